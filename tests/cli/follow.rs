//! `sph-prep run`: what it prints and writes.

use super::support::{Folder, sph_prep};

#[test]
fn the_command_prints_a_table_a_verdict_and_a_page() {
    let folder = Folder::new();
    let [out, page] = ["ic.hdf5", "page.html"].map(|name| folder.path(name).display().to_string());
    let star = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/polytrope-1.5.nc");
    let placed = sph_prep(&["--in", star, "-n", "500", "--for", "swift", "--out", &out, "--quiet"]);
    assert_eq!(placed.code, Some(0), "{placed:?}");
    let run = |rest: &[&str]| sph_prep(&[&["run", &out, "--for", "swift"], rest].concat());
    let told = run(&["--duration", "0.5", "--report", &page]);
    assert_eq!(told.code, Some(0), "{told:?}");
    for part in ["r_half", "dynamical times", "cubic spline", "page: ", "time: "] {
        assert!(told.stdout.contains(part), "{part}: {}", told.stdout);
    }
    // The heading, and the table below it.
    assert!(told.stdout.lines().skip(1).take(8).all(|l| l.len() <= 80), "{}", told.stdout);
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(html.contains("Certificate: motion") && html.contains("half-mass radius"));
    let json = run(&["--duration", "0.5", "--json"]);
    let parsed: serde_json::Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(parsed["states"].as_array().unwrap().len(), 6);
    let early = run(&["--duration", "1000", "--time-limit", "1"]);
    assert_eq!(early.code, Some(3), "{early:?}");
    assert!(early.stdout.contains("stopped early"));
    let at_once = run(&["--time-limit", "0"]);
    assert!(at_once.code == Some(3) && at_once.stdout.contains("unknown"), "{at_once:?}");
    let settled = folder.path("settled.hdf5").display().to_string();
    let quiet = run(&["--duration", "0.2", "--settle", "0.5", "--out", &settled]);
    assert_eq!(quiet.code, Some(0), "{quiet:?}");
    assert!(quiet.stdout.contains("while motion is damped") && quiet.stdout.contains(&settled), "{}", quiet.stdout);
    assert_eq!(sph_prep(&["check", &settled, "--for", "swift"]).code, Some(0));
    // A name that several formats have is one of the code's.
    let of_code = folder.path("of-code.hdf5").display().to_string();
    let short = ["--duration", "0", "--settle", "0.05", "--out", &of_code];
    let placed = sph_prep(&[&["run", &out, "--for", "gadget4"][..], &short].concat());
    assert_eq!(placed.code, Some(0), "{placed:?}");
    let found = sph_formats::registry::detect(sph_formats::FORMATS, of_code.as_ref(), None).unwrap();
    assert_eq!(found.name, "gadget");
    let alone = run(&["--settle", "1"]);
    assert!(alone.code == Some(2) && alone.stderr.contains("--out"), "{alone:?}");
    let itself = run(&["--settle", "1", "--out", &out]);
    assert!(itself.code == Some(2) && itself.stderr.contains("itself"), "{itself:?}");
    let over = run(&["--report", &out]);
    assert_ne!(over.code, Some(0));
    assert!(over.stderr.contains("itself"));
    let mistyped = sph_prep(&["run", &out, "--for", "swfit"]);
    assert!(mistyped.stderr.contains("swift"), "{mistyped:?}");
}
