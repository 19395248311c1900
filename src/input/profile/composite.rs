//! Composite polytropes: zones of different indices from the center outward, in hydrostatic equilibrium under their own gravity.
//!
//! In each zone P = P_i theta^(n + 1) and rho = rho_i theta^n from its inner boundary i, with
//!
//! d theta/dr = -G m rho_i / ((n + 1) P_i r^2),  dm/dr = 4 pi r^2 rho.
//!
//! Pressure and mass are continuous; so is the temperature, so that the density jumps by the ratio of the mean molecular weights
//! (Chandrasekhar 1939, chapter IV; Schoenberg & Chandrasekhar 1942, ApJ 96, 161). The equations have no scale: they are solved with
//! rho = P = 4 pi G = 1 in the center, and mass and radius scale the solution. Where boundaries are depends on the mass and radius of the
//! whole, which is found by bisection.

use super::spheres::key;
use super::table::Table;
use crate::error::{Error, Result};
use crate::ode;
use crate::scene::PolytropeZone;
use std::f64::consts::PI;

const MODEL: &str = "composite-polytrope";
/// Steps over which the radius grows by the scale of the center, or by itself farther out.
const STEPS: f64 = 1000.0;
/// Larger ones are of a body without a surface.
const MOST_STEPS: usize = 60_000;
/// Steps by Newton's method to a boundary; each squares the distance to it.
const REFINEMENTS: usize = 40;
/// The whole is looked for over this many decades, in steps of a part of a decade.
const DECADES: i32 = 12;
const PARTS: i32 = 4;
const BISECTIONS: usize = 60;
/// Largest index: zones of larger ones are isothermal for all purposes.
const LARGEST: f64 = 1000.0;

/// A zone, with what it is bounded by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Zone {
    pub n: f64,
    /// Part of the whole mass, or radius, at its outer boundary; 1 in the outermost.
    pub end: f64,
    /// Mean molecular weight.
    pub weight: f64,
}

/// What boundaries are parts of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Bounds {
    Mass,
    Radius,
}

/// Zones as a scene states them.
///
/// # Errors
/// Boundaries that do not ascend or are of both kinds, and numbers that are none.
pub(super) fn zones(stated: &[PolytropeZone]) -> Result<(Vec<Zone>, Bounds)> {
    let wrong = |name: &str, problem: String| Err(Error::scene(key(MODEL, name), problem));
    let Some((_, inner)) = stated.split_last() else { return wrong("zones", "are none; expected one at least".into()) };
    let is_by_mass = inner.iter().all(|z| z.mass_fraction.is_some() && z.radius_fraction.is_none());
    let is_by_radius = inner.iter().all(|z| z.radius_fraction.is_some() && z.mass_fraction.is_none());
    if !(is_by_mass || is_by_radius) {
        let problem =
            "have a mass_fraction, or all of them a radius_fraction, at the outer boundary of each but the last";
        return wrong("zones", problem.into());
    }
    let mut before = 0.0;
    let mut zones = Vec::new();
    for (i, zone) in stated.iter().enumerate() {
        let stated_end = zone.mass_fraction.or(zone.radius_fraction);
        let is_last = i == inner.len();
        if is_last && stated_end.is_some() {
            return wrong(
                &format!("zones[{i}]"),
                "ends with the body; leave its mass_fraction or radius_fraction out".into(),
            );
        }
        let end = stated_end.unwrap_or(1.0);
        if !(end > before && (end < 1.0 || is_last)) {
            return wrong(&format!("zones[{i}]"), format!("ends at {end}, expected a part above {before} and below 1"));
        }
        let weight = zone.mean_molecular_weight;
        if !(weight.is_finite() && weight > 0.0) {
            return wrong(
                &format!("zones[{i}].mean_molecular_weight"),
                format!("is {weight}, expected a positive number"),
            );
        }
        if !(0.0..=LARGEST).contains(&zone.n) {
            return wrong(&format!("zones[{i}].n"), format!("is {}, expected 0 to {LARGEST}", zone.n));
        }
        before = end;
        zones.push(Zone { n: zone.n, end, weight });
    }
    Ok((zones, if is_by_mass { Bounds::Mass } else { Bounds::Radius }))
}

/// A place of the solution.
#[derive(Debug, Clone, Copy)]
struct Point {
    r: f64,
    mass: f64,
    theta: f64,
}

/// A row: radius, mass, density and pressure.
#[derive(Debug, Clone, Copy)]
struct Row {
    r: f64,
    mass: f64,
    density: f64,
    pressure: f64,
}

/// A zone with the state at its inner boundary.
struct Layer {
    n: f64,
    density: f64,
    pressure: f64,
}

impl Layer {
    fn row(&self, p: &Point) -> Row {
        let theta = p.theta.max(0.0);
        Row {
            r: p.r,
            mass: p.mass,
            density: self.density * theta.powf(self.n),
            pressure: self.pressure * theta.powf(self.n + 1.0),
        }
    }

    /// Derivatives of mass (over 4 pi) and theta.
    fn slopes(&self, r: f64, [mass, theta]: [f64; 2]) -> [f64; 2] {
        let density = self.density * theta.max(0.0).powf(self.n);
        // Near the center m/r^2 is rho r/3.
        let pull = if r > 0.0 { mass / (r * r) } else { 0.0 };
        [r * r * density, -pull * self.density / ((self.n + 1.0) * self.pressure)]
    }

    /// A step of Runge and Kutta's fourth order.
    fn step(&self, from: &Point, h: f64) -> Point {
        let [mass, theta] = ode::step(from.r, [from.mass, from.theta], h, |r, y| self.slopes(r, y));
        Point { r: from.r + h, mass, theta }
    }

    /// The place at which `left` vanishes, from one near before it; `left` gives what is left and its decrease by radius.
    fn refine(&self, mut p: Point, left: &dyn Fn(&Point) -> (f64, f64)) -> Point {
        for _ in 0..REFINEMENTS {
            let (rest, fall) = left(&p);
            let h = rest / fall;
            if !(h.abs() > 1e-15 * p.r) || !h.is_finite() {
                break;
            }
            p = self.step(&p, h);
        }
        p
    }
}

/// Rows of a body whose whole mass, or radius, is `whole` for its boundaries; `None` where it has no surface within reach.
fn solve(zones: &[Zone], bounds: Bounds, whole: f64) -> Option<Vec<Row>> {
    // (n + 1) P/(4 pi G rho^2) is the square of the scale in the center.
    let scale = (zones[0].n + 1.0).sqrt();
    let mut p = Point { r: 0.0, mass: 0.0, theta: 1.0 };
    let mut layer = Layer { n: zones[0].n, density: 1.0, pressure: 1.0 };
    let mut rows = vec![layer.row(&p)];
    for (i, zone) in zones.iter().enumerate() {
        let is_last = i + 1 == zones.len();
        let end = if is_last { f64::INFINITY } else { zone.end * whole };
        let reached = |p: &Point| if bounds == Bounds::Mass { p.mass } else { p.r };
        loop {
            if rows.len() > MOST_STEPS {
                return None;
            }
            // Layers at the surface of a zone are thin.
            let fall = -layer.slopes(p.r, [p.mass, p.theta])[1];
            let thin = if fall > 0.0 { 0.1 * p.theta / fall } else { f64::INFINITY };
            let h = ((scale + p.r) / STEPS).min(thin.max(1e-6 * (scale + p.r)));
            let next = layer.step(&p, h);
            if reached(&next) >= end && next.theta > 0.0 {
                p = layer.refine(p, &|p| match bounds {
                    Bounds::Mass => (end - p.mass, layer.slopes(p.r, [p.mass, p.theta])[0]),
                    Bounds::Radius => (end - p.r, 1.0),
                });
                break;
            }
            if !(next.theta > 0.0) {
                let surface = layer.refine(p, &|p| (p.theta, -layer.slopes(p.r, [p.mass, p.theta])[1]));
                let row = Row {
                    density: if layer.n == 0.0 { layer.density } else { 0.0 },
                    pressure: 0.0,
                    ..layer.row(&surface)
                };
                rows.push(row);
                return Some(rows);
            }
            p = next;
            rows.push(layer.row(&p));
        }
        let row = layer.row(&p);
        let (inner, outer) = (zone, zones.get(i + 1)?);
        layer = Layer { n: outer.n, density: row.density * outer.weight / inner.weight, pressure: row.pressure };
        p.theta = 1.0;
        rows.extend([row, layer.row(&p)]);
    }
    None
}

/// The mass or radius of the whole over that for which its boundaries are; without a surface it is more than any.
fn excess(zones: &[Zone], bounds: Bounds, whole: f64) -> f64 {
    let Some(last) = solve(zones, bounds, whole).and_then(|rows| rows.last().copied()) else { return f64::INFINITY };
    if bounds == Bounds::Mass { last.mass / whole } else { last.r / whole }
}

/// The table of a body of this mass and radius.
///
/// # Errors
/// Zones that make no body.
pub(super) fn composite(zones: &[Zone], bounds: Bounds, mass: f64, radius: f64, gravity: f64) -> Result<Table> {
    let at = |i: i32| 10f64.powf(f64::from(i) / f64::from(PARTS));
    let excesses: Vec<f64> = (-DECADES * PARTS..=DECADES * PARTS).map(|i| excess(zones, bounds, at(i))).collect();
    let found = excesses.windows(2).position(|pair| pair[0] > 1.0 && pair[1] <= 1.0);
    let found = found.map(|i| i as i32 - DECADES * PARTS);
    let none = || {
        let problem =
            "have no body with a surface and these boundaries; outer zones of n below 5, and smaller cores, have one";
        Error::scene(key(MODEL, "zones"), problem)
    };
    let (mut low, mut high) = found.map(|i| (at(i), at(i + 1))).ok_or_else(none)?;
    for _ in 0..BISECTIONS {
        let middle = (low * high).sqrt();
        if excess(zones, bounds, middle) > 1.0 { low = middle } else { high = middle }
    }
    // The one that jumps from a body to none is no solution.
    if !((excess(zones, bounds, high) - 1.0).abs() < 1e-6) {
        return Err(none());
    }
    let rows = solve(zones, bounds, high).ok_or_else(none)?;
    let last = rows[rows.len() - 1];
    // With 4 pi G = 1 the masses of the solution are over 4 pi.
    let length = radius / last.r;
    let density = mass / (4.0 * PI * last.mass * length.powi(3));
    let pressure = 4.0 * PI * gravity * (density * length).powi(2);
    let mut radii: Vec<f64> = rows.iter().map(|row| row.r * length).collect();
    radii.iter_mut().last().into_iter().for_each(|r| *r = radius);
    Ok(Table {
        radii,
        density: rows.iter().map(|row| row.density * density).collect(),
        pressure: Some(rows.iter().map(|row| row.pressure * pressure).collect()),
        ..Table::default()
    })
}

#[cfg(test)]
mod tests {
    use super::super::spheres::polytrope;
    use super::*;

    fn zone(n: f64, end: f64, weight: f64) -> Zone {
        Zone { n, end, weight }
    }

    fn value(radii: &[f64], values: &[f64], r: f64) -> f64 {
        let i = radii.partition_point(|x| *x < r).max(1);
        let share = (r - radii[i - 1]) / (radii[i] - radii[i - 1]);
        values[i - 1] + share * (values[i] - values[i - 1])
    }

    /// Zones of one index and one weight are a polytrope, wherever they meet.
    #[test]
    fn zones_of_one_index_are_a_polytrope() {
        for n in [0.0, 1.0, 1.5, 3.0] {
            let whole = polytrope(3, n, 2.0, 3.0, 5.0).unwrap();
            for bounds in [Bounds::Mass, Bounds::Radius] {
                let zones = [zone(n, 0.2, 1.0), zone(n, 0.6, 1.0), zone(n, 1.0, 1.0)];
                let made = composite(&zones, bounds, 2.0, 3.0, 5.0).unwrap();
                // Straight lines between rows, of which there are a thousand, are as good as 1e-4 away from the surface.
                for r in [0.1, 0.5, 1.0, 1.5, 2.0] {
                    for (a, b) in [
                        (&made.density, &whole.density),
                        (made.pressure.as_ref().unwrap(), whole.pressure.as_ref().unwrap()),
                    ] {
                        let (found, exact) = (value(&made.radii, a, r), value(&whole.radii, b, r));
                        assert!((found - exact).abs() < 1e-4 * exact, "{n} {bounds:?} {r}: {found} {exact}");
                    }
                }
            }
        }
    }

    /// Against steps of the midpoint rule for P and m by radius, 4e5 of them, whose errors of 1e-9 or so do not count.
    #[test]
    fn zones_are_in_equilibrium_by_another_integration() {
        let zones = [zone(3.0, 0.3, 1.0), zone(1.5, 1.0, 0.5)];
        let (mass, radius, gravity) = (2.0, 3.0, 5.0);
        let made = composite(&zones, Bounds::Mass, mass, radius, gravity).unwrap();
        let pressure = made.pressure.as_ref().unwrap();
        assert!((made.radii[made.radii.len() - 1] - radius).abs() < 1e-12);
        let jump = made.radii.windows(2).position(|r| r[0] == r[1]).unwrap();
        assert!((made.density[jump + 1] / made.density[jump] - 0.5).abs() < 1e-12);
        assert_eq!(pressure[jump], pressure[jump + 1]);
        // K of each zone from the state at its boundary, and then hydrostatics from the center by radius.
        let constants = [jump, jump + 1].map(|i| [made.density[i], pressure[i]]);
        let law = |p: f64, k: usize| constants[k][0] * (p / constants[k][1]).powf(zones[k].n / (zones[k].n + 1.0));
        let (mut r, mut m, mut p) = (0.0, 0.0, pressure[0]);
        let h = radius / 4e5;
        let mut worst = 0.0_f64;
        let mut count = 0;
        while r < 0.7 * radius {
            let zone = usize::from(m >= 0.3 * mass);
            let middle = r + 0.5 * h;
            let rho = law(p, zone);
            let half = m + 0.5 * h * 4.0 * PI * middle * middle * rho;
            let there = law(p - 0.5 * h * gravity * half * rho / (middle * middle), zone);
            p -= h * gravity * half * there / (middle * middle);
            m += h * 4.0 * PI * middle * middle * there;
            r += h;
            count += 1;
            if count % 20_000 == 0 {
                worst = worst.max((value(&made.radii, pressure, r) / p - 1.0).abs());
            }
        }
        assert!(worst < 1e-4, "{worst}");
        let boundary = made.radii[jump];
        let within: f64 = made.radii[..=jump]
            .windows(2)
            .zip(made.density.windows(2))
            .map(|(r, d)| 4.0 / 3.0 * PI * (r[1].powi(3) - r[0].powi(3)) * 0.5 * (d[0] + d[1]))
            .sum();
        assert!((within / mass - 0.3).abs() < 1e-4, "{within} within {boundary}");
    }

    #[test]
    fn zones_that_make_no_body_are_refused() {
        for zones in [
            vec![zone(1.5, 0.3, 1.0), zone(5.5, 1.0, 1.0)],
            // Beyond the limit of Schoenberg and Chandrasekhar.
            vec![zone(1000.0, 0.9, 4.0), zone(3.0, 1.0, 1.0)],
        ] {
            assert!(composite(&zones, Bounds::Mass, 1.0, 1.0, 1.0).is_err(), "{zones:?}");
        }
    }

    #[test]
    fn zones_are_stated_in_order() {
        let zone = |n: f64, mass_fraction: Option<f64>, radius_fraction: Option<f64>| PolytropeZone {
            n,
            mass_fraction,
            radius_fraction,
            mean_molecular_weight: 1.0,
        };
        let (made, bounds) = zones(&[zone(3.0, None, Some(0.2)), zone(1.5, None, None)]).unwrap();
        assert!(bounds == Bounds::Radius && made[0].end == 0.2 && made[1].end == 1.0);
        for wrong in [
            vec![],
            vec![zone(1.5, None, None), zone(1.5, None, None)],
            vec![zone(1.5, Some(0.5), None)],
            vec![zone(3.0, Some(0.5), Some(0.5)), zone(1.5, None, None)],
            vec![zone(3.0, Some(0.5), None), zone(2.0, None, Some(0.6)), zone(1.5, None, None)],
            vec![zone(3.0, Some(0.5), None), zone(2.0, Some(0.4), None), zone(1.5, None, None)],
            vec![zone(3.0, Some(1.0), None), zone(1.5, None, None)],
            vec![zone(-1.0, Some(0.5), None), zone(1.5, None, None)],
            vec![zone(f64::NAN, Some(0.5), None), zone(1.5, None, None)],
        ] {
            let error = zones(&wrong).err().unwrap_or_else(|| panic!("{wrong:?}")).to_string();
            assert!(error.contains("input.profile.composite-polytrope.zones"), "{error}");
        }
    }
}
