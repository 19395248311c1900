//! Integrals of piecewise smooth fields over the unit cube.
//!
//! Globally adaptive as [`super::cubature`]: cells that hold most of the error are refined, round by round, in parallel
//! within a round, with sums in cell order. Cells within one part take smooth rules; those in which parts end are
//! integrated across the ends (`nest`), so that the error falls with the order of the rule instead of with the cells' width.
//! A part that is so small that no point or line of a cell meets it, and that no level tells, shows in the bounds of the field
//! over the cell, where it has some; what these leave open is part of the error. Without bounds it is missed, as by any sampling.

mod adaptive;
mod cell;
mod change;
mod chart;
mod hidden;
mod integrand;
mod lattice;
mod line;
mod nest;
mod orders;
mod window;

pub(crate) use adaptive::{PieceIntegrals, integrate_pieces};
pub(crate) use chart::Chart;
pub(crate) use integrand::Integrand;
pub(crate) use line::{Stretch, stretches};

#[cfg(test)]
mod tests;
