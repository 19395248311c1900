//! Radii of a table with a bounded spacing, and cubic interpolation between them.

use crate::field::Intervals;

/// What divides each of the four cubics through four places: it is 1 at its own.
fn divisors(places: &[f64]) -> [f64; 4] {
    sph::array(|j| (0..4).filter(|m| *m != j).map(|m| 1.0 / (places[j] - places[m])).product())
}

/// Values of the four cubics through four places that are so far below.
fn values(below: &[f64; 4], divisors: &[f64; 4]) -> [f64; 4] {
    let [a, b, c, d] = *below;
    let (low, high) = (a * b, c * d);
    [b * high * divisors[0], a * high * divisors[1], low * d * divisors[2], low * c * divisors[3]]
}

/// Their slopes.
fn slopes(below: &[f64; 4], divisors: &[f64; 4]) -> [f64; 4] {
    let slope = |x: f64, y: f64, z: f64| x * y + x * z + y * z;
    let [a, b, c, d] = *below;
    [
        slope(b, c, d) * divisors[0],
        slope(a, c, d) * divisors[1],
        slope(a, b, d) * divisors[2],
        slope(a, b, c) * divisors[3],
    ]
}

/// Values of the four cubics through 0, 1, 2 and 3.
pub(super) fn even_values(x: f64) -> [f64; 4] {
    values(&[x, x - 1.0, x - 2.0, x - 3.0], &[-1.0 / 6.0, 0.5, -0.5, 1.0 / 6.0])
}

/// Radii, ascending.
pub(super) struct Rows {
    places: Intervals,
    /// For each four of them.
    divisors: Vec<[f64; 4]>,
}

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
                return Self::at(places);
            }
            factor *= 1.2 * (outer - inner) / (r - inner).max(1e-3 * (outer - inner));
        }
    }

    fn at(places: Vec<f64>) -> Self {
        let divisors = places.windows(4).map(divisors).collect();
        Self { places: Intervals::new(places), divisors }
    }

    /// With the middles between all of them, too.
    pub fn halved(&self) -> Self {
        let mut places: Vec<f64> = self.places.windows(2).flat_map(|w| [w[0], 0.5 * (w[0] + w[1])]).collect();
        places.extend(self.places.last());
        Self::at(places)
    }

    pub fn places(&self) -> &[f64] {
        &self.places
    }

    /// The first of the four rows about `r`, and how far each is below. Beyond the ends it is the end that counts.
    fn about(&self, r: f64) -> (usize, [f64; 4]) {
        let n = self.places.len();
        let r = r.clamp(self.places[0], self.places[n - 1]);
        let first = self.places.find(r).saturating_sub(1).min(n - 4);
        (first, sph::array(|j| r - self.places[first + j]))
    }

    /// The first of the four rows about `r`, and by what their values count there.
    pub fn weights(&self, r: f64) -> (usize, [f64; 4]) {
        let (first, below) = self.about(r);
        (first, values(&below, &self.divisors[first]))
    }

    /// Value of what has these values at the rows.
    pub fn value(&self, of: &[f64], r: f64) -> f64 {
        let (first, weights) = self.weights(r);
        (0..4).map(|j| weights[j] * of[first + j]).sum()
    }

    /// Slope of what has these values at the rows.
    pub fn slope(&self, of: &[f64], r: f64) -> f64 {
        let (first, below) = self.about(r);
        let weights = slopes(&below, &self.divisors[first]);
        (0..4).map(|j| weights[j] * of[first + j]).sum()
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
            let (value, slope) = (rows.value(&values, r), rows.slope(&values, r));
            assert!((value - cubic(r)).abs() < 1e-12, "{r}: {value}");
            assert!((slope - (-1.0 + r - 0.3 * r * r)).abs() < 1e-10, "{r}: {slope}");
            let (value, slope) = (rows.value(&sines, r), rows.slope(&sines, r));
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
