//! Tables with a header, comma or white-space separated

use crate::registry::{Capabilities, FormatSpec, Match};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "table",
    summary: "Tables with a header, comma or white-space separated",
    extensions: &["csv", "dat", "txt", "tab"],
    feature: "table",
    reference: "https://www.rfc-editor.org/rfc/rfc4180",
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
