//! Steps of ordinary differential equations.

/// `y(x + h)` where `y(x)` is `y` and `y' = slopes(x, y)`, by Runge and Kutta's fourth order.
pub(crate) fn step<const N: usize>(
    x: f64,
    y: [f64; N],
    h: f64,
    slopes: impl Fn(f64, [f64; N]) -> [f64; N],
) -> [f64; N] {
    try_step(x, y, h, |x, y| Some(slopes(x, y))).unwrap_or(y)
}

/// The same; `None` where there are no slopes on the way.
pub(crate) fn try_step<const N: usize>(
    x: f64,
    y: [f64; N],
    h: f64,
    slopes: impl Fn(f64, [f64; N]) -> Option<[f64; N]>,
) -> Option<[f64; N]> {
    let moved = |h: f64, k: [f64; N]| sph::array(|i| y[i] + h * k[i]);
    let k1 = slopes(x, y)?;
    let k2 = slopes(x + 0.5 * h, moved(0.5 * h, k1))?;
    let k3 = slopes(x + 0.5 * h, moved(0.5 * h, k2))?;
    let k4 = slopes(x + h, moved(h, k3))?;
    Some(moved(h, sph::array(|i| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// y'' = -y from 0 to pi/2 in so many steps: sin and cos.
    fn error(steps: u32) -> f64 {
        let h = std::f64::consts::FRAC_PI_2 / f64::from(steps);
        let end = (0..steps).fold([0.0, 1.0], |y, i| step(f64::from(i) * h, y, h, |_, [a, b]| [b, -a]));
        (end[0] - 1.0).abs().max(end[1].abs())
    }

    #[test]
    fn errors_fall_with_the_fourth_power_of_the_step() {
        let ratio = error(10) / error(20);
        assert!((ratio / 16.0 - 1.0).abs() < 0.1, "{ratio}");
    }

    #[test]
    fn where_there_is_no_slope_there_is_no_step() {
        assert_eq!(try_step(0.0, [1.0], 1.0, |x, _| (x < 0.7).then_some([1.0])), None);
        assert_eq!(try_step(0.0, [1.0], 0.5, |x, _| (x < 0.7).then_some([1.0])), Some([1.5]));
    }
}
