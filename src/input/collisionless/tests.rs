use super::eddington::Eddington;
use super::jeans::Jeans;
use super::well::{Sphere, Well};
use crate::random::{Purpose, keyed};
use std::f64::consts::PI;

/// A closed form with G = M = a = 1.
struct Model {
    density: fn(f64) -> f64,
    enclosed: fn(f64) -> f64,
}

const PLUMMER: Model = Model {
    density: |r| 3.0 / (4.0 * PI) * (1.0 + r * r).powf(-2.5),
    enclosed: |r| r.powi(3) * (1.0 + r * r).powf(-1.5),
};
const HERNQUIST: Model =
    Model { density: |r| 1.0 / (2.0 * PI * r * (1.0 + r).powi(3)), enclosed: |r| (r / (1.0 + r)).powi(2) };

fn nodes(inner: f64, outer: f64) -> Vec<f64> {
    let n = 3000;
    (0..=n).map(|i| inner * ((outer / inner).ln() * f64::from(i) / f64::from(n)).exp()).collect()
}

fn with<R>(model: &Model, outer: f64, then: impl Fn(&Sphere<'_>, &Well) -> R) -> R {
    let nodes = nodes(1e-4, outer);
    let sphere = Sphere { density: &model.density, enclosed: &model.enclosed, nodes: &nodes };
    then(&sphere, &Well::new(&sphere, true).unwrap_or_else(|e| panic!("{e}")))
}

/// f = 24 sqrt(2)/(7 pi^3) E^(7/2).
#[test]
fn plummers_distribution_function_is_its_closed_form() {
    with(&PLUMMER, 100.0, |_, well| {
        let f = Eddington::new(well);
        for energy in [0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97_f64] {
            let exact = 24.0 * 2.0_f64.sqrt() / (7.0 * PI.powi(3)) * energy.powf(3.5);
            let found = f.by_energy(energy);
            // A tail of r^-5 for (1 + r^2)^(-5/2) changes f by 2.5 (a/R)^2 at psi = a/R; splines by h^2/12 times some derivatives.
            assert!((found / exact - 1.0).abs() < 1e-3, "{energy}: {found:e} {exact:e}");
        }
        assert!(f.negative.is_none_or(|n| n.0 < 1e-9), "{:?}", f.negative);
    });
}

/// Hernquist (1990, ApJ 356, 359), equation 17.
#[test]
fn hernquists_distribution_function_is_its_closed_form() {
    with(&HERNQUIST, 1e3, |_, well| {
        let f = Eddington::new(well);
        for energy in [0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97_f64] {
            let q = energy.sqrt();
            let rest = 1.0 - q * q;
            let exact = (3.0 * q.asin()
                + q * rest.sqrt() * (1.0 - 2.0 * q * q) * (8.0 * q.powi(4) - 8.0 * q * q - 3.0))
                / (8.0 * 2.0_f64.sqrt() * PI.powi(3) * rest.powf(2.5));
            let found = f.by_energy(energy);
            assert!((found / exact - 1.0).abs() < 2e-3, "{energy}: {found:e} {exact:e}");
        }
    });
}

/// Integrated over speeds, f is the density again, to the interpolation between places.
#[test]
fn the_distribution_function_makes_the_density_again() {
    for model in [&PLUMMER, &HERNQUIST] {
        with(model, 50.0, |_, well| {
            let f = Eddington::new(well);
            for i in (0..well.radii.len()).step_by(200) {
                let r = well.radii[i];
                if !(0.01..40.0).contains(&r) {
                    continue;
                }
                let (found, exact) = (f.density(r), (model.density)(r));
                assert!((found / exact - 1.0).abs() < 3e-3, "{r}: {found:e} {exact:e}");
            }
        });
    }
}

/// A polytrope of n = 1 with its surface: rho = sin(pi r)/(4 r), M = (sin(pi r) - pi r cos(pi r))/pi, psi = rho 4/pi + const: rho is linear in psi, so
/// that f = rho' / (sqrt(8) pi^2 sqrt(E)) with rho' = pi/4.
#[test]
fn a_density_with_a_surface_has_its_closed_form() {
    let nodes: Vec<f64> = (1..=3000).map(|i| f64::from(i) / 3000.0).collect();
    let density = |r: f64| if r < 1.0 { (PI * r).sin() / (4.0 * r) } else { 0.0 };
    let enclosed = |r: f64| if r < 1.0 { ((PI * r).sin() - PI * r * (PI * r).cos()) / PI } else { 1.0 };
    let sphere = Sphere { density: &density, enclosed: &enclosed, nodes: &nodes };
    let well = Well::new(&sphere, true).unwrap();
    assert!(well.tail.is_none());
    let f = Eddington::new(&well);
    for energy in [0.05, 0.2, 0.5, 0.8_f64] {
        let exact = 0.25 * PI / (8.0_f64.sqrt() * PI * PI * energy.sqrt());
        let found = f.by_energy(energy);
        assert!((found / exact - 1.0).abs() < 3e-3, "{energy}: {found:e} {exact:e}");
    }
}

/// A uniform ball, and one whose density rises outward, have no such f; the ball has Gaussians.
#[test]
fn densities_that_no_isotropic_velocities_hold_are_found() {
    let nodes: Vec<f64> = (1..=500).map(|i| f64::from(i) / 500.0).collect();
    let enclosed = |r: f64| r.min(1.0).powi(3);
    let ball = Sphere { density: &|r| if r <= 1.0 { 0.75 / PI } else { 0.0 }, enclosed: &enclosed, nodes: &nodes };
    assert!(Well::new(&ball, true).err().unwrap().contains("jeans"));
    // sigma^2 = (1 - r^2)/2.
    let well = Well::new(&ball, false).unwrap();
    let gaussian = Jeans::new(&ball, &well).unwrap();
    let draw = |r: f64, i| gaussian.speed(r, &mut keyed(5, Purpose::Velocity, i));
    check_dispersions(draw, |r| 0.5 * (1.0 - r * r), &[0.1, 0.5, 0.8]);
    // A shell within an envelope that falls.
    let bumpy = |r: f64| (1.0 + 20.0 * (-((r - 0.5) / 0.05).powi(2)).exp()) * (1.0 - r).max(0.0).powi(2);
    let shell = Sphere { density: &bumpy, enclosed: &enclosed, nodes: &nodes };
    let well = Well::new(&shell, true).unwrap();
    let f = Eddington::new(&well);
    assert!(f.negative.unwrap().0 > 0.01, "{:?}", f.negative);
}

/// Dispersions in shells against Jeans's equation; 1 standard deviation of a mean of n squares of a normal number is sqrt(2/n),
/// and no distribution here has heavier tails; 4.5 of them are allowed for 3 components in 8 shells.
fn check_dispersions(speed: impl Fn(f64, u64) -> f64, sigma: fn(f64) -> f64, radii: &[f64]) {
    let n = 20_000;
    for (k, &r) in radii.iter().enumerate() {
        let mut squares = [0.0; 3];
        for i in 0..n {
            let number = (k * n + i) as u64;
            let way = super::direction(&mut keyed(7, Purpose::Velocity, number));
            let v = speed(r, number);
            (0..3).for_each(|c| squares[c] += (v * way[c]).powi(2) / n as f64);
        }
        for square in squares {
            let off = square / sigma(r) - 1.0;
            assert!(off.abs() < 4.5 * (2.0 / n as f64).sqrt() + 2e-3, "{r}: {off}");
        }
    }
}

const RADII: [f64; 8] = [0.05, 0.1, 0.3, 0.6, 1.0, 2.0, 4.0, 8.0];

/// sigma^2 = 1/(6 sqrt(1 + r^2)) in Plummer's sphere.
#[test]
fn plummers_dispersion_is_that_of_jeans() {
    let sigma = |r: f64| 1.0 / (6.0 * (1.0 + r * r).sqrt());
    with(&PLUMMER, 100.0, |sphere, well| {
        let f = Eddington::new(well);
        check_dispersions(|r, i| f.speed(r, &mut keyed(1, Purpose::Velocity, i)), sigma, &RADII);
        let gaussian = Jeans::new(sphere, well).unwrap();
        check_dispersions(|r, i| gaussian.speed(r, &mut keyed(2, Purpose::Velocity, i)), sigma, &RADII);
    });
}

/// Hernquist (1990), equation 10.
#[test]
fn hernquists_dispersion_is_that_of_jeans() {
    let sigma = |r: f64| {
        let polynomial = 25.0 + 52.0 * r + 42.0 * r * r + 12.0 * r.powi(3);
        (12.0 * r * (1.0 + r).powi(3) * ((1.0 + r) / r).ln() - r / (1.0 + r) * polynomial) / 12.0
    };
    with(&HERNQUIST, 1e3, |sphere, well| {
        let f = Eddington::new(well);
        check_dispersions(|r, i| f.speed(r, &mut keyed(3, Purpose::Velocity, i)), sigma, &RADII);
        let gaussian = Jeans::new(sphere, well).unwrap();
        check_dispersions(|r, i| gaussian.speed(r, &mut keyed(4, Purpose::Velocity, i)), sigma, &RADII);
    });
}
