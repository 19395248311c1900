//! NumPy files: grids in every order and type, archives of particles, damage.

use sph_formats::common::particle_names as names;
use sph_formats::{
    FORMATS, FieldRequest, FileContent, FormatError, Geometry, Location, RawField, UnitDimension, Values, registry,
};
use std::io::Write;

fn npy(descr: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let mut dict = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
    while !(10 + dict.len()).is_multiple_of(16) {
        dict.insert(dict.len() - 1, ' ');
    }
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((dict.len() as u16).to_le_bytes());
    bytes.extend(dict.as_bytes());
    bytes.extend(data);
    bytes
}

fn attempt(name: &str, bytes: &[u8]) -> Result<FileContent, FormatError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    registry::read(FORMATS, &path, None, &FieldRequest::default())
}

fn field(bytes: &[u8]) -> RawField {
    match attempt("a.npy", bytes).unwrap() {
        FileContent::Field(f) => f,
        FileContent::Particles(_) => panic!("particles"),
    }
}

fn npz(arrays: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in arrays {
        zip.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn doubles(v: &[f64]) -> Vec<u8> {
    v.iter().flat_map(|x| x.to_le_bytes()).collect()
}

#[test]
fn grids_have_x_first_in_both_orders_of_indices() {
    // a[i, j] = 10 i + j, shape (2, 3).
    let c_order = doubles(&[0.0, 1.0, 2.0, 10.0, 11.0, 12.0]);
    let fortran = doubles(&[0.0, 10.0, 1.0, 11.0, 2.0, 12.0]);
    for bytes in [npy("<f8", false, "(2, 3)", &c_order), npy("<f8", true, "(2, 3)", &fortran)] {
        let f = field(&bytes);
        let Geometry::Grid { axes, .. } = &f.geometry else { panic!("{}", f.geometry.kind()) };
        assert_eq!(axes.len(), 2);
        assert_eq!(axes[0].nodes, [0.25, 0.75]);
        assert_eq!(axes[1].bounds.as_deref(), Some(&[0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0][..]));
        assert_eq!(f.variables[0].values.to_f64(), [0.0, 10.0, 1.0, 11.0, 2.0, 12.0]);
        assert_eq!(f.density.as_deref(), Some("density"));
    }
    let cube: Vec<f64> = (0..24).map(f64::from).collect();
    let f = field(&npy("<f8", false, "(2, 3, 4)", &doubles(&cube)));
    // Value (i, j, k) was 12 i + 4 j + k and stands at i + 2 (j + 3 k).
    assert_eq!(f.variables[0].values.get(1 + 2 * (2 + 3 * 3)), 12.0 + 8.0 + 3.0);
    assert_eq!(
        field(&npy("<f8", false, "(1, 24, 1)", &doubles(&cube))).geometry.count(sph_formats::Location::Node),
        24
    );
}

#[test]
fn every_type_and_byte_order_is_read() {
    let check = |descr: &str, data: &[u8]| {
        assert_eq!(field(&npy(descr, false, "(2,)", data)).variables[0].values.to_f64(), [1.0, 2.0], "{descr}");
    };
    check(">f8", &[1.0_f64.to_be_bytes(), 2.0_f64.to_be_bytes()].concat());
    check("<f4", &[1.0_f32.to_le_bytes(), 2.0_f32.to_le_bytes()].concat());
    check("<f2", &[0x00, 0x3c, 0x00, 0x40]);
    check("|u1", &[1, 2]);
    check(">i2", &[0, 1, 0, 2]);
    check("<u4", &[1, 0, 0, 0, 2, 0, 0, 0]);
    check("<i8", &[1_i64.to_le_bytes(), 2_i64.to_le_bytes()].concat());
}

#[test]
fn archives_of_plain_arrays_are_particles() {
    let bytes = npz(&[
        ("pos", npy("<f8", false, "(2, 3)", &doubles(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))),
        ("mass", npy("<f8", false, "(2,)", &doubles(&[0.5, 0.25]))),
        ("id", npy("<f8", false, "(2,)", &doubles(&[7.0, 8.0]))),
        ("grid", npy("<f8", false, "(3,)", &doubles(&[0.0; 3]))),
    ]);
    let FileContent::Particles(p) = attempt("a.npz", &bytes).unwrap() else { panic!("a field") };
    let table = &p.species[0].table;
    assert_eq!((p.header.dimension, table.count), (3, 2));
    assert_eq!(table.column(names::MASSES).unwrap().dimension, UnitDimension::MASS);
    assert_eq!(table.column(names::COORDINATES).unwrap().values.get(5), 6.0);
    assert_eq!(table.column(names::PARTICLE_IDS).unwrap().values, Values::I64(vec![7, 8]));
    assert!(p.header.provenance.iter().any(|(k, v)| k == "not read" && v.contains("'grid'")));
}

#[test]
fn what_is_no_array_is_refused_with_the_reason() {
    let refusal = |name: &str, bytes: &[u8]| attempt(name, bytes).map(|_| ()).unwrap_err().to_string();
    let text = refusal("a.npy", &npy("<f8", false, "(1000000000000, 1000)", &[0; 64]));
    assert!(text.contains("declares 8000000000000000 bytes"), "{text}");
    let text = refusal("a.npy", &npy("<f8", false, "(18446744073709551615, 3)", &[0; 64]));
    assert!(text.contains("declares"), "{text}");
    let text = refusal("a.npy", &npy("|O", false, "(2,)", &[0; 64]));
    assert!(text.contains("|O"), "{text}");
    let text = refusal("a.npz", &npz(&[("m", npy("<f8", false, "(2,)", &[0; 8]))]));
    assert!(text.contains("'m'"), "{text}");
    let text = refusal("a.npz", &npz(&[("a", npy("<f8", false, "(2, 2, 2, 2)", &[0; 128]))]));
    assert!(text.contains("1 to 3 dimensions") && text.contains("a [2, 2, 2, 2]"), "{text}");
    assert!(attempt("a.npz", b"PK\x03\x04 and no more").is_err());
    let whole = npy("<f8", false, "(50, 50)", &[1; 20_000]);
    for length in (0..whole.len()).step_by(512) {
        assert!(attempt("a.npy", &whole[..length]).is_err(), "the first {length} bytes pass");
    }
    for i in 0..160 {
        let mut bytes = whole.clone();
        bytes[i] ^= 0x11;
        let _ = attempt("a.npy", &bytes);
    }
}

/// A velocity at the faces of shells whose densities are averages.
#[test]
fn values_at_faces_go_with_those_of_shells() {
    let array = |v: &[f64]| npy("<f8", false, &format!("({},)", v.len()), &doubles(v));
    let arrays = [("r", array(&[0.0, 1.0, 2.0])), ("rho", array(&[2.0, 1.0])), ("v_r", array(&[0.0, 3.0, 5.0]))];
    let found = field(&npz(&arrays));
    let located = |name: &str| {
        let variable = found.variable(name).unwrap();
        (variable.location, variable.values.to_f64())
    };
    assert_eq!(located("rho"), (Location::Cell, vec![2.0, 1.0]));
    assert_eq!(located("v_r"), (Location::Node, vec![0.0, 3.0, 5.0]));
    let bytes = npz(&[("r", array(&[0.0, 1.0, 2.0, 3.0])), ("rho", array(&[2.0, 1.0]))]);
    let error = attempt("a.npz", &bytes).unwrap_err().to_string();
    assert!(error.contains("expected 2 radii of 'rho', or 3 faces"), "{error}");
}

/// Inward, and with a value for each shell between faces.
#[test]
fn radii_may_run_inward_and_be_faces() {
    let read = |radii: &[f64], density: &[f64]| {
        let array = |v: &[f64]| npy("<f8", false, &format!("({},)", v.len()), &doubles(v));
        field(&npz(&[("r", array(radii)), ("rho", array(density))]))
    };
    for (radii, density) in [
        (&[0.0, 1.0, 2.0, 4.0][..], &[8.0, 4.0, 2.0, 1.0][..]),
        (&[4.0, 2.0, 1.0, 0.0], &[1.0, 2.0, 4.0, 8.0]),
        (&[0.0, 1.0, 2.0, 4.0], &[8.0, 4.0, 2.0]),
        (&[4.0, 2.0, 1.0, 0.0], &[2.0, 4.0, 8.0]),
    ] {
        let found = read(radii, density);
        let Geometry::Radial { nodes, .. } = &found.geometry else { panic!("{:?}", found.geometry) };
        assert_eq!(nodes, &[0.0, 1.0, 2.0, 4.0]);
        let rho = &found.variables[0];
        assert_eq!(rho.values.to_f64(), [8.0, 4.0, 2.0, 1.0][..density.len()]);
        let is_cells = density.len() == 3;
        assert_eq!(rho.location, if is_cells { Location::Cell } else { Location::Node });
    }
}
