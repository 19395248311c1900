//! Adjusts the thickness of a disc to the vertical equilibrium that the simulation code computes.
//!
//! Sums over neighbors smooth a layer that is only some smoothing lengths thick, and the resulting pressure force pushes it apart: a disc placed with
//! the thickness of the gas would oscillate about a thicker equilibrium. For the code that a scene names, rings of the disc are stretched along the
//! axis until in each ring sum z a = -sum z g, with the acceleration a that the code computes from its kernel and the gas's temperature, and the
//! gravity g that balances the target's pressure, dP*/dz / rho*. The ratio of the two sums falls by twice the stretch.
//!
//! Sheared particles move relative to each other, and viscosity acts on them. Where the share of the weight that viscosity supports is known for the
//! code, a has to support that much less.

use crate::field::CarriedField;
use crate::input::displacement::Displaced;
use crate::input::internal_units::Prepared;
use crate::metrics::{Measured, strengths};
use crate::scene::Scene;
use crate::target::{Positions, Target, at};
use sph::parallel;
use sph_formats::common::particle_names as names;

/// Particles of a ring, and rings at most: the scatter of forces over the root of the former is less than a hundredth.
const PER_RING: usize = 250;
const MOST_RINGS: usize = 64;
/// How often the forces are looked at.
const ROUNDS: usize = 3;
/// Largest change: where more would be needed the layer is thinner than kernels see, and is left as it is placed.
const MOST: f64 = 0.15;
/// Shear is taken to hold at most this share of the weight: it is known of layers that are resolved.
const MOST_BY_SHEAR: f64 = 0.2;
/// Step of the differences of the target, in support radii.
const STEP: f64 = 1e-3;

/// The particles of a disc that is made for a code, where they are pushed to; `None` of all else.
pub(super) fn stretched<const D: usize>(
    scene: &Scene,
    prepared: &Prepared<D>,
    target: &Target<'_, D>,
    (positions, masses, support): (&Positions<D>, &[f64], &[f64]),
) -> Option<Displaced<D>> {
    let is_for_a_code = D == 3 && scene.input.disc().is_some() && scene.code().is_some();
    let pressure = prepared.source.carried.iter().find(|f| f.info().name == names::PRESSURE);
    let pressure = pressure.filter(|_| is_for_a_code && scene.collisionless.is_none())?;
    let carried = &prepared.source.carried;
    let velocity = carried.iter().find(|f| f.info().name == names::VELOCITIES).map(AsRef::as_ref);
    // Of the input's numbers, in which pressure and velocity are.
    let density = prepared.mass.value / prepared.length.powi(D as i32);
    let shear = velocity.zip(scene.code().map(|code| code.support_by_shear()));
    let layer = Layer::new(target, (pressure.as_ref(), density, shear), positions, masses);
    let sums = (scene.kernel(), scene.kernel_neighbors(D));
    let rings = layer.rings.len();
    let (mut moved, mut stretch, mut is_resolved) = (positions.clone(), vec![1.0; rings], vec![true; rings]);
    for _ in 0..ROUNDS {
        let measured = Measured::new(sums.0, target.domain, &moved, masses, support, sums.1);
        let temperature = layer.temperatures(target, &moved);
        let strength = strengths(&measured, |i| temperature[i]);
        let force = measured.pressure_force(sums.0, target.domain, masses, &strength);
        let excess = layer.excess(target, &moved, &|i| force[i][D - 1], &measured.support);
        for (ring, excess) in excess.into_iter().enumerate() {
            let next = stretch[ring] * (1.0 + 0.5 * excess);
            is_resolved[ring] &= (next - 1.0).abs() <= MOST;
            stretch[ring] = if is_resolved[ring] { next } else { 1.0 };
        }
        moved[D - 1] = layer.heights(target, positions, &stretch);
    }
    let note = said(&stretch, &is_resolved);
    let along = (0..masses.len()).map(|i| moved[D - 1][i] - positions[D - 1][i]);
    let moves = along.map(|dz| sph::array(|k| if k == D - 1 { dz } else { 0.0 })).collect();
    let volumes = parallel::map(masses.len(), |i| layer.of_ring(i, &stretch));
    Some(Displaced { positions: moved, moves, volumes, is_at_rest: true, note })
}

/// What is done to the rings.
fn said(stretch: &[f64], is_resolved: &[bool]) -> String {
    let left = is_resolved.iter().filter(|is| !**is).count();
    let unresolved = "the layer is thinner than kernels see, and is not stretched to where the code's pressure would hold it: use more particles";
    if left == stretch.len() {
        return format!("the disc is not resolved along its axis: {unresolved}");
    }
    let held = || stretch.iter().zip(is_resolved).filter(|(_, is)| **is).map(|(f, _)| *f);
    let (least, most) = held().fold((f64::INFINITY, 0.0_f64), |(a, b), f| (a.min(f), b.max(f)));
    let beside = if left > 0 { format!("; in {left} of {} rings {unresolved}", stretch.len()) } else { String::new() };
    format!(
        "along its axis the disc is stretched by {least:.3} to {most:.3}, ring by ring, to where the pressure that the code sums over neighbors holds it up. Figures of \
         density, noise and neighbors are those of the placement, without the stretch{beside}"
    )
}

/// Particles by their distance from the axis.
struct Layer<'a, const D: usize> {
    masses: &'a [f64],
    /// P*.
    pressure: &'a dyn CarriedField<D>,
    /// The input's unit of density per internal one.
    density: f64,
    /// Velocities, and what shear holds up.
    shear: Option<(&'a dyn CarriedField<D>, f64)>,
    radii: Vec<f64>,
    rings: Vec<Vec<usize>>,
    /// Of the rings, on average.
    middles: Vec<f64>,
}

impl<'a, const D: usize> Layer<'a, D> {
    fn new(
        target: &Target<'_, D>,
        (pressure, density, shear): (&'a dyn CarriedField<D>, f64, Option<(&'a dyn CarriedField<D>, f64)>),
        positions: &Positions<D>,
        masses: &'a [f64],
    ) -> Self {
        let (n, center) = (masses.len(), target.domain.center());
        let radii = parallel::map(n, |i| {
            let x = at(positions, i);
            (0..D - 1).map(|k| (x[k] - center[k]).powi(2)).sum::<f64>().sqrt()
        });
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| radii[*a].total_cmp(&radii[*b]).then(a.cmp(b)));
        let number = (n / PER_RING).clamp(1, MOST_RINGS);
        let rings: Vec<Vec<usize>> =
            (0..number).map(|ring| order[ring * n / number..(ring + 1) * n / number].to_vec()).collect();
        let middle = |ring: &Vec<usize>| ring.iter().map(|&i| radii[i]).sum::<f64>() / ring.len() as f64;
        let middles = rings.iter().map(middle).collect();
        Self { masses, pressure, density, shear, radii, rings, middles }
    }

    /// The share of the weight that shear holds up at a place, with the gas's P*/rho* and a smoothing length there.
    fn held_by_shear(&self, x: &[f64; D], center: &[f64; D], (temperature, smoothing_length): (f64, f64)) -> f64 {
        let Some((velocity, support)) = self.shear else { return 0.0 };
        let offset = |k: usize| if k < D - 1 { x[k] - center[k] } else { 0.0 };
        let radius = (0..D - 1).map(|k| offset(k).powi(2)).sum::<f64>().sqrt();
        let turning = |factor: f64| {
            let (mut v, place) = ([0.0; D], sph::array(|k| x[k] + (factor - 1.0) * offset(k)));
            velocity.evaluate(&place, &mut v);
            (0..D).map(|k| v[k] * v[k]).sum::<f64>().sqrt() / (factor * radius)
        };
        let shear = (turning(1.0 + STEP) - turning(1.0 - STEP)) / (2.0 * STEP);
        let share = support * (shear * smoothing_length).powi(2) / (temperature / self.density);
        if share.is_finite() { share.min(MOST_BY_SHEAR) } else { 0.0 }
    }

    fn pressure_at(&self, x: &[f64; D]) -> f64 {
        let mut value = [0.0];
        self.pressure.evaluate(x, &mut value);
        value[0]
    }

    /// P*/rho* of each particle.
    fn temperatures(&self, target: &Target<'_, D>, positions: &Positions<D>) -> Vec<f64> {
        parallel::map(self.masses.len(), |i| {
            let x = at(positions, i);
            self.pressure_at(&x) / target.density.value(&x)
        })
    }

    /// sum m z (a - a*) / sum m z a* of each ring, a* being what holds the target against gravity, less what shear holds.
    fn excess(
        &self,
        target: &Target<'_, D>,
        positions: &Positions<D>,
        force: &(dyn Fn(usize) -> f64 + Sync),
        support: &[f64],
    ) -> Vec<f64> {
        let center = target.domain.center();
        let held = parallel::map(self.masses.len(), |i| {
            let (x, step) = (at(positions, i), STEP * support[i]);
            let pressure = |way: f64| {
                let mut y = x;
                y[D - 1] += way * step;
                self.pressure_at(&y)
            };
            let temperature = self.pressure_at(&x) / target.density.value(&x);
            let held = -temperature * (pressure(1.0) / pressure(-1.0)).ln() / (2.0 * step);
            held * (1.0 - self.held_by_shear(&x, &center, (temperature, 0.5 * support[i])))
        });
        let of_ring = |ring: &Vec<usize>| {
            let (mut more, mut all) = (0.0, 0.0);
            // At the ends of the target nothing is said of what holds it.
            for &i in ring.iter().filter(|&&i| held[i].is_finite() && force(i).is_finite()) {
                let arm = self.masses[i] * (positions[D - 1][i] - center[D - 1]);
                more += arm * (force(i) - held[i]);
                all += arm * held[i];
            }
            if all > 0.0 { more / all } else { 0.0 }
        };
        self.rings.iter().map(of_ring).collect()
    }

    /// Heights above the middle times the stretch; a particle that would leave the disc stays.
    fn heights(&self, target: &Target<'_, D>, positions: &Positions<D>, stretch: &[f64]) -> Vec<f64> {
        let middle = target.domain.center()[D - 1];
        parallel::map(self.masses.len(), |i| {
            let mut x = at(positions, i);
            x[D - 1] = middle + self.of_ring(i, stretch) * (x[D - 1] - middle);
            if target.density.value(&x) > 0.0 { x[D - 1] } else { positions[D - 1][i] }
        })
    }

    /// Of a particle, between the middles of rings along a line.
    fn of_ring(&self, i: usize, values: &[f64]) -> f64 {
        let (r, middles) = (self.radii[i], &self.middles);
        let next = middles.partition_point(|middle| *middle <= r);
        if next == 0 || next == middles.len() {
            return values[next.min(values.len() - 1)];
        }
        let t = (r - middles[next - 1]) / (middles[next] - middles[next - 1]);
        values[next - 1] + t * (values[next] - values[next - 1])
    }
}
