//! `refine`: a sphere (a disc in 2-D, an interval in 1-D) in which particles are finer or coarser, and which may move.
//!
//! The number density is what it would be without the sphere times f(r), r the distance from its center: the factor within the
//! radius, 1 beyond the shell, and in the shell ln f = (1 - 3 t^2 + 2 t^3) ln(factor) with t = (r - radius) / shell, so that neither f nor
//! its slope jumps. Distances are those to the nearest image where the domain is periodic.

use crate::error::{Error, Result};
use crate::field::{ScalarField, SharedDensity, Source, Trace};
use crate::input::ingest::RawInput;
use crate::scene::{Conversion, RefineInput, Scene, vector};
use sph::domain::Domain;
use sph_formats::{Geometry, UnitDimension};
use std::sync::Arc;

/// Width of the shell over the radius, where the scene does not state it.
const SHELL: f64 = 0.25;

/// Where the resolution is another, in the units of the input or in internal ones.
#[derive(Clone)]
pub(crate) struct Refinement<const D: usize> {
    center: [f64; D],
    radius: f64,
    shell: f64,
    log_factor: f64,
    domain: Domain<D>,
}

impl<const D: usize> Refinement<D> {
    /// That of the scene, in the units that `conversion` leads to, at its own time or else at `time`.
    ///
    /// # Errors
    /// A center or a velocity of another number of components, or numbers that are no lengths.
    pub fn new(input: &RefineInput, domain: &Domain<D>, conversion: &Conversion, time: f64) -> Result<Self> {
        let length = |key: &str, q: &crate::scene::Quantity| q.value(key, UnitDimension::LENGTH, conversion);
        let center: [f64; D] = vector("refine.center", &input.center, UnitDimension::LENGTH, conversion)?;
        let velocity: [f64; D] = vector("refine.velocity", &input.velocity, UnitDimension::VELOCITY, conversion)?;
        let stated =
            input.time.as_ref().map(|q| q.value("refine.time", UnitDimension::TIME, conversion)).transpose()?;
        let time = stated.unwrap_or(time);
        let radius = length("refine.radius", &input.radius)?;
        let shell = input.shell.as_ref().map_or(Ok(SHELL * radius), |q| length("refine.shell", q))?;
        let mut center: [f64; D] = sph::array(|k| center[k] + velocity[k] * time);
        if !center.iter().all(|x| x.is_finite()) {
            let problem = format!("is at {center:?} at the time {time:e}, expected finite coordinates");
            return Err(Error::scene("refine.center", problem));
        }
        domain.wrap(&mut center);
        Ok(Self { center, radius, shell, log_factor: input.factor.ln(), domain: domain.clone() })
    }

    /// Particles at `x` in the place of one.
    pub fn factor(&self, x: &[f64; D]) -> f64 {
        let from = self.domain.displacement(&self.center, x);
        let t = (from.iter().map(|v| v * v).sum::<f64>().sqrt() - self.radius) / self.shell;
        let t = t.clamp(0.0, 1.0);
        ((1.0 - t * t * (3.0 - 2.0 * t)) * self.log_factor).exp()
    }

    /// The same with lengths times `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            center: self.center.map(|x| x * factor),
            radius: self.radius * factor,
            shell: self.shell * factor,
            log_factor: self.log_factor,
            domain: self.domain.scaled(factor),
        }
    }

    /// In words, with its place in the input's units.
    pub fn describe(&self) -> String {
        let center: Vec<String> = self.center.iter().map(|x| format!("{x:.6e}")).collect();
        format!("about [{}], with the radius {:.6e} and a shell of {:.6e}", center.join(", "), self.radius, self.shell)
    }

    /// The number density, in any scale, of a `source` in the units of this one: that of the density, or of the `resolution` where
    /// there is one.
    pub fn apply(
        &self,
        source: Source<D>,
        resolution: Option<Box<dyn ScalarField<D>>>,
    ) -> (Source<D>, Box<dyn ScalarField<D>>) {
        let (source, base) = match resolution {
            Some(field) => (source, field),
            None => {
                let shared: Arc<dyn ScalarField<D>> = Arc::from(source.density);
                let density = Box::new(SharedDensity(Arc::clone(&shared)));
                let base: Box<dyn ScalarField<D>> = Box::new(SharedDensity(shared));
                (Source { density, ..source }, base)
            }
        };
        (source, Box::new(Finer { base, refinement: self.clone() }))
    }
}

/// A number density times the factor.
struct Finer<const D: usize> {
    base: Box<dyn ScalarField<D>>,
    refinement: Refinement<D>,
}

impl<const D: usize> ScalarField<D> for Finer<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        let base = self.base.value(x);
        if base == 0.0 { 0.0 } else { base * self.refinement.factor(x) }
    }

    fn piece(&self, x: &[f64; D]) -> u64 {
        self.base.piece(x)
    }

    fn is_piecewise(&self) -> bool {
        self.base.is_piecewise()
    }

    fn trace(&self, x: &[f64; D]) -> Trace {
        self.base.trace(x)
    }

    fn has_parts(&self) -> bool {
        self.base.has_parts()
    }
}

/// Gas of a snapshot that is refined: its mass counts where the integral of an interpolant takes long.
pub(crate) struct Sampled<const D: usize> {
    points: Vec<[f64; D]>,
    masses: Vec<f64>,
    pub time: f64,
}

impl<const D: usize> Sampled<D> {
    /// Of a scene with a refinement whose input is a snapshot.
    pub fn of(scene: &Scene, raw: &RawInput) -> Option<Self> {
        let RawInput::Snapshot(snapshot) = raw else { return None };
        let Geometry::Cloud { points, .. } = &snapshot.field.geometry else { return None };
        scene.refine.as_ref()?;
        let points = points.iter().map(|p| sph::array(|k| p[k])).collect();
        Some(Self { points, masses: snapshot.masses.clone(), time: snapshot.time })
    }

    /// The integral of density times factor over that of the density.
    pub fn mean_factor(&self, refinement: &Refinement<D>) -> f64 {
        let total: f64 = self.masses.iter().sum();
        self.points.iter().zip(&self.masses).map(|(x, m)| m * refinement.factor(x)).sum::<f64>() / total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sph::domain::{Axis, Region};

    fn refinement(input: &str, time: f64) -> Refinement<1> {
        let input: RefineInput = serde_saphyr::from_str(input).unwrap();
        let domain = Domain::new([0.0], [1.0], [Axis::Periodic], Region::Box).unwrap();
        Refinement::new(&input, &domain, &Conversion::NONE, time).unwrap()
    }

    #[test]
    fn the_factor_is_full_within_and_one_beyond_and_goes_across_the_box() {
        let interval = refinement("{center: [0.95], radius: 0.1, shell: 0.1, factor: 4}", 0.0);
        for (x, expected) in [(0.95, 4.0), (0.86, 4.0), (0.04, 4.0), (0.1, 2.0), (0.16, 1.0), (0.5, 1.0), (0.74, 1.0)] {
            assert!((interval.factor(&[x]) - expected).abs() < 1e-12, "{x}: {}", interval.factor(&[x]));
        }
    }

    #[test]
    fn the_center_moves_with_its_velocity() {
        let at = |text: &str, time: f64| refinement(text, time).center[0];
        assert!((at("{center: [0.1], velocity: [0.2], radius: 0.1, time: 2}", 7.0) - 0.5).abs() < 1e-12);
        assert!((at("{center: [0.1], velocity: [0.2], radius: 0.1}", 7.0) - 0.5).abs() < 1e-12, "across the box");
        assert!((at("{center: [0.1], radius: 0.1}", 7.0) - 0.1).abs() < 1e-12);
    }
}
