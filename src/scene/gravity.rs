//! Physics that a code needs to be told: whether matter is self-gravitating, walls, and properties of the gas.

use super::{BalanceInput, BoundaryName, GravityName, Input, ProfileInput, Scene};
use crate::error::{Error, Result};

impl Scene {
    /// The constant of gravity of pure numbers (`balance.constant`, 1 by default) where the scene's matter attracts itself: a model that
    /// its own gravity holds, a balance with it, point masses, an orbit, and collisionless particles. `None` where nothing says so.
    pub(crate) fn own_gravity(&self) -> Option<f64> {
        let attracts = holds_itself(&self.input, self.balance.on())
            || self.collisionless.is_some()
            || self.orbit.is_some()
            || has_own_disc(&self.input)
            || self.bodies.iter().any(|body| {
                let balance = body.balance.on().or(self.balance.on());
                body.point_mass.is_some()
                    || body.collisionless.is_some()
                    || has_own_disc(&body.input)
                    || holds_itself(&body.input, balance)
            });
        attracts.then(|| self.balance.on().cloned().unwrap_or_default().constant)
    }

    /// Whether the gas of the scene, or of one of its bodies, is a disc in rotation.
    pub(crate) fn has_disc(&self) -> bool {
        self.input.disc().is_some() || self.bodies.iter().any(|body| body.input.disc().is_some())
    }

    /// Whether no gas of the scene feels its own gravity, but that of others: discs without `self_gravity`.
    pub(crate) fn has_light_gas(&self) -> bool {
        let bodies = self.bodies.iter().filter(|b| b.point_mass.is_none() && b.collisionless.is_none());
        let mut gas = bodies.map(|b| &b.input).chain(self.bodies.is_empty().then_some(&self.input));
        self.ambient.is_none() && gas.all(|input| input.disc().is_some_and(|disc| !disc.self_gravity))
    }

    /// Whether the gas of a disc has temperatures that the scene's code keeps by place.
    pub(crate) fn keeps_disc_temperatures(&self) -> bool {
        self.has_disc() && self.code().is_some_and(|code| code.cools_discs_by_distance())
    }

    /// Whether a field of force that is not the particles' own is said to hold the pressure.
    pub(crate) fn is_in_field(&self) -> bool {
        let of_bodies = self.bodies.iter().map(|body| (&body.input, &body.balance));
        std::iter::once((&self.input, &self.balance)).chain(of_bodies).any(|(input, balance)| {
            let stated = balance.on().and_then(|balance| balance.gravity);
            stated == Some(GravityName::Field) || stated.is_none() && input.is_without_own_gravity()
        })
    }

    /// Whether dust is to be particles of its own.
    pub(crate) fn has_grains(&self) -> bool {
        self.dust.is_some() || self.bodies.iter().any(|body| body.dust.is_some())
    }

    /// For how long the result is followed as it was placed; `None` where it settles first.
    pub(crate) fn certify_at_once(&self) -> Option<f64> {
        self.certify.filter(|_| self.settle.is_none())
    }

    /// Refuses to settle what other forces act on, or more than gas.
    pub(super) fn check_settling(&self) -> Result<()> {
        if self.settle.is_none() {
            return Ok(());
        }
        let is_beside = [
            ("walls", self.walls.is_some()),
            ("domain.boundary: reflecting", self.has_walls() && !self.holds_its_medium()),
            ("gravity_of", !self.gravity_of.is_empty()),
            ("balance.gravity: field", self.balance.on().and_then(|b| b.gravity) == Some(GravityName::Field)),
            ("dust", self.dust.is_some()),
            ("bodies with `collisionless`", self.bodies.iter().any(|body| body.collisionless.is_some())),
        ];
        match is_beside.iter().find(|(_, is_given)| *is_given) {
            Some((what, _)) => {
                let problem = format!(
                    "knows the forces of gas, its own gravity and point masses, but the scene has {what}; leave one out"
                );
                Err(Error::scene("settle", problem))
            }
            None => Ok(()),
        }
    }

    /// Whether walls reflect anything.
    pub(crate) fn has_walls(&self) -> bool {
        let mut domains = std::iter::once(&self.domain).chain(self.bodies.iter().map(|body| &body.domain));
        domains.any(|domain| domain.boundary.contains(&BoundaryName::Reflecting))
    }

    /// Whether the heat of the gas is stated, in place of what an input has.
    pub(crate) fn states_heat(&self) -> bool {
        self.thermal.internal_energy.is_some() || self.fields.stated().any(|(name, _)| is_heat(name))
    }

    /// Whether particles are to have the energies of an equation of state that the balance names.
    pub(crate) fn states_balanced_energies(&self) -> bool {
        self.balance.on().is_some_and(|balance| balance.equation_of_state.is_some())
    }

    /// Whether anything of the scene is gas.
    pub(crate) fn has_gas(&self) -> bool {
        let mut bodies = self.bodies.iter();
        match self.bodies.is_empty() {
            true => self.collisionless.is_none(),
            false => self.ambient.is_some() || bodies.any(|b| b.point_mass.is_none() && b.collisionless.is_none()),
        }
    }

    /// The adiabatic index of the gas; `None` where bodies, or they and the medium about them, have different ones.
    pub(crate) fn adiabatic_index(&self) -> Option<f64> {
        let mut indices = self.adiabatic_indices();
        let Some(first) = indices.next() else { return Some(self.thermal.gamma) };
        indices.all(|other| (other / first - 1.0).abs() < SAME_GAS).then_some(first)
    }

    fn adiabatic_indices(&self) -> impl Iterator<Item = f64> {
        let own = self.thermal.gamma;
        let gas = self.bodies.iter().filter(|body| body.point_mass.is_none() && body.collisionless.is_none());
        let of_bodies = gas.map(move |body| body.thermal.as_ref().map_or(own, |thermal| thermal.gamma));
        of_bodies.chain(self.ambient.as_ref().map(|_| own))
    }

    /// What is to be said of gas with several adiabatic indices.
    pub(crate) fn has_several_gases(&self) -> Option<String> {
        if self.adiabatic_index().is_some() {
            return None;
        }
        let mut all: Vec<String> = self.adiabatic_indices().map(|gamma| format!("{gamma:.4}")).collect();
        all.dedup();
        Some(format!(
            "bodies and medium have the adiabatic indices {}, by which their pressures became energies; a code has one for all gas, and makes other pressures of \
             the energies of the rest: state one thermal.gamma",
            all.join(", ")
        ))
    }
}

/// Relative difference of adiabatic indices that are one: they are written with few digits.
pub(crate) const SAME_GAS: f64 = 1e-3;

/// Whether an input is a disc that feels its own gravity.
fn has_own_disc(input: &Input) -> bool {
    input.disc().is_some_and(|disc| disc.self_gravity)
}

/// Whether an input is a model that its own gravity holds, or is balanced with it.
fn holds_itself(input: &Input, balance: Option<&BalanceInput>) -> bool {
    match balance.and_then(|b| b.gravity) {
        Some(gravity) => gravity == GravityName::Own,
        None => input.profile.as_ref().is_some_and(|profile| {
            !matches!(profile, ProfileInput::ToyStar { .. } | ProfileInput::Disc(_)) && !input.is_without_own_gravity()
        }),
    }
}

/// Whether a field of this name says what heat the gas has.
pub(crate) fn is_heat(name: &str) -> bool {
    matches!(name, "pressure" | "temperature" | "internal_energy" | "entropy")
}
