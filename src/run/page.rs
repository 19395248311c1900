//! The page of a run: first the verdict, as in the report, then images, figures, and the course of the run.

use super::drawings::Drawing;
use super::report::Report;
use super::verdict::{EXPLANATIONS, Finding, Grade, Topic, ending, worst};
use crate::error::Result;
use crate::metrics::IN_PLACE;
use crate::page::{Axis, Curve, Figure, Page, Portrait, escape, histograms, list, pictures, profiles, table};
use crate::relaxation::{Certificate, Progress, StageReport};
use crate::scene::Scene;
use sph_formats::ParticleFile;

/// The page; `command` is what was called, empty where no program was.
///
/// # Errors
/// Values that cannot be drawn.
pub fn page(scene: &Scene, file: &ParticleFile, report: &Report, command: &str) -> Result<String> {
    let portrait = Drawing::of(report).portrait(file)?;
    let mut page = Page::new(&format!("{} \u{2192} {}", report.input, report.output));
    page.add(&lead(report));
    page.section("Pictures", &pictures(&portrait)?);
    page.section("Profile against target", &profiles(&portrait));
    page.section("Histograms", &histograms(&portrait));
    page.section("On the way", &on_the_way(report));
    page.section("Figures", &(numbers(report) + &errors(report)));
    page.section("Plan", &plan(report));
    let warnings = report.warnings.iter().map(|w| format!("Warning: {w}"));
    page.section("Notes", &list(warnings.chain(report.notes.iter().cloned())));
    page.section("Variables", &variables(report));
    page.section("Scene", &format!("<pre>{}</pre>\n", escape(&scene.to_yaml())));
    page.section("Units and versions", &origin(&portrait, report, command));
    page.section("What the numbers mean", &explanations());
    Ok(page.finish())
}

/// A box with a headline and lines that are marked by their grades.
/// Lines have what they are about where the page explains it.
pub fn lead_of<'a>(
    grade: Grade,
    headline: &str,
    lines: impl Iterator<Item = (&'a str, Grade, String, Option<Topic>)>,
) -> String {
    let class = |grade: Grade| match grade {
        Grade::Good => "good",
        Grade::Look => "look",
        Grade::Bad => "bad",
    };
    let mut out = format!("<div class=\"lead {}\">\n<p>{}</p>\n<ul>\n", class(grade), escape(headline));
    for (mark, grade, text, topic) in lines {
        let (mark, text) = (escape(mark), with_code(&text));
        let link = topic.map_or_else(String::new, |t| format!(" (<a href=\"#{}\">what it means</a>)", t.anchor()));
        out += &format!("<li class=\"{}\"><span class=\"tag\">{mark}</span>{text}{link}</li>\n", class(grade));
    }
    out + "</ul>\n</div>\n"
}

/// What the lines of a verdict mean: the sections of the manual's page, under the names by which lines link to them.
pub fn explanations() -> String {
    let mut out = String::new();
    for block in EXPLANATIONS.split("\n\n").map(str::trim) {
        match block.strip_prefix("## ") {
            Some(heading) => {
                let anchor = heading.to_lowercase().replace(' ', "-");
                out += &format!("<h3 id=\"{}\">{}</h3>\n", escape(&anchor), escape(heading));
            }
            None if block.is_empty() || block.starts_with("# ") => {}
            None => out += &format!("<p>{}</p>\n", with_code(&block.replace("**", ""))),
        }
    }
    out
}

/// Text as HTML, with what is between backticks as code.
fn with_code(text: &str) -> String {
    let parts: Vec<&str> = text.split('`').collect();
    let is_paired = parts.len() % 2 == 1;
    let shown = |(i, part): (usize, &&str)| match i % 2 {
        1 => format!("<code>{}</code>", escape(part)),
        _ => escape(part),
    };
    if is_paired { parts.iter().enumerate().map(shown).collect() } else { escape(text) }
}

fn lead(report: &Report) -> String {
    let alarms = report.alarms().into_iter().map(|(alarm, text)| (alarm, Grade::Bad, text, None));
    let told = |f: &Finding| format!("{}: {}", f.topic.name(), f.text);
    let findings = report.verdict.iter().map(|f| (f.grade.mark(), f.grade, told(f), Some(f.topic)));
    let has_alarm = !report.alarms().is_empty();
    let grade = if has_alarm { Grade::Bad } else { worst(&report.verdict) };
    let headline = format!("Verdict: {}", worst(&report.verdict).summary());
    lead_of(grade, &headline, alarms.chain(findings))
}

/// How error and balance fell, and what became of the body afterwards.
fn on_the_way(report: &Report) -> String {
    let mut all = Vec::new();
    let error = |p: &Progress| Some(p.epsilon);
    all.extend(history(report, "Error against time", "epsilon, mass re-fitted [1]", &error));
    let force = |p: &Progress| p.force_error;
    all.extend(history(report, "Balance against time", "net force [of gravity]", &force));
    all.extend(forward(report.settled.as_ref(), report.certificate.as_ref()));
    side_by_side(&all)
}

/// How motion fell while it was damped, and what became of the particles from there.
pub(super) fn forward(settled: Option<&Certificate>, free: Option<&Certificate>) -> Vec<Figure> {
    let damped = settled.into_iter().flat_map(|c| certified(c, "While motion is damped"));
    damped.chain(free.into_iter().flat_map(|c| certified(c, "Certificate"))).collect()
}

/// Figures next to each other; nothing where there are none.
pub(super) fn side_by_side(figures: &[Figure]) -> String {
    let all: String = figures.iter().map(Figure::html).collect();
    if all.is_empty() { all } else { format!("<div class=\"figures\">\n{all}</div>\n") }
}

/// A measure that stages watch, one curve for each of them, one after the other.
fn history(report: &Report, title: &str, label: &str, value: &dyn Fn(&Progress) -> Option<f64>) -> Option<Figure> {
    let mut curves = Vec::new();
    let mut start = 0.0;
    for (i, stage) in report.stages.iter().enumerate() {
        let points: Vec<(f64, f64)> =
            stage.history.iter().filter_map(|p| Some((start + p.seconds, value(p)?))).collect();
        if !points.is_empty() {
            curves.push(Curve::line(stage.stage.title, Some(i), points));
        }
        start += stage.seconds;
    }
    let x = Axis::linear("time since the seeding [s]");
    (!curves.is_empty()).then(|| Figure::new(title, x, Axis::logarithmic(label), curves))
}

/// The page of a file that was followed forward.
#[cfg(feature = "cli")]
pub fn page_of_certificate(name: &str, certificate: &Certificate, notes: &[String], command: &str) -> String {
    let mut page = Page::new(name);
    let summary = certificate.summary();
    page.add(&format!("<div class=\"lead\">\n<p>{}</p>\n{}</div>\n", escape(&summary[0]), list(&summary[1..])));
    page.section("Forward in time", &side_by_side(&forward(None, Some(certificate))));
    page.section("Notes", &list(notes));
    let rows = [row("page", format!("sph-prep {}", env!("CARGO_PKG_VERSION"))), row("command", command)];
    page.section("Versions", &table("", &[], &rows));
    page.finish()
}

fn certified(certificate: &Certificate, title: &str) -> [Figure; 2] {
    let states = &certificate.states;
    let points = |value: &dyn Fn(&crate::relaxation::State) -> f64| {
        states.iter().map(|s| (s.time, value(s))).collect::<Vec<_>>()
    };
    let [unit, times] = certificate.units();
    let x = || Axis::linear(format!("time [{times}]"));
    let kinetic = Curve::line("kinetic energy", Some(0), points(&|s| s.kinetic));
    let mut drifts = vec![Curve::line("densities (rms)", Some(3), points(&|s| 100.0 * s.density_change))];
    if certificate.has_gravity {
        drifts.push(Curve::line("central density", Some(1), points(&|s| 100.0 * (s.central_density - 1.0))));
        drifts.push(Curve::line("half-mass radius", Some(2), points(&|s| 100.0 * (s.half_mass_radius - 1.0))));
    }
    let label = format!("kinetic energy [of {unit}]");
    let mut motion = Figure::new(format!("{title}: motion"), x(), Axis::logarithmic(label), vec![kinetic]);
    let potential = if certificate.has_gravity { "; W is the potential energy" } else { "" };
    motion.caption =
        format!("Verdict: {}. The particles were followed forward{potential}.", certificate.verdict().name());
    [motion, Figure::new(format!("{title}: drifts"), x(), Axis::linear("change since the start [%]"), drifts)]
}

fn row(name: &str, text: impl Into<String>) -> Vec<String> {
    vec![name.into(), text.into()]
}

fn numbers(report: &Report) -> String {
    let m = &report.mass;
    let grams = m.total_cgs.map(|g| format!(" = {g:.6e} g")).unwrap_or_default();
    let mut rows = vec![
        row("particles", format!("{} in {}-D", report.particles, report.dimension)),
        row("kernel", format!("{}, {:.1} neighbors", report.kernel, report.neighbors.kernel_neighbors)),
        row("mass", format!("{:.12e}{grams}; particles add up to it within {:.1e}", m.total, m.defect.abs())),
        row(
            "particle mass",
            match m.smallest == m.largest {
                true => format!("{:.6e}, equal", m.smallest),
                false => format!("{:.4e} to {:.4e}", m.smallest, m.largest),
            },
        ),
    ];
    if let Some(smallest) = report.ledger.levels.last() {
        let text = format!(
            "{:.2} % of it, to {:.0} % in {} boxes of equal mass",
            100.0 * report.ledger.in_place,
            100.0 * IN_PLACE,
            smallest.boxes
        );
        rows.push(row("mass in place", text));
    }
    let inside = report.noise.interior.map(|n| format!(", interior {:.2} %", 100.0 * n)).unwrap_or_default();
    let (all, median) = (100.0 * report.noise.all, 100.0 * report.noise.median);
    rows.push(row("force noise", format!("{all:.2} % of a random set's, median {median:.2} %{inside}")));
    if let Some(balance) = &report.balance {
        rows.push(row("force balance", format!("net force is {:.2} % of gravity on average", 100.0 * balance.all)));
    }
    rows.push(row("neighbors", report.neighbors.describe()));
    table("", &[], &rows)
}

fn errors(report: &Report) -> String {
    let rows: Vec<Vec<String>> = report
        .error_rows()
        .into_iter()
        .map(|(name, e)| {
            let [mean, most, max] = [e.mean, e.most, e.max].map(|share| 100.0 * share);
            vec![
                name.into(),
                e.particles.to_string(),
                format!("{:.3e}", e.epsilon),
                format!("{mean:.3} %"),
                format!("{most:.2} %"),
                format!("{max:.2} %"),
            ]
        })
        .collect();
    table("numbers", &["density error", "particles", "epsilon", "mean |e|", "99 % are below", "max |e|"], &rows)
}

/// What was done and how it ended; what was not, and why; how long each took.
fn plan(report: &Report) -> String {
    let stage = |s: &StageReport| {
        let iterations = s.history.last().map_or(0, |p| p.iteration);
        let text = format!("{} after {iterations} iterations, best is {}", ending(s.stop), s.best_iteration);
        vec![s.stage.title.to_owned(), text, format!("{:.2} s", s.seconds)]
    };
    let seeding = report.plan.seeding.method();
    let seeded =
        report.timing.iter().find(|t| t.step == seeding.stage).map_or(String::new(), |t| format!("{:.2} s", t.seconds));
    let mut done = vec![vec![format!("seed: {}", seeding.name), seeding.summary.to_owned(), seeded]];
    done.extend(report.stages.iter().map(stage));
    let left: Vec<Vec<String>> = report.plan.left_out.iter().map(|l| vec![l.what.clone(), l.why.clone()]).collect();
    let timing: Vec<Vec<String>> =
        report.timing.iter().map(|t| vec![t.step.to_owned(), format!("{:.2}", t.seconds)]).collect();
    table("", &["done", "how it ended", "time"], &done)
        + &table("", &["without", "why"], &left)
        + &table("numbers", &["step", "time [s]"], &timing)
}

fn variables(report: &Report) -> String {
    let mut text = String::new();
    // Writing to memory does not fail.
    let _ = super::variables::write_variables(&mut text, &report.variables);
    if text.is_empty() { text } else { format!("<pre>{}</pre>\n", escape(&text)) }
}

fn origin(portrait: &Portrait, report: &Report, command: &str) -> String {
    let mut rows = vec![
        row("units of the output", portrait.labels.system.clone()),
        row("format", report.format),
        row("seed of random numbers", report.seed.to_string()),
        row("program", format!("sph-prep {}", env!("CARGO_PKG_VERSION"))),
        row("time in all", format!("{:.2} s", report.seconds)),
    ];
    if !command.is_empty() {
        rows.push(row("command", command));
    }
    table("", &[], &rows)
}
