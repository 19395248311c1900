//! Which figures a comparison has, and what they show.

use super::comparison::{Comparison, MethodRun};
use super::picture::Sample;
use super::plots::{Axis, Curve, Figure, color};
use plotters::style::RGBColor;

const SIZE: (u32, u32) = (680, 440);
/// With room for the legend the axes of a picture are about as wide as high.
const SMALL: (u32, u32) = (560, 450);
/// Dots of one picture or profile, so that pages stay small.
const MOST_DOTS: usize = 1500;

impl Comparison {
    /// Numbers of particles in increasing order.
    pub(super) fn counts(&self) -> Vec<usize> {
        let mut counts: Vec<usize> = self.runs.iter().map(|r| r.particles).collect();
        counts.sort_unstable();
        counts.dedup();
        counts
    }

    /// The methods that ran with `count` particles, each with its color.
    fn with_count(&self, count: usize) -> impl Iterator<Item = (&MethodRun, RGBColor)> {
        self.colored().filter(move |(run, _)| run.particles == count)
    }

    /// A method has the same color in all figures.
    fn colored(&self) -> impl Iterator<Item = (&MethodRun, RGBColor)> {
        let place = |name: &str| self.methods.iter().position(|m| m.name == name).unwrap_or(0);
        self.runs.iter().map(move |run| (run, color(place(&run.method))))
    }
}

fn curve(run: &MethodRun, color: RGBColor, dot: i32, points: Vec<(f64, f64)>) -> Curve {
    Curve { name: run.method.clone(), color, joined: true, dot, points }
}

/// Epsilon at every step against the time since seeding began.
pub(super) fn error_against_time(comparison: &Comparison, count: usize) -> Figure {
    let curves = comparison.with_count(count).map(|(run, color)| {
        let seeded = (run.steps.is_empty(), run.last());
        let mut points: Vec<(f64, f64)> = run.steps.iter().map(|s| (s.seconds, s.epsilon)).collect();
        if let (true, Some(state)) = seeded {
            points.push((state.seconds, state.shown_error().epsilon));
        }
        let dot = if points.len() == 1 { 5 } else { 0 };
        curve(run, color, dot, points)
    });
    Figure {
        title: format!("Density error against run time, {count} particles"),
        size: SIZE,
        x: Axis::logarithmic("seconds"),
        y: Axis::logarithmic("epsilon, mass re-fitted"),
        curves: curves.collect(),
    }
}

/// Force noise of the states against time.
pub(super) fn noise_against_time(comparison: &Comparison, count: usize) -> Figure {
    let curves = comparison.with_count(count).map(|(run, color)| {
        // Before splitting there are fewer particles; their noise is not comparable.
        let states = run.states.iter().filter(|s| s.particles == run.particles);
        curve(run, color, 4, states.map(|s| (s.seconds, s.shown_noise())).collect())
    });
    Figure {
        title: format!("Force noise after seed and stages, {count} particles"),
        size: SIZE,
        x: Axis::logarithmic("seconds"),
        y: Axis::logarithmic("force noise over a random set's"),
        curves: curves.collect(),
    }
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
        Curve { name: method.name.clone(), color: color(i), joined: true, dot: 4, points }
    });
    Figure {
        title: title.into(),
        size: SIZE,
        x: Axis::logarithmic("particles"),
        y: Axis::logarithmic(label),
        curves: curves.filter(|c| !c.points.is_empty()).collect(),
    }
}

/// Error, noise and time of the results against the number of particles.
pub(super) fn all_against_count(comparison: &Comparison) -> [Figure; 3] {
    let draw = |title: &str, label: &'static str, value: fn(&MethodRun) -> Option<f64>| {
        against_count(comparison, title, label, value)
    };
    [
        draw("Density error of the results", "epsilon, mass re-fitted", |r| Some(r.last()?.shown_error().epsilon)),
        draw("Force noise of the results", "force noise over a random set's", |r| Some(r.last()?.shown_noise())),
        draw("Run time", "seconds", |r| Some(r.seconds)),
    ]
}

/// Steps of rho/rho* - 1 between the colors of a picture, from blue (too thin) to red (too dense).
const BANDS: [(f64, &str, RGBColor); 5] = [
    (-0.05, "below -5 %", RGBColor(33, 102, 172)),
    (-0.01, "-5 to -1 %", RGBColor(103, 169, 207)),
    (0.01, "within 1 %", RGBColor(150, 150, 150)),
    (0.05, "1 to 5 %", RGBColor(239, 138, 98)),
    (f64::INFINITY, "above 5 %", RGBColor(178, 24, 43)),
];

/// The particles about the middle: all in 2-D, a slab one spacing thick in 3-D, as wide as the dots allow.
/// None in 1-D, where the profile shows the same.
pub(super) fn picture(run: &MethodRun, dimension: usize) -> Option<Figure> {
    let first = run.picture.samples.first()?;
    if dimension < 2 {
        return None;
    }
    let mut ends = [(first.x[0], first.x[0]), (first.x[1], first.x[1]), (first.x[2], first.x[2])];
    for sample in &run.picture.samples {
        for (end, x) in ends.iter_mut().zip(sample.x) {
            *end = (end.0.min(x), end.1.max(x));
        }
    }
    let middle = ends.map(|(lo, hi)| 0.5 * (lo + hi));
    let off = |s: &Sample, k: usize| (s.x[k] - middle[k]).abs();
    let across = |s: &Sample| off(s, 0).max(off(s, 1));
    let mut slab: Vec<&Sample> =
        run.picture.samples.iter().filter(|s| dimension < 3 || off(s, 2) <= 0.5 * s.spacing).collect();
    slab.sort_by(|a, b| across(a).total_cmp(&across(b)));
    slab.truncate(MOST_DOTS);
    let reach = 1.04 * slab.last().map_or(0.0, |s| across(s)).max(f64::MIN_POSITIVE);
    let error = |s: &Sample| run.picture.refit * s.density / s.target_density - 1.0;
    let mut from = f64::NEG_INFINITY;
    let curves = BANDS.map(|(to, name, color)| {
        let inside = slab.iter().filter(|s| error(s) >= from && error(s) < to);
        let points = inside.map(|s| (s.x[0], s.x[1])).collect();
        from = to;
        Curve { name: name.into(), color, joined: false, dot: 2, points }
    });
    let axis = |label, k: usize| Axis { range: Some((middle[k] - reach, middle[k] + reach)), ..Axis::linear(label) };
    Some(Figure {
        title: format!("{}: {}", run.method, if dimension < 3 { "particles" } else { "slab through the middle" }),
        size: SMALL,
        x: axis("x", 0),
        y: axis("y", 1),
        curves: curves.into(),
    })
}

/// Dots of a picture of the density: what it shows is in the whole plane, so that more are kept.
const MOST_DENSITY_DOTS: usize = 12_000;

/// Colors of the density, from the lowest to the highest: perceptually even, and told apart without color as well.
const SCALE: [RGBColor; 8] = [
    RGBColor(68, 1, 84),
    RGBColor(70, 50, 126),
    RGBColor(54, 92, 141),
    RGBColor(39, 127, 142),
    RGBColor(31, 161, 135),
    RGBColor(74, 193, 109),
    RGBColor(159, 218, 58),
    RGBColor(253, 231, 37),
];

/// The summed density of all particles in 2-D, in bands between its smallest and largest value.
pub(super) fn density_picture(run: &MethodRun, dimension: usize) -> Option<Figure> {
    if dimension != 2 || run.picture.samples.is_empty() {
        return None;
    }
    let every = run.picture.samples.len().div_ceil(MOST_DENSITY_DOTS);
    let kept: Vec<&Sample> = run.picture.samples.iter().step_by(every).collect();
    let ends = |value: fn(&Sample) -> f64| {
        let fold = |(lo, hi): (f64, f64), s: &&Sample| (lo.min(value(s)), hi.max(value(s)));
        kept.iter().fold((f64::INFINITY, f64::NEG_INFINITY), fold)
    };
    let (x, y, density) = (ends(|s| s.x[0]), ends(|s| s.x[1]), ends(|s| s.density));
    let width = (density.1 - density.0).max(f64::MIN_POSITIVE) / SCALE.len() as f64;
    let band = |s: &Sample| (((s.density - density.0) / width) as usize).min(SCALE.len() - 1);
    let curves = SCALE.iter().enumerate().map(|(i, &color)| Curve {
        name: format!("from {:.3e}", density.0 + i as f64 * width),
        color,
        joined: false,
        dot: 1,
        points: kept.iter().filter(|s| band(s) == i).map(|s| (s.x[0], s.x[1])).collect(),
    });
    let reach = 0.52 * (x.1 - x.0).max(y.1 - y.0).max(f64::MIN_POSITIVE);
    let axis = |label, (lo, hi): (f64, f64)| {
        let middle = 0.5 * (lo + hi);
        Axis { range: Some((middle - reach, middle + reach)), ..Axis::linear(label) }
    };
    Some(Figure {
        title: format!("{}: density", run.method),
        size: SMALL,
        x: axis("x", x),
        y: axis("y", y),
        curves: curves.collect(),
    })
}

/// Summed and target density at the particles, against the radius or the first coordinate.
pub(super) fn profile(run: &MethodRun) -> Figure {
    let place = |s: &Sample| if run.picture.radial { s.r } else { s.x[0] };
    let mut sorted: Vec<&Sample> = run.picture.samples.iter().collect();
    sorted.sort_by(|a, b| place(a).total_cmp(&place(b)));
    let kept: Vec<&Sample> = sorted.iter().step_by(sorted.len().div_ceil(MOST_DOTS / 2).max(1)).copied().collect();
    let (lo, hi) =
        kept.iter().fold((f64::INFINITY, 0.0_f64), |(lo, hi), s| (lo.min(s.target_density), hi.max(s.target_density)));
    let dots = |name: &str, color: RGBColor, value: fn(&Sample) -> f64| Curve {
        name: name.into(),
        color,
        joined: false,
        dot: 2,
        points: kept.iter().map(|s| (place(s), value(s))).collect(),
    };
    Figure {
        title: format!("{}: density", run.method),
        size: SMALL,
        x: Axis::linear(if run.picture.radial { "distance from the center" } else { "x" }),
        y: if hi > 30.0 * lo { Axis::logarithmic("density") } else { Axis::linear("density") },
        curves: vec![dots("particles", color(1), |s| s.density), dots("target", color(6), |s| s.target_density)],
    }
}
