//! Materials with equations of state of their own, in internal units.

use crate::eos::EquationOfState;

/// The materials of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Materials {
    equations: Vec<EquationOfState>,
    /// Internal units of density and specific energy in cgs.
    density: f64,
    energy: f64,
}

/// Which of the materials is somewhere, with its density and specific energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialState {
    pub kind: usize,
    pub density: f64,
    pub energy: f64,
}

impl Materials {
    /// Of one or more; `density` and `energy` are cgs per internal unit.
    pub fn new(equations: Vec<EquationOfState>, density: f64, energy: f64) -> Self {
        Self { equations, density, energy }
    }

    /// Its equation of state; a kind that there is none of, as from a checkpoint of others, is the last.
    fn equation(&self, s: &MaterialState) -> &EquationOfState {
        &self.equations[s.kind.min(self.equations.len() - 1)]
    }

    /// P of a material.
    pub fn pressure(&self, s: &MaterialState) -> f64 {
        self.equation(s).pressure(s.density * self.density, s.energy * self.energy) / (self.density * self.energy)
    }

    /// c of a material.
    pub fn sound_speed(&self, s: &MaterialState) -> f64 {
        self.equation(s).sound_speed(s.density * self.density, s.energy * self.energy) / self.energy.sqrt()
    }

    /// The state at another density, without exchange of heat.
    #[must_use]
    pub fn compressed(&self, s: &MaterialState, density: f64) -> MaterialState {
        let from = [s.density * self.density, s.energy * self.energy];
        let energy = self.equation(s).adiabat(from, density * self.density) / self.energy;
        MaterialState { density, energy, ..*s }
    }

    /// Names of the materials.
    pub fn names(&self) -> String {
        self.equations.iter().map(EquationOfState::name).collect::<Vec<_>>().join(", ")
    }
}
