//! MESA profile*.data stellar models

use crate::registry::{Capabilities, FormatSpec, Match};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "mesa",
    summary: "MESA profile*.data stellar models",
    extensions: &["data"],
    feature: "mesa",
    reference: "https://docs.mesastar.org/en/latest/using_mesa/output.html",
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
