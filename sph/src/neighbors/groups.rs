//! Particles that lie close together.

use super::tree::Tree;
use crate::parallel;

/// Particles in groups, each of which is a part of a leaf.
#[derive(Debug, Clone)]
pub struct Groups {
    particles: Vec<u32>,
    /// Where each group ends.
    ends: Vec<u32>,
}

/// Leaves that are divided at once.
const SHARE: usize = 256;

impl Groups {
    /// All particles of a tree: leaves halved across their longest edges until none has more than `most`.
    pub fn new<const D: usize>(tree: &Tree<D>, most: usize) -> Self {
        let shares = parallel::pieces(tree.leaves.len(), SHARE, |share| {
            let (mut places, mut sizes) = (Vec::new(), Vec::new());
            for &leaf in &tree.leaves[share] {
                let node = &tree.nodes[leaf as usize];
                let first = places.len();
                places.extend(node.first..node.first + node.count);
                divide(tree, &mut places[first..], most, &mut sizes);
            }
            (places, sizes)
        });
        let (mut particles, mut ends) = (Vec::with_capacity(tree.len()), Vec::new());
        let mut end = 0;
        for (places, sizes) in shares {
            particles.extend(places.into_iter().map(|place| tree.order()[place as usize]));
            ends.extend(sizes.into_iter().map(|size| {
                end += size;
                end
            }));
        }
        Self { particles, ends }
    }

    /// How many groups there are.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The particles of a group, as the arrays number them that the tree was built from.
    pub fn members(&self, group: usize) -> &[u32] {
        let first = group.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.particles[first as usize..self.ends[group] as usize]
    }
}

/// Puts places of particles in an order in which those close together follow each other, and adds the sizes of their groups.
fn divide<const D: usize>(tree: &Tree<D>, places: &mut [u32], most: usize, sizes: &mut Vec<u32>) {
    if places.len() <= most.max(1) {
        sizes.push(places.len() as u32);
        return;
    }
    let extent = |k: usize| {
        let of = |(lo, hi): (f64, f64), x: f64| (lo.min(x), hi.max(x));
        let all = places.iter().map(|&place| tree.positions[k][place as usize]);
        let (lo, hi) = all.fold((f64::INFINITY, f64::NEG_INFINITY), of);
        hi - lo
    };
    let extents: [f64; D] = crate::array(extent);
    let longest = (1..D).fold(0, |best, k| if extents[k] > extents[best] { k } else { best });
    let half = places.len() / 2;
    let along = |place: &u32| tree.positions[longest][*place as usize];
    places.select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
    let (first, last) = places.split_at_mut(half);
    divide(tree, first, most, sizes);
    divide(tree, last, most, sizes);
}
