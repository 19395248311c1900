//! The density error that stages monitor.

use crate::target::{Positions, at};
use serde::{Deserialize, Serialize};
use sph::domain::Domain;
use sph::exchange::{Alone, Exchange};
use sph::{parallel, reduce};

/// Density error with the mass re-fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Fit {
    /// kappa = mean(n*/n), the particle mass in units of the one that the target assumes (ALARIC eq. 44).
    pub factor: f64,
    /// sum (kappa n - n*)^2/n / sum n*^2/n (ALARIC eq. 45).
    pub epsilon: f64,
}

/// Weight of a particle whose target is as sharp as [`crate::target::Target::sharpness`] says: from 1 where no
/// edge is near to 0 where no sum over neighbors can follow.
pub(super) fn resolved(sharpness: f64) -> f64 {
    1.0 / (1.0 + sharpness.powi(4))
}

/// Particles whose support lies in the domain and whose weight (none given: 1) is more than half: at an edge
/// into vacuum and at jumps no arrangement meets the target. `None` where those are few, so that all count.
pub(super) fn interior<const D: usize>(
    domain: &Domain<D>,
    positions: &Positions<D>,
    support: &[f64],
    weights: Option<&[f64]>,
) -> Option<Vec<bool>> {
    interior_among(&Alone, domain, positions, support, weights)
}

/// [`interior`] of particles that are over several ranks.
pub(super) fn interior_among<const D: usize>(
    exchange: &dyn Exchange,
    domain: &Domain<D>,
    positions: &Positions<D>,
    support: &[f64],
    weights: Option<&[f64]>,
) -> Option<Vec<bool>> {
    let n = support.len();
    let inside = parallel::map(n, |i| {
        weights.is_none_or(|w| w[i] > 0.5) && !domain.is_edge_within(&at(positions, i), support[i])
    });
    let [count, n] = exchange.together([parallel::count(n, |i| inside[i]) as f64, n as f64]);
    (count < n && count > (n / 10.0).floor()).then_some(inside)
}

/// The error over `set` (all particles where `None`).
pub(super) fn fit(set: Option<&[bool]>, wanted: &[f64], summed: impl Fn(usize) -> f64 + Sync) -> Fit {
    fit_among(&Alone, set, wanted, summed)
}

/// [`fit`] of particles that are over several ranks.
pub(super) fn fit_among(
    exchange: &dyn Exchange,
    set: Option<&[bool]>,
    wanted: &[f64],
    summed: impl Fn(usize) -> f64 + Sync,
) -> Fit {
    let over = |f: &(dyn Fn(usize) -> f64 + Sync)| total(set, wanted.len(), f);
    let [count, sum] = exchange.together([over(&|_| 1.0), over(&|i| wanted[i] / summed(i))]);
    fitted(exchange, set, wanted, summed, sum / count)
}

/// The error over `set` for a given kappa.
pub(super) fn fit_with(set: Option<&[bool]>, wanted: &[f64], summed: impl Fn(usize) -> f64 + Sync, factor: f64) -> Fit {
    fitted(&Alone, set, wanted, summed, factor)
}

fn fitted(
    exchange: &dyn Exchange,
    set: Option<&[bool]>,
    wanted: &[f64],
    summed: impl Fn(usize) -> f64 + Sync,
    factor: f64,
) -> Fit {
    let over = |f: &(dyn Fn(usize) -> f64 + Sync)| total(set, wanted.len(), f);
    let squares = over(&|i| (factor * summed(i) - wanted[i]).powi(2) / summed(i));
    let [squares, norm] = exchange.together([squares, over(&|i| wanted[i].powi(2) / summed(i))]);
    Fit { factor, epsilon: squares / norm }
}

/// The sum of `f` over `set` of `n` particles.
fn total(set: Option<&[bool]>, n: usize, f: &(dyn Fn(usize) -> f64 + Sync)) -> f64 {
    reduce::sum(n, |i| if set.is_none_or(|s| s[i]) { f(i) } else { 0.0 })
}
