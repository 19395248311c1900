//! Determines which of several separate parts of a piece contains a position.

use crate::field::{Aabb, Bvh};
use sph::nearest::Nearest;

/// Separate parts of a piece. A place in the box about one of them alone is in that; elsewhere the nearest cell says which.
pub(super) struct Components<const D: usize> {
    boxes: Vec<Aabb<D>>,
    tree: Bvh<D>,
    cells: Nearest<D>,
    /// The part of each cell.
    parts: Vec<usize>,
}

impl<const D: usize> Components<D> {
    /// Parts from the centers of their cells, with the part of each, and the boxes about all cells of each part. None without cells.
    pub fn new(centers: &[[f64; D]], parts: Vec<usize>, boxes: Vec<Aabb<D>>) -> Option<Self> {
        let cells = Nearest::new(centers).ok()?;
        let tree = Bvh::new((0..boxes.len() as u32).collect(), &|part| boxes[part as usize]);
        Some(Self { boxes, tree, cells, parts })
    }

    /// The part that `x` is in.
    pub fn of(&self, x: &[f64; D]) -> usize {
        let mut only = None;
        let second = self.tree.find(x, |part| {
            let part = part as usize;
            if self.boxes[part].contains(x) { only.replace(part) } else { None }
        });
        only.filter(|_| second.is_none()).unwrap_or_else(|| self.parts[self.cells.one(x).0])
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
        let boxes: Vec<_> = lows.iter().map(|lo| Aabb { lo: *lo, hi: lo.map(|v| v + size) }).collect();
        let middles: Vec<[f64; D]> = lows.iter().map(|lo| lo.map(|v| v + 0.5 * size)).collect();
        let all = Components::new(&middles, (0..lows.len()).collect(), boxes.clone()).unwrap();
        for (number, Aabb { lo, hi }) in boxes.iter().enumerate() {
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
        let boxes = vec![Aabb { lo: [0.0; 2], hi: [1.0; 2] }, Aabb { lo: [0.5; 2], hi: [2.0; 2] }];
        let all = Components::new(&[[0.2, 0.2], [1.5, 1.5]], vec![0, 1], boxes).unwrap();
        assert_eq!([[0.6, 0.6], [0.95, 0.95], [0.9, 0.1], [1.9, 0.6]].map(|x| all.of(&x)), [0, 1, 0, 1]);
    }
}
