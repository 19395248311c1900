//! ALARIC with its terms switched on one by one: what each does, and what it costs.

use super::results::Table;
use super::{Density, control, interval, target};
use crate::support::{alaric, wvt};
use sph::domain::{Axis, Domain, Region};
use sph::kernel::KernelName;
use sph_prep::relaxation::{AlaricOptions, WvtOptions, conservation};
use sph_prep::seeding::{Seeding, seed};

/// Everything that can be switched off.
fn bare(d: usize, steps: usize) -> AlaricOptions {
    AlaricOptions {
        friction: 0.0,
        viscosity: false,
        velocity_stops: false,
        grad_h: false,
        rate_tolerance: 0.0,
        steps,
        ..AlaricOptions::new(d)
    }
}

/// With friction, viscosity and stops switched off nothing of them is left: the fluid keeps its energy and momentum, to the
/// leap-frog's error of second order in the step. Friction of 4 alone would take 1 - exp(-2 * 4 * 0.3), nine tenths of the
/// kinetic energy in that time.
#[test]
fn terms_that_are_off_leave_the_fluid_its_energy_and_momentum() {
    let domain = interval();
    let target = target(&domain, &Density(|_: &[f64; 1]| 1.0), 100, 1.0);
    let start = seed(&target, Seeding::Random, 1).unwrap().positions;
    let default = AlaricOptions::new(1);
    let options = AlaricOptions { courant: 0.5 * default.courant, steps: 2000, ..default };
    let drift = conservation::<1, f64>(KernelName::WendlandC4, &target, start, &options, &control());
    assert!(drift.time > 0.3 && drift.energy < 0.1 && drift.momentum < 1e-6, "{drift:?}");
}

#[test]
fn each_term_that_is_on_changes_the_run() {
    let domain = Domain::new([0.0; 2], [1.0; 2], [Axis::Periodic; 2], Region::Box).unwrap();
    let density = Density(|x: &[f64; 2]| 1.0 + 0.5 * (std::f64::consts::TAU * x[0]).sin());
    let target = target(&domain, &density, 300, 1.0);
    let start = seed(&target, Seeding::MassBisection, 0).unwrap().positions;
    let run = |options: AlaricOptions| {
        let report = alaric::<2, f32>(KernelName::WendlandC4, &target, start.clone(), &options, &control()).1;
        report.history.iter().map(|p| p.epsilon.to_bits()).collect::<Vec<_>>()
    };
    let bare = bare(2, 40);
    let plain = run(bare);
    for (name, with) in [
        ("friction", AlaricOptions { friction: 4.0, ..bare }),
        ("viscosity", AlaricOptions { viscosity: true, ..bare }),
        ("velocity stops", AlaricOptions { velocity_stops: true, ..bare }),
        ("grad-h terms", AlaricOptions { grad_h: true, ..bare }),
        ("held particles", AlaricOptions { hold_unresolved: true, ..bare }),
    ] {
        assert!(run(with) != plain, "{name} does nothing");
    }
}

/// Only viscosity has a pass over pairs of its own.
#[test]
#[ignore = "half a minute; prints times"]
fn terms() {
    let domain = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap();
    let density = Density(|x: &[f64; 3]| 1.0 + 0.5 * (std::f64::consts::TAU * x[0]).sin());
    let target = target(&domain, &density, 50_000, 1.0);
    let start = seed(&target, Seeding::MassBisection, 0).unwrap().positions;
    let few = WvtOptions { iterations: 5, ..WvtOptions::new(3) };
    let start = wvt(KernelName::WendlandC4, &target, start, &few, &control()).0;
    let steps = 40;
    let bare = bare(3, steps);
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
        "What each term costs",
        "Time per step and particle of ALARIC, 50 000 particles in 3-D: only viscosity has a pass over pairs of its own.",
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
