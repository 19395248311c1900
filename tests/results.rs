//! Pages of results that are data and a template, and the README's figures, which are those of the pages.
//!
//! ```sh
//! SPH_PREP_DOCS=1 cargo test --test all results::   # draws the figure and writes its page again
//! ```

use sph_prep::page::{Axis, Curve, Figure};
use std::fmt::Write;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn results(name: &str) -> PathBuf {
    root().join("docs/src/results").join(name)
}

fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(path.as_ref()).unwrap_or_else(|e| panic!("{}: {e}", path.as_ref().display()))
}

/// Kinetic energies over time of one start.
struct Start {
    name: String,
    points: Vec<(f64, f64)>,
}

impl Start {
    /// Mean over these times.
    fn mean(&self, from: f64, to: f64) -> f64 {
        let values: Vec<f64> = self.points.iter().filter(|p| p.0 >= from && p.0 <= to).map(|p| p.1).collect();
        values.iter().sum::<f64>() / values.len() as f64
    }

    fn largest(&self) -> f64 {
        self.points.iter().map(|p| p.1).fold(0.0, f64::max)
    }
}

/// What the data file says of itself, and its starts in its order.
fn star_in_swift() -> (Vec<String>, Vec<Start>) {
    let text = read(results("star-in-swift.csv"));
    let notes = text.lines().filter_map(|l| l.strip_prefix("# ")).map(str::to_owned).collect();
    let mut rows = text.lines().filter(|l| !l.starts_with('#'));
    assert_eq!(rows.next(), Some("start,time,kinetic_over_potential"));
    let mut starts: Vec<Start> = Vec::new();
    for row in rows {
        let cells: Vec<&str> = row.split(',').collect();
        let [name, time, value] = cells.as_slice() else { panic!("a row of {} cells: {row}", cells.len()) };
        if starts.last().is_none_or(|s| s.name != *name) {
            starts.push(Start { name: (*name).into(), points: Vec::new() });
        }
        starts.last_mut().unwrap().points.push((time.parse().unwrap(), value.parse().unwrap()));
    }
    (notes, starts)
}

fn figure(starts: &[Start]) -> String {
    // The first states are at rest, where a logarithm ends.
    let moving = |s: &Start| s.points.iter().copied().filter(|p| p.0 > 0.0).collect();
    let curves = starts.iter().enumerate().map(|(i, s)| Curve::line(&s.name, Some(i), moving(s)));
    Figure::new(
        "A star at rest in SWIFT: how much it moves",
        Axis::linear("time [dynamical times]").within(0.0, 5.0),
        Axis::logarithmic("kinetic energy over |potential energy| [1]").within(1e-7, 1e-1),
        curves.collect(),
    )
    .file()
}

fn page(notes: &[String], starts: &[Start]) -> String {
    let mut out = String::from(
        "# A star in SWIFT\n\n<!-- Written by `SPH_PREP_DOCS=1 cargo test --test all results::`. -->\n\n\
         ![Kinetic energy of a star at rest, by what it was started from](star-in-swift.svg)\n\n",
    );
    for note in notes {
        let _ = writeln!(out, "- {note}");
    }
    out += "\nAll starts have the profile, the equation of state and the parameter file in common, but for the last one's `resolution_eta`. `random` draws positions from the density; \
            `SEAGen` are the shells of that tool (Kegerreis et al. 2019); `WVT` is `--polish none`, `sph-prep` the default without a code in mind, \
            `sph-prep --for swift` is what [the tutorial](../star.md) does. Its 48 neighbors are next to the pairing instability of the cubic spline; \
            `sph-prep --for swift:eta=1.2`, as its report advises, has 44.\n\n\
            | start | mean of t = 1 to 3 | largest |\n|---|---|---|\n";
    for start in starts {
        let _ = writeln!(out, "| {} | {:.1e} | {:.1e} |", start.name, start.mean(1.0, 3.0), start.largest());
    }
    out + "\nThe numbers are in [star-in-swift.csv](star-in-swift.csv).\n"
}

#[test]
fn the_star_in_swift_is_drawn_from_its_data() {
    let (notes, starts) = star_in_swift();
    let names: Vec<&str> = starts.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["random", "SEAGen", "WVT", "sph-prep", "sph-prep --for swift", "sph-prep --for swift:eta=1.2"]);
    assert!(notes.iter().any(|n| n.contains("made on 20")), "{notes:?}");
    for (name, expected) in [("star-in-swift.svg", figure(&starts)), ("star-in-swift.md", page(&notes, &starts))] {
        if std::env::var_os("SPH_PREP_DOCS").is_some() {
            std::fs::write(results(name), &expected).unwrap();
        }
        let is_same = read(results(name)) == expected;
        assert!(is_same, "docs/src/results/{name} is stale: SPH_PREP_DOCS=1 cargo test --test all results::");
    }
}

/// Cells of a table's rows.
fn cells(line: &str) -> Vec<String> {
    line.trim_matches('|').split('|').map(|c| c.trim().replace("**", "")).collect()
}

/// The value with as many digits as `text` has, as a text.
fn to_digits_of(text: &str, value: f64) -> String {
    let decimals = text.split_once('.').map_or(0, |(_, fraction)| fraction.len());
    format!("{value:.decimals$}")
}

/// `NAME: 0.028 % in 3.1 s` as name, error and seconds.
fn claim(text: &str) -> (&str, &str, &str) {
    let parts = text.split_once(": ").and_then(|(name, rest)| {
        let (error, seconds) = rest.split_once(" % in ")?;
        Some((name, error, seconds.strip_suffix(" s")?))
    });
    parts.unwrap_or_else(|| panic!("'{text}' is not 'NAME: ERROR % in SECONDS s'"))
}

#[test]
fn what_the_readme_says_of_other_tools_is_in_the_page() {
    let rows: Vec<Vec<String>> = read(results("peers.md")).lines().filter(|l| l.starts_with("| ")).map(cells).collect();
    let readme = read(root().join("README.md"));
    let mut checked = 0;
    for line in
        readme.lines().skip_while(|l| !l.starts_with("| problem | N |")).skip(2).take_while(|l| l.starts_with('|'))
    {
        let line = cells(line);
        let (problem, count) = (&line[0], line[1].replace(' ', ""));
        let ours = [("sph-prep, ", line[2].as_str())].into_iter();
        for (whose, text) in ours.chain(line[3].split("; ").map(|t| ("", t))) {
            let (name, error, seconds) = claim(text);
            let method = format!("{whose}{name}");
            let is_it = |r: &Vec<String>| {
                let mean = r[5].parse::<f64>().map(|m| to_digits_of(error, 100.0 * m));
                let time = r[3].parse::<f64>().map(|t| to_digits_of(seconds, t));
                r[0] == *problem
                    && r[1] == count
                    && r[2].starts_with(&method)
                    && mean.as_deref() == Ok(error)
                    && time.as_deref() == Ok(seconds)
            };
            assert!(rows.iter().any(is_it), "{problem}, {count}: no row of peers.md says '{text}'");
            checked += 1;
        }
    }
    assert!(checked >= 7, "only {checked} figures");
}

#[test]
fn the_readme_is_short_and_in_order() {
    let readme = read(root().join("README.md"));
    assert!(readme.lines().count() < 120, "{} lines", readme.lines().count());
    let order = [
        "![Kinetic energy",
        "| problem | N |",
        "cargo run --release -- --in profiles/star.nc --out ic.hdf5 -n 100000",
        "cargo test --release",
        "## First run",
        "## One scene",
        "## Formats",
        "## Where to go on",
        "## Cite",
        "## License",
    ];
    let places: Vec<usize> =
        order.iter().map(|part| readme.find(part).unwrap_or_else(|| panic!("the README lacks '{part}'"))).collect();
    assert!(places.is_sorted(), "{places:?}");
    let near_top = readme.lines().position(|l| l == "cargo test --release").unwrap();
    assert!(near_top < 40, "the second command is in line {near_top}");
}

#[test]
fn versions_of_packages_are_that_of_the_program() {
    let version = env!("CARGO_PKG_VERSION");
    let said = [
        ("CITATION.cff", format!("version: {version}\n")),
        ("packaging/conda/meta.yaml", format!("set version = \"{version}\"")),
        ("CHANGELOG.md", format!("\n## {version}")),
        ("Cargo.toml", format!("version = \"{version}\"")),
    ];
    for (file, text) in said {
        assert!(read(root().join(file)).contains(&text), "{file} lacks '{}'", text.trim());
    }
}

#[test]
fn results_say_when_where_and_by_what_they_were_made() {
    let mut pages = 0;
    for entry in std::fs::read_dir(results("")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "md") {
            let (name, text) = (path.display(), read(&path));
            let made = text.lines().find(|l| l.to_lowercase().contains("made on "));
            let made = made.unwrap_or_else(|| panic!("{name} does not say when it was made"));
            assert!(made.contains(" 20") && ["x86_64", "aarch64"].iter().any(|m| made.contains(m)), "{name}: {made}");
            let command = ["cargo bench --bench ", "cargo test --release ", "tests/codes/"];
            assert!(command.iter().any(|c| text.contains(c)), "{name} does not say by which command it is made");
            pages += 1;
        }
    }
    assert!(pages > 8, "{pages}");
}

/// What a crate and a Debian package have of `profiles/` is all that its scenes read.
#[test]
fn packages_carry_what_the_scenes_read() {
    let manifest = read(root().join("Cargo.toml"));
    for entry in std::fs::read_dir(root().join("profiles")).unwrap() {
        let path = entry.unwrap().path();
        let kind = path.extension().unwrap().to_str().unwrap();
        if !["md", "rs"].contains(&kind) {
            assert!(
                manifest.contains(&format!("\"/profiles/*.{kind}\",")),
                "a crate has no .{kind}: {}",
                path.display()
            );
            assert!(manifest.contains(&format!("[\"profiles/*.{kind}\", ")), "a Debian package has no .{kind}");
        }
    }
}

/// The paper says of the star what the data say.
#[test]
fn the_paper_says_what_was_measured() {
    let paper = read(root().join("paper/paper.md"));
    for start in star_in_swift().1 {
        let text = format!("{:.1e}", start.mean(1.0, 3.0));
        let (digits, exponent) = text.split_once('e').unwrap();
        let text = format!("${digits} \\times 10^{{{exponent}}}$");
        assert!(paper.contains(&text), "{}: the paper lacks {text}", start.name);
    }
    let bibliography = read(root().join("paper/paper.bib"));
    for key in paper.split('@').skip(1).map(|t| t.split(|c: char| !c.is_alphanumeric()).next().unwrap()) {
        assert!(bibliography.contains(&format!("{{{key},")), "paper.bib lacks {key}");
    }
}
