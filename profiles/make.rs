//! Makes the bundled profiles: `cargo run --release --example make-profiles`.
//!
//! - `star.nc`: n = 3 polytrope of one solar mass and radius (Eddington's standard model of a star), gamma = 5/3.
//! - `polytrope-1.5.nc`: n = 1.5, a fully convective star of one solar mass and radius.
//! - `asteroid.stl`: an elongated lump with craters, in units of a kilometer.
//! - `wvt.png`: three letters on a ground of a hundredth of their brightness.
//! - `rotating-star.hdf5`: a snapshot of 4000 particles of a toy star, rho = 15/(8 pi) (1 - r^2) and u = rho, that rotates and drifts.
//!
//! Lane-Emden: theta'' + 2/xi theta' + theta^n = 0, integrated by Runge-Kutta 4; then rho = rho_c theta^n and
//! P = P_c theta^(n+1), with the central values that belong to mass and radius (Chandrasekhar 1939, ch. IV).

use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use sph_formats::common::particle_names as names;
use sph_formats::units::{GRAVITATIONAL_CONSTANT_CGS, SOLAR_MASS_CGS, SOLAR_RADIUS_CGS};
use sph_formats::{FORMATS, Values, WriteOptions};
use sph_prep::{Control, Scene, place};
use std::f64::consts::PI;
use std::path::Path;

/// Rows of a profile.
const ROWS: usize = 1001;
const GAMMA: f64 = 5.0 / 3.0;

struct LaneEmden {
    index: f64,
    /// First zero of theta, and -theta' there.
    surface: f64,
    slope: f64,
}

/// theta and -theta' at `xi`, one step of length `h` further.
fn step(index: f64, xi: f64, (theta, slope): (f64, f64), h: f64) -> (f64, f64) {
    // Series at the center, where 2/xi is singular: theta = 1 - xi^2/6, -theta' = xi/3.
    let derivative = |xi: f64, theta: f64, slope: f64| {
        let curvature = if xi > 0.0 { theta.max(0.0).powf(index) - 2.0 * slope / xi } else { 1.0 / 3.0 };
        (-slope, curvature)
    };
    let (a1, b1) = derivative(xi, theta, slope);
    let (a2, b2) = derivative(xi + 0.5 * h, theta + 0.5 * h * a1, slope + 0.5 * h * b1);
    let (a3, b3) = derivative(xi + 0.5 * h, theta + 0.5 * h * a2, slope + 0.5 * h * b2);
    let (a4, b4) = derivative(xi + h, theta + h * a3, slope + h * b3);
    (theta + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4), slope + h / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4))
}

/// Steps between two rows.
const SUBSTEPS: usize = 20;

impl LaneEmden {
    fn new(index: f64) -> Self {
        let h = 1e-4;
        let (mut xi, mut state) = (0.0, (1.0, 0.0));
        loop {
            let next = step(index, xi, state, h);
            if next.0 <= 0.0 {
                // theta and its slope are linear so near the zero.
                let part = state.0 / (state.0 - next.0);
                return Self { index, surface: xi + part * h, slope: state.1 + part * (next.1 - state.1) };
            }
            (xi, state) = (xi + h, next);
        }
    }

    /// theta on `ROWS` equidistant radii.
    fn table(&self) -> Vec<f64> {
        let h = self.surface / ((ROWS - 1) * SUBSTEPS) as f64;
        let mut state = (1.0, 0.0);
        let mut rows = vec![1.0];
        for i in 1..ROWS {
            for k in 0..SUBSTEPS {
                state = step(self.index, ((i - 1) * SUBSTEPS + k) as f64 * h, state, h);
            }
            rows.push(if i + 1 == ROWS { 0.0 } else { state.0.max(0.0) });
        }
        rows
    }
}

fn polytrope(index: f64, path: &Path, title: &str) -> Result<(), Box<dyn std::error::Error>> {
    let model = LaneEmden::new(index);
    let theta = model.table();
    let (mass, radius) = (SOLAR_MASS_CGS, SOLAR_RADIUS_CGS);
    let mean = mass / (4.0 / 3.0 * PI * radius.powi(3));
    let central_density = mean * model.surface / (3.0 * model.slope);
    let central_pressure = GRAVITATIONAL_CONSTANT_CGS * mass * mass
        / (radius.powi(4) * 4.0 * PI * (index + 1.0) * model.slope * model.slope);
    let row = |f: &dyn Fn(f64) -> f64| theta.iter().map(|&t| f(t)).collect::<Vec<f64>>();
    let energy = central_pressure / central_density / (GAMMA - 1.0);
    let columns = [
        ("radius", "cm", "distance from the center", {
            (0..ROWS).map(|i| radius * i as f64 / (ROWS - 1) as f64).collect()
        }),
        ("density", "g cm-3", "mass density", row(&|t| central_density * t.powf(index))),
        ("pressure", "dyn cm-2", "gas pressure", row(&|t| central_pressure * t.powf(index + 1.0))),
        ("internal_energy", "erg g-1", "specific internal energy, gamma = 5/3", row(&|t| energy * t)),
    ];
    let mut file = ClassicFile::new();
    file.attribute("title", title);
    file.attribute("Conventions", "CF-1.8");
    file.attribute("source", "Lane-Emden equation, made by sph-prep's own profiles/make.rs");
    let rows = file.dimension("radius", ROWS);
    for (name, units, meaning, values) in &columns {
        file.variable(
            name,
            &[rows],
            Data::F64(values),
            &[("units", (*units).into()), ("long_name", (*meaning).into())],
        );
    }
    file.write(path)?;
    println!("{}: xi_1 = {:.6}, rho_c/mean = {:.4}", path.display(), model.surface, central_density / mean);
    Ok(())
}

/// Steps around the axis of the asteroid, and from pole to pole.
const AROUND: usize = 48;
const ALONG: usize = 24;
/// Directions of craters with the angle that each spans and its depth, in radians and radii.
const CRATERS: [([f64; 3], f64, f64); 5] = [
    ([0.8, 0.6, 0.0], 0.5, 0.12),
    ([-0.6, 0.48, 0.64], 0.4, 0.1),
    ([0.0, -0.8, 0.6], 0.6, 0.15),
    ([0.36, -0.48, -0.8], 0.35, 0.08),
    ([-0.96, 0.0, -0.28], 0.45, 0.1),
];

/// A point of the asteroid's surface: an ellipsoid with waves and craters.
fn asteroid_point(i: usize, j: usize) -> [f64; 3] {
    let (sin, cos) = (2.0 * PI * (i % AROUND) as f64 / AROUND as f64).sin_cos();
    let (ring, z) = match j {
        0 => (0.0, 1.0),
        ALONG => (0.0, -1.0),
        _ => (PI * j as f64 / ALONG as f64).sin_cos(),
    };
    let way = [ring * cos, ring * sin, z];
    let waves = 0.06 * (3.0 * way[0]).sin() * (2.0 * way[1]).cos() + 0.05 * (4.0 * way[2] + 1.0).sin();
    let crater = |(to, span, depth): &([f64; 3], f64, f64)| {
        let cosine = (0..3).map(|k| to[k] * way[k]).sum::<f64>();
        let q = cosine.clamp(-1.0, 1.0).acos() / span;
        if q < 1.0 { -depth * (1.0 - q * q).powi(2) } else { 0.0 }
    };
    let radius = 1.0 + waves + CRATERS.iter().map(crater).sum::<f64>();
    [0.28, 0.16, 0.13]
        .iter()
        .zip(way)
        .map(|(axis, w)| axis * radius * w)
        .collect::<Vec<_>>()
        .try_into()
        .unwrap_or([0.0; 3])
}

fn asteroid(path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let mut triangles: Vec<[[f64; 3]; 3]> = Vec::new();
    for (i, j) in (0..AROUND).flat_map(|i| (0..ALONG).map(move |j| (i, j))) {
        let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| asteroid_point(i, j));
        // At the poles one of the two has no extent.
        if j > 0 {
            triangles.push([a, c, b]);
        }
        if j + 1 < ALONG {
            triangles.push([a, d, c]);
        }
    }
    let mut bytes = b"asteroid, km; made by sph-prep's own profiles/make.rs".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in &triangles {
        bytes.extend([0; 12]);
        triangle.iter().flatten().for_each(|v| bytes.extend((*v as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    std::fs::write(path, bytes)?;
    println!("{}: {} triangles", path.display(), triangles.len());
    Ok(())
}

/// Strokes of the letters W, V and T from pixel to pixel, columns and rows from the upper left.
const STROKES: [[[f64; 2]; 2]; 8] = [
    [[10.0, 8.0], [22.0, 48.0]],
    [[22.0, 48.0], [32.0, 20.0]],
    [[32.0, 20.0], [42.0, 48.0]],
    [[42.0, 48.0], [54.0, 8.0]],
    [[62.0, 8.0], [78.0, 48.0]],
    [[78.0, 48.0], [94.0, 8.0]],
    [[100.0, 8.0], [136.0, 8.0]],
    [[118.0, 8.0], [118.0, 48.0]],
];

/// Half of the width of a stroke, in pixels.
const STROKE: f64 = 4.0;
const LOGO: [u32; 2] = [144, 56];

fn letters(path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let distance = |x: f64, y: f64, [a, b]: [[f64; 2]; 2]| {
        let (along, across) = (b[0] - a[0], b[1] - a[1]);
        let t = ((x - a[0]) * along + (y - a[1]) * across) / (along * along + across * across);
        let t = t.clamp(0.0, 1.0);
        (x - a[0] - t * along).hypot(y - a[1] - t * across)
    };
    let mut bytes = Vec::new();
    for row in 0..LOGO[1] {
        for column in 0..LOGO[0] {
            let (x, y) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
            let is_letter = STROKES.iter().any(|stroke| distance(x, y, *stroke) < STROKE);
            let value: u16 = if is_letter { 65_535 } else { 655 };
            bytes.extend(value.to_be_bytes());
        }
    }
    let mut encoder = png::Encoder::new(std::fs::File::create(path)?, LOGO[0], LOGO[1]);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_compression(png::Compression::High);
    encoder.write_header()?.write_image_data(&bytes)?;
    println!("{}: {} by {} pixels", path.display(), LOGO[0], LOGO[1]);
    Ok(())
}

/// Of the snapshot.
const STAR: &str = "input: {profile: {toy-star: {mass: 1, radius: 1, k: 1}}}
particles: 4000
thermal: {gamma: 2}
fields: {velocity: ['0.1 - 0.3*y', '0.3*x', 0]}
output: {units: code, origin: center-of-mass}";
/// Where its center is, along each axis.
const MIDDLE: f64 = 2.0;
/// What a snapshot cannot do without.
const COLUMNS: [&str; 6] =
    [names::COORDINATES, names::VELOCITIES, names::MASSES, names::PARTICLE_IDS, names::INTERNAL_ENERGY, names::DENSITY];

fn snapshot(path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let (mut file, _) = place(&Scene::parse(STAR)?, FORMATS, &Control::default())?;
    let table = &mut file.species[0].table;
    table.columns.retain(|c| COLUMNS.contains(&c.name.as_str()));
    for column in table.columns.iter_mut().filter(|c| c.name != names::PARTICLE_IDS) {
        let shift = if column.name == names::COORDINATES { MIDDLE } else { 0.0 };
        column.values = Values::F32(column.values.to_f64().iter().map(|v| (v + shift) as f32).collect());
    }
    // In the middle of a box, as codes have it.
    (file.header.box_size, file.header.box_corner) = ([2.0 * MIDDLE; 3], None);
    file.header.provenance = vec![("Source".into(), "sph-prep's own profiles/make.rs".into())];
    let options = WriteOptions { compression: 9, ..WriteOptions::default() };
    sph_formats::write(FORMATS, path, Some("gadget"), &file, options)?;
    println!("{}: {} particles", path.display(), file.species[0].table.count);
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles");
    polytrope(3.0, &folder.join("star.nc"), "n = 3 polytrope of one solar mass and radius")?;
    polytrope(1.5, &folder.join("polytrope-1.5.nc"), "n = 1.5 polytrope of one solar mass and radius")?;
    asteroid(&folder.join("asteroid.stl"))?;
    letters(&folder.join("wvt.png"))?;
    snapshot(&folder.join("rotating-star.hdf5"))?;
    Ok(())
}
