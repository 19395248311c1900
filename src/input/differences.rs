//! Derivatives, by finite differences, of functions that are known only by their values.

/// Steps to the outermost points of [`slope`].
pub(crate) const REACH: f64 = 3.0;

/// The slope at 0 by central differences of sixth order.
pub(crate) fn slope(step: f64, at: impl Fn(f64) -> f64) -> f64 {
    let rise = |steps: f64| at(steps * step) - at(-steps * step);
    (45.0 * rise(1.0) - 9.0 * rise(2.0) + rise(3.0)) / (60.0 * step)
}
