//! `--dry-run`: what a run would do, and nothing of it.

use super::support::{Folder, sph_prep, succeed};

const STAR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/star.nc");

#[test]
fn a_dry_run_says_what_each_stage_takes_and_writes_nothing() {
    let folder = Folder::new();
    let out = folder.path("out/ic.hdf5").display().to_string();
    for (polish, stage) in [("solver", "solver"), ("alaric", "alaric"), ("afc", "afc"), ("none", "wvt")] {
        let args = ["--in", STAR, "--out", &out, "-n", "20000", "--polish", polish, "--dry-run"];
        let text = succeed(&args).stdout;
        for part in ["nothing is written", "particles        20000 in 3-D", "this machine", "all stages", "GiB"] {
            assert!(text.contains(part), "{polish}: {text}");
        }
        let line = text.lines().find(|l| l.trim_start().starts_with("stage") && l.contains(stage));
        assert!(line.is_some_and(|l| l.contains("at most") && l.contains("GiB")), "{polish}: {text}");
        let json: serde_json::Value =
            serde_json::from_str(&succeed(&[&args[..], &["--json"]].concat()).stdout).unwrap();
        for stage in json["stages"].as_array().unwrap() {
            assert!(stage["seconds"].as_f64().is_some_and(|s| s > 0.0), "{polish}: {json}");
            // Some hundred bytes a particle.
            assert!((2e6..2e7).contains(&stage["memory"].as_f64().unwrap()), "{polish}: {json}");
        }
        // A busy machine may be slow, but this is no other one.
        assert!((0.05..50.0).contains(&json["slowness"].as_f64().unwrap()), "{polish}: {json}");
    }
    assert!(folder.outputs().is_empty());
}

/// Four times the particles take four times the time.
#[test]
fn what_is_foreseen_grows_with_the_work() {
    let seconds = |more: &[&str]| {
        let args = [&["--in", STAR, "--dry-run", "--json", "--polish", "afc"], more].concat();
        let json: serde_json::Value = serde_json::from_str(&succeed(&args).stdout).unwrap();
        let stages = json["stages"].as_array().unwrap().clone();
        let afc = stages.iter().find(|s| s["stage"] == "afc").unwrap();
        afc["seconds"].as_f64().unwrap() / json["slowness"].as_f64().unwrap()
    };
    // What the target costs is measured anew in each run.
    let few = seconds(&["-n", "10000"]);
    assert!((2.0..8.0).contains(&(seconds(&["-n", "40000"]) / few)));
}

#[test]
fn what_a_run_refuses_a_dry_run_refuses_too() {
    let folder = Folder::new();
    let out = folder.path("out/ic.hdf5").display().to_string();
    for (args, part) in [
        (&["--in", STAR, "--density", "desnity"][..], "did you mean 'density'"),
        (&["--in", STAR, "-n", "1e9"], "GiB of memory"),
        (&["--in", "absent.nc"], "absent.nc"),
    ] {
        let outcome = sph_prep(&[args, &["--dry-run", "--out", &out]].concat());
        assert!(outcome.code != Some(0) && outcome.stderr.contains(part), "{args:?}: {outcome:?}");
    }
    assert!(folder.outputs().is_empty());
}

/// Stars of 3 to 1, and a third like the first.
#[test]
fn several_bodies_are_foreseen_one_by_one() {
    let folder = Folder::new();
    let out = folder.path("out/ic.hdf5").display().to_string();
    let cache = folder.path("cache").display().to_string();
    let star = |mass: usize, place: usize| {
        format!(
            "{{input: {{profile: {{polytrope: {{n: 1.5, mass: {mass}, radius: 1}}}}}}, particles: {mass}000, position: [{place}, 0, 0]}}"
        )
    };
    let scene = format!(
        "cache: '{cache}'\nwvt: {{iterations: 2}}\npolish: none\nbodies: [{}, {}, {}, {{point_mass: 1, position: [0, 9, 0]}}]\n",
        star(3, 0),
        star(1, 5),
        star(3, 10)
    );
    let scene = folder.file("three.yaml", scene).display().to_string();
    let args = ["--scene", &scene, "--out", &out, "--dry-run"];
    let text = succeed(&args).stdout;
    for part in ["nothing is written", "body 1", "3000 in 3-D", "1000 in 3-D", "a copy of body 1", "all bodies"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let foreseen = |args: &[&str]| -> serde_json::Value {
        serde_json::from_str(&succeed(&[args, &["--json"]].concat()).stdout).unwrap()
    };
    let json = foreseen(&args);
    let bodies = json["bodies"].as_array().unwrap();
    assert_eq!(bodies.len(), 3, "{json}");
    assert!(bodies[0]["forecast"]["mass"].as_f64().is_some_and(|m| (m - 3.0).abs() < 0.01), "{json}");
    assert!(bodies[2]["same_as"] == "1" && bodies[2]["forecast"].is_null(), "{json}");
    assert!(folder.outputs().is_empty());
    assert!(json["ambient"].is_null() && json["notes"].as_array().unwrap().is_empty(), "{json}");
    // What was placed is kept.
    succeed(&args[..4]);
    let json = foreseen(&args);
    assert!(json["bodies"][1]["is_cached"] == true && json["bodies"][1]["forecast"].is_null(), "{json}");
}

/// A ball of density 3 in a box of volume 64 with density 0.5 around: it would take 32/(4 pi) of the ball's number of particles.
#[test]
fn a_medium_is_foreseen_with_the_particles_it_may_have() {
    let folder = Folder::new();
    let scene = |matching: &str| {
        let text = format!(
            "bodies: [{{input: {{expression: '3'}}, domain: {{ball: {{center: [0, 0, 0], radius: 1}}}}, particles: 1000}}]\n\
             ambient: {{density: 0.5{matching}}}\ndomain: {{box: [[-2, -2, -2], [2, 2, 2]], boundary: periodic}}\n"
        );
        folder.file("ambient.yaml", text).display().to_string()
    };
    let file = scene("");
    let text = succeed(&["--scene", &file, "--dry-run"]).stdout;
    for part in ["\nambient\n", "density          0.5", "at most 2", "all bodies and the medium"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let foreseen = |args: &[&str]| -> serde_json::Value {
        serde_json::from_str(&succeed(&[args, &["--dry-run", "--json"]].concat()).stdout).unwrap()
    };
    let json = foreseen(&["--scene", &file]);
    let exact = 0.5 * 64.0 / (3.0 * 4.0 / 3.0 * std::f64::consts::PI / 1000.0);
    let most = json["ambient"]["most"].as_f64().unwrap();
    // The mass of both is found by quadrature.
    assert!((most / exact - 1.0).abs() < 0.01, "{most} {exact}");
    assert_eq!(json["ambient"]["forecast"]["particles"], json["ambient"]["most"]);
    let json = foreseen(&["--scene", &scene(", match: spacing")]);
    assert!(json["ambient"]["most"].is_null() && json["ambient"]["density"] == "0.5", "{json}");
}

#[test]
fn a_number_of_the_whole_that_no_body_takes_is_told() {
    let folder = Folder::new();
    let ball = |x: usize, more: &str| {
        format!(
            "{{input: {{expression: '1'}}, domain: {{ball: {{center: [0, 0], radius: 1}}}}, position: [{x}, 0]{more}}}"
        )
    };
    let text = format!("bodies: [{}, {}]\npolish: none\n", ball(0, ", particles: 200"), ball(4, ", particles: 300"));
    let scene = folder.file("two.yaml", text).display().to_string();
    let out = folder.path("out/ic.vtu").display().to_string();
    for dry in [&["--dry-run"][..], &[]] {
        let told = succeed(&[&["--scene", &scene, "--out", &out, "-n", "4000"], dry].concat()).stdout;
        assert!(told.contains("4000 particles of the whole were asked for, but each"), "{told}");
        let told = succeed(&[&["--scene", &scene, "--out", &out], dry].concat()).stdout;
        assert!(!told.contains("of the whole"), "{told}");
    }
    // The last line has the file, its size and the verdict.
    let told = succeed(&["--scene", &scene, "--out", &out]).stdout;
    let last = told.lines().last().unwrap();
    let bytes = std::fs::metadata(folder.path("out/ic.vtu")).unwrap().len() as f64;
    assert!(last.starts_with(&format!("wrote {out} ({:.1} kB): ", bytes / 1000.0)), "{last} {bytes}");
    assert!(["good", "usable", "do not use it"].iter().any(|v| last.contains(v)), "{last}");
}
