//! Locally isothermal gas of a disc, whose temperature depends on the distance from the star: P = c^2 rho with c^2 = K r^(-2q), Phantom's `ieos =
//! 6`.

use crate::model::{DISC_KEY, ParticleFile, ParticleTable};
use crate::particle_names as names;

/// Root mean square of ln c^2 about the power law that is still one: heights above the plane change it by more in discs whose temperature is that of
/// the distance from the axis.
const SCATTER: f64 = 3e-3;

/// The law, in the file's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocallyIsothermal {
    /// K: the square of the sound speed at the distance 1.
    pub squared_speed: f64,
    /// q, above 0.
    pub fall: f64,
    /// Number of the star among the point masses, from 1.
    pub sink: usize,
}

impl LocallyIsothermal {
    /// That of a disc about one of the point masses of a file whose header says that its gas is one.
    pub fn of(file: &ParticleFile) -> Option<Self> {
        if !Self::is_meant(file) {
            return None;
        }
        let points = file.species.iter().filter(|s| s.table.is_of_points());
        let places = points.flat_map(|s| (0..s.table.count).map(|i| place(&s.table, i)));
        let gas = file.species.iter().find(|s| s.part_type == 0 && !s.table.is_of_points())?;
        let gamma = file.header.adiabatic_index();
        let about = |(i, center): (usize, Option<[f64; 3]>)| {
            Some(Self { sink: i + 1, ..Self::about(&center?, &gas.table, gamma)? })
        };
        places.enumerate().find_map(about)
    }

    /// Whether the header says that the gas has temperatures of its place.
    pub fn is_meant(file: &ParticleFile) -> bool {
        file.header.provenance.iter().any(|(key, _)| key == DISC_KEY)
    }

    /// That of gas about a point.
    fn about(center: &[f64; 3], gas: &ParticleTable, gamma: f64) -> Option<Self> {
        let energies = gas.column(names::INTERNAL_ENERGY)?;
        let logarithms = (0..gas.count).map(|i| {
            let x = place(gas, i)?;
            let distance = (0..3).map(|k| (x[k] - center[k]).powi(2)).sum::<f64>().sqrt();
            Some([distance.ln(), ((gamma - 1.0) * energies.values.get(i)).ln()])
        });
        Self::fitted(&logarithms.collect::<Option<Vec<_>>>()?)
    }

    /// By least squares, from the logarithms of distances and of squares of sound speeds.
    fn fitted(points: &[[f64; 2]]) -> Option<Self> {
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
        let middle = [mean(&|p| p[0]), mean(&|p| p[1])];
        let spread = mean(&|p| (p[0] - middle[0]).powi(2));
        let slope = mean(&|p| (p[0] - middle[0]) * (p[1] - middle[1])) / spread;
        let scatter = mean(&|p| (p[1] - middle[1] - slope * (p[0] - middle[0])).powi(2)).sqrt();
        let is_law = slope < -SCATTER && scatter < SCATTER;
        is_law.then(|| Self { squared_speed: (middle[1] - slope * middle[0]).exp(), fall: -0.5 * slope, sink: 1 })
    }
}

fn place(table: &ParticleTable, i: usize) -> Option<[f64; 3]> {
    let column = table.column(names::COORDINATES).filter(|c| c.components == 3)?;
    Some([0, 1, 2].map(|k| column.values.get(3 * i + k)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_found_and_another_is_none() {
        let points = |of: &dyn Fn(f64) -> f64| -> Vec<[f64; 2]> {
            (1..100).map(|i| 0.05 * f64::from(i)).map(|r| [r.ln(), of(r).ln()]).collect()
        };
        let found = LocallyIsothermal::fitted(&points(&|r| 0.02 * r.powf(-0.9))).unwrap();
        assert!((found.squared_speed / 0.02 - 1.0).abs() < 1e-12 && (found.fall - 0.45).abs() < 1e-12, "{found:?}");
        assert_eq!(LocallyIsothermal::fitted(&points(&|r| 0.02 * (1.0 + 0.1 * r) / r)), None);
        assert_eq!(LocallyIsothermal::fitted(&points(&|_| 0.02)), None, "isothermal throughout");
        assert_eq!(LocallyIsothermal::fitted(&points(&|r| 0.02 * r)), None, "hotter outward");
        assert_eq!(LocallyIsothermal::fitted(&[]), None);
    }
}
