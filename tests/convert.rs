//! `sph-prep convert`: a chain through every kind of container keeps what can be kept and says what cannot.

#![cfg(all(
    feature = "netcdf",
    feature = "swift",
    feature = "gadget",
    feature = "gadget-binary",
    feature = "vtk",
    feature = "table"
))]

use assert_cmd::Command;
use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use sph_formats::common::particle_names as names;
use sph_formats::{
    Column, FORMATS, FieldRequest, FileContent, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension,
    UnitSystem, Values, WriteOptions,
};
use std::path::Path;

/// 500 particles along a curve, no two numbers alike.
fn particles() -> ParticleFile {
    let n = 500;
    let x = |i: usize| (i as f64 + 0.5) / n as f64;
    let column = |name: &str, components: usize, f: &dyn Fn(usize) -> f64, dimension: UnitDimension| Column {
        name: name.into(),
        components,
        values: Values::F64((0..n * components).map(f).collect()),
        dimension,
    };
    let columns = vec![
        column(names::COORDINATES, 3, &|i| 2.0 * x(i / 3).powi(1 + (i % 3) as i32), UnitDimension::LENGTH),
        column(names::VELOCITIES, 3, &|i| x(i / 3) - (i % 3) as f64, UnitDimension::VELOCITY),
        column(names::MASSES, 1, &|i| 1e-3 * (1.0 + x(i)), UnitDimension::MASS),
        column(names::DENSITY, 1, &|i| 3.0 + x(i), UnitDimension::mass_density(3)),
        column(names::SUPPORT_RADIUS, 1, &|i| 0.1 + x(i), UnitDimension::LENGTH),
        column(names::INTERNAL_ENERGY, 1, &|i| 7.0 + x(i), UnitDimension::SPECIFIC_ENERGY),
        column("IronFraction", 1, &x, UnitDimension::NONE),
    ];
    ParticleFile {
        header: RunHeader {
            dimension: 3,
            box_size: [2.0; 3],
            box_corner: None,
            periodic: [true; 3],
            units: UnitSystem::solar(),
            time: 0.25,
            kernel: "Wendland C4".into(),
            kernel_neighbors: 120.0,
            provenance: vec![("Scene".into(), "a: 1 -- b\n".into())],
            layouts: Vec::new(),
        },
        species: vec![Species { part_type: 0, table: ParticleTable { count: n, columns } }],
    }
}

fn read(path: &Path) -> ParticleFile {
    match sph_formats::read(FORMATS, path, None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(p) => p,
        FileContent::Field(_) => panic!("a field"),
    }
}

fn convert(from: &Path, to: &Path, more: &[&str]) -> (bool, String) {
    let output = Command::cargo_bin("sph-prep").unwrap().arg("convert").arg(from).arg(to).args(more).output().unwrap();
    (output.status.success(), String::from_utf8(output.stderr).unwrap())
}

fn same(a: &ParticleFile, b: &ParticleFile, name: &str, tolerance: f64) {
    let get = |p: &ParticleFile| p.species[0].table.column(name).unwrap_or_else(|| panic!("no {name}")).values.to_f64();
    for (x, y) in get(a).iter().zip(get(b)) {
        assert!((x - y).abs() <= tolerance * x.abs(), "{name}: {y} of {x}");
    }
}

#[test]
fn a_chain_of_formats_keeps_columns_header_and_units() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let original = particles();
    let options = WriteOptions { compression: 4, double_precision: false };
    sph_formats::write(FORMATS, &file("a.hdf5"), None, &original, options).unwrap();
    for pair in ["a.hdf5", "b.h5", "c.vtu", "d.csv", "e.npz", "f.vtp", "g.hdf5"].windows(2) {
        let (good, text) = convert(&file(pair[0]), &file(pair[1]), &[]);
        assert!(good && !text.contains("does not hold"), "{pair:?}: {text}");
    }
    let (first, last) = (read(&file("a.hdf5")), read(&file("g.hdf5")));
    for name in [
        names::COORDINATES,
        names::VELOCITIES,
        names::MASSES,
        names::DENSITY,
        names::INTERNAL_ENERGY,
        names::PARTICLE_IDS,
    ] {
        same(&first, &last, name, 0.0);
        if name != names::PARTICLE_IDS {
            same(&original, &last, name, 6e-8);
        }
    }
    same(&first, &last, "IronFraction", 0.0);
    // Computed anew from masses and densities in f32.
    same(&first, &last, names::SUPPORT_RADIUS, 1.2e-7);
    assert_eq!((last.header.units, last.header.box_size), (original.header.units, original.header.box_size));
    assert_eq!((last.header.kernel.as_str(), last.header.periodic), ("Wendland C4", [true; 3]));
    assert!(last.header.provenance.contains(&("Scene".into(), "a: 1 -- b\n".into())));
}

/// A periodic box of 4 cells along each axis with a density and two fields to carry.
fn field(path: &Path) {
    let n = 4;
    let line: Vec<f64> = (0..n).map(|i| 0.5 + i as f64).collect();
    let wave = |i: usize| 1.5 + (i % n) as f64 / 8.0 - (i / n % n) as f64 / 16.0 + (i / n / n) as f64 / 32.0;
    let density: Vec<f64> = (0..n * n * n).map(wave).collect();
    let warm: Vec<f64> = density.iter().map(|rho| 300.0 * rho).collect();
    let iron: Vec<f64> = density.iter().map(|rho| 0.25 * rho).collect();
    let mut file = ClassicFile::new();
    let axes = ["z", "y", "x"].map(|name| file.dimension(name, n));
    for (name, id) in ["z", "y", "x"].into_iter().zip(axes) {
        file.variable(name, &[id], Data::F64(&line), &[("units", "km".into())]);
    }
    file.variable("density", &axes, Data::F64(&density), &[("units", "kg m-3".into())]);
    file.variable("temperature", &axes, Data::F64(&warm), &[("units", "K".into())]);
    file.variable("iron", &axes, Data::F64(&iron), &[]);
    file.write(path).unwrap();
}

#[test]
fn a_field_goes_through_gadget_and_swift_to_vtk_and_keeps_all_that_they_hold() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    field(&file("field.nc"));
    let scene = format!(
        "input: {{file: {}}}\noutput: {{file: {}, format: gadget, units: si}}\nparticles: 60\nwvt: {{iterations: 2}}\n\
         polish: none\nthermal: {{internal_energy: 2.5e5}}\n",
        file("field.nc").display(),
        file("a.h5").display()
    );
    std::fs::write(file("scene.yaml"), scene).unwrap();
    let made = Command::cargo_bin("sph-prep")
        .unwrap()
        .arg("--scene")
        .arg(file("scene.yaml"))
        .args(["--boundary", "periodic"])
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));

    let (good, text) = convert(&file("a.h5"), &file("b.hdf5"), &[]);
    assert!(good, "{text}");
    // SWIFT's smoothing lengths are its own, but the file says for how many neighbors the radii are: nothing is lost on the way to it.
    assert!(!text.lines().any(|l| l.contains("swift holds") || l.contains("not hold")), "{text}");
    let (good, text) = convert(&file("b.hdf5"), &file("c.vtu"), &[]);
    assert!(good && !text.contains("hold"), "{text}");
    let (good, text) = convert(&file("c.vtu"), &file("d.vtk"), &["--to", "vtk"]);
    assert!(good, "{text}");
    for lost in ["the unit system", "the box", "which axes are periodic", "the kernel", "the provenance"] {
        assert!(text.contains(&format!("vtk does not hold {lost}")), "{lost}: {text}");
    }
    assert!(!text.contains("column"), "{text}");

    let (first, vtu, vtk) = (read(&file("a.h5")), read(&file("c.vtu")), read(&file("d.vtk")));
    let columns = &first.species[0].table.columns;
    assert!(columns.len() >= 9 && columns.iter().all(|c| c.values.len() >= 60), "{}", columns.len());
    for c in columns.iter().filter(|c| c.name != names::SUPPORT_RADIUS) {
        for last in [&vtu, &vtk] {
            let found = last.species[0].table.column(&c.name).unwrap_or_else(|| panic!("no {}", c.name));
            assert_eq!(found.values.to_f64(), c.values.to_f64(), "{}", c.name);
        }
        assert_eq!(vtu.species[0].table.column(&c.name).unwrap().dimension, c.dimension, "{}", c.name);
    }
    let same = |name: &str| same(&read(&file("b.hdf5")), &vtu, name, 6e-8);
    same(names::SUPPORT_RADIUS);
    let (a, b) = (&first.header, &vtu.header);
    assert_eq!((a.units, a.box_size, a.periodic, a.time), (b.units, b.box_size, b.periodic, b.time));
    assert_eq!((a.dimension, &a.kernel, a.kernel_neighbors), (b.dimension, &b.kernel, b.kernel_neighbors));
    assert!(!a.provenance.is_empty() && a.provenance.iter().all(|fact| b.provenance.contains(fact)));
    assert_eq!((a.units, a.box_size), (UnitSystem::si(), [4000.0; 3]));
}

#[test]
fn a_file_without_densities_gets_lengths_by_summation() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    // A lattice of density 1.
    let n = 8;
    let mut p = particles();
    let count = n * n * n;
    let place = |i: usize| [i % n, i / n % n, i / n / n].map(|k| 2.0 * (k as f64 + 0.5) / n as f64);
    let table = &mut p.species[0].table;
    table.count = count;
    table.columns.retain(|c| [names::COORDINATES, names::MASSES, names::INTERNAL_ENERGY].contains(&c.name.as_str()));
    for c in &mut table.columns {
        c.values = Values::F64(match c.name.as_str() {
            names::COORDINATES => (0..count).flat_map(place).collect(),
            names::MASSES => vec![8.0 / count as f64; count],
            _ => vec![1.0; count],
        });
    }
    p.header.kernel_neighbors = 0.0;
    sph_formats::write(FORMATS, &file("a.h5"), None, &p, WriteOptions::default()).unwrap();
    let (good, text) = convert(&file("a.h5"), &file("b.hdf5"), &[]);
    assert!(good && text.contains("a density summed over them"), "{text}");
    let gas = &read(&file("b.hdf5")).species[0].table;
    assert!(gas.column(names::DENSITY).is_none());
    // 64 neighbors, which the new file states, lie within the support.
    let expected = (64.0 / 4.18879020478639_f64).cbrt() * 2.0 / n as f64;
    let found = gas.column(names::SUPPORT_RADIUS).unwrap().values.to_f64();
    assert!(found.iter().all(|h| (h / expected - 1.0).abs() < 0.02), "{:?} of {expected}", &found[..3]);
}

#[test]
fn losses_are_listed_and_units_converted() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let original = particles();
    sph_formats::write(FORMATS, &file("a.h5"), None, &original, WriteOptions::default()).unwrap();
    let (good, text) = convert(&file("a.h5"), &file("b.gadget"), &["--units", "cgs"]);
    assert!(good, "{text}");
    for lost in ["'IronFraction'", "the kernel", "the provenance"] {
        assert!(text.contains(&format!("does not hold {lost}")) || text.contains(&format!("column {lost}")), "{text}");
    }
    assert!(!text.contains("unit system"), "{text}");
    let back = read(&file("b.gadget"));
    let factor = 6.957e10;
    for (x, y) in original.species[0].table.columns[0]
        .values
        .to_f64()
        .iter()
        .zip(back.species[0].table.columns[0].values.to_f64())
    {
        assert!((x * factor / y - 1.0).abs() < 1e-6);
    }
    let (good, text) = convert(&file("a.h5"), &file("c.hdf5"), &["--units", "furlongs"]);
    assert!(!good && text.contains("furlongs") && !file("c.hdf5").exists(), "{text}");
    std::fs::write(file("grid.csv"), "x,y,rho\n0,0,1\n1,0,2\n0,1,3\n1,1,4\n").unwrap();
    let (good, text) = convert(&file("grid.csv"), &file("c.hdf5"), &[]);
    assert!(!good && text.contains("holds a grid"), "{text}");
}

/// A pressure that the scene states without a unit is converted with what it is of: P = (gamma - 1) rho u holds in any units.
#[test]
fn a_pressure_without_a_unit_is_converted_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: String| folder.path().join(name);
    for (d, corners) in [(1, "[[0], [1]]"), (2, "[[0, 0], [1, 1]]"), (3, "[[0, 0, 0], [1, 1, 1]]")] {
        let text = format!(
            "input: {{expression: '1'}}\ndomain: {{box: {corners}, boundary: periodic}}\nparticles: 64\npolish: none\nfields: {{pressure: 3}}\n"
        );
        let scene = file(format!("{d}.yaml"));
        std::fs::write(&scene, text).unwrap();
        for from in ["hdf5", "csv", "vtu", "nc"] {
            let (made, si) = (file(format!("{d}.{from}")), file(format!("{d}-si-of-{from}.hdf5")));
            let mut command = Command::cargo_bin("sph-prep").unwrap();
            command.arg("--scene").arg(&scene).arg("--out").arg(&made).arg("--quiet");
            assert!(command.output().unwrap().status.success(), "{d}-D, {from}");
            let (good, text) = convert(&made, &si, &["--units", "si", "--input-units", "cgs"]);
            assert!(good, "{text}");
            let converted = read(&si);
            let table = &converted.species[0].table;
            let of = |name: &str| table.column(name).unwrap().values.to_f64();
            let (p, rho, u) = (of(names::PRESSURE), of(names::DENSITY), of(names::INTERNAL_ENERGY));
            let ratio = p[9] / (2.0 / 3.0 * rho[9] * u[9]);
            assert!((ratio - 1.0).abs() < 0.1, "{d}-D, {from}: {ratio}");
            assert!((p[9] / 0.3 - 1.0).abs() < 1e-6, "{d}-D, {from}: {} Pa", p[9]);
        }
    }
}

#[test]
fn a_piece_of_the_snapshot_that_is_converted_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let options = WriteOptions { compression: 0, double_precision: true };
    sph_formats::write_files(FORMATS, &file("s.hdf5"), Some("gadget"), &particles(), 2, options).unwrap();
    let (good, text) = convert(&file("s.0.hdf5"), &file("s.1.hdf5"), &["--to", "gadget"]);
    assert!(!good && text.contains("a piece of the snapshot"), "{text}");
    assert_eq!(read(&file("s.0.hdf5")).species[0].table.count, 500);
    // One that is none of it is.
    let (good, text) = convert(&file("s.0.hdf5"), &file("s.2.hdf5"), &["--to", "gadget"]);
    assert!(good, "{text}");
}

#[test]
fn values_that_are_no_numbers_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let mut broken = particles();
    let columns = &mut broken.species[0].table.columns;
    let Values::F64(v) = &mut columns.iter_mut().find(|c| c.name == names::VELOCITIES).unwrap().values else {
        panic!()
    };
    v[7] = f64::NAN;
    sph_formats::write(FORMATS, &file("a.vtu"), None, &broken, WriteOptions::default()).unwrap();
    let (good, text) = convert(&file("a.vtu"), &file("b.vtu"), &[]);
    assert!(good && text.contains("'Velocities' has 1 values of 1500 that are no finite numbers"), "{text}");
}

/// Radii are lengths in a table of all types as well, and black holes of SWIFT have their masses under another name.
#[test]
fn point_masses_keep_their_radii_and_masses() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let mut with_hole = particles();
    with_hole.header.units = UnitSystem::galactic();
    let column = |name: &str, components: usize, values: Vec<f64>, dimension| Column {
        name: name.into(),
        components,
        values: Values::F64(values),
        dimension,
    };
    let columns = vec![
        column(names::COORDINATES, 3, vec![0.5; 3], UnitDimension::LENGTH),
        column(names::VELOCITIES, 3, vec![0.0; 3], UnitDimension::VELOCITY),
        column(names::MASSES, 1, vec![7.0], UnitDimension::MASS),
        column(names::ACCRETION_RADIUS, 1, vec![0.25], UnitDimension::LENGTH),
    ];
    with_hole.species.push(Species { part_type: 5, table: ParticleTable { count: 1, columns } });
    let length = with_hole.header.units.length;
    sph_formats::write(FORMATS, &file("a.vtu"), None, &with_hole, WriteOptions::default()).unwrap();
    let (good, text) = convert(&file("a.vtu"), &file("b.hdf5"), &["--to", "gadget", "--units", "si", "--double"]);
    assert!(good, "{text}");
    let hole = |file: &ParticleFile| file.species.iter().find(|s| s.part_type == 5).unwrap().table.clone();
    let radius = hole(&read(&file("b.hdf5"))).column(names::ACCRETION_RADIUS).unwrap().values.get(0);
    assert!((radius / (0.25 * length / 100.0) - 1.0).abs() < 1e-6, "{radius:e}");
    // What a format has no place for is refused, and may be left out.
    let refused = |args: &[&str], why: &str| {
        let (good, text) = convert(&file("a.vtu"), &file("e.dat"), args);
        assert!(!good && text.contains(why) && !file("e.dat").exists(), "{text}");
    };
    refused(&["--to", "sph-exa"], "--types 0");
    refused(&["--to", "gadget-binary", "--types", "0,3"], "names 3, but the file has 500 of type 0 and 1 of type 5");
    let (good, text) = convert(&file("a.vtu"), &file("e.dat"), &["--to", "gadget-binary", "--types", "0"]);
    assert!(good && text.contains("left out, as --types says: 1 of type 5"), "{text}");
    assert_eq!(
        read(&file("e.dat")).species.iter().map(|s| (s.part_type, s.table.count)).collect::<Vec<_>>(),
        [(0, 500)]
    );
    // What has no mass says so.
    with_hole.species[1].table.columns.remove(2);
    sph_formats::write(FORMATS, &file("c.npz"), None, &with_hole, WriteOptions::default()).unwrap();
    let (_, text) = convert(&file("c.npz"), &file("d.npz"), &[]);
    assert!(text.contains("the 1 particles of type 5 have no masses"), "{text}");
}

#[test]
fn pure_numbers_are_converted_only_where_their_units_are_said() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let mut pure = particles();
    pure.header.units = UnitSystem::CODE;
    sph_formats::write(FORMATS, &file("pure.hdf5"), None, &pure, WriteOptions::default()).unwrap();
    sph_formats::write(FORMATS, &file("solar.hdf5"), None, &particles(), WriteOptions::default()).unwrap();
    let (good, text) = convert(&file("pure.hdf5"), &file("a.hdf5"), &["--units", "galactic"]);
    assert!(!good && text.contains("--input-units") && !file("a.hdf5").exists(), "{text}");
    let (good, text) = convert(&file("pure.hdf5"), &file("a.hdf5"), &["--units", "galactic", "--input-units", "solar"]);
    assert!(good, "{text}");
    let (good, text) = convert(&file("solar.hdf5"), &file("b.hdf5"), &["--units", "galactic"]);
    assert!(good, "{text}");
    for name in [names::MASSES, names::VELOCITIES, names::DENSITY] {
        same(&read(&file("b.hdf5")), &read(&file("a.hdf5")), name, 2e-7);
    }
    let (good, text) = convert(&file("solar.hdf5"), &file("c.hdf5"), &["--input-units", "cgs"]);
    assert!(!good && text.contains("states its own"), "{text}");
}

/// Beyond 2^53 an f64 does not tell one number from the next.
#[test]
fn numbers_of_particles_beyond_the_digits_of_floats_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let mut numbered = particles();
    let ids: Vec<i64> = (0..500).map(|i| (1 << 54) + 1 + i).collect();
    let column = Column {
        name: names::PARTICLE_IDS.into(),
        components: 1,
        values: Values::I64(ids.clone()),
        dimension: UnitDimension::NONE,
    };
    numbered.species[0].table.columns.push(column);
    for name in ["a.vtu", "a.vtp", "a.vtk"] {
        let path = folder.path().join(name);
        sph_formats::write(FORMATS, &path, None, &numbered, WriteOptions::default()).unwrap();
        let back = read(&path);
        assert_eq!(
            back.species[0].table.column(names::PARTICLE_IDS).unwrap().values,
            Values::I64(ids.clone()),
            "{name}"
        );
    }
}
