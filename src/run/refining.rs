//! A snapshot with another resolution in a sphere: only particles whose masses do not fit there are replaced, and the new ones are relaxed
//! against those that stay.
//!
//! With the mass m* = m_0 / f(x), f the factor of [`crate::input::refinement`], a particle stands for s = m / m* particles. Where s is near 1 it
//! stays, to the bit. All others, in the order of a tree, are replaced by as many particles as the running sum of s passes halves
//! of whole numbers: none, one, or a family about their place (ALARIC sec. 2.4). These move by WVT until their number density is rho / m*, and
//! have the masses rho / n times one number near 1, which keeps the total; then these change by up to a tenth until the summed
//! densities are nearer to rho.
//!
//! A snapshot may also stay as it is as a whole, to be measured and put among other bodies.

use super::grading::verdict as verdict_on;
use super::plan::{LeftOut, Plan};
use super::renewed::Sums;
use super::report::Report;
use super::stages::{Placed, Setting};
use super::verdict::{Finding, Grade};
use crate::error::{Error, Result};
use crate::field::FreeSpace;
use crate::input::ingest::RawInput;
use crate::input::internal_units::Prepared;
use crate::input::particles::{LEFT_OUT, Snapshot};
use crate::input::refinement::Refinement;
use crate::input::support::support_radii;
use crate::input::units::RunUnits;
use crate::output::columns;
use crate::output::kept::{Replacement, is_double};
use crate::relaxation::{WVT, family};
use crate::scene::{Motion, OtherTypes, Polish, Scene, system_of};
use crate::target::{Positions, Target, at};
use sph::domain::{Axis, Domain};
use sph::neighbors::Tree;
use sph_formats::common::particle_names as names;
use sph_formats::{Geometry, ParticleFile, Species, UnitDimension, UnitSystem};

/// Share of a snapshot's mass in particles that may be replaced beyond the shell without a warning: a sphere that moves on leaves as much.
const MUCH_BEYOND: f64 = 0.25;
/// A particle of so many times the mass that belongs there, or of its inverse, is replaced.
const TOLERATED: f64 = 1.5;
/// Iterations of WVT where the scene does not say: each number begins anew, and that counts with which the sums of the new particles come nearest
/// to the density. Across a shell of about a spacing's width, where the spacing itself doubles, many make layers and gaps.
const ITERATIONS: [usize; 5] = [60, 20, 6, 2, 1];
/// Largest change of a new particle's mass for the sake of the density, and how often it is looked for.
const TRIM: f64 = 0.1;
const TRIMS: usize = 5;

/// What becomes of the particles of a snapshot.
pub(super) struct Refining<const D: usize> {
    file: ParticleFile,
    /// Of its gas, in its units.
    points: Vec<[f64; D]>,
    masses: Vec<f64>,
    domain: Domain<D>,
    /// Mass of a particle far from the sphere.
    particle: f64,
    kept: Vec<usize>,
    /// Particles that give way, with how many there are in their place.
    replaced: Vec<(usize, usize)>,
    /// Mass of those of them beyond the shell; 0 where the scene says what mass belongs there.
    beyond: f64,
    notes: Vec<String>,
    /// By how much the summed densities of the new particles are off on average, when they are placed.
    off: Option<f64>,
    /// Whether it is refined at all.
    is_refined: bool,
    /// Whether nobody says what its numbers are in.
    is_pure: bool,
}

/// New particles after the particles that stay.
struct Candidate<const D: usize> {
    placed: Placed<D>,
    masses: Vec<f64>,
    sums: Sums,
    off: Option<f64>,
}

impl<const D: usize> Refining<D> {
    /// Decides which particles give way; `None` where the scene refines no snapshot, or places all particles of it anew.
    ///
    /// # Errors
    /// What such a scene cannot say, and numbers of particles that cannot be placed.
    pub fn new(scene: &Scene, raw: &mut RawInput, units: &RunUnits) -> Result<Option<Self>> {
        if scene.input.keeps_particles() {
            return Self::keeping(scene, raw, units).map(Some);
        }
        let (Some(input), RawInput::Snapshot(snapshot)) = (&scene.refine, raw) else {
            return match scene.refine.as_ref().is_some_and(|r| r.particle_mass.is_some()) {
                false => Ok(None),
                true => {
                    let problem = "is that of a snapshot's particles; here their number settles it: leave it out";
                    Err(Error::scene("refine.particle_mass", problem))
                }
            };
        };
        if scene.particles.is_some() {
            return match input.particle_mass {
                None => Ok(None),
                Some(_) => Err(Error::scene("refine.particle_mass", "and particles are both given; leave one out")),
            };
        }
        refuse_what_changes_all(scene, &snapshot.units)?;
        if snapshot.is_mesh {
            let problem = "is of particles, but the snapshot has cells of a moving mesh; state `particles` to place all of them anew";
            return Err(Error::scene("refine", problem));
        }
        let Some(mut refining) = Self::whole(scene, snapshot)? else { return Ok(None) };
        let into_input = units.to_input();
        let refinement = Refinement::new(input, &refining.domain, &into_input, snapshot.time)?;
        let masses = &refining.masses;
        let particle = match &input.particle_mass {
            Some(q) => q.value("refine.particle_mass", UnitDimension::new(D as i8 - 3, 1, 0, 0), &into_input)?,
            None if input.factor < 1.0 => masses.iter().copied().filter(|m| *m > 0.0).fold(f64::INFINITY, f64::min),
            None => refining.particle,
        };
        let (kept, replaced) = chosen(&refining.points, masses, |x| particle / refinement.factor(x))?;
        refining = Self { particle, kept, replaced, is_refined: true, ..refining };
        let is_beyond = |i: &usize| refinement.factor(&refining.points[*i]) == 1.0;
        let beyond: Vec<usize> = refining.replaced.iter().map(|r| r.0).filter(is_beyond).collect();
        if input.particle_mass.is_none() {
            refining.beyond = beyond.iter().map(|&i| refining.masses[i]).sum();
        }
        refining.notes.push(format!(
            "refined {}: {} particles, of which {} are beyond the shell, give way to {}; {} stay as they are, to the bit",
            refinement.describe(),
            refining.replaced.len(),
            beyond.len(),
            refining.made(),
            refining.kept.len()
        ));
        Ok(Some(refining))
    }

    /// All particles of a snapshot as they are.
    fn keeping(scene: &Scene, raw: &mut RawInput, units: &RunUnits) -> Result<Self> {
        let key = "input.keep_particles";
        let RawInput::Snapshot(snapshot) = raw else {
            return Err(Error::scene(key, "is of the particles of a snapshot, and the input has none; leave it out"));
        };
        if snapshot.is_mesh {
            return Err(Error::scene(
                key,
                "is of particles, but the snapshot has cells of a moving mesh; leave it out",
            ));
        }
        let placing = [("particles", scene.particles.is_some()), ("refine", scene.refine.is_some())];
        if let Some((other, _)) = placing.iter().chain(&changing(scene)).find(|(_, is_given)| *is_given) {
            let problem =
                "would change particles that stay as they are; leave it out, or state `input: {keep_particles: false}`";
            return Err(Error::scene(*other, problem));
        }
        let none = || Error::scene(key, "is of gas particles, and the snapshot has none");
        let mut keeping = Self::whole(scene, snapshot)?.ok_or_else(none)?;
        match units.input {
            None => keeping.is_pure = true,
            // Numbers without units are in those of the scene.
            Some(own) if keeping.file.header.units == UnitSystem::CODE => {
                let (length, time) = (own.length, own.time);
                let mass = own.density * length.powi(3);
                keeping.file.header.units = UnitSystem { length, time, mass, ..UnitSystem::CODE };
            }
            Some(_) => {}
        }
        keeping.notes.push(format!("the {} particles stay as they are (input.keep_particles)", keeping.points.len()));
        Ok(keeping)
    }

    /// A snapshot of whose particles none gives way; `None` where its file is not kept.
    fn whole(scene: &Scene, snapshot: &mut Snapshot) -> Result<Option<Self>> {
        let Some(mut file) = snapshot.file.take() else { return Ok(None) };
        let notes = support_radii(&snapshot.field.path, &mut file);
        let Geometry::Cloud { points, .. } = &snapshot.field.geometry else { return Ok(None) };
        let (domain, masses) = (snapshot.domain::<D>()?, snapshot.masses.clone());
        let points: Vec<[f64; D]> = points.iter().map(|p| domain.wrapped(&sph::array(|k| p[k]))).collect();
        if scene.input.other_types == OtherTypes::Drop {
            file.species.retain(|s| s.part_type == 0);
        }
        Ok(Some(Self {
            file,
            domain,
            particle: masses.iter().copied().fold(0.0, f64::max),
            masses,
            kept: (0..points.len()).collect(),
            points,
            replaced: Vec::new(),
            beyond: 0.0,
            notes,
            off: None,
            is_refined: false,
            is_pure: false,
        }))
    }

    fn made(&self) -> usize {
        self.replaced.iter().map(|r| r.1).sum()
    }

    /// Particles of the result.
    pub fn count(&self) -> usize {
        self.kept.len() + self.made()
    }

    pub fn units(&self) -> UnitSystem {
        self.file.header.units
    }

    fn total(&self) -> f64 {
        self.masses.iter().sum()
    }

    /// n* = rho / m* by itself, not by the number of particles.
    pub fn target<'a>(&self, target: Target<'a, D>) -> Target<'a, D> {
        let count = self.count();
        Target { count, resolution_integral: count as f64 * self.particle / self.total(), ..target }
    }

    /// What is probably not meant.
    pub fn doubt(&self) -> Option<String> {
        let text = "refine changes nothing: no particle is where one would give way to others; check `refine.center`, `radius` and `factor` against \
                    the places and masses of the snapshot (`sph-prep inspect`)";
        if self.is_refined && self.replaced.is_empty() {
            return Some(text.to_owned());
        }
        (self.beyond > MUCH_BEYOND * self.total()).then(|| {
            format!(
                "refine replaces particles with {:.0} % of the mass though they are beyond the shell, since their masses are not those of a snapshot with \
                 equal ones; state `refine.particle_mass`, of those that are to stay, or `particles` to place all of them anew",
                100.0 * self.beyond / self.total()
            )
        })
    }

    /// What is done to the snapshot, in place of what is done to others.
    pub fn change(&self, plan: &mut Plan, scene: &Scene) {
        plan.stages = if self.replaced.is_empty() { Vec::new() } else { vec![WVT] };
        plan.wvt_iterations = scene.wvt.iterations.unwrap_or(ITERATIONS[0]);
        (plan.polish, plan.splittings, plan.evaluations, plan.balance) = (Polish::None, 0, 0, 0);
        let why = match self.is_refined {
            true => "particles far from the sphere stay as they are, and those about it are relaxed against them",
            false => "all particles stay as they are",
        };
        plan.left_out = vec![LeftOut { what: "seeding and polish".into(), why: why.into() }];
    }

    /// Kept particles in their order, and then the others, relaxed.
    ///
    /// # Errors
    /// An interrupt that is to leave nothing.
    pub fn place(&mut self, setting: &Setting<'_, D>, plan: &Plan, length: f64) -> Result<Placed<D>> {
        let (target, neighbors) = (&setting.target, setting.scene.kernel_neighbors(D));
        let points: Vec<[f64; D]> = self.points.iter().map(|p| p.map(|x| x / length)).collect();
        let mut densities = vec![None; points.len()];
        // By what they weigh, which is not quite what they should there.
        let own = |i: usize| target.density.value(&points[i]) * self.total() / self.masses[i];
        self.kept.iter().for_each(|&i| densities[i] = Some(own(i)));
        let stays: Vec<bool> = densities.iter().map(Option::is_some).collect();
        // New particles are where those were that they replace: in what is nearest to them.
        let (base, taken) = (|x: &[f64; D]| target.number_density(x), |_: &[f64; D], nearest: usize| stays[nearest]);
        let free = FreeSpace::new((&points, densities), target.domain, &base, &taken)?;
        let count = self.count();
        let among = Target {
            largest_spacing: target.largest_spacing,
            ..Target::of_equal_masses(target.domain, &free, count, count as f64)
        };
        let mut all: Vec<[f64; D]> = self.kept.iter().map(|&i| points[i]).collect();
        for &(i, count) in &self.replaced {
            let spacing = (count as f64).powf(1.0 / D as f64) * target.spacing(target.number_density(&points[i]));
            all.extend(family(&among, &points[i], spacing, neighbors, count));
        }
        let held: Vec<bool> = (0..all.len()).map(|i| i < self.kept.len()).collect();
        let positions: Positions<D> = std::array::from_fn(|k| all.iter().map(|x| x[k]).collect());
        let setting = Setting::new(setting.scene, among, None, setting.control);
        let Candidate { mut placed, masses, sums, .. } = self.nearest(&setting, (plan, target), &positions, &held)?;
        self.center(target, &mut placed.particles.positions, &masses, length);
        if !self.replaced.is_empty() {
            self.off = sums.off(&setting, target, &placed.particles.positions, &masses);
        }
        placed.particles.masses = Some(masses);
        placed.notes.extend(self.notes.iter().cloned());
        Ok(placed)
    }

    /// Of as many iterations as the scene says, or of several numbers, that whose sums are nearest to the density.
    fn nearest(
        &self,
        setting: &Setting<'_, D>,
        (plan, target): (&Plan, &Target<'_, D>),
        positions: &Positions<D>,
        held: &[bool],
    ) -> Result<Candidate<D>> {
        let stated = setting.scene.wvt.iterations.is_some() || self.replaced.is_empty();
        let numbers = if stated { &[plan.wvt_iterations][..] } else { &ITERATIONS };
        let mut best: Option<Candidate<D>> = None;
        for &iterations in numbers {
            let plan = Plan { wvt_iterations: iterations, ..plan.clone() };
            let placed = setting.settled(&plan, positions.clone(), (held, false))?;
            let places = &placed.particles.positions;
            let sums = Sums::new((self.kept.len(), self.count()), setting, target, places);
            let masses = self.trimmed(setting, target, (places, self.masses_of(target, places)), &sums);
            let off = if stated { None } else { sums.off(setting, target, places, &masses) };
            let is_cut = placed.stop.is_cut();
            if best.as_ref().is_none_or(|b| off.zip(b.off).is_some_and(|(new, old)| new < old)) {
                best = Some(Candidate { placed, masses, sums, off });
            }
            if is_cut {
                break;
            }
        }
        best.ok_or_else(|| Error::Numeric { stage: "relaxation", problem: "has no result".into() })
    }

    /// Masses of particles that stay, and of the others by the density at their places.
    fn masses_of(&self, target: &Target<'_, D>, positions: &Positions<D>) -> Vec<f64> {
        let total = self.total();
        let share = (total - self.kept.iter().map(|&i| self.masses[i]).sum::<f64>()) / total;
        let weight = |i: usize| {
            let (x, parent) = (at(positions, i), target.domain.center());
            let density = target.number_density(&x);
            if density > 0.0 { target.density.value(&x) / density } else { target.density.value(&parent) }
        };
        let weights: Vec<f64> = (self.kept.len()..self.count()).map(weight).collect();
        let sum: f64 = weights.iter().sum();
        let made = weights.iter().map(|w| w / sum * share);
        self.kept.iter().map(|&i| self.masses[i] / total).chain(made).collect()
    }

    /// Masses of which those of the new particles are changed a little, with the same total, for the sake of the summed density. Particles that
    /// see vacuum keep theirs.
    fn trimmed(
        &self,
        setting: &Setting<'_, D>,
        target: &Target<'_, D>,
        (positions, mut masses): (&Positions<D>, Vec<f64>),
        sums: &Sums,
    ) -> Vec<f64> {
        if self.replaced.is_empty() {
            return masses;
        }
        let first = self.kept.len();
        let own = masses[first..].to_vec();
        let share: f64 = own.iter().sum();
        for _ in 0..TRIMS {
            let summed = sums.summed(setting, target, positions, &masses);
            for (j, wanted) in sums.wanted.iter().enumerate() {
                let Some(wanted) = wanted else { continue };
                let ratio = (wanted / summed[j]).clamp(1.0 - TRIM, 1.0 + TRIM);
                masses[first + j] = (masses[first + j] * ratio).clamp((1.0 - TRIM) * own[j], (1.0 + TRIM) * own[j]);
            }
            let sum: f64 = masses[first..].iter().sum();
            masses[first..].iter_mut().for_each(|m| *m *= share / sum);
        }
        masses
    }

    /// Moves the new particles by what their center of mass is off, where that has a meaning: all alike, but for those that would leave the
    /// matter.
    fn center(&self, target: &Target<'_, D>, positions: &mut Positions<D>, masses: &[f64], length: f64) {
        let (total, first) = (self.total(), self.kept.len());
        let mut stays = vec![false; self.masses.len()];
        self.kept.iter().for_each(|&i| stays[i] = true);
        let missing: [f64; D] = sph::array(|k| {
            let replaced = (0..self.masses.len()).filter(|i| !stays[*i]);
            let old: f64 = replaced.map(|i| self.masses[i] / total * self.points[i][k] / length).sum();
            let new: f64 = (first..masses.len()).map(|i| masses[i] * positions[k][i]).sum();
            if self.domain.axes[k] == Axis::Periodic { 0.0 } else { old - new }
        });
        let mut moving: Vec<usize> = (first..masses.len()).collect();
        for _ in 0..=moving.len() {
            let mass: f64 = moving.iter().map(|&i| masses[i]).sum();
            let moved = |i: usize| sph::array(|k| positions[k][i] + missing[k] / mass);
            let left: Vec<usize> = moving.iter().copied().filter(|&i| target.admits(&moved(i))).collect();
            if left.len() < moving.len() {
                moving = left;
                continue;
            }
            let places: Vec<[f64; D]> = moving.iter().map(|&i| moved(i)).collect();
            for (&i, x) in moving.iter().zip(&places) {
                (0..D).for_each(|k| positions[k][i] = x[k]);
            }
            return;
        }
    }

    /// Puts the snapshot in the place of the file that was `made` of its field, with the new particles.
    ///
    /// # Errors
    /// Identifiers that go beyond 64 bits.
    pub fn rewrite(
        &self,
        scene: &Scene,
        prepared: &Prepared<D>,
        places: &Positions<D>,
        (made, report): (&mut ParticleFile, &mut Report),
    ) -> Result<()> {
        let first = self.kept.len();
        let own: Positions<D> = std::array::from_fn(|k| places[k][first..].to_vec());
        let units = self.units();
        let mut masses = Vec::new();
        let replaced: f64 = self.total() - self.kept.iter().map(|&i| self.masses[i]).sum::<f64>();
        if let Some(column) = made.species[0].table.column(names::MASSES) {
            masses = (first..self.count()).map(|i| column.values.get(i)).collect();
            let sum: f64 = masses.iter().sum();
            masses.iter_mut().for_each(|m| *m *= replaced / sum);
        }
        let carried = prepared.source.carried.iter().map(|f| columns::column(f.as_ref(), &own, &units)).collect();
        let parents: Vec<usize> = self.replaced.iter().flat_map(|&(i, count)| vec![i; count]).collect();
        let positions = (0..parents.len()).flat_map(|i| {
            let x = self.domain.wrapped(&at(&own, i).map(|x| x * prepared.length));
            x.into_iter().collect::<Vec<f64>>()
        });
        let replacement = Replacement {
            file: &self.file,
            kept: &self.kept,
            parents: &parents,
            positions: positions.collect(),
            masses,
            carried,
            sums: &made.species[0].table,
            double: scene.output.double_precision || is_double(&self.file),
        };
        let (mut file, conserved) = replacement.file()?;
        self.enclose(&mut file);
        file.header.provenance = std::mem::take(&mut made.header.provenance);
        if let Some(target) = made.species[0].table.column(names::TARGET_DENSITY) {
            let gas = file.species.iter_mut().find(|s| s.part_type == 0 && s.table.count == target.values.len());
            gas.into_iter().for_each(|gas| gas.table.columns.push(target.clone()));
        }
        if let Some(name) = scene.output.units.as_deref().filter(|_| !self.is_refined) {
            let wanted = system_of("output.units", name)?;
            match self.is_pure {
                // Numbers without units are written as they stand.
                true => file.header.units = wanted,
                false if wanted != file.header.units => file.change_units(wanted),
                false => {}
            }
        }
        *made = file;
        tell_of_columns(&made.species, report);
        let others = conserved
            .as_ref()
            .map(|c| format!("the new particles have the totals of those that they replace; {}", c.describe()));
        report.notes.extend(others);
        report.renewed = self.off;
        report.snapshot.iter_mut().for_each(|s| s.conserved.clone_from(&conserved));
        Ok(())
    }
}

impl<const D: usize> Refining<D> {
    /// The verdict on the result: that on particles that stay has no remedies, which are all of placing them.
    pub fn verdict(&self, report: &Report) -> Vec<Finding> {
        let mut verdict = verdict_on(report);
        if !self.is_refined {
            for finding in verdict.iter_mut().filter(|f| f.grade != Grade::Good) {
                finding.text.truncate(finding.text.find(';').unwrap_or(finding.text.len()));
            }
        }
        verdict
    }

    /// States the box of a snapshot whose coordinates are not from the corner on, as isolated bodies have them.
    fn enclose(&self, file: &mut ParticleFile) {
        let header = &mut file.header;
        let ends = |k: usize| {
            self.points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (x[k].min(lo), x[k].max(hi)))
        };
        let is_held = |k: usize| {
            header.periodic[k] || {
                let (lo, hi) = ends(k);
                lo >= 0.0 && hi < header.box_size[k]
            }
        };
        if header.box_corner.is_some() || (0..D).all(is_held) {
            return;
        }
        let mut corner = [0.0; 3];
        for k in (0..D).filter(|&k| !header.periodic[k]) {
            let (lo, hi) = ends(k);
            header.box_size[k] = header.box_size[k].max(2.0 * (hi - lo));
            // A box about the origin where that holds all.
            let half = 0.5 * header.box_size[k];
            corner[k] = if lo > -half && hi < half { -half } else { 0.5 * (lo + hi) - half };
        }
        header.box_corner = Some(corner);
    }
}

/// Particles that stay, and those that give way with how many there are in the place of each; `mass` is what a particle should have.
fn chosen<const D: usize>(
    points: &[[f64; D]],
    masses: &[f64],
    mass: impl Fn(&[f64; D]) -> f64,
) -> Result<(Vec<usize>, Vec<(usize, usize)>)> {
    let shares: Vec<f64> = points.iter().zip(masses).map(|(x, m)| m / mass(x)).collect();
    let stays = |s: f64| !(s >= TOLERATED || s <= 1.0 / TOLERATED);
    let places: Positions<D> = std::array::from_fn(|k| points.iter().map(|x| x[k]).collect());
    let (mut sum, mut taken, mut replaced) = (0.0_f64, 0.0_f64, Vec::new());
    for &i in Tree::build(&places).order() {
        let share = shares[i as usize];
        if stays(share) {
            continue;
        }
        sum += share;
        if !(sum < f64::from(u32::MAX) / 2.0) {
            let problem = format!(
                "makes {sum:.3e} particles and more; choose a smaller factor or radius, or state refine.particle_mass"
            );
            return Err(Error::scene("refine.factor", problem));
        }
        let next = (sum + 0.5).floor();
        replaced.push((i as usize, (next - taken) as usize));
        taken = next;
    }
    if taken == 0.0 {
        return Ok(((0..points.len()).collect(), Vec::new()));
    }
    Ok(((0..points.len()).filter(|&i| stays(shares[i])).collect(), replaced))
}

/// What would change particles that are to stay as they are, with whether the scene states it.
fn changing(scene: &Scene) -> Vec<(&'static str, bool)> {
    vec![
        ("domain", scene.domain.has_extent()),
        ("resolution", scene.resolution.is_some()),
        ("seeding", scene.seeding.is_some()),
        ("order", scene.order.is_some()),
        ("polish", scene.polish.is_some_and(|p| p != Polish::None)),
        ("balance", scene.balance.is_on()),
        ("certify", scene.certify.is_some()),
        ("settle", scene.settle.is_some()),
        ("trim_masses", scene.trim_masses.is_some()),
        ("checkpoint", !scene.checkpoint.is_default()),
        ("fields", !scene.fields.is_empty()),
        ("turbulence", scene.turbulence.is_some()),
        ("displacement", scene.displacement.is_some()),
        ("motion", scene.motion != Motion::default()),
        ("thermal.internal_energy", scene.thermal.internal_energy.is_some()),
        ("collisionless", scene.collisionless.is_some()),
        ("dust", scene.dust.is_some()),
        ("gravity_of", !scene.gravity_of.is_empty()),
        ("material", !scene.material.is_empty()),
        ("walls", scene.walls.is_some()),
        ("input.factor", scene.input.factor.is_some()),
        ("input.core", scene.input.core.is_some()),
        ("input.others", scene.input.others.is_some()),
        ("output.origin", scene.output.origin.is_some()),
    ]
}

/// Refuses what would change particles far from the sphere.
fn refuse_what_changes_all(scene: &Scene, units: &UnitSystem) -> Result<()> {
    let in_others = ("output.units", !same_units(scene, units)?);
    let bounded = ("domain", !scene.domain.boundary.is_empty());
    match changing(scene).iter().chain([&bounded, &in_others]).find(|(_, is_given)| *is_given) {
        None => Ok(()),
        Some((key, _)) => {
            let problem = "would change particles far from the sphere, which stay as they are; leave it out, or state `particles` to place all of \
                           the snapshot anew";
            Err(Error::scene(*key, problem))
        }
    }
}

/// Whether the output is in `units`, as far as the scene says.
fn same_units(scene: &Scene, units: &UnitSystem) -> Result<bool> {
    Ok(scene.output.units.as_deref().map_or(Ok(*units), |name| system_of("output.units", name))? == *units)
}

/// What no field carries is written as well: kept particles have it as it was, new ones from a neighbor.
fn tell_of_columns(species: &[Species], report: &mut Report) {
    let Some(gas) = species.iter().find(|s| s.part_type == 0) else { return };
    let is_there = |name: &str| gas.table.column(name).is_some();
    let quoted = |note: &String| note.strip_prefix('\'').and_then(|rest| rest.split('\'').next()).is_some_and(is_there);
    report.notes.retain(|note| !(note.contains(LEFT_OUT) && quoted(note)));
    for variable in report.variables.iter_mut().filter(|v| v.written_as.is_none() && is_there(&v.name)) {
        variable.written_as = Some(variable.name.clone());
        variable.note = Some("is as it was of particles that stay, and a neighbor's of new ones".into());
    }
}

/// Whether a run has refined a snapshot of which most stays as it is.
pub(super) fn refines_a_snapshot(scene: &Scene, report: &Report) -> bool {
    scene.input.keeps_particles() || scene.refine.is_some() && scene.particles.is_none() && report.snapshot.is_some()
}
