//! Starting positions that no seed makes, handed to the stages themselves: coincident particles, lattices with
//! equal coordinates, particles on the boundary, all on one plane, line or point; and options far off.

use super::harness::Case;
use crate::support::{alaric, solve_density, wvt};
use sph::domain::{Axis, Domain, Region, Wall};
use sph::kernel::{KernelName, default_kernel_neighbors, support_over_spacing};
use sph_prep::field::ScalarField;
use sph_prep::metrics::Measured;
use sph_prep::relaxation::{AlaricOptions, Control, PAIRED, SolverOptions, StopReason, WvtOptions, part_pairs};
use sph_prep::target::{Positions, Target, at};
use std::sync::atomic::AtomicBool;

static NEVER: AtomicBool = AtomicBool::new(false);

/// 2 + x: mean 2.5 over the unit box.
struct Slope;

impl<const D: usize> ScalarField<D> for Slope {
    fn value(&self, x: &[f64; D]) -> f64 {
        2.0 + x[0]
    }
}

/// A way to fill `n` starting positions.
type Start = fn(usize, usize, usize) -> f64;

/// Coordinate `k` of particle `i` of `n`, by name.
const STARTS: [(&str, Start); 7] = [
    ("all at one point", |_, _, _| 0.25),
    ("pairs that coincide", |i, k, _| scattered(i / 2, k)),
    ("all in a corner", |_, _, _| 1.0),
    ("all on the boundary", |i, k, _| if k == 0 { (i % 2) as f64 } else { scattered(i, k) }),
    ("all on one plane", |i, k, _| if k == 0 { 0.5 } else { scattered(i, k) }),
    ("all on one line", |i, k, n| if k == 0 { (i as f64 + 0.5) / n as f64 } else { 0.5 }),
    ("lattice with equal coordinates", |i, k, _| ((i / [1, 7, 49][k]) % 7) as f64 / 7.0),
];

fn scattered(i: usize, k: usize) -> f64 {
    ((i + 1) as f64 * [0.754_877_666, 0.569_840_29, 0.430_159_71][k]).fract()
}

fn control() -> Control<'static> {
    Control { deadline: None, interrupted: &NEVER, observer: &|_| {} }
}

/// The first epsilon, that of what came out, and the positions.
type Done<const D: usize> = (Positions<D>, f64, f64, StopReason);

fn stage<const D: usize>(name: &str, target: &Target<'_, D>, start: Positions<D>) -> Done<D> {
    let kernel = KernelName::WendlandC4;
    let (x, report) = match name {
        "wvt" => wvt(kernel, target, start, &WvtOptions { iterations: 30, ..WvtOptions::new(D) }, &control()),
        "solver" => {
            let options = SolverOptions { evaluations: 30, ..SolverOptions::new(D) };
            solve_density::<D, f32>(kernel, target, start, &options, &control())
        }
        _ => {
            let options = AlaricOptions { steps: 100, ..AlaricOptions::new(D) };
            alaric::<D, f32>(kernel, target, start, &options, &control())
        }
    };
    (x, report.history[0].epsilon, report.epsilon().unwrap_or(f64::NAN), report.stop)
}

/// Closest pair over the spacing there.
fn closest<const D: usize>(target: &Target<'_, D>, x: &Positions<D>) -> f64 {
    let neighbors = default_kernel_neighbors(D);
    let ratio = support_over_spacing(D, neighbors);
    let guess: Vec<f64> = target.number_densities(x).iter().map(|&n| ratio * target.spacing(n)).collect();
    let measured = Measured::new(KernelName::WendlandC4, target.domain, x, &target.masses(x), &guess, neighbors);
    measured.neighbors(target.domain, neighbors).closest_pair
}

/// Runs every stage from every start; returns Markdown rows and what was wrong.
pub fn all<const D: usize>(count: usize) -> (String, Vec<String>) {
    let (mut rows, mut wrong) = (String::new(), Vec::new());
    let ball = Domain::ball([0.5; D], 0.5, Wall::Reflecting).unwrap();
    let boxes = [Axis::Periodic, Axis::REFLECTING, Axis::OPEN]
        .map(|axis| Domain::new([0.0; D], [1.0; D], [axis; D], Region::Box).unwrap());
    for (place, domain) in ["periodic", "reflecting", "open", "ball"].iter().zip(boxes.iter().chain([&ball])) {
        let mass = 2.5 * domain.volume();
        let target = Target::of_equal_masses(domain, &Slope, count, mass);
        for (name, start) in STARTS {
            let mut x: Positions<D> = std::array::from_fn(|k| (0..count).map(|i| start(i, k, count)).collect());
            if *place == "ball" {
                // Into the ball inside the box, its surface included.
                (0..D)
                    .for_each(|k| x[k].iter_mut().for_each(|v| *v = 0.5 + (*v - 0.5) / (D as f64).sqrt() * 0.999_999));
            }
            for method in ["wvt", "solver", "alaric"] {
                let (mut y, first, last, stop) = stage(method, &target, x.clone());
                // As runs do after each stage.
                part_pairs(&target, &mut y, PAIRED);
                let case = Case::new(&format!("{name}, {place}, {D}-D"), "");
                let inside = (0..count).all(|i| domain.contains(&at(&y, i)));
                let finite = y.iter().flatten().all(|v| v.is_finite());
                let near = closest(&target, &y);
                rows += &format!("| {} | {method} | {first:.1e} | {last:.1e} | {near:.3} | {stop:?} |\n", case.name);
                let mut fault = |bad: bool, text: String| {
                    if bad {
                        wrong.push(format!("{} by {method}: {text}", case.name));
                    }
                };
                fault(y.iter().any(|v| v.len() != count), "lost particles".into());
                fault(!finite, "positions are not finite".into());
                fault(finite && !inside, "particles outside".into());
                fault(!(last <= first), format!("epsilon {first:.2e} -> {last:.2e}"));
                // On a reflecting wall the image counts as well.
                fault(!(near > 0.02), format!("closest pair {near:.1e}"));
            }
        }
    }
    (rows, wrong)
}
