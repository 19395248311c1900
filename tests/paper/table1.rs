//! Table 1: what friction, viscosity and velocity stops do, alone and together.

use crate::{Density, control, integral, interval, target, uniform, well};
use sph_prep::kernel::KernelName;
use sph_prep::placement::{AlaricOptions, alaric};

/// What a run comes to.
struct Outcome {
    /// First step with epsilon below 1e-3.
    steps: Option<usize>,
    /// Median over the last 1000 steps: undamped runs oscillate.
    residual: f64,
}

fn run(friction: bool, viscosity: bool, stops: bool) -> Outcome {
    let domain = interval();
    let density = Density(well(0.0));
    let mass = integral(|x| well(0.0)(&[x]));
    let target = target(&domain, &density, 300, mass);
    let options = AlaricOptions {
        friction: if friction { AlaricOptions::new(1).friction } else { 0.0 },
        viscosity,
        velocity_stops: stops,
        kernel_neighbors: 8.0,
        ..AlaricOptions::new(1)
    };
    let (_, report) = alaric::<1, f64>(KernelName::WendlandC4, &target, uniform(300), &options, &control());
    let history = &report.history;
    let mut tail: Vec<f64> = history[history.len().saturating_sub(1000)..].iter().map(|h| h.epsilon).collect();
    tail.sort_by(f64::total_cmp);
    Outcome { steps: history.iter().position(|h| h.epsilon < 1e-3), residual: tail[tail.len() / 2] }
}

/// The paper's residuals (its "steps to converge" depend on a rate of 1e-8 in a unit of time that it does not
/// state; the steps to 1e-3 are ours) and what our runs come to.
#[test]
fn ingredients() {
    let table = [
        ("reference", false, false, false, 0.17),
        ("V", false, true, false, 3.4e-3),
        ("S", false, false, true, 1.3e-3),
        ("S+V", false, true, true, 2e-4),
        ("F", true, false, false, 2e-4),
        ("F+V", true, true, false, 2e-4),
        ("S+F+V", true, true, true, 2e-4),
        ("S+F", true, false, true, 2e-4),
    ];
    println!("{:<10} {:>14} {:>10} {:>10}", "run", "steps to 1e-3", "epsilon", "paper");
    let outcomes = table.map(|(name, friction, viscosity, stops, paper)| {
        let o = run(friction, viscosity, stops);
        let steps = o.steps.map_or("-".into(), |s| s.to_string());
        println!("{name:<10} {steps:>14} {:>10.2e} {paper:>10.1e}", o.residual);
        o
    });
    for ((name, .., paper), o) in table.iter().zip(&outcomes) {
        assert!(o.residual < 3.0 * paper, "{name}: {:e}", o.residual);
    }
    let worst_damped = outcomes[3..].iter().fold(0.0_f64, |m, o| m.max(o.residual));
    assert!(outcomes[0].residual > 10.0 * outcomes[1].residual, "viscosity damps");
    assert!(outcomes[0].residual > 100.0 * worst_damped);
    assert!(outcomes[6].steps < outcomes[4].steps, "with stops and viscosity friction is faster");
}
