//! `sph-prep check` on files that it wrote, and on the same with one thing wrong.

use super::support::{Folder, Outcome, sph_prep, succeed};
use sph_formats::{Column, FORMATS, FieldRequest, FileContent, ParticleFile, Values};
use sph_prep::check::Level;

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

fn column<'a>(file: &'a mut ParticleFile, name: &str) -> &'a mut Column {
    file.species[0].table.columns.iter_mut().find(|c| c.name == name).unwrap_or_else(|| panic!("no {name}"))
}
