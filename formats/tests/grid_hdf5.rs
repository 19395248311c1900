//! HDF5 grids of Athena++ and PLUTO, made here block by block. Values are f(x, y, z) at the middle of their cell, so that a
//! cell in the wrong place has a wrong value.

use crate::support::refuses_flipped_bits;
use rust_hdf5::H5File;
use sph_formats::{FORMATS, FieldRequest, FileContent, Geometry, Location, RawField, Result, read};
use std::path::Path;

fn attempt(path: &Path) -> Result<RawField> {
    match read(FORMATS, path, None, &FieldRequest::default())? {
        FileContent::Field(field) => Ok(field),
        FileContent::Particles(_) => panic!("a grid holds no particles"),
    }
}

fn f(x: f64, y: f64, z: f64) -> f32 {
    (x + 100.0 * y + 1e4 * z) as f32
}

/// Every value of the density is the function at the middle of its cell.
fn check(field: &RawField, cells: &[usize]) {
    let Geometry::Grid { axes, .. } = &field.geometry else { panic!("{:?}", field.geometry) };
    assert_eq!(axes.iter().map(|a| a.nodes.len()).collect::<Vec<_>>(), cells);
    let values = &field.variable(field.density.as_deref().unwrap()).unwrap().values;
    assert_eq!(values.len(), cells.iter().product::<usize>());
    for flat in 0..values.len() {
        let (mut rest, mut x) = (flat, [0.0; 3]);
        for (axis, nodes) in axes.iter().enumerate() {
            x[axis] = nodes.nodes[rest % nodes.nodes.len()];
            rest /= nodes.nodes.len();
        }
        let expected = f64::from(f(x[0], x[1], x[2]));
        assert!((values.get(flat) - expected).abs() <= 1e-5 * expected.abs(), "{x:?}: {}", values.get(flat));
    }
}

fn face(axis: usize, i: usize) -> f32 {
    // Not uniform: x grows by 3 % a cell.
    [1.03_f32.powi(i as i32), 0.5 * i as f32, i as f32][axis]
}

/// Four blocks of 4 x 3 x 2 cells in a grid of 8 x 6 x 2, in an order of their own.
fn athena(path: &Path, places: &[[i64; 3]; 4], level: i32, coordinates: &str) {
    let file = H5File::create(path).unwrap();
    let block = [4, 3, 2];
    let root = file.root_group();
    root.set_attr_string("Coordinates", coordinates).unwrap();
    root.set_attr_array_numeric("RootGridSize", &[8_i32, 6, 2]).unwrap();
    root.set_attr_array_numeric("MeshBlockSize", &block.map(|n| n as i32)).unwrap();
    root.set_attr_numeric("NumMeshBlocks", &4_i32).unwrap();
    root.set_attr_numeric("MaxLevel", &level).unwrap();
    root.set_attr_numeric("Time", &1.5_f32).unwrap();
    root.set_attr_string_array("DatasetNames", &["prim", "B"]).unwrap();
    root.set_attr_array_numeric("NumVariables", &[2_i32, 1]).unwrap();
    root.set_attr_string_array("VariableNames", &["press", "rho", "Bcc1"]).unwrap();
    let flat: Vec<i64> = places.iter().flatten().copied().collect();
    file.new_dataset::<i64>().shape([4, 3]).create("LogicalLocations").unwrap().write_raw(&flat).unwrap();
    let first = |b: usize, k: usize| places[b][k].max(0) as usize * block[k];
    for (axis, n) in block.into_iter().enumerate() {
        let faces: Vec<f32> = (0..4).flat_map(|b| (0..=n).map(move |i| face(axis, first(b, axis) + i))).collect();
        let name = format!("x{}f", axis + 1);
        file.new_dataset::<f32>().shape([4, n + 1]).create(&name).unwrap().write_raw(&faces).unwrap();
    }
    let middle = |axis, i| 0.5 * (f64::from(face(axis, i)) + f64::from(face(axis, i + 1)));
    let mut prim = vec![7.0_f32; 4 * 24];
    for b in 0..4 {
        for k in 0..2 {
            for j in 0..3 {
                for i in 0..4 {
                    let at = [first(b, 0) + i, first(b, 1) + j, first(b, 2) + k];
                    prim.push(f(middle(0, at[0]), middle(1, at[1]), middle(2, at[2])));
                }
            }
        }
    }
    file.new_dataset::<f32>().shape([2, 4, 2, 3, 4]).create("prim").unwrap().write_raw(&prim).unwrap();
    file.new_dataset::<f32>().shape([1, 4, 2, 3, 4]).create("B").unwrap().write_raw(&[9.0_f32; 96]).unwrap();
    file.close().unwrap();
}

const PLACES: [[i64; 3]; 4] = [[1, 1, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0]];

#[test]
fn blocks_of_athena_lie_where_they_say() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.athdf", "a.h5", "a"] {
        let path = folder.path().join(name);
        athena(&path, &PLACES, 0, "cartesian");
        let field = attempt(&path).unwrap();
        check(&field, &[8, 6, 2]);
        assert_eq!((field.format, field.density.as_deref()), ("grid-hdf5", Some("rho")));
        assert_eq!(field.variable("press").unwrap().values.to_f64(), [7.0; 96]);
        assert_eq!(field.variable("Bcc1").unwrap().values.to_f64(), [9.0; 96]);
        assert_eq!(field.metadata, [("time".to_owned(), "1.5".to_owned())]);
    }
}

#[test]
fn what_is_no_uniform_grid_of_athena_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.athdf");
    let refusal = |places: [[i64; 3]; 4], level, coordinates: &str| {
        athena(&path, &places, level, coordinates);
        attempt(&path).unwrap_err().to_string()
    };
    let text = refusal(PLACES, 2, "cartesian");
    assert!(text.contains("dataset 'Levels'"), "{text}");
    let text = refusal(PLACES, 0, "schwarzschild");
    assert!(text.contains("coordinates 'schwarzschild'"), "{text}");
    let text = refusal([[1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]], 0, "cartesian");
    assert!(text.contains("two blocks are at [1, 1, 0]"), "{text}");
    let text = refusal([[1, 1, 0], [0, 0, 0], [2, 1, 0], [-1, 1, 0]], 0, "cartesian");
    assert!(text.contains("block 2 is at [2.0, 1.0, 0.0]"), "{text}");
}

fn pluto(path: &Path, cells: &[usize], bend: f64) {
    let file = H5File::create(path).unwrap();
    let step = file.create_group("Timestep_12").unwrap();
    step.set_attr_numeric("Time", &0.25_f64).unwrap();
    let vars = step.create_group("vars").unwrap();
    let shape: Vec<usize> = cells.iter().rev().copied().collect();
    let nodes: Vec<usize> = shape.iter().map(|n| n + 1).collect();
    let coordinates = file.create_group("node_coords").unwrap();
    let index = |flat: usize, shape: &[usize]| {
        let (mut rest, mut at) = (flat, [0; 3]);
        for (axis, n) in shape.iter().rev().enumerate() {
            at[axis] = rest % n;
            rest /= n;
        }
        at
    };
    for (axis, name) in ["X", "Y", "Z"].iter().enumerate().take(cells.len()) {
        let at = |flat: usize| {
            let i = index(flat, &nodes);
            f64::from(face(axis, i[axis])) + bend * (i[(axis + 1) % cells.len()] as f64)
        };
        let values: Vec<f32> = (0..nodes.iter().product()).map(|flat| at(flat) as f32).collect();
        coordinates.new_dataset::<f32>().shape(&nodes).create(name).unwrap().write_raw(&values).unwrap();
    }
    let middle = |axis: usize, i: usize| match axis < cells.len() {
        true => 0.5 * (f64::from(face(axis, i)) + f64::from(face(axis, i + 1))),
        false => 0.0,
    };
    let rho: Vec<f64> = (0..shape.iter().product())
        .map(|flat| index(flat, &shape))
        .map(|i| f64::from(f(middle(0, i[0]), middle(1, i[1]), middle(2, i[2]))))
        .collect();
    for (name, data) in [("prs", &vec![1.0; rho.len()]), ("rho", &rho)] {
        vars.new_dataset::<f64>().shape(&shape).create(name).unwrap().write_raw(data).unwrap();
    }
    file.close().unwrap();
}

#[test]
fn a_step_of_pluto_has_its_axes_and_values() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("data.0012.dbl.h5");
    grid_out(folder.path(), "CARTESIAN");
    for cells in [vec![5, 4, 3], vec![6, 2], vec![9]] {
        pluto(&path, &cells, 0.0);
        let field = attempt(&path).unwrap();
        check(&field, &cells);
        assert_eq!((field.format, field.metadata[0].1.as_str()), ("grid-hdf5", "0.25"));
        assert_eq!(field.variable("prs").map(|v| v.location), Some(Location::Node));
    }
    pluto(&path, &[5, 4], 0.01);
    let text = attempt(&path).unwrap_err().to_string();
    assert!(text.contains("a curvilinear grid: X does not depend"), "{text}");
}

/// The head of the file that PLUTO writes beside its output.
fn grid_out(folder: &Path, geometry: &str) {
    let text = format!(
        "# ****\n# PLUTO 4.4 Grid File\n# \n# DIMENSIONS: 2\n# GEOMETRY:   {geometry}\n# X1: [ 1, 2], 3 point(s)\n"
    );
    std::fs::write(folder.join("grid.out"), text).unwrap();
}

#[test]
fn radii_of_pluto_are_not_taken_for_x() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("data.0001.flt.h5");
    let text = |cells: &[usize]| {
        pluto(&path, cells, 0.0);
        attempt(&path).map(|f| f.geometry.kind()).map_err(|e| e.to_string())
    };
    // Nothing says what the first coordinate is.
    assert_eq!(text(&[5, 4, 3]), Ok("grid"));
    for cells in [&[6, 2][..], &[9]] {
        let refused = text(cells).unwrap_err();
        assert!(refused.contains("may be x or a radius") && refused.contains("grid.out"), "{refused}");
    }
    // Coordinates that are known, but not where their cells are.
    for geometry in ["CYLINDRICAL", "POLAR", "SPHERICAL"] {
        grid_out(folder.path(), geometry);
        let refused = text(&[6, 2]).unwrap_err();
        assert!(refused.contains("grid.out") && refused.contains("before its number of cells"), "{refused}");
    }
    grid_out(folder.path(), "TOROIDAL");
    assert!(text(&[6, 2]).unwrap_err().contains("coordinates 'TOROIDAL'"));
    grid_out(folder.path(), "SPHERICAL");
    assert_eq!(text(&[9]), Ok("radial profile"));
    let field = attempt(&path).unwrap();
    assert_eq!(field.variable("rho").map(|v| (v.location, v.values.len())), Some((Location::Cell, 9)));
    grid_out(folder.path(), "CYLINDRICAL");
    assert!(text(&[9]).is_err());
}

#[test]
fn other_hdf5_files_are_refused_by_name_and_damage_never_panics() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.athdf");
    let file = H5File::create(&path).unwrap();
    file.create_group("level_0").unwrap();
    file.close().unwrap();
    let request = FieldRequest::default();
    let text = read(FORMATS, &path, Some("grid-hdf5"), &request).unwrap_err().to_string();
    assert!(text.contains("Chombo"), "{text}");
    let file = H5File::create(&path).unwrap();
    for name in ["bounding box", "refine level"] {
        file.new_dataset::<f32>().shape([2]).create(name).unwrap().write_raw(&[0.0_f32; 2]).unwrap();
    }
    file.close().unwrap();
    let text = read(FORMATS, &path, None, &request).unwrap_err().to_string();
    assert!(text.contains("no variable of blocks"), "{text}");
    athena(&path, &PLACES, 0, "cartesian");
    refuses_flipped_bits(&path, "grid-hdf5", &request);
}
