//! The scenes in `profiles`, with few particles, against the closed forms that they stand for.

use sph_prep::scene::{Order, Polish, WvtInput};
use sph_prep::{BodiesReport, Control, FORMATS, ParticleFile, Report, Scene, place, place_bodies};
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles")
}

fn scene(name: &str, particles: usize) -> Scene {
    let scene = Scene::load(&folder().join(name)).unwrap_or_else(|e| panic!("{e}"));
    Scene { particles: Some(particles), wvt: WvtInput { iterations: Some(3), ..scene.wvt }, ..scene }
}

fn placed(name: &str, particles: usize) -> (ParticleFile, Report) {
    place(&scene(name, particles), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Without a polish, of which what fields are at the particles does not depend.
fn sampled(name: &str, particles: usize) -> ParticleFile {
    let scene = Scene { polish: Some(Polish::None), ..scene(name, particles) };
    place(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{name}: {e}")).0
}

fn bodies(name: &str, particles: usize) -> (ParticleFile, BodiesReport) {
    let mut scene = scene(name, particles);
    if let Some(balance) = scene.balance.on_mut() {
        balance.evaluations = Some(20);
    }
    place_bodies(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Rows of a column.
fn rows(file: &ParticleFile, name: &str) -> Vec<Vec<f64>> {
    let table = &file.species[0].table;
    let c = table.column(name).unwrap_or_else(|| panic!("no '{name}'"));
    (0..table.count).map(|i| (0..c.components).map(|k| c.values.get(i * c.components + k)).collect()).collect()
}

/// Coordinates from `origin`, a place in the box.
fn places(file: &ParticleFile, origin: [f64; 3]) -> Vec<Vec<f64>> {
    let shifted = |row: Vec<f64>| row.iter().zip(origin).map(|(x, o)| x - o).collect();
    rows(file, "Coordinates").into_iter().map(shifted).collect()
}

/// Whether a column is what it should be at each particle, to `tolerance` of `scale`.
fn check(file: &ParticleFile, origin: [f64; 3], name: &str, scale: f64, expected: impl Fn(&[f64]) -> Vec<f64>) {
    for (x, row) in places(file, origin).iter().zip(rows(file, name)) {
        for (found, wanted) in row.iter().zip(expected(x)) {
            assert!((found - wanted).abs() < 1e-9 * scale, "{name} at {x:?}: {found}, expected {wanted}");
        }
    }
}

fn total(file: &ParticleFile, name: &str) -> f64 {
    rows(file, "Masses").iter().zip(rows(file, name)).map(|(m, v)| m[0] * v[0]).sum()
}

#[test]
fn scenes_are_short_parse_and_are_listed() {
    let readme = std::fs::read_to_string(folder().join("README.md")).unwrap();
    for entry in std::fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "yaml") {
            continue;
        }
        let name = path.file_name().unwrap().to_str().unwrap();
        let lines = std::fs::read_to_string(&path).unwrap().lines().count();
        assert!(lines <= 25, "{name} has {lines} lines");
        assert!(readme.contains(&format!("`{name}`")), "{name} is not listed in README.md");
        Scene::load(&path).and_then(|s| s.validate()).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
}

#[test]
fn the_vortex_of_gresho_is_in_equilibrium() {
    let (file, report) = placed("gresho.yaml", 900);
    let middle = [0.5; 3];
    let speed = |r: f64| {
        if r < 0.2 { 5.0 * r } else { (2.0 - 5.0 * r).max(0.0) }
    };
    check(&file, middle, "Velocities", 1.0, |x| {
        let r = x[0].hypot(x[1]);
        vec![-speed(r) * x[1] / r, speed(r) * x[0] / r]
    });
    // dP/dr = v^2/r from P(0) = 5, by Simpson's rule in each third.
    let pressure = |r: f64| {
        let integral = |a: f64, b: f64| {
            let (n, f) = (200, |s: f64| if s > 0.0 { speed(s).powi(2) / s } else { 0.0 });
            let h = (b - a) / f64::from(n);
            (0..n)
                .map(|i| a + h * f64::from(i))
                .map(|s| h / 6.0 * (f(s) + 4.0 * f(s + 0.5 * h) + f(s + h)))
                .sum::<f64>()
        };
        5.0 + integral(0.0, r.min(0.2)) + if r > 0.2 { integral(0.2, r.min(0.4)) } else { 0.0 }
    };
    check(&file, middle, "Pressure", 5.0, |x| vec![pressure(x[0].hypot(x[1]))]);
    check(&file, middle, "InternalEnergy", 5.0, |x| vec![1.5 * pressure(x[0].hypot(x[1]))]);
    assert!((report.mass.total - 1.0).abs() < 1e-12);
}

#[test]
fn the_vortex_of_orszag_and_tang_has_its_field() {
    let file = sampled("orszag-tang.yaml", 400);
    let unit = 1.0 / (4.0 * PI).sqrt();
    check(&file, [0.0; 3], "MagneticField", 0.1, |x| {
        vec![-unit * (TAU * x[1]).sin(), unit * (2.0 * TAU * x[0]).sin(), 0.0]
    });
    check(&file, [0.0; 3], "Velocities", 1.0, |x| vec![-(TAU * x[1]).sin(), (TAU * x[0]).sin()]);
    check(&file, [0.0; 3], "InternalEnergy", 1.0, |_| vec![0.9]);
}

#[test]
fn the_rotor_turns_in_a_uniform_field() {
    let file = sampled("rotor.yaml", 900);
    check(&file, [0.5; 3], "MagneticField", 1.0, |_| vec![5.0 / (4.0 * PI).sqrt(), 0.0, 0.0]);
    check(&file, [0.5; 3], "Velocities", 1.0, |x| {
        if x[0].hypot(x[1]) < 0.1 { vec![-20.0 * x[1], 20.0 * x[0]] } else { vec![0.0, 0.0] }
    });
    check(&file, [0.5; 3], "InternalEnergy", 1.0, |x| vec![if x[0].hypot(x[1]) < 0.1 { 0.25 } else { 2.5 }]);
}

#[test]
fn layers_that_shear_are_in_pressure_equilibrium() {
    let (file, report) = placed("kelvin-helmholtz-2d.yaml", 900);
    assert!((report.mass.total - 1.5).abs() < 1e-9);
    let inner = |y: f64| (y - 0.5).abs() < 0.25;
    check(&file, [0.0; 3], "Pressure", 1.0, |_| vec![2.5]);
    check(&file, [0.0; 3], "InternalEnergy", 1.0, |x| vec![3.75 / if inner(x[1]) { 2.0 } else { 1.0 }]);
    let gauss = |d: f64| (-(d / 0.05).powi(2)).exp();
    check(&file, [0.0; 3], "Velocities", 1.0, |x| {
        let kick = 0.1 * (2.0 * TAU * x[0]).sin() * (gauss(x[1] - 0.25) + gauss(x[1] - 0.75));
        vec![if inner(x[1]) { 0.5 } else { -0.5 }, kick]
    });
    // Two thirds of the mass in the dense layer.
    let dense = places(&file, [0.0; 3]).iter().filter(|x| inner(x[1])).count();
    assert_eq!(dense, 600);
}

/// The smallest distance across the contacts over the mean of the two spacings there, by own sums over pairs in a box of edges
/// `box_size` that is periodic along all of them.
fn nearest_across(places: &[Vec<f64>], layer: impl Fn(&[f64]) -> f64, mass: f64, box_size: [f64; 3]) -> f64 {
    let spacing = |x: &[f64]| (mass / layer(x)).cbrt();
    let near: Vec<&Vec<f64>> =
        places.iter().filter(|x| ((x[1] - 0.5).abs() - 0.25).abs() < 1.5 * mass.cbrt()).collect();
    let mut least = f64::INFINITY;
    for (i, a) in near.iter().enumerate() {
        for b in near[..i].iter().filter(|b| layer(b) != layer(a)) {
            let square: f64 =
                (0..3).map(|k| a[k] - b[k] - box_size[k] * ((a[k] - b[k]) / box_size[k]).round()).map(|d| d * d).sum();
            least = least.min(square.sqrt() / (0.5 * (spacing(a) + spacing(b))));
        }
    }
    least
}

/// Across the contacts particles are 0.87 of the mean spacing apart, or a hundredth less. Each layer is relaxed by itself against a wall, so that no
/// particle of one knows of those of the other: before they part there they are as near as 0.58. Lattices (`order: crystal`) are 0.85 to 0.95
/// apart, which the dense layer strains along y.
#[test]
#[ignore = "slow: .ci/full runs it"]
fn layers_that_shear_keep_apart_at_their_contacts_in_three_dimensions() {
    let (file, report) = {
        let scene = Scene { wvt: WvtInput::default(), ..scene("kelvin-helmholtz-3d.yaml", 6000) };
        place(&scene, FORMATS, &Control::default()).unwrap()
    };
    // (2 + 1)/2 of a volume of 1/8, two thirds of it in the dense layer.
    assert!((report.mass.total - 0.1875).abs() < 1e-9);
    let box_size = [1.0, 1.0, 0.125];
    assert!(file.header.box_size == box_size && file.header.periodic == [true; 3]);
    let layer = |x: &[f64]| if (x[1] - 0.5).abs() < 0.25 { 2.0 } else { 1.0 };
    check(&file, [0.0; 3], "Pressure", 1.0, |_| vec![2.5]);
    check(&file, [0.0; 3], "InternalEnergy", 1.0, |x| vec![3.75 / layer(x)]);
    let gauss = |d: f64| (-(d / 0.05).powi(2)).exp();
    check(&file, [0.0; 3], "Velocities", 1.0, |x| {
        let kick = 0.1 * (2.0 * TAU * x[0]).sin() * (gauss(x[1] - 0.25) + gauss(x[1] - 0.75));
        vec![layer(x) - 1.5, kick, 0.0]
    });
    let places = places(&file, [0.0; 3]);
    let mass = |rho: f64| -> f64 {
        places.iter().zip(rows(&file, "Masses")).filter(|(x, _)| layer(x) == rho).map(|(_, m)| m[0]).sum()
    };
    // The shares are whole numbers of particles.
    assert!((mass(2.0) - 0.125).abs() < 1e-9 && (mass(1.0) - 0.0625).abs() < 1e-9, "{} {}", mass(2.0), mass(1.0));
    let mass = 0.1875 / 6000.0;
    let across = nearest_across(&places, layer, mass, box_size);
    assert!(across > 0.86 && report.neighbors.closest_pair > 0.7, "{across} spacings across the contacts");
    let crystal = Scene { order: Some(Order::Crystal), ..scene("kelvin-helmholtz-3d.yaml", 6000) };
    let (file, _) = place(&crystal, FORMATS, &Control::default()).unwrap();
    let across = nearest_across(&self::places(&file, [0.0; 3]), layer, mass, box_size);
    assert!(across > 0.75, "{across} spacings across the contacts of a lattice");
}

#[test]
fn the_shock_tube_has_its_two_states() {
    let (file, report) = placed("sod.yaml", 1800);
    // Of a box of 0.02: half at the density 1, half at 0.125.
    assert!((report.mass.total - 0.011_25).abs() < 1e-12);
    check(&file, [1.0, 0.0, 0.0], "InternalEnergy", 1.0, |x| vec![if x[0].abs() < 0.5 { 2.5 } else { 2.0 }]);
    let dense = places(&file, [1.0, 0.0, 0.0]).iter().filter(|x| x[0].abs() < 0.5).count();
    assert_eq!(dense, 1600);
}

#[test]
fn the_blob_is_at_rest_in_its_wind() {
    let file = sampled("blob.yaml", 1200);
    let middle = [1.0, 0.25, 0.25];
    let inside = |x: &[f64]| x.iter().map(|v| v * v).sum::<f64>() < 0.01;
    check(&file, middle, "Velocities", 1.0, |x| {
        vec![if inside(x) { 0.0 } else { 2.7 * (5.0 / 3.0_f64).sqrt() }, 0.0, 0.0]
    });
    check(&file, middle, "InternalEnergy", 1.0, |x| vec![if inside(x) { 0.15 } else { 1.5 }]);
}

#[test]
fn the_blast_has_its_energy() {
    let file = sampled("sedov.yaml", 12_000);
    // The sum over particles 0.044 apart of a Gaussian of 0.05 is its integral to exp(-(pi 0.05/0.044)^2), were they a lattice;
    // without one, to a part of the noise of 8 particles.
    let energy = total(&file, "InternalEnergy");
    assert!((energy - 1.0).abs() < 0.05, "{energy}");
    check(&file, [0.5; 3], "InternalEnergy", 1e3, |x| {
        let r2: f64 = x.iter().map(|v| v * v).sum();
        vec![1e-6 + (-r2 / 0.0025).exp() / (PI.powf(1.5) * 1.25e-4)]
    });
}

#[test]
fn evrards_sphere_is_cold_and_falls_as_one_over_the_radius() {
    let (file, report) = placed("evrard.yaml", 1000);
    check(&file, [0.0; 3], "InternalEnergy", 1.0, |_| vec![0.05]);
    assert!((report.mass.total - 1.0).abs() < 1e-6);
    // M(r) = r^2: a quarter of all particles within half of the radius.
    let middle = 0.5 * file.header.box_size[0];
    let within = places(&file, [middle; 3]).iter().filter(|x| x.iter().map(|v| v * v).sum::<f64>() < 0.25).count();
    assert!((within as f64 / 1000.0 - 0.25).abs() < 0.02, "{within}");
}

#[test]
fn the_toy_star_balances_its_force() {
    let (file, report) = placed("toy-star.yaml", 1000);
    assert!((report.mass.total - 1.0).abs() < 0.02);
    let balance = report.balance.unwrap().all;
    assert!(balance < 0.2, "net force {balance} of that which holds it");
    // u = k rho of a gas of gamma = 2, whose energies the balance moves by the error of its density.
    let middle = 0.5 * file.header.box_size[0];
    for (x, u) in places(&file, [middle; 3]).iter().zip(rows(&file, "InternalEnergy")) {
        let r2 = x[0] * x[0] + x[1] * x[1];
        if r2 < 0.5 {
            let expected = 2.0 / PI * (1.0 - r2);
            assert!((u[0] / expected - 1.0).abs() < 0.15, "{x:?}: {} {expected}", u[0]);
        }
    }
}

#[test]
fn a_white_dwarf_comes_in_solar_units() {
    let (file, report) = placed("white-dwarf.yaml", 1000);
    assert!((report.mass.total - 0.6).abs() < 2e-3, "{}", report.mass.total);
    // Some 0.0125 solar radii.
    let middle = 0.5 * file.header.box_size[0];
    let reach =
        places(&file, [middle; 3]).iter().map(|x| x.iter().map(|v| v * v).sum::<f64>()).fold(0.0, f64::max).sqrt();
    assert!((0.009..0.0135).contains(&reach), "{reach}");
}

#[test]
fn the_stars_of_the_binary_go_around_each_other() {
    let (file, report) = bodies("binary.yaml", 1600);
    assert_eq!(report.units, "solar");
    let orbit = report.orbit.unwrap();
    assert!((orbit.distance - 4.0).abs() < 1e-9 && (orbit.speed - (report.mass / 4.0).sqrt()).abs() < 1e-6);
    assert!((report.mass - 1.6).abs() < 0.02);
    assert_eq!(report.bodies[0].ids[1] as f64, 1000.0);
    assert!(report.bodies.iter().all(|b| b.figures.as_ref().is_some_and(|f| f.net_force.is_some())));
    let momentum: Vec<f64> = (0..3)
        .map(|k| rows(&file, "Masses").iter().zip(rows(&file, "Velocities")).map(|(m, v)| m[0] * v[k]).sum())
        .collect();
    assert!(momentum.iter().all(|p| p.abs() < 1e-13), "{momentum:?}");
}

#[test]
fn the_stars_of_the_collision_meet() {
    let (_, report) = bodies("collision.yaml", 800);
    // Of the profiles, wherever their outermost particles are.
    let surface = |i: usize| report.bodies[i].figures.as_ref().unwrap().radius.unwrap();
    let contact = surface(0) + surface(1);
    let orbit = report.orbit.unwrap();
    let square = orbit.speed.powi(2) - 2.0 * report.mass / orbit.distance + 2.0 * report.mass / contact;
    assert!((square.sqrt() / (1.05 * (2.0 * report.mass / contact).sqrt()) - 1.0).abs() < 1e-5);
    assert!(orbit.pericenter < contact);
}

/// c^2 = gamma P / rho = 1.001; the mean over 2000 particles of a velocity with waves of the box's size is as good as they sample it.
#[test]
fn the_turbulent_box_has_its_mach_number() {
    let file = sampled("turbulence.yaml", 2000);
    let v = rows(&file, "Velocities");
    let mean = v.iter().map(|v| v.iter().map(|c| c * c).sum::<f64>()).sum::<f64>() / 2000.0;
    assert!((mean.sqrt() / (5.0 * 1.001_f64.sqrt()) - 1.0).abs() < 0.02, "{}", mean.sqrt());
    for k in 0..3 {
        let drift = v.iter().map(|v| v[k]).sum::<f64>() / 2000.0;
        assert!(drift.abs() < 0.02 * mean.sqrt(), "{drift}");
    }
}

/// Particles within one spacing of a contact see the other side; none are in each other's way, and farther off the density is that of
/// the layers to 2 %, beside the kernel's own sum over a lattice.
#[test]
fn contacts_are_clean_on_both_sides() {
    let (file, report) = {
        let scene = Scene { wvt: WvtInput::default(), ..scene("kelvin-helmholtz-2d.yaml", 4000) };
        place(&scene, FORMATS, &Control::default()).unwrap()
    };
    assert!(report.neighbors.closest_pair > 0.65, "{}", report.neighbors.closest_pair);
    let mass = 1.5 / 4000.0_f64;
    let (places, density) = (places(&file, [0.0; 3]), rows(&file, "Density"));
    let support = rows(&file, "SupportRadius");
    for ((x, rho), support) in places.iter().zip(&density).zip(&support) {
        let is_inner = (x[1] - 0.5).abs() < 0.25;
        let target = if is_inner { 2.0 } else { 1.0 };
        let from = ((x[1] - 0.5).abs() - 0.25).abs();
        // Beyond the support of the kernel the other side has no weight.
        if from > support[0] && from > (mass / target).sqrt() {
            assert!((rho[0] / target - 1.0).abs() < 0.02, "{x:?}: {rho:?}");
        }
    }
}

/// Gaussians of 1.25 scale heights at both edges of the disc, which begin at three of these widths: at 0.8 and 1.875.
fn edge(big: f64) -> f64 {
    let of = |depth: f64, width: f64| (-0.5 * (3.0 - depth / width).max(0.0).powi(2)).exp();
    of(big - 0.5, 1.25 * 0.08) * of(3.0 - big, 1.25 * 0.3)
}

/// Gravity of the star, the gradient of the pressure and the rotation add up to nothing at the particles. The gas weighs a thousandth of the star.
#[test]
fn the_disc_about_a_star_is_in_equilibrium() {
    let (file, report) = bodies("protoplanetary-disc.yaml", 3000);
    assert_eq!(file.species.iter().map(|s| (s.part_type, s.table.count)).collect::<Vec<_>>(), [(0, 3000), (1, 1)]);
    let star = &file.species[1].table;
    let origin = [0, 1, 2].map(|k| star.column("Coordinates").unwrap().values.get(k));
    // The disc's center of mass is on the star; its axis is off by as much as the particles' mean was.
    let slack = 0.03;
    let pressure = |big: f64, z: f64| edge(big) * 0.01 / big.powi(3) * (100.0 * (big / big.hypot(z) - 1.0)).exp();
    let (velocities, places) = (rows(&file, "Velocities"), places(&file, origin));
    for ((x, v), u) in places.iter().zip(&velocities).zip(rows(&file, "InternalEnergy")) {
        let (big, z) = (x[0].hypot(x[1]), x[2]);
        // Beside an edge slopes change within the distance that the axis is off.
        if z.abs() > 0.3 * big || !(0.85..1.8).contains(&big) {
            continue;
        }
        let (s, h) = (big.hypot(z), 1e-5);
        let rho = pressure(big, z) * big / 0.01;
        let along_r = (pressure(big + h, z) - pressure(big - h, z)) / (2.0 * h * rho);
        let speed = (x[0] * v[1] - x[1] * v[0]) / big;
        let net = speed * speed / big - along_r - big / s.powi(3);
        assert!(net.abs() < slack / (big * big), "{x:?}: {net}");
        assert!((u[0] * 2.0 / 3.0 * big / 0.01 - 1.0).abs() < slack, "{x:?}: {u:?}");
    }
    assert!((report.bodies[0].mass - 1.0).abs() < 1e-12 && (report.bodies[1].mass / 1e-3 - 1.0).abs() < 1e-12);
}
