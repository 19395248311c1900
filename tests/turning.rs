//! Bodies that turn: what is followed of them turns as well, and what their rotation does to them is in the verdict.

use sph_prep::run::verdict::Grade;
use sph_prep::{BodiesReport, Control, FORMATS, ParticleFile, Report, Scene, place, place_bodies};

const STAR: &str = "input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}";

fn alone(rest: &str) -> (ParticleFile, Report) {
    place(&Scene::parse(&format!("{STAR}\n{rest}")).unwrap(), FORMATS, &Control::default())
        .unwrap_or_else(|e| panic!("{e}"))
}

fn among_others(body: &str, rest: &str) -> (ParticleFile, BodiesReport) {
    let scene = format!("bodies:\n- {{name: star, {STAR}{body}}}\n{rest}");
    place_bodies(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn column(file: &ParticleFile, name: &str) -> Vec<f64> {
    file.species[0].table.column(name).unwrap_or_else(|| panic!("no '{name}'")).values.to_f64()
}

/// 2 K/(3 (gamma - 1) U), by the columns of a file alone.
fn motion_over_support(file: &ParticleFile) -> f64 {
    let (v, u) = (column(file, "Velocities"), column(file, "InternalEnergy"));
    v.iter().map(|v| v * v).sum::<f64>() / (2.0 * u.iter().sum::<f64>())
}

#[test]
fn the_certificate_of_a_body_among_others_is_that_of_the_body_as_it_turns() {
    let short = "particles: 600\nbalance: {evaluations: 40}\ncertify: 0.3\n";
    let (_, expected) = alone(&format!("{short}motion: {{rotation: [0.1, 0, 0.6]}}\n"));
    let expected = expected.certificate.unwrap().states;
    let of = |body: &str| {
        let (_, report) = among_others(body, short);
        let states = report.bodies[0].report["certificate"]["states"].clone();
        let last = states.as_array().unwrap().last().unwrap().clone();
        ([&states[0]["virial"], &last["half_mass_radius"]].map(|v| v.as_f64().unwrap()), report)
    };
    let (still, report) = of("");
    assert!(still[0].abs() < 0.02, "{still:?}");
    let text = report.text();
    assert!(text.contains("good   certificate") || text.contains("LOOK   certificate"), "{text}");
    let (turning, _) = of(", spin: [0.1, 0, 0.6], position: [7, 0, 0]");
    assert!(expected[0].virial > 0.05, "{:?}", expected[0]);
    assert!((turning[0] / expected[0].virial - 1.0).abs() < 1e-3, "{turning:?} {:?}", expected[0]);
    let radius = expected.last().unwrap().half_mass_radius;
    assert!((turning[1] / radius - 1.0).abs() < 1e-3 && radius > still[1] + 4e-3, "{still:?} {turning:?} {radius}");
}

#[test]
fn what_rotation_carries_is_told_of_bodies_as_it_is_of_one() {
    let short = "particles: 600\nbalance: {evaluations: 40}\n";
    let carried = |text: &str| -> Option<f64> {
        let (_, rest) = text.split_once("carries ")?;
        rest.split_once(" % of gravity")?.0.trim().parse().ok()
    };
    let (file, report) = among_others(", spin: [0, 0, 0.7], velocity: [3, 0, 0]", short);
    let finding = report.verdict.iter().find(|f| f.text.contains("body star is placed at rest")).unwrap();
    let mut file = file;
    for c in file.species[0].table.columns.iter_mut().filter(|c| c.name == "Velocities") {
        let v = c.values.to_f64();
        c.values = sph_formats::Values::F64(v.iter().enumerate().map(|(i, v)| v - [3.0, 0.0, 0.0][i % 3]).collect());
    }
    let expected = 100.0 * motion_over_support(&file);
    let found = carried(&finding.text).unwrap();
    // Energies have been changed by some percent.
    assert!(finding.grade == Grade::Look && (found / expected - 1.0).abs() < 0.1, "{found} {expected}");
    let (_, report) = alone(&format!("{short}motion: {{rotation: [0, 0, 0.7]}}\n"));
    let of_one = report.verdict.iter().find_map(|f| carried(&f.text)).unwrap();
    assert!((of_one - found).abs() <= 1.0, "{of_one} {found}");
    // Too little to tell, and nothing at rest.
    for body in [", spin: [0, 0, 0.05]", ""] {
        let (_, report) = among_others(body, short);
        assert!(!report.verdict.iter().any(|f| f.text.contains("spin")), "{:?}", report.verdict);
    }
}

#[test]
fn what_turns_faster_than_its_gravity_holds_is_bad() {
    let short = "particles: 100\npolish: none\nwvt: {iterations: 0}\n";
    for (rate, is_held) in [(0.9, true), (1.1, false), (-5.0, false)] {
        let (_, report) = alone(&format!("{short}motion: {{rotation: [0, 0, {rate}]}}\n"));
        let is_told = |f: &&sph_prep::run::verdict::Finding| f.text.contains("it flies apart");
        let told = report.verdict.iter().find(is_told).map(|f| f.grade);
        assert_eq!(told, (!is_held).then_some(Grade::Bad), "alone, {rate}");
        let (_, report) = among_others(&format!(", spin: [0, 0, {rate}]"), short);
        let told = report.verdict.iter().find(is_told).map(|f| f.grade);
        assert_eq!(told, (!is_held).then_some(Grade::Bad), "among others, {rate}");
    }
}

/// Its note is on the velocities that were drawn.
#[test]
fn a_halo_that_is_spun_is_said_to_spread() {
    let scene = |spin: f64| {
        format!(
            "bodies:\n- {{name: halo, input: {{profile: {{plummer: {{mass: 1, scale_radius: 1, outer_radius: 10}}}}}}, collisionless: true, spin: [0, 0, {spin}]}}\n\
             particles: 500\npolish: none\nwvt: {{iterations: 0}}\n"
        )
    };
    let of = |spin: f64| place_bodies(&Scene::parse(&scene(spin)).unwrap(), FORMATS, &Control::default()).unwrap();
    let energy = |file: &ParticleFile| {
        let table = &file.species[0].table;
        table.column("Velocities").unwrap().values.to_f64().iter().map(|v| v * v).sum::<f64>()
    };
    let (still, _) = of(0.0);
    let (file, report) = of(0.2);
    let factor = energy(&file) / energy(&still);
    let told = report.verdict.iter().find(|f| f.text.contains("body halo turns")).unwrap();
    assert!(told.text.contains(&format!("is {factor:.3} times")) && factor > 1.1, "{} {factor}", told.text);
    let (_, report) = of(0.001);
    assert!(!report.verdict.iter().any(|f| f.text.contains("turns")), "{:?}", report.verdict);
}

/// A disc, or a halo, without what it is about.
#[test]
fn bodies_at_one_place_that_part_are_told() {
    let scene = |velocity: &str| {
        format!(
            "bodies:\n- {{name: star, point_mass: 1, accretion_radius: 0.1, velocity: [3, 0, 0]}}\n\
             - {{name: disc, input: {{profile: {{disc: {{mass: 1e-3, inner_radius: 1, outer_radius: 5, aspect_ratio: 0.1}}}}}}, velocity: {velocity}}}\n\
             particles: 300\npolish: none\nwvt: {{iterations: 0}}\noutput: {{units: code}}\n"
        )
    };
    let told = |velocity: &str| {
        let (_, report) = place_bodies(&Scene::parse(&scene(velocity)).unwrap(), FORMATS, &Control::default()).unwrap();
        report.warnings.iter().any(|w| w.contains("star and disc are at one place, but move against each other"))
    };
    assert_eq!(["[3, 0, 0]", "[0, 0, 0]", "[3, 0, 1e-3]"].map(told), [false, true, true]);
}
