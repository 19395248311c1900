//! Periodic boxes from grids: their edges and their mass are those of what was sampled, to rounding, or the run is refused.

use crate::grids::{CONTAINERS, Container, Grid, archive, npy};
use sph_prep::relaxation::Control;
use sph_prep::{FORMATS, Result, Scene, place};
use std::f64::consts::TAU;

/// Even, odd, and with three different edges and numbers.
const BOXES: [([usize; 3], [f64; 3]); 3] =
    [([4, 4, 4], [1.0, 1.0, 1.0]), ([5, 5, 5], [2.0, 2.0, 2.0]), ([4, 5, 6], [1.0, 2.0, 3.0])];

/// A wave along each axis whose samples have a mean of 2.
fn wave([x, y, z]: [f64; 3]) -> f64 {
    2.0 + 0.3 * (TAU * x).sin() + 0.4 * (TAU * y).sin() + 0.2 * (TAU * z).sin()
}

fn even(_: [f64; 3]) -> f64 {
    2.0
}

/// Box and mass of a run.
fn run(container: &Container, grid: &Grid, density: crate::grids::Field, more: &str) -> Result<([f64; 3], f64)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(container.file);
    (container.write)(&path, grid, &[("density", density)]);
    let text = format!(
        "input: {{file: '{}', density: density{more}}}\ndomain: {{boundary: [periodic]}}\nparticles: 4\npolish: none\nwvt: {{iterations: 0}}",
        path.display()
    );
    place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default()).map(|(file, report)| {
        assert_eq!(file.header.periodic, [true; 3]);
        (file.header.box_size, report.mass.total)
    })
}

fn check(container: &Container, grid: &Grid, density: crate::grids::Field, more: &str) {
    let label = format!("{} {grid:?} {more}", container.file);
    let (edges, mass) = run(container, grid, density, more).unwrap_or_else(|e| panic!("{label}: {e}"));
    let extent: [f64; 3] = std::array::from_fn(|k| grid.high[k] - grid.low[k]);
    for k in 0..3 {
        assert!((edges[k] / extent[k] - 1.0).abs() < 1e-12, "{label}: edges {edges:?}, expected {extent:?}");
    }
    let expected = 2.0 * extent.iter().product::<f64>();
    assert!((mass / expected - 1.0).abs() < 1e-12, "{label}: mass {mass}, expected {expected}");
}

fn from_zero(counts: [usize; 3], edges: [f64; 3], has_cells: bool) -> Grid {
    Grid { counts, low: [0.0; 3], high: edges, has_cells }
}

fn symmetric(counts: [usize; 3], edges: [f64; 3], has_cells: bool) -> Grid {
    Grid { counts, low: edges.map(|e| -0.5 * e), high: edges.map(|e| 0.5 * e), has_cells }
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn cells_fill_their_box_in_every_format() {
    for container in CONTAINERS {
        for (counts, edges) in BOXES {
            check(container, &from_zero(counts, edges, true), wave, "");
            check(container, &symmetric(counts, edges, true), wave, "");
            // Values that agree say nothing.
            check(container, &from_zero(counts, edges, true), even, "");
        }
    }
}

#[test]
fn nodes_that_end_where_they_begin_span_their_box_in_every_format() {
    for container in CONTAINERS.iter().filter(|c| !c.states_cells) {
        for (counts, edges) in BOXES {
            let counts = counts.map(|n| n + 1);
            check(container, &from_zero(counts, edges, false), wave, "");
            check(container, &from_zero(counts, edges, false), even, "");
        }
    }
}

#[test]
fn what_may_be_either_is_asked_for_and_taken_as_told() {
    for container in CONTAINERS.iter().filter(|c| !c.states_cells) {
        for (counts, edges) in &BOXES[2..] {
            let (cells, nodes) = (symmetric(*counts, *edges, true), symmetric(*counts, *edges, false));
            let shifted =
                |grid: &Grid| Grid { low: grid.low.map(|x| x + 7.3), high: grid.high.map(|x| x + 7.3), ..*grid };
            // Point data are VTK's word for nodes.
            let says_points = container.file.ends_with(".vtk");
            for grid in [cells, nodes, shifted(&cells), shifted(&nodes)] {
                let found = run(container, &grid, even, "");
                if says_points && grid.low[0] < 0.0 {
                    continue;
                }
                let error = found.expect_err(container.file).to_string();
                for part in ["input.centering", "centering: cells", "axis 'x'"] {
                    assert!(error.contains(part), "{}: {error}", container.file);
                }
            }
            for grid in [cells, shifted(&cells)] {
                check(container, &grid, even, ", centering: cells");
            }
            for grid in [nodes, shifted(&nodes)] {
                check(container, &grid, even, ", centering: nodes");
            }
        }
    }
}

#[test]
fn a_box_of_the_scene_says_what_the_period_is() {
    let container = &CONTAINERS[0];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(container.file);
    // Nodes at i/4: the fifth would be the first again.
    let grid = Grid { counts: [4; 3], low: [0.0; 3], high: [0.75; 3], has_cells: false };
    (container.write)(&path, &grid, &[("density", even)]);
    let run = |edge: f64| {
        let text = format!(
            "input: {{file: '{}'}}\ndomain: {{box: [[0, 0, 0], [{edge}, {edge}, {edge}]], boundary: [periodic]}}\nparticles: 4\npolish: none\nwvt: {{iterations: 0}}",
            path.display()
        );
        place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default()).map(|(_, report)| report.mass.total)
    };
    assert!((run(1.0).unwrap() - 2.0).abs() < 1e-12);
    assert!((run(0.75).unwrap() - 2.0 * 0.75_f64.powi(3)).abs() < 1e-12);
    assert!((run(0.5).unwrap() - 0.25).abs() < 1e-12, "a part of it");
}

#[test]
fn the_report_says_how_it_was_decided() {
    let container = &CONTAINERS[0];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(container.file);
    (container.write)(&path, &from_zero([4; 3], [1.0; 3], true), &[("density", wave)]);
    let text = format!(
        "input: {{file: '{}'}}\ndomain: {{boundary: [periodic]}}\nparticles: 4\npolish: none\nwvt: {{iterations: 0}}",
        path.display()
    );
    let (_, report) = place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default()).unwrap();
    assert!(
        report.text().contains("axis 'y': its 4 nodes are taken for the middles of cells, its period is 1"),
        "{}",
        report.text()
    );
}

/// An array without axes fills the box that is stated, and nodes that are the middles of cells of the stated box are that.
#[test]
fn arrays_fill_the_box_that_is_stated() {
    let folder = tempfile::tempdir().unwrap();
    let bare = folder.path().join("bare.npy");
    std::fs::write(&bare, npy("(4, 5)", &[2.0; 20])).unwrap();
    let middles = folder.path().join("middles.npz");
    let line = |n: usize| (0..n).map(|i| 3.0 * i as f64 + 1.5).collect::<Vec<f64>>();
    let arrays = [("x", npy("(4,)", &line(4))), ("y", npy("(5,)", &line(5))), ("density", npy("(4, 5)", &[2.0; 20]))];
    archive(&middles, arrays.into_iter());
    for (file, corners, mass) in
        [(&bare, "[[-1, 0], [5, 7]]", 84.0), (&bare, "[[0, 0], [1, 1]]", 2.0), (&middles, "[[0, 0], [12, 15]]", 360.0)]
    {
        let text = format!(
            "input: {{file: '{}'}}\ndomain: {{box: {corners}, boundary: reflecting}}\nparticles: 300\npolish: none\nwvt: {{iterations: 0}}\n",
            file.display()
        );
        let scene = Scene::parse(&text).unwrap();
        let (particles, report) = place(&scene, FORMATS, &Control::default()).unwrap();
        assert!((report.mass.total / mass - 1.0).abs() < 1e-12, "{corners}: {}", report.mass.total);
        let box_size = particles.header.box_size;
        assert!((box_size[0] * box_size[1] * 2.0 / mass - 1.0).abs() < 1e-12, "{corners}: {box_size:?}");
    }
}
