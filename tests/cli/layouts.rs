//! `sph-prep check` on files by hand, each with one thing in its layout that some codes stop at or take for something else.

use super::support::{Folder, succeed};
use rust_hdf5::{H5File, LibverBound};
use sph_formats::{FORMATS, FieldRequest, FileContent, ParticleFile};
use sph_prep::check::{Finding, Level};
use sph_prep::codes::TargetCode;
use std::path::Path;

/// Particles along each edge of a lattice that fills the box.
const SIDE: usize = 10;
const COUNT: usize = SIDE * SIDE * SIDE;
const CODES: [&str; 7] = ["swift", "swift:pressure-entropy", "swift:planetary", "gadget4", "gadget2", "gizmo", "arepo"];
const FAMILY: [&str; 4] = ["gadget4", "gadget2", "gizmo", "arepo"];

/// What is written by hand.
struct Made {
    header: Vec<(&'static str, Vec<f64>)>,
    units: Option<Vec<&'static str>>,
    /// Name, columns (none: a row of numbers) and all numbers.
    datasets: Vec<(&'static str, Option<usize>, Vec<f64>)>,
    libver: LibverBound,
}

impl Made {
    /// A file that all codes take.
    fn fine() -> Self {
        let counts = vec![COUNT as f64, 0.0, 0.0, 0.0, 0.0, 0.0];
        let mut header = vec![
            ("NumPart_ThisFile", counts.clone()),
            ("NumPart_Total", counts),
            ("NumPart_Total_HighWord", vec![0.0; 6]),
            ("MassTable", vec![0.0; 6]),
        ];
        let one = |name, number: f64| (name, vec![number]);
        header.extend([one("BoxSize", 1.0), one("NumFilesPerSnapshot", 1.0), one("HubbleParam", 1.0)]);
        let zeros = [
            "Time",
            "Redshift",
            "Omega0",
            "OmegaLambda",
            "Flag_Entropy_ICs",
            "Flag_DoublePrecision",
            "Flag_Sfr",
            "Flag_Cooling",
            "Flag_StellarAge",
            "Flag_Metals",
            "Flag_Feedback",
        ];
        header.extend(zeros.map(|name| one(name, 0.0)));
        let place = |i: usize| [i / (SIDE * SIDE), i / SIDE % SIDE, i % SIDE].map(|k| (k as f64 + 0.5) / SIDE as f64);
        let datasets = vec![
            ("Coordinates", Some(3), (0..COUNT).flat_map(place).collect()),
            ("Velocities", Some(3), vec![0.0; 3 * COUNT]),
            ("Masses", None, vec![1.0 / COUNT as f64; COUNT]),
            // SWIFT's, which is half of the family's: not so far off that it counts for more than a warning.
            ("SmoothingLength", None, vec![1.2348 / SIDE as f64; COUNT]),
            ("InternalEnergy", None, vec![1.0; COUNT]),
            ("Density", None, vec![1.0; COUNT]),
            ("ParticleIDs", None, (1..=COUNT).map(|i| i as f64).collect()),
            ("MaterialIDs", None, vec![0.0; COUNT]),
        ];
        Self { header, units: Some(UNITS.to_vec()), datasets, libver: LibverBound::V18 }
    }

    fn set(&mut self, name: &str, numbers: &[f64]) {
        let attribute = self.header.iter_mut().find(|(key, _)| *key == name);
        attribute.unwrap().1 = numbers.to_vec();
    }

    fn write(&self, path: &Path) {
        let file = H5File::options().libver(self.libver).create(path).unwrap();
        let header = file.create_group("Header").unwrap();
        for (name, numbers) in &self.header {
            header.set_attr_array_numeric(name, numbers).unwrap();
        }
        if let Some(names) = &self.units {
            let units = file.create_group("Units").unwrap();
            names.iter().for_each(|name| units.set_attr_array_numeric(name, &[2.0]).unwrap());
        }
        let group = file.create_group("PartType0").unwrap();
        for (name, columns, values) in &self.datasets {
            let rows = values.len() / columns.unwrap_or(1);
            let shape: Vec<usize> = std::iter::once(rows).chain(*columns).collect();
            group.new_dataset::<f64>().shape(&shape).create(name).unwrap().write_raw(values).unwrap();
        }
        file.close().unwrap();
    }
}

const UNITS: [&str; 5] = [
    "Unit length in cgs (U_L)",
    "Unit mass in cgs (U_M)",
    "Unit time in cgs (U_t)",
    "Unit current in cgs (U_I)",
    "Unit temperature in cgs (U_T)",
];

fn read(path: &Path) -> ParticleFile {
    match sph_formats::read(FORMATS, path, None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(file) => file,
        FileContent::Field(_) => panic!("a field"),
    }
}

fn found(path: &Path, code: &str) -> Vec<Finding> {
    sph_prep::check::check(&read(path), &TargetCode::parse(code).unwrap()).unwrap()
}

/// A change; what the codes say of it: how much it matters to which, and a part of the text.
type Case<'a> = (&'a str, Box<dyn Fn(&mut Made)>, &'a [(&'a str, Level)], &'a str);

/// Each change is told for these codes, and for no other one.
fn each(cases: Vec<Case<'_>>) {
    let folder = Folder::new();
    let path = folder.path("ic.hdf5");
    Made::fine().write(&path);
    let before = CODES.map(|code| found(&path, code));
    for (code, findings) in CODES.iter().zip(&before) {
        assert!(findings.iter().all(|f| f.level != Level::Error), "{code}: {findings:?}");
    }
    for (name, spoil, expected, text) in cases {
        let mut made = Made::fine();
        spoil(&mut made);
        made.write(&path);
        for (code, before) in CODES.iter().zip(&before) {
            let told: Vec<_> = found(&path, code).into_iter().filter(|f| !before.contains(f)).collect();
            let wanted = expected.iter().find(|(known, _)| known == code);
            let said = |level: Level| {
                told.iter().any(|f| f.level == level && format!("{}: {}", f.what, f.text).contains(text))
            };
            match wanted {
                Some((_, level)) => assert!(said(*level), "{name}, {code}: {told:?}"),
                None => assert!(told.iter().all(|f| f.level == Level::Good), "{name}, {code}: {told:?}"),
            }
        }
    }
}

use Level::{Error, Warning};

const SWIFT: [(&str, Level); 3] = [("swift", Error), ("swift:pressure-entropy", Error), ("swift:planetary", Error)];

fn lacks(name: &'static str) -> Box<dyn Fn(&mut Made)> {
    Box::new(move |made| made.header.retain(|(key, _)| *key != name))
}

fn sets(name: &'static str, numbers: &'static [f64]) -> Box<dyn Fn(&mut Made)> {
    Box::new(move |made| made.set(name, numbers))
}

#[test]
fn attributes_that_a_code_opens_are_there() {
    let swift_and = |others: &'static [&'static str]| {
        SWIFT.into_iter().chain(others.iter().map(|code| (*code, Error))).collect::<Vec<_>>()
    };
    let only = |codes: &[&'static str]| codes.iter().map(|code| (*code, Error)).collect::<Vec<_>>();
    let cases = [
        ("NumPart_Total_HighWord", swift_and(&["gadget2", "gizmo", "arepo"])),
        ("Flag_Entropy_ICs", swift_and(&["gadget2"])),
        ("MassTable", only(&FAMILY)),
        ("Time", only(&FAMILY)),
        ("NumFilesPerSnapshot", only(&FAMILY)),
        ("Redshift", only(&["gadget4", "arepo"])),
        ("Flag_DoublePrecision", only(&["gizmo", "arepo"])),
        ("Omega0", only(&["arepo"])),
    ];
    let texts = cases.each_ref().map(|(name, _)| format!("header: lacks the header's {name}"));
    each(
        cases
            .iter()
            .zip(&texts)
            .map(|((name, codes), text)| (*name, lacks(name), codes.as_slice(), text.as_str()))
            .collect(),
    );
}

/// GADGET-4 and AREPO compare lengths, the others count on them.
#[test]
fn attributes_have_the_lengths_that_codes_have_room_for() {
    const SEVEN: &[f64] = &[COUNT as f64, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    const EIGHT: &[f64] = &[COUNT as f64, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let family = [("gadget4", Error), ("gadget2", Warning), ("gizmo", Warning), ("arepo", Error)];
    let all: Vec<_> = family.into_iter().chain(SWIFT.map(|(code, _)| (code, Warning))).collect();
    each(vec![
        ("seven types", sets("NumPart_Total", SEVEN), &family, "NumPart_Total has 7 numbers"),
        ("seven here", sets("NumPart_ThisFile", SEVEN), &family, "NumPart_ThisFile has 7 numbers"),
        ("seven masses", sets("MassTable", &[0.0; 7]), &family, "MassTable has 7 numbers"),
        ("one type", sets("NumPart_Total", &SEVEN[..1]), &[("gadget4", Error), ("arepo", Error)], "NTYPES=1"),
        ("eight types", sets("NumPart_Total", EIGHT), &all, "NumPart_Total has 8 numbers"),
        (
            "seven of all",
            Box::new(|made: &mut Made| {
                ["NumPart_ThisFile", "NumPart_Total"].iter().for_each(|name| made.set(name, SEVEN));
                made.set("MassTable", &[0.0; 7]);
            }),
            &family,
            "NumPart_ThisFile, NumPart_Total, MassTable have 7 numbers",
        ),
        (
            "a box of three edges",
            sets("BoxSize", &[1.0; 3]),
            &[("gadget4", Error), ("arepo", Error)],
            "BoxSize has 3 numbers",
        ),
        ("no files", sets("NumFilesPerSnapshot", &[0.0]), &SWIFT, "NumFilesPerSnapshot is 0"),
    ]);
}

#[test]
fn flags_that_a_code_stops_at_or_does_not_heed_are_told() {
    let double = [("gizmo", Error), ("arepo", Error)];
    let entropy =
        [("swift", Error), ("swift:planetary", Error), ("gadget4", Warning), ("gizmo", Error), ("arepo", Error)];
    each(vec![
        ("doubles", sets("Flag_DoublePrecision", &[1.0]), &double, "INPUT_IN_DOUBLEPRECISION"),
        ("entropies", sets("Flag_Entropy_ICs", &[1.0]), &entropy, "InternalEnergy has entropies"),
    ]);
}

#[test]
fn a_group_of_units_has_all_that_swift_reads_of_it() {
    let texts = UNITS.map(|unit| format!("units: lack '{unit}'"));
    let case = |(unit, text): (&'static str, _)| -> Case<'_> {
        (unit, Box::new(move |made: &mut Made| made.units.as_mut().unwrap().retain(|u| *u != unit)), &SWIFT, text)
    };
    let temperature_and_current = UNITS.into_iter().zip(texts.iter().map(String::as_str)).skip(3).map(case);
    let mut cases: Vec<_> = temperature_and_current.collect();
    // Without the group the parameter file has the units.
    let all = CODES.map(|code| (code, Warning));
    cases.push(("none", Box::new(|made| made.units = None), &all, "units: are pure numbers"));
    each(cases);
}

/// SWIFT's own snapshots are read everywhere here, but no code starts from them.
#[test]
fn names_of_snapshots_are_told_and_convert_writes_others() {
    let rename = |from: &'static str, to: &'static str| -> Box<dyn Fn(&mut Made)> {
        Box::new(move |made| made.datasets.iter_mut().filter(|d| d.0 == from).for_each(|d| d.0 = to))
    };
    let all: Vec<_> = SWIFT.into_iter().chain(FAMILY.map(|code| (code, Error))).collect();
    each(vec![
        (
            "lengths",
            rename("SmoothingLength", "SmoothingLengths"),
            &SWIFT,
            "SmoothingLength: is called SmoothingLengths",
        ),
        ("energies", rename("InternalEnergy", "InternalEnergies"), &all, "InternalEnergy: is called InternalEnergies"),
        ("densities", rename("Density", "Densities"), &[], ""),
    ]);
    let folder = Folder::new();
    let (old, new) = (folder.path("snapshot.hdf5"), folder.path("ic.hdf5"));
    let mut made = Made::fine();
    rename("SmoothingLength", "SmoothingLengths")(&mut made);
    rename("InternalEnergy", "InternalEnergies")(&mut made);
    made.write(&old);
    let path = |path: &Path| path.display().to_string();
    succeed(&["convert", &path(&old), &path(&new), "--to", "swift"]);
    let left = found(&new, "swift");
    assert!(left.iter().all(|f| f.level != Error), "{left:?}");
}

/// A dataset of one column is read as zeros where it is in chunks and a row is asked for.
#[test]
fn columns_have_the_shape_that_codes_read() {
    let shape = |name: &'static str, columns: usize| -> Box<dyn Fn(&mut Made)> {
        Box::new(move |made| {
            let dataset = made.datasets.iter_mut().find(|d| d.0 == name).unwrap();
            let old = dataset.1.unwrap_or(1);
            let rows = dataset.2.chunks(old).map(<[f64]>::to_vec);
            dataset.2 = rows
                .flat_map(|mut row| {
                    row.resize(columns, 0.0);
                    row
                })
                .collect();
            dataset.1 = Some(columns);
        })
    };
    let family = FAMILY.map(|code| (code, Error));
    let all: Vec<_> = SWIFT.into_iter().chain(family).collect();
    each(vec![
        ("a column of masses", shape("Masses", 1), &family, "Masses: has the shape [1000, 1]"),
        ("four components", shape("Velocities", 4), &all, "Velocities: has the shape [1000, 4]"),
    ]);
}

#[test]
fn a_container_for_later_libraries_is_warned_about() {
    let all: Vec<_> = CODES.map(|code| (code, Warning)).into();
    each(vec![("latest", Box::new(|made| made.libver = LibverBound::V110), &all, "superblock of version 3")]);
}

/// What the program writes for a code is what that code opens.
#[test]
fn files_of_the_program_have_the_layout_of_their_code() {
    let folder = Folder::new();
    let scene = folder.file(
        "box.yaml",
        "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nparticles: 1000\npolish: none\n",
    );
    for (code, format) in [("swift", "swift"), ("gadget4", "gadget"), ("gizmo", "gizmo"), ("arepo", "arepo")] {
        let out = folder.path(&format!("{code}.hdf5"));
        let (scene, path) = (scene.display().to_string(), out.display().to_string());
        succeed(&["--scene", &scene, "--for", code, "--to", format, "--out", &path, "--quiet"]);
        let findings = found(&out, code);
        let bad = |f: &&Finding| f.level == Error || ["header", "file"].contains(&f.what.as_str());
        assert_eq!(findings.iter().find(bad), None, "{code}");
    }
}
