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

fn lie_alike(a: &ParticleFile, b: &ParticleFile) -> bool {
    let x = |file: &ParticleFile| file.species[0].table.columns[0].values.to_f64();
    x(a) == x(b)
}

/// Of a box that is fifty times as wide as what is in it no cell that is looked at need have anything.
#[test]
fn a_body_in_a_wide_periodic_box_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = lattice(true);
    file.header.box_size = [50.0 * EDGE; 3];
    let mut scene =
        Scene::parse("particles: 300\nwvt: {iterations: 0}\npolish: none\ndomain: {boundary: periodic}\n").unwrap();
    scene.input.file = Some(written(folder.path(), "body.hdf5", &file));
    let (after, _) = pipeline::place(&scene, FORMATS, &Control::default()).unwrap();
    assert_eq!(after.header.box_size, [50.0 * EDGE; 3]);
    let x = after.species[0].table.columns[0].values.to_f64();
    assert!(x.iter().all(|x| (0.0..EDGE + 0.1).contains(x) || *x > 50.0 * EDGE - 0.1), "beside the body");
}

/// A body that turns about the middle of its box keeps its angular momentum where the box is not periodic: where the scene says so, and where it says
/// nothing and the body is alone.
#[test]
fn a_body_alone_in_a_box_keeps_its_rotation_where_faces_are_said_to_be_open() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = lattice(true);
    let Values::F64(x) = file.species[0].table.columns[0].values.clone() else { panic!() };
    let v = (0..SIDE.pow(3)).flat_map(|i| [1.0 - x[3 * i + 1], x[3 * i] - 1.0, 0.0]);
    file.species[0].table.columns[1].values = Values::F64(v.collect());
    let before = totals(&file);
    let scene = |file: &ParticleFile, boundary: &str| {
        let text = format!(
            "particles: 400\nwvt: {{iterations: 0}}\npolish: none\noutput: {{double_precision: true}}\n{boundary}"
        );
        let mut scene = Scene::parse(&text).unwrap();
        scene.input.file = Some(written(folder.path(), "body.hdf5", file));
        scene
    };
    let run = |file: &ParticleFile, boundary: &str| {
        pipeline::place(&scene(file, boundary), FORMATS, &Control::default())
            .unwrap_or_else(|e| panic!("{boundary}: {e}"))
    };
    let kept = |after: &ParticleFile| (totals(after).1 / before.1 - 1.0).abs();
    let (after, report) = run(&file, "domain: {boundary: reflecting}\n");
    assert!(kept(&after) < 1e-12, "{:?} {before:?}", totals(&after));
    assert!(report.warnings.iter().all(|w| !w.contains("periodic")), "{:?}", report.warnings);
    file.header.box_size = [1.5 * EDGE; 3];
    let (after, report) = run(&file, "domain: {boundary: open}\n");
    assert!(kept(&after) < 1e-12, "{:?} {before:?}", totals(&after));
    assert!(report.warnings.iter().all(|w| !w.contains("periodic")), "{:?}", report.warnings);
    assert!(report.notes.iter().any(|n| n.contains("angular momentum")), "{:?}", report.notes);
    // So it counts where nothing is said, and no particle of any kind is near the faces.
    let is_told = |notes: &[String]| notes.iter().any(|n| n.contains("is treated as open"));
    let (open, report) = run(&file, "");
    assert!(is_told(&report.notes) && lie_alike(&open, &after), "{:?}", report.notes);
    let mut beside = file.clone();
    let mut dark = beside.species[0].clone();
    dark.part_type = 1;
    let Values::F64(x) = &mut dark.table.columns[0].values else { panic!() };
    x.iter_mut().for_each(|x| *x *= 1.5);
    beside.species.push(dark);
    for (file, boundary) in [(&beside, ""), (&file, "domain: {boundary: periodic}\n")] {
        let foreseen = pipeline::forecast(&scene(file, boundary), FORMATS, &Control::default()).unwrap();
        assert!(!is_told(&foreseen.notes), "{:?}", foreseen.notes);
    }
    // The box is kept where most particles stay as they are; it is told then.
    let mut refined = Scene::parse("refine: {center: [1, 1, 1], radius: 0.2, factor: 2}\n").unwrap();
    refined.input.file = Some(written(folder.path(), "kept.hdf5", &file));
    let (_, report) = pipeline::place(&refined, FORMATS, &Control::default()).unwrap();
    let alone = report.warnings.iter().filter(|w| w.contains("`--boundary open` keeps its angular momentum")).count();
    assert!(alone == 1 && !is_told(&report.notes), "{:?}", report.warnings);
    // Places beyond a periodic box are not wrapped into it without a word.
    file.header.box_size = [0.75 * EDGE; 3];
    let mut scene = Scene::parse("particles: 400\nwvt: {iterations: 0}\npolish: none\n").unwrap();
    let path = folder.path().join("beyond.gadget");
    sph_formats::write(FORMATS, &path, Some("gadget"), &file, sph_formats::WriteOptions::default()).unwrap();
    scene.input.file = Some(path);
    let (_, report) = pipeline::place(&scene, FORMATS, &Control::default()).unwrap();
    let beyond = format!("{} of {} particles lie outside", SIDE.pow(3) - (3 * SIDE / 4).pow(3), SIDE.pow(3));
    assert!(report.warnings.iter().any(|w| w.contains(&beyond)), "{:?}", report.warnings);
}
