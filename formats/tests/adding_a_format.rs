//! The example of how a format is added, as part of the tests: what it says has to work.

#[allow(dead_code)]
#[path = "../examples/adding_a_format.rs"]
mod example;

use sph_formats::registry::{FieldRequest, FileContent, WriteOptions};
use sph_formats::{FORMATS, ParticleFile};
use std::path::Path;

const WATER: &str = "2\nt = 5e-1\nH 5e-1 0e0 2.5e-1\nH -5e-1 0e0 2.5e-1\n";

fn read(path: &Path) -> Result<ParticleFile, String> {
    match sph_formats::read(&[example::XYZ], path, None, &FieldRequest::default()).map_err(|e| e.to_string())? {
        FileContent::Particles(p) => Ok(p),
        FileContent::Field(_) => Err("a field".into()),
    }
}

#[test]
fn it_runs() {
    example::main().unwrap();
}

#[test]
fn a_hosts_own_list_reads_and_writes_it() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("a.xyz"), folder.path().join("b.xyz"));
    std::fs::write(&first, WATER).unwrap();
    let mut water = read(&first).unwrap();
    water.header.time = 0.5;
    sph_formats::write(&[example::XYZ], &second, None, &water, WriteOptions::default()).unwrap();
    assert_eq!(std::fs::read_to_string(&second).unwrap(), WATER);
    let unknown = sph_formats::write(FORMATS, &second, None, &water, WriteOptions::default()).unwrap_err();
    assert!(unknown.to_string().contains("no writer has this extension"), "{unknown}");
}

#[test]
fn damage_is_named_by_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xyz");
    for (content, line) in [
        ("18446744073709551615\n\nH 0 0 0\n", "line 1"),
        ("3\n\nH 0 0 0\nH 1 1 1\n", "line 1"),
        ("1\n\nH 0 zero 0\n", "line 3"),
        ("1\n\nH 0 nan 0\n", "line 3"),
    ] {
        std::fs::write(&path, content).unwrap();
        let text = read(&path).unwrap_err();
        assert!(text.contains(line), "{content:?}: {text}");
    }
}

#[test]
fn it_stays_short() {
    let source = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/adding_a_format.rs"));
    let lines = source.unwrap().lines().count();
    assert!(lines < 100, "the example has {lines} lines");
}
