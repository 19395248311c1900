//! Passes compiled with this crate, for every dimension, precision and kernel.
//!
//! A generic function is compiled anew in every crate that calls it, and the passes are long to compile: tests and
//! benches leave them to this crate. A function without type parameters is compiled here once; it makes
//! the pass for a shape known at run time, and the caller takes it out again with its types.

use super::batch::{DynPass, LeafPass, drive};
use super::sources::Sources;
use crate::domain::Domain;
use crate::lanes::Real;
use std::any::Any;

/// Type parameters of a pass as values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shape {
    pub dimension: usize,
    pub channels: usize,
    pub double: bool,
}

impl Shape {
    pub fn new<const D: usize, const C: usize, R: Real>() -> Self {
        Self { dimension: D, channels: C, double: R::DOUBLE }
    }
}

type Drive<const D: usize, const C: usize, R, O> =
    fn(&Domain<D>, &[Sources<'_, D, C>], f64, &dyn DynPass<D, C, R, O>) -> Vec<O>;

/// A pass whose output is `O`, with what drives it over all leaves.
pub(crate) struct Compiled<const D: usize, const C: usize, R, O> {
    pass: Box<dyn DynPass<D, C, R, O>>,
    /// A pointer, so that this crate holds the code and not each that calls it.
    drive: Drive<D, C, R, O>,
}

impl<const D: usize, const C: usize, R: Real, O: Copy + Send + Default> Compiled<D, C, R, O> {
    pub fn new(pass: impl LeafPass<D, C, R, Output = O> + 'static) -> Self {
        Self { pass: Box::new(pass), drive: drive::<D, C, R, O> }
    }
}

impl<const D: usize, const C: usize, R, O> Compiled<D, C, R, O> {
    /// See [`super::for_each_target`].
    pub fn drive(&self, domain: &Domain<D>, sources: &[Sources<'_, D, C>], margin: f64) -> Vec<O> {
        (self.drive)(domain, sources, margin, &*self.pass)
    }
}

/// What `make` makes for this shape.
pub(crate) fn compiled<const D: usize, const C: usize, R: Real, O: 'static>(
    make: impl FnOnce(Shape) -> Box<dyn Any>,
) -> Compiled<D, C, R, O> {
    match make(Shape::new::<D, C, R>()).downcast::<Compiled<D, C, R, O>>() {
        Ok(pass) => *pass,
        Err(_) => unreachable!("passes exist in one to three dimensions, in the precisions that callers name"),
    }
}

/// Calls `$body` with `$D` and `$R` standing for a shape's dimension and precision; with the dimension alone where
/// single precision is all there is.
macro_rules! in_shape {
    (@ $d:literal, $D:ident => $body:expr) => {{
        const $D: usize = $d;
        $body
    }};
    (@ $d:literal, $r:ty, $D:ident, $R:ident => $body:expr) => {{
        const $D: usize = $d;
        type $R = $r;
        $body
    }};
    ($shape:expr, $D:ident => $body:expr) => {
        match $shape.dimension {
            1 => $crate::neighbors::in_shape!(@ 1, $D => $body),
            2 => $crate::neighbors::in_shape!(@ 2, $D => $body),
            3 => $crate::neighbors::in_shape!(@ 3, $D => $body),
            _ => Box::new(()),
        }
    };
    ($shape:expr, $D:ident, $R:ident => $body:expr) => {
        match ($shape.dimension, $shape.double) {
            (1, false) => $crate::neighbors::in_shape!(@ 1, f32, $D, $R => $body),
            (2, false) => $crate::neighbors::in_shape!(@ 2, f32, $D, $R => $body),
            (3, false) => $crate::neighbors::in_shape!(@ 3, f32, $D, $R => $body),
            (1, true) => $crate::neighbors::in_shape!(@ 1, f64, $D, $R => $body),
            (2, true) => $crate::neighbors::in_shape!(@ 2, f64, $D, $R => $body),
            (3, true) => $crate::neighbors::in_shape!(@ 3, f64, $D, $R => $body),
            _ => Box::new(()),
        }
    };
}
pub(crate) use in_shape;
