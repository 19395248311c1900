//! The goal of the relaxation of blocks: stages aim at the target or, where matching its densities would move mass, at the target smoothed by the
//! kernel.

use crate::run::plan::Plan;
use crate::target::mass_points::MassPoints;
use crate::target::{Positions, Target, at};
use sph::kernel::{KernelName, support_over_spacing};
use sph::parallel;
use std::sync::Arc;

/// Support radii of a point within which particles are that feel it, and move.
const REACH: f64 = 1.5;

pub(super) struct Goal<'a, const D: usize> {
    pub target: Target<'a, D>,
    pub plan: &'a Plan,
    kernel: KernelName,
    points: Option<Points<D>>,
}

/// Points of mass of the whole target, and how far each is felt.
struct Points<const D: usize> {
    all: MassPoints<D>,
    reach: Vec<f64>,
}

impl<'a, const D: usize> Goal<'a, D> {
    /// With the points of mass where the plan aims at mass.
    pub fn new(target: Target<'a, D>, plan: &'a Plan, (kernel, neighbors): (KernelName, f64)) -> Self {
        let all = if plan.aims_at_mass { MassPoints::new(&target) } else { None };
        let ratio = support_over_spacing(D, neighbors);
        let points = all.map(|all| {
            let reach = |c: usize| {
                let density = target.number_density(&at(all.positions(), c));
                REACH * target.support(density, ratio).min(target.domain.size())
            };
            Points { reach: parallel::map(all.share().len(), reach), all }
        });
        Self { target, plan, kernel, points }
    }

    /// Points of mass about a block, of `all` that is held with it.
    pub fn points_about(&self, all: &Positions<D>) -> Option<Arc<MassPoints<D>>> {
        let points = self.points.as_ref()?;
        points.all.about(self.kernel, self.target.domain, &points.reach, all).map(Arc::new)
    }
}
