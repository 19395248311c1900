//! Rules over the sources: who may know whom, how long files are, what documents repeat from the code.

mod imports;
mod tokens;

use self::imports::Crate;
use self::tokens::{tokens, without_tests};
use sph_formats::{FORMATS, FormatSpec};
use sph_prep::scene::Scene;
use std::path::{Path, PathBuf};

/// Longest source file.
const MAX_LINES: usize = 600;

/// Modules that place particles and measure them; files are none of their business.
const PLACEMENT: [&str; 4] = ["metrics", "relaxation", "seeding", "target"];

/// The folders of the crates, and the words by which code of one names the others.
const CRATES: [(&str, &[&str]); 3] =
    [("sph/src", &["sph_formats", "sph_prep"]), ("formats/src", &["sph_core", "sph_prep"]), ("src", &[])];

/// Parts of `field` that turn what was read into fields; the rest of it knows no files either.
const FROM_FILES: [&str; 27] = [
    "build.rs",
    "build_grid.rs",
    "build_input.rs",
    "build_radial.rs",
    "build_refined.rs",
    "build_surface.rs",
    "build_tests.rs",
    "carried.rs",
    "curvilinear.rs",
    "grid_slopes.rs",
    "curvilinear_tests.rs",
    "rows.rs",
    "rows_tests.rs",
    "categorical.rs",
    "check.rs",
    "cloud.rs",
    "fitted.rs",
    "fitted_tests.rs",
    "geographic.rs",
    "grid.rs",
    "grid_boxes.rs",
    "mesh.rs",
    "refined.rs",
    "refined_tests.rs",
    "sampled.rs",
    "stepped.rs",
    "voronoi.rs",
];

/// Panics of `formats/src` outside tests that no file can cause: (file, text of the line, why).
const JUSTIFIED: [(&str, &str, &str); 0] = [];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All Rust files below a folder or file of the project, with their texts.
fn sources(below: &str) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    let mut open = vec![root().join(below)];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(path).unwrap().map(|e| e.unwrap().path()));
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            found.push((path.strip_prefix(root()).unwrap().to_owned(), text));
        }
    }
    found.sort();
    assert!(!found.is_empty(), "there are no sources below '{below}'");
    found
}

/// Numbered lines of code: no comments, no test modules, which end a file.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let end = text.find("#[cfg(test)]\nmod ").unwrap_or(text.len());
    let lines = text[..end].lines().enumerate().map(|(i, line)| (i + 1, line));
    lines.filter(|(_, line)| !line.trim_start().starts_with("//"))
}

/// Lines of code with one of `words`, as `path:line: text`.
fn lines_with(below: &str, words: &[&str], allowed: impl Fn(&Path, &str) -> bool) -> Vec<String> {
    let mut found = Vec::new();
    for (path, text) in sources(below) {
        for (number, line) in code(&text) {
            if words.iter().any(|w| line.contains(w)) && !allowed(&path, line) {
                found.push(format!("{}:{number}: {}", path.display(), line.trim()));
            }
        }
    }
    found
}

/// Places where code of a folder has one of `names`, as `path: name`.
fn names_in(below: &str, names: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    for (path, text) in sources(below) {
        let mut here = without_tests(tokens(&text));
        here.retain(|token| names.contains(&token.as_str()));
        here.dedup();
        found.extend(here.iter().map(|name| format!("{}: {name}", path.display())));
    }
    found
}

#[test]
fn crates_use_only_those_below_them() {
    for (folder, others) in CRATES {
        assert_eq!(names_in(folder, others), Vec::<String>::new());
        let manifest = std::fs::read_to_string(root().join(folder).with_file_name("Cargo.toml")).unwrap();
        let dependencies = manifest.split_once("[dependencies]").unwrap().1;
        let lines = || dependencies.lines().filter(|l| !l.starts_with('#'));
        for other in others.iter().map(|name| name.replace('_', "-")) {
            assert!(!lines().any(|l| l.contains(&other)), "{folder} depends on {other}");
        }
    }
}

/// `cargo test` does not look into the core for tests.
#[test]
fn the_core_has_its_tests_beside_it() {
    let none = Vec::<String>::new();
    let with_tests = sources("sph/src").into_iter().filter(|(_, text)| text.contains("#[test]"));
    assert_eq!(with_tests.map(|(path, _)| path.display().to_string()).collect::<Vec<_>>(), none);
}

#[test]
fn imports_go_in_no_circle() {
    let mut circles = Vec::new();
    for (folder, _) in CRATES {
        let files = sources(folder);
        // The binary has one file, which uses the library as others do.
        let of_library = files.iter().filter(|(path, _)| path != Path::new("src/main.rs"));
        let named =
            of_library.map(|(path, text)| (path.strip_prefix(folder).unwrap().to_str().unwrap(), text.as_str()));
        let found = Crate::new(named);
        assert!(found.uses().values().map(Vec::len).sum::<usize>() > 10, "{folder}: imports are not found any more");
        circles.extend(found.circles().into_iter().map(|line| format!("{folder}/{line}")));
    }
    assert!(circles.is_empty(), "{} imports are part of circles:\n{}", circles.len(), circles.join("\n"));
}

#[test]
fn only_the_command_line_knows_of_terminals() {
    let mut found = names_in("src", &["clap", "indicatif", "ctrlc"]);
    found.retain(|line| !line.starts_with("src/cli/") && !line.starts_with("src/main.rs"));
    assert_eq!(found, Vec::<String>::new());
    assert!(!names_in("src/cli", &["clap"]).is_empty());
}

#[test]
fn nothing_is_unsafe() {
    for (folder, _) in CRATES {
        let library = std::fs::read_to_string(root().join(folder).join("lib.rs")).unwrap();
        assert!(library.contains("\n#![forbid(unsafe_code)]\n"), "{folder}/lib.rs does not forbid unsafe code");
    }
    // Tests and benches are crates of their own. Only an allocator that counts, for the fuzzing of readers, cannot do
    // without: the trait of allocators is unsafe.
    for folder in ["src", "formats", "sph", "python", "tests", "profiles"] {
        let mut found = names_in(folder, &["unsafe"]);
        found.retain(|line| !line.starts_with("formats/tests/fuzz"));
        assert_eq!(found, Vec::<String>::new());
    }
}

#[test]
fn placement_knows_nothing_of_formats() {
    let none = Vec::<String>::new();
    for module in PLACEMENT {
        assert_eq!(lines_with(&format!("src/{module}"), &["sph_formats"], |_, _| false), none);
    }
    let from_files = |path: &Path, _: &str| FROM_FILES.iter().any(|name| path.ends_with(Path::new("field").join(name)));
    assert_eq!(lines_with("src/field", &["sph_formats"], from_files), none);
    for name in FROM_FILES {
        let path = format!("src/field/{name}");
        assert!(sources(&path)[0].1.contains("sph_formats"), "'{path}' needs no exception any more");
    }
    // And what places particles knows of no stage around it.
    let around = ["crate::run::pipeline", "crate::cli", "crate::scene", "crate::run::report", "crate::input::ingest"];
    for module in PLACEMENT {
        assert_eq!(lines_with(&format!("src/{module}"), &around, |_, _| false), none);
    }
}

#[test]
fn no_source_file_is_too_long() {
    let all = ["src", "formats", "sph", "tests", "profiles"].into_iter().flat_map(sources);
    let long: Vec<String> = all
        .filter(|(path, _)| !path.components().any(|c| c.as_os_str() == "target"))
        .map(|(path, text)| (path, text.lines().count()))
        .filter(|(_, lines)| *lines > MAX_LINES)
        .map(|(path, lines)| format!("{}: {lines} lines, at most {MAX_LINES}", path.display()))
        .collect();
    assert_eq!(long, Vec::<String>::new());
}

#[test]
fn readers_and_writers_do_not_panic_on_purpose() {
    let words = [".unwrap()", ".expect(", "panic!(", "todo!(", "unimplemented!(", "unreachable!("];
    let justified = |path: &Path, line: &str| {
        JUSTIFIED.iter().any(|(file, text, _)| path == Path::new("formats/src").join(file) && line.contains(text))
    };
    assert_eq!(lines_with("formats/src", &words, justified), Vec::<String>::new());
    // What is justified is still there.
    for (file, text, why) in JUSTIFIED {
        let source = std::fs::read_to_string(root().join("formats/src").join(file)).unwrap();
        assert!(source.contains(text) && !why.is_empty(), "{file} has no '{text}' to be justified");
    }
}

#[test]
fn formats_are_sorted_and_have_folders_and_features() {
    let names: Vec<&str> = FORMATS.iter().map(|f| f.name).collect();
    assert!(names.is_sorted_by(|a, b| a < b), "{names:?}");
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    for format in FORMATS {
        let folder = format.feature.replace('-', "_");
        assert!(root().join("formats/src").join(folder).join("mod.rs").is_file(), "{} has no folder", format.name);
        let feature = format!("{0} = [\"sph-formats/{0}\"]", format.feature);
        assert!(manifest.contains(&feature), "Cargo.toml has no line '{feature}'");
        assert!(format.reference.starts_with("https://"), "{}: '{}'", format.name, format.reference);
    }
    let folders = std::fs::read_dir(root().join("formats/src")).unwrap().map(|e| e.unwrap().path());
    for folder in folders.filter(|p| p.is_dir() && !p.ends_with("common")) {
        let name = folder.file_name().unwrap().to_string_lossy().into_owned();
        let feature = name.replace('_', "-");
        assert!(FORMATS.iter().any(|f| f.feature == feature), "the folder '{name}' has no line in FORMATS");
    }
}

/// The row of a format in the README.
fn row(format: &FormatSpec) -> String {
    let c = format.capabilities;
    let field = if c.read_field { c.geometries.join(", ") } else { "-".into() };
    let particles = match (c.read_particles, c.write_particles) {
        (true, true) => "read, write",
        (true, false) => "read",
        (false, true) => "write",
        (false, false) => "-",
    };
    let extensions = format.extensions.join(", ");
    format!("| [`{}`]({}) | {} | {extensions} | {field} | {particles} |", format.name, format.reference, format.summary)
}

#[test]
fn the_table_of_formats_in_the_readme_is_the_registry() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let expected: Vec<String> = FORMATS.iter().map(row).collect();
    let found: Vec<&str> = readme.lines().filter(|l| l.starts_with("| [`")).collect();
    assert_eq!(found, expected, "the README should have these rows:\n{}\n", expected.join("\n"));
}

#[test]
fn bundled_scenes_are_valid_and_documented() {
    let documented = std::fs::read_to_string(root().join("profiles/README.md")).unwrap();
    let mut scenes = 0;
    for entry in std::fs::read_dir(root().join("profiles")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.extension().is_some_and(|e| e == "yaml") {
            let scene = Scene::load(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
            scene.validate().unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!(scene.input.file.is_none_or(|f| f.is_file()), "{name}: its input file is missing");
            scenes += 1;
        }
        assert!(name == "README.md" || documented.contains(&format!("`{name}`")) || name == "make.rs", "{name}");
    }
    assert!(scenes > 5, "only {scenes} scenes");
}
