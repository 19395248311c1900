//! GYRE stellar models (MESA text format)

use crate::registry::{Capabilities, FormatSpec, Match};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "gyre",
    summary: "GYRE stellar models (MESA text format)",
    extensions: &["mesa", "gyre"],
    feature: "gyre",
    reference: "https://gyre.readthedocs.io/en/stable/ref-guide/stellar-models.html",
    capabilities: Capabilities {
        read_field: true,
        read_particles: false,
        write_particles: false,
        geometries: &[],
        dimensions: &[1, 2, 3],
    },
    sniff,
    read: None,
    write: None,
};

fn sniff(_head: &[u8]) -> Match {
    Match::No
}
