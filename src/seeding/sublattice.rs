//! Lattices of exactly N points in a periodic box, for any N: every particle has the same surroundings, so that densities are equal,
//! and forces vanish by inversion.
//!
//! The lattice lies askew in the box as [`super::sublattice_search`] finds it. Its points are the cosets of the box's edges: one for
//! each (i, j, k) below the diagonal of the Hermite normal form, at fractions of the edges that are whole multiples of 1/N,
//! which integers give without rounding. O(N); the search takes some tens of milliseconds, whatever N.

use super::integers::{gcd, hermite_diagonal};
use super::sublattice_search::{Basis, Fitted, PointGroup, fit_in_plane, fit_in_space};
use sph::parallel;

/// Lattices that a periodic box can hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Bravais {
    /// Simple cubic; square.
    Cubic,
    /// Face-centered cubic; hexagonal in the plane.
    FaceCentered,
    /// Body-centered cubic; hexagonal in the plane.
    BodyCentered,
    /// Hexagonal close packing, of two points per cell; hexagonal in the plane.
    ClosePackedLayers,
}

/// A lattice of N points that fills a box.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sublattice<const D: usize> {
    /// Rows of the adjugate of the matrix of edges: a point with the multiples m of the basis lies at `rows . m / cells`
    /// of the edges.
    rows: [[i64; D]; D],
    cells: i64,
    diagonal: [i64; D],
    /// Places of the points of a cell, in its basis.
    motif: Vec<[f64; D]>,
    /// Largest |ln| of the factors by which the ideal lattice is stretched.
    pub strain: f64,
}

/// A box thinner than this, in spacings, has one layer of points.
const ONE_LAYER: f64 = 0.5;

impl Bravais {
    fn points_per_cell(self, d: usize) -> usize {
        if self == Self::ClosePackedLayers && d == 3 { 2 } else { 1 }
    }

    /// Cells of volume 1.
    fn basis(self) -> Basis {
        let (vectors, symmetry) = match self {
            Self::Cubic => ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], PointGroup::Cubic),
            Self::FaceCentered => ([[0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [0.5, 0.5, 0.0]], PointGroup::Cubic),
            Self::BodyCentered => ([[-0.5, 0.5, 0.5], [0.5, -0.5, 0.5], [0.5, 0.5, -0.5]], PointGroup::Cubic),
            Self::ClosePackedLayers => {
                let vectors = [[1.0, 0.0, 0.0], [-0.5, 0.75_f64.sqrt(), 0.0], [0.0, 0.0, (8.0 / 3.0_f64).sqrt()]];
                (vectors, PointGroup::Hexagonal)
            }
        };
        let volume: f64 = match self {
            Self::Cubic => 1.0,
            Self::FaceCentered => 0.25,
            Self::BodyCentered => 0.5,
            Self::ClosePackedLayers => 2.0_f64.sqrt(),
        };
        Basis { vectors: vectors.map(|v| v.map(|x| x / volume.cbrt())), symmetry }
    }

    /// Cells of area 1.
    fn basis_in_plane(self) -> [[f64; 2]; 2] {
        if self == Self::Cubic {
            return [[1.0, 0.0], [0.0, 1.0]];
        }
        let side = (4.0_f64 / 3.0).powf(0.25);
        [[side, 0.0], [0.5 * side, 0.75_f64.sqrt() * side]]
    }

    /// The lattice of exactly `count` points that fits a box of these edges best. Close packing in layers ABAB needs an even
    /// number.
    pub fn fit<const D: usize>(self, extent: &[f64; D], count: usize) -> Option<Sublattice<D>> {
        let mut per_cell = self.points_per_cell(D);
        if count == 0 || !count.is_multiple_of(per_cell) {
            return None;
        }
        let cells = (count / per_cell) as i64;
        let longest = extent.iter().fold(0.0, |a, &b| f64::max(a, b));
        let relative = extent.map(|e| e / longest);
        let spacing = (relative.iter().product::<f64>() / cells as f64).powf(1.0 / D as f64);
        let edges = relative.map(|e| e / spacing);
        let wide: Vec<usize> = (0..D).filter(|&k| edges[k] >= ONE_LAYER).collect();
        let Fitted { edges, strain } = match wide[..] {
            [i, j, k] => spread(&[i, j, k], fit_in_space(&self.basis(), &[edges[i], edges[j], edges[k]], cells)),
            [i, j] => {
                per_cell = 1;
                let (cells, scale) = (count as i64, (count as f64 / (edges[i] * edges[j])).sqrt());
                let edges = [edges[i] * scale, edges[j] * scale];
                spread(&[i, j], fit_in_plane(&self.basis_in_plane(), &edges, cells))
            }
            _ => {
                per_cell = 1;
                let along = (0..D).fold(0, |best, k| if edges[k] > edges[best] { k } else { best });
                spread(&[along], Fitted { edges: [[count as i64]], strain: 0.0 })
            }
        };
        let motif = match per_cell {
            // Where the layers B lie between layers A.
            2 => vec![[0.0; D], sph::array(|k| [1.0 / 3.0, 2.0 / 3.0, 0.5][k])],
            _ => vec![[0.0; D]],
        };
        Some(Sublattice::new(&edges, strain, motif))
    }
}

/// A lattice of fewer dimensions along some axes, repeated along the others with one layer per edge.
fn spread<const D: usize, const P: usize>(axes: &[usize; P], fitted: Fitted<P>) -> Fitted<D> {
    let mut edges = [[0; D]; D];
    for k in 0..D {
        edges[k][k] = 1;
    }
    for (edge, &k) in fitted.edges.iter().zip(axes) {
        edges[k] = [0; D];
        for (&m, &axis) in edge.iter().zip(axes) {
            edges[k][axis] = m;
        }
    }
    Fitted { edges, strain: fitted.strain }
}

impl<const D: usize> Sublattice<D> {
    fn new(edges: &[[i64; D]; D], strain: f64, motif: Vec<[f64; D]>) -> Self {
        let (rows, determinant) = adjugate(edges);
        let rows = rows.map(|row| row.map(|v| v * determinant.signum()));
        Self { rows, cells: determinant.abs(), diagonal: hermite_diagonal(*edges), motif, strain }
    }

    /// The points, as fractions of the edges in [0, 1).
    pub fn fractions(&self) -> Vec<[f64; D]> {
        let (n, per_cell) = (self.cells, self.motif.len());
        // Half of the step between planes across each axis: no plane lies on a face.
        let half: [f64; D] = sph::array(|k| 0.5 * self.rows[k].iter().fold(n, |g, &v| gcd(g, v)) as f64);
        parallel::map(n as usize * per_cell, |i| {
            let mut rest = (i / per_cell) as i64;
            let m: [i64; D] = sph::array(|k| {
                let index = rest % self.diagonal[k];
                rest /= self.diagonal[k];
                index
            });
            let offset = &self.motif[i % per_cell];
            sph::array(|k| {
                let row = &self.rows[k];
                let whole = (0..D).map(|j| i128::from(row[j]) * i128::from(m[j])).sum::<i128>();
                let shift: f64 = (0..D).map(|j| row[j] as f64 * offset[j]).sum::<f64>() + half[k];
                let place = (whole.rem_euclid(i128::from(n)) as f64 + shift) / n as f64;
                (place - place.floor()).min(1.0 - f64::EPSILON)
            })
        })
    }
}

/// The adjugate, whose product with the matrix of these columns is its determinant, which comes second.
fn adjugate<const D: usize>(columns: &[[i64; D]; D]) -> ([[i64; D]; D], i64) {
    let at = |row: usize, column: usize| columns[column % D][row % D];
    let rows: [[i64; D]; D] = match D {
        1 => [[1; D]; D],
        2 => std::array::from_fn(|i| std::array::from_fn(|j| if i == j { at(i + 1, j + 1) } else { -at(i, j) })),
        _ => std::array::from_fn(|i| {
            sph::array(|j| at(j + 1, i + 1) * at(j + 2, i + 2) - at(j + 1, i + 2) * at(j + 2, i + 1))
        }),
    };
    let determinant = (0..D).map(|j| rows[0][j] * columns[0][j]).sum();
    (rows, determinant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    const ALL: [Bravais; 4] =
        [Bravais::Cubic, Bravais::FaceCentered, Bravais::BodyCentered, Bravais::ClosePackedLayers];

    #[test]
    fn adjugates_times_their_matrix_are_the_determinant() {
        let columns = [[3, -1, 4], [1, 5, -9], [2, 6, 5]];
        let (rows, determinant) = adjugate(&columns);
        for i in 0..3 {
            for j in 0..3 {
                let product: i64 = (0..3).map(|k| rows[i][k] * columns[j][k]).sum();
                assert_eq!(product, if i == j { determinant } else { 0 });
            }
        }
        assert_eq!(adjugate(&[[2, 7], [1, 3]]), ([[3, -1], [-7, 2]], -1));
    }

    /// Exactly N points, none twice.
    fn check<const D: usize>(kind: Bravais, extent: [f64; D], count: usize) -> f64 {
        let Some(lattice) = kind.fit(&extent, count) else {
            assert!(kind.points_per_cell(D) == 2 && count % 2 == 1, "{kind:?} {count}");
            return 0.0;
        };
        let mut points = lattice.fractions();
        assert_eq!(points.len(), count, "{kind:?} {extent:?}");
        assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)), "{kind:?} {extent:?} {count}");
        let near = |a: &[f64; D], b: &[f64; D]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        points.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert!(points.windows(2).all(|w| !near(&w[0], &w[1])), "{kind:?} {extent:?} {count}");
        lattice.strain
    }

    #[test]
    fn every_box_holds_exactly_any_number_of_points() {
        for kind in ALL {
            for count in (1..=60).chain([97, 128, 200, 997, 1000, 4099]) {
                for extent in [[1.0, 1.0, 1.0], [1.0, 3.0, 0.2], [1.0, 0.37, 0.61], [1.0, 1.0, 1e-3], [1e6, 1.0, 1.0]] {
                    assert!(check(kind, extent, count).is_finite());
                }
                for extent in [[1.0, 1.0], [1.0, 7.3], [1e-5, 1.0]] {
                    assert!(check(kind, extent, count).is_finite());
                }
                check(kind, [2.5], count);
            }
        }
    }

    #[test]
    fn counts_that_a_lattice_has_are_met_without_strain() {
        assert!(check(Bravais::Cubic, [1.0; 3], 1000) < 1e-12);
        assert!(check(Bravais::FaceCentered, [1.0; 3], 4 * 512) < 1e-12);
        assert!(check(Bravais::BodyCentered, [1.0, 2.0, 1.0], 2 * 2 * 343) < 1e-12);
        assert!(check(Bravais::ClosePackedLayers, [1.0, 3.0_f64.sqrt(), (8.0 / 3.0_f64).sqrt()], 4 * 216) < 1e-12);
        assert!(check(Bravais::FaceCentered, [1.0, 3.0_f64.sqrt()], 2 * 100) < 1e-12);
    }

    /// Bounds are those of the numbers of solutions, N^2 strain^5 and N strain^2, with the factors that these lattices have.
    #[test]
    fn strain_falls_with_the_number_of_points() {
        for kind in ALL {
            for (count, most) in [(1000, 0.08), (10_000, 0.03), (99_991, 0.015), (100_000, 0.012), (1_000_003, 0.0075)]
            {
                let strain = check(kind, [1.0; 3], count);
                assert!(strain < most, "{kind:?} {count}: {strain}");
            }
            for (count, most) in [(100, 0.2), (997, 0.06), (10_007, 0.02), (100_003, 0.008)] {
                let strain = check(kind, [1.0, 1.0], count);
                assert!(strain < most, "{kind:?} {count}: {strain}");
            }
        }
    }

    #[test]
    fn scale_changes_nothing() {
        for count in [17, 998] {
            let unit = Bravais::FaceCentered.fit(&[1.0, 3.0, 0.2], count).unwrap();
            for scale in [2.0_f64.powi(60), 2.0_f64.powi(-90)] {
                assert_eq!(Bravais::FaceCentered.fit(&[scale, 3.0 * scale, 0.2 * scale], count), Some(unit.clone()));
            }
        }
    }

    /// `cargo test --release --lib sublattice -- --ignored --nocapture`
    #[test]
    #[ignore = "prints strain and time of the search"]
    fn print_strain_and_time() {
        println!("lattice | box | N | strain | ms");
        for kind in ALL {
            for extent in [[1.0, 1.0, 1.0], [1.0, 3.0, 0.2], [1.0, 1.0, 0.05]] {
                for count in [17, 100, 1000, 10_007, 99_991, 100_000, 1_000_003, 10_000_019, 1_000_000_007] {
                    let count = count + count % kind.points_per_cell(3);
                    let start = Instant::now();
                    let lattice = kind.fit(&extent, count).unwrap();
                    let ms = 1e3 * start.elapsed().as_secs_f64();
                    println!("{kind:?} | {extent:?} | {count} | {:.2e} | {ms:.1}", lattice.strain);
                }
            }
            for count in [17, 1000, 99_991, 10_000_019] {
                let start = Instant::now();
                let strain = kind.fit(&[1.0, 1.0], count).unwrap().strain;
                println!("{kind:?} | plane | {count} | {strain:.2e} | {:.1}", 1e3 * start.elapsed().as_secs_f64());
            }
        }
    }
}
