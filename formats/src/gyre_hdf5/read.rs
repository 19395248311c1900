//! Reader of both kinds of models.

use super::schema::{NAME, PROFILES};
use crate::common::hdf5_read::{Attributes, Reader};
use crate::common::wanted::wanted;
use crate::error::{FormatError, Result};
use crate::model::{Geometry, Location, RawField, Values, Variable};
use crate::registry::{FieldRequest, FileContent};
use crate::units::Unit;
use std::f64::consts::PI;
use std::path::Path;

/// A model as read.
struct Model {
    nodes: Vec<f64>,
    length: Option<Unit>,
    /// Name, unit and values.
    variables: Vec<(&'static str, Option<Unit>, Vec<f64>)>,
    metadata: Vec<(String, String)>,
    note: String,
}

/// Reads a model.
///
/// # Errors
/// [`FormatError::Input`] where it is neither kind or contradicts itself, [`FormatError::Unsupported`] for polytropes of
/// several regions, [`FormatError::Limit`], [`FormatError::Io`].
pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let file = Reader::open(path, NAME)?;
    let datasets = file.datasets("/")?;
    let has = |name: &str| datasets.iter().any(|d| d == name);
    let attributes = file.root_attributes()?;
    let model = if has("z") && has("theta") {
        polytrope(&file, path, &attributes)?
    } else if has("r") && has("rho") {
        star(&file, &attributes, &datasets)?
    } else {
        return Err(file.input(
            "group '/'",
            format!(
                "expected datasets r and rho (GSM) or z and theta (POLY), found {}; name another format with --format",
                if datasets.is_empty() { "none".to_owned() } else { datasets.join(", ") }
            ),
        ));
    };
    let names: Vec<String> = model.variables.iter().map(|v| v.0.to_owned()).collect();
    let (chosen, density) =
        wanted(&names, request, &["density"]).map_err(|(location, problem)| file.input(location, problem))?;
    let jumps = model.nodes.windows(2).filter(|w| w[0] == w[1]).count();
    let jumps = (jumps > 0).then(|| format!("{jumps} repeated radii are taken as jumps"));
    let variables = model.variables.into_iter().filter(|v| chosen.iter().any(|c| c == v.0));
    Ok(FileContent::Field(RawField {
        path: path.into(),
        format: NAME,
        geometry: Geometry::Radial { nodes: model.nodes, unit: model.length },
        variables: variables
            .map(|(name, unit, values)| Variable {
                name: name.into(),
                description: None,
                unit,
                location: Location::Node,
                components: 1,
                values: Values::F64(values),
            })
            .collect(),
        density,
        metadata: model.metadata,
        notes: std::iter::once(model.note).chain(jumps).collect(),
    }))
}

/// A column of `n` finite numbers.
fn column(file: &Reader, name: &str, n: Option<usize>) -> Result<Vec<f64>> {
    let wrong = |problem: String| file.input(format!("dataset '{name}'"), problem);
    let Some((shape, values)) = file.array(name)? else {
        return Err(wrong("expected numbers".into()));
    };
    let expected = n.unwrap_or(values.len());
    if shape != [expected] {
        return Err(wrong(format!("has shape {shape:?}, expected ({expected})")));
    }
    let values = values.to_f64();
    match values.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(wrong(format!("value {i} is {}, expected a finite number", values[i]))),
        None => Ok(values),
    }
}

/// The radii, as many as the file says.
fn radii(file: &Reader, name: &str, attributes: &Attributes) -> Result<Vec<f64>> {
    let nodes = column(file, name, None)?;
    if let Some(n) = attributes.number("n")
        && n != nodes.len() as f64
    {
        let problem = format!("has {} values, but the attribute n is {n}", nodes.len());
        return Err(file.input(format!("dataset '{name}'"), problem));
    }
    Ok(nodes)
}

fn polytrope(file: &Reader, path: &Path, attributes: &Attributes) -> Result<Model> {
    let indices = attributes.numbers("n_poly").unwrap_or_default();
    let regions = attributes.number("n_r").unwrap_or(indices.len() as f64);
    if regions > 1.0 || indices.len() > 1 {
        let what =
            format!("a composite polytrope of {} regions; a single index is read", regions.max(indices.len() as f64));
        return Err(FormatError::Unsupported { path: path.into(), format: NAME, what });
    }
    let Some(&index) = indices.first().filter(|n| n.is_finite() && **n >= 0.0) else {
        let problem = format!("is {indices:?}, expected one index that is not negative");
        return Err(file.input("attribute 'n_poly'", problem));
    };
    let z = radii(file, "z", attributes)?;
    let theta = column(file, "theta", Some(z.len()))?;
    if let Some(i) = theta.iter().position(|t| !(-1e-6..=1.0 + 1e-6).contains(t)) {
        let problem = format!("value {i} is {:e}, expected one from 1 at the center to 0 at the surface", theta[i]);
        return Err(file.input("dataset 'theta'", problem));
    }
    // The last zero may miss it by rounding.
    let power = |exponent: f64| theta.iter().map(|t| t.max(0.0).powf(exponent)).collect::<Vec<f64>>();
    let scale = 4.0 * PI / (index + 1.0);
    let pressure = power(index + 1.0).into_iter().map(|p| scale * p).collect();
    let mut variables = vec![("density", None, power(index)), ("pressure", None, pressure)];
    if file.datasets("/")?.iter().any(|d| d == "dtheta") {
        let slopes = column(file, "dtheta", Some(z.len()))?;
        let enclosed = z.iter().zip(slopes).map(|(z, slope)| -4.0 * PI * z * z * slope).collect();
        variables.push(("enclosed_mass", None, enclosed));
    }
    Ok(Model {
        nodes: z,
        length: None,
        variables,
        metadata: vec![("polytropic index".into(), index.to_string())],
        note: format!(
            "polytrope of index {index} without dimensions: lengths in r_n, densities in the central one, G = 1"
        ),
    })
}

fn star(file: &Reader, attributes: &Attributes, datasets: &[String]) -> Result<Model> {
    let nodes = radii(file, "r", attributes)?;
    let mass = attributes.number("M_star");
    let mut variables: Vec<(&'static str, Option<Unit>, Vec<f64>)> = Vec::new();
    for &(name, meaning, unit) in PROFILES {
        if !datasets.iter().any(|d| d == name) || variables.iter().any(|v| v.0 == meaning) {
            continue;
        }
        let values = match name {
            "w" => enclosed(file, mass)?,
            _ => column(file, name, Some(nodes.len()))?,
        };
        if values.len() != nodes.len() {
            let problem = format!("has {} values for {} radii", values.len(), nodes.len());
            return Err(file.input(format!("dataset '{name}'"), problem));
        }
        variables.push((meaning, Unit::parse(unit), values));
    }
    let scalars = [("mass (g)", "M_star"), ("photospheric radius (cm)", "R_star"), ("luminosity (erg/s)", "L_star")];
    let scalar = |(meaning, name): (&str, &str)| Some((meaning.to_owned(), attributes.number(name)?.to_string()));
    let version = attributes.number("version").unwrap_or(0.0) / 100.0;
    Ok(Model {
        nodes,
        length: Unit::parse("cm"),
        variables,
        metadata: scalars.into_iter().filter_map(scalar).chain([("version".into(), format!("{version:.2}"))]).collect(),
        note: format!(
            "GYRE model, GSM version {version:.2}: all profiles belong to the same radii{}",
            unknown(datasets)
        ),
    })
}

/// Datasets that no version of GSM has, which are not read: in words, if there are any.
fn unknown(datasets: &[String]) -> String {
    // Partial derivatives of opacity and energy generation are GSM's, too.
    let is_derivative = |name: &str| ["kap_", "eps_"].iter().any(|start| name.starts_with(start));
    let is_known = |name: &str| name == "r" || is_derivative(name) || PROFILES.iter().any(|profile| profile.0 == name);
    match datasets.iter().map(String::as_str).filter(|name| !is_known(name)).collect::<Vec<_>>() {
        unknown if unknown.is_empty() => String::new(),
        unknown => format!("; left out, as no model of GYRE has them: {}", unknown.join(", ")),
    }
}

/// Enclosed masses from w = m / (M - m), which is infinite or huge where all the mass is enclosed.
fn enclosed(file: &Reader, mass: Option<f64>) -> Result<Vec<f64>> {
    let Some(mass) = mass.filter(|m| m.is_finite() && *m > 0.0) else {
        return Err(file.input("attribute 'M_star'", "is missing or not a mass, which dataset 'w' needs"));
    };
    let Some((_, values)) = file.array("w")? else {
        return Err(file.input("dataset 'w'", "expected numbers"));
    };
    let fraction = |w: f64| if w.is_infinite() { 1.0 } else { w / (1.0 + w) };
    Ok(values.to_f64().into_iter().map(|w| mass * fraction(w)).collect())
}
