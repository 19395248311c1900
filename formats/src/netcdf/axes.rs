//! The meaning of a coordinate variable by CF conventions, and its nodes in ascending order.
//!
//! Roles come from `axis`, `standard_name`, `units` (`degrees_north`, `days since ...`), `positive`, and last
//! from the name; never from the order of dimensions. CF: <https://cfconventions.org>, chapters 4 and 5.

use crate::common::curvilinear::Along;
use netcdf_reader::NcVariable;

/// Meaning of one dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    X,
    Y,
    Z,
    Radius,
    Longitude,
    Latitude,
    /// From the z axis.
    Colatitude,
    /// Around the z axis.
    Azimuth,
    /// Downward from a surface.
    Depth,
    /// Upward from a surface, where the other axes are longitude and latitude.
    Height,
    Time,
}

impl Role {
    /// Where a grid is curvilinear.
    pub fn along(self) -> Option<Along> {
        Some(match self {
            Self::Radius => Along::Radius,
            Self::Colatitude => Along::Colatitude,
            Self::Azimuth => Along::Azimuth,
            Self::Z => Along::Z,
            _ => return None,
        })
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Radius => "radius",
            Self::Longitude => "longitude",
            Self::Latitude => "latitude",
            Self::Colatitude => "theta",
            Self::Azimuth => "phi",
            Self::Depth => "depth",
            Self::Height => "height",
            Self::Time => "time",
        }
    }
}

const RADIUS_NAMES: &[&str] = &["r", "rad", "radius", "radial", "radial_coordinate", "radii"];
const LONGITUDE_NAMES: &[&str] = &["lon", "long", "longitude"];
const LATITUDE_NAMES: &[&str] = &["lat", "latitude"];
const DEPTH_NAMES: &[&str] = &["depth", "dep"];
const TIME_NAMES: &[&str] = &["t", "time", "record"];

/// The text of an attribute.
pub fn text(variable: &NcVariable, name: &str) -> Option<String> {
    let value = variable.attribute(name)?.value.as_string()?;
    let value = value.trim_end_matches('\0').trim();
    (!value.is_empty()).then(|| value.to_owned())
}

/// The role of a dimension of this name with this coordinate variable; `None` where neither tells.
pub fn role(dimension: &str, variable: Option<&NcVariable>) -> Option<Role> {
    let attribute = |name: &str| variable.and_then(|v| text(v, name));
    let units = attribute("units").unwrap_or_default().to_lowercase();
    let standard = attribute("standard_name").unwrap_or_default().to_lowercase();
    if units.contains(" since ") || standard == "time" {
        return Some(Role::Time);
    }
    by_standard_name(&standard)
        .or_else(|| by_units(&units))
        .or_else(|| by_name(dimension))
        .or_else(|| by_positive(&attribute("positive").unwrap_or_default()))
        .or_else(|| by_axis(&attribute("axis").unwrap_or_default()))
        .or_else(|| by_long_name(&attribute("long_name").unwrap_or_default().to_lowercase()))
}

fn by_standard_name(name: &str) -> Option<Role> {
    Some(match name {
        "longitude" | "grid_longitude" => Role::Longitude,
        "latitude" | "grid_latitude" => Role::Latitude,
        "depth" | "depth_below_geoid" | "depth_below_sea_surface" => Role::Depth,
        "height" | "altitude" | "height_above_reference_ellipsoid" => Role::Height,
        "projection_x_coordinate" => Role::X,
        "projection_y_coordinate" => Role::Y,
        "radius" | "radial_distance" => Role::Radius,
        _ => return None,
    })
}

fn by_units(units: &str) -> Option<Role> {
    let letters: String = units.chars().filter(|c| c.is_ascii_alphabetic()).collect();
    match letters.as_str() {
        "degreesnorth" | "degreenorth" | "degreesn" | "degreen" => Some(Role::Latitude),
        "degreeseast" | "degreeeast" | "degreese" | "degreee" => Some(Role::Longitude),
        _ => None,
    }
}

fn by_name(name: &str) -> Option<Role> {
    let name = name.to_lowercase();
    let is = |list: &[&str]| list.contains(&name.as_str());
    Some(match name.as_str() {
        "x" => Role::X,
        "y" => Role::Y,
        "z" => Role::Z,
        "altitude" | "height" => Role::Height,
        _ if is(RADIUS_NAMES) => Role::Radius,
        _ if is(LONGITUDE_NAMES) => Role::Longitude,
        _ if is(LATITUDE_NAMES) => Role::Latitude,
        _ if is(DEPTH_NAMES) => Role::Depth,
        _ if is(TIME_NAMES) => Role::Time,
        _ => return by_direction(&name),
    })
}

fn by_direction(name: &str) -> Option<Role> {
    match Along::named(name)? {
        Along::Colatitude => Some(Role::Colatitude),
        Along::Azimuth => Some(Role::Azimuth),
        // Known by name already.
        Along::Radius | Along::Z => None,
    }
}

fn by_positive(positive: &str) -> Option<Role> {
    match positive.to_lowercase().as_str() {
        "down" => Some(Role::Depth),
        "up" => Some(Role::Z),
        _ => None,
    }
}

fn by_axis(axis: &str) -> Option<Role> {
    match axis.to_uppercase().as_str() {
        "X" => Some(Role::X),
        "Y" => Some(Role::Y),
        "Z" => Some(Role::Z),
        "T" => Some(Role::Time),
        _ => None,
    }
}

fn by_long_name(name: &str) -> Option<Role> {
    let first = name.split([' ', ';', '_']).next().unwrap_or_default();
    match first {
        "radius" | "radial" => Some(Role::Radius),
        _ => None,
    }
}

/// How the nodes of an axis may run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Steps {
    Strict,
    /// Equal neighbors mark a jump.
    Jumps,
}

/// Puts nodes in ascending order; tells whether they were descending.
///
/// # Errors
/// What is wrong, with the index (from 0) at which it shows.
pub fn ascending(mut nodes: Vec<f64>, steps: Steps) -> Result<(Vec<f64>, bool), String> {
    if let Some(i) = nodes.iter().position(|x| !x.is_finite()) {
        return Err(format!("value {i} is {}, expected a finite coordinate", nodes[i]));
    }
    let flipped = matches!((nodes.first(), nodes.last()), (Some(a), Some(b)) if a > b);
    if flipped {
        nodes.reverse();
    }
    let count = nodes.len();
    let wrong = nodes.windows(2).position(|pair| match steps {
        Steps::Strict => pair[0] >= pair[1],
        Steps::Jumps => pair[0] > pair[1],
    });
    let thrice = (steps == Steps::Jumps).then(|| nodes.windows(3).position(|w| w[0] == w[2])).flatten();
    let original = |i: usize| if flipped { count - 1 - i } else { i };
    if let Some(i) = wrong {
        let (a, b) = (original(i), original(i + 1));
        let (first, second) = (a.min(b), a.max(b));
        let at = |k: usize| nodes[original(k)];
        return Err(format!(
            "values {first} and {second} are {} and {}, expected strictly {} coordinates; sort or merge them",
            at(first),
            at(second),
            if flipped { "descending" } else { "ascending" }
        ));
    }
    if let Some(i) = thrice {
        return Err(format!("the coordinate {} comes three times, expected at most twice (a jump)", nodes[i]));
    }
    Ok((nodes, flipped))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn descending_nodes_are_turned_and_faults_keep_the_file_s_index() {
        assert_eq!(ascending(vec![3.0, 2.0, 0.5], Steps::Strict), Ok((vec![0.5, 2.0, 3.0], true)));
        let text = ascending(vec![5.0, 4.0, 4.0, 1.0], Steps::Strict).unwrap_err();
        assert!(text.starts_with("values 1 and 2 are 4 and 4"), "{text}");
        let text = ascending(vec![0.0, 1.0, 0.5, 2.0], Steps::Jumps).unwrap_err();
        assert!(text.starts_with("values 1 and 2 are 1 and 0.5"), "{text}");
        assert!(ascending(vec![0.0, 1.0, 1.0, 2.0], Steps::Jumps).is_ok());
        assert!(ascending(vec![0.0, 1.0, 1.0, 1.0], Steps::Jumps).is_err());
        assert!(ascending(vec![0.0, f64::NAN], Steps::Jumps).is_err());
    }

    #[test]
    fn names_tell_a_role_where_attributes_do_not() {
        assert_eq!(role("R", None), Some(Role::Radius));
        assert_eq!(role("lat", None), Some(Role::Latitude));
        assert_eq!(role("level", None), None);
    }
}
