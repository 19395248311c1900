//! Divides space by planes into blocks, each with its share of the target's mass on either side, as mass bisection divides particles.

use super::bisection::least_cells;
use crate::error::Result;
use crate::target::Target;
use crate::target::cells::Cell;
use crate::target::cut::{Cut, cut};
use crate::target::partition::partition;
use crate::target::refinement::refine;

/// Which block each place is in. Any place of the domain is in one.
#[derive(Debug, Clone, PartialEq)]
pub struct Parting<const D: usize> {
    nodes: Vec<Node>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Node {
    Block(usize),
    /// What is below the plane is in the next node, what is not in the one that is named.
    Plane {
        axis: usize,
        at: f64,
        beyond: usize,
    },
}

impl<const D: usize> Parting<D> {
    /// Parts the target into blocks of about equal mass. O(blocks).
    ///
    /// # Errors
    /// A target without mass in its domain.
    pub fn new(target: &Target<'_, D>, blocks: usize) -> Result<Self> {
        Self::by(target, blocks, |_| least_cells(usize::MAX, target.cell_rule()))
    }

    /// The same with many blocks, for which their masses need not be known so well.
    ///
    /// # Errors
    /// A target without mass in its domain.
    pub fn coarse(target: &Target<'_, D>, blocks: usize) -> Result<Self> {
        Self::by(target, blocks, |blocks| least_cells(blocks, target.cell_rule()))
    }

    /// `cells` are those that what is divided into so many blocks has at least.
    fn by(target: &Target<'_, D>, blocks: usize, cells: impl Fn(usize) -> usize) -> Result<Self> {
        let mut nodes = Vec::with_capacity(2 * blocks);
        divide(target, partition(target, target.cell_rule())?, (0, blocks.max(1)), &cells, &mut nodes);
        Ok(Self { nodes })
    }

    /// The block that a place is in.
    pub fn block_of(&self, x: &[f64; D]) -> usize {
        let mut node = 0;
        loop {
            match self.nodes[node] {
                Node::Block(block) => return block,
                Node::Plane { axis, at, beyond } => node = if x[axis] < at { node + 1 } else { beyond },
            }
        }
    }
}

/// Appends the nodes of what is divided into so many blocks, of which `first` is the first.
fn divide<const D: usize>(
    target: &Target<'_, D>,
    mut cells: Vec<Cell<D>>,
    (first, blocks): (usize, usize),
    least: &dyn Fn(usize) -> usize,
    nodes: &mut Vec<Node>,
) {
    if blocks == 1 {
        nodes.push(Node::Block(first));
        return;
    }
    refine(target, &mut cells, least(blocks), target.cell_rule());
    let below = blocks / 2;
    let Cut { axis, plane, left, right } = cut(cells, below as f64 / blocks as f64);
    let node = nodes.len();
    nodes.push(Node::Plane { axis, at: plane, beyond: 0 });
    divide(target, left, (first, below), least, nodes);
    let beyond = nodes.len();
    nodes[node] = Node::Plane { axis, at: plane, beyond };
    divide(target, right, (first + below, blocks - below), least, nodes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::AnalyticField;
    use sph::domain::{Domain, Wall};

    #[test]
    fn blocks_have_their_shares_of_the_mass_and_are_as_deep_as_wide() {
        let domain = Domain::ball([0.0; 3], 1.0, Wall::Open).unwrap();
        let field = AnalyticField::new("density", "exp(-5*r)", [0.0; 3]).unwrap();
        let target = Target::of_equal_masses(&domain, &field, 40_000, 1.0);
        let seeds = crate::seeding::seed_block(&target, 1, 0..40_000).unwrap();
        for blocks in [1, 5, 8] {
            let parting = Parting::new(&target, blocks).unwrap();
            let mut found = vec![0; blocks];
            (0..40_000).for_each(|i| found[parting.block_of(&seeds.each_ref().map(|x| x[i]))] += 1);
            let wanted = 40_000.0 / blocks as f64;
            assert!(found.iter().all(|n| (f64::from(*n) / wanted - 1.0).abs() < 0.02), "{found:?}");
            let planes = parting.nodes.iter().filter(|n| matches!(n, Node::Plane { .. })).count();
            assert_eq!(planes, blocks - 1);
        }
        let octants = Parting::new(&target, 8).unwrap();
        let axes: Vec<usize> = octants
            .nodes
            .iter()
            .filter_map(|n| match n {
                Node::Plane { axis, .. } => Some(*axis),
                Node::Block(_) => None,
            })
            .collect();
        assert!((0..3).all(|k| axes.contains(&k)), "{axes:?}");
    }
}
