//! The properties of a target that cells use.

use crate::field::Stretch;
use sph::domain::Domain;

/// What is known of a box.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Within {
    /// A bound of n*; it need not be narrow.
    pub most: f64,
    /// Whether no discontinuity goes through it.
    pub is_continuous: bool,
}

/// What is divided into cells: a number density over a domain.
pub(crate) trait Matter<const D: usize>: Sync {
    fn domain(&self) -> &Domain<D>;
    /// The box that holds all of it.
    fn bounds(&self) -> ([f64; D], [f64; D]);
    /// The integral of its density.
    fn count(&self) -> usize;
    /// n*; 0 where no particle belongs.
    fn number_density(&self, x: &[f64; D]) -> f64;
    /// n* at `x`; none outside.
    fn density_inside(&self, x: &[f64; D]) -> Option<f64>;
    /// Whether it may be discontinuous where that is not known.
    fn is_piecewise(&self) -> bool;
    /// Whether it may be discontinuous at all.
    fn may_jump(&self) -> bool;
    /// Whether it is a part of a whole, bounded by itself.
    fn is_cut(&self) -> bool;
    /// Whether nothing but the domain's surface ends it.
    fn is_smooth(&self) -> bool;
    /// What is known of n* in all of a box, without a look at any place.
    fn within(&self, lo: &[f64; D], hi: &[f64; D]) -> Option<Within>;
    /// A number that differs between places with a surface or a kink between them, as far as the field knows of it.
    fn part(&self, x: &[f64; D]) -> u64;
    /// Its smooth parts along a line through `x` between two places, a hair inside of these; none where they are too many.
    fn parts_along(&self, x: &[f64; D], axis: usize, between: [f64; 2]) -> Option<Vec<Stretch>>;
    /// The integral of n* over a box, where the field knows it to rounding.
    fn mass_within(&self, lo: &[f64; D], hi: &[f64; D]) -> Option<f64>;
    /// Where layers across an axis that are too thin to be met by chance begin and end.
    fn planes(&self, axis: usize) -> Vec<f64>;
}
