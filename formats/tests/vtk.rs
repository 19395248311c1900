//! VTK files: what is written reads back, small files of each syntax mean what they say, damage is survived.

use crate::support::{particles_of, read_back, replace};
use sph_formats::common::particle_names as names;
use sph_formats::{
    Column, FORMATS, FieldRequest, FileContent, Geometry, Location, ParticleFile, ParticleTable, RawField, RunHeader,
    Species, UnitDimension, UnitSystem, Values, WriteOptions, read, write,
};
use std::path::Path;

fn field(path: &Path) -> RawField {
    match read(FORMATS, path, None, &FieldRequest::default()) {
        Ok(FileContent::Field(field)) => field,
        other => panic!("{other:?}"),
    }
}

fn particles(n: usize) -> ParticleFile {
    let column = |name: &str, components: usize, f: &dyn Fn(usize) -> f64| Column {
        name: name.into(),
        components,
        values: Values::F64((0..n * components).map(f).collect()),
        dimension: UnitDimension::NONE,
    };
    let columns = vec![
        column(names::COORDINATES, 3, &|i| i as f64 * 0.37),
        column(names::DENSITY, 1, &|i| 1.0 + i as f64),
        column(names::VELOCITIES, 3, &|i| -(i as f64)),
    ];
    let header = RunHeader {
        dimension: 3,
        box_size: [1e3; 3],
        box_corner: None,
        periodic: [false; 3],
        units: UnitSystem::CODE,
        time: 0.0,
        kernel: "Wendland C4".into(),
        kernel_neighbors: 64.0,
        provenance: vec![("Version".into(), "test -- 1".into())],
        layouts: Vec::new(),
    };
    ParticleFile { header, species: vec![Species { part_type: 0, table: ParticleTable { count: n, columns } }] }
}

#[test]
fn written_particles_read_back_as_a_cloud() {
    let folder = tempfile::tempdir().unwrap();
    for (extension, compression) in [("vtu", 4), ("vtu", 0), ("vtp", 4), ("vtp", 0), ("vtk", 0)] {
        for n in [1, 7, 20_000] {
            let path = folder.path().join(format!("p.{extension}"));
            let options = WriteOptions { compression, double_precision: true };
            write(FORMATS, &path, None, &particles(n), options).unwrap();
            let field = field(&path);
            let Geometry::Cloud { points, .. } = &field.geometry else { panic!("{extension}: {:?}", field.geometry) };
            assert_eq!(points.len(), n, "{extension}");
            assert!(points.iter().enumerate().all(|(i, p)| p[2] == (3 * i + 2) as f64 * 0.37));
            assert_eq!(field.density.as_deref(), Some("Density"));
            let density = &field.variable("Density").unwrap().values;
            assert!((0..n).all(|i| density.get(i) == 1.0 + i as f64), "{extension}");
            assert_eq!(field.variable("Velocities").unwrap().components, 3);
        }
    }
}

/// VTK asks for three components, of which a vector in a plane has two: in files of one piece and of several.
#[test]
fn vectors_in_a_plane_come_back_with_two_components() {
    let folder = tempfile::tempdir().unwrap();
    let spec = FORMATS.iter().find(|f| f.name == "vtk").unwrap();
    let mut p = particles_of(spec, 7, 2);
    let normals = Values::F64((0..14).map(f64::from).collect());
    p.species[0].table.columns.push(Column {
        name: "Normals".into(),
        components: 2,
        values: normals,
        dimension: UnitDimension::NONE,
    });
    for extension in ["vtu", "vtp"] {
        let path = folder.path().join(format!("p.{extension}"));
        crate::support::write(spec, &path, &p, true).unwrap();
        let back = read_back(&path).unwrap();
        let found = back.species[0].table.column("Normals").unwrap();
        assert_eq!((found.components, &found.values), (2, &p.species[0].table.columns.last().unwrap().values));
    }
}

#[test]
fn equal_particles_give_equal_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |name: &str| {
        let path = folder.path().join(name);
        write(FORMATS, &path, None, &particles(1000), WriteOptions::default()).unwrap();
        std::fs::read(path).unwrap()
    };
    assert_eq!(bytes("a.vtu"), bytes("b.vtu"));
}

/// Single precision has nothing between 1e-45 and 0.
#[test]
fn columns_beyond_single_precision_are_refused_on_both_sides() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtu");
    let written = |scale: f64, double_precision: bool| {
        let mut file = particles(3);
        file.species[0].table.columns[1].values = Values::F64(vec![scale, 2.0 * scale, 0.0]);
        write(FORMATS, &path, None, &file, WriteOptions { double_precision, ..WriteOptions::default() })
    };
    for (scale, text) in [(1e50, "beyond Float32"), (1e-60, "too little for Float32")] {
        let error = written(scale, false).unwrap_err().to_string();
        assert!(error.contains("Density of particle 0") && error.contains(text), "{error}");
        written(scale, true).unwrap();
    }
    written(1e-30, false).unwrap();
    written(0.0, false).unwrap();
}

const IMAGE: &str = r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="0.1" byte_order="LittleEndian">
<ImageData WholeExtent="0 2 0 1 0 0" Origin="1 2 3" Spacing="0.5 -1 1"><Piece Extent="0 2 0 1 0 0">
<PointData><DataArray type="Float64" Name="rho" format="ascii">0 1 2 10 11 12</DataArray></PointData>
<CellData><DataArray type="Float32" Name="c" format="ascii">5 6</DataArray></CellData>
</Piece></ImageData></VTKFile>"#;

#[test]
fn an_image_is_a_plane_grid_with_axes_that_ascend() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("i.vti");
    std::fs::write(&path, IMAGE).unwrap();
    let field = field(&path);
    let Geometry::Grid { axes, .. } = &field.geometry else { panic!("{:?}", field.geometry) };
    assert_eq!(axes.len(), 2);
    assert_eq!(axes[0].nodes, [1.0, 1.5, 2.0]);
    assert_eq!(axes[1].nodes, [1.0, 2.0]);
    assert_eq!(field.variable("rho").unwrap().values.to_f64(), [10.0, 11.0, 12.0, 0.0, 1.0, 2.0]);
    assert_eq!(field.variable("c").unwrap().location, Location::Cell);
    assert_eq!(field.density.as_deref(), Some("rho"));
}

const TETRAHEDRON: &str = "# vtk DataFile Version 3.0\none cell\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n\
0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nPOINT_DATA 4\nSCALARS density double 1\n\
LOOKUP_TABLE default\n1 2 3 4\nCELL_DATA 1\nFIELD FieldData 1\nq 1 1 int\n7\n";

#[test]
fn a_legacy_mesh_keeps_its_cells() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.vtk");
    std::fs::write(&path, TETRAHEDRON).unwrap();
    let field = field(&path);
    let Geometry::Mesh { dimension, cells, .. } = &field.geometry else { panic!("{:?}", field.geometry) };
    assert_eq!((*dimension, cells.types.as_slice()), (3, [10_u8].as_slice()));
    assert_eq!(cells.connectivity, [0, 1, 2, 3]);
    assert_eq!(field.variable("density").unwrap().values.to_f64(), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(field.variable("q").unwrap().values.to_f64(), [7.0]);
}

/// The third tetrahedron is another piece's, and the second is hidden.
#[test]
fn cells_of_other_pieces_and_hidden_ones_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.vtk");
    let mesh = |marks: &str| {
        format!(
            "# vtk DataFile Version 3.0\nthree cells\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 6 float\n\
             0 0 0 1 0 0 0 1 0 0 0 1 1 1 1 2 2 2\nCELLS 3 15\n4 0 1 2 3\n4 1 2 3 4\n4 2 3 4 5\nCELL_TYPES 3\n10 10 10\n\
             CELL_DATA 3\nSCALARS density double 1\nLOOKUP_TABLE default\n1 2 3\nVECTORS X%20Velocity double\n\
             1 1 1 2 2 2 3 3 3\n{marks}"
        )
    };
    let cells_of = |field: &RawField| match &field.geometry {
        Geometry::Mesh { cells, .. } => cells.clone(),
        other => panic!("{other:?}"),
    };
    std::fs::write(&path, mesh("")).unwrap();
    assert_eq!(cells_of(&field(&path)).types.len(), 3);
    for marks in [
        "SCALARS vtkGhostType unsigned_char 1\nLOOKUP_TABLE default\n0 32 1\n",
        "SCALARS vtkGhostLevels unsigned_char 1\nLOOKUP_TABLE default\n0 1 2\n",
    ] {
        std::fs::write(&path, mesh(marks)).unwrap();
        let field = field(&path);
        let cells = cells_of(&field);
        assert_eq!((cells.types, cells.offsets, cells.connectivity), (vec![10], vec![0, 4], vec![0, 1, 2, 3]));
        assert_eq!(field.variable("density").unwrap().values.to_f64(), [1.0]);
        // Names are encoded in legacy files.
        assert_eq!(field.variable("X Velocity").unwrap().values.to_f64(), [1.0; 3]);
        assert!(field.variables.iter().all(|v| !v.name.starts_with("vtkGhost")));
        assert!(field.notes.iter().any(|n| n.contains("2 of 3 cells are left out")), "{:?}", field.notes);
    }
    // The rest of a grid is none.
    let marked = IMAGE.replace(
        "<CellData>",
        "<CellData><DataArray type=\"UInt8\" Name=\"vtkGhostType\" format=\"ascii\">0 1</DataArray>",
    );
    let path = folder.path().join("i.vti");
    std::fs::write(&path, marked).unwrap();
    let error = read(FORMATS, &path, None, &FieldRequest::default()).unwrap_err().to_string();
    assert!(error.contains("vtkGhostType") && error.contains("1 cells"), "{error}");
}

#[test]
fn units_and_kernel_are_field_data() {
    let folder = tempfile::tempdir().unwrap();
    let file = particles(5);
    for (extension, has_texts) in [("vtu", false), ("vtp", true), ("vtk", false)] {
        let path = folder.path().join(format!("a.{extension}"));
        write(FORMATS, &path, None, &file, WriteOptions::default()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        for name in ["UnitLength_in_cm", "UnitMass_in_g", "UnitVelocity_in_cm_per_s", "KernelNeighbors"] {
            assert!(text.contains(name), "{extension}: {name}");
        }
        if extension != "vtk" {
            let length = format!(
                "Name=\"UnitLength_in_cm\" NumberOfTuples=\"1\" format=\"ascii\">{:e}<",
                file.header.units.length
            );
            assert!(text.contains(&length), "{extension}");
        }
        assert_eq!(text.contains("type=\"String\" Name=\"Kernel\""), has_texts, "{extension}");
    }
}

#[test]
fn damaged_files_are_errors_and_never_panics() {
    let folder = tempfile::tempdir().unwrap();
    let mut originals = vec![(IMAGE.as_bytes().to_vec(), "vti"), (TETRAHEDRON.as_bytes().to_vec(), "vtk")];
    for extension in ["vtu", "vtp", "vtk"] {
        let path = folder.path().join(format!("whole.{extension}"));
        write(FORMATS, &path, None, &particles(60), WriteOptions::default()).unwrap();
        originals.push((std::fs::read(&path).unwrap(), extension));
    }
    let (mut refused, mut tried) = (0, 0);
    for (bytes, extension) in originals {
        let path = folder.path().join(format!("broken.{extension}"));
        let mut check = |damaged: &[u8]| {
            replace(&path, damaged);
            tried += 1;
            refused += usize::from(read(FORMATS, &path, None, &FieldRequest::default()).is_err());
        };
        (0..bytes.len()).step_by(64).for_each(|end| check(&bytes[..end]));
        for k in 0..200_usize {
            let mut damaged = bytes.clone();
            let at = k.wrapping_mul(2_654_435_761) % bytes.len();
            damaged[at] ^= 1 << (k % 8);
            check(&damaged);
        }
    }
    assert!(refused * 3 > tried, "{refused} of {tried} damaged files refused");
}

#[test]
fn an_absurd_size_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("a.vtk", TETRAHEDRON.replace("POINTS 4", "POINTS 4000000000000")),
        ("b.vti", IMAGE.replace("0 2 0 1 0 0", "0 2000000000 0 2000000000 0 2000000000")),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        read(FORMATS, &path, None, &FieldRequest::default()).unwrap_err();
    }
}

#[test]
fn garbage_where_a_number_belongs_is_refused_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |name: &str, text: String| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        read(FORMATS, &path, None, &FieldRequest::default()).unwrap_err().to_string()
    };
    let components = |n: &str| IMAGE.replacen("<DataArray", &format!("<DataArray NumberOfComponents=\"{n}\""), 1);
    for (n, expected) in [("three", "NumberOfComponents 'three'"), ("0", "'0'"), ("-1", "'-1'"), ("1e99", "'1e99'")] {
        let text = refusal("a.vti", components(n));
        assert!(text.contains("array '") && text.contains(expected), "{text}");
    }
    for (from, to, expected) in [
        ("0 2 0 1 0 0", "0 2 zero 1 0 0", "Extent: is '0 2 zero 1 0 0'"),
        ("0 2 0 1 0 0", "0 2 0 1 0 0 9", "expected six ascending integers"),
        ("0 2 0 1 0 0", "0 2000000000 0 1 0 0", "Extent: declares [2000000001, 2, 1] nodes"),
        ("Spacing=\"", "Spacing=\"x ", "Spacing: is 'x "),
        ("byte_order=\"LittleEndian\"", "byte_order=\"Little\"", "attribute byte_order of VTKFile: is 'Little'"),
    ] {
        assert!(IMAGE.contains(from), "{from}");
        let text = refusal("b.vti", IMAGE.replace(from, to));
        assert!(text.contains(expected), "{text}\n{expected}");
    }
    for (from, to, expected) in [
        ("POINTS 4", "POINTS -4", "'-4' stands where a count is expected"),
        ("POINTS 4", "POINTS 4000000000000", "more than is left of the file"),
        ("density double 1", "density double many", "SCALARS 'density' have 'many' components"),
        ("CELL_TYPES 1\n10", "CELL_TYPES 1\n999", "cell type 999 is none of VTK's"),
    ] {
        assert!(TETRAHEDRON.contains(from), "{from}");
        let text = refusal("c.vtk", TETRAHEDRON.replace(from, to));
        assert!(text.contains(expected) && text.contains("byte "), "{text}\n{expected}");
    }
    let points = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 16000000 1 1\n";
    let text = refusal("d.vtk", points.into());
    assert!(text.contains("DIMENSIONS are [16000000, 1, 1]"), "{text}");
}

/// VTK writes the range of vectors into the array's element; its numbers are none of the array's.
#[test]
fn numbers_of_elements_within_an_array_are_not_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("i.vti");
    let key = "<InformationKey name=\"L2_NORM_RANGE\" length=\"2\"><Value index=\"0\">\n1.5\n</Value></InformationKey>";
    std::fs::write(&path, IMAGE.replace("0 1 2 10 11 12<", &format!("0 1 2 10 11 12 {key}<"))).unwrap();
    assert_eq!(field(&path).variable("rho").unwrap().values.to_f64(), [10.0, 11.0, 12.0, 0.0, 1.0, 2.0]);
}
