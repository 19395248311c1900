//! Particles to gather from, and the distance up to which each is seen.

use super::tree::{Node, Tree};
use crate::pack::EIGHT;

/// Whose support radius decides which pairs are gathered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// Sources within the target's radius.
    Target,
    /// Sources within the larger radius of the two.
    Either,
    /// Sources whose own radius reaches the target.
    Source,
}

/// Particles to gather from, with `C` values each, in tree order.
pub struct Sources<'a, const D: usize, const C: usize> {
    pub(super) tree: &'a Tree<D>,
    pub(super) channels: [&'a [f64]; C],
    pub(super) reach: Reach,
    /// Largest support radius below each node, and the radii; empty for [`Reach::Target`].
    node_reach: Vec<f64>,
    pub(super) support: &'a [f64],
    /// The first `D` channels are a vector, whose components change sign in mirror images.
    pub(super) vector: bool,
    /// Targets only: nothing is gathered from here.
    silent: bool,
}

impl<'a, const D: usize, const C: usize> Sources<'a, D, C> {
    /// `support` and `channels` are in tree order.
    pub fn new(tree: &'a Tree<D>, support: &'a [f64], channels: [&'a [f64]; C], reach: Reach) -> Self {
        let node_reach = match reach {
            Reach::Target => Vec::new(),
            Reach::Either | Reach::Source => tree.node_maxima(support),
        };
        Self { tree, channels, reach, node_reach, support, vector: false, silent: false }
    }

    /// Declares the first `D` channels the components of a vector.
    pub fn with_vector(mut self) -> Self {
        self.vector = true;
        self
    }

    /// Declares these particles targets that no target sees.
    pub fn silent(mut self) -> Self {
        self.silent = true;
        self
    }

    /// How far a node's particles can be from a target: `own` is the target leaf's reach.
    #[inline(always)]
    pub(super) fn reach_of(&self, node: usize, own: f64) -> f64 {
        match self.reach {
            Reach::Target => own,
            Reach::Either | Reach::Source => self.node_reach[node].max(self.targets_reach(own)),
        }
    }

    /// How far targets see particles that do not reach as far themselves.
    #[inline(always)]
    pub(super) fn targets_reach(&self, own: f64) -> f64 {
        match self.reach {
            Reach::Target | Reach::Either => own,
            Reach::Source => 0.0,
        }
    }

    /// Whether there is anything to be gathered.
    pub(super) fn is_seen(&self) -> bool {
        !self.silent && !self.tree.is_empty()
    }

    pub(super) fn nodes(&self) -> &'a [Node<D>] {
        &self.tree.nodes
    }

    /// Positions and channels, of at least eight particles: those of fewer are copied to `few`, with zeros behind them.
    pub(super) fn whole<'f>(
        &self,
        few: &'f mut ([[f64; EIGHT]; D], [[f64; EIGHT]; C]),
    ) -> ([&'f [f64]; D], [&'f [f64]; C])
    where
        'a: 'f,
    {
        let (n, tree) = (self.tree.len(), self.tree);
        if n >= EIGHT {
            return (std::array::from_fn(|k| tree.positions[k].as_slice()), self.channels);
        }
        (0..D).for_each(|k| few.0[k][..n].copy_from_slice(&tree.positions[k]));
        (0..C).for_each(|c| few.1[c][..n].copy_from_slice(&self.channels[c][..n]));
        (few.0.each_ref().map(|x| x.as_slice()), few.1.each_ref().map(|x| x.as_slice()))
    }
}
