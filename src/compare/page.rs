//! The report of a comparison: one page with its figures inside, which fetches nothing.

use super::comparison::Comparison;
use super::figures;
use crate::error::Result;
use crate::metrics::ErrorFigures;

const STYLE: &str = "body{font:15px/1.45 sans-serif;max-width:1400px;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;margin:1em 0}td,th{padding:.25em .7em;border-bottom:1px solid #ddd;text-align:right}\
td:first-child,th:first-child,.text td,.text th{text-align:left}.figures{display:flex;flex-wrap:wrap;gap:1em}\
svg{max-width:100%;height:auto}";

/// The page.
///
/// # Errors
/// A figure that cannot be drawn.
pub(super) fn page(comparison: &Comparison) -> Result<String> {
    let c = comparison;
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>sph-prep: comparison of methods</title>\
         <style>{STYLE}</style></head>\n<body>\n<h1>Comparison of methods</h1>\n<p>{}, {}-D, {} kernel, \
         {:.1} kernel neighbors, seed {}; sph-prep {}.</p>\n",
        escape(&c.input),
        c.dimension,
        escape(c.kernel),
        c.kernel_neighbors,
        c.seed,
        c.version
    );
    c.notes.iter().for_each(|note| out += &format!("<p>Note: {}.</p>\n", escape(note)));
    out += &methods(c);
    out += &results(c);
    out += "<h2>Against run time</h2>\n<p>The error at every step as the stages watch it: mass re-fitted, at the \
            target's own support radii. Times are those of seeding and relaxing.</p>\n<div class=\"figures\">\n";
    for count in c.counts() {
        out += &figures::error_against_time(c, count).svg()?;
        out += &figures::noise_against_time(c, count).svg()?;
    }
    out += "</div>\n";
    if c.counts().len() > 1 {
        out += "<h2>Against the number of particles</h2>\n<div class=\"figures\">\n";
        for figure in figures::all_against_count(c) {
            out += &figure.svg()?;
        }
        out += "</div>\n";
    }
    out += &pictures(c)?;
    out += "</body>\n</html>\n";
    Ok(out)
}

fn methods(c: &Comparison) -> String {
    let mut out =
        String::from("<h2>Methods</h2>\n<table class=\"text\"><tr><th>method<th>what it is<th>reference</tr>\n");
    for m in &c.methods {
        out += &format!("<tr><td>{}<td>{}<td>{}</tr>\n", escape(&m.name), escape(&m.summary), escape(&m.reference));
    }
    out += "</table>\n";
    for left in &c.left_out {
        out += &format!(
            "<p>Left out: {} with {} particles: {}.</p>\n",
            escape(&left.method),
            left.particles,
            escape(&left.why)
        );
    }
    out
}

fn results(c: &Comparison) -> String {
    let mut out = String::from(
        "<h2>Results</h2>\n<p>Density error over particles whose support lies inside the domain and where the target \
         is resolved (over all where there are none), with the mass as given (the total is right) and re-fitted. \
         Epsilon is the sum of (rho - rho*)<sup>2</sup>/n over that of rho*<sup>2</sup>/n. Force noise: the force of a \
         constant pressure as a fraction of that in a random set.</p>\n\
         <table><tr><th>method<th>particles<th>epsilon<br>as given<th>mean<th>max<th>epsilon<br>re-fitted<th>mean\
         <th>max<th>force<br>noise<th>closest pair,<br>spacings<th>seconds<th>stop</tr>\n",
    );
    for run in &c.runs {
        let Some(state) = run.last() else { continue };
        let given = state.density_error.interior.as_ref().unwrap_or(&state.density_error.all);
        let cells =
            |e: &ErrorFigures| format!("<td>{:.2e}<td>{:.3} %<td>{:.2} %", e.epsilon, 100.0 * e.mean, 100.0 * e.max);
        out += &format!(
            "<tr><td>{}<td>{}{}{}<td>{:.2} %<td>{:.2}<td>{:.2}<td>{:?}</tr>\n",
            escape(&run.method),
            run.particles,
            cells(given),
            cells(state.shown_error()),
            100.0 * state.shown_noise(),
            state.neighbors.closest_pair,
            run.seconds,
            run.stop
        );
    }
    out + "</table>\n"
}

/// Pictures and profiles of the runs with the most particles.
fn pictures(c: &Comparison) -> Result<String> {
    let Some(&count) = c.counts().last() else { return Ok(String::new()) };
    let mut out = format!(
        "<h2>Particles</h2>\n<p>Results with {count} particles, in the input's units. Colors of the pictures: \
         rho/rho* - 1, mass re-fitted.</p>\n<div class=\"figures\">\n"
    );
    for run in c.runs.iter().filter(|r| r.particles == count) {
        if let Some(picture) = figures::picture(run, c.dimension) {
            out += &picture.svg()?;
        }
        if let Some(picture) = figures::density_picture(run, c.dimension) {
            out += &picture.svg()?;
        }
        out += &figures::profile(run).svg()?;
    }
    Ok(out + "</div>\n")
}

/// Text as HTML.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_outside_is_no_markup() {
        assert_eq!(escape("<b>\"a\" & b"), "&lt;b&gt;&quot;a&quot; &amp; b");
    }
}
