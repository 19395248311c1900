//! A comparison as one CSV table, and as text for a terminal.

use super::advice::advice;
use super::comparison::{Comparison, MethodRun, State, Step};
use crate::metrics::ErrorFigures;
use crate::run::verdict::ending;
use std::fmt::Write;

/// Columns of the CSV. A row is a step (an iteration: only its `epsilon_watched`) or a state (after the seeding or
/// after a stage: everything else). What does not apply is empty. Epsilon, mean and max are as in the run report.
pub const CSV_COLUMNS: [&str; 26] = [
    "method",
    "particles",
    "row",
    "stage",
    "step",
    "stage_particles",
    "seconds",
    "epsilon_watched",
    "epsilon",
    "mean_error",
    "max_error",
    "epsilon_refitted",
    "mean_error_refitted",
    "max_error_refitted",
    "interior_epsilon",
    "interior_mean_error",
    "interior_max_error",
    "interior_epsilon_refitted",
    "interior_mean_error_refitted",
    "interior_max_error_refitted",
    "mass_in_place",
    "smoothed_mean_error",
    "noise",
    "interior_noise",
    "mean_neighbors",
    "closest_pair",
];

/// The table, rows of a run in the order of time.
pub fn csv(comparison: &Comparison) -> String {
    let mut out = CSV_COLUMNS.join(",") + "\n";
    for run in &comparison.runs {
        for state in &run.states {
            run.steps.iter().filter(|s| s.stage == state.stage).for_each(|s| push(&mut out, step_row(run, s)));
            push(&mut out, state_row(run, state));
        }
    }
    out
}

fn push(out: &mut String, cells: Vec<String>) {
    *out += &cells.join(",");
    out.push('\n');
}

fn step_row(run: &MethodRun, step: &Step) -> Vec<String> {
    let mut cells = vec![
        run.method.clone(),
        run.particles.to_string(),
        "step".into(),
        step.stage.into(),
        step.step.to_string(),
        String::new(),
        number(step.seconds),
        number(step.epsilon),
    ];
    cells.resize(CSV_COLUMNS.len(), String::new());
    cells
}

fn state_row(run: &MethodRun, state: &State) -> Vec<String> {
    let e = &state.density_error;
    let mut cells = vec![
        run.method.clone(),
        run.particles.to_string(),
        "state".into(),
        state.stage.into(),
        String::new(),
        state.particles.to_string(),
        number(state.seconds),
        String::new(),
    ];
    for figures in [Some(e.all), Some(e.all_refitted), e.interior, e.interior_refitted] {
        let values = figures.map(|ErrorFigures { epsilon, mean, max, .. }| [epsilon, mean, max]);
        cells.extend((0..3).map(|k| values.map_or(String::new(), |v| number(v[k]))));
    }
    cells.push(number(state.in_place));
    cells.push(number(state.overall_error()));
    cells.push(number(state.noise.all));
    cells.push(state.noise.interior.map_or(String::new(), number));
    cells.push(number(state.neighbors.mean_count));
    cells.push(number(state.neighbors.closest_pair));
    cells
}

/// Shortest text that reads back as the same number.
fn number(value: f64) -> String {
    format!("{value:e}")
}

impl Comparison {
    /// Why methods ended, each with the methods that did so.
    fn endings(&self) -> Vec<(&'static str, Vec<&str>)> {
        let mut all: Vec<(&str, Vec<&str>)> = Vec::new();
        for run in &self.runs {
            let how = ending(run.stop);
            let known = all.iter().position(|known| known.0 == how);
            let at = known.unwrap_or_else(|| {
                all.push((how, Vec::new()));
                all.len() - 1
            });
            if !all[at].1.contains(&run.method.as_str()) {
                all[at].1.push(&run.method);
            }
        }
        all
    }

    /// As text for a terminal: one line per run.
    pub fn text(&self) -> String {
        let width = self.runs.iter().map(|r| r.method.len()).max().unwrap_or(0).max(6);
        let mut out = format!(
            "{} in {}-D; mass re-fitted, interior; all |e|: from the smoothed target, as given\n",
            self.input, self.dimension
        );
        out += &format!(
            "  {:<width$} {:>9} {:>8} {:>9} {:>8} {:>8} {:>8} {:>8} {:>8}\n",
            "method", "particles", "epsilon", "mean |e|", "max |e|", "in place", "all |e|", "noise", "seconds"
        );
        for run in &self.runs {
            let Some(state) = run.last() else { continue };
            let e = state.shown_error();
            // Writing to a string cannot fail.
            let _ = writeln!(
                out,
                "  {:<width$} {:>9} {:>8.1e} {:>7.3} % {:>6.2} % {:>6.1} % {:>6.2} % {:>6.2} % {:>8.2}",
                run.method,
                run.particles,
                e.epsilon,
                100.0 * e.mean,
                100.0 * e.max,
                100.0 * state.in_place,
                100.0 * state.overall_error(),
                100.0 * state.shown_noise(),
                run.seconds
            );
        }
        for (how, methods) in self.endings() {
            let _ = writeln!(out, "  ended     {how}: {}", methods.join(", "));
        }
        for left in &self.left_out {
            let _ = writeln!(out, "  left out  {} with {}: {}", left.method, left.particles, left.why);
        }
        for note in &self.notes {
            let _ = writeln!(out, "  note      {note}");
        }
        if let Some(advice) = advice(self) {
            let _ = writeln!(out, "  {advice}");
        }
        out
    }
}
