//! Snapshots in several files, and numbers of particles that 32 bits do not hold.

use crate::support::{can_read, column, particles_of, read_back, table};
use sph_formats::common::hdf5_read::Reader;
use sph_formats::common::particle_names as names;
use sph_formats::model::FILES_KEY;
use sph_formats::registry::detect;
use sph_formats::stream::{Part, ParticleStream, Piece, TYPES};
use sph_formats::{
    FORMATS, FormatError, FormatSpec, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension, Values,
    WriteOptions, write, write_files, write_stream,
};
use std::ops::Range;
use std::path::{Path, PathBuf};

const OPTIONS: WriteOptions = WriteOptions { compression: 1, double_precision: true };

fn spec(name: &str) -> &'static FormatSpec {
    FORMATS.iter().find(|f| f.name == name).unwrap()
}

/// Formats that write several files, with a name for them.
fn families() -> impl Iterator<Item = (&'static FormatSpec, &'static str)> {
    let named = [("gadget", "ic.hdf5"), ("gizmo", "ic.hdf5"), ("arepo", "ic.h5"), ("gadget-binary", "ic")];
    let more = [("gadget-binary-1", "ic.gadget1"), ("vtk", "ic.pvtu"), ("vtk", "ic.pvtp")];
    named.into_iter().chain(more).map(|(name, path)| (spec(name), path))
}

fn written(spec: &FormatSpec, path: &Path, p: &ParticleFile, files: usize) -> Result<Vec<PathBuf>, FormatError> {
    write_files(FORMATS, path, Some(spec.name), p, files, OPTIONS)
}

/// Gas and a second type, of which some files have none.
fn two_types(spec: &FormatSpec, d: usize) -> ParticleFile {
    let mut p = particles_of(spec, 41, d);
    let mut stars = table(2, d, 1000);
    stars.columns.retain(|c| c.name != "IronFraction");
    p.species.push(Species { part_type: 4, table: stars });
    p
}

fn same(context: &str, a: &ParticleFile, b: &ParticleFile) {
    assert_eq!(a.species.len(), b.species.len(), "{context}");
    for (a, b) in a.species.iter().zip(&b.species) {
        assert_eq!((a.part_type, a.table.count), (b.part_type, b.table.count), "{context}");
        for c in &a.table.columns {
            let other = b.table.column(&c.name).unwrap_or_else(|| panic!("{context}: no {}", c.name));
            assert_eq!(c.components, other.components, "{context}: {}", c.name);
            for i in 0..c.values.len() {
                let (x, y) = (c.values.get(i), other.values.get(i));
                assert!(x == y || x.is_nan() && y.is_nan(), "{context}: {} of {i}: {x} {y}", c.name);
            }
        }
    }
    let [h, k] = [&a.header, &b.header];
    assert_eq!((h.dimension, h.box_size, h.time), (k.dimension, k.box_size, k.time), "{context}");
}

#[test]
fn several_files_hold_what_one_does_by_any_of_their_names_and_their_stem() {
    for (spec, name) in families().filter(|(spec, _)| can_read(spec)) {
        for d in 1..=3 {
            let folder = tempfile::tempdir().unwrap();
            let single = folder.path().join(if name == "ic.pvtp" { "one.vtp" } else { "one.hdf5" });
            let single = if spec.name == "vtk" { single.with_extension(&name[4..]) } else { single };
            let p = two_types(spec, d);
            write(FORMATS, &single, Some(spec.name), &p, OPTIONS).unwrap();
            let whole = read_back(&single).unwrap();
            let path = folder.path().join(name);
            let files = written(spec, &path, &p, 3).unwrap();
            let is_list = files.len() == 4;
            assert!(is_list == (spec.name == "vtk") && files.iter().all(|f| f.is_file()), "{files:?}");
            for by in files.iter().chain([&path]) {
                let context = format!("{} {d}-D by {}", spec.name, by.display());
                let back = read_back(by).unwrap_or_else(|e| panic!("{context}: {e}"));
                // VTK's types stand in a column: numbers that one type lacks are gaps in the other.
                same(&context, &whole, &back);
                let told = back.header.provenance.iter().find(|(key, _)| key == FILES_KEY).unwrap();
                assert!(told.1.starts_with("3: ic"), "{told:?}");
            }
        }
    }
}

#[test]
fn numbers_go_on_from_file_to_file_where_particles_have_none() {
    for (spec, name) in families().filter(|(spec, _)| can_read(spec) && spec.name != "vtk") {
        let folder = tempfile::tempdir().unwrap();
        let mut p = two_types(spec, 3);
        p.species.iter_mut().for_each(|s| s.table.columns.retain(|c| c.name != names::PARTICLE_IDS));
        written(spec, &folder.path().join(name), &p, 5).unwrap();
        let back = read_back(&folder.path().join(name)).unwrap();
        let ids: Vec<f64> =
            back.species.iter().flat_map(|s| s.table.column(names::PARTICLE_IDS).unwrap().values.to_f64()).collect();
        assert_eq!(ids, (1..=43).map(f64::from).collect::<Vec<_>>(), "{}", spec.name);
    }
}

#[test]
fn a_family_that_lacks_a_file_is_refused_with_its_name() {
    for (spec, name) in families().filter(|(spec, _)| can_read(spec)) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        let files = written(spec, &path, &particles_of(spec, 20, 3), 4).unwrap();
        let gone = files.iter().rev().nth(1).unwrap();
        std::fs::remove_file(gone).unwrap();
        let missing = gone.file_name().unwrap().to_str().unwrap();
        let kept: Vec<_> = files.iter().filter(|f| *f != gone && (spec.name != "vtk" || **f == path)).collect();
        for by in kept.into_iter().chain([&path]) {
            let error = read_back(by).unwrap_err().to_string();
            assert!(error.contains(missing) && error.contains("missing"), "{}: {error}", spec.name);
        }
    }
    // The first one, of which the stem knows nothing.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ic.hdf5");
    let files = written(spec("gadget"), &path, &particles_of(spec("gadget"), 20, 3), 4).unwrap();
    std::fs::remove_file(&files[0]).unwrap();
    let error = read_back(&path).unwrap_err().to_string();
    assert!(error.contains("ic.0.hdf5") && error.contains("missing"), "{error}");
}

#[test]
fn files_of_two_snapshots_are_not_mixed() {
    for (spec, name) in families().filter(|(spec, _)| can_read(spec) && spec.name != "vtk") {
        let folder = tempfile::tempdir().unwrap();
        let (path, other) = (folder.path().join(name), folder.path().join(name.replace("ic", "other")));
        let mut p = particles_of(spec, 20, 3);
        let files = written(spec, &path, &p, 2).unwrap();
        let one_more = written(spec, &other, &particles_of(spec, 21, 3), 2).unwrap();
        std::fs::copy(&one_more[1], &files[1]).unwrap();
        let error = read_back(&path).unwrap_err().to_string();
        assert!(error.contains("two snapshots"), "{}: {error}", spec.name);
        // As many, at another time.
        p.header.time = 0.75;
        let later = written(spec, &other, &p, 2).unwrap();
        std::fs::copy(&later[1], &files[1]).unwrap();
        let error = read_back(&path).unwrap_err().to_string();
        assert!(error.contains("time is 0.75"), "{}: {error}", spec.name);
        // One file for another.
        p.header.time = 0.0;
        let files = written(spec, &path, &p, 2).unwrap();
        std::fs::copy(&files[0], &files[1]).unwrap();
        let error = read_back(&path).unwrap_err().to_string();
        assert!(error.contains("one file stands for the other"), "{}: {error}", spec.name);
        // More files than there were.
        written(spec, &path, &p, 3).unwrap();
        std::fs::copy(&later[1], &files[1]).unwrap();
        assert!(read_back(&path).is_err());
        // A name that is none of a family's.
        let alone = folder.path().join("alone.hdf5");
        std::fs::copy(&later[0], &alone).unwrap();
        let error = read_back(&alone).unwrap_err().to_string();
        assert!(error.contains("none of NAME.0.hdf5 to NAME.1.hdf5"), "{}: {error}", spec.name);
    }
}

#[test]
fn what_cannot_be_written_in_several_files_says_why_and_leaves_none() {
    let folder = tempfile::tempdir().unwrap();
    let p = particles_of(spec("gadget"), 20, 3);
    for (format, name, files, told) in [
        ("swift", "ic.hdf5", 2, "one file"),
        ("numpy", "ic.npz", 2, "one file"),
        ("vtk", "ic.vtu", 2, ".pvtu"),
        ("numpy", "ic.npz", 0, "one file"),
        ("gadget", "ic.hdf5", 0, "expected 1 to 20"),
        ("gadget", "ic.hdf5", 21, "expected 1 to 20"),
    ] {
        let error = written(spec(format), &folder.path().join(name), &p, files).unwrap_err().to_string();
        assert!(error.contains(told), "{format}: {error}");
    }
    // The last of three cannot be: nothing of the others stays, and what was there is there.
    let path = folder.path().join("ic.hdf5");
    let files = written(spec("gadget"), &path, &p, 3).unwrap();
    let before: Vec<Vec<u8>> = files.iter().map(|f| std::fs::read(f).unwrap()).collect();
    let mut bad = p;
    let energies = bad.species[0].table.columns.iter_mut().find(|c| c.name == names::INTERNAL_ENERGY).unwrap();
    let mut values = energies.values.to_f64();
    values[19] = -1.0;
    energies.values = Values::F64(values);
    let error = written(spec("gadget"), &path, &bad, 3).unwrap_err().to_string();
    assert!(error.contains("particle 19 is -1e0") && error.contains("ic.2.hdf5"), "{error}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
    assert!(files.iter().zip(&before).all(|(f, b)| std::fs::read(f).unwrap() == *b));
}

/// More particles than there can be in a test; those asked for are made.
struct Many {
    header: RunHeader,
    counts: [usize; TYPES],
}

impl ParticleStream for Many {
    fn header(&self) -> &RunHeader {
        &self.header
    }

    fn counts(&self) -> [usize; TYPES] {
        self.counts
    }

    fn rows(&self, _: u8, rows: Range<usize>, wanted: &dyn Fn(&str) -> bool) -> Result<ParticleTable, FormatError> {
        let n = rows.len();
        let mut columns = table(n, 3, 0).columns;
        columns.retain(|c| c.name != names::PARTICLE_IDS);
        let origins = rows.map(|i| (i as i64) << 3).collect();
        columns.push(column("OriginIDs", 1, Values::I64(origins), UnitDimension::NONE));
        columns.retain(|c| wanted(&c.name));
        Ok(ParticleTable { count: n, columns })
    }
}

#[test]
fn numbers_past_32_bits_are_whole_in_headers_and_columns() {
    let gas = 5 * (1_usize << 32) + 7;
    let many = Many { header: particles_of(spec("gadget"), 2, 3).header, counts: [gas, 0, 3, 0, 0, 0] };
    let folder = tempfile::tempdir().unwrap();
    // The last six of the gas, and the last of the second type.
    let (starts, counts) = ([gas - 6, 0, 2, 0, 0, 0], [6, 0, 1, 0, 0, 0]);
    let part = Part { index: 9, files: 10, totals: many.counts, starts, counts };
    for format in ["gadget", "gizmo", "arepo", "swift"] {
        let path = folder.path().join(format!("{format}.9.hdf5"));
        let piece = Piece { path: &path, part, stream: &many };
        (spec(format).stream.unwrap().write)(&piece, OPTIONS).unwrap();
        let file = Reader::open(&path, "test").unwrap();
        let header = file.group_attributes("Header").unwrap();
        let numbers = |name: &str| header.numbers(name).unwrap();
        // GADGET-4 reads 64 bits from NumPart_Total and never looks at the high words; the others add them.
        let [low, high] = if format == "gadget" { [gas as f64, 0.0] } else { [7.0, 5.0] };
        assert_eq!(numbers("NumPart_Total"), [low, 0.0, 3.0, 0.0, 0.0, 0.0], "{format}");
        assert_eq!(numbers("NumPart_Total_HighWord"), [high, 0.0, 0.0, 0.0, 0.0, 0.0], "{format}");
        assert_eq!(numbers("NumPart_ThisFile"), [6.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!((numbers("NumFilesPerSnapshot"), numbers("ThisFile")), (vec![10.0], vec![9.0]));
        let ids = |group: &str| file.numbers(&format!("{group}/ParticleIDs")).unwrap().unwrap().1;
        let first = gas as i64 - 5;
        assert_eq!(ids("PartType0"), Values::I64((first..first + 6).collect()), "{format}");
        assert_eq!(ids("PartType2"), Values::I64(vec![gas as i64 + 3]), "{format}");
        let origins = file.numbers("PartType0/OriginIDs").unwrap().unwrap().1;
        assert_eq!(origins, Values::I64((first - 1..first + 5).map(|i| i << 3).collect()));
        // It is one of ten, which are asked for.
        let error = read_back(&path).unwrap_err().to_string();
        assert!(error.contains(&format!("{format}.0.hdf5")), "{error}");
    }
    let path = folder.path().join("ic.9");
    let piece = Piece { path: &path, part, stream: &many };
    (spec("gadget-binary").stream.unwrap().write)(&piece, OPTIONS).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    // The header stands behind its name's record (16 bytes) and its own length.
    let word = |at: usize| u32::from_le_bytes(*bytes[20 + at..].first_chunk().unwrap());
    assert_eq!((word(0), word(8), word(96), word(168), word(124)), (6, 1, 7, 5, 10));
    let wanted: Vec<u8> = (gas as u64 - 5..=gas as u64).flat_map(u64::to_le_bytes).collect();
    assert!(bytes.windows(wanted.len()).any(|w| w == wanted), "numbers of 64 bits");
}

#[test]
fn totals_of_gadget_4_and_of_high_words_are_understood() {
    // Both ways of writing 2^32 + 6, of which six are here and the rest is claimed for a second file with as many as it has.
    let many = Many { header: particles_of(spec("gadget"), 2, 3).header, counts: [(1 << 32) + 6, 0, 0, 0, 0, 0] };
    let folder = tempfile::tempdir().unwrap();
    for format in ["gadget", "swift"] {
        let mut paths = Vec::new();
        for index in 0..2 {
            let path = folder.path().join(format!("{format}.{index}.hdf5"));
            let counts = [6, 0, 0, 0, 0, 0];
            let part = Part { index, files: 2, totals: many.counts, starts: [6 * index, 0, 0, 0, 0, 0], counts };
            (spec(format).stream.unwrap().write)(&Piece { path: &path, part, stream: &many }, OPTIONS).unwrap();
            paths.push(path);
        }
        let error = read_back(&paths[0]).unwrap_err().to_string();
        assert!(error.contains("[12.0") && error.contains("4294967302.0"), "{error}");
    }
}

#[test]
fn integers_of_own_columns_keep_their_digits() {
    let folder = tempfile::tempdir().unwrap();
    for (k, ids) in
        [vec![1, -2, 3], vec![1, i64::from(i32::MAX) + 1, 3], vec![i64::MAX - 1, i64::MIN, 0]].iter().enumerate()
    {
        let mut p = particles_of(spec("gadget"), 3, 3);
        p.species[0].table.columns.push(column("ProgenitorIDs", 1, Values::I64(ids.clone()), UnitDimension::NONE));
        for files in [1, 3] {
            let path = folder.path().join(format!("{k}-{files}.hdf5"));
            written(spec("gadget"), &path, &p, files).unwrap();
            let back = read_back(&path).unwrap();
            assert_eq!(back.species[0].table.column("ProgenitorIDs").unwrap().values, Values::I64(ids.clone()));
        }
    }
}

#[test]
fn a_stream_gives_the_numbers_that_the_same_particles_in_memory_give() {
    let folder = tempfile::tempdir().unwrap();
    // Several blocks.
    let p = {
        let mut p = particles_of(spec("gadget"), 200_000, 3);
        p.species.push(Species { part_type: 1, table: table(3, 3, 5) });
        p
    };
    for format in ["gadget", "swift"] {
        for compression in [0, 4] {
            let options = WriteOptions { compression, double_precision: false };
            let (a, b) = (folder.path().join("a.hdf5"), folder.path().join("b.hdf5"));
            write(FORMATS, &a, Some(format), &p, options).unwrap();
            write_stream(FORMATS, &b, Some(format), &p, 1, options).unwrap();
            assert!(std::fs::read(&a).unwrap() == std::fs::read(&b).unwrap(), "{format} {compression}");
        }
    }
}

#[test]
fn lists_of_pieces_that_make_no_sense_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ic.pvtu");
    written(spec("vtk"), &path, &particles_of(spec("vtk"), 20, 3), 2).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(detect(FORMATS, &path, None).unwrap().name, "vtk");
    for (from, to, told) in [
        ("ic_1.vtu", "ic_0.vtu", "twice"),
        ("ic_1.vtu", "ic_7.vtu", "missing"),
        ("ic_1.vtu", "ic.pvtu", "a list itself"),
        ("GhostLevel=\"0\"", "GhostLevel=\"1\"", "overlap"),
        ("<Piece", "<Part", "is empty"),
    ] {
        assert!(text.contains(from));
        std::fs::write(&path, text.replace(from, to)).unwrap();
        let error = read_back(&path).unwrap_err().to_string();
        assert!(error.contains(told), "{to}: {error}");
    }
}
