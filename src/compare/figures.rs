//! The figures of a comparison.

use super::comparison::{Comparison, MethodRun};
use crate::page::{Axis, CURVES, Curve, Figure, Mark, density_profile};

impl Comparison {
    /// Numbers of particles in increasing order.
    pub(super) fn counts(&self) -> Vec<usize> {
        let mut counts: Vec<usize> = self.runs.iter().map(|r| r.particles).collect();
        counts.sort_unstable();
        counts.dedup();
        counts
    }

    /// The methods that ran with `count` particles, each with its color.
    fn with_count(&self, count: usize) -> impl Iterator<Item = (&MethodRun, usize)> {
        self.colored().filter(move |(run, _)| run.particles == count)
    }

    /// A method has the same color in all figures.
    fn colored(&self) -> impl Iterator<Item = (&MethodRun, usize)> {
        let place = |name: &str| self.methods.iter().position(|m| m.name == name).unwrap_or(0);
        self.runs.iter().map(move |run| (run, place(&run.method)))
    }
}

/// Beyond as many methods as there are colors, lines are dashed.
fn curve(name: &str, color: usize, mark: Mark, points: Vec<(f64, f64)>) -> Curve {
    Curve { mark, dashed: color >= CURVES, ..Curve::line(name, Some(color), points) }
}

/// Epsilon at every step against the time since seeding began.
pub(super) fn error_against_time(comparison: &Comparison, count: usize) -> Figure {
    let curves = comparison.with_count(count).map(|(run, color)| {
        let seeded = (run.steps.is_empty(), run.last());
        let mut points: Vec<(f64, f64)> = run.steps.iter().map(|s| (s.seconds, s.epsilon)).collect();
        if let (true, Some(state)) = seeded {
            points.push((state.seconds, state.shown_error().epsilon));
        }
        let mark = if points.len() == 1 { Mark::Dots(5.0) } else { Mark::Line };
        curve(&run.method, color, mark, points)
    });
    Figure::new(
        format!("Density error against run time, {count} particles"),
        Axis::logarithmic("time [s]"),
        Axis::logarithmic("epsilon, mass re-fitted [1]"),
        curves.collect(),
    )
}

/// Force noise of the states against time.
pub(super) fn noise_against_time(comparison: &Comparison, count: usize) -> Figure {
    let curves = comparison.with_count(count).map(|(run, color)| {
        // Before splitting there are fewer particles; their noise is not comparable.
        let states = run.states.iter().filter(|s| s.particles == run.particles);
        curve(&run.method, color, Mark::LineAndDots(4.0), states.map(|s| (s.seconds, s.shown_noise())).collect())
    });
    Figure::new(
        format!("Force noise after seeding and stages, {count} particles"),
        Axis::logarithmic("time [s]"),
        Axis::logarithmic("force noise [of a random set's]"),
        curves.collect(),
    )
}

/// A figure of the results against the number of particles.
fn against_count(
    comparison: &Comparison,
    title: &str,
    label: &'static str,
    value: impl Fn(&MethodRun) -> Option<f64>,
) -> Figure {
    let curves = comparison.methods.iter().enumerate().map(|(i, method)| {
        let runs = comparison.runs.iter().filter(|r| r.method == method.name);
        let mut points: Vec<(f64, f64)> = runs.filter_map(|r| Some((r.particles as f64, value(r)?))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        curve(&method.name, i, Mark::LineAndDots(4.0), points)
    });
    Figure::new(
        title,
        Axis::logarithmic("number of particles"),
        Axis::logarithmic(label),
        curves.filter(|c| !c.points.is_empty()).collect(),
    )
}

/// Error, noise and time of the results against the number of particles.
pub(super) fn all_against_count(comparison: &Comparison) -> [Figure; 3] {
    let draw = |title: &str, label: &'static str, value: fn(&MethodRun) -> Option<f64>| {
        against_count(comparison, title, label, value)
    };
    [
        draw("Density error of the results", "epsilon, mass re-fitted [1]", |r| Some(r.last()?.shown_error().epsilon)),
        draw("Force noise of the results", "force noise [of a random set's]", |r| Some(r.last()?.shown_noise())),
        draw("Run time", "time [s]", |r| Some(r.seconds)),
    ]
}

/// Density against target of a run whose particles are kept.
pub(super) fn profile(run: &MethodRun) -> Option<Figure> {
    let figure = density_profile(run.portrait.as_ref()?)?;
    Some(Figure { title: format!("{}: density", run.method), ..figure })
}
