//! Checks whether a simulation code accepts a particle file, and what it will compute from it.
//!
//! Everything that a code would stumble over, whoever wrote the file: missing and impossible values, numbers that are used
//! twice, places outside of the box, pairs; then what it sums with its own kernel: densities against those in the file,
//! smoothing lengths, and the net force of a body that its own gravity holds.

mod finding;
mod layout;
mod values;

use crate::codes::{AS_PLANETARY, CELL_OVER_REACH, LEAST_CELLS, Neighbors, TargetCode, long_bits};
use crate::eos::Material;
use crate::error::{Error, Result};
use crate::metrics::{InOwnUnits, Measured, Moving, NetForce, mean_net_force};
pub use finding::{Finding, Level};
use finding::{add, named};
use sph::domain::Domain;
use sph::point_mass::PointMass;
use sph::sums::support_guess;
use sph_formats::common::particle_names as names;
use sph_formats::{ParticleFile, ParticleTable, RunHeader, UnitSystem};
use values::{header, numbers, values, velocities};

/// Particles nearer than this many spacings are one to a code, or a pair.
const COINCIDENT: f64 = 1e-6;
pub(crate) const PAIRED: f64 = 0.3;
/// Smoothing lengths may be off by this factor: a code finds its own, but from afar slowly or not at all.
const NEAR: f64 = 1.25;
const FAR: f64 = 3.0;
/// In edges of the box: farther away rounding moves particles.
const FARTHEST: f64 = 1e9;
/// The square of more is beyond single precision.
const LARGE_MASS: f64 = 1e19;
/// A density column may be off by this much: it may be the sum with another kernel.
const OTHER_DENSITY: f64 = 0.05;
/// Share of a box that particles fill which has no vacuum.
const FILLED: f64 = 0.5;
/// Share of smoothing lengths that may be far off without a word.
const FEW: f64 = 0.02;
/// Net forces over gravity that let a body stay still, and that move it.
const STILL: f64 = 0.01;
const MOVES: f64 = 0.1;
/// Share of gravity from which on it is worth a word what bodies need of it as wholes.
const SEEN: f64 = 1e-3;

/// Checks a file for a code.
///
/// # Errors
/// A file without gas or without coordinates: there is nothing to check.
pub fn check(file: &ParticleFile, code: &TargetCode) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    let gas = file.species.iter().find(|s| s.part_type == 0 && s.table.count > 0);
    let table =
        &gas.ok_or_else(|| Error::field("PartType0", "the file has no gas particles; nothing can be checked"))?.table;
    if table.column(names::COORDINATES).is_none() {
        return Err(Error::field(names::COORDINATES, "is missing; expected three numbers for each particle"));
    }
    header(&file.header, code, &mut findings);
    layout::layouts(file, code, &mut findings);
    for species in file.species.iter().filter(|s| s.table.count > 0) {
        values(species, (code, &file.header), &mut findings);
    }
    numbers(file, code, &mut findings);
    velocities(file, &mut findings);
    for unread in file.species.iter().filter_map(|species| code.unread(species)) {
        add(&mut findings, Level::Warning, "types", unread);
    }
    frame(file, code, &mut findings);
    if findings.iter().all(|f| f.level != Level::Error) {
        match file.header.dimension {
            1 => sums::<1>(file, table, code, &mut findings)?,
            2 => sums::<2>(file, table, code, &mut findings)?,
            _ => sums::<3>(file, table, code, &mut findings)?,
        }
    }
    Ok(findings)
}

/// Dimension, box and units.
fn frame(file: &ParticleFile, code: &TargetCode, findings: &mut Vec<Finding>) {
    let header = &file.header;
    if header.dimension != 3 {
        let (d, title) = (header.dimension, code.sheet.title);
        match code.dimension_option(d).as_deref() {
            Some("") => {}
            Some(option) => {
                let text = format!("is {d}; the default build of {title} is for 3: build it with {option}");
                add(findings, Level::Warning, "dimension", text);
            }
            None => add(findings, Level::Error, "dimension", format!("is {d}, and {title} has 3 alone")),
        }
    }
    let edges = &header.box_size[..header.dimension];
    let isolated = header.periodic == [false; 3];
    let (title, needs_box) = (code.sheet.title, ["swift", "arepo"].contains(&code.sheet.name));
    // GADGET's family does not look at the box unless it is built to be periodic.
    let counts = needs_box || !isolated;
    let is_cube = edges.iter().all(|e| (e - edges[0]).abs() <= 1e-9 * edges[0]);
    let is_brick = counts && !is_cube;
    let options = if code.sheet.name == "gadget4" { long_bits(edges) } else { None };
    if let Some(options) = options.filter(|_| is_brick) {
        let text = format!("has the edges {edges:?}: build GADGET-4 with {}", options.join(" "));
        add(findings, Level::Warning, "box", text);
    } else if is_brick && code.sheet.format.starts_with("gadget") {
        add(
            findings,
            Level::Error,
            "box",
            format!(
                "has the edges {edges:?}, but {title} reads one; build it with LONG_X and the like, or make a cube"
            ),
        );
    }
    if edges.contains(&0.0) && isolated && needs_box {
        let text = format!("has no edges, but {title} needs BoxSize; write the edge of a box around the body");
        add(findings, Level::Error, "box", text);
        return;
    }
    for species in file.species.iter().filter(|s| counts && s.table.count > 0) {
        let Some(x) = species.table.column(names::COORDINATES) else { continue };
        let is_outside = |i: usize| {
            let edge = edges[i % header.dimension];
            let is_read = needs_box || header.periodic[i % header.dimension];
            is_read && edge > 0.0 && !(x.values.get(i) >= 0.0 && x.values.get(i) < edge)
        };
        if let Some(i) = (0..x.values.len()).find(|&i| x.values.get(i).is_finite() && is_outside(i)) {
            let level = if isolated { Level::Error } else { Level::Warning };
            let what = match needs_box {
                true => {
                    format!("{title} stops there unless it runs periodic: shift the body to the middle of a larger box")
                }
                false => "a periodic build moves it to the other side: shift the particles into the box".into(),
            };
            let (particle, edge) = (i / header.dimension, edges[i % header.dimension]);
            let text = format!(
                "particle {particle} is at {:?}, outside of the box from 0 to {edge:?}; {what}",
                x.values.get(i)
            );
            add(findings, level, &named(species, names::COORDINATES), text);
        }
        let is_lost = |i: &usize| {
            x.values.get(*i).is_finite() && x.values.get(*i).abs() > FARTHEST * edges[*i % header.dimension]
        };
        if let Some(i) = (0..x.values.len()).find(|i| edges[i % header.dimension] > 0.0 && is_lost(i)) {
            let text = format!(
                "particle {} is at {:?}, so far from the box that its coordinate has no digits left for a place in it",
                i / header.dimension,
                x.values.get(i)
            );
            add(findings, Level::Error, &named(species, names::COORDINATES), text);
        }
    }
    if header.units == UnitSystem::CODE {
        add(
            findings,
            Level::Warning,
            "units",
            "are pure numbers: those of the parameter file count, and gravity and cooling follow from those",
        );
    }
    let masses = file.species.iter().filter_map(|s| s.table.column(names::MASSES));
    let most = masses.map(|m| m.values.range().1).fold(0.0_f64, f64::max);
    if most > LARGE_MASS {
        let text = format!(
            "masses of {most:e} overflow single precision where codes square them; write units that suit the body"
        );
        add(findings, Level::Warning, "units", text);
    }
}

/// What the code sums.
fn sums<const D: usize>(
    file: &ParticleFile,
    table: &ParticleTable,
    code: &TargetCode,
    findings: &mut Vec<Finding>,
) -> Result<()> {
    let header = &file.header;
    let (Some(x), Some(m)) = (table.column(names::COORDINATES), table.column(names::MASSES)) else { return Ok(()) };
    let n = table.count;
    let (coordinates, masses) = (x.values.to_f64(), m.values.to_f64());
    let own = InOwnUnits::<D>::new(&coordinates, &masses, (&header.box_size, header.periodic))
        .map_err(|e| Error::field(names::COORDINATES, format!("make no box: {e}")))?;
    let InOwnUnits { positions, masses, domain, start, size, total } = own;
    let neighbors = code.kernel_neighbors(D);
    let density = table.column(names::DENSITY);
    let guess = support(table, code, size, &domain);
    let measured = Measured::new(code.kernel, &domain, &positions, &masses, &guess, neighbors);
    pairs(&measured, &domain, neighbors, findings);
    if code.sheet.name == "arepo" && D == 3 {
        let edges = header.box_size.map(|edge| edge / size);
        vacuum(&measured, &masses, edges.iter().product(), findings);
    }
    if code.sheet.is_mesh {
        let text =
            format!("is each cell's mass over its volume in {}; what the file says is not read", code.sheet.title);
        add(findings, Level::Good, names::DENSITY, text);
        return Ok(());
    }
    smoothing(&measured, table, (code, size), header, findings);
    let interior: Vec<usize> = (0..n).filter(|&i| measured.interior[i]).collect();
    if let Some(column) = density {
        let summed = |i: usize| measured.sums[i].weighted * total / size.powi(D as i32);
        let mut ratios: Vec<f64> = interior.iter().map(|&i| summed(i) / column.values.get(i)).collect();
        ratios.sort_unstable_by(f64::total_cmp);
        if let Some(median) = ratios.get(ratios.len() / 2) {
            let spread = ratios[(ratios.len() as f64 * 0.84) as usize % ratios.len()] / median - 1.0;
            let level = if (median - 1.0).abs() > OTHER_DENSITY { Level::Warning } else { Level::Good };
            let text = format!(
                "{} sums {:.3} times the file's in the median of the interior, with a scatter of {:.2} %",
                code.sheet.title,
                median,
                100.0 * spread
            );
            add(findings, level, names::DENSITY, text);
        }
    }
    let points: Vec<PointMass<D>> =
        points::<D>(file, code, (start, size, total)).into_iter().map(|(point, _)| point).collect();
    net_force(file, table, code, (&measured, &domain, &positions, (&masses, &points)), (size, total), findings);
    Ok(())
}

/// About the support radii, from the densities in the file or the mean spacing, in units of `size`.
pub(crate) fn support<const D: usize>(
    table: &ParticleTable,
    code: &TargetCode,
    size: f64,
    domain: &Domain<D>,
) -> Vec<f64> {
    let mean = domain.mean_spacing(table.count);
    let columns = table.column(names::MASSES).zip(table.column(names::DENSITY));
    let spacing = |i: usize| {
        let own = columns.map(|(m, d)| (m.values.get(i) / d.values.get(i)).powf(1.0 / D as f64) / size);
        own.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(mean).min(1.0)
    };
    support_guess::<D>(code.kernel_neighbors(D), table.count, spacing)
}

/// A box of this volume that particles fill for a small part.
fn vacuum<const D: usize>(measured: &Measured<D>, masses: &[f64], whole: f64, findings: &mut Vec<Finding>) {
    let volume: f64 = measured.sums.iter().zip(masses).map(|(sums, m)| m / sums.weighted).sum();
    let share = volume / whole;
    if share < FILLED {
        let text = format!(
            "is filled by particles to {:.0} %, but cells fill all of it: AREPO cannot make a mesh of a body in a vacuum, and ends before its first step; fill the rest (`ambient:`), or take another code",
            100.0 * share
        );
        add(findings, Level::Error, "box", text);
    }
}

fn pairs<const D: usize>(measured: &Measured<D>, domain: &Domain<D>, neighbors: f64, findings: &mut Vec<Finding>) {
    let closest = measured.neighbors(domain, neighbors).closest_pair;
    let said = if closest < 0.01 { format!("{closest:.1e}") } else { format!("{closest:.2}") };
    let (level, text) = if closest < COINCIDENT {
        (
            Level::Error,
            format!(
                "two are {closest:.1e} spacings apart: some codes refuse that, to others they are one particle of twice the mass; expected different places"
            ),
        )
    } else if closest < PAIRED {
        (Level::Warning, format!("are {said} spacings apart at least: pairs see one density where two particles are"))
    } else {
        (Level::Good, format!("are {said} spacings apart at least"))
    };
    add(findings, level, "particles", text);
}

/// Smoothing lengths, if the code reads them.
fn smoothing<const D: usize>(
    measured: &Measured<D>,
    table: &ParticleTable,
    (code, size): (&TargetCode, f64),
    RunHeader { box_size, periodic, layouts, .. }: &RunHeader,
    findings: &mut Vec<Finding>,
) {
    // Where the file does not say which convention it follows, it is the code's, as it is of what the code opens itself.
    let by_author = layouts.first().filter(|_| layout::opens(code)).and_then(|layout| layout.support_over_length);
    let of_code = by_author.map_or(1.0, |by_author| code.support_over_length(D) / by_author);
    let own = table.column(names::SUPPORT_RADIUS).map(|c| (c, of_code));
    let by_code = || table.column(names::SMOOTHING_LENGTH).map(|c| (c, code.support_over_length(D)));
    let Some((column, factor)) = own.or_else(by_code) else { return };
    let radius = |i: usize| factor * column.values.get(i);
    let mut ratios: Vec<f64> = (0..table.count).map(|i| radius(i) / (measured.support[i] * size)).collect();
    ratios.sort_unstable_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    let largest = factor * column.values.range().1;
    let least_edge = (0..D).filter(|&k| periodic[k]).map(|k| box_size[k]).fold(f64::INFINITY, f64::min);
    if code.sheet.name == "swift" && CELL_OVER_REACH * largest > least_edge / LEAST_CELLS {
        add(
            findings,
            Level::Error,
            "smoothing lengths",
            format!(
                "kernels reach {largest:e}, and cells {CELL_OVER_REACH} times as wide are more than a third of the box: SWIFT stops (it asks for at least 3 cells); use more particles, or check the convention, expected h = eta (m/rho)^(1/3)"
            ),
        );
    }
    let off = median.max(1.0 / median);
    let level = match off {
        o if o > FAR => Level::Error,
        o if o > NEAR => Level::Warning,
        _ => Level::Good,
    };
    let expected = match code.neighbors {
        Neighbors::Eta(eta) => format!("h = {eta} (m/rho)^(1/3)"),
        Neighbors::Lengths(ratio) => format!("h = {ratio} (m/rho)^(1/3)"),
        Neighbors::Diagonals(ratio) => format!("h = {ratio} sqrt({D}) (m/rho)^(1/{D})"),
        Neighbors::Count { lengths: 1.0, .. } => format!("the kernel's radius with {} neighbors", code.setting_in(D)),
        Neighbors::Count { lengths, .. } => {
            format!("the kernel's radius over {lengths} with {} neighbors", code.setting_in(D))
        }
    };
    let title = code.sheet.title;
    let text = format!("are {median:.3} times those that {title} will find in the median; expected {expected}");
    add(findings, level, "smoothing lengths", text);
    let strays = ratios.iter().filter(|ratio| !(1.0 / FAR..=FAR).contains(*ratio)).count();
    if off <= FAR && strays as f64 > FEW * table.count as f64 {
        let text = format!(
            "of {strays} of {} particles are off by more than a factor of {FAR}: {title} finds its own slowly, or not at all; expected {expected}",
            table.count
        );
        add(findings, Level::Warning, "smoothing lengths", text);
    }
}

/// Point masses with a softening radius, softened as the code does it, in units of a length from a corner and of a mass, with
/// their velocities in the file's units (0 where it has none).
pub(crate) fn points<const D: usize>(
    file: &ParticleFile,
    code: &TargetCode,
    (start, size, total): ([f64; D], f64, f64),
) -> Vec<(PointMass<D>, [f64; D])> {
    let softening = code.sheet.softening;
    let mut points = Vec::new();
    for table in file.species.iter().map(|s| &s.table) {
        let column = |name: &str| table.column(name);
        let radius = column(names::SOFTENING_RADIUS).or_else(|| column(names::ACCRETION_RADIUS));
        let (Some(radius), Some(x), Some(m)) = (radius, column(names::COORDINATES), column(names::MASSES)) else {
            continue;
        };
        let point = |i: usize| PointMass {
            center: sph::array(|k| (x.values.get(i * x.components + k) - start[k]) / size),
            mass: m.values.get(i) / total,
            radius: radius.values.get(i) / size,
            softening,
        };
        let velocity = |i: usize| {
            column(names::VELOCITIES).map_or([0.0; D], |v| sph::array(|k| v.values.get(i * v.components + k)))
        };
        points.extend((0..table.count).map(|i| (point(i), velocity(i))));
    }
    points
}

/// The net force on a body that its own gravity holds.
fn net_force<const D: usize>(
    file: &ParticleFile,
    table: &ParticleTable,
    code: &TargetCode,
    (measured, domain, positions, attracting): (&Measured<D>, &Domain<D>, &[Vec<f64>; D], (&[f64], &[PointMass<D>])),
    (size, total): (f64, f64),
    findings: &mut Vec<Finding>,
) {
    let header = &file.header;
    let Some(energy) = table.column(names::INTERNAL_ENERGY) else { return };
    let other_materials = table.materials();
    let is_other_matter = other_materials.is_some() && !AS_PLANETARY.contains(&code.scheme.name);
    if D == 3 && header.periodic != [false; 3] {
        let text = "is not looked at: the box is periodic, as files of GADGET without a word of it count; --open says that it is not";
        return add(findings, Level::Good, "net force", text);
    }
    if D < 3 || header.units == UnitSystem::CODE || is_other_matter || !code.scheme.has_our_force {
        return;
    }
    if let Some(other) = file.species.iter().find(|s| s.part_type != 0 && s.table.count > 1) {
        let text = format!(
            "is not looked at: {} particles of type {} attract the gas, too",
            other.table.count, other.part_type
        );
        return add(findings, Level::Good, "net force", text);
    }
    let (u, gamma) = (&header.units, header.adiabatic_index());
    let unit = code.gravity_in(u) * total / size;
    let density = |i: usize| measured.sums[i].weighted * total / size.powi(3) * u.mass / u.length.powi(3);
    let specific = (u.length / u.time).powi(2);
    // That of an ideal gas with the pressure that the material has at the density summed here.
    let of_material = |i: usize, id: f64| {
        let matter = Material::of_id(id as i32)?.equation;
        let pressure = matter.pressure(density(i), energy.values.get(i) * specific);
        Some(pressure / (density(i) * specific * (gamma - 1.0)))
    };
    let energies: Option<Vec<f64>> = (0..table.count)
        .map(|i| match other_materials {
            None => Some(energy.values.get(i) / unit),
            Some(ids) => Some(of_material(i, ids.values.get(i))? / unit),
        })
        .collect();
    let Some(energies) = energies else { return };
    let velocities = in_units::<D>(table, unit);
    let bodies = table.bodies();
    let is_attracted = !attracting.1.is_empty();
    let moving = Moving { velocities: velocities.as_deref(), bodies: &bodies, is_attracted };
    let found = mean_net_force(code.kernel, measured, domain, positions, attracting, (&energies, gamma), moving);
    let Some(NetForce { left, rotation, whole }) = found else { return };
    let (level, advice) = match left {
        m if m < STILL && code.pairing(D).is_some() => (
            Level::Good,
            "it stays nearly so: the kernel pairs particles, which leave any arrangement at rest (`sph-prep run` shows how fast)",
        ),
        m if m < STILL => (Level::Good, "it stays still"),
        m if m < MOVES => (Level::Warning, "it settles with some motion: place it with --for, or relax it in the code"),
        _ => (Level::Warning, "it moves at once: check pressure, units and kernel, or relax it in the code"),
    };
    let whose = if bodies.iter().any(|b| *b > 0) { "each body" } else { "the whole" };
    let taken: Vec<String> = [("rotation", rotation), ("acceleration", whole)]
        .into_iter()
        .filter(|(_, share)| *share > SEEN)
        .map(|(what, share)| format!("{what} ({:.2} % of gravity)", 100.0 * share))
        .collect();
    let less = match taken.is_empty() {
        true => String::new(),
        false => format!(", less what the {} of {whose} takes", taken.join(" and the ")),
    };
    let text = format!(
        "is {:.2} % of gravity in the interior on average, as {} sums it{less}; {advice}",
        100.0 * left,
        code.describe(3)
    );
    add(findings, level, "net force", text);
}

/// Velocities of the gas in units of the root of a specific energy, where all are numbers.
fn in_units<const D: usize>(table: &ParticleTable, specific: f64) -> Option<Vec<[f64; D]>> {
    let column = table.column(names::VELOCITIES).filter(|c| c.components >= D)?;
    let unit = specific.sqrt();
    let row = |i: usize| sph::array(|k| column.values.get(i * column.components + k) / unit);
    let all: Vec<[f64; D]> = (0..table.count).map(row).collect();
    all.iter().flatten().all(|v| v.is_finite()).then_some(all)
}
