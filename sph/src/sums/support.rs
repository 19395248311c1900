//! Support radii that belong to a neighbor number: n_a V_d H_a^d = N_H (ALARIC sec. 1), and the sums at these radii.

use super::density::{DensitySums, density_sums};
use crate::domain::Domain;
use crate::exchange::Exchange;
use crate::geometry::unit_ball_volume;
use crate::kernel::{Kernel, KernelName, support_over_spacing, with_kernel};
use crate::lanes::Real;
use crate::neighbors::{Batch, Compiled, LeafPass, Shape, Sources, compiled, in_shape};
use crate::parallel;
use pulp::Simd;
use std::any::Any;

/// Support radius and the sums at it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Solved<const D: usize> {
    pub support: f64,
    pub sums: DensitySums<D>,
}

struct SolvePass<K> {
    kernel: K,
    kernel_neighbors: f64,
    tolerance: f64,
    largest: f64,
}

/// How support radii are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Relative accuracy of n V_d H^d = N_H.
    pub tolerance: f64,
    /// Reach of the first gathering over the largest guess of the leaf.
    pub margin: f64,
}

impl Search {
    /// From guesses of any quality to what f32 sums do not resolve.
    pub const EXACT: Self = Self { tolerance: FINEST, margin: SOLVE_MARGIN };
}

/// Finer than what f32 sums resolve.
const FINEST: f64 = 1e-6;
/// Newton converges in three or four steps, bisection needs some forty.
const MAX_SUPPORT_STEPS: usize = 80;
/// Reach of gathering over radii that may still be far off.
const SOLVE_MARGIN: f64 = 1.15;

impl<const D: usize, const C: usize, K: Kernel, R: Real> LeafPass<D, C, R> for SolvePass<K> {
    type Output = Solved<D>;

    #[inline(always)]
    fn leaf<S: Simd>(&self, simd: S, batch: &mut Batch<'_, D, C, R>, out: &mut [Self::Output]) {
        for (i, out) in batch.targets().zip(out) {
            *out = self.solve::<D, C, R, S>(simd, batch, i);
        }
    }
}

impl<K: Kernel> SolvePass<K> {
    /// Newton in ln H on ln(n V_d H^d / N_H), bracketed; gathers anew where the root lies beyond the reach. Within the tolerance the last
    /// step is made without sums at its end: H and n are those of the root to its square, all else is of where they were summed.
    #[inline(always)]
    fn solve<const D: usize, const C: usize, R: Real, S: Simd>(
        &self,
        simd: S,
        batch: &mut Batch<'_, D, C, R>,
        i: usize,
    ) -> Solved<D> {
        let target = self.kernel_neighbors / unit_ball_volume(D);
        let (mut lo, mut hi) = (0.0_f64, f64::INFINITY);
        let mut support = batch.support(i).min(self.largest);
        let mut sums = DensitySums::default();
        for _ in 0..MAX_SUPPORT_STEPS {
            if support > batch.reach() {
                batch.gather_again(support * SOLVE_MARGIN);
            }
            sums = density_sums::<D, C, K, R, S>(simd, self.kernel, batch, i, support);
            let count = sums.number_density * support.powi(D as i32);
            let excess = (count / target).ln();
            let rate = D as f64 + sums.slope / sums.number_density;
            if excess.abs() < self.tolerance && excess.abs() > FINEST && rate > 0.0 {
                support = (support * (-excess / rate).exp()).min(self.largest);
                sums.number_density = target / support.powi(D as i32);
                break;
            }
            if excess.abs() < FINEST || (support >= self.largest && excess < 0.0) {
                break;
            }
            if excess > 0.0 {
                hi = support
            } else {
                lo = support
            }
            if hi / lo < 1.0 + 1e-12 {
                break;
            }
            let newton = support * (-excess / rate).clamp(-1.0, 1.0).exp();
            support = if rate > 0.0 && newton > lo && newton < hi {
                newton
            } else if hi.is_finite() {
                if lo > 0.0 { (lo * hi).sqrt() } else { 0.5 * hi }
            } else {
                2.0 * support
            }
            .min(self.largest);
        }
        Solved { support, sums }
    }
}

/// Solves n V_d H^d = N_H for every particle; the guess, which is the support of the first source, is in tree order, as is the result. No radius exceeds
/// `largest` (where fewer than N_H particles exist in an open domain, there is no solution).
pub fn solve_support_radii<const D: usize, const C: usize, R: Real>(
    kernel: KernelName,
    domain: &Domain<D>,
    sources: &[Sources<'_, D, C>],
    (kernel_neighbors, search): (f64, Search),
    largest: f64,
) -> Vec<Solved<D>> {
    let pass = |shape| solve_pass(kernel, (kernel_neighbors, search.tolerance), largest, shape);
    compiled::<D, C, R, Solved<D>>(pass).drive(domain, sources, search.margin)
}

fn solve_pass(
    kernel: KernelName,
    (kernel_neighbors, tolerance): (f64, f64),
    largest: f64,
    shape: Shape,
) -> Box<dyn Any> {
    in_shape!(shape, D, R => with_kernel!(kernel, kernel => {
        let pass = SolvePass { kernel, kernel_neighbors, tolerance, largest };
        match shape.channels {
            0 => Box::new(Compiled::<D, 0, R, Solved<D>>::new(pass)),
            _ => Box::new(Compiled::<D, 1, R, Solved<D>>::new(pass)),
        }
    }))
}

/// Support radii to begin a solution with: those of particles whose spacings n^(-1/d) are `spacing(i)`, for `i` in
/// `0..count`. In the unit of the spacings.
pub fn support_guess<const D: usize>(
    kernel_neighbors: f64,
    count: usize,
    spacing: impl Fn(usize) -> f64 + Sync,
) -> Vec<f64> {
    let ratio = support_over_spacing(D, kernel_neighbors);
    parallel::map(count, |i| ratio * spacing(i))
}

/// Reach of the first solution over guessed radii, and of the next over those that came out, which are solved to less.
const FIRST_REACH: f64 = 1.3;
const SOLVED: f64 = 1.0 + 1e-4;

/// Support radii of particles over several ranks. `solve` finds them with what others have within a reach of each particle, and is called once more
/// where a radius came out beyond its reach: with neighbors missing it comes out too large, so that the second reach is enough. Nothing is looked
/// for beyond `largest`. All ranks call it together.
pub fn solve_within_reach<const D: usize>(
    exchange: &dyn Exchange,
    (guess, largest): (&[f64], f64),
    mut solve: impl FnMut(&[f64]) -> Vec<Solved<D>>,
) -> Vec<Solved<D>> {
    let mut reach = parallel::map(guess.len(), |i| (FIRST_REACH * guess[i]).min(largest));
    loop {
        let solved = solve(&reach);
        let wanted = |i: usize| solved[i].support.min(largest);
        if !exchange.any((0..solved.len()).any(|i| wanted(i) > reach[i])) {
            return solved;
        }
        parallel::update(&mut reach, |i, r| *r = r.max((SOLVED * wanted(i)).min(largest)));
    }
}

/// Largest support radius that makes sense in a domain: with periodic or mirrored images any number of
/// neighbors can be had, in an open one no more than the particles that exist.
pub fn largest_support<const D: usize>(domain: &Domain<D>, count: usize, kernel_neighbors: f64) -> f64 {
    let mean = (kernel_neighbors * domain.volume() / (unit_ball_volume(D) * count.max(1) as f64)).powf(1.0 / D as f64);
    let diagonal = domain.extent().iter().map(|e| e * e).sum::<f64>().sqrt();
    2.0 * diagonal.max(mean)
}
