//! Fields that foreign programs wrote, number by number. `tests/foreign/fields.py FOLDER` writes them; then
//!
//! ```sh
//! FOREIGN_FIELDS=FOLDER cargo test -p sph-formats --test formats foreign -- --ignored
//! ```

use sph_formats::{FORMATS, FieldRequest, FileContent, Geometry, RawField, read};
use std::path::{Path, PathBuf};

/// Relative difference that two precisions may make: files hold f32 or f64 of numbers that are exact in both, but axes
/// are computed.
const TOLERANCE: f64 = 1e-6;

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|n| n.parse().unwrap()).collect()
}

fn close(found: &[f64], expected: &[f64]) -> bool {
    let same = |(a, b): (&f64, &f64)| (a - b).abs() <= TOLERANCE * b.abs().max(1.0);
    found.len() == expected.len() && found.iter().zip(expected).all(same)
}

/// What is wrong with a field, by the text beside its file.
fn difference(field: &RawField, expected: &str) -> Option<String> {
    let mut axes = match &field.geometry {
        Geometry::Grid { axes, .. } => axes.iter(),
        _ => [].iter(),
    };
    for line in expected.lines() {
        let (key, rest) = line.split_once(' ').unwrap();
        let (name, list) = rest.split_once(' ').unwrap_or((rest, ""));
        let right = match key {
            "geometry" => match field.geometry {
                Geometry::Radial { .. } => name == "radial",
                Geometry::Grid { .. } => name == "grid",
                Geometry::Refined(_) => name == "refined grid",
                Geometry::Mesh { .. } => name == "mesh",
                Geometry::Cloud { .. } => name == "cloud",
                Geometry::Surface { .. } => name == "surface",
            },
            "axis" => axes.next().is_some_and(|a| a.name == name && close(&a.nodes, &numbers(list))),
            "radii" => matches!(&field.geometry, Geometry::Radial { nodes, .. } if close(nodes, &numbers(rest))),
            "values" => {
                field.density.as_deref() == Some(name)
                    && field.variable(name).is_some_and(|v| close(&v.values.to_f64(), &numbers(list)))
            }
            other => panic!("the line '{other}' is not known"),
        };
        if !right {
            let density = field.density.as_ref().and_then(|d| field.variable(d)).map(|v| v.values.to_f64());
            return Some(format!("expected '{line}', found {:?} with {density:?}", field.geometry));
        }
    }
    None
}

#[test]
#[ignore = "needs files of foreign programs"]
fn fields_of_foreign_programs_are_read_number_by_number() {
    let folder = PathBuf::from(std::env::var("FOREIGN_FIELDS").expect("FOREIGN_FIELDS names the folder of the files"));
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    let (mut count, mut wrong) = (0, Vec::new());
    for path in paths.iter().filter(|p| p.extension().is_some_and(|e| e == "expected")) {
        let file: &Path = &path.with_extension("");
        let expected = std::fs::read_to_string(path).unwrap();
        count += 1;
        let problem = match read(FORMATS, file, None, &FieldRequest::default()) {
            Ok(FileContent::Field(field)) => difference(&field, &expected),
            Ok(FileContent::Particles(_)) => Some("was taken for particles".into()),
            Err(e) => Some(e.to_string()),
        };
        wrong.extend(problem.map(|p| format!("{}: {p}", file.display())));
    }
    assert!(count > 0, "there are no files in '{}'", folder.display());
    assert!(wrong.is_empty(), "{} of {count} files:\n{}", wrong.len(), wrong.join("\n"));
    println!("{count} files of foreign programs read number by number");
}
