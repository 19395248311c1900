//! One scene from its number: domain, density, number of particles, units and method.

use super::density::{Density, Law, Matter};
use super::domain::{Boundary, Domain, Kind};
use super::draw::{Draw, Point};
use super::quadrature::Masses;
use super::solid::Solid;
use sph_prep::seeding::METHODS;
use sph_prep::sph::kernel::{KernelName, default_kernel_neighbors};
use std::fmt::Write;

/// A scene. Lengths and densities are in units of its own, of which `length` and `scale` are those that it is written in.
#[derive(Debug, Clone)]
pub struct Drawn {
    pub number: u64,
    pub d: usize,
    pub count: usize,
    pub domain: Domain,
    pub density: Density,
    pub length: f64,
    pub scale: f64,
    /// Whether the density is given as a table over the radius.
    pub is_table: bool,
    pub seeding: Option<&'static str>,
    pub kernel: Option<KernelName>,
    pub neighbors: Option<f64>,
    /// Seconds.
    pub time_limit: Option<f64>,
    /// Keys of the method.
    method: String,
}

/// Name of the table that a scene may read.
const TABLE: &str = "profile.csv";
/// Rows of a table.
const ROWS: usize = 600;

impl Drawn {
    pub fn new(number: u64) -> Self {
        let draw = &mut Draw::new(number);
        let d = draw.one(&[1, 2, 2, 3, 3]);
        let count = draw.decades(0.0, 3.5) as usize;
        let is_table = draw.percent(12);
        let domain = if is_table { Domain::of_profile(d, draw.decades(-1.0, 1.0)) } else { Domain::draw(draw, d) };
        let density = loop {
            let density = if is_table { profile(draw, d, &domain) } else { expression(draw, d, &domain) };
            // A density that is zero nearly everywhere is refused: its solids have to reach into the domain.
            if holds_matter(&density, &domain) {
                break density;
            }
        };
        let far = draw.percent(30);
        let (length, scale) = if far { (draw.decades(-30.0, 30.0), draw.decades(-30.0, 30.0)) } else { (1.0, 1.0) };
        let kernel = draw.percent(35).then(|| draw.one(&KernelName::ALL));
        let usual = default_kernel_neighbors(d).log10();
        let neighbors = draw.percent(35).then(|| draw.decades(usual - 0.2, usual + 0.4));
        let time_limit = draw.percent(8).then(|| draw.decades(-1.5, 0.7));
        let seeding = draw.percent(35).then(|| METHODS[draw.below(METHODS.len())].name);
        let method = method(draw);
        Self {
            number,
            d,
            count,
            domain,
            density,
            length,
            scale,
            is_table,
            seeding,
            kernel,
            neighbors,
            time_limit,
            method,
        }
    }

    /// The scene, with the folder of its table.
    pub fn yaml(&self, folder: &str) -> String {
        let mut out = format!("# scene {}\n{}", self.number, self.body(folder));
        if let Some(seconds) = self.time_limit {
            writeln!(out, "time_limit: {seconds:?}").unwrap();
        }
        out += &self.method;
        out
    }

    /// The same without what follows the seeding.
    pub fn yaml_of_seeds(&self, folder: &str) -> String {
        format!("{}wvt: {{iterations: 0}}\npolish: none\n", self.body(folder))
    }

    fn body(&self, folder: &str) -> String {
        let mut out = String::new();
        if self.is_table {
            writeln!(out, "input: {{file: '{folder}/{TABLE}', dimension: {}, atmosphere: keep}}", self.d).unwrap();
        } else {
            let names: Vec<String> = ["x", "y", "z"][..self.d].iter().map(|name| self.coordinate(name)).collect();
            let factor = if self.scale == 1.0 { String::new() } else { format!("{:?}*", self.scale) };
            let text = self.density.text(&names);
            writeln!(out, "input: {{expression: '{factor}({text})'}}").unwrap();
            writeln!(out, "{}", self.domain.text(self.length)).unwrap();
        }
        writeln!(out, "particles: {}\nseed: {}", self.count, self.number).unwrap();
        if let Some(seeding) = self.seeding {
            writeln!(out, "seeding: {seeding}").unwrap();
        }
        if let Some(kernel) = self.kernel {
            writeln!(out, "kernel: {}", kernel.name()).unwrap();
        }
        if let Some(neighbors) = self.neighbors {
            writeln!(out, "neighbors: {neighbors:.2}").unwrap();
        }
        out
    }

    fn coordinate(&self, name: &str) -> String {
        if self.length == 1.0 { name.into() } else { format!("({name}/{:?})", self.length) }
    }

    /// Writes the table, where there is one.
    pub fn write(&self, folder: &std::path::Path) {
        if self.is_table {
            std::fs::write(folder.join(TABLE), self.table()).unwrap();
        }
    }

    /// Radius and density, with two rows where the density jumps.
    fn table(&self) -> String {
        let radius = self.domain.hi[0];
        let inner = 1e-4_f64.ln();
        let mut radii: Vec<f64> = (0..ROWS).map(|i| (inner * (1.0 - i as f64 / (ROWS - 1) as f64)).exp()).collect();
        radii.insert(0, 0.0);
        let mut rows: Vec<[f64; 2]> =
            radii.iter().map(|r| [r * radius, self.density.value(&[r * radius, 0.0, 0.0])]).collect();
        for (solid, _) in &self.density.solids {
            let Solid::Ball { radius, .. } = solid else { unreachable!("tables have balls alone") };
            for side in [1.0 - 1e-12, 1.0 + 1e-12] {
                rows.push([*radius, self.density.value(&[radius * side, 0.0, 0.0])]);
            }
        }
        // Stable: the rows of a jump stay in order.
        rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let line = |[r, rho]: &[f64; 2]| format!("{:e},{:e}\n", r * self.length, rho * self.scale);
        format!("r,rho\n{}", rows.iter().map(line).collect::<String>())
    }

    /// The mass that is to be placed, and where.
    pub fn masses(&self) -> Masses {
        Masses::new(&self.density, &self.domain)
    }
}

/// Whether some hundredth of the domain's bounds has matter.
fn holds_matter(density: &Density, domain: &Domain) -> bool {
    const POINTS: usize = 4000;
    // Kronecker sequence of the generalized golden ratio of three dimensions.
    let steps = [0.819_172_513_396_164, 0.671_043_606_703_789, 0.549_700_477_901_970];
    let at = |i: usize| -> Point {
        let u = steps.map(|s| (0.5 + s * i as f64).fract());
        std::array::from_fn(|k| domain.lo[k] + u[k] * domain.edge(k))
    };
    let places: Vec<Point> = (0..POINTS).map(at).filter(|x| domain.contains(x, 0.0)).collect();
    let values: Vec<f64> = places.iter().map(|x| density.value(x)).collect();
    100 * values.iter().filter(|v| **v > 0.0).count() > POINTS && values.iter().all(|v| v.is_finite())
}

fn expression(draw: &mut Draw, d: usize, domain: &Domain) -> Density {
    let bounds = [&domain.lo, &domain.hi];
    let number = draw.one(&[0, 0, 0, 1, 1, 1, 2, 3]);
    // Steps of uniform matter, whose regions are known to be apart; or all laws within each other.
    let even = number > 0 && draw.percent(60);
    let vacuum = number > 0 && draw.percent(30);
    let matter = |draw: &mut Draw, factor: f64| {
        let law = if even { Law::Uniform } else { Law::draw(draw, d, bounds, domain.center) };
        let floor = match law {
            Law::Uniform | Law::Wave { .. } => 0.0,
            _ if draw.percent(50) => factor * draw.decades(-12.0, 0.0),
            _ => 0.0,
        };
        Matter { factor, law, floor }
    };
    let around = if vacuum { draw.one(&[0.0, 0.0, 1e-10, 1e-6]) } else { 1.0 };
    let around = matter(draw, around);
    let solids = (0..number).map(|_| {
        let factor = if draw.percent(8) { 0.0 } else { draw.decades(-3.0, 6.0) };
        let solid = Solid::draw(draw, d, bounds);
        (solid, matter(draw, factor))
    });
    Density { d, solids: solids.collect(), around }
}

/// A law of the radius that falls outward, perhaps with a denser or thinner core.
fn profile(draw: &mut Draw, d: usize, domain: &Domain) -> Density {
    let radius = domain.hi[0];
    let center = [0.0; 3];
    let law = match draw.below(5) {
        0 => Law::Giant {
            center,
            core: radius * draw.decades(-2.3, -1.0),
            envelope: draw.decades(-14.0, -1.0),
            radius: 1.01 * radius,
        },
        1 => Law::Gaussian { center, width: radius * draw.between(0.2, 1.0) },
        2 => Law::Power { center, core: radius * draw.decades(-2.3, -0.3), slope: draw.between(0.5, 6.0) },
        3 => Law::Atmosphere { normal: [1.0, 0.0, 0.0], foot: 0.0, height: radius * draw.between(0.08, 0.5) },
        _ => Law::Uniform,
    };
    let law =
        if let Law::Atmosphere { height, .. } = law { Law::Power { center, core: height, slope: 5.0 } } else { law };
    let solids = if draw.percent(40) {
        let core = Matter { factor: draw.decades(-1.0, 3.0), law: law.clone(), floor: 0.0 };
        vec![(Solid::Ball { center, radius: radius * draw.between(0.1, 0.9) }, core)]
    } else {
        Vec::new()
    };
    Density { d, solids, around: Matter { factor: 1.0, law, floor: 0.0 } }
}

fn method(draw: &mut Draw) -> String {
    let mut out = String::new();
    let mut say = |line: String| {
        out += &line;
        out.push('\n');
    };
    match draw.below(20) {
        0 | 1 => say("polish: none".into()),
        2..=4 => {
            let splittings = if draw.percent(50) { format!(", splittings: {}", draw.below(4)) } else { String::new() };
            say(format!("polish: alaric\nalaric: {{steps: {}{splittings}}}", draw.one(&[20, 60, 150])));
        }
        5 => say(format!("polish: damped-relaxation\nalaric: {{steps: {}}}", draw.one(&[20, 60]))),
        6 => say(format!("polish: afc\nafc: {{steps: {}}}", draw.one(&[10, 40]))),
        7 => say(format!("solver: {{quietness: {:?}}}", draw.one(&[0.0, 0.3, 0.8, 1.0]))),
        8 => say(format!("solver: {{evaluations: {}}}", draw.one(&[1, 5, 30]))),
        9 => say(format!("trim_masses: {:?}", draw.one(&[0.01, 0.1, 0.5]))),
        10 => say(format!("region_contrast: {:?}", draw.one(&[1.1, 1.5, 30.0, 1e6]))),
        11 => say("order: isotropic".into()),
        12 => say(format!("wvt: {{iterations: {}}}", draw.one(&[0, 1, 5, 40]))),
        13 => say("tolerance: 1e-6".into()),
        _ => {}
    }
    out
}

/// Particles of a quick scene, at most, in one to three dimensions.
const QUICK: [usize; 3] = [1000, 300, 120];

impl Drawn {
    /// Whether it takes a fraction of a second, whatever the clock says: few particles, and in space nothing that is
    /// integrated across faces.
    pub fn is_quick(&self) -> bool {
        let is_smooth = |matter: &Matter| matches!(matter.law, Law::Uniform | Law::Wave { .. } | Law::Gaussian { .. });
        let is_plain = match self.domain.kind {
            Kind::Box | Kind::Ball { .. } | Kind::Cylinder { .. } => true,
            Kind::Torus { .. } | Kind::Ellipsoid { .. } | Kind::Less { .. } | Kind::Two { .. } => {
                self.density.solids.is_empty() && is_smooth(&self.density.around)
            }
        };
        let solids = [3, 1, 0][self.d - 1];
        let few_solids = self.density.solids.len() <= solids && (self.d == 1 || is_smooth(&self.density.around));
        let is_made = matches!(self.seeding, Some("glass" | "gravitational-glass"));
        self.count <= QUICK[self.d - 1]
            && self.time_limit.is_none()
            && !is_made
            && is_plain
            && (few_solids || self.is_table)
    }

    /// Whether particles end where they are mirrored or repeated, and nowhere else: what codes sum there is known.
    pub fn is_flat(&self) -> bool {
        match self.domain.kind {
            Kind::Box => true,
            Kind::Cylinder { axis, .. } => (0..3).all(|k| k == axis || self.domain.boundary[k] == Boundary::Open),
            _ => self.domain.boundary[0] == Boundary::Open,
        }
    }
}
