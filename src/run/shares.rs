//! Bodies before they are placed: their common data, and the number of particles of each.
//!
//! Particles are shared out by mass, so that all have the same up to half a particle's worth in each body.

use crate::error::{Error, Result};
use crate::input::constants::gravity;
use crate::input::ingest::{self, RawInput};
use crate::input::internal_units::Prepared;
use crate::input::stated_units;
use crate::input::units::{InputUnits, RunUnits};
use crate::output::frame::output_units;
use crate::scene::{AmbientInput, Conversion, DEFAULT_PARTICLES, MatchName, Quantity, Scene, in_body, name_of};
use sph_formats::{FormatSpec, UnitDimension, UnitSystem};

/// The bodies that are not points, each as a scene of its own.
pub(super) struct Shared {
    pub common: Common,
    /// Among the scene's bodies.
    pub gas: Vec<usize>,
    pub scenes: Vec<Scene>,
    /// In cgs where there are units; of a particle of all bodies, on average.
    particle_mass: f64,
    /// What of the scene has no effect.
    pub notes: Vec<String>,
}

/// Reads all bodies, and shares particles out among them.
///
/// # Errors
/// Those of reading a body, with its name, and bodies that do not go together.
pub(super) fn shared(scene: &Scene, formats: &[FormatSpec]) -> Result<Shared> {
    let gas: Vec<usize> = (0..scene.bodies.len()).filter(|i| scene.bodies[*i].point_mass.is_none()).collect();
    let estimated = |counts: &[Option<usize>]| -> Result<Vec<Estimate>> {
        let one = |(i, n): (&usize, &Option<usize>)| {
            estimate(scene, *i, *n, formats).map_err(|e| in_body(&scene.bodies[*i].title(*i), e))
        };
        gas.iter().zip(counts).map(one).collect()
    };
    let estimates = estimated(&vec![None; gas.len()])?;
    let common = Common::new(scene, &estimates)?;
    let mut counts = common.counts(scene, &estimates)?;
    if estimates.iter().any(|e| e.is_radial) {
        // How much of an atmosphere is cut depends on the number of particles.
        let again = estimated(&counts.iter().map(|n| Some(*n)).collect::<Vec<_>>())?;
        counts = common.counts(scene, &again)?;
    }
    let alone = |((i, count), estimate): ((&usize, &usize), &Estimate)| {
        let mut alone = match estimate.is_kept {
            true => scene.of_kept_body(*i),
            false => scene.of_body(*i, Some(*count)),
        };
        alone.output.units = Some(common.name.clone());
        if scene.ambient.is_some() {
            // What neighbors the medium has is told by the density that the body should have.
            alone.output.target_density = true;
        }
        alone
    };
    let scenes = gas.iter().zip(&counts).zip(&estimates).map(alone).collect();
    let particle_mass = estimates.iter().map(|e| e.mass).sum::<f64>() / counts.iter().sum::<usize>() as f64;
    let all_state_theirs = estimates.iter().all(|e| e.is_kept || scene.bodies[e.index].particles.is_some());
    let unused = scene.particles.filter(|_| all_state_theirs && scene.particle_mass.is_none());
    let note = |n| {
        format!(
            "{n} particles of the whole were asked for, but each of the bodies states its own number, or keeps its own particles, which is what it gets"
        )
    };
    let mut notes: Vec<String> = unused.map(note).into_iter().collect();
    if let Some(kept) = estimates.iter().find(|e| e.is_kept && scene.balance.is_on()) {
        let title = scene.bodies[kept.index].title(kept.index);
        notes.push(format!(
            "the balance of the scene is not of body {title}, whose particles and energies stay as they are"
        ));
    }
    Ok(Shared { common, gas, scenes, particle_mass, notes })
}

impl Shared {
    /// The medium about the bodies as a scene by itself, with as many particles as it would have if it filled the whole box: none where
    /// that is known only when the bodies are placed.
    ///
    /// # Errors
    /// Those of reading its density.
    pub fn medium(
        &self,
        scene: &Scene,
        ambient: &AmbientInput,
        formats: &[FormatSpec],
    ) -> Result<(Scene, Option<usize>)> {
        let mut alone = scene.of_ambient(ambient, self.common.dimension, None);
        alone.output.units = Some(self.common.name.clone());
        let mass = weigh(&alone, formats)?.1;
        let count = (mass / self.particle_mass).ceil();
        let is_known = ambient.matching == MatchName::Mass && count >= 1.0 && count <= f64::from(u32::MAX);
        let count = is_known.then_some(count as usize);
        alone.particles = count;
        Ok((alone, count))
    }
}

/// What a body is before it is placed.
struct Estimate {
    /// Among the scene's bodies.
    index: usize,
    /// In cgs where there are units.
    mass: f64,
    dimension: usize,
    is_radial: bool,
    units: RunUnits,
    /// The gas particles of a snapshot of which nothing says how many it should have, or whose particles stay.
    own: Option<usize>,
    is_kept: bool,
}

/// The mass of a body by itself.
fn estimate(scene: &Scene, index: usize, count: Option<usize>, formats: &[FormatSpec]) -> Result<Estimate> {
    let (units, mass, dimension, is_radial, own) = weigh(&scene.of_body(index, count), formats)?;
    let is_kept = own.is_some() && scene.keeps_body(index);
    let is_counted = scene.particles.is_some() || scene.particle_mass.is_some();
    let own = own.filter(|_| is_kept || !is_counted && scene.bodies[index].particles.is_none());
    Ok(Estimate { index, mass, dimension, is_radial, units, own, is_kept })
}

/// Units, mass (in cgs where there are units), dimension, whether it is a profile, and the gas particles of a snapshot, of what one scene reads.
fn weigh(scene: &Scene, formats: &[FormatSpec]) -> Result<(RunUnits, f64, usize, bool, Option<usize>)> {
    let raw = ingest::read(scene, formats)?;
    let own = match &raw {
        RawInput::Snapshot(snapshot) if !snapshot.is_mesh => Some(snapshot.masses.len()),
        _ => None,
    };
    let units = RunUnits::new(scene, stated_units::units(scene, &raw)?.input)?;
    let dimension = ingest::dimension(scene, &raw)?;
    let count = scene.particles.unwrap_or(DEFAULT_PARTICLES);
    let (mass, is_radial) = match dimension {
        1 => weighed(&Prepared::<1>::new(scene, formats, (raw, &units), count)?),
        2 => weighed(&Prepared::<2>::new(scene, formats, (raw, &units), count)?),
        _ => weighed(&Prepared::<3>::new(scene, formats, (raw, &units), count)?),
    };
    let unit = units.input.map_or(1.0, |u| u.density * u.length.powi(dimension as i32));
    Ok((units, mass * unit, dimension, is_radial, own))
}

fn weighed<const D: usize>(prepared: &Prepared<D>) -> (f64, bool) {
    (prepared.mass.value, prepared.source.radial.is_some())
}

/// What all bodies have in common.
pub(super) struct Common {
    pub dimension: usize,
    units: RunUnits,
    /// Of the output's system of units.
    pub name: String,
    /// Constant of gravity in cgs, or in numbers without units.
    pub gravity: f64,
}

impl Common {
    fn new(scene: &Scene, estimates: &[Estimate]) -> Result<Self> {
        let title = |i: usize| scene.bodies[i].title(i);
        let first = &estimates[0];
        for other in estimates {
            let key = || format!("bodies[{}]", title(other.index));
            if other.dimension != first.dimension {
                let problem =
                    format!("is in {}-D, but body {} in {}-D", other.dimension, title(first.index), first.dimension);
                return Err(Error::scene(key(), problem));
            }
            if other.units.input.is_some() != first.units.input.is_some() {
                let (with, without) =
                    if first.units.input.is_some() { (first.index, other.index) } else { (other.index, first.index) };
                let problem = format!(
                    "has no units, but body {} has; state them by input.length_unit and input.density_unit",
                    title(with)
                );
                return Err(Error::scene(format!("bodies[{}].input", title(without)), problem));
            }
            if other.units.to_cgs().from != first.units.to_cgs().from && has_plain_numbers(scene) {
                let problem = format!(
                    "is in other units than body {}, so that plain numbers of the scene could mean either; state `units`, as in \
                     `units: solar`, or write numbers with their units",
                    title(first.index)
                );
                return Err(Error::scene(key(), problem));
            }
        }
        let is_known = first.units.input.is_some();
        let name = match (&scene.output.units, is_known) {
            (Some(name), _) => name.clone(),
            (None, false) => "code".into(),
            (None, true) => {
                let total = estimates.iter().map(|e| e.mass).sum();
                let cgs = InputUnits { length: 1.0, density: 1.0, time: 1.0 };
                let (system, _) = output_units(None, Some(cgs), total, first.dimension)?;
                name_of(system).unwrap_or("cgs").to_owned()
            }
        };
        Ok(Self { dimension: first.dimension, units: first.units, name, gravity: gravity(scene, is_known) })
    }

    pub fn has_units(&self) -> bool {
        self.units.input.is_some()
    }

    pub fn conversion(&self, out: &UnitSystem) -> Conversion {
        self.units.to_output(out)
    }

    /// Particles of each body.
    fn counts(&self, scene: &Scene, estimates: &[Estimate]) -> Result<Vec<usize>> {
        let masses: Vec<f64> = estimates.iter().map(|e| e.mass).collect();
        if let Some(particle) = &scene.particle_mass {
            let dimension = UnitDimension::new(self.dimension as i8 - 3, 1, 0, 0);
            let mass = particle.value("particle_mass", dimension, &self.units.to_cgs())?;
            return by_particle_mass(scene, estimates, mass);
        }
        if let Some(mass) = mean_of_snapshots(estimates).filter(|_| scene.particles.is_none()) {
            return by_particle_mass(scene, estimates, mass);
        }
        let stated: Vec<Option<usize>> = estimates.iter().map(|e| e.own.or(scene.bodies[e.index].particles)).collect();
        let total = scene.particles.unwrap_or(DEFAULT_PARTICLES);
        let taken: usize = stated.iter().flatten().sum();
        let open: Vec<usize> = (0..masses.len()).filter(|i| stated[*i].is_none()).collect();
        if taken + open.len() > total && !open.is_empty() {
            let problem =
                format!("are {total}, of which bodies take {taken}, which leaves too few for the other {}", open.len());
            return Err(Error::scene("particles", problem));
        }
        let shares = shares(total.saturating_sub(taken), &open.iter().map(|i| masses[*i]).collect::<Vec<_>>());
        let mut counts: Vec<usize> = stated.iter().map(|n| n.unwrap_or(0)).collect();
        open.iter().zip(shares).for_each(|(i, n)| counts[*i] = n);
        if let Some(i) = counts.iter().position(|n| *n == 0) {
            let problem =
                format!("is too light for one of {total} particles of the same mass; state more, or its own number");
            return Err(Error::scene(
                format!("bodies[{}].particles", scene.bodies[estimates[i].index].title(estimates[i].index)),
                problem,
            ));
        }
        Ok(counts)
    }
}

/// Whether a number with a dimension is written without its unit.
fn has_plain_numbers(scene: &Scene) -> bool {
    let is_plain = |q: &Quantity| matches!(q, Quantity::Plain(v) if *v != 0.0);
    let in_bodies = scene.bodies.iter().flat_map(|b| b.position.iter().chain(&b.velocity).chain(&b.spin));
    let orbit = scene.orbit.iter().flat_map(|o| {
        [&o.semi_major_axis, &o.velocity_at_contact, &o.velocity_at_infinity, &o.distance].into_iter().flatten()
    });
    let points = scene.bodies.iter().flat_map(|b| b.point_mass.iter().chain(b.radii().map(|r| r.2)));
    in_bodies.chain(orbit).chain(points).chain(&scene.particle_mass).any(is_plain)
}

/// Mass of a particle of the snapshots that have as many as they had, on average.
fn mean_of_snapshots(estimates: &[Estimate]) -> Option<f64> {
    let all = || estimates.iter().filter_map(|e| Some((e.mass, e.own?)));
    let (mass, count) = all().fold((0.0, 0), |(mass, count), (m, n)| (mass + m, count + n));
    (count > 0).then(|| mass / count as f64)
}

fn by_particle_mass(scene: &Scene, estimates: &[Estimate], particle: f64) -> Result<Vec<usize>> {
    let counts = estimates.iter().map(|Estimate { index, mass, own, .. }| {
        if let Some(own) = own.or(scene.bodies[*index].particles) {
            return Ok(own);
        }
        let count = (mass / particle).round();
        match count >= 1.0 && count <= f64::from(u32::MAX) {
            true => Ok(count as usize),
            false => {
                let (title, most) = (scene.bodies[*index].title(*index), u32::MAX);
                let problem = format!("makes {count:.3e} particles of body {title}, expected 1 to {most}");
                Err(Error::scene("particle_mass", problem))
            }
        }
    });
    counts.collect()
}

/// `total` shared by mass: whole numbers, and what is left to those with the largest remainders.
fn shares(total: usize, masses: &[f64]) -> Vec<usize> {
    let sum: f64 = masses.iter().sum();
    let exact: Vec<f64> = masses.iter().map(|m| total as f64 * m / sum).collect();
    let mut counts: Vec<usize> = exact.iter().map(|n| n.floor() as usize).collect();
    let mut order: Vec<usize> = (0..masses.len()).collect();
    order.sort_by(|a, b| exact[*b].fract().total_cmp(&exact[*a].fract()).then(a.cmp(b)));
    let left = total.saturating_sub(counts.iter().sum());
    order.iter().take(left).for_each(|i| counts[*i] += 1);
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn particles_are_shared_by_mass_and_add_up() {
        assert_eq!(shares(10, &[1.0, 1.0, 1.0]), [4, 3, 3]);
        assert_eq!(shares(100, &[0.333, 0.667]), [33, 67]);
        assert_eq!(shares(1000, &[2e33, 1e33, 1e27]), [667, 333, 0]);
        assert_eq!(shares(0, &[1.0, 2.0]), [0, 0]);
    }
}
