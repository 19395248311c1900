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

/// Twice the particles take twice the time; more steps take more.
#[test]
fn what_is_foreseen_grows_with_the_work() {
    let seconds = |more: &[&str]| {
        let args = [&["--in", STAR, "--dry-run", "--json", "--polish", "afc"], more].concat();
        let json: serde_json::Value = serde_json::from_str(&succeed(&args).stdout).unwrap();
        let stages = json["stages"].as_array().unwrap().clone();
        let afc = stages.iter().find(|s| s["stage"] == "afc").unwrap();
        afc["seconds"].as_f64().unwrap() / json["slowness"].as_f64().unwrap()
    };
    let few = seconds(&["-n", "10000"]);
    assert!((seconds(&["-n", "40000"]) / few - 4.0).abs() < 1e-9);
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
    let bodies = folder.file("two.yaml", format!("bodies: [{{input: {{file: {STAR}}}}}, {{input: {{file: {STAR}}}}}]"));
    let outcome = sph_prep(&["--scene", &bodies.display().to_string(), "--dry-run", "--out", &out]);
    assert!(outcome.code == Some(2) && outcome.stderr.contains("each of the bodies by itself"), "{outcome:?}");
    assert!(folder.outputs().is_empty());
}
