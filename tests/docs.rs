//! The documentation in `docs/`: its reference pages are what the code says, its links lead somewhere, its commands run.
//!
//! ```sh
//! SPH_PREP_DOCS=1 cargo test --test all docs::   # writes the reference pages again
//! ```

use sph_prep::scene::reference::{Key, keys};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/src")
}

fn printed(arguments: &[&str]) -> String {
    let output = assert_cmd::Command::new(env!("CARGO_BIN_EXE_sph-prep"))
        .env("COLUMNS", "100")
        .args(arguments)
        .output()
        .unwrap();
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    // Spaces at the ends of lines have no place on a page.
    String::from_utf8(output.stdout).unwrap().lines().map(|l| l.trim_end().to_owned() + "\n").collect()
}

fn block(text: &str) -> String {
    format!("```text\n{}\n```\n", text.trim_end())
}

/// A page that is written by this test.
fn page(title: &str, body: &str) -> String {
    format!("# {title}\n\n<!-- Written by `SPH_PREP_DOCS=1 cargo test --test all docs::`. -->\n\n{body}")
}

fn entry(out: &mut String, key: &Key, depth: usize) {
    let cell = |text: &str| text.replace('|', "\\|").replace('<', "&lt;");
    let _ = writeln!(out, "{} `{}`\n", "#".repeat((depth + 2).min(5)), key.path);
    let _ = writeln!(out, "{}\n", cell(&key.description));
    let _ = writeln!(out, "- is: {}", cell(&key.kind));
    if let Some(unit) = &key.unit {
        let _ = writeln!(out, "- measures: {unit}");
    }
    if key.keys.is_empty() {
        let default = key.default.as_ref().map_or_else(|| "unset".to_owned(), ToString::to_string);
        let _ = writeln!(
            out,
            "- default: {}",
            if key.is_required { "none, it has to be stated".into() } else { format!("`{default}`") }
        );
    }
    if let Some(example) = &key.example {
        let _ = writeln!(out, "- example: `{}: {example}`", key.name());
    }
    for (word, text) in &key.choices {
        let _ =
            writeln!(out, "- `{word}`{}", if text.is_empty() { String::new() } else { format!(": {}", cell(text)) });
    }
    out.push('\n');
    key.keys.iter().for_each(|k| entry(out, k, depth + 1));
}

/// Commands in the order of the help.
fn commands(help: &str) -> Vec<String> {
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let is_name = |l: &&str| l.starts_with("  ") && !l.starts_with("   ");
    list.lines().filter(is_name).filter_map(|l| l.split_whitespace().next()).map(str::to_owned).collect()
}

/// The reference pages and what they should hold.
fn reference() -> Vec<(&'static str, String)> {
    let mut scene = String::from("`sph-prep help scene.KEY` says the same in a terminal.\n\n");
    keys().iter().for_each(|key| entry(&mut scene, key, 0));
    let help = printed(&["help"]);
    let mut line = block(&help);
    for name in commands(&help) {
        let _ = write!(line, "\n## sph-prep {name}\n\n{}", block(&printed(&["help", &name])));
    }
    vec![
        ("scene.md", page("Keys of a scene", &scene)),
        ("command-line.md", page("Command line and exit codes", &line)),
        ("formats.md", page("Formats", &block(&printed(&["formats"])))),
        ("methods.md", page("Seeding and methods", &block(&printed(&["methods"])))),
    ]
}

#[test]
fn reference_pages_are_what_the_code_says() {
    for (name, expected) in reference() {
        let path = folder().join("reference").join(name);
        if std::env::var_os("SPH_PREP_DOCS").is_some() {
            std::fs::write(&path, &expected).unwrap();
        }
        let found = std::fs::read_to_string(&path).unwrap();
        assert!(found == expected, "docs/src/reference/{name} is stale: SPH_PREP_DOCS=1 cargo test --test all docs::");
    }
    let line = std::fs::read_to_string(folder().join("reference/command-line.md")).unwrap();
    for code in ["0 success", "1 failure", "2 wrong usage", "3 not converged"] {
        assert!(line.contains(code), "{code}");
    }
    assert!(line.contains("## sph-prep compare") && line.contains("## sph-prep plot"));
}

/// Pages with their texts.
fn pages() -> Vec<(PathBuf, String)> {
    let (mut found, mut open) = (Vec::new(), vec![folder()]);
    while let Some(below) = open.pop() {
        for path in std::fs::read_dir(below).unwrap().map(|e| e.unwrap().path()) {
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                found.push((path.clone(), std::fs::read_to_string(path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn no_link_is_dead_and_every_page_is_two_clicks_away() {
    let summary = std::fs::read_to_string(folder().join("SUMMARY.md")).unwrap();
    for (path, text) in pages() {
        let name = path.strip_prefix(folder()).unwrap().display().to_string();
        assert!(name == "SUMMARY.md" || summary.contains(&format!("({name})")), "{name} is not in the summary");
        for link in links(&text) {
            let (file, place) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            assert!(link.contains("://") || target.is_file(), "{name}: {link}");
            // What lies outside of the book is not in what is built of it.
            let is_within = !link.contains("://") && target.canonicalize().unwrap().starts_with(folder());
            assert!(is_within || link.contains("://"), "{name}: {link} leaves the book");
            if !place.is_empty() && !link.contains("://") {
                let headings = std::fs::read_to_string(&target).unwrap();
                let mut headings = headings.lines().filter(|l| l.starts_with('#')).map(anchor);
                assert!(headings.any(|a| a == place), "{name}: {link} has no such heading");
            }
        }
    }
    // The front page knows the pages with lists, and these all that is to be done.
    let reached = |page: &str| -> BTreeSet<PathBuf> {
        let path = folder().join(page);
        let text = std::fs::read_to_string(&path).unwrap();
        let targets = links(&text).into_iter().filter(|l| !l.contains("://") && !l.starts_with('#'));
        targets.map(|l| path.parent().unwrap().join(l.split('#').next().unwrap())).collect()
    };
    let first = reached("index.md");
    let second: BTreeSet<PathBuf> = first
        .iter()
        .filter(|p| p.extension().is_some_and(|e| e == "md"))
        .flat_map(|p| reached(p.strip_prefix(folder()).unwrap().to_str().unwrap()))
        .collect();
    let far: Vec<String> = pages()
        .into_iter()
        .map(|(path, _)| path)
        .filter(|path| !path.ends_with("SUMMARY.md") && !path.ends_with("index.md"))
        .filter(|path| !first.contains(path) && !second.contains(path))
        .map(|path| path.display().to_string())
        .collect();
    assert!(far.is_empty(), "more than two clicks from the first page: {far:?}");
}

/// Targets of the links of a page, outside of code.
fn links(text: &str) -> Vec<&str> {
    let blocks = text.split("```").step_by(2);
    blocks.flat_map(|b| b.split("](").skip(1)).map(|rest| rest.split(')').next().unwrap()).collect()
}

/// The name by which a heading is linked to.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = text.chars().filter(|c| c.is_alphanumeric() || "-_ ".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// The words of a command as a shell sees them: quotes hold together, ` #` begins a comment.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), String::new(), false);
    for c in line.split(" #").next().unwrap().chars() {
        match c {
            '\'' => quote = !quote,
            ' ' if !quote => words.extend((!word.is_empty()).then(|| std::mem::take(&mut word))),
            _ => word.push(c),
        }
    }
    words.extend((!word.is_empty()).then_some(word));
    words
}

/// Every command in a block of shell, with few particles, in the order of the page. Pages of results name the commands that write them,
/// which are cargo's.
#[test]
fn commands_in_the_pages_run() {
    let mut ran = 0;
    for (path, text) in pages() {
        let blocks: Vec<&str> = text.split("```sh\n").skip(1).map(|b| b.split("```").next().unwrap()).collect();
        if blocks.is_empty() || path.starts_with(folder().join("results")) {
            continue;
        }
        let folder = tempfile::tempdir().unwrap();
        let profiles = folder.path().join("profiles");
        std::fs::create_dir(&profiles).unwrap();
        for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles")).unwrap() {
            let entry = entry.unwrap().path();
            if entry.is_file() {
                std::fs::copy(&entry, profiles.join(entry.file_name().unwrap())).unwrap();
            }
        }
        for line in blocks.iter().flat_map(|b| b.lines()).filter(|l| !l.is_empty()) {
            let words = words(line.strip_prefix("sph-prep ").unwrap_or_else(|| panic!("{line}")));
            let is_count = |i: usize| i > 0 && words[i - 1] == "-n";
            let fewer = |(i, word): (usize, &String)| if is_count(i) { few(word) } else { word.clone() };
            let words: Vec<String> = words.iter().enumerate().map(fewer).collect();
            let output = assert_cmd::Command::new(env!("CARGO_BIN_EXE_sph-prep"))
                .current_dir(folder.path())
                .args(&words)
                .output()
                .unwrap();
            // A misplaced region of so few particles is told by its own code.
            let is_fine = matches!(output.status.code(), Some(0 | 3));
            assert!(is_fine, "{}: {line}\n{}", path.display(), String::from_utf8_lossy(&output.stderr));
            ran += 1;
        }
    }
    assert!(ran > 70, "only {ran} commands");
}

/// Some hundred particles in place of thousands; several numbers stay apart.
fn few(counts: &str) -> String {
    let numbers = counts.split(',').enumerate().map(|(i, _)| (400 + 200 * i).to_string());
    numbers.collect::<Vec<_>>().join(",")
}
