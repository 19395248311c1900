use sph_prep::domain::*;
use sph_prep::field::ScalarField;
use sph_prep::kernel::*;
use sph_prep::metrics::*;
use sph_prep::placement::*;
use sph_prep::seeding::*;
use sph_prep::target::*;
use std::sync::atomic::AtomicBool;
struct F(u8);
impl ScalarField<3> for F {
    fn value(&self, x: &[f64; 3]) -> f64 {
        match self.0 {
            0 => 1.0,
            1 => 1.0 + 0.5 * (6.283185307 * x[0]).sin() * (6.283185307 * x[1]).cos(),
            _ => 1.0 + 99.0 * (-(x.iter().map(|v| (v - 0.5).powi(2)).sum::<f64>()) / (2.0 * 0.1 * 0.1)).exp(),
        }
    }
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let n: usize = a[1].parse::<f64>().unwrap() as usize;
    let f: u8 = a[2].parse().unwrap();
    let step: f64 = a[3].parse().unwrap();
    let fin: f64 = a[4].parse().unwrap();
    let its: usize = a[5].parse().unwrap();
    let w = if a.get(6).map(|s| s == "inv").unwrap_or(false) { Weight::InverseSquare } else { Weight::Kernel };
    let domain = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap();
    let field = F(f);
    let mut mass = 0.0;
    let m = 64;
    for i in 0..m {
        for j in 0..m {
            for k in 0..m {
                mass += field.value(&[
                    (i as f64 + 0.5) / m as f64,
                    (j as f64 + 0.5) / m as f64,
                    (k as f64 + 0.5) / m as f64,
                ]);
            }
        }
    }
    mass /= (m * m * m) as f64;
    let target = Target {
        domain: &domain,
        density: &field,
        resolution: Resolution::EqualMass,
        count: n,
        mass,
        resolution_integral: mass,
    };
    let t = std::time::Instant::now();
    let x = seed(&target, Seeding::MassBisection, 1).unwrap();
    println!("seed {:.2}s", t.elapsed().as_secs_f64());
    let stop = AtomicBool::new(false);
    let obs = |_: &'static str, _: usize, _: usize, _: f64| {};
    let c = Control { deadline: None, interrupted: &stop, observer: &obs };
    let meas = |x: &Positions<3>| {
        let masses = target.masses(x);
        let nd = target.number_densities(x);
        let guess: Vec<f64> = nd.iter().map(|v| 2.48 * v.powf(-1.0 / 3.0)).collect();
        let m = Measured::new(WendlandC4, &domain, x, &masses, &guess, 64.0);
        let e = DensityError::new(&m, &target.densities(x));
        let no = NoiseFigures::new(WendlandC4, &m, &domain, &masses, 64.0);
        println!(
            "eps refit {:.3e} given {:.3e} mean {:.2e} max {:.2e} noise {:.3}% {:?}",
            e.all_refitted.epsilon,
            e.all.epsilon,
            e.all_refitted.mean,
            e.all_refitted.max,
            100.0 * no.all,
            m.neighbors(&domain, x, 64.0)
        );
    };
    meas(&x);
    let r = seed(&target, Seeding::Random, 1).unwrap();
    meas(&r);
    let mut o = WvtOptions::new(3);
    o.step = step;
    o.final_step = fin;
    o.iterations = its;
    o.weight = w;
    let (x, rep) = relax(WendlandC4, &target, x, &o, &c);
    for h in &rep.history {
        if h.iteration % 5 == 0 {
            println!("{:3} {:.3e} {:.4} {:.2}s", h.iteration, h.epsilon, h.largest_step, h.seconds);
        }
    }
    println!("best {} {:?}", rep.best_iteration, rep.stop);
    meas(&x);
}
