//! Particles of a block whose surroundings are held fixed: which of them may move, and which count in the measures.

use serde::{Deserialize, Serialize};
use sph::parallel;

/// What a particle may do, and counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Hold {
    /// It moves.
    Free,
    /// It stays, and all that it sees is there: its own density is known, and changes with those that move.
    Held,
    /// It stays, and some of what it sees is not there.
    Beyond,
}

/// Which particle each place holds, in the order in which they were given, and what it may do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Held {
    order: Vec<u32>,
    holds: Vec<Hold>,
}

impl Held {
    /// Of particles of which `order` are the given ones that places hold.
    pub fn new(order: Vec<u32>, given: &[Hold]) -> Self {
        let holds = order.iter().map(|&i| given[i as usize]).collect();
        Self { order, holds }
    }

    /// Follows the particles into a new order.
    pub fn reorder(&mut self, order: &[u32]) {
        self.order = parallel::reordered(&self.order, order);
        self.holds = parallel::reordered(&self.holds, order);
    }

    pub fn of(&self, place: usize) -> Hold {
        self.holds[place]
    }

    pub fn order(&self) -> &[u32] {
        &self.order
    }
}

/// Values of places as those of particles, which `order` tells.
pub(super) fn as_given(order: &[u32], values: &[f64]) -> Vec<f64> {
    let mut given = vec![0.0; values.len()];
    order.iter().zip(values).for_each(|(&i, v)| given[i as usize] = *v);
    given
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::AnalyticField;
    use crate::relaxation::{
        Control, DensitySolver, Holding, Others, SolverOptions, Stage, Wvt, WvtOptions, relax_new,
    };
    use crate::target::{Positions, Target, at};
    use sph::domain::{Axis, Domain, Region};
    use sph::kernel::KernelName;

    const KERNEL: KernelName = KernelName::WendlandC4;

    /// Calls `with` with 600 random particles of a target in 2-D, WVT and the density solver, each for these holds or for none.
    fn stages(holds: Option<&[Hold]>, mut with: impl FnMut(&Positions<2>, &dyn Stage<2>)) {
        let domain = Domain { lo: [0.0; 2], hi: [1.0; 2], axes: [Axis::Periodic; 2], region: Region::Box };
        let field = AnalyticField::new("density", "2 + sin(2*pi*x)", [0.0; 2]).unwrap();
        let target = Target::of_equal_masses(&domain, &field, 600, 2.0);
        let places = crate::seeding::seed_block(&target, 3, 0..600).unwrap();
        let wvt = || Wvt { kernel: KERNEL, target, options: WvtOptions { iterations: 6, ..WvtOptions::new(2) } };
        let options = SolverOptions { evaluations: 12, ..SolverOptions::new(2) };
        let solver = DensitySolver::<2>::new(KERNEL, target, options);
        match holds {
            None => {
                with(&places, &wvt());
                with(&places, &solver);
            }
            Some(holds) => {
                with(&places, &Holding { wvt: wvt(), others: Others::OfTarget(holds) });
                with(&places, &solver.within(holds, None));
            }
        }
    }

    fn relaxed(stage: &dyn Stage<2>, places: &Positions<2>) -> Positions<2> {
        relax_new(stage, places.clone(), &Control::default()).particles.positions
    }

    #[test]
    fn those_that_stay_do_so_to_the_bit_and_all_come_out_as_they_were_given() {
        let hold = |i: usize| [Hold::Free, Hold::Held, Hold::Free, Hold::Beyond][i % 4];
        let holds: Vec<Hold> = (0..600).map(hold).collect();
        stages(Some(&holds), |places, stage| {
            let found = relaxed(stage, places);
            for (i, hold) in holds.iter().enumerate() {
                let (before, after) = (at(places, i), at(&found, i));
                assert_eq!(*hold != Hold::Free, before == after, "{} {i} {hold:?}", stage.name().name);
                let apart = |k: usize| ((after[k] - before[k] + 0.5).rem_euclid(1.0) - 0.5).abs();
                assert!((0..2).all(|k| apart(k) < 0.1), "{i} came out in the place of another");
            }
        });
    }

    #[test]
    fn where_all_are_free_they_go_as_without_holds() {
        let mut plain = Vec::new();
        let sorted = |mut places: Vec<[f64; 2]>| {
            places.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
            places
        };
        let all = |found: &Positions<2>| sorted((0..600).map(|i| at(found, i)).collect());
        stages(None, |places, stage| plain.push(all(&relaxed(stage, places))));
        let mut plain = plain.into_iter();
        stages(Some(&[Hold::Free; 600]), |places, stage| {
            assert!(plain.next().unwrap() == all(&relaxed(stage, places)), "{}", stage.name().name);
        });
    }
}
