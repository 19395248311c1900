//! FLASH: the leaves of a tree of blocks, or the blocks of a uniform grid.

use super::flash_parameters::Parameters;
use super::mesh::{Mesh, gathered, unsupported};
use super::tree::{Leaf, MOST_LEVELS, Tree, checked};
use crate::common::hdf5_read::Reader;
use crate::error::Result;
use crate::model::{FIELD_ADIABATIC_INDEX, Location, Values};
use crate::units::{Unit, UnitDimension, UnitSystem};
use std::path::Path;

const BOXES: &str = "bounding box";
const LEVELS: &str = "refine level";
const KINDS: &str = "node type";
const NAMES: &str = "unknown names";
/// The kind of a leaf.
const LEAF: f64 = 1.0;
/// How far the ends of a block may be from where its place is, in widths of the block, beside the rounding of numbers in f32.
const SAME: f64 = 1e-3;
/// With more than that the places of blocks are not known.
const MOST_OFF: f64 = 0.2;

/// The blocks of a file, their values not yet read.
pub struct Blocks<'a> {
    file: &'a Reader<'a>,
    path: &'a Path,
    parameters: Parameters,
    /// All blocks, leaves or not, and the cells of each along z, y and x.
    shape: [usize; 4],
    /// Names of variables, and those of their datasets.
    variables: Vec<(String, String)>,
    tree: Tree,
    notes: Vec<String>,
}

/// Both ends of a block along the axes.
type Ends = [[f64; 2]; 3];

impl<'a> Blocks<'a> {
    /// # Errors
    /// Where blocks, variables or geometry are missing, contradict each other or are not supported.
    pub fn open(file: &'a Reader<'a>, path: &'a Path, datasets: Vec<String>) -> Result<Self> {
        let parameters = Parameters::read(file, &datasets)?;
        let mut notes = Vec::new();
        match parameters.text("geometry").map(str::to_ascii_lowercase).as_deref() {
            Some("cartesian") => {}
            Some(other) => {
                let what = format!("FLASH's geometry '{other}'; cartesian is read: resample this one");
                return Err(unsupported(path, what));
            }
            None => notes.push("the file does not name its geometry, which is taken to be cartesian".into()),
        }
        let (shape, variables) = variables(file, &datasets, &mut notes)?;
        let dimension = dimension(file, &parameters, &shape)?;
        let tree = tree(file, &parameters, &shape, dimension)?;
        if parameters.number("usecosmology").is_some_and(|x| x != 0.0) {
            notes
                .push("the run is cosmological: lengths, densities and velocities are comoving, as in the file".into());
        }
        if parameters.units().is_none() {
            notes.push("the run has no units (pc_unitsBase)".into());
        }
        Ok(Self { file, path, parameters, shape, variables, tree, notes })
    }

    /// # Errors
    /// Where leaves overlap or do not fill the box.
    pub fn mesh(&self) -> Result<Mesh> {
        let (geometry, mut notes) = checked(self.tree.grid(self.path)?, "FLASH", |location, problem| {
            self.file.input(location, format!("{problem} (by '{BOXES}', '{LEVELS}' and '{KINDS}')"))
        })?;
        notes.extend(self.notes.iter().cloned());
        let stated = [("time", "time"), (FIELD_ADIABATIC_INDEX, "gamma")];
        let stated = stated.iter().filter_map(|(key, name)| Some(((*key).to_owned(), self.parameters.number(name)?)));
        Ok(Mesh {
            geometry,
            location: Location::Cell,
            names: self.variables.iter().map(|(name, _)| name.clone()).collect(),
            metadata: stated.map(|(key, number)| (key, number.to_string())).collect(),
            units: self.parameters.units(),
            notes,
        })
    }

    /// The values of a variable in all leaves.
    ///
    /// # Errors
    /// Where it is missing, or holds no numbers.
    pub fn variable(&self, name: &str) -> Result<(String, Values)> {
        let dataset = self.variables.iter().find(|(own, _)| own == name).map_or(name, |(_, dataset)| dataset);
        let location = format!("dataset '{dataset}'");
        let found = self.file.array(dataset)?;
        let Some((_, values)) = found.filter(|(shape, _)| *shape == self.shape) else {
            return Err(self.file.input(location, format!("expected numbers of shape {:?}", self.shape)));
        };
        let cells: usize = self.shape[1..].iter().product();
        if self.tree.leaves.len() == self.shape[0] {
            return Ok((name.to_owned(), values));
        }
        let leaves = self.tree.leaves.iter().flat_map(|leaf| leaf.number * cells..(leaf.number + 1) * cells);
        Ok((name.to_owned(), gathered(&values, leaves)))
    }
}

/// The shape of variables, and names with those of their datasets: of elements with short names these end with spaces.
fn variables(
    file: &Reader,
    datasets: &[String],
    notes: &mut Vec<String>,
) -> Result<([usize; 4], Vec<(String, String)>)> {
    let mut shape: Option<[usize; 4]> = None;
    let mut found = Vec::new();
    let named = if datasets.iter().any(|d| d == NAMES) { file.texts(NAMES)?.unwrap_or_default() } else { Vec::new() };
    let is_named = |dataset: &str| named.iter().any(|name| name.trim() == dataset.trim());
    // Those that are named come first, and say which shape all have.
    let (first, rest): (Vec<&String>, Vec<&String>) = datasets.iter().partition(|d| is_named(d));
    for dataset in first.iter().chain(&rest) {
        let Ok(own) = <[u64; 4]>::try_from(file.shape(dataset)?) else { continue };
        let own = own.map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        if *shape.get_or_insert(own) == own {
            found.push((dataset.trim().to_owned(), (*dataset).clone()));
        } else {
            notes.push(format!("'{dataset}' was left out: it has shape {own:?}, unlike the others"));
        }
    }
    if let Some(missing) = named.iter().find(|name| !found.iter().any(|(own, _)| own == name.trim())) {
        let problem = format!("is among the '{NAMES}', but there is no such dataset of blocks, z, y and x");
        return Err(file.input(format!("dataset '{missing}'"), problem));
    }
    match shape {
        Some(shape) if shape.iter().all(|n| *n > 0) => Ok((shape, found)),
        Some(shape) => Err(file.input("variables", format!("have shape {shape:?}, expected none of them empty"))),
        None => Err(file.input("group '/'", "there is no variable of blocks, z, y and x, such as 'dens'")),
    }
}

/// The dimensions of the run, and that blocks have the cells that it says.
fn dimension(file: &Reader, parameters: &Parameters, shape: &[usize; 4]) -> Result<usize> {
    let [_, nz, ny, nx] = *shape;
    for (name, n) in [("nxb", nx), ("nyb", ny), ("nzb", nz)] {
        if let Some(stated) = parameters.number(name).filter(|stated| *stated != n as f64) {
            let problem = format!(
                "have {n} cells per block along {}, but '{name}' is {stated}; write the file without guard cells",
                &name[1..2]
            );
            return Err(file.input("variables", problem));
        }
    }
    let apparent = if nz > 1 { 3 } else { 1 + usize::from(ny > 1) };
    match parameters.number("dimensionality") {
        None => Ok(apparent),
        Some(stated) if [1.0, 2.0, 3.0].contains(&stated) && stated as usize >= apparent => Ok(stated as usize),
        Some(stated) => {
            let problem = format!("is {stated}, but blocks have {nx} x {ny} x {nz} cells");
            Err(file.input("scalar 'dimensionality'", problem))
        }
    }
}

/// Numbers of which there is one, or a row, per block.
fn rows(file: &Reader, name: &str, blocks: usize, fits: &dyn Fn(&[usize]) -> bool) -> Result<(Vec<usize>, Values)> {
    let found = file.array(name)?.filter(|(shape, _)| shape.first() == Some(&blocks) && fits(&shape[1..]));
    found.ok_or_else(|| {
        let problem = format!("expected numbers for each of {blocks} blocks, which variables such as 'dens' have");
        file.input(format!("dataset '{name}'"), problem)
    })
}

fn tree(file: &Reader, parameters: &Parameters, shape: &[usize; 4], dimension: usize) -> Result<Tree> {
    let blocks = shape[0];
    if let Some(all) = parameters.number("globalnumblocks").filter(|all| *all != blocks as f64) {
        let problem =
            format!("are {blocks}, but the run has {all} (globalnumblocks); write it to one file (outputSplitNum = 1)");
        return Err(file.input("blocks", problem));
    }
    let one = |rest: &[usize]| rest.iter().all(|n| *n == 1);
    let (_, levels) = rows(file, LEVELS, blocks, &one)?;
    let (_, kinds) = rows(file, KINDS, blocks, &one)?;
    let (of_boxes, boxes) = rows(file, BOXES, blocks, &|rest| rest.len() == 2 && rest[0] >= dimension && rest[1] == 2)?;
    let axes = of_boxes[1];
    let ends_of = |b: usize| -> Ends {
        let end =
            |k: usize, side: usize| if k < dimension { boxes.get((b * axes + k) * 2 + side) } else { side as f64 };
        std::array::from_fn(|k| [end(k, 0), end(k, 1)])
    };
    let mut leaves = Vec::new();
    for b in (0..blocks).filter(|b| kinds.get(*b) == LEAF) {
        let level = levels.get(b);
        if !(level.fract() == 0.0 && (1.0..=f64::from(MOST_LEVELS)).contains(&level)) {
            let problem = format!("block {b} is of level {level}, expected 1 to {MOST_LEVELS}");
            return Err(file.input(format!("dataset '{LEVELS}'"), problem));
        }
        let ends = ends_of(b);
        if !ends.iter().all(|[lo, hi]| lo < hi && (hi - lo).is_finite()) {
            let problem = format!("block {b} extends over {ends:?}, expected ascending finite ends");
            return Err(file.input(format!("dataset '{BOXES}'"), problem));
        }
        leaves.push((Leaf { number: b, level: level as u8 - 1, place: [0; 3] }, ends));
    }
    // The largest block has the best known width.
    let Some(largest) = leaves.iter().min_by_key(|(leaf, _)| leaf.level) else {
        return Err(file.input(format!("dataset '{KINDS}'"), format!("none of {blocks} blocks is a leaf (kind 1)")));
    };
    let (least, wide) = (i32::from(largest.0.level), largest.1);
    let whole: Ends = std::array::from_fn(|k| {
        let all = || leaves.iter().map(|(_, ends)| ends[k]);
        let seen = [all().fold(f64::INFINITY, |m, e| m.min(e[0])), all().fold(f64::NEG_INFINITY, |m, e| m.max(e[1]))];
        stated_ends(parameters, k).filter(|_| k < dimension).filter(|stated| near(stated, &seen)).unwrap_or(seen)
    });
    let roots = std::array::from_fn(|k| {
        if k >= dimension {
            return 1;
        }
        // As many of the largest blocks fill the box, whose width is a whole number of those of level 0.
        let across = ((whole[k][1] - whole[k][0]) / (wide[k][1] - wide[k][0])).round().max(1.0);
        (across / 2.0_f64.powi(least)).ceil().max(1.0) as u64
    });
    let finest = leaves.iter().map(|(leaf, _)| leaf.level).max().unwrap_or(0);
    let mut tree = Tree {
        ends: whole,
        is_periodic: parameters.periodic(),
        unit: parameters.units().map(|system| system.unit(UnitDimension::LENGTH)),
        roots,
        cells: [shape[3], shape[2], shape[1]].map(|n| n as u64),
        dimension,
        levels: finest + 1,
        leaves: Vec::with_capacity(leaves.len()),
    };
    for (mut leaf, ends) in leaves {
        for k in 0..dimension {
            leaf.place[k] = place(&tree, k, leaf.level, ends[k]).map_err(|problem| {
                let problem = format!("block {} of level {} {problem}", leaf.number, leaf.level + 1);
                file.input(format!("dataset '{BOXES}'"), problem)
            })?;
        }
        tree.leaves.push(leaf);
    }
    Ok(tree)
}

/// The ends of the box by the run's parameters, which are in double precision.
fn stated_ends(parameters: &Parameters, k: usize) -> Option<[f64; 2]> {
    let axis = ["x", "y", "z"][k];
    let [lo, hi] = ["min", "max"].map(|end| parameters.number(&format!("{axis}{end}")));
    Some([lo?, hi?])
}

/// Whether two pairs of ends are the same but for rounding in single precision.
fn near(a: &[f64; 2], b: &[f64; 2]) -> bool {
    let slack = 4.0 * f64::from(f32::EPSILON) * b[0].abs().max(b[1].abs());
    a[0] < a[1] && (a[0] - b[0]).abs() <= slack && (a[1] - b[1]).abs() <= slack
}

/// Which block of its level lies between two ends along an axis; or why none does.
fn place(tree: &Tree, k: usize, level: u8, [lo, hi]: [f64; 2]) -> std::result::Result<u64, String> {
    let [from, to] = tree.ends[k];
    let along = tree.roots[k] as f64 * 2.0_f64.powi(level.into());
    let width = (to - from) / along;
    let slack = SAME + 4.0 * f64::from(f32::EPSILON) * from.abs().max(to.abs()) / width;
    let at = (lo - from) / width;
    let off = (at - at.round()).abs().max(((hi - from) / width - at.round() - 1.0).abs());
    if slack > MOST_OFF {
        return Err(format!(
            "lies between {lo:e} and {hi:e}, which single precision does not tell apart from its neighbors"
        ));
    }
    if !(off <= slack && at.round() >= 0.0 && at.round() < along) {
        return Err(format!("lies between {lo:e} and {hi:e}, where there is none of {along} from {from:e} to {to:e}"));
    }
    Ok(at.round() as u64)
}

/// The unit of one of FLASH's variables, where its name tells.
pub fn unit(system: &UnitSystem, name: &str) -> Option<Unit> {
    let dimension = match name {
        "dens" => UnitDimension::mass_density(3),
        "pres" => UnitDimension::PRESSURE,
        "temp" | "tion" | "tele" | "trad" => UnitDimension::TEMPERATURE,
        "velx" | "vely" | "velz" => UnitDimension::VELOCITY,
        "eint" | "ener" | "eion" | "eele" | "gpot" => UnitDimension::SPECIFIC_ENERGY,
        _ => return None,
    };
    Some(system.unit(dimension))
}
