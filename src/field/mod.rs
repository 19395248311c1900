//! Interpolants: what a file's numbers, or an expression, say at any point.
//!
//! | input | interpolant | mass |
//! |---|---|---|
//! | radial profile, nodes | monotone cubic in `ln rho` or `rho` ([`RadialProfile`]) | quadrature per segment |
//! | radial profile, cells | monotone cubic of the enclosed mass | exact per cell |
//! | grid | multilinear, constant per cell, or limited cubic | closed form; cells for cubic |
//! | mesh | isoparametric shape functions, constant per cell | exact per cell |
//! | point cloud | Shepard's weights over the nearest points | adaptive cubature |
//! | expression | [`Expression`] | adaptive cubature |
//!
//! Numbers stay in the file's units and precision. [`Source::scaled`] changes units without copying data.

// Loops over dimensions index several arrays of length D at once.
#![allow(clippy::needless_range_loop)]

mod analytic;
mod build;
mod build_grid;
mod build_radial;
mod bvh;
mod categorical;
mod check;
mod cloud;
mod cubature;
mod curve;
mod expression;
mod geographic;
mod grid;
mod grid_axis;
mod hull;
mod intervals;
mod mass;
mod mesh;
mod profile;
pub(crate) mod quadrature;
mod radial;
mod sampled;
mod scaled;
mod shapes;
mod skin;
#[cfg(test)]
pub(crate) mod testing;

pub use analytic::{AnalyticCarried, AnalyticField};
pub use build::{from_raw, natural_dimension};
pub use expression::Expression;
pub use hull::MeshHull;
pub use mass::total_mass;
pub use profile::RadialProfile;

use sph::domain::Domain;
use sph_formats::Unit;
use std::sync::Arc;

/// A mass with the error of its quadrature (same unit, absolute).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassEstimate {
    pub value: f64,
    pub error: f64,
}

/// A scalar field: a mass density, a spacing, a number density.
pub trait ScalarField<const D: usize>: Send + Sync {
    /// Value at `x`: finite and, for a density, never negative; 0 outside the field's support.
    fn value(&self, x: &[f64; D]) -> f64;

    /// The point on the distance from which alone the field depends, where there is one: its gradient then takes
    /// one difference instead of D.
    fn center(&self) -> Option<[f64; D]> {
        None
    }

    /// The integral over `domain` where this interpolant knows it better than sampling would.
    fn integral(&self, domain: &Domain<D>) -> Option<MassEstimate> {
        let _ = domain;
        None
    }
}

/// What a carried variable is.
#[derive(Debug, Clone, PartialEq)]
pub struct CarriedInfo {
    pub name: String,
    pub unit: Option<Unit>,
    /// 1 for a scalar, D for a vector.
    pub components: usize,
}

/// A variable that rides along with the density.
pub trait CarriedField<const D: usize>: Send + Sync {
    fn info(&self) -> &CarriedInfo;
    /// Writes the `components` values at `x`, clamped to the nearest point of the field's support.
    fn evaluate(&self, x: &[f64; D], out: &mut [f64]);
}

/// A radial profile and where its center lies: what shell-wise seeds and the cut of an atmosphere need.
#[derive(Debug, Clone)]
pub struct RadialSource<const D: usize> {
    pub profile: Arc<RadialProfile>,
    pub center: [f64; D],
}

/// Everything that placement needs to know of an input.
pub struct Source<const D: usize> {
    /// Mass density, in the input's own units.
    pub density: Box<dyn ScalarField<D>>,
    pub carried: Vec<Box<dyn CarriedField<D>>>,
    /// Where the input is defined: the default domain.
    pub domain: Domain<D>,
    /// Exact or better-than-quadrature mass within `domain`, where the interpolant knows it.
    pub mass: Option<MassEstimate>,
    /// The profile itself, where the density is a function of the radius alone.
    pub radial: Option<RadialSource<D>>,
    /// Decisions of the interpolant, for the report.
    pub notes: Vec<String>,
}

/// How values between nodes are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// The value of the cell, or of the nearest node.
    Constant,
    /// Linear along each axis: through the nodes, or through the centers of cells.
    Linear,
    /// Catmull-Rom along each axis, clamped to the range of the surrounding nodes. Grids only.
    Cubic,
}

/// What a missing value (NaN) of a variable stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Missing {
    /// A density with missing values is refused; a carried variable with missing values is left out.
    #[default]
    Error,
    /// There is nothing: 0.
    Zero,
}

/// How one grid axis repeats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Period {
    /// From the data: between the outer edges of cells; between nodes the span if the last plane repeats
    /// the first, else the span and one more spacing.
    Auto,
    /// This length, in the file's units.
    Length(f64),
}

/// Choices of the scene that shape an interpolant. Lengths in the file's units.
#[derive(Debug, Clone)]
pub struct FieldOptions<const D: usize> {
    /// `None`: linear between nodes, constant in cells.
    pub interpolation: Option<Interpolation>,
    /// `None`: what the reader decided.
    pub density_name: Option<String>,
    pub missing: Missing,
    /// Where the center of a radial profile is placed.
    pub center: [f64; D],
    /// Axes of a grid that repeat.
    pub periodic: [Option<Period>; D],
    /// Names of the variables that ride along; `None`: all that can.
    pub carried: Option<Vec<String>>,
    /// The domain of a point cloud, across whose periodic axes it repeats; `None`: its bounding box.
    pub cloud_domain: Option<Domain<D>>,
}

impl<const D: usize> Default for FieldOptions<D> {
    fn default() -> Self {
        Self {
            interpolation: None,
            density_name: None,
            missing: Missing::Error,
            center: [0.0; D],
            periodic: [None; D],
            carried: None,
            cloud_domain: None,
        }
    }
}
