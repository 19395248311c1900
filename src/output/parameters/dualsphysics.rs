//! DualSPHysics' case: constants, blocks of particles and parameters, as its GenCase writes them for the solver (Dominguez et al. 2022, Comput. Part.
//! Mech. 9, 867).

use super::facts::{END, Facts, SNAPSHOT};
use sph::kernel::KernelName;
use sph_formats::common::particle_names as names;
use sph_formats::dualsphysics::Liquid;
use std::fmt::Write as _;

/// Numbers of the first blocks: those below are of fluids.
const FIRST_WALLS: u32 = 10;
const FIRST_FLUID: u32 = 1;
/// Densities over that without pressure beyond which a particle is taken out, as in the code for water.
const OUT: [f64; 2] = [0.7, 1.3];
/// Part of the case's size that the domain is larger by, where nothing holds the fluid.
const ROOM: &str = "50%";
/// Parts of a fitted vector that are rounding.
const ROUNDING: f64 = 1e-6;
/// The code's axes, of which x and z are those of a plane.
const AXES: [&str; 3] = ["x", "y", "z"];

/// What is the same for every case: key, value, meaning.
const PARAMETERS: [(&str, &str, &str); 11] = [
    (
        "Boundary",
        "1",
        "1: dynamic boundary particles, 2: modified ones (mDBC), for which the walls' normals are in the file",
    ),
    ("StepAlgorithm", "2", "1: Verlet, 2: symplectic"),
    ("VerletSteps", "40", "of Verlet alone"),
    ("ViscoTreatment", "1", "1: artificial, 2: laminar and turbulence, 3: laminar"),
    ("Visco", "0.01", "alpha of the artificial viscosity"),
    ("ViscoBoundFactor", "1", "its part at walls"),
    ("DensityDTvalue", "0.1", "coefficient of the diffusion of density"),
    ("Shifting", "0", "0: none"),
    ("CoefDtMin", "0.05", "least step over h/c"),
    ("DtIni", "0", "0: h/c"),
    ("DtMin", "0", "0: CoefDtMin h/c"),
];

impl Facts<'_> {
    pub(super) fn dualsphysics(&mut self) -> String {
        let liquid = Liquid::of(self.file);
        let edge = self.edges().iter().copied().fold(0.0, f64::max);
        // Nothing else says how fast a liquid is.
        if let Some(speed) = liquid.and_then(|l| l.largest_speed()) {
            self.time = edge / speed;
            self.time_is = "times in which the fastest flow crosses the box";
        }
        // Two hyphens would end the comment.
        let head = self.head("", &format!("DualSPHysics5.4CPU_linux64 {0} {0}_out, or its GPU build", self.stem));
        let mut text =
            format!("<!--{} -->\n<case app=\"sph-prep\">\n    <execution>\n", head.trim_end().replace("--", "- -"));
        let Some(liquid) = liquid else { return text + "    </execution>\n</case>\n" };
        let gravity = self.in_space(without_rounding(self.field_gravity(liquid.density)));
        self.write_constants(&mut text, &liquid, gravity, edge);
        self.write_blocks(&mut text);
        self.write_parameters(&mut text, &liquid, gravity);
        text + "    </execution>\n</case>\n"
    }

    /// A vector along the code's axes.
    fn in_space(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        if self.file.header.dimension == 2 { [x, 0.0, y] } else { [x, y, z] }
    }

    fn write_constants(&self, text: &mut String, liquid: &Liquid, [x, y, z]: [f64; 3], edge: f64) {
        let sound = liquid.sound_speed.unwrap_or(edge / self.time);
        let stiffness = Liquid { sound_speed: Some(sound), ..*liquid }.stiffness();
        let is_plane = self.file.header.dimension == 2;
        *text += "        <constants>\n";
        let _ = writeln!(text, "            <data2d value=\"{is_plane}\" />");
        if is_plane {
            *text += "            <data2dposy value=\"0\" />\n";
        }
        let _ = writeln!(text, "            <gravity x=\"{x:e}\" y=\"{y:e}\" z=\"{z:e}\" />");
        for (name, value, what) in [
            ("cflnumber", 0.2, "of time steps"),
            ("gamma", liquid.gamma, "P = b ((rho/rhop0)^gamma - 1)"),
            ("rhop0", liquid.density, "density without pressure"),
            ("dp", liquid.spacing, "spacing of the particles"),
            ("h", liquid.smoothing_length, "half the support radius"),
            ("b", stiffness, "c^2 rhop0/gamma"),
            ("massbound", liquid.wall_mass, "of a particle of walls"),
            ("massfluid", liquid.mass, "of a particle of fluid"),
        ] {
            let _ = writeln!(text, "            <{name} value=\"{value:e}\" comment=\"{what}\" />");
        }
        *text += "        </constants>\n";
    }

    fn write_blocks(&self, text: &mut String) {
        let walls: usize = self.file.species.iter().filter(|s| s.part_type != 0).map(|s| s.table.count).sum();
        let fluid = self.gas.count;
        let _ = writeln!(
            text,
            "        <particles np=\"{}\" nb=\"{walls}\" nbf=\"{walls}\" mkboundfirst=\"{FIRST_WALLS}\" mkfluidfirst=\"{FIRST_FLUID}\">",
            walls + fluid
        );
        if walls > 0 {
            let _ = writeln!(
                text,
                "            <fixed mkbound=\"0\" mk=\"{FIRST_WALLS}\" begin=\"0\" count=\"{walls}\" />"
            );
        }
        let _ = writeln!(
            text,
            "            <fluid mkfluid=\"0\" mk=\"{FIRST_FLUID}\" begin=\"{walls}\" count=\"{fluid}\" />"
        );
        *text += "        </particles>\n";
    }

    fn write_parameters(&self, text: &mut String, liquid: &Liquid, gravity: [f64; 3]) {
        *text += "        <parameters>\n";
        let mut row = |key: &str, value: &str, what: &str| {
            let _ = writeln!(text, "            <parameter key=\"{key}\" value=\"{value}\" comment=\"{what}\" />");
        };
        let kernel = if self.code.kernel == KernelName::CubicSpline { "1" } else { "2" };
        row("Kernel", kernel, "1: cubic spline, 2: Wendland");
        // Fourtakas' diffusion takes away the weight of the water, along z alone.
        let is_down = gravity[2] != 0.0 && gravity[0].hypot(gravity[1]) < gravity[2].abs();
        row("DensityDT", if is_down { "2" } else { "1" }, "diffusion of density, 0: none, 1: Molteni, 2: Fourtakas");
        for (key, value, what) in PARAMETERS {
            row(key, value, what);
        }
        row("TimeMax", &format!("{:e}", END * self.time), "end");
        row("TimeOut", &format!("{:e}", SNAPSHOT * self.time), "between outputs");
        let [least, most] = OUT.map(|part| format!("{:e}", part * liquid.density));
        row("RhopOutMin", &least, "fluid of less density is taken out");
        row("RhopOutMax", &most, "and of more");
        let header = &self.file.header;
        let periodic = self.along(|k| header.periodic[k]);
        let shifts = ["XPeriodicIncZ", "YPeriodicIncZ", "ZPeriodicIncX"];
        for (key, _) in shifts.iter().zip(periodic).filter(|(_, is)| *is) {
            row(key, "0", "the axis is periodic");
        }
        *text += "            <simulationdomain comment=\"what leaves it is taken out\">\n";
        let is_weightless = gravity == [0.0; 3];
        for (side, sign, away) in [("posmin", "-", 1.0), ("posmax", "+", -1.0)] {
            let of = |k: usize| match gravity[k] * away > 0.0 || is_weightless {
                true if !periodic[k] => format!("{}=\"default {sign} {ROOM}\"", AXES[k]),
                _ => format!("{}=\"default\"", AXES[k]),
            };
            let _ = writeln!(text, "                <{side} {} {} {} />", of(0), of(1), of(2));
        }
        *text += "            </simulationdomain>\n        </parameters>\n";
    }

    /// What holds along the code's axes.
    fn along(&self, of: impl Fn(usize) -> bool) -> [bool; 3] {
        if self.file.header.dimension == 2 { [of(0), false, of(1)] } else { [of(0), of(1), of(2)] }
    }

    pub(super) fn dualsphysics_doubts(&self) -> Vec<String> {
        let gravity = self
            .gravity
            .map(|_| "DualSPHysics has no gravity of the particles: a body that it holds flies apart".to_owned());
        let file = (!self.name.ends_with(".bi4"))
            .then(|| "DualSPHysics reads files of this name with .bi4: name the output so".to_owned());
        let still = self.gas.column(names::PRESSURE).is_none().then(|| {
            "the liquid begins without pressure and without gravity, for the file has no pressures: state `fields: {pressure: ...}`, \
             with which gravity is found, or set gravity in the file"
                .to_owned()
        });
        [gravity, file, still].into_iter().flatten().collect()
    }
}

/// A vector without the components that are rounding beside the others.
fn without_rounding(v: [f64; 3]) -> [f64; 3] {
    let largest = v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    v.map(|x| if x.abs() > ROUNDING * largest { x } else { 0.0 })
}
