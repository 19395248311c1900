//! Tests of the quantities that ALARIC's integrator should conserve: with friction, viscosity and velocity stops switched off and a uniform
//! target, the fictitious fluid is isolated.
//!
//! The pressure n - n*/kappa is that of an energy per particle of u = ln n + n*/(kappa n), for du/dn = p/n^2. The sum
//! of kinetic and internal energy then stays what it was, as does the momentum, up to the time step, the
//! tolerance of the support radii and the precision of the sums. Where the target varies, the force is that of no
//! potential, and neither is conserved.

use super::control::Control;
use super::fluid::{AlaricOptions, Fluid};
use crate::target::{Positions, Target};
use sph::kernel::KernelName;
use sph::lanes::Real;
use sph::reduce;

/// Drifts over a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Largest change of the total energy, over the largest kinetic energy.
    pub energy: f64,
    /// Largest net momentum, over the sum of the particles' momenta.
    pub momentum: f64,
    /// Duration, in times in which sound crosses the domain.
    pub time: f64,
}

/// Follows the fluid for `options.steps` steps. `target` has to be uniform and its domain without open walls;
/// friction, viscosity and stops are switched off.
pub fn conservation<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &AlaricOptions,
    control: &Control<'_>,
) -> Drift {
    let options = AlaricOptions { friction: 0.0, viscosity: false, velocity_stops: false, ..*options };
    rayon::scope(|_| {
        let mut fluid = Fluid::<D, R>::new(kernel, *target, positions, &options);
        fluid.refit_mass();
        let start = fluid.energy();
        let (mut change, mut kinetic, mut momentum) = (0.0_f64, 0.0_f64, 0.0_f64);
        for _ in 0..options.steps {
            if control.stop_reason().is_some() {
                break;
            }
            fluid.advance();
            change = change.max((fluid.energy() - start).abs());
            kinetic = kinetic.max(fluid.kinetic_energy());
            momentum = momentum.max(net_momentum(&fluid.velocities));
        }
        Drift { energy: change / kinetic, momentum, time: fluid.time / target.domain.size() }
    })
}

/// |sum v| / sum |v|.
fn net_momentum<const D: usize>(velocities: &[[f64; D]]) -> f64 {
    let n = velocities.len();
    let net = (0..D).map(|k| reduce::sum(n, |i| velocities[i][k]).powi(2)).sum::<f64>().sqrt();
    net / reduce::sum(n, |i| velocities[i].iter().map(|v| v * v).sum::<f64>().sqrt())
}
