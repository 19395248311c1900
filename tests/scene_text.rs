//! Scenes as text: how values may be written, and what is said of those that cannot be.

use sph_prep::Scene;
use sph_prep::scene::BoundaryName::{Open, Periodic};
use sph_prep::scene::{BalanceInput, Switch};

#[test]
fn an_unknown_key_is_named_with_line_and_column() {
    let error = Scene::parse("input:\n  file: a.nc\n  densty: rho\n").unwrap_err().to_string();
    assert!(error.contains("densty") && error.contains("line 3"), "{error}");
}

#[test]
fn a_printed_scene_reads_back_the_same() {
    let scene = Scene::parse(
        "input: {expression: '1 + x'}\ndomain: {box: [[0, 0], [1, 2]], boundary: [periodic, open]}\nparticles: 1000\n",
    )
    .unwrap();
    assert_eq!(Scene::parse(&scene.to_yaml()).unwrap(), scene, "{}", scene.to_yaml());
    scene.validate().unwrap();
}

#[test]
fn impossible_values_are_refused_by_key() {
    for (text, key) in [
        ("particles: 10", "input"),
        ("input: {file: a}\nparticles: 0", "particles"),
        ("input: {file: a}\nwvt: {step: -1}", "wvt.step"),
        ("input: {file: a}\nwvt: {final_step: 2}", "wvt.final_step"),
        ("input: {file: a}\nneighbors: .nan", "neighbors"),
        ("input: {file: a}\nthermal: {gamma: 1}", "thermal.gamma"),
        ("input: {file: a}\nmaterial: [{id: 400, radius: 2}, {id: 401, radius: 1}, {id: 402}]", "material"),
        ("input: {file: a}\nmaterial: [{id: 400, radius: 2}]", "material"),
        ("input: {file: a}\nresolution: {}", "resolution"),
        ("input: {file: a}\ndomain: {box: [[0], [1]], ball: {radius: 1}}", "domain"),
    ] {
        let error = Scene::parse(text).unwrap().validate().unwrap_err().to_string();
        assert!(error.starts_with(&format!("scene, {key}")), "{error}");
    }
}

#[test]
fn plain_words_stand_for_lists_and_sections() {
    let boundary = |text: &str| Scene::parse(&format!("domain: {{boundary: {text}}}")).unwrap().domain.boundary;
    assert_eq!(boundary("periodic"), [Periodic]);
    assert_eq!(boundary("[periodic]"), [Periodic]);
    assert_eq!(boundary("[open, open, periodic]"), [Open, Open, Periodic]);
    let balance = |text: &str| Scene::parse(&format!("balance: {text}")).unwrap().balance;
    assert_eq!(balance("true"), Switch::On(BalanceInput::default()));
    assert_eq!(balance("{}"), Switch::On(BalanceInput::default()));
    assert_eq!(balance("{evaluations: 200}").on().unwrap().evaluations, Some(200));
    assert_eq!((balance("false"), balance("null")), (Switch::Off, Switch::Unset));
    let scene = Scene::parse("balance: false").unwrap();
    assert_eq!(Scene::parse(&scene.to_yaml()).unwrap().balance, Switch::Off);
}

#[test]
fn errors_say_where_what_and_what_instead() {
    for (text, parts) in [
        (
            "input:\n  file: a\n  densty: rho\n",
            &["line 3, column 3", "no key 'densty'", "did you mean 'density'?", "    3 |   densty: rho\n      |   ^"][..],
        ),
        ("polish: Solver", &["line 1, column 9", "'Solver' is no choice", "did you mean 'solver'?", "alaric"]),
        ("domain: {boundary: Periodic}", &["'Periodic' is no choice", "did you mean 'periodic'?"]),
        ("domain: {boundary: [perodic]}", &["did you mean 'periodic'?"]),
        ("balance: {evalutions: 3}", &["line 1", "no key 'evalutions'", "did you mean 'evaluations'?"]),
        ("balance: yess", &["line 1", "true, false, or keys"]),
        ("motion: {bulk: 3}", &["expected a list, as in [1, 2, 3]"]),
        ("domain: 3", &["expected keys with values"]),
        ("input: star.nc", &["expected keys with values", "for a file write `input: {file: star.nc}`"]),
        ("bodies:\n- {name: a, input: 'my/star.nc'}", &["line 2, column 20", "`input: {file: my/star.nc}`"]),
        ("output: ic.hdf5 # for SWIFT", &["`output: {file: ic.hdf5}`"]),
        ("motion: {bulk: [.nan, 0, 0]}", &["line 1, column 17", "is .nan, expected a finite number"]),
        ("domain: {box: [[0], [-.inf]]}", &["is -.inf, expected a finite number"]),
        ("seed: -1", &["expected a whole number, at least 0"]),
        ("wvt: {step: big}", &["expected a number"]),
        ("output: {double_precision: 3}", &["expected true or false"]),
        ("seed: 1\nseed: 2", &["the key 'seed' comes twice"]),
        ("material: [{radius: 1}]", &["the key 'id' is missing"]),
        ("domain: {ball: {center: [0]}}", &["the key 'radius' is missing"]),
        ("xyz: 1", &["no key 'xyz'", "expected one of input"]),
    ] {
        let error = Scene::parse(text).unwrap_err().to_string();
        for part in parts.iter().chain(&["scene, document"]) {
            assert!(error.contains(part), "{text}: {error}\nlacks {part}");
        }
        assert!(!error.contains("<input>") && !error.contains("serde"), "{error}");
    }
}

#[test]
fn known_keys_are_listed_once() {
    let error = Scene::parse("xyz: 1").unwrap_err().to_string();
    assert_eq!(error.matches("particles").count(), 1, "{error}");
}

#[test]
fn counts_are_read_as_people_write_them() {
    for text in ["100000", "1e5", "100_000", "100k", "0.1M", "100K", "'1e5'", "1.0e5", "0.1M"] {
        let scene = Scene::parse(&format!("particles: {text}\nwvt: {{iterations: {text}}}")).unwrap();
        assert_eq!((scene.particles, scene.wvt.iterations), (Some(100_000), Some(100_000)), "{text}");
    }
    assert_eq!(Scene::parse("particles: null").unwrap().particles, None);
}

#[test]
fn what_is_no_count_is_refused() {
    for text in ["1.5", "-3", "many", "1e30", "k", "", "nan", "1kk"] {
        assert!(Scene::parse(&format!("particles: '{text}'")).is_err(), "{text}");
    }
    let error = Scene::parse("particles: 1.5").unwrap_err().to_string();
    assert!(error.contains("1.5 is no count") && error.contains("line 1"), "{error}");
}

#[test]
fn a_coordinate_is_no_switch() {
    let scene = Scene::parse("fields: {velocity: [x, y, n]}").unwrap();
    let (_, velocity) = scene.fields.stated().next().unwrap();
    assert_eq!(velocity.texts(), ["x", "y", "n"]);
    // What is a switch may still be written so.
    let scene = Scene::parse("balance: yes\noutput: {parameters: on}").unwrap();
    assert!(scene.balance.is_on() && scene.output.parameters);
    assert!(Scene::parse("balance: off").unwrap().balance.is_off());
    for text in ["output: {parameters: maybe}", "output: {parameters: maybe}\nfields: {velocity: [x, y, z]}"] {
        let error = Scene::parse(text).unwrap_err().to_string();
        assert!(error.contains("line 1") && error.contains("expected true or false"), "{error}");
    }
}
