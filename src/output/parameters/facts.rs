//! The data from which the parameter files of all codes are written.

use crate::codes::TargetCode;
use crate::error::{Error, Result};
use crate::scene::Scene;
use sph::geometry::distance;
use sph_formats::common::particle_names as names;
use sph_formats::model::SOFTENING_OVER_SPACING;
use sph_formats::{ParticleFile, ParticleTable, UnitSystem};
use std::fmt::Write as _;
use std::path::Path;

/// Dynamical or crossing times that the run takes, and between two snapshots.
pub(super) const END: f64 = 10.0;
pub(super) const SNAPSHOT: f64 = 1.0;
/// Share of the particles that a dynamical time is of.
const MOST: f64 = 0.999;
/// Largest time step in dynamical times.
pub(super) const LARGEST_STEP: f64 = 0.05;
/// Smoothing lengths may grow to this part of the box.
pub(super) const LARGEST_SMOOTHING: f64 = 0.1;

/// Masses that differ by more are not the same.
const APART: f64 = 1.001;

/// In the first line of each file.
pub(super) const WRITTEN_BY: &str = "written by sph-prep";

/// What the scene says of the physics beside what is in the file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Physics {
    /// Whether the file's units have a meaning: pure numbers are written as if they were in cgs.
    has_units: bool,
    /// The constant of gravity of pure numbers, where the scene's matter attracts itself.
    of_numbers: Option<f64>,
    /// Bodies attract the gas that are not in the file.
    is_attracted: bool,
    reflects: bool,
    /// A disc is among the bodies, whose gas is sheared.
    has_disc: bool,
    /// The gas feels the gravity of others alone.
    has_light_gas: bool,
    /// A force that is not the particles' own holds the gas, as the scene says, or the balance by default.
    pub in_field: bool,
    /// Particles of dust are among the others.
    has_grains: bool,
    /// The gas comes from a snapshot, which does not say what acts on it.
    pub of_snapshot: bool,
    /// Gas particles that each one of the file stands for: 1, unless the file is but a sample.
    pub stands_for: f64,
}

impl Physics {
    /// Of `scene`, whose input has units or none.
    pub fn of(scene: &Scene, has_units: bool) -> Self {
        Self {
            has_units,
            of_numbers: scene.own_gravity(),
            is_attracted: !scene.gravity_of.is_empty() && scene.bodies.is_empty() && scene.input.others.is_none(),
            reflects: scene.has_walls(),
            has_disc: scene.has_disc(),
            has_light_gas: scene.has_light_gas(),
            in_field: scene.is_in_field(),
            has_grains: scene.has_grains(),
            of_snapshot: false,
            stands_for: 1.0,
        }
    }
}

/// The constant of gravity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Gravity {
    /// In the file's units.
    pub constant: f64,
    /// What the code is to be told; none where it is the constant that it knows.
    pub stated: Option<f64>,
}

/// What a code will not make of a file as the scene means it, each in a sentence, with the remedy where there is one.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Doubts {
    /// At which it stops.
    pub stops: Vec<String>,
    /// With which it goes on.
    pub others: Vec<String>,
}

impl Doubts {
    /// What to say of all of them.
    pub fn texts(&self) -> impl Iterator<Item = &String> {
        self.stops.iter().chain(&self.others)
    }
}

/// What the files say.
pub(super) struct Facts<'a> {
    pub code: TargetCode,
    pub file: &'a ParticleFile,
    pub gas: &'a ParticleTable,
    /// Name of the initial condition, and without its extension.
    pub name: String,
    pub stem: String,
    /// In GADGET's own terms: 1 and 2 are binary, 3 is HDF5.
    pub container: u8,
    /// Of matter that attracts itself.
    pub gravity: Option<Gravity>,
    /// Gravity that the scene has, and the file is started without.
    pub lacks_gravity: bool,
    /// The gas may attract itself: nothing says whether it does, and the file is started without gravity.
    pub may_lack_gravity: bool,
    pub is_attracted: bool,
    /// Matter of the scene attracts itself, in pure numbers.
    pub holds_itself: bool,
    pub reflects: bool,
    pub has_disc: bool,
    /// The gas feels the gravity of others alone, whatever there is of it.
    pub has_light_gas: bool,
    pub in_field: bool,
    pub has_grains: bool,
    /// Gas particles that each of the file's stands for.
    pub stands_for: f64,
    /// Dynamical time of a body that holds itself, else the time in which sound crosses the box, and which it is.
    pub time: f64,
    pub time_is: &'static str,
    pub softening: f64,
    /// Type of a point mass, and its Plummer-equivalent length.
    pub point: Option<(u8, f64)>,
    /// What the code will not make of the file as the scene means it.
    pub doubts: Doubts,
}

/// Without its folder.
pub(super) fn name(path: &Path) -> String {
    path.file_name().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

pub(super) fn stem(path: &Path) -> String {
    path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

/// What Phantom calls the run of a dump `PREFIX_00000.tmp`.
pub(super) fn prefix(stem: &str) -> &str {
    stem.split('_').next().unwrap_or(stem)
}

impl<'a> Facts<'a> {
    /// What a build for fewer than three dimensions needs.
    pub fn dimension_option(&self) -> Option<String> {
        let d = self.file.header.dimension;
        self.code.dimension_option(d).filter(|option| d < 3 && !option.is_empty())
    }

    /// Of a file; without doubts.
    ///
    /// # Errors
    /// A file without gas.
    pub fn new(
        code: TargetCode,
        (path, format): (&Path, Option<&str>),
        file: &'a ParticleFile,
        physics: Physics,
    ) -> Result<Self> {
        let missing =
            |what: &str| Error::scene("output.parameters", format!("need {what}, which the file does not have"));
        let species = file.species.iter().find(|s| s.part_type == 0).ok_or_else(|| missing("gas particles"))?;
        let gas = &species.table;
        let name = name(path);
        let lacking = || if gas.column(names::MASSES).is_none() { names::MASSES } else { names::DENSITY };
        let smallest = gas.smallest_spacing(file.header.dimension).ok_or_else(|| missing(lacking()))?;
        let gravity = Gravity::of(code, file, physics);
        let (time, time_is) = match gravity {
            Some(gravity) => (
                dynamical_time(gravity.constant, file, gas),
                "dynamical times sqrt(R^3/(G M)), R the radius of 99.9 % of the gas particles",
            ),
            None => (crossing_time(file, gas), "times in which sound, with the motion of the gas, crosses the box"),
        };
        let softened = |s: &sph_formats::Species| {
            let radius = s.table.column(names::SOFTENING_RADIUS)?.values.range().1;
            (radius > 0.0).then_some((s.part_type, radius / code.sheet.softening.radius_over_plummer()))
        };
        Ok(Self {
            code,
            file,
            gas,
            name,
            stem: stem(path),
            container: match format {
                Some("gadget-binary-1") => 1,
                Some("gadget-binary") => 2,
                _ => 3,
            },
            gravity,
            lacks_gravity: physics.of_numbers.is_some() && gravity.is_none() && file.header.periodic.contains(&true),
            may_lack_gravity: physics.of_snapshot
                && gravity.is_none()
                && file.header.dimension == 3
                && file.header.periodic == [false; 3],
            is_attracted: physics.is_attracted,
            holds_itself: physics.of_numbers.is_some(),
            reflects: physics.reflects,
            has_disc: physics.has_disc,
            has_light_gas: physics.has_light_gas,
            in_field: physics.in_field,
            has_grains: physics.has_grains,
            stands_for: physics.stands_for,
            time,
            time_is,
            softening: SOFTENING_OVER_SPACING * smallest,
            point: file.species.iter().find_map(softened),
            doubts: Doubts::default(),
        })
    }

    /// The name that GADGET and its kin are told: that of an HDF5 file they complete themselves, and numbers of several files they add to it.
    pub fn told_name(&self) -> &str {
        if self.container == 3 { &self.stem } else { &self.name }
    }

    /// Masses of the particles of all types but point masses, of which there are two kinds at least: the least and the largest where they differ.
    pub fn masses_apart(&self) -> Option<[f64; 2]> {
        let of = |s: &sph_formats::Species| {
            let masses = s.table.column(names::MASSES).filter(|_| !s.table.is_of_points() && s.table.count > 0)?;
            Some(masses.values.range())
        };
        let ranges = || self.file.species.iter().filter_map(of);
        let least = ranges().map(|r| r.0).fold(f64::INFINITY, f64::min);
        let largest = ranges().map(|r| r.1).fold(0.0, f64::max);
        (largest > least * APART && least > 0.0).then_some([least, largest])
    }

    /// Radii of softened point masses, of which the code has one for all: the least and the largest where they differ.
    pub fn softened_apart(&self) -> Option<[f64; 2]> {
        let columns = self.file.species.iter().filter_map(|s| s.table.column(names::SOFTENING_RADIUS));
        let radii = || columns.clone().flat_map(|c| (0..c.values.len()).map(|i| c.values.get(i))).filter(|r| *r > 0.0);
        let (least, largest) = (radii().fold(f64::INFINITY, f64::min), radii().fold(0.0, f64::max));
        (largest > least * (1.0 + 1e-6)).then_some([least, largest])
    }

    pub fn gamma(&self) -> f64 {
        self.file.header.adiabatic_index()
    }

    /// Of the box, along the axes that there are.
    pub fn edges(&self) -> &[f64] {
        &self.file.header.box_size[..self.file.header.dimension]
    }

    /// Lines of GADGET's kin: the Plummer-equivalent length of each `kind` of softening, and which one each type of particles has.
    pub fn softenings(&self, kind: &str) -> String {
        let mut text = String::new();
        for class in 0..6 {
            let (own, of_type) = match self.point {
                Some((t, length)) if class == t => (length, class),
                _ => (self.softening, 0),
            };
            let _ = writeln!(text, "SofteningComoving{kind}{class} {own:e}");
            let _ = writeln!(text, "SofteningMaxPhys{kind}{class} {own:e}");
            let _ = writeln!(text, "Softening{kind}OfPartType{class} {of_type}");
        }
        text
    }

    /// Comments at the beginning of a file: what it is, and how the code is run.
    pub fn head(&self, comment: &str, run: &str) -> String {
        let mut text = String::new();
        let code = self.code.describe(self.file.header.dimension);
        // Phantom and SPH-EXA soften by smoothing lengths.
        let is_told = !["phantom", "sph-exa"].contains(&self.code.sheet.name);
        let softening = self.gravity.filter(|_| is_told).map(|_| {
            format!(
                "softening is {SOFTENING_OVER_SPACING} times the smallest spacing, with which pressure and gravity are resolved alike"
            )
        });
        let lines = [
            format!("{} for {code} ({WRITTEN_BY})", self.name),
            format!("run it by: {run}"),
            format!("units and box are those of the file; the end is at {END} {}", self.time_is),
        ];
        for line in lines.into_iter().chain(softening) {
            let _ = writeln!(text, "{comment} {line}");
        }
        for doubt in self.doubts.texts() {
            let _ = writeln!(text, "{comment} beware: {doubt}");
        }
        text
    }

    /// The reach of the widest kernel, the shortest edge of a periodic box, and how many particles would do, where the edge is shorter
    /// than so many reaches.
    pub fn too_few(&self, reaches: f64) -> Option<(f64, f64, f64)> {
        let header = &self.file.header;
        let reach = self.gas.column(names::SUPPORT_RADIUS)?.values.range().1;
        let least = self.edges().iter().copied().fold(f64::INFINITY, f64::min);
        let part = reaches * reach / least;
        let is_short = header.periodic.contains(&true) && part > 1.0 && part.is_finite();
        let count = self.gas.count as f64 * self.stands_for;
        is_short.then(|| (reach, least, (count * part.powi(header.dimension as i32)).ceil()))
    }
}

impl Gravity {
    /// `None` of matter that does not attract itself, as far as is known: in fewer than three dimensions, in a box without an
    /// outside, and of pure numbers whose scene says nothing of it.
    fn of(code: TargetCode, file: &ParticleFile, physics: Physics) -> Option<Self> {
        if file.header.periodic != [false; 3] || file.header.dimension < 3 {
            return None;
        }
        let u = &file.header.units;
        if physics.has_units || *u != UnitSystem::CODE {
            return Some(Self { constant: code.gravity_in(u), stated: None });
        }
        physics.of_numbers.map(|constant| Self { constant, stated: Some(constant) })
    }
}

/// sqrt(R^3/(G M)) in the file's units, R the distance from the middle of the box within which all but a thousandth of the gas particles are, and M
/// all mass within it: single ones may be far away.
fn dynamical_time(constant: f64, file: &ParticleFile, gas: &ParticleTable) -> f64 {
    let corner = file.header.box_corner.unwrap_or_default();
    let middle = sph::array(|k| corner[k] + 0.5 * file.header.box_size[k]);
    let places = |table: &ParticleTable| -> Vec<f64> {
        let place = |c: &sph_formats::Column, i: usize| sph::array(|k| c.values.get(3 * i + k));
        let x = table.column(names::COORDINATES);
        x.map_or_else(Vec::new, |c| (0..table.count).map(|i| distance::<3>(&place(c, i), &middle)).collect())
    };
    let mut distances = places(gas);
    distances.sort_unstable_by(f64::total_cmp);
    let count = (MOST * distances.len() as f64).ceil() as usize;
    let radius = count.checked_sub(1).map_or(0.0, |last| distances[last]);
    let within = |table: &ParticleTable| -> f64 {
        let masses = table.column(names::MASSES);
        let mass = |i: usize| masses.map_or(0.0, |c| c.values.get(i));
        places(table).into_iter().enumerate().filter(|(_, r)| *r <= radius).map(|(i, _)| mass(i)).sum()
    };
    let mass: f64 = file.species.iter().map(|s| within(&s.table)).sum();
    (radius.powi(3) / (constant * mass)).sqrt()
}

/// Longest edge over the speed of sound of the mean specific energy, since that of a blast is of few particles, together with the speed of the gas about
/// its mean.
fn crossing_time(file: &ParticleFile, gas: &ParticleTable) -> f64 {
    let masses = gas.column(names::MASSES);
    let mass = |i: usize| masses.map_or(1.0, |c| c.values.get(i));
    let total: f64 = (0..gas.count).map(mass).sum();
    let mean = |of: &dyn Fn(usize) -> f64| (0..gas.count).map(|i| mass(i) * of(i)).sum::<f64>() / total;
    let energy = gas.column(names::INTERNAL_ENERGY).map_or(0.0, |c| mean(&|i| c.values.get(i)));
    let motion = gas.column(names::VELOCITIES).map_or(0.0, |c| {
        let along = |k: usize| {
            let v = |i: usize| c.values.get(c.components * i + k);
            let common = mean(&v);
            mean(&|i| (v(i) - common).powi(2))
        };
        (0..c.components).map(along).sum()
    });
    let gamma = file.header.adiabatic_index();
    let square = |energy: f64| gamma * (gamma - 1.0) * energy + motion;
    let known = Some(square(energy)).filter(|v| *v > 0.0 && v.is_finite());
    file.header.box_size.iter().copied().fold(0.0, f64::max) / known.unwrap_or_else(|| square(1.0)).sqrt()
}
