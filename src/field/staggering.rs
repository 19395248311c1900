//! Determines where the rows of a radial table lie, from the mass that the file states in addition to radius and density.
//!
//! Stellar codes put radius and enclosed mass at the faces of zones and the density between them; tables of their models
//! look like values at points all the same. Taken as such they hold a mass that is wrong to first order in the zones'
//! width. Of the ways to read the rows, the right one gives each zone the mass that the mass column gives it.

use super::RadialProfile;
use super::options::Staggering;
use crate::error::{Error, Result};
use sph::geometry::unit_ball_volume;

/// Largest error of the masses of zones, in the median, and of their sum, with which a budget closes.
const ZONES_CLOSE: f64 = 0.02;
const TOTAL_CLOSES: f64 = 0.01;
/// Readings whose errors differ by less are as good as each other: then that counts which the file's kind suggests.
const NOT_MUCH_WORSE: f64 = 3.0;
/// Groups of zones whose masses are compared.
const GROUPS: f64 = 50.0;
/// Fewer zones than these tell nothing.
const LEAST_ZONES: usize = 8;

/// The rows of a table, outwards.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    pub radii: Vec<f64>,
    pub density: Vec<f64>,
    /// Where the first row's zone begins if its radius is the outer face's.
    pub start: f64,
    /// How the reader understands them.
    pub read_as: Staggering,
}

/// The mass that a file states.
#[derive(Debug, Clone)]
pub(crate) struct Budget {
    /// The variable's name.
    pub name: String,
    /// Mass between the row before and each row, the first row's from the start; or of each row's own zone.
    pub zones: Vec<f64>,
    pub is_of_rows: bool,
    /// The unit of density times cubed radius in that of the mass, where both are known.
    pub unit: Option<f64>,
    /// Whether the file states those units: then a mass that is off by a factor is a mistake.
    pub is_stated: bool,
}

/// How well a reading meets the budget.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Closure {
    pub staggering: Staggering,
    /// Relative error of the masses of (groups of) zones in the median.
    pub zones: f64,
    /// Relative error of their sum.
    pub total: f64,
    /// Mass that the budget states per mass of density times volume, beside the units.
    pub factor: f64,
}

impl Closure {
    fn closes(&self) -> bool {
        self.zones <= ZONES_CLOSE && self.total.abs() <= TOTAL_CLOSES
    }

    fn score(&self) -> f64 {
        self.zones.max(self.total.abs())
    }
}

impl std::fmt::Display for Closure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.1e} in the median of the zones, {:.1e} in all", self.zones, self.total)
    }
}

/// How the rows are to be read: told by the shape of the masses over the radius first, since a wrong unit must not pass for
/// another place of the rows, then by their sum. `None` where the zones are too few.
///
/// # Errors
/// A budget that no reading meets, or all but a factor that the stated units leave no room for.
pub(crate) fn infer(rows: &Rows, budget: &Budget) -> Result<Option<Closure>> {
    if budget.zones.iter().filter(|m| **m > 0.0).count() < LEAST_ZONES {
        return Ok(None);
    }
    let by_shape: Vec<Closure> = Staggering::ALL.iter().filter_map(|s| compared(rows, budget, *s, None)).collect();
    let least = by_shape.iter().map(|c| c.zones).fold(f64::INFINITY, f64::min);
    if !(least <= ZONES_CLOSE) {
        return Err(shape_error(budget, &by_shape));
    }
    let alike: Vec<Staggering> =
        by_shape.iter().filter(|c| c.zones <= NOT_MUCH_WORSE * least).map(|c| c.staggering).collect();
    let closing = |unit: Option<f64>| {
        let all = alike.iter().filter_map(|s| compared(rows, budget, *s, unit)).filter(Closure::closes);
        preferred(rows, &all.collect::<Vec<_>>())
    };
    match budget.unit.and_then(|unit| closing(Some(unit))).or_else(|| closing(None)) {
        Some(found) if budget.is_stated && Some(found.factor) != budget.unit => Err(unit_error(budget, &found)),
        found => Ok(found),
    }
}

/// How well one reading meets the budget, by the units that are known or else in shape.
pub(crate) fn closure(rows: &Rows, budget: &Budget, staggering: Staggering) -> Option<Closure> {
    compared(rows, budget, staggering, budget.unit).or_else(|| compared(rows, budget, staggering, None))
}

/// The reading that the reader suggests, or the best where that is much better.
fn preferred(rows: &Rows, all: &[Closure]) -> Option<Closure> {
    let best = all.iter().min_by(|a, b| a.score().total_cmp(&b.score()))?;
    let own = all.iter().find(|c| c.staggering == rows.read_as);
    Some(*own.filter(|own| own.score() <= NOT_MUCH_WORSE * best.score()).unwrap_or(best))
}

/// The masses as the reading has them against those of the budget, zones in groups: of neighbors' masses in few digits the
/// difference is lost.
fn compared(rows: &Rows, budget: &Budget, staggering: Staggering, unit: Option<f64>) -> Option<Closure> {
    let (held, stated) = zone_masses(rows, budget, staggering);
    let sums = (held.iter().sum::<f64>(), stated.iter().sum::<f64>());
    let factor = unit.unwrap_or(sums.1 / sums.0);
    if !(factor > 0.0 && factor.is_finite()) {
        return None;
    }
    let mut group = (0.0, 0.0);
    let mut errors = Vec::new();
    for (p, m) in held.iter().zip(&stated) {
        group = (group.0 + p, group.1 + m);
        if group.1 > 0.0 && group.1 >= sums.1 / GROUPS {
            errors.push((group.0 * factor / group.1 - 1.0).abs());
            group = (0.0, 0.0);
        }
    }
    errors.sort_unstable_by(f64::total_cmp);
    let zones = *errors.get(errors.len() / 2)?;
    Some(Closure { staggering, zones, total: sums.0 * factor / sums.1 - 1.0, factor })
}

/// Masses of the zones in units of density times cubed radius, and as the budget states them.
fn zone_masses(rows: &Rows, budget: &Budget, staggering: Staggering) -> (Vec<f64>, Vec<f64>) {
    let Rows { radii, density, start, .. } = rows;
    let shell = |inner: f64, outer: f64, rho: f64| rho * unit_ball_volume(3) * (outer.powi(3) - inner.powi(3));
    let cells =
        |faces: &[f64]| -> Vec<f64> { faces.windows(2).zip(density).map(|(f, rho)| shell(f[0], f[1], *rho)).collect() };
    match staggering {
        Staggering::Nodes => {
            let profile = RadialProfile::from_nodes(3, radii, density);
            let mut before = 0.0;
            let held = radii.iter().map(|r| {
                let enclosed = profile.enclosed_mass(*r);
                let zone = enclosed - before;
                before = enclosed;
                zone
            });
            (held.collect(), budget.zones.clone())
        }
        Staggering::OuterFaces => {
            let faces: Vec<f64> = std::iter::once(*start).chain(radii.iter().copied()).collect();
            (cells(&faces), budget.zones.clone())
        }
        Staggering::InnerFaces => {
            let between: Vec<f64> = cells(radii);
            if budget.is_of_rows {
                return (between, budget.zones[..radii.len() - 1].to_vec());
            }
            let inner = shell(0.0, radii[0], density[0]);
            (std::iter::once(inner).chain(between).collect(), budget.zones.clone())
        }
        Staggering::Centers => (cells(&middle_faces(rows)), budget.zones.clone()),
    }
}

/// Faces in the middle between centers.
pub(crate) fn middle_faces(rows: &Rows) -> Vec<f64> {
    let radii = &rows.radii;
    let mut faces = vec![0.0];
    faces.extend(radii.windows(2).map(|r| 0.5 * (r[0] + r[1])));
    let last = radii[radii.len() - 1];
    faces.push(2.0 * last - faces[faces.len() - 1]);
    faces
}

/// Faces between which the rows' zones have the masses of the budget, if each row's radius lies in its zone.
pub(crate) fn faces_of_masses(rows: &Rows, budget: &Budget, closure: &Closure) -> Option<Vec<f64>> {
    let mut faces = vec![0.0_f64];
    let mut cube = 0.0_f64;
    for ((mass, rho), center) in budget.zones.iter().zip(&rows.density).zip(&rows.radii) {
        cube += mass / (closure.factor * rho * unit_ball_volume(3));
        let face = cube.cbrt();
        if !(face.is_finite() && *center >= faces[faces.len() - 1] && *center <= face) {
            return None;
        }
        faces.push(face);
    }
    Some(faces)
}

fn unit_error(budget: &Budget, found: &Closure) -> Error {
    let unit = budget.unit.unwrap_or(1.0);
    Error::field(
        &budget.name,
        format!(
            "is {:.6e} times the mass of radius and density in the units that the file states, zone by zone (rows read as {}), \
             expected 1 within {TOTAL_CLOSES}: correct the units (input.length_unit, input.density_unit), or skip this check by \
             input.staggering (--staggering {})",
            found.factor / unit,
            found.staggering.name(),
            found.staggering.name(),
        ),
    )
}

fn shape_error(budget: &Budget, tried: &[Closure]) -> Error {
    let best = tried.iter().min_by(|a, b| a.zones.total_cmp(&b.zones));
    let off = |b: &Closure| {
        format!(", nearest as {}: masses are off by {:.1e} in the median of the zones", b.staggering.name(), b.zones)
    };
    let reached = best.map_or(String::new(), off);
    let names: Vec<&str> = Staggering::ALL.iter().map(|s| s.name()).collect();
    Error::field(
        &budget.name,
        format!(
            "does not fit radius and density however the rows are read{reached}, expected at most {ZONES_CLOSE}: \
             correct the columns, or say where the rows lie by input.staggering (--staggering {})",
            names.join(", ")
        ),
    )
}
