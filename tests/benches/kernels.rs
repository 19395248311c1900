//! Every kernel with few and many neighbors: error, noise and closest pair by WVT and by the default.
//!
//! `cargo bench --bench kernels [-- N]` prints a table; with SPH_PREP_RESULTS=docs/src/results it also writes
//! `kernels.md` there.

mod support;

use sph::kernel::KernelName;
use sph_prep::run::report::Report;
use sph_prep::scene::{Polish, Scene};
use std::fmt::Write;
use std::path::Path;

const CASES: [(KernelName, f64); 13] = [
    (KernelName::WendlandC2, 64.0),
    (KernelName::WendlandC2, 128.0),
    (KernelName::WendlandC4, 64.0),
    (KernelName::WendlandC4, 128.0),
    (KernelName::WendlandC6, 128.0),
    (KernelName::WendlandC6, 250.0),
    (KernelName::CubicSpline, 48.0),
    (KernelName::CubicSpline, 64.0),
    (KernelName::CubicSpline, 128.0),
    (KernelName::Quartic, 64.0),
    (KernelName::Quartic, 128.0),
    (KernelName::Quintic, 128.0),
    (KernelName::Quintic, 250.0),
];

fn figures(report: &Report) -> String {
    let error = report.density_error.all_refitted;
    let (mean, noise) = (100.0 * error.mean, 100.0 * report.noise.all);
    format!("{:.1e} | {mean:.3} % | {noise:.1} % | {:.2}", error.epsilon, report.neighbors.closest_pair)
}

fn row(kernel: KernelName, neighbors: f64, count: usize) -> Result<String, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles/uniform-3d.yaml");
    let mut scene = Scene::load(&path).map_err(|e| e.to_string())?;
    (scene.kernel, scene.neighbors, scene.particles) = (Some(kernel), Some(neighbors), Some(count));
    let solved = support::run(&scene)?;
    scene.polish = Some(Polish::None);
    let wvt = support::run(&scene)?;
    Ok(format!("| {}, {neighbors} | {} | {} |\n", kernel.title(), figures(&wvt), figures(&solved)))
}

fn main() {
    let count = std::env::args().filter_map(|a| a.parse::<f64>().ok()).next().unwrap_or(8e3) as usize;
    let mut page = format!(
        "# Kernels and neighbor numbers\n\n`SPH_PREP_RESULTS=docs/src/results cargo bench --bench kernels -- {count}` makes this page: {count} particles in a \
         uniform periodic box by WVT\nalone and by the default. Density error (mass re-fitted), force noise as a fraction of random points', and the closest pair in \
         spacings.\nB-splines are brought to rest by Wendland C4, since at rest they make pairs (Dehnen & Aly 2012); those with more neighbors than keep\nparticles apart end \
         with the density alone.\n\n| kernel, neighbors | WVT: epsilon | mean | noise | closest | default: epsilon | mean | noise | closest |\n\
         |---|---|---|---|---|---|---|---|---|\n"
    );
    print!("{page}");
    for (kernel, neighbors) in CASES {
        let row = row(kernel, neighbors, count).unwrap_or_else(|problem| support::fail(&problem));
        print!("{row}");
        let _ = write!(page, "{row}");
    }
    support::write_page("kernels.md", &page);
}
