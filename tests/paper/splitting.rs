//! Table 2, Fig. 6 and Fig. 16: particle splitting, and the error below which nothing goes.

use super::results::Table;
use super::{Density, control, integral, interval, target, uniform, well};
use crate::support::alaric_by_splitting;
use sph::kernel::KernelName;
use sph_prep::metrics::lowest_epsilon;
use sph_prep::relaxation::{AlaricOptions, StageReport, coarse_count};

fn run(delta: f64, count: usize, splittings: usize) -> Vec<StageReport> {
    let domain = interval();
    let density = Density(well(delta));
    let mass = integral(|x| well(delta)(&[x]));
    let target = target(&domain, &density, count, mass);
    let options = AlaricOptions { kernel_neighbors: 8.0, rate_tolerance: 1e-10, ..AlaricOptions::new(1) };
    let start = uniform(coarse_count(1, count, splittings));
    alaric_by_splitting::<1, f64>(KernelName::WendlandC4, &target, start, splittings, &options, &control()).1
}

fn bound(delta: f64, count: usize) -> f64 {
    lowest_epsilon(1, count, |r| well(delta)(&[0.5 * (1.0 + r)]))
}

fn last(reports: &[StageReport]) -> f64 {
    let report = reports.last().unwrap();
    report.history[report.best_iteration].epsilon
}

fn ends(reports: &[StageReport]) -> String {
    let steps = |r: &StageReport| r.history.last().map_or(0, |p| p.iteration);
    reports.iter().map(|r| format!("{:?} after {}", r.stop, steps(r))).collect::<Vec<_>>().join(", ")
}

/// The paper's residuals from above: where the target is positive everywhere it stops at 1e-8. The estimate of
/// the lowest epsilon is no bound for our states, which also re-fit the mass and sum over supports wider than
/// lambda. At Delta = 0.1 and 0.5 we stay above the paper, 8 and 4 times: the steps run out while epsilon falls.
fn table2_of(rows: &[(f64, f64, f64, f64)]) -> Table {
    let mut page = Table::new(
        "Table 2: one splitting, 101 to 303 particles in 1-D",
        "Lowest epsilon of the well of eq. 46 for six depths; the minimum is the paper's estimate, computed here.",
        &["Delta", "epsilon, paper", "here", "minimum, paper", "here", "stages"],
    );
    let outcomes = rows.iter().map(|&(delta, paper, minimum, _)| {
        let reports = run(delta, 303, 1);
        let (epsilon, ours) = (last(&reports), bound(delta, 303));
        page.row(&[
            delta.to_string(),
            format!("{}{paper:.0e}", if delta >= 0.5 { "below " } else { "" }),
            format!("{epsilon:.1e}"),
            format!("{minimum:.0e}"),
            format!("{ours:.1e}"),
            ends(&reports),
        ]);
        assert!((0.8..1.45).contains(&(ours / minimum)), "Delta {delta}: {ours:e}");
        epsilon
    });
    let outcomes: Vec<f64> = outcomes.collect();
    page.note(
        "Delta = 0.05 comes to rest in one of several states, from 1.9e-7 to 1.7e-4, and rounding decides in which. \
         Not reached: Delta = 0.1 and 0.5 end 8 and 4 times above the paper, with epsilon still falling when the 10 000 \
         steps are used up. The estimate of the minimum is no bound here: it takes the error of one particle of \
         radius lambda at the bottom for all, while the states here re-fit the mass and sum over wider supports.",
    );
    for ((delta, paper, _, within), epsilon) in rows.iter().zip(outcomes) {
        assert!(epsilon < within * paper, "Delta {delta}: {epsilon:e}");
    }
    page
}

/// Delta, epsilon of the paper, its minimum, and within which factor of its epsilon we end.
const TABLE_2: [(f64, f64, f64, f64); 6] = [
    (0.0, 2e-4, 1e-4, 3.0),
    (0.01, 1e-4, 7e-5, 3.0),
    (0.05, 2e-5, 9e-6, 10.0),
    (0.1, 2e-6, 8e-7, 20.0),
    (0.5, 1e-8, 1e-9, 5.0),
    (1.0, 1e-8, 8e-11, 3.0),
];

/// The deepest well, and the shallowest.
#[test]
fn table2() {
    table2_of(&[TABLE_2[0], TABLE_2[5]]);
}

#[test]
#[ignore = "half a minute"]
fn table2_to_the_end() {
    table2_of(&TABLE_2).publish("table2");
}

fn fig16_up_to(most: usize, publish: bool) {
    let mut page = Table::new(
        "Fig. 16: 51 particles split zero to four times",
        "In the paper the error falls with each splitting and stays above the estimate of the minimum.",
        &["splittings", "particles", "epsilon", "minimum", "stages"],
    );
    let mut before = f64::INFINITY;
    for k in 0..=most {
        let count = 51 * 3_usize.pow(k as u32);
        let reports = run(0.0, count, k);
        let (epsilon, minimum) = (last(&reports), bound(0.0, count));
        page.row(&[
            k.to_string(),
            count.to_string(),
            format!("{epsilon:.1e}"),
            format!("{minimum:.1e}"),
            ends(&reports),
        ]);
        // Beyond two the steps are used up before epsilon has come down.
        assert!(epsilon < before || k > 2, "{k} splittings: {epsilon:e}");
        assert!(epsilon < 3e-4 || k == 0, "{k} splittings: {epsilon:e}");
        before = epsilon;
    }
    page.note(
        "Every splitting lowers the error, as in the paper. All end at about half of the estimate of the minimum, which is no \
         bound here (see Table 2). How far the last stages come down depends on where they come to rest: a step is a fraction \
         of the smallest support radius, so that 10 000 of them span less time the more particles there are.",
    );
    if publish {
        page.publish("fig16");
    }
}

#[test]
fn fig16() {
    fig16_up_to(2, false);
}

#[test]
#[ignore = "half a minute"]
fn fig16_to_the_end() {
    fig16_up_to(4, true);
}

/// 909 particles in the end. (That splitting leaves an error below 3e-4 is what the short form of Fig. 16 checks.)
#[test]
#[ignore = "half a minute"]
fn fig6() {
    let mut page = Table::new(
        "Fig. 6: zero to two splittings to 909 particles",
        "In the paper one splitting is best: none takes longer, two add noise.",
        &["splittings", "epsilon", "seconds", "stages"],
    );
    let outcomes: Vec<f64> = (0..=2)
        .map(|k| {
            let reports = run(0.0, 909, k);
            let seconds: f64 = reports.iter().map(|r| r.seconds).sum();
            page.row(&[k.to_string(), format!("{:.1e}", last(&reports)), format!("{seconds:.1}"), ends(&reports)]);
            last(&reports)
        })
        .collect();
    page.note(
        "All three end within a factor of six of each other here, and which is lowest is a matter of where they come to \
         rest; the paper's order is not reproduced.",
    );
    page.publish("fig6");
    assert!(outcomes.iter().all(|o| *o < 3e-4), "{outcomes:?}");
}
