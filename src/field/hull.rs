//! The region that a mesh fills: its cells decide whether a point is inside, and the skin of the mesh is its surface.

use super::mesh::Mesh;
use sph::domain::Hull;
use std::sync::Arc;

/// The region that a mesh fills.
#[derive(Debug)]
pub struct MeshHull<const D: usize> {
    pub(crate) mesh: Arc<Mesh<D>>,
}

impl<const D: usize> Hull<D> for MeshHull<D> {
    fn contains(&self, x: &[f64; D]) -> bool {
        self.mesh.locate(x).is_some()
    }

    fn nearest_on_surface(&self, x: &[f64; D]) -> [f64; D] {
        self.mesh.skin.nearest(x).map_or(*x, |n| n.0)
    }

    fn volume(&self) -> f64 {
        self.mesh.volume
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::CellKind;
    use super::super::testing::Random;
    use super::*;
    use sph_formats::Cells;

    fn push(cells: &mut Cells, kind: u8, nodes: &[usize]) {
        if cells.offsets.is_empty() {
            cells.offsets.push(0);
        }
        cells.types.push(kind);
        cells.connectivity.extend_from_slice(nodes);
        cells.offsets.push(cells.connectivity.len());
    }

    /// The unit cube in n^3 blocks, each of them one hexahedron, two wedges, six pyramids or six tetrahedra.
    pub(crate) fn cube(n: usize, wiggle: f64) -> (Vec<[f64; 3]>, Cells) {
        let mut random = Random::new(5);
        let mut points = Vec::new();
        for k in 0..=n {
            for j in 0..=n {
                for i in 0..=n {
                    points.push([i, j, k].map(|i| {
                        let inner = i > 0 && i < n;
                        (i as f64 + if inner { wiggle * (random.unit() - 0.5) } else { 0.0 }) / n as f64
                    }));
                }
            }
        }
        let at = |i: usize, j: usize, k: usize| i + (n + 1) * (j + (n + 1) * k);
        let mut cells = Cells::default();
        for k in 0..n {
            for j in 0..n {
                for i in 0..n {
                    let h = [
                        at(i, j, k),
                        at(i + 1, j, k),
                        at(i + 1, j + 1, k),
                        at(i, j + 1, k),
                        at(i, j, k + 1),
                        at(i + 1, j, k + 1),
                        at(i + 1, j + 1, k + 1),
                        at(i, j + 1, k + 1),
                    ];
                    match k % 2 {
                        _ if wiggle == 0.0 && i % 2 == 0 => {
                            push(&mut cells, 13, &[h[0], h[1], h[3], h[4], h[5], h[7]]);
                            push(&mut cells, 13, &[h[1], h[2], h[3], h[5], h[6], h[7]]);
                        }
                        0 => push(&mut cells, 12, &h),
                        _ => {
                            let hub = points.len();
                            points.push(sph::array(|a| h.iter().map(|&p| points[p][a]).sum::<f64>() / 8.0));
                            for face in CellKind::Hexahedron.faces() {
                                let f: Vec<usize> = face.iter().map(|&l| h[l]).chain([hub]).collect();
                                push(&mut cells, 14, &f);
                            }
                        }
                    }
                }
            }
        }
        (points, cells)
    }

    fn mesh(n: usize, wiggle: f64) -> (Mesh<3>, Vec<String>) {
        let (points, cells) = cube(n, wiggle);
        let mut notes = Vec::new();
        (Mesh::new("rho", points, cells, &mut notes).unwrap(), notes)
    }

    #[test]
    fn a_cube_of_mixed_cells_is_filled_without_gaps() {
        for wiggle in [0.0, 0.4] {
            let (mesh, notes) = mesh(4, wiggle);
            assert!(notes.is_empty(), "{notes:?}");
            assert!((mesh.volume - 1.0).abs() < 1e-13, "{}", mesh.volume);
            let f = |x: &[f64; 3]| 1.0 + 2.0 * x[0] + 3.0 * x[1] - x[2];
            let mut random = Random::new(1);
            for i in 0..3000 {
                let mut x: [f64; 3] = random.point();
                if i % 3 == 0 {
                    x[i % 9 / 3] = 0.25 * (i % 5) as f64;
                }
                let (cell, w) = mesh.locate(&x).unwrap_or_else(|| panic!("{x:?}"));
                let nodes = mesh.nodes(cell);
                let value: f64 = nodes.iter().zip(&w).map(|(&i, w)| w * f(&mesh.points[i])).sum();
                assert!((value - f(&x)).abs() < 1e-8, "{x:?}");
            }
        }
    }

    #[test]
    fn the_hull_of_a_cube_is_its_surface() {
        let (mesh, _) = mesh(4, 0.0);
        assert_eq!(mesh.skin.len(), 6 * 16 * 2);
        let hull = MeshHull { mesh: Arc::new(mesh) };
        let p = hull.nearest_on_surface(&[0.5, 0.6, 0.9]);
        assert!((p[2] - 1.0).abs() < 1e-14 && (p[1] - 0.6).abs() < 1e-14);
        let p = hull.nearest_on_surface(&[1.5, 1.5, 0.3]);
        assert!((p[0] - 1.0).abs() < 1e-14 && (p[1] - 1.0).abs() < 1e-14 && (p[2] - 0.3).abs() < 1e-14);
        assert!(hull.contains(&[1.0, 1.0, 1.0]) && !hull.contains(&[1.0, 1.0, 1.0001]));
        assert!((hull.volume() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn cells_with_points_of_their_own_share_faces() {
        let mut points = Vec::new();
        let mut cells = Cells::default();
        for i in 0..2 {
            let x = i as f64;
            let first = points.len();
            points.extend([[x, -0.0], [x + 1.0, 0.0], [x + 1.0, 1.0], [x, 1.0]]);
            push(&mut cells, 9, &[first, first + 1, first + 2, first + 3]);
        }
        let mesh = Mesh::new("rho", points, cells, &mut vec![]).unwrap();
        assert_eq!(mesh.skin.len(), 6);
        assert_eq!(mesh.skin.nearest(&[0.9, 0.4]).unwrap().0, [0.9, 0.0]);
    }

    #[test]
    fn faces_divided_differently_are_no_hull() {
        // A quad beside two smaller ones.
        let points =
            vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [2.0, 0.0], [2.0, 0.5], [1.0, 0.5], [2.0, 1.0]];
        let mut cells = Cells::default();
        push(&mut cells, 9, &[0, 1, 2, 3]);
        push(&mut cells, 9, &[1, 4, 5, 6]);
        push(&mut cells, 9, &[6, 5, 7, 2]);
        let mesh = Mesh::new("rho", points, cells, &mut vec![]).unwrap();
        assert_eq!(mesh.skin.len(), 7);
        assert_eq!(mesh.skin.nearest(&[1.01, 0.6]).unwrap().0, [1.01, 1.0]);
    }

    #[test]
    fn odd_cells_are_noted_or_refused() {
        let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mut cells = Cells::default();
        push(&mut cells, 9, &[0, 1, 2, 3]);
        push(&mut cells, 3, &[0, 1]);
        push(&mut cells, 5, &[0, 0, 1]);
        // A mirrored listing is as good as the other.
        push(&mut cells, 9, &[3, 2, 1, 0]);
        let mut notes = vec![];
        let mesh = Mesh::new("rho", points.clone(), cells, &mut notes).unwrap();
        assert_eq!(notes.len(), 2, "{notes:?}");
        assert!((mesh.volume - 2.0).abs() < 1e-15);
        let refuse = |kind: u8, nodes: &[usize]| {
            let mut cells = Cells::default();
            push(&mut cells, kind, nodes);
            Mesh::new("rho", points.clone(), cells, &mut vec![]).unwrap_err().to_string()
        };
        assert!(refuse(22, &[0, 1, 2]).contains("VTK type 22"));
        assert!(refuse(5, &[0, 1, 9]).contains("point 9"));
        assert!(refuse(5, &[0, 1]).contains("2 nodes, expected 3"));
        assert!(refuse(3, &[0, 1]).contains("none of the mesh's 1 cells"));
    }
}
