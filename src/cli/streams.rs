//! `sph-prep replicate` and `sph-prep seed`, which generate particles while writing them.

use super::progress::Progress;
use super::stream_args::{ReplicateArgs, SeedArgs, StreamArgs};
use crate::error::{Error, Result};
use crate::input::support::support_radii;
use crate::metrics::{ErrorFigures, PatchFigures};
use crate::run::destination::{intended_format, refuse_clobbering, refuse_replacing};
use crate::run::remarks::Remarks;
use crate::run::replicate::{Repeated, mapped};
use crate::run::seeds::seeds;
use crate::scene::Scene;
use sph_formats::common::particle_names as names;
use sph_formats::registry::output_files;
use sph_formats::stream::TYPES;
use sph_formats::{
    Column, FieldRequest, FileContent, FormatSpec, ParticleStream, ParticleTable, RunHeader, Values, WriteOptions,
    write_part, write_stream,
};
use std::fmt::Write;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Rows that are made at once where nothing is written.
const ROWS: usize = 1 << 16;

/// Repeats a box; returns what was written.
///
/// # Errors
/// A file that is no box of particles, a target that it cannot be mapped to, and what the writer says.
pub fn replicate(formats: &[FormatSpec], args: &ReplicateArgs) -> Result<String> {
    let start = Instant::now();
    let mut scene = args.scene.as_deref().map(Scene::load).transpose()?;
    let of_scene = scene.as_ref().map_or_else(Vec::new, Scene::inputs);
    let to = Destined::new(formats, &args.stream, scene.as_mut(), [&args.file].into_iter().chain(&of_scene))?;
    let progress = Progress::new(false);
    progress.begin("read");
    let content = sph_formats::read(formats, &args.file, args.format.as_deref(), &FieldRequest::default())?;
    let path = args.file.display().to_string();
    let FileContent::Particles(mut tile) = content else {
        return Err(Error::field(path, "holds a field; expected a periodic box of particles"));
    };
    if tile.counts().iter().all(|n| *n == 0) {
        return Err(Error::field(path, "has no particles; expected a periodic box of them"));
    }
    let notes = support_radii(&args.file, &mut tile);
    tile.move_corner_to_origin();
    let repeated = Repeated::new(tile, &args.times)?;
    let mut out = match &scene {
        None => to.put(formats, &repeated, &Remarks { notes, warnings: Vec::new() }, &progress),
        Some(scene) => mapped(&repeated, scene, formats, to.format, |stream, more| {
            let mut told = Remarks { notes, warnings: Vec::new() };
            told.add(more);
            to.put(formats, stream, &told, &progress)
        }),
    }?;
    out.push_str(&taken(start));
    Ok(out)
}

fn taken(start: Instant) -> String {
    format!("{:.2} s in all\n", start.elapsed().as_secs_f64())
}

/// Writes the initial positions of a scene; returns what was written.
///
/// # Errors
/// A scene whose initial positions are not made block by block, and errors of the writer.
pub fn seed(formats: &[FormatSpec], args: &SeedArgs) -> Result<String> {
    let start = Instant::now();
    let mut scene = Scene::load(&args.scene)?;
    let inputs = scene.inputs();
    let to = Destined::new(formats, &args.stream, Some(&mut scene), &inputs)?;
    scene.particles = args.particles.or(scene.particles);
    scene.seeding = args.seeding.or(scene.seeding);
    if scene.particles == Some(0) {
        return Err(Error::scene("particles", "is 0, expected at least 1"));
    }
    let progress = Progress::new(false);
    progress.begin("read");
    seeds(&scene, formats, to.format, |stream, told, measure| {
        let mut out = to.put(formats, stream, &told, &progress)?;
        // One of several parts tells what all have in common.
        if args.stream.part.unwrap_or(0) == 0 {
            progress.begin("measure");
            out.push_str(&measured(measure()?));
        }
        out.push_str(&taken(start));
        Ok(out)
    })
}

/// Measures of the initial positions before any relaxation.
fn measured(figures: Option<PatchFigures>) -> String {
    let Some(PatchFigures { places, smoothed, smoothed_refitted, all, closest_pair }) = figures else {
        return String::new();
    };
    let percent = |x: f64| format!("{:.3} %", 100.0 * x);
    let line = |title: &str, of: ErrorFigures| {
        let (mean, most, max) = (percent(of.mean), percent(of.most), percent(of.max));
        format!("  {title:<38} {mean:>9} on average, {most:>9} for 99 %, {max:>9} at most\n")
    };
    // One that sees no other has none.
    let closest = match closest_pair.is_finite() {
        true => format!("  closest pair there {closest_pair:.2} spacings apart\n"),
        false => String::new(),
    };
    format!(
        "density at {} particles about {places} places, not relaxed:\n{}{}{}{closest}",
        all.particles,
        line("off the target as the kernel sees it", smoothed),
        line("the same, mass re-fitted", smoothed_refitted),
        line("off the target itself", all),
    )
}

/// Where the particles go, by the command line and the scene's `output`.
struct Destined<'a, 'f> {
    args: &'a StreamArgs,
    format: Option<&'f FormatSpec>,
    files: usize,
    options: WriteOptions,
}

impl<'a, 'f> Destined<'a, 'f> {
    /// Tries the place and the format, before the work. The scene's output becomes the one of the command line.
    ///
    /// # Errors
    /// A file that would replace one of the `inputs`, or one that is there where none is to be replaced; no such format; what cannot be written.
    fn new<'i>(
        formats: &'f [FormatSpec],
        args: &'a StreamArgs,
        scene: Option<&mut Scene>,
        inputs: impl IntoIterator<Item = &'i PathBuf>,
    ) -> Result<Self> {
        let mut alone = Scene::default();
        let scene = scene.unwrap_or(&mut alone);
        let output = &mut scene.output;
        output.file.clone_from(&args.output);
        output.format = args.to.clone().or(output.format.take());
        output.no_clobber |= args.no_clobber;
        let options = args.encoding.over(output.write_options());
        let files = args.files.unwrap_or(output.files);
        let format = intended_format(scene, formats)?;
        if let (Some(path), Some(format)) = (args.output.as_deref(), format) {
            inputs.into_iter().try_for_each(|input| refuse_replacing("--out", path, input))?;
            let all = output_files(format, path, files)?;
            let own = match args.part {
                Some(part) => all.get(part..=part).unwrap_or_default(),
                None => &all,
            };
            own.iter().try_for_each(|file| refuse_clobbering("--out", file, scene.output.no_clobber))?;
            // All of them are in one folder.
            own.first().map_or(Ok(()), |file| sph_formats::output::probe(file))?;
        }
        Ok(Self { args, format, files, options })
    }

    fn put(
        &self,
        formats: &[FormatSpec],
        stream: &dyn ParticleStream,
        Remarks { notes, warnings }: &Remarks,
        progress: &Progress,
    ) -> Result<String> {
        let Self { args, files, options, .. } = *self;
        let output = args.output.as_deref().filter(|_| !args.dry_run).zip(self.format);
        progress.begin(if output.is_none() { "make" } else { "write" });
        let stream = &Watched::new(stream, progress)?;
        let mut out = String::new();
        let count: usize = stream.counts().iter().sum();
        let header = stream.header();
        let edges: Vec<String> = header.box_size.iter().take(header.dimension).map(|l| format!("{l:.6e}")).collect();
        let _ = writeln!(out, "{count} particles in a box of {}", edges.join(" x "));
        for warning in warnings {
            let _ = writeln!(out, "WARNING: {warning}");
        }
        for note in notes {
            let _ = writeln!(out, "note: {note}");
        }
        match (output, args.part) {
            (Some((path, format)), Some(part)) => {
                let file = write_part(formats, path, Some(format.name), stream, (part, files), options)?;
                let _ = writeln!(out, "part {part} of {files} is in '{}'", file.display());
            }
            (Some((path, format)), None) => {
                let written = write_stream(formats, path, Some(format.name), stream, files, options)?;
                let shown = match written.as_slice() {
                    [first, _, .., last] => {
                        format!("'{}' to '{}', {} files", first.display(), last.display(), written.len())
                    }
                    few => few.iter().map(|f| format!("'{}'", f.display())).collect::<Vec<_>>().join(" and "),
                };
                let _ = writeln!(out, "written to {shown} ({})", format.name);
            }
            (None, _) => {
                let Tally { particles, mass, hash } = tally(stream)?;
                let _ = writeln!(out, "{particles} particles were made, of mass {mass:.9e} together; hash {hash:016x}");
            }
        }
        Ok(out)
    }
}

/// Particles whose way into a file is shown.
struct Watched<'a> {
    inner: &'a dyn ParticleStream,
    progress: &'a Progress,
    /// Numbers that were taken, of `all`: rows times columns, since some writers take one column after the other.
    taken: AtomicU64,
    all: u64,
}

impl<'a> Watched<'a> {
    fn new(inner: &'a dyn ParticleStream, progress: &'a Progress) -> Result<Self> {
        let mut all = 0;
        for (t, count) in inner.counts().into_iter().enumerate().filter(|(_, count)| *count > 0) {
            all += (inner.rows(t as u8, 0..1, &|_| true)?.columns.len() * count) as u64;
        }
        Ok(Self { inner, progress, taken: AtomicU64::new(0), all })
    }
}

impl ParticleStream for Watched<'_> {
    fn header(&self) -> &RunHeader {
        self.inner.header()
    }

    fn counts(&self) -> [usize; TYPES] {
        self.inner.counts()
    }

    fn rows(
        &self,
        part_type: u8,
        rows: Range<usize>,
        wanted: &dyn Fn(&str) -> bool,
    ) -> sph_formats::Result<ParticleTable> {
        let table = self.inner.rows(part_type, rows, wanted)?;
        let more = (table.count * table.columns.len()) as u64;
        let taken = self.taken.fetch_add(more, Ordering::Relaxed) + more;
        self.progress.count(100 * taken / self.all.max(1), 100);
        Ok(table)
    }
}

/// What is left of particles that nothing is written of.
struct Tally {
    particles: usize,
    mass: f64,
    hash: u64,
}

fn tally(stream: &dyn ParticleStream) -> Result<Tally> {
    let mut all = Tally { particles: 0, mass: 0.0, hash: OFFSET };
    for (t, total) in stream.counts().into_iter().enumerate() {
        let blocks = total.div_ceil(ROWS);
        // A few blocks at once, hashed in their order.
        for first in (0..blocks).step_by(AT_ONCE) {
            let made = sph::parallel::tasks(AT_ONCE.min(blocks - first), |k| {
                let start = (first + k) * ROWS;
                let table = stream.rows(t as u8, start..total.min(start + ROWS), &|_| true)?;
                let masses = table.column(names::MASSES);
                let mass = masses.map_or(0.0, |c| (0..c.values.len()).map(|i| c.values.get(i)).sum::<f64>());
                Ok::<_, sph_formats::FormatError>((table.count, mass, table.columns.iter().fold(OFFSET, hashed)))
            });
            for block in made {
                let (count, mass, hash) = block?;
                all.particles += count;
                all.mass += mass;
                all.hash = fold(all.hash, hash);
            }
        }
    }
    Ok(all)
}

/// Blocks that are made at once.
const AT_ONCE: usize = 16;
/// Of the hash by Fowler, Noll and Vo (FNV-1a, 64 bits), here over words instead of bytes.
const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0100_0000_01b3;

fn fold(hash: u64, word: u64) -> u64 {
    (hash ^ word).wrapping_mul(PRIME)
}

fn hashed(hash: u64, column: &Column) -> u64 {
    match &column.values {
        Values::F32(v) => v.iter().fold(hash, |h, x| fold(h, u64::from(x.to_bits()))),
        Values::F64(v) => v.iter().fold(hash, |h, x| fold(h, x.to_bits())),
        Values::I64(v) => v.iter().fold(hash, |h, x| fold(h, *x as u64)),
    }
}
