//! Separates particles that are far too close to each other.

use crate::domain::Domain;
use crate::geometry::unit_ball_volume;
use crate::neighbors::{Batch, Compiled, LeafPass, Shape, Sources, compiled, in_shape};
use crate::random::keyed;
use pulp::Simd;
use rand::RngExt;
use std::any::Any;

/// Share of that by which each of a pair moves at random.
const SIDEWAYS: f64 = 0.2;
/// Squared distance, in limits, below which there is no direction from one to the other.
const NO_DIRECTION: f64 = 1e-24;

/// The way that a particle should go, and whether it is one of a pair.
#[derive(Debug, Clone, Copy)]
pub struct Parting<const D: usize> {
    pub shift: [f64; D],
    pub paired: bool,
}

impl<const D: usize> Default for Parting<D> {
    fn default() -> Self {
        Self { shift: [0.0; D], paired: false }
    }
}

/// Which distance two particles are to have that want different ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Apart {
    /// The smaller, of which each goes half the way; a little to the side, too.
    Smaller,
    /// The mean, of which each goes a part in proportion to its own.
    Mean,
    /// The larger, likewise.
    Larger,
}

/// Channel 0: the distance up to which a particle wants to be apart.
struct PartingPass {
    apart: Apart,
    /// The distance that makes a pair over that.
    threshold: f64,
    seed: u64,
    stream: u64,
}

impl<const D: usize> LeafPass<D, 1, f64> for PartingPass {
    type Output = Parting<D>;

    #[inline(always)]
    fn leaf<S: Simd>(&self, _: S, batch: &mut Batch<'_, D, 1, f64>, out: &mut [Parting<D>]) {
        let unit = batch.unit();
        for (i, out) in batch.targets().zip(out) {
            let target = batch.target(i);
            let (mut shift, mut same, mut paired) = ([0.0; D], 0, false);
            for j in 0..batch.len() {
                let x = batch.position(j);
                let (own, other) = (batch.support(i), batch.channel(0, j) * unit.channels[0]);
                let (apart, share) = match self.apart {
                    Apart::Smaller => (own.min(other) / unit.length, 0.5),
                    Apart::Mean => (0.5 * (own + other) / unit.length, own / (own + other)),
                    Apart::Larger => (own.max(other) / unit.length, own / (own + other)),
                };
                let r2 = (0..D).map(|k| (x[k] - target[k]).powi(2)).sum::<f64>();
                if r2 < NO_DIRECTION * apart * apart {
                    same += 1;
                } else if r2 < (self.threshold * apart).powi(2) {
                    paired = true;
                    let r = r2.sqrt();
                    let push = share * (apart - r) * unit.length / r;
                    (0..D).for_each(|k| shift[k] += push * (target[k] - x[k]));
                }
            }
            // One at distance 0 is the particle itself.
            let coincident = same > 1;
            paired |= coincident;
            if coincident || paired && self.apart == Apart::Smaller {
                // A little to the side, too: along a crowded line there is no room.
                let size = batch.support(i) * if coincident { 0.5 } else { SIDEWAYS };
                let way = direction::<D>(i as u64, self.seed, self.stream);
                (0..D).for_each(|k| shift[k] += size * way[k]);
            }
            *out = Parting { shift, paired };
        }
    }
}

/// A random vector no longer than 1 and not much shorter.
fn direction<const D: usize>(particle: u64, seed: u64, stream: u64) -> [f64; D] {
    let mut rng = keyed(seed, stream, particle);
    let tries = (32.0 / unit_ball_volume(D)) as usize;
    for _ in 0..tries {
        let way: [f64; D] = crate::array(|_| 2.0 * rng.random::<f64>() - 1.0);
        let size2 = way.iter().map(|v| v * v).sum::<f64>();
        if (0.25..=1.0).contains(&size2) {
            return way;
        }
    }
    crate::array(|k| if k == 0 { 1.0 } else { 0.0 })
}

/// How every particle of `sources[0]` parts from others within `threshold` of its support radius, which is the distance
/// that it is to have from them; channel 0 is that of the other, and sources reach as far as [`Apart`] asks for. Which way coincident ones go
/// is drawn by `seed` and `stream`.
pub fn partings<const D: usize>(
    domain: &Domain<D>,
    sources: &[Sources<'_, D, 1>],
    (apart, threshold): (Apart, f64),
    (seed, stream): (u64, u64),
) -> Vec<Parting<D>> {
    compiled::<D, 1, f64, Parting<D>>(|shape| parting_pass(PartingPass { apart, threshold, seed, stream }, shape))
        .drive(domain, sources, 1.0)
}

fn parting_pass(pass: PartingPass, shape: Shape) -> Box<dyn Any> {
    in_shape!(shape, D => Box::new(Compiled::<D, 1, f64, Parting<D>>::new(pass)))
}
