//! Refined grids of Athena++, FLASH and AMReX through whole runs: masses and velocities against functions of place.

use sph_formats::common::particle_names as names;
use sph_formats::{ParticleFile, Values};
use sph_prep::relaxation::Control;
use sph_prep::{FORMATS, Report, Scene, place};
use std::path::{Path, PathBuf};
use std::process::Command;

// Each test uses a part of them.
#[allow(dead_code)]
#[path = "../formats/tests/support/plotfile.rs"]
mod plotfile;
#[allow(dead_code)]
#[path = "../formats/tests/support/trees.rs"]
mod trees;

use plotfile::Plot;

/// A cloud that thins out from a point, turns about z and expands.
fn density([x, y, z]: [f64; 3]) -> f64 {
    0.5 + (-0.3 * ((x - 1.0).powi(2) + (y - 2.0).powi(2) + (z - 3.0).powi(2))).exp()
}

const TURN: f64 = 0.7;
const EXPANSION: f64 = 0.2;

fn velocity([x, y, z]: [f64; 3]) -> [f64; 3] {
    [EXPANSION * x - TURN * y, EXPANSION * y + TURN * x, EXPANSION * z]
}

/// A refined grid in a file, and its cells by those that wrote it: corners.
struct Refined {
    path: PathBuf,
    density: &'static str,
    cells: Vec<[[f64; 3]; 2]>,
}

fn cells_of_trees(d: usize) -> Vec<[[f64; 3]; 2]> {
    let n = trees::cells(d);
    let leaves = trees::blocks(d).into_iter().filter(|b| b.is_leaf);
    let corners = |b: trees::Block| {
        let half: [f64; 3] = std::array::from_fn(|k| 0.5 * (b.ends(k, d)[1] - b.ends(k, d)[0]) / n[k] as f64);
        b.middles(d).into_iter().map(move |m| [-1.0, 1.0].map(|s| std::array::from_fn(|k| m[k] + s * half[k])))
    };
    leaves.flat_map(corners).collect()
}

fn cells_of_plotfile(plot: &Plot) -> Vec<[[f64; 3]; 2]> {
    let mut cells = Vec::new();
    for (level, patches) in plot.levels.iter().enumerate() {
        let width = |k: usize| {
            let along = if k < plot.dimension { plotfile::HI[k] - plotfile::LO[k] } else { 1.0 };
            along / plot.cells(level, k) as f64
        };
        for [lo, hi] in patches {
            for z in lo[2]..=hi[2] {
                for y in lo[1]..=hi[1] {
                    for cell in (lo[0]..=hi[0]).map(|x| [x, y, z]).filter(|c| !plot.is_covered(level, *c)) {
                        let m = plot.middle(level, cell);
                        cells.push([-0.5, 0.5].map(|s| std::array::from_fn(|k| m[k] + s * width(k))));
                    }
                }
            }
        }
    }
    cells
}

/// The same cloud in a file of each code.
fn files(folder: &Path, d: usize) -> Vec<Refined> {
    let (athena, flash, amrex) =
        (folder.join("cloud.athdf"), folder.join("cloud_hdf5_chk_0007"), folder.join("plt00042"));
    let of = |names: [&'static str; 4]| -> Vec<(&'static str, fn([f64; 3]) -> f64)> {
        let functions: [fn([f64; 3]) -> f64; 4] = [density, |x| velocity(x)[0], |x| velocity(x)[1], |x| velocity(x)[2]];
        names.into_iter().zip(functions).take(d + 1).collect()
    };
    trees::athena(&athena, d, "cartesian", &of(["rho", "vel1", "vel2", "vel3"]), |_| ());
    let mut run = trees::run(d);
    run.texts = vec![("geometry", "cartesian")];
    trees::flash(&flash, d, &run, &of(["dens", "velx", "vely", "velz"]), |_| ());
    let plot = Plot::new(d, &of(["density", "x_velocity", "y_velocity", "z_velocity"]));
    plot.write(&amrex);
    let trees = || cells_of_trees(d);
    vec![
        Refined { path: athena, density: "rho", cells: trees() },
        Refined { path: flash, density: "dens", cells: trees() },
        Refined { path: amrex, density: "density", cells: cells_of_plotfile(&plot) },
    ]
}

fn run(path: &Path, particles: usize, more: &str) -> (ParticleFile, Report) {
    let text = format!("input: {{file: '{}'}}\nparticles: {particles}\npolish: none\n{more}", path.display());
    place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{path:?}: {e}"))
}

fn column<'a>(file: &'a ParticleFile, name: &str) -> &'a Values {
    &file.species[0].table.column(name).unwrap_or_else(|| panic!("{name}")).values
}

fn point(values: &Values, i: usize, d: usize) -> [f64; 3] {
    std::array::from_fn(|k| if k < d { values.get(i * d + k) } else { 0.0 })
}

fn middle([a, b]: &[[f64; 3]; 2]) -> [f64; 3] {
    std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
}

fn mass(cells: &[[[f64; 3]; 2]], d: usize) -> f64 {
    cells.iter().map(|c| density(middle(c)) * (0..d).map(|k| c[1][k] - c[0][k]).product::<f64>()).sum()
}

#[test]
fn clouds_keep_their_mass_and_their_velocities() {
    let folder = tempfile::tempdir().unwrap();
    for d in 1..=3 {
        for refined in files(folder.path(), d) {
            let (file, report) = run(&refined.path, 400, "output: {units: code, origin: input}");
            let expected = mass(&refined.cells, d);
            // Values of the trees are in f32.
            let total = report.mass.total;
            assert!((total / expected - 1.0).abs() < 1e-6, "{:?} in {d}-D: {total} {expected}", refined.path);
            let (x, v) = (column(&file, names::COORDINATES), column(&file, names::VELOCITIES));
            let count = file.species[0].table.count;
            for i in 0..count {
                let (x, v) = (point(x, i, d), point(v, i, d));
                // The cell about the particle: its velocity is that of the function in its middle, in f32.
                let within = |c: &&[[f64; 3]; 2]| (0..d).all(|k| c[0][k] - 1e-9 <= x[k] && x[k] <= c[1][k] + 1e-9);
                let near = |c: &[[f64; 3]; 2]| (0..d).all(|k| (v[k] - velocity(middle(c))[k]).abs() < 1e-5);
                assert!(refined.cells.iter().filter(within).any(near), "{:?}: {x:?} {v:?}", refined.path);
            }
            assert_eq!(report.variables.iter().filter(|a| a.name == refined.density).count(), 1);
        }
    }
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn mass_in_shells_is_that_of_the_cells() {
    let folder = tempfile::tempdir().unwrap();
    let center = [1.0, 2.0, 3.0];
    for refined in files(folder.path(), 3) {
        for radius in [0.4, 0.7, 1.0] {
            let ball = format!(
                "domain: {{ball: {{center: {center:?}, radius: {radius}}}}}\noutput: {{units: code, origin: input}}"
            );
            let (file, report) = run(&refined.path, 200, &ball);
            // Cells in equal parts; those that the sphere may cut are what is not known.
            let (mut inside, mut cut) = (0.0, 0.0);
            for cell in &refined.cells {
                let n = 24;
                let width: [f64; 3] = std::array::from_fn(|k| (cell[1][k] - cell[0][k]) / f64::from(n));
                let share = density(middle(cell)) * width.iter().product::<f64>();
                let half = 0.5 * width.iter().map(|w| w * w).sum::<f64>().sqrt();
                for part in 0..n * n * n {
                    let at = [part % n, part / n % n, part / n / n];
                    let x: [f64; 3] = std::array::from_fn(|k| cell[0][k] + width[k] * (f64::from(at[k]) + 0.5));
                    let r = (0..3).map(|k| (x[k] - center[k]).powi(2)).sum::<f64>().sqrt();
                    inside += if r < radius { share } else { 0.0 };
                    cut += if (r - radius).abs() < half { share } else { 0.0 };
                }
            }
            // Of parts that are cut some are counted whole and some not at all: a few percent of them are left.
            let off = (report.mass.total - inside).abs();
            assert!(off < 0.05 * cut + 1e-6 * inside, "{:?}: {} {inside} {cut}", refined.path, report.mass.total);
            let masses: f64 = column(&file, names::MASSES).to_f64().iter().sum();
            assert!((masses / report.mass.total - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn parts_of_the_box_have_the_mass_of_the_parts_of_cells() {
    let folder = tempfile::tempdir().unwrap();
    let (lo, hi) = ([0.13, 1.02, 2.11], [1.77, 4.41, 3.9]);
    for refined in files(folder.path(), 3) {
        let text = format!("domain: {{box: [{lo:?}, {hi:?}]}}\noutput: {{units: code}}");
        let (_, report) = run(&refined.path, 100, &text);
        let share =
            |c: &[[f64; 3]; 2]| (0..3).map(|k| (c[1][k].min(hi[k]) - c[0][k].max(lo[k])).max(0.0)).product::<f64>();
        let expected: f64 = refined.cells.iter().map(|c| density(middle(c)) * share(c)).sum();
        assert!(
            (report.mass.total / expected - 1.0).abs() < 1e-6,
            "{:?}: {} {expected}",
            refined.path,
            report.mass.total
        );
    }
}

#[test]
fn axes_repeat_where_the_file_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cloud_hdf5_plt_cnt_0001");
    trees::flash(&path, 3, &trees::run(3), &[("dens", density)], |_| ());
    let (file, report) = run(&path, 100, "");
    assert_eq!(file.header.periodic, [true, false, false]);
    assert!(report.text().contains("repeats along axis 'x'"), "{}", report.text());
    assert!((file.header.box_size[0] - 4.0).abs() < 1e-12, "{:?}", file.header.box_size);
    let (file, _) = run(&path, 100, "domain: {boundary: [open, periodic, periodic]}");
    assert_eq!(file.header.periodic, [false, true, true]);
}

#[test]
fn inspect_shows_levels_and_cells() {
    let folder = tempfile::tempdir().unwrap();
    for refined in files(folder.path(), 2) {
        let output = Command::new(env!("CARGO_BIN_EXE_sph-prep")).arg("inspect").arg(&refined.path).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        for part in ["refined grid", "  axis x ", "  axis y ", "  level 0 ", "  level 2 ", "<- density", "<- velocity"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(!text.contains("level 3"), "{text}");
    }
}
