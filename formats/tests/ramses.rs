//! Outputs of RAMSES. Values are whole numbers that tell level and place of their cell.

use crate::support::ramses::{COARSE, Descriptor, LEVELS, Output, Variable};
use crate::support::{attempt, refusal, replace};
use sph_formats::model::FIELD_ADIABATIC_INDEX;
use sph_formats::{FORMATS, FieldRequest, FileContent, Geometry, RawField, RefinedGrid, UnitDimension, files_of, read};
use std::fs;
use std::path::{Path, PathBuf};

/// Exact in 4 bytes, and another for every cell of these trees.
fn own(level: usize, [x, y, z]: [u64; 3]) -> f64 {
    (level as u64 + 8 * (x + 64 * (y + 64 * z))) as f64
}

const VARIABLES: [Variable; 4] = [
    ("density", own),
    ("velocity_x", |level, x| -own(level, x)),
    ("pressure", |_, x| x[0] as f64),
    ("metallicity", |_, _| 0.25),
];

fn refined(field: &RawField) -> &RefinedGrid {
    let Geometry::Refined(grid) = &field.geometry else { panic!("{:?}", field.geometry) };
    grid
}

/// Every value is that of its cell, the cells fill the box, and nothing else is there.
fn check(field: &RawField, output: &Output) {
    let grid = refined(field);
    let d = output.dimension;
    assert_eq!(grid.dimension(), d);
    let variable = |name: &str| &field.variable(name).unwrap().values;
    let (density, velocity) = (variable("density"), variable("velocity_x"));
    let (mut mass, mut expected, mut volume) = (0.0, 0.0, 0.0);
    for i in 0..grid.cell_count() {
        let (block, at) = grid.place(i).unwrap();
        let place: [u64; 3] = std::array::from_fn(|k| block.first[k] + at[k]);
        let value = own(block.level.into(), place);
        assert_eq!((density.get(i), velocity.get(i)), (value, -value), "level {} at {place:?}", block.level);
        let own: f64 =
            (0..d).map(|k| grid.face(k, block.level, place[k] + 1) - grid.face(k, block.level, place[k])).product();
        (mass, expected, volume) = (mass + density.get(i) * own, expected + value * own, volume + own);
    }
    // Widths are powers of 2.
    assert_eq!(mass, expected);
    assert_eq!(volume, (0..d).map(|k| COARSE * output.coarse[k] as f64).product::<f64>());
}

#[test]
fn cells_of_all_files_lie_where_they_say_and_copies_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    for d in 1..=3 {
        let plain = Output::new(d, &VARIABLES);
        let path = folder.path().join(format!("output_{d}"));
        for own in [
            plain.clone(),
            Output { is_double: false, ..plain.clone() },
            Output { is_big: true, ordering: "bisection", ..plain.clone() },
            Output { files: 1, descriptor: Descriptor::Old, ..plain.clone() },
            Output { margins: [[1, 1], [0, 0], [0, 0]], ..plain.clone() },
            Output { margins: [[0, 1], [0, 0], [0, 0]], files: 2, ..plain.clone() },
        ] {
            own.write(&path);
            for name in [path.clone(), path.join("info_00012.txt")] {
                let field = attempt(&name).unwrap();
                check(&field, &own);
                let grid = refined(&field);
                assert_eq!((field.format, field.density.as_deref()), ("ramses", Some("density")));
                assert_eq!(grid.ratios, [1, 2, 4, 8, 16]);
                assert!((1..=LEVELS).all(|l| grid.levels()[l][1] > 0), "{:?}", grid.levels());
                assert_eq!(grid.axes[0].is_periodic, own.margins[0] == [0, 0]);
                let [time, gamma] = field.metadata.as_slice() else { panic!("{:?}", field.metadata) };
                assert_eq!((time.0.as_str(), time.1.as_str()), ("time", "1.5"));
                // In f32 in some of the files.
                assert_eq!(gamma.0, FIELD_ADIABATIC_INDEX);
                assert!((gamma.1.parse::<f64>().unwrap() - 1.4).abs() < 1e-6, "{gamma:?}");
            }
            assert!(files_of(&path).unwrap().len() >= 2 + 2 * own.files);
        }
    }
}

#[test]
fn units_are_those_of_the_info_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut output = Output::new(2, &VARIABLES);
    output.write(folder.path());
    let field = attempt(folder.path()).unwrap();
    let [l, rho, t] = output.units;
    let unit =
        |field: &RawField, name: &str| field.variable(name).unwrap().unit.as_ref().map(|u| (u.to_cgs, u.dimension));
    for (name, cgs, dimension) in [
        ("density", rho, UnitDimension::mass_density(3)),
        ("velocity_x", l / t, UnitDimension::VELOCITY),
        ("pressure", rho * (l / t).powi(2), UnitDimension::PRESSURE),
        ("metallicity", 1.0, UnitDimension::NONE),
    ] {
        let (found, own) = unit(&field, name).unwrap();
        // Of mass and length, which the density is made of, to rounding.
        assert!((found / cgs - 1.0).abs() < 1e-14 && own == dimension, "{name}: {found:e}");
    }
    assert_eq!(refined(&field).unit.as_ref().map(|u| u.to_cgs), Some(l));
    output.units = [1.0; 3];
    output.write(folder.path());
    let field = attempt(folder.path()).unwrap();
    assert!(unit(&field, "density").is_none() && refined(&field).unit.is_none());
    assert!(field.notes.iter().any(|n| n.contains("without units")), "{:?}", field.notes);
}

#[test]
fn magnetic_fields_are_the_means_of_faces() {
    let folder = tempfile::tempdir().unwrap();
    let mut variables = VARIABLES.to_vec();
    variables.insert(2, ("B_x_left", |level, x| own(level, x) - 0.5));
    variables.insert(3, ("B_x_right", |level, x| own(level, x) + 0.5));
    let output = Output::new(3, &variables);
    output.write(folder.path());
    let field = attempt(folder.path()).unwrap();
    check(&field, &output);
    let [mean, density] = ["magnetic_field_x", "density"].map(|name| field.variable(name).unwrap());
    assert_eq!(mean.values, density.values);
    let [l, rho, t] = output.units;
    let gauss = (4.0 * std::f64::consts::PI * rho).sqrt() * l / t;
    let unit = mean.unit.as_ref().unwrap();
    assert_eq!(unit.dimension, UnitDimension::MAGNETIC_FIELD);
    assert!((unit.to_cgs / gauss - 1.0).abs() < 1e-14, "{:e} {gauss:e}", unit.to_cgs);
    assert!(field.variable("B_x_left").is_none());
}

#[test]
fn without_a_descriptor_the_order_tells_what_is_sure() {
    let folder = tempfile::tempdir().unwrap();
    let output = Output { descriptor: Descriptor::None, ..Output::new(1, &VARIABLES) };
    output.write(folder.path());
    let field = attempt(folder.path()).unwrap();
    let names: Vec<&str> = field.variables.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["density", "velocity_x", "pressure", "scalar_00"]);
    assert!(field.notes.iter().any(|n| n.contains("there is no hydro_file_descriptor.txt")), "{:?}", field.notes);
    fs::write(folder.path().join("hydro_file_descriptor.txt"), " 1, density, d\n").unwrap();
    assert!(refusal(folder.path()).contains("names 1 variables, but the hydro files have 4"));
    fs::write(folder.path().join("hydro_file_descriptor.txt"), " 1, density, d\n 2, density, d\n").unwrap();
    assert!(refusal(folder.path()).contains("line 2: names 'density' twice"));
    fs::write(folder.path().join("hydro_file_descriptor.txt"), " 1, density, d\n 3, p, d\n").unwrap();
    assert!(refusal(folder.path()).contains("line 2: names variable 3 after 1 others"));
}

#[test]
fn uniform_parts_are_few_blocks() {
    let folder = tempfile::tempdir().unwrap();
    for d in 1..=3 {
        let is_refined = |level: usize, _: [u64; 3]| level < 3;
        let output = Output { is_refined, ..Output::new(d, &VARIABLES) };
        output.write(folder.path());
        let field = attempt(folder.path()).unwrap();
        check(&field, &output);
        // One cube for each coarse cell: 8 cells along each axis.
        let blocks: u64 = output.coarse.iter().product();
        assert_eq!(refined(&field).blocks.len() as u64, if d == 1 { 1 } else { blocks });
        assert_eq!(refined(&field).levels()[3][1], blocks * 8_u64.pow(d as u32));
    }
}

#[test]
fn only_what_is_asked_for_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let output = Output::new(2, &VARIABLES);
    output.write(folder.path());
    let request = FieldRequest { carry: Some(vec!["pressure".into()]), ..FieldRequest::default() };
    let Ok(FileContent::Field(field)) = read(FORMATS, folder.path(), None, &request) else { panic!("no field") };
    let names: Vec<&str> = field.variables.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["density", "pressure"]);
    let request = FieldRequest { density: Some("rho".into()), ..FieldRequest::default() };
    let error = read(FORMATS, folder.path(), None, &request).unwrap_err().to_string();
    assert!(error.contains("variable 'rho'") && error.contains("density, velocity_x"), "{error}");
}

#[test]
fn files_that_do_not_fit_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let output = Output::new(3, &VARIABLES);
    let at = |name: &str| folder.path().join(name);
    let info = at("info_00012.txt");
    let check = |name: &str, change: &dyn Fn(), parts: &[&str]| {
        output.write(folder.path());
        change();
        let error = refusal(&info);
        assert!(parts.iter().all(|part| error.contains(part)), "{name}: {error}\nlacks {parts:?}");
    };
    let remove = |name: &str| fs::remove_file(at(name)).unwrap();
    check("no octs", &|| remove("amr_00012.out00002"), &["amr_00012.out00002", "file 2 of 3", "missing"]);
    check("no values", &|| remove("hydro_00012.out00003"), &["hydro_00012.out00003", "file 3 of 3", "missing"]);
    check("no values at all", &|| remove("hydro_00012.out00001"), &["hydro_00012.out00001", "missing"]);
    check(
        "another's values",
        &|| drop(fs::copy(at("hydro_00012.out00001"), at("hydro_00012.out00002"))),
        &["hydro_00012.out00002", "do not belong together"],
    );
    check(
        "another's octs",
        &|| drop(fs::copy(at("amr_00012.out00001"), at("amr_00012.out00002"))),
        &["_00012.out00002"],
    );
    let other = |own: Output| {
        let path = folder.path().join("other");
        own.write(&path);
        fs::copy(path.join("amr_00012.out00002"), at("amr_00012.out00002")).unwrap();
    };
    check(
        "another grid",
        &|| other(Output { coarse: [2, 2, 1], ..output.clone() }),
        &["amr_00012.out00002", "different outputs"],
    );
    check(
        "another dimension",
        &|| other(Output::new(2, &VARIABLES)),
        &["amr_00012.out00002", "number of dimensions", "is 2, but 3"],
    );
    let text = |from: &str, to: &str| {
        let old = fs::read_to_string(&info).unwrap();
        assert!(old.contains(from), "{from}");
        fs::write(&info, old.replacen(from, to, 1)).unwrap();
    };
    check(
        "more files",
        &|| text("ncpu        =          3", "ncpu        =          4"),
        &["_00012.out00001", "is 3, but 4"],
    );
    check(
        "fewer levels",
        &|| text("levelmax    =          4", "levelmax    =          3"),
        &["number of levels", "is 4, but 3"],
    );
    check("deep", &|| text("levelmax    =          4", "levelmax    =        400"), &["not supported", "levelmax 400"]);
    check(
        "no dimension",
        &|| text("ndim        =          3", "ndim        =          0"),
        &["line 2, column 'ndim'", "is 0"],
    );
    check("no size", &|| text("boxlen", "boxlem"), &["key 'boxlen'", "is missing"]);
    check("a unit", &|| text("unit_d      =", "unit_d      = x"), &["column 'unit_d'", "expected a number"]);
    check("no unit", &|| text("unit_t      =", "unit_t      =NaN #"), &["column 'unit_t'"]);
    check(
        "negative",
        &|| text("unit_l      =   3", "unit_l      =  -3"),
        &["column 'unit_l'", "expected a positive number"],
    );
    output.write(folder.path());
    fs::copy(&info, at("info.txt")).unwrap();
    assert!(refusal(&at("info.txt")).contains("expected info_NNNNN.txt"));
}

#[test]
fn gaps_and_overlaps_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let plain = Output::new(2, &VARIABLES);
    Output { without: vec![(3, [0, 1, 0])], ..plain.clone() }.write(folder.path());
    let error = refusal(folder.path());
    assert!(error.contains("blocks") && error.contains("missing") && error.contains("x from"), "{error}");
    Output { in_all: vec![(3, [0, 1, 0])], ..plain.clone() }.write(folder.path());
    let error = refusal(folder.path());
    assert!(
        error.contains("amr_00012.out0000") && error.contains("level 3 at [0, 1, 0]") && error.contains("again in"),
        "{error}"
    );
    Output { without: vec![(1, [0, 0, 0]), (1, [0, 1, 0])], ..plain }.write(folder.path());
    assert!(refusal(folder.path()).contains("none of the files has one of level 1"));
}

/// The binary files of a small output.
fn binaries(folder: &Path) -> Vec<PathBuf> {
    let files = files_of(folder).unwrap();
    files.into_iter().filter(|path| path.extension().is_some_and(|e| e != "txt")).collect()
}

#[test]
fn every_cut_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    Output { files: 2, ..Output::new(1, &VARIABLES[..2]) }.write(folder.path());
    for path in binaries(folder.path()) {
        let whole = fs::read(&path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        for cut in (0..whole.len()).step_by(3) {
            replace(&path, &whole[..cut]);
            let error = refusal(folder.path());
            assert!(error.contains(&name), "{cut} of {}: {error}", whole.len());
        }
        replace(&path, &whole);
    }
    assert!(attempt(folder.path()).is_ok());
}

#[test]
fn hostile_lengths_and_flipped_bits_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let output = Output { files: 2, margins: [[1, 0], [0, 0], [0, 0]], ..Output::new(2, &VARIABLES[..2]) };
    output.write(folder.path());
    let (mut refused, mut tried) = (0, 0);
    for path in binaries(folder.path()) {
        let whole = fs::read(&path).unwrap();
        for at in (0..whole.len() - 4).step_by(4) {
            for word in [i32::MAX, i32::MIN, -1, 1 << 28] {
                let mut bytes = whole.clone();
                bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
                replace(&path, &bytes);
                (refused, tried) = (refused + usize::from(attempt(folder.path()).is_err()), tried + 1);
            }
        }
        for n in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[n] ^= 1 << (n % 8);
            replace(&path, &bytes);
            if let Ok(field) = attempt(folder.path()) {
                // What is still read fills the box.
                assert!(refined(&field).validate().is_ok());
            }
        }
        replace(&path, &whole);
    }
    // Most words are values, indices that are not needed, or copies; every length before and behind a record is seen.
    assert!(refused * 4 > tried, "{refused} of {tried}");
    check(&attempt(folder.path()).unwrap(), &output);
}
