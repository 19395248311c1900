//! GADGET binary files made by hand, byte for byte as the GADGET-2 user guide describes them.

use sph_formats::common::particle_names as names;
use sph_formats::model::COSMOLOGY_KEY;
use sph_formats::{FORMATS, FieldRequest, FileContent, FormatError, ParticleFile, Values, registry};
use std::path::PathBuf;

/// Bytes of a file in one byte order.
struct Bytes {
    big: bool,
    named: bool,
    bytes: Vec<u8>,
}

impl Bytes {
    fn word(&mut self, w: u32) {
        self.bytes.extend(if self.big { w.to_be_bytes() } else { w.to_le_bytes() });
    }

    fn record(&mut self, label: &str, data: &[u8]) {
        if self.named {
            self.word(8);
            self.bytes.extend(label.as_bytes());
            self.word(data.len() as u32 + 8);
            self.word(8);
        }
        self.word(data.len() as u32);
        self.bytes.extend(data);
        self.word(data.len() as u32);
    }

    fn floats(&mut self, label: &str, v: &[f32]) {
        let big = self.big;
        let data: Vec<u8> = v.iter().flat_map(|x| if big { x.to_be_bytes() } else { x.to_le_bytes() }).collect();
        self.record(label, &data);
    }

    fn doubles(&mut self, label: &str, v: &[f64]) {
        let big = self.big;
        let data: Vec<u8> = v.iter().flat_map(|x| if big { x.to_be_bytes() } else { x.to_le_bytes() }).collect();
        self.record(label, &data);
    }

    fn header(&mut self, counts: [u32; 6], masses: [f64; 6], files: u32, cooling: u32) {
        let outer = std::mem::take(&mut self.bytes);
        counts.iter().for_each(|&c| self.word(c));
        for m in masses {
            self.bytes.extend(if self.big { m.to_be_bytes() } else { m.to_le_bytes() });
        }
        for x in [0.25_f64, 3.0] {
            self.bytes.extend(if self.big { x.to_be_bytes() } else { x.to_le_bytes() });
        }
        (0..2).for_each(|_| self.word(0));
        counts.iter().for_each(|&c| self.word(c));
        self.word(cooling);
        self.word(files);
        self.bytes.extend(if self.big { 10.0_f64.to_be_bytes() } else { 10.0_f64.to_le_bytes() });
        let mut header = std::mem::replace(&mut self.bytes, outer);
        header.resize(256, 0);
        self.record("HEAD", &header);
    }
}

/// The header that GADGET-4 writes by default: counts of 64 bits, no flags.
fn header_of_4(b: &mut Bytes, counts: [u64; 6], masses: [f64; 6]) {
    let outer = std::mem::take(&mut b.bytes);
    for n in counts.into_iter().chain(counts) {
        b.bytes.extend(if b.big { n.to_be_bytes() } else { n.to_le_bytes() });
    }
    for x in masses.into_iter().chain([0.25, 3.0, 10.0]) {
        b.bytes.extend(if b.big { x.to_be_bytes() } else { x.to_le_bytes() });
    }
    b.word(1);
    let mut header = std::mem::replace(&mut b.bytes, outer);
    header.resize(192, 0);
    b.record("HEAD", &header);
}

/// Two gas particles of mass 5 (in the table) and one star of mass 7 (in the block), double or single.
fn sample(big: bool, named: bool, double: bool) -> Vec<u8> {
    let mut b = Bytes { big, named, bytes: Vec::new() };
    b.header([2, 0, 0, 0, 1, 0], [5.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1, 0);
    let positions = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
    if double {
        b.doubles("POS ", &positions);
        b.doubles("VEL ", &positions);
        let ids: Vec<u8> =
            [1_u64, 1 << 40, 3].iter().flat_map(|i| if big { i.to_be_bytes() } else { i.to_le_bytes() }).collect();
        b.record("ID  ", &ids);
        b.doubles("MASS", &[7.0]);
        b.doubles("U   ", &[0.5, 0.75]);
    } else {
        b.floats("POS ", &positions.map(|x| x as f32));
        b.floats("VEL ", &positions.map(|x| x as f32));
        let ids: Vec<u8> =
            [1_u32, 2, 3].iter().flat_map(|i| if big { i.to_be_bytes() } else { i.to_le_bytes() }).collect();
        b.record("ID  ", &ids);
        b.floats("MASS", &[7.0]);
        b.floats("U   ", &[0.5, 0.75]);
    }
    b.bytes
}

fn attempt(bytes: &[u8]) -> Result<ParticleFile, FormatError> {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("snapshot_000");
    std::fs::write(&path, bytes).unwrap();
    match registry::read(FORMATS, &path, None, &FieldRequest::default())? {
        FileContent::Particles(p) => Ok(p),
        FileContent::Field(_) => panic!("a field"),
    }
}

#[test]
fn both_formats_byte_orders_and_widths_are_read() {
    for (big, named) in [(false, false), (false, true), (true, false), (true, true)] {
        for double in [false, true] {
            let p = attempt(&sample(big, named, double)).unwrap();
            assert_eq!((p.header.time, p.header.box_size, p.header.dimension), (0.25, [10.0; 3], 3));
            let [gas, stars] = p.species.as_slice() else { panic!("{} species", p.species.len()) };
            assert_eq!((gas.part_type, stars.part_type), (0, 4));
            assert_eq!(gas.table.column(names::MASSES).unwrap().values.to_f64(), [5.0, 5.0]);
            assert_eq!(stars.table.column(names::MASSES).unwrap().values.to_f64(), [7.0]);
            assert_eq!(stars.table.column(names::COORDINATES).unwrap().values.to_f64(), [7.0, 8.0, 9.0]);
            assert_eq!(gas.table.column(names::INTERNAL_ENERGY).unwrap().values.to_f64(), [0.5, 0.75]);
            // A time of 0.25 at a redshift of 3.
            let cosmology = p.header.provenance.iter().find(|fact| fact.0 == COSMOLOGY_KEY).unwrap();
            assert!(cosmology.1.contains("scale factor of 0.25"), "{cosmology:?}");
            assert!(stars.table.column(names::INTERNAL_ENERGY).is_none());
            let second = if double { 1 << 40 } else { 2 };
            assert_eq!(gas.table.column(names::PARTICLE_IDS).unwrap().values, Values::I64(vec![1, second]));
        }
    }
}

#[test]
fn entropies_become_energies_or_are_refused() {
    for (named, big) in [(false, false), (true, true)] {
        for density in [false, true] {
            let mut b = Bytes { big, named, bytes: Vec::new() };
            b.header([2, 0, 0, 0, 0, 0], [5.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1, 0);
            // The flag stands at byte 192 of the header, which begins behind its length (and its name).
            let at = 192 + if named { 20 } else { 4 };
            b.bytes[at..at + 4].copy_from_slice(&if big { 1_u32.to_be_bytes() } else { 1_u32.to_le_bytes() });
            b.floats("POS ", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
            b.floats("VEL ", &[0.0; 6]);
            b.record("ID  ", &[0; 8]);
            b.floats("U   ", &[2.0, 4.0]);
            if density {
                b.floats("RHO ", &[8.0, 27.0]);
                let p = attempt(&b.bytes).unwrap();
                let energies = p.species[0].table.column(names::INTERNAL_ENERGY).unwrap().values.to_f64();
                // u = A rho^(2/3) / (2/3).
                assert!((energies[0] - 12.0).abs() < 1e-12 && (energies[1] - 54.0).abs() < 1e-12, "{energies:?}");
                assert!(p.header.provenance.iter().any(|(k, _)| k == "converted"));
            } else {
                let error = attempt(&b.bytes).unwrap_err();
                assert!(matches!(error, FormatError::Unsupported { .. }), "{error}");
                assert!(error.to_string().contains("Flag_Entropy_ICs"), "{error}");
            }
        }
    }
}

#[test]
fn cooling_puts_two_blocks_before_the_smoothing_lengths() {
    for cooling in [0, 1] {
        let mut b = Bytes { big: false, named: false, bytes: Vec::new() };
        b.header([1, 0, 0, 0, 0, 0], [5.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1, cooling);
        b.floats("POS ", &[1.0, 2.0, 3.0]);
        b.floats("VEL ", &[0.0; 3]);
        b.record("ID  ", &1_u32.to_le_bytes());
        for x in [10.0, 11.0, 12.0, 13.0, 14.0] {
            b.floats("", &[x]);
        }
        let p = attempt(&b.bytes).unwrap();
        let value = |name: &str| p.species[0].table.column(name).map(|c| c.values.get(0));
        assert_eq!(value(names::INTERNAL_ENERGY), Some(10.0));
        assert_eq!(value(names::DENSITY), Some(11.0));
        assert_eq!(value(names::SUPPORT_RADIUS), Some(if cooling == 1 { 14.0 } else { 12.0 }));
        assert_eq!(value("ElectronAbundance"), (cooling == 1).then_some(12.0));
        let skipped = p.header.provenance.iter().filter(|(k, _)| k == "not read").count();
        assert_eq!(skipped, if cooling == 1 { 0 } else { 2 });
    }
}

#[test]
fn unknown_blocks_are_named_and_passed_over() {
    let mut b = Bytes { big: true, named: true, bytes: Vec::new() };
    b.header([1, 0, 0, 0, 0, 0], [5.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1, 0);
    b.record("ABCD", &[1, 2, 3]);
    b.floats("POS ", &[1.0, 2.0, 3.0]);
    let p = attempt(&b.bytes).unwrap();
    assert!(p.header.provenance.iter().any(|(k, v)| k == "not read" && v.contains("ABCD")));
    assert_eq!(p.species[0].table.count, 1);
}

#[test]
fn what_contradicts_itself_is_refused_with_its_place() {
    let refusal = |bytes: &[u8]| attempt(bytes).unwrap_err().to_string();
    let mut b = Bytes { big: false, named: true, bytes: Vec::new() };
    b.header([u32::MAX, 0, 0, 0, 0, 0], [5.0; 6], 1, 0);
    let head = b.bytes.clone();
    b.floats("POS ", &[1.0; 3]);
    let text = refusal(&b.bytes);
    assert!(text.contains("block 'POS'") && text.contains("12 bytes"), "{text}");
    // A length that agrees with the header, but not with the file.
    b.bytes = head;
    for w in [8, u32::from_le_bytes(*b"POS "), 0, 8, (u64::from(u32::MAX) * 12) as u32] {
        b.word(w);
    }
    let text = refusal(&b.bytes);
    assert!(text.contains("declares 51539607540 bytes, more than the 0"), "{text}");

    let mut b = Bytes { big: false, named: false, bytes: Vec::new() };
    b.header([1, 0, 0, 0, 0, 0], [0.0; 6], 1, 0);
    b.floats("POS ", &[1.0; 3]);
    let text = refusal(&b.bytes);
    assert!(text.contains("block 'MASS'") && text.contains("missing"), "{text}");

    let mut b = Bytes { big: false, named: false, bytes: Vec::new() };
    b.header([1, 0, 0, 0, 0, 0], [0.0; 6], 4, 0);
    assert!(refusal(&b.bytes).contains("4 files"));

    // Header bytes: totals at 96, time at 72, both behind the record's length and, in format 2, 16 bytes of name.
    let whole = sample(false, false, false);
    for (at, bytes, expected) in [
        (4 + 96, 77_u32.to_le_bytes().to_vec(), "in all, but says that there is one file"),
        (4 + 72, f64::NAN.to_le_bytes().to_vec(), "Time is NaN"),
        (4 + 128, (-1.0_f64).to_le_bytes().to_vec(), "BoxSize is -1"),
        (4 + 24, f64::INFINITY.to_le_bytes().to_vec(), "its table of masses has inf"),
        (4, u32::MAX.to_le_bytes().to_vec(), "the header at byte"),
        (0, 300_u32.to_le_bytes().to_vec(), ""),
    ] {
        let mut broken = whole.clone();
        broken[at..at + bytes.len()].copy_from_slice(&bytes);
        let text = refusal(&broken);
        assert!(text.contains(expected), "{text}\n{expected}");
    }

    let mut whole = sample(false, false, false);
    let end = whole.len() - 1;
    whole[end] ^= 1;
    let text = refusal(&whole);
    assert!(text.contains("block 'U'") && text.contains("expected 8"), "{text}");
    assert!(matches!(attempt(&[8, 0, 0, 0]), Err(FormatError::Detection { .. })));
}

/// GADGET-4 writes another header unless it is built with GADGET2_HEADER; the rest is the same.
#[test]
fn gadget_4s_own_header_is_read() {
    for (big, named) in [(false, false), (true, true), (false, true)] {
        let old = sample(big, named, false);
        let skipped = 256 + 8 + if named { 16 } else { 0 };
        let mut b = Bytes { big, named, bytes: Vec::new() };
        header_of_4(&mut b, [2, 0, 0, 0, 1, 0], [5.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        b.bytes.extend(&old[skipped..]);
        let folder = tempfile::tempdir().unwrap();
        let [new, before] = ["snapshot_001", "snapshot_002"].map(|name| folder.path().join(name));
        std::fs::write(&new, &b.bytes).unwrap();
        std::fs::write(&before, &old).unwrap();
        let read = |path: &PathBuf| match sph_formats::read(FORMATS, path, None, &FieldRequest::default()).unwrap() {
            FileContent::Particles(p) => p,
            FileContent::Field(_) => panic!("read as a field"),
        };
        let (found, wanted) = (read(&new), read(&before));
        assert_eq!((found.header.time, found.header.box_size), (wanted.header.time, wanted.header.box_size));
        for (a, b) in found.species.iter().zip(&wanted.species) {
            assert_eq!(a.part_type, b.part_type);
            assert_eq!(a.table.columns.len(), b.table.columns.len());
            for (a, b) in a.table.columns.iter().zip(&b.table.columns) {
                assert_eq!((&a.name, &a.values), (&b.name, &b.values));
            }
        }
        // Cut off, and with a count that cannot be.
        std::fs::write(&new, &b.bytes[..100]).unwrap();
        assert!(sph_formats::read(FORMATS, &new, None, &FieldRequest::default()).is_err());
        let mut b = Bytes { big, named, bytes: Vec::new() };
        header_of_4(&mut b, [1 << 40, 0, 0, 0, 0, 0], [5.0; 6]);
        std::fs::write(&new, &b.bytes).unwrap();
        let error = sph_formats::read(FORMATS, &new, None, &FieldRequest::default()).unwrap_err().to_string();
        assert!(error.contains("1099511627776"), "{error}");
    }
}
