//! Table 1: what friction, viscosity and velocity stops do, alone and together.

use super::results::Table;
use super::{Density, control, integral, interval, target, uniform, well};
use crate::support::alaric;
use sph::kernel::KernelName;
use sph_prep::relaxation::{AlaricOptions, StopReason};

/// What a run comes to.
struct Outcome {
    /// First step with epsilon below 1e-3.
    to_1e3: Option<usize>,
    /// Steps until the paper's criteria, epsilon or its rate below 1e-8, held.
    converged: Option<usize>,
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
    let converged = matches!(report.stop, StopReason::Stagnated | StopReason::ToleranceReached);
    Outcome {
        to_1e3: history.iter().position(|h| h.epsilon < 1e-3),
        converged: converged.then(|| history.len() - 1),
        residual: tail[tail.len() / 2],
    }
}

fn steps(count: Option<usize>) -> String {
    count.map_or("over 10000".into(), |s| s.to_string())
}

/// The paper's residuals, from above, and what our runs come to.
#[test]
#[ignore = "slow: .ci/full runs it"]
fn ingredients() {
    let table = [
        ("reference", false, false, false, "over 10000", 0.17),
        ("V", false, true, false, "over 10000", 3.4e-3),
        ("S", false, false, true, "over 10000", 1.3e-3),
        ("S+V", false, true, true, "over 10000", 2e-4),
        ("F", true, false, false, "6841", 2e-4),
        ("F+V", true, true, false, "6486", 2e-4),
        ("S+F+V", true, true, true, "4218", 2e-4),
        ("S+F", true, false, true, "4219", 2e-4),
    ];
    let mut page = Table::new(
        "Table 1: friction F, viscosity V, velocity stops S",
        "300 particles in 1-D in the well of eq. 46 with Delta = 0, from uniform; thresholds 1e-8.",
        &["run", "steps to converge, paper", "here", "steps to epsilon 1e-3, here", "epsilon, paper", "here"],
    );
    let outcomes = table.map(|(name, friction, viscosity, stops, theirs, paper)| {
        let o = run(friction, viscosity, stops);
        page.row(&[
            name.into(),
            theirs.into(),
            steps(o.converged),
            steps(o.to_1e3),
            format!("{paper:.1e}"),
            format!("{:.2e}", o.residual),
        ]);
        o
    });
    page.note(
        "Steps to converge hang on a rate of 1e-8 per unit of a time that the paper does not state, so steps to 1e-3 \
         stand beside them. Not reached: by the \
         paper's criteria runs with stops take longer than F alone here: they creep on near the paper's 2e-4 up to the \
         last step, while those with inertia (F, F+V) go on to lower errors.",
    );
    page.publish("table1");
    for ((name, .., paper), o) in table.iter().zip(&outcomes) {
        assert!(o.residual < 3.0 * paper, "{name}: {:e}", o.residual);
    }
    let worst_damped = outcomes[3..].iter().fold(0.0_f64, |m, o| m.max(o.residual));
    assert!(outcomes[0].residual > 10.0 * outcomes[1].residual, "viscosity damps");
    assert!(outcomes[0].residual > 100.0 * worst_damped);
    assert!(outcomes[6].to_1e3 < outcomes[4].to_1e3, "with stops and viscosity friction is faster");
}
