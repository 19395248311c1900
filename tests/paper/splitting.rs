//! Table 2, Fig. 6 and Fig. 16: particle splitting, and the error below which nothing goes.

use crate::{Density, control, integral, interval, target, uniform, well};
use sph_prep::kernel::KernelName;
use sph_prep::metrics::lowest_epsilon;
use sph_prep::placement::{AlaricOptions, StageReport, alaric_by_splitting, coarse_count};

fn run(delta: f64, count: usize, splittings: usize) -> Vec<StageReport> {
    let domain = interval();
    let density = Density(well(delta));
    let mass = integral(|x| well(delta)(&[x]));
    let target = target(&domain, &density, count, mass);
    let options = AlaricOptions {
        kernel_neighbors: std::env::var("NH").unwrap().parse().unwrap(),
        steps: 40000,
        courant: std::env::var("CO").unwrap().parse().unwrap(),
        ..AlaricOptions::new(1)
    };
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

#[test]
fn table2() {
    println!("{:>6} {:>10} {:>10} {:>10} stages", "Delta", "epsilon", "paper", "minimum");
    for (delta, paper) in [(0.0, 2e-4), (0.01, 1e-4), (0.05, 2e-5), (0.1, 2e-6), (0.5, 1e-8), (1.0, 1e-8)] {
        let reports = run(delta, 303, 1);
        let epsilon = last(&reports);
        let stages: Vec<_> = reports.iter().map(|r| format!("{:?} after {}", r.stop, r.history.len() - 1)).collect();
        println!("{delta:>6} {epsilon:>10.1e} {paper:>10.0e} {:>10.1e} {}", bound(delta, 303), stages.join(", "));
    }
}

#[test]
fn fig16() {
    for k in 0..=4 {
        let reports = run(0.0, 51 * 3_usize.pow(k), k as usize);
        println!("{k} splittings: {:.1e}, minimum {:.1e}", last(&reports), bound(0.0, 51 * 3_usize.pow(k)));
    }
}

#[test]
fn fig6() {
    for k in 0..=2 {
        let reports = run(0.0, 909, k);
        let steps: Vec<_> = reports.iter().map(|r| (r.history.len() - 1, r.seconds)).collect();
        println!("{k} splittings: {:.1e} {steps:?}", last(&reports));
    }
}
