//! Places where nothing can be read or written.

use super::support::{Folder, faults, refusal_faults, sph_prep};
use std::path::Path;

const GOOD: &str = "# r density\n0 2\n0.5 1.5\n1 1\n";

/// Runs with a good input to this output, and returns what is wrong with the refusal.
fn faults_of_output(folder: &Folder, output: &Path, words: &[&str]) -> Vec<String> {
    let input = folder.file("good.txt", GOOD);
    let (input, out) = (input.display().to_string(), output.display().to_string());
    let outcome = sph_prep(&["--in", &input, "--out", &out, "-n", "100", "--iterations", "1"]);
    let mut all = faults(&outcome, folder, 1, words);
    if !all.is_empty() {
        all.push(outcome.stderr);
    }
    all
}

#[test]
fn outputs_that_cannot_be_are_refused() {
    let folder = Folder::new();
    let none = Vec::<String>::new();
    let absent = folder.path("absent");
    let name = absent.display().to_string();
    assert_eq!(faults_of_output(&folder, &absent.join("ic.hdf5"), &[&name]), none);
    // A file where a folder is expected, and a folder where a file is expected.
    let file = folder.file("file", "");
    let name = file.display().to_string();
    assert_eq!(faults_of_output(&folder, &file.join("ic.hdf5"), &[&name]), none);
    let taken = folder.path("taken.hdf5");
    std::fs::create_dir(&taken).unwrap();
    assert_eq!(faults_of_output(&folder, &taken, &["taken.hdf5", "directory"]), none);
    assert_eq!(std::fs::read_dir(&taken).unwrap().count(), 0);
    assert_eq!(faults_of_output(&folder, &folder.path("out/ic.xyz"), &["ic.xyz", "--to"]), none);
    assert_eq!(faults_of_output(&folder, &folder.path("out/ic"), &["out/ic", "--to"]), none);
}

#[cfg(target_os = "linux")]
#[test]
fn devices_are_not_replaced() {
    use std::os::unix::fs::FileTypeExt;
    let folder = Folder::new();
    let link = folder.path("out/full.hdf5");
    std::os::unix::fs::symlink("/dev/full", &link).unwrap();
    let input = folder.file("good.txt", GOOD);
    let (input, out) = (input.display().to_string(), link.display().to_string());
    let outcome = sph_prep(&["--in", &input, "--out", &out, "-n", "100", "--iterations", "1"]);
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    assert!(outcome.stderr.contains(&out) && !outcome.stderr.contains("panicked"), "{outcome:?}");
    assert_eq!(folder.outputs(), ["full.hdf5"]);
    assert!(std::fs::metadata("/dev/full").unwrap().file_type().is_char_device());
}

#[test]
fn the_input_is_never_overwritten() {
    let folder = Folder::new();
    let input = folder.file("star.vtu", GOOD);
    let same = input.display().to_string();
    let roundabout = folder.path("out/../star.vtu").display().to_string();
    let link = folder.path("link.vtu");
    #[cfg(unix)]
    std::os::unix::fs::symlink(&input, &link).unwrap();
    let mut outputs = vec![same.clone(), roundabout];
    if link.exists() {
        outputs.push(link.display().to_string());
    }
    for out in outputs {
        let outcome = sph_prep(&["--in", &same, "--format", "table", "--out", &out, "-n", "100", "--iterations", "1"]);
        assert_eq!(faults(&outcome, &folder, 2, &["output.file", "input"]), Vec::<String>::new(), "{outcome:?}");
        assert_eq!(std::fs::read_to_string(&input).unwrap(), GOOD);
    }
}

#[test]
fn convert_does_not_replace_what_it_converts() {
    let folder = Folder::new();
    let (star, input, other) = (folder.file("good.txt", GOOD), folder.path("ic.vtu"), folder.path("out/new.vtu"));
    let (same, new) = (input.display().to_string(), other.display().to_string());
    let made = sph_prep(&["--in", &star.display().to_string(), "--out", &same, "-n", "100", "--iterations", "1"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let before = std::fs::read(&input).unwrap();
    let outcome = sph_prep(&["convert", &same, &same]);
    assert_eq!(faults(&outcome, &folder, 2, &["which would be overwritten"]), Vec::<String>::new(), "{outcome:?}");
    assert_eq!(std::fs::read(&input).unwrap(), before);
    let told = |words: &str| {
        let outcome = sph_prep(&["convert", &same, &new]);
        assert_eq!(outcome.code, Some(0), "{outcome:?}");
        format!("{}{}", outcome.stdout, outcome.stderr).contains(words)
    };
    assert!(!told("was replaced") && told("new.vtu' was replaced"));
}

/// A small scene, in the folder.
const BOX: &str =
    "input: {expression: '1'}\ndomain: {box: [[0, 0], [1, 1]], boundary: periodic}\nparticles: 50\npolish: none\n";

#[test]
fn the_scene_is_never_overwritten() {
    let folder = Folder::new();
    let (scene, table) = (folder.file("box.yaml", BOX), folder.file("asc.txt", GOOD));
    let bodies = format!("bodies: [{{input: {{file: {}}}, particles: 100}}]\n", table.display());
    let bodies = folder.file("bodies.yaml", bodies);
    let [own, table, bodies] = [&scene, &table, &bodies].map(|path| path.display().to_string());
    let out = folder.path("ic.hdf5").display().to_string();
    let tile = folder.path("tile.hdf5").display().to_string();
    assert_eq!(sph_prep(&["--scene", &own, "--out", &tile]).code, Some(0));
    for (arguments, key) in [
        (vec!["--scene", &own, "--out", &own, "--to", "swift"], "output.file"),
        (vec!["--scene", &own, "--out", &out, "--report", &own], "output.report"),
        (vec!["--scene", &own, "--out", &out, "--checkpoint", &own], "checkpoint.file"),
        (vec!["--scene", &bodies, "--out", &out, "--report", &table], "output.report"),
        (vec!["--scene", &bodies, "--out", &out, "--report", &bodies], "output.report"),
        (vec!["seed", "--scene", &own, "--out", &own, "--to", "swift"], "--out"),
        (vec!["replicate", &tile, "--times", "1,1", "--scene", &own, "--out", &own, "--to", "swift"], "--out"),
    ] {
        let outcome = sph_prep(&arguments);
        assert_eq!(
            faults(&outcome, &folder, 2, &[key, "which would be overwritten"]),
            Vec::<String>::new(),
            "{outcome:?}"
        );
    }
    assert_eq!(std::fs::read_to_string(&scene).unwrap(), BOX);
}

#[test]
fn a_checkpoint_replaces_nothing_else() {
    let folder = Folder::new();
    let (scene, notes) = (folder.file("box.yaml", BOX), folder.file("notes.txt", "hello"));
    let [own, kept] = [&scene, &notes].map(|path| path.display().to_string());
    let out = folder.path("ic.hdf5").display().to_string();
    let outcome = sph_prep(&["--scene", &own, "--out", &out, "--checkpoint", &kept]);
    assert_eq!(
        faults(&outcome, &folder, 2, &["checkpoint.file", "no checkpoint"]),
        Vec::<String>::new(),
        "{outcome:?}"
    );
    assert_eq!(std::fs::read_to_string(&notes).unwrap(), "hello");
}

/// Some gigabytes, of which an interrupt leaves nothing.
#[cfg(unix)]
#[test]
fn seeds_that_are_interrupted_leave_no_file() {
    let folder = Folder::new();
    let scene = folder.file("box.yaml", BOX).display().to_string();
    let out = folder.path("out/seeds.hdf5").display().to_string();
    let mut seeds = std::process::Command::new(env!("CARGO_BIN_EXE_sph-prep"));
    seeds.args(["seed", "--scene", &scene, "-n", "1e8", "--out", &out]).stderr(std::process::Stdio::piped());
    let mut seeds = seeds.spawn().unwrap();
    while folder.outputs().is_empty() && seeds.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    std::process::Command::new("kill").args(["-INT", &seeds.id().to_string()]).status().unwrap();
    let ended = seeds.wait_with_output().unwrap();
    assert!(String::from_utf8_lossy(&ended.stderr).contains("interrupted"), "{ended:?}");
    assert_eq!(folder.outputs(), Vec::<String>::new());
}

/// More than any disk has, before the first of them.
#[cfg(unix)]
#[test]
fn seeds_without_room_are_refused_before_the_work() {
    let folder = Folder::new();
    let scene = folder.file("box.yaml", BOX).display().to_string();
    let out = folder.path("out/seeds.hdf5").display().to_string();
    let outcome = sph_prep(&["seed", "--scene", &scene, "-n", "1e15", "--out", &out]);
    assert_eq!(faults(&outcome, &folder, 1, &["are free", &out]), Vec::<String>::new(), "{outcome:?}");
}

#[test]
fn what_a_format_cannot_hold_is_refused_before_the_work() {
    let folder = Folder::new();
    let text = "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic, open, open]}\nparticles: 100\n";
    let scene = folder.file("box.yaml", text).display().to_string();
    let own = |name: &str, more: &[&str]| {
        let out = folder.path(name).display().to_string();
        let known = ["--scene", scene.as_str(), "--out", &out, "--dry-run"];
        sph_prep(&[&known, more].concat())
    };
    let outcome = own("p.phantom", &[]);
    assert_eq!(faults(&outcome, &folder, 2, &["domain.boundary", "all or none"]), Vec::<String>::new(), "{outcome:?}");
    for name in ["Coordinates: [1, 2, 3]", "SmoothingLength: 1", "TargetDensity: 3", "Masses: 2"] {
        let made = folder.file("made.yaml", format!("{text}fields: {{{name}}}\n")).display().to_string();
        let out = folder.path("out/ic.hdf5").display().to_string();
        let outcome = sph_prep(&["--scene", &made, "--out", &out]);
        assert_eq!(faults(&outcome, &folder, 2, &["placement itself"]), Vec::<String>::new(), "{name}: {outcome:?}");
    }
}

#[test]
fn inputs_that_are_no_readable_files_are_refused() {
    let folder = Folder::new();
    let mut faults = vec![
        refusal_faults(&folder, &folder.path("absent.nc"), &[], &["No such file"]),
        refusal_faults(&folder, &folder.path("out"), &[], &["directory"]),
        refusal_faults(&folder, &folder.file("x.txt", GOOD), &["--format", "fits"], &["'fits'", "table"]),
    ];
    let secret = folder.file("secret.txt", GOOD);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(&secret, std::fs::Permissions::from_mode(0o000)).unwrap();
    }
    if std::fs::read(&secret).is_ok() {
        println!("skipped: an unreadable file; permissions do not bind this user");
    } else {
        faults.push(refusal_faults(&folder, &secret, &[], &["denied"]));
    }
    let faults: Vec<String> = faults.into_iter().flatten().collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
