//! Finds the roots of functions of one variable.

/// Narrowings of a bracket; each halves it at least every fourth time.
const MOST_STEPS: usize = 200;

/// The two ends of the interval within which `is_before` changes from true to false, after so many halvings.
pub(crate) fn bisect(is_before: impl Fn(f64) -> bool, [mut low, mut high]: [f64; 2], halvings: usize) -> [f64; 2] {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if is_before(middle) { low = middle } else { high = middle }
    }
    [low, high]
}

/// Where a function goes from negative (`low`) to positive (`high`), each with its value: regula falsi with halved weights
/// (Illinois), and bisection where that is slow.
pub(crate) fn root(function: &dyn Fn(f64) -> f64, low: (f64, f64), high: (f64, f64)) -> f64 {
    let ((mut a, mut fa), (mut b, mut fb)) = (low, high);
    let mut side = 0;
    for step in 0..MOST_STEPS {
        if !((b - a).abs() > 4.0 * f64::EPSILON * a.abs().max(b.abs())) {
            break;
        }
        let falsi = (fb * a - fa * b) / (fb - fa);
        let between = falsi > a.min(b) && falsi < a.max(b);
        let c = if step % 4 == 3 || !between { 0.5 * (a + b) } else { falsi };
        let fc = function(c);
        if fc == 0.0 {
            return c;
        }
        if fc > 0.0 {
            (b, fb) = (c, fc);
            if side == 1 {
                fa *= 0.5;
            }
            side = 1;
        } else {
            (a, fa) = (c, fc);
            if side == -1 {
                fb *= 0.5;
            }
            side = -1;
        }
    }
    0.5 * (a + b)
}
