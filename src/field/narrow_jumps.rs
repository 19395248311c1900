//! Steps of a radial table that are too narrow for particles to resolve. They are treated as discontinuities, although their two sides have
//! different radii.
//!
//! A table whose density changes by a factor over a thousandth of its radius would have the change between two shells of particles, and each of
//! them as a whole on this side or on that. As a discontinuity both sides have their mass.

use super::RadialProfile;

/// Width over the radius, and factor of the density, of such a step.
const NARROW: f64 = 1e-3;
const FACTOR: f64 = 1.5;
/// How much steeper it is than the rows before and after: a profile that is steep all along has no steps.
const STEEPER: f64 = 10.0;
/// Share of the mass on either side from which on it matters.
const LITTLE: f64 = 1e-4;

/// Puts both ends of each narrow step to the middle between them, of the rows of a profile; what there is to note.
pub(super) fn merge(profile: &RadialProfile, nodes: &mut [f64], density: &[f64]) -> Vec<String> {
    let total = profile.total_mass().value;
    let width = |i: usize| nodes[i + 1] - nodes[i];
    let rise = |i: usize| (density[i + 1] / density[i]).ln().abs();
    let is_calm = |i: usize, step: usize| width(i) > 0.0 && rise(i) / width(i) * STEEPER < rise(step) / width(step);
    let intervals = nodes.len().saturating_sub(1);
    let is_step = |i: usize| {
        let share = profile.enclosed_mass(nodes[i]) / total;
        width(i) > 0.0
            && width(i) <= NARROW * nodes[i]
            && density[i].min(density[i + 1]) > 0.0
            && rise(i) > FACTOR.ln()
            && (LITTLE..=1.0 - LITTLE).contains(&share)
            && (i == 0 || is_calm(i - 1, i))
            && (i + 1 == intervals || is_calm(i + 1, i))
    };
    let steps: Vec<usize> = (0..intervals).filter(|&i| is_step(i)).collect();
    let mut notes = Vec::new();
    for i in steps {
        let middle = 0.5 * (nodes[i] + nodes[i + 1]);
        notes.push(format!(
            "the density changes by a factor of {:.3} within {:.1e} of the radius {middle:.6e}, less than particles resolve: it is taken as a jump",
            density[i + 1] / density[i],
            (nodes[i + 1] - nodes[i]) / middle
        ));
        (nodes[i], nodes[i + 1]) = (middle, middle);
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn merge(nodes: &mut [f64], density: &[f64]) -> Vec<String> {
        super::merge(&RadialProfile::from_nodes(3, nodes, density), nodes, density)
    }

    #[test]
    fn narrow_steps_are_jumps_and_steep_profiles_are_not() {
        let mut nodes = vec![0.0, 0.3, 0.3 + 1e-7, 1.0];
        let notes = merge(&mut nodes, &[10.0, 10.0, 1.0, 1.0]);
        assert!(nodes[1] == nodes[2] && (nodes[1] - 0.3).abs() < 1e-7, "{nodes:?}");
        assert!(notes.len() == 1 && notes[0].contains("0.100") && notes[0].contains("3.3e-7"), "{notes:?}");
        for (nodes, density) in [
            // Little of a step, a wide one, and one that has hardly any mass beyond.
            (vec![0.0, 0.3, 0.3 + 1e-7, 1.0], vec![10.0, 10.0, 7.0, 7.0]),
            (vec![0.0, 0.3, 0.302, 1.0], vec![10.0, 10.0, 1.0, 1.0]),
            (vec![0.0, 0.9999, 0.99995, 1.0], vec![10.0, 10.0, 1e-3, 1e-3]),
        ] {
            let mut merged = nodes.clone();
            assert!(merge(&mut merged, &density).is_empty() && merged == nodes, "{nodes:?}");
        }
        // An atmosphere: by a factor of two in each row, and a row in each thousandth.
        let mut nodes: Vec<f64> = (0..20).map(|i| 0.9 * (1.0 + 5e-4 * f64::from(i))).collect();
        let density: Vec<f64> = (0..20).map(|i| 0.5_f64.powi(i)).collect();
        assert!(merge(&mut nodes, &density).is_empty());
    }
}
