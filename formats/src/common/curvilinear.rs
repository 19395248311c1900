//! Grids in spherical (r, theta, phi) or cylindrical (R, phi, z) coordinates, recognized by the names of their axes.

use crate::model::{Coordinates, GridAxis};
use std::f64::consts::{PI, TAU};

/// What an axis of a curvilinear grid is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Along {
    /// From the center, or from the z axis.
    Radius,
    /// From the z axis, 0 to pi.
    Colatitude,
    Azimuth,
    Z,
}

/// Angles are the same up to this.
const SAME_ANGLE: f64 = 1e-6;

impl Along {
    /// By the name of a dimension or an array.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name.to_lowercase().as_str() {
            "r" | "rad" | "radius" | "radial" => Self::Radius,
            "theta" | "colatitude" | "colat" | "polar_angle" => Self::Colatitude,
            "phi" | "azimuth" | "azimuthal_angle" => Self::Azimuth,
            "z" => Self::Z,
            _ => return None,
        })
    }

    pub fn is_angle(self) -> bool {
        matches!(self, Self::Colatitude | Self::Azimuth)
    }
}

/// The coordinates that so many different axes make, and these axes in the order of the coordinates. Whether phi or z comes first
/// is as it is in `axes`; the order of the others does not matter.
pub fn coordinates(axes: &[Along]) -> Option<(Coordinates, [Along; 3])> {
    let has = |along: Along| axes.contains(&along);
    let first = axes.iter().find(|a| matches!(a, Along::Azimuth | Along::Z));
    let found = match (has(Along::Colatitude), first) {
        (true, _) if !has(Along::Z) => (Coordinates::Spherical, [Along::Radius, Along::Colatitude, Along::Azimuth]),
        (false, Some(Along::Z)) => (Coordinates::Cylindrical, [Along::Radius, Along::Z, Along::Azimuth]),
        (false, Some(_)) => (Coordinates::Polar, [Along::Radius, Along::Azimuth, Along::Z]),
        _ => return None,
    };
    (has(Along::Radius) && axes.len() > 1).then_some(found)
}

/// The three axes of cells that such a grid has: those that are there, with the faces of their cells, in the order of the
/// coordinates, and one cell along each of the others. Says where faces were made.
///
/// # Errors
/// The axis and what is wrong with it.
pub fn complete(axes: Vec<(Along, GridAxis)>) -> Result<(Coordinates, Vec<GridAxis>, Vec<String>), (String, String)> {
    let present: Vec<Along> = axes.iter().map(|(along, _)| *along).collect();
    let Some((coordinates, order)) = coordinates(&present) else {
        return Err(("axes".into(), format!("{present:?} make no grid that fills a volume or a plane")));
    };
    let mut notes = Vec::new();
    let mut all = Vec::new();
    for along in order {
        let mut axis = match axes.iter().find(|(a, _)| *a == along) {
            Some((_, axis)) => axis.clone(),
            None => whole(along),
        };
        if axis.bounds.is_none() {
            axis.bounds = Some(faces(along, &axis.nodes).map_err(|problem| (axis.name.clone(), problem))?);
            notes.push(format!("the faces of cells along '{}' are taken halfway between its nodes", axis.name));
        }
        all.push(axis);
    }
    Ok((coordinates, all, notes))
}

/// One cell: a plane, or all around the axis.
fn whole(along: Along) -> GridAxis {
    let (name, end) = if along == Along::Azimuth { ("phi", TAU) } else { ("z", 1.0) };
    GridAxis { name: name.into(), nodes: vec![0.5 * end], unit: None, bounds: Some(vec![0.0, end]) }
}

/// Halfway between nodes, and as far beyond the ends, but not past the center or the poles.
fn faces(along: Along, nodes: &[f64]) -> Result<Vec<f64>, String> {
    let (&[first, second, ..], &[.., before, last]) = (nodes, nodes) else {
        return Err(format!("has {} nodes, expected at least 2", nodes.len()));
    };
    if along == Along::Azimuth && (last - first - TAU).abs() < SAME_ANGLE {
        return Err(format!(
            "runs from {first} to {last}, so that its first and last nodes are the same place; leave the last one out, or give the faces of the cells"
        ));
    }
    let mut faces = vec![first - 0.5 * (second - first)];
    faces.extend(nodes.windows(2).map(|w| 0.5 * (w[0] + w[1])));
    faces.push(last + 0.5 * (last - before));
    let (lowest, highest) = match along {
        Along::Radius => (0.0, f64::INFINITY),
        Along::Colatitude => (0.0, PI),
        Along::Azimuth | Along::Z => return Ok(faces),
    };
    // Nodes that lie beyond are for the field to refuse.
    if first >= lowest && last <= highest + SAME_ANGLE {
        faces.iter_mut().for_each(|face| *face = face.clamp(lowest, highest));
    }
    Ok(faces)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(name: &str, nodes: &[f64]) -> (Along, GridAxis) {
        (Along::named(name).unwrap(), GridAxis { name: name.into(), nodes: nodes.into(), unit: None, bounds: None })
    }

    #[test]
    fn axes_that_lack_are_whole_cells_and_faces_stay_in_range() {
        let (kind, axes, notes) = complete(vec![axis("theta", &[0.0, 1.0, PI]), axis("r", &[0.25, 1.0])]).unwrap();
        assert_eq!(kind, Coordinates::Spherical);
        assert_eq!(axes[0].bounds, Some(vec![0.0, 0.625, 1.375]));
        assert_eq!(axes[1].bounds, Some(vec![0.0, 0.5, 0.5 * (1.0 + PI), PI]));
        assert_eq!(axes[2].bounds, Some(vec![0.0, TAU]));
        assert_eq!(notes.len(), 2);
    }

    #[test]
    fn axes_make_coordinates() {
        let kind = |names: &[&str]| {
            coordinates(&names.iter().map(|n| Along::named(n).unwrap()).collect::<Vec<_>>()).map(|c| c.0)
        };
        assert_eq!(kind(&["r", "theta", "phi"]), Some(Coordinates::Spherical));
        assert_eq!(kind(&["R", "phi"]), Some(Coordinates::Polar));
        assert_eq!(kind(&["R", "z"]), Some(Coordinates::Cylindrical));
        assert_eq!(kind(&["R", "z", "phi"]), Some(Coordinates::Cylindrical));
        assert_eq!(kind(&["R", "phi", "z"]), Some(Coordinates::Polar));
        assert_eq!(kind(&["theta", "phi"]), None);
        assert_eq!(kind(&["theta", "z", "r"]), None);
        assert_eq!(kind(&["r"]), None);
    }

    #[test]
    fn a_node_that_comes_twice_around_the_axis_is_refused() {
        let (name, problem) = complete(vec![axis("r", &[0.0, 1.0]), axis("phi", &[0.0, 3.0, TAU])]).unwrap_err();
        assert!(name == "phi" && problem.contains("the same place"), "{problem}");
    }
}
