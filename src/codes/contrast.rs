//! Detects gas particle masses that differ by more than simulation codes tolerate.

use super::TargetCode;
use sph_formats::Values;

/// Masses of gas beyond this contrast may fail in codes.
const MASS_CONTRAST: f64 = 1e3;

/// Masses of gas particles that differ by far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contrast {
    pub least: f64,
    pub most: f64,
    /// Of a code that counts neighbors by their mass over the particle's own, so that the heaviest does not find its number in all of the gas.
    pub is_out_of_reach: bool,
    /// Whether the code is one of these: of others no more is known than that they crash or hang.
    is_known: bool,
}

impl Contrast {
    /// Whether the code ends over it, as far as is known.
    pub fn stops(&self) -> bool {
        !self.is_known
    }

    /// What the code makes of it, after its name.
    pub fn outcome(&self) -> &'static str {
        match (self.is_out_of_reach, self.is_known) {
            (true, _) => {
                "counts neighbors by mass, of which the heaviest finds too little in all of the gas, so that it may stop at the first step"
            }
            (false, true) => "is slow at such contrasts, or hangs",
            (false, false) => "crashes or hangs at such contrasts",
        }
    }
}

impl TargetCode {
    /// Whether `masses` of gas in `d` dimensions differ by more than the code bears.
    pub(crate) fn contrast(&self, masses: &Values, d: usize) -> Option<Contrast> {
        let (least, most, _) = masses.range();
        let total: f64 = (0..masses.len()).map(|i| masses.get(i)).sum();
        let is_known = self.sheet.format.starts_with("gadget");
        let is_out_of_reach = is_known && self.kernel_neighbors(d) * most > total && most > 1.5 * least;
        (!self.sheet.is_mesh && least > 0.0 && (most > MASS_CONTRAST * least || is_out_of_reach)).then_some(Contrast {
            least,
            most,
            is_out_of_reach,
            is_known,
        })
    }
}
