//! Finds where the target is a layer thinner than the spacing of its particles.

use super::Target;
use super::edges::ways;
use nalgebra::DMatrix;

impl<const D: usize> Target<'_, D> {
    /// The axis along which the target is a layer thinner than two spacings at `x`: it falls by more than a factor e within one to both sides, for a
    /// `spacing`. Beyond an edge it is nothing.
    pub fn thin_along(&self, x: &[f64; D], spacing: f64) -> Option<usize> {
        let least = self.number_density(x) / std::f64::consts::E;
        let falls = |k: usize, step: f64| {
            let mut y = *x;
            y[k] += step;
            self.domain.wrap(&mut y);
            !self.domain.contains(&y) || self.number_density(&y) < least
        };
        (0..D).find(|&k| falls(k, spacing) && falls(k, -spacing))
    }

    /// The unit normal of the layer thinner than a `spacing` that the target is at `x`: it falls by more than a factor e within half of that to both
    /// sides. None where it does so along no line, or along all, or is nothing.
    pub fn layer_normal(&self, x: &[f64; D], spacing: f64) -> Option<[f64; D]> {
        let reach = (HALF * spacing).min(0.25 * self.domain.size());
        let here = self.number_density(x).ln();
        if !here.is_finite() {
            return None;
        }
        let change =
            |way: &[f64; D], h: f64| self.logarithm_along(x, way, h).map_or(-DEEPEST, |l| (l - here).max(-DEEPEST));
        let falls = |way: &[f64; D]| change(way, reach) < -1.0 && change(way, -reach) < -1.0;
        if !ways::<D>().any(|way| falls(&way)) || ways::<D>().all(|way| falls(&way)) {
            return None;
        }
        // The direction of the largest second difference.
        let bend = |way: &[f64; D]| change(way, reach) + change(way, -reach);
        let diagonal = |a: usize, b: usize, sign: f64| {
            let component = |k: usize| f64::from(u8::from(k == a)) + sign * f64::from(u8::from(k == b));
            bend(&sph::array(|k| std::f64::consts::FRAC_1_SQRT_2 * component(k)))
        };
        let bends = DMatrix::from_fn(D, D, |a, b| match a == b {
            true => bend(&sph::array(|k| f64::from(u8::from(k == a)))),
            false => 0.5 * (diagonal(a, b, 1.0) - diagonal(a, b, -1.0)),
        });
        let eigen = bends.symmetric_eigen();
        let most = eigen.eigenvalues.imin();
        let normal: [f64; D] = sph::array(|k| eigen.eigenvectors[(k, most)]);
        let places = || (0..LOOKS).map(|i| reach * ((2 * i + 1) as f64 / LOOKS as f64 - 1.0));
        let mass = |h: f64| change(&normal, h).exp();
        let middle = places().map(|h| h * mass(h)).sum::<f64>() / places().map(mass).sum::<f64>();
        (falls(&normal) && middle.abs() < NEAR * spacing).then_some(normal)
    }
}

/// Spacings from the middle of a layer of one spacing to its sides.
const HALF: f64 = 0.5;

/// How far from the middle of its mass a particle is at most that belongs there, in spacings, and by how many looks across a layer that is found.
const NEAR: f64 = 0.2;
const LOOKS: usize = 16;

/// Change of ln n* beyond which all is alike: beyond an edge is nothing.
const DEEPEST: f64 = 20.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::AnalyticField;
    use sph::domain::{Axis, Domain, Region};

    /// In the middle of a layer of a fourth of a spacing at an angle, and nowhere else: neither a spacing beside it, nor where it is thick, in a clump, or all
    /// is even.
    #[test]
    fn normals_are_those_of_thin_layers() {
        fn check<const D: usize>(normal: [f64; D]) {
            let domain = Domain::new([-1.0; D], [1.0; D], [Axis::OPEN; D], Region::Box).unwrap();
            let names = ["x", "y", "z"];
            let across: Vec<String> = (0..D).map(|k| format!("({})*{}", normal[k], names[k])).collect();
            let layer = format!("exp(-x)*(0.001 + exp(-(({})/0.01)^2))", across.join("+"));
            let find = |text: &str, x: [f64; D], spacing: f64| {
                let field = AnalyticField::<D>::new("density", text, [0.0; D]).unwrap();
                Target::of_equal_masses(&domain, &field, 1000, 1.0).layer_normal(&x, spacing)
            };
            let found = find(&layer, [0.0; D], 0.04).unwrap();
            let cosine = (0..D).map(|k| found[k] * normal[k]).sum::<f64>().abs();
            assert!(cosine > 0.999, "{D}-D: {found:?}, not {normal:?}");
            assert_eq!(find(&layer, normal.map(|n| 0.04 * n), 0.04), None);
            assert_eq!(find(&layer, [0.0; D], 0.015), None);
            let clump: Vec<String> = (0..D).map(|k| format!("{}^2", names[k])).collect();
            assert_eq!(find(&format!("exp(-({})/0.0001)", clump.join("+")), [0.0; D], 0.04), None);
            assert_eq!(find("exp(-x)", [0.0; D], 0.04), None);
            assert_eq!(find("if(x > 0.01, 1, 0)", [0.0; D], 0.04), None);
        }
        check::<2>([0.0, 1.0]);
        check::<2>([0.6, -0.8]);
        check::<3>([0.0, 0.0, 1.0]);
        check::<3>([2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0]);
    }
}
