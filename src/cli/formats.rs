//! The table of formats, made from their data sheets.

use sph_formats::FormatSpec;

/// One line per format.
pub fn table(formats: &[FormatSpec]) -> String {
    let mut out = format!(
        "{:<9} {:<22} {:<7} {:<15} {:<12} {}\n",
        "name", "extensions", "field", "particles", "in build", "what it is"
    );
    for f in formats {
        let c = f.capabilities;
        let particles = match (c.read_particles, c.write_particles) {
            (true, true) => "read, write",
            (true, false) => "read",
            (false, true) => "write",
            (false, false) => "-",
        };
        let built = f.read.is_some() || f.write.is_some();
        let build = if built { "yes".to_owned() } else { format!("--features {}", f.feature) };
        out += &format!(
            "{:<9} {:<22} {:<7} {particles:<15} {build:<12} {}\n{:<9} {}\n",
            f.name,
            f.extensions.join(" "),
            if c.read_field { "read" } else { "-" },
            f.summary,
            "",
            f.reference,
        );
    }
    out
}
