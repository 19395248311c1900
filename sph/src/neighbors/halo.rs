//! Particles of other ranks that are visible to the particles of this rank, in a separate tree from which they are gathered.
//!
//! Each rank tells the others where its particles are, as boxes with how far the particles in them see, and is given all
//! that lie within. The boxes are nodes of its tree: some dozens tell the shape of a block closely enough. A particle that
//! reaches a box through a periodic face is given once, as it is: the domain makes its images. Mirror images need nothing: an
//! image in a wall is farther from all that is inside than what it is an image of.

use super::tree::Tree;
use crate::domain::{Axis, Domain};
use crate::exchange::Exchange;

/// Boxes by which a rank tells where its particles are, about.
const BOXES: usize = 64;
/// Slices of a periodic axis that are looked at for whether any particle of a box is in them, and the share of the axis from which on a
/// box may have some that are empty.
const SLICES: usize = 16;
const WIDE: f64 = 2.0 / SLICES as f64;
/// A little farther than exact, so that rounding loses no neighbor.
const SLACK: f64 = 1.0 + 1e-6;

/// A box, and how far the particles in it see.
#[derive(Debug, Clone, Copy)]
struct Sight<const D: usize> {
    lo: [f64; D],
    hi: [f64; D],
    reach: f64,
}

impl<const D: usize> Sight<D> {
    fn packed(&self) -> impl Iterator<Item = f64> + '_ {
        self.lo.iter().chain(&self.hi).chain([&self.reach]).copied()
    }

    fn unpacked(numbers: &[f64]) -> Vec<Self> {
        let one = |n: &[f64]| Self { lo: crate::array(|k| n[k]), hi: crate::array(|k| n[D + k]), reach: n[2 * D] };
        numbers.chunks_exact(2 * D + 1).map(one).collect()
    }

    /// A box that holds both.
    fn with(&self, other: &Self) -> Self {
        Self {
            lo: crate::array(|k| self.lo[k].min(other.lo[k])),
            hi: crate::array(|k| self.hi[k].max(other.hi[k])),
            reach: self.reach.max(other.reach),
        }
    }

    /// Whether anything between `lo` and `hi` is seen, which itself may see `own` far.
    fn sees(&self, domain: &Domain<D>, lo: &[f64; D], hi: &[f64; D], own: f64) -> bool {
        let reach = SLACK * self.reach.max(own);
        domain.squared_distance_of_boxes([&self.lo, &self.hi], [lo, hi]) <= reach * reach
    }
}

impl<const D: usize> Tree<D> {
    /// Boxes that hold all particles, with the largest of their `support`, in tree order. Particles that have come through a periodic face
    /// are in boxes of their own: one box with those that have not would hold all that is between them.
    fn sights(&self, domain: &Domain<D>, support: &[f64], boxes: usize) -> Vec<Sight<D>> {
        let maxima = self.node_maxima(support);
        let share = self.len().div_ceil(boxes.max(1));
        let mut sights = Vec::new();
        let mut at = 0;
        while at < self.nodes.len() {
            let node = &self.nodes[at];
            let is_leaf = node.skip as usize == at + 1;
            if is_leaf || node.count as usize <= share {
                let whole = Sight { lo: node.lo, hi: node.hi, reach: maxima[at] };
                let wide = |k: usize| whole.hi[k] - whole.lo[k] > WIDE * (domain.hi[k] - domain.lo[k]);
                match (0..D).any(|k| matches!(domain.axes[k], Axis::Periodic) && wide(k)) {
                    true => sights.extend(self.parted(domain, node.places(), support)),
                    false => sights.push(whole),
                }
                at = node.skip as usize;
            } else {
                at += 1;
            }
        }
        sights
    }

    /// Boxes of the particles at these places, in groups between which slices of the domain are empty along the periodic axes.
    fn parted(&self, domain: &Domain<D>, places: std::ops::Range<usize>, support: &[f64]) -> Vec<Sight<D>> {
        let mut groups = vec![places.collect::<Vec<usize>>()];
        for k in (0..D).filter(|k| matches!(domain.axes[*k], Axis::Periodic)) {
            groups = groups.into_iter().flat_map(|group| self.between_empty_slices(domain, k, group)).collect();
        }
        let of = |i: usize| Sight { lo: self.position(i), hi: self.position(i), reach: support[i] };
        let hull = |group: &Vec<usize>| group.iter().map(|i| of(*i)).reduce(|all, one| all.with(&one));
        groups.iter().filter_map(hull).collect()
    }

    /// Particles in the groups that empty slices across axis `k` leave.
    fn between_empty_slices(&self, domain: &Domain<D>, k: usize, group: Vec<usize>) -> Vec<Vec<usize>> {
        let per_length = SLICES as f64 / (domain.hi[k] - domain.lo[k]);
        let slice = |i: usize| (((self.position(i)[k] - domain.lo[k]) * per_length) as usize).min(SLICES - 1);
        let mut is_filled = [false; SLICES];
        group.iter().for_each(|i| is_filled[slice(*i)] = true);
        let begins = |s: usize| is_filled[s] && (s == 0 || !is_filled[s - 1]);
        // How many runs of filled slices begin up to each.
        let mut count = 0;
        let run: [usize; SLICES] = std::array::from_fn(|s| {
            count += usize::from(begins(s));
            count
        });
        if count < 2 {
            return vec![group];
        }
        let mut runs = vec![Vec::new(); count];
        group.into_iter().for_each(|i| runs[run[slice(i)] - 1].push(i));
        runs
    }

    /// Tree positions of particles that any of `sights` sees, or that see any of them by their `own` radii, if given.
    fn seen(&self, domain: &Domain<D>, sights: &[Sight<D>], own: &[f64]) -> Vec<u32> {
        let maxima = if own.is_empty() { Vec::new() } else { self.node_maxima(own) };
        let far = |values: &[f64], i: usize| values.get(i).copied().unwrap_or(0.0);
        let mut seen = Vec::new();
        if self.nodes.is_empty() {
            return seen;
        }
        let mut open = vec![(0_usize, sights.to_vec())];
        while let Some((at, mut sights)) = open.pop() {
            let node = &self.nodes[at];
            sights.retain(|s| s.sees(domain, &node.lo, &node.hi, far(&maxima, at)));
            if sights.is_empty() {
                continue;
            }
            if node.skip as usize == at + 1 {
                let inside = node.places();
                let is_seen = |i: &usize| {
                    let x = self.position(*i);
                    sights.iter().any(|s| s.sees(domain, &x, &x, far(own, *i)))
                };
                seen.extend(inside.filter(is_seen).map(|i| i as u32));
            } else {
                open.push((self.nodes[at + 1].skip as usize, sights.clone()));
                open.push((at + 1, sights));
            }
        }
        seen
    }
}

/// Where some particles are, about, and how far those there see: enough to tell which of others are near them.
#[derive(Debug, Clone)]
pub struct Sights<const D: usize>(Vec<Sight<D>>);

impl<const D: usize> Sights<D> {
    /// Of particles with these support radii, as about so many boxes.
    pub fn new(domain: &Domain<D>, positions: &[Vec<f64>; D], support: &[f64], boxes: usize) -> Self {
        let tree = Tree::build(positions);
        Self(tree.sights(domain, &tree.to_tree_order(support), boxes))
    }

    /// As if the particles saw so many times as far.
    #[must_use]
    pub fn widened(&self, times: f64) -> Self {
        Self(self.0.iter().map(|sight| Sight { reach: times * sight.reach, ..*sight }).collect())
    }

    /// Whether any of the particles may see `x`, or be seen from there `own` far.
    pub fn may_reach(&self, domain: &Domain<D>, x: &[f64; D], own: f64) -> bool {
        self.0.iter().any(|sight| sight.sees(domain, x, x, own))
    }

    /// Whether any of the particles may see any of others, or be seen by them.
    pub fn may_meet(&self, domain: &Domain<D>, others: &Self) -> bool {
        self.0.iter().any(|s| others.0.iter().any(|o| s.sees(domain, &o.lo, &o.hi, o.reach)))
    }
}

/// Whose support radius decides what a rank is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sees {
    /// What lies within the radii of the particles that receive.
    Targets,
    /// What lies within the larger radius of the two.
    Either,
}

/// What other ranks have given.
#[derive(Debug)]
pub struct Halo<const D: usize> {
    pub tree: Tree<D>,
    /// For each rank, tree positions of the particles here that are given to it, and of their ghosts.
    given: Vec<[Vec<u32>; 2]>,
}

impl<const D: usize> Halo<D> {
    /// Exchanges the particles of `tree`, which see as far as `support` (tree order) says, and their `ghosts`. All ranks call it
    /// together.
    pub fn new(
        exchange: &dyn Exchange,
        domain: &Domain<D>,
        (tree, support): (&Tree<D>, &[f64]),
        ghosts: Option<&Tree<D>>,
        sees: Sees,
    ) -> Self {
        let sights: Vec<f64> =
            tree.sights(domain, support, BOXES).iter().flat_map(|s| s.packed().collect::<Vec<_>>()).collect();
        let others: Vec<Vec<Sight<D>>> = exchange.all(&sights).iter().map(|n| Sight::unpacked(n)).collect();
        let own = if sees == Sees::Either { support } else { &[] };
        let given: Vec<[Vec<u32>; 2]> = crate::parallel::tasks(others.len(), |rank| {
            if rank == exchange.rank() {
                return [Vec::new(), Vec::new()];
            }
            let ghosts = ghosts.map_or_else(Vec::new, |ghosts| ghosts.seen(domain, &others[rank], &[]));
            [tree.seen(domain, &others[rank], own), ghosts]
        });
        let mut halo = Self { tree: Tree::build(&std::array::from_fn(|_| Vec::new())), given };
        let of_ghosts = |k: usize| ghosts.map_or(&[][..], |g| &g.positions[k]);
        let channels: [[&[f64]; 2]; D] = crate::array(|k| [tree.positions[k].as_slice(), of_ghosts(k)]);
        halo.tree = Tree::build(&halo.swapped(exchange, channels));
        halo
    }

    /// Values of the particles that were given, in the order of [`Self::tree`]; `channels` are those of the particles here and of their
    /// ghosts, each in the order of its tree. All ranks call it together.
    pub fn values<const C: usize>(&self, exchange: &dyn Exchange, channels: [[&[f64]; 2]; C]) -> [Vec<f64>; C] {
        self.swapped(exchange, channels).map(|values| self.tree.to_tree_order(&values))
    }

    /// The same in the order of ranks.
    fn swapped<const C: usize>(&self, exchange: &dyn Exchange, channels: [[&[f64]; 2]; C]) -> [Vec<f64>; C] {
        let chosen = |given: &[Vec<u32>; 2]| -> Vec<f64> {
            let of = |c: usize| (0..2).flat_map(move |s| given[s].iter().map(move |&i| channels[c][s][i as usize]));
            (0..C).flat_map(of).collect()
        };
        let received = exchange.swap(self.given.iter().map(chosen).collect());
        std::array::from_fn(|c| {
            let part = |message: &Vec<f64>| {
                let each = message.len() / C.max(1);
                message[c * each..(c + 1) * each].to_vec()
            };
            received.iter().flat_map(part).collect()
        })
    }
}
