//! SPH-EXA files against what the code's reader demands of a step, and outputs of its own.

use sph_formats::common::hdf5::Writer;
use sph_formats::common::hdf5_read::Reader;
use sph_formats::common::particle_names as names;
use sph_formats::{
    Column, FORMATS, FieldRequest, FileContent, FormatError, ParticleFile, ParticleTable, RunHeader, Species,
    UnitDimension, UnitSystem, Values, WriteOptions,
};
use std::path::Path;

fn gas() -> ParticleFile {
    let column = |name: &str, components, values: &[f64], dimension| Column {
        name: name.into(),
        components,
        values: Values::F64(values.to_vec()),
        dimension,
    };
    let columns = vec![
        column(names::COORDINATES, 3, &[0.5, 1.0, 1.5, 0.25, 0.75, 2.5], UnitDimension::LENGTH),
        column(names::VELOCITIES, 3, &[1.0, 0.0, 0.0, 0.0, -2.0, 0.0], UnitDimension::VELOCITY),
        column(names::MASSES, 1, &[0.5, 0.25], UnitDimension::MASS),
        column(names::SUPPORT_RADIUS, 1, &[0.5, 0.75], UnitDimension::LENGTH),
        column(names::INTERNAL_ENERGY, 1, &[1.5, 6.0], UnitDimension::SPECIFIC_ENERGY),
        column("Iron", 1, &[0.125, 1.0], UnitDimension::MASS),
    ];
    ParticleFile {
        header: RunHeader {
            dimension: 3,
            box_size: [1.0, 2.0, 3.0],
            box_corner: None,
            periodic: [false; 3],
            units: UnitSystem::solar(),
            time: 0.25,
            kernel: "M6".into(),
            kernel_neighbors: 110.0,
            provenance: vec![("Seed".into(), "1".into())],
            layouts: Vec::new(),
        },
        species: vec![Species { part_type: 0, table: ParticleTable { count: 2, columns } }],
    }
}

fn write(path: &Path, p: &ParticleFile) -> Result<(), FormatError> {
    sph_formats::write(FORMATS, path, Some("sph-exa"), p, WriteOptions::default())
}

fn read(path: &Path) -> ParticleFile {
    match sph_formats::read(FORMATS, path, Some("sph-exa"), &FieldRequest::default()).unwrap() {
        FileContent::Particles(p) => p,
        FileContent::Field(_) => panic!("read as a field"),
    }
}

#[test]
fn a_step_has_what_the_code_reads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sphexa");
    write(&path, &gas()).unwrap();
    let file = Reader::open(&path, "sph-exa").unwrap();
    let step = file.group_attributes("Step#0").unwrap();
    assert_eq!(step.numbers("box").unwrap(), [0.0, 1.0, 0.0, 2.0, 0.0, 3.0]);
    assert_eq!(step.numbers("boundaryType").unwrap(), [0.0; 3]);
    assert_eq!(step.numbers("numParticlesGlobal").unwrap(), [2.0]);
    assert_eq!(step.numbers("time").unwrap(), [0.25]);
    // Solar units are those in which G = 1.
    assert!((step.number("gravConstant").unwrap() - 1.0).abs() < 1e-12);
    let column = |name: &str| file.numbers(&format!("Step#0/{name}")).unwrap().unwrap().1.to_f64();
    assert_eq!(column("h"), [0.25, 0.375]);
    assert_eq!(column("vy"), [0.0, -2.0]);
    assert_eq!(column("id"), [1.0, 2.0]);
    // u = cv T with cv = R / (mui (gamma - 1)), by hand: 1.5 * 10 * (2/3) / 8.317e7.
    assert!((column("temp")[0] / 1.202_356_619_5e-7 - 1.0).abs() < 1e-9, "{:e}", column("temp")[0]);
    // Signal: sqrt(10/9 * 6) + 2 sqrt(3); the smallest h is 0.25.
    let dt = 0.1 * 0.2 * 0.25 / ((60.0f64 / 9.0).sqrt() + 2.0 * 3.0f64.sqrt());
    assert!((step.number("minDt").unwrap() / dt - 1.0).abs() < 1e-12);
    assert!((column("x_m1")[0] / dt - 1.0).abs() < 1e-6 && column("x_m1")[1] == 0.0);
    let back = read(&path);
    let iron = back.species[0].table.column("Iron").unwrap();
    assert_eq!((iron.values.to_f64(), iron.dimension), (vec![0.125, 1.0], UnitDimension::MASS));
    assert_eq!((back.header.units, back.header.kernel.as_str()), (UnitSystem::solar(), "M6"));
    assert_eq!((back.header.box_size, back.header.provenance), ([1.0, 2.0, 3.0], vec![("Seed".into(), "1".into())]));
}

/// Softening by the smallest spacing, and the neighbors where the sums are of the code's kernel: its own defaults are 0.005 in
/// whatever units, and 100.
#[test]
fn gravity_is_softened_by_the_spacing_and_the_neighbors_are_those_of_the_sums() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sphexa");
    let step = |p: &ParticleFile| {
        write(&path, p).unwrap();
        Reader::open(&path, "sph-exa").unwrap().group_attributes("Step#0").unwrap()
    };
    let mut p = gas();
    assert!(step(&p).number("eps").is_none() && step(&p).number("ng0").is_none());
    let table = &mut p.species[0].table;
    let masses = table.column(names::MASSES).unwrap().values.to_f64();
    let density = Column {
        name: names::DENSITY.into(),
        components: 1,
        values: Values::F64(vec![masses[0] * 64.0, masses[1] * 8.0]),
        dimension: UnitDimension::mass_density(3),
    };
    table.columns.push(density);
    p.header.kernel = "sinc^6".into();
    let found = step(&p);
    assert!((found.number("eps").unwrap() - 0.125).abs() < 1e-12);
    assert_eq!((found.number("ng0"), found.number("ngmax")), (Some(110.0), Some(165.0)));
    p.header.periodic = [true; 3];
    assert!(step(&p).number("eps").is_none());
}

#[test]
fn the_last_step_of_an_output_is_read_from_its_temperature_and_shifted_box() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.sphexa");
    let writer = Writer::create(&path).unwrap();
    for (name, x) in [("Step#2", 9.0), ("Step#10", -0.25)] {
        let step = writer.group(name).unwrap();
        step.numbers("box", &[-0.5, 0.5, -0.5, 0.5, -0.5, 0.5]).unwrap();
        step.numbers("boundaryType", &[1i8, 0, 1]).unwrap();
        step.numbers("time", &[2.0]).unwrap();
        step.numbers("gamma", &[1.4]).unwrap();
        step.numbers("muiConst", &[2.0f32]).unwrap();
        let line = |name: &str, value: f64| {
            step.dataset(name, 1, 1, 0, |_, out| {
                out.push(value);
                Ok(())
            })
            .unwrap();
        };
        for (name, value) in [("x", x), ("y", 0.0), ("z", 0.25), ("m", 2.0), ("h", 0.125), ("temp", 1e-7)] {
            line(name, value);
        }
    }
    writer.close().unwrap();
    let p = read(&path);
    let column = |name: &str| p.species[0].table.column(name).unwrap().values.to_f64();
    assert_eq!(column(names::COORDINATES), [0.25, 0.5, 0.75]);
    assert_eq!(column(names::SUPPORT_RADIUS), [0.25]);
    // 8.317e7 / 2 / 0.4 * 1e-7.
    assert!((column(names::INTERNAL_ENERGY)[0] - 10.396_25).abs() < 1e-9);
    assert_eq!((p.header.box_size, p.header.periodic, p.header.time), ([1.0; 3], [true, false, true], 2.0));
    assert!(p.header.provenance.iter().any(|(key, _)| key == "shifted"), "{:?}", p.header.provenance);
}

/// A column with the name of one of the code's own has another beside it.
#[test]
fn what_is_carried_under_a_name_of_the_codes_own_has_another() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sphexa");
    for own in ["temp", "x", "rho"] {
        let mut p = gas();
        let values = p.species[0].table.columns[5].values.to_f64();
        p.species[0].table.columns[5].name = own.into();
        write(&path, &p).unwrap();
        let back = read(&path);
        let table = &back.species[0].table;
        assert_eq!(table.column(&format!("{own}OfInput")).unwrap().values.to_f64(), values, "{own}");
        assert_eq!(table.column(names::COORDINATES).unwrap().values.get(0), 0.5);
    }
}

#[test]
fn what_the_code_cannot_hold_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |change: &dyn Fn(&mut ParticleFile)| {
        let mut p = gas();
        change(&mut p);
        write(&folder.path().join("a.sphexa"), &p).unwrap_err().to_string()
    };
    let text = refusal(&|p| p.species.push(Species { part_type: 1, table: p.species[0].table.clone() }));
    assert!(text.contains("type 1") && text.contains("gas only"), "{text}");
    let text = refusal(&|p| p.header.box_size[2] = 2.0);
    assert!(text.contains("within the box"), "{text}");
}

/// The code starts from temperatures, whatever energies are beside them.
#[test]
fn energies_that_contradict_the_temperatures_are_told() {
    use sph_formats::model::{DOUBT_KEY, LACKS_KEY};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sphexa");
    let said = |temperatures: Option<f64>| {
        let writer = Writer::create(&path).unwrap();
        {
            let step = writer.group("Step#0").unwrap();
            let columns = [("x", 1.0), ("y", 1.0), ("z", 1.0), ("m", 1.0), ("h", 1.0), ("u", 3.0)];
            for (name, value) in columns.into_iter().chain(temperatures.map(|t| ("temp", t))) {
                let fill = |rows: std::ops::Range<usize>, out: &mut Vec<f64>| {
                    out.extend(rows.map(|_| value));
                    Ok(())
                };
                step.dataset(name, 2, 1, 0, fill).unwrap();
            }
        }
        writer.close().unwrap();
        read(&path)
            .header
            .provenance
            .into_iter()
            .filter(|(key, _)| key == DOUBT_KEY || key == LACKS_KEY)
            .collect::<Vec<_>>()
    };
    // u mui (gamma - 1) / R with the mui of 10 and the index of 5/3 that hold where nothing is stated.
    let fits = 3.0 * 10.0 * (2.0 / 3.0) / 8.317e7;
    assert_eq!(said(Some(fits)), []);
    let [(_, other)] = said(Some(100.0 * fits)).try_into().unwrap();
    assert!(other.starts_with("u of particle 0 is 3, but its temp"), "{other}");
    let [(key, none)] = said(None).try_into().unwrap();
    assert!(key == LACKS_KEY && none.contains("temp"), "{none}");
}
