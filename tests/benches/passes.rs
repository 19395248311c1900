//! Cost of one density + gradient pass per particle: N from 1e4 to 1e7, uniform and with a 1e6:1 contrast.
//!
//! `cargo bench --bench passes [-- LARGEST_N]`

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use sph::domain::{Axis, Domain, Region};
use sph::kernel::KernelName;
use sph::neighbors::{Reach, Sources, Tree};
use sph::sums::{Search, density, solve_support_radii};
use std::time::Instant;

const NEIGHBORS: f64 = 64.0;

fn positions(n: usize, contrast: f64) -> [Vec<f64>; 3] {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let side = (n as f64).cbrt().round() as usize;
    // Jittered lattice; with a contrast, mapped radially so that the density falls as r^-s from the center.
    let power = if contrast > 1.0 { contrast.ln() / (n as f64).ln() } else { 0.0 };
    let mut out: [Vec<f64>; 3] = Default::default();
    for i in 0..side * side * side {
        let cell = [i % side, i / side % side, i / side / side];
        let mut x: [f64; 3] =
            std::array::from_fn(|k| (cell[k] as f64 + 0.25 + 0.5 * rng.random::<f64>()) / side as f64);
        if power > 0.0 {
            let r = x.iter().map(|v| (v - 0.5).powi(2)).sum::<f64>().sqrt().max(1e-12);
            let scale = (2.0 * r).powf(power.min(6.0));
            x = x.map(|v| 0.5 + (v - 0.5) * scale.min(1.0));
        }
        (0..3).for_each(|k| out[k].push(x[k]));
    }
    out
}

fn measure(n: usize, contrast: f64) {
    let domain = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap();
    let x = positions(n, contrast);
    let n = x[0].len();
    let start = Instant::now();
    let tree = Tree::build(&x);
    let build = start.elapsed();
    let guess = vec![(NEIGHBORS / (4.19 * n as f64)).cbrt(); n];
    let sources = [Sources::<3, 0>::new(&tree, &guess, [], Reach::Target)];
    let start = Instant::now();
    let solved =
        solve_support_radii::<3, 0, f32>(KernelName::WendlandC4, &domain, &sources, (NEIGHBORS, Search::EXACT), 2.0);
    let solve = start.elapsed();
    let support: Vec<f64> = solved.iter().map(|s| s.support).collect();
    let spread = support.iter().fold(0.0_f64, |m, &h| m.max(h)) / support.iter().fold(f64::MAX, |m, &h| m.min(h));
    let sources = [Sources::<3, 0>::new(&tree, &support, [], Reach::Target)];
    let mut best = f64::MAX;
    for _ in 0..3 {
        let start = Instant::now();
        std::hint::black_box(density::<3, 0, f32>(KernelName::WendlandC4, &domain, &sources));
        best = best.min(start.elapsed().as_secs_f64());
    }
    let per = |t: f64| t / n as f64 * 1e9;
    println!(
        "{n:>9} {contrast:>9.0e} {:>10.3e} {:>9.0} {:>9.0} {:>9.0}",
        spread.powi(3),
        per(build.as_secs_f64()),
        per(solve.as_secs_f64()),
        per(best)
    );
}

fn main() {
    let largest: usize = std::env::args().filter_map(|a| a.parse::<f64>().ok()).next().unwrap_or(1e6) as usize;
    println!("{} threads; ns of wall time per particle", rayon::current_num_threads());
    println!("{:>9} {:>9} {:>10} {:>9} {:>9} {:>9}", "N", "contrast", "(max/min)", "tree", "solve H", "pass");
    for n in [10_000, 100_000, 1_000_000, 10_000_000] {
        if n <= largest {
            measure(n, 1.0);
        }
    }
    measure(1_000_000.min(largest), 1e6);
}
