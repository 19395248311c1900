//! Contacts between the regions of a target.

use super::Target;
use super::edges::ways;

impl<const D: usize> Target<'_, D> {
    /// Whether another region that has particles lies within about `reach` of `x`.
    pub fn is_beside_region(&self, x: &[f64; D], reach: f64) -> bool {
        let Some(regions) = self.regions() else { return false };
        let own = regions.of(x);
        own.is_some()
            && ways::<D>().any(|way| {
                [-1.0, -0.5, 0.5, 1.0].into_iter().any(|share| {
                    let there = regions.of(&sph::array(|k| x[k] + share * reach * way[k]));
                    there.is_some() && there != own
                })
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::AnalyticField;
    use sph::domain::{Axis, Domain, Region};

    fn in_dimension<const D: usize>() {
        let domain = Domain::new([0.0; D], [1.0; D], [Axis::REFLECTING; D], Region::Box).unwrap();
        // Vacuum beyond 0.9.
        let field = AnalyticField::<D>::new("density", "if(x < 0.5, 10, if(x < 0.9, 1, 0))", [0.5; D]).unwrap();
        let whole = Target::of_equal_masses(&domain, &field, 100, 5.4);
        let regions = whole.find_regions(None).unwrap();
        let target = whole.with_regions(Some(&regions));
        for i in 0..90 {
            let place = 0.005 + 0.01 * f64::from(i);
            let x = sph::array(|k| if k == 0 { place } else { 0.5 });
            assert_eq!(target.is_beside_region(&x, 0.1), (place - 0.5).abs() < 0.1, "{D}-D at {place}");
            assert!(!whole.is_beside_region(&x, 0.1), "without regions there is none beside");
        }
    }

    #[test]
    fn a_region_is_beside_as_far_as_is_asked_and_vacuum_is_none() {
        in_dimension::<1>();
        in_dimension::<2>();
        in_dimension::<3>();
    }
}
