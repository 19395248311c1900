//! One scene in every form that a field may have: the particles do not tell which file they came from.
//!
//! `tests/data/cube.nc4` is made by `tests/data/make.py`; the other forms are written here.

#![cfg(all(feature = "netcdf", feature = "vtk", feature = "table", feature = "numpy"))]

use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use sph_formats::common::particle_names as names;
use sph_formats::{FORMATS, FieldRequest, FileContent};
use sph_prep::relaxation::Control;
use sph_prep::run::pipeline;
use sph_prep::scene::Scene;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Particles made of each form.
const COUNT: usize = 100;
/// Nodes per axis.
const N: usize = 5;

fn node(i: usize) -> f64 {
    i as f64 / (N - 1) as f64
}

/// The density at a node: exact in binary and short in decimals.
fn density(i: usize, j: usize, k: usize) -> f64 {
    1.0 + (node(i) + 2.0 * node(j) + 4.0 * node(k) * node(k)) / 2.0
}

/// Positions and densities of all nodes, x fastest.
fn nodes() -> Vec<([f64; 3], f64)> {
    let index = |n: usize| (n % N, n / N % N, n / (N * N));
    (0..N * N * N).map(index).map(|(i, j, k)| ([node(i), node(j), node(k)], density(i, j, k))).collect()
}

fn densities() -> String {
    nodes().iter().map(|(_, rho)| format!("{rho} ")).collect()
}

fn points() -> String {
    nodes().iter().map(|([x, y, z], _)| format!("{x} {y} {z}\n")).collect()
}

fn axis() -> String {
    (0..N).map(|i| format!("{} ", node(i))).collect()
}

/// The eight corners of every cell in VTK's order.
fn hexahedra() -> Vec<[usize; 8]> {
    let at = |i: usize, j: usize, k: usize| i + N * (j + N * k);
    let mut cells = Vec::new();
    for k in 0..N - 1 {
        for j in 0..N - 1 {
            for i in 0..N - 1 {
                let face = |k| [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)];
                let ([a, b, c, d], [e, f, g, h]) = (face(k), face(k + 1));
                cells.push([a, b, c, d, e, f, g, h]);
            }
        }
    }
    cells
}

fn netcdf_classic(path: &Path) {
    let line: Vec<f64> = (0..N).map(node).collect();
    let rho: Vec<f64> = nodes().iter().map(|n| n.1).collect();
    let mut file = ClassicFile::new();
    let axes = ["z", "y", "x"].map(|name| file.dimension(name, N));
    for (name, id) in ["z", "y", "x"].into_iter().zip(axes) {
        file.variable(name, &[id], Data::F64(&line), &[]);
    }
    file.variable("density", &axes, Data::F64(&rho), &[]);
    file.write(path).unwrap();
}

fn xml(kind: &str, extent: &str, geometry: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\"><{kind} {extent}><Piece {piece}>
<PointData Scalars=\"density\"><DataArray type=\"Float64\" Name=\"density\" format=\"ascii\">{rho}</DataArray></PointData>
{geometry}</Piece></{kind}></VTKFile>\n",
        piece = extent.replace("WholeExtent", "Extent"),
        rho = densities(),
    )
}

fn data_array(name: &str, components: usize, content: &str) -> String {
    let kind = if name == "types" {
        "UInt8"
    } else if components == 0 {
        "Int64"
    } else {
        "Float64"
    };
    let components = components.max(1);
    format!(
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">{content}</DataArray>"
    )
}

fn unstructured() -> String {
    let cells = hexahedra();
    let connectivity: String = cells.iter().flatten().map(|p| format!("{p} ")).collect();
    let offsets: String = (1..=cells.len()).map(|c| format!("{} ", 8 * c)).collect();
    let geometry = format!(
        "<Points>{}</Points><Cells>{}{}{}</Cells>",
        data_array("Points", 3, &points()),
        data_array("connectivity", 0, &connectivity),
        data_array("offsets", 0, &offsets),
        data_array("types", 0, &"12 ".repeat(cells.len())),
    );
    let extent = format!("NumberOfPoints=\"{}\" NumberOfCells=\"{}\"", N * N * N, cells.len());
    xml("UnstructuredGrid", &extent, &geometry).replacen(
        &format!("<UnstructuredGrid {extent}>"),
        "<UnstructuredGrid>",
        1,
    )
}

fn legacy(geometry: &str) -> String {
    format!(
        "# vtk DataFile Version 3.0\na cube\nASCII\nDATASET {geometry}\nPOINT_DATA {}\nSCALARS density double 1\nLOOKUP_TABLE default\n{}\n",
        N * N * N,
        densities()
    )
}

/// The scene in every form: those of a grid, then those of a mesh.
fn write_all(folder: &Path) -> (Vec<PathBuf>, Vec<PathBuf>) {
    let put = |name: &str, content: String| {
        let path = folder.join(name);
        std::fs::write(&path, content).unwrap();
        path
    };
    let last = N - 1;
    let extent = format!("WholeExtent=\"0 {last} 0 {last} 0 {last}\"");
    let classic = folder.join("cube.nc");
    netcdf_classic(&classic);
    let image = format!("{extent} Origin=\"0 0 0\" Spacing=\"0.25 0.25 0.25\"");
    let lines = ["x", "y", "z"].map(|name| data_array(name, 1, &axis())).concat();
    let mut table = "x,y,z,density\n".to_owned();
    nodes().iter().for_each(|([x, y, z], rho)| writeln!(table, "{x},{y},{z},{rho}").unwrap());
    let (a, n) = (axis(), N * N * N);
    let grids = vec![
        classic,
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/cube.nc4"),
        put("image.vti", xml("ImageData", &image, "")),
        put("lines.vtr", xml("RectilinearGrid", &extent, &format!("<Coordinates>{lines}</Coordinates>"))),
        put(
            "a.vtk",
            legacy(&format!("STRUCTURED_POINTS\nDIMENSIONS {N} {N} {N}\nORIGIN 0 0 0\nSPACING 0.25 0.25 0.25")),
        ),
        put(
            "b.vtk",
            legacy(&format!(
                "RECTILINEAR_GRID\nDIMENSIONS {N} {N} {N}\nX_COORDINATES {N} double\n{a}\nY_COORDINATES {N} double\n{a}\nZ_COORDINATES {N} double\n{a}"
            )),
        ),
        put("cube.csv", table),
    ];
    let mesh = format!("<Points>{}</Points>", data_array("Points", 3, &points()));
    let hexahedra: String = hexahedra().iter().map(|c| format!("8 {}\n", c.map(|p| p.to_string()).join(" "))).collect();
    let cells = (N - 1).pow(3);
    let meshes = vec![
        put("curved.vts", xml("StructuredGrid", &extent, &mesh)),
        put("cells.vtu", unstructured()),
        put("c.vtk", legacy(&format!("STRUCTURED_GRID\nDIMENSIONS {N} {N} {N}\nPOINTS {n} double\n{}", points()))),
        put(
            "d.vtk",
            legacy(&format!(
                "UNSTRUCTURED_GRID\nPOINTS {n} double\n{}CELLS {cells} {}\n{hexahedra}CELL_TYPES {cells}\n{}",
                points(),
                9 * cells,
                "12\n".repeat(cells)
            )),
        ),
    ];
    (grids, meshes)
}

/// Positions and masses of the particles that a file gives.
fn particles(folder: &Path, input: &Path) -> Vec<f64> {
    let mut scene = Scene::parse("particles: 100\nseed: 5\npolish: none\nwvt: {iterations: 2}").unwrap();
    scene.input.file = Some(input.into());
    scene.input.density = Some("density".into());
    scene.output.double_precision = true;
    let output = folder.join("out.npz");
    scene.output.file = Some(output.clone());
    let stop = AtomicBool::new(false);
    let control = Control { deadline: None, interrupted: &stop, observer: &|_| {} };
    pipeline::run(&scene, FORMATS, &control).unwrap_or_else(|e| panic!("{}: {e}", input.display()));
    match sph_formats::read(FORMATS, &output, None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(p) => {
            let column = |name: &str| p.species[0].table.column(name).unwrap().values.to_f64();
            [names::COORDINATES, names::MASSES, names::DENSITY].map(column).concat()
        }
        FileContent::Field(_) => panic!("read as a field"),
    }
}

#[test]
fn one_scene_in_every_form_gives_the_same_particles() {
    let folder = tempfile::tempdir().unwrap();
    let (grids, meshes) = write_all(folder.path());
    let first = particles(folder.path(), &grids[0]);
    assert_eq!(first.len(), 5 * COUNT);
    for grid in &grids[1..] {
        assert!(particles(folder.path(), grid) == first, "{} differs", grid.display());
    }
    let mesh = particles(folder.path(), &meshes[0]);
    for other in &meshes[1..] {
        assert!(particles(folder.path(), other) == mesh, "{} differs", other.display());
    }
    // A mesh is a body of its own shape, not a box, so its particles lie elsewhere; but they weigh the same.
    let mass = |v: &[f64]| v[3 * COUNT..4 * COUNT].iter().sum::<f64>();
    let (a, b) = (mass(&first), mass(&mesh));
    assert!((a - b).abs() <= 1e-12 * a, "{a} of the grids is {b} of the meshes");
}
