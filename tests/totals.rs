//! What particles that take a snapshot's place have together: the mass, momentum, angular momentum and energy of those of the snapshot.

#![cfg(all(feature = "swift", feature = "gadget", feature = "numpy"))]

use crate::resample::{EDGE, SIDE, density, lattice, noise, resampled, totals, written};
use sph_formats::{FORMATS, ParticleFile, Values};
use sph_prep::relaxation::Control;
use sph_prep::run::pipeline;
use sph_prep::scene::Scene;

/// Eight times and an eighth of a rotating, moving ball, whose density and velocities are noisy.
#[test]
#[ignore = "slow: .ci/full runs it"]
fn mass_momentum_spin_and_energy_are_kept_at_any_resolution() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = lattice(true);
    let n = SIDE.pow(3);
    let Values::F64(x) = file.species[0].table.columns[0].values.clone() else { panic!() };
    file.header.periodic = [false; 3];
    let v = (0..n).flat_map(|i| {
        let [x, y] = [x[3 * i] - 1.0, x[3 * i + 1] - 1.0];
        [10.0 - y + 0.01 * noise(3 * i), x + 0.01 * noise(3 * i + 1), x * y + 0.01 * noise(3 * i + 2)]
    });
    file.species[0].table.columns[1].values = Values::F64(v.collect());
    file.species[0].table.columns[3].values = Values::F64((0..n).map(|i| 1.5 + x[3 * i + 2]).collect());
    file.species[0].table.columns[5].values =
        Values::F64((0..n).map(|i| density(x[3 * i]) * (1.0 + 0.03 * noise(i))).collect());
    let before = totals(&file);
    let input = written(folder.path(), "ball.hdf5", &file);
    for count in [8 * n, n / 8] {
        let scene =
            format!("particles: {count}\nwvt: {{iterations: 3}}\npolish: none\noutput: {{double_precision: true}}");
        let after = totals(&resampled(&input, &scene).unwrap());
        let off = |a: f64, b: f64, unit: f64| ((a - b) / unit).abs();
        assert!(off(after.4, before.4, before.4) < 1e-12, "mass {after:?} {before:?}");
        for k in 0..3 {
            assert!(off(after.0[k], before.0[k], before.0[0]) < 1e-12, "momentum {after:?} {before:?}");
        }
        assert!(off(after.1, before.1, before.1) < 1e-12, "spin {after:?} {before:?}");
        let energy = before.2 + before.3;
        assert!(off(after.2 + after.3, energy, energy) < 1e-12, "energy {after:?} {before:?}");
    }
}

/// A body that turns about the middle of its box keeps its angular momentum where the scene says that the box is not periodic, and it is told
/// where nothing says so.
#[test]
fn a_body_alone_in_a_box_keeps_its_rotation_where_faces_are_said_to_be_open() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = lattice(true);
    let Values::F64(x) = file.species[0].table.columns[0].values.clone() else { panic!() };
    let v = (0..SIDE.pow(3)).flat_map(|i| [1.0 - x[3 * i + 1], x[3 * i] - 1.0, 0.0]);
    file.species[0].table.columns[1].values = Values::F64(v.collect());
    let before = totals(&file);
    let run = |file: &ParticleFile, boundary: &str| {
        let text = format!(
            "particles: 400\nwvt: {{iterations: 0}}\npolish: none\noutput: {{double_precision: true}}\n{boundary}"
        );
        let mut scene = Scene::parse(&text).unwrap();
        scene.input.file = Some(written(folder.path(), "body.hdf5", file));
        pipeline::place(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{boundary}: {e}"))
    };
    let kept = |after: &ParticleFile| (totals(after).1 / before.1 - 1.0).abs();
    let (after, report) = run(&file, "domain: {boundary: reflecting}\n");
    assert!(kept(&after) < 1e-12, "{:?} {before:?}", totals(&after));
    assert!(report.warnings.iter().all(|w| !w.contains("periodic")), "{:?}", report.warnings);
    file.header.box_size = [3.0 * EDGE; 3];
    let (after, report) = run(&file, "domain: {boundary: open}\n");
    assert!(kept(&after) < 1e-12, "{:?} {before:?}", totals(&after));
    assert!(report.warnings.iter().all(|w| !w.contains("periodic")), "{:?}", report.warnings);
    assert!(report.notes.iter().any(|n| n.contains("angular momentum")), "{:?}", report.notes);
    let (_, report) = run(&file, "");
    let alone = report.warnings.iter().filter(|w| w.contains("`--boundary open` keeps its angular momentum")).count();
    assert_eq!(alone, 1, "{:?}", report.warnings);
    let (_, report) = run(&file, "domain: {boundary: periodic}\n");
    assert!(report.warnings.iter().all(|w| !w.contains("--boundary")), "{:?}", report.warnings);
    // Places beyond a periodic box are not wrapped into it without a word.
    file.header.box_size = [0.75 * EDGE; 3];
    let mut scene = Scene::parse("particles: 400\nwvt: {iterations: 0}\npolish: none\n").unwrap();
    let path = folder.path().join("beyond.gadget");
    sph_formats::write(FORMATS, &path, Some("gadget"), &file, sph_formats::WriteOptions::default()).unwrap();
    scene.input.file = Some(path);
    let (_, report) = pipeline::place(&scene, FORMATS, &Control::default()).unwrap();
    let half = format!("{} of {} particles lie beyond", SIDE.pow(3) - 12_usize.pow(3), SIDE.pow(3));
    assert!(report.warnings.iter().any(|w| w.contains(&half)), "{:?}", report.warnings);
}
