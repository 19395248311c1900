//! Surfaces: STL, OBJ and PLY in all their encodings, and what is wrong with files of them.

use crate::support::replace;
use sph_formats::{FORMATS, FieldRequest, FileContent, FormatError, Geometry, RawField, Result, read};
use std::path::{Path, PathBuf};

/// A tetrahedron, corners and faces.
const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 2.0, 0.0], [0.25, 0.25, -1.0]];
const FACES: [[u32; 3]; 4] = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];

fn attempt(path: &Path) -> Result<RawField> {
    match read(FORMATS, path, None, &FieldRequest::default())? {
        FileContent::Field(field) => Ok(field),
        FileContent::Particles(_) => panic!("a surface holds no particles"),
    }
}

fn file(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    replace(&path, bytes);
    path
}

/// The corners of all facets.
fn facets(field: &RawField) -> Vec<[f64; 3]> {
    let Geometry::Surface { points, facets, .. } = &field.geometry else { panic!("{:?}", field.geometry) };
    facets.iter().map(|&i| points[i as usize]).collect()
}

fn expected() -> Vec<[f64; 3]> {
    FACES.iter().flatten().map(|&i| CORNERS[i as usize].map(f64::from)).collect()
}

fn stl_binary() -> Vec<u8> {
    let mut bytes = b"solid by name only".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((FACES.len() as u32).to_le_bytes());
    for face in FACES {
        bytes.extend([0; 12]);
        face.iter().flat_map(|&i| CORNERS[i as usize]).for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn stl_text() -> String {
    let corner = |i: &u32| {
        let [x, y, z] = CORNERS[*i as usize];
        format!("      vertex {x} {y:e} {z:.6}\r\n")
    };
    let facet = |face: &[u32; 3]| {
        let corners: String = face.iter().map(corner).collect();
        format!("  facet normal 0 0 0\r\n    outer loop\r\n{corners}    endloop\r\n  endfacet\r\n")
    };
    format!("solid a b\r\n{}endsolid a b\r\n", FACES.iter().map(facet).collect::<String>())
}

fn obj() -> String {
    let points: String = CORNERS.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    format!(
        "# a tetrahedron\nmtllib a.mtl\no a\n{points}vn 0 0 1\ns off\nf 1/1/1 2//1 3\nf 1 \\\n 4 2\nf -4 -2 -1\nf 2 4 3\n"
    )
}

fn ply(format: &str) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\ncomment made by hand\nelement vertex 4\nproperty uchar red\nproperty float x\nproperty float y\nproperty float \
         z\nelement edge 1\nproperty int a\nelement face 4\nproperty list uchar int vertex_indices\nproperty short flag\nend_header\n"
    );
    let mut bytes = header.into_bytes();
    let big = format == "binary_big_endian";
    let mut put = |text: String, little: &[u8]| match format {
        "ascii" => bytes.extend([text.as_bytes(), b" "].concat()),
        _ if big => bytes.extend(little.iter().rev()),
        _ => bytes.extend(little),
    };
    for corner in CORNERS {
        put("7".into(), &[7]);
        corner.iter().for_each(|v| put(v.to_string(), &v.to_le_bytes()));
    }
    put("9".into(), &9_i32.to_le_bytes());
    for face in FACES {
        put("3".into(), &[3]);
        face.iter().for_each(|i| put(i.to_string(), &i.to_le_bytes()));
        put("-2".into(), &(-2_i16).to_le_bytes());
    }
    bytes
}

fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("binary.stl", stl_binary()),
        ("text.stl", stl_text().into_bytes()),
        ("upper.stl", stl_text().to_uppercase().into_bytes()),
        ("a.obj", obj().into_bytes()),
        ("ascii.ply", ply("ascii")),
        ("little.ply", ply("binary_little_endian")),
        ("big.ply", ply("binary_big_endian")),
    ]
}

#[test]
fn every_encoding_holds_the_same_surface() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in all() {
        let field = attempt(&file(&folder, name, &bytes)).unwrap();
        assert_eq!(field.format, name.rsplit('.').next().unwrap());
        let found = facets(&field);
        if name == "a.obj" {
            // Of one face the corners were counted from the end.
            let sorted = |f: &[[f64; 3]]| {
                let mut f = f.to_vec();
                f.sort_by(|a, b| a.partial_cmp(b).unwrap());
                f
            };
            assert_eq!(sorted(&found), sorted(&expected()), "{name}");
        } else {
            assert_eq!(found, expected(), "{name}");
        }
        // The extension is not needed.
        let bare = file(&folder, "bare", &bytes);
        assert_eq!(attempt(&bare).unwrap().format, field.format, "{name}");
    }
}

#[test]
fn polygons_become_fans_and_strips_turn_every_other_triangle() {
    let folder = tempfile::tempdir().unwrap();
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    assert_eq!(facets(&attempt(&file(&folder, "a.obj", square.as_bytes())).unwrap()).len(), 6);
    let strip = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\nproperty list \
                 int int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0 1 1 0\n5 0 1 2 3 -1\n";
    let Geometry::Surface { facets, .. } = attempt(&file(&folder, "a.ply", strip.as_bytes())).unwrap().geometry else {
        panic!("not a surface")
    };
    assert_eq!(facets, [0, 1, 2, 2, 1, 3]);
}

#[test]
fn lines_in_a_plane_are_a_curve_and_others_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let curve = "v 0 0 2\nv 1 0 2\nv 0 1 2\nl 1 2 3 1\n";
    let field = attempt(&file(&folder, "a.obj", curve.as_bytes())).unwrap();
    assert!(matches!(&field.geometry, Geometry::Surface { dimension: 2, facets, .. } if facets == &[0, 1, 1, 2, 2, 0]));
    let bent = curve.replace("v 0 1 2", "v 0 1 3");
    let error = attempt(&file(&folder, "b.obj", bent.as_bytes())).unwrap_err().to_string();
    assert!(error.contains("plane of constant z"), "{error}");
}

#[test]
fn every_cut_is_an_error_or_leaves_whole_facets() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in all() {
        for length in 0..bytes.len() {
            let path = file(&folder, name, &bytes[..length]);
            match attempt(&path) {
                // The last number of a text may be cut short, and a list of faces may end anywhere.
                Ok(_) => {
                    // Behind `endsolid` a name follows.
                    let rest = if matches!(name, "text.stl" | "upper.stl") { 7 } else { 3 };
                    let is_whole = name == "a.obj" || bytes.len() - length < rest;
                    assert!(is_whole, "{name} cut to {length} bytes is taken for whole");
                }
                Err(e) => assert!(e.to_string().contains(&path.display().to_string()), "{name}: {e}"),
            }
        }
    }
}

#[test]
fn sizes_that_cannot_be_are_refused_before_anything_is_allocated() {
    let folder = tempfile::tempdir().unwrap();
    let mut huge = stl_binary();
    huge[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let text = |bytes: &[u8], name: &str| attempt(&file(&folder, name, bytes)).unwrap_err();
    assert!(matches!(text(&huge, "a.stl"), FormatError::Limit { .. }));
    for format in ["ascii", "binary_little_endian"] {
        let whole = String::from_utf8_lossy(&ply(format)).into_owned();
        let many = whole.replace("element vertex 4", "element vertex 4000000000000");
        assert!(matches!(text(many.as_bytes(), "a.ply"), FormatError::Limit { .. }), "{format}");
        let more = whole.replace("element face 4", "element face 18446744073709551615");
        assert!(matches!(text(more.as_bytes(), "a.ply"), FormatError::Limit { .. }), "{format}");
    }
    let endless = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement a 99999999999\nend_header\n0 0 0\n";
    assert!(text(endless.as_bytes(), "b.ply").to_string().contains("without a property"));
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content, part) in [
        ("a.obj", "v 0 0\nf 1 1 1\n", "line 1, column 'z'"),
        ("b.obj", "v 0 0 0\nf 1 2 9\n", "name point 2 of 1"),
        ("c.obj", "v 0 0 0\nf 1 0 1\n", "names point '0'"),
        ("d.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n", "has 2 points, expected at least 3"),
        ("e.obj", "v 0 0 0\n", "has no faces"),
        ("f.obj", "v 0 nan 0\nv 1 0 0\nv 1 1 1\nf 1 2 3\n", "expected finite coordinates"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", "x, y and z"),
        ("b.ply", "ply\nformat text 1.0\nend_header\n", "line 2: has the format 'text'"),
        ("c.ply", "ply\nformat ascii 1.0\nelement vertex x\n", "has no line `end_header`"),
        (
            "a.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid\n",
            "2 vertices",
        ),
        ("b.stl", "solid a\nvertex 0 0 0\nfacet\n", "outside of a facet"),
    ] {
        let error = attempt(&file(&folder, name, content.as_bytes())).unwrap_err().to_string();
        assert!(error.contains(part), "{name}: {error}");
    }
}
