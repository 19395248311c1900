//! Command-line arguments, and how they override the keys of a scene.

use super::choices::{choice, kernel, seeding};
use super::rank_args::{PlanArgs, ranks, threads};
use super::stream_args::{EncodingArgs, ReplicateArgs, SeedArgs};
use crate::compare::DEFAULT;
use crate::error::Result;
use crate::scene::{Scene, parse_count, parse_mapping};
use crate::seeding::Seeding;
use clap::{Parser, Subcommand};
use sph::kernel::KernelName;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sph-prep --in star.nc --out ic.hdf5 -n 100000      a star for SWIFT, GADGET-4, GIZMO
  sph-prep --in profile8.data --out star.vtu         a MESA model, to view in ParaView
  sph-prep --scene box.yaml --out box.hdf5           everything from a scene file
  sph-prep --in grid.nc --density rho --print-scene  the run as a scene, without running it
  sph-prep help scene.domain                         the keys of a scene
  sph-prep inspect grid.nc                           the contents of a file
  sph-prep convert ic.hdf5 ic.vtu                    particles in another format
  sph-prep replicate box.hdf5 --times 8,8,8 --scene star.yaml --out ic.hdf5
                                                     more particles than fit in memory
  sph-prep check ic.hdf5 --for swift                 whether a code accepts the file
  sph-prep run ic.hdf5 --for swift                   whether the gas stays at rest
  sph-prep plot ic.hdf5                              a page of images and figures: ic.html
  sph-prep formats                                   formats that can be read and written
  sph-prep compare --scene box.yaml --out methods    which method suits a scene

Exit codes: 0 success, 1 failure, 2 wrong usage, 3 not converged: the file was written, but the
tolerance was not reached, a region of the target does not have its mass, the run was interrupted
with --on-interrupt write, or a figure is BAD (--strict).";

/// Version, commit and features, each on a line.
const LONG_VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\nbuilt from ",
    env!("SPH_PREP_BUILT_FROM"),
    "\nfeatures: ",
    env!("SPH_PREP_FEATURES")
);

const COMPARE: &str = "\
Each METHOD is a variation of the scene; METHOD:SEEDING also changes the seeding (solver:shells,
seed:random). `sph-prep methods` lists both. FOLDER receives compare.csv (one row for each step and
for each state at the end of a stage), compare.json";

/// Follows [`COMPARE`].
const COMPARE_FIGURES: &str = if cfg!(feature = "plots") {
    ", report.html (a self-contained page of tables
and figures), and two of the figures for the largest number of particles: error-against-time.svg,
and density-profile.svg of the last method."
} else {
    ". This build draws no figures (feature plots)."
};

const COMPARE_EXAMPLE: &str =
    "\n\n  sph-prep compare --scene disc.yaml -n 1000,10000 --methods wvt,solver,solver:random --out out";

/// Low-noise initial conditions for smoothed particle hydrodynamics (SPH) codes, from profiles, grids, meshes,
/// particles or expressions.
#[derive(Debug, Parser)]
#[command(name = "sph-prep", version, long_version = LONG_VERSION, after_help = EXAMPLES, args_conflicts_with_subcommands = true, arg_required_else_help = true, disable_help_subcommand = true)]
pub struct Args {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub run: RunArgs,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Show what a file contains: variables, shapes, units, ranges, and which variable would be used as the density.
    Inspect(InspectArgs),
    /// Check whether a simulation code accepts a particle file from any program, and what it will compute from it.
    Check(CheckArgs),
    /// Evolve the gas of any particle file and report whether it stays at rest.
    Run(FollowArgs),
    /// Convert a particle file to another format, and list what that format cannot hold.
    Convert(ConvertArgs),
    /// Repeat a relaxed periodic box along its axes and map it to a target: any number of particles in bounded memory.
    Replicate(ReplicateArgs),
    /// Write unrelaxed initial positions of a scene block by block, in bounded memory, or one part per process.
    Seed(SeedArgs),
    /// Estimate memory, time and messages of each rank of a parallel run, and the size of its file, without running it.
    Plan(PlanArgs),
    /// Plot a particle file from any program: a page of images and figures, or a small image.
    Plot(PlotArgs),
    /// Print help on a command, on the keys of a scene (scene, scene.domain.box), or on the figures of a report
    /// (numbers).
    Help {
        /// A command, scene.KEY, or numbers.FIGURE.
        topic: Vec<String>,
    },
    /// Print the JSON Schema of scene files, which editors use to complete and check them.
    Schema,
    /// List the formats that can be read and written.
    Formats,
    /// List the seeding methods, which make initial positions, and the methods that can be compared.
    Methods,
    /// Run a scene with several methods, and write error, noise and time as tables, JSON and a page of figures.
    Compare(CompareArgs),
    /// Print a completion script for a shell.
    Completions {
        /// The shell.
        #[arg(value_enum)]
        shell: clap_complete::Shell,
    },
    /// Print the manual page (roff), as for `man -l`.
    Man {
        /// A command, to print its own page.
        topic: Vec<String>,
    },
}

#[derive(Debug, clap::Args)]
pub struct InspectArgs {
    /// File, or the folder of a plotfile.
    pub file: PathBuf,
    /// Name of the format, if it cannot be recognized from the file.
    #[arg(long)]
    pub format: Option<String>,
    /// Name of the variable that holds the mass density.
    #[arg(long)]
    pub density: Option<String>,
    /// Value of the time coordinate to read.
    #[arg(long, allow_negative_numbers = true)]
    pub time: Option<f64>,
    /// Role of a variable, if its name does not determine it: vel1=velocity-x; may be repeated.
    #[arg(long, value_name = "NAME=ROLE")]
    pub map: Vec<String>,
}

#[derive(Debug, clap::Args)]
pub struct CheckArgs {
    /// Particle file.
    pub file: PathBuf,
    /// The code and its build options, as in the main command.
    #[arg(long = "for", value_name = "CODE")]
    pub target_code: String,
    /// Name of the format, if it cannot be recognized from the file.
    #[arg(long)]
    pub format: Option<String>,
    /// Treat the box as open, with vacuum outside. GADGET files do not state whether their box is periodic, and are
    /// treated as periodic by default.
    #[arg(long)]
    pub open: bool,
    /// Print the findings as JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
pub struct FollowArgs {
    /// Particle file.
    pub file: PathBuf,
    /// The code and its build options, as in the main command; its kernel, number of neighbors, gravitational constant
    /// and softening are used.
    #[arg(long = "for", value_name = "CODE")]
    pub target_code: String,
    /// Duration in dynamical times sqrt(R^3/(G M)), or in sound crossing times of the domain if there is no gravity.
    #[arg(long, value_name = "T_DYN", default_value_t = 3.0, allow_negative_numbers = true)]
    pub duration: f64,
    /// Gravitational constant in the file's units, 0 for no gravity [default: the code's, for a file in 3-D that is not
    /// periodic].
    #[arg(long, value_name = "G", allow_negative_numbers = true)]
    pub gravity: Option<f64>,
    /// Adiabatic index of gas without material numbers [default: that of the file, else 5/3].
    #[arg(long, allow_negative_numbers = true)]
    pub gamma: Option<f64>,
    /// Treat the box as open, with vacuum outside. GADGET files do not state whether their box is periodic, and are
    /// treated as periodic by default.
    #[arg(long)]
    pub open: bool,
    /// Before that, damp all motion except translation and rotation of the whole for this time, and write the particles
    /// to --out.
    #[arg(long, value_name = "T_DYN", requires = "output", allow_negative_numbers = true)]
    pub settle: Option<f64>,
    /// Particle file to write after --settle.
    #[arg(long = "out", value_name = "FILE", requires = "settle")]
    pub output: Option<PathBuf>,
    /// Format of --out, if its name does not determine it.
    #[arg(long = "to", value_name = "FORMAT")]
    pub to_format: Option<String>,
    /// Write a self-contained HTML page with the curves.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Name of the format, if it cannot be recognized from the file.
    #[arg(long)]
    pub format: Option<String>,
    /// Stop after this many seconds and report the result so far.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub time_limit: Option<f64>,
    /// Number of threads [default: all cores]. The results do not depend on it.
    #[arg(long, value_parser = threads)]
    pub threads: Option<usize>,
    /// Print all states as JSON.
    #[arg(long)]
    pub json: bool,
    /// Print no progress.
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, clap::Args)]
pub struct PlotArgs {
    /// Particle file.
    pub file: PathBuf,
    /// File to write: a page (.html) or a small image of the density (.png) [default: the particle file's name with
    /// .html].
    #[arg(long = "out", value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Name of the format, if it cannot be recognized from the file.
    #[arg(long)]
    pub format: Option<String>,
}

#[derive(Debug, clap::Args)]
pub struct ConvertArgs {
    /// Particle file to read.
    pub from: PathBuf,
    /// Particle file to write.
    pub to: PathBuf,
    /// Format of the input, if it cannot be recognized from the file.
    #[arg(long)]
    pub format: Option<String>,
    /// Format of the output, if the extension does not determine it.
    #[arg(long = "to", alias = "to-format", value_name = "FORMAT")]
    pub to_format: Option<String>,
    /// Units of the output: cgs, si, solar, planetary, galactic or code [default: those of the input].
    #[arg(long)]
    pub units: Option<String>,
    /// Units of an input that states none, or states units of 1: cgs, si, solar, planetary or galactic.
    #[arg(long, value_name = "UNITS")]
    pub input_units: Option<String>,
    /// Edge length of the box, in units of the output, if the input has no box.
    #[arg(long = "box", value_name = "LENGTH", allow_negative_numbers = true)]
    pub box_size: Option<f64>,
    /// Treat the box as open, with vacuum outside. GADGET files do not state whether their box is periodic, and are
    /// treated as periodic by default.
    #[arg(long)]
    pub open: bool,
    /// Only the particles of these types, by GADGET's numbers: 0 is gas, 1 halo, 2 disk, 3 bulge, 4 stars, 5 black holes
    /// or boundary [default: all].
    #[arg(long, value_name = "TYPE,...", value_delimiter = ',')]
    pub types: Vec<u8>,
    /// Write this many files: NAME.0.EXT, NAME.1.EXT and so on for GADGET and similar formats, pieces of a .pvtu for
    /// VTK.
    #[arg(long, value_name = "K", default_value_t = 1)]
    pub files: usize,
    #[command(flatten)]
    pub encoding: EncodingArgs,
}

#[derive(Debug, clap::Args)]
#[command(after_help = [COMPARE, COMPARE_FIGURES, COMPARE_EXAMPLE].concat())]
pub struct CompareArgs {
    /// Scene file (YAML); its output file is not written.
    #[arg(long, value_name = "FILE", required_unless_present = "input")]
    pub scene: Option<PathBuf>,
    /// Density field, instead of the scene's.
    #[arg(long = "in", value_name = "FILE")]
    pub input: Option<PathBuf>,
    /// Numbers of particles [default: the scene's, or 1000 and 10000].
    #[arg(short = 'n', long, value_name = "N,...", value_delimiter = ',', value_parser = count)]
    pub particles: Vec<usize>,
    /// Methods, separated by commas.
    #[arg(long, value_name = "METHOD,...", default_value = DEFAULT)]
    pub methods: String,
    /// Folder for the files; created if needed.
    #[arg(long = "out", value_name = "FOLDER")]
    pub output: PathBuf,
    /// Number of threads [default: all cores]. Only the times depend on it.
    #[arg(long, value_parser = threads)]
    pub threads: Option<usize>,
    /// Print neither progress nor table.
    #[arg(long)]
    pub quiet: bool,
}

/// Everything here overrides the key of the scene that it names.
#[derive(Debug, clap::Args)]
pub struct RunArgs {
    /// Density field: a stellar profile, grid, mesh, table or point cloud.
    #[arg(long = "in", value_name = "FILE")]
    input: Option<PathBuf>,
    /// Particle file to write; the extension selects the format (.hdf5, .vtu, ...); .png writes a small image instead.
    #[arg(long = "out", value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write a self-contained HTML page about the run: verdict, images, figures, plan and scene.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Number of particles, met exactly [default: 100000].
    #[arg(short = 'n', long, value_name = "N", value_parser = count)]
    particles: Option<usize>,
    /// Scene file (YAML) with everything else; arguments override it.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Format of the input, if it cannot be recognized from the file.
    #[arg(long, value_name = "NAME")]
    format: Option<String>,
    /// Format of the output, if the extension does not determine it.
    #[arg(long, value_name = "NAME")]
    to: Option<String>,
    /// Simulation code for which the particles are made: swift, gadget4, gadget2, gizmo, phantom, sph-exa, arepo, pysph
    /// or dualsphysics, with build options as in swift:wendland-c4,eta=1.2348,scheme=planetary. Sets kernel, number of
    /// neighbors and format, and balances stars for this code.
    #[arg(long = "for", value_name = "CODE")]
    target_code: Option<String>,
    /// Name of the variable that holds the mass density.
    #[arg(long, value_name = "NAME")]
    density: Option<String>,
    /// Role of a variable, if its name does not determine it: vel1=velocity-x, E=none; may be repeated.
    #[arg(long, value_name = "NAME=ROLE")]
    map: Vec<String>,
    /// Positions of the rows of a radial table: nodes, outer-faces, inner-faces, centers, or auto (if a column of
    /// masses determines them).
    #[arg(long, value_name = "WHERE", value_parser = choice::<crate::scene::StaggeringName>)]
    staggering: Option<crate::scene::StaggeringName>,
    /// Value of the input's time coordinate to read.
    #[arg(long, value_name = "T")]
    time: Option<f64>,
    /// Boundary of all axes: periodic, reflecting or open.
    #[arg(long, value_name = "NAME", value_parser = choice::<crate::scene::BoundaryName>)]
    boundary: Option<crate::scene::BoundaryName>,
    /// Units of the output: cgs, si, solar, planetary, galactic, code.
    #[arg(long, value_name = "NAME")]
    units: Option<String>,
    /// Write this many files: NAME.0.EXT, NAME.1.EXT and so on for GADGET and similar formats, pieces of a .pvtu for
    /// VTK.
    #[arg(long, value_name = "K")]
    files: Option<usize>,
    /// Do not overwrite an existing output.
    #[arg(long)]
    no_clobber: bool,
    /// Write f64 where the format's default is f32.
    #[arg(long)]
    double: bool,
    /// Also write parameter files with which the code of --for starts and runs the output without changes.
    #[arg(long)]
    parameters: bool,
    /// Deflate level of the output, from 0 (none) to 9 [default: 4].
    #[arg(long, value_name = "LEVEL", value_parser = clap::value_parser!(u8).range(0..=9))]
    compression: Option<u8>,
    /// SPH kernel: cubic-spline, quartic, quintic, wendland-c2, wendland-c4, wendland-c6, sinc6 [default: that of the
    /// code of --for, else wendland-c4].
    #[arg(long, value_name = "NAME", value_parser = kernel)]
    kernel: Option<KernelName>,
    /// Number of neighbors, V n H^d [default: that of the code of --for, else 64 in 3-D].
    #[arg(long, value_name = "NUMBER")]
    neighbors: Option<f64>,
    /// Method for the initial positions; `sph-prep methods` lists the names.
    #[arg(long, value_name = "NAME", value_parser = seeding)]
    seeding: Option<Seeding>,
    /// crystal: a relaxed lattice of exactly N points, which has the least noise but preferred directions; isotropic:
    /// no preferred directions [default: isotropic, unless the seeding is a lattice].
    #[arg(long, value_name = "KIND", value_parser = choice::<crate::scene::Order>)]
    order: Option<crate::scene::Order>,
    /// Seed of all random numbers.
    #[arg(long)]
    seed: Option<u64>,
    /// Iterations of the relaxation by weighted Voronoi tessellation (WVT; Diehl et al. 2015, PASA 32, e048; Arth et
    /// al. 2019, arXiv:1907.11250) [default: 60, or few before a polish]. With --polish none, 0 leaves the seeded
    /// positions unchanged.
    #[arg(long, value_name = "COUNT")]
    iterations: Option<usize>,
    /// Method that follows WVT: solver (least error and noise), alaric (damped dynamics of ALARIC, "an ALgorithm for
    /// ARbitrary Initial Conditions", as in its paper), damped-relaxation, afc (away from the closest neighbor) or
    /// none.
    #[arg(long, value_name = "NAME", value_parser = choice::<crate::scene::Polish>)]
    polish: Option<crate::scene::Polish>,
    /// Then move the particles until the pressure force of the target code balances gravity, so that a star stays at
    /// rest.
    #[arg(long)]
    balance: bool,
    /// Evolve the result for this many dynamical times and report whether it stays at rest: energies, drifts, a
    /// verdict.
    #[arg(long, value_name = "T_DYN", num_args = 0..=1, default_missing_value = "3")]
    certify: Option<f64>,
    /// Before that, damp the motion caused by the code's forces for this many dynamical times; for bodies that cannot
    /// be balanced.
    #[arg(long, value_name = "T_DYN")]
    settle: Option<f64>,
    /// Priority of the solver, from 0 (exact density) to 1 (least force noise) [default: 0.7, or the largest value that
    /// a tolerance admits].
    #[arg(long, value_name = "0..1")]
    quietness: Option<f64>,
    /// Plan for an epsilon (mass re-fitted) below this value, and stop when it is reached; exit with 3 if it is not.
    #[arg(long)]
    tolerance: Option<f64>,
    /// Stop relaxing after this many seconds, and keep the best state so far.
    #[arg(long, value_name = "SECONDS")]
    time_limit: Option<f64>,
    /// What Ctrl-C does with the result: discard (the default) or write (the best state so far; exit with 3).
    #[arg(long, value_name = "WHAT", value_parser = choice::<crate::scene::OnInterrupt>)]
    on_interrupt: Option<crate::scene::OnInterrupt>,
    /// Write a checkpoint to FILE every few minutes, on Ctrl-C and at the time limit; --resume continues from it.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Store placed bodies in FOLDER and reuse them: another orbit of the same bodies takes no time.
    #[arg(long, value_name = "FOLDER")]
    cache: Option<PathBuf>,
    /// Continue from a checkpoint of the same scene; the result is identical; new checkpoints also go to FILE, unless
    /// --checkpoint names another.
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
    /// Print the resolved scene and stop.
    #[arg(long)]
    pub print_scene: bool,
    /// Read the input, plan, and print the time and memory that the stages will take, but place and write nothing.
    #[arg(long, conflicts_with = "print_scene")]
    pub dry_run: bool,
    /// With --print-scene: print every key with its meaning; unset keys appear as comments.
    #[arg(long, requires = "print_scene")]
    pub all: bool,
    /// Place the particles on this many ranks, each with its share of the particles and of the threads, as with
    /// processes started by mpirun: seeding by mass bisection or on shells, WVT and the density solver.
    #[arg(long, value_name = "COUNT", value_parser = ranks, conflicts_with = "dry_run")]
    pub ranks: Option<usize>,
    /// Process this many blocks in turn, repeatedly, until no seams are left; only one is in memory: seeding by mass
    /// bisection or on shells, WVT and the density solver.
    #[arg(long, value_name = "BLOCKS", value_parser = ranks, conflicts_with_all = ["dry_run", "ranks"])]
    pub in_turn: Option<usize>,
    /// Folder in which --in-turn stores the blocks, and from which an interrupted run continues [default: OUT.blocks].
    #[arg(long, value_name = "FOLDER", requires = "in_turn")]
    pub blocks: Option<PathBuf>,
    /// Number of threads [default: all cores]. The result does not depend on it.
    #[arg(long, value_parser = threads)]
    pub threads: Option<usize>,
    /// Print neither progress nor report.
    #[arg(long)]
    pub quiet: bool,
    /// Print the report as JSON.
    #[arg(long)]
    pub json: bool,
    /// Exit with code 3 if the verdict marks a figure BAD.
    #[arg(long)]
    pub strict: bool,
}

/// Accepts 100000, 1e5, 100_000 and 100k.
fn count(text: &str) -> std::result::Result<usize, String> {
    match parse_count(text)? {
        value if value >= 1 && value <= u32::MAX as usize => Ok(value),
        _ => Err(format!("expected a whole number from 1 to {}", u32::MAX)),
    }
}

impl RunArgs {
    /// The scene file, or an empty scene, with the arguments laid over it.
    ///
    /// # Errors
    /// A scene file that cannot be read.
    pub fn scene(&self) -> Result<Scene> {
        let mut scene = self.scene.as_deref().map_or_else(|| Ok(Scene::default()), Scene::load)?;
        if self.input.is_some() {
            scene.input.expression = None;
            scene.input.profile = None;
        }
        overlay(&mut scene.input.file, &self.input);
        overlay(&mut scene.input.format, &self.format);
        overlay(&mut scene.target_code, &self.target_code);
        overlay(&mut scene.certify, &self.certify);
        overlay(&mut scene.settle, &self.settle);
        scene.output.parameters |= self.parameters;
        overlay(&mut scene.input.density, &self.density);
        for text in &self.map {
            let (name, role) = parse_mapping(text)?;
            scene.map.insert(name, role);
        }
        scene.input.staggering = self.staggering.unwrap_or(scene.input.staggering);
        overlay(&mut scene.input.time, &self.time);
        overlay(&mut scene.output.file, &self.output);
        overlay(&mut scene.output.report, &self.report);
        overlay(&mut scene.output.format, &self.to);
        overlay(&mut scene.output.units, &self.units);
        scene.output.files = self.files.unwrap_or(scene.output.files);
        scene.output.no_clobber |= self.no_clobber;
        scene.output.double_precision |= self.double;
        scene.output.compression = self.compression.unwrap_or(scene.output.compression);
        overlay(&mut scene.particles, &self.particles);
        overlay(&mut scene.tolerance, &self.tolerance);
        overlay(&mut scene.time_limit, &self.time_limit);
        if let Some(boundary) = self.boundary {
            scene.domain.boundary = vec![boundary];
        }
        scene.seed = self.seed.unwrap_or(scene.seed);
        overlay(&mut scene.kernel, &self.kernel);
        overlay(&mut scene.neighbors, &self.neighbors);
        overlay(&mut scene.seeding, &self.seeding);
        overlay(&mut scene.order, &self.order);
        overlay(&mut scene.wvt.iterations, &self.iterations);
        overlay(&mut scene.polish, &self.polish);
        scene.output.on_interrupt = self.on_interrupt.unwrap_or(scene.output.on_interrupt);
        overlay(&mut scene.cache, &self.cache);
        overlay(&mut scene.checkpoint.file, &self.resume);
        overlay(&mut scene.checkpoint.file, &self.checkpoint);
        overlay(&mut scene.checkpoint.resume, &self.resume);
        scene.solver.quietness = self.quietness.or(scene.solver.quietness);
        if self.balance && !scene.balance.is_on() {
            scene.balance = crate::scene::Switch::On(crate::scene::BalanceInput::default());
        }
        Ok(scene)
    }
}

fn overlay<T: Clone>(key: &mut Option<T>, argument: &Option<T>) {
    if argument.is_some() {
        key.clone_from(argument);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_of_the_arguments_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn counts_may_be_written_with_an_exponent() {
        assert_eq!(count("1e5"), Ok(100_000));
        assert_eq!(count("100_000"), Ok(100_000));
        for bad in ["0", "-3", "1.5", "nan", "1e12", "many"] {
            assert!(count(bad).is_err(), "{bad}");
        }
    }
}
