//! The `dust` section of a scene: a separate fluid in addition to the gas.

use super::{FieldsInput, Term};
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Formats of codes that have dust particles, with the type that they have in files of GADGET's kind.
const TYPES: [(&str, u8); 2] = [("phantom", 2), ("gizmo", 3)];
/// Of codes that have none.
const WITHOUT: [&str; 5] = ["swift", "gadget", "gadget-binary", "gadget-binary-1", "arepo"];

/// Dust as particles of its own, whose density is that of the gas times a ratio.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DustInput {
    /// Mass of dust per mass of gas: a number, or an expression in x, y, z and r as that of a density.
    #[schemars(example = 0.01)]
    pub ratio: Term,
    /// Number of dust particles; by default a fifth of the number of gas particles.
    #[schemars(schema_with = "super::schema::optional_count", example = &"20k")]
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "super::count::optional_count")]
    pub particles: Option<usize>,
    /// Fields of the dust in place of those of the gas, as its velocity without the gas's pressure.
    #[schemars(example = serde_json::json!({"v_phi": "1/sqrt(R)"}))]
    #[serde(default, skip_serializing_if = "FieldsInput::is_empty")]
    pub fields: FieldsInput,
    /// Particle type in files of GADGET's kind, 1 to 5; by default that of dust in the code (3 in GIZMO), and 2 where the format
    /// is of no code.
    #[schemars(range(min = 1, max = 5), example = 3)]
    #[serde(default, rename = "type", skip_serializing_if = "Option::is_none")]
    pub part_type: Option<u8>,
}

impl DustInput {
    /// The type of its particles in a format.
    ///
    /// # Errors
    /// A format of a code that has none, where the scene does not say which to take.
    pub(crate) fn part_type(&self, format: Option<&str>) -> Result<u8> {
        let own = |name: &str| TYPES.iter().find(|(format, _)| *format == name).map(|(_, own)| *own);
        match (self.part_type, format) {
            (Some(stated), _) => Ok(stated),
            (None, Some(name)) if WITHOUT.contains(&name) => {
                let problem = format!(
                    "is of particles that the code of '{name}' does not have; make it a fraction of the gas with fields.dust_fraction, write for Phantom or \
                     GIZMO, or state dust.type to have them as another type"
                );
                Err(Error::scene("dust", problem))
            }
            (None, name) => Ok(name.and_then(own).unwrap_or(2)),
        }
    }
}
