//! Quadrature rules of several orders, and their error estimates.

/// Relative difference of rules that agree but for rounding.
pub(super) const SAME: f64 = 1e-13;

/// Factor on the error that a falling sequence of steps leads to expect: where a function has a root at the end of a stretch
/// the fall is not steady.
const SAFETY: f64 = 4.0;

/// Masses by piece, each piece once.
pub(super) type Masses = Vec<(u64, f64)>;

/// Adds `mass` to that of `piece`.
pub(super) fn add(masses: &mut Masses, piece: u64, mass: f64) {
    match masses.iter_mut().find(|m| m.0 == piece) {
        Some(known) => known.1 += mass,
        None => masses.push((piece, mass)),
    }
}

pub(super) fn total(masses: &Masses) -> f64 {
    masses.iter().map(|m| m.1).sum()
}

/// Points per axis of the rule and of two lower ones that tell its error: the error of a rule falls from the second to the
/// last at least as it does from the first to the second, even where it falls as a power of the number of points.
pub(super) const fn orders<const D: usize>() -> [usize; 3] {
    match D {
        1 => [5, 8, 12],
        2 => [4, 6, 9],
        _ => [3, 5, 8],
    }
}

/// Integral and error by the rules of [`orders`], the lowest of which is known.
pub(super) fn by_orders<const D: usize>(
    first: Masses,
    of_order: impl Fn(usize) -> Option<Masses>,
) -> Option<(Masses, f64)> {
    let [_, second, last] = orders::<D>().map(|order| if order == orders::<D>()[0] { None } else { of_order(order) });
    let (second, last) = (second?, last?);
    let steps = [total(&second) - total(&first), total(&last) - total(&second)].map(f64::abs);
    let error = error_after(steps, total(&last));
    Some((last, error))
}

/// The error of a rule, from the steps to the lower one and on to it. The second step counts no less than it would for
/// an analytic function as large as the integral: steps that are small by chance are not trusted.
fn error_after([first, second]: [f64; 2], scale: f64) -> f64 {
    let analytic = if scale > 0.0 { scale * (first / scale).powf(5.0 / 3.0) } else { 0.0 };
    let second = second.max(analytic);
    if second < first { second * (SAFETY * second / first).min(1.0) } else { second }
}
