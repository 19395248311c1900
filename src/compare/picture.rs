//! Images of the particles of a result, for the figures of a comparison.

use crate::input::internal_units::Prepared;
use crate::metrics::{Detail, Outcome};
use crate::page::{Portrait, Side};
use crate::scene::Scene;
use crate::target::{Positions, Target};
use sph::domain::Region;

/// The last state of a run, in the input's units, with the mass re-fitted.
pub(super) fn portrait<const D: usize>(
    scene: &Scene,
    prepared: &Prepared<D>,
    target: &Target<'_, D>,
    positions: &Positions<D>,
    (outcome, detail): (&Outcome, Detail),
) -> Portrait {
    let sums = (scene.kernel(), scene.kernel_neighbors(D));
    let density = prepared.mass.value / prepared.length.powi(D as i32);
    let mut detail = detail.scaled(prepared.length, density);
    // As in the table: methods are compared by what they do to the density beside a constant factor.
    let e = &outcome.density_error;
    let refit = if e.interior_refitted.is_some() { e.refit_interior } else { e.refit_all };
    detail.density.iter_mut().for_each(|rho| *rho *= refit);
    let is_radial = prepared.source.radial.is_some() || !matches!(target.domain.region, Region::Box);
    let center = prepared.source.center();
    let center = sph::array(|k| if k < D { center[k] * prepared.length } else { 0.0 });
    let side = if is_radial && D > 1 { Side::Radius(center) } else { Side::Axis };
    let masses = outcome.masses.iter().map(|m| m * prepared.mass.value).collect();
    Portrait::of_result(
        &target.domain.scaled(prepared.length),
        (positions, prepared.length),
        masses,
        sums,
        detail,
        side,
    )
}
