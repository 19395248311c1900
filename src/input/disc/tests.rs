use super::gas::Gas;
use super::law::{Law, Temperature};
use super::well::Well;
use crate::field::{ScalarField, total_mass};
use crate::input::constants::Constants;
use crate::input::formula::Formula;
use crate::input::weight::Beside;
use crate::scene::{Conversion, Scene, Term};
use sph::domain::{Axis, Domain, Wall};
use sph::point_mass::{PointMass, Softening};
use sph_formats::UnitDimension;
use std::f64::consts::TAU;

fn formula(text: &str) -> Formula {
    let scene = Scene::default();
    let term = Term::Text(text.into());
    Formula::new(("disc".into(), &term), UnitDimension::NONE, (&Constants::new(&scene, None), &Conversion::NONE))
        .unwrap()
}

fn about(mass: f64) -> Well {
    let point = PointMass { center: [0.0], mass, radius: 0.0, softening: Softening::CubicSpline };
    Well::new(Beside { spheres: Vec::new(), points: vec![point] }, 1.0, 100.0)
}

fn law(surface: &str, temperature: Temperature, edges: [f64; 2]) -> Law {
    Law { surface: formula(surface), temperature, edges, widths: [0.0; 2] }
}

fn ratio(text: &str) -> Temperature {
    Temperature::AspectRatio(formula(text))
}

/// Takeuchi & Lin's disc in closed form: Sigma ~ 1/R, H/R = 0.1. The cut at a density of 1e-5 takes less than that of the mass.
#[test]
fn a_light_disc_about_a_point_is_that_of_the_closed_form() {
    let gas = Gas::new((law("1/R", ratio("0.1"), [0.5, 2.0]), about(1.0)), 1e-9, 0.0, (false, None)).unwrap();
    let form = |r: f64, z: f64| (100.0 * (r / r.hypot(z) - 1.0)).exp() / (r * r);
    let scale = gas.density(1.0, 0.0) / form(1.0, 0.0);
    for (r, z) in [(0.5, 0.0), (0.7, 0.05), (1.0, 0.2), (1.7, -0.3), (2.0, 0.4)] {
        let (found, expected) = (gas.density(r, z), scale * form(r, z));
        assert!((found / expected - 1.0).abs() < 3e-5, "{r} {z}: {found} for {expected}");
        assert!((gas.pressure(r, z) / found * r - 0.01).abs() < 1e-12);
        let speed = ((r / r.hypot(z) - 0.03) / r).sqrt();
        assert!((gas.speed(r, z) / speed - 1.0).abs() < 1e-5, "{r} {z}: {} for {speed}", gas.speed(r, z));
        let orbit = r / r.hypot(z).powf(1.5);
        assert!((gas.orbital_speed(r, z) / orbit - 1.0).abs() < 1e-5, "{r} {z}");
    }
    assert_eq!((gas.density(0.49, 0.0), gas.density(2.01, 0.0)), (0.0, 0.0));
    let [low, high] = gas.figures().aspect_ratio;
    assert!((low - 0.1).abs() < 1e-9 && (high - 0.1).abs() < 1e-9);
}

/// The same disc with the temperature of the distance from the star, c^2 = 0.01/r: P = A R^97/r^100, and v^2 = 0.97/r.
#[test]
fn a_disc_with_temperatures_by_the_distance_is_that_of_the_closed_form() {
    let (disc, well) = (law("1/R", ratio("0.1"), [0.5, 2.0]), about(1.0));
    let fall = disc.fall(&well).unwrap();
    assert!((fall - 0.5).abs() < 1e-9, "{fall}");
    let gas = Gas::new((disc, well), 1e-9, 0.0, (false, Some(fall))).unwrap();
    let form = |r: f64, z: f64| (r / r.hypot(z)).powi(99) / (r * r);
    let scale = gas.density(1.0, 0.0) / form(1.0, 0.0);
    for (r, z) in [(0.5, 0.0), (0.7, 0.05), (1.0, 0.2), (1.7, -0.3), (2.0, 0.4)] {
        let (found, expected) = (gas.density(r, z), scale * form(r, z));
        assert!((found / expected - 1.0).abs() < 3e-5, "{r} {z}: {found} for {expected}");
        assert!((gas.pressure(r, z) / found * r.hypot(z) - 0.01).abs() < 1e-12);
        let speed = (0.97 / r.hypot(z)).sqrt();
        assert!((gas.speed(r, z) / speed - 1.0).abs() < 1e-5, "{r} {z}: {} for {speed}", gas.speed(r, z));
    }
    assert_eq!(law("1/R", ratio("0.1 + 0.01*R"), [0.5, 2.0]).fall(&about(1.0)), None);
    assert_eq!(law("1/R", Temperature::SoundSpeed(formula("0.1")), [0.5, 2.0]).fall(&about(1.0)), None);
}

/// The density of a disc with H/R = 0.2 does not fall below exp(-25) of that in the plane, however high one looks.
#[test]
fn a_hot_disc_may_reach_its_star() {
    for (aspect_ratio, has_own) in [("0.2", false), ("0.05", false), ("0.05", true)] {
        check_columns_of_a_whole_disc(aspect_ratio, has_own);
    }
}

fn check_columns_of_a_whole_disc(aspect_ratio: &str, has_own: bool) {
    let gas = Gas::new((law("1", ratio(aspect_ratio), [0.0, 8.0]), about(1.0)), 0.3, 0.0, (has_own, None)).unwrap();
    let surface_density = 0.3 / (64.0 * 0.5 * TAU);
    for r in [0.01, 0.1, 1.0, 5.0] {
        // In steps of ln z, which no panel of the disc's own follows.
        let (low, steps) = (1e-6 * r, 40_000_u32);
        let step = (gas.top / low).ln() / f64::from(steps);
        let at = |i: u32| low * (step * (f64::from(i) + 0.5)).exp();
        let above = (0..steps).map(|i| gas.density(r, at(i)) * at(i) * step).sum::<f64>() + low * gas.density(r, 0.0);
        assert!((2.0 * above / surface_density - 1.0).abs() < 1e-4, "{r}: {above} for {surface_density}");
    }
}

/// A density as the quadrature of every field sees it.
struct Seen(Gas);

impl ScalarField<3> for Seen {
    fn value(&self, x: &[f64; 3]) -> f64 {
        self.0.density(x[0].hypot(x[1]), x[2])
    }
}

#[test]
fn the_mass_is_the_one_that_is_asked_for() {
    let gas = Gas::new(
        (law("R^-1.5*(1 - 0.8*exp(-50*(R - 2)^2))", ratio("0.05*R^0.25"), [0.5, 4.0]), about(1.0)),
        0.02,
        1.25,
        (true, None),
    );
    let gas = gas.unwrap();
    let domain = Domain::cylinder([0.0; 3], 2, [0.5, 4.0], 2.0 * gas.top, (Wall::Open, Axis::OPEN)).unwrap();
    let found = total_mass(&Seen(gas), &domain, 1e-7).unwrap().value;
    assert!((found / 0.02 - 1.0).abs() < 1e-5, "{found}");
}

/// Of gas, by summing over points of its mass: potential at a place.
fn potential(gas: &Gas, edges: [f64; 2], (radius, height): (f64, f64)) -> f64 {
    let [rings, around, layers] = [240, 480, 120];
    let width = (edges[1] - edges[0]) / f64::from(rings);
    let thick = 2.0 * gas.top / f64::from(layers);
    let mut sum = 0.0;
    for i in 0..rings {
        let r = edges[0] + (f64::from(i) + 0.5) * width;
        for k in 0..layers {
            let z = -gas.top + (f64::from(k) + 0.5) * thick;
            let mass = gas.density(r, z) * r * width * thick * TAU / f64::from(around);
            let one = |j: i32| {
                let angle = TAU * (f64::from(j) + 0.5) / f64::from(around);
                ((r * angle.cos() - radius).powi(2) + (r * angle.sin()).powi(2) + (z - height).powi(2)).sqrt().recip()
            };
            sum += mass * (0..around).map(one).sum::<f64>();
        }
    }
    -sum
}

/// Forces balance in a disc that weighs as much as a quarter of its star: c^2 ln rho + Phi does not depend on z, and the rotation makes up
/// for what is left along R. Gravity is summed here over points of the mass, without rings or tables.
#[test]
fn a_heavy_disc_is_in_equilibrium_with_its_own_gravity() {
    let edges = [0.5, 3.0];
    let gas = Gas::new((law("1/R", ratio("0.1"), edges), about(1.0)), 0.25, 1.25, (true, None)).unwrap();
    let star = |r: f64, z: f64| -1.0 / r.hypot(z);
    let whole = |r: f64, z: f64| potential(&gas, edges, (r, z)) + star(r, z);
    for r in [1.0, 1.7] {
        let speed = 0.01 / r;
        let plane = whole(r, 0.0);
        for z in [0.05 * r, 0.1 * r, 0.2 * r] {
            let rise = whole(r, z) - plane;
            let fall = speed * (gas.density(r, z) / gas.density(r, 0.0)).ln();
            assert!((rise + fall).abs() < 0.01 * rise, "{r} {z}: {rise} {fall}");
            // The own gravity counts.
            assert!(rise > 1.2 * (star(r, z) - star(r, 0.0)), "{r} {z}: {rise}");
        }
        let step = 0.05;
        let pull = (whole(r + step, 0.0) - whole(r - step, 0.0)) / (2.0 * step);
        let pressure = (gas.pressure(r + step, 0.0) - gas.pressure(r - step, 0.0)) / (2.0 * step) / gas.density(r, 0.0);
        let (found, expected) = (gas.speed(r, 0.0).powi(2), r * (pull + pressure));
        assert!((found / expected - 1.0).abs() < 0.01, "{r}: {found} for {expected}");
    }
    let (stability, at) = gas.figures().stability;
    let expected = 0.1 / (std::f64::consts::PI * 0.25) * edges_mass(edges);
    assert!((stability / (expected / at) - 1.0).abs() < 0.5, "{stability} at {at}, for about {}", expected / at);
}

/// 2 pi times the length over which a surface density of 1/R without tapers is spread.
fn edges_mass([inner, outer]: [f64; 2]) -> f64 {
    TAU * (outer - inner)
}

#[test]
fn edges_fall_without_unstable_rings_unless_they_are_too_narrow() {
    let of =
        |width: f64| Gas::new((law("1/R", ratio("0.05"), [0.5, 2.0]), about(1.0)), 1e-6, width, (false, None)).unwrap();
    let smooth = of(1.25);
    assert_eq!(smooth.figures().unstable_rings, None);
    let steep = of(0.7).figures();
    assert!(steep.unstable_rings.is_some());
    // Where rings are unstable Toomre's criterion has nothing to say.
    let (smooth_least, steep_least) = (smooth.figures().stability.0, steep.stability.0);
    assert!(steep_least > 0.1 * smooth_least, "{steep_least} {smooth_least}");
    let surface = |r: f64| smooth.density(r, 0.0) * r * r;
    assert!(surface(2.0) < 0.02 * surface(1.2) && surface(0.5) < 0.02 * surface(1.2));
}

#[test]
fn what_is_no_disc_is_refused() {
    let about = || about(1.0);
    let text = |made: crate::error::Result<Gas>| made.err().map(|e| e.to_string()).unwrap_or_default();
    let hot = text(Gas::new((law("1/R", ratio("0.6"), [0.5, 2.0]), about()), 1e-6, 0.0, (false, None)));
    assert!(hot.contains("so hot"), "{hot}");
    let wide = text(Gas::new((law("1/R", ratio("0.1"), [1.0, 1.2]), about()), 1e-6, 1.25, (false, None)));
    assert!(wide.contains("edge_width") && wide.contains("as wide as the disc"), "{wide}");
    let pushed = text(Gas::new((law("R^-90", ratio("0.15"), [0.5, 2.0]), about()), 1e-6, 0.0, (false, None)));
    assert!(pushed.contains("pressure force exceeds gravity"), "{pushed}");
    let negative = law("1 - R", ratio("0.1"), [0.5, 2.0]).check().unwrap_err().to_string();
    assert!(negative.contains("surface_density") || negative.contains("disc"), "{negative}");
    assert!(negative.contains("expected a positive number"), "{negative}");
}
