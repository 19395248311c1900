//! `sph-prep seed` and `sph-prep replicate`: what the scene says of its output holds for them, too.

use super::support::{Folder, sph_prep, succeed};
use sph_formats::{FORMATS, FileContent, ParticleFile, Values};
use std::path::Path;

const SCENE: &str = "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: periodic}\n\
                     thermal: {internal_energy: 1}\nparticles: 512\n";

fn read(path: &Path) -> ParticleFile {
    match sph_formats::read(FORMATS, path, None, &Default::default()).unwrap_or_else(|e| panic!("{e}")) {
        FileContent::Particles(file) => *Box::new(file),
        FileContent::Field(_) => panic!("{} holds a field", path.display()),
    }
}

/// Support radii over smoothing lengths: 1 in GADGET's files.
fn convention(file: &ParticleFile) -> f64 {
    file.header.layouts[0].support_over_length.unwrap()
}

#[test]
fn files_precision_and_code_of_the_scene_hold_for_streams() {
    let folder = Folder::new();
    let output = "target_code: gadget4\noutput: {files: 2, double_precision: true, compression: 0}\n";
    let scene = folder.file("scene.yaml", format!("{SCENE}{output}")).display().to_string();
    let out = folder.path("out/ic.hdf5").display().to_string();
    succeed(&["seed", "--scene", &scene, "--out", &out]);
    let mut names = folder.outputs();
    names.sort();
    assert_eq!(names, ["ic.0.hdf5", "ic.1.hdf5"]);
    let file = read(&folder.path("out/ic.0.hdf5"));
    assert!(matches!(file.species[0].table.column("Masses").unwrap().values, Values::F64(_)));
    assert_eq!(convention(&file), 1.0);
    // The command line comes first.
    let one = folder.path("out/one.hdf5").display().to_string();
    succeed(&["seed", "--scene", &scene, "--out", &one, "--files", "1", "--to", "swift"]);
    assert!(convention(&read(Path::new(&one))) > 1.5);
}

#[test]
fn streams_replace_nothing_where_the_scene_or_the_command_line_says_so() {
    let folder = Folder::new();
    let scene = |name: &str, more: &str| folder.file(name, format!("{SCENE}{more}")).display().to_string();
    let (plain, careful) = (scene("plain.yaml", ""), scene("careful.yaml", "output: {no_clobber: true}\n"));
    let out = folder.file("out/ic.hdf5", "precious").display().to_string();
    let tile = folder.path("tile.hdf5").display().to_string();
    succeed(&["seed", "--scene", &plain, "--out", &tile]);
    for args in [
        &["seed", "--scene", &careful, "--out", &out][..],
        &["seed", "--scene", &plain, "--out", &out, "--no-clobber"],
        &["replicate", &tile, "--times", "2,1,1", "--out", &out, "--no-clobber"],
        &["replicate", &tile, "--times", "2,1,1", "--scene", &careful, "--out", &out],
    ] {
        let outcome = sph_prep(args);
        assert!(outcome.code == Some(2) && outcome.stderr.contains("is there already"), "{args:?} {outcome:?}");
        assert_eq!(std::fs::read(&out).unwrap(), b"precious", "{args:?}");
    }
    succeed(&["seed", "--scene", &plain, "--out", &out]);
    assert_eq!(read(Path::new(&out)).species[0].table.count, 512);
}

#[test]
fn what_the_scene_asks_of_its_output_that_streams_do_not_write_is_told() {
    let folder = Folder::new();
    let text = SCENE.replace("'1'", "'1 + x'") + "order: crystal\noutput: {report: page.html}\n";
    let scene = folder.file("scene.yaml", text).display().to_string();
    let outcome = succeed(&["seed", "--scene", &scene, "--dry-run"]);
    assert!(outcome.stdout.contains("under order, output.report changes nothing here"), "{outcome:?}");
    assert!(outcome.stdout.contains("the box is periodic along x, but the density is not"), "{outcome:?}");
}
