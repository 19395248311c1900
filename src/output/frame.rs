//! Position and units of the result: the box of the output, and factors from internal units to those of the file.

use crate::error::Result;
use crate::field::RadialSource;
use crate::input::internal_units::Prepared;
use crate::input::units::InputUnits;
use crate::scene::system_of;
use crate::target::Positions;
use sph::domain::{Axis, Domain};
use sph::parallel;
use sph_formats::{UnitDimension, UnitSystem};

/// Output units per internal unit.
pub struct Factors {
    pub length: f64,
    pub mass: f64,
    pub density: f64,
    /// Output units of mass per input unit.
    pub input_mass: f64,
}

impl Factors {
    /// From internal units to `out`, with the input in `units` or in numbers without any.
    pub(crate) fn new<const D: usize>(units: Option<InputUnits>, prepared: &Prepared<D>, out: &UnitSystem) -> Self {
        let (length, density) = units
            .map_or((1.0, 1.0), |u| (u.length / out.length, u.density / out.to_cgs(UnitDimension::mass_density(3))));
        let input_mass = density * length.powi(D as i32);
        let mass = prepared.mass.value * input_mass;
        let size = prepared.length * length;
        Self { length: size, mass, density: mass / size.powi(D as i32), input_mass }
    }
}

/// The unit system of the output, and a note where it was chosen or hides what numbers are in: the one `named`, or the one that suits a body of `mass`
/// (in the input's units) in `d` dimensions.
///
/// # Errors
/// A name that is none.
pub fn output_units(
    named: Option<&str>,
    units: Option<InputUnits>,
    mass: f64,
    d: usize,
) -> Result<(UnitSystem, Option<String>)> {
    if let Some(name) = named {
        let system = system_of("output.units", name)?;
        let note = "output.units is code, which is cgs where the input's units are known";
        return Ok((system, (name == "code" && units.is_some()).then(|| note.to_owned())));
    }
    let Some(units) = units else { return Ok((UnitSystem::CODE, None)) };
    if d < 3 {
        return Ok((UnitSystem::cgs(), None));
    }
    let grams = mass * units.density * units.length.powi(3);
    let (name, system) = match grams {
        g if !(1e22..1e50).contains(&g) => ("cgs", UnitSystem::cgs()),
        g if g < 1e30 => ("planetary", UnitSystem::planetary()),
        g if g < 1e38 => ("solar", UnitSystem::solar()),
        _ => ("galactic", UnitSystem::galactic()),
    };
    let note = format!("output is in {name} units, which suit a mass of {grams:.3e} g (set output.units for others)");
    Ok((system, Some(note)))
}

/// The radial source with its center times `factor`.
pub fn radial_in<const D: usize>(radial: Option<&RadialSource<D>>, factor: f64) -> Option<RadialSource<D>> {
    let mut radial = radial?.clone();
    radial.center = radial.center.map(|v| v * factor);
    Some(radial)
}

/// Where the domain lies in the box of the output, in internal units.
pub struct Frame<const D: usize> {
    /// Added to coordinates.
    shift: [f64; D],
    pub box_size: [f64; 3],
    periodic: [bool; D],
    pub isolated: bool,
    /// The point that is at the origin of the output, where it is chosen.
    origin: Option<[f64; D]>,
}

impl<const D: usize> Frame<D> {
    /// Axes with vacuum beyond get `box_factor` times the body's extent, the same on all of them; others keep
    /// theirs, with the corner at the origin.
    pub fn new(domain: &Domain<D>, box_factor: f64) -> Self {
        let open: [bool; D] = sph::array(|k| !domain.has_faces(k) || domain.axes[k] == Axis::OPEN);
        let edge = box_factor * domain.size();
        let mut frame = Self {
            shift: [0.0; D],
            box_size: [0.0; 3],
            periodic: domain.axes.map(|a| a == Axis::Periodic),
            isolated: open.contains(&true),
            origin: None,
        };
        for k in 0..D {
            let extent = domain.hi[k] - domain.lo[k];
            frame.box_size[k] = if open[k] { edge } else { extent };
            frame.shift[k] = 0.5 * (frame.box_size[k] - extent) - domain.lo[k];
        }
        frame
    }

    /// With a point of the input's coordinates at the origin.
    pub(super) fn with_origin(self, origin: Option<[f64; D]>) -> Self {
        Self { origin, ..self }
    }

    /// The lower corner of the box in the coordinates of the input.
    pub(crate) fn lower_corner(&self) -> [f64; D] {
        self.shift.map(|s| 0.0 - s)
    }

    /// The point that is at the origin of the output, times `factor`, where it is chosen.
    pub(super) fn origin(&self, factor: f64) -> Option<[f64; D]> {
        Some(self.origin?.map(|x| x * factor))
    }

    /// The lower corner of the box in the coordinates of the output times `factor`, where their origin is chosen.
    pub fn corner(&self, factor: f64) -> Option<[f64; D]> {
        let origin = self.origin?;
        Some(sph::array(|k| (0.0 - self.shift[k] - origin[k]) * factor))
    }

    /// Interleaved coordinates in the box of the output, times `factor`: from 0 on, unless an origin is chosen.
    pub fn coordinates(&self, positions: &Positions<D>, factor: f64) -> Vec<f64> {
        let origin = self.origin.unwrap_or_else(|| self.lower_corner());
        let corner = self.corner(factor).unwrap_or([0.0; D]);
        let mut out = vec![[0.0; D]; positions[0].len()];
        parallel::update(&mut out, |i, out| {
            for k in 0..D {
                let end = corner[k] + self.box_size[k] * factor;
                let x = (positions[k][i] - origin[k]) * factor;
                out[k] = match x < end {
                    true => x.max(corner[k]),
                    false if self.periodic[k] => corner[k],
                    false => end.next_down(),
                };
            }
        });
        out.into_flattened()
    }
}
