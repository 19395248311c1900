//! Stars whose core is a point mass: what is conserved, what holds, what codes get, and what is refused.

use sph_formats::common::particle_names as names;
use sph_prep::{BodiesReport, Control, FORMATS, ParticleFile, Report, Scene, place, place_bodies};

const GIANT: &str = "input: {profile: {polytrope: {n: 4.5, mass: 1 Msun, radius: 50 Rsun}}, core: {radius: 5 Rsun}}\n";
/// As few stages as there can be.
const QUICK: &str = "wvt: {iterations: 0}\npolish: none\n";

fn attempt(yaml: &str) -> Result<(ParticleFile, Report), String> {
    let scene = Scene::parse(yaml).map_err(|e| e.to_string())?;
    place(&scene, FORMATS, &Control::default()).map_err(|e| e.to_string())
}

fn placed(yaml: &str) -> (ParticleFile, Report) {
    attempt(yaml).unwrap_or_else(|e| panic!("{yaml}{e}"))
}

fn values(file: &ParticleFile, species: usize, name: &str) -> Vec<f64> {
    file.species[species].table.column(name).unwrap_or_else(|| panic!("no {name}")).values.to_f64()
}

/// Distances of gas from the point mass.
fn radii(file: &ParticleFile) -> Vec<f64> {
    let (x, center) = (values(file, 0, names::COORDINATES), values(file, 1, names::COORDINATES));
    x.chunks(3).map(|x| x.iter().zip(&center).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()).collect()
}

/// Scenes of the three kinds of gas, and the model itself.
fn kinds(rest: &str) -> [String; 4] {
    let with = |gas: &str| format!("{}{rest}", GIANT.replace("5 Rsun}", &format!("5 Rsun, gas: {gas}}}")));
    let own = format!("{}{rest}", GIANT.replace(", core: {radius: 5 Rsun}", ""));
    [with("cubic"), with("constant-entropy"), with("lane-emden"), own]
}

#[test]
fn gas_and_point_weigh_what_the_model_does() {
    let rest = format!("{QUICK}particles: 500\noutput: {{units: solar}}\n");
    for scene in &kinds(&rest)[..3] {
        let (file, report) = placed(&scene.replace("core:", "atmosphere: keep, core:"));
        assert_eq!(file.species.iter().map(|s| (s.part_type, s.table.count)).collect::<Vec<_>>(), [(0, 500), (1, 1)]);
        let core = values(&file, 1, names::MASSES)[0];
        let total = core + values(&file, 0, names::MASSES).iter().sum::<f64>();
        assert!((total - 1.0).abs() < 1e-6, "{total}");
        assert!((0.02..0.6).contains(&core), "{core}");
        assert!((values(&file, 1, names::SOFTENING_RADIUS)[0] / 5.0 - 1.0).abs() < 1e-12);
        assert_eq!(
            (values(&file, 1, names::ACCRETION_RADIUS)[0], values(&file, 1, names::PARTICLE_IDS)[0]),
            (0.0, 501.0)
        );
        let middle = 0.5 * file.header.box_size[0];
        assert!(values(&file, 1, names::COORDINATES).iter().all(|x| (x / middle - 1.0).abs() < 1e-12));
        let said = |part: &str| report.notes.iter().any(|n| n.contains(part));
        assert!(said("the core is a point mass of") && said("hsoft 1.739"), "{:?}", report.notes);
    }
}

/// Beyond the radius gas has the model's density and energy; within they are those of a softened star.
#[test]
fn the_envelope_is_the_models() {
    let rest = format!("{QUICK}particles: 3000\noutput: {{units: solar, target_density: true}}\n");
    let scenes = kinds(&rest);
    let (model, _) = placed(&scenes[3]);
    let center = 0.5 * model.header.box_size[0];
    let mut known: Vec<(f64, f64, f64)> = values(&model, 0, names::COORDINATES)
        .chunks(3)
        .map(|x| x.iter().map(|v| (v - center).powi(2)).sum::<f64>().sqrt())
        .zip(values(&model, 0, "TargetDensity"))
        .zip(values(&model, 0, names::INTERNAL_ENERGY))
        .map(|((r, rho), u)| (r, rho, u))
        .collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Between two of the model's particles by the logarithm: 3000 of them are near enough for 1 %.
    let between = |r: f64| {
        let i = known.partition_point(|k| k.0 < r).clamp(1, known.len() - 1);
        let (a, b) = (known[i - 1], known[i]);
        let t = if b.0 > a.0 { (r - a.0) / (b.0 - a.0) } else { 0.0 };
        let mix = |x: f64, y: f64| (x.ln() + t * (y / x).ln()).exp();
        (mix(a.1, b.1), mix(a.2, b.2))
    };
    for scene in &scenes[..3] {
        let (file, _) = placed(scene);
        let (mut outside, mut inside) = (0, 0);
        for ((r, rho), u) in radii(&file).into_iter().zip(values(&file, 0, "TargetDensity")).zip(values(
            &file,
            0,
            names::INTERNAL_ENERGY,
        )) {
            let (expected, energy) = between(r);
            if (5.05..40.0).contains(&r) {
                outside += 1;
                assert!((rho / expected - 1.0).abs() < 0.01, "{r}: {rho} against {expected}");
                assert!((u / energy - 1.0).abs() < 0.01, "{r}: {u} against {energy}");
            } else if r < 2.0 {
                inside += 1;
                assert!(rho < 1.31 * expected, "{r}: {rho}");
            }
        }
        assert!(outside > 500 && inside > 100, "{outside} {inside}");
    }
}

/// Else gas and point would begin to swing about their common center.
#[test]
fn the_gas_about_a_core_has_its_center_of_mass_there() {
    let (file, _) = placed(
        "input: {profile: {polytrope: {n: 3, mass: 1 Msun, radius: 50 Rsun}}, core: {radius: 10 Rsun, gas: constant-entropy}}\n\
         particles: 700\npolish: none\nwvt: {iterations: 3}\noutput: {units: solar, double_precision: true}\n",
    );
    let (x, center) = (values(&file, 0, names::COORDINATES), values(&file, 1, names::COORDINATES));
    for k in 0..3 {
        let mean = x.iter().skip(k).step_by(3).sum::<f64>() / 700.0;
        assert!((mean - center[k]).abs() < 50.0 * 1e-13, "{}", mean - center[k]);
    }
}

/// The point's attraction is part of the balance, the thermal factor and the certificate: without it the body would fall apart, and
/// without its potential the energy would not be kept.
#[test]
#[ignore = "slow: .ci/full runs it"]
fn a_balanced_giant_is_quiet() {
    let (file, report) = placed(
        "input: {profile: {polytrope: {n: 4, mass: 1 Msun, radius: 50 Rsun}}, core: {radius: 10 Rsun, gas: constant-entropy}}\n\
         particles: 3000\nbalance: {evaluations: 200}\ncertify: 1\noutput: {units: solar}\n",
    );
    let certificate = report.certificate.as_ref().unwrap();
    assert!(certificate.kinetic < 2e-4, "{}", certificate.kinetic);
    assert!(certificate.central_density_drift < 0.05, "{}", certificate.central_density_drift);
    let states = &certificate.states;
    assert!(states.iter().all(|s| s.energy.abs() < 1e-3 && s.virial.abs() < 0.05), "{states:?}");
    assert!(report.balance.as_ref().unwrap().interior.unwrap() < 0.02, "{:?}", report.balance);
    assert!(report.notes.iter().any(|n| n.contains("that of the point mass in its center")), "{:?}", report.notes);
    let (x, center) = (values(&file, 0, names::COORDINATES), values(&file, 1, names::COORDINATES));
    for k in 0..3 {
        let mean = x.iter().skip(k).step_by(3).sum::<f64>() / 3000.0;
        // To the digits of the file.
        assert!((mean - center[k]).abs() < 50.0 * 1e-7, "{}", mean - center[k]);
    }
}

fn bodies(yaml: &str) -> (ParticleFile, BodiesReport) {
    place_bodies(&Scene::parse(yaml).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_giant_and_its_companion_are_on_their_orbit() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string("profiles/common-envelope.yaml").unwrap();
    let text = text.replace("100000", "2000").replace("balance: {}", "wvt: {iterations: 2}\npolish: none");
    let scene = format!("{text}cache: {}\noutput: {{units: solar}}\n", folder.path().display());
    let (file, report) = bodies(&scene);
    assert_eq!(file.species.iter().map(|s| (s.part_type, s.table.count)).collect::<Vec<_>>(), [(0, 2000), (1, 2)]);
    assert_eq!(report.bodies.iter().map(|b| b.ids).collect::<Vec<_>>(), [[1, 2001], [2002, 2002]]);
    assert_eq!(values(&file, 1, names::PARTICLE_IDS), [2001.0, 2002.0]);
    assert_eq!(values(&file, 1, "BodyID"), [1.0, 2.0]);
    let softening = values(&file, 1, names::SOFTENING_RADIUS);
    assert!(softening.iter().zip([10.0, 5.0]).all(|(r, wanted)| (r / wanted - 1.0).abs() < 1e-9), "{softening:?}");
    let points = values(&file, 1, names::MASSES);
    assert!((points[1] - 0.5).abs() < 1e-9);
    let gas: f64 = values(&file, 0, names::MASSES).iter().sum();
    assert!((gas + points[0] - report.bodies[0].mass).abs() < 1e-12);
    assert!((report.bodies[0].particle_mass / (gas / 2000.0) - 1.0).abs() < 1e-12);
    // The core moves with the giant, and all of them about their center of mass.
    let v = values(&file, 1, names::VELOCITIES);
    let of_gas = values(&file, 0, names::VELOCITIES);
    assert!((0..3).all(|k| (v[k] - of_gas[k]).abs() < 1e-12), "{v:?}");
    for k in 0..3 {
        let momentum = gas * of_gas[k] + points[0] * v[k] + points[1] * v[3 + k];
        assert!(momentum.abs() < 1e-12, "{momentum}");
    }
    let speed = ((0..3).map(|k| (v[k] - v[3 + k]).powi(2)).sum::<f64>()).sqrt();
    let total = gas + points[0] + points[1];
    assert!((speed / (total / 55.0).sqrt() - 1.0).abs() < 1e-9, "{speed}");
    let (again, report) = bodies(&scene);
    assert!(report.bodies[0].cached);
    for species in 0..2 {
        assert_eq!(values(&again, species, names::COORDINATES), values(&file, species, names::COORDINATES));
    }
}

/// A point mass beside gas that is kept: what holds the gas is the weight in the pull of both.
#[test]
fn gas_about_a_black_hole_is_held_by_both() {
    let scene = |core: &str| {
        format!(
            "input: {{profile: {{plummer: {{mass: 1, scale_radius: 1, outer_radius: 3}}}}{core}}}\nparticles: 2000\n\
             wvt: {{iterations: 4}}\nsolver: {{evaluations: 10}}\nbalance: {{equation_of_state: at-rest, evaluations: 60}}\noutput: {{units: code}}\n"
        )
    };
    let (file, report) = placed(&scene(", core: {radius: 0.5, mass: 0.5, gas: keep}"));
    let (alone, _) = placed(&scene(""));
    assert_eq!(values(&file, 1, names::MASSES), [0.5]);
    let hot = |file: &ParticleFile| values(file, 0, names::INTERNAL_ENERGY).iter().fold(0.0_f64, |m, u| m.max(*u));
    assert!(hot(&file) > 1.3 * hot(&alone), "{} against {}", hot(&file), hot(&alone));
    assert!(report.balance.as_ref().unwrap().interior.unwrap() < 0.05, "{:?}", report.balance);
}

#[test]
fn what_makes_no_core_is_refused_with_what_would() {
    let giant = |core: &str| GIANT.replace("{radius: 5 Rsun}", core) + QUICK;
    for (scene, words) in [
        (giant("{radius: 60 Rsun}"), &["input.core.radius", "ends at"][..]),
        (giant("{radius: -1 Rsun}"), &["input.core.radius", "more than 0"]),
        (giant("{radius: 1e300 Rsun}"), &["input.core.radius", "ends at"]),
        (giant("{radius: 5 Msun}"), &["input.core.radius", "a length"]),
        (giant("{gas: cubic}"), &["radius"]),
        (giant("{radius: 5 Rsun, mass: 0.9 Msun}"), &["input.core.mass", "1.3 times the model"]),
        (giant("{radius: 5 Rsun, mass: 0.2 Msun, gas: lane-emden}"), &["input.core.mass", "hydrostatics"]),
        (giant("{radius: 5 Rsun, gas: keep}"), &["input.core.mass", "missing"]),
        (giant("{radius: 5 Rsun, n: 3}"), &["input.core.n", "lane-emden"]),
        (giant("{radius: 5 Rsun, gas: lane-emden, n: 7}"), &["input.core.n", "below 5"]),
        (giant("{radius: 5 Rsun, type: 0}"), &["input.core.type", "1 to 5"]),
        (giant("{radius: 5 Rsun, gas: square}"), &["cubic"]),
        (
            "input: {expression: '1', dimension: 3, core: {radius: 1}}\ndomain: {ball: {radius: 3}}\n".into(),
            &["input.core", "radial profile"],
        ),
        (
            "input: {profile: {polytrope: {n: 0, mass: 1, radius: 1}}, core: {radius: 0.3}}\n".into(),
            &["input.core.radius", "falls outward"],
        ),
        (
            giant("{radius: 5 Rsun}") + "domain: {ball: {radius: 40 Rsun, inner_radius: 1 Rsun}}\n",
            &["input.core.radius", "domain"],
        ),
    ] {
        let error = attempt(&scene).err().unwrap_or_else(|| panic!("{scene} is taken"));
        for word in words {
            assert!(error.contains(word), "{scene}{error} lacks {word:?}");
        }
    }
    let gas_alone = giant("{radius: 5 Rsun}") + "output: {file: a.h5, format: sph-exa}\n";
    assert!(attempt(&gas_alone).err().unwrap().contains("gas alone"));
    let radii = "bodies:\n- {softening_radius: 1, input: {profile: {polytrope: {n: 1, mass: 1, radius: 1}}}}\n";
    let error = Scene::parse(radii).and_then(|s| s.validate()).unwrap_err().to_string();
    assert!(error.contains("point_mass") && error.contains("missing"), "{error}");
}
