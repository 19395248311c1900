//! The manual's page on what a file means: each of its commands is run, and prints what the page says.

use crate::docs::folder;
use crate::grids::{CONTAINERS, Field, Grid};
use std::f64::consts::TAU;
use std::path::Path;

fn write(folder: &Path, container: &str, name: &str, grid: &Grid, variables: &[(&str, Field)]) {
    let container = CONTAINERS.iter().find(|c| c.file == container).unwrap();
    (container.write)(&folder.join(name), grid, variables);
}

/// The files and scenes that the page speaks of.
fn inputs(folder: &Path) {
    let cells = Grid { counts: [6, 5, 4], low: [-1.0; 3], high: [1.0; 3], has_cells: true };
    let nodes = Grid { has_cells: false, ..cells };
    let one: Field = |_| 1.0;
    let motion: [Field; 3] = [|x| 0.5 * x[0] - 2.0 * x[1], |x| 0.5 * x[1] + 2.0 * x[0], |x| 0.5 * x[2]];
    let moving = |names: [&'static str; 3]| -> Vec<(&'static str, Field)> {
        std::iter::once(("rho", one)).chain(names.into_iter().zip(motion)).collect()
    };
    let mut cloud = moving(["vel1", "vel2", "vel3"]);
    cloud.extend([("press", one), ("Bcc1", one), ("Bcc2", one), ("Bcc3", one)]);
    write(folder, "grid.athdf", "cloud.athdf", &cells, &cloud);
    write(folder, "grid.nc", "wind.nc", &nodes, &moving(["u", "v", "w"]));
    write(folder, "grid.nc", "gas.nc", &nodes, &[("rho", one), ("u", one), ("x_mass_fraction_He", |_| 0.25)]);
    let wave: Field = |x| 2.0 + (TAU * x[0]).sin() * (TAU * x[1]).cos();
    let cube = Grid { counts: [32; 3], low: [0.0; 3], high: [1.0; 3], has_cells: true };
    write(folder, "grid.nc", "box.nc", &cube, &[("rho", wave)]);
    let rows: String = (0..20).map(|i| f64::from(i) / 19.0).map(|r| format!("{r} {} {}\n", 2.0 - r, 3.0 * r)).collect();
    std::fs::write(folder.join("star.txt"), format!("# r rho v_r\n{rows}")).unwrap();
    std::fs::create_dir(folder.join("profiles")).unwrap();
    let star = Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles/star.nc");
    std::fs::copy(star, folder.join("profiles/star.nc")).unwrap();
}

fn plain(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Runs a block: lines after `$` are commands, or make a file with `cat > NAME`; others are what the last one prints, where `...`
/// stands for anything.
fn follow(folder: &Path, block: &str) -> usize {
    let (mut printed, mut command, mut commands) = (String::new(), "", 0);
    let mut lines = block.lines();
    while let Some(line) = lines.next() {
        if let Some(name) = line.strip_prefix("$ cat > ") {
            let text: Vec<&str> = lines.by_ref().take_while(|l| !l.is_empty()).collect();
            std::fs::write(folder.join(name), text.join("\n")).unwrap();
        } else if let Some(words) = line.strip_prefix("$ sph-prep ") {
            let output = assert_cmd::Command::new(env!("CARGO_BIN_EXE_sph-prep"))
                .current_dir(folder)
                .args(words.split_whitespace())
                .output()
                .unwrap();
            let text = [output.stdout, output.stderr].concat();
            (printed, command, commands) = (plain(&String::from_utf8_lossy(&text)), line, commands + 1);
        } else {
            let mut rest = printed.as_str();
            for part in line.split("...").map(plain).filter(|part| !part.is_empty()) {
                let at =
                    rest.find(&part).unwrap_or_else(|| panic!("{command}\nlacks '{part}' of '{line}' in\n{printed}"));
                rest = &rest[at + part.len()..];
            }
        }
    }
    commands
}

#[test]
fn each_failure_of_before_is_what_the_page_says_now() {
    let page = std::fs::read_to_string(folder().join("meaning.md")).unwrap();
    let place = tempfile::tempdir().unwrap();
    inputs(place.path());
    let blocks = page.split("```console\n").skip(1).map(|b| b.split("```").next().unwrap());
    let commands: usize = blocks.map(|block| follow(place.path(), block)).sum();
    assert!(commands > 11, "{commands}");
}

/// Tests that the page names are there.
#[test]
fn the_tests_that_the_page_names_are_there() {
    let page = std::fs::read_to_string(folder().join("meaning.md")).unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = 0;
    for name in page.split('`').skip(1).step_by(2).filter(|n| n.contains("::") || n.starts_with("tests/")) {
        let (file, test) = name.split_once("::").unwrap_or((name, ""));
        let text = std::fs::read_to_string(root.join(file)).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(test.is_empty() || text.contains(&format!("fn {test}(")), "{name}");
        found += 1;
    }
    assert!(found > 15, "{found}");
}
