//! What an axis is, from what CF and custom say of it.

use crate::units::{Unit, UnitDimension};
use netcdf_reader::{NcFile, NcVariable};

/// Meaning of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    X,
    Y,
    Z,
    Radius,
    Longitude,
    Latitude,
    /// Depth, height, pressure or another vertical that is no radius.
    Vertical,
    Time,
    Unknown,
}

/// One dimension of a variable with its coordinates.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub name: String,
    pub role: Role,
    pub nodes: Vec<f64>,
    /// Whether the nodes are only indices.
    pub indexed: bool,
    pub unit: Option<Unit>,
    /// Name of the CF bounds variable.
    pub bounds: Option<String>,
}

/// A text attribute, lowercase.
fn hint(v: &NcVariable, name: &str) -> String {
    text(v, name).unwrap_or_default().to_ascii_lowercase()
}

pub(super) fn text(v: &NcVariable, name: &str) -> Option<String> {
    v.attribute(name).and_then(|a| a.value.as_string())
}

/// The unit of a variable, where it states one that is understood.
pub(super) fn unit(v: &NcVariable) -> Option<Unit> {
    Unit::parse(&text(v, "units")?)
}

fn role(v: Option<&NcVariable>, dimension: &str) -> Role {
    let name = dimension.to_ascii_lowercase();
    let by_name = match name.as_str() {
        "r" | "radius" | "rad" => Role::Radius,
        "x" | "nx" => Role::X,
        "y" | "ny" => Role::Y,
        "z" | "nz" => Role::Z,
        "lon" | "longitude" => Role::Longitude,
        "lat" | "latitude" => Role::Latitude,
        "depth" | "lev" | "level" | "height" | "altitude" => Role::Vertical,
        "time" | "t" => Role::Time,
        _ => Role::Unknown,
    };
    let Some(v) = v else { return by_name };
    let (units, standard) = (hint(v, "units"), hint(v, "standard_name"));
    if units.contains(" since ") || standard == "time" || hint(v, "axis") == "t" {
        return Role::Time;
    }
    if units.starts_with("degree") && (units.ends_with('e') || units.ends_with("east")) || standard == "longitude" {
        return Role::Longitude;
    }
    if units.starts_with("degree") && (units.ends_with('n') || units.ends_with("north")) || standard == "latitude" {
        return Role::Latitude;
    }
    if by_name == Role::Radius || standard == "radius" || hint(v, "long_name").starts_with("radius") {
        return Role::Radius;
    }
    if !hint(v, "positive").is_empty() || matches!(standard.as_str(), "depth" | "height" | "altitude") {
        return Role::Vertical;
    }
    match (by_name, hint(v, "axis").as_str(), standard.as_str()) {
        (Role::Unknown, "x", _) | (_, _, "projection_x_coordinate") => Role::X,
        (Role::Unknown, "y", _) | (_, _, "projection_y_coordinate") => Role::Y,
        (Role::Unknown, "z", _) => Role::Z,
        (found, _, _) => found,
    }
}

/// Axes of a variable in the file's order. A dimension without a coordinate variable counts 0, 1, 2 ...
///
/// # Errors
/// Name of the coordinate variable and what the library says.
pub(super) fn axes_of(file: &NcFile, v: &NcVariable) -> Result<Vec<Axis>, (String, String)> {
    v.dimensions
        .iter()
        .map(|d| {
            let variables = file.variables().map_err(|e| (d.name.clone(), e.to_string()))?;
            let coordinate = variables.iter().find(|c| c.name == d.name && c.dimensions.len() == 1);
            let nodes = match coordinate {
                Some(c) => file
                    .read_variable_unpacked_masked(&c.name)
                    .map_err(|e| (c.name.clone(), e.to_string()))?
                    .into_iter()
                    .collect(),
                None => (0..d.size).map(|i| i as f64).collect(),
            };
            Ok(Axis {
                name: d.name.clone(),
                role: role(coordinate, &d.name),
                nodes,
                indexed: coordinate.is_none(),
                unit: coordinate.and_then(unit).filter(|u| u.dimension == UnitDimension::LENGTH),
                bounds: coordinate.and_then(|c| text(c, "bounds")),
            })
        })
        .collect()
}
