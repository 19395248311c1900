//! The options of the density solver, and the parts of its descent, see [`super::solver`].

use sph::kernel::{KernelName, default_kernel_neighbors, most_neighbors_without_pairs, own_count};

/// Parameters of the solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverOptions {
    /// N_H = V_d n H^d.
    pub kernel_neighbors: f64,
    /// Evaluations of the objective, at most.
    pub evaluations: usize,
    /// What matters more: 0 the exact density, 1 quiet forces.
    pub quietness: f64,
    /// Stop when epsilon (re-fitted, as measured in the end) is below.
    pub tolerance: f64,
    /// What the latter half of the evaluations has to lower the energy of a particle by, in units of its pressure energy, for more to be
    /// made; 0 makes them all.
    pub least_gain: f64,
    /// The start is in order (shells, a lattice, a glass): there is no stage that brings it to rest.
    pub settled: bool,
    /// Particles aim at the target as the kernel sees it, wherever it is resolved: mass lies where the target has it, and densities
    /// are those of the kernel.
    pub smoothed: bool,
}

impl SolverOptions {
    /// The defaults in `D` dimensions.
    pub fn new(d: usize) -> Self {
        Self {
            kernel_neighbors: default_kernel_neighbors(d),
            evaluations: 100,
            quietness: 0.7,
            tolerance: 0.0,
            least_gain: if d == 3 { LEAST_GAIN } else { LEAST_GAIN_IN_FEWER },
            settled: false,
            smoothed: false,
        }
    }

    /// The quietest forces with which epsilon gets below `tolerance`: with the weight lambda it ends between about
    /// 1e-3 (a uniform box) and 3e-2 lambda^2 (a planet's jump), as the default does in `cargo bench --bench tolerances`.
    pub fn quietness_for(tolerance: f64) -> f64 {
        let lambda = (tolerance / 2.5e-2).sqrt();
        (1.0 + lambda.log10() / QUIETNESS_DECADES).clamp(0.0, 1.0)
    }

    /// The stages for `kernel` in `d` dimensions.
    pub(super) fn schedule(&self, kernel: KernelName, d: usize) -> Vec<Stretch> {
        // 0 at the end: an exact density leaves no room for the pressure energy.
        let last = if self.quietness > 0.0 { 10f64.powf(QUIETNESS_DECADES * (self.quietness - 1.0)) } else { 0.0 };
        let single = self.settled || self.tolerance > 0.0;
        let own = |lambda, share| Stretch { kernel, kernel_neighbors: self.kernel_neighbors, lambda, share };
        let at_rest = if single { last } else { 1.0 };
        match most_neighbors_without_pairs(kernel, d) {
            Some(most) => {
                let (kernel, kernel_neighbors) = (KernelName::default(), default_kernel_neighbors(d));
                // Without a pressure energy of its own the last stage is the shorter the quieter the end is to be.
                let (last, share) = match self.kernel_neighbors > most {
                    true => (0.0, 0.4 * (2.0 - 2.0 * self.quietness).min(1.0)),
                    false => (last, 0.4),
                };
                vec![Stretch { kernel, kernel_neighbors, lambda: at_rest, share: 1.0 - share }, own(last, share)]
            }
            None if single => vec![own(last, 1.0)],
            None => vec![own(at_rest, 0.6), own(last, 0.4)],
        }
    }
}

/// A part of the descent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    pub kernel: KernelName,
    pub kernel_neighbors: f64,
    /// Weight of the pressure energy, before [`weight_with`].
    pub lambda: f64,
    /// Of the evaluations.
    pub share: f64,
}

/// Decades of lambda between most exact and most quiet, where it is 1.
const QUIETNESS_DECADES: f64 = 5.0;

/// Weight of the pressure energy with any kernel for one `lambda`, which is meant for the default kernel and
/// neighbor number. Both sums change with what one neighbor counts, the energy in proportion, the squares faster:
/// the weight follows the share that a particle has in its own density.
pub(super) fn weight_with(kernel: KernelName, d: usize, kernel_neighbors: f64, lambda: f64) -> f64 {
    let usual = own_count(KernelName::default(), d) / default_kernel_neighbors(d);
    lambda * own_count(kernel, d) / kernel_neighbors / usual
}

/// The square of the force noise in 3-D, in percent of a random set's, falls by some 3000 times what the energy does: twice as
/// many evaluations would lower a noise of 2 % to 1.75 %. In 2-D it is three times as much, and neighbors are few.
const LEAST_GAIN: f64 = 3e-4;
const LEAST_GAIN_IN_FEWER: f64 = 1e-5;
