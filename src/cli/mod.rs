//! The command line: arguments over a scene file, progress, report, exit codes.
//!
//! Exit codes: 0 success, 1 failure, 2 wrong usage, 3 written, but not what was asked for.

mod args;
mod check;
mod choices;
mod compare;
mod convert;
mod exit;
mod files;
mod follow;
mod formats;
mod in_turn;
mod inspect;
mod interrupt;
mod methods;
mod numbers;
mod plot;
mod progress;
mod rank_args;
mod ranks;
#[cfg(feature = "plots")]
mod sketch;
mod stream_args;
mod streams;
mod terminal;
mod written;

use crate::error::Error;
use crate::relaxation::{Control, Event};
use crate::run::bodies_report::BodiesReport;
use crate::run::in_turn::InTurnReport;
use crate::run::report::Report;
use crate::run::verdict::{Grade, worst};
use crate::run::{bodies, pipeline};
use crate::scene::{Scene, reference};
use args::{Args, Command, CompareArgs, RunArgs};
use clap::{CommandFactory, Parser};
use exit::{FAILURE, SUCCESS, Shortcomings, USAGE};
use interrupt::Interrupts;
use sph_formats::{FORMATS, FormatError, did_you_mean};
use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Parses the process's arguments, runs, prints, and returns the exit code.
pub fn main() -> ExitCode {
    ExitCode::from(main_with(std::env::args_os()))
}

/// [`main`] with given arguments, the first of which is the program's name. Where they are no arguments, or ask for help, the
/// process ends.
pub fn main_with<T: Into<OsString> + Clone>(arguments: impl IntoIterator<Item = T>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let args = Args::parse_from(&arguments);
    let command = command_line(&arguments);
    let result = match &args.command {
        Some(Command::Formats) => tell(&formats::table(FORMATS)),
        Some(Command::Methods) => tell(&(methods::table() + &compare::table())),
        Some(Command::Inspect(inspect)) => inspect::inspect(FORMATS, inspect).and_then(|text| tell(&text)),
        Some(Command::Compare(arguments)) => compare(arguments),
        Some(Command::Completions { shell }) => print(&completions(*shell)),
        Some(Command::Help { topic }) => help(topic).and_then(|text| print(&text)),
        Some(Command::Schema) => print(&format!("{:#}\n", Scene::schema())),
        Some(Command::Man { topic }) => manual(topic).and_then(|page| print(&page)),
        Some(Command::Check(arguments)) => check::run(FORMATS, arguments).and_then(|(text, code)| {
            if arguments.json { print(&text) } else { tell(&text) }?;
            Ok(code)
        }),
        Some(Command::Run(arguments)) => set_threads(arguments.threads)
            .and_then(|()| follow::run(FORMATS, arguments, &command))
            .and_then(|(text, code)| {
                if arguments.json { print(&text) } else { tell(&text) }?;
                Ok(code)
            }),
        Some(Command::Convert(convert)) => leaving_nothing(|| convert::convert(FORMATS, convert)).map(|notes| {
            notes.iter().for_each(|note| eprintln!("note: {note}"));
            SUCCESS
        }),
        Some(Command::Replicate(arguments)) => set_threads(arguments.stream.threads)
            .and_then(|()| leaving_nothing(|| streams::replicate(FORMATS, arguments)))
            .and_then(|text| tell(&text)),
        Some(Command::Seed(arguments)) => set_threads(arguments.stream.threads)
            .and_then(|()| leaving_nothing(|| streams::seed(FORMATS, arguments)))
            .and_then(|text| tell(&text)),
        Some(Command::Plan(arguments)) => {
            ranks::plan(arguments).and_then(|text| if arguments.json { print(&text) } else { tell(&text) })
        }
        Some(Command::Plot(plot)) => plot::run(FORMATS, plot, &command).and_then(|text| tell(&text)),
        None => run(&args.run, &command),
    };
    result.unwrap_or_else(|error| {
        eprintln!("{}: {error}", terminal::marked("error"));
        if matches!(error, Error::Scene { .. }) { USAGE } else { FAILURE }
    })
}

/// Work of one process, of which an interrupt leaves no temporary file.
fn leaving_nothing<T>(work: impl FnOnce() -> crate::Result<T>) -> crate::Result<T> {
    ranks::refuse_processes()?;
    let _interrupts = Interrupts::of_other_work();
    work()
}

fn run(args: &RunArgs, command: &str) -> crate::Result<u8> {
    let scene = args.scene()?;
    if args.print_scene {
        return print(&if args.all { scene.to_full_yaml()? } else { scene.to_commented_yaml()? });
    }
    set_threads(args.threads)?;
    let deadline = scene.time_limit.and_then(|s| Instant::now().checked_add(Duration::try_from_secs_f64(s).ok()?));
    if let Some(ended) = if args.dry_run { None } else { ranks::run(args, &scene, deadline)? } {
        return match (ended.report, ended.is_first) {
            (Ok(report), true) => tell_of_one(args, &scene, &report),
            (Ok(report), false) => Ok(Shortcomings::of(&scene, &report).code(args.strict)),
            (Err(error), true) => Err(error),
            // The first says which rank it was.
            (Err(_), false) => Ok(FAILURE),
        };
    }
    if let Some(blocks) = args.in_turn {
        return tell_of_blocks(args, &scene, &in_turn::run(args, &scene, deadline, blocks)?);
    }
    let interrupts = Interrupts::of_run(&scene);
    let progress = progress::Progress::new(args.quiet);
    let observer = |event: Event| {
        interrupts.note(event);
        progress.update(event);
    };
    let control = Control { deadline, interrupted: interrupts.requested(), observer: &observer };
    if args.dry_run {
        let told = foresee(&scene, &control, args.json);
        progress.finish();
        return if args.json { print(&told?) } else { tell(&told?) };
    }
    if !scene.bodies.is_empty() {
        let result = bodies::run_bodies_as(&scene, FORMATS, &control, command);
        progress.finish();
        return tell_of_bodies(args, &scene, &result?);
    }
    let result = pipeline::run_as(&scene, FORMATS, &control, command);
    progress.finish();
    tell_of_one(args, &scene, &result?)
}

/// Prints what may be wrong where the report does not.
fn warn(args: &RunArgs, warnings: &[String]) {
    if args.json || args.quiet {
        warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    }
}

/// Prints a report; returns the exit code.
fn tell_of_one(args: &RunArgs, scene: &Scene, report: &Report) -> crate::Result<u8> {
    warn(args, &report.warnings);
    if args.json {
        print(&format!("{}\n", report.json()))?;
    } else if !args.quiet {
        tell_of_run(scene, &report.text(), worst(&report.verdict))?;
    }
    Ok(Shortcomings::of(scene, report).told(args))
}

/// Prints a report of a run block by block; returns the exit code.
fn tell_of_blocks(args: &RunArgs, scene: &Scene, report: &InTurnReport) -> crate::Result<u8> {
    warn(args, &report.warnings);
    if args.json {
        print(&format!("{}\n", report.json()))?;
    } else if !args.quiet {
        // Pictures are of particles that are held at once.
        tell(&report.text())?;
        tell(&written::line(scene, FORMATS, worst(&report.verdict)))?;
    }
    Ok(Shortcomings::of_blocks(scene, report.stop, &report.verdict).told(args))
}

/// What was called, as a shell takes it.
fn command_line(arguments: &[OsString]) -> String {
    let quoted = |text: &str| {
        let plain = |c: char| c.is_alphanumeric() || "-_./=:,+@%~".contains(c);
        if !text.is_empty() && text.chars().all(plain) {
            text.to_owned()
        } else {
            format!("'{}'", text.replace('\'', "'\\''"))
        }
    };
    let rest = arguments.iter().skip(1).map(|a| quoted(&a.to_string_lossy()));
    std::iter::once("sph-prep".to_owned()).chain(rest).collect::<Vec<_>>().join(" ")
}

fn foresee(scene: &Scene, control: &Control<'_>, is_json: bool) -> crate::Result<String> {
    if scene.bodies.is_empty() {
        let forecast = pipeline::forecast(scene, FORMATS, control)?;
        return Ok(if is_json { forecast.json() } else { forecast.text() });
    }
    let forecast = bodies::forecast_bodies(scene, FORMATS, control)?;
    Ok(if is_json { forecast.json() } else { forecast.text() })
}

fn tell_of_bodies(args: &RunArgs, scene: &Scene, report: &BodiesReport) -> crate::Result<u8> {
    if args.json || args.quiet {
        for (body, figures) in report.bodies.iter().filter_map(|b| Some((&b.name, b.figures.as_ref()?))) {
            figures.warnings.iter().for_each(|warning| eprintln!("warning: body {body}: {warning}"));
        }
    }
    if args.json {
        print(&format!("{}\n", report.json()))?;
    } else if !args.quiet {
        tell_of_run(scene, &report.text(), report.worst())?;
    }
    Ok(Shortcomings::of_bodies(scene, report).told(args))
}

fn compare(args: &CompareArgs) -> crate::Result<u8> {
    set_threads(args.threads)?;
    compare::run(args, FORMATS, Interrupts::of_other_work().requested()).and_then(|text| tell(&text))
}

/// Of the program, a command, keys of a scene, or figures of a report.
fn help(topic: &[String]) -> crate::Result<String> {
    let mut command = Args::command();
    command.build();
    if let [scene] = topic
        && let Some(path) = scene.strip_prefix("scene").filter(|rest| rest.is_empty() || rest.starts_with('.'))
    {
        return reference::help(path);
    }
    if let [scene, keys @ ..] = topic
        && scene == "scene"
    {
        return reference::help(&keys.join("."));
    }
    if let [first, words @ ..] = topic
        && let Some(name) = first.strip_prefix("numbers").filter(|rest| rest.is_empty() || rest.starts_with('.'))
    {
        let words = [name.trim_start_matches('.')].into_iter().chain(words.iter().map(String::as_str));
        return numbers::help(&words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join("-"));
    }
    Ok(found(&mut command, topic, "help", &["scene", "numbers"])?.render_long_help().to_string())
}

/// A command below another; `asked` is the one that was asked for it, which has `others` besides.
fn found<'a>(
    command: &'a mut clap::Command,
    topic: &[String],
    asked: &str,
    others: &[&str],
) -> crate::Result<&'a mut clap::Command> {
    topic.iter().try_fold(command, |below, name| {
        let known: Vec<String> = below
            .get_subcommands()
            .map(clap::Command::get_name)
            .chain(others.iter().copied())
            .map(str::to_owned)
            .collect();
        below.find_subcommand_mut(name).ok_or_else(|| {
            let hint = did_you_mean(name, known.iter().map(String::as_str));
            Error::scene(asked, format!("knows nothing of '{name}'{hint}; it has {}", known.join(", ")))
        })
    })
}

fn completions(shell: clap_complete::Shell) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Args::command(), "sph-prep", &mut script);
    String::from_utf8_lossy(&script).into_owned()
}

fn manual(topic: &[String]) -> crate::Result<String> {
    let mut command = Args::command();
    // Gives commands their whole names.
    command.build();
    let command = found(&mut command, topic, "man", &[])?.clone();
    let mut page = Vec::new();
    // Writing to memory does not fail.
    let _ = clap_mangen::Man::new(command).render(&mut page);
    Ok(String::from_utf8_lossy(&page).into_owned())
}

fn set_threads(threads: Option<usize>) -> crate::Result<()> {
    let Some(threads) = threads else { return Ok(()) };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|e| Error::scene("--threads", e.to_string()))
}

/// Prints the report of a run, with a picture where the terminal shows some, and says at the end what was written.
fn tell_of_run(scene: &Scene, report: &str, grade: Grade) -> crate::Result<u8> {
    tell(report)?;
    #[cfg(feature = "plots")]
    if let Some(picture) = sketch::of_output(scene) {
        print(&picture)?;
    }
    tell(&written::line(scene, FORMATS, grade))
}

/// Prints what people read: for a terminal in lines that fit.
fn tell(text: &str) -> crate::Result<u8> {
    print(&terminal::shown(text))
}

/// Prints to standard output. A reader that has seen enough (`| head`) is no failure.
fn print(text: &str) -> crate::Result<u8> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(FormatError::io(Path::new("standard output"), "write to", e).into())
        }
        _ => Ok(SUCCESS),
    }
}
