//! Chooses the point of the result that is placed at the origin: by the scene, or by default as the format's data sheet states.

use super::frame::Frame;
use crate::error::{Error, Result};
use crate::scene::{Conversion, OriginInput, OriginName, Scene, values};
use crate::target::Positions;
use sph::domain::{Axis, Domain};
use sph::reduce;
use sph_formats::registry::{FixedCorner, Origin};
use sph_formats::{FormatSpec, UnitDimension};

/// How the note begins that says where the origin is.
pub const NOTE: &str = "the origin is";

/// What the scene asks for, else what the format wants of a body in vacuum; `None` where coordinates count from the corner of the
/// box as they always do.
pub fn wanted(scene: &Scene, format: Option<&FormatSpec>, (periodic, open): (bool, bool)) -> Option<OriginInput> {
    let by_format = || match format?.capabilities.origin {
        Origin::CenterOfMass if open && !periodic => Some(OriginInput::Named(OriginName::CenterOfMass)),
        _ => None,
    };
    scene.output.origin.clone().or_else(by_format)
}

/// Whether a domain is periodic along an axis, and whether there is vacuum beyond one.
pub fn closed_and_open<const D: usize>(domain: &Domain<D>) -> (bool, bool) {
    let open = |k: usize| !domain.has_faces(k) || domain.axes[k] == Axis::OPEN;
    (domain.axes.contains(&Axis::Periodic), (0..D).any(open))
}

/// Refuses an origin that the format or the box does not allow; `periodic` says which axes are.
///
/// # Errors
/// [`Error::Scene`] with the reason, and what to write instead.
pub fn refuse(scene: &Scene, format: Option<&FormatSpec>, periodic: &[bool]) -> Result<()> {
    let Some(origin) = &scene.output.origin else { return Ok(()) };
    let wrong = |problem: String| Err(Error::scene("output.origin", format!("is {origin}, {problem}")));
    if let OriginInput::Point(point) = origin
        && point.len() != periodic.len()
    {
        return wrong(format!("a point of {} coordinates, but the particles have {}", point.len(), periodic.len()));
    }
    let is_periodic = periodic.contains(&true);
    if *origin == OriginInput::Named(OriginName::CenterOfMass) && is_periodic {
        return wrong(
            "but matter that repeats along a periodic axis has no center of mass; choose center, corner, input or a point".into(),
        );
    }
    let Some(format) = format.filter(|_| *origin != OriginInput::Named(OriginName::Corner)) else { return Ok(()) };
    let (name, remedy) = (format.name, "leave it out, or write another format");
    match format.capabilities.corner {
        FixedCorner::Everywhere => {
            wrong(format!("but coordinates of '{name}' go from 0 to the edge of the box; {remedy}"))
        }
        FixedCorner::Periodic if is_periodic => {
            wrong(format!("but '{name}' states of a periodic box its edge alone, so that its corner is at 0; {remedy}"))
        }
        _ => Ok(()),
    }
}

/// Farthest point from the domain in units of its size: farther away rounding moves particles.
const FAR: f64 = 1e9;

/// Refuses a point so far away that coordinates would not tell particles apart. `domain` is in internal units, of which `length`
/// of the input's are one; `conversion` is that of the scene's numbers to the input's.
///
/// # Errors
/// The point, and how far it is.
pub fn refuse_far<const D: usize>(
    scene: &Scene,
    domain: &Domain<D>,
    (conversion, length): (&Conversion, f64),
) -> Result<()> {
    let Some(OriginInput::Point(point)) = &scene.output.origin else { return Ok(()) };
    let point = values("output.origin", point, UnitDimension::LENGTH, conversion)?;
    let middle = domain.center();
    let off = |k: usize| (point.get(k).copied().unwrap_or(0.0) / length - middle[k]).abs() / domain.size();
    let far = (0..D).map(off).fold(0.0, f64::max);
    if far <= FAR {
        return Ok(());
    }
    let problem = format!(
        "is {far:.1e} times the size of the domain away from it: rounding would move the particles; name a nearer point"
    );
    Err(Error::scene("output.origin", problem))
}

/// The point in internal units. `conversion` is that of the scene's numbers to the output's, of which `length` are one internal
/// unit; `all` are lists of places with masses.
///
/// # Errors
/// A point with units that cannot be converted.
pub(super) fn point<const D: usize>(
    origin: &OriginInput,
    frame: &Frame<D>,
    (conversion, length): (&Conversion, f64),
    all: &[(&Positions<D>, &[f64])],
) -> Result<[f64; D]> {
    Ok(match origin {
        OriginInput::Named(OriginName::Corner) => frame.lower_corner(),
        OriginInput::Named(OriginName::Center) => {
            let corner = frame.lower_corner();
            sph::array(|k| corner[k] + 0.5 * frame.box_size[k])
        }
        OriginInput::Named(OriginName::Input) => [0.0; D],
        OriginInput::Named(OriginName::CenterOfMass) => {
            let total: f64 = all.iter().map(|(_, m)| reduce::sum(m.len(), |i| m[i])).sum();
            let moment = |k: usize| all.iter().map(|(x, m)| reduce::sum(m.len(), |i| m[i] * x[k][i])).sum::<f64>();
            sph::array(|k| moment(k) / total)
        }
        OriginInput::Point(point) => {
            let point = values("output.origin", point, UnitDimension::LENGTH, conversion)?;
            sph::array(|k| point.get(k).copied().unwrap_or(0.0) / length)
        }
    })
}

/// The same for several bodies, in the output's units: from the corner and edges of their box, and their center of mass.
///
/// # Errors
/// As for a single one.
pub fn among_bodies(
    origin: &OriginInput,
    (lo, edges, center): ([f64; 3], [f64; 3], [f64; 3]),
    conversion: &Conversion,
) -> Result<[f64; 3]> {
    Ok(match origin {
        OriginInput::Named(OriginName::Corner) => lo,
        OriginInput::Named(OriginName::Center) => sph::array(|k| lo[k] + 0.5 * edges[k]),
        OriginInput::Named(OriginName::CenterOfMass) => center,
        OriginInput::Named(OriginName::Input) => [0.0; 3],
        OriginInput::Point(point) => {
            let point = values("output.origin", point, UnitDimension::LENGTH, conversion)?;
            sph::array(|k| point.get(k).copied().unwrap_or(0.0))
        }
    })
}

/// What is said of it: `at` is where it is in the coordinates of the input, in the output's units.
pub(super) fn describe(origin: &OriginInput, at: &[f64], (corner, edges): (&[f64], &[f64])) -> String {
    let list = |numbers: Vec<f64>| numbers.iter().map(|x| format!("{:.6e}", x + 0.0)).collect::<Vec<_>>().join(", ");
    let what = match origin {
        OriginInput::Named(OriginName::Corner) => "the lower corner of the box",
        OriginInput::Named(OriginName::Center) => "the middle of the box",
        OriginInput::Named(OriginName::CenterOfMass) => "the center of mass",
        OriginInput::Named(OriginName::Input) => "that of the input",
        OriginInput::Point(_) => "the point that output.origin names",
    };
    let end = corner.iter().zip(edges).map(|(c, edge)| c + edge).collect();
    format!(
        "{NOTE} {what}, [{}] of the input; the box goes from [{}] to [{}] (output.origin)",
        list(at.to_vec()),
        list(corner.to_vec()),
        list(end)
    )
}
