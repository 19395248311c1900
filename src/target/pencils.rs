//! The parts of a cell that surfaces leave, as line segments with the cross-section that each represents. They give the distribution of the
//! cell's mass for any number of cuts, without evaluating the target again.

use super::cells::Cell;
use super::lines;
use super::matter::Matter;

/// Most particles of a cell that is divided into pencils, and pencils to each of them, at least.
const MOST: f64 = 16.0;
const PER_PARTICLE: f64 = 8.0;

impl<const D: usize> Cell<D> {
    /// Whether it is to be divided into pencils rather than in halves: surfaces cross it, and it has few particles.
    pub(super) fn has_pencils(&self) -> bool {
        self.is_crossed_by_lines() && self.mass <= MOST
    }

    /// Its mass as pencils; none where lines find nothing of it.
    pub(super) fn pencils(&self, target: &dyn Matter<D>) -> Vec<Self> {
        let Some(axis) = self.across.map(usize::from) else { return Vec::new() };
        let lines = lines::for_each_axis::<D>(PER_PARTICLE * self.mass);
        let half: [f64; D] = sph::array(|k| 0.5 * (self.hi[k] - self.lo[k]) / lines as f64);
        let mut found = Vec::new();
        lines::each_part(target, [&self.lo, &self.hi], axis, lines, |part| {
            let whole = part.mass(target);
            let parts = (PER_PARTICLE * whole).ceil().max(1.0) as usize;
            for part in part.divided(parts) {
                let (mut lo, mut hi) = (sph::array(|k| part.x[k] - half[k]), sph::array(|k| part.x[k] + half[k]));
                (lo[axis], hi[axis]) = (part.from, part.to);
                let mass = if parts == 1 { whole } else { part.mass(target) };
                found.push(Self { lo, hi, mass, across: self.across, is_pencil: true, within: self.within });
            }
        });
        found.retain(|pencil| pencil.mass > 0.0);
        let sum: f64 = found.iter().map(|pencil| pencil.mass).sum();
        found.iter_mut().for_each(|pencil| pencil.mass *= self.mass / sum);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::AnalyticField;
    use crate::target::Target;
    use crate::target::cells::Rule;
    use crate::target::partition::partition;
    use sph::domain::{Axis, Domain, Region};

    /// Of a thin tilted layer: all of the mass, each pencil with its middle in the layer, and no more than its share.
    fn check<const D: usize>(count: usize) {
        let domain = Domain::new([0.0; D], [1.0; D], [Axis::OPEN; D], Region::Box).unwrap();
        let slope = ["", " + 0.3*y", " + 0.3*y + 0.2*z"][D - 1];
        let text = format!("if(abs(x{slope} - 0.7) < 1e-5, 1, 0)");
        let field = AnalyticField::<D>::new("density", &text, [0.5; D]).unwrap();
        let target = Target::of_equal_masses(&domain, &field, count, 2e-5);
        let cells = partition(&target, Rule::Gauss).unwrap();
        let crossed: Vec<_> =
            cells.iter().filter(|cell| PER_PARTICLE * cell.mass > 1.0 && cell.has_pencils()).collect();
        assert!(!crossed.is_empty());
        for cell in crossed {
            let pencils = cell.pencils(&target);
            let sum: f64 = pencils.iter().map(|pencil| pencil.mass).sum();
            assert!((sum / cell.mass - 1.0).abs() < 1e-12, "{sum} of {}", cell.mass);
            assert!(pencils.iter().all(|pencil| target.admits(&pencil.center())));
            assert!(pencils.iter().all(|pencil| pencil.mass < 2.0 / PER_PARTICLE));
            let inside = |p: &Cell<D>| (0..D).all(|k| p.lo[k] > cell.lo[k] - 1e-12 && p.hi[k] < cell.hi[k] + 1e-12);
            assert!(pencils.iter().all(inside));
        }
    }

    #[test]
    fn pencils_hold_the_mass_of_a_thin_layer() {
        check::<1>(4);
        check::<2>(200);
        check::<3>(2000);
    }
}
