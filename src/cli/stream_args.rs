//! Arguments of the commands that generate particles while writing them.

use super::choices::seeding;
use super::rank_args::threads;
use crate::scene::parse_count;
use crate::seeding::Seeding;
use sph_formats::WriteOptions;
use std::path::PathBuf;

/// How numbers are written.
#[derive(Debug, clap::Args)]
pub struct EncodingArgs {
    /// Write f64 where the format's default is f32.
    #[arg(long)]
    double: bool,
    /// Deflate level, 0 to 9 [default: 4].
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=9))]
    compression: Option<u8>,
}

impl EncodingArgs {
    pub fn options(&self) -> WriteOptions {
        self.over(WriteOptions::default())
    }

    /// Those of the command line over others.
    pub fn over(&self, of_scene: WriteOptions) -> WriteOptions {
        WriteOptions {
            compression: self.compression.unwrap_or(of_scene.compression),
            double_precision: self.double || of_scene.double_precision,
        }
    }
}

/// Where particles go that are made while they are written.
#[derive(Debug, clap::Args)]
pub struct StreamArgs {
    /// Particle file to write.
    #[arg(long = "out", value_name = "FILE", required_unless_present = "dry_run")]
    pub output: Option<PathBuf>,
    /// Format of the output, if the extension does not determine it.
    #[arg(long, value_name = "NAME")]
    pub to: Option<String>,
    /// Write this many files: NAME.0.EXT, NAME.1.EXT and so on for GADGET and similar formats, pieces of a .pvtu for
    /// VTK [default: 1, or what the scene says].
    #[arg(long, value_name = "K")]
    pub files: Option<usize>,
    /// Write only file PART of --files, counted from 0, and leave the others to other processes.
    #[arg(long, value_name = "PART", conflicts_with = "dry_run")]
    pub part: Option<usize>,
    #[command(flatten)]
    pub encoding: EncodingArgs,
    /// Do not overwrite an existing output.
    #[arg(long)]
    pub no_clobber: bool,
    /// Make all particles, count them, sum their masses and hash their values, but write nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// Number of threads [default: all cores]. The result does not depend on it.
    #[arg(long, value_parser = threads)]
    pub threads: Option<usize>,
}

#[derive(Debug, clap::Args)]
pub struct ReplicateArgs {
    /// Particle file with a periodic box.
    pub file: PathBuf,
    /// Number of copies of the box along each axis.
    #[arg(long, value_name = "NX,NY,NZ", value_delimiter = ',', required = true)]
    pub times: Vec<usize>,
    /// Scene whose target the copies are mapped to: a product of functions of x, y and z in a box, or a function of the
    /// radius in a ball or shell.
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Name of the box's format, if it cannot be recognized from the file.
    #[arg(long)]
    pub format: Option<String>,
    #[command(flatten)]
    pub stream: StreamArgs,
}

#[derive(Debug, clap::Args)]
pub struct SeedArgs {
    /// Scene file (YAML).
    #[arg(long, value_name = "FILE")]
    pub scene: PathBuf,
    /// Number of particles, overrides the scene's; it may be more than one process can hold.
    #[arg(short = 'n', long, value_name = "N", value_parser = parse_count)]
    pub particles: Option<usize>,
    /// Seeding: mass-bisection, or shells or equal-area-shells for a radial target [default: the scene's, or mass-bisection].
    #[arg(long, value_name = "NAME", value_parser = seeding)]
    pub seeding: Option<Seeding>,
    #[command(flatten)]
    pub stream: StreamArgs,
}
