//! All measures of one arrangement of particles.

use super::smoothed::{Looking, smoothed_densities};
use super::{
    BalanceFigures, BondOrder, DensityError, Detail, Ledger, LedgerFigures, Measured, NeighborFigures, NoiseFigures,
    Thermodynamics, Wanted,
};
use crate::target::{Positions, Target, at};
use sph::exchange::{Alone, Exchange};
use sph::kernel::KernelName;
use sph::sums::support_guess;

/// Particle columns in internal units, and the figures over them.
pub struct Outcome {
    pub masses: Vec<f64>,
    /// Support radii at the neighbor number asked for.
    pub support: Vec<f64>,
    /// Summed density.
    pub density: Vec<f64>,
    /// Target density.
    pub target_density: Vec<f64>,
    pub density_error: DensityError,
    pub ledger: LedgerFigures,
    pub noise: NoiseFigures,
    pub neighbors: NeighborFigures,
    /// Whether neighbors lie in preferred directions; none in one dimension.
    pub order: Option<BondOrder>,
    /// Where pressure and gravity are known.
    pub balance: Option<BalanceFigures>,
}

impl Outcome {
    /// Measures `positions`, of which there are `target.count`.
    pub fn new<const D: usize>(
        kernel: KernelName,
        (target, ledger): (&Target<'_, D>, &Ledger<D>),
        (positions, masses): (&Positions<D>, Vec<f64>),
        kernel_neighbors: f64,
        thermodynamics: Option<&Thermodynamics<'_, D>>,
    ) -> Self {
        Self::among(&Alone, kernel, (target, ledger), (positions, masses), kernel_neighbors, thermodynamics)
    }

    /// The same with what each particle has.
    pub fn with_detail<const D: usize>(
        kernel: KernelName,
        by: (&Target<'_, D>, &Ledger<D>),
        particles: (&Positions<D>, Vec<f64>),
        kernel_neighbors: f64,
        thermodynamics: Option<&Thermodynamics<'_, D>>,
    ) -> (Self, Detail) {
        let (outcome, Found { measured, smoothed, noise }) =
            Self::found(&Alone, kernel, by, particles, kernel_neighbors, thermodynamics);
        let nearest = measured.nearest_over_spacing(by.0.domain);
        let wanted = Wanted { target: outcome.target_density.clone(), smoothed, resolved: measured.interior };
        let (support, density) = (outcome.support.clone(), outcome.density.clone());
        (outcome, Detail { support, density, noise, nearest, wanted: Some(wanted) })
    }

    /// Measures those of `target.count` particles that this rank has; the figures are over all ranks. The balance is none of theirs.
    pub fn among<const D: usize>(
        exchange: &dyn Exchange,
        kernel: KernelName,
        (target, ledger): (&Target<'_, D>, &Ledger<D>),
        (positions, masses): (&Positions<D>, Vec<f64>),
        kernel_neighbors: f64,
        thermodynamics: Option<&Thermodynamics<'_, D>>,
    ) -> Self {
        Self::found(exchange, kernel, (target, ledger), (positions, masses), kernel_neighbors, thermodynamics).0
    }

    fn found<const D: usize>(
        exchange: &dyn Exchange,
        kernel: KernelName,
        (target, ledger): (&Target<'_, D>, &Ledger<D>),
        (positions, masses): (&Positions<D>, Vec<f64>),
        kernel_neighbors: f64,
        thermodynamics: Option<&Thermodynamics<'_, D>>,
    ) -> (Self, Found<D>) {
        let spacing = |i: usize| target.spacing(target.number_density(&at(positions, i))).min(target.domain.size());
        let guess = support_guess::<D>(kernel_neighbors, positions[0].len(), spacing);
        let mut measured =
            Measured::among(exchange, kernel, target.domain, positions, &masses, &guess, kernel_neighbors);
        drop(guess);
        let groups = measured.groups();
        measured.leave_out_unresolved(target, positions, (&groups, kernel_neighbors));
        let target_density = target.densities(positions);
        let own = measured.own();
        // Each rank would need the points of all.
        let by = (target, Some(ledger).filter(|_| exchange.is_alone()));
        let together = exchange.is_alone().then_some((&groups, target_density.as_slice()));
        let looking = Looking { positions, support: &measured.support[..own], together };
        let smoothed = smoothed_densities(kernel, by, &looking, &mut measured.interior[..own]);
        let density_error = DensityError::among(exchange, &measured, &target_density, Some(&smoothed));
        let shifts = if exchange.is_alone() { ledger.shifts(target, positions) } else { Vec::new() };
        let mut ledger = ledger.figures_among(exchange, &measured, target, positions, &masses);
        ledger.regions.iter_mut().zip(shifts).for_each(|(region, shift)| region.shift = shift);
        let calm = exchange.is_alone().then(|| measured.apart_from_jumps(target, positions));
        let among = (&measured, calm.as_deref().unwrap_or(&measured.interior));
        let (figures, noise) =
            NoiseFigures::with_each(exchange, kernel, among, target.domain, &masses, kernel_neighbors);
        let balance = thermodynamics.filter(|_| exchange.is_alone()).and_then(|t| {
            BalanceFigures::new(kernel, &measured, target.domain, positions, (&masses, &target_density), t)
        });
        let neighbors = measured.neighbors_among(exchange, target.domain, kernel_neighbors);
        let order = BondOrder::sampled(exchange, &measured, target.domain);
        let (support, density) =
            measured.support.iter().zip(&measured.sums).take(own).map(|(&h, s)| (h, s.weighted)).unzip();
        let outcome = Self {
            masses,
            support,
            density,
            target_density,
            density_error,
            ledger,
            noise: figures,
            neighbors,
            order,
            balance,
        };
        (outcome, Found { measured, smoothed, noise })
    }
}

/// What the figures are of.
struct Found<const D: usize> {
    measured: Measured<D>,
    smoothed: Vec<f64>,
    noise: Vec<f64>,
}
