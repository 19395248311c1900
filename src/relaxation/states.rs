//! The dependence of each particle's pressure on its density: P = A rho^gamma of an ideal gas, or the adiabat of its material.

use crate::target::{MaterialState, Materials};
use serde::{Deserialize, Serialize};

/// What each particle keeps as it is compressed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum States {
    /// A_i of an ideal gas.
    Gas(Vec<f64>),
    /// A point of each particle's adiabat: material, density and energy.
    Materials { kind: Vec<u32>, density: Vec<f64>, energy: Vec<f64> },
}

/// The equation of state of all particles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Law<'a> {
    pub gamma: f64,
    /// In place of the ideal gas.
    pub materials: Option<&'a Materials>,
}

impl States {
    pub fn of_materials(states: &[MaterialState]) -> Self {
        Self::Materials {
            kind: states.iter().map(|s| s.kind as u32).collect(),
            density: states.iter().map(|s| s.density).collect(),
            energy: states.iter().map(|s| s.energy).collect(),
        }
    }

    /// Whether it is of `count` particles under `law`.
    pub fn is_of(&self, count: usize) -> bool {
        match self {
            Self::Gas(entropy) => entropy.len() == count,
            Self::Materials { kind, density, energy } => [kind.len(), density.len(), energy.len()] == [count; 3],
        }
    }
}

impl Law<'_> {
    /// The material of particle `i` at a density; `None` for an ideal gas.
    fn compressed(&self, states: &States, i: usize, density: f64) -> Option<(&Materials, MaterialState)> {
        let (States::Materials { kind, density: from, energy }, Some(materials)) = (states, self.materials) else {
            return None;
        };
        let state = MaterialState { kind: kind[i] as usize, density: from[i], energy: energy[i] };
        Some((materials, materials.compressed(&state, density)))
    }

    fn entropy(states: &States, i: usize) -> f64 {
        if let States::Gas(entropy) = states { entropy[i] } else { 0.0 }
    }

    /// P of particle `i` at a density.
    pub fn pressure(&self, states: &States, i: usize, density: f64) -> f64 {
        match self.compressed(states, i, density) {
            Some((materials, state)) => materials.pressure(&state),
            None => Self::entropy(states, i) * density.powf(self.gamma),
        }
    }

    /// P/rho of particle `i` at a density.
    pub fn temperature(&self, states: &States, i: usize, density: f64) -> f64 {
        match self.compressed(states, i, density) {
            Some((materials, state)) => materials.pressure(&state) / density,
            None => Self::entropy(states, i) * density.powf(self.gamma - 1.0),
        }
    }

    /// u of particle `i` at a density.
    pub fn energy(&self, states: &States, i: usize, density: f64) -> f64 {
        match self.compressed(states, i, density) {
            Some((_, state)) => state.energy,
            None => Self::entropy(states, i) * density.powf(self.gamma - 1.0) / (self.gamma - 1.0),
        }
    }

    /// c of particle `i` at a density.
    pub fn sound_speed(&self, states: &States, i: usize, density: f64) -> f64 {
        match self.compressed(states, i, density) {
            Some((materials, state)) => materials.sound_speed(&state),
            None => (self.gamma * Self::entropy(states, i) * density.powf(self.gamma - 1.0)).sqrt(),
        }
    }
}
