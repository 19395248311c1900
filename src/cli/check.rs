//! `sph-prep check`: whether a code takes a file.

use super::args::CheckArgs;
use super::exit::{FAILURE, SUCCESS};
use super::files::particles;
use super::progress::Progress;
use crate::check::{Level, check};
use crate::codes::TargetCode;
use crate::error::Result;
use sph_formats::FormatSpec;
use std::fmt::Write;

/// The findings as text or JSON, and the exit code: 1 where the code would stop or run on nonsense.
///
/// # Errors
/// A file that cannot be read, holds no particles, or a code that is not known.
pub fn run(formats: &[FormatSpec], args: &CheckArgs) -> Result<(String, u8)> {
    let code = TargetCode::parse(&args.target_code)?;
    let progress = Progress::new(false);
    progress.begin("read");
    let file = particles(formats, &args.file, args.format.as_deref())?;
    let path = args.file.display().to_string();
    progress.begin("check");
    let findings = check(&file, &code)?;
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
        Level::Error => "the code will not take it, or will run on nonsense",
    };
    let _ = writeln!(out, "  {verdict}");
    Ok((out, exit))
}
