//! Readers of text: models of stars in the formats of several codes, and tables, on real files where they are present and on
//! made ones.

mod fgong;
mod gyre;
mod kepler;
mod mesa;
mod table;
mod wdec;

use crate::support::replace;
use sph_formats::{FORMATS, FieldRequest, FileContent, Geometry, Location, RawField, Result};
use std::path::{Path, PathBuf};

/// A real input file, or `None` (with a line that says so) where the collection is not there.
pub fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data").join(name);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// Reads a field of a known format.
pub fn read_as(format: Option<&str>, path: &Path, request: &FieldRequest) -> Result<RawField> {
    match sph_formats::read(FORMATS, path, format, request)? {
        FileContent::Field(field) => Ok(field),
        FileContent::Particles(_) => panic!("text files hold no particles"),
    }
}

/// Reads a field whose format has to be found out.
pub fn read(path: &Path) -> RawField {
    read_as(None, path, &FieldRequest::default()).unwrap()
}

/// Reads `content` as a file of `format`.
pub fn read_text(format: &str, content: &[u8], request: &FieldRequest) -> Result<RawField> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("input.txt");
    std::fs::write(&path, content).unwrap();
    read_as(Some(format), &path, request)
}

/// The text of the error that `content` meets; fails where it is read.
pub fn error_of(format: &str, content: &str) -> String {
    match read_text(format, content.as_bytes(), &FieldRequest::default()) {
        Ok(field) => panic!("was read: {:?}", field.geometry),
        Err(e) => e.to_string(),
    }
}

/// No prefix at every `step` bytes and no flipped byte may panic; a prefix that lacks its last lines may not be
/// read where `counted` (the format states its length).
pub fn survives_damage(format: &str, content: &[u8], step: usize, counted: bool) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.txt");
    let lines = |bytes: &[u8]| bytes.iter().filter(|&&b| b == b'\n').count();
    let request = FieldRequest::default();
    for cut in (0..content.len()).step_by(step) {
        let prefix = &content[..cut];
        replace(&path, prefix);
        let result = read_as(Some(format), &path, &request);
        if counted && lines(prefix) + 1 < lines(content) {
            assert!(result.is_err(), "the first {cut} bytes were read as a whole file");
        }
    }
    for (n, i) in (0..content.len()).step_by(step).enumerate() {
        let mut damaged = content.to_vec();
        damaged[i] ^= [0x01, 0x08, 0x10, 0x40, 0x80, 0xff][n % 6];
        replace(&path, &damaged);
        let _ = read_as(Some(format), &path, &request);
    }
}

/// Radial nodes of a field.
pub fn radii(field: &RawField) -> &[f64] {
    match &field.geometry {
        Geometry::Radial { nodes, .. } => nodes,
        other => panic!("expected a radial profile, found a {}", other.kind()),
    }
}

/// Values of a variable.
pub fn values(field: &RawField, name: &str) -> Vec<f64> {
    let found = field.variable(name).unwrap_or_else(|| panic!("no variable '{name}'"));
    found.values.to_f64()
}

/// Mass in a radial field: cell by cell, or by the trapezoid rule in r^3 between nodes.
pub fn mass(field: &RawField, density: &str) -> f64 {
    let (r, rho) = (radii(field), values(field, density));
    let location = field.variable(density).map(|v| v.location);
    let shells = r.windows(2).map(|w| 4.0 / 3.0 * std::f64::consts::PI * (w[1].powi(3) - w[0].powi(3)));
    match location {
        Some(Location::Cell) => shells.zip(&rho).map(|(v, rho)| v * rho).sum(),
        _ => shells.zip(rho.windows(2)).map(|(v, w)| v * 0.5 * (w[0] + w[1])).sum(),
    }
}

/// Asserts that two numbers agree to a relative tolerance.
#[track_caller]
pub fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found / expected - 1.0).abs() <= tolerance, "found {found:e}, expected {expected:e}");
}

/// The radius (cm) of the star of index 1 and central density 1 that the models are of.
pub const STAR_RADIUS: f64 = 7e10;

/// Its density at a fraction of the radius.
pub fn sinc(x: f64) -> f64 {
    let phase = std::f64::consts::PI * x;
    if x > 0.0 { phase.sin() / phase } else { 1.0 }
}

/// Its mass within: 4 pi R^3 times the integral of x^2 sin(pi x)/(pi x); of the first terms where these cancel.
pub fn enclosed(x: f64) -> f64 {
    use std::f64::consts::PI;
    let phase = PI * x;
    let series = |p: f64| p.powi(3) * (1.0 / 3.0 - p * p / 30.0 + p.powi(4) / 840.0 - p.powi(6) / 45_360.0);
    let difference = if phase < 0.1 { series(phase) } else { phase.sin() - phase * phase.cos() };
    4.0 * STAR_RADIUS.powi(3) * difference / (PI * PI)
}

/// All of it.
pub fn star_mass() -> f64 {
    enclosed(1.0)
}

/// A number as Fortran's `1pEw.dEe` writes it, without the letter where the exponent is longer than `exponent` digits.
pub fn fortran(value: f64, width: usize, digits: usize, exponent: usize) -> String {
    let text = format!("{value:.digits$e}");
    let (mantissa, power) = text.split_once('e').unwrap();
    let power: i32 = power.parse().unwrap();
    let letter = if power.abs() < 10_i32.pow(exponent as u32) { "E" } else { "" };
    let sign = if power < 0 { '-' } else { '+' };
    format!("{:>width$}", format!("{mantissa}{letter}{sign}{:0exponent$}", power.abs()))
}
