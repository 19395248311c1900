//! Deviation of the summed density from the target.

use super::Measured;
use serde::Serialize;
use sph::reduce;

/// Figures over one set of particles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorFigures {
    /// How many particles are in the set.
    pub particles: usize,
    /// sum (rho - rho*)^2/n / sum rho*^2/n (ALARIC sec. 2).
    pub epsilon: f64,
    /// Mean |rho/rho* - 1|.
    pub mean: f64,
    /// Largest |rho/rho* - 1|.
    pub max: f64,
}

/// Density error with the mass as given (so that the total is right) and with the mass re-fitted
/// (m <- m mean(rho*/rho), which removes a constant factor such as the bias of the self-contribution), over all particles
/// and over the interior, see [`Measured::interior`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DensityError {
    pub all: ErrorFigures,
    pub all_refitted: ErrorFigures,
    pub interior: Option<ErrorFigures>,
    pub interior_refitted: Option<ErrorFigures>,
    /// Everything that is not interior (surfaces, discontinuities, steep places), with the mass re-fitted to the
    /// interior.
    pub edge_refitted: Option<ErrorFigures>,
    /// The factor on the mass in `all_refitted`.
    pub refit_all: f64,
    /// The factor on the mass in `interior_refitted`.
    pub refit_interior: f64,
}

impl DensityError {
    /// Compares the density summed in `measured` with `target`, which is rho* at the particles, in the unit of mass
    /// over volume of the measurement.
    pub fn new<const D: usize>(measured: &Measured<D>, target: &[f64]) -> Self {
        let everywhere = vec![true; target.len()];
        let refit_all = refit(measured, target, &everywhere);
        let inside = &measured.interior;
        let refit_interior = refit(measured, target, inside);
        let figures = |set: &[bool], factor: f64| figures(measured, target, set, factor);
        let any = inside.iter().any(|&i| i);
        let edge: Vec<bool> = inside.iter().map(|i| !i).collect();
        Self {
            all: figures(&everywhere, 1.0),
            all_refitted: figures(&everywhere, refit_all),
            interior: any.then(|| figures(inside, 1.0)),
            interior_refitted: any.then(|| figures(inside, refit_interior)),
            edge_refitted: (any && edge.contains(&true)).then(|| figures(&edge, refit_interior)),
            refit_all,
            refit_interior,
        }
    }

    /// The figures that a tolerance bounds and by which methods are compared: with the mass re-fitted, over the interior
    /// where there is one.
    pub fn stated(&self) -> &ErrorFigures {
        self.interior_refitted.as_ref().unwrap_or(&self.all_refitted)
    }
}

/// mean(rho*/rho) over a set.
fn refit<const D: usize>(measured: &Measured<D>, target: &[f64], set: &[bool]) -> f64 {
    let count = set.iter().filter(|&&s| s).count().max(1);
    reduce::sum(target.len(), |i| if set[i] { target[i] / measured.sums[i].weighted } else { 0.0 }) / count as f64
}

fn figures<const D: usize>(measured: &Measured<D>, target: &[f64], set: &[bool], factor: f64) -> ErrorFigures {
    let n = target.len();
    let density = |i: usize| factor * measured.sums[i].weighted;
    let over = |f: &(dyn Fn(usize) -> f64 + Sync)| reduce::sum(n, |i| if set[i] { f(i) } else { 0.0 });
    let particles = set.iter().filter(|&&s| s).count();
    let volume = |i: usize| 1.0 / measured.sums[i].number_density;
    let squares = over(&|i| (density(i) - target[i]).powi(2) * volume(i));
    let norm = over(&|i| target[i].powi(2) * volume(i));
    ErrorFigures {
        particles,
        epsilon: squares / norm,
        mean: over(&|i| (density(i) / target[i] - 1.0).abs()) / particles as f64,
        max: reduce::max(n, |i| if set[i] { (density(i) / target[i] - 1.0).abs() } else { 0.0 }),
    }
}
