//! The scenes: contrasts, jumps, holes, cusps, spikes, thin domains, strange grids, numbers at the ends of f64.

use super::harness::Case;
use sph_formats::{Coordinates, Geometry, GridAxis, Location, RawField, Unit, Values, Variable};

/// A scene in one or several dimensions, and those in which it does not come to particles in order.
pub struct Scene {
    pub case: Case,
    pub dimensions: &'static [usize],
    /// Dimensions, and the number of particles from which on there are enough of them.
    unresolved: &'static [(usize, usize)],
    refused: &'static [usize],
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Expected {
    /// Particles.
    Placed,
    /// Particles, but far too few for the domain: pairs of them and their density mean nothing. All else holds.
    Unresolved,
    /// An error.
    Refused,
}

const ALL: &[usize] = &[1, 2, 3];

/// Ball of radius 1 about the origin.
const BALL: &str = "ball: {center: CENTER, radius: 1}";
const PERIODIC: &str = "box: [LO, HI], boundary: [periodic]";
const WALLS: &str = "box: [LO, HI], boundary: [reflecting]";
const OPEN: &str = "box: [LO, HI]";

fn scene(name: &str, expression: &str, domain: &str, dimensions: &'static [usize]) -> Scene {
    let yaml = format!("input: {{expression: '{expression}'}}\ndomain: {{{domain}}}");
    Scene { case: Case::new(name, yaml), dimensions, unresolved: &[], refused: &[] }
}

impl Scene {
    fn unresolved_below(self, counts: &'static [(usize, usize)]) -> Self {
        Self { unresolved: counts, ..self }
    }

    fn refused_in(self, dimensions: &'static [usize]) -> Self {
        Self { refused: dimensions, ..self }
    }

    pub fn expected(&self, dimension: usize, count: usize) -> Expected {
        let unresolved = |&(d, enough): &(usize, usize)| d == dimension && count < enough;
        if self.refused.contains(&dimension) {
            Expected::Refused
        } else if self.unresolved.iter().any(unresolved) {
            Expected::Unresolved
        } else {
            Expected::Placed
        }
    }

    pub fn is_in_a_ball(&self) -> bool {
        self.case.yaml.contains("ball:")
    }

    /// Whether there are places without mass inside the domain.
    pub fn has_holes(&self) -> bool {
        self.case.name == "hole"
    }

    /// The case in `d` dimensions.
    pub fn in_dimension(&self, d: usize) -> Case {
        let list = |v: &str| format!("[{}]", vec![v; d].join(","));
        // A needle is long along x, a pancake thin along it.
        let first = |v: &str, rest: &str| {
            let mut values = vec![rest; d];
            values[0] = v;
            format!("[{}]", values.join(","))
        };
        let mut case = self.case.clone();
        for (key, value) in [
            ("CENTER", list("0")),
            ("LO", list("0")),
            ("HI", list("1")),
            ("NEEDLE", first("1000", "1")),
            ("PANCAKE", first("1", "1000")),
        ] {
            case.yaml = case.yaml.replace(key, &value);
        }
        case.name = format!("{} {d}-D", case.name);
        case
    }
}

/// Density contrasts from 1e2 to 1e12.
fn contrasts() -> Vec<Scene> {
    vec![
        scene("contrast 1e2", "1 + 99*exp(-20*r^2)", BALL, ALL),
        scene("contrast 1e4", "exp(-9.21*r)", BALL, ALL),
        scene("red giant, core 1e12", "1e-6*(1.001 - r)^3 + 1e6/(1 + (r/0.005)^2)^4", BALL, ALL),
        scene("stellar wind 1e6", "1/max(r, 1e-3)^2", BALL, ALL),
        scene("stellar wind 1e12", "1/max(r, 1e-6)^2", BALL, &[3]),
        scene("thin disc 1e12", "max(exp(-5*sqrt(x^2+y^2) - (z/0.02)^2), 1e-12)", BALL, &[3]),
        scene("layer 1e8", "exp(-18.4*x)", WALLS, ALL),
    ]
}

fn jumps() -> Vec<Scene> {
    vec![
        scene("two-layer planet", "if(r < 0.5, 10, 3.5)", BALL, ALL),
        // The outer layer is 0.2 thick and has a 38th of the mass on a line, a 14th in the plane. With 100 particles the
        // support radius there, of 2.5 spacings, is 0.4 and 1: wider than the layer, so that all particles are near a jump
        // or the surface. With 1000 on the line it is 0.04, with 3000 in the plane 0.18.
        scene("three-layer planet", "if(r < 0.5, 12, if(r < 0.8, 4.5, 1))", BALL, ALL)
            .unresolved_below(&[(1, 1000), (2, 3000)]),
        scene("shock tube 8:1", "if(x < 0.5, 8, 1)", WALLS, ALL),
        scene("shock tube 8:1 periodic", "if(x < 0.5, 8, 1)", PERIODIC, ALL),
        scene("top hat 1e3", "if(abs(x - 0.5) < 0.2, 1000, 1)", PERIODIC, ALL),
        scene("blob 10:1", "if(hypot(x - 0.5, y - 0.5) < 0.2, 10, 1)", PERIODIC, &[2, 3]),
    ]
}

fn holes() -> Vec<Scene> {
    vec![
        scene("hole", "if(r < 0.4, 0, 1)", BALL, ALL),
        scene("island in vacuum", "if(abs(x - 0.3) < 0.1, 1, 0)", OPEN, ALL),
        scene("disjoint islands", "if(abs(x - 0.2) < 0.1, 1, if(abs(x - 0.8) < 0.05, 3, 0))", OPEN, ALL),
        scene("speckles", "if(sin(40*x) > 0.9, 1, 0)", PERIODIC, ALL),
        scene("nothing at all", "0*x", OPEN, ALL).refused_in(ALL),
        scene("negative", "x - 0.5", OPEN, ALL).refused_in(ALL),
    ]
}

fn cusps() -> Vec<Scene> {
    vec![
        // In 1-D its mass is infinite.
        scene("Evrard 1/r", "1/r", BALL, ALL).refused_in(&[1]),
        scene("NFW", "1/((10*r)*(1 + 10*r)^2)", BALL, &[2, 3]),
        scene("Bondi r^-3/2", "r^(-1.5)", BALL, &[2, 3]),
        scene("ALARIC well, Delta 0", "1 - cos(5*r)*exp(-5*r^2)", BALL, ALL),
        scene("r^8 well", "r^8", BALL, ALL),
        scene("spike 1e-6 wide", "1 + 1e5*exp(-((x - 0.37)/1e-6)^2)", PERIODIC, ALL),
        // In three dimensions a sheet that is far thinner than the distance of particles in it.
        scene("spike that holds all mass", "1e-9 + exp(-((x - 0.37)/1e-4)^2)", WALLS, ALL)
            .unresolved_below(&[(3, 100_000_000)]),
        scene("point mass", "1/max(r, 1e-9)^3", BALL, &[3]),
    ]
}

fn domains() -> Vec<Scene> {
    vec![
        scene("needle 1000:1", "1 + 0.5*sin(pi*x/500)", "box: [LO, NEEDLE], boundary: [periodic]", &[2, 3]),
        scene("needle 1000:1, walls", "2 + x/1000", "box: [LO, NEEDLE], boundary: [reflecting]", &[2, 3]),
        scene("pancake 1:1000", "2 + sin(pi*y/500)", "box: [LO, PANCAKE], boundary: [periodic]", &[2, 3]),
        scene("pancake 1:1000, open", "2 + y/1000", "box: [LO, PANCAKE]", &[2, 3]),
        scene("shell", "1", "ball: {center: CENTER, radius: 1, inner_radius: 0.8}", ALL),
        // Its spacing is less than the thickness with 2 pi 1e3 particles on the circle and 4 pi 1e6 on the sphere. On a line
        // it is two pieces 2 apart; with 100 particles one batch holds both, and single precision has 1e-7 of that
        // distance, 1/200 of the spacing.
        scene("shell 1e-3 thick", "1", "ball: {center: CENTER, radius: 1, inner_radius: 0.999}", ALL)
            .unresolved_below(&[(1, 1000), (2, 6300), (3, 12_600_000)]),
        scene("far from the origin", "1 + 0.5*sin(2*pi*(x - 1e6))", "box: [FAR, AWAY], boundary: [periodic]", &[1]),
    ]
}

fn extremes() -> Vec<Scene> {
    let ball = |r: &str| format!("ball: {{center: CENTER, radius: {r}}}");
    vec![
        scene("density 1e-300", "1e-300*(1 + r)", BALL, ALL),
        scene("density 1e+300", "1e300*(1 + r)", BALL, ALL),
        // What is below the smallest normal number, 2.2e-308, has too few digits.
        scene("denormal density", "1e-310*(1 + r)", BALL, ALL).refused_in(ALL),
        scene("size 1e-90", "1 + r*1e90", &ball("1e-90"), ALL),
        scene("size 1e+90", "1 + r*1e-90", &ball("1e90"), ALL),
        // Masses of 1e-360, 1e400 and 1e600 are beyond f64.
        scene("size 1e-120", "1", &ball("1e-120"), ALL).refused_in(&[3]),
        scene("size 1e+200", "1", &ball("1e200"), ALL).refused_in(&[2, 3]),
        scene("infinite density", "1e308*10*(1 + x)", BALL, ALL).refused_in(ALL),
        scene("NaN density", "sqrt(x - 0.5)", OPEN, ALL).refused_in(ALL),
        scene("cgs star", "1.4*(1.001 - r/7e10)^3", &ball("7e10"), ALL),
    ]
}

fn variable(values: Vec<f64>, location: Location) -> Variable {
    Variable {
        name: "rho".into(),
        description: None,
        unit: Unit::parse("1"),
        location,
        components: 1,
        values: Values::F64(values),
    }
}

/// A Cartesian grid over the unit box with these values.
fn grid(name: &str, d: usize, nodes: usize, location: Location, value: impl Fn(usize) -> f64) -> Case {
    let axis = |k: usize| GridAxis {
        name: ["x", "y", "z"][k].into(),
        nodes: (0..nodes).map(|i| i as f64 / (nodes - 1) as f64).collect(),
        unit: Unit::parse("1"),
        bounds: None,
    };
    let per_axis = if location == Location::Cell { nodes - 1 } else { nodes };
    let values = (0..per_axis.pow(d as u32)).map(value).collect();
    let field = RawField {
        path: "in.field".into(),
        format: "field",
        geometry: Geometry::Grid { coordinates: Coordinates::Cartesian, axes: (0..d).map(axis).collect() },
        variables: vec![variable(values, location)],
        density: Some("rho".into()),
        metadata: Vec::new(),
        notes: Vec::new(),
    };
    Case { name: format!("{name} {d}-D"), yaml: "output: {units: code}".into(), field: Some(field) }
}

/// A number in [0, 1) that looks random.
fn scrambled(i: usize) -> f64 {
    let mut x = (i as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x ^ (x >> 31)) as f64 / 2f64.powi(64)
}

/// Grids: one cell, noise over decades, NaN around the matter.
pub fn grids() -> Vec<(Case, Expected)> {
    let mut out = Vec::new();
    for d in 1..=3 {
        out.push((grid("grid of one cell", d, 2, Location::Cell, |_| 2.0), Expected::Placed));
        out.push((grid("grid of two nodes", d, 2, Location::Node, |i| 1.0 + i as f64), Expected::Placed));
        out.push((
            grid("noise over 6 decades", d, 9, Location::Cell, |i| 10f64.powf(6.0 * scrambled(i))),
            Expected::Placed,
        ));
        let halo = move |i: usize| {
            let r2: f64 = (0..d).map(|k| ((i / 9_usize.pow(k as u32) % 9) as f64 / 8.0 - 0.5).powi(2)).sum();
            if r2 < 0.2 { 1.0 + r2 } else { f64::NAN }
        };
        out.push((grid("NaN halo", d, 9, Location::Node, halo), Expected::Refused));
        let mut zero = grid("NaN halo as vacuum", d, 9, Location::Node, halo);
        zero.yaml += "\ninput: {missing: zero}";
        out.push((zero, Expected::Placed));
        out.push((grid("all NaN", d, 5, Location::Node, |_| f64::NAN), Expected::Refused));
    }
    out
}

/// All scenes given as expressions.
pub fn all() -> Vec<Scene> {
    let mut scenes = contrasts();
    for more in [jumps(), holes(), cusps(), domains(), extremes()] {
        scenes.extend(more);
    }
    for scene in &mut scenes {
        scene.case.yaml = scene.case.yaml.replace("FAR", "[1e6]").replace("AWAY", "[1000001]");
        scene.case.yaml += "\noutput: {units: code}\nalaric: {steps: 120}";
    }
    scenes
}
