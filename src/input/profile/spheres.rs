//! Bodies whose density is known in closed form, or as a solution of the equation of [`super::emden`].

use super::emden::{Emden, End, Point};
use super::table::{Table, hydrostatic, radii_beyond_core, radii_of_cusp};
use crate::error::{Error, Result};
use sph::geometry::unit_sphere_area;
use std::f64::consts::PI;

/// Polytropes of a larger index have hardly a surface any more.
const LARGEST_INDEX: f64 = 4.99;
/// Share of the mass within the innermost row of a cusp.
const UNRESOLVED: f64 = 1e-10;
/// Innermost rows are not closer to the center than this, in units of the radius.
const INNERMOST: f64 = 1e-60;
/// Isothermal spheres have the most mass for their radius here (Bonnor 1956, MNRAS 116, 351).
const MOST_MASSIVE: f64 = 8.993;
const BISECTIONS: usize = 80;

pub(super) fn key(model: &str, name: &str) -> String {
    format!("input.profile.{model}.{name}")
}

/// rho = rho_c theta^n and P = P_c theta^(n + 1), P_c = 4 pi G rho_c^2 r_c^2 / (n + 1).
pub(super) fn polytrope(d: usize, n: f64, mass: f64, radius: f64, gravity: f64) -> Result<Table> {
    let refused = |n: f64| {
        let problem =
            format!("is {n}, expected 0 to {LARGEST_INDEX}; one of 5 is `plummer`, larger ones have no surface");
        Error::scene(key("polytrope", "n"), problem)
    };
    if !((0.0..=LARGEST_INDEX).contains(&n)) {
        return Err(refused(n));
    }
    let source = |theta: f64| theta.max(0.0).powf(n);
    // Steps towards the surface look beyond it, where a small index must not make the source vanish at once.
    let on_both_sides = |theta: f64| theta.abs().powf(n);
    let end = End::Surface(0.0);
    let equation = Emden { dimension: d, source: &on_both_sides, center: 1.0, end };
    let points = if n > 0.0 && n < 1.0 { equation.solve_closely() } else { equation.solve() };
    let points = points.ok_or_else(|| refused(n))?;
    let state = |p: &Point| (source(p.phi), p.phi.max(0.0).powf(n + 1.0) / (n + 1.0));
    Ok(scaled(d, &points, mass, radius, gravity, &state))
}

/// The isothermal sphere that ends at `xi`.
pub(super) fn bonnor_ebert(d: usize, xi: f64, mass: f64, radius: f64, gravity: f64) -> Result<Table> {
    let source = |phi: f64| phi.exp();
    let points = Emden { dimension: d, source: &source, center: 0.0, end: End::Radius(xi) }.solve();
    let points = points.ok_or_else(|| {
        Error::scene(key("bonnor-ebert", "xi"), format!("is {xi:e}, expected a positive number up to some 1e20"))
    })?;
    Ok(scaled(d, &points, mass, radius, gravity, &|p: &Point| (p.phi.exp(), p.phi.exp())))
}

/// By how much more than what just does is asked for, which is written with few digits.
const ROOM: f64 = 1.0001;

/// The isothermal sphere of a sound speed: G M / (R c^2) = xi psi'(xi). Errors are in the `unit` of speeds.
pub(super) fn isothermal(mass: f64, radius: f64, (sound_speed, unit): (f64, f64), gravity: f64) -> Result<Table> {
    let source = |phi: f64| phi.exp();
    let points = Emden { dimension: 3, source: &source, center: 0.0, end: End::Radius(MOST_MASSIVE) };
    let points = points.solve().unwrap_or_default();
    let compactness = gravity * mass / (radius * sound_speed * sound_speed);
    let most = points.last().map_or(0.0, |p| p.xi * p.slope);
    let Some(i) = points.iter().position(|p| p.xi * p.slope >= compactness) else {
        let problem = format!(
            "is too low: G M / (R c^2) is {compactness:.4}, but the pressure holds up {most:.3} at most; expected {:.4e} or more in the scene's units",
            ROOM * (gravity * mass / (radius * most)).sqrt() / unit
        );
        return Err(Error::scene(key("isothermal", "sound_speed"), problem));
    };
    let (mut low, mut high) = (points[i.max(1) - 1].xi, points[i].xi);
    for _ in 0..BISECTIONS {
        let xi = 0.5 * (low + high);
        let end = Emden { dimension: 3, source: &source, center: 0.0, end: End::Radius(xi) }.solve();
        let is_less = end.and_then(|p| p.last().copied()).is_none_or(|p| p.xi * p.slope < compactness);
        if is_less { low = xi } else { high = xi }
    }
    bonnor_ebert(3, high, mass, radius, gravity)
}

/// A solution as a body of this mass and radius. `state` gives density over the central one, and pressure over
/// 4 pi G rho_c^2 r_c^2.
fn scaled(
    d: usize,
    points: &[Point],
    mass: f64,
    radius: f64,
    gravity: f64,
    state: &dyn Fn(&Point) -> (f64, f64),
) -> Table {
    let end = points.last().copied().unwrap_or(Point { xi: 1.0, phi: 0.0, slope: 1.0 });
    let length = radius / end.xi;
    let center = mass / (unit_sphere_area(d) * length.powi(d as i32) * end.mass(d));
    let pressure = 4.0 * PI * gravity * (center * length).powi(2);
    let mut radii: Vec<f64> = points.iter().map(|p| p.xi * length).collect();
    radii.iter_mut().last().into_iter().for_each(|r| *r = radius);
    Table {
        radii,
        density: points.iter().map(|p| center * state(p).0).collect(),
        pressure: Some(points.iter().map(|p| pressure * state(p).1).collect()),
        ..Table::default()
    }
}

/// What a sphere with a closed form of the density is cut to.
#[derive(Clone, Copy)]
pub(super) struct Cut {
    pub mass: f64,
    pub scale: f64,
    pub outer: f64,
}

/// A density of r in units of the scale, finite in the center.
pub(super) fn cored(cut: Cut, gravity: f64, density: &dyn Fn(f64) -> f64) -> Table {
    let radii = radii_beyond_core(cut.scale, cut.outer);
    hydrostatic(3, radii, cut.mass, gravity, &|r| density(r / cut.scale))
}

/// A density of r in units of the scale that goes as 1/r in the center.
pub(super) fn cusped(cut: Cut, gravity: f64, density: &dyn Fn(f64) -> f64) -> Table {
    let inner = UNRESOLVED.sqrt() * cut.scale.min(cut.outer);
    hydrostatic(3, radii_of_cusp(inner, cut.outer), cut.mass, gravity, &|r| density(r / cut.scale))
}

/// King (1962, AJ 67, 471), equation 27, by the radius in units of that of the core, over (1 - z_0^2)^(3/2), with z_0 that of the center.
pub(super) fn king(tidal: f64) -> impl Fn(f64) -> f64 {
    let edge = 1.0 + tidal * tidal;
    // With s^2 = 1 - z^2 the rest of the bracket is asin(s)/z - s = 2/3 s^3 + 8/15 s^5 + ..., the two terms of which cancel where s is small.
    move |x: f64| {
        let share = ((1.0 - x / tidal) * (1.0 + x / tidal)).max(0.0);
        let squared = share * tidal * tidal / edge;
        let sum = if squared < SMALL {
            let terms = (1..=TERMS).scan(1.0, |coefficient, n| {
                *coefficient *= 2.0 * f64::from(n) / f64::from(2 * n + 1);
                Some(*coefficient * squared.powi(n - 1))
            });
            terms.sum::<f64>()
        } else {
            let (s, z) = (squared.sqrt(), (1.0 - squared).sqrt());
            (s.atan2(z) / z - s) / (squared * s)
        };
        share.powf(1.5) * sum / (1.0 - squared)
    }
}

/// King (1966, AJ 71, 64): rho ~ sum_(k >= 2) W^(k + 1/2)/Gamma(k + 3/2), which is e^W erf(sqrt W) less its first two terms, and P the sum from
/// k = 3 on, both without cancellation where W is small.
pub(super) fn king_cluster(w0: f64, mass: f64, radius: f64, gravity: f64) -> Result<Table> {
    let refused = || {
        let problem = format!("is {w0}, expected a number above 0 and up to {DEEPEST}; clusters have 3 to 12");
        Error::scene(key("king-1966", "w0"), problem)
    };
    if !(w0 > 0.0 && w0 <= DEEPEST) {
        return Err(refused());
    }
    let center = lowered(w0, 2);
    let source = |w: f64| lowered(w.max(0.0), 2) / center;
    let points = Emden { dimension: 3, source: &source, center: w0, end: End::Surface(0.0) }.solve();
    let points = points.ok_or_else(refused)?;
    Ok(scaled(3, &points, mass, radius, gravity, &|p: &Point| (source(p.phi), lowered(p.phi.max(0.0), 3) / center)))
}

/// W_0 of deeper clusters is that of an isothermal sphere over many decades.
const DEEPEST: f64 = 20.0;

/// sum_(k >= first) W^(k + 1/2)/Gamma(k + 3/2).
fn lowered(w: f64, first: u32) -> f64 {
    // Gamma(1/2) is sqrt(pi).
    let mut term = (0..=first).fold(1.0 / (PI * w).sqrt(), |term, k| term * w / (f64::from(k) + 0.5));
    let (mut sum, mut k) = (0.0, first);
    while term > f64::EPSILON * sum {
        sum += term;
        k += 1;
        term *= w / (f64::from(k) + 0.5);
    }
    sum
}

/// s^2 below which the series is summed, and terms that it takes to all digits there.
const SMALL: f64 = 0.01;
const TERMS: i32 = 8;

/// r^-slope.
pub(super) fn power_law(d: usize, slope: f64, mass: f64, radius: f64, gravity: f64) -> Result<Table> {
    let inner = UNRESOLVED.powf(1.0 / (d as f64 - slope));
    if !(slope >= 0.0 && slope < d as f64 && inner >= INNERMOST) {
        let most = d as f64 + UNRESOLVED.log10() / -INNERMOST.log10();
        let problem = format!(
            "is {slope}, expected 0 to {most:.2}: steeper profiles have all their mass in the \
                               center"
        );
        return Err(Error::scene(key("power-law", "slope"), problem));
    }
    if slope == 0.0 {
        return Ok(hydrostatic(d, radii_beyond_core(radius, radius), mass, gravity, &|_| 1.0));
    }
    Ok(hydrostatic(d, radii_of_cusp(inner * radius, radius), mass, gravity, &|r| (r / radius).powf(-slope)))
}

/// 1/r with one specific internal energy.
pub(super) fn evrard(mass: f64, radius: f64, energy: f64, gravity: f64) -> Table {
    let table = hydrostatic(3, radii_of_cusp(UNRESOLVED.sqrt() * radius, radius), mass, gravity, &|r| radius / r);
    let energy = energy * gravity * mass / radius;
    let internal_energy = Some(vec![energy; table.radii.len()]);
    Table { pressure: None, internal_energy, ..table }
}

/// rho_c (1 - r^2/R^2) with P = k rho^2 (Monaghan & Price 2004, MNRAS 350, 1449).
pub(super) fn toy_star(d: usize, mass: f64, radius: f64, k: f64) -> Table {
    let dimension = d as f64;
    // int_0^1 (1 - x^2) x^(d-1) dx.
    let integral = 2.0 / (dimension * (dimension + 2.0));
    let center = mass / (unit_sphere_area(d) * radius.powi(d as i32) * integral);
    let radii = radii_beyond_core(radius, radius);
    let density: Vec<f64> = radii.iter().map(|r| center * (1.0 - (r / radius).powi(2)).max(0.0)).collect();
    let pressure = density.iter().map(|rho| k * rho * rho).collect();
    Table { radii, density, pressure: Some(pressure), ..Table::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::RadialProfile;

    fn near(found: f64, expected: f64, tolerance: f64, what: &str) {
        assert!((found / expected - 1.0).abs() < tolerance, "{what}: {found:e}, expected {expected:e}");
    }

    fn pressure_at(table: &Table, r: f64) -> f64 {
        let i = table.radii.iter().position(|x| *x >= r).unwrap().max(1);
        let t = (r - table.radii[i - 1]) / (table.radii[i] - table.radii[i - 1]);
        let p = table.pressure.as_ref().unwrap();
        p[i - 1] + t * (p[i] - p[i - 1])
    }

    /// P_c = W_n G M^2 / R^4 with W_n = 1 / (4 pi (n + 1) theta'^2) (Chandrasekhar 1939, table 4).
    #[test]
    fn central_values_of_polytropes_are_those_of_the_tables() {
        for (n, concentration, pressure) in [
            (0.0, 1.0, 3.0 / (8.0 * PI)),
            (1.0, PI * PI / 3.0, PI / 8.0),
            (1.5, 5.99071, 0.77014),
            (3.0, 54.1825, 11.05066),
        ] {
            let table = polytrope(3, n, 2.0, 3.0, 5.0).unwrap();
            let mean = 2.0 / (4.0 / 3.0 * PI * 27.0);
            near(table.density[0] / mean, concentration, 1e-5, &format!("n = {n}, rho_c"));
            let unit = 5.0 * 4.0 / 81.0;
            near(table.pressure.unwrap()[0] / unit, pressure, 2e-5, &format!("n = {n}, P_c"));
        }
        for n in [-1.0, 5.0, f64::NAN] {
            assert!(polytrope(3, n, 1.0, 1.0, 1.0).is_err());
        }
    }

    /// Of a steep surface, too, which the rows follow: their interpolation has the mass that the central density was found from.
    #[test]
    fn polytropes_of_small_index_have_their_mass() {
        for n in [1e-3, 0.1, 0.3, 0.5, 0.9, 1.0] {
            let table = polytrope(3, n, 2.0, 3.0, 5.0).unwrap();
            let found = RadialProfile::from_nodes(3, &table.radii, &table.density).total_mass().value;
            near(found, 2.0, 2e-5, &format!("n = {n}, mass"));
        }
    }

    /// Cut far within its core it is (1 - x^2)^(3/2), whose terms cancel in King's form; where the series ends, both agree.
    #[test]
    fn kings_sphere_is_known_to_all_digits() {
        for tidal in [1e-100, 1e-12, 1e-8, 1e-5] {
            let density = king(tidal);
            for x in [0.0, 0.3, 0.7, 0.99] {
                near(density(x * tidal) / density(0.0), (1.0 - x * x).powf(1.5), 2.0 * tidal * tidal + 1e-12, "shape");
            }
            assert_eq!(density(tidal), 0.0);
        }
        // s^2 = t^2/(1 + t^2) in the center.
        let at = |squared: f64| king((squared / (1.0 - squared)).sqrt())(0.0);
        near(at(SMALL * (1.0 - 1e-9)), at(SMALL * (1.0 + 1e-9)), 1e-9, "both forms");
        let z = 1.0 / 26_f64.sqrt();
        let expected = (z.acos() / z - (1.0 - z * z).sqrt()) / (z * z) / (1.0 - z * z).powf(1.5);
        near(king(5.0)(0.0), expected, 1e-13, "King's equation 27");
    }

    /// log10(r_t/r_0) of King's (1966) models, with r_0^2 = 9 sigma^2/(4 pi G rho_0) (King 1966, table II; Binney & Tremaine, figure 4.9).
    #[test]
    fn kings_clusters_have_their_concentrations() {
        for (w0, concentration) in [(1.0, 0.296), (3.0, 0.672), (6.0, 1.255), (9.0, 2.120), (12.0, 2.739)] {
            let table = king_cluster(w0, 2.0, 3.0, 5.0).unwrap();
            // rho_0 = (9 sigma^2)/(4 pi G r_0^2), and the central pressure is sigma^2 times the third sum over the second times rho_0.
            let square = table.pressure.as_ref().unwrap()[0] / table.density[0] * lowered(w0, 2) / lowered(w0, 3);
            let core = (9.0 * square / (4.0 * PI * 5.0 * table.density[0])).sqrt();
            assert!(((3.0 / core).log10() - concentration).abs() < 2e-3, "W_0 = {w0}: {}", (3.0 / core).log10());
            let found = RadialProfile::from_nodes(3, &table.radii, &table.density).total_mass().value;
            near(found, 2.0, 1e-5, "mass");
        }
        // e^W erf(sqrt W) - sqrt(4 W/pi) (1 + 2 W/3) with erf(1) = 0.842 700 792 949 715.
        let expected = 1f64.exp() * 0.842_700_792_949_715 - (4.0 / PI).sqrt() * (5.0 / 3.0);
        near(lowered(1.0, 2), expected, 1e-13, "rho of W = 1");
        for w0 in [0.0, -1.0, 21.0, f64::NAN] {
            assert!(king_cluster(w0, 1.0, 1.0, 1.0).is_err());
        }
    }

    /// P = G M^2 / (8 pi a^4) (1 + x^2)^-3 less its value at the edge, with M that of the whole.
    #[test]
    fn the_pressure_of_plummers_sphere_is_its_closed_form() {
        let cut = Cut { mass: 1.0, scale: 2.0, outer: 12.0 };
        let table = cored(cut, 3.0, &|x| (1.0 + x * x).powf(-2.5));
        let share = 6f64.powi(3) / 37f64.powf(1.5);
        let whole = |x: f64| 3.0 / share.powi(2) / (8.0 * PI * 16.0) * (1.0 + x * x).powi(-3);
        for i in [0, 1000, 2000, 3000] {
            let expected = whole(table.radii[i] / 2.0) - whole(6.0);
            near(table.pressure.as_ref().unwrap()[i], expected, 1e-8, "P");
        }
        near(table.density[0], 3.0 / (4.0 * PI * 8.0) / share, 1e-9, "rho_c");
    }

    /// Hernquist (1990): rho = M a / (2 pi r (r + a)^3), M(r) = M r^2 / (r + a)^2.
    #[test]
    fn cusps_have_their_densities_and_weights() {
        let cut = Cut { mass: 1.0, scale: 1.0, outer: 9.0 };
        let hernquist = cusped(cut, 1.0, &|x| 1.0 / (x * (1.0 + x).powi(3)));
        let whole = 1.0 / 0.81;
        let i = hernquist.radii.iter().position(|r| *r > 0.7).unwrap();
        let r = hernquist.radii[i];
        near(hernquist.density[i], whole / (2.0 * PI * r * (1.0 + r).powi(3)), 1e-8, "rho");
        // P = G M^2 / (2 pi) int dr / (r (1 + r)^5) with the primitive ln(r/(1+r)) + sum 1/(k (1+r)^k), k = 1 ... 4.
        let primitive =
            |r: f64| (r / (1.0 + r)).ln() + (1..=4).map(|k| 1.0 / (f64::from(k) * (1.0 + r).powi(k))).sum::<f64>();
        let expected = whole * whole / (2.0 * PI) * (primitive(9.0) - primitive(r));
        near(hernquist.pressure.as_ref().unwrap()[i], expected, 1e-8, "P");
        let nfw = cusped(cut, 1.0, &|x| 1.0 / (x * (1.0 + x).powi(2)));
        let enclosed = |r: f64| (1.0 + r).ln() - r / (1.0 + r);
        near(nfw.density[i], 1.0 / (4.0 * PI * enclosed(9.0) * r * (1.0 + r).powi(2)), 1e-8, "NFW");
    }

    #[test]
    fn power_laws_evrard_and_toy_stars_are_their_closed_forms() {
        let evrard = evrard(2.0, 3.0, 0.05, 7.0);
        near(evrard.density[3999], 2.0 / (2.0 * PI * 27.0), 1e-9, "Evrard");
        near(evrard.internal_energy.unwrap()[0], 0.05 * 7.0 * 2.0 / 3.0, 1e-12, "u");
        // The singular isothermal sphere: rho = M / (4 pi R r^2); P = G M^2 / (8 pi R^2) (1/r^2 - 1/R^2).
        let steep = power_law(3, 2.0, 2.0, 3.0, 7.0).unwrap();
        let at = |r: f64| 7.0 * 4.0 / (8.0 * PI * 9.0) * (1.0 / (r * r) - 1.0 / 9.0);
        near(pressure_at(&steep, 1.0), at(1.0), 1e-4, "singular");
        assert!(power_law(3, 3.0, 1.0, 1.0, 1.0).is_err() && power_law(2, 1.9, 1.0, 1.0, 1.0).is_err());
        // In 2-D: M = pi rho_c R^2 / 2.
        let toy = toy_star(2, 2.0, 3.0, 0.25);
        near(toy.density[0], 4.0 / (PI * 9.0), 1e-12, "toy star");
        near(toy.pressure.unwrap()[0], 0.25 * (4.0 / (PI * 9.0_f64)).powi(2), 1e-12, "its pressure");
    }

    #[test]
    fn isothermal_spheres_are_found_by_their_sound_speed() {
        // xi = 3: a Bonnor-Ebert sphere, and back from its sound speed, the square of P over rho.
        let table = bonnor_ebert(3, 3.0, 2.0, 5.0, 7.0).unwrap();
        let speed = (table.pressure.as_ref().unwrap()[0] / table.density[0]).sqrt();
        let again = isothermal(2.0, 5.0, (speed, 1.0), 7.0).unwrap();
        near(again.density[0], table.density[0], 1e-9, "rho_c");
        near(again.pressure.unwrap()[0], table.pressure.unwrap()[0], 1e-9, "P_c");
        let error = isothermal(2.0, 5.0, (0.1 * speed, 1.0), 7.0).err().unwrap().to_string();
        assert!(error.contains("sound_speed") && error.contains("2.518"), "{error}");
    }
}
