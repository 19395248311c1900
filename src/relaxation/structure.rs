//! The density in the middle of what is followed, and the radius of half of its mass: of several bodies, the mean over them by mass, each about
//! its own center of mass, since what is in the middle of all of them says nothing of any.

use crate::target::{Positions, at};
use sph::geometry::distance;
use sph::parallel;

/// Share of the particles whose mean density counts as central.
const CENTRAL: f64 = 0.02;

/// Particles that are followed.
pub(super) struct Structure<'a, const D: usize> {
    pub positions: &'a Positions<D>,
    pub masses: &'a [f64],
    pub density: &'a (dyn Fn(usize) -> f64 + Sync),
}

impl<const D: usize> Structure<'_, D> {
    /// Central density and half-mass radius of all of it about `center`.
    pub fn about(&self, center: &[f64; D]) -> (f64, f64) {
        self.of(&Vec::from_iter(0..self.masses.len()), center)
    }

    /// The means of the bodies whose numbers `bodies` has, of one where there are none.
    pub fn of_bodies(&self, bodies: &[usize]) -> (f64, f64) {
        let count = bodies.iter().max().map_or(1, |last| last + 1);
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); count];
        (0..self.masses.len()).for_each(|i| members[bodies.get(i).copied().unwrap_or(0)].push(i));
        let (mut total, mut sums) = (0.0, (0.0, 0.0));
        for own in members.iter().filter(|own| !own.is_empty()) {
            let mass: f64 = own.iter().map(|&i| self.masses[i]).sum();
            let center = sph::array(|k| own.iter().map(|&i| self.masses[i] * self.positions[k][i]).sum::<f64>() / mass);
            let (density, radius) = self.of(own, &center);
            total += mass;
            sums = (sums.0 + mass * density, sums.1 + mass * radius);
        }
        (sums.0 / total, sums.1 / total)
    }

    fn of(&self, members: &[usize], center: &[f64; D]) -> (f64, f64) {
        let mut order =
            parallel::map(members.len(), |j| (distance(&at(self.positions, members[j]), center), members[j]));
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let central = ((CENTRAL * order.len() as f64) as usize).clamp(1, order.len());
        let density = order[..central].iter().map(|&(_, i)| (self.density)(i)).sum::<f64>() / central as f64;
        let total: f64 = members.iter().map(|&i| self.masses[i]).sum();
        let mut within = 0.0;
        let half = order.iter().find(|&&(_, i)| {
            within += self.masses[i];
            within > 0.5 * total
        });
        (density, half.map_or(0.0, |half| half.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_several_bodies_it_is_that_of_each_wherever_they_are() {
        // Two lines of 101 particles about their middles, one twice as long and heavy as the other, with the densities of their numbers.
        let place = |i: usize| if i < 101 { i as f64 - 50.0 } else { 1000.0 + 2.0 * (i as f64 - 151.0) };
        let positions = [(0..202).map(place).collect::<Vec<f64>>()];
        let masses: Vec<f64> = (0..202).map(|i| if i < 101 { 1.0 } else { 2.0 }).collect();
        let density = |i: usize| if i < 101 { 3.0 } else { 6.0 };
        let structure = Structure { positions: &positions, masses: &masses, density: &density };
        let bodies: Vec<usize> = (0..202).map(|i| usize::from(i >= 101)).collect();
        let (central, half) = structure.of_bodies(&bodies);
        assert!((central - 5.0).abs() < 1e-12, "{central}");
        // More than 50.5 of 101 are within 25 to either side, and twice that of the other.
        assert!((half - (25.0 + 2.0 * 50.0) / 3.0).abs() < 1e-12, "{half}");
        let (_, together) = structure.about(&[700.0]);
        assert!(together > 200.0 && structure.of_bodies(&[]).1 > 200.0, "{together}");
    }
}
