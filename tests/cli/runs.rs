//! Runs that work: exact counts, the same bytes again, what is printed where.

use super::support::{Folder, Outcome, command, faults, sph_prep, succeed};
use crate::cases::first;
use sph_formats::{FORMATS, FieldRequest, FileContent};
use std::path::{Path, PathBuf};

fn text(path: &Path) -> String {
    path.display().to_string()
}

/// Gas particles in a file.
fn particles_in(path: &Path) -> usize {
    match sph_formats::read(FORMATS, path, None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(file) => file.species.iter().map(|s| s.table.count).sum(),
        FileContent::Field(field) => panic!("'{}' holds a {}", path.display(), field.geometry.kind()),
    }
}

/// A star of a file, and periodic boxes, walls and balls of expressions, in every dimension.
fn scenes(folder: &Folder) -> Vec<PathBuf> {
    let corners = ["[[0], [1]]", "[[0, 0], [1, 2]]", "[[0, 0, 0], [1, 2, 3]]"];
    let mut scenes = Vec::new();
    for (d, corners) in corners.iter().enumerate() {
        let d = d + 1;
        for (i, domain) in [
            format!("{{box: {corners}, boundary: [periodic]}}"),
            format!("{{box: {corners}, boundary: [reflecting]}}"),
            "{ball: {radius: 2}}".to_owned(),
        ]
        .iter()
        .enumerate()
        {
            let scene = format!("input: {{expression: '1 + 0.5*x', dimension: {d}}}\ndomain: {domain}\n");
            let scene = scene.replace("0.5*x", if i == 2 { "r" } else { "0.5*x" });
            scenes.push(folder.file(&format!("d{d}-{i}.yaml"), scene + "wvt: {iterations: 3}\n"));
        }
    }
    folder.file("star.txt", "# r density\n0 2\n0.5 1.5\n1 0.5\n");
    scenes.push(folder.file("star.yaml", "input: {file: star.txt}\nwvt: {iterations: 3}\n"));
    scenes
}

#[test]
fn few_particles_are_placed_exactly() {
    let folder = Folder::new();
    for scene in scenes(&folder) {
        for n in [1, 2, 7] {
            let out = folder.path("out/ic.vtu");
            let outcome = succeed(&["--scene", &text(&scene), "--out", &text(&out), "-n", &n.to_string(), "--json"]);
            let report: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
            assert_eq!(report["particles"], n, "{scene:?}");
            assert!(report["mass"]["defect"].as_f64().unwrap().abs() < 1e-12, "{scene:?} {n}: {}", report["mass"]);
            let hdf5 = folder.path("out/ic.hdf5");
            succeed(&["--scene", &text(&scene), "--out", &text(&hdf5), "-n", &n.to_string()]);
            assert_eq!(particles_in(&hdf5), n, "{scene:?}");
        }
    }
}

#[test]
fn no_particles_are_refused_as_wrong_usage() {
    let folder = Folder::new();
    let none = folder.file("none.yaml", "input: {expression: '1', dimension: 1}\nparticles: 0\n");
    let out = text(&folder.path("out/ic.hdf5"));
    let outcome = sph_prep(&["--scene", &text(&none), "--out", &out]);
    assert_eq!(faults(&outcome, &folder, 2, &["particles", "at least 1"]), Vec::<String>::new(), "{outcome:?}");
    for count in ["0", "-3", "1.5", "nan", "1e12", "many"] {
        let outcome = sph_prep(&["--in", "star.nc", "--out", &out, &format!("-n={count}")]);
        assert_eq!(outcome.code, Some(2), "{outcome:?}");
        assert!(outcome.stderr.contains("--particles"), "{outcome:?}");
    }
    assert!(folder.outputs().is_empty());
}

/// Runs a 2-D scene of some hundred particles to this file name.
fn disc(folder: &Folder, name: &str, arguments: &[&str]) -> (Vec<u8>, Outcome) {
    let scene = folder.file(
        "disc.yaml",
        "input: {expression: 'exp(-2*r)'}\ndomain: {ball: {center: [0, 0], radius: 1}}\n\
         particles: 700\nwvt: {iterations: 20}\n",
    );
    let out = folder.path("out").join(name);
    let (scene, file) = (text(&scene), text(&out));
    let mut args = vec!["--scene", &scene, "--out", &file];
    args.extend(arguments);
    let outcome = succeed(&args);
    (std::fs::read(out).unwrap(), outcome)
}

#[test]
fn bytes_depend_on_the_seed_and_not_on_threads() {
    let folder = Folder::new();
    for name in ["ic.hdf5", "ic.vtu"] {
        let (one, _) = disc(&folder, name, &["--threads", "1"]);
        for threads in first(1, ["3", "2", "7"]) {
            let (many, _) = disc(&folder, name, &["--threads", threads]);
            assert!(one == many, "{name}: 1 and {threads} threads differ");
        }
        let (seeded, _) = disc(&folder, name, &["--seed", "5"]);
        let (again, _) = disc(&folder, name, &["--seed", "5"]);
        assert!(seeded == again, "{name}: the same seed gives other bytes");
        assert!(seeded != one, "{name}: another seed gives the same bytes");
    }
}

#[test]
fn piped_output_has_no_progress() {
    let folder = Folder::new();
    let (_, outcome) = disc(&folder, "ic.hdf5", &[]);
    assert!(outcome.stderr.is_empty(), "{outcome:?}");
    assert!(outcome.stdout.contains("700 in 2-D") && !outcome.stdout.contains(['\u{1b}', '\r']), "{outcome:?}");
    let (_, outcome) = disc(&folder, "ic.hdf5", &["--quiet"]);
    assert!(outcome.stderr.is_empty() && outcome.stdout.is_empty(), "{outcome:?}");
}

#[test]
fn the_json_report_has_its_keys() {
    let folder = Folder::new();
    let (_, outcome) = disc(&folder, "ic.hdf5", &["--json"]);
    assert!(outcome.stderr.is_empty(), "{outcome:?}");
    let report: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    for key in [
        "/input",
        "/output",
        "/format",
        "/dimension",
        "/particles",
        "/seed",
        "/kernel",
        "/mass/total",
        "/mass/quadrature_error",
        "/mass/smallest",
        "/mass/largest",
        "/mass/defect",
        "/mass/total_cgs",
        "/stop",
        "/density_error/all/epsilon",
        "/density_error/all_refitted/mean",
        "/noise/all",
        "/neighbors/kernel_neighbors",
        "/stages/0/history",
        "/timing/0/step",
        "/seconds",
        "/plan/left_out",
        "/notes",
    ] {
        assert!(report.pointer(key).is_some(), "no {key} in {report:#}");
    }
    assert_eq!(report["format"], "swift");
    assert_eq!(report["dimension"], 2);
}

#[test]
fn a_printed_scene_runs_to_the_same_bytes() {
    let folder = Folder::new();
    let (first, _) = disc(&folder, "ic.hdf5", &["--seed", "3", "-n", "300"]);
    let (disc, out) = (text(&folder.path("disc.yaml")), text(&folder.path("out/ic.hdf5")));
    let printed = succeed(&["--scene", &disc, "--out", &out, "--seed", "3", "-n", "300", "--print-scene"]).stdout;
    let scene = text(&folder.file("printed.yaml", printed));
    std::fs::remove_file(&out).unwrap();
    succeed(&["--scene", &scene]);
    assert!(std::fs::read(&out).unwrap() == first, "the printed scene gives other bytes");
    // Printed again it is the same text.
    assert_eq!(succeed(&["--scene", &scene, "--print-scene"]).stdout, std::fs::read_to_string(scene).unwrap());
}

#[test]
fn a_scene_with_an_unknown_key_is_refused_by_line_and_column() {
    let folder = Folder::new();
    let scene = text(&folder.file("typo.yaml", "input:\n  file: star.nc\n  densty: rho\n"));
    let outcome = sph_prep(&["--scene", &scene, "--out", &text(&folder.path("out/ic.hdf5"))]);
    let words = [&scene, "densty", "line 3", "column 3"];
    assert_eq!(faults(&outcome, &folder, 2, &words), Vec::<String>::new(), "{outcome:?}");
    for (bad, word) in [("absent.yaml", "No such file"), ("out", "directory")] {
        let path = text(&folder.path(bad));
        let outcome = sph_prep(&["--scene", &path, "--out", &text(&folder.path("out/ic.hdf5"))]);
        assert_eq!(faults(&outcome, &folder, 2, &[&path, word]), Vec::<String>::new(), "{outcome:?}");
    }
    let binary = text(&folder.file("binary.yaml", [0xff, 0xfe, 0, 1]));
    let outcome = sph_prep(&["--scene", &binary, "--out", &text(&folder.path("out/ic.hdf5"))]);
    assert_eq!(faults(&outcome, &folder, 2, &[&binary]), Vec::<String>::new(), "{outcome:?}");
}

#[test]
fn a_tolerance_out_of_reach_has_its_own_exit_code() {
    let folder = Folder::new();
    let (scene, out) = (scenes(&folder).swap_remove(3), folder.path("out/ic.hdf5"));
    let outcome = sph_prep(&["--scene", &text(&scene), "--out", &text(&out), "-n", "200", "--tolerance", "1e-30"]);
    assert_eq!(outcome.code, Some(3), "{outcome:?}");
    assert!(outcome.stderr.contains("tolerance") && outcome.stdout.contains("200 in 2-D"), "{outcome:?}");
    assert_eq!(particles_in(&out), 200);
    succeed(&["--scene", &text(&scene), "--out", &text(&out), "-n", "200", "--tolerance", "1e3"]);
    for bad in ["0", "-1", "nan"] {
        let outcome = sph_prep(&["--scene", &text(&scene), "--out", &text(&out), &format!("--tolerance={bad}")]);
        assert_eq!(outcome.code, Some(2), "{outcome:?}");
    }
}

/// What the verdict marks as bad is never silent, and ends a strict run with a code of its own; the file is there in any case.
#[test]
fn what_is_bad_is_said_in_every_mode() {
    let folder = Folder::new();
    let (scene, out) = (text(&scenes(&folder).swap_remove(3)), folder.path("out/ic.hdf5"));
    let run = |more: &[&str]| {
        let out = text(&out);
        let random = ["--seeding", "random", "--iterations", "0", "--polish", "none"];
        let outcome = sph_prep(&[&["--scene", &scene, "--out", &out, "-n", "200"], &random[..], more].concat());
        let is_told = outcome.stderr.contains("bad: density");
        assert!(is_told || outcome.stdout.contains("BAD    density"), "{more:?}: {outcome:?}");
        assert_eq!(particles_in(Path::new(&out)), 200);
        (outcome.code, is_told)
    };
    assert_eq!(run(&[]), (Some(0), false));
    assert_eq!(run(&["--quiet"]), (Some(0), true));
    assert_eq!(run(&["--json"]), (Some(0), true));
    assert_eq!(run(&["--strict"]), (Some(3), true));
}

#[test]
fn a_time_limit_ends_with_a_file() {
    let folder = Folder::new();
    for limit in ["0", "1e-9"] {
        let (_, outcome) = disc(&folder, "ic.hdf5", &["--time-limit", limit]);
        assert!(outcome.stdout.contains("TimeLimit"), "{outcome:?}");
        assert_eq!(particles_in(&folder.path("out/ic.hdf5")), 700);
    }
}

#[test]
fn a_pipe_that_closes_early_is_no_panic() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};
    let mut child = Command::new(env!("CARGO_BIN_EXE_sph-prep"))
        .arg("--help")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let stderr = child.stderr.take().unwrap();
    assert!(BufReader::new(stderr).lines().all(|line| !line.unwrap().contains("panicked")));
    child.wait().unwrap();
    for arguments in [vec!["formats"], vec!["inspect", concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/star.nc")]] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
        let Ok(full) = full else { return println!("skipped: no /dev/full") };
        let output = Command::new(env!("CARGO_BIN_EXE_sph-prep")).args(arguments).stdout(full).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(!stderr.contains("panicked") && output.status.code() == Some(1), "{stderr}");
    }
}

#[test]
fn formats_and_inspect_describe() {
    let formats = succeed(&["formats"]).stdout;
    for format in FORMATS {
        assert!(formats.lines().any(|l| l.starts_with(format.name)), "{}: {formats}", format.name);
    }
    let folder = Folder::new();
    let star = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/star.nc");
    let described = succeed(&["inspect", star]).stdout;
    assert!(described.contains("radial") && described.contains("<- density"), "{described}");
    disc(&folder, "ic.hdf5", &[]);
    disc(&folder, "ic.vtu", &[]);
    let described = succeed(&["inspect", &text(&folder.path("out/ic.hdf5"))]).stdout;
    assert!(described.contains("700 particles") && described.contains("Coordinates"), "{described}");
    let described = succeed(&["inspect", &text(&folder.path("out/ic.vtu"))]).stdout;
    assert!(described.contains("700"), "{described}");
    let outcome = sph_prep(&["inspect", &text(&folder.path("absent.nc"))]);
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    assert!(outcome.stderr.contains("absent.nc"), "{outcome:?}");
    assert_eq!(command().output().unwrap().status.code(), Some(2), "no arguments are wrong usage");
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_nothing() {
    use std::process::{Command, Stdio};
    let folder = Folder::new();
    let scene = scenes(&folder).swap_remove(6);
    let child = Command::new(env!("CARGO_BIN_EXE_sph-prep"))
        .args(["--scene", &text(&scene), "--out", &text(&folder.path("out/ic.hdf5")), "-n", "60000"])
        .args(["--iterations", "1000000"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(1500));
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("interrupted"), "{stderr}");
    assert!(folder.outputs().is_empty(), "{:?}", folder.outputs());
}

/// Whatever a run without stages is at (reading, seeding, measuring, writing): it ends, or it had come to its end before.
#[cfg(unix)]
#[test]
#[ignore = "slow: .ci/full runs it"]
fn an_interrupt_ends_every_step_between_the_stages() {
    use std::process::{Command, Stdio};
    let folder = Folder::new();
    let scene = scenes(&folder).swap_remove(6);
    let start = || {
        Command::new(env!("CARGO_BIN_EXE_sph-prep"))
            .args(["--scene", &text(&scene), "--out", &text(&folder.path("out/ic.hdf5")), "-n", "200000"])
            .args(["--iterations", "0", "--polish", "none", "--quiet"])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let begin = std::time::Instant::now();
    assert!(start().wait().unwrap().success());
    let whole = begin.elapsed();
    let mut interrupted = 0;
    for share in [0.02, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8] {
        folder.outputs().iter().for_each(|file| std::fs::remove_file(folder.path("out").join(file)).unwrap());
        let child = start();
        std::thread::sleep(whole.mul_f64(share));
        assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        match output.status.code() {
            Some(0) => assert_eq!(folder.outputs().len(), 1, "at {share}"),
            Some(1) => {
                assert!(stderr.contains("interrupted") && folder.outputs().is_empty(), "at {share}: {stderr}");
                interrupted += 1;
            }
            // Before the program listens, the signal ends it as it ends any other.
            None => assert!(folder.outputs().is_empty(), "at {share}: {stderr}"),
            code => panic!("at {share}: exit code {code:?}, {stderr}"),
        }
    }
    assert!(interrupted > 2, "only {interrupted} of 7 interrupts came in time");
}

/// What people look for as options is the scene's own key.
#[test]
fn kernel_neighbors_and_seeding_are_options() {
    let options = ["--kernel", "quintic", "--neighbors", "80", "--seeding", "glass"];
    let scene = succeed(&[&["--in", "star.nc", "--print-scene"], &options[..]].concat()).stdout;
    for line in ["kernel: quintic", "neighbors: 80", "seeding: glass"] {
        assert!(scene.lines().any(|l| l.starts_with(line)), "{line}: {scene}");
    }
    let wrong = sph_prep(&["--in", "star.nc", "--kernel", "wendland-c3"]);
    assert_eq!(wrong.code, Some(2));
    assert!(wrong.stderr.contains("did you mean") && wrong.stderr.contains("quintic"), "{}", wrong.stderr);
}

/// Every option stands in the manual page and in the completions of each shell.
#[test]
fn shells_and_the_manual_know_every_option() {
    let help = succeed(&["--help"]).stdout;
    let manual = succeed(&["man"]).stdout.replace('\\', "");
    assert!(manual.contains(".TH sph-prep"));
    let scripts = ["bash", "zsh", "fish"].map(|shell| (shell, succeed(&["completions", shell]).stdout));
    let named = |w: &&str| w.len() > 1 && w.chars().all(|c| c.is_ascii_lowercase() || c == '-');
    let options = |help: &str| -> Vec<String> {
        let words = help.split_whitespace().filter_map(|w| w.strip_prefix("--")).filter(named);
        words.map(str::to_owned).collect()
    };
    let of_all = options(&help);
    assert!(of_all.len() > 20, "{of_all:?}");
    for option in &of_all {
        assert!(manual.contains(&format!("--{option}")), "the manual lacks --{option}");
        for (shell, script) in &scripts {
            assert!(script.contains(option), "{shell} lacks --{option}");
        }
    }
    // Commands have pages of their own, by the names under which the manual lists them.
    let commands: Vec<&str> = manual.lines().filter_map(|l| l.strip_prefix("sph-prep-")?.strip_suffix("(1)")).collect();
    assert!(commands.len() > 12, "{commands:?}");
    for command in commands {
        let page = succeed(&["man", command]).stdout.replace('\\', "");
        assert!(page.contains(&format!(".TH sph-prep-{command} 1")), "{page:.300}");
        for option in options(&succeed(&["help", command]).stdout) {
            assert!(page.contains(&format!("--{option}")), "the manual of {command} lacks --{option}");
        }
    }
    let wrong = sph_prep(&["man", "inspct"]);
    assert!(wrong.code == Some(2) && wrong.stderr.contains("did you mean 'inspect'"), "{}", wrong.stderr);
}

#[test]
fn the_version_comes_with_commit_and_features() {
    let long = super::support::succeed(&["--version"]).stdout;
    let lines: Vec<&str> = long.lines().collect();
    assert_eq!(lines[0], concat!("sph-prep ", env!("CARGO_PKG_VERSION")));
    assert!(lines[1].starts_with("built from "), "{long}");
    let features: Vec<&str> = lines[2].strip_prefix("features: ").unwrap().split(' ').collect();
    assert!(["cli", "plots", "gadget-binary", "netcdf"].iter().all(|f| features.contains(f)), "{long}");
    assert!(!features.contains(&"default"), "{long}");
    assert_eq!(super::support::succeed(&["-V"]).stdout.trim(), lines[0]);
}
