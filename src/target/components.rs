//! Which of several separate parts of a piece a place of it is in.

use sph::nearest::Nearest;

/// Separate parts of a piece. A place in the box about one of them alone is in that; elsewhere the nearest cell says which.
pub(super) struct Components<const D: usize> {
    tree: Nearest<D>,
    /// The part of each cell.
    parts: Vec<usize>,
    boxes: Vec<([f64; D], [f64; D])>,
    /// A box about all boxes, and bins of it along each axis.
    lo: [f64; D],
    step: [f64; D],
    bins: usize,
    /// The only box that reaches into each bin.
    only: Vec<Only>,
}

/// The box that reaches into a bin.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Only {
    None,
    One(u32),
    Several,
}

/// Bins for each box, and along an axis, at most.
const BINS_PER_BOX: usize = 16;
const MOST_BINS: usize = 64;

impl<const D: usize> Components<D> {
    /// Parts from the centers of their cells, with the part of each, and the boxes about all cells of each part. None without cells or boxes.
    pub fn new(centers: &[[f64; D]], parts: Vec<usize>, boxes: Vec<([f64; D], [f64; D])>) -> Option<Self> {
        let tree = Nearest::new(centers).ok()?;
        let bins = ((BINS_PER_BOX * boxes.len()) as f64).powf(1.0 / D as f64).ceil() as usize;
        let bins = bins.clamp(1, MOST_BINS);
        let end = |start: f64, of: &dyn Fn(f64, f64) -> f64, side: &dyn Fn(&([f64; D], [f64; D])) -> f64| {
            boxes.iter().map(side).fold(start, of)
        };
        let lo = sph::array(|k| end(f64::INFINITY, &f64::min, &|b| b.0[k]));
        let hi: [f64; D] = sph::array(|k| end(f64::NEG_INFINITY, &f64::max, &|b| b.1[k]));
        let step = sph::array(|k| (hi[k] - lo[k]) / bins as f64);
        if boxes.is_empty() || !(0..D).all(|k| step[k] > 0.0) {
            return None;
        }
        let only = vec![Only::None; bins.pow(D as u32)];
        let mut all = Self { tree, parts, boxes, lo, step, bins, only };
        for number in 0..all.boxes.len() {
            all.enter(number);
        }
        Some(all)
    }

    /// Notes a box in the bins into which it reaches.
    fn enter(&mut self, number: usize) {
        let (lo, hi) = self.boxes[number];
        let first: [usize; D] = sph::array(|k| self.bin(k, lo[k]));
        let last: [usize; D] = sph::array(|k| self.bin(k, hi[k]));
        let width: [usize; D] = sph::array(|k| last[k] - first[k] + 1);
        for i in 0..width.iter().product() {
            let mut rest = i;
            let place = (0..D).fold((0, 1), |(place, stride), k| {
                let along = first[k] + rest % width[k];
                rest /= width[k];
                (place + along * stride, stride * self.bins)
            });
            let only = &mut self.only[place.0];
            *only = if *only == Only::None { Only::One(number as u32) } else { Only::Several };
        }
    }

    fn bin(&self, axis: usize, x: f64) -> usize {
        (((x - self.lo[axis]) / self.step[axis]).max(0.0) as usize).min(self.bins - 1)
    }

    /// The part that `x` is in.
    pub fn of(&self, x: &[f64; D]) -> usize {
        let place = (0..D).rev().fold(0, |place, k| place * self.bins + self.bin(k, x[k]));
        if let Only::One(number) = self.only[place] {
            let (lo, hi) = &self.boxes[number as usize];
            if (0..D).all(|k| x[k] >= lo[k] && x[k] <= hi[k]) {
                return number as usize;
            }
        }
        self.parts[self.tree.one(x)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares, rods and cubes on a lattice, one of each two missing: each has the places about its cells, those between go to the nearest.
    fn check<const D: usize>(per_axis: usize) {
        let spacing = 1.0 / per_axis as f64;
        let corner = |i: usize| -> [f64; D] {
            sph::array(|k| spacing * ((i / per_axis.pow(k as u32) % per_axis) as f64 + 0.25))
        };
        let lows: Vec<[f64; D]> = (0..per_axis.pow(D as u32)).step_by(2).map(corner).collect();
        let size = 0.5 * spacing;
        let boxes: Vec<_> = lows.iter().map(|lo| (*lo, lo.map(|v| v + size))).collect();
        let middles: Vec<[f64; D]> = lows.iter().map(|lo| lo.map(|v| v + 0.5 * size)).collect();
        let all = Components::new(&middles, (0..lows.len()).collect(), boxes.clone()).unwrap();
        for (number, (lo, hi)) in boxes.iter().enumerate() {
            for share in [0.0, 0.3, 0.5, 1.0] {
                let x = sph::array(|k| lo[k] + share * (hi[k] - lo[k]));
                assert_eq!(all.of(&x), number, "{D}-D");
            }
            // A little outside, also of all boxes.
            assert_eq!(all.of(&lo.map(|v| v - 0.1 * size)), number, "{D}-D");
        }
    }

    #[test]
    fn places_are_in_the_part_that_is_about_them() {
        check::<1>(9);
        check::<2>(9);
        check::<3>(5);
    }

    #[test]
    fn where_boxes_overlap_the_nearest_cell_says() {
        let boxes = vec![([0.0, 0.0], [1.0, 1.0]), ([0.5, 0.5], [2.0, 2.0])];
        let all = Components::new(&[[0.2, 0.2], [1.5, 1.5]], vec![0, 1], boxes).unwrap();
        assert_eq!([[0.6, 0.6], [0.95, 0.95], [0.9, 0.1], [1.9, 0.6]].map(|x| all.of(&x)), [0, 1, 0, 1]);
    }
}
