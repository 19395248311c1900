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
    assert_eq!(faults(&outcome, &folder, 2, &["which it would replace"]), Vec::<String>::new(), "{outcome:?}");
    assert_eq!(std::fs::read(&input).unwrap(), before);
    let told = |words: &str| {
        let outcome = sph_prep(&["convert", &same, &new]);
        assert_eq!(outcome.code, Some(0), "{outcome:?}");
        format!("{}{}", outcome.stdout, outcome.stderr).contains(words)
    };
    assert!(!told("was replaced") && told("new.vtu' was replaced"));
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
