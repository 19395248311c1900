//! The table of formats, generated from their data sheets.

use sph_formats::FormatSpec;

/// A line per format with what can be done with it, and below what it is and where that is written.
pub fn table(formats: &[FormatSpec]) -> String {
    let mut out = format!("{:<16} {:<33} {:<5} {:<11} in build\n", "name", "extensions", "field", "particles");
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
            "{:<16} {:<33} {:<5} {particles:<11} {build}\n  {}\n  {}\n",
            f.name,
            f.extensions.join(" "),
            if c.read_field { "read" } else { "-" },
            f.summary,
            f.reference,
        );
    }
    out
}
