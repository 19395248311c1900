//! Finds the interval between ascending nodes that contains a value.

use std::ops::Deref;

/// Ascending nodes. A table over equal steps narrows the search down to the nodes within one of them: to one or two
/// where nodes are about evenly spaced, to a bisection of the few that cluster where they are not.
#[derive(Debug, Clone)]
pub(crate) struct Intervals {
    nodes: Vec<f64>,
    /// For each step the nodes before it, and after the last step all of them.
    before: Vec<u32>,
    steps_per_length: f64,
}

impl Intervals {
    /// `nodes` are finite and ascend; equal neighbors are allowed.
    pub(crate) fn new(nodes: Vec<f64>) -> Self {
        let count = nodes.len().min(MOST_STEPS);
        let span = nodes.last().zip(nodes.first()).map_or(0.0, |(last, first)| last - first);
        let steps_per_length = if span > 0.0 { count as f64 / span } else { 0.0 };
        let mut intervals = Self { nodes, before: vec![0; count + 1], steps_per_length };
        for i in 0..intervals.nodes.len() {
            let step = intervals.step(intervals.nodes[i]);
            intervals.before[step + 1] = i as u32 + 1;
        }
        // Steps without nodes have as many before them as the last that has some.
        for step in 1..=count {
            intervals.before[step] = intervals.before[step].max(intervals.before[step - 1]);
        }
        intervals
    }

    /// The last node at or below `x`; the first where all lie above, or `x` is no number.
    #[inline]
    pub(crate) fn find(&self, x: f64) -> usize {
        let step = self.step(x);
        // Rounding is monotone, so the nodes of other steps lie on their own side of x.
        let (first, end) = (self.before[step] as usize, self.before[step + 1] as usize);
        (first + self.nodes[first..end].partition_point(|&node| node <= x)).saturating_sub(1)
    }

    #[inline]
    fn step(&self, x: f64) -> usize {
        let step = (x - self.nodes[0]) * self.steps_per_length;
        (step as usize).min(self.before.len() - 2)
    }
}

/// Of a table of 4 bytes each.
const MOST_STEPS: usize = 1 << 20;

impl Deref for Intervals {
    type Target = [f64];

    #[inline]
    fn deref(&self) -> &[f64] {
        &self.nodes
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;

    fn by_bisection(nodes: &[f64], x: f64) -> usize {
        nodes.partition_point(|&node| node <= x).saturating_sub(1)
    }

    #[test]
    fn ends_and_what_is_no_number() {
        let intervals = Intervals::new(vec![1.0, 2.0, 2.0, 4.0]);
        let found = [f64::NEG_INFINITY, 0.0, 1.0, 1.9, 2.0, 3.9, 4.0, 1e300, f64::INFINITY].map(|x| intervals.find(x));
        assert_eq!(found, [0, 0, 0, 0, 2, 2, 3, 3, 3]);
        assert_eq!(intervals.find(f64::NAN), 0);
        assert_eq!(Intervals::new(vec![5.0]).find(7.0), 0);
        assert_eq!(Intervals::new(vec![5.0, 5.0]).find(5.0), 1);
        assert_eq!(Intervals::new(vec![-1e300, 1e300]).find(0.0), 0, "a span beyond f64");
    }

    #[test]
    fn is_what_bisection_finds() {
        let mut random = Random::new(4);
        for _ in 0..256 {
            let first = random.between(-1e3, 1e3);
            let mut nodes = vec![first];
            for _ in 0..random.whole(1, 200) {
                nodes.push(nodes[nodes.len() - 1] + random.unit() * 10f64.powi(random.whole(0, 16) as i32 - 12));
            }
            let intervals = Intervals::new(nodes.clone());
            let span = nodes[nodes.len() - 1] - first;
            let asked: Vec<f64> = (0..50).map(|_| first + random.between(-0.1, 1.1) * span).collect();
            let near = nodes.iter().flat_map(|&x| [x.next_down(), x, x.next_up()]);
            for x in asked.into_iter().chain(near) {
                assert_eq!(intervals.find(x), by_bisection(&nodes, x), "{x} in {nodes:?}");
            }
        }
    }
}
