//! `job_info`: the description of its run that a code writes as text.

use crate::units::UnitSystem;
use std::path::Path;

const FILE: &str = "job_info";
/// More than any has.
const MOST_BYTES: u64 = 1 << 24;
/// Codes whose numbers are in cgs units, as their first lines name them.
const CGS: [&str; 2] = ["castro", "maestro"];
/// A boundary that is none: the box repeats.
const PERIODIC: &str = "interior";

/// What is known of the run; nothing where there is no such file.
#[derive(Debug, Default)]
pub struct Job {
    text: String,
}

impl Job {
    /// The file beside the `Header` at `path`.
    pub fn beside(path: &Path) -> Self {
        let path = path.with_file_name(FILE);
        let is_readable = std::fs::metadata(&path).is_ok_and(|m| m.is_file() && m.len() <= MOST_BYTES);
        let bytes = if is_readable { std::fs::read(&path).unwrap_or_default() } else { Vec::new() };
        Self { text: String::from_utf8_lossy(&bytes).to_ascii_lowercase() }
    }

    /// The units of the code, where it has only one system.
    pub fn units(&self) -> Option<UnitSystem> {
        let title = self.text.lines().find(|line| line.contains("job information"))?;
        CGS.iter().any(|code| title.contains(code)).then(UnitSystem::cgs)
    }

    /// Whether the box repeats along the axes: neither end has a boundary.
    pub fn periodic(&self) -> [bool; 3] {
        ["x", "y", "z"].map(|axis| {
            ["-", "+"].iter().all(|side| {
                let key = format!("{side}{axis}:");
                let stated = self.text.lines().find_map(|line| line.trim().strip_prefix(key.as_str()));
                stated.is_some_and(|kind| kind.trim() == PERIODIC)
            })
        })
    }
}
