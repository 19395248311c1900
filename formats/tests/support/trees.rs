//! Trees of blocks as Athena++ and FLASH write them, made block by block. Cells along x, y and z are of different numbers.

use rust_hdf5::H5File;
use rust_hdf5::format::messages::datatype::{CompoundMember, DatatypeMessage};
use std::path::Path;

/// Cells of a block, and blocks of level 0.
pub const CELLS: [usize; 3] = [4, 2, 3];
pub const ROOTS: [u64; 3] = [2, 3, 1];
pub const LO: [f64; 3] = [-1.0, 0.0, 2.0];
pub const HI: [f64; 3] = [3.0, 6.0, 5.0];

/// A variable: its name, and its value at the middle of a cell.
pub type Variable = (&'static str, fn([f64; 3]) -> f64);

/// A block: its level, its place among those of the level, and whether it is a leaf.
#[derive(Debug, Clone, Copy)]
pub struct Block {
    pub level: u8,
    pub place: [u64; 3],
    pub is_leaf: bool,
}

/// All blocks in `d` dimensions: the last root is divided, and of its children the first one again.
pub fn blocks(d: usize) -> Vec<Block> {
    let roots: [u64; 3] = std::array::from_fn(|k| if k < d { ROOTS[k] } else { 1 });
    let count: u64 = roots.iter().product();
    let mut all = Vec::new();
    let children = |of: Block| {
        let child = move |i: u64| Block {
            level: of.level + 1,
            place: std::array::from_fn(|k| if k < d { 2 * of.place[k] + (i >> k & 1) } else { 0 }),
            is_leaf: true,
        };
        (0..1_u64 << d).map(child).collect::<Vec<_>>()
    };
    for i in 0..count {
        let place = [i % roots[0], i / roots[0] % roots[1], i / roots[0] / roots[1]];
        all.push(Block { level: 0, place, is_leaf: i + 1 < count });
    }
    let first = children(all[count as usize - 1]);
    all.push(Block { is_leaf: false, ..first[0] });
    all.extend(children(first[0]));
    all.extend(&first[1..]);
    // In an order of their own.
    all.rotate_left(3 % count as usize);
    all
}

impl Block {
    pub fn width(&self, axis: usize) -> f64 {
        (HI[axis] - LO[axis]) / (ROOTS[axis] as f64 * 2.0_f64.powi(self.level.into()))
    }

    pub fn ends(&self, axis: usize, d: usize) -> [f64; 2] {
        if axis >= d {
            return [0.0, 1.0];
        }
        [0, 1].map(|side| LO[axis] + self.width(axis) * (self.place[axis] + side) as f64)
    }

    /// Middles of the cells, x fastest.
    pub fn middles(&self, d: usize) -> Vec<[f64; 3]> {
        let n: [usize; 3] = cells(d);
        let at = |i: [usize; 3]| -> [f64; 3] {
            std::array::from_fn(|k| {
                let [lo, hi] = self.ends(k, d);
                if k < d { lo + (hi - lo) * (i[k] as f64 + 0.5) / n[k] as f64 } else { 0.0 }
            })
        };
        (0..n.iter().product()).map(|i| at([i % n[0], i / n[0] % n[1], i / n[0] / n[1]])).collect()
    }
}

pub fn cells(d: usize) -> [usize; 3] {
    std::array::from_fn(|k| if k < d { CELLS[k] } else { 1 })
}

/// Leaves as Athena++ writes them; `change` what is in the file before.
pub fn athena(path: &Path, d: usize, coordinates: &str, variables: &[Variable], change: impl Fn(&mut Vec<Block>)) {
    let mut leaves: Vec<Block> = blocks(d).into_iter().filter(|b| b.is_leaf).collect();
    change(&mut leaves);
    let n = leaves.len();
    let file = H5File::create(path).unwrap();
    let root = file.root_group();
    let cells = cells(d);
    let all: [i32; 3] = std::array::from_fn(|k| if k < d { (ROOTS[k] as usize * cells[k]) as i32 } else { 1 });
    root.set_attr_string("Coordinates", coordinates).unwrap();
    root.set_attr_array_numeric("RootGridSize", &all).unwrap();
    root.set_attr_array_numeric("MeshBlockSize", &cells.map(|n| n as i32)).unwrap();
    root.set_attr_numeric("NumMeshBlocks", &(n as i32)).unwrap();
    root.set_attr_numeric("MaxLevel", &2_i32).unwrap();
    root.set_attr_numeric("Time", &0.75_f32).unwrap();
    root.set_attr_string_array("DatasetNames", &["prim"]).unwrap();
    root.set_attr_array_numeric("NumVariables", &[variables.len() as i32]).unwrap();
    let names: Vec<&str> = variables.iter().map(|(name, _)| *name).collect();
    root.set_attr_string_array("VariableNames", &names).unwrap();
    let places: Vec<i64> = leaves.iter().flat_map(|b| b.place.map(|p| p as i64)).collect();
    file.new_dataset::<i64>().shape([n, 3]).create("LogicalLocations").unwrap().write_raw(&places).unwrap();
    let levels: Vec<i32> = leaves.iter().map(|b| b.level.into()).collect();
    file.new_dataset::<i32>().shape([n]).create("Levels").unwrap().write_raw(&levels).unwrap();
    for (axis, m) in cells.into_iter().enumerate() {
        let faces = leaves.iter().flat_map(|b| {
            let [lo, hi] = b.ends(axis, d);
            (0..=m).map(move |i| (lo + (hi - lo) * i as f64 / m as f64) as f32)
        });
        let (name, faces) = (format!("x{}f", axis + 1), faces.collect::<Vec<_>>());
        file.new_dataset::<f32>().shape([n, m + 1]).create(&name).unwrap().write_raw(&faces).unwrap();
    }
    let [nx, ny, nz] = cells;
    let middles: Vec<[f64; 3]> = leaves.iter().flat_map(|b| b.middles(d)).collect();
    let prim: Vec<f32> = variables.iter().flat_map(|(_, f)| middles.iter().map(|x| f(*x) as f32)).collect();
    file.new_dataset::<f32>().shape([variables.len(), n, nz, ny, nx]).create("prim").unwrap().write_raw(&prim).unwrap();
    file.close().unwrap();
}

/// What a FLASH file says of its run.
pub struct Run {
    pub numbers: Vec<(&'static str, f64)>,
    pub counts: Vec<(&'static str, i32)>,
    pub texts: Vec<(&'static str, &'static str)>,
}

/// Texts of four bytes, or pairs of a name of 80 and a number, or a text of 80, as FLASH writes them.
#[derive(Clone, Copy)]
struct Record<const N: usize>([u8; N]);

impl<const N: usize> rust_hdf5::H5Type for Record<N> {
    fn hdf5_type() -> DatatypeMessage {
        let value = match N {
            4 => return DatatypeMessage::fixed_string(4),
            84 => DatatypeMessage::i32_type(),
            88 => DatatypeMessage::f64_type(),
            _ => DatatypeMessage::fixed_string(80),
        };
        let member = |name: &str, offset, datatype| CompoundMember { name: name.into(), offset, datatype };
        let name = member("name", 0, DatatypeMessage::fixed_string(80));
        DatatypeMessage::compound(N as u32, vec![name, member("value", 80, value)])
    }

    fn element_size() -> usize {
        N
    }
}

fn list<const N: usize>(file: &H5File, name: &str, pairs: &[(&str, Vec<u8>)]) {
    let record = |(name, value): &(&str, Vec<u8>)| {
        let mut bytes = format!("{name:<80}").into_bytes();
        bytes.extend(value);
        Record::<N>(bytes.try_into().unwrap())
    };
    let records: Vec<Record<N>> = pairs.iter().map(record).collect();
    file.new_dataset::<Record<N>>().shape([pairs.len()]).create(name).unwrap().write_raw(&records).unwrap();
}

/// The blocks of a tree as FLASH writes them; `change` what is in the file before.
pub fn flash(path: &Path, d: usize, run: &Run, variables: &[Variable], change: impl Fn(&mut Vec<Block>)) {
    let mut all = blocks(d);
    change(&mut all);
    let n = all.len();
    let file = H5File::create(path).unwrap();
    let pairs = |numbers: &[(&'static str, i32)]| -> Vec<(&'static str, Vec<u8>)> {
        numbers.iter().map(|(name, value)| (*name, value.to_le_bytes().to_vec())).collect()
    };
    let reals: Vec<_> = run.numbers.iter().map(|(name, value)| (*name, value.to_le_bytes().to_vec())).collect();
    let texts: Vec<_> = run.texts.iter().map(|(name, text)| (*name, format!("{text:<80}").into_bytes())).collect();
    list::<84>(&file, "integer scalars", &pairs(&run.counts));
    list::<88>(&file, "real scalars", &reals);
    list::<160>(&file, "string runtime parameters", &texts);
    list::<88>(
        &file,
        "real runtime parameters",
        &[("xmin", LO[0].to_le_bytes().to_vec()), ("xmax", HI[0].to_le_bytes().to_vec())],
    );
    let padded = |name: &str| format!("{name:<4}");
    let names = variables.iter().map(|(name, _)| Record::<4>(padded(name).into_bytes().try_into().unwrap()));
    let names: Vec<Record<4>> = names.collect();
    file.new_dataset::<Record<4>>().shape([names.len(), 1]).create("unknown names").unwrap().write_raw(&names).unwrap();
    let numbers = |name: &str, of: &dyn Fn(&Block) -> i32| {
        let values: Vec<i32> = all.iter().map(of).collect();
        file.new_dataset::<i32>().shape([n]).create(name).unwrap().write_raw(&values).unwrap();
    };
    numbers("refine level", &|b| i32::from(b.level) + 1);
    numbers("node type", &|b| if b.is_leaf { 1 } else { 2 });
    let boxes: Vec<f64> = all.iter().flat_map(|b| (0..3).flat_map(|k| b.ends(k, d)).collect::<Vec<_>>()).collect();
    file.new_dataset::<f64>().shape([n, 3, 2]).create("bounding box").unwrap().write_raw(&boxes).unwrap();
    let [nx, ny, nz] = cells(d);
    let variable = |name: &str, of: &dyn Fn([f64; 3]) -> f64| {
        // What is under a leaf has another value, which must not be read.
        let value = |b: &Block, x| if b.is_leaf { of(x) } else { -1e30 };
        let values: Vec<f32> =
            all.iter().flat_map(|b| b.middles(d).into_iter().map(|x| value(b, x) as f32).collect::<Vec<_>>()).collect();
        file.new_dataset::<f32>().shape([n, nz, ny, nx]).create(name).unwrap().write_raw(&values).unwrap();
    };
    variables.iter().for_each(|(name, f)| variable(&padded(name), f));
    file.close().unwrap();
}

/// That of [`blocks`], periodic along x.
pub fn run(d: usize) -> Run {
    let [nx, ny, nz] = cells(d).map(|n| n as i32);
    Run {
        numbers: vec![("time", 2.5)],
        counts: vec![("nxb", nx), ("nyb", ny), ("nzb", nz), ("dimensionality", d as i32)],
        texts: vec![("geometry", "cartesian"), ("xl_boundary_type", "periodic"), ("xr_boundary_type", "PERIODIC")],
    }
}
