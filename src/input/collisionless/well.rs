//! A density in a spherical potential, as functions of each other, with G = 1.
//!
//! Energies count as `lift`: psi(center) - psi, from the innermost radius looked at outward, so that small ones keep their digits.
//! The density is a spline of its logarithm through rows of the profile, in ln r, or in ln(r/(R - r)) where it vanishes at its
//! outer radius R. A density that is cut before it vanishes goes on as the power of the radius that it has at the cut, without
//! mass of its own.

use super::spline::Spline;
use crate::field::quadrature::integrate;

/// A body in the attraction of all that is about its center.
pub(super) struct Sphere<'a> {
    pub density: &'a (dyn Fn(f64) -> f64 + Sync),
    /// Mass within a radius that attracts.
    pub enclosed: &'a (dyn Fn(f64) -> f64 + Sync),
    /// Radii at which the density is known, ascending from above 0; the last is the outer one.
    pub nodes: &'a [f64],
}

/// Knots of the spline are this far apart, or farther where rows are.
const STEP: f64 = 0.05;
/// Places between two knots.
const FINE: usize = 5;
/// Fewer knots make no profile.
const LEAST_KNOTS: usize = 12;
/// r^3 rho of the innermost knot over the largest: nothing lies within.
const INNERMOST: f64 = 1e-7;
/// A density that has fallen to this part of the mean one vanishes.
const VANISHED: f64 = 1e-12;
/// Rows nearer to the outer radius than this part of it say little of how the density vanishes.
const EDGE: f64 = 1e-3;
/// A density that is cut goes on to this many e-folds of the radius.
const TAIL: f64 = 9.0;
/// A density that falls less steeply at the cut has no such tail: f would diverge.
const LEAST_SLOPE: f64 = 0.5;
const ORDER: usize = 4;
/// Gauss points of the potential beyond the last place.
const BEYOND: usize = 16;

/// Places outward, with what is known there.
pub(super) struct Well {
    pub radii: Vec<f64>,
    pub lift: Vec<f64>,
    /// Derivatives of the density by psi.
    pub slope: Vec<f64>,
    pub bend: Vec<f64>,
    /// Where the density ends: at the lift of its surface, or at that of infinity.
    pub end: f64,
    /// Where rho'' beyond the last place counts: in the middle of it for rho ~ psi^n there, (n - 1)/n of the way from the end.
    pub edge: f64,
    /// Lift of infinity.
    pub escape: f64,
    /// -d ln rho/d ln r of what goes on beyond the outer radius; none where the density vanishes there.
    pub tail: Option<f64>,
}

/// The variable in which the density is smooth.
#[derive(Clone, Copy)]
enum Scale {
    /// ln r.
    Radius,
    /// ln(r/(R - r)).
    Edge(f64),
}

impl Scale {
    fn of(self, r: f64) -> f64 {
        match self {
            Self::Radius => r.ln(),
            Self::Edge(outer) => (r / (outer - r)).ln(),
        }
    }

    /// The radius, and its first two derivatives.
    fn radius(self, t: f64) -> [f64; 3] {
        match self {
            Self::Radius => [t.exp(); 3],
            Self::Edge(outer) => {
                let share = 1.0 / (1.0 + (-t).exp());
                let rest = 1.0 / (1.0 + t.exp());
                [outer * share, outer * share * rest, outer * share * rest * (rest - share)]
            }
        }
    }
}

impl Well {
    /// With a tail beyond an edge at which the density does not vanish, or without.
    ///
    /// # Errors
    /// What is wrong with the density, or with a tail of it.
    pub fn new(sphere: &Sphere<'_>, has_tail: bool) -> Result<Self, String> {
        let outer = sphere.nodes.last().copied().unwrap_or(0.0);
        let heaviest = sphere.nodes.iter().map(|r| r.powi(3) * (sphere.density)(*r)).fold(0.0, f64::max);
        if !(outer > 0.0 && heaviest > 0.0 && heaviest.is_finite()) {
            return Err("are drawn for a body with a density, but this one has none".into());
        }
        let vanishes = (sphere.density)(outer) * outer.powi(3) < VANISHED * heaviest;
        let scale = if vanishes { Scale::Edge(outer) } else { Scale::Radius };
        let (mut places, mut logs) = knots(sphere, scale, (outer, heaviest));
        if places.len() < LEAST_KNOTS {
            return Err(format!(
                "are drawn from the shape of the density, of which the input tells {} radii; expected {LEAST_KNOTS} at least",
                places.len()
            ));
        }
        let tail = if vanishes || !has_tail { None } else { Some(lengthen(&mut places, &mut logs)?) };
        let radii_of = |i: usize, k: usize| places[i] + (places[i + 1] - places[i]) * k as f64 / FINE as f64;
        let all: Vec<(usize, usize)> = (0..places.len() - 1).flat_map(|i| (0..FINE).map(move |k| (i, k))).collect();
        let radius = |(i, k): (usize, usize)| scale.radius(radii_of(i, k));
        let radii: Vec<f64> = all.iter().map(|p| radius(*p)[0]).collect();
        let spline = Spline::new(places.clone(), logs);
        let mut well = Self {
            lift: lifts(sphere, &radii),
            radii,
            slope: Vec::new(),
            bend: Vec::new(),
            end: 0.0,
            edge: 0.0,
            escape: 0.0,
            tail,
        };
        for &(i, k) in &all {
            let t = radii_of(i, k);
            let [slope, bend] =
                derivatives(sphere, scale, t, spline.within(i, k as f64 / FINE as f64), 0.5 * STEP / FINE as f64);
            well.slope.push(slope);
            well.bend.push(bend);
        }
        let last = well.radii.len() - 1;
        let (r, lift) = (well.radii[last], well.lift[last]);
        well.escape = lift + beyond(sphere, r);
        well.end = if vanishes { lift + rise(sphere, r, outer) } else { well.escape };
        let left = well.end - lift;
        let density = spline.within(places.len() - 2, (FINE - 1) as f64 / FINE as f64)[0].exp();
        let power = (well.slope[last] * left / density).max(1.0);
        well.edge = well.end - left * (power - 1.0) / power;
        match well.lift.iter().chain(&well.slope).chain(&well.bend).all(|v| v.is_finite()) && well.escape.is_finite() {
            true => Ok(well),
            false => Err("are drawn in a potential that is not finite; expected one of a body with a mass".into()),
        }
    }

    /// The place at or within the radius `r`, and the lift there.
    pub fn at(&self, r: f64) -> (usize, f64) {
        let i = self.radii.partition_point(|x| *x <= r).saturating_sub(1).min(self.radii.len() - 2);
        let [a, b] = [self.radii[i], self.radii[i + 1]];
        let share = ((r - a) / (b - a)).clamp(0.0, 1.0);
        (i, self.lift[i] + share * (self.lift[i + 1] - self.lift[i]))
    }
}

/// Places and logarithms of the density, from rows of the profile.
fn knots(sphere: &Sphere<'_>, scale: Scale, (outer, heaviest): (f64, f64)) -> (Vec<f64>, Vec<f64>) {
    let (mut places, mut logs): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let is_edge = matches!(scale, Scale::Edge(_));
    for &r in sphere.nodes {
        let density = (sphere.density)(r);
        let is_within = !is_edge || outer - r > EDGE * outer;
        if !(density > 0.0 && is_within && (!places.is_empty() || r.powi(3) * density >= INNERMOST * heaviest)) {
            continue;
        }
        let (t, log) = (scale.of(r), density.ln());
        if places.last().is_none_or(|last| t - last >= STEP) {
            places.push(t);
            logs.push(log);
        } else if r >= outer && places.len() > 1 {
            // The last row is the edge.
            let last = places.len() - 1;
            (places[last], logs[last]) = (t, log);
        }
    }
    (places, logs)
}

/// Goes on as the power of the radius that the density has at the last knots; returns it.
fn lengthen(places: &mut Vec<f64>, logs: &mut Vec<f64>) -> Result<f64, String> {
    let n = places.len();
    let secant = |i: usize| (logs[i] - logs[i - 1]) / (places[i] - places[i - 1]);
    let (last, before) = (secant(n - 1), secant(n - 2));
    let (wide, narrow) = (places[n - 2] - places[n - 3], places[n - 1] - places[n - 2]);
    let steep = -(last + (last - before) * narrow / (wide + narrow));
    if !(steep >= LEAST_SLOPE) {
        return Err(format!(
            "are drawn from f(E), but the density is cut where it goes as r^{:.2}: no isotropic velocities hold such an edge; `velocities: jeans` \
             draws Gaussian ones, or let the density fall before its edge",
            -steep
        ));
    }
    let (t, log) = (places[n - 1], logs[n - 1]);
    for i in 1..=(TAIL / STEP) as usize {
        places.push(t + STEP * i as f64);
        logs.push(log - steep * STEP * i as f64);
    }
    Ok(steep)
}

/// First and second derivative of the density by psi, from those of its logarithm by `t`.
fn derivatives(sphere: &Sphere<'_>, scale: Scale, t: f64, [log, s, ss]: [f64; 3], step: f64) -> [f64; 2] {
    let [r, r_t, r_tt] = scale.radius(t);
    let mass = (sphere.enclosed)(r);
    let mass_t =
        ((sphere.enclosed)(scale.radius(t + step)[0]) - (sphere.enclosed)(scale.radius(t - step)[0])) / (2.0 * step);
    let density = log.exp();
    let (rho_t, rho_tt) = (density * s, density * (ss + s * s));
    let psi_t = -mass * r_t / (r * r);
    let psi_tt = -(mass_t * r_t + mass * r_tt) / (r * r) + 2.0 * mass * r_t * r_t / r.powi(3);
    [rho_t / psi_t, (rho_tt * psi_t - rho_t * psi_tt) / psi_t.powi(3)]
}

/// psi(a) - psi(b).
fn rise(sphere: &Sphere<'_>, a: f64, b: f64) -> f64 {
    integrate(ORDER, a, b, &|r| (sphere.enclosed)(r) / (r * r))
}

fn lifts(sphere: &Sphere<'_>, radii: &[f64]) -> Vec<f64> {
    let mut all = vec![0.0];
    for pair in radii.windows(2) {
        all.push(all[all.len() - 1] + rise(sphere, pair[0], pair[1]));
    }
    all
}

/// psi(r), the integral of M/s^2 from r to infinity, in u = 1/s; masses far out may end at any radius.
fn beyond(sphere: &Sphere<'_>, r: f64) -> f64 {
    let mut total = 0.0;
    let mut high = 1.0 / r;
    for _ in 0..BEYOND {
        let low = 0.5 * high;
        total += integrate(BEYOND, low, high, &|u| (sphere.enclosed)(1.0 / u));
        high = low;
    }
    total + high * (sphere.enclosed)(1.0 / high)
}
