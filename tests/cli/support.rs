//! Folders, runs of the binary, and what every refusal has in common.

use assert_cmd::Command;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

/// Far above what any of these runs takes.
const TIMEOUT: Duration = Duration::from_secs(120);

/// What a run left behind.
#[derive(Debug)]
pub struct Outcome {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

/// A folder with an empty folder `out` in it.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("out")).unwrap();
        Self(folder)
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, content).unwrap();
        path
    }

    /// Names of what is in the folder `out`, hidden files too.
    pub fn outputs(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.path("out")).unwrap();
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect()
    }
}

/// The binary; its output is no terminal.
pub fn command() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sph-prep"));
    command.timeout(TIMEOUT);
    command
}

/// Runs the binary.
pub fn sph_prep<S: AsRef<std::ffi::OsStr>>(args: &[S]) -> Outcome {
    let output = command().args(args).output().unwrap();
    Outcome {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// Runs the binary and expects success.
pub fn succeed<S: AsRef<std::ffi::OsStr>>(args: &[S]) -> Outcome {
    let outcome = sph_prep(args);
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    outcome
}

/// What is wrong with a refusal: it should end with `code`, say why in one line that holds all of `words`, and
/// leave nothing in the folder `out`.
pub fn faults(outcome: &Outcome, folder: &Folder, code: i32, words: &[&str]) -> Vec<String> {
    let mut faults = Vec::new();
    let mut check = |holds: bool, fault: String| {
        if !holds {
            faults.push(fault);
        }
    };
    check(outcome.code == Some(code), format!("exit code {:?}, expected {code}", outcome.code));
    check(outcome.stdout.is_empty(), format!("printed {:.60?}", outcome.stdout));
    check(outcome.stderr.starts_with("error: "), "does not say `error:`".into());
    check(!outcome.stderr.contains("panicked"), "panicked".into());
    for word in words {
        check(outcome.stderr.contains(word), format!("does not say {word:?}"));
    }
    let left = folder.outputs();
    check(left.is_empty(), format!("left {left:?}"));
    faults
}

/// Runs `input` with `arguments` added and collects what is wrong with the refusal, which also has to name the file.
pub fn refusal_faults(folder: &Folder, input: &Path, arguments: &[&str], words: &[&str]) -> Option<String> {
    let (file, out) = (input.display().to_string(), folder.path("out/ic.hdf5").display().to_string());
    let mut args = vec!["--in", &file, "--out", &out, "-n", "200", "--iterations", "2"];
    args.extend(arguments);
    let outcome = sph_prep(&args);
    let mut words = words.to_vec();
    words.push(&file);
    let faults = faults(&outcome, folder, 1, &words);
    // One leftover is not to be blamed on the cases that follow.
    folder.outputs().iter().for_each(|name| std::fs::remove_file(folder.path("out").join(name)).unwrap());
    (!faults.is_empty()).then(|| format!("{args:?}: {}\n  {}", faults.join("; "), outcome.stderr.trim_end()))
}

/// A file to be refused.
pub struct Bad<'a> {
    pub name: &'a str,
    pub content: Vec<u8>,
    pub arguments: &'a [&'a str],
    /// What the error has to say besides the file's name.
    pub words: &'a [&'a str],
}

pub fn bad<'a>(name: &'a str, content: impl Into<Vec<u8>>, arguments: &'a [&'a str], words: &'a [&'a str]) -> Bad<'a> {
    Bad { name, content: content.into(), arguments, words }
}

/// Refuses all, and says of each what was wrong with it.
pub fn refuse_all(cases: &[Bad<'_>]) {
    let folder = Folder::new();
    let faults = cases.iter().filter_map(|case| {
        let input = folder.file(case.name, &case.content);
        refusal_faults(&folder, &input, case.arguments, case.words)
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "{} of {} files:\n{}", faults.len(), cases.len(), faults.join("\n"));
}
