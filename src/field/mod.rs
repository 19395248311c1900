//! Interpolants: the values of a file's data, or of an expression, at any point.
//!
//! | input | interpolant | mass |
//! |---|---|---|
//! | radial profile, nodes | monotone cubic in `ln rho` or `rho` ([`RadialProfile`]) | quadrature per segment |
//! | radial profile, cells | monotone cubic of the enclosed mass | exact per cell |
//! | grid | piecewise linear or constant in cells, multilinear, or limited cubic | closed form; cells for cubic |
//! | grid of r, theta, phi or R, phi, z | multilinear, constant per cell | closed form |
//! | grid of cells of several sizes | constant per cell, or linear with limited slopes | exact per cell |
//! | mesh | isoparametric shape functions, constant per cell | exact per cell |
//! | point cloud | Shepard's weights over the nearest points | adaptive cubature |
//! | particles | a smooth field fitted to them, or constant in their Voronoi cells | that of the particles |
//! | surface | an expression inside | divergence theorem, or chords |
//! | expression | [`Expression`] | adaptive cubature, across discontinuities and kinks |
//!
//! Numbers stay in the file's units and precision. [`Source::scaled`] changes units without copying data.

// Loops over dimensions index several arrays of length D at once.
#![allow(clippy::needless_range_loop)]

mod analytic;
mod build;
mod build_grid;
mod build_input;
mod build_radial;
mod build_refined;
mod build_surface;
mod bvh;
mod carried;
mod categorical;
mod centering;
mod check;
mod chords;
mod cloud;
mod cubature;
mod curve;
mod curvilinear;
mod expression;
mod facets;
mod fitted;
mod free_space;
mod geographic;
mod grid;
mod grid_axis;
mod grid_boxes;
mod grid_shape;
mod grid_slopes;
mod hull;
mod interior;
mod intervals;
mod listed;
mod local_fit;
mod local_mass;
mod mass;
mod mesh;
mod narrow_jumps;
mod options;
mod orientation;
mod outer_layer;
mod outline;
mod patch;
mod piecewise;
mod profile;
pub(crate) mod quadrature;
mod radial;
mod refined;
mod rows;
mod sampled;
mod scalar;
mod scaled;
mod sector;
mod series;
mod shapes;
mod shared;
mod skin;
mod solid;
mod source;
mod staggering;
mod stepped;
mod surface;
#[cfg(test)]
pub(crate) mod testing;
mod trace;
mod voronoi;

pub(crate) use analytic::probes;
pub use analytic::{AnalyticCarried, AnalyticField};
pub use build::{Samples, from_particles, from_raw, natural_dimension};
pub use build_surface::surface_of;
pub(crate) use bvh::{Aabb, Bvh};
pub use carried::{CarriedField, CarriedInfo};
pub use expression::Expression;
pub(crate) use expression::Names;
pub use fitted::Scatter;
pub(crate) use free_space::FreeSpace;
pub use hull::MeshHull;
pub(crate) use interior::Inside;
pub(crate) use intervals::Intervals;
pub(crate) use mass::mass_and_pieces;
pub use mass::{piece_masses, total_mass};
pub use options::{Centering, FieldOptions, Interpolation, Missing, Period, Staggering};
pub use orientation::{Orientation, rotated, turned_back};
pub use patch::{Enclosure, Patch};
pub(crate) use piecewise::{Stretch, stretches};
pub use profile::RadialProfile;
pub(crate) use rows::mass_columns;
pub use scalar::{MassEstimate, ScalarField};
pub(crate) use scaled::in_units_of;
pub(crate) use shared::{SharedCarried, SharedDensity};
pub use solid::Solid;
pub(crate) use solid::{Primitive, Shape, Tree, upright};
pub use source::{RadialSource, Source};
pub use surface::Surface;
pub use trace::{Level, Trace};
