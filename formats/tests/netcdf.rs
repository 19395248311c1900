//! NetCDF fields: axes, order, masks, packing, records, the choice of the density, and damage.

use crate::support::replace;
use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use sph_formats::registry::detect;
use sph_formats::{Coordinates, FORMATS, FieldRequest, FileContent, FormatError, Geometry, RawField, Values};
use std::path::{Path, PathBuf};

fn read(path: &Path, request: &FieldRequest) -> Result<RawField, FormatError> {
    let spec = detect(FORMATS, path, None)?;
    assert_eq!(spec.name, "netcdf");
    match (spec.read.unwrap())(path, request)? {
        FileContent::Field(field) => Ok(field),
        FileContent::Particles(_) => panic!("particles"),
    }
}

/// Writes `file` and reads it back.
fn through(file: &ClassicFile, request: &FieldRequest) -> Result<RawField, FormatError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nc");
    file.write(&path).unwrap();
    read(&path, request)
}

fn refusal(file: &ClassicFile, request: &FieldRequest) -> String {
    through(file, request).unwrap_err().to_string()
}

/// Each rounded by itself, neighbors disagree by the last digit about where they meet.
#[test]
fn bounds_in_single_precision_tile_their_axis() {
    let n = 50;
    let centers: Vec<f32> = (0..n).map(|i| (100.0 + (f64::from(i) + 0.5) * 0.013) as f32).collect();
    let bounds: Vec<f32> = centers.iter().flat_map(|c| [c - 0.0065, c + 0.0065]).collect();
    assert!(
        bounds.chunks(2).zip(bounds.chunks(2).skip(1)).any(|(a, b)| a[1] != b[0]),
        "all meet: choose other numbers"
    );
    let ones = vec![1.0_f32; n as usize];
    let with = |bounds: &[f32]| {
        let mut file = ClassicFile::new();
        let (x, two) = (file.dimension("x", n as usize), file.dimension("two", 2));
        file.variable("x", &[x], Data::F32(&centers), &[("axis", "X".into()), ("bounds", "x_b".into())]);
        file.variable("x_b", &[x, two], Data::F32(bounds), &[]);
        file.variable("density", &[x], Data::F32(&ones), &[]);
        let field = through(&file, &FieldRequest::default()).unwrap();
        let Geometry::Grid { axes, .. } = field.geometry else { panic!("{:?}", field.geometry) };
        axes[0].bounds.clone()
    };
    assert_eq!(with(&bounds).map(|b| b.len()), Some(51));
    // A gap of a tenth of a cell is none of digits.
    let mut gap = bounds.clone();
    gap[1] -= 0.0013;
    assert_eq!(with(&gap), None);
}

#[test]
fn a_profile_from_the_surface_inward_is_turned_and_keeps_its_jump() {
    let r = [3.0, 2.0, 2.0, 0.0];
    let rho = [0.5f32, 1.0, 4.0, 8.0];
    let mut file = ClassicFile::new();
    file.attribute("title", "two layers");
    let d = file.dimension("r", 4);
    file.variable("r", &[d], Data::F64(&r), &[("units", "km".into())]);
    file.variable("rho", &[d], Data::F32(&rho), &[("units", "kg/m^3".into())]);
    file.variable("u", &[d], Data::F64(&r), &[]);
    let field = through(&file, &FieldRequest::default()).unwrap();
    let Geometry::Radial { nodes, unit } = &field.geometry else { panic!("{:?}", field.geometry) };
    assert_eq!(nodes, &[0.0, 2.0, 2.0, 3.0]);
    assert_eq!(unit.as_ref().unwrap().to_cgs, 1e5);
    assert_eq!(field.density.as_deref(), Some("rho"));
    let density = field.variable("rho").unwrap();
    assert_eq!(density.values, Values::F32(vec![8.0, 4.0, 1.0, 0.5]));
    assert_eq!(density.unit.as_ref().unwrap().to_cgs, 1e-3);
    assert_eq!(field.variable("u").unwrap().values.to_f64(), [0.0, 2.0, 2.0, 3.0]);
    assert!(field.metadata.contains(&("title".into(), "two layers".into())));
    let only = FieldRequest { carry: Some(vec![]), ..FieldRequest::default() };
    assert_eq!(through(&file, &only).unwrap().variables.len(), 1);
}

#[test]
fn grids_in_any_order_come_out_with_x_fastest() {
    let (x, y, z) = ([0.0, 1.0, 4.0], [5.0, 2.0], [1.0, 2.0, 3.0, 5.0]);
    // value = x + 10 y + 100 z in the order (x, z, y), y descending.
    let value = |i: usize, j: usize, k: usize| x[i] + 10.0 * y[j] + 100.0 * z[k];
    let mut values = Vec::new();
    for i in 0..3 {
        for k in 0..4 {
            values.extend((0..2).map(|j| value(i, j, k)));
        }
    }
    let mut file = ClassicFile::new();
    let dx = file.dimension("east", 3);
    let dz = file.dimension("z", 4);
    let dy = file.dimension("north", 2);
    file.variable("east", &[dx], Data::F64(&x), &[("axis", "X".into())]);
    file.variable("north", &[dy], Data::F64(&y), &[("axis", "Y".into())]);
    file.variable("z", &[dz], Data::F64(&z), &[]);
    file.variable("DENS", &[dx, dz, dy], Data::F64(&values), &[]);
    file.variable("flipped", &[dy, dz, dx], Data::F64(&[7.0; 24]), &[]);
    let field = through(&file, &FieldRequest::default()).unwrap();
    let Geometry::Grid { coordinates, axes } = &field.geometry else { panic!("{:?}", field.geometry) };
    assert_eq!(*coordinates, Coordinates::Cartesian);
    assert_eq!(axes[0].name, "east");
    assert_eq!(axes[1].nodes, [2.0, 5.0]);
    assert_eq!(axes[2].nodes, z);
    let density = field.variable("DENS").unwrap();
    for (i, x) in axes[0].nodes.iter().enumerate() {
        for (j, y) in axes[1].nodes.iter().enumerate() {
            for (k, z) in axes[2].nodes.iter().enumerate() {
                let expected = x + 10.0 * y + 100.0 * z;
                assert_eq!(density.values.get(i + 3 * (j + 2 * k)), expected);
            }
        }
    }
    assert_eq!(field.variables.len(), 2);
}

#[test]
fn a_grid_that_is_read_in_parts_is_whole() {
    // Many times as much as is read at once, of one record among two and with a mask in the last part.
    let shape = [2, 13, 900, 1100];
    let count: usize = shape[1..].iter().product();
    let nodes = |n: usize| (0..n).map(|i| i as f64).collect::<Vec<f64>>();
    let mut values: Vec<f32> = (0..2 * count).map(|i| 1.0 + (i % 65_521) as f32).collect();
    let masked = 2 * count - 5;
    values[masked] = -1.0;
    let axes = shape.map(nodes);
    let mut file = ClassicFile::new();
    let names = ["time", "z", "y", "x"];
    let dimensions: [_; 4] = std::array::from_fn(|i| file.dimension(names[i], shape[i]));
    for (i, name) in names.iter().enumerate() {
        file.variable(name, &[dimensions[i]], Data::F64(&axes[i]), &[]);
    }
    file.variable("rho", &dimensions, Data::F32(&values), &[("_FillValue", (-1.0).into())]);
    let doubles: Vec<f64> = values.iter().map(|&x| x.into()).collect();
    file.variable("double", &dimensions, Data::F64(&doubles), &[]);
    let request = FieldRequest { time: Some(1.0), ..FieldRequest::default() };
    let field = through(&file, &request).unwrap();
    let Values::F32(density) = &field.variable("rho").unwrap().values else { panic!("not as stored") };
    assert!(density[masked - count].is_nan());
    assert!(density.iter().zip(&values[count..]).all(|(a, b)| a == b || a.is_nan() && *b == -1.0));
    assert_eq!(field.variable("double").unwrap().values, Values::F64(doubles[count..].to_vec()));
}

#[test]
fn packed_and_masked_values_are_decoded_as_cf_says() {
    let stored = [-5, 0, 100, 99];
    let mut file = ClassicFile::new();
    let d = file.dimension("x", 4);
    file.variable("x", &[d], Data::F64(&[0.0, 1.0, 2.0, 3.0]), &[]);
    file.variable(
        "rho",
        &[d],
        Data::I32(&stored),
        &[("scale_factor", (-0.5).into()), ("add_offset", 60.0.into()), ("_FillValue", 99.0.into())],
    );
    let field = through(&file, &FieldRequest::default()).unwrap();
    let values = field.variables[0].values.to_f64();
    assert_eq!(&values[..3], &[62.5, 60.0, 10.0]);
    assert!(values[3].is_nan());
    assert!(field.notes.iter().any(|n| n.contains("1 of 4 values are missing")));
}

#[test]
fn bytes_declared_unsigned_are_taken_so() {
    let mut file = ClassicFile::new();
    let d = file.dimension("x", 4);
    file.variable("x", &[d], Data::F64(&[0.0, 1.0, 2.0, 3.0]), &[]);
    let attributes = [("_Unsigned", "true".into()), ("_FillValue", (-1.0).into()), ("scale_factor", 2.0.into())];
    file.variable("rho", &[d], Data::I8(&[3, -56, -6, -1]), &attributes);
    let values = through(&file, &FieldRequest::default()).unwrap().variables.remove(0).values.to_f64();
    assert_eq!(&values[..3], &[6.0, 400.0, 500.0]);
    assert!(values[3].is_nan());
}

#[test]
fn a_fill_value_in_f64_masks_the_f32_nearest_to_it() {
    let mut file = ClassicFile::new();
    let d = file.dimension("x", 3);
    file.variable("x", &[d], Data::F64(&[0.0, 1.0, 2.0]), &[]);
    let fill = [("missing_value", 1e20.into())];
    file.variable("rho", &[d], Data::F32(&[0.1, 1e20, 0.3]), &fill);
    let values = through(&file, &FieldRequest::default()).unwrap().variables.remove(0).values;
    let Values::F32(values) = values else { panic!("{values:?}") };
    assert_eq!((values[0], values[2]), (0.1, 0.3));
    assert!(values[1].is_nan());
}

/// As libraries state it that write 1e20 in single precision beside numbers in double.
#[test]
fn a_fill_value_in_f32_masks_the_decimal_number_in_f64() {
    let mut file = ClassicFile::new();
    let d = file.dimension("x", 4);
    file.variable("x", &[d], Data::F64(&[0.0, 1.0, 2.0, 3.0]), &[]);
    let single = f64::from(1e20_f32);
    assert!(single != 1e20);
    let (stored, fill) = ([0.1, 1e20, single, 1.1e20], [("missing_value", single.into())]);
    file.variable("rho", &[d], Data::F64(&stored), &fill);
    let values = through(&file, &FieldRequest::default()).unwrap().variables.remove(0).values.to_f64();
    assert_eq!((values[0], values[3]), (0.1, 1.1e20));
    assert!(values[1].is_nan() && values[2].is_nan());
}

#[test]
fn the_density_is_chosen_by_name_description_or_request() {
    let mut file = ClassicFile::new();
    let d = file.dimension("r", 2);
    file.variable("r", &[d], Data::F64(&[0.0, 1.0]), &[]);
    file.variable("a", &[d], Data::F64(&[1.0, 2.0]), &[]);
    let field = through(&file, &FieldRequest::default()).unwrap();
    assert_eq!(field.density.as_deref(), Some("a"));
    assert!(field.notes[0].contains("there is no other"), "{:?}", field.notes);
    file.variable("b", &[d], Data::F64(&[3.0, 4.0]), &[]);
    let text = refusal(&file, &FieldRequest::default());
    assert!(text.contains("--density") && text.contains("a, b"), "{text}");
    let named = |name: &str| FieldRequest { density: Some(name.into()), ..FieldRequest::default() };
    assert_eq!(through(&file, &named("b")).unwrap().density.as_deref(), Some("b"));
    let text = refusal(&file, &named("c"));
    assert!(text.contains("'c'") && text.contains("a, b"), "{text}");
    let hint = [("long_name", "Mass Density".into())];
    file.variable("v", &[d], Data::F64(&[5.0, 6.0]), &hint);
    let field = through(&file, &FieldRequest::default()).unwrap();
    assert_eq!(field.density.as_deref(), Some("v"));
    let missing = FieldRequest { carry: Some(vec!["nothing".into()]), ..FieldRequest::default() };
    assert!(refusal(&file, &missing).contains("'nothing'"));
}

#[test]
fn records_are_taken_by_the_nearest_time() {
    let values: Vec<f64> = (0..6).map(f64::from).collect();
    let mut file = ClassicFile::new();
    let t = file.dimension("time", 3);
    let x = file.dimension("x", 2);
    let units = [("units", "days since 2001-1-1".into())];
    file.variable("time", &[t], Data::F64(&[10.0, 20.0, 40.0]), &units);
    file.variable("x", &[x], Data::F64(&[0.0, 1.0]), &[]);
    file.variable("rho", &[t, x], Data::F64(&values), &[]);
    let text = refusal(&file, &FieldRequest::default());
    assert!(text.contains("3 records from 10 to 40 (days"), "{text}");
    let at = |time: f64| FieldRequest { time: Some(time), ..FieldRequest::default() };
    let field = through(&file, &at(29.0)).unwrap();
    assert_eq!(field.variables[0].values.to_f64(), [2.0, 3.0]);
    assert!(field.notes.iter().any(|n| n.contains("record 1 of 3, at time 20")));
    // Within a step of the first and the last is near enough.
    assert_eq!(through(&file, &at(54.0)).unwrap().variables[0].values.to_f64(), [4.0, 5.0]);
    for beyond in [1e9, -50.0, f64::NAN] {
        let text = refusal(&file, &at(beyond));
        assert!(text.contains("3 records from 10 to 40 (days") && text.contains("--time is"), "{text}");
    }
}

#[test]
fn depth_becomes_radius_only_where_the_planet_is_known() {
    let lon = [0.0, 90.0, 180.0];
    let lat = [10.0, -10.0];
    let depth = [0.0, 100.0];
    let values: Vec<f64> = (0..12).map(f64::from).collect();
    let mut file = ClassicFile::new();
    let d = file.dimension("depth", 2);
    let b = file.dimension("lat", 2);
    let l = file.dimension("lon", 3);
    file.variable("lon", &[l], Data::F64(&lon), &[]);
    file.variable("lat", &[b], Data::F64(&lat), &[]);
    file.variable("depth", &[d], Data::F64(&depth), &[("positive", "down".into())]);
    file.variable("rho", &[d, b, l], Data::F64(&values), &[]);
    let text = refusal(&file, &FieldRequest::default());
    assert!(text.contains("planet_radius") && text.contains("not supported"), "{text}");
    file.attribute("planet_radius", 1000.0);
    let field = through(&file, &FieldRequest::default()).unwrap();
    let Geometry::Grid { coordinates, axes } = &field.geometry else { panic!("{:?}", field.geometry) };
    assert_eq!(*coordinates, Coordinates::Geographic);
    assert_eq!(axes[0].nodes, lon);
    assert_eq!(axes[1].nodes, [-10.0, 10.0]);
    assert_eq!(axes[2].nodes, [900.0, 1000.0]);
    // The innermost shell, southern latitude first: values 9, 10, 11 of the file.
    assert_eq!(field.variables[0].values.to_f64()[..3], [9.0, 10.0, 11.0]);
    // What is asked for goes over what the file states.
    let asked = FieldRequest { planet_radius: Some(2000.0), ..FieldRequest::default() };
    let field = through(&file, &asked).unwrap();
    let Geometry::Grid { axes, .. } = &field.geometry else { panic!("{:?}", field.geometry) };
    assert_eq!(axes[2].nodes, [1900.0, 2000.0]);
}

#[test]
fn a_depth_may_come_twice_where_the_density_jumps() {
    let (lon, lat, depth) = ([0.0, 180.0], [-45.0, 45.0], [0.0, 50.0, 50.0, 100.0]);
    let values: Vec<f64> = (0..16).map(f64::from).collect();
    let mut file = ClassicFile::new();
    let d = file.dimension("depth", 4);
    let b = file.dimension("lat", 2);
    let l = file.dimension("lon", 2);
    file.variable("lon", &[l], Data::F64(&lon), &[]);
    file.variable("lat", &[b], Data::F64(&lat), &[]);
    file.variable("depth", &[d], Data::F64(&depth), &[]);
    file.variable("rho", &[d, b, l], Data::F64(&values), &[]);
    let asked = FieldRequest { planet_radius: Some(1000.0), ..FieldRequest::default() };
    let field = through(&file, &asked).unwrap();
    let Geometry::Grid { axes, .. } = &field.geometry else { panic!("{:?}", field.geometry) };
    assert_eq!(axes[2].nodes, [900.0, 950.0, 950.0, 1000.0]);
    // Below the jump lies what the file lists after it.
    assert_eq!(field.variables[0].values.to_f64()[4..8], [8.0, 9.0, 10.0, 11.0]);
}

#[test]
fn faulty_axes_are_named_with_their_index() {
    let with = |name: &str, nodes: &[f64], more: &str| {
        let values = vec![1.0; nodes.len()];
        let mut file = ClassicFile::new();
        let d = file.dimension(name, nodes.len());
        if more != "bare" {
            file.variable(name, &[d], Data::F64(nodes), &[]);
        }
        file.variable("rho", &[d], Data::F64(&values), &[]);
        refusal(&file, &FieldRequest::default())
    };
    let text = with("x", &[0.0, 2.0, 2.0, 3.0], "");
    assert!(text.contains("axis 'x'") && text.contains("values 1 and 2 are 2 and 2"), "{text}");
    let text = with("r", &[0.0, 2.0, 1.0, 3.0], "");
    assert!(text.contains("axis 'r'") && text.contains("values 1 and 2"), "{text}");
    assert!(with("r", &[-1.0, 2.0], "").contains("starts at -1"));
    assert!(with("x", &[0.0, f64::NAN], "").contains("value 1 is NaN"));
    assert!(with("x", &[0.0, 1.0], "bare").contains("no coordinate variable"));
    assert!(with("lon", &[0.0, 1.0], "").contains("axes longitude"));
    assert!(with("level", &[0.0, 1.0], "").contains("cannot tell which axis"));
    assert!(with("x", &[0.0], "").contains("1 nodes"));
}

#[test]
fn damaged_files_and_absurd_sizes_are_errors() {
    let values: Vec<f64> = (0..60).map(f64::from).collect();
    let mut file = ClassicFile::new();
    let y = file.dimension("y", 3);
    let x = file.dimension("x", 20);
    file.variable("y", &[y], Data::F64(&values[..3]), &[]);
    file.variable("x", &[x], Data::F64(&values[..20]), &[]);
    file.variable("rho", &[y, x], Data::F64(&values), &[]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nc");
    file.write(&path).unwrap();
    let whole = std::fs::read(&path).unwrap();
    for length in 0..whole.len() {
        replace(&path, &whole[..length]);
        let spec = detect(FORMATS, &path, None);
        let outcome = spec.and_then(|s| (s.read.unwrap())(&path, &FieldRequest::default()));
        assert!(outcome.is_err(), "the first {length} bytes pass");
    }
    for i in 3..whole.len() {
        for flip in [0x01, 0x80, 0xff] {
            let mut bytes = whole.clone();
            bytes[i] ^= flip;
            replace(&path, &bytes);
            if let Ok(spec) = detect(FORMATS, &path, None) {
                let _ = (spec.read.unwrap())(&path, &FieldRequest::default());
            }
        }
    }
    // The length of dimension x: 20 becomes 2^30.
    let at = whole.windows(8).position(|w| w == b"x\0\0\0\0\0\0\x14").unwrap() + 4;
    let mut bytes = whole.clone();
    bytes[at..at + 4].copy_from_slice(&(1u32 << 30).to_be_bytes());
    std::fs::write(&path, &bytes).unwrap();
    let text = read(&path, &FieldRequest::default()).unwrap_err().to_string();
    assert!(text.contains("1073741824") || text.contains("damaged"), "{text}");
}

/// The folder of real inputs, where this machine has it.
fn shared() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/netcdf");
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: there is no {}", path.display());
    None
}

#[test]
fn real_files_get_truthful_errors_or_are_read() {
    let Some(folder) = shared() else { return };
    let refusal = |name: &str, time: Option<f64>| {
        let request = FieldRequest { time, ..FieldRequest::default() };
        read(&folder.join(name), &request).unwrap_err().to_string()
    };
    let text = refusal("tos_O1_2001-2002.nc", Some(15.0));
    assert!(text.contains("'tos' on the axes longitude, latitude"), "{text}");
    let text = refusal("basin_mask.nc", None);
    assert!(text.contains("'basin' on the axes z, longitude, latitude"), "{text}");
    let text = refusal("SAW642AN_rho.nc", None);
    assert!(text.contains("depth from a surface") && text.contains("planet_radius"), "{text}");
}
