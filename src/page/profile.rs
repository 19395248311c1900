//! Density and error against the radius or along an axis.

use super::axis::Axis;
use super::figure::{Band, Curve, Figure};
use super::portrait::{Portrait, Side, shown_end};
use super::statistics::quantile;

/// Bins of a profile, at most, and particles in each on average, at least.
const BINS: usize = 80;
const IN_BIN: usize = 12;

/// Mean of a bin, with what 16 % and 84 % of its particles stay below.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spread {
    pub mean: f64,
    pub low: f64,
    pub high: f64,
}

impl Spread {
    fn new(mut values: Vec<f64>) -> Option<Self> {
        values.retain(|v| v.is_finite());
        values.sort_unstable_by(f64::total_cmp);
        let mean = values.iter().map(|v| v / values.len() as f64).sum();
        Some(Self { mean, low: quantile(&values, 0.16)?, high: quantile(&values, 0.84)? })
    }
}

/// Particles between two places, in the file's units.
#[derive(Debug, Clone)]
pub(super) struct Bin {
    pub from: f64,
    pub to: f64,
    pub density: Spread,
    pub target: Option<f64>,
    pub smoothed: Option<f64>,
    pub error: Option<Spread>,
    /// Share of particles where the kernel can follow the target.
    pub resolved: Option<f64>,
}

impl Bin {
    fn middle(&self) -> f64 {
        0.5 * (self.from + self.to)
    }
}

/// The axis along which the density changes most.
pub(super) fn steepest(portrait: &Portrait) -> usize {
    let contrast = |k: usize| {
        let places: Vec<f64> = portrait.positions.iter().map(|x| x[k]).collect();
        let bins = in_bins(portrait, &places, (portrait.lo[k], portrait.hi[k]), 16);
        let means: Vec<f64> = bins.iter().map(|b| b.density.mean).collect();
        let (lo, hi) = means.iter().fold((f64::INFINITY, 0.0_f64), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
        if hi > 0.0 { (hi - lo) / hi } else { 0.0 }
    };
    // A tenth more counts as more: noise does not choose.
    (1..portrait.dimension).fold(0, |best, k| if contrast(k) > 0.1 + contrast(best) { k } else { best })
}

/// Places of all particles, their range, and what they are called.
fn places(portrait: &Portrait) -> (Vec<f64>, (f64, f64), String) {
    match portrait.side {
        Side::Radius(center) => {
            let radius = |x: &[f64; 3]| {
                let [a, b, c] = sph::array(|k| x[k] - center[k]);
                f64::hypot(f64::hypot(a, b), c)
            };
            let places: Vec<f64> = portrait.positions.iter().map(radius).collect();
            let end = shown_end(places.clone());
            (places, (0.0, end), portrait.length_label("distance from the center"))
        }
        Side::Axis => {
            let k = steepest(portrait);
            let places = portrait.positions.iter().map(|x| x[k]).collect();
            (places, (portrait.lo[k], portrait.hi[k]), portrait.length_label(["x", "y", "z"][k]))
        }
    }
}

/// About `count` bins of the profile.
pub(super) fn binned(portrait: &Portrait, count: usize) -> Vec<Bin> {
    let (places, ends, _) = places(portrait);
    in_bins(portrait, &places, ends, count)
}

/// Bins of equal width, those with few particles put together with their next.
fn in_bins(portrait: &Portrait, places: &[f64], (lo, hi): (f64, f64), count: usize) -> Vec<Bin> {
    let n = places.len();
    let count = count.min(n / IN_BIN).max(1);
    let width = (hi - lo) / count as f64;
    let bin_of = |x: f64| if width > 0.0 { (((x - lo) / width) as usize).min(count - 1) } else { 0 };
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); count];
    // What is beyond the ends is not in the figure.
    let inside = places.iter().enumerate().filter(|(_, x)| (lo..=hi).contains(*x));
    inside.for_each(|(i, x)| members[bin_of(*x)].push(i));
    let least = (IN_BIN / 2).min(n);
    let (mut out, mut from, mut open) = (Vec::new(), lo, Vec::new());
    for (b, here) in members.into_iter().enumerate() {
        open.extend(here);
        let to = if b + 1 == count { hi } else { lo + (b + 1) as f64 * width };
        if open.len() >= least || (b + 1 == count && !open.is_empty()) {
            out.extend(bin(portrait, (from, to), &open));
            open.clear();
            from = to;
        }
    }
    out
}

fn bin(portrait: &Portrait, (from, to): (f64, f64), members: &[usize]) -> Option<Bin> {
    let of = |column: &[f64]| -> Option<Spread> {
        Spread::new(members.iter().filter_map(|&i| column.get(i).copied()).collect())
    };
    let wanted = portrait.detail.wanted.as_ref();
    let resolved: Vec<bool> = members.iter().filter_map(|&i| portrait.is_resolved(i)).collect();
    Some(Bin {
        from,
        to,
        density: of(&portrait.detail.density)?,
        target: wanted.and_then(|w| of(&w.target)).map(|s| s.mean),
        smoothed: wanted.and_then(|w| of(&w.smoothed)).map(|s| s.mean),
        error: Spread::new(members.iter().filter_map(|&i| portrait.error(i)).collect()),
        resolved: (!resolved.is_empty())
            .then(|| resolved.iter().filter(|r| **r).count() as f64 / resolved.len() as f64),
    })
}

/// What the kernel cannot follow: bins where most particles are of that kind.
fn shades(bins: &[Bin]) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::new();
    for bin in bins.iter().filter(|b| b.resolved.is_some_and(|r| r < 0.5)) {
        match out.last_mut().filter(|last| last.1 >= bin.from) {
            Some(last) => last.1 = bin.to,
            None => out.push((bin.from, bin.to)),
        }
    }
    out
}

/// Density against target, and the error.
pub(super) fn figures(portrait: &Portrait) -> Vec<Figure> {
    let (places, ends, label) = places(portrait);
    let bins = in_bins(portrait, &places, ends, BINS);
    let factor = portrait.labels.density_factor;
    let shades = shades(&bins);
    let shade_name = "the kernel cannot follow";
    let curve = |value: &dyn Fn(&Bin) -> Option<f64>| -> Vec<(f64, f64)> {
        bins.iter().filter_map(|b| Some((b.middle(), factor * value(b)?))).collect()
    };
    let mut curves = Vec::new();
    let smoothed = curve(&|b| b.smoothed);
    if !smoothed.is_empty() {
        curves.push(Curve { dashed: true, ..Curve::line("target as the kernel sees it", Some(0), smoothed) });
    }
    let target = curve(&|b| b.target);
    if !target.is_empty() {
        curves.insert(0, Curve::line("target", None, target));
    }
    curves.push(Curve::line("particles, mean", Some(1), curve(&|b| Some(b.density.mean))));
    let all = curves.iter().flat_map(|c| &c.points).map(|p| p.1);
    let mut y = Axis::for_values(portrait.density_label(), all.clone());
    if !y.logarithmic {
        // From 0, so that small waves are not blown up.
        let top = all.chain(bins.iter().map(|b| factor * b.density.high)).fold(0.0, f64::max);
        y = y.within(0.0, 1.08 * top);
    }
    let edges = bins.iter().map(|b| (b.middle(), factor * b.density.low, factor * b.density.high)).collect();
    let x = Axis::linear(label).within(ends.0, ends.1);
    let mut out = vec![Figure {
        bands: vec![Band { name: "68 % of them".into(), color: 1, edges }],
        shades: shades.clone(),
        shade_name: shade_name.into(),
        ..Figure::new("Density profile", x.clone(), y, curves)
    }];
    let errors: Vec<(&Bin, Spread)> = bins.iter().filter_map(|b| Some((b, b.error?))).collect();
    if !errors.is_empty() {
        let mean = errors.iter().map(|(b, e)| (b.middle(), 100.0 * e.mean)).collect();
        let edges = errors.iter().map(|(b, e)| (b.middle(), 100.0 * e.low, 100.0 * e.high)).collect();
        let zero = Curve { dashed: true, ..Curve::line("", None, vec![(ends.0, 0.0), (ends.1, 0.0)]) };
        let y = Axis::linear("\u{3c1}/\u{3c1}* \u{2212} 1 [%]");
        out.push(Figure {
            bands: vec![Band { name: "68 % of the particles".into(), color: 1, edges }],
            shades,
            shade_name: shade_name.into(),
            caption: "Of the summed density, the mass as it is in the particles.".into(),
            ..Figure::new("Density error", x, y, vec![zero, Curve::line("mean", Some(1), mean)])
        });
    }
    out
}
