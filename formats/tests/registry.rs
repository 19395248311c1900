//! Finding formats, reading and writing through the registry, and files that appear whole or not at all.

use sph_formats::registry::{detect, detect_output, reader, writer};
use sph_formats::*;
use std::path::{Path, PathBuf};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn file(folder: &tempfile::TempDir, name: &str, content: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    path
}

fn names_in(folder: &tempfile::TempDir) -> Vec<String> {
    let entries = std::fs::read_dir(folder.path()).unwrap();
    entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

const BOTH: Capabilities = Capabilities {
    read_field: true,
    read_particles: true,
    write_particles: true,
    geometries: &["radial"],
    dimensions: &[3],
    ..Capabilities::NONE
};

const fn spec(name: &'static str, extensions: &'static [&'static str], sniff: fn(&[u8]) -> Match) -> FormatSpec {
    FormatSpec {
        name,
        summary: "made up",
        extensions,
        feature: "made-up",
        reference: "https://example.org",
        capabilities: BOTH,
        sniff,
        read: None,
        write: None,
        stream: None,
    }
}

fn never(_: &[u8]) -> Match {
    Match::No
}

fn container(head: &[u8]) -> Match {
    if head.starts_with(b"BOX") { Match::Container } else { Match::No }
}

fn certain(head: &[u8]) -> Match {
    if head.starts_with(b"BOX-A") { Match::Certain } else { container(head) }
}

/// A host's own list.
static HOST: [FormatSpec; 4] = [
    spec("alpha", &["a", "box"], certain),
    spec("beta", &["b", "box"], container),
    spec("gamma", &["c"], never),
    spec("delta", &["c"], never),
];

fn found(path: &Path, explicit: Option<&str>) -> std::result::Result<&'static str, String> {
    detect(&HOST, path, explicit).map(|f| f.name).map_err(|e| e.to_string())
}

#[test]
fn the_list_is_sorted_unique_and_documented() {
    for pair in FORMATS.windows(2) {
        assert!(pair[0].name < pair[1].name, "{} before {}", pair[0].name, pair[1].name);
    }
    for f in FORMATS {
        assert!(!f.summary.is_empty() && !f.summary.ends_with('.'), "{}", f.name);
        assert!(f.reference.starts_with("https://"), "{}", f.name);
        assert!(!f.feature.is_empty() && !f.extensions.is_empty(), "{}", f.name);
        for e in f.extensions {
            assert!(!e.is_empty() && !e.contains('.') && e.to_ascii_lowercase() == *e, "{}: {e}", f.name);
        }
        let c = f.capabilities;
        assert!(c.read_field || c.read_particles || c.write_particles, "{}", f.name);
        assert!(f.read.is_none() || !c.read_field || !c.geometries.is_empty(), "{}: geometries of fields", f.name);
        assert!(c.dimensions.iter().all(|d| (1..=3).contains(d)), "{}", f.name);
        assert!(
            c.geometries.iter().all(|g| ["radial", "grid", "refined grid", "mesh", "cloud", "surface"].contains(g)),
            "{}",
            f.name
        );
        assert!(f.read.is_none() || c.read_field || c.read_particles, "{}", f.name);
        assert!(f.write.is_none() || c.write_particles, "{}", f.name);
        assert_eq!((f.sniff)(b""), Match::No, "{}", f.name);
    }
}

#[test]
fn no_signature_is_claimed_by_two_formats() {
    let heads: [&[u8]; 12] = [
        b"CDF\x01\0\0\0\0",
        b"CDF\x02\0\0\0\0",
        b"CDF\x05\0\0\0\0",
        b"# vtk DataFile Version 3.0\ntitle\nASCII\n",
        b"<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\">",
        b"1 2\nmodel_number num_zones\n1 2\n",
        b"# r rho\n0 1\n1 2\n",
        b"1 2\nmodel_number num_zones\n1 2\n\n1 2 3 4\nzone mass radius rho\n",
        b"1 2\n2 = 1 + 1\n 1.0 2.0\n",
        b"# cell outer radius  cell density\n1 2 3\n",
        b"\x89PNG\r\n\x1a\n\0\0",
        b"\xff\xfe\xfd",
    ];
    for head in heads {
        let certain: Vec<_> = FORMATS.iter().filter(|f| (f.sniff)(head) == Match::Certain).map(|f| f.name).collect();
        assert!(certain.len() <= 1, "{certain:?} claim {head:?}");
    }
}

#[test]
fn text_formats_are_told_apart_by_their_first_lines() {
    let folder = folder();
    let row = |k: u32| format!("{k} {}\n", ["1.0"; 18].join(" "));
    for (name, content, expected) in [
        ("a.data", "1 2\nmodel_number num_zones\n7 2\n".to_owned(), "mesa"),
        ("b.data", "r rho\n0 1\n1 2\n".to_owned(), "table"),
        ("c.mesa", format!("2 1.0E33 1.0E10 1.0E33 100\n{}{}", row(1), row(2)), "gyre"),
        ("d", format!("2 1.0E33 1.0E10 1.0E33\n{}", row(1)), "gyre"),
        ("e.txt", "# only comments\n".to_owned(), "table"),
        ("s15.txt", "VERSION 1\n grid  cell outer radius  cell density\n 1:  1.0  1.0\n".to_owned(), "kepler"),
        ("b.data", "r  outer radius  cell density\n0 1 1\n1 2 1\n".to_owned(), "table"),
        ("c.data", "a\n\n\n\n 2 3 5 300\n 1.0E+00-1.0E+00 1.0E+00\n".to_owned(), "fgong"),
        ("info_00001.txt", "ncpu =  1\nndim =  3\nlevelmin =  4\n".to_owned(), "ramses"),
        ("evolved", "7 8\n 2 = 1 + 1\n 1.0 2.0\n".to_owned(), "wdec"),
        ("f.csv", "x,y,rho\n0,0,1\n".to_owned(), "table"),
    ] {
        let path = file(&folder, name, content.as_bytes());
        assert_eq!(detect(FORMATS, &path, None).map(|f| f.name).map_err(|e| e.to_string()), Ok(expected), "{name}");
    }
}

#[test]
fn a_name_beats_the_signature_and_the_signature_beats_the_extension() {
    let folder = folder();
    assert_eq!(found(&file(&folder, "x.c", b"BOX-A"), Some("gamma")), Ok("gamma"));
    assert_eq!(found(&file(&folder, "x.b", b"BOX-A"), None), Ok("alpha"));
    assert_eq!(found(&file(&folder, "y.b", b"BOX-?"), None), Ok("beta"));
    assert_eq!(found(&file(&folder, "Y.A", b"BOX-?"), None), Ok("alpha"));
    assert_eq!(found(&file(&folder, "z.a", b"unknown"), None), Ok("alpha"));
}

#[test]
fn what_cannot_be_told_is_an_error_that_lists_the_choices() {
    let folder = folder();
    for (name, content, explicit, expected) in [
        ("x.box", "BOX-?", None, "it may be alpha, beta; name it with --format"),
        ("x.c", "unknown", None, "it may be gamma, delta; name it with --format"),
        ("x.zip", "unknown", None, "neither its first bytes nor its extension are known"),
        ("x", "unknown", None, "one of alpha, beta, gamma, delta"),
        ("x.a", "BOX", Some("omega"), "there is no format 'omega'; known are alpha, beta, gamma, delta"),
        ("empty.a", "", None, "the file is empty"),
    ] {
        let error = found(&file(&folder, name, content.as_bytes()), explicit).unwrap_err();
        assert!(error.contains(expected) && error.contains(name), "{error}");
    }
}

#[test]
fn paths_that_cannot_be_read_are_refused() {
    let folder = folder();
    let request = FieldRequest::default();
    let error = |path: &Path| read(FORMATS, path, None, &request).unwrap_err();
    assert!(matches!(error(folder.path()), FormatError::Io { .. }));
    assert!(error(folder.path()).to_string().contains("it is a directory"));
    assert!(matches!(error(&folder.path().join("missing.nc")), FormatError::Io { action: "open", .. }));
    for f in FORMATS {
        let path = file(&folder, "empty", b"");
        assert!(read(FORMATS, &path, Some(f.name), &request).is_err(), "{} reads an empty file", f.name);
        assert!(read(FORMATS, folder.path(), Some(f.name), &request).is_err(), "{} reads a directory", f.name);
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let path = file(&folder, "secret.csv", b"r,rho\n0,1\n1,2\n");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o000)).unwrap();
        if std::fs::File::open(&path).is_err() {
            assert!(matches!(error(&path), FormatError::Io { action: "open", .. }));
        } else {
            println!("skipped: this user may read everything");
        }
    }
}

#[test]
fn writers_are_found_by_extension_and_name() {
    let to = |path: &str, explicit| {
        detect_output(&HOST, Path::new(path), explicit).map(|f| f.name).map_err(|e| e.to_string())
    };
    assert_eq!(to("ic.a", None), Ok("alpha"));
    assert_eq!(to("ic.B", None), Ok("beta"));
    assert_eq!(to("ic.anything", Some("beta")), Ok("beta"));
    assert!(to("ic.box", None).unwrap_err().contains("the flavor may be alpha, beta; name it with --to"));
    assert!(to("ic", None).unwrap_err().contains("no writer has this extension"));
    assert!(to("ic.a", Some("nope")).unwrap_err().contains("there is no format 'nope'"));
}

#[test]
fn absent_readers_name_the_feature_and_impossible_ones_say_so() {
    let path = Path::new("x.a");
    let text = |e: FormatError| e.to_string();
    assert!(text(reader(&HOST[0], path).unwrap_err()).contains("rebuild with --features made-up"));
    assert!(text(writer(&HOST[0], path).unwrap_err()).contains("not in this build"));
    let nothing = FormatSpec { capabilities: Capabilities { read_field: true, ..Default::default() }, ..HOST[0] };
    assert!(text(writer(&nothing, path).unwrap_err()).contains("'alpha' cannot be written"));
    let only_written =
        FormatSpec { capabilities: Capabilities { write_particles: true, ..Default::default() }, ..HOST[0] };
    assert!(text(reader(&only_written, path).unwrap_err()).contains("'alpha' cannot be read"));
}

fn particles(count: usize) -> ParticleFile {
    let column = Column {
        name: "Masses".into(),
        components: 1,
        values: Values::F64(vec![1.0; 3]),
        dimension: UnitDimension::MASS,
    };
    ParticleFile {
        header: RunHeader {
            dimension: 3,
            box_size: [1.0; 3],
            box_corner: None,
            periodic: [false; 3],
            units: UnitSystem::cgs(),
            time: 0.0,
            kernel: "Wendland C4".into(),
            kernel_neighbors: 60.0,
            provenance: Vec::new(),
            layouts: Vec::new(),
        },
        species: vec![Species { part_type: 0, table: ParticleTable { count, columns: vec![column] } }],
    }
}

fn write_whole(path: &Path, _: &ParticleFile, _: WriteOptions) -> Result<()> {
    std::fs::write(path, "whole").map_err(|e| FormatError::io(path, "write", e))
}

fn write_half(path: &Path, _: &ParticleFile, _: WriteOptions) -> Result<()> {
    std::fs::write(path, "half").map_err(|e| FormatError::io(path, "write", e))?;
    Err(FormatError::Output { path: path.into(), format: "alpha", problem: "the disk is full".into() })
}

#[test]
fn a_failed_write_leaves_the_older_file_and_nothing_else() {
    let folder = folder();
    let good = [FormatSpec { write: Some(write_whole), ..HOST[0] }];
    let bad = [FormatSpec { write: Some(write_half), ..HOST[0] }];
    let path = folder.path().join("ic.a");
    let options = WriteOptions::default();

    let error = write(&bad, &path, None, &particles(3), options).unwrap_err().to_string();
    assert!(error.contains("ic.a' as alpha: the disk is full"), "the temporary is named: {error}");
    assert!(names_in(&folder).is_empty());

    write(&good, &path, None, &particles(3), options).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "whole");
    std::fs::write(&path, "older").unwrap();
    assert!(write(&bad, &path, None, &particles(3), options).is_err());
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "older");
    assert_eq!(names_in(&folder), ["ic.a"]);

    let error = write(&good, &path, None, &particles(4), options).unwrap_err().to_string();
    assert!(error.contains("column 'Masses': has 3 values, expected 4"), "{error}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "older");
}

#[test]
fn outputs_have_the_permissions_of_new_files() {
    let folder = folder();
    let path = folder.path().join("ic.a");
    output::atomically(&path, |t| write_whole(t, &particles(0), WriteOptions::default())).unwrap();
    let plain = file(&folder, "plain", b"");
    assert_eq!(std::fs::metadata(&path).unwrap().permissions(), std::fs::metadata(&plain).unwrap().permissions());
}

#[cfg(unix)]
#[test]
fn a_link_keeps_leading_to_the_output() {
    let folder = folder();
    let (real, link) = (file(&folder, "real.a", b"older"), folder.path().join("link.a"));
    std::os::unix::fs::symlink(&real, &link).unwrap();
    output::atomically(&link, |t| write_whole(t, &particles(0), WriteOptions::default())).unwrap();
    assert!(link.is_symlink());
    assert_eq!(std::fs::read_to_string(&real).unwrap(), "whole");
}

#[test]
fn outputs_that_cannot_be_made_are_refused_before_and_while_writing() {
    let folder = folder();
    let nowhere = folder.path().join("missing/ic.a");
    assert!(matches!(output::probe(&nowhere), Err(FormatError::Io { .. })));
    assert!(matches!(output::atomically(&nowhere, |_| Ok(())), Err(FormatError::Io { .. })));
    assert!(output::probe(folder.path()).unwrap_err().to_string().contains("it is a directory"));
    let inner = folder.path().join("inner.a");
    std::fs::create_dir(&inner).unwrap();
    assert!(output::atomically(&inner, |t| write_whole(t, &particles(0), WriteOptions::default())).is_err());
    assert_eq!(names_in(&folder), ["inner.a"]);
    assert!(output::probe(&folder.path().join("new.a")).is_ok());
    assert_eq!(names_in(&folder), ["inner.a"]);
}

fn field_of(path: &Path, geometry: Geometry, values: usize) -> Result<FileContent> {
    let variable = Variable {
        name: "rho".into(),
        description: None,
        unit: None,
        location: Location::Node,
        components: 1,
        values: Values::F64(vec![1.0; values]),
    };
    Ok(FileContent::Field(RawField {
        path: path.into(),
        format: "alpha",
        geometry,
        variables: vec![variable],
        density: Some("rho".into()),
        metadata: Vec::new(),
        notes: Vec::new(),
    }))
}

fn radial(nodes: &[f64]) -> Geometry {
    Geometry::Radial { nodes: nodes.to_vec(), unit: None }
}

fn triangle(offsets: &[usize], points: &[usize]) -> Geometry {
    let cells = Cells { types: vec![5], offsets: offsets.to_vec(), connectivity: points.to_vec() };
    Geometry::Mesh { dimension: 2, points: vec![[0.0; 3]; 3], unit: None, cells }
}

fn grid(nodes: &[f64], bounds: Option<Vec<f64>>) -> Geometry {
    let axis = GridAxis { name: "x".into(), nodes: nodes.to_vec(), unit: None, bounds };
    Geometry::Grid { coordinates: Coordinates::Cartesian, axes: vec![axis] }
}

#[test]
fn every_reader_is_checked_for_contradictions() {
    let folder = folder();
    let path = file(&folder, "x.a", b"BOX-A");
    macro_rules! read_made_up {
        ($geometry:expr, $values:expr) => {{
            let spec = [FormatSpec { read: Some(|path, _| field_of(path, $geometry, $values)), ..HOST[0] }];
            read(&spec, &path, None, &FieldRequest::default()).map(|_| ()).map_err(|e| e.to_string())
        }};
    }
    assert_eq!(read_made_up!(radial(&[0.0, 1.0, 1.0]), 3), Ok(()));
    assert_eq!(read_made_up!(triangle(&[0, 3], &[0, 1, 2]), 3), Ok(()));
    assert_eq!(read_made_up!(grid(&[0.0, 1.0], Some(vec![-0.5, 0.5, 1.5])), 2), Ok(()));
    for (result, expected) in [
        (read_made_up!(radial(&[0.0, 1.0]), 3), "variable 'rho': has 3 values, expected 2"),
        (read_made_up!(radial(&[0.0]), 1), "radius: has 1 value, expected at least 2"),
        (read_made_up!(radial(&[0.0, 2.0, 1.0]), 3), "radius: value 2 is 1e0 after 2e0"),
        (read_made_up!(radial(&[0.0, f64::NAN]), 2), "radius: value 1 is NaN"),
        (read_made_up!(radial(&[-1.0, 1.0]), 2), "radius: value 0 is -1e0, expected none below 0"),
        (read_made_up!(grid(&[0.0, 0.0], None), 2), "axis 'x': value 1 is 0e0 after 0e0"),
        (read_made_up!(grid(&[0.0, 1.0], Some(vec![0.0, 1.0])), 2), "axis 'x': has 2 bounds for 2 cells"),
        (read_made_up!(triangle(&[0, 3], &[0, 1, 3]), 3), "name point 3, but there are 3"),
        (read_made_up!(triangle(&[0, 4], &[0, 1, 2]), 3), "offsets that do not ascend"),
        (read_made_up!(triangle(&[0], &[0, 1, 2]), 3), "have 1 offsets for 1 cells"),
        (
            read_made_up!(Geometry::Cloud { dimension: 3, points: vec![[0.0, f64::INFINITY, 0.0]], unit: None }, 1),
            "point 0 is [0.0, inf, 0.0]",
        ),
        (
            read_made_up!(Geometry::Cloud { dimension: 4, points: vec![[0.0; 3]], unit: None }, 1),
            "dimension: is 4, expected 1 to 3",
        ),
    ] {
        let error = result.unwrap_err();
        assert!(error.contains(expected) && error.contains("x.a"), "{error}\n{expected}");
    }
}
