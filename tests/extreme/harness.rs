//! One scene through one method, with everything that must hold of the result checked against the file that was
//! written, not against what the run says of itself.

use sph_formats::common::particle_names as names;
use sph_formats::{
    Capabilities, FieldRequest, FileContent, FormatError, FormatSpec, Match, ParticleFile, RawField, WriteOptions,
};
use sph_prep::compare::Compared;
use sph_prep::metrics::ErrorFigures;
use sph_prep::relaxation::Control;
use sph_prep::run::pipeline;
use sph_prep::run::report::Report;
use sph_prep::scene::Scene;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

static WRITTEN: Mutex<Option<HashMap<PathBuf, ParticleFile>>> = Mutex::new(None);
static FIELDS: Mutex<Option<HashMap<PathBuf, RawField>>> = Mutex::new(None);

fn no_sniff(_: &[u8]) -> Match {
    Match::No
}

fn sniff(head: &[u8]) -> Match {
    if head.starts_with(b"field") { Match::Certain } else { Match::No }
}

/// Each run has a folder of its own, which tells the runs apart.
fn keep(path: &Path, file: &ParticleFile, _: WriteOptions) -> Result<(), FormatError> {
    let key = path.parent().unwrap().to_owned();
    WRITTEN.lock().unwrap().get_or_insert_default().insert(key, file.clone());
    std::fs::write(path, "kept").map_err(|e| FormatError::io(path, "write", e))
}

fn field(path: &Path, _: &FieldRequest) -> Result<FileContent, FormatError> {
    let fields = FIELDS.lock().unwrap();
    let field = fields.as_ref().and_then(|f| f.get(path)).expect("the field was registered");
    Ok(FileContent::Field(field.clone()))
}

const NOTHING: Capabilities = Capabilities { dimensions: &[1, 2, 3], ..Capabilities::NONE };

const FORMATS: &[FormatSpec] = &[
    FormatSpec {
        name: "field",
        summary: "made here",
        extensions: &["field"],
        feature: "none",
        reference: "none",
        capabilities: Capabilities { read_field: true, geometries: &["radial", "grid"], ..NOTHING },
        sniff,
        read: Some(field),
        write: None,
        stream: None,
    },
    FormatSpec {
        name: "memory",
        summary: "kept in memory",
        extensions: &["kept"],
        feature: "none",
        reference: "none",
        capabilities: Capabilities { write_particles: true, ..NOTHING },
        sniff: no_sniff,
        read: None,
        write: Some(keep),
        stream: None,
    },
];

/// A scene as YAML, or with a field instead of a file.
#[derive(Clone)]
pub struct Case {
    pub name: String,
    pub yaml: String,
    pub field: Option<RawField>,
}

impl Case {
    pub fn new(name: &str, yaml: impl Into<String>) -> Self {
        Self { name: name.into(), yaml: yaml.into(), field: None }
    }
}

/// What a run came to.
pub enum Verdict {
    /// Particles, and what is wrong with them.
    Placed(Box<Placed>, Vec<String>),
    /// An error that says why.
    Refused(String),
    /// A panic.
    Panicked(String),
}

pub struct Placed {
    pub report: Report,
    pub positions: Vec<f64>,
    pub box_size: f64,
    pub seconds: f64,
}

impl Placed {
    /// Figures over the interior, where there is one to speak of.
    fn interior(&self) -> Option<ErrorFigures> {
        self.report.density_error.interior_refitted.filter(|e| 10 * e.particles > self.report.particles)
    }

    /// Figures that the run is judged by.
    pub fn error(&self) -> ErrorFigures {
        self.interior().unwrap_or(self.report.density_error.all_refitted)
    }

    /// epsilon of another state and of this one over the interior (where there is one) and over all.
    pub fn epsilons(&self, other: &Self) -> Vec<(f64, f64)> {
        let all = |p: &Self| p.report.density_error.all_refitted.epsilon;
        let inside = other.interior().zip(self.interior()).map(|(a, b)| (a.epsilon, b.epsilon));
        inside.into_iter().chain([(all(other), all(self))]).collect()
    }

    pub fn closest(&self) -> f64 {
        self.report.neighbors.closest_pair
    }
}

/// Runs `method` (as `compare` names them; "default" is the scene as it is) on `case` with `count` particles.
pub fn run(case: &Case, method: &str, count: usize) -> Verdict {
    let start = Instant::now();
    let outcome = catch_unwind(AssertUnwindSafe(|| place(case, method, count)));
    match outcome {
        Err(cause) => {
            let text = cause.downcast_ref::<String>().cloned();
            Verdict::Panicked(text.or_else(|| cause.downcast_ref::<&str>().map(|s| s.to_string())).unwrap_or_default())
        }
        Ok(Err(refusal)) => Verdict::Refused(refusal),
        Ok(Ok((report, file))) => {
            let wrong = faults(&report, &file, count);
            let positions = column(&file, names::COORDINATES);
            Verdict::Placed(
                Box::new(Placed {
                    report,
                    positions,
                    box_size: file.header.box_size[0],
                    seconds: start.elapsed().as_secs_f64(),
                }),
                wrong,
            )
        }
    }
}

fn place(case: &Case, method: &str, count: usize) -> Result<(Report, ParticleFile), String> {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = Scene::parse(&case.yaml).map_err(|e| e.to_string())?;
    if let Some(field) = &case.field {
        let path = folder.path().join("in.field");
        std::fs::write(&path, "field").unwrap();
        FIELDS.lock().unwrap().get_or_insert_default().insert(path.clone(), field.clone());
        scene.input.file = Some(path);
    }
    scene.particles = Some(count);
    scene.output.file = Some(folder.path().join("out.kept"));
    if method != "default" {
        scene = Compared::parse(method).map_err(|e| e.to_string())?.apply(&scene);
    }
    let stop = AtomicBool::new(false);
    let control = Control { deadline: None, interrupted: &stop, observer: &|_| {} };
    let report = pipeline::run(&scene, FORMATS, &control).map_err(|e| e.to_string())?;
    let file = WRITTEN.lock().unwrap().get_or_insert_default().remove(folder.path()).expect("a file was written");
    Ok((report, file))
}

pub fn column(file: &ParticleFile, name: &str) -> Vec<f64> {
    file.species[0].table.column(name).unwrap_or_else(|| panic!("no column {name}")).values.to_f64()
}

/// What does not hold of a result that was written.
fn faults(report: &Report, file: &ParticleFile, count: usize) -> Vec<String> {
    let mut wrong = Vec::new();
    let d = file.header.dimension;
    let x = column(file, names::COORDINATES);
    let m = column(file, names::MASSES);
    let (h, rho) = (column(file, names::SUPPORT_RADIUS), column(file, names::DENSITY));
    if m.len() != count || x.len() != d * count {
        wrong.push(format!("{} particles instead of {count}", m.len()));
    }
    for (name, values) in [("coordinate", &x), ("mass", &m), ("support", &h), ("density", &rho)] {
        if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
            wrong.push(format!("{name} {bad}"));
        }
    }
    for (name, values) in [("mass", &m), ("support", &h), ("density", &rho)] {
        if let Some(bad) = values.iter().find(|v| !(**v > 0.0)) {
            wrong.push(format!("{name} {bad} is not positive"));
        }
    }
    let outside = (0..x.len()).filter(|&i| !(x[i] >= 0.0 && x[i] < file.header.box_size[i % d])).count();
    if outside > 0 {
        wrong.push(format!("{outside} coordinates outside the box"));
    }
    // Kahan's sum, so that the defect is the masses' own.
    let (mut total, mut lost) = (0.0, 0.0);
    for mass in &m {
        let y = mass - lost;
        let t: f64 = total + y;
        lost = (t - total) - y;
        total = t;
    }
    if !((total / report.mass.total - 1.0).abs() < 1e-12) {
        wrong.push(format!("masses add up to {total:e} instead of {:e}", report.mass.total));
    }
    let e = &report.density_error;
    for figures in [Some(e.all), Some(e.all_refitted), e.interior, e.interior_refitted].into_iter().flatten() {
        if !(figures.epsilon >= 0.0 && figures.epsilon.is_finite() && figures.max.is_finite()) {
            wrong.push(format!("an error of {figures:?}"));
        }
    }
    if !report.noise.all.is_finite() {
        wrong.push(format!("a noise of {}", report.noise.all));
    }
    wrong
}
