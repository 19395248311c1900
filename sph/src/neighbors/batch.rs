//! Leaf-batched gathering: the buffers that targets of one leaf run over.
//!
//! Buffers hold positions relative to the leaf's center in units of the leaf's largest reach, so f32 resolves
//! about 1e-7 of a support radius whatever the units and wherever the leaf is; sums over them are good to a
//! few 1e-7 relative. With f64 buffers the same code gives the reference.

use super::tree::{LEAF_SIZE, Tree};
use crate::domain::{AxisImage, Domain};
use crate::lanes::{MAX_LANES, Real};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

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
    tree: &'a Tree<D>,
    channels: [&'a [f64]; C],
    reach: Reach,
    /// Largest support radius below each node, and the radii; empty for [`Reach::Target`].
    node_reach: Vec<f64>,
    support: &'a [f64],
    /// The first `D` channels are a vector, whose components change sign in mirror images.
    vector: bool,
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
    fn reach_of(&self, node: usize, own: f64) -> f64 {
        match self.reach {
            Reach::Target => own,
            Reach::Either => self.node_reach[node].max(own),
            Reach::Source => self.node_reach[node],
        }
    }
}

/// Scales of a batch: buffer value times scale is the value in code units.
#[derive(Debug, Clone, Copy)]
pub struct BatchUnit<const C: usize> {
    pub length: f64,
    pub channels: [f64; C],
}

/// What a pass does with the targets of one leaf.
pub trait LeafPass<const D: usize, const C: usize, R: Real>: Sync {
    type Output: Copy + Send + Default;

    /// Fills `out`, one entry per target of the leaf (`batch.targets()` in order).
    fn leaf<S: Simd>(&self, simd: S, batch: &mut Batch<'_, D, C, R>, out: &mut [Self::Output]);
}

/// Gathered neighbors of one leaf.
pub struct Batch<'a, const D: usize, const C: usize, R: Real> {
    domain: &'a Domain<D>,
    sources: &'a [Sources<'a, D, C>],
    first: usize,
    count: usize,
    center: [f64; D],
    half: [f64; D],
    unit: BatchUnit<C>,
    used: usize,
    positions: [Vec<R>; D],
    channels: [Vec<R>; C],
}

/// The first `count` of each array as registers. A loop: closures over arrays are not always inlined here.
#[inline(always)]
fn all_vectors<const N: usize, R: Real, S: Simd>(arrays: &[Vec<R>; N], count: usize) -> [&[R::Vector<S>]; N] {
    let mut out: [&[R::Vector<S>]; N] = [&[]; N];
    for k in 0..N {
        out[k] = R::vectors::<S>(&arrays[k][..count]);
    }
    out
}

impl<'a, const D: usize, const C: usize, R: Real> Batch<'a, D, C, R> {
    fn new(domain: &'a Domain<D>, sources: &'a [Sources<'a, D, C>]) -> Self {
        Self {
            domain,
            sources,
            first: 0,
            count: 0,
            center: [0.0; D],
            half: [0.0; D],
            unit: BatchUnit { length: 1.0, channels: [1.0; C] },
            used: 0,
            positions: std::array::from_fn(|_| Vec::new()),
            channels: std::array::from_fn(|_| Vec::new()),
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
            out[k] = R::from_f64((tree.positions[k][i] - self.center[k]) / self.unit.length);
        }
        out
    }

    /// Channel `c` of the target at tree position `i` in buffer units.
    #[inline(always)]
    pub fn target_channel(&self, c: usize, i: usize) -> f64 {
        self.sources[0].channels[c][i] / self.unit.channels[c]
    }

    /// Position and channel registers of all gathered sources. What pads the last registers lies beyond every
    /// support and has zero channels.
    #[inline(always)]
    pub fn registers<S: Simd>(&self) -> ([&[R::Vector<S>]; D], [&[R::Vector<S>]; C]) {
        let padded = self.used.next_multiple_of(MAX_LANES);
        (all_vectors::<D, R, S>(&self.positions, padded), all_vectors::<C, R, S>(&self.channels, padded))
    }

    fn enter(&mut self, leaf: u32) {
        let tree = self.sources[0].tree;
        let node = &tree.nodes[leaf as usize];
        self.first = node.first as usize;
        self.count = node.count as usize;
        self.center = crate::array(|k| 0.5 * (node.lo[k] + node.hi[k]));
        // A little wider than exact, so that rounding loses no neighbor.
        self.half = crate::array(|k| 0.5 * (node.hi[k] - node.lo[k]) * (1.0 + 1e-6));
        for c in 0..C {
            let largest = self.sources[0].channels[c][self.targets()].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            self.unit.channels[c] = if largest > 0.0 { largest } else { 1.0 };
        }
    }

    /// Gathers anew from within a pass, where it is rare: compiled once, without the pass's instructions.
    #[inline(never)]
    pub fn gather_again(&mut self, reach: f64) {
        self.gather(reach);
    }

    /// Gathers all that lies within `reach` of the leaf's box.
    #[inline(always)]
    fn gather(&mut self, reach: f64) {
        self.used = 0;
        self.unit.length = reach;
        for s in 0..self.sources.len() {
            if self.sources[s].silent || self.sources[s].tree.is_empty() {
                continue;
            }
            let widest = self.sources[s].reach_of(0, reach);
            let images: [Vec<AxisImage>; D] = std::array::from_fn(|k| {
                let span = self.half[k] + widest;
                if self.center[k] - span >= self.domain.lo[k] && self.center[k] + span <= self.domain.hi[k] {
                    vec![AxisImage::IDENTITY]
                } else {
                    self.domain.axis_images(k, self.center[k] - span, self.center[k] + span)
                }
            });
            let combinations: usize = images.iter().map(Vec::len).product();
            for mut combination in 0..combinations {
                let image = std::array::from_fn(|k| {
                    let chosen = images[k][combination % images[k].len()];
                    combination /= images[k].len();
                    chosen
                });
                self.gather_image(s, &image, reach);
            }
        }
        self.pad();
    }

    #[inline(always)]
    fn gather_image(&mut self, s: usize, image: &[AxisImage; D], reach: f64) {
        let source = &self.sources[s];
        let nodes = &source.tree.nodes;
        // The leaf's box seen from the original: an image is its own inverse up to the sign of the shift.
        let center: [f64; D] = crate::array(|k| image[k].sign * (self.center[k] - image[k].shift));
        let mut at = 0;
        while at < nodes.len() {
            let node = &nodes[at];
            let mut gap2 = 0.0;
            for k in 0..D {
                let gap = (node.lo[k] - center[k] - self.half[k]).max(center[k] - self.half[k] - node.hi[k]).max(0.0);
                gap2 += gap * gap;
            }
            let reach = source.reach_of(at, reach);
            if gap2 > reach * reach {
                at = node.skip as usize;
            } else {
                if node.skip as usize == at + 1 {
                    self.gather_leaf(s, image, node.first as usize, node.count as usize, reach);
                }
                at += 1;
            }
        }
    }

    /// Appends those of a source leaf that are near enough. `reach` already includes the leaf's own radii.
    #[inline(always)]
    fn gather_leaf(&mut self, s: usize, image: &[AxisImage; D], first: usize, count: usize, reach: f64) {
        let source = &self.sources[s];
        let needed = (self.used + count).next_multiple_of(MAX_LANES) + MAX_LANES;
        if self.positions[0].len() < needed {
            let size = needed * 2;
            self.positions.iter_mut().for_each(|p| p.resize(size, R::default()));
            self.channels.iter_mut().for_each(|c| c.resize(size, R::default()));
        }
        let mut relative = [[0.0_f64; LEAF_SIZE]; D];
        let mut gap2 = [0.0_f64; LEAF_SIZE];
        for k in 0..D {
            let (sign, shift, half) = (image[k].sign, image[k].shift - self.center[k], self.half[k]);
            let x = &source.tree.positions[k][first..first + count];
            for ((y, g), &x) in relative[k].iter_mut().zip(&mut gap2).zip(x) {
                *y = sign * x + shift;
                let gap = (y.abs() - half).max(0.0);
                *g += gap * gap;
            }
        }
        let (limit, scale) = (reach * reach, 1.0 / self.unit.length);
        let channel_scale: [f64; C] = crate::array(|c| {
            let sign = if source.vector && c < D { image[c].sign } else { 1.0 };
            sign / self.unit.channels[c]
        });
        let mut used = self.used;
        for j in 0..count {
            for k in 0..D {
                self.positions[k][used] = R::from_f64(relative[k][j] * scale);
            }
            for c in 0..C {
                self.channels[c][used] = R::from_f64(source.channels[c][first + j] * channel_scale[c]);
            }
            used += usize::from(gap2[j] < limit);
        }
        self.used = used;
    }

    /// Fills up the last registers with sources that no kernel reaches.
    fn pad(&mut self) {
        let padded = self.used.next_multiple_of(MAX_LANES);
        if self.positions[0].len() < padded {
            self.positions.iter_mut().for_each(|p| p.resize(padded, R::default()));
            self.channels.iter_mut().for_each(|c| c.resize(padded, R::default()));
        }
        for j in self.used..padded {
            self.positions.iter_mut().for_each(|p| p[j] = R::from_f64(FAR));
            self.channels.iter_mut().for_each(|c| c[j] = R::default());
        }
    }

    /// Position of gathered source `j` in buffer units.
    #[inline(always)]
    pub fn position(&self, j: usize) -> [R; D] {
        crate::array(|k| self.positions[k][j])
    }

    /// Channel `c` of gathered source `j` in buffer units.
    #[inline(always)]
    pub fn channel(&self, c: usize, j: usize) -> R {
        self.channels[c][j]
    }

    /// How many sources are in the buffers.
    pub fn len(&self) -> usize {
        self.used
    }

    pub fn is_empty(&self) -> bool {
        self.used == 0
    }

    /// Support radius of source `0`'s particle at tree position `i`.
    pub fn support(&self, i: usize) -> f64 {
        self.sources[0].support[i]
    }
}

/// Buffer position of padding: its square still fits f32, and no support radius is 1e8 times the leaf's reach.
const FAR: f64 = 1e8;

/// Leaves that one parallel task takes.
const LEAVES_PER_TASK: usize = 32;

/// Apart from [`Leaf`], so that gathering is compiled once for all passes.
struct Gather<'b, 'a, const D: usize, const C: usize, R: Real> {
    batch: &'b mut Batch<'a, D, C, R>,
    reach: f64,
}

impl<const D: usize, const C: usize, R: Real> WithSimd for Gather<'_, '_, D, C, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.batch.gather(self.reach);
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
    let is_chosen = |leaf: &&u32| {
        let node = &tree.nodes[**leaf as usize];
        support[node.places()].iter().any(|h| *h > 0.0)
    };
    let leaves: Vec<u32> = tree.leaves.iter().filter(is_chosen).copied().collect();
    drive_leaves::<D, C, R, P::Output>(domain, sources, margin, (pass, &leaves))
}

/// [`for_each_target`] with a pass that was chosen at run time.
pub(crate) fn drive<const D: usize, const C: usize, R: Real, O: Copy + Send + Default>(
    domain: &Domain<D>,
    sources: &[Sources<'_, D, C>],
    margin: f64,
    pass: &dyn DynPass<D, C, R, O>,
) -> Vec<O> {
    drive_leaves(domain, sources, margin, (pass, &sources[0].tree.leaves))
}

fn drive_leaves<const D: usize, const C: usize, R: Real, O: Copy + Send + Default>(
    domain: &Domain<D>,
    sources: &[Sources<'_, D, C>],
    margin: f64,
    (pass, leaves): (&dyn DynPass<D, C, R, O>, &[u32]),
) -> Vec<O> {
    let tree = sources[0].tree;
    let targets = leaves.iter().map(|&leaf| tree.nodes[leaf as usize].count as usize).sum();
    let mut out = vec![O::default(); targets];
    let mut tasks = Vec::with_capacity(leaves.len() / LEAVES_PER_TASK + 1);
    let mut rest = out.as_mut_slice();
    for leaves in leaves.chunks(LEAVES_PER_TASK) {
        let size = leaves.iter().map(|&l| tree.nodes[l as usize].count as usize).sum();
        let (mine, others) = rest.split_at_mut(size);
        tasks.push((leaves, mine));
        rest = others;
    }
    let arch = Arch::new();
    tasks.into_par_iter().for_each_init(
        || Batch::<D, C, R>::new(domain, sources),
        |batch, (leaves, mut out)| {
            for &leaf in leaves {
                batch.enter(leaf);
                let (mine, others) = out.split_at_mut(batch.count);
                out = others;
                let widest = batch.targets().fold(0.0_f64, |m, i| m.max(batch.support(i)));
                arch.dispatch(Gather { batch: &mut *batch, reach: widest * margin });
                pass.leaf(arch, batch, mine);
            }
        },
    );
    out
}
