//! The decrease of the energy during a descent, from which it is decided whether more evaluations are worth their time.

use serde::{Deserialize, Serialize};

/// Evaluations that every descent may make: its first steps tell little.
const FEWEST: usize = 20;

/// Energies after the steps of a descent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Course {
    /// Each with the evaluation that found it, in their order.
    steps: Vec<(usize, f64)>,
}

impl Course {
    pub fn new(evaluation: usize, energy: f64) -> Self {
        Self { steps: vec![(evaluation, energy)] }
    }

    pub fn push(&mut self, evaluation: usize, energy: f64) {
        self.steps.push((evaluation, energy));
    }

    /// Goes on with an objective that has another value where the particles are: what the former one fell by stays.
    pub fn shift(&mut self, by: f64) {
        self.steps.iter_mut().for_each(|(_, energy)| *energy += by);
    }

    /// What the energy fell by in the latter half of all evaluations; none while there are few.
    pub fn gain_of_latter_half(&self) -> Option<f64> {
        let ((first, _), (last, now)) = self.steps.first().zip(self.steps.last())?;
        let made = last - first;
        if made < FEWEST {
            return None;
        }
        let halfway = self.steps.partition_point(|(evaluation, _)| evaluation - first <= made / 2) - 1;
        Some(self.steps[halfway].1 - now)
    }

    pub fn is_finite(&self) -> bool {
        !self.steps.is_empty()
            && self.steps.iter().all(|(_, energy)| energy.is_finite())
            && self.steps.is_sorted_by(|a, b| a.0 <= b.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An energy that falls as 1/k, k the evaluations: from k/2 to k by 1/k.
    #[test]
    fn the_latter_half_is_counted_in_evaluations() {
        let mut course = Course::new(7, 1.0);
        for k in (2..=40).step_by(2) {
            assert_eq!(course.gain_of_latter_half().is_some(), k > FEWEST, "{k}");
            course.push(7 + k, 1.0 / k as f64);
        }
        let gain = course.gain_of_latter_half().unwrap();
        assert!((gain - 1.0 / 40.0).abs() < 1e-15, "{gain}");
        // Another objective has another value, and fell by as much.
        course.shift(-3.0);
        assert!((course.gain_of_latter_half().unwrap() - gain).abs() < 1e-15);
        course.push(7 + 41, f64::NAN);
        assert!(!course.is_finite());
    }
}
