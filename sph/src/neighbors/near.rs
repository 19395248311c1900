//! Leaves of sources near a box. The leaves that a group of neighboring leaves may see are searched once, from the root of the tree.

use super::sources::Sources;
use super::tree::Node;
use crate::domain::{AxisImage, Domain};
use crate::lanes::Real;
use crate::pack::EIGHT;
use pulp::Simd;
use std::ops::Range;

/// A box by its center and half its edges.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cuboid<const D: usize> {
    pub center: [f64; D],
    pub half: [f64; D],
}

impl<const D: usize> Cuboid<D> {
    /// A little wider than exact, so that rounding loses no neighbor.
    pub fn new(lo: &[f64; D], hi: &[f64; D]) -> Self {
        Self {
            center: crate::array(|k| 0.5 * (lo[k] + hi[k])),
            half: crate::array(|k| 0.5 * (hi[k] - lo[k]) * (1.0 + 1e-6)),
        }
    }

    /// The box around nodes of a tree.
    pub fn around<'n>(nodes: impl Iterator<Item = &'n Node<D>>) -> Self {
        let (mut lo, mut hi) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
        for node in nodes {
            (0..D).for_each(|k| lo[k] = lo[k].min(node.lo[k]));
            (0..D).for_each(|k| hi[k] = hi[k].max(node.hi[k]));
        }
        Self::new(&lo, &hi)
    }

    /// As the originals of an image see it: an image is its own inverse up to the sign of the shift.
    #[inline(always)]
    fn seen_through(&self, image: &[AxisImage; D]) -> Self {
        let Self { center, half } = *self;
        Self { center: crate::array(|k| image[k].sign * (center[k] - image[k].shift)), half }
    }

    /// Square of the distance from a box of these bounds.
    #[inline(always)]
    fn gap2(&self, lo: &[f64; D], hi: &[f64; D]) -> f64 {
        let mut gap2 = 0.0;
        for k in 0..D {
            let gap = (lo[k] - self.center[k] - self.half[k]).max(self.center[k] - self.half[k] - hi[k]).max(0.0);
            gap2 += gap * gap;
        }
        gap2
    }
}

/// Leaves of sources that lie near a box, in the order of their trees.
#[derive(Default)]
pub(super) struct Near<const D: usize> {
    leaves: Vec<Leaves<D>>,
    runs: Vec<Run<D>>,
}

/// Eight leaves: their boxes, how far their particles are seen whoever looks, and their places.
#[derive(Clone, Copy)]
struct Leaves<const D: usize> {
    lo: [[f64; EIGHT]; D],
    hi: [[f64; EIGHT]; D],
    own: [f64; EIGHT],
    first: [u32; EIGHT],
    count: [u32; EIGHT],
}

impl<const D: usize> Leaves<D> {
    /// Infinitely far away.
    const NONE: Self = Self {
        lo: [[f64::INFINITY; EIGHT]; D],
        hi: [[f64::INFINITY; EIGHT]; D],
        own: [0.0; EIGHT],
        first: [0; EIGHT],
        count: [0; EIGHT],
    };

    fn set(&mut self, j: usize, node: &Node<D>, own: f64) {
        for k in 0..D {
            (self.lo[k][j], self.hi[k][j]) = (node.lo[k], node.hi[k]);
        }
        (self.own[j], self.first[j], self.count[j]) = (own, node.first, node.count);
    }

    /// Squares of the distances within which particles are seen, and the bits of those leaves that are so near.
    #[inline(always)]
    fn within<S: Simd>(&self, simd: S, cuboid: &Cuboid<D>, reach: f64) -> ([f64; EIGHT], u8) {
        let (mut gap2, mut limits, mut beyond) = ([0.0; EIGHT], [0.0; EIGHT], [0.0; EIGHT]);
        for k in 0..D {
            let (center, half) = (cuboid.center[k], cuboid.half[k]);
            for j in 0..EIGHT {
                let gap = (self.lo[k][j] - center - half).max(center - half - self.hi[k][j]).max(0.0);
                gap2[j] += gap * gap;
            }
        }
        for j in 0..EIGHT {
            let reach = self.own[j].max(reach);
            limits[j] = reach * reach;
            beyond[j] = gap2[j] - limits[j];
        }
        (limits, f64::below(simd, beyond, 0.0))
    }
}

/// Leaves of one kind of sources, seen through one image.
pub(super) struct Run<const D: usize> {
    pub source: usize,
    pub image: [AxisImage; D],
    leaves: Range<usize>,
}

/// Places of sources in their tree's order, all of them within a distance whose square is `limit` as far as is known.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places {
    pub first: usize,
    pub end: usize,
    pub limit: f64,
}

impl<const D: usize> Near<D> {
    /// Leaves whose sources may be seen from the box, with targets that reach as far as `reach`.
    pub fn look<const C: usize>(
        &mut self,
        domain: &Domain<D>,
        sources: &[Sources<'_, D, C>],
        cuboid: &Cuboid<D>,
        reach: f64,
    ) {
        self.leaves.clear();
        self.runs.clear();
        for (source, of) in sources.iter().enumerate() {
            if !of.is_seen() {
                continue;
            }
            for_each_image(domain, cuboid, of.reach_of(0, reach), |image| {
                let first = self.leaves.len();
                self.descend(of, &cuboid.seen_through(&image), reach);
                self.runs.push(Run { source, image, leaves: first..self.leaves.len() });
            });
        }
    }

    fn descend<const C: usize>(&mut self, source: &Sources<'_, D, C>, cuboid: &Cuboid<D>, reach: f64) {
        let nodes = source.nodes();
        let (mut at, mut found) = (0, 0);
        while at < nodes.len() {
            let node = &nodes[at];
            let reach = source.reach_of(at, reach);
            if cuboid.gap2(&node.lo, &node.hi) > reach * reach {
                at = node.skip as usize;
                continue;
            }
            if node.skip as usize == at + 1 {
                if found % EIGHT == 0 {
                    self.leaves.push(Leaves::NONE);
                }
                if let Some(last) = self.leaves.last_mut() {
                    last.set(found % EIGHT, node, source.reach_of(at, 0.0));
                }
                found += 1;
            }
            at += 1;
        }
    }

    pub fn runs(&self) -> &[Run<D>] {
        &self.runs
    }

    /// The places of a run that may be seen from a box within the one that was looked at; neighboring ones are put together.
    #[inline(always)]
    pub fn places<S: Simd, const C: usize>(
        &self,
        simd: S,
        run: &Run<D>,
        source: &Sources<'_, D, C>,
        (cuboid, reach): (&Cuboid<D>, f64),
        places: &mut Vec<Places>,
    ) {
        let (cuboid, reach) = (cuboid.seen_through(&run.image), source.targets_reach(reach));
        places.clear();
        for leaves in &self.leaves[run.leaves.clone()] {
            let (limits, mut bits) = leaves.within(simd, &cuboid, reach);
            while bits != 0 {
                let j = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let (first, limit) = (leaves.first[j] as usize, limits[j]);
                let end = first + leaves.count[j] as usize;
                match places.last_mut() {
                    Some(last) if last.end == first && last.limit == limit => last.end = end,
                    _ => places.push(Places { first, end, limit }),
                }
            }
        }
    }
}

/// Calls `take` with each image through which something may be seen within `reach` of the box.
fn for_each_image<const D: usize>(
    domain: &Domain<D>,
    cuboid: &Cuboid<D>,
    reach: f64,
    mut take: impl FnMut([AxisImage; D]),
) {
    let images: [Vec<AxisImage>; D] = std::array::from_fn(|k| {
        let (center, span) = (cuboid.center[k], cuboid.half[k] + reach);
        if center - span >= domain.lo[k] && center + span <= domain.hi[k] {
            vec![AxisImage::IDENTITY]
        } else {
            domain.axis_images(k, center - span, center + span)
        }
    });
    let combinations: usize = images.iter().map(Vec::len).product();
    for mut combination in 0..combinations {
        take(std::array::from_fn(|k| {
            let chosen = images[k][combination % images[k].len()];
            combination /= images[k].len();
            chosen
        }));
    }
}
