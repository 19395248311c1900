//! `sph-prep run`: evolves the gas of a particle file in time.

use super::args::FollowArgs;
use super::exit::{NOT_CONVERGED, SUCCESS};
use super::files::particles_in;
use super::interrupt::Interrupts;
use super::progress::Progress;
use crate::codes::TargetCode;
use crate::error::{Error, Result};
use crate::follow::{Options, Outcome, follow_file};
use crate::relaxation::{CERTIFICATE, Certificate, Control, Event, SETTLING, Step};
use crate::run::destination::{format_for, refuse_replacing};
use sph_formats::{FormatSpec, WriteOptions, registry};
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

/// Rows of the table, about.
const ROWS: usize = 12;

/// What became of the gas, as text or JSON, and the exit code: 3 where it was ended early.
///
/// # Errors
/// A file that cannot be read or followed, options out of their ranges, or a page that cannot be written.
pub fn run(formats: &[FormatSpec], args: &FollowArgs, command: &str) -> Result<(String, u8)> {
    let code = TargetCode::parse(&args.target_code)?;
    if let Some(page) = &args.report {
        probe(page, &args.file)?;
    }
    let target = args.output.as_deref().map(|to| writer(formats, (args, &code), to)).transpose()?;
    let seconds = args.time_limit.map(|s| Duration::try_from_secs_f64(s).map_err(|e| (s, e))).transpose();
    let seconds = seconds.map_err(|(s, e)| Error::scene("--time-limit", format!("is {s}, expected seconds ({e})")))?;
    let begin = Instant::now();
    let path = args.file.display().to_string();
    let progress = Progress::new(args.quiet);
    progress.update(Event::Begin(Step::Read));
    let file = particles_in(formats, &args.file, args.format.as_deref(), args.open)?;
    let interrupts = Interrupts::of_other_work();
    let observer = |event: Event| progress.update(event);
    let control = Control {
        deadline: seconds.and_then(|s| begin.checked_add(s)),
        interrupted: interrupts.requested(),
        observer: &observer,
    };
    control.tell(Event::Begin(Step::Relax(if args.settle.is_some() { SETTLING } else { CERTIFICATE })));
    let (duration, settle) = (args.duration, args.settle);
    let options = Options { duration, gravity: args.gravity, gamma: args.gamma, settle, ..Options::default() };
    let outcome = follow_file(&file, &code, &options, &control);
    progress.finish();
    let Outcome { certificate, settled, notes } = outcome?;
    if let (Some(settled), Some(to), Some(target)) = (&settled, &args.output, target) {
        sph_formats::write(formats, to, Some(target.name), &settled.file, WriteOptions::default())?;
    }
    if let Some(page) = &args.report {
        write_page(page, &path, &certificate, &notes, command)?;
    }
    let is_whole = certificate.is_whole && settled.as_ref().is_none_or(|s| s.certificate.is_whole);
    let exit = if is_whole { SUCCESS } else { NOT_CONVERGED };
    if args.json {
        notes.iter().for_each(|note| eprintln!("note: {note}"));
        let text = serde_json::to_string_pretty(&certificate).unwrap_or_else(|e| format!("{{\"error\": \"{e}\"}}"));
        return Ok((text + "\n", exit));
    }
    let mut out = format!("{path} for {}\n", code.describe(file.header.dimension));
    if let (Some(settled), Some(to)) = (&settled, &args.output) {
        out += "  while motion is damped\n";
        out += &table(&settled.certificate);
        let _ = writeln!(out, "  the settled particles are in {}; free from there:", to.display());
    }
    out += &table(&certificate);
    for line in certificate.summary() {
        let _ = writeln!(out, "  {line}");
    }
    for note in notes {
        let _ = writeln!(out, "  note: {note}");
    }
    if let Some(page) = &args.report {
        let _ = writeln!(out, "  page: {}", page.display());
    }
    let _ = writeln!(out, "  time: {:.2} s", begin.elapsed().as_secs_f64());
    Ok((out, exit))
}

/// The states at some times.
fn table(certificate: &Certificate) -> String {
    let [unit, times] = certificate.units();
    let mut out = format!("  time in {times}, energies over {unit}, changes since the start\n");
    let body =
        if certificate.has_gravity { format!("{:>10}{:>10}{:>9}", "rho_c", "r_half", "virial") } else { String::new() };
    let _ = writeln!(out, "  {:>8}{:>10}{:>10}{body}{:>10}", "time", "kinetic", "densities", "energy");
    let last = certificate.states.len().saturating_sub(1);
    let every = last.div_ceil(ROWS).max(1);
    let is_shown = |i: usize| i.is_multiple_of(every) || i == last;
    for s in certificate.states.iter().enumerate().filter_map(|(i, s)| is_shown(i).then_some(s)) {
        let percent = |v: f64| format!("{:.2} %", 100.0 * v);
        let body = if certificate.has_gravity {
            let (center, half) = (percent(s.central_density - 1.0), percent(s.half_mass_radius - 1.0));
            format!("{center:>10}{half:>10}{:>9.4}", s.virial)
        } else {
            String::new()
        };
        let changed = percent(s.density_change);
        let _ = writeln!(out, "  {:>8.2}{:>10.1e}{changed:>10}{body}{:>10.0e}", s.time, s.kinetic, s.energy);
    }
    out
}

/// The format of the settled particles; refuses what cannot be written before the work.
fn writer<'a>(
    formats: &'a [FormatSpec],
    (args, code): (&FollowArgs, &TargetCode),
    to: &Path,
) -> Result<&'a FormatSpec> {
    let target = format_for(Some(code), formats, (to, args.to_format.as_deref()))?;
    registry::writer(target, to)?;
    refuse_replacing("--out", to, &args.file)?;
    sph_formats::output::probe(to)?;
    Ok(target)
}

/// Refuses a page that cannot be written before the work.
fn probe(page: &Path, file: &Path) -> Result<()> {
    if cfg!(not(feature = "plots")) {
        return Err(Error::scene(
            "--report",
            "asks for a page, but this build draws none; build it with the feature 'plots'",
        ));
    }
    refuse_replacing("--report", page, file)?;
    Ok(sph_formats::output::probe(page)?)
}

#[cfg(feature = "plots")]
fn write_page(page: &Path, name: &str, certificate: &Certificate, notes: &[String], command: &str) -> Result<()> {
    let text = crate::run::page::page_of_certificate(name, certificate, notes, command);
    crate::page::write(page, text.as_bytes())
}

#[cfg(not(feature = "plots"))]
fn write_page(_: &Path, _: &str, _: &Certificate, _: &[String], _: &str) -> Result<()> {
    Ok(())
}
