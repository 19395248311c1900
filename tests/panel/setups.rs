//! The methods, the two targets and what is measured of them.

use crate::support::{self, alaric, solve_density};
use sph::domain::{Axis, Domain, Region, Wall};
use sph::kernel::{CubicSpline, Kernel, KernelName, evaluate, support_over_spacing};
use sph::neighbors::brute_force;
use sph_prep::field::ScalarField;
use sph_prep::metrics::{BondOrder, DensityError, Measured, NoiseFigures};
use sph_prep::relaxation::{AlaricOptions, Control, SolverOptions, WvtOptions};
use sph_prep::seeding::{Seeding, is_radial, seed};
use sph_prep::target::{Positions, Target, at};
use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

static NEVER: AtomicBool = AtomicBool::new(false);

/// Neighbors of the deviations, as in the paper, and of the noise.
const PLANE_NEIGHBORS: f64 = 128.0;
const NOISE_NEIGHBORS: f64 = 64.0;
/// Pixels along an edge of a picture.
pub const PIXELS: usize = 64;

/// What follows the seeding.
#[derive(Clone, Copy)]
pub enum Then {
    Nothing,
    Wvt,
    Alaric,
    /// The default: WVT, or for radial targets shells, and the solver with this quietness.
    Solver(f64),
}

#[derive(Clone, Copy)]
pub struct Setup {
    pub name: &'static str,
    seeding: Seeding,
    then: Then,
}

const fn setup(name: &'static str, seeding: Seeding, then: Then) -> Setup {
    Setup { name, seeding, then }
}

pub const SETUPS: [Setup; 15] = [
    setup("cubic", Seeding::Cubic, Then::Nothing),
    setup("cubic-close-packed", Seeding::CubicClosePacked, Then::Nothing),
    setup("hexagonal-close-packed", Seeding::HexagonalClosePacked, Then::Nothing),
    setup("body-centered-cubic", Seeding::BodyCenteredCubic, Then::Nothing),
    setup("quaquaversal", Seeding::Quaquaversal, Then::Nothing),
    setup("random", Seeding::Random, Then::Nothing),
    setup("low-discrepancy", Seeding::LowDiscrepancy, Then::Nothing),
    setup("shells", Seeding::Shells, Then::Nothing),
    setup("equal-area-shells", Seeding::EqualAreaShells, Then::Nothing),
    setup("glass", Seeding::Glass, Then::Nothing),
    setup("gravitational-glass", Seeding::GravitationalGlass, Then::Nothing),
    setup("WVT", Seeding::MassBisection, Then::Wvt),
    setup("WVT, ALARIC", Seeding::MassBisection, Then::Alaric),
    setup("ours", Seeding::MassBisection, Then::Solver(0.5)),
    setup("ours, quiet", Seeding::MassBisection, Then::Solver(1.0)),
];

/// A target of the comparison.
pub trait Problem: ScalarField<3> {
    /// The domain in which a seeding can show the target.
    fn domain(&self, seeding: Seeding) -> Domain<3>;
    fn mass(&self, domain: &Domain<3>) -> f64;
    /// The target smoothed by a kernel of this support radius.
    fn smoothed(&self, x: &[f64; 3], support: f64) -> f64;
    /// A square of the plane z = const: its corner, edge and height.
    fn window(&self) -> ([f64; 3], f64);
}

/// Density 1: a periodic cube, for shells a ball.
pub struct Uniform;

impl ScalarField<3> for Uniform {
    fn value(&self, _: &[f64; 3]) -> f64 {
        1.0
    }
}

impl Problem for Uniform {
    fn domain(&self, seeding: Seeding) -> Domain<3> {
        let axes = match seeding {
            Seeding::Shells | Seeding::EqualAreaShells => return Domain::ball([0.5; 3], 0.62, Wall::Open).unwrap(),
            // The tiling does not repeat: judged where no seam is near.
            Seeding::Quaquaversal => [Axis::OPEN; 3],
            _ => [Axis::Periodic; 3],
        };
        Domain::new([0.0; 3], [1.0; 3], axes, Region::Box).unwrap()
    }

    fn mass(&self, domain: &Domain<3>) -> f64 {
        domain.volume()
    }

    fn smoothed(&self, _: &[f64; 3], _: f64) -> f64 {
        1.0
    }

    fn window(&self) -> ([f64; 3], f64) {
        ([0.3, 0.3, 0.55], 0.4)
    }
}

/// n ~ r^-2, so that the spacing grows as r^(2/3), in the unit ball.
pub struct Sphere;

impl ScalarField<3> for Sphere {
    fn value(&self, x: &[f64; 3]) -> f64 {
        1.0 / x.iter().map(|v| v * v).sum::<f64>().max(1e-6)
    }
}

impl Problem for Sphere {
    fn domain(&self, _: Seeding) -> Domain<3> {
        Domain::ball([0.0; 3], 1.0, Wall::Open).unwrap()
    }

    /// 4 pi R, less what the bound at r = 1e-3 takes away.
    fn mass(&self, _: &Domain<3>) -> f64 {
        4.0 * PI * (1.0 - 1e-3 + 1e-3 / 3.0)
    }

    /// Over a sphere of radius s about a point at R the mean of r^-2 is ln((R + s)/|R - s|)/(2 R s).
    fn smoothed(&self, x: &[f64; 3], support: f64) -> f64 {
        const SHELLS: usize = 400;
        let distance = x.iter().map(|v| v * v).sum::<f64>().sqrt();
        let shell = |i: usize| {
            let q = (i as f64 + 0.5) / SHELLS as f64;
            let s = q * support;
            let mean = ((distance + s) / (distance - s).abs()).ln() / (2.0 * distance * s);
            4.0 * PI * q * q * <CubicSpline as Kernel>::SIGMA[2] * evaluate::<_, 3>(CubicSpline, q).0 * mean
        };
        (0..SHELLS).map(shell).sum::<f64>() / SHELLS as f64
    }

    /// Off the center, which no sum over neighbors resolves.
    fn window(&self) -> ([f64; 3], f64) {
        ([0.15, -0.25, 0.05], 0.5)
    }
}

pub struct Measure {
    /// Largest and root mean square deviation over the picture.
    pub max: f64,
    pub rms: f64,
    /// Root mean square deviation from the target as the kernel smooths it, the mean taken out.
    pub uneven: f64,
    /// Mean deviation at the particles inside, with the kernel and neighbors of placing, mass re-fitted.
    pub at_particles: f64,
    /// Over particles inside, with the paper's kernel and with that of placing.
    pub noise: [f64; 2],
    pub order: BondOrder,
    /// rho/rho* - 1, row by row.
    pub pixels: Vec<f64>,
}

/// Sets up and measures; what a method does not admit is the error.
pub fn measure(setup: &Setup, problem: &dyn Problem, count: usize) -> Result<Measure, String> {
    let domain = problem.domain(setup.seeding);
    let mass = problem.mass(&domain);
    let field = Borrowed(problem);
    let target = Target::of_equal_masses(&domain, &field, count, mass);
    let x = place(setup, &target).map_err(|e| e.to_string())?;
    let masses = target.masses(&x);
    let guess = |neighbors: f64| -> Vec<f64> {
        let ratio = support_over_spacing(3, neighbors);
        target.number_densities(&x).iter().map(|&n| ratio * target.spacing(n)).collect()
    };
    let guess_noise = guess(NOISE_NEIGHBORS);
    let [(_, paper), (noisy, own)] = [KernelName::CubicSpline, KernelName::WendlandC4].map(|kernel| {
        let measured = Measured::new(kernel, &domain, &x, &masses, &guess_noise, NOISE_NEIGHBORS);
        let noise = NoiseFigures::new(kernel, &measured, &domain, &masses, NOISE_NEIGHBORS);
        (measured, noise.interior.unwrap_or(noise.all))
    });
    let errors = DensityError::new(&noisy, &target.densities(&x), None);
    let at_particles = errors.stated().mean;
    let order = BondOrder::new(&noisy, &domain).ok_or("no bonds")?;
    let (corner, edge) = problem.window();
    let ratio = support_over_spacing(3, PLANE_NEIGHBORS);
    let mut pixels = Vec::with_capacity(PIXELS * PIXELS);
    let mut smooth = Vec::with_capacity(PIXELS * PIXELS);
    for pixel in 0..PIXELS * PIXELS {
        let offset = |i: usize| edge * (i as f64 + 0.5) / PIXELS as f64;
        let point = [corner[0] + offset(pixel % PIXELS), corner[1] + offset(pixel / PIXELS), corner[2]];
        let support = ratio * target.spacing(target.number_density(&point));
        let norm = <CubicSpline as Kernel>::SIGMA[2] / support.powi(3);
        let mut density = 0.0;
        brute_force::for_each_within(&domain, &x, &point, support, |d, j| {
            let r = d.iter().map(|v| v * v).sum::<f64>().sqrt();
            density += masses[j] * norm * evaluate::<_, 3>(CubicSpline, r / support).0;
        });
        pixels.push(density / problem.value(&point) - 1.0);
        smooth.push(density / problem.smoothed(&point, support) - 1.0);
    }
    let max = pixels.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
    let rms = |values: &[f64], mean: f64| {
        (values.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
    };
    let mean = smooth.iter().sum::<f64>() / smooth.len() as f64;
    let (rms, uneven) = (rms(&pixels, 0.0), rms(&smooth, mean));
    Ok(Measure { max, rms, uneven, at_particles, noise: [paper, own], order, pixels })
}

struct Borrowed<'a>(&'a dyn Problem);

impl ScalarField<3> for Borrowed<'_> {
    fn value(&self, x: &[f64; 3]) -> f64 {
        self.0.value(x)
    }
}

fn place(setup: &Setup, target: &Target<'_, 3>) -> sph_prep::error::Result<Positions<3>> {
    let control = Control { deadline: None, interrupted: &NEVER, observer: &|_| {} };
    let kernel = KernelName::WendlandC4;
    let start = seed(target, setup.seeding, 1)?.positions;
    let wvt = |iterations: usize| WvtOptions { iterations, ..WvtOptions::new(3) };
    let x = match setup.then {
        Then::Nothing => start,
        Then::Wvt => support::wvt(kernel, target, start, &wvt(60), &control).0,
        Then::Alaric => {
            let x = support::wvt(kernel, target, start, &wvt(5), &control).0;
            let options = AlaricOptions { steps: 500, ..AlaricOptions::new(3) };
            alaric::<3, f32>(kernel, target, x, &options, &control).0
        }
        Then::Solver(quietness) => {
            let settled = is_radial(target);
            let x = if settled {
                seed(target, Seeding::EqualAreaShells, 1)?.positions
            } else {
                support::wvt(kernel, target, start, &wvt(5), &control).0
            };
            let options = SolverOptions { quietness, settled, ..SolverOptions::new(3) };
            solve_density::<3, f32>(kernel, target, x, &options, &control).0
        }
    };
    assert!((0..target.count).all(|i| target.admits(&at(&x, i))), "{}: particles outside", setup.name);
    Ok(x)
}
