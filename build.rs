//! What `--version` says beside the version: the commit and the features.
//!
//! The commit is `SPH_PREP_COMMIT` where that is set, else what the package of a registry says of itself, else that of the
//! checkout, read without git. Builds for development have none, so that a commit does not build all anew.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rerun-if-env-changed=SPH_PREP_COMMIT");
    println!("cargo::rerun-if-changed=build.rs");
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let is_release = env::var("PROFILE").is_ok_and(|p| p == "release");
    let commit = env::var("SPH_PREP_COMMIT").ok().filter(|c| !c.is_empty()).or_else(|| of_package(&root));
    let commit = commit.or_else(|| is_release.then(|| of_checkout(&root)).flatten());
    let short: String = commit.unwrap_or_default().chars().filter(char::is_ascii_alphanumeric).take(12).collect();
    println!("cargo::rustc-env=SPH_PREP_BUILT_FROM={}", if short.is_empty() { "unknown commit" } else { &short });
    println!("cargo::rustc-env=SPH_PREP_FEATURES={}", features().join(" "));
}

/// Cargo notes the commit in what it packs.
fn of_package(root: &Path) -> Option<String> {
    let text = fs::read_to_string(root.join(".cargo_vcs_info.json")).ok()?;
    let after = text.split_once("\"sha1\"")?.1;
    after.split('"').nth(1).map(str::to_owned)
}

fn of_checkout(root: &Path) -> Option<String> {
    let mut folder = root.join(".git");
    if folder.is_file() {
        // A work tree beside the repository: a file that says where its folder is.
        folder = root.join(fs::read_to_string(&folder).ok()?.strip_prefix("gitdir:")?.trim());
    }
    let head = folder.join("HEAD");
    println!("cargo::rerun-if-changed={}", head.display());
    let text = fs::read_to_string(&head).ok()?;
    let Some(name) = text.strip_prefix("ref:").map(str::trim) else { return Some(text.trim().to_owned()) };
    // References are in the folder of the repository, which a work tree names.
    let common = fs::read_to_string(folder.join("commondir")).map(|c| folder.join(c.trim())).unwrap_or(folder);
    let loose = common.join(name);
    let packed = common.join("packed-refs");
    for path in [&loose, &packed].into_iter().filter(|p| p.is_file()) {
        println!("cargo::rerun-if-changed={}", path.display());
    }
    if let Ok(commit) = fs::read_to_string(loose) {
        return Some(commit.trim().to_owned());
    }
    let packed = fs::read_to_string(packed).ok()?;
    packed.lines().find_map(|l| l.strip_suffix(name)?.strip_suffix(' ').map(str::to_owned))
}

/// Names of features, which have no underscores.
fn features() -> Vec<String> {
    let names = env::vars().filter_map(|(key, _)| Some(key.strip_prefix("CARGO_FEATURE_")?.to_lowercase()));
    let mut names: Vec<String> = names.map(|n| n.replace('_', "-")).filter(|n| n != "default").collect();
    names.sort();
    names
}
