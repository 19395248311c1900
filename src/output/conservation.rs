//! Gives particles that replace a snapshot its momentum, spin and energy.
//!
//! Interpolated velocities come near; what is missing is a common velocity, a rotation of the whole, and the
//! energy of motions that the new particles do not resolve, or that were noise. That becomes heat or a common factor of the flow, whichever changes
//! the particles less: a star at rest gets the heat, the rotation of a cold disc the factor.

use crate::input::totals::{MassPoints, Motion, Totals};
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use sph_formats::common::particle_names as names;
use sph_formats::{Column, Values};

/// How the note begins that says what was kept.
pub const TOTALS: &str = "kept of the snapshot";
/// Flows and internal energies that would have to change by more are not those of the snapshot.
const LARGEST_CHANGE: f64 = 0.1;

/// What keeping the snapshot's totals has changed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conserved {
    /// Largest change of a velocity over the root mean square of all, about their mean.
    pub velocity_change: Option<f64>,
    /// Factor on all internal energies.
    pub energy_factor: Option<f64>,
    /// Kinetic energy that interpolation left out, over all kinetic energy.
    pub kinetic_lost: Option<f64>,
    /// Whether kinetic and internal energy together are those of the snapshot.
    pub is_energy_kept: bool,
    /// About which axes angular momentum is defined, and kept.
    pub spin_kept: [bool; 3],
}

impl Conserved {
    /// In words.
    pub fn describe(&self) -> String {
        let spin = match self.spin_kept.iter().filter(|kept| **kept).count() {
            _ if self.velocity_change.is_none() => "",
            0 => " (no angular momentum: it is not defined across periodic axes)",
            1 => ", angular momentum about the axis that nothing periodic crosses",
            _ => ", angular momentum",
        };
        let mut kept = Vec::new();
        if self.velocity_change.is_some() {
            kept.push(format!("momentum{spin}"));
        }
        if self.is_energy_kept {
            kept.push("kinetic with internal energy".into());
        }
        let mut how = Vec::new();
        how.extend(self.velocity_change.map(|v| format!("velocities were changed by up to {v:.1e} of their spread")));
        how.extend(
            self.energy_factor.map(|f| format!("internal energies were changed by {:.1e} of themselves", f - 1.0)),
        );
        match kept.is_empty() {
            true => "no totals of the snapshot could be kept".into(),
            false => format!("{TOTALS}: {}; for this {}", kept.join(" and "), how.join(", ")),
        }
    }
}

/// Gives `columns` of particles the totals of a snapshot, which are in their units (lengths are the input's); `None` where there is nothing to keep.
pub(crate) fn conserve(columns: &mut [Column], new: &MassPoints<'_>, totals: &Totals) -> Option<Conserved> {
    let mut kept = Conserved {
        velocity_change: None,
        energy_factor: None,
        kinetic_lost: None,
        is_energy_kept: false,
        spin_kept: [false; 3],
    };
    let find = |columns: &[Column], name: &str, components: usize| {
        columns.iter().position(|c| c.name == name && c.components == components && matches!(c.values, Values::F64(_)))
    };
    let mean = |u: &[f64]| {
        let sum: f64 = u.iter().zip(new.masses).map(|(u, m)| u * m).sum();
        sum / new.masses.iter().sum::<f64>()
    };
    let thermal = totals.thermal.filter(|u| *u > 0.0).and_then(|wanted| {
        let at = find(columns, names::INTERNAL_ENERGY, 1)?;
        let Values::F64(u) = &columns[at].values else { return None };
        let found = mean(u);
        (found > 0.0).then_some((at, wanted, found))
    });
    let mut missing = 0.0;
    if let Some((wanted, at)) = totals.motion.zip(find(columns, names::VELOCITIES, new.dimension))
        && let Values::F64(v) = &mut columns[at].values
    {
        let before = v.clone();
        let found = new.sums(v);
        add_rigid(new, v, &wanted, &found);
        let found = new.sums(v);
        let lost = wanted.kinetic - found.kinetic;
        kept.kinetic_lost = (wanted.kinetic > 0.0).then(|| lost / wanted.kinetic);
        let heat = thermal.map_or(f64::INFINITY, |(_, u, _)| lost.abs() / u);
        kept.is_energy_kept = true;
        match stretch(new, v, &found, lost) {
            Some((factor, stretched)) if (factor - 1.0).abs() < heat.min(LARGEST_CHANGE) => *v = stretched,
            _ if heat <= LARGEST_CHANGE => missing = lost,
            _ => kept.is_energy_kept = lost == 0.0,
        }
        kept.velocity_change = Some(change(new, &before, v));
        kept.spin_kept = both_defined(&wanted, &found);
    }
    if let Some((at, wanted, found)) = thermal
        && let Values::F64(u) = &mut columns[at].values
    {
        let factor = (wanted + missing) / found;
        u.iter_mut().for_each(|u| *u *= factor);
        kept.energy_factor = Some(factor);
        kept.is_energy_kept |= totals.motion.is_none();
    }
    (kept.velocity_change.is_some() || kept.energy_factor.is_some()).then_some(kept)
}

/// A rotation about the axes about which there is one: inertia times it is `spin`.
fn rotation(inertia: &Matrix3<f64>, spin: &Vector3<f64>, is_defined: [bool; 3]) -> Vector3<f64> {
    if is_defined == [true; 3] {
        // Particles on a line do not rotate about it.
        return inertia.pseudo_inverse(1e-12 * inertia.norm()).map_or_else(|_| Vector3::zeros(), |i| i * spin);
    }
    Vector3::from_fn(|k, _| if is_defined[k] && inertia[(k, k)] > 0.0 { spin[k] / inertia[(k, k)] } else { 0.0 })
}

/// About which axes both have a spin: what is periodic before or after has none that could be kept.
fn both_defined(a: &Motion, b: &Motion) -> [bool; 3] {
    sph::array(|k| a.is_defined[k] && b.is_defined[k])
}

/// Adds the common velocity and the rotation that `found` lacks of `wanted`.
fn add_rigid(new: &MassPoints<'_>, v: &mut [f64], wanted: &Motion, found: &Motion) {
    let (d, shift) = (new.dimension, wanted.velocity - found.velocity);
    let turn = rotation(&found.inertia, &(wanted.spin - found.spin), both_defined(wanted, found));
    for i in 0..new.masses.len() {
        let (x, _) = new.at(v, i);
        let add = shift + turn.cross(&(x - found.center));
        (0..d).for_each(|k| v[i * d + k] += add[k]);
    }
}

/// The flow but for its rigid part times the factor that gives it `lost` more kinetic energy; `None` where none does.
fn stretch(new: &MassPoints<'_>, v: &[f64], found: &Motion, lost: f64) -> Option<(f64, Vec<f64>)> {
    let (d, turn) = (new.dimension, rotation(&found.inertia, &found.spin, found.is_defined));
    let rigid = |i: usize| found.velocity + turn.cross(&(new.at(v, i).0 - found.center));
    let total: f64 = new.masses.iter().sum();
    let rest: f64 =
        (0..new.masses.len()).map(|i| 0.5 * new.masses[i] / total * (new.at(v, i).1 - rigid(i)).norm_squared()).sum();
    let square = 1.0 + lost / rest;
    if !(square > 0.0 && square.is_finite()) {
        return None;
    }
    let factor = square.sqrt();
    let mut out = v.to_vec();
    for i in 0..new.masses.len() {
        let rigid = rigid(i);
        (0..d).for_each(|k| out[i * d + k] = rigid[k] + factor * (v[i * d + k] - rigid[k]));
    }
    Some((factor, out))
}

/// The largest change over the root mean square about the mean; 0 where all is at rest.
fn change(new: &MassPoints<'_>, before: &[f64], after: &[f64]) -> f64 {
    let sums = new.sums(after);
    let spread = (2.0 * sums.kinetic - sums.velocity.norm_squared()).max(0.0).sqrt();
    let largest = before.iter().zip(after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let scale = if spread > 0.0 { spread } else { sums.velocity.norm() };
    if scale > 0.0 { largest / scale } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, keyed};
    use rand::RngExt;
    use sph_formats::UnitDimension;

    fn column(name: &str, components: usize, values: Vec<f64>) -> Column {
        Column::new(name, components, Values::F64(values), UnitDimension::NONE)
    }

    fn random(n: usize, key: u64) -> Vec<f64> {
        let mut random = keyed(7, Purpose::Measure, key);
        (0..n).map(|_| random.random::<f64>() - 0.5).collect()
    }

    /// Momentum, spin about z, kinetic and internal energy per mass, by plain sums.
    fn plain(x: &[f64], v: &[f64], u: &[f64], m: &[f64], d: usize) -> (Vec<f64>, f64, f64, f64) {
        let total: f64 = m.iter().sum();
        let mean = |of: &[f64], k: usize| m.iter().enumerate().map(|(i, m)| m * of[i * d + k]).sum::<f64>() / total;
        let momentum: Vec<f64> = (0..d).map(|k| mean(v, k)).collect();
        let center: Vec<f64> = (0..d).map(|k| mean(x, k)).collect();
        let (mut spin, mut kinetic, mut thermal) = (0.0, 0.0, 0.0);
        for (i, m) in m.iter().enumerate() {
            let (x, v) = (&x[i * d..(i + 1) * d], &v[i * d..(i + 1) * d]);
            if d > 1 {
                spin += m * ((x[0] - center[0]) * (v[1] - momentum[1]) - (x[1] - center[1]) * (v[0] - momentum[0]));
            }
            kinetic += 0.5 * m * v.iter().map(|v| v * v).sum::<f64>();
            thermal += m * u.get(i).copied().unwrap_or(0.0);
        }
        (momentum, spin / total, kinetic / total, thermal / total)
    }

    /// Rotating, expanding particles in `d` dimensions, with noise of `noise` in their velocities, give their totals to others that rotate
    /// a little too slowly. With the internal energy that these have then, over the snapshot's.
    fn kept(d: usize, periodic: [bool; 3], noise: f64, heat: Option<f64>) -> (Conserved, f64) {
        let rotating = |x: &[f64], rate: f64| -> Vec<f64> {
            x.chunks(d)
                .flat_map(|x| match d {
                    1 => vec![rate + 2.0 * x[0]],
                    2 => vec![3.0 - rate * x[1] + 2.0 * x[0], rate * x[0]],
                    _ => vec![3.0 - rate * x[1] + 2.0 * x[0], rate * x[0] + x[2], -x[1] + x[0] * x[2]],
                })
                .collect()
        };
        let (x, m) = (random(500 * d, 1), vec![2.0; 500]);
        let v: Vec<f64> = rotating(&x, 1.0).iter().zip(random(500 * d, 2)).map(|(v, r)| v + noise * r).collect();
        let u: Vec<f64> = heat.map_or_else(Vec::new, |u| random(500, 3).iter().map(|r| u * (1.0 + 0.1 * r)).collect());
        let motion = MassPoints { positions: &x, masses: &m, dimension: d, periodic }.sums(&v);
        let wanted = plain(&x, &v, &u, &m, d);
        let totals = Totals { motion: Some(motion), thermal: heat.map(|_| wanted.3), are_pure: false };
        let (y, n) = (random(900 * d, 4), random(900, 5).iter().map(|r| 1.0 + r).collect::<Vec<f64>>());
        let mut columns = vec![column(names::VELOCITIES, d, rotating(&y, 0.99))];
        columns.extend(heat.map(|u| column(names::INTERNAL_ENERGY, 1, vec![u; 900])));
        let new = MassPoints { positions: &y, masses: &n, dimension: d, periodic };
        let kept = conserve(&mut columns, &new, &totals).unwrap();
        let values = |i: usize| columns.get(i).map_or_else(Vec::new, |c| c.values.to_f64());
        let found = plain(&y, &values(0), &values(1), &n, d);
        for (a, b) in found.0.iter().zip(&wanted.0) {
            assert!((a - b).abs() < 1e-12, "{found:?} {wanted:?}");
        }
        if d > 1 && !periodic[0] && !periodic[1] {
            assert!((found.1 - wanted.1).abs() < 1e-12, "{found:?} {wanted:?}");
        }
        let off = (found.2 + found.3) / (wanted.2 + wanted.3) - 1.0;
        assert_eq!(off.abs() < 1e-12, kept.is_energy_kept, "{off:e} {kept:?}");
        (kept, found.3 / wanted.3)
    }

    #[test]
    fn momentum_spin_and_energy_are_the_snapshots_in_every_dimension() {
        for d in 1..=3 {
            for periodic in [[false; 3], [false, false, true], [true; 3]] {
                let (kept, _) = kept(d, periodic.map(|p| p && d > 1), 0.1, Some(5.0));
                assert!(kept.is_energy_kept && kept.velocity_change.unwrap() < 1.0, "{kept:?}");
                let about = kept.spin_kept.iter().filter(|k| **k).count();
                let expected = match (d, periodic) {
                    (3, [false, false, false]) => 3,
                    (2, [false, false, _]) | (3, [false, false, true]) => 1,
                    _ => 0,
                };
                assert_eq!(about, expected, "{d}-D {periodic:?}");
            }
        }
    }

    #[test]
    fn noise_of_a_hot_body_becomes_heat_and_a_cold_flow_is_stretched() {
        let (hot, heat) = kept(3, [false; 3], 1.0, Some(100.0));
        assert!(hot.kinetic_lost.unwrap() > 0.01 && heat > 1.0 + 1e-4, "{hot:?} {heat}");
        let (cold, heat) = kept(3, [false; 3], 0.05, Some(1e-6));
        assert!(cold.is_energy_kept && (heat - 1.0).abs() < 1e-12, "{cold:?} {heat}");
        assert!(kept(2, [false; 3], 0.05, None).0.is_energy_kept);
        // Flows that are mostly noise, and nothing, or too little, that could take it up.
        assert!(!kept(3, [false; 3], 20.0, Some(1e-6)).0.is_energy_kept);
        assert!(!kept(2, [false; 3], 20.0, None).0.is_energy_kept);
    }
}
