//! What was placed is followed forward, where a scene asks for it (`certify`) and nothing settles before.

use super::plan::Held;
use super::stages::Setting;
use crate::error::{Error, Result};
use crate::input::hydrostatics::Hydrostatics;
use crate::relaxation::{CERTIFICATE, Certificate, Event, Field, HeldBy, Matter, Step, certify, opened, too_few};
use crate::scene::Scene;
use crate::target::{Equilibrium, Positions, Target, at};
use sph::domain::Axis;
use sph::parallel;

/// Refuses to follow what is not known to be held by anything, or is too little.
///
/// # Errors
/// That.
pub(super) fn refuse_certificate<const D: usize>(
    scene: &Scene,
    (target, is_known): (&Target<'_, D>, bool),
    held: &Held,
    (count, neighbors): (usize, f64),
) -> Result<()> {
    if scene.certify_at_once().is_none() {
        return Ok(());
    }
    let refuse = |problem: String| Err(Error::scene("certify", format!("{problem}; leave it out")));
    let is_by_field = is_known && *held == Held::Not && scene.balance.is_some() && opened(target.domain).is_some();
    if !is_by_field && *held != Held::ByItself {
        let why = if let Held::Unsure(why) = held { format!(" ({why})") } else { String::new() };
        return refuse(format!(
            "follows a body of equal masses that its own gravity holds, with a pressure that is known{why}, or, with balance.gravity, gas in a box or a ball that a field or nothing acts on"
        ));
    }
    too_few(count, neighbors).filter(|_| !target.domain.axes.contains(&Axis::Periodic)).map_or(Ok(()), refuse)
}

/// What becomes of the gas where the scene asks for it and it does not settle before: of a body that its own gravity holds, or of what a
/// field and walls hold.
pub(super) fn certificate<const D: usize>(
    setting: &Setting<'_, D>,
    hydrostatics: Option<&Hydrostatics<'_, D>>,
    (positions, internal_energy): (&Positions<D>, Option<&[f64]>),
) -> Option<Certificate> {
    let Setting { scene, target, control, .. } = setting;
    let (equilibrium, duration) = hydrostatics.zip(scene.certify_at_once())?;
    let held_by = match equilibrium.own_center() {
        Some(center) => HeldBy::Own { center, point: equilibrium.point_mass() },
        None => HeldBy::Field(Field { equilibrium, target: *target }),
    };
    control.tell(Event::Begin(Step::Relax(CERTIFICATE)));
    let own = |i: usize| {
        let x = at(positions, i);
        if let Some(state) = equilibrium.material(&x) {
            return state.energy;
        }
        equilibrium.pressure(&x) / ((equilibrium.gamma() - 1.0) * target.density.value(&x).max(f64::MIN_POSITIVE))
    };
    let energy = internal_energy.map_or_else(|| parallel::map(positions[0].len(), own), <[f64]>::to_vec);
    let sums = (scene.kernel(), scene.kernel_neighbors(D));
    let kind = |i: usize| equilibrium.material(&at(positions, i)).map_or(0, |s| s.kind);
    let kinds = parallel::map(positions[0].len(), kind);
    let materials = equilibrium.materials().map(|m| (m, kinds.as_slice()));
    let matter = Matter { gamma: equilibrium.gamma(), materials, held_by };
    Some(certify(sums, *target, (positions, &energy), &matter, duration, control))
}
