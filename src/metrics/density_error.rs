//! Deviation of the summed density from the target.

use super::Measured;
use serde::Serialize;
use sph::exchange::{Alone, Exchange};
use sph::{parallel, reduce};

/// Figures over one set of particles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorFigures {
    /// How many particles are in the set.
    pub particles: usize,
    /// sum (rho - rho*)^2/n / sum rho*^2/n (ALARIC sec. 2).
    pub epsilon: f64,
    /// Mean |rho/rho* - 1|.
    pub mean: f64,
    /// What 99 % of the particles stay below in |rho/rho* - 1|.
    pub most: f64,
    /// Largest |rho/rho* - 1|.
    pub max: f64,
}

/// Density error with the mass as given (so that the total is right) and with the mass re-fitted
/// (m <- m mean(rho*/rho), which removes a constant factor such as the bias of the self-contribution), over all particles
/// and over the interior, see [`Measured::interior`]. The mean leaves out what differs from the median by more than a
/// factor of two, so that a few particles do not make it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DensityError {
    /// Over all particles, the mass as given, against the target as the kernel sees it: what surfaces, cusps and jumps do to
    /// any arrangement is not counted, what this one does wrong is.
    pub smoothed: Option<ErrorFigures>,
    /// What the kernel alone does at this resolution: the target as it sees it against the target itself, over all
    /// particles.
    pub kernel_limit: Option<ErrorFigures>,
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
    /// over volume of the measurement, and with `smoothed`, the target as the kernel sees it, where it is known.
    pub fn new<const D: usize>(measured: &Measured<D>, target: &[f64], smoothed: Option<&[f64]>) -> Self {
        Self::among(&Alone, measured, target, smoothed)
    }

    /// [`Self::new`] of particles that are over several ranks.
    pub fn among<const D: usize>(
        exchange: &dyn Exchange,
        measured: &Measured<D>,
        target: &[f64],
        smoothed: Option<&[f64]>,
    ) -> Self {
        let n = target.len();
        let sums = &measured.sums[..measured.own()];
        let density: Vec<f64> = sums.iter().map(|s| s.weighted).collect();
        let volume: Vec<f64> = sums.iter().map(|s| 1.0 / s.number_density).collect();
        // Beyond a surface, where a balance may leave particles, there is no target.
        let everywhere: Vec<bool> = target.iter().map(|rho| *rho > 0.0).collect();
        let inside = &measured.interior[..n];
        let refit = |set: &[bool]| refit(exchange, &density, target, set);
        let (refit_all, refit_interior) = (refit(&everywhere), refit(inside));
        let figures_of =
            |density: (&[f64], f64), target: &[f64], set: &[bool]| figures(exchange, density, target, &volume, set);
        let figures = |set: &[bool], factor: f64| figures_of((&density, factor), target, set);
        let any = exchange.any(inside.iter().any(|&i| i));
        let edge: Vec<bool> = (0..n).map(|i| everywhere[i] && !inside[i]).collect();
        Self {
            smoothed: smoothed.map(|s| {
                let seen: Vec<bool> = s.iter().map(|rho| *rho > 0.0).collect();
                figures_of((&density, 1.0), s, &seen)
            }),
            kernel_limit: smoothed.map(|s| figures_of((s, 1.0), target, &everywhere)),
            all: figures(&everywhere, 1.0),
            all_refitted: figures(&everywhere, refit_all),
            interior: any.then(|| figures(inside, 1.0)),
            interior_refitted: any.then(|| figures(inside, refit_interior)),
            edge_refitted: (any && exchange.any(edge.contains(&true))).then(|| figures(&edge, refit_interior)),
            refit_all,
            refit_interior,
        }
    }

    /// Mean and epsilon against the target or `smoothed`, the target as the kernel sees it, whichever is nearer to what each particle has:
    /// stages make the density that of the target wherever an arrangement can have it. Over all particles of all ranks, with the mass
    /// re-fitted by no more than `most_bias`, which is what the self-contribution can do. In the mean a difference counts over the larger of the two
    /// densities: a few particles in next to nothing do not make it.
    pub(super) fn against_either(
        exchange: &dyn Exchange,
        (density, volume): (&[f64], &[f64]),
        target: &[f64],
        smoothed: &[f64],
        most_bias: f64,
    ) -> (f64, f64) {
        let everywhere = vec![true; smoothed.len()];
        let factor = refit(exchange, density, smoothed, &everywhere).clamp(1.0 - most_bias, 1.0 + most_bias);
        let nearer = |i: usize| {
            let off = |wanted: f64| (factor * density[i] / wanted - 1.0).abs();
            if off(target[i]) < off(smoothed[i]) { target[i] } else { smoothed[i] }
        };
        let wanted = parallel::map(target.len(), nearer);
        let bounded = |i: usize| {
            let found = factor * density[i];
            (found - wanted[i]).abs() / found.max(wanted[i])
        };
        let [sum, count] = exchange.together([reduce::sum(wanted.len(), bounded), wanted.len() as f64]);
        (sum / count, figures(exchange, (density, factor), &wanted, volume, &everywhere).epsilon)
    }

    /// The mean over a set against the target, with the mass re-fitted, of all ranks; none of an empty set.
    pub(super) fn mean_refitted(
        exchange: &dyn Exchange,
        (density, volume): (&[f64], &[f64]),
        target: &[f64],
        set: &[bool],
    ) -> Option<f64> {
        let factor = refit(exchange, density, target, set);
        exchange.any(set.contains(&true)).then(|| figures(exchange, (density, factor), target, volume, set).mean)
    }

    /// The figures that a tolerance bounds and by which methods are compared: with the mass re-fitted, over the interior
    /// where there is one.
    pub fn stated(&self) -> &ErrorFigures {
        self.interior_refitted.as_ref().unwrap_or(&self.all_refitted)
    }
}

/// mean(rho*/rho) over those of a set that are within a factor of two of their median.
pub(super) fn refit(exchange: &dyn Exchange, density: &[f64], target: &[f64], set: &[bool]) -> f64 {
    let ratio = |i: usize| target[i] / density[i];
    let mut ratios: Vec<f64> = (0..set.len()).filter(|&i| set[i]).map(ratio).collect();
    let all = exchange.count(ratios.len());
    if all == 0 {
        return 1.0;
    }
    let median = exchange.nth(&mut ratios, all / 2);
    let counts = |i: usize| set[i] && ratio(i) > 0.5 * median && ratio(i) < 2.0 * median;
    let count = exchange.count(parallel::count(set.len(), counts));
    if count == 0 {
        return median;
    }
    exchange.sum(reduce::sum(set.len(), |i| if counts(i) { ratio(i) } else { 0.0 })) / count as f64
}

/// The share of particles that [`ErrorFigures::most`] leaves out.
pub(super) const FEW: f64 = 0.01;

/// Of `density` times `factor` against `target`.
pub(super) fn figures(
    exchange: &dyn Exchange,
    (density, factor): (&[f64], f64),
    target: &[f64],
    volume: &[f64],
    set: &[bool],
) -> ErrorFigures {
    let n = target.len();
    let density = |i: usize| factor * density[i];
    let over = |f: &(dyn Fn(usize) -> f64 + Sync)| exchange.sum(reduce::sum(n, |i| if set[i] { f(i) } else { 0.0 }));
    let particles = exchange.count(set.iter().filter(|&&s| s).count());
    let squares = over(&|i| (density(i) - target[i]).powi(2) * volume[i]);
    let norm = over(&|i| target[i].powi(2) * volume[i]);
    let deviation = |i: usize| (density(i) / target[i] - 1.0).abs();
    let mut deviations: Vec<f64> = (0..n).filter(|&i| set[i]).map(deviation).collect();
    let most = ((1.0 - FEW) * particles as f64) as usize;
    ErrorFigures {
        particles,
        epsilon: squares / norm,
        mean: over(&deviation) / particles as f64,
        max: exchange.max(deviations.iter().fold(f64::NEG_INFINITY, |m, d| m.max(*d))),
        most: if particles > 0 { exchange.nth(&mut deviations, most.min(particles - 1)) } else { 0.0 },
    }
}
