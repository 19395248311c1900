//! The documentation in `docs/`: its reference pages are what the code says, its links lead somewhere, its commands run.
//!
//! ```sh
//! SPH_PREP_DOCS=1 cargo test --test all docs::   # writes the reference pages again
//! ```

use sph_formats::{Unit, UnitDimension};
use sph_prep::scene::Role;
use sph_prep::scene::reference::{Key, keys};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
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
    if !key.aliases.is_empty() {
        let _ =
            writeln!(out, "- also: {}", key.aliases.iter().map(|a| format!("`{a}`")).collect::<Vec<_>>().join(", "));
    }
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

/// What units measure, in words, in the order of the page.
const MEASURES: [(&str, UnitDimension); 11] = [
    ("length", UnitDimension::LENGTH),
    ("mass", UnitDimension::MASS),
    ("time", UnitDimension::TIME),
    ("temperature", UnitDimension::TEMPERATURE),
    ("velocity", UnitDimension::VELOCITY),
    ("rate", UnitDimension::RATE),
    ("density", UnitDimension::mass_density(3)),
    ("energy per mass", UnitDimension::SPECIFIC_ENERGY),
    ("energy", UnitDimension::new(2, 1, -2, 0)),
    ("pressure", UnitDimension::PRESSURE),
    ("magnetic field", UnitDimension::MAGNETIC_FIELD),
];

/// Units with what they are in cgs, roles of variables with what these measure, and the names that communities have for them.
fn names() -> String {
    let mut out = String::from(
        "Numbers of a scene and variables of a file may have these units, SI prefixes before them (`mG`, `kyr`), powers and products (`g/cm^3`, \
         `km s-1`, `1e-3 kg m-3`).\n\n| measures | units | in cgs |\n|---|---|---|\n",
    );
    for (what, dimension) in MEASURES {
        let units = Unit::known(dimension);
        assert!(!units.is_empty(), "{what}");
        let number = |v: f64| if (1e-3..1e5).contains(&v) { format!("{v}") } else { format!("{v:.6e}") };
        let in_cgs = units.iter().map(|u| number(Unit::parse(u).unwrap().to_cgs)).collect::<Vec<_>>().join(", ");
        let _ = writeln!(
            out,
            "| {what} | {} | {in_cgs} |",
            units.iter().map(|u| format!("`{u}`")).collect::<Vec<_>>().join(", ")
        );
    }
    out += "\n## Roles of variables\n\n`--map NAME=ROLE`, and `map` in a scene, take these; `sph-prep inspect FILE` says what each variable of a file is taken for.\n\n\
            | role | measures |\n|---|---|\n";
    let schema = sph_prep::Scene::schema();
    for role in schema["$defs"]["Role"]["enum"].as_array().unwrap().iter().map(|r| r.as_str().unwrap()) {
        let dimension = Role::parse(role).unwrap().dimension();
        let measured = MEASURES.iter().find(|m| Some(m.1) == dimension).map_or("", |m| m.0);
        assert!(dimension.is_none() || !measured.is_empty(), "{role}");
        let _ = writeln!(out, "| `{role}` | {measured} |");
    }
    out += "\n## Names that are known\n\nUpper and lower case, underscores, brackets and dots make no difference.\n\n";
    // The table at the head of the list of names.
    let source = include_str!("../src/input/roles/spelling.rs");
    source.lines().filter_map(|l| l.strip_prefix("//! |")).for_each(|row| out += &format!("|{row}\n"));
    out
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
        ("names.md", page("Units, and what variables are", &names())),
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
    let codes =
        include_str!("../src/cli/exit.rs").lines().filter_map(|l| l.strip_prefix("pub const ")?.split_once(": u8 = "));
    let codes: Vec<String> =
        codes.map(|(name, number)| format!("{} {}", number.trim_end_matches(';'), in_words(name))).collect();
    assert_eq!(codes.len(), 4);
    let everyday = std::fs::read_to_string(folder().join("everyday.md")).unwrap().replace('\n', " ");
    for code in &codes {
        assert!(line.contains(code) && everyday.contains(code), "the code '{code}' has no entry");
    }
    // What an option or argument does stands below it.
    let lines: Vec<&str> = line.lines().collect();
    let is_option =
        |l: &str| l.starts_with("  ") && l.trim_start().starts_with(['-', '<', '[']) && !l.starts_with("          ");
    let bare: Vec<&str> = lines
        .windows(2)
        .filter(|pair| is_option(pair[0]) && !pair[1].trim_start().starts_with(char::is_alphanumeric))
        .map(|pair| pair[0])
        .collect();
    assert!(bare.is_empty() && lines.iter().filter(|l| is_option(l)).count() > 120, "{bare:?}");
    assert!(line.contains("## sph-prep compare") && line.contains("## sph-prep plot"));
}

/// What a constant of the exit codes is called.
fn in_words(name: &str) -> &'static str {
    match name {
        "SUCCESS" => "success",
        "FAILURE" => "failure",
        "USAGE" => "wrong usage",
        "NOT_CONVERGED" => "not converged",
        other => panic!("{other} is a new exit code: it needs words, and entries in the manual"),
    }
}

/// Pages with their texts.
pub fn pages() -> Vec<(PathBuf, String)> {
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
        for link in links(&text).into_iter().filter(|l| !l.contains("://")) {
            // What lies outside of the book is not in what is built of it.
            assert!(
                target(&path, link).canonicalize().unwrap().starts_with(folder()),
                "{name}: {link} leaves the book"
            );
        }
    }
    // The front page knows the pages with lists, and these all that is to be done.
    let clicks = clicks();
    let is_far = |path: &PathBuf| clicks.get(path).is_none_or(|n| *n > 2);
    let far: Vec<String> = pages()
        .into_iter()
        .map(|(path, _)| path)
        .filter(|path| !path.ends_with("SUMMARY.md") && is_far(path))
        .map(|path| path.display().to_string())
        .collect();
    assert!(far.is_empty(), "more than two clicks from the first page: {far:?}");
}

/// Where a link of a page leads: to a file that is there and, behind `#`, to a heading of it.
fn target(path: &Path, link: &str) -> PathBuf {
    let (file, place) = link.split_once('#').unwrap_or((link, ""));
    let target = if file.is_empty() { path.to_owned() } else { path.parent().unwrap().join(file) };
    assert!(target.is_file(), "{}: {link}", path.display());
    if !place.is_empty() {
        let headings = std::fs::read_to_string(&target).unwrap();
        let mut headings = headings.lines().filter(|l| l.starts_with('#')).map(anchor);
        assert!(headings.any(|a| a == place), "{}: {link} has no such heading", path.display());
    }
    target
}

#[test]
fn no_link_outside_of_the_manual_is_dead() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut followed = 0;
    for name in [
        "README.md",
        "CONTRIBUTING.md",
        "RELEASING.md",
        "CHANGELOG.md",
        "formats/README.md",
        "profiles/README.md",
        "python/README.md",
        "sph/README.md",
        "paper/paper.md",
    ] {
        let path = root.join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        for link in links(&text).into_iter().filter(|l| !l.contains("://")) {
            target(&path, link);
            followed += 1;
        }
    }
    assert!(followed > 15, "{followed}");
}

/// What a page of the manual leads to.
fn reached(path: &Path) -> BTreeSet<PathBuf> {
    let text = std::fs::read_to_string(path).unwrap();
    let targets = links(&text).into_iter().filter(|l| !l.contains("://") && !l.starts_with('#'));
    targets.map(|l| path.parent().unwrap().join(l.split('#').next().unwrap()).canonicalize().unwrap()).collect()
}

/// Clicks from the first page, of all that is reached.
fn clicks() -> BTreeMap<PathBuf, usize> {
    let first = folder().canonicalize().unwrap().join("index.md");
    let mut known = BTreeMap::from([(first.clone(), 0)]);
    let mut open = VecDeque::from([first]);
    while let Some(page) = open.pop_front() {
        let next = known[&page] + 1;
        for target in reached(&page).into_iter().filter(|p| p.extension().is_some_and(|e| e == "md")) {
            if !known.contains_key(&target) {
                known.insert(target.clone(), next);
                open.push_back(target);
            }
        }
    }
    known
}

/// What people come with, in their words; the page that answers, and the scene that does it.
const TASKS: [(&str, &str, &str); 24] = [
    ("a star", "star.md", "star-1.5"),
    ("a binary", "tasks/binary.md", "binary"),
    ("impact of planets", "tasks/impact.md", "impact"),
    ("a collision of stars", "tasks/impact.md", "collision"),
    ("a planet with core and mantle", "tasks/impact.md", "planet"),
    ("a giant with its core", "tasks/profiles.md", "common-envelope"),
    ("a white dwarf", "tasks/profiles.md", "white-dwarf"),
    ("a disc", "tasks/disc.md", "protoplanetary-disc"),
    ("gas of a galaxy", "tasks/galaxy.md", "galaxy"),
    ("dark matter or stars as particles", "tasks/galaxy.md", "cloud-in-halo"),
    ("a cloud in a wind", "tasks/tests.md", "blob"),
    ("a star in a wind", "tasks/ambient.md", "star-in-wind"),
    ("shear", "tasks/tests.md", "kelvin-helmholtz-2d"),
    ("a shock tube", "tasks/tests.md", "sod"),
    ("a blast", "tasks/tests.md", "sedov"),
    ("a vortex", "tasks/tests.md", "gresho"),
    ("a collapse", "tasks/tests.md", "evrard"),
    ("a magnetic field", "tasks/fields.md", "orszag-tang"),
    ("a turbulent box", "tasks/turbulence.md", "turbulence"),
    ("a cosmological box", "tasks/displacement.md", "zeldovich"),
    ("a tank", "tasks/tank.md", "tank"),
    ("an asteroid's shape model", "tasks/shape.md", "asteroid"),
    ("finer in places", "tasks/resolution.md", "refined-sphere"),
    ("a snapshot at another resolution", "tasks/re-sampling.md", "resample-finer"),
];

/// On a page that the first one leads to stands a line with the task's words and its scene, which leads to a page that works on it.
#[test]
fn every_task_is_two_clicks_away() {
    let (root, clicks) = (folder().canonicalize().unwrap(), clicks());
    let near: Vec<(PathBuf, String)> = clicks
        .iter()
        .filter(|(_, n)| **n <= 1)
        .map(|(page, _)| (page.clone(), std::fs::read_to_string(page).unwrap()))
        .collect();
    for (words, page, scene) in TASKS {
        let target = root.join(page);
        let leads = |from: &Path, line: &str| {
            let files = links(line).into_iter().filter_map(|l| l.split('#').next().map(str::to_owned));
            files
                .filter(|f| !f.is_empty())
                .any(|f| from.parent().unwrap().join(f).canonicalize().is_ok_and(|f| f == target))
        };
        let line = near.iter().find_map(|(from, text)| {
            text.lines().find(|l| l.contains(words) && leads(from, l) && l.contains(&format!("`{scene}.yaml`")))
        });
        assert!(line.is_some(), "no line within a click says '{words}', names {scene}.yaml and leads to {page}");
        assert!(clicks.get(&target).is_some_and(|n| *n <= 2), "{page}: {:?}", clicks.get(&target));
        let text = std::fs::read_to_string(&target).unwrap();
        assert!(text.contains(&format!("{scene}.yaml")), "{page} does not work on {scene}.yaml");
        assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("profiles/{scene}.yaml")).is_file(), "{scene}");
    }
}

/// Drawings with axes say at both what is measured in which unit; panels of pictures have none.
#[test]
fn no_figure_of_the_manual_is_without_units() {
    let mut seen = 0;
    for entry in std::fs::read_dir(folder().join("results")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.ends_with(".svg") || name.starts_with("methods-") {
            continue;
        }
        let drawing = std::fs::read_to_string(&path).unwrap();
        let texts = drawing.split("<text").skip(1).map(|t| t.split('>').nth(1).unwrap().split('<').next().unwrap());
        let labels: Vec<&str> = texts.filter(|t| t.contains('[') && t.contains(']')).collect();
        assert!(labels.len() >= 2, "{name}: {labels:?}");
        seen += 1;
    }
    assert!(seen > 2, "{seen}");
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
#[ignore = "slow: .ci/full runs it"]
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
            // Blocks in turn take more than few.
            let is_whole = words.iter().any(|word| word == "--in-turn");
            let is_count = |i: usize| !is_whole && i > 0 && words[i - 1] == "-n";
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
