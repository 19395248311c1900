//! Histograms of error, force noise and neighbor distances.

use super::axis::{Axis, rounded};
use super::figure::{Curve, Figure, Mark};
use super::portrait::Portrait;

/// Columns of a histogram, at most.
const COLUMNS: usize = 50;

/// The value below which this share of ascending values lies.
pub(super) fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    sorted.get(((sorted.len() as f64 * share) as usize).min(sorted.len().saturating_sub(1))).copied()
}

/// Shares of `values` between `lo` and `hi`, in per cent of `of`; what is beyond counts at the ends.
fn shares(values: &[f64], (lo, hi): (f64, f64), columns: usize, of: usize) -> Vec<(f64, f64)> {
    let mut counts = vec![0_usize; columns];
    for v in values {
        let place = (v - lo) / (hi - lo) * columns as f64;
        counts[(place.max(0.0) as usize).min(columns - 1)] += 1;
    }
    let left = |i: usize| lo + (hi - lo) * i as f64 / columns as f64;
    let share = |i: usize| 100.0 * counts[i.min(columns - 1)] as f64 / of.max(1) as f64;
    let edges = (0..=columns).map(|i| (left(i), share(i)));
    std::iter::once((lo, 0.0)).chain(edges).chain([(hi, 0.0)]).collect()
}

/// A name, a color and the values of one set.
type Set<'a> = (&'a str, Option<usize>, Vec<f64>);

/// `sets` between these ends, each in per cent of all particles. Values are placed as the axis places them.
fn histogram(title: &str, x: Axis, (lo, hi): (f64, f64), sets: Vec<Set<'_>>) -> Option<Figure> {
    let count = sets.iter().map(|s| s.2.len()).max().filter(|n| *n > 0)?;
    let columns = (2.0 * (count as f64).sqrt()).clamp(4.0, COLUMNS as f64) as usize;
    let beyond = |s: &Set<'_>| s.2.iter().filter(|v| **v < lo || **v > hi).count();
    let outside = sets.iter().map(beyond).max().unwrap_or(0);
    let logarithmic = x.logarithmic;
    let real = |v: f64| if logarithmic { 10f64.powf(v) } else { v };
    let curves = sets.iter().map(|(name, color, values)| {
        let points = shares(values, (lo, hi), columns, count).into_iter().map(|(x, y)| (real(x), y)).collect();
        Curve { mark: Mark::Steps, ..Curve::line(*name, *color, points) }
    });
    let mut figure =
        Figure::new(title, x.within(real(lo), real(hi)), Axis::linear("share of the particles [%]"), curves.collect());
    let most = figure.curves.iter().flat_map(|c| &c.points).map(|p| p.1).fold(0.0, f64::max);
    figure.y = figure.y.within(0.0, 1.06 * most.max(1e-3));
    if outside > 0 {
        let values = sets.iter().flat_map(|s| &s.2);
        let (least, largest) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        figure.caption = format!(
            "{outside} of {count} particles are beyond the ends and counted there; all are from {} to {}.",
            rounded(real(least)),
            rounded(real(largest))
        );
    }
    Some(figure)
}

/// Ends that hold all but a few.
fn ends(values: &[f64], share: f64) -> Option<(f64, f64)> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    Some((quantile(&sorted, 1.0 - share)?, quantile(&sorted, share)?))
}

fn errors(portrait: &Portrait) -> Option<Figure> {
    let all: Vec<f64> = (0..portrait.count()).filter_map(|i| portrait.error(i)).map(|e| 100.0 * e).collect();
    let resolved = (0..portrait.count()).filter(|&i| portrait.is_resolved(i) == Some(true));
    let resolved: Vec<f64> = resolved.filter_map(|i| portrait.error(i)).map(|e| 100.0 * e).collect();
    let (lo, hi) = ends(&all, 0.98)?;
    let reach = (1.2 * lo.abs().max(hi.abs())).max(1e-3);
    let mut sets: Vec<Set<'_>> = vec![("all", None, all)];
    if !resolved.is_empty() {
        sets.push(("where the kernel can follow", Some(0), resolved));
    }
    histogram("Density error", Axis::linear("\u{3c1}/\u{3c1}* \u{2212} 1 [%]"), (-reach, reach), sets)
}

fn noise(portrait: &Portrait) -> Option<Figure> {
    let logs = portrait.detail.noise.iter().map(|v| (100.0 * v).log10()).filter(|v| v.is_finite()).collect::<Vec<_>>();
    let (lo, hi) = ends(&logs, 0.995)?;
    let (lo, hi) = ((lo - 0.05).floor(), (hi + 0.05).ceil());
    let x = Axis::logarithmic("force noise [% of a random set's]");
    histogram("Force noise", x, (lo, hi.max(lo + 1.0)), vec![("all", Some(2), logs)])
}

fn distances(portrait: &Portrait) -> Option<Figure> {
    let values: Vec<f64> = portrait.detail.nearest.iter().copied().filter(|v| v.is_finite()).collect();
    let (_, hi) = ends(&values, 0.999)?;
    let x = Axis::linear("nearest neighbor [mean spacings]");
    histogram("Distance of the nearest neighbor", x, (0.0, (1.1 * hi).max(1.2)), vec![("all", Some(3), values)])
}

/// What there is to be shown of these particles.
pub(super) fn figures(portrait: &Portrait) -> Vec<Figure> {
    [errors(portrait), noise(portrait), distances(portrait)].into_iter().flatten().collect()
}
