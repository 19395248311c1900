//! What a scene needs, and what it does without, with the reasons: nothing is run that a scene has no use for.

use crate::domain::{Axis, Domain, Region};
use crate::scene::{Atmosphere, Scene};
use serde::Serialize;

/// Something that the plan drops.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    pub what: String,
    pub why: String,
}

/// Stages in order, and what is dropped.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Plan {
    pub stages: Vec<&'static str>,
    pub left_out: Vec<LeftOut>,
}

impl Plan {
    /// Decides from the scene, the domain that it came to and the number of particles.
    pub fn new<const D: usize>(scene: &Scene, domain: &Domain<D>, count: usize, has_profile: bool) -> Self {
        let mut plan = Self { stages: Vec::new(), left_out: Vec::new() };
        plan.stages.push(scene.seeding.method().stage);
        if scene.wvt.iterations == 0 {
            plan.drop("WVT", "wvt.iterations is 0");
        } else if count < MIN_RELAXED {
            plan.drop("WVT", format!("{count} particles have no neighbors to relax against"));
        } else {
            plan.stages.push("WVT");
        }
        plan.stages.push("measure");
        if !domain.axes.contains(&Axis::Periodic) {
            plan.drop("periodic images", "no axis is periodic");
        }
        if matches!(domain.region, Region::Box) {
            plan.drop("ghost particles", "no surface is curved; flat walls mirror without them");
        }
        if scene.resolution.is_none() {
            plan.drop("variable masses", "the resolution follows the density, so all masses are equal");
        }
        if !has_profile {
            plan.drop("atmosphere cut", "the input is not a radial profile");
        } else if scene.input.atmosphere == Atmosphere::Keep {
            plan.drop("atmosphere cut", "input.atmosphere is keep");
        }
        plan
    }

    pub fn drop(&mut self, what: impl Into<String>, why: impl Into<String>) {
        self.left_out.push(LeftOut { what: what.into(), why: why.into() });
    }

    pub fn relaxes(&self) -> bool {
        self.stages.contains(&"WVT")
    }
}

/// Fewer particles are left where the seed puts them.
const MIN_RELAXED: usize = 3;
