//! Ghosts in the order of a separate tree, from which they can be gathered.

use super::tree::Tree;
use crate::domain::{Domain, Ghosts};
use crate::geometry::Positions;

/// Mirror images in a curved surface, in tree order.
#[derive(Debug, Clone)]
pub struct GhostTree<const D: usize> {
    pub tree: Tree<D>,
    /// The particle that each one mirrors.
    pub parents: Vec<u32>,
    /// Volume of each over that of its parent.
    pub stretch: Vec<f64>,
}

impl<const D: usize> GhostTree<D> {
    /// The images of all particles within `reach` of the surface; `None` where there are none.
    pub fn mirror(domain: &Domain<D>, positions: &Positions<D>, reach: impl Fn(usize) -> f64 + Sync) -> Option<Self> {
        let ghosts = Ghosts::mirror(domain, positions, reach);
        if ghosts.positions.is_empty() {
            return None;
        }
        let tree = Tree::build(&ghosts.soa());
        Some(Self { parents: tree.to_tree_order(&ghosts.parents), stretch: tree.to_tree_order(&ghosts.stretch), tree })
    }

    /// Values of the parents, times a power of the ratio of volumes: 0 for what a ghost has as its parent does, 1/d for
    /// lengths, 1 for volumes and masses.
    pub fn inherit(&self, values: &[f64], power: f64) -> Vec<f64> {
        self.parents.iter().zip(&self.stretch).map(|(&p, s)| values[p as usize] * s.powf(power)).collect()
    }
}
