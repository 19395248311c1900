//! Determines which particles are within reach of others.

use super::tree::Tree;
use crate::domain::Domain;
use crate::parallel;

/// Particles that see as far as their support radii.
pub struct Seeing<const D: usize> {
    tree: Tree<D>,
    /// In tree order, with the largest below each node.
    support: Vec<f64>,
    maxima: Vec<f64>,
}

impl<const D: usize> Seeing<D> {
    /// A positive `support` for each.
    pub fn new(positions: &[Vec<f64>; D], support: &[f64]) -> Self {
        let tree = Tree::build(positions);
        let support = tree.to_tree_order(support);
        let maxima = tree.node_maxima(&support);
        Self { tree, support, maxima }
    }

    /// Which of the `others` any of the particles sees, or is seen by within their `own` radii, if given. O(log N) for each of them.
    pub fn reach(&self, domain: &Domain<D>, others: &[Vec<f64>; D], own: &[f64]) -> Vec<bool> {
        let far = |i: usize| own.get(i).copied().unwrap_or(0.0);
        parallel::map(others[0].len(), |i| self.reaches(domain, &crate::array(|k| others[k][i]), far(i)))
    }

    fn reaches(&self, domain: &Domain<D>, x: &[f64; D], own: f64) -> bool {
        let nodes = &self.tree.nodes;
        let within = |lo: &[f64; D], hi: &[f64; D], reach: f64| {
            domain.squared_distance_of_boxes([lo, hi], [x, x]) <= reach.max(own).powi(2)
        };
        let mut at = 0;
        while at < nodes.len() {
            let node = &nodes[at];
            let skip = node.skip as usize;
            if !within(&node.lo, &node.hi, self.maxima[at]) {
                at = skip;
                continue;
            }
            let sees = |i: usize| {
                let y = self.tree.position(i);
                within(&y, &y, self.support[i])
            };
            if skip == at + 1 && node.places().any(sees) {
                return true;
            }
            at += 1;
        }
        false
    }
}
