//! The compiled half of the Python module: plain data in and out. What users see of it is in `sph_prep/__init__.py`.

mod particles;
mod work;

use particles::{from_python, to_python};
use pyo3::create_exception;
use pyo3::exceptions::{PyKeyboardInterrupt, PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde_json::Value;
use sph_formats::{FORMATS, FieldRequest, FileContent, ParticleFile, WriteOptions};
use sph_prep::codes::TargetCode;
use sph_prep::compare::{Compared, DEFAULT, Request, advice, numbers};
use sph_prep::{Control, Error, Scene};
use std::path::PathBuf;

create_exception!(sph_prep, SphPrepError, PyRuntimeError, "Particles could not be placed, read or written.");
create_exception!(sph_prep, SceneError, PyValueError, "A scene that asks for something impossible or contradictory.");

/// What a page says it was made by.
const PAGE: &str = "sph_prep.place";

/// An error of the library as the exception that a Python user expects.
fn raise(error: &Error) -> PyErr {
    let text = error.to_string();
    match error {
        Error::Scene { .. } => SceneError::new_err(text),
        Error::Interrupted | Error::InterruptedKept(_) | Error::InterruptedUnkept(_) => {
            PyKeyboardInterrupt::new_err(text)
        }
        Error::Format(_) => PyOSError::new_err(text),
        _ => SphPrepError::new_err(text),
    }
}

/// Places the particles of a scene, which is YAML or JSON. Returns the header, the species, and the report as JSON.
/// `progress` is called with a text now and then.
#[pyfunction]
#[pyo3(signature = (scene, progress=None))]
fn place(
    py: Python<'_>,
    scene: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Py<PyDict>, Py<PyList>, String, String)> {
    let scene = Scene::parse(scene).map_err(|e| raise(&e))?;
    let (yaml, limit) = (scene.to_yaml(), scene.time_limit);
    let place = move |control: &Control<'_>| placed(&scene, control);
    let (file, report) = work::watched(py, limit, progress, place)?.map_err(|e| raise(&e))?;
    let (header, species) = to_python(py, file)?;
    Ok((header, species, report, yaml))
}

/// The particles of a scene and the report as JSON. The page that the scene asks for is written.
fn placed(scene: &Scene, control: &Control<'_>) -> sph_prep::Result<(ParticleFile, String)> {
    if let Some(page) = &scene.output.report {
        sph_formats::output::probe(page)?;
    }
    let unwritten = [("output.file", scene.output.file.is_some()), ("output.parameters", scene.output.parameters)];
    let notes = unwritten.into_iter().filter(|(_, is_asked)| *is_asked).map(|(key, _)| {
        format!("{key} is for the program: here nothing but a page is written, and Particles.write writes particles")
    });
    if scene.bodies.is_empty() {
        let (file, mut report) = sph_prep::place(scene, FORMATS, control)?;
        report.notes.extend(notes);
        report.write_page(scene, &file, PAGE)?;
        return Ok((file, report.json()));
    }
    let (file, mut report) = sph_prep::place_bodies(scene, FORMATS, control)?;
    report.notes.extend(notes);
    report.write_page(scene, &file, PAGE)?;
    Ok((file, report.json()))
}

/// Runs a scene through several methods and writes the files of the comparison into a folder. Returns its table, and which method to take.
#[pyfunction]
#[pyo3(signature = (scene, methods, counts, folder, progress=None))]
fn compare(
    py: Python<'_>,
    scene: &str,
    methods: Option<&str>,
    counts: Vec<usize>,
    folder: PathBuf,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, Option<String>)> {
    let scene = Scene::parse(scene).map_err(|e| raise(&e))?;
    let methods = Compared::parse_list(methods.unwrap_or(DEFAULT)).map_err(|e| raise(&e))?;
    let counts = numbers(&scene, &counts).map_err(|e| raise(&e))?;
    let work = move |control: &Control<'_>| {
        let request = Request { scene: &scene, methods: &methods, counts: &counts };
        let comparison = sph_prep::compare::compare(&request, FORMATS, control)?;
        sph_prep::compare::write(&comparison, &folder)?;
        Ok((comparison.text(), advice(&comparison)))
    };
    work::watched(py, None, progress, work)?.map_err(|e| raise(&e))
}

/// The scene with all that it sets, as YAML.
#[pyfunction]
fn scene_yaml(scene: &str) -> PyResult<String> {
    Scene::parse(scene).map(|s| s.to_yaml()).map_err(|e| raise(&e))
}

/// The scene of a file as YAML, with paths that count from the file's folder.
#[pyfunction]
fn scene_of_file(path: PathBuf) -> PyResult<String> {
    Scene::load(&path).map(|s| s.to_yaml()).map_err(|e| raise(&e))
}

/// A scene in YAML with further keys, given as JSON, which win.
#[pyfunction]
fn scene_with(scene: &str, keys: &str) -> PyResult<String> {
    let refuse = |problem: String| SceneError::new_err(format!("scene: {problem}"));
    let mut whole: Value = serde_saphyr::from_str(scene).map_err(|e| refuse(e.to_string()))?;
    let keys: Value = serde_json::from_str(keys).map_err(|e| refuse(e.to_string()))?;
    overlay(&mut whole, keys);
    serde_json::to_string(&whole).map_err(|e| refuse(e.to_string()))
}

/// Puts the keys of maps within maps over those that are there; anything else replaces what is there.
fn overlay(under: &mut Value, over: Value) {
    match (under, over) {
        (Value::Object(under), Value::Object(over)) => {
            for (key, value) in over {
                overlay(under.entry(key).or_insert(Value::Null), value);
            }
        }
        (under, over) => *under = over,
    }
}

/// Header and species of a particle file.
#[pyfunction]
#[pyo3(signature = (path, format=None))]
fn read(py: Python<'_>, path: PathBuf, format: Option<String>) -> PyResult<(Py<PyDict>, Py<PyList>)> {
    let content = py
        .detach(|| sph_formats::read(FORMATS, &path, format.as_deref(), &FieldRequest::default()))
        .map_err(|e| raise(&e.into()))?;
    match content {
        FileContent::Particles(file) => to_python(py, file),
        FileContent::Field(_) => Err(SphPrepError::new_err(format!(
            "'{}' holds a field, expected particles; place particles in it with place(path)",
            path.display()
        ))),
    }
}

/// Writes a particle file, in the format that is named, else in that of the scene in YAML that placed the particles. Returns what there is to note.
#[pyfunction]
#[pyo3(signature = (path, header, species, scene, format, encoding))]
fn write(
    py: Python<'_>,
    path: PathBuf,
    header: &Bound<'_, PyDict>,
    species: &Bound<'_, PyList>,
    scene: Option<&str>,
    format: Option<String>,
    encoding: (Option<bool>, u8),
) -> PyResult<Vec<String>> {
    let (double_precision, compression) = encoding;
    let mut file = from_python(header, species)?;
    let scene = scene.map(Scene::parse).transpose().map_err(|e| raise(&e))?;
    let of_scene = scene.as_ref().is_some_and(|scene| scene.output.double_precision);
    let options = WriteOptions { compression, double_precision: double_precision.unwrap_or(of_scene) };
    let to = (path.as_path(), format.as_deref());
    py.detach(|| sph_prep::write_placed(FORMATS, to, (&mut file, scene.as_ref()), options)).map_err(|e| raise(&e))
}

/// What a code will make of particles: a JSON list of findings.
#[pyfunction]
fn check(py: Python<'_>, header: &Bound<'_, PyDict>, species: &Bound<'_, PyList>, code: &str) -> PyResult<String> {
    let file = from_python(header, species)?;
    let code = TargetCode::parse(code).map_err(|e| raise(&e))?;
    let findings = py.detach(|| sph_prep::check::check(&file, &code)).map_err(|e| raise(&e))?;
    serde_json::to_string(&findings).map_err(|e| SphPrepError::new_err(e.to_string()))
}

/// Runs the program with these arguments, the first of which is its name. Returns its exit code.
#[pyfunction]
fn main(py: Python<'_>, arguments: Vec<String>) -> u8 {
    py.detach(|| sph_prep::cli::main_with(arguments))
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("SphPrepError", py.get_type::<SphPrepError>())?;
    module.add("SceneError", py.get_type::<SceneError>())?;
    module.add_function(wrap_pyfunction!(place, module)?)?;
    module.add_function(wrap_pyfunction!(compare, module)?)?;
    module.add_function(wrap_pyfunction!(scene_yaml, module)?)?;
    module.add_function(wrap_pyfunction!(scene_of_file, module)?)?;
    module.add_function(wrap_pyfunction!(scene_with, module)?)?;
    module.add_function(wrap_pyfunction!(read, module)?)?;
    module.add_function(wrap_pyfunction!(write, module)?)?;
    module.add_function(wrap_pyfunction!(check, module)?)?;
    module.add_function(wrap_pyfunction!(main, module)?)
}
