//! Builds a field from a plotfile.

use super::fab::{Fab, Files};
use super::header::Header;
use super::job::Job;
use super::leaves::{Leaf, leaves};
use super::level::Level;
use super::schema::{DENSITY_NAMES, NAME, WARPX};
use crate::common::text::Text;
use crate::common::wanted::wanted;
use crate::error::{FormatError, Result};
use crate::limits::Budget;
use crate::model::{Geometry, Location, RawField, Values, Variable};
use crate::refined::{RefinedAxis, RefinedBlock, RefinedGrid};
use crate::registry::{FieldRequest, FileContent};
use crate::units::{Unit, UnitDimension, UnitSystem};
use std::path::Path;

/// Reads the plotfile whose `Header` is at `path`.
///
/// # Errors
/// [`FormatError::Input`] where texts, boxes and values contradict each other or are incomplete, [`FormatError::Unsupported`] for
/// other coordinates, versions and kinds of numbers, [`FormatError::Limit`], [`FormatError::Io`].
pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let text = Text::read(path, NAME)?;
    let header = Header::parse(path, text.content())?;
    let levels: Vec<Level> = header
        .levels
        .iter()
        .map(|(patches, data)| Level::read(data, *patches, header.dimension))
        .collect::<Result<_>>()?;
    let mut numbered = levels.iter().enumerate();
    if let Some((number, level)) = numbered.find(|(_, level)| level.components != header.names.len()) {
        let problem = format!("has {} variables, but the file Header names {}", level.components, header.names.len());
        return Err(FormatError::input(path, NAME, format!("level {number}"), problem));
    }
    let leaves = leaves(path, &header, &levels)?;
    let job = Job::beside(path);
    let units = job.units();
    let grid = grid(&header, &leaves, &job, units.as_ref());
    grid.validate().map_err(|(location, problem)| FormatError::input(path, NAME, location, problem))?;
    let is_charge = path.with_file_name(WARPX).exists();
    let densities: &[&str] = if is_charge { &[] } else { &DENSITY_NAMES };
    let (names, density) = wanted(&header.names, request, densities)
        .map_err(|(location, problem)| FormatError::input(path, NAME, location, problem))?;
    let mut notes = notes(&grid);
    if is_charge && density.is_none() {
        notes.push(
            "WarpX writes densities of charge and of numbers of particles; name the mass density with --density".into(),
        );
    }
    if units.is_none() {
        notes.push("no job_info of Castro or MAESTROeX says which units the numbers are in".into());
    }
    let wanted: Vec<usize> =
        header.names.iter().enumerate().filter(|(_, n)| names.contains(n)).map(|(k, _)| k).collect();
    let values = values(path, &header, &levels, &leaves, &wanted)?;
    let variable = |(k, values): (usize, Values)| {
        let name = header.names[k].clone();
        let unit = units.as_ref().and_then(|system| unit(system, &name));
        Variable { name, description: None, unit, location: Location::Cell, components: 1, values }
    };
    Ok(FileContent::Field(RawField {
        path: path.into(),
        format: NAME,
        geometry: Geometry::Refined(grid),
        variables: wanted.iter().copied().zip(values).map(variable).collect(),
        density,
        metadata: vec![("time".into(), header.time.to_string())],
        notes,
    }))
}

fn notes(grid: &RefinedGrid) -> Vec<String> {
    let levels = grid.levels().into_iter().enumerate().filter(|(_, [parts, _])| *parts > 0);
    let levels: Vec<String> = levels.map(|(level, [_, cells])| format!("{cells} cells of level {level}")).collect();
    let mut notes = vec![format!("AMReX plotfile of {}, less those that finer levels cover", levels.join(", "))];
    notes.extend(grid.absent_levels());
    notes
}

fn grid(header: &Header, leaves: &[Leaf], job: &Job, units: Option<&UnitSystem>) -> RefinedGrid {
    let periodic = job.periodic();
    let sizes = header.domains[0].sizes();
    let axis = |k: usize| RefinedAxis {
        name: ["x", "y", "z"][k].into(),
        lo: header.ends[k][0],
        hi: header.ends[k][1],
        cells: sizes[k],
        is_periodic: periodic[k],
    };
    let block = |leaf: &Leaf| RefinedBlock {
        number: leaf.patch,
        level: leaf.level as u8,
        first: leaf.cells.lo.map(|x| x as u64),
        cells: leaf.cells.sizes(),
    };
    RefinedGrid {
        axes: (0..header.dimension).map(axis).collect(),
        unit: units.map(|system| system.unit(UnitDimension::LENGTH)),
        ratios: header.ratios.clone(),
        blocks: leaves.iter().map(block).collect(),
    }
}

/// The values of some variables in all leaves: of 4 bytes where all patches have such.
fn values(path: &Path, header: &Header, levels: &[Level], leaves: &[Leaf], wanted: &[usize]) -> Result<Vec<Values>> {
    let mut files = Files::default();
    let mut fabs: Vec<Vec<Fab>> = Vec::new();
    let mut there = 0_u64;
    for level in levels {
        let open = |k| Fab::open(&mut files, level, k, header.dimension);
        let own: Vec<Fab> = level.patches.iter().enumerate().map(open).collect::<Result<_>>()?;
        there = own.iter().fold(there, |sum, fab| sum.saturating_add(fab.cells.count().saturating_mul(8)));
        fabs.push(own);
    }
    let is_double = fabs.iter().flatten().any(|fab| fab.kind.is_double);
    let cells = leaves.iter().fold(0_u64, |n, leaf| n.saturating_add(leaf.cells.count()));
    let budget = Budget::new(there);
    for k in wanted {
        budget.take(path, NAME, &format!("variable '{}'", header.names[*k]), cells.saturating_mul(8))?;
    }
    let empty = || match is_double {
        true => Values::F64(Vec::with_capacity(cells as usize)),
        false => Values::F32(Vec::with_capacity(cells as usize)),
    };
    let mut all: Vec<Values> = wanted.iter().map(|_| empty()).collect();
    for parts in leaves.chunk_by(|a, b| (a.level, a.patch) == (b.level, b.patch)) {
        let Some(fab) = parts.first().and_then(|leaf| fabs.get(leaf.level)?.get(leaf.patch)) else { continue };
        for (k, values) in wanted.iter().zip(&mut all) {
            let bytes = fab.read(&mut files, *k)?;
            for leaf in parts {
                let corner = header.domains[leaf.level].lo;
                let part = leaf.cells.shifted(corner.map(|x| -x));
                match values {
                    Values::F32(v) => fab.for_each(&bytes, &part, |x| v.push(x as f32)),
                    Values::F64(v) => fab.for_each(&bytes, &part, |x| v.push(x)),
                    Values::I64(_) => {}
                }
            }
        }
    }
    Ok(all)
}

/// The unit of a variable of Castro or MAESTROeX, where its name tells.
fn unit(system: &UnitSystem, name: &str) -> Option<Unit> {
    let dimension = match name {
        "density" | "rho" | "rho0" => UnitDimension::mass_density(3),
        "xmom" | "ymom" | "zmom" => UnitDimension::new(-2, 1, -1, 0),
        "rho_E" | "rho_e" | "pressure" | "p0" | "p0pluspi" | "rhoh" => UnitDimension::PRESSURE,
        "Temp" | "tfromp" | "tfromh" => UnitDimension::TEMPERATURE,
        "x_velocity" | "y_velocity" | "z_velocity" | "velx" | "vely" | "velz" | "xvel" | "yvel" | "zvel" => {
            UnitDimension::VELOCITY
        }
        "magvel" | "soundspeed" => UnitDimension::VELOCITY,
        "eint_E" | "eint_e" | "phiGrav" => UnitDimension::SPECIFIC_ENERGY,
        _ => return None,
    };
    Some(system.unit(dimension))
}
