//! Natural cubic splines.

/// A curve with continuous second derivatives through values at ascending places; its second derivative is 0 at both ends.
pub(super) struct Spline {
    places: Vec<f64>,
    values: Vec<f64>,
    bends: Vec<f64>,
}

impl Spline {
    /// Of at least two places.
    pub fn new(places: Vec<f64>, values: Vec<f64>) -> Self {
        let n = places.len();
        let mut bends = vec![0.0; n];
        let mut above = vec![0.0; n];
        // Thomas's algorithm.
        for i in 1..n.saturating_sub(1) {
            let (left, right) = (places[i] - places[i - 1], places[i + 1] - places[i]);
            let rise = (values[i + 1] - values[i]) / right - (values[i] - values[i - 1]) / left;
            let diagonal = 2.0 * (left + right) - left * above[i - 1];
            above[i] = right / diagonal;
            bends[i] = (6.0 * rise - left * bends[i - 1]) / diagonal;
        }
        for i in (1..n.saturating_sub(1)).rev() {
            bends[i] -= above[i] * bends[i + 1];
        }
        Self { places, values, bends }
    }

    /// Value and first two derivatives a fraction `x` of the way from knot `i` to the next.
    pub fn within(&self, i: usize, x: f64) -> [f64; 3] {
        let width = self.places[i + 1] - self.places[i];
        let (a, b) = (1.0 - x, x);
        let (low, high) = (self.bends[i], self.bends[i + 1]);
        let bent = |t: f64| (t * t * t - t) * width * width / 6.0;
        let steep = |t: f64| (3.0 * t * t - 1.0) * width / 6.0;
        [
            a * self.values[i] + b * self.values[i + 1] + bent(a) * low + bent(b) * high,
            (self.values[i + 1] - self.values[i]) / width - steep(a) * low + steep(b) * high,
            a * low + b * high,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine between zeros of its second derivative, where a natural spline has no error of its ends: it is off by h^4/384 in
    /// the value, and by h^2/12 in the second derivative.
    #[test]
    fn a_sine_is_followed_to_fourth_order() {
        let n = 32;
        let places: Vec<f64> = (0..=n).map(|i| std::f64::consts::PI * f64::from(i) / f64::from(n)).collect();
        let step = places[1];
        let spline = Spline::new(places.clone(), places.iter().map(|t| t.sin()).collect());
        for i in 0..n as usize {
            for x in [0.0, 0.3, 0.7, 1.0] {
                let t = places[i] + x * step;
                let [value, slope, bend] = spline.within(i, x);
                assert!((value - t.sin()).abs() < step.powi(4) / 100.0, "{i} {x}: {value}");
                assert!((slope - t.cos()).abs() < step.powi(3) / 10.0, "{i} {x}: {slope}");
                assert!((bend + t.sin()).abs() < step.powi(2) / 6.0, "{i} {x}: {bend}");
            }
        }
    }
}
