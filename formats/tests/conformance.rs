//! What every particle format of the registry has to stand, besides the round trips of `particles.rs`: numbers that mean
//! nothing, sizes that cannot be, columns of unusual shape. A new format is taken up by its line in the registry.

use crate::support::{can_read, column, particles_of, read_back, replace, write, writers};
use sph_formats::common::particle_names as names;
use sph_formats::registry::read;
use sph_formats::{FORMATS, FieldRequest, FormatError, UnitDimension, Values};

/// Places in a file that are tried, and bytes of its start and end among them.
const PLACES: usize = 80;
const ENDS: usize = 200;

#[test]
fn positions_and_masses_that_are_no_numbers_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for spec in writers() {
        let d = spec.capabilities.dimensions[0];
        for name in [names::COORDINATES, names::MASSES] {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut p = particles_of(spec, 9, d);
                let path = folder.path().join(format!("{}.{}", spec.name, spec.extensions[0]));
                let c = p.species[0].table.columns.iter_mut().find(|c| c.name == name).unwrap();
                let Values::F64(v) = &mut c.values else { panic!("{name} is no f64") };
                v[7 * c.components] = bad;
                let error = write(spec, &path, &p, false).unwrap_err();
                let text = error.to_string();
                assert!(matches!(error, FormatError::Output { .. }), "{}: {text}", spec.name);
                assert!(text.contains(&format!("'{name}' of particle 7")), "{}: {text}", spec.name);
                assert!(!path.exists(), "{} left a file behind", spec.name);
            }
        }
    }
}

#[test]
fn columns_of_unusual_kinds_come_back_or_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    for spec in writers().filter(|s| can_read(s)) {
        let mut p = particles_of(spec, 6, 3);
        let count = |n: usize| Values::F64((0..n).map(|i| i as f64 - 0.5).collect());
        let whole = Values::I64(vec![i64::from(i32::MIN), -1, 0, 1, 1 << 30, i64::from(i32::MAX)]);
        let extra = [
            column("Tensor", 9, count(54), UnitDimension::PRESSURE),
            column("a long name, with blanks and commas", 1, count(6), UnitDimension::NONE),
            column("Flags", 1, whole, UnitDimension::NONE),
        ];
        p.species[0].table.columns.extend(extra);
        let path = folder.path().join(format!("{}.{}", spec.name, spec.extensions[0]));
        match write(spec, &path, &p, true) {
            Err(e) => assert!(matches!(e, FormatError::Output { .. }), "{}: {e}", spec.name),
            Ok(()) => {
                let back = read_back(&path).unwrap_or_else(|e| panic!("{}: {e}", spec.name));
                for old in &p.species[0].table.columns[8..] {
                    if let Some(new) = back.species[0].table.column(&old.name) {
                        assert_eq!(new.components, old.components, "{}: {}", spec.name, old.name);
                        assert_eq!(new.values.to_f64(), old.values.to_f64(), "{}: {}", spec.name, old.name);
                    }
                }
            }
        }
    }
}

/// Words at the start, at the end and all over the file.
fn places(length: usize) -> Vec<usize> {
    let stride = (length / PLACES).max(1) | 1;
    let ends = (0..length.min(ENDS)).step_by(4).flat_map(|i| [i, length - i - 1]);
    ends.chain((0..length).step_by(stride)).collect()
}

#[test]
fn absurd_sizes_anywhere_are_refused_or_harmless() {
    let folder = tempfile::tempdir().unwrap();
    let huge: [&[u8]; 4] = [&[0xff; 8], b"\xff\xff\xff\x7f", b"\x7f\xff\xff\xff\xff\xff\xff\xff", b"99999999"];
    for spec in writers().filter(|s| can_read(s)) {
        let path = folder.path().join(format!("{}.{}", spec.name, spec.extensions[0]));
        write(spec, &path, &particles_of(spec, 12, 3), false).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let start = std::time::Instant::now();
        for at in places(whole.len()) {
            for word in huge {
                let mut bytes = whole.clone();
                bytes.iter_mut().skip(at).zip(word).for_each(|(to, from)| *to = *from);
                replace(&path, &bytes);
                match read(FORMATS, &path, None, &FieldRequest::default()) {
                    Ok(_) => {}
                    Err(e) => assert!(e.to_string().contains(&path.display().to_string()), "{}: {e}", spec.name),
                }
            }
        }
        println!("{}: {} bytes, {:.1?}", spec.name, whole.len(), start.elapsed());
    }
}
