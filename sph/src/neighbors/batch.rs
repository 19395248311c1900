//! Leaf-batched gathering: the buffers that targets of one leaf run over.
//!
//! Buffers hold positions relative to the leaf's center in units of the leaf's largest reach, so f32 resolves
//! about 1e-7 of a support radius whatever the units and wherever the leaf is; sums over them are good to a
//! few 1e-7 relative. With f64 buffers the same code gives the reference.

use super::buffers::Buffers;
use super::near::{Cuboid, Near, Places};
use super::sources::{Reach, Sources};
use super::tree::{LEAF_SIZE, PART_OF_LEAF};
use crate::domain::{AxisImage, Domain};
use crate::lanes::Real;
use crate::pack::EIGHT;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

/// Scales of a batch: buffer value times scale is the value in code units.
#[derive(Debug, Clone, Copy)]
pub struct BatchUnit<const C: usize> {
    pub length: f64,
    pub channels: [f64; C],
}

/// What a pass does with targets of one leaf that lie close together.
pub trait LeafPass<const D: usize, const C: usize, R: Real>: Sync {
    type Output: Copy + Send + Default;

    /// Fills `out`, one entry per target (`batch.targets()` in order).
    fn leaf<S: Simd>(&self, simd: S, batch: &mut Batch<'_, D, C, R>, out: &mut [Self::Output]);
}

/// Where eight of `of` values begin among which the first of `places` are, and which of them are these.
#[inline(always)]
fn window(places: Range<usize>, of: usize) -> (usize, u8) {
    let at = places.start.min(of.saturating_sub(EIGHT));
    let (skipped, count) = (places.start - at, places.len().min(EIGHT));
    (at, (u8::MAX >> (EIGHT - count)) << skipped)
}

#[inline(always)]
fn eight(values: &[f64], at: usize) -> [f64; EIGHT] {
    let mut out = [0.0; EIGHT];
    out.copy_from_slice(&values[at..at + EIGHT]);
    out
}

/// Neighbors of targets that lie close together: a leaf, or a part of one.
pub struct Batch<'a, const D: usize, const C: usize, R: Real> {
    domain: &'a Domain<D>,
    sources: &'a [Sources<'a, D, C>],
    first: usize,
    count: usize,
    cuboid: Cuboid<D>,
    unit: BatchUnit<C>,
    /// How far from the targets all sources are in the buffers.
    reach: f64,
    /// How far away sources may be that any target sees, by the radii of either.
    widest: f64,
    places: Vec<Places>,
    /// What the leaf may see, and what of it the targets may see.
    gathered: Buffers<D, C, R>,
    seen: Buffers<D, C, R>,
}

impl<'a, const D: usize, const C: usize, R: Real> Batch<'a, D, C, R> {
    fn new(domain: &'a Domain<D>, sources: &'a [Sources<'a, D, C>]) -> Self {
        Self {
            domain,
            sources,
            first: 0,
            count: 0,
            cuboid: Cuboid::new(&[0.0; D], &[0.0; D]),
            unit: BatchUnit { length: 1.0, channels: [1.0; C] },
            reach: 0.0,
            widest: 0.0,
            places: Vec::new(),
            gathered: Buffers::new(),
            seen: Buffers::new(),
        }
    }

    /// Tree positions of the targets.
    pub fn targets(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.count
    }

    pub fn unit(&self) -> BatchUnit<C> {
        self.unit
    }

    /// Position of the target at tree position `i` in buffer units.
    #[inline(always)]
    pub fn target(&self, i: usize) -> [R; D] {
        let tree = self.sources[0].tree;
        let mut out = [R::default(); D];
        for k in 0..D {
            out[k] = R::from_f64((tree.positions[k][i] - self.cuboid.center[k]) / self.unit.length);
        }
        out
    }

    /// Channel `c` of the target at tree position `i` in buffer units.
    #[inline(always)]
    pub fn target_channel(&self, c: usize, i: usize) -> f64 {
        self.sources[0].channels[c][i] / self.unit.channels[c]
    }

    /// Position and channel registers of all sources. What pads the last registers lies beyond every
    /// support and has zero channels.
    #[inline(always)]
    pub fn registers<S: Simd>(&self) -> ([&[R::Vector<S>]; D], [&[R::Vector<S>]; C]) {
        self.seen.registers::<S>()
    }

    /// All sources within this distance of any target are there.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    fn enter(&mut self, leaf: u32) {
        let tree = self.sources[0].tree;
        let node = &tree.nodes[leaf as usize];
        self.first = node.first as usize;
        self.count = node.count as usize;
        self.cuboid = Cuboid::new(&node.lo, &node.hi);
        for c in 0..C {
            let largest = self.sources[0].channels[c][self.targets()].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            self.unit.channels[c] = if largest > 0.0 { largest } else { 1.0 };
        }
    }

    /// Looks farther from within a pass, where it is rare.
    #[inline(never)]
    pub fn gather_again(&mut self, reach: f64) {
        let arch = Arch::new();
        if reach > self.unit.length {
            let mut near = Near::default();
            near.look(self.domain, self.sources, &self.cuboid, reach);
            arch.dispatch(Gather { batch: self, near: &near, reach });
        }
        arch.dispatch(Turn { targets: self.targets(), batch: self, reach });
    }

    /// Gathers all that lies within `reach` of the leaf's box, from what is near.
    #[inline(always)]
    fn gather<S: Simd>(&mut self, simd: S, near: &Near<D>, reach: f64) {
        self.gathered.clear();
        (self.unit.length, self.reach, self.widest) = (reach, reach, 0.0);
        let mut places = std::mem::take(&mut self.places);
        for run in near.runs() {
            near.places(simd, run, &self.sources[run.source], (&self.cuboid, reach), &mut places);
            self.append(simd, &self.sources[run.source], &run.image, &places);
        }
        self.places = places;
        self.widest = self.widest.sqrt();
        self.gathered.pad();
    }

    /// Appends those sources of a run that are near enough.
    #[inline(always)]
    fn append<S: Simd>(&mut self, simd: S, source: &Sources<'_, D, C>, image: &[AxisImage; D], places: &[Places]) {
        let (scale, half) = (1.0 / self.unit.length, self.cuboid.half);
        let sign: [f64; D] = crate::array(|k| image[k].sign);
        let shift: [f64; D] = crate::array(|k| image[k].shift - self.cuboid.center[k]);
        let channel_scale: [f64; C] = crate::array(|c| {
            let sign = if source.vector && c < D { sign[c] } else { 1.0 };
            sign / self.unit.channels[c]
        });
        // A tree of a few particles alone does without a window of its own.
        let mut few = ([[0.0; EIGHT]; D], [[0.0; EIGHT]; C]);
        let from = source.whole(&mut few);
        let mut filled = self.gathered.filled(places.iter().map(|places| places.end - places.first).sum());
        for places in places {
            self.widest = self.widest.max(places.limit);
            for first in (places.first..places.end).step_by(EIGHT) {
                let (at, wanted) = window(first..places.end, source.tree.len());
                let mut positions = [[R::default(); EIGHT]; D];
                let mut gap2 = [0.0_f64; EIGHT];
                for k in 0..D {
                    let x = eight(from.0[k], at);
                    for j in 0..EIGHT {
                        let y = sign[k] * x[j] + shift[k];
                        gap2[j] = y.add_gap2(0.0, half[k], gap2[j]);
                        positions[k][j] = R::from_f64(y * scale);
                    }
                }
                let mut channels = [[R::default(); EIGHT]; C];
                for c in 0..C {
                    let x = eight(from.1[c], at);
                    for j in 0..EIGHT {
                        channels[c][j] = R::from_f64(x[j] * channel_scale[c]);
                    }
                }
                let bits = f64::below(simd, gap2, places.limit) & wanted;
                filled.push(simd, &positions, &channels, bits);
            }
        }
    }

    /// Turns to some of the leaf's targets, whose support radii are at most `reach`, and to those sources that they may see.
    #[inline(always)]
    fn turn_to<S: Simd>(&mut self, simd: S, targets: Range<usize>, reach: f64) {
        (self.first, self.count) = (targets.start, targets.len());
        if R::DOUBLE {
            // Checks see what the whole leaf may see.
            self.reach = self.unit.length;
            std::mem::swap(&mut self.seen, &mut self.gathered);
            return;
        }
        let (mut lo, mut hi) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
        for k in 0..D {
            for x in &self.sources[0].tree.positions[k][targets.clone()] {
                (lo[k], hi[k]) = (lo[k].min(*x), hi[k].max(*x));
            }
        }
        let (mut center, mut half) = ([R::default(); D], [R::default(); D]);
        for k in 0..D {
            center[k] = R::from_f64((0.5 * (lo[k] + hi[k]) - self.cuboid.center[k]) / self.unit.length);
            half[k] = R::from_f64(0.5 * (hi[k] - lo[k]) / self.unit.length);
        }
        self.reach = reach;
        let of_sources = if self.sources.iter().all(|s| s.reach == Reach::Target) { 0.0 } else { self.widest };
        let limit = (reach.max(of_sources) / self.unit.length + ROUNDING).powi(2);
        self.seen.take_near(simd, &self.gathered, (&center, &half), R::from_f64(limit));
    }

    /// Position of gathered source `j` in buffer units.
    #[inline(always)]
    pub fn position(&self, j: usize) -> [R; D] {
        self.seen.position(j)
    }

    /// Channel `c` of gathered source `j` in buffer units.
    #[inline(always)]
    pub fn channel(&self, c: usize, j: usize) -> R {
        self.seen.channel(c, j)
    }

    /// How many sources are in the buffers.
    pub fn len(&self) -> usize {
        self.seen.len()
    }

    pub fn is_empty(&self) -> bool {
        self.seen.len() == 0
    }

    /// Support radius of source `0`'s particle at tree position `i`.
    pub fn support(&self, i: usize) -> f64 {
        self.sources[0].support[i]
    }
}

/// How much farther than exact sources are looked for in buffers, in units of the leaf's reach: several times what single precision rounds.
const ROUNDING: f64 = 1e-6;

/// Groups of leaves that a thread takes at once, at least.
const GROUPS_AT_ONCE: usize = 4;

/// Apart from [`Leaf`], so that gathering is compiled once for all passes.
struct Gather<'b, 'a, const D: usize, const C: usize, R: Real> {
    batch: &'b mut Batch<'a, D, C, R>,
    near: &'b Near<D>,
    reach: f64,
}

impl<const D: usize, const C: usize, R: Real> WithSimd for Gather<'_, '_, D, C, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.batch.gather(simd, self.near, self.reach);
    }
}

/// See [`Batch::turn_to`].
struct Turn<'b, 'a, const D: usize, const C: usize, R: Real> {
    batch: &'b mut Batch<'a, D, C, R>,
    targets: Range<usize>,
    reach: f64,
}

impl<const D: usize, const C: usize, R: Real> WithSimd for Turn<'_, '_, D, C, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.batch.turn_to(simd, self.targets, self.reach);
    }
}

struct Leaf<'p, 'b, 'a, 'o, const D: usize, const C: usize, R: Real, P: LeafPass<D, C, R>> {
    pass: &'p P,
    batch: &'b mut Batch<'a, D, C, R>,
    out: &'o mut [P::Output],
}

impl<const D: usize, const C: usize, R: Real, P: LeafPass<D, C, R>> WithSimd for Leaf<'_, '_, '_, '_, D, C, R, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.pass.leaf(simd, self.batch, self.out);
    }
}

/// A pass without its kernel in the type, so that what drives it is compiled once for all kernels.
pub(crate) trait DynPass<const D: usize, const C: usize, R: Real, O>: Sync {
    fn leaf(&self, arch: Arch, batch: &mut Batch<'_, D, C, R>, out: &mut [O]);
}

impl<const D: usize, const C: usize, R: Real, P: LeafPass<D, C, R>> DynPass<D, C, R, P::Output> for P {
    fn leaf(&self, arch: Arch, batch: &mut Batch<'_, D, C, R>, out: &mut [P::Output]) {
        let leaf = Leaf { pass: self, batch, out };
        if R::DOUBLE { dispatch_double(leaf) } else { arch.dispatch(leaf) }
    }
}

/// Double precision serves checks and the trimming of masses: it does without the widest instructions, so that a
/// third of the compilation is saved.
#[inline(always)]
fn dispatch_double<Op: WithSimd>(op: Op) -> Op::Output {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    return match pulp::x86::V3::try_new() {
        Some(simd) => Simd::vectorize(simd, op),
        None => Simd::vectorize(pulp::Scalar::new(), op),
    };
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    Arch::new().dispatch(op)
}

/// Runs `pass` over every particle of `sources[0]`, gathering from all `sources` (the others are ghosts).
/// Each leaf is gathered once to `margin` (at least 1) times its largest support radius.
///
/// The result is in tree order of `sources[0]`.
pub fn for_each_target<const D: usize, const C: usize, R: Real, P: LeafPass<D, C, R>>(
    domain: &Domain<D>,
    sources: &[Sources<'_, D, C>],
    margin: f64,
    pass: &P,
) -> Vec<P::Output> {
    drive::<D, C, R, P::Output>(domain, sources, margin, pass)
}

/// [`for_each_target`] of the leaves with any radius that is more than zero, alone: what a sample costs follows its size. The result is
/// in tree order of all particles of these leaves.
pub fn for_each_in_chosen_leaves<const D: usize, const C: usize, R: Real, P: LeafPass<D, C, R>>(
    domain: &Domain<D>,
    sources: &[Sources<'_, D, C>],
    margin: f64,
    pass: &P,
) -> Vec<P::Output> {
    let Sources { tree, support, .. } = &sources[0];
    let is_chosen = |leaf: &u32| support[tree.nodes[*leaf as usize].places()].iter().any(|h| *h > 0.0);
    drive_leaves::<D, C, R, P::Output>(domain, sources, margin, (pass, &is_chosen))
}

/// [`for_each_target`] with a pass that was chosen at run time.
pub(crate) fn drive<const D: usize, const C: usize, R: Real, O: Copy + Send + Default>(
    domain: &Domain<D>,
    sources: &[Sources<'_, D, C>],
    margin: f64,
    pass: &dyn DynPass<D, C, R, O>,
) -> Vec<O> {
    drive_leaves(domain, sources, margin, (pass, &|_| true))
}

/// Targets for which sources are picked out of what their leaf may see.
fn targets_at_once<R: Real>() -> usize {
    if R::DOUBLE { LEAF_SIZE } else { PART_OF_LEAF }
}

/// A group of neighboring leaves, and where the results of their particles go.
struct Task<'o, O> {
    leaves: Vec<u32>,
    out: &'o mut [O],
}

fn drive_leaves<const D: usize, const C: usize, R: Real, O: Copy + Send + Default>(
    domain: &Domain<D>,
    sources: &[Sources<'_, D, C>],
    margin: f64,
    (pass, is_chosen): (&dyn DynPass<D, C, R, O>, &dyn Fn(&u32) -> bool),
) -> Vec<O> {
    let (tree, support) = (sources[0].tree, sources[0].support);
    let groups: Vec<Vec<u32>> = tree
        .leaf_groups()
        .map(|leaves| leaves.iter().filter(|leaf| is_chosen(leaf)).copied().collect())
        .filter(|leaves: &Vec<u32>| !leaves.is_empty())
        .collect();
    let size = |leaves: &[u32]| leaves.iter().map(|&leaf| tree.nodes[leaf as usize].count as usize).sum::<usize>();
    let mut out = vec![O::default(); groups.iter().map(|leaves| size(leaves)).sum()];
    let mut tasks = Vec::with_capacity(groups.len());
    let mut rest = out.as_mut_slice();
    for leaves in groups {
        let (mine, others) = rest.split_at_mut(size(&leaves));
        tasks.push(Task { leaves, out: mine });
        rest = others;
    }
    let arch = Arch::new();
    let radius = |places: Range<usize>| margin * support[places].iter().fold(0.0_f64, |m, h| m.max(*h));
    let reach = |leaf: &u32| radius(tree.nodes[*leaf as usize].places());
    tasks.into_par_iter().with_min_len(GROUPS_AT_ONCE).for_each_init(
        || (Batch::<D, C, R>::new(domain, sources), Near::default()),
        |(batch, near), Task { leaves, mut out }| {
            let widest = leaves.iter().map(reach).fold(0.0, f64::max);
            near.look(domain, sources, &Cuboid::around(leaves.iter().map(|&leaf| &tree.nodes[leaf as usize])), widest);
            for leaf in &leaves {
                batch.enter(*leaf);
                let places = batch.targets();
                arch.dispatch(Gather { batch: &mut *batch, near, reach: reach(leaf) });
                for first in places.clone().step_by(targets_at_once::<R>()) {
                    let targets = first..places.end.min(first + targets_at_once::<R>());
                    let (mine, others) = out.split_at_mut(targets.len());
                    out = others;
                    arch.dispatch(Turn { reach: radius(targets.clone()), batch: &mut *batch, targets });
                    pass.leaf(arch, batch, mine);
                }
            }
        },
    );
    out
}
