//! Numbers of a scene with and without units: the same body, whatever it is written in.

use sph_formats::common::particle_names as names;
use sph_formats::{ParticleFile, UnitDimension};
use sph_prep::relaxation::Control;
use sph_prep::{FORMATS, Report, Scene, place, place_bodies};

/// One solar mass and radius, in cgs.
const STAR: &str = concat!("file: ", env!("CARGO_MANIFEST_DIR"), "/profiles/star.nc");
/// cm.
const SOLAR_RADIUS: f64 = 6.957e10;

fn run(scene: &str) -> (ParticleFile, Report) {
    let scene = format!("{scene}\npolish: none\nwvt: {{iterations: 2}}\n");
    place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{scene}: {e}"))
}

fn refusal(scene: &str) -> String {
    place(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).unwrap_err().to_string()
}

/// A column in cgs.
fn cgs(file: &ParticleFile, name: &str, dimension: UnitDimension) -> Vec<f64> {
    let column = file.species[0].table.column(name).unwrap_or_else(|| panic!("no {name}"));
    let factor = file.header.units.to_cgs(dimension);
    column.values.to_f64().iter().map(|v| v * factor).collect()
}

/// Distances from the middle of the box, in cm.
fn radii(file: &ParticleFile) -> Vec<f64> {
    let length = file.header.units.length;
    let middle = file.header.box_size.map(|edge| 0.5 * edge * length);
    let x = cgs(file, names::COORDINATES, UnitDimension::LENGTH);
    x.chunks(3).map(|p| (0..3).map(|k| (p[k] - middle[k]).powi(2)).sum::<f64>().sqrt()).collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn close(found: f64, expected: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < 1e-9, "{what}: {found:e}, expected {expected:e}");
}

#[test]
fn a_domain_is_the_same_in_every_unit() {
    let half = 0.5 * SOLAR_RADIUS;
    let (reference, _) =
        run(&format!("input: {{{STAR}}}\nparticles: 200\ndomain: {{ball: {{center: [0, 0, 0], radius: {half}}}}}"));
    let edge = largest(&radii(&reference));
    assert!(edge < half && edge > 0.7 * half, "{edge:e}");
    for (units, radius) in [
        ("", "0.5 Rsun"),
        ("", "'347850 km'"),
        ("units: input", "347850 km"),
        ("units: solar", "0.5"),
        ("units: si", "3.4785e8"),
        ("units: galactic", "3.4785e10 cm"),
        ("output: {units: si}", "0.5 Rsun"),
    ] {
        let (file, _) = run(&format!(
            "input: {{{STAR}}}\nparticles: 200\n{units}\ndomain: {{ball: {{center: [0, 0, 0], radius: {radius}}}}}"
        ));
        close(largest(&radii(&file)), edge, radius);
    }
}

#[test]
fn motion_energy_and_materials_are_the_same_in_every_unit() {
    for (units, speed, rate, energy, radius) in [
        ("", "3e6", "1e-5", "2e14", "3.4785e10"),
        ("", "30 km/s", "1e-5 rad/s", "2e14 erg/g", "0.5 Rsun"),
        ("units: si", "3e4", "1e-5", "2e10", "3.4785e8"),
        ("units: si", "30 km/s", "0.864 rad/day", "2e4 km^2/s^2", "0.5 Rsun"),
        ("units: si\noutput: {units: galactic}", "3e4", "1e-5", "2e10", "3.4785e8"),
        ("output: {units: cgs}", "30 km/s", "0.036 rad/hr", "2e10 J/kg", "0.5 Rsun"),
    ] {
        let (file, _) = run(&format!(
            "input: {{{STAR}, carry: []}}\nparticles: 200\n{units}\nmotion: {{bulk: [{speed}, 0, 0], rotation: [0, 0, {rate}]}}\n\
             thermal: {{internal_energy: {energy}}}\nmaterial: [{{id: 3, radius: {radius}}}, {{id: 4}}]"
        ));
        let label = format!("{units}, {speed}");
        let v = cgs(&file, names::VELOCITIES, UnitDimension::VELOCITY);
        let x = cgs(&file, names::COORDINATES, UnitDimension::LENGTH);
        let middle = 0.5 * file.header.box_size[0] * file.header.units.length;
        for (x, v) in x.chunks(3).zip(v.chunks(3)) {
            let (x, y) = (x[0] - middle, x[1] - middle);
            let expected = [3e6 - 1e-5 * y, 1e-5 * x, 0.0];
            for k in 0..3 {
                assert!((v[k] - expected[k]).abs() < 1e-6 * 3e6, "{label}: {v:?}, expected {expected:?}");
            }
        }
        for u in cgs(&file, names::INTERNAL_ENERGY, UnitDimension::SPECIFIC_ENERGY) {
            close(u, 2e14, &label);
        }
        let materials = file.species[0].table.column(names::MATERIAL_IDS).unwrap().values.to_f64();
        for (id, r) in materials.iter().zip(radii(&file)) {
            assert_eq!(*id, if r < 0.5 * SOLAR_RADIUS { 3.0 } else { 4.0 }, "{label}: r = {r:e}");
        }
    }
}

#[test]
fn an_expression_is_in_the_units_that_the_scene_states() {
    let scene = "input: {expression: '1', dimension: 3}\nunits: solar\nparticles: 100\ndomain: {ball: {radius: 2}}";
    let (file, report) = run(scene);
    let expected = 4.0 / 3.0 * std::f64::consts::PI * 8.0 * 1.988_409_870_698_051e33;
    assert!((report.mass.total_cgs.unwrap() / expected - 1.0).abs() < 1e-8, "{:?}", report.mass);
    assert!(largest(&radii(&file)) < 2.0 * SOLAR_RADIUS && largest(&radii(&file)) > 1.6 * SOLAR_RADIUS);
    // A radius in km within it.
    let (file, _) = run(&scene.replace("radius: 2", "radius: 1.3914e6 km"));
    assert!(largest(&radii(&file)) < 2.0 * SOLAR_RADIUS && largest(&radii(&file)) > 1.6 * SOLAR_RADIUS);
}

#[test]
fn densities_and_spacings_may_carry_units_and_constants() {
    let scene = |density: &str, more: &str| {
        format!(
            "input: {{expression: '{density}'}}\nunits: galactic\nparticles: 200\n\
             domain: {{box: [[0, 0, 0], [1, 1, 2]], boundary: periodic}}\n{more}"
        )
    };
    // 2 kpc^3 of 0.02 solar masses per cubic parsec.
    for density in ["0.02 Msun/pc^3", "0.02*Msun/pc^3", "2e7*Msun/kpc^3*(1 + 0*x)"] {
        let (_, report) = run(&scene(density, ""));
        let expected = 2.0 * 2e7 * 1.988_409_870_698_051e33;
        assert!((report.mass.total_cgs.unwrap() / expected - 1.0).abs() < 1e-8, "{density}: {:?}", report.mass);
    }
    let masses = |resolution: &str| cgs(&run(&scene("1 + z", resolution)).0, names::MASSES, UnitDimension::MASS);
    let plain = masses("resolution: {spacing: '0.1 + z/10'}");
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a / b - 1.0).abs() < 1e-12);
    assert!(same(&plain, &masses("resolution: {spacing: '100*pc + z/10'}")));
    assert!(largest(&plain) > 2.0 * plain.iter().copied().fold(f64::INFINITY, f64::min), "masses should vary");
    let even = masses("resolution: {spacing: 100 pc}");
    assert!(same(&even, &masses("resolution: {number_density: 1000 kpc^-3}")));
    for (density, parts) in [
        ("1 Msun", &["input.expression", "which is a mass", "expected a density"][..]),
        ("1 Msum/pc^3", &["input.expression", "Msum"]),
        ("3*parsecs", &["input.expression", "unknown name 'parsecs'"]),
    ] {
        let text = refusal(&scene(density, ""));
        assert!(parts.iter().all(|part| text.contains(part)), "{density}: {text}");
    }
    let text = refusal(&scene("1", "resolution: {spacing: 1 kpc^2}"));
    assert!(text.contains("resolution") && text.contains("expected a length"), "{text}");
}

#[test]
fn a_resolution_counts_in_the_scenes_units_too() {
    let masses = |scene: &str| {
        let (file, _) = run(&format!(
            "input: {{{STAR}}}\nparticles: 400\noutput: {{units: cgs}}\ndomain: {{ball: {{center: [0, 0, 0], radius: 0.8 Rsun}}}}\n{scene}"
        ));
        cgs(&file, names::MASSES, UnitDimension::MASS)
    };
    let in_cgs = masses("resolution: {spacing: '0.1 + r/6.957e10'}");
    let in_solar = masses("units: solar\nresolution: {spacing: '0.1 + r'}");
    assert!(largest(&in_cgs) > 2.0 * in_cgs.iter().copied().fold(f64::INFINITY, f64::min), "masses should vary");
    for (a, b) in in_cgs.iter().zip(&in_solar) {
        assert!((a / b - 1.0).abs() < 1e-6, "{a:e} and {b:e}");
    }
}

#[test]
fn a_sound_speed_may_have_its_unit() {
    for (speed, units) in [("1e7", ""), ("100 km/s", ""), ("1e5", "units: si")] {
        let scene = format!(
            "input: {{{STAR}, carry: []}}\n{units}\nparticles: 400\nbalance: {{evaluations: 1, equation_of_state: {{isothermal: {{sound_speed: {speed}}}}}}}"
        );
        let (file, _) = run(&scene);
        let u = cgs(&file, names::INTERNAL_ENERGY, UnitDimension::SPECIFIC_ENERGY);
        let mut sorted = u.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        // P/rho = (gamma - 1) u = c^2, but for the thermal factor that the balance fits.
        let median = sorted[sorted.len() / 2] * 2.0 / 3.0 / 1e14;
        assert!((0.5..2.0).contains(&median), "{speed} {units}: {median}");
    }
}

#[test]
fn units_that_cannot_be_used_are_refused_before_the_work() {
    let box_of = |edge: &str| format!("input: {{expression: '1'}}\ndomain: {{box: [[0, 0], [1, {edge}]]}}");
    for (scene, parts) in [
        (box_of("1 pc"), &["domain.box[1][1]", "'1 pc'", "states no units", "units: solar"][..]),
        (box_of("1 parsek"), &["domain.box[1][1]", "'parsek' is not known", "did you mean '1 parsec'"]),
        (box_of("1 km/s"), &["which is a velocity", "expected a length"]),
        (box_of("1") + "\nmotion: {bulk: [0, 3 km]}", &["motion.bulk[1]", "which is a length", "km/s"]),
        (box_of("1") + "\nunits: sollar", &["scene, units:", "did you mean 'solar'"]),
        (
            format!("input: {{{STAR}}}\nmaterial: [{{id: 1, radius: 0.5 Rsun}}, {{id: 2, radius: 3e10}}, {{id: 3}}]"),
            &["material", "layer 2", "ascend"],
        ),
        (
            format!("input: {{{STAR}}}\nthermal: {{internal_energy: -1 erg/g}}"),
            &["thermal.internal_energy", "positive"],
        ),
        (format!("input: {{{STAR}}}\ndomain: {{ball: {{radius: 0 Rsun}}}}"), &["domain.ball", "radii"]),
    ] {
        let error = refusal(&scene);
        for part in parts {
            assert!(error.contains(part), "{scene}: {error} lacks {part}");
        }
    }
}

#[test]
fn a_printed_scene_keeps_its_units() {
    let text = "input: {file: a.nc, planet_radius: 6371 km}\nunits: solar\nparticles: 100k\n\
                domain: {cylinder: {radius: 1 Rsun, length: 3, center: [0, 0, 1 au]}}\n\
                motion: {bulk: [30 km/s, 0, 0]}\nthermal: {internal_energy: 1e14 erg/g}\nmaterial: [{id: 1, radius: 1 pc}, {id: 2}]";
    let scene = Scene::parse(text).unwrap();
    let printed = scene.to_commented_yaml().unwrap();
    assert!(printed.contains("lengths in 6.957e10 cm"), "{printed}");
    assert_eq!(Scene::parse(&printed).unwrap(), scene, "{printed}");
    for part in ["1 Rsun", "30 km/s", "1e14 erg/g", "6371 km", "100000", "units: solar"] {
        assert!(printed.contains(part), "{printed}");
    }
}

/// What a plain number is in beside a body of numbers with units, nobody has said.
#[test]
fn plain_numbers_beside_a_body_with_units_are_refused() {
    let star = "profile: {polytrope: {n: 1.5, mass: 1 Msun, radius: 1 Rsun}}";
    let scene = |more: &str| format!("input: {{{star}}}\nparticles: 300\n{more}");
    for (key, more) in [
        ("motion.bulk", "motion: {bulk: [1, 0, 0]}"),
        ("turbulence.rms_velocity", "turbulence: {rms_velocity: 2}"),
        ("domain", "domain: {ball: {center: [0, 0, 0], radius: 2}}"),
    ] {
        let problem = refusal(&scene(more));
        assert!(problem.contains("beside numbers with units; write its unit, or state `units`"), "{key}: {problem}");
        assert!(problem.contains(key), "{problem}");
    }
    // Nothing is nothing in any unit, and a scene that states its units has said it.
    run(&scene("motion: {bulk: [0, 0, 0]}"));
    run(&scene("units: solar\nmotion: {bulk: [1, 0, 0]}"));
    let bodies = |more: &str| format!("bodies:\n- {{input: {{{star}}}}}\n- {more}\nparticles: 300\n");
    for more in [
        "{point_mass: 1}\norbit: {semi_major_axis: 5 Rsun}",
        "{point_mass: 1 Msun, position: [5, 0, 0]}",
        "{point_mass: 1 Msun}\norbit: {semi_major_axis: 5}",
    ] {
        let scene = Scene::parse(&format!("{}polish: none\nwvt: {{iterations: 2}}\n", bodies(more))).unwrap();
        let problem = place_bodies(&scene, FORMATS, &Control::default()).expect_err(more).to_string();
        assert!(problem.contains("beside numbers with units"), "{more}: {problem}");
    }
}
