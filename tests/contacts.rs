//! Contacts: surfaces across which the density jumps. Particles on both sides keep their distance.

use crate::cases::first;
use sph_formats::common::particle_names as names;
use sph_formats::{FORMATS, ParticleFile};
use sph_prep::{Control, Scene, place};

fn placed(scene: &str) -> ParticleFile {
    place(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).unwrap().0
}

/// Half of a periodic unit box, between two parallel surfaces of slope 1 if it is tilted, is `ratio` times as dense.
fn halves(d: usize, is_tilted: bool, ratio: f64, count: usize) -> String {
    let phase = if is_tilted { "(x + y)" } else { "x" };
    let corner = |v: &str| vec![v; d].join(", ");
    format!(
        "input: {{expression: 'if(sin(2*pi*{phase}) > 0, {ratio}, 1)'}}\ndomain: {{box: [[{}], [{}]], boundary: [periodic]}}\nparticles: {count}\n\
         output: {{units: code, target_density: true}}\n",
        corner("0"),
        corner("1")
    )
}

fn values(file: &ParticleFile, name: &str) -> Vec<f64> {
    file.species[0].table.column(name).unwrap().values.to_f64()
}

/// The smallest distance of two particles of a periodic unit box over the mean of their spacings in the target, and that of two on both sides of a jump.
fn closest(file: &ParticleFile) -> (f64, f64) {
    let (d, x) = (file.header.dimension, values(file, names::COORDINATES));
    let (mass, target) = (values(file, names::MASSES), values(file, "TargetDensity"));
    let spacing: Vec<f64> = mass.iter().zip(&target).map(|(m, rho)| (m / rho).powf(1.0 / d as f64)).collect();
    let (mut all, mut across) = (f64::INFINITY, f64::INFINITY);
    for i in 0..mass.len() {
        for j in 0..i {
            let squared = |k: usize| {
                let apart = (x[d * i + k] - x[d * j + k]).abs();
                apart.min(1.0 - apart).powi(2)
            };
            let distance = (0..d).map(squared).sum::<f64>().sqrt() / (0.5 * (spacing[i] + spacing[j]));
            all = distance.min(all);
            if (target[i] / target[j]).ln().abs() > 0.5 {
                across = distance.min(across);
            }
        }
    }
    (all, across)
}

/// By a count of every pair. Beside a jump particles part to 0.87 of the mean spacing, which moves of a tenth of what is left approach, so that a
/// hundredth of it may be missing; elsewhere those that have come to rest are 0.8 apart at least (a lattice: 1.07 and 1.12).
#[test]
fn particles_on_both_sides_of_a_jump_keep_their_distance() {
    for (d, is_tilted, ratio, count) in
        first(3, [(2, false, 2.0, 1500), (2, true, 100.0, 1500), (3, true, 10.0, 1500), (3, false, 2.0, 2000)])
    {
        let file = placed(&halves(d, is_tilted, ratio, count));
        let (all, across) = closest(&file);
        println!("{d}-D, {ratio}: {all:.3}, across {across:.3}");
        assert!(all > 0.8 && across > 0.86, "{d}-D, {ratio}: {all} {across}");
        // Masses of both sides are as 1 to the ratio, to a particle.
        let dense = values(&file, "TargetDensity").iter().filter(|rho| **rho > 0.5 * (1.0 + ratio)).count() as f64;
        let wanted = count as f64 * ratio / (1.0 + ratio);
        assert!((dense - wanted).abs() <= 1.0, "{dense} of {wanted}");
    }
}
