//! Unstructured meshes of linear cells: cell location by a box tree, isoparametric interpolation.
//!
//! Node values are exact for linear fields in every cell; cell values are constant per cell. The mass is the
//! sum of Gauss's rule per cell, exact for either. Cells of a lower dimension than the mesh (edges of a
//! surface, skin of a volume) and cells without volume are left aside.

use super::MassEstimate;
use super::bvh::{Aabb, Bvh};
use super::check::magnitude;
use super::quadrature::Sum;
use super::sampled::{Outside, Sampler};
use super::shapes::{CellKind, Weights, is_skewed, jacobian, locate, locate_nearest, simplex_integrals};
use super::skin::Skin;
use crate::error::{Error, Result};
use rayon::prelude::*;
use sph::domain::{Domain, Region};
use sph_formats::{Cells, Location, Values};
use std::sync::Arc;

const CHUNK: usize = 4096;

#[derive(Debug)]
pub(crate) struct Mesh<const D: usize> {
    pub(crate) points: Vec<[f64; D]>,
    cells: Cells,
    kinds: Vec<CellKind>,
    skewed: Vec<bool>,
    tree: Bvh<D>,
    pub(crate) skin: Skin<D>,
    pub(crate) bounds: Aabb<D>,
    pub(crate) volume: f64,
}

impl<const D: usize> Mesh<D> {
    /// `notes` receives what was left aside.
    ///
    /// # Errors
    /// Cells that refer to points which are not there, of unsupported types, or none of dimension D with a
    /// volume.
    pub(crate) fn new(name: &str, points: Vec<[f64; D]>, cells: Cells, notes: &mut Vec<String>) -> Result<Self> {
        let kinds = check_cells(name, points.len(), &cells)?;
        if cells.types.len() >= u32::MAX as usize {
            return Err(Error::field(
                name,
                format!("the mesh has {} cells; at most 2^32 - 2 are supported", cells.types.len()),
            ));
        }
        let bounds = Aabb::around(&points);
        let mut mesh = Self {
            skewed: vec![false; kinds.len()],
            points,
            cells,
            kinds,
            tree: Bvh::new(vec![], &|_| Aabb::EMPTY),
            skin: Skin::empty(),
            bounds,
            volume: 0.0,
        };
        let (mut flat, mut lower) = (0_usize, 0_usize);
        let mut live = Vec::new();
        let mut volume = Sum::default();
        let sizes: Vec<Option<(bool, f64)>> = (0..mesh.kinds.len()).into_par_iter().map(|c| mesh.measure(c)).collect();
        for (c, size) in sizes.into_iter().enumerate() {
            match size {
                None => lower += 1,
                Some((skewed, v)) if v > 0.0 => {
                    mesh.skewed[c] = skewed;
                    volume.add(v);
                    live.push(c as u32);
                }
                Some(_) => flat += 1,
            }
        }
        if live.is_empty() {
            return Err(Error::field(
                name,
                format!("none of the mesh's {} cells is {D}-dimensional with a volume above zero", mesh.kinds.len()),
            ));
        }
        let skewed = mesh.skewed.iter().filter(|&&s| s).count();
        for (count, text) in [
            (lower, "have fewer dimensions than the mesh and were left aside"),
            (flat, "have no volume and were left aside"),
            (skewed, "are inside out in part; they are divided into simplices"),
        ] {
            if count > 0 {
                notes.push(format!("{count} of the mesh's {} cells {text}", mesh.kinds.len()));
            }
        }
        mesh.volume = volume.value();
        mesh.skin = Skin::of(&mesh.points, live.iter().map(|&c| (c, mesh.kinds[c as usize], mesh.nodes(c as usize))));
        mesh.tree = Bvh::new(live, &|c| mesh.with_corners(c as usize, cell_box));
        let skin = std::mem::replace(&mut mesh.skin, Skin::empty());
        mesh.skin = skin.without_inner(&|x| mesh.locate(x).is_some());
        Ok(mesh)
    }

    pub(crate) fn nodes(&self, cell: usize) -> &[usize] {
        &self.cells.connectivity[self.cells.offsets[cell]..self.cells.offsets[cell + 1]]
    }

    fn with_corners<T>(&self, cell: usize, f: impl FnOnce(&[[f64; D]]) -> T) -> T {
        let mut corners = [[0.0; D]; 8];
        let nodes = self.nodes(cell);
        for (c, &i) in corners.iter_mut().zip(nodes) {
            *c = self.points[i];
        }
        f(&corners[..nodes.len()])
    }

    /// Whether the cell is skewed, and its volume; `None` below dimension D.
    fn measure(&self, cell: usize) -> Option<(bool, f64)> {
        let kind = self.kinds[cell];
        if kind.dimension() != D {
            return None;
        }
        let skewed = self.with_corners(cell, |c| is_skewed(kind, c));
        self.skewed_integrals(cell, skewed).map(|w| (skewed, w.iter().sum()))
    }

    /// Integral of each node's shape function over the cell.
    fn skewed_integrals(&self, cell: usize, skewed: bool) -> Option<Weights> {
        let kind = self.kinds[cell];
        self.with_corners(cell, |corners| {
            if skewed {
                return Some(simplex_integrals(kind, corners));
            }
            let mut total = [0.0; 8];
            for (u, weight) in kind.quadrature() {
                let element = weight * jacobian(kind, corners, u);
                let (n, _) = kind.shape(u);
                (0..kind.nodes()).for_each(|i| total[i] += element * n[i]);
            }
            // A cell listed in mirrored order has a negative Jacobian throughout.
            let sign = total.iter().sum::<f64>().signum();
            Some(total.map(|v| v * sign))
        })
    }

    /// The cell around `x` and its nodes' weights there.
    pub(crate) fn locate(&self, x: &[f64; D]) -> Option<(usize, Weights)> {
        self.tree.find(x, |c| {
            let cell = c as usize;
            self.with_corners(cell, |corners| {
                // A leaf of the tree holds several cells; most are ruled out by their own box.
                if !cell_box(corners).contains(x) {
                    return None;
                }
                locate(self.kinds[cell], corners, self.skewed[cell], x)
            })
            .map(|w| (cell, w))
        })
    }

    /// The same at the nearest point of the hull.
    fn locate_nearest(&self, x: &[f64; D]) -> Option<(usize, Weights)> {
        let (p, cell) = self.skin.nearest(x)?;
        let cell = cell as usize;
        let w = self.with_corners(cell, |corners| locate_nearest(self.kinds[cell], corners, self.skewed[cell], &p));
        Some((cell, w))
    }
}

/// Bounds of a cell, grown by the tolerance of inside tests.
fn cell_box<const D: usize>(corners: &[[f64; D]]) -> Aabb<D> {
    let b = Aabb::around(corners);
    b.grown(1e-9 * b.diagonal())
}

fn check_cells(name: &str, points: usize, cells: &Cells) -> Result<Vec<CellKind>> {
    let bad = |problem: String| Err(Error::field(name, format!("the mesh is damaged: {problem}")));
    if cells.offsets.len() != cells.types.len() + 1 {
        return bad(format!(
            "{} cells have {} offsets, expected one more than cells",
            cells.types.len(),
            cells.offsets.len()
        ));
    }
    let mut kinds = Vec::with_capacity(cells.types.len());
    for (c, &number) in cells.types.iter().enumerate() {
        let Some(kind) = CellKind::from_vtk(number) else {
            return Err(Error::field(
                name,
                format!(
                    "cell {c} is of VTK type {number}; lines, triangles, quads, tetrahedra, hexahedra, wedges and \
                     pyramids are supported: convert the mesh to linear cells"
                ),
            ));
        };
        let nodes = cells.connectivity.get(cells.offsets[c]..cells.offsets[c + 1]);
        match nodes {
            Some(nodes) if nodes.len() == kind.nodes() => {
                if let Some(i) = nodes.iter().find(|&&i| i >= points) {
                    return bad(format!("cell {c} refers to point {i}, but there are {points}"));
                }
            }
            Some(nodes) => {
                return bad(format!(
                    "cell {c} has {} nodes, expected {} for VTK type {number}",
                    nodes.len(),
                    kind.nodes()
                ));
            }
            None => {
                return bad(format!("the nodes of cell {c} lie outside the list of {}", cells.connectivity.len()));
            }
        }
        kinds.push(kind);
    }
    Ok(kinds)
}

/// Values on the nodes or cells of a mesh.
pub(crate) struct MeshSampler<const D: usize> {
    pub(crate) mesh: Arc<Mesh<D>>,
    pub(crate) location: Location,
}

impl<const D: usize> Sampler<D> for MeshSampler<D> {
    fn sample(&self, values: &Values, stride: usize, x: &[f64; D], outside: Outside, out: &mut [f64]) -> bool {
        let found = self.mesh.locate(x).or_else(|| match outside {
            Outside::Reject => None,
            Outside::Clamp => self.mesh.locate_nearest(x),
        });
        let Some((cell, w)) = found else { return false };
        for (c, v) in out.iter_mut().enumerate() {
            *v = match self.location {
                Location::Cell => values.get(cell * stride + c),
                Location::Node => {
                    self.mesh.nodes(cell).iter().zip(&w).map(|(&i, w)| w * values.get(i * stride + c)).sum()
                }
            };
        }
        true
    }

    fn integral(&self, values: &Values, domain: &Domain<D>) -> Option<MassEstimate> {
        let Region::Hull(hull, _) = &domain.region else {
            return None;
        };
        let mesh = &self.mesh;
        let own = (hull.volume() / mesh.volume - 1.0).abs() < 1e-9
            && (0..D).all(|k| {
                let slack = 1e-9 * (mesh.bounds.hi[k] - mesh.bounds.lo[k]);
                (domain.lo[k] - mesh.bounds.lo[k]).abs() <= slack && (domain.hi[k] - mesh.bounds.hi[k]).abs() <= slack
            });
        if !own {
            return None;
        }
        let unit = magnitude(values);
        let cells = mesh.kinds.len();
        let partial: Vec<f64> = (0..cells.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut sum = Sum::default();
                for cell in chunk * CHUNK..cells.min((chunk + 1) * CHUNK) {
                    if mesh.kinds[cell].dimension() != D {
                        continue;
                    }
                    let Some(w) = mesh.skewed_integrals(cell, mesh.skewed[cell]) else {
                        continue;
                    };
                    sum.add(match self.location {
                        Location::Cell => values.get(cell) / unit * w.iter().sum::<f64>(),
                        Location::Node => {
                            mesh.nodes(cell).iter().zip(&w).map(|(&i, w)| w * (values.get(i) / unit)).sum()
                        }
                    });
                }
                sum.value()
            })
            .collect();
        let total: Sum = partial.iter().copied().collect();
        let size: Sum = partial.iter().map(|v| v.abs()).collect();
        Some(MassEstimate { value: total.value() * unit, error: 64.0 * f64::EPSILON * size.value() * unit })
    }
}
