//! `sph-prep check`: whether a simulation code accepts a file.

use super::args::CheckArgs;
use super::exit::{FAILURE, SUCCESS};
use super::files::particles_in;
use super::progress::Progress;
use crate::check::{Finding, Level, check};
use crate::codes::TargetCode;
use crate::error::Result;
use sph_formats::{FormatSpec, registry};
use std::fmt::Write;

/// The findings as text or JSON, and the exit code: 1 where the code would stop or run on nonsense.
///
/// # Errors
/// A file that cannot be read, holds no particles, or a code that is not known.
pub fn run(formats: &[FormatSpec], args: &CheckArgs) -> Result<(String, u8)> {
    let code = TargetCode::parse(&args.target_code)?;
    let progress = Progress::new(false);
    progress.begin("read");
    let file = particles_in(formats, &args.file, args.format.as_deref(), args.open)?;
    let path = args.file.display().to_string();
    progress.begin("check");
    let mut findings = check(&file, &code)?;
    let spec = registry::detect(formats, &args.file, args.format.as_deref())?;
    findings.extend(container(formats, spec, &code));
    progress.finish();
    let worst = findings.iter().map(|f| f.level).max().unwrap_or(Level::Good);
    let exit = if worst == Level::Error { FAILURE } else { SUCCESS };
    if args.json {
        let text = serde_json::to_string_pretty(&findings).unwrap_or_else(|e| format!("{{\"error\": \"{e}\"}}"));
        return Ok((text + "\n", exit));
    }
    let mut out = format!("{path} for {}\n", code.describe(file.header.dimension));
    for finding in &findings {
        let level = match finding.level {
            Level::Good => "good",
            Level::Warning => "WARNING",
            Level::Error => "ERROR",
        };
        let _ = writeln!(out, "  {level:<8} {}: {}", finding.what, finding.text);
    }
    let verdict = match worst {
        Level::Good => "the code takes it as it is",
        Level::Warning => "the code takes it, but see the warnings",
        Level::Error => "the code refuses it, or takes it for something else than it is meant to be",
    };
    let _ = writeln!(out, "  {verdict}");
    Ok((out, exit))
}

/// Whether the code starts from files of this kind at all.
fn container(formats: &[FormatSpec], of_file: &FormatSpec, code: &TargetCode) -> Option<Finding> {
    let wanted = formats.iter().find(|spec| spec.name == code.sheet.format)?;
    let reads_itself = wanted.capabilities.read_particles;
    let is_taken = of_file.name == wanted.name
        // All of HDF5 is read as one format, and GADGET-2 reads that, too.
        || of_file.name == HDF5 && (!reads_itself || [HDF5, GADGET_BINARY].contains(&wanted.name))
        // All of the family but SWIFT take its binary files, GADGET-4 built with GADGET2_HEADER.
        || of_file.name == GADGET_BINARY && code.is_of_gadgets_kin();
    let title = code.sheet.title;
    let text = format!(
        "is '{0}', from which {1} does not start: the rest is about its particles in a file of '{2}'; sph-prep convert FILE NEW --to {2} makes that",
        of_file.name, title, wanted.name
    );
    (!is_taken).then(|| Finding { level: Level::Warning, what: "format".into(), text })
}

/// The formats that GADGET's family starts from.
const HDF5: &str = "gadget";
const GADGET_BINARY: &str = "gadget-binary";
