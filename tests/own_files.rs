//! Small files of the kinds that programs write, made from closed forms: what they should give is known exactly.

use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use std::f64::consts::PI;
use std::path::Path;

/// The sun's radius and mass as the files state them, in cm and g.
pub const RADIUS: f64 = 6.957e10;
const SUN: f64 = 1.988_4e33;
/// Zones of a star.
const ZONES: usize = 400;

/// Density in g/cm^3 of the n = 1 polytrope of central density 1, at a fraction of its radius.
fn density(x: f64) -> f64 {
    if x > 0.0 { (PI * x).sin() / (PI * x) } else { 1.0 }
}

/// Grams within: 4 pi R^3 times the integral of x^2 sin(pi x)/(pi x).
fn enclosed(x: f64) -> f64 {
    4.0 * RADIUS.powi(3) * ((PI * x).sin() / PI - x * (PI * x).cos()) / PI
}

/// Grams in all.
pub fn star_mass() -> f64 {
    4.0 / PI * RADIUS.powi(3)
}

/// Zones from the surface inward: faces' radius and mass, the mean density between them.
fn mesa() -> String {
    let mut text = format!(
        "1 2 3 4\nmodel_number num_zones msun rsun\n7 {ZONES} {SUN:e} {RADIUS:e}\n\n1 2 3 4 5\nzone mass radius logRho h1\n"
    );
    for zone in 0..ZONES {
        let (outer, inner) = ((ZONES - zone) as f64 / ZONES as f64, (ZONES - zone - 1) as f64 / ZONES as f64);
        let volume = 4.0 / 3.0 * PI * RADIUS.powi(3) * (outer.powi(3) - inner.powi(3));
        let mean = (enclosed(outer) - enclosed(inner)) / volume;
        text += &format!("{} {:e} {outer:e} {:e} 0.7\n", zone + 1, enclosed(outer) / SUN, mean.log10());
    }
    text
}

/// Radii from the center, short of the surface, where the density is 0.
fn rows() -> impl Iterator<Item = f64> {
    (0..ZONES).map(|i| i as f64 / ZONES as f64)
}

fn gyre() -> String {
    let edge = (ZONES - 1) as f64 / ZONES as f64;
    let mut text = format!("{ZONES} {:e} {:e} 1.0E+33 100\n", enclosed(edge), edge * RADIUS);
    for (i, x) in rows().enumerate() {
        let rest = "0.4 1e-7 1.67 0.4 1.0 0.3 0.0 0.0 1.0 0.0 0.0 0.0";
        let (mass, pressure) = (enclosed(x), 1e15 * density(x).powi(2));
        text += &format!("{} {:e} {mass:e} 0.0 {pressure:e} 1.0e6 {:e} {rest}\n", i + 1, x * RADIUS, density(x));
    }
    text
}

/// Variables at the same radii from the surface inward, five on a line; a negative number touches the one before it.
fn fgong() -> String {
    let block = |values: &[f64]| {
        let line = |five: &[f64]| five.iter().map(|v| fortran(*v, 16, 9)).collect::<String>() + "\n";
        values.chunks(5).map(line).collect::<String>()
    };
    let mut text = format!("a polytrope\n\n\n\n{ZONES:>10}{:>10}{:>10}{:>10}\n", 5, 6, 300);
    text += &block(&[star_mass(), RADIUS, 3.8e33, 0.02, 0.7]);
    for x in rows().collect::<Vec<f64>>().into_iter().rev() {
        let log = if x > 0.0 { (enclosed(x) / star_mass()).ln() } else { -138.0 };
        text += &block(&[x * RADIUS, log, 1e6, 1e16 * density(x), density(x), 0.7]);
    }
    text
}

/// A number of so many characters, as Fortran writes it.
fn fortran(value: f64, width: usize, digits: usize) -> String {
    let text = format!("{value:.digits$e}");
    let (mantissa, power) = text.split_once('e').unwrap();
    let power: i32 = power.parse().unwrap();
    format!("{:>width$}", format!("{mantissa}E{power:+03}"))
}

/// Cells from the center outward: faces' radius and mass, the mean density between them.
fn progenitor() -> String {
    let names = ["cell outer total mass", "cell outer radius", "cell density", "cell temperature", "stability", "h1"];
    let mut text = format!("VERSION 1 -- made by hand\n  grid   {}\n", names.join("    "));
    for cell in 0..ZONES {
        let (inner, outer) = (cell as f64 / ZONES as f64, (cell + 1) as f64 / ZONES as f64);
        let volume = 4.0 / 3.0 * PI * RADIUS.powi(3) * (outer.powi(3) - inner.powi(3));
        let mean = (enclosed(outer) - enclosed(inner)) / volume;
        text += &format!("{}:  {:e}  {:e}  {mean:e}  1e6  rad  ---\n", cell + 1, enclosed(outer), outer * RADIUS);
    }
    text + "wind:  0\n"
}

/// Arrays at the same radii, four numbers on a line.
fn wdec() -> String {
    let mut text = format!("  41  4.8722E+08\n  {ZONES}  =   100  +   {}\n", ZONES - 100);
    for array in 1..=20 {
        let value = |x: f64| match array {
            1 => x * RADIUS,
            2 => enclosed(x),
            4 => 1e6,
            5 => density(x),
            6 => 1e16 * density(x),
            _ => 0.0,
        };
        let all: Vec<String> = rows().map(|x| fortran(value(x), 22, 15)).collect();
        all.chunks(4).for_each(|four| text += &(four.concat() + "\n"));
    }
    text
}

/// As KEPLER's models come with Phantom: from the surface inward, names in brackets.
fn kepler() -> String {
    let mut text = "[    Mass   ]  [  Pressure ]  [   Radius  ]  [  Density  ]\n".to_owned();
    for x in rows().collect::<Vec<_>>().into_iter().rev().filter(|x| *x > 0.0) {
        text += &format!("{:e} {:e} {:e} {:e}\n", enclosed(x), 1e15 * density(x).powi(2), x * RADIUS, density(x));
    }
    text
}

/// Radius and density without units, after a commented header: the mass is 4/pi.
fn plain() -> String {
    "# r, density\n".to_owned() + &rows().map(|x| format!("{x:e} {:e}\n", density(x))).collect::<String>()
}

/// A planet in SI units as PREM is tabulated: depth before radius, and a jump as two rows of one radius.
fn planet() -> String {
    let mut text = "#Depth(m)\tRadius(m)\tDensity(kg/m^3)\n".to_owned();
    for (radius, rho) in [(6.4e6, 4000.0), (3.2e6, 4000.0), (3.2e6, 10_000.0), (0.0, 10_000.0)] {
        text += &format!("{:e}\t{radius:e}\t{rho:e}\n", 6.4e6 - radius);
    }
    text
}

/// Grams of the planet: two uniform layers.
pub fn planet_mass() -> f64 {
    let ball = |r: f64| 4.0 / 3.0 * PI * r.powi(3);
    1e3 * (4000.0 * (ball(6.4e6) - ball(3.2e6)) + 10_000.0 * ball(3.2e6))
}

/// Outer radius of the mantle, and its depth, in km.
pub const MANTLE: (f64, f64) = (6371.0, 2900.0);

/// Density over depth, latitude and longitude, linear in depth and the same all around.
fn mantle(path: &Path, with_depth: bool) {
    let mut file = ClassicFile::new();
    let depths = [0.0, 1000.0, MANTLE.1];
    let latitudes: Vec<f64> = (0..7).map(|i| -90.0 + 30.0 * f64::from(i)).collect();
    let longitudes: Vec<f64> = (0..12).map(|i| 30.0 * f64::from(i)).collect();
    let mut axes = Vec::new();
    if with_depth {
        let depth = file.dimension("depth", depths.len());
        file.variable("depth", &[depth], Data::F64(&depths), &[("units", "km".into()), ("positive", "down".into())]);
        axes.push(depth);
    }
    for (name, nodes, unit) in [("latitude", &latitudes, "degrees_north"), ("longitude", &longitudes, "degrees_east")] {
        let axis = file.dimension(name, nodes.len());
        file.variable(name, &[axis], Data::F64(nodes), &[("units", unit.into())]);
        axes.push(axis);
    }
    let layers = if with_depth { &depths[..] } else { &depths[..1] };
    let around = latitudes.len() * longitudes.len();
    let values: Vec<f64> = layers.iter().flat_map(|d| vec![3300.0 + 0.8 * d; around]).collect();
    file.variable("rho", &axes, Data::F64(&values), &[("units", "kg m-3".into())]);
    file.write(path).unwrap();
}

/// Kilograms of the mantle: the integral of 4 pi r^2 (3300 + 0.8 (R - r)) with r in km.
pub fn mantle_mass() -> f64 {
    let (outer, inner) = (MANTLE.0, MANTLE.0 - MANTLE.1);
    let power = |p: i32| (outer.powi(p) - inner.powi(p)) / f64::from(p);
    4e9 * PI * ((3300.0 + 0.8 * outer) * power(3) - 0.8 * power(4))
}

/// 1 + x on a rectilinear grid with uneven lines over the box of 1 x 2 x 4; on its cells there may be something else of
/// the same name.
fn rectilinear(name: &str, cells_too: bool) -> String {
    let xs = [0.0, 0.1, 0.4, 1.0];
    let mut text = format!(
        "# vtk DataFile Version 3.0\nbox\nASCII\nDATASET RECTILINEAR_GRID\nDIMENSIONS 4 2 2\n\
         X_COORDINATES 4 double\n0 0.1 0.4 1\nY_COORDINATES 2 double\n0 2\nZ_COORDINATES 2 double\n0 4\n\
         POINT_DATA 16\nSCALARS {name} double 1\nLOOKUP_TABLE default\n"
    );
    text += &(0..16).map(|i| format!("{}\n", 1.0 + xs[i % 4])).collect::<String>();
    if cells_too {
        text += &format!("CELL_DATA 3\nSCALARS {name} double 1\nLOOKUP_TABLE default\n1\n-1\n1\n");
    }
    text
}

/// Mass of the box: 8 times the mean of 1 + x.
pub const BOX_MASS: f64 = 12.0;

/// Writes all of them into a folder.
pub fn write(folder: &Path) {
    for (name, content) in [
        ("star.data", mesa()),
        ("star.mesa", gyre()),
        ("kepler.data", kepler()),
        ("star.fgong", fgong()),
        ("star_presn", progenitor()),
        ("evolved", wdec()),
        ("star.tab", plain()),
        ("planet.txt", planet()),
        ("box.vtk", rectilinear("rho", false)),
        ("points_and_cells.vtk", rectilinear("scalars", true)),
        ("no_variables.vtu", NO_VARIABLES.into()),
    ] {
        std::fs::write(folder.join(name), content).unwrap();
    }
    mantle(&folder.join("mantle.nc"), true);
    mantle(&folder.join("surface.nc"), false);
}

/// One tetrahedron, and nothing on it.
const NO_VARIABLES: &str = r#"<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="4" NumberOfCells="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">4</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">10</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>
"#;
