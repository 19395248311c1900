//! Radii of a table that are nowhere farther apart than asked for, and cubic interpolation between them.

/// Values of the four cubics through four places at `x`, and their slopes.
pub(super) fn lagrange(places: &[f64; 4], x: f64) -> ([f64; 4], [f64; 4]) {
    let mut values = [1.0; 4];
    let mut slopes = [0.0; 4];
    for j in 0..4 {
        for m in (0..4).filter(|m| *m != j) {
            let width = places[j] - places[m];
            slopes[j] = slopes[j] * (x - places[m]) / width + values[j] / width;
            values[j] *= (x - places[m]) / width;
        }
    }
    (values, slopes)
}

/// Radii, ascending.
pub(super) struct Rows(Vec<f64>);

impl Rows {
    /// From `inner` to `outer`, with steps of up to `step(r)`; at least `least` of them, and no more than about `most`.
    pub fn new([inner, outer]: [f64; 2], step: impl Fn(f64) -> f64, [least, most]: [usize; 2]) -> Self {
        let width = |r: f64| step(r).min((outer - inner) / least as f64);
        let mut factor = 1.0;
        loop {
            let mut places = vec![inner];
            let mut r = inner;
            while r < outer && places.len() <= most {
                r += factor * width(r);
                places.push(r.min(outer));
            }
            if r >= outer {
                // The last step may be any part of a whole one.
                let n = places.len();
                if n > 4 {
                    places[n - 2] = 0.5 * (places[n - 3] + outer);
                }
                return Self(places);
            }
            factor *= 1.2 * (outer - inner) / (r - inner).max(1e-3 * (outer - inner));
        }
    }

    /// With the middles between all of them, too.
    pub fn halved(&self) -> Self {
        let mut places: Vec<f64> = self.0.windows(2).flat_map(|w| [w[0], 0.5 * (w[0] + w[1])]).collect();
        places.extend(self.0.last());
        Self(places)
    }

    pub fn places(&self) -> &[f64] {
        &self.0
    }

    /// The first of the four rows about `r`, by what their values count there, and by what in the slope. Beyond the ends it is the
    /// value at the end.
    pub fn weights(&self, r: f64) -> (usize, [f64; 4], [f64; 4]) {
        let n = self.0.len();
        let r = r.clamp(self.0[0], self.0[n - 1]);
        let above = self.0.partition_point(|&place| place < r);
        let first = above.saturating_sub(2).min(n - 4);
        let places: [f64; 4] = sph::array(|j| self.0[first + j]);
        let (values, slopes) = lagrange(&places, r);
        (first, values, slopes)
    }

    /// Value and slope of what has these values at the rows.
    pub fn interpolate(&self, of: &[f64], r: f64) -> (f64, f64) {
        let (first, values, slopes) = self.weights(r);
        let sum = |weights: &[f64; 4]| (0..4).map(|j| weights[j] * of[first + j]).sum();
        (sum(&values), sum(&slopes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_followed_exactly_and_sines_closely() {
        let rows = Rows::new([0.5, 4.0], |r| 0.1 * r, [8, 1000]);
        let places = rows.places();
        assert!(places[0] == 0.5 && *places.last().unwrap() == 4.0);
        assert!(places.windows(2).all(|w| w[1] > w[0] && w[1] - w[0] <= 0.1 * w[1] + 1e-12), "{places:?}");
        let cubic = |r: f64| 2.0 - r + 0.5 * r * r - 0.1 * r.powi(3);
        let values: Vec<f64> = places.iter().map(|&r| cubic(r)).collect();
        let sines: Vec<f64> = places.iter().map(|r| r.sin()).collect();
        for i in 0..=70 {
            let r = 0.5 + 0.05 * f64::from(i);
            let (value, slope) = rows.interpolate(&values, r);
            assert!((value - cubic(r)).abs() < 1e-12, "{r}: {value}");
            assert!((slope - (-1.0 + r - 0.3 * r * r)).abs() < 1e-10, "{r}: {slope}");
            let (value, slope) = rows.interpolate(&sines, r);
            assert!((value - r.sin()).abs() < 1e-3 && (slope - r.cos()).abs() < 2e-2, "{r}: {value} {slope}");
        }
        assert_eq!(rows.halved().places().len(), 2 * places.len() - 1);
    }

    #[test]
    fn rows_are_bounded_in_number() {
        let rows = Rows::new([0.0, 1.0], |_| 1e-6, [8, 500]);
        assert!((100..=502).contains(&rows.places().len()), "{}", rows.places().len());
        assert!(Rows::new([0.0, 1.0], |_| 1e6, [8, 500]).places().len() >= 9);
    }
}
