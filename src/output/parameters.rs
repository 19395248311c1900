//! Parameter files with which a code starts and runs an initial condition as it is.

use crate::codes::TargetCode;
use crate::error::{Error, Result};
use sph::geometry::distance;
use sph_formats::common::particle_names as names;
use sph_formats::model::SOFTENING_OVER_SPACING;
use sph_formats::{ParticleFile, ParticleTable};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Dynamical or crossing times that the run takes, and between two snapshots.
const END: f64 = 10.0;
const SNAPSHOT: f64 = 1.0;
/// Largest time step in dynamical times.
const LARGEST_STEP: f64 = 0.05;
/// Smoothing lengths may grow to this part of the box.
const LARGEST_SMOOTHING: f64 = 0.1;
const GAMMA: f64 = 5.0 / 3.0;

/// What the files say.
struct Facts<'a> {
    code: TargetCode,
    file: &'a ParticleFile,
    /// Name of the initial condition, and without its extension.
    name: String,
    stem: String,
    gravity: bool,
    /// Dynamical time of a body that holds itself, else the time in which sound crosses the box, and which it is.
    time: f64,
    time_is: &'static str,
    softening: f64,
    /// Type of a point mass, and its Plummer-equivalent length.
    point: Option<(u8, f64)>,
}

/// In the first line of each file.
const WRITTEN_BY: &str = "written by sph-prep";

/// Where the files are to be, beside `path`; none for codes whose sheet knows none.
fn places(code: TargetCode, path: &Path) -> Vec<PathBuf> {
    let stem = stem(path);
    let names = match code.sheet.name {
        "swift" => vec![format!("{stem}.yml")],
        "gadget4" => vec![format!("{stem}.param"), format!("{stem}.Config.sh")],
        "phantom" => vec![format!("{}.in", prefix(&stem))],
        "sph-exa" => vec![format!("{stem}.sh")],
        _ => Vec::new(),
    };
    names.into_iter().map(|name| path.with_file_name(name)).collect()
}

fn stem(path: &Path) -> String {
    path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

/// What Phantom calls the run of a dump `PREFIX_00000.tmp`.
fn prefix(stem: &str) -> &str {
    stem.split('_').next().unwrap_or(stem)
}

/// Before the work: a file that is there already, and that was not written here, is somebody's scene or setup.
///
/// # Errors
/// Its name.
pub(crate) fn refuse_overwriting(code: TargetCode, path: &Path) -> Result<()> {
    let is_foreign = |place: &&PathBuf| {
        let first = std::fs::read(place).ok().map(|bytes| bytes.split(|b| *b == b'\n').next().map(<[u8]>::to_vec));
        first.is_some_and(|line| !String::from_utf8_lossy(&line.unwrap_or_default()).contains(WRITTEN_BY))
    };
    match places(code, path).iter().find(is_foreign) {
        None => Ok(()),
        Some(place) => Err(Error::scene(
            "output.parameters",
            format!("would replace '{}', which was not {WRITTEN_BY}; move it, or name another output", place.display()),
        )),
    }
}

/// The files beside `path`, each with its text: none is written.
///
/// # Errors
/// A file without gas.
pub(crate) fn files(code: TargetCode, path: &Path, file: &ParticleFile) -> Result<Vec<(PathBuf, String)>> {
    let facts = Facts::new(code, path, file)?;
    let texts = match code.sheet.name {
        "swift" => vec![facts.swift()],
        "gadget4" => vec![facts.gadget4(), facts.gadget4_config()],
        "phantom" => vec![facts.phantom()],
        "sph-exa" => vec![facts.sph_exa()],
        _ => Vec::new(),
    };
    Ok(places(code, path).into_iter().zip(texts).collect())
}

impl<'a> Facts<'a> {
    fn new(code: TargetCode, path: &Path, file: &'a ParticleFile) -> Result<Self> {
        let missing =
            |what: &str| Error::scene("output.parameters", format!("need {what}, which the file does not have"));
        let gas = file.species.iter().find(|s| s.part_type == 0).ok_or_else(|| missing("gas particles"))?;
        let name = path.file_name().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let stem = stem(path);
        let lacking = || if gas.table.column(names::MASSES).is_none() { names::MASSES } else { names::DENSITY };
        let smallest = gas.table.smallest_spacing(file.header.dimension).ok_or_else(|| missing(lacking()))?;
        let gravity = is_isolated(file) && file.header.units != sph_formats::UnitSystem::CODE;
        let (time, time_is) = if gravity {
            (dynamical_time(code, file, &gas.table), "dynamical times sqrt(R^3/(G M))")
        } else {
            (crossing_time(file, &gas.table), "times in which sound crosses the box")
        };
        let softened = |s: &sph_formats::Species| {
            let radius = s.table.column(names::SOFTENING_RADIUS)?.values.range().1;
            (radius > 0.0).then_some((s.part_type, radius / code.sheet.softening.radius_over_plummer()))
        };
        let point = file.species.iter().find_map(softened);
        Ok(Self { code, file, name, stem, gravity, time, time_is, softening: SOFTENING_OVER_SPACING * smallest, point })
    }

    fn head(&self, comment: &str, run: &str) -> String {
        let mut text = String::new();
        let code = self.code.describe(self.file.header.dimension);
        for line in [
            format!("{} for {code} ({WRITTEN_BY})", self.name),
            format!("run it by: {run}"),
            format!("units and box are those of the file; the end is at {END} {}", self.time_is),
            format!(
                "softening is {SOFTENING_OVER_SPACING} times the smallest spacing, with which pressure and gravity are resolved alike"
            ),
        ] {
            let _ = writeln!(text, "{comment} {line}");
        }
        text
    }

    fn swift(&self) -> String {
        let u = &self.file.header.units;
        let gravity = if self.gravity { " --self-gravity" } else { "" };
        let largest_box = self.file.header.box_size.iter().copied().fold(0.0, f64::max);
        let mut text = self.head("#", &format!("swift --hydro{gravity} --threads=N {}.yml", self.stem));
        let end = END * self.time;
        let periodic = i32::from(self.file.header.periodic.contains(&true));
        let _ = write!(
            text,
            "InternalUnitSystem:
  UnitMass_in_cgs: {:e}
  UnitLength_in_cgs: {:e}
  UnitVelocity_in_cgs: {:e}
  UnitCurrent_in_cgs: 1
  UnitTemp_in_cgs: {:e}
TimeIntegration:
  time_begin: 0
  time_end: {end:e}
  dt_min: {:e}
  dt_max: {:e}
Snapshots:
  basename: {}_snap
  time_first: 0
  delta_time: {:e}
Statistics:
  delta_time: {:e}
  time_first: 0
Scheduler:
  max_top_level_cells: 16
InitialConditions:
  file_name: {}
  periodic: {periodic}
SPH:
  resolution_eta: {}
  CFL_condition: 0.2
  h_max: {:e}
",
            u.mass,
            u.length,
            u.length / u.time,
            u.temperature,
            1e-10 * end,
            LARGEST_STEP * self.time,
            self.stem,
            SNAPSHOT * self.time,
            0.1 * SNAPSHOT * self.time,
            self.name,
            self.code.setting(),
            LARGEST_SMOOTHING * largest_box,
        );
        if self.gravity {
            if self.code.scheme.name == "sphenix" {
                text += "  # A body at rest has steep gradients of energy at its surface, which artificial conduction would smooth:
  # it raises the entropy there by nearly a half in a dynamical time. Leave these out where mixing matters.
  diffusion_beta: 0
  diffusion_alpha: 0
  diffusion_alpha_max: 0
  diffusion_alpha_min: 0
";
            }
            let _ = write!(
                text,
                "Gravity:
  eta: 0.025
  MAC: geometric
  theta_cr: 0.7
  epsilon_fmm: 0.001
  use_tree_below_softening: 1
  max_physical_baryon_softening: {:e}
",
                self.softening
            );
            if self.file.species.iter().any(|s| s.part_type == 1) {
                let own = self.point.filter(|p| p.0 == 1).map_or(self.softening, |(_, length)| length);
                let _ = writeln!(text, "  max_physical_DM_softening: {own:e}");
            }
        }
        text += &self.swift_materials();
        text
    }

    /// Equations of state of the materials that occur.
    fn swift_materials(&self) -> String {
        let tables = self.file.species.iter().filter(|s| s.part_type == 0).map(|s| &s.table);
        let ids = tables
            .filter_map(|t| t.column(names::MATERIAL_IDS))
            .flat_map(|c| (0..c.values.len()).map(|i| c.values.get(i)));
        let ids: std::collections::BTreeSet<i64> = ids.map(|id| id as i64).collect();
        let known = |id: &i64| match id {
            0 => Some("idg_def"),
            100 => Some("Til_iron"),
            101 => Some("Til_granite"),
            102 => Some("Til_water"),
            103 => Some("Til_basalt"),
            104 => Some("Til_ice"),
            _ => None,
        };
        if ids.is_empty() {
            return String::new();
        }
        let mut text = "EoS:\n".to_owned();
        for id in &ids {
            let _ = match known(id) {
                Some(name) => writeln!(text, "  planetary_use_{name}: 1"),
                None => {
                    writeln!(text, "  # material {id} occurs: switch its equation of state on here, with its table")
                }
            };
        }
        text
    }

    fn gadget4(&self) -> String {
        let u = &self.file.header.units;
        let end = END * self.time;
        let mut text =
            self.head("%", &format!("mpirun -np N Gadget4 {}.param, built with {}.Config.sh", self.stem, self.stem));
        let box_size = if is_isolated(self.file) { 0.0 } else { self.file.header.box_size[0] };
        let _ = write!(
            text,
            "InitCondFile {}
OutputDir ./{}_output
SnapshotFileBase snapshot
OutputListFilename none
ICFormat 3
SnapFormat 3
TimeLimitCPU 86400
CpuTimeBetRestartFile 7200
MaxMemSize 2000
TimeBegin 0
TimeMax {end:e}
ComovingIntegrationOn 0
Omega0 0
OmegaLambda 0
OmegaBaryon 0
HubbleParam 1
Hubble 0
BoxSize {box_size:e}
OutputListOn 0
TimeBetSnapshot {:e}
TimeOfFirstSnapshot 0
TimeBetStatistics {:e}
NumFilesPerSnapshot 1
MaxFilesWithConcurrentIO 1
ErrTolIntAccuracy 0.025
CourantFac 0.15
MaxSizeTimestep {:e}
MinSizeTimestep 0
TypeOfOpeningCriterion 1
ErrTolTheta 0.5
ErrTolThetaMax 0.9
ErrTolForceAcc 0.0025
TopNodeFactor 2.5
ActivePartFracForNewDomainDecomp 0.01
DesNumNgb {}
MaxNumNgbDeviation 0.1
UnitLength_in_cm {:e}
UnitMass_in_g {:e}
UnitVelocity_in_cm_per_s {:e}
GravityConstantInternal 0
ArtBulkViscConst 1
MinEgySpec 0
InitGasTemp 0
",
            self.stem,
            self.stem,
            SNAPSHOT * self.time,
            0.1 * SNAPSHOT * self.time,
            LARGEST_STEP * self.time,
            self.code.setting(),
            u.length,
            u.mass,
            u.length / u.time,
        );
        for class in 0..6 {
            let (own, of_type) = match self.point {
                Some((t, length)) if class == t => (length, class),
                _ => (self.softening, 0),
            };
            let _ = writeln!(text, "SofteningComovingClass{class} {own:e}");
            let _ = writeln!(text, "SofteningMaxPhysClass{class} {own:e}");
            let _ = writeln!(text, "SofteningClassOfPartType{class} {of_type}");
        }
        text
    }

    fn gadget4_config(&self) -> String {
        let mut text = self.head("#", &format!("make CONFIG={}.Config.sh", self.stem));
        text += "NTYPES=6\nDOUBLEPRECISION=1\n";
        text += match self.code.kernel {
            sph::kernel::KernelName::WendlandC2 => "WENDLAND_C2_KERNEL\n",
            sph::kernel::KernelName::WendlandC4 => "WENDLAND_C4_KERNEL\n",
            sph::kernel::KernelName::WendlandC6 => "WENDLAND_C6_KERNEL\n",
            _ => "CUBIC_SPLINE_KERNEL\n",
        };
        text += if self.gravity { "SELFGRAVITY\n" } else { "" };
        text += if is_isolated(self.file) { "" } else { "PERIODIC\n" };
        text
    }

    fn phantom(&self) -> String {
        let prefix = prefix(&self.stem);
        let mut text = self.head("#", &format!("phantom {prefix}.in"));
        let row = |text: &mut String, key: &str, value: String, what: &str| {
            let _ = writeln!(text, "{key:>20} = {value:>12}    ! {what}");
        };
        let number = |v: f64| format!("{v:.6E}");
        row(&mut text, "logfile", format!("{prefix}01.log"), "file to which output is directed");
        row(&mut text, "dumpfile", self.name.clone(), "dump file to start from");
        row(&mut text, "tmax", number(END * self.time), "end time");
        row(&mut text, "dtmax", number(SNAPSHOT * self.time), "time between dumps");
        for (key, value, what) in PHANTOM {
            row(&mut text, key, (*value).to_owned(), what);
        }
        row(&mut text, "hfact", number(self.code.setting()), "h in units of particle spacing [h = hfact(m/rho)^(1/3)]");
        text
    }

    /// A command: the code has no parameter file, and reads what else it needs from its input. Times are real numbers, for it
    /// takes integers as numbers of steps.
    fn sph_exa(&self) -> String {
        let head = self.head("#", &format!("sh {}.sh [OPTION ...], where sphexa is on the path", self.stem));
        format!(
            "#!/bin/sh\n{head}exec sphexa --init {} --prop {} -s {:e} -w {:e} -f x,y,z,vx,vy,vz,h,m,rho,temp -o {} \"$@\"\n",
            quoted(&self.name),
            self.code.scheme.name,
            END * self.time,
            SNAPSHOT * self.time,
            quoted(&format!("{}_snap.h5", self.stem)),
        )
    }
}

/// A word of a shell's command, whatever it holds.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// Options without which Phantom writes the file anew and stops, at its defaults.
const PHANTOM: &[(&str, &str, &str)] = &[
    ("nmax", "-1", "maximum number of timesteps (0=just get derivs and stop)"),
    ("nout", "-1", "write dumpfile every n dtmax (-ve=ignore)"),
    ("twallmax", "000:00", "maximum wall time (hhh:mm, 000:00=ignore)"),
    ("nfulldump", "1", "full dump every n dumps"),
    ("iverbose", "0", "verboseness of log (-1=quiet 0=default 1=allsteps 2=debug 5=max)"),
    ("C_cour", "0.300", "Courant factor"),
    ("C_force", "0.250", "dt_force factor"),
    ("tolv", "1.000E-02", "tolerance on v iterations in timestepping"),
    ("tree_accuracy", "0.500", "tree opening criterion (0.0-1.0)"),
    ("tolh", "1.000E-04", "tolerance on h-rho iterations"),
    ("alpha", "0.000", "MINIMUM shock viscosity parameter"),
    ("alphamax", "1.000", "MAXIMUM shock viscosity parameter"),
    ("beta", "2.000", "non-linear shock viscosity parameter"),
    ("alphau", "1.000", "shock conductivity parameter"),
    ("ieos", "2", "eqn of state (1=isoth;2=adiab;3=locally iso;8=barotropic)"),
    ("mu", "2.381", "mean molecular weight"),
    ("ipdv_heating", "1", "heating from PdV work (0=off, 1=on)"),
    ("ishock_heating", "1", "shock heating (0=off, 1=on)"),
    ("icooling", "0", "cooling function (0=off)"),
    ("isink_potential", "0", "sink potential (0=1/r,1=surf)"),
    ("icreate_sinks", "0", "allow automatic sink particle creation"),
    ("h_soft_sinksink", "0.000", "softening length between sink particles"),
    ("f_acc", "0.800", "particles < f_acc*h_acc accreted without checks"),
    ("iexternalforce", "0", "external force (0=none)"),
    ("irealvisc", "0", "physical viscosity type (0=none)"),
    ("shearparam", "0.100", "magnitude of shear viscosity"),
    ("bulkvisc", "0.000", "magnitude of bulk viscosity"),
    ("rkill", "-1.000", "deactivate particles outside this radius (<0 is off)"),
    ("curlv", "F", "output curl v in dump files"),
    ("track_lum", "F", "write du/dt to dump files"),
    ("gw", "F", "calculate gravitational wave strain"),
];

fn is_isolated(file: &ParticleFile) -> bool {
    file.header.periodic == [false; 3] && file.header.dimension == 3
}

/// sqrt(R^3/(G M)) in the file's units, R the distance of the farthest gas particle from the middle of the box.
fn dynamical_time(code: TargetCode, file: &ParticleFile, gas: &ParticleTable) -> f64 {
    let u = &file.header.units;
    let constant = code.sheet.gravity * u.mass * u.time.powi(2) / u.length.powi(3);
    let corner = file.header.box_corner.unwrap_or_default();
    let middle = std::array::from_fn(|k| corner[k] + 0.5 * file.header.box_size[k]);
    let place = |c: &sph_formats::Column, i: usize| std::array::from_fn(|k| c.values.get(3 * i + k));
    let radius = gas
        .column(names::COORDINATES)
        .map_or(0.0, |c| (0..gas.count).map(|i| distance::<3>(&place(c, i), &middle)).fold(0.0, f64::max));
    let mass: f64 = gas.column(names::MASSES).map_or(0.0, |c| (0..gas.count).map(|i| c.values.get(i)).sum());
    (radius.powi(3) / (constant * mass)).sqrt()
}

/// Longest edge over the median speed of sound.
fn crossing_time(file: &ParticleFile, gas: &ParticleTable) -> f64 {
    let mut energy: Vec<f64> =
        gas.column(names::INTERNAL_ENERGY).map_or_else(Vec::new, |c| (0..gas.count).map(|i| c.values.get(i)).collect());
    energy.sort_unstable_by(f64::total_cmp);
    let median = energy.get(energy.len() / 2).copied().filter(|u| *u > 0.0).unwrap_or(1.0);
    let edge = file.header.box_size.iter().copied().fold(0.0, f64::max);
    edge / (GAMMA * (GAMMA - 1.0) * median).sqrt()
}
