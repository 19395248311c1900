//! A cache of placed bodies, keyed by everything that they were made from: a scene with another orbit reuses them unchanged.
//!
//! A file holds, behind a mark and a checksum, the scene of the body by itself, fingerprints of the files that it reads, the
//! particles to the last bit, and the report. What does not fit or is damaged is made anew.

use super::bodies_report::BodyFigures;
use super::fingerprint::Hash;
use crate::error::{Error, Result};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use sph_formats::common::particle_names as names;
use sph_formats::{
    Column, FormatError, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension, UnitSystem, Values, files_of,
};
use std::path::{Path, PathBuf};

/// The first bytes of a file, with the version of the layout and of what bodies come out as.
const MARK: &[u8; 8] = b"SPHBODY7";
/// Mark and checksum.
const HEADER: usize = 16;

/// A placed body.
#[derive(Debug, Clone)]
pub struct PlacedBody {
    pub file: ParticleFile,
    /// As JSON.
    pub report: String,
    pub figures: BodyFigures,
}

/// Everything that a body follows from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    version: String,
    scene: String,
    format: String,
    /// Fingerprints of the files that it reads.
    inputs: Vec<u64>,
}

#[derive(Serialize, Deserialize)]
struct Kept {
    recipe: Recipe,
    report: String,
    figures: BodyFigures,
    dimension: usize,
    box_size: [f64; 3],
    periodic: [bool; 3],
    units: [f64; 4],
    kernel: String,
    kernel_neighbors: f64,
    species: Vec<KeptSpecies>,
}

#[derive(Serialize, Deserialize)]
struct KeptSpecies {
    part_type: u8,
    count: usize,
    columns: Vec<KeptColumn>,
}

#[derive(Serialize, Deserialize)]
struct KeptColumn {
    name: String,
    components: usize,
    dimension: [i8; 4],
    values: KeptValues,
}

#[derive(Serialize, Deserialize)]
enum KeptValues {
    F32(Vec<f32>),
    F64(Vec<f64>),
    I64(Vec<i64>),
}

impl Recipe {
    /// Of a body by itself, for a format.
    ///
    /// # Errors
    /// An input that cannot be read.
    pub fn new(alone: &Scene, format: &str) -> Result<Self> {
        let mut scene = alone.clone();
        // What only says how the file of all bodies is written.
        let written = std::mem::take(&mut scene.output);
        (scene.output.units, scene.output.box_factor) = (written.units, written.box_factor);
        let mut inputs = Vec::new();
        for file in scene.inputs_mut() {
            for own in files_of(&std::mem::take(file))? {
                let bytes = std::fs::read(&own).map_err(|e| FormatError::io(&own, "read", e))?;
                inputs.push(Hash::of(&bytes));
            }
        }
        // How it turns is no key of the document.
        let turning = format!("{:?}", scene.turning);
        let scene = scene.to_yaml() + &turning;
        Ok(Self { version: env!("CARGO_PKG_VERSION").into(), scene, format: format.into(), inputs })
    }

    fn path(&self, folder: &Path) -> Result<PathBuf> {
        let bytes = postcard::to_extend(self, Vec::new()).map_err(|e| broken(folder, &e))?;
        Ok(folder.join(format!("{:016x}.body", Hash::of(&bytes))))
    }

    /// The body, where `folder` has it.
    pub fn find(&self, folder: &Path) -> Option<PlacedBody> {
        let bytes = std::fs::read(self.path(folder).ok()?).ok()?;
        let (head, payload) = bytes.split_at_checked(HEADER)?;
        let is_whole = head.starts_with(MARK) && head[8..] == Hash::of(payload).to_le_bytes();
        let kept: Kept = is_whole.then(|| postcard::from_bytes(payload).ok())??;
        (kept.recipe == *self).then(|| kept.into_body()).filter(|body| body.file.validate().is_ok())
    }

    /// Keeps a body in `folder`, which is made if need be.
    ///
    /// # Errors
    /// A folder or file that cannot be written.
    pub fn keep(self, folder: &Path, body: &PlacedBody) -> Result<()> {
        std::fs::create_dir_all(folder).map_err(|e| FormatError::io(folder, "make the folder", e))?;
        let path = self.path(folder)?;
        let kept = Kept::new(self, body);
        let mut bytes = postcard::to_extend(&kept, vec![0; HEADER]).map_err(|e| broken(&path, &e))?;
        let checksum = Hash::of(&bytes[HEADER..]);
        bytes[..8].copy_from_slice(MARK);
        bytes[8..HEADER].copy_from_slice(&checksum.to_le_bytes());
        sph_formats::output::atomically(&path, |temporary| {
            std::fs::write(temporary, &bytes).map_err(|e| FormatError::io(&path, "write", e))
        })?;
        Ok(())
    }
}

fn broken(path: &Path, error: &postcard::Error) -> Error {
    Error::Checkpoint { path: path.into(), problem: format!("cannot be made: {error}") }
}

impl Kept {
    fn new(recipe: Recipe, body: &PlacedBody) -> Self {
        let header = &body.file.header;
        let UnitSystem { length, mass, time, temperature } = header.units;
        let column = |c: &Column| {
            let UnitDimension { length, mass, time, temperature, .. } = c.dimension;
            KeptColumn {
                name: c.name.clone(),
                components: c.components,
                dimension: [length, mass, time, temperature],
                values: match &c.values {
                    Values::F32(v) => KeptValues::F32(v.clone()),
                    Values::F64(v) => KeptValues::F64(v.clone()),
                    Values::I64(v) => KeptValues::I64(v.clone()),
                },
            }
        };
        Self {
            recipe,
            report: body.report.clone(),
            figures: body.figures.clone(),
            dimension: header.dimension,
            box_size: header.box_size,
            periodic: header.periodic,
            units: [length, mass, time, temperature],
            kernel: header.kernel.clone(),
            kernel_neighbors: header.kernel_neighbors,
            species: body
                .file
                .species
                .iter()
                .map(|s| KeptSpecies {
                    part_type: s.part_type,
                    count: s.table.count,
                    columns: s.table.columns.iter().map(column).collect(),
                })
                .collect(),
        }
    }

    fn into_body(self) -> PlacedBody {
        let [length, mass, time, temperature] = self.units;
        let column = |c: KeptColumn| {
            let [length, mass, time, temperature] = c.dimension;
            let dimension = match c.name.as_str() {
                names::MAGNETIC_FIELD => UnitDimension::MAGNETIC_FIELD,
                _ => UnitDimension::new(length, mass, time, temperature),
            };
            Column {
                name: c.name,
                components: c.components,
                values: match c.values {
                    KeptValues::F32(v) => Values::F32(v),
                    KeptValues::F64(v) => Values::F64(v),
                    KeptValues::I64(v) => Values::I64(v),
                },
                dimension,
            }
        };
        let header = RunHeader {
            dimension: self.dimension,
            box_size: self.box_size,
            box_corner: None,
            periodic: self.periodic,
            units: UnitSystem { length, mass, time, temperature },
            time: 0.0,
            kernel: self.kernel,
            kernel_neighbors: self.kernel_neighbors,
            provenance: Vec::new(),
            layouts: Vec::new(),
        };
        let species = self.species.into_iter().map(|KeptSpecies { part_type, count, columns }| Species {
            part_type,
            table: ParticleTable { count, columns: columns.into_iter().map(column).collect() },
        });
        let file = ParticleFile { header, species: species.collect() };
        PlacedBody { file, report: self.report, figures: self.figures }
    }
}
