//! Plotfiles of AMReX, made file by file. Cells along x, y and z are of different numbers.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

pub const LO: [f64; 3] = [-2.0, 0.0, 1.0];
pub const HI: [f64; 3] = [2.0, 6.0, 4.0];
/// Cells of level 0.
const CELLS: [i64; 3] = [8, 12, 6];
/// The value of cells that a finer level covers, and of ghost cells: neither must be read.
const COVERED: f64 = -1e30;

/// A variable: its name, and its value at the middle of a cell.
pub type Variable = (&'static str, fn([f64; 3]) -> f64);

/// First and last cell of a patch along each axis, from the lower end of the level's box.
pub type Patch = [[i64; 3]; 2];

/// A plotfile as it is to be written.
#[derive(Clone)]
pub struct Plot {
    pub dimension: usize,
    pub ratios: Vec<i64>,
    pub levels: Vec<Vec<Patch>>,
    /// The first cell of level 0 by its number.
    pub corner: [i64; 3],
    pub ghosts: i64,
    pub is_double: bool,
    pub is_little: bool,
    pub job: Option<&'static str>,
    pub variables: Vec<Variable>,
}

impl Plot {
    /// Two patches of level 0; two of level 1, next to each other across their border; one of level 2, a quarter as wide.
    pub fn new(dimension: usize, variables: &[Variable]) -> Self {
        let cut = |patch: Patch| patch.map(|x| std::array::from_fn(|k| if k < dimension { x[k] } else { 0 }));
        let levels = vec![
            vec![[[0, 0, 0], [3, 11, 5]], [[4, 0, 0], [7, 11, 5]]],
            vec![[[4, 4, 2], [7, 15, 9]], [[8, 4, 2], [11, 9, 7]]],
            vec![[[24, 24, 16], [31, 31, 23]]],
        ];
        Self {
            dimension,
            ratios: vec![2, 4],
            levels: levels.into_iter().map(|level| level.into_iter().map(cut).collect()).collect(),
            corner: [0; 3],
            ghosts: 0,
            is_double: true,
            is_little: true,
            job: None,
            variables: variables.into(),
        }
    }

    fn ratio(&self, level: usize) -> i64 {
        self.ratios[..level].iter().product()
    }

    /// Of a level's box, along an axis.
    pub fn cells(&self, level: usize, k: usize) -> i64 {
        if k < self.dimension { CELLS[k] * self.ratio(level) } else { 1 }
    }

    fn first(&self, level: usize, k: usize) -> i64 {
        if k < self.dimension { self.corner[k] * self.ratio(level) } else { 0 }
    }

    /// A box as AMReX writes it.
    fn text(&self, level: usize, [lo, hi]: Patch, grown: i64) -> String {
        let corner = |x: [i64; 3], by: i64| {
            let all: Vec<String> =
                (0..self.dimension).map(|k| (x[k] + by + self.first(level, k)).to_string()).collect();
            format!("({})", all.join(","))
        };
        let kind = vec!["0"; self.dimension].join(",");
        format!("({} {} ({kind}))", corner(lo, -grown), corner(hi, grown))
    }

    pub fn is_covered(&self, level: usize, cell: [i64; 3]) -> bool {
        let Some(finer) = self.levels.get(level + 1) else { return false };
        let by = self.ratios[level];
        let inside = |[lo, hi]: &Patch| (0..self.dimension).all(|k| cell[k] * by >= lo[k] && cell[k] * by <= hi[k]);
        finer.iter().any(inside)
    }

    pub fn middle(&self, level: usize, cell: [i64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| match k < self.dimension {
            true => LO[k] + (HI[k] - LO[k]) * (cell[k] as f64 + 0.5) / self.cells(level, k) as f64,
            false => 0.0,
        })
    }

    pub fn write(&self, folder: &Path) {
        fs::create_dir_all(folder).unwrap();
        let d = self.dimension;
        let row = |x: [f64; 3]| x[..d].iter().map(|v| format!("{v:e} ")).collect::<String>();
        let mut text = format!("HyperCLaw-V1.1\n{}\n", self.variables.len());
        self.variables.iter().for_each(|(name, _)| writeln!(text, "{name}").unwrap());
        writeln!(text, "{d}\n1.5\n{}", self.ratios.len()).unwrap();
        writeln!(text, "{}\n{}", row(LO), row(HI)).unwrap();
        writeln!(text, "{}", self.ratios.iter().map(|r| format!("{r} ")).collect::<String>()).unwrap();
        let whole = |level: usize| [[0; 3], std::array::from_fn(|k| self.cells(level, k) - 1)];
        let all = 0..self.levels.len();
        writeln!(text, "{}", all.clone().map(|l| self.text(l, whole(l), 0) + " ").collect::<String>()).unwrap();
        writeln!(text, "{}", all.clone().map(|_| "7 ").collect::<String>()).unwrap();
        for level in all.clone() {
            writeln!(text, "{}", row(std::array::from_fn(|k| (HI[k] - LO[k]) / self.cells(level, k) as f64))).unwrap();
        }
        text += "0\n0\n";
        for level in all {
            writeln!(text, "{level} {} 1.5\n7", self.levels[level].len()).unwrap();
            for [lo, hi] in &self.levels[level] {
                for k in 0..d {
                    let face = |i: i64| LO[k] + (HI[k] - LO[k]) * i as f64 / self.cells(level, k) as f64;
                    writeln!(text, "{:e} {:e}", face(lo[k]), face(hi[k] + 1)).unwrap();
                }
            }
            writeln!(text, "Level_{level}/Cell").unwrap();
            self.write_level(&folder.join(format!("Level_{level}")), level);
        }
        fs::write(folder.join("Header"), text).unwrap();
        if let Some(job) = self.job {
            fs::write(folder.join("job_info"), job).unwrap();
        }
    }

    fn write_level(&self, folder: &Path, level: usize) {
        fs::create_dir_all(folder).unwrap();
        let patches = &self.levels[level];
        let ghosts = match self.dimension {
            1 => self.ghosts.to_string(),
            d => format!("({})", vec![self.ghosts.to_string(); d].join(",")),
        };
        let mut text = format!("1\n1\n{}\n{ghosts}\n({} 0\n", self.variables.len(), patches.len());
        patches.iter().for_each(|p| writeln!(text, "{}", self.text(level, *p, 0)).unwrap());
        writeln!(text, ")\n{}", patches.len()).unwrap();
        // The last patch has a file of its own.
        let mut files = [Vec::new(), Vec::new()];
        for (i, patch) in patches.iter().enumerate() {
            let file = usize::from(i + 1 == patches.len());
            writeln!(text, "FabOnDisk: Cell_D_0000{file} {}", files[file].len()).unwrap();
            files[file].extend(self.fab(level, *patch));
        }
        text += "\n1,3\n0,0,0,\n\n1,3\n1,1,1,\n\n";
        fs::write(folder.join("Cell_H"), text).unwrap();
        for (i, bytes) in files.iter().enumerate() {
            fs::write(folder.join(format!("Cell_D_0000{i}")), bytes).unwrap();
        }
    }

    fn fab(&self, level: usize, patch: Patch) -> Vec<u8> {
        let width = if self.is_double { 8 } else { 4 };
        let mut order: Vec<String> = (1..=width).map(|i: usize| i.to_string()).collect();
        if self.is_little {
            order.reverse();
        }
        let kind = if self.is_double { "64 11 52 0 1 12 0 1023" } else { "32 8 23 0 1 9 0 127" };
        let text = self.text(level, patch, self.ghosts);
        let mut bytes =
            format!("FAB ((8, ({kind})),({width}, ({}))){text} {}\n", order.join(" "), self.variables.len())
                .into_bytes();
        let range = |k: usize| {
            let grown = if k < self.dimension { self.ghosts } else { 0 };
            patch[0][k] - grown..=patch[1][k] + grown
        };
        for (_, function) in &self.variables {
            for z in range(2) {
                for y in range(1) {
                    for x in range(0) {
                        let cell = [x, y, z];
                        let is_own = (0..3).all(|k| (patch[0][k]..=patch[1][k]).contains(&cell[k]));
                        let is_read = is_own && !self.is_covered(level, cell);
                        let value = if is_read { function(self.middle(level, cell)) } else { COVERED };
                        match (self.is_double, self.is_little) {
                            (true, true) => bytes.extend(value.to_le_bytes()),
                            (true, false) => bytes.extend(value.to_be_bytes()),
                            (false, true) => bytes.extend((value as f32).to_le_bytes()),
                            (false, false) => bytes.extend((value as f32).to_be_bytes()),
                        }
                    }
                }
            }
        }
        bytes
    }
}
