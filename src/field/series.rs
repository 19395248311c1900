//! Values of particles in the form in which they are fitted.

/// Where a variable's coefficients are, and what they are of.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub first: usize,
    pub components: usize,
    pub is_log: bool,
    pub ranges: Vec<(f64, f64)>,
}

/// A variable's values as they are fitted.
pub(super) struct Series {
    pub place: Place,
    /// Interleaved.
    values: Vec<f64>,
}

impl Series {
    /// Of `values` with so many components each, interleaved.
    pub fn new(mut values: Vec<f64>, components: usize, first: usize) -> Self {
        let is_log = components == 1 && values.iter().all(|v| *v > 0.0);
        if is_log {
            values.iter_mut().for_each(|v| *v = v.ln());
        }
        let ranges = ranges(&values, components);
        Self { place: Place { first, components, is_log, ranges }, values }
    }

    /// Adds to the values as they are fitted, those of one component.
    pub fn change(&mut self, by: impl Fn(usize) -> f64) {
        self.values.iter_mut().enumerate().for_each(|(i, value)| *value += by(i));
        self.place.ranges = ranges(&self.values, self.place.components);
    }

    pub fn at(&self, i: usize, component: usize) -> f64 {
        self.values[i * self.place.components + component]
    }
}

/// Lowest and largest value of each component.
fn ranges(values: &[f64], components: usize) -> Vec<(f64, f64)> {
    let range = |c: usize| {
        let of_component = values.iter().skip(c).step_by(components);
        of_component.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (v.min(lo), v.max(hi)))
    };
    (0..components).map(range).collect()
}

/// Components of all series.
pub(super) fn components(series: &[Series]) -> usize {
    series.iter().map(|s| s.place.components).sum()
}
