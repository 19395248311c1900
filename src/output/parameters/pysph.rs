//! PySPH's script, which takes the place of the parameter file of other codes (Ramachandran et al. 2021, ACM TOMS 47, 34).

use super::facts::{END, Facts, SNAPSHOT};
use sph::kernel::KernelName;
use sph_formats::common::particle_names as names;
use sph_formats::model::ADIABATIC_INDEX;
use std::fmt::Write as _;

/// Speed of sound over the largest speed, with which the density of a liquid changes by a hundredth (Monaghan 1994, JCP 110, 399).
const SOUND_OVER_SPEED: f64 = 10.0;

/// Share of a variance that a linear function explains, and part of a mean that a change is at least.
const LINEAR: f64 = 0.999;
const UNEVEN: f64 = 1e-5;
/// Tait's exponent of liquids, where a scene has none of its own.
const TAIT: f64 = 7.0;

impl Facts<'_> {
    pub(super) fn pysph(&self) -> String {
        let d = self.file.header.dimension;
        let kernel = kernel_class(self.code.kernel, d);
        let is_gas = self.is_gas();
        let liquid = (!is_gas).then(|| self.liquid());
        let class = if is_gas { "GasDScheme" } else { "WCSPHScheme" };
        let gamma = if is_gas || self.gamma() != ADIABATIC_INDEX { self.gamma() } else { TAIT };
        let has_walls = self.has_walls() && !is_gas;
        let mut text = self.head("#", &format!("python {}.py, with PySPH installed", self.stem));
        let _ = write!(
            text,
            "import numpy as np
from pysph.base.kernels import {kernel}
from pysph.base.nnps import DomainManager
from pysph.base.utils import get_particle_array
from pysph.solver.application import Application
from pysph.sph.scheme import {class}

DIMENSION = {d}
GAMMA = {}
HDX = {}
END, BETWEEN_OUTPUTS = {:e}, {:e}
KERNEL = {kernel}(dim=DIMENSION)
DATA = np.load({:?})
{}


def column(name, rows):
    return np.nan_to_num(DATA[name][rows].astype(float)) if name in DATA else np.zeros(np.count_nonzero(rows))


def particles(name, kind):
    rows = DATA[\"ParticleType\"] == kind if \"ParticleType\" in DATA else np.ones(len(DATA[\"Masses\"]), bool)
    found = {{\"m\": column(\"Masses\", rows), \"h\": column(\"SupportRadius\", rows) / KERNEL.radius_scale}}
{}    for axis in range(DIMENSION):
        found[\"xyz\"[axis]] = DATA[\"Coordinates\"][rows].reshape(-1, DIMENSION)[:, axis]
        if \"Velocities\" in DATA:
            found[\"uvw\"[axis]] = DATA[\"Velocities\"][rows].reshape(-1, DIMENSION)[:, axis].astype(float)
    return get_particle_array(name=name, **found)


class InitialCondition(Application):
    def create_particles(self):
        arrays = [particles(\"fluid\", 0){}]
        self.scheme.setup_properties(arrays)
        return arrays

",
            gamma,
            self.code.setting_in(d),
            END * self.time,
            SNAPSHOT * self.time,
            self.name,
            liquid.as_ref().map_or_else(String::new, |l| format!("RHO0, C0 = {:e}, {:e}", l.density, l.sound)),
            if is_gas { GAS } else { LIQUID },
            if has_walls { format!(", particles(\"walls\", {WALLS})") } else { String::new() },
        );
        let domain = self.pysph_domain();
        text += &domain;
        let solids = if has_walls { "[\"walls\"]" } else { "[]" };
        let of_fluid = format!("fluids=[\"fluid\"], solids={solids}, dim=DIMENSION, gamma=GAMMA");
        let smallest = "np.min(DATA[\"SupportRadius\"]) / KERNEL.radius_scale";
        let (scheme, step) = match liquid {
            Some(Liquid { gravity: [x, y, z], .. }) => (
                format!(
                    "{of_fluid}, rho0=RHO0, c0=C0, gx={x:e}, gy={y:e}, gz={z:e}, h0={}, hdx=HDX, alpha=0.1",
                    smallest.replace("min", "max")
                ),
                format!("0.125 * {smallest} / C0"),
            ),
            None => (
                format!(
                    "{of_fluid}, kernel_factor=HDX, alpha1=1.0, alpha2=0.1, beta=2.0, update_alpha1=True, update_alpha2=True, has_ghosts={}",
                    if domain.is_empty() { "False" } else { "True" }
                ),
                format!("0.1 * {smallest} / np.sqrt(GAMMA * (GAMMA - 1) * np.max(DATA[\"InternalEnergy\"]))"),
            ),
        };
        let _ = write!(
            text,
            "    def create_scheme(self):
        return {class}({scheme})

    def configure_scheme(self):
        step = {step}
        times = np.arange(BETWEEN_OUTPUTS, END, BETWEEN_OUTPUTS)
        self.scheme.configure_solver(
            kernel=KERNEL, dt=step, tf=END, adaptive_timestep=True, cfl=0.3, pfreq=10**9, output_at_times=times
        )


if __name__ == \"__main__\":
    InitialCondition().run()
"
        );
        text
    }

    /// The method that says what is beyond the faces of the box; none where nothing is.
    fn pysph_domain(&self) -> String {
        let header = &self.file.header;
        let kinds = ["x", "y", "z"]
            .into_iter()
            .zip(self.edges())
            .zip(header.periodic)
            .zip(header.box_corner.unwrap_or_default());
        let limits: Vec<String> = kinds
            .filter_map(|(((axis, edge), is_periodic), low)| {
                // Particles of walls hold what mirrors would.
                let kind = match (is_periodic, self.reflects && !self.has_walls()) {
                    (true, _) => "periodic",
                    (false, true) => "mirror",
                    (false, false) => return None,
                };
                Some(format!("{axis}min={low:?}, {axis}max={:e}, {kind}_in_{axis}=True", low + edge))
            })
            .collect();
        match limits.is_empty() {
            true => String::new(),
            false => format!("    def create_domain(self):\n        return DomainManager({})\n\n", limits.join(", ")),
        }
    }

    pub(super) fn pysph_doubts(&self) -> Vec<String> {
        let gravity = self
            .gravity
            .map(|_| "PySPH's schemes have no gravity of the particles: a body that it holds flies apart".to_owned());
        let archive = (!self.name.ends_with(".npz"))
            .then(|| "PySPH's script reads NumPy's archives: name the output .npz".to_owned());
        let is_gas = self.is_gas();
        let walls = (self.has_walls() && is_gas)
            .then(|| "PySPH's gas dynamics has no wall particles: --for pysph:scheme=wcsph is for them".to_owned());
        let cold = (is_gas && self.gas.column(names::INTERNAL_ENERGY).is_none()).then(|| {
            "PySPH's gas dynamics takes internal energies, and the file has none: state a pressure or a temperature, or take \
             --for pysph:scheme=wcsph for a liquid"
                .to_owned()
        });
        [gravity, archive, walls, cold].into_iter().flatten().collect()
    }

    /// What stands for the liquid of weakly compressible schemes: its pressures say which uniform gravity they are in balance with.
    fn liquid(&self) -> Liquid {
        let d = self.file.header.dimension;
        let values = |name: &str| self.gas.column(name).map(|c| &c.values);
        // The middle one: beside a free surface sums miss what is not there.
        let mut densities = values(names::DENSITY).map(sph_formats::Values::to_f64).unwrap_or_default();
        densities.sort_by(f64::total_cmp);
        let density = densities.get(densities.len() / 2).copied().unwrap_or(1.0);
        let gravity = self.field_gravity(density);
        let potential: f64 = (0..d).map(|k| f64::abs(gravity[k]) * self.extent(k)).sum();
        let edge = self.edges().iter().copied().fold(0.0, f64::max);
        let sound = if potential > 0.0 { SOUND_OVER_SPEED * (2.0 * potential).sqrt() } else { edge / self.time };
        Liquid { density, sound, gravity }
    }

    /// The uniform gravity that the pressures of a liquid of this density are in balance with.
    pub(super) fn field_gravity(&self, density: f64) -> [f64; 3] {
        let d = self.file.header.dimension;
        let pressures = self.gas.column(names::PRESSURE).map(|c| &c.values);
        let slopes = pressures.and_then(|p| self.slopes(|i| p.get(i))).unwrap_or_default();
        sph::array(|k| if k < d { slopes[k] / density } else { 0.0 })
    }

    fn is_gas(&self) -> bool {
        self.code.scheme.name == "gas-dynamics"
    }

    pub(super) fn has_walls(&self) -> bool {
        self.file.species.iter().any(|s| s.part_type == WALLS)
    }

    /// How far the gas reaches along an axis.
    fn extent(&self, axis: usize) -> f64 {
        let d = self.file.header.dimension;
        let x = self.gas.column(names::COORDINATES).map(|c| &c.values);
        let places = || (0..self.gas.count).filter_map(|i| Some(x?.get(i * d + axis)));
        places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min)
    }

    /// Slopes along each axis of a quantity of the gas that is linear in the position and not the same everywhere.
    fn slopes(&self, value: impl Fn(usize) -> f64) -> Option<[f64; 3]> {
        let d = self.file.header.dimension;
        let x = self.gas.column(names::COORDINATES)?;
        let n = self.gas.count as f64;
        let place = |i: usize, k: usize| x.values.get(i * d + k);
        let mean = |f: &dyn Fn(usize) -> f64| (0..self.gas.count).map(f).sum::<f64>() / n;
        let middle: Vec<f64> = (0..d).map(|k| mean(&|i| place(i, k))).collect();
        let level = mean(&value);
        let products = |a: usize, b: usize| mean(&|i| (place(i, a) - middle[a]) * (place(i, b) - middle[b]));
        let matrix = nalgebra::DMatrix::from_fn(d, d, products);
        let right = nalgebra::DVector::from_fn(d, |k, _| mean(&|i| (place(i, k) - middle[k]) * (value(i) - level)));
        let found = matrix.lu().solve(&right)?;
        let change = mean(&|i| (value(i) - level).powi(2));
        let explained = found.dot(&right);
        let is_linear = explained > LINEAR * change && change > (UNEVEN * level).powi(2);
        is_linear.then(|| sph::array(|k| if k < d { found[k] } else { 0.0 }))
    }
}

/// The thermal state of a gas, and that of a liquid: Tait's density at the pressure over the least one.
const GAS: &str = "    found[\"rho\"], found[\"e\"] = column(\"Density\", rows), column(\"InternalEnergy\", rows)
    found[\"p\"] = (GAMMA - 1) * found[\"rho\"] * found[\"e\"]
";
const LIQUID: &str = "    pressure = column(\"Pressure\", rows)
    found[\"p\"] = pressure - np.min(pressure)
    found[\"rho\"] = RHO0 * (1 + GAMMA * found[\"p\"] / (RHO0 * C0**2)) ** (1 / GAMMA)
";

/// Wall particles.
const WALLS: u8 = 5;

struct Liquid {
    density: f64,
    sound: f64,
    gravity: [f64; 3],
}

/// PySPH's classes; its own default stands for what it does not have.
fn kernel_class(kernel: KernelName, d: usize) -> &'static str {
    match (kernel, d) {
        (KernelName::Quintic, _) => "QuinticSpline",
        (KernelName::WendlandC2, 1) => "WendlandQuinticC2_1D",
        (KernelName::WendlandC4, 1) => "WendlandQuinticC4_1D",
        (KernelName::WendlandC6, 1) => "WendlandQuinticC6_1D",
        (KernelName::WendlandC2, _) => "WendlandQuintic",
        (KernelName::WendlandC4, _) => "WendlandQuinticC4",
        (KernelName::WendlandC6, _) => "WendlandQuinticC6",
        _ => "CubicSpline",
    }
}
