//! Materials by the numbers of SWIFT's planetary schemes and by name.

use super::equation::EquationOfState;
use super::tillotson::Tillotson;

/// A material of a body: its equation of state, and its number in files (`MaterialIDs`), where it has one.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub id: Option<i32>,
    pub equation: EquationOfState,
}

/// gamma of SWIFT's default build, and the mean molecular weight of WoMa's hydrogen and helium.
const GAMMA: f64 = 5.0 / 3.0;
const MEAN_MOLECULAR_WEIGHT: f64 = 2.3;

impl Material {
    /// Of a number that needs no file; `None` where there is no such.
    pub fn of_id(id: i32) -> Option<Self> {
        let equation = match id {
            0 => EquationOfState::IdealGas { gamma: GAMMA, mean_molecular_weight: MEAN_MOLECULAR_WEIGHT },
            100 => EquationOfState::Tillotson(Tillotson::iron()),
            101 => EquationOfState::Tillotson(Tillotson::granite()),
            102 => EquationOfState::Tillotson(Tillotson::water()),
            103 => EquationOfState::Tillotson(Tillotson::basalt()),
            104 => EquationOfState::Tillotson(Tillotson::ice()),
            _ => return None,
        };
        Some(Self { id: Some(id), equation })
    }
}
