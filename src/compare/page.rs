//! The report of a comparison: one self-contained page with its figures.

use super::advice::advice;
use super::comparison::Comparison;
use super::figures;
use crate::error::Result;
use crate::metrics::ErrorFigures;
use crate::page::{Page, density_map, error_map, escape, list, table};
use crate::run::verdict::ending;

/// The page.
///
/// # Errors
/// A figure that cannot be drawn.
pub(super) fn page(comparison: &Comparison) -> Result<String> {
    let c = comparison;
    let mut page = Page::new("Comparison of methods");
    if let Some(advice) = advice(c) {
        page.add(&format!("<div class=\"lead good\">\n<p>{}</p>\n</div>\n", escape(&advice)));
    }
    page.add(&format!(
        "<p>{}, {}-D, {} kernel, {:.1} kernel neighbors, seed {}; sph-prep {}.</p>\n",
        escape(&c.input),
        c.dimension,
        escape(c.kernel),
        c.kernel_neighbors,
        c.seed,
        c.version
    ));
    page.add(&list(c.notes.iter().map(|note| format!("Note: {note}."))));
    page.section("Results", &results(c));
    page.section("Against run time", &against_time(c));
    if c.counts().len() > 1 {
        let all: String = figures::all_against_count(c).iter().map(crate::page::Figure::html).collect();
        page.section("Against the number of particles", &side_by_side(&all));
    }
    page.section("Particles", &pictures(c)?);
    page.section("Methods", &methods(c));
    Ok(page.finish())
}

fn side_by_side(figures: &str) -> String {
    format!("<div class=\"figures\">\n{figures}</div>\n")
}

fn against_time(c: &Comparison) -> String {
    let mut all = String::new();
    for count in c.counts() {
        all += &figures::error_against_time(c, count).html();
        all += &figures::noise_against_time(c, count).html();
    }
    "<p>The error at every step as the stages watch it: mass re-fitted, at the target's own support radii. Times are those of \
     seeding and relaxing.</p>\n"
        .to_owned()
        + &side_by_side(&all)
}

fn methods(c: &Comparison) -> String {
    let row = |m: &super::comparison::MethodSheet| vec![m.name.clone(), m.summary.clone(), m.reference.clone()];
    let rows: Vec<Vec<String>> = c.methods.iter().map(row).collect();
    let left = c.left_out.iter().map(|l| format!("Left out: {} with {} particles: {}.", l.method, l.particles, l.why));
    table("", &["method", "what it is", "reference"], &rows) + &list(left)
}

fn results(c: &Comparison) -> String {
    let mut rows = Vec::new();
    for run in &c.runs {
        let Some(state) = run.last() else { continue };
        let given = state.density_error.interior.as_ref().unwrap_or(&state.density_error.all);
        let cells = |e: &ErrorFigures| {
            [format!("{:.2e}", e.epsilon), format!("{:.3} %", 100.0 * e.mean), format!("{:.2} %", 100.0 * e.max)]
        };
        let mut row = vec![run.method.clone(), run.particles.to_string()];
        row.extend(cells(state.shown_error()));
        row.extend(cells(given));
        row.push(format!("{:.2} %", 100.0 * state.shown_noise()));
        row.push(format!("{:.2}", state.neighbors.closest_pair));
        row.push(format!("{:.2}", run.seconds));
        row.push(ending(run.stop).to_owned());
        rows.push(row);
    }
    let headings = [
        "method",
        "particles",
        "epsilon, re-fitted",
        "mean",
        "max",
        "epsilon, as given",
        "mean",
        "max",
        "force noise",
        "closest pair [spacings]",
        "time [s]",
        "end",
    ];
    "<p>Density error over particles whose support lies inside the domain and where the target is resolved (over all where there \
     are none), with the mass re-fitted and as given (the total is right). Epsilon is the sum of \
     (\u{3c1} \u{2212} \u{3c1}*)\u{b2}/n over that of \u{3c1}*\u{b2}/n. Force noise: the force of a constant pressure over that in a \
     random set.</p>\n"
        .to_owned()
        + &table("numbers", &headings, &rows)
}

/// Colors of all maps of errors, so that they can be compared, in per cent.
const ERRORS: f64 = 5.0;

/// Pictures and profiles of the runs with the most particles.
fn pictures(c: &Comparison) -> Result<String> {
    let mut all = String::new();
    for run in &c.runs {
        let Some(portrait) = &run.portrait else { continue };
        all.extend(density_map(portrait, &format!("{}: density", run.method))?);
        all.extend(error_map(portrait, &format!("{}: density error", run.method), ERRORS)?);
        all.extend(figures::profile(run).map(|figure| figure.html()));
    }
    if all.is_empty() {
        return Ok(all);
    }
    let most = c.counts().last().copied().unwrap_or(0);
    Ok(format!("<p>Results with {most} particles, in the input's units, with the mass re-fitted.</p>\n")
        + &side_by_side(&all))
}
