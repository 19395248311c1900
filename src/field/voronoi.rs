//! Cells of a moving mesh: every place has the values of the cell whose generator is nearest (Springel 2010, MNRAS 401, 791,
//! section 3), so that the mass of a cell is its density times its volume, and jumps between cells stay jumps. Images across
//! periodic axes count. O(log N).

use super::cloud::Cloud;
use super::sampled::{Outside, Sampler};
use crate::error::Result;
use sph::domain::Domain;
use sph_formats::Values;

pub(crate) struct Voronoi<const D: usize> {
    generators: Cloud<D>,
}

impl<const D: usize> Voronoi<D> {
    /// From generators that are finite, in their domain.
    ///
    /// # Errors
    /// Those of [`Cloud::new`].
    pub(crate) fn new(name: &str, generators: &[[f64; D]], domain: &Domain<D>) -> Result<Self> {
        Ok(Self { generators: Cloud::new(name, generators, Some(domain))? })
    }
}

impl<const D: usize> Sampler<D> for Voronoi<D> {
    fn sample(&self, values: &Values, stride: usize, x: &[f64; D], outside: Outside, out: &mut [f64]) -> bool {
        if outside == Outside::Reject && !self.generators.is_boxed(x) {
            return false;
        }
        let (cell, _) = self.generators.near(x);
        out.iter_mut().enumerate().for_each(|(c, v)| *v = values.get(cell * stride + c));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;
    use sph::domain::{Axis, Region};

    fn sampled<const D: usize>(cells: &Voronoi<D>, values: &Values, x: [f64; D]) -> Option<f64> {
        let mut out = [f64::NAN];
        cells.sample(values, 1, &x, Outside::Reject, &mut out).then_some(out[0])
    }

    /// Against all images of all generators; the first axis repeats, the others end at walls.
    fn nearest_of_all_images<const D: usize>() {
        let axes = std::array::from_fn(|k| if k == 0 { Axis::Periodic } else { Axis::OPEN });
        let domain = Domain::new([0.0; D], [1.0; D], axes, Region::Box).unwrap();
        let mut random = Random::new(3);
        let points: Vec<[f64; D]> = (0..40).map(|_| random.point()).collect();
        let cells = Voronoi::new("rho", &points, &domain).unwrap();
        let values = Values::F64((0..40).map(f64::from).collect());
        for _ in 0..2000 {
            let x = random.point::<D>();
            let distance = |p: &[f64; D]| {
                let along = |k: usize| match (x[k] - p[k]).abs() {
                    d if k == 0 => d.min(1.0 - d),
                    d => d,
                };
                (0..D).map(|k| along(k).powi(2)).sum::<f64>()
            };
            let nearest = (0..40).min_by(|&a, &b| distance(&points[a]).total_cmp(&distance(&points[b]))).unwrap();
            assert_eq!(sampled(&cells, &values, x), Some(nearest as f64), "{x:?}");
            let image = sph::array(|k| if k == 0 { x[k] + 3.0 } else { x[k] });
            assert_eq!(sampled(&cells, &values, image), Some(nearest as f64), "{x:?}");
        }
        if D > 1 {
            assert_eq!(sampled(&cells, &values, [1.5; D]), None);
        }
    }

    #[test]
    fn every_place_belongs_to_its_nearest_generator() {
        nearest_of_all_images::<1>();
        nearest_of_all_images::<2>();
        nearest_of_all_images::<3>();
    }

    /// On a line the cells end halfway between generators.
    #[test]
    fn cells_of_a_line_end_halfway() {
        let domain = Domain::new([0.0], [1.0], [Axis::Periodic], Region::Box).unwrap();
        let points = [[0.1], [0.2], [0.5], [0.9]];
        let cells = Voronoi::new("rho", &points, &domain).unwrap();
        let values = Values::F64(vec![0.0, 1.0, 2.0, 3.0]);
        // The last one is of the first and the last, across the end.
        for (face, left, right) in [(0.15, 0.0, 1.0), (0.35, 1.0, 2.0), (0.7, 2.0, 3.0), (1.0, 3.0, 0.0)] {
            assert_eq!(sampled(&cells, &values, [face - 1e-9]), Some(left), "{face}");
            assert_eq!(sampled(&cells, &values, [face + 1e-9]), Some(right), "{face}");
        }
    }
}
