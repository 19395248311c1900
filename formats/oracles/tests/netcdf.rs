//! The C library as an oracle for NetCDF: it reads our classic files, and we read what it writes.

use ::netcdf::{AttributeValue, Options};
use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use sph_formats::registry::detect;
use sph_formats::{FORMATS, FieldRequest, FileContent, Geometry, RawField, Values};
use std::path::Path;

fn read(path: &Path, request: &FieldRequest) -> RawField {
    let spec = detect(FORMATS, path, None).unwrap();
    assert_eq!(spec.name, "netcdf");
    match (spec.read.unwrap())(path, request).unwrap() {
        FileContent::Field(field) => field,
        FileContent::Particles(_) => panic!("particles"),
    }
}

/// Every way in which the C library can lay out a file.
const KINDS: [(&str, Options); 4] = [
    ("CDF-1", Options::empty()),
    ("CDF-2", Options::_64BIT_OFFSET),
    ("CDF-5", Options::_64BIT_DATA),
    ("NetCDF-4", Options::NETCDF4),
];

#[test]
fn the_c_library_reads_classic_files_of_ours() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ours.nc");
    let r: Vec<f64> = (0..1001).map(|i| f64::from(i) / 7.0).collect();
    let rho: Vec<f32> = r.iter().map(|r| (-r).exp() as f32).collect();
    let layer: Vec<i32> = (0..1001).map(|i| i * 3 - 5).collect();
    let flag: Vec<i8> = (0..1001).map(|i| (i % 200 - 100) as i8).collect();
    let mut file = ClassicFile::new();
    file.attribute("title", "é star");
    file.attribute("mass", 1.25);
    let d = file.dimension("radius", r.len());
    // The odd-sized bytes come first: what follows shows whether they were padded.
    file.variable("flag", &[d], Data::I8(&flag), &[]);
    file.variable("radius", &[d], Data::F64(&r), &[("units", "cm".into())]);
    file.variable("rho", &[d], Data::F32(&rho), &[("units", "g cm-3".into())]);
    file.variable("layer", &[d], Data::I32(&layer), &[]);
    file.write(&path).unwrap();

    let theirs = netcdf::open(&path).unwrap();
    assert_eq!(theirs.dimension_len("radius"), Some(1001));
    assert_eq!(theirs.attribute("title").unwrap().value().unwrap(), AttributeValue::Str("é star".into()));
    assert_eq!(theirs.attribute("mass").unwrap().value().unwrap(), AttributeValue::Double(1.25));
    let variable = |name: &str| theirs.variable(name).unwrap();
    assert_eq!(variable("flag").get_values::<i8, _>(..).unwrap(), flag);
    assert_eq!(variable("radius").get_values::<f64, _>(..).unwrap(), r);
    assert_eq!(variable("rho").get_values::<f32, _>(..).unwrap(), rho);
    assert_eq!(variable("layer").get_values::<i32, _>(..).unwrap(), layer);
    let units = variable("rho").attribute_value("units").unwrap().unwrap();
    assert_eq!(units, AttributeValue::Str("g cm-3".into()));
}

const SHAPE: [usize; 3] = [4, 5, 6];

/// The density at a point of the test grid.
fn density(x: f64, y: f64, z: f64, time: f64) -> f64 {
    1.0 + x + 10.0 * y + 100.0 * z + 1000.0 * time
}

/// A grid (time, z, x, y) with y descending and two records of f32, beside packed and 64-bit variables.
fn write_grid(path: &Path, options: Options) {
    let [nx, ny, nz] = SHAPE;
    let chunked = options.contains(Options::NETCDF4);
    let mut file = netcdf::create_with(path, options).unwrap();
    file.add_unlimited_dimension("time").unwrap();
    for (name, n) in [("z", nz), ("x", nx), ("y", ny)] {
        file.add_dimension(name, n).unwrap();
    }
    for name in ["x", "y", "z"] {
        let mut axis = file.add_variable::<f64>(name, &[name]).unwrap();
        axis.put_attribute("axis", name.to_uppercase()).unwrap();
    }
    let axes = ["time", "z", "x", "y"];
    file.add_variable::<f64>("time", &["time"]).unwrap().put_attribute("units", "days since 2000-01-01").unwrap();
    let mut rho = file.add_variable::<f32>("rho", &axes).unwrap();
    if chunked {
        rho.set_chunking(&[1, 2, 3, 2]).unwrap();
        rho.set_compression(5, true).unwrap();
    }
    rho.put_attribute("units", "kg m-3").unwrap();
    let mut packed = file.add_variable::<i16>("packed", &axes).unwrap();
    packed.put_attribute("scale_factor", 0.5).unwrap();
    packed.put_attribute("add_offset", -3.0).unwrap();
    packed.put_attribute("_FillValue", 0i16).unwrap();
    if !chunked {
        file.enddef().unwrap();
    }
    for (name, n) in [("x", nx), ("y", ny), ("z", nz)] {
        let nodes: Vec<f64> = (0..n).map(|i| if name == "y" { n - 1 - i } else { i } as f64).collect();
        file.variable_mut(name).unwrap().put_values(&nodes, ..).unwrap();
    }
    for time in 0..2 {
        file.variable_mut("time").unwrap().put_values(&[time as f64], [time..time + 1]).unwrap();
        let mut values = Vec::new();
        for z in 0..nz {
            for x in 0..nx {
                values.extend((0..ny).rev().map(|y| density(x as f64, y as f64, z as f64, time as f64) as f32));
            }
        }
        let extents = (time..time + 1, .., .., ..);
        file.variable_mut("rho").unwrap().put_values(&values, extents.clone()).unwrap();
        let small: Vec<i16> = (0..values.len() as i16).collect();
        file.variable_mut("packed").unwrap().put_values(&small, extents).unwrap();
    }
}

#[test]
fn grids_of_the_c_library_are_read_in_every_layout() {
    let folder = tempfile::tempdir().unwrap();
    let [nx, ny, nz] = SHAPE;
    for (kind, options) in KINDS {
        let path = folder.path().join("theirs.nc");
        write_grid(&path, options);
        let field = read(&path, &FieldRequest { time: Some(0.9), ..FieldRequest::default() });
        let Geometry::Grid { axes, .. } = &field.geometry else { panic!("{kind}: {:?}", field.geometry) };
        let lengths: Vec<_> = axes.iter().map(|a| (a.name.as_str(), a.nodes.len())).collect();
        assert_eq!(lengths, [("x", nx), ("y", ny), ("z", nz)], "{kind}");
        let Values::F32(rho) = &field.variable("rho").unwrap().values else { panic!("{kind}: not f32") };
        let packed = &field.variable("packed").unwrap().values;
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let i = x + nx * (y + ny * z);
                    assert_eq!(f64::from(rho[i]), density(x as f64, y as f64, z as f64, 1.0), "{kind} {x} {y} {z}");
                    let stored = (ny - 1 - y) + ny * (x + nx * z);
                    let value = packed.get(i);
                    if stored == 0 {
                        assert!(value.is_nan(), "{kind}: the fill value is read as {value}");
                    } else {
                        assert_eq!(value, 0.5 * stored as f64 - 3.0, "{kind}");
                    }
                }
            }
        }
    }
}

#[test]
fn profiles_of_the_c_library_are_read_in_every_type() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("profile.nc");
    let r = [0.0f32, 0.5, 0.5, 2.0];
    let mut file = netcdf::create(&path).unwrap();
    file.add_dimension("r", r.len()).unwrap();
    file.add_variable::<f32>("r", &["r"]).unwrap().put_values(&r, ..).unwrap();
    file.add_variable::<f64>("rho", &["r"]).unwrap().put_values(&[9.0, 8.0, 2.0, 1.0], ..).unwrap();
    file.add_variable::<u8>("u8", &["r"]).unwrap().put_values(&[0u8, 1, 200, 255], ..).unwrap();
    file.add_variable::<i8>("i8", &["r"]).unwrap().put_values(&[-128i8, -1, 0, 127], ..).unwrap();
    file.add_variable::<u16>("u16", &["r"]).unwrap().put_values(&[0u16, 1, 2, 65_000], ..).unwrap();
    file.add_variable::<u32>("u32", &["r"]).unwrap().put_values(&[0u32, 1, 2, 4_000_000_000], ..).unwrap();
    file.add_variable::<i64>("i64", &["r"]).unwrap().put_values(&[-1i64, 0, 1, 1 << 52], ..).unwrap();
    let filled = [1i64, -9_223_372_036_854_775_806, 3, 4];
    file.add_variable::<i64>("filled", &["r"]).unwrap().put_values(&filled, ..).unwrap();
    file.close().unwrap();

    let field = read(&path, &FieldRequest::default());
    let Geometry::Radial { nodes, .. } = &field.geometry else { panic!("{:?}", field.geometry) };
    assert_eq!(nodes, &[0.0, 0.5, 0.5, 2.0]);
    let values = |name: &str| field.variable(name).unwrap().values.to_f64();
    assert_eq!(values("rho"), [9.0, 8.0, 2.0, 1.0]);
    assert_eq!(values("u8"), [0.0, 1.0, 200.0, 255.0]);
    assert_eq!(values("i8"), [-128.0, -1.0, 0.0, 127.0]);
    assert_eq!(values("u16"), [0.0, 1.0, 2.0, 65_000.0]);
    assert_eq!(values("u32"), [0.0, 1.0, 2.0, 4e9]);
    assert!(values("filled")[1].is_nan());
    assert_eq!(values("i64"), [-1.0, 0.0, 1.0, (1u64 << 52) as f64]);
}
