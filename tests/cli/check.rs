//! `sph-prep check` on files that it wrote, and on the same with one thing wrong.

use super::support::{Folder, Outcome, sph_prep, succeed};
use sph_formats::{Column, FORMATS, FieldRequest, FileContent, ParticleFile, Species, Values};
use sph_prep::check::{Finding, Level};

const STAR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/polytrope-1.5.nc");

fn check(folder: &Folder, name: &str, code: &str) -> Outcome {
    sph_prep(&["check", &folder.path(name).display().to_string(), "--for", code])
}

fn read(folder: &Folder, name: &str) -> ParticleFile {
    match sph_formats::read(FORMATS, &folder.path(name), None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(file) => file,
        FileContent::Field(_) => panic!("a field"),
    }
}

#[test]
fn a_file_for_a_code_is_taken_and_one_for_another_is_told_apart() {
    let folder = Folder::new();
    let out = folder.path("ic.hdf5").display().to_string();
    succeed(&["--in", STAR, "-n", "2000", "--for", "swift", "--out", &out, "--quiet"]);
    let own = check(&folder, "ic.hdf5", "swift");
    assert_eq!(own.code, Some(0), "{own:?}");
    for part in ["smoothing lengths: are 1.000 times", "Density: SWIFT sums 1.000 times", "it stays still"] {
        assert!(own.stdout.contains(part), "{part}: {}", own.stdout);
    }
    let other = check(&folder, "ic.hdf5", "swift:eta=2");
    assert_eq!(other.code, Some(0), "{other:?}");
    for part in ["WARNING  net force", "WARNING  smoothing lengths", "SPH:resolution_eta 2: 203.9 neighbors"] {
        assert!(other.stdout.contains(part), "{part}: {}", other.stdout);
    }
}

/// Each of these stops a code, or makes it run on nonsense.
#[test]
fn what_a_code_would_stumble_over_is_an_error_with_its_place() {
    let folder = Folder::new();
    let out = folder.path("ic.hdf5").display().to_string();
    succeed(&["--in", STAR, "-n", "300", "--iterations", "0", "--polish", "none", "--out", &out, "--quiet"]);
    let good = read(&folder, "ic.hdf5");
    let code = sph_prep::codes::TargetCode::parse("swift").unwrap();
    let worst = |file: &ParticleFile| {
        let found = sph_prep::check::check(file, &code).unwrap();
        found
            .into_iter()
            .filter(|f| f.level == Level::Error)
            .map(|f| format!("{}: {}", f.what, f.text))
            .collect::<Vec<_>>()
    };
    assert_eq!(worst(&good), Vec::<String>::new());
    let set = |name: &'static str, index: usize, value: f64| {
        move |file: &mut ParticleFile| {
            let column = column(file, name);
            let mut values = column.values.to_f64();
            values[index] = value;
            column.values = Values::F64(values);
        }
    };
    type Change<'a> = Box<dyn Fn(&mut ParticleFile) + 'a>;
    let without = |name: &'static str| -> Change<'_> {
        Box::new(move |file| file.species[0].table.columns.retain(|c| c.name != name))
    };
    let changes: Vec<(Change<'_>, &str)> = vec![
        (without("Velocities"), "Velocities: is missing"),
        (without("InternalEnergy"), "InternalEnergy: is missing"),
        (Box::new(set("InternalEnergy", 5, 0.0)), "InternalEnergy: is 0 at particle 5"),
        (Box::new(set("Density", 7, -1.0)), "Density: is -1 at particle 7"),
        (Box::new(set("Masses", 2, 1e6)), "Masses: go from"),
        (
            Box::new(|file| {
                let ids = column(file, "ParticleIDs");
                ids.values = Values::I64((0..ids.values.len()).map(|i| i as i64 / 2 + 1).collect());
            }),
            "ParticleIDs: 150 of 300 are used twice",
        ),
        (
            Box::new(|file| {
                let places = column(file, "Coordinates");
                let mut values = places.values.to_f64();
                values.copy_within(0..3, 3);
                places.values = Values::F64(values);
            }),
            "particles: two are",
        ),
        (
            Box::new(|file| {
                let places = column(file, "Coordinates");
                places.values = Values::F64(places.values.to_f64().iter().map(|x| x - 1e9).collect());
            }),
            "outside of the box",
        ),
    ];
    for (change, text) in changes {
        let mut file = good.clone();
        change(&mut file);
        let found = worst(&file);
        assert!(found.iter().any(|f| f.contains(text)), "{text}: {found:?}");
    }
    // A table without energies, as a file.
    let table = folder.path("ic.csv").display().to_string();
    succeed(&["convert", &out, &table]);
    let text = std::fs::read_to_string(&table).unwrap().replace("InternalEnergy", "Warmth");
    std::fs::write(&table, text).unwrap();
    let outcome = check(&folder, "ic.csv", "swift");
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    assert!(outcome.stdout.contains("ERROR    InternalEnergy: is missing"), "{outcome:?}");
}

/// All that attracts, not the gas alone.
#[test]
fn particles_of_other_types_are_looked_at_as_the_gas_is() {
    let folder = Folder::new();
    let out = folder.path("ic.hdf5").display().to_string();
    succeed(&["--in", STAR, "-n", "300", "--iterations", "0", "--polish", "none", "--out", &out, "--quiet"]);
    let mut good = read(&folder, "ic.hdf5");
    let mut dark = good.species[0].table.clone();
    let wanted = ["Coordinates", "Velocities", "Masses", "ParticleIDs"];
    dark.columns.retain(|c| wanted.contains(&c.name.as_str()));
    let mut ids = dark.columns.iter_mut().filter(|c| c.name == "ParticleIDs");
    ids.next().unwrap().values = Values::I64((1001..=1300).collect());
    good.species.push(Species { part_type: 1, table: dark });
    let errors = |file: &ParticleFile, code: &str| {
        let code = sph_prep::codes::TargetCode::parse(code).unwrap();
        let found = sph_prep::check::check(file, &code).unwrap();
        // AREPO does not start with a body in a vacuum, nor without the parameters of cosmology that its own format has.
        let of_arepo = |f: &Finding| code.sheet.name == "arepo" && ["box", "header"].contains(&f.what.as_str());
        let errors = found.into_iter().filter(|f| f.level == Level::Error && !of_arepo(f));
        errors.map(|f| format!("{}: {}", f.what, f.text)).collect::<Vec<_>>()
    };
    for code in ["swift", "gadget4", "gizmo", "arepo"] {
        assert_eq!(errors(&good, code), Vec::<String>::new(), "{code}");
        for name in wanted {
            let mut file = good.clone();
            file.species[1].table.columns.retain(|c| c.name != name);
            let found = errors(&file, code);
            assert!(found.iter().any(|f| f.starts_with(&format!("PartType1/{name}: is missing"))), "{code}: {found:?}");
        }
        let set = [("Masses", f64::NAN), ("Masses", -1.0), ("Coordinates", f64::NAN), ("Velocities", f64::INFINITY)];
        for (name, value) in set {
            let mut file = good.clone();
            let mut column = file.species[1].table.columns.iter_mut().filter(|c| c.name == name);
            let values = &mut column.next().unwrap().values;
            let mut changed = values.to_f64();
            changed[4] = value;
            *values = Values::F64(changed);
            let found = errors(&file, code);
            assert_eq!(found.len(), 1, "{code}, {name}: {found:?}");
            assert!(found[0].starts_with(&format!("PartType1/{name}: is {value}")), "{code}: {found:?}");
        }
    }
    let mut file = good.clone();
    let mut places = file.species[1].table.columns.iter_mut().filter(|c| c.name == "Coordinates");
    places.next().unwrap().values = Values::F64(vec![-1.0; 900]);
    let found = errors(&file, "swift");
    assert!(found.iter().any(|f| f.contains("PartType1/Coordinates") && f.contains("outside of the box")), "{found:?}");
}

#[test]
fn numbers_that_a_code_does_not_take_are_errors() {
    let folder = Folder::new();
    let out = folder.path("ic.hdf5").display().to_string();
    succeed(&["--in", STAR, "-n", "300", "--iterations", "0", "--polish", "none", "--out", &out, "--quiet"]);
    let good = read(&folder, "ic.hdf5");
    let level = |first: f64, step: f64, code: &str| {
        let mut file = good.clone();
        column(&mut file, "ParticleIDs").values = Values::F64((0..300).map(|i| first + step * f64::from(i)).collect());
        let code = sph_prep::codes::TargetCode::parse(code).unwrap();
        let found = sph_prep::check::check(&file, &code).unwrap();
        found.into_iter().filter(|f| f.what == "ParticleIDs").map(|f| f.level).max()
    };
    assert_eq!(level(1.0, 1.0, "swift"), None);
    assert_eq!(level(0.0, 1.0, "swift"), Some(Level::Error));
    assert_eq!(level(0.0, 1.0, "gadget4"), Some(Level::Warning));
    assert_eq!(level(1.5, 1.0, "gadget4"), Some(Level::Error));
    let of_energy = |code: &str| {
        let mut file = good.clone();
        let energy = column(&mut file, "InternalEnergy");
        let mut values = energy.values.to_f64();
        values[5] = 1e300;
        energy.values = Values::F64(values);
        let code = sph_prep::codes::TargetCode::parse(code).unwrap();
        let found = sph_prep::check::check(&file, &code).unwrap();
        found
            .into_iter()
            .any(|f| f.level == Level::Error && f.text.contains("at particle 5, beyond the single precision"))
    };
    assert!(of_energy("swift") && of_energy("gadget4") && !of_energy("phantom"));
}

/// Phantom has one mass for all gas, and starts from its own files.
#[test]
fn what_phantom_cannot_start_from_is_told() {
    let folder = Folder::new();
    let (out, dump) = (folder.path("ic.hdf5").display().to_string(), folder.path("ic.phantom").display().to_string());
    succeed(&["--in", STAR, "-n", "300", "--iterations", "0", "--polish", "none", "--out", &out, "--quiet"]);
    let of_swift = check(&folder, "ic.hdf5", "phantom");
    assert!(
        of_swift.stdout.contains("WARNING  format: is 'gadget', from which Phantom does not start"),
        "{of_swift:?}"
    );
    assert!(of_swift.stdout.contains("--to phantom"), "{of_swift:?}");
    succeed(&["convert", &out, &dump]);
    assert!(!check(&folder, "ic.phantom", "phantom").stdout.contains("format:"));
    assert!(check(&folder, "ic.phantom", "swift").stdout.contains("is 'phantom', from which SWIFT"));
    let mut file = read(&folder, "ic.hdf5");
    let masses = column(&mut file, "Masses");
    let own = masses.values.get(0);
    masses.values = Values::F64((0..300).map(|i| own * (1.0 + 1e-3 * f64::from(i))).collect());
    let code = sph_prep::codes::TargetCode::parse("phantom").unwrap();
    let found = sph_prep::check::check(&file, &code).unwrap();
    assert!(found.iter().any(|f| f.level == Level::Error && f.text.contains("one mass for all")), "{found:?}");
}

#[test]
fn several_files_are_one_too_many_for_swift() {
    let folder = Folder::new();
    let (out, split) = (folder.path("ic.hdf5").display().to_string(), folder.path("split.hdf5").display().to_string());
    succeed(&["--in", STAR, "-n", "300", "--iterations", "0", "--polish", "none", "--out", &out, "--quiet"]);
    succeed(&["convert", &out, &split, "--to", "gadget", "--files", "2"]);
    let swift = check(&folder, "split.0.hdf5", "swift");
    assert!(swift.code == Some(1) && swift.stdout.contains("ERROR    files: are several"), "{swift:?}");
    assert!(!check(&folder, "split.0.hdf5", "gadget4").stdout.contains("files:"));
}

/// GADGET's family reads a box where it is built to be periodic.
#[test]
fn the_edges_of_an_open_box_do_not_matter_to_gadget() {
    let folder = Folder::new();
    let out = folder.path("ic.hdf5").display().to_string();
    succeed(&["--in", STAR, "-n", "300", "--iterations", "0", "--polish", "none", "--out", &out, "--quiet"]);
    let mut file = read(&folder, "ic.hdf5");
    let size = file.header.box_size[0];
    let mut boxes = |code: &str, edges: [f64; 3], periodic: bool| {
        (file.header.box_size, file.header.periodic) = (edges.map(|edge| edge * size), [periodic; 3]);
        let code = sph_prep::codes::TargetCode::parse(code).unwrap();
        let found = sph_prep::check::check(&file, &code).unwrap();
        found.into_iter().filter(|f| f.what == "box").map(|f| f.level).max()
    };
    for (code, halved) in [("gadget4", Level::Warning), ("gadget2", Level::Error)] {
        for edges in [[1.0, 1.5, 1.0], [1.0, 2.0, 1.0]] {
            assert_eq!(boxes(code, edges, false), None, "{code}: {edges:?}");
        }
        assert_eq!(boxes(code, [1.0, 1.5, 1.0], true), Some(Level::Error), "{code}");
        assert_eq!(boxes(code, [1.0, 2.0, 1.0], true), Some(halved), "{code}");
    }
}

/// GADGET's format 1 does not say that the box is no boundary.
#[test]
fn a_box_may_be_said_to_be_no_boundary() {
    let folder = Folder::new();
    let out = folder.path("ic.gadget1").display().to_string();
    succeed(&["--in", STAR, "-n", "1000", "--units", "cgs", "--to", "gadget-binary-1", "--out", &out, "--quiet"]);
    let periodic = sph_prep(&["run", &out, "--for", "gadget2", "--duration", "0.1", "--quiet"]);
    assert!(periodic.stdout.contains("without gravity: the box is periodic (--open"), "{periodic:?}");
    let refused = sph_prep(&["run", &out, "--for", "gadget2", "--gravity", "1", "--quiet"]);
    assert!(refused.code == Some(2) && refused.stderr.contains("--open"), "{refused:?}");
    let open = sph_prep(&["run", &out, "--for", "gadget2", "--duration", "0.1", "--gravity", "1", "--open", "--quiet"]);
    assert!(open.code == Some(0) && !open.stdout.contains("without gravity"), "{open:?}");
    let checked = sph_prep(&["check", &out, "--for", "gadget2"]);
    assert!(checked.stdout.contains("net force: is not looked at") && checked.stdout.contains("--open"), "{checked:?}");
    let back = folder.path("back.hdf5").display().to_string();
    succeed(&["convert", &out, &back, "--to", "swift", "--open"]);
    assert_eq!(read(&folder, "back.hdf5").header.periodic, [false; 3]);
}

/// Codes have builds for a plane and a line, which are named; AREPO's cells fill the box, and its mesh does not bear a vacuum about a body.
#[test]
fn builds_and_boxes_that_codes_do_not_have_are_told() {
    let folder = Folder::new();
    let scene = folder.file(
        "plane.yaml",
        "input: {expression: '1'}\ndomain: {box: [[0, 0], [1, 1]], boundary: [periodic]}\nparticles: 400\npolish: none\n",
    );
    let scene = scene.display().to_string();
    for (code, option) in [("swift", "--with-hydro-dimension=2"), ("gadget4", "TWODIMS"), ("arepo", "TWODIMS")] {
        let out = folder.path("plane.hdf5").display().to_string();
        succeed(&["--scene", &scene, "--for", code, "--out", &out, "--quiet"]);
        let told = check(&folder, "plane.hdf5", code);
        assert!(told.code == Some(0) && told.stdout.contains(option), "{code}: {told:?}");
    }
    let told = check(&folder, "plane.hdf5", "phantom");
    assert!(told.code == Some(1) && told.stdout.contains("Phantom has 3 alone"), "{told:?}");
    let out = folder.path("star.hdf5").display().to_string();
    succeed(&[
        "--in",
        STAR,
        "-n",
        "500",
        "--iterations",
        "0",
        "--polish",
        "none",
        "--for",
        "arepo",
        "--out",
        &out,
        "--quiet",
    ]);
    let told = check(&folder, "star.hdf5", "arepo");
    assert!(told.code == Some(1) && told.stdout.contains("a body in a vacuum"), "{told:?}");
}

/// What only some particles have wrong: a few smoothing lengths, places beyond a periodic box, speeds that no matter has.
#[test]
fn what_is_wrong_of_some_particles_is_told() {
    let folder = Folder::new();
    let out = folder.path("ic.hdf5").display().to_string();
    succeed(&["--in", STAR, "-n", "300", "--iterations", "0", "--polish", "none", "--out", &out, "--quiet"]);
    let good = read(&folder, "ic.hdf5");
    let told = |code: &str, spoil: &dyn Fn(&mut ParticleFile)| {
        let mut file = good.clone();
        spoil(&mut file);
        let code = sph_prep::codes::TargetCode::parse(code).unwrap();
        let found = sph_prep::check::check(&file, &code).unwrap();
        found.iter().map(|f| format!("{:?} {}: {}", f.level, f.what, f.text)).collect::<Vec<_>>().join("\n")
    };
    let scaled = |file: &mut ParticleFile, name: &str, every: usize, factor: f64| {
        let column = column(file, name);
        let scale = |(i, v): (usize, f64)| if i.is_multiple_of(every) { factor * v } else { v };
        column.values = Values::F64(column.values.to_f64().into_iter().enumerate().map(scale).collect());
    };
    let strays = told("swift", &|file| scaled(file, "SupportRadius", 10, 5.0));
    assert!(strays.contains("of 30 of 300 particles are off"), "{strays}");
    let negative = told("swift", &|file| scaled(file, "SupportRadius", 10, -1.0));
    assert!(negative.contains("Error SmoothingLength: is -"), "{negative}");
    let fast = told("swift", &|file| column(file, "Velocities").values = Values::F64(vec![1e12; 900]));
    assert!(fast.contains("faster than light"), "{fast}");
    let beyond = told("gadget4", &|file| {
        file.header.periodic = [true; 3];
        scaled(file, "Coordinates", 900, 1e3);
    });
    assert!(beyond.contains("Warning Coordinates: particle 0 is at"), "{beyond}");
}

fn column<'a>(file: &'a mut ParticleFile, name: &str) -> &'a mut Column {
    file.species[0].table.columns.iter_mut().find(|c| c.name == name).unwrap_or_else(|| panic!("no {name}"))
}

/// Codes open a dataset by its name, and take its numbers by their own convention, whatever another group of the file says.
#[test]
fn smoothing_lengths_are_those_that_the_code_opens() {
    let folder = Folder::new();
    for (name, code) in [("swift.hdf5", "swift"), ("gadget.hdf5", "gadget4")] {
        let out = folder.path(name).display().to_string();
        let args = ["--in", STAR, "-n", "1000", "--iterations", "0", "--polish", "none", "--for", code, "--out", &out];
        succeed(&[&args[..], &["--quiet"]].concat());
    }
    for (name, code, level, [least, most]) in [
        ("swift.hdf5", "swift", Level::Good, [0.9, 1.2]),
        ("gadget.hdf5", "gadget4", Level::Good, [0.9, 1.2]),
        // The support radius is 1.94 smoothing lengths of 48 neighbors, and 64 have a radius that is a tenth larger.
        ("swift.hdf5", "gadget4", Level::Warning, [0.4, 0.6]),
        ("gadget.hdf5", "swift", Level::Warning, [1.7, 2.3]),
    ] {
        let code = sph_prep::codes::TargetCode::parse(code).unwrap();
        let found = sph_prep::check::check(&read(&folder, name), &code).unwrap();
        let told = found.iter().find(|f| f.what == "smoothing lengths").unwrap();
        let ratio: f64 = told.text.split(' ').nth(1).unwrap().parse().unwrap();
        assert!(told.level == level && (least..most).contains(&ratio), "{name}: {told:?}");
    }
}
