//! Outputs of RAMSES, made file by file: octs of several levels in several files, each with copies of others and at boundaries.

use std::fs;
use std::path::Path;

/// Finest level.
pub const LEVELS: usize = 4;
/// The value of cells that hold finer ones, of copies and of boundaries: none of them must be read.
const UNREAD: f64 = -1e30;
/// Width of a coarse cell.
pub const COARSE: f64 = 0.5;

/// A variable: its name, and its value for a level and a place along each axis in cells of it.
pub type Variable = (&'static str, fn(usize, [u64; 3]) -> f64);

/// An oct: its level, and its place in octs of it.
pub type Oct = (usize, [u64; 3]);

/// How the hydro variables are named.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Descriptor {
    None,
    Old,
    New,
}

#[derive(Clone)]
pub struct Output {
    pub dimension: usize,
    /// Coarse cells within the box.
    pub coarse: [u64; 3],
    /// Coarse cells of boundaries before and behind them.
    pub margins: [[u64; 2]; 3],
    pub files: usize,
    pub is_double: bool,
    pub is_big: bool,
    pub ordering: &'static str,
    pub descriptor: Descriptor,
    /// cm, g/cm^3 and s.
    pub units: [f64; 3],
    pub variables: Vec<Variable>,
    /// Whether a cell, of a level and at a place in cells of it, holds an oct.
    pub is_refined: fn(usize, [u64; 3]) -> bool,
    /// Octs that are left out.
    pub without: Vec<Oct>,
    /// Octs that all files own.
    pub in_all: Vec<Oct>,
}

/// Cells along one face of the box are refined, fewer at every level.
fn corner(level: usize, [x, y, z]: [u64; 3]) -> bool {
    x == 0 && y + z < [0, 3, 4, 3][level.min(3)]
}

impl Output {
    pub fn new(dimension: usize, variables: &[Variable]) -> Self {
        let cut = |x: [u64; 3]| std::array::from_fn(|k| if k < dimension { x[k] } else { 1 });
        Self {
            dimension,
            coarse: cut([1, 2, 1]),
            margins: [[0, 0]; 3],
            files: 3,
            is_double: true,
            is_big: false,
            ordering: "hilbert",
            descriptor: Descriptor::New,
            units: [3e18, 1e-24, 3e13],
            variables: variables.into(),
            is_refined: corner,
            without: Vec::new(),
            in_all: Vec::new(),
        }
    }

    /// All octs, level by level.
    fn octs(&self) -> Vec<Vec<Oct>> {
        let d = self.dimension;
        let [x, y, z] = self.coarse;
        let first = (0..x * y * z).map(|i| (1, [i % x, i / x % y, i / x / y])).collect();
        let mut levels: Vec<Vec<Oct>> = vec![first];
        for level in 1..LEVELS {
            let mut next = Vec::new();
            for &(_, place) in &levels[level - 1] {
                let cells = (0..1_u64 << d).map(|c| Self::cell(place, c, d));
                next.extend(cells.filter(|&cell| (self.is_refined)(level, cell)).map(|cell| (level + 1, cell)));
            }
            levels.push(next);
        }
        levels
    }

    /// The place of a cell of an oct.
    fn cell(oct: [u64; 3], cell: u64, d: usize) -> [u64; 3] {
        std::array::from_fn(|k| if k < d { 2 * oct[k] + (cell >> k & 1) } else { 0 })
    }

    /// The file that owns an oct, from 0.
    fn owner(&self, (level, place): Oct) -> usize {
        (level + place.iter().sum::<u64>() as usize) % self.files
    }

    fn boundaries(&self) -> usize {
        self.margins.iter().flatten().filter(|n| **n > 0).count()
    }

    /// Octs of a level that a file has of each process and boundary.
    fn held(&self, level: &[Oct], file: usize) -> Vec<Vec<Oct>> {
        let kept = || level.iter().filter(|oct| !self.without.contains(oct));
        let of = |owner: usize| {
            let is_own = |oct: &Oct| self.owner(*oct) == owner || owner == file && self.in_all.contains(oct);
            // Of others every second one is copied.
            let is_held = |oct: &Oct| owner == file || oct.1.iter().sum::<u64>() % 2 == 0;
            kept().copied().filter(|oct| is_own(oct) && is_held(oct)).collect::<Vec<Oct>>()
        };
        let at_boundaries = (0..self.boundaries()).map(|_| level.iter().take(2).copied().collect());
        (0..self.files).map(of).chain(at_boundaries).collect()
    }

    /// Writes all files.
    pub fn write(&self, folder: &Path) {
        fs::create_dir_all(folder).unwrap();
        let [l, d, t] = self.units;
        let info = format!(
            "ncpu        ={:11}\nndim        ={:11}\nlevelmin    ={:11}\nlevelmax    ={LEVELS:11}\nngridmax    ={:11}\nnstep_coarse={:11}\n\n\
             boxlen      ={COARSE:23.15E}\ntime        ={:23.15E}\naexp        ={:23.15E}\nunit_l      ={l:23.15E}\nunit_d      ={d:23.15E}\n\
             unit_t      ={t:23.15E}\n\nordering type={}\n   DOMAIN   ind_min                 ind_max\n",
            self.files, self.dimension, 1, 100, 7, 1.5, 1.0, self.ordering
        );
        fs::write(folder.join("info_00012.txt"), info).unwrap();
        let mut text = match self.descriptor {
            Descriptor::Old => format!("nvar        ={:11}\n", self.variables.len()),
            _ => "# version:  1\n# ivar, variable_name, variable_type\n".to_owned(),
        };
        for (i, (name, _)) in self.variables.iter().enumerate() {
            text += &match self.descriptor {
                Descriptor::Old => format!("variable #{:2}: {name}\n", i + 1),
                _ => format!("{:3}, {name}, d\n", i + 1),
            };
        }
        if self.descriptor != Descriptor::None {
            fs::write(folder.join("hydro_file_descriptor.txt"), text).unwrap();
        }
        let levels = self.octs();
        for file in 0..self.files {
            let held: Vec<Vec<Vec<Oct>>> = levels.iter().map(|level| self.held(level, file)).collect();
            fs::write(folder.join(format!("amr_00012.out{:05}", file + 1)), self.amr(&held)).unwrap();
            fs::write(folder.join(format!("hydro_00012.out{:05}", file + 1)), self.hydro(&held, file)).unwrap();
        }
    }

    fn amr(&self, held: &[Vec<Vec<Oct>>]) -> Vec<u8> {
        let mut out = Records { bytes: Vec::new(), is_big: self.is_big, is_double: self.is_double };
        let all: [u64; 3] = std::array::from_fn(|k| self.coarse[k] + self.margins[k][0] + self.margins[k][1]);
        let cells = all.iter().product::<u64>() as usize;
        let boundaries = self.boundaries();
        out.whole(&[self.files as i32]);
        out.whole(&[self.dimension as i32]);
        out.whole(&all.map(|n| n as i32));
        [LEVELS, 100, boundaries, 50].iter().for_each(|n| out.whole(&[*n as i32]));
        out.real(&[COARSE * self.coarse[0] as f64]);
        out.whole(&[1, 1, 1]);
        [1, 1, 1, LEVELS, LEVELS].iter().for_each(|n| out.real(&vec![0.5; *n]));
        out.whole(&[7, 7]);
        [3, 7, 5, 1].iter().for_each(|n| out.real(&vec![0.5; *n]));
        let table = |range: std::ops::Range<usize>| -> Vec<i32> {
            held.iter().flat_map(|level| level[range.clone()].iter().map(|octs| octs.len() as i32)).collect()
        };
        (0..2).for_each(|_| out.whole(&table(0..self.files)));
        out.whole(&table(0..self.files));
        out.whole(&[0; 10 * LEVELS]);
        if boundaries > 0 {
            (0..3).for_each(|_| out.whole(&table(self.files..self.files + boundaries)));
        }
        out.whole(&[0; 5]);
        out.record(format!("{:<128}", self.ordering).as_bytes());
        (0..if self.ordering == "bisection" { 5 } else { 1 }).for_each(|_| out.real(&vec![0.0; self.files + 1]));
        (0..3).for_each(|_| out.whole(&vec![1; cells]));
        for (l, domains) in held.iter().enumerate() {
            for octs in domains.iter().filter(|octs| !octs.is_empty()) {
                self.octs_of(&mut out, l + 1, octs);
            }
        }
        out.bytes
    }

    fn octs_of(&self, out: &mut Records, level: usize, octs: &[Oct]) {
        let d = self.dimension;
        let index = vec![9; octs.len()];
        (0..3).for_each(|_| out.whole(&index));
        for k in 0..d {
            let width = 0.5_f64.powi(level as i32 - 1);
            let middle = |oct: &Oct| self.margins[k][0] as f64 + (oct.1[k] as f64 + 0.5) * width;
            out.real(&octs.iter().map(middle).collect::<Vec<f64>>());
        }
        (0..1 + 2 * d).for_each(|_| out.whole(&index));
        for cell in 0..1_u64 << d {
            let son = |oct: &Oct| i32::from(level < LEVELS && (self.is_refined)(level, Self::cell(oct.1, cell, d)));
            out.whole(&octs.iter().map(son).collect::<Vec<i32>>());
        }
        (0..2 << d).for_each(|_| out.whole(&index));
    }

    fn hydro(&self, held: &[Vec<Vec<Oct>>], file: usize) -> Vec<u8> {
        let d = self.dimension;
        let mut out = Records { bytes: Vec::new(), is_big: self.is_big, is_double: self.is_double };
        [self.files, self.variables.len(), d, LEVELS, self.boundaries()].iter().for_each(|n| out.whole(&[*n as i32]));
        out.real(&[1.4]);
        for (l, domains) in held.iter().enumerate() {
            for (owner, octs) in domains.iter().enumerate() {
                out.whole(&[l as i32 + 1]);
                out.whole(&[octs.len() as i32]);
                if octs.is_empty() {
                    continue;
                }
                for cell in 0..1_u64 << d {
                    for (_, value) in &self.variables {
                        let of = |oct: &Oct| {
                            let place = Self::cell(oct.1, cell, d);
                            let is_leaf = l + 1 == LEVELS || !(self.is_refined)(l + 1, place);
                            if owner == file && is_leaf { value(l + 1, place) } else { UNREAD }
                        };
                        out.real(&octs.iter().map(of).collect::<Vec<f64>>());
                    }
                }
            }
        }
        out.bytes
    }
}

struct Records {
    bytes: Vec<u8>,
    is_big: bool,
    is_double: bool,
}

impl Records {
    fn record(&mut self, content: &[u8]) {
        let length = content.len() as i32;
        let length = if self.is_big { length.to_be_bytes() } else { length.to_le_bytes() };
        self.bytes.extend(length.iter().chain(content).chain(&length));
    }

    fn whole(&mut self, numbers: &[i32]) {
        let bytes = |n: &i32| if self.is_big { n.to_be_bytes() } else { n.to_le_bytes() };
        self.record(&numbers.iter().flat_map(bytes).collect::<Vec<u8>>());
    }

    fn real(&mut self, numbers: &[f64]) {
        let bytes = |x: &f64| match (self.is_double, self.is_big) {
            (true, true) => x.to_be_bytes().to_vec(),
            (true, false) => x.to_le_bytes().to_vec(),
            (false, true) => (*x as f32).to_be_bytes().to_vec(),
            (false, false) => (*x as f32).to_le_bytes().to_vec(),
        };
        self.record(&numbers.iter().flat_map(bytes).collect::<Vec<u8>>());
    }
}
