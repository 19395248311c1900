//! Files whose arrays are missing, of another kind, or of another size than they say: for every HDF5 and NetCDF file that our
//! writers make (and the small fields of foreign codes) each array in turn is left out, replaced and declared absurdly
//! large, and one is added. What the reader then says names the array, or it does without.
//!
//! The arrays are those found in the written file, so that a new flavor is taken up by its line in the registry.

#[path = "fuzz/seeds.rs"]
mod seeds;

use crate::support::{can_read, particles_of, replace, write, writers};
use hdf5_reader::group::Group;
use hdf5_reader::{Attribute, Dataset, Datatype, Hdf5File};
use rust_hdf5::{H5File, H5Group};
use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use sph_formats::common::particle_names as names;
use sph_formats::registry::HDF5_SIGNATURE;
use sph_formats::{FORMATS, FieldRequest, FileContent, FormatError, Geometry, ParticleFile, read};
use std::path::Path;

/// Rows that no file of a few kilobytes has (8 TiB of f64).
const ABSURD: usize = 1 << 40;

/// What is done to one array.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Change {
    Nothing,
    Left,
    /// Texts instead of numbers.
    Texts,
    /// Whole numbers instead of fractions, and the other way round.
    Kind,
    Shorter,
    Longer,
    Absurd,
    NaN,
}

const CHANGES: [Change; 7] =
    [Change::Left, Change::Texts, Change::Kind, Change::Shorter, Change::Longer, Change::Absurd, Change::NaN];

/// An array's numbers and shape.
struct Array {
    shape: Vec<usize>,
    numbers: Vec<f64>,
    integers: bool,
}

impl Array {
    fn changed(mut self, change: Change) -> Self {
        let row = self.numbers.len() / self.shape[0].max(1);
        match change {
            Change::Kind => self.integers = !self.integers,
            Change::NaN => {
                self.integers = false;
                self.numbers.fill(f64::NAN);
            }
            Change::Shorter if self.shape[0] > 1 => {
                self.shape[0] -= 1;
                self.numbers.truncate(self.numbers.len() - row);
            }
            Change::Longer => {
                self.shape[0] += 1;
                self.numbers.extend_from_within(..row);
            }
            _ => {}
        }
        self
    }
}

/// A copy of an HDF5 file, group by group, in which one dataset is changed and one may be added.
struct Copy<'a> {
    target: &'a str,
    change: Change,
    extra: bool,
}

impl Copy<'_> {
    fn make(&self, from: &Path, to: &Path) {
        let (source, file) = (Hdf5File::open(from).unwrap(), H5File::create(to).unwrap());
        self.group(&source.root_group().unwrap(), &file.root_group(), "");
        file.close().unwrap();
    }

    fn group(&self, from: &Group, to: &H5Group, path: &str) {
        for a in from.attributes().unwrap() {
            if let Ok(texts) = a.read_strings().map(|t| t.iter().map(|t| t.trim_end_matches('\0').to_owned()).collect())
            {
                let texts: Vec<String> = texts;
                match texts.as_slice() {
                    [one] => to.set_attr_string(&a.name, one).unwrap(),
                    many => {
                        to.set_attr_string_array(&a.name, &many.iter().map(String::as_str).collect::<Vec<_>>()).unwrap()
                    }
                }
            } else {
                to.set_attr_array_numeric(&a.name, &attribute(&a)).unwrap();
            }
        }
        let (groups, datasets) = from.members().unwrap();
        for group in groups {
            let path = format!("{path}{}/", group.name());
            self.group(&group, &to.create_group(group.name()).unwrap(), &path);
        }
        for dataset in &datasets {
            let here = format!("{path}{}", dataset.name());
            self.dataset(dataset, to, if here == self.target { self.change } else { Change::Nothing });
        }
        if self.extra && !datasets.is_empty() {
            to.new_dataset::<f64>().shape([2, 3, 4]).create("Extra").unwrap().write_raw(&[1.5; 24]).unwrap();
            to.write_vlen_strings("Words", &["an", "extra"]).unwrap();
        }
    }

    fn dataset(&self, from: &Dataset, to: &H5Group, change: Change) {
        let array = array(from).changed(change);
        let (name, shape) = (from.name(), array.shape.as_slice());
        match change {
            Change::Left => {}
            Change::Texts => drop(to.write_vlen_strings(name, &vec!["no number"; shape[0]]).unwrap()),
            Change::Absurd => {
                let shape = [&[ABSURD], &shape[1..]].concat();
                let chunk: Vec<usize> = shape.iter().map(|n| (*n).min(1 << 26)).collect();
                to.new_dataset::<f64>().shape(&shape).chunk(&chunk).create(name).unwrap();
            }
            _ if array.integers => {
                let whole: Vec<i64> = array.numbers.iter().map(|x| *x as i64).collect();
                to.new_dataset::<i64>().shape(shape).create(name).unwrap().write_raw(&whole).unwrap();
            }
            _ => to.new_dataset::<f64>().shape(shape).create(name).unwrap().write_raw(&array.numbers).unwrap(),
        }
    }
}

fn attribute(a: &Attribute) -> Vec<f64> {
    let whole = |size: u8, signed: bool| -> Vec<f64> {
        match (size, signed) {
            (1, true) => a.read_1d::<i8>().unwrap().into_iter().map(f64::from).collect(),
            (4, true) => a.read_1d::<i32>().unwrap().into_iter().map(f64::from).collect(),
            (4, false) => a.read_1d::<u32>().unwrap().into_iter().map(f64::from).collect(),
            (8, true) => a.read_1d::<i64>().unwrap().into_iter().map(|x| x as f64).collect(),
            (8, false) => a.read_1d::<u64>().unwrap().into_iter().map(|x| x as f64).collect(),
            other => panic!("{}: integers {other:?}", a.name),
        }
    };
    match &a.datatype {
        Datatype::FloatingPoint { size: 4, .. } => a.read_1d::<f32>().unwrap().into_iter().map(f64::from).collect(),
        Datatype::FloatingPoint { .. } => a.read_1d::<f64>().unwrap(),
        Datatype::FixedPoint { size, signed, .. } => whole(*size, *signed),
        other => panic!("{}: {other:?}", a.name),
    }
}

fn array(d: &Dataset) -> Array {
    let numbers = match d.dtype() {
        Datatype::FloatingPoint { size: 4, .. } => {
            d.read_array::<f32>().unwrap().iter().map(|x| f64::from(*x)).collect()
        }
        Datatype::FloatingPoint { .. } => d.read_array::<f64>().unwrap().iter().copied().collect(),
        Datatype::FixedPoint { size: 4, .. } => d.read_array::<i32>().unwrap().iter().map(|x| f64::from(*x)).collect(),
        Datatype::FixedPoint { signed: true, .. } => d.read_array::<i64>().unwrap().iter().map(|x| *x as f64).collect(),
        Datatype::FixedPoint { .. } => d.read_array::<u64>().unwrap().iter().map(|x| *x as f64).collect(),
        other => panic!("{}: {other:?}", d.name()),
    };
    let integers = matches!(d.dtype(), Datatype::FixedPoint { .. });
    Array { shape: d.shape().iter().map(|n| *n as usize).collect(), numbers, integers }
}

/// Paths of all datasets of a group.
fn datasets(group: &Group, path: &str) -> Vec<String> {
    let (groups, own) = group.members().unwrap();
    let below = groups.iter().flat_map(|g| datasets(g, &format!("{path}{}/", g.name())));
    own.iter().map(|d| format!("{path}{}", d.name())).chain(below).collect()
}

/// A copy of a NetCDF file of one or two dimensions, as classic one.
fn copy_netcdf(from: &Path, to: &Path, target: &str, change: Change, extra: bool) {
    let source = netcdf_reader::NcFile::open(from).unwrap();
    let arrays: Vec<(String, Array, Vec<(String, String)>)> = source
        .variables()
        .unwrap()
        .iter()
        .map(|v| {
            let numbers = source.read_variable_as_f64(v.name()).unwrap().iter().copied().collect();
            let shape = v.dimensions().iter().map(|d| d.size as usize).collect();
            let texts = v.attributes().iter().filter_map(|a| Some((a.name.clone(), a.value.as_string()?))).collect();
            let change = if v.name() == target { change } else { Change::Nothing };
            let array = Array { shape, numbers, integers: v.name() == names::PARTICLE_IDS };
            (v.name().to_owned(), array.changed(change), texts)
        })
        .collect();
    let mut file = ClassicFile::new();
    for a in source.global_attributes().unwrap() {
        if let Some(text) = a.value.as_string() {
            file.attribute(&a.name, text.as_str());
        }
    }
    let mut known: Vec<(usize, String)> = Vec::new();
    let mut ids = Vec::new();
    let whole: Vec<Vec<i32>> = arrays.iter().map(|(_, a, _)| a.numbers.iter().map(|x| *x as i32).collect()).collect();
    let words = [b'n' as i8; 3];
    for ((name, array, attributes), whole) in arrays.iter().zip(&whole) {
        if name == target && change == Change::Left {
            continue;
        }
        let mut dimensions = Vec::new();
        for n in &array.shape {
            let at = known.iter().position(|(size, _)| size == n).unwrap_or_else(|| {
                // Coordinates are known by the name of their dimension.
                let label = if array.shape.len() == 1 && name.len() == 1 { name.clone() } else { format!("d{n}") };
                known.push((*n, label.clone()));
                ids.push(file.dimension(&label, *n));
                known.len() - 1
            });
            dimensions.push(ids[at]);
        }
        let attributes: Vec<_> = attributes.iter().map(|(k, v)| (k.as_str(), v.as_str().into())).collect();
        let data = if array.integers { Data::I32(whole) } else { Data::F64(&array.numbers) };
        file.variable(name, &dimensions, data, &attributes);
    }
    if extra {
        let d = file.dimension("other", 3);
        file.variable("Extra", &[d], Data::I8(&words), &[]);
    }
    file.write(to).unwrap();
}

/// What a reader made of a file: sound numbers in the numbers that they should have.
fn sound(content: &FileContent, context: &str, as_it_was: Option<&ParticleFile>) {
    match content {
        FileContent::Field(field) => {
            for v in &field.variables {
                assert_eq!(v.values.len(), v.components * field.geometry.count(v.location), "{context}: {}", v.name);
            }
            if let Geometry::Grid { axes, .. } = &field.geometry {
                assert!(axes.iter().all(|a| a.nodes.iter().all(|x| x.is_finite())), "{context}");
            }
        }
        FileContent::Particles(p) => {
            for species in &p.species {
                assert!(species.table.column(names::COORDINATES).is_some(), "{context}: no coordinates");
                for c in &species.table.columns {
                    assert_eq!(c.values.len(), c.components * species.table.count, "{context}: {}", c.name);
                }
            }
            let Some(whole) = as_it_was else { return };
            assert_eq!(p.species.len(), whole.species.len(), "{context}");
            for (new, old) in p.species.iter().zip(&whole.species) {
                assert_eq!(new.table.count, old.table.count, "{context}");
            }
        }
    }
}

/// The last part of an array's path, as errors name it; positions and velocities may be named as wholes.
fn named(error: &str, target: &str) -> bool {
    let own = target.rsplit('/').next().unwrap_or(target);
    let lower = error.to_lowercase();
    lower.contains(&own.to_lowercase())
        // A length of its own is a dimension of its own in a NetCDF file.
        || lower.contains("dimension 'd")
        || (own.to_lowercase().starts_with(['x', 'y', 'z'])
            && ["coordinates", "radius", "axis '"].iter().any(|what| lower.contains(what)))
        || (own.starts_with('v') && lower.contains("velocities"))
        || names::standard(own).is_some_and(|n| lower.contains(&n.to_lowercase()))
}

fn attempt(path: &Path, reader: &str) -> Result<FileContent, FormatError> {
    read(FORMATS, path, Some(reader), &FieldRequest::default())
}

/// All changes to all arrays of one file; how many ended in an error.
fn all_changes(file: &Path, folder: &Path, reader: &str, label: &str) -> usize {
    let start = std::time::Instant::now();
    let hdf5 = std::fs::read(file).unwrap().starts_with(HDF5_SIGNATURE);
    let targets = if hdf5 {
        datasets(&Hdf5File::open(file).unwrap().root_group().unwrap(), "")
    } else {
        let source = netcdf_reader::NcFile::open(file).unwrap();
        source.variables().unwrap().iter().map(|v| v.name().to_owned()).collect()
    };
    assert!(!targets.is_empty(), "{label}: no arrays");
    let path = folder.join("changed");
    let copy = |target: &str, change: Change, extra: bool| {
        let _ = std::fs::remove_file(&path);
        match hdf5 {
            true => Copy { target, change, extra }.make(file, &path),
            false => copy_netcdf(file, &path, target, change, extra),
        }
    };
    copy("", Change::Nothing, false);
    let whole = attempt(&path, reader).unwrap_or_else(|e| panic!("{label}: the plain copy: {e}"));
    let whole = match whole {
        FileContent::Particles(p) => Some(p),
        FileContent::Field(_) => None,
    };
    copy("", Change::Nothing, true);
    let extra = attempt(&path, reader).unwrap_or_else(|e| panic!("{label}: with more arrays: {e}"));
    sound(&extra, &format!("{label} with more arrays"), whole.as_ref());
    let (mut refused, mut absurd) = (0, 0);
    for target in &targets {
        // A classic file has no room for the sizes that it declares; texts in it are bytes.
        let possible = |c: &&Change| hdf5 || !matches!(c, Change::Absurd | Change::Texts);
        for change in CHANGES.iter().filter(possible) {
            let context = format!("{label}, {target}: {change:?}");
            copy(target, *change, false);
            match attempt(&path, reader) {
                Ok(content) => {
                    let resized = matches!(change, Change::Shorter | Change::Longer);
                    sound(&content, &context, whole.as_ref().filter(|_| !resized || hdf5));
                }
                Err(e) => {
                    refused += 1;
                    absurd += usize::from(*change == Change::Absurd && matches!(e, FormatError::Limit { .. }));
                    let text = e.to_string();
                    // Of two lengths that differ either may be wrong.
                    let resized = matches!(change, Change::Shorter | Change::Longer);
                    let names_it = named(&text, target) || (resized && targets.iter().any(|t| named(&text, t)));
                    assert!(names_it, "{context}: {text}");
                    assert!(text.contains(&path.display().to_string()), "{context}: {text}");
                }
            }
        }
    }
    // Arrays that follow from others are not read at all.
    assert!(!hdf5 || absurd >= targets.len() / 2, "{label}: {absurd} absurd sizes refused");
    println!("{label}: {} arrays, {refused} changes refused, {:.1?}", targets.len(), start.elapsed());
    refused
}

#[test]
fn changed_arrays_of_particle_files_are_named_or_done_without() {
    let folder = tempfile::tempdir().unwrap();
    let mut count = 0;
    for spec in writers().filter(|s| can_read(s)) {
        let path = folder.path().join(format!("whole.{}", spec.extensions[0]));
        write(spec, &path, &particles_of(spec, 9, 3), true).unwrap();
        let hdf5 = std::fs::read(&path).unwrap().starts_with(HDF5_SIGNATURE);
        if !hdf5 && spec.name != "netcdf" {
            continue;
        }
        let reader = if spec.read.is_some() { spec.name } else { "gadget" };
        let refused = all_changes(&path, folder.path(), reader, spec.name);
        assert!(refused >= 5, "{}: {refused} changes refused", spec.name);
        count += 1;
    }
    assert_eq!(count, 6);
}

#[test]
fn changed_arrays_of_field_files_are_named_or_done_without() {
    let folder = tempfile::tempdir().unwrap();
    for reader in ["grid-hdf5", "gyre-hdf5"] {
        let path = folder.path().join("whole");
        let mut count = 0;
        for (i, bytes) in seeds::of(reader, folder.path()).iter().enumerate() {
            replace(&path, bytes);
            if attempt(&path, reader).is_ok() {
                all_changes(&path, folder.path(), reader, &format!("{reader} {i}"));
                count += 1;
            }
        }
        assert!(count >= 2, "{reader}: {count} files");
    }
}
