//! Bucket k-d tree over particle positions: leaves of equal size, stored in preorder, particles in leaf order.

use crate::parallel;

/// Particles of a leaf, at most. Larger leaves share their gathered neighbors among more targets, smaller
/// ones gather fewer that no target sees; measured best at 64 neighbors in 3-D.
pub const LEAF_SIZE: usize = 32;

/// Particles that follow each other in a leaf and lie close together.
pub(super) const PART_OF_LEAF: usize = 8;

/// Leaves that look for what is near them together: a subtree of this many, at most.
const GROUP_OF_LEAVES: usize = 8;

/// Nodes above this many particles are built in parallel.
const PARALLEL_BUILD: usize = 8192;

/// A node covers `first .. first + count` in tree order. Its first child, if any, is the next node; `skip` is
/// the node after its whole subtree.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node<const D: usize> {
    pub lo: [f64; D],
    pub hi: [f64; D],
    pub first: u32,
    pub count: u32,
    pub skip: u32,
}

impl<const D: usize> Node<D> {
    /// Places of its particles in tree order.
    pub fn places(&self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

/// K-d tree that owns the positions of its particles in tree order.
#[derive(Debug, Clone)]
pub struct Tree<const D: usize> {
    /// Tree position -> index in the arrays that the tree was built from; empty where these are in tree order.
    order: Vec<u32>,
    pub(crate) positions: [Vec<f64>; D],
    pub(crate) nodes: Vec<Node<D>>,
    pub(crate) leaves: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Item<const D: usize> {
    x: [f64; D],
    index: u32,
}

impl<const D: usize> Tree<D> {
    /// Builds a tree over finite positions, O(N log N). At most 2^32 - 1 particles.
    pub fn build(positions: &[Vec<f64>; D]) -> Self {
        let n = positions[0].len();
        assert!(u32::try_from(n).is_ok(), "more particles than 32-bit indices");
        let mut items = parallel::map(n, |i| Item { x: crate::array(|k| positions[k][i]), index: i as u32 });
        let leaf_count = n.div_ceil(LEAF_SIZE);
        let empty = Node { lo: [0.0; D], hi: [0.0; D], first: 0, count: 0, skip: 0 };
        let mut nodes = vec![empty; (2 * leaf_count).saturating_sub(1)];
        if n > 0 {
            subdivide(&mut items, &mut nodes, 0, 0, leaf_count);
        }
        let leaves = (0..nodes.len() as u32).filter(|&i| nodes[i as usize].skip == i + 1).collect();
        Self {
            order: parallel::map(n, |i| items[i].index),
            positions: std::array::from_fn(|k| parallel::map(n, |i| items[i].x[k])),
            nodes,
            leaves,
        }
    }

    /// The tree of particles that are in the order of an earlier tree, as [`Self::move_particles`] leaves it: the
    /// structure depends on their number alone.
    pub fn of_sorted(positions: &[Vec<f64>; D]) -> Self {
        let mut tree = Self::build(positions);
        tree.take_order();
        tree.move_particles(|own| own.clone_from(positions));
        tree
    }

    pub fn len(&self) -> usize {
        self.positions[0].len()
    }

    /// Groups of leaves that are subtrees, in the tree's order.
    pub(super) fn leaf_groups(&self) -> impl Iterator<Item = &[u32]> {
        let (mut at, mut first) = (0, 0);
        std::iter::from_fn(move || {
            // A subtree of l leaves has 2 l - 1 nodes.
            while at < self.nodes.len() {
                let nodes = self.nodes[at].skip as usize - at;
                if nodes < 2 * GROUP_OF_LEAVES {
                    let leaves = &self.leaves[first..first + nodes.div_ceil(2)];
                    (at, first) = (at + nodes, first + leaves.len());
                    return Some(leaves);
                }
                at += 1;
            }
            None
        })
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Positions in tree order.
    pub fn positions(&self) -> &[Vec<f64>; D] {
        &self.positions
    }

    /// The same, without the tree.
    pub fn into_positions(self) -> [Vec<f64>; D] {
        self.positions
    }

    /// Position of the particle at tree position `i`.
    pub fn position(&self, i: usize) -> [f64; D] {
        crate::array(|k| self.positions[k][i])
    }

    /// Tree position -> particle index; empty after [`Self::take_order`].
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Declares that the particles' own arrays are now in tree order, which is returned.
    pub fn take_order(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.order)
    }

    /// Lets `change` move particles, whose positions it gets in tree order, without sorting anew: boxes are fitted again, so that results
    /// stay right however far particles went; passes slow down as leaves begin to overlap. There must be as many particles as before.
    pub fn move_particles(&mut self, change: impl FnOnce(&mut [Vec<f64>; D])) {
        let n = self.len();
        change(&mut self.positions);
        assert!(self.positions.iter().all(|axis| axis.len() == n), "another number of particles");
        let tree_positions = &self.positions;
        parallel::update(&mut self.nodes, |i, node| {
            if node.skip == i as u32 + 1 {
                let range = node.places();
                (node.lo, node.hi) =
                    std::array::from_fn::<_, D, _>(|k| bounds(&tree_positions[k][range.clone()])).into_bounds();
            }
        });
        // Children follow their parent in preorder, so a backward sweep sees them first.
        for i in (0..self.nodes.len()).rev() {
            if self.nodes[i].skip != i as u32 + 1 {
                let (left, right) = (i + 1, self.nodes[i + 1].skip as usize);
                for k in 0..D {
                    self.nodes[i].lo[k] = self.nodes[left].lo[k].min(self.nodes[right].lo[k]);
                    self.nodes[i].hi[k] = self.nodes[left].hi[k].max(self.nodes[right].hi[k]);
                }
            }
        }
    }

    /// Values of particles (in their own order) brought into tree order.
    pub fn to_tree_order<T: Copy + Send + Sync>(&self, values: &[T]) -> Vec<T> {
        parallel::reordered(values, &self.order)
    }

    /// For each node the largest of `values` (in tree order) below it.
    pub(super) fn node_maxima(&self, values: &[f64]) -> Vec<f64> {
        let mut maxima = vec![0.0_f64; self.nodes.len()];
        for i in (0..self.nodes.len()).rev() {
            let node = &self.nodes[i];
            maxima[i] = if node.skip == i as u32 + 1 {
                let range = node.places();
                values[range].iter().fold(0.0, |m, &v| v.max(m))
            } else {
                maxima[i + 1].max(maxima[self.nodes[i + 1].skip as usize])
            };
        }
        maxima
    }
}

fn bounds(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &v| (lo.min(v), hi.max(v)))
}

trait IntoBounds<const D: usize> {
    fn into_bounds(self) -> ([f64; D], [f64; D]);
}

impl<const D: usize> IntoBounds<D> for [(f64, f64); D] {
    fn into_bounds(self) -> ([f64; D], [f64; D]) {
        (crate::array(|k| self[k].0), crate::array(|k| self[k].1))
    }
}

/// Parts items at `middle`, across the longest edge of their bounds.
fn split<const D: usize>(items: &mut [Item<D>], middle: usize, (lo, hi): (&[f64; D], &[f64; D])) {
    let axis = (0..D).fold(0, |best, k| if hi[k] - lo[k] > hi[best] - lo[best] { k } else { best });
    // The index breaks ties, so that the split is unique also where coordinates are equal.
    items.select_nth_unstable_by(middle, |a, b| a.x[axis].total_cmp(&b.x[axis]).then(a.index.cmp(&b.index)));
}

fn limits<const D: usize>(items: &[Item<D>]) -> ([f64; D], [f64; D]) {
    let (mut lo, mut hi) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for item in items {
        for k in 0..D {
            lo[k] = lo[k].min(item.x[k]);
            hi[k] = hi[k].max(item.x[k]);
        }
    }
    (lo, hi)
}

/// Puts the particles of a leaf in an order of which every [`PART_OF_LEAF`] lie close together.
fn part<const D: usize>(items: &mut [Item<D>], bounds: (&[f64; D], &[f64; D])) {
    let parts = items.len().div_ceil(PART_OF_LEAF);
    if parts < 2 {
        return;
    }
    let middle = parts / 2 * PART_OF_LEAF;
    split(items, middle, bounds);
    let (left, right) = items.split_at_mut(middle);
    for items in [left, right] {
        if items.len() > PART_OF_LEAF {
            let (lo, hi) = limits(items);
            part(items, (&lo, &hi));
        }
    }
}

/// Fills `nodes` (2 `leaf_count` - 1 of them, the first at absolute index `at`) for `items`, whose first has
/// tree position `first`. Leaves get equal shares, so that cost per particle does not depend on N.
fn subdivide<const D: usize>(items: &mut [Item<D>], nodes: &mut [Node<D>], at: u32, first: u32, leaf_count: usize) {
    let (lo, hi) = limits(items);
    let skip = at + nodes.len() as u32;
    nodes[0] = Node { lo, hi, first, count: items.len() as u32, skip };
    if leaf_count == 1 {
        part(items, (&lo, &hi));
        return;
    }
    let left_leaves = leaf_count / 2;
    let middle = (items.len() as u64 * left_leaves as u64 / leaf_count as u64) as usize;
    split(items, middle, (&lo, &hi));
    let parallel = items.len() > PARALLEL_BUILD;
    let (left, right) = items.split_at_mut(middle);
    let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * left_leaves - 1);
    let right_at = at + 1 + left_nodes.len() as u32;
    let right_first = first + middle as u32;
    let build_left = || subdivide(left, left_nodes, at + 1, first, left_leaves);
    let build_right = || subdivide(right, right_nodes, right_at, right_first, leaf_count - left_leaves);
    if parallel {
        rayon::join(build_left, build_right);
    } else {
        let (mut build_left, mut build_right) = (build_left, build_right);
        build_left();
        build_right();
    }
}
