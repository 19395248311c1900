//! Wall particles: layers of a lattice outside of the region that contains a fluid.
//!
//! The lattice has its planes halfway within and without the faces of the held region's bounding box, so that flat walls have their first
//! layer half a spacing behind the surface, and the fluid its own half a spacing before it (Crespo et al. 2007, CMC 5, 173). At
//! slanted and curved walls layers are stepped. Each particle has the unit normal of the nearest point of the surface, towards the
//! fluid, and its distance from there.

use super::frame::Factors;
use crate::codes::TargetCode;
use crate::error::{Error, Result};
use crate::input::internal_units::Prepared;
use crate::input::shapes;
use crate::scene::{Conversion, Scene, ShapeInput};
use sph::domain::{Axis, Domain, Hull, Region, Wall};
use sph::geometry::distance;
use sph::{parallel, reduce};
use sph_formats::common::particle_names as names;
use sph_formats::{Column, FormatSpec, ParticleTable, Species, UnitDimension, Values};
use std::sync::Arc;

/// Unit normals of the surface, towards the fluid.
pub const NORMALS: &str = "Normals";
/// Distance from the surface.
pub const SURFACE_DISTANCE: &str = "SurfaceDistance";
/// Spacings from the fluid beyond which walls do not act on it.
const FAR: f64 = 3.0;
/// Codes for which walls are particles: DualSPHysics and PySPH, and Phantom, whose boundary particles they are.
const WITH_WALLS: [&str; 3] = ["dualsphysics", "pysph", "phantom"];
/// Most points of the lattice.
const MOST_POINTS: f64 = 2e9;

/// Wall particles, in internal units.
pub(crate) struct Walls<const D: usize> {
    positions: Vec<[f64; D]>,
    normals: Vec<[f64; D]>,
    depths: Vec<f64>,
    /// Along each axis, and that of as large a cube.
    steps: [f64; D],
    spacing: f64,
    /// The box of fluid and walls: axes along which there are walls end there.
    pub frame: Domain<D>,
    part_type: u8,
}

/// Numbers of the fluid that walls share, in the output's units.
pub(crate) struct Fluid {
    count: usize,
    density: f64,
    support: f64,
}

impl Fluid {
    /// Means over particles, of what they are to have as a density and not of what is summed, which lacks something at the surface.
    pub(crate) fn of(density: &[f64], support: &[f64], factors: &Factors) -> Self {
        let count = density.len();
        let mean = |values: &[f64]| reduce::sum(count, |i| values[i]) / count as f64;
        Self { count, density: mean(density) * factors.density, support: mean(support) * factors.length }
    }
}

impl<const D: usize> Walls<D> {
    /// The walls of a scene; none where it has none.
    ///
    /// # Errors
    /// Shapes that make no region, walls within the fluid, or none at all.
    pub(crate) fn new(
        scene: &Scene,
        formats: &[FormatSpec],
        prepared: &Prepared<D>,
        conversion: &Conversion,
    ) -> Result<Option<Self>> {
        let Some(walls) = &scene.walls else { return Ok(None) };
        let domain = &prepared.source.domain;
        let unit = 1.0 / prepared.length;
        let own = domain.mean_spacing(prepared.target().count);
        let spacing = match &walls.spacing {
            Some(spacing) => spacing.value("walls.spacing", UnitDimension::LENGTH, conversion)? * unit,
            None => own,
        };
        let held = Held::new(scene, formats, domain, (conversion, unit))?;
        let without = match &walls.without {
            Some(shape) => Some(shapes::inside::<D>(shape, "walls.without", formats, conversion)?),
            None => None,
        };
        let reach = walls.layers as f64 * spacing;
        let lattice = Lattice::new(&held, domain, spacing, walls.layers);
        let points = lattice.counts.iter().map(|&n| n as f64).product::<f64>();
        if !(points <= MOST_POINTS) {
            let problem = format!(
                "is {:.3e}, which requires {points:.1e} positions to be examined; choose a larger one",
                spacing / unit
            );
            return Err(Error::scene("walls.spacing", problem));
        }
        let total: usize = lattice.counts.iter().product();
        let found = parallel::pieces(total, total.div_ceil(PIECES).max(1), |range| {
            range.filter_map(|i| held.wall(&lattice.point(i), reach)).collect::<Vec<_>>()
        });
        let mut made = Self {
            positions: Vec::new(),
            normals: Vec::new(),
            depths: Vec::new(),
            steps: lattice.step,
            spacing: lattice.step.iter().product::<f64>().powf(1.0 / D as f64),
            frame: domain.clone(),
            part_type: walls.part_type,
        };
        for (x, surface) in found.into_iter().flatten() {
            let in_input = x.map(|v| v / unit);
            if without.as_ref().is_some_and(|holds| holds(&in_input)) {
                continue;
            }
            if domain.contains(&x) {
                let problem = format!(
                    "leaves out {:?}, which is in the fluid's domain; walls hold the fluid from outside",
                    in_input
                );
                return Err(Error::scene("walls.around", problem));
            }
            let depth = distance(&x, &surface);
            made.positions.push(x);
            made.normals.push(sph::array(|k| (surface[k] - x[k]) / depth));
            made.depths.push(depth);
        }
        if made.positions.is_empty() {
            let why = match without.is_some() {
                true => "`without` leaves all of them out",
                false => {
                    "no axis of the domain has faces that walls could be behind, as those of a periodic box; state `around`"
                }
            };
            return Err(Error::scene("walls", format!("are none: {why}")));
        }
        made.frame = made.whole(domain)?;
        Ok(Some(made))
    }

    /// The box of fluid and walls, half a step beyond the outermost.
    fn whole(&self, domain: &Domain<D>) -> Result<Domain<D>> {
        let (mut lo, mut hi) = (domain.lo, domain.hi);
        for x in &self.positions {
            for k in (0..D).filter(|&k| domain.axes[k] != Axis::Periodic) {
                lo[k] = lo[k].min(x[k] - 0.5 * self.steps[k]);
                hi[k] = hi[k].max(x[k] + 0.5 * self.steps[k]);
            }
        }
        let axes = domain.axes.map(|axis| if axis == Axis::Periodic { axis } else { Axis::REFLECTING });
        Ok(Domain::new(lo, hi, axes, Region::Box)?)
    }

    /// What there is to note.
    pub(crate) fn describe(&self, length: f64) -> String {
        let nearest = self.depths.iter().fold(f64::INFINITY, |m, d| m.min(*d)) / self.spacing;
        let most = self.depths.iter().fold(0.0_f64, |m, d| m.max(*d)) / self.spacing;
        let step = |k: usize| format!("{:.6e}", self.steps[k] * length);
        let mut steps: Vec<String> = (0..D).map(step).collect();
        if steps.iter().all(|s| *s == steps[0]) {
            steps.truncate(1);
        }
        format!(
            "{} wall particles of type {}, {} apart, from {nearest:.2} to {most:.2} spacings behind the surface",
            self.positions.len(),
            self.part_type,
            steps.join(" x ")
        )
    }

    /// Walls that hold nothing: no particle of them is near the box of the fluid.
    pub(crate) fn doubt(&self, domain: &Domain<D>) -> Option<String> {
        let beyond = |x: &[f64; D], k: usize| (domain.lo[k] - x[k]).max(x[k] - domain.hi[k]).max(0.0);
        let from_box = |x: &[f64; D]| (0..D).map(|k| beyond(x, k).powi(2)).sum::<f64>().sqrt();
        let nearest = self.positions.iter().map(from_box).fold(f64::INFINITY, f64::min) / self.spacing;
        (nearest > FAR).then(|| {
            format!(
                "the walls are nowhere closer to the fluid's domain than {nearest:.1} of their spacings, and do not \
                 confine it: check the position and the size of \
                 `walls.around`"
            )
        })
    }

    /// What a code makes of them that has no such particles.
    pub(crate) fn unknown_to(&self, code: Option<TargetCode>) -> Option<String> {
        let title = code.filter(|code| !WITH_WALLS.contains(&code.sheet.name))?.sheet.title;
        Some(format!(
            "{title} has no walls of particles: it takes the {} of type {} for matter that only attracts, or leaves them out, and nothing holds the fluid; \
             `--for dualsphysics` and `--for pysph` have walls",
            self.positions.len(),
            self.part_type
        ))
    }

    /// Places, in internal units, by axis.
    pub(crate) fn positions(&self) -> [Vec<f64>; D] {
        std::array::from_fn(|k| self.positions.iter().map(|x| x[k]).collect())
    }

    /// The particles, whose `coordinates` are in the box of the output; `length` is the output's unit of length.
    pub(crate) fn species(&self, coordinates: Vec<f64>, length: f64, fluid: &Fluid) -> Species {
        let n = self.positions.len();
        let first = fluid.count as i64 + 1;
        let normals = self.normals.iter().flatten().copied().collect();
        let depths = self.depths.iter().map(|d| d * length).collect();
        // As heavy as fluid of the same spacing.
        let volume = (self.spacing * length).powi(D as i32);
        let columns = vec![
            Column::new(names::COORDINATES, D, Values::F64(coordinates), UnitDimension::LENGTH),
            Column::new(
                names::MASSES,
                1,
                Values::F64(vec![fluid.density * volume; n]),
                UnitDimension::new(D as i8 - 3, 1, 0, 0),
            ),
            Column::new(names::SUPPORT_RADIUS, 1, Values::F64(vec![fluid.support; n]), UnitDimension::LENGTH),
            Column::new(names::DENSITY, 1, Values::F64(vec![fluid.density; n]), UnitDimension::mass_density(3)),
            Column::new(names::PARTICLE_IDS, 1, Values::I64((first..first + n as i64).collect()), UnitDimension::NONE),
            Column::new(NORMALS, D, Values::F64(normals), UnitDimension::NONE),
            Column::new(SURFACE_DISTANCE, 1, Values::F64(depths), UnitDimension::LENGTH),
        ];
        Species { part_type: self.part_type, table: ParticleTable { count: n, columns } }
    }
}

/// Parts into which the lattice is divided: as many for any number of threads.
const PIECES: usize = 256;

/// What the walls hold, in internal units.
struct Held<const D: usize> {
    region: Domain<D>,
    /// Axes across which there are no walls.
    open: [bool; D],
}

impl<const D: usize> Held<D> {
    fn new(
        scene: &Scene,
        formats: &[FormatSpec],
        domain: &Domain<D>,
        (conversion, unit): (&Conversion, f64),
    ) -> Result<Self> {
        let open = domain.axes.map(|axis| axis == Axis::Periodic);
        let Some(shape) = scene.walls.as_ref().and_then(|w| w.around.as_ref()) else {
            return Ok(Self { region: domain.clone(), open });
        };
        if let (ShapeInput::Box(_), true) = (shape, open.contains(&true)) {
            let bounds = shapes::solid::<D>(shape, "walls.around", formats, conversion)?.0.bounds();
            let [lo, hi] = bounds.map(|corner| corner.map(|v| v * unit));
            return Ok(Self { region: Domain::new(lo, hi, domain.axes, Region::Box)?, open });
        }
        if open.contains(&true) {
            return Err(Error::scene("walls.around", "is no box, but the fluid's domain is periodic; use a box"));
        }
        let (region, _) = shapes::solid::<D>(shape, "walls.around", formats, conversion)?;
        let [lo, hi] = region.bounds();
        let hull = Region::Hull(Arc::new(region) as Arc<dyn Hull<D>>, Wall::Open);
        Ok(Self { region: Domain::new(lo, hi, [Axis::OPEN; D], hull)?.scaled(unit), open })
    }

    /// A point behind the surface, nearer than `reach` to it, with the nearest point there.
    fn wall(&self, x: &[f64; D], reach: f64) -> Option<([f64; D], [f64; D])> {
        if self.contains(x) {
            return None;
        }
        let surface = match &self.region.region {
            Region::Hull(hull, _) => hull.nearest_within(x, reach)?,
            _ => self.nearest(x),
        };
        // On the surface there is no direction.
        (1e-9 * reach..reach * (1.0 - 1e-9)).contains(&distance(x, &surface)).then_some((*x, surface))
    }

    fn contains(&self, x: &[f64; D]) -> bool {
        let within = |k: usize| self.open[k] || (x[k] >= self.region.lo[k] && x[k] <= self.region.hi[k]);
        (0..D).all(within) && self.region.region.contains(x)
    }

    /// The nearest point of a box, a ball, a shell or a cylinder to one outside.
    fn nearest(&self, x: &[f64; D]) -> [f64; D] {
        let clamped = |mut y: [f64; D]| {
            (0..D).filter(|&k| !self.open[k]).for_each(|k| y[k] = y[k].clamp(self.region.lo[k], self.region.hi[k]));
            y
        };
        let Some(round) = self.region.region.round() else { return clamped(*x) };
        let r = round.distance(x);
        let wanted = r.clamp(round.inner_radius, round.radius);
        if r > 0.0 {
            return clamped(round.scaled(x, wanted / r));
        }
        let mut y = *x;
        let k = (0..D).find(|k| round.axis != Some(*k)).unwrap_or(0);
        y[k] += wanted;
        clamped(y)
    }
}

/// Places that may be those of wall particles.
struct Lattice<const D: usize> {
    start: [f64; D],
    step: [f64; D],
    counts: [usize; D],
}

impl<const D: usize> Lattice<D> {
    fn new(held: &Held<D>, domain: &Domain<D>, spacing: f64, layers: usize) -> Self {
        let mut lattice = Self { start: [0.0; D], step: [spacing; D], counts: [0; D] };
        for k in 0..D {
            let bounds = if held.open[k] { domain } else { &held.region };
            let extent = bounds.hi[k] - bounds.lo[k];
            let within = (extent / spacing).round().max(1.0);
            let beyond = if held.open[k] { 0 } else { layers };
            lattice.step[k] = extent / within;
            lattice.start[k] = bounds.lo[k] + (0.5 - beyond as f64) * lattice.step[k];
            lattice.counts[k] = within as usize + 2 * beyond;
        }
        lattice
    }

    fn point(&self, mut i: usize) -> [f64; D] {
        sph::array(|k| {
            let place = i % self.counts[k];
            i /= self.counts[k];
            self.start[k] + place as f64 * self.step[k]
        })
    }
}
