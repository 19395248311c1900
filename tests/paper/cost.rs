//! What is left out costs nothing: the time of a step of ALARIC with its terms switched on one by one.

use super::results::Table;
use super::{Density, control, target};
use sph::domain::{Axis, Domain, Region};
use sph::kernel::KernelName;
use sph_prep::relaxation::{AlaricOptions, WvtOptions, alaric, relax};
use sph_prep::seeding::{Seeding, seed};

/// Only viscosity has a pass over pairs of its own; friction and stops are free.
#[test]
#[ignore = "half a minute; prints times"]
fn terms() {
    let domain = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap();
    let density = Density(|x: &[f64; 3]| 1.0 + 0.5 * (std::f64::consts::TAU * x[0]).sin());
    let target = target(&domain, &density, 50_000, 1.0);
    let start = seed(&target, Seeding::MassBisection, 0).unwrap().positions;
    let few = WvtOptions { iterations: 5, ..WvtOptions::new(3) };
    let start = relax(KernelName::WendlandC4, &target, start, &few, &control()).0;
    let steps = 40;
    let bare = AlaricOptions {
        friction: 0.0,
        viscosity: false,
        velocity_stops: false,
        grad_h: false,
        rate_tolerance: 0.0,
        steps,
        ..AlaricOptions::new(3)
    };
    let friction = AlaricOptions::new(3).friction;
    let variants = [
        ("pressure alone", bare),
        ("and friction", AlaricOptions { friction, ..bare }),
        ("and velocity stops", AlaricOptions { friction, velocity_stops: true, ..bare }),
        ("and grad-h terms", AlaricOptions { friction, velocity_stops: true, grad_h: true, ..bare }),
        ("and held particles", AlaricOptions { friction, velocity_stops: true, hold_unresolved: true, ..bare }),
        ("and viscosity", AlaricOptions { friction, velocity_stops: true, grad_h: true, viscosity: true, ..bare }),
    ];
    let mut page = Table::new(
        "What is left out costs nothing",
        "Time per step and particle of ALARIC, 50 000 particles in 3-D: a term that is switched off leaves no trace, and \
         only viscosity has a pass over pairs of its own.",
        &["terms", "nanoseconds"],
    );
    let times = variants.map(|(name, options)| {
        let run = || alaric::<3, f32>(KernelName::WendlandC4, &target, start.clone(), &options, &control()).1;
        // The better of two: other work on the machine only ever adds.
        let seconds = run().seconds.min(run().seconds);
        let nanoseconds = 1e9 * seconds / (steps * 50_000) as f64;
        page.row(&[name.into(), format!("{nanoseconds:.0}")]);
        nanoseconds
    });
    page.publish("cost");
    assert!(times.iter().all(|t| t.is_finite() && *t > 0.0));
}
