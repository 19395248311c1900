//! Files as real programs write them, through the built binary: particles of the right mass, or an error that states
//! the true reason.
//!
//! The small files are made here, from closed forms. Those that were collected from programs are not part of the
//! project; where their folder is absent the tests of them say `skipped`.

use crate::own_files;
use Outcome::{Particles, Refused};
use assert_cmd::Command;
use std::path::{Path, PathBuf};

const PARTICLES: usize = 500;

#[derive(Debug, Clone, Copy)]
enum Outcome {
    Particles,
    /// Texts that the error has to hold besides the file's name.
    Refused(&'static [&'static str]),
}

/// The small files: file, further arguments, outcome.
const OWN: &[(&str, &[&str], Outcome)] = &[
    ("star.data", &[], Particles),
    ("star.mesa", &[], Particles),
    ("kepler.data", &[], Particles),
    ("star.fgong", &[], Particles),
    ("star_presn", &[], Particles),
    ("evolved", &[], Particles),
    ("star.tab", &[], Particles),
    ("planet.txt", &[], Particles),
    ("box.vtk", &[], Particles),
    // The planet's radius is nowhere in the file.
    ("mantle.nc", &[], Refused(&["depth from a surface", "input.planet_radius"])),
    ("surface.nc", &[], Refused(&["'rho'", "latitude"])),
    ("points_and_cells.vtk", &[], Refused(&["cannot tell which", "'scalars', 'scalars_2'"])),
    ("points_and_cells.vtk", &["--density", "scalars"], Particles),
    ("points_and_cells.vtk", &["--density", "scalars_2"], Refused(&["'scalars_2'", "negative"])),
    ("no_variables.vtu", &[], Refused(&["has no variables"])),
];

/// File, further arguments, outcome. A file may have several rows.
const TABLE: &[(&str, &[&str], Outcome)] = &[
    ("earth/prem_burnman.txt", &[], Particles),
    ("gyre/poly_n3.h5", &[], Particles),
    ("gyre/rgb.mesa", &[], Particles),
    ("mesa/mesa2hydro_profile_mainsequence_logE.data", &[], Particles),
    ("mesa/mesa2hydro_profile_redgiant_logE.data", &[], Particles),
    ("mesa/mesa2hydro_profile_wd1_0.6Msolar.data", &[], Particles),
    ("mesa/mesa_16M_profile_tams.data", &[], Particles),
    ("mesa/py_mesa_reader_profile1.data", &[], Particles),
    // The planet's radius is nowhere in the file.
    ("netcdf/SAW642AN_rho.nc", &[], Refused(&["depth from a surface", "input.planet_radius"])),
    // Numbers of ocean basins, and temperatures of the sea's surface: neither fills a volume.
    ("netcdf/basin_mask.nc", &[], Refused(&["'basin'", "longitude, latitude"])),
    ("netcdf/tos_O1_2001-2002.nc", &[], Refused(&["'tos'", "longitude, latitude"])),
    ("phantom/kepler_MS.data", &[], Particles),
    ("phantom/lau22.data", &[], Particles),
    ("phantom/ns-rdensity.tab", &[], Particles),
    ("vtk/RectGrid2.vtk", &[], Particles),
    // One array on points and one on cells have the same name; the latter holds negative numbers.
    ("vtk/SampleStructGrid.vtk", &[], Refused(&["cannot tell which", "'scalars', 'scalars_2'"])),
    ("vtk/SampleStructGrid.vtk", &["--density", "scalars"], Particles),
    ("vtk/SampleStructGrid.vtk", &["--density", "scalars_2"], Refused(&["'scalars_2'", "negative"])),
    ("vtk/hexa.vtk", &[], Particles),
    ("vtk/hydrogen.vti", &[], Particles),
    ("vtk/ironProt.vtk", &[], Particles),
    ("vtk/vtkio_RectilinearGridCompressed.vtr", &[], Refused(&["cannot tell which", "'Void Volume Fraction'"])),
    ("vtk/vtkio_hexahedron_lz4.vtu", &[], Refused(&["has no variables"])),
    ("vtk/vtkio_volume_complex.vti", &[], Particles),
];

fn folder() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    if !folder.is_dir() {
        println!("skipped: there is no folder '{}'", folder.display());
        return None;
    }
    Some(folder)
}

/// Runs a file; the report where there are particles, and what the run does other than the table says.
fn check(folder: &Path, (name, arguments, expected): (&str, &[&str], Outcome)) -> Result<serde_json::Value, String> {
    let out = tempfile::tempdir().unwrap();
    let (input, file) = (folder.join(name).display().to_string(), out.path().join("ic.hdf5"));
    let output = Command::new(env!("CARGO_BIN_EXE_sph-prep"))
        .args(["--in", &input, "--out", &file.display().to_string(), "--iterations", "3", "--polish", "none", "--json"])
        .args(["-n", &PARTICLES.to_string()])
        .args(arguments)
        .output()
        .unwrap();
    let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let code = output.status.code();
    let wrong = |what: String| Err(format!("{name} {arguments:?}: {what}; exit code {code:?}, {stderr}"));
    match expected {
        Particles if code == Some(0) => {
            let report: serde_json::Value = serde_json::from_str(&stdout).unwrap();
            let defect = report["mass"]["defect"].as_f64().unwrap();
            let count = report["particles"].as_u64().unwrap() as usize;
            let is_right = count == PARTICLES && defect.abs() < 1e-12 && file.exists();
            if is_right { Ok(report) } else { wrong(format!("{count} particles, mass defect {defect:e}")) }
        }
        Refused(words) if code == Some(1) => {
            let unsaid = [input.as_str()].into_iter().chain(words.iter().copied()).find(|w| !stderr.contains(w));
            let left = std::fs::read_dir(out.path()).unwrap().count();
            match unsaid {
                Some(word) => wrong(format!("does not say {word:?}")),
                None if left > 0 || stderr.contains("panicked") => wrong(format!("{left} files left")),
                None => Ok(serde_json::Value::Null),
            }
        }
        _ => wrong(format!("expected {expected:?}")),
    }
}

#[test]
fn each_small_file_gives_particles_or_the_true_reason() {
    let folder = tempfile::tempdir().unwrap();
    own_files::write(folder.path());
    let faults: Vec<String> = OWN.iter().filter_map(|&row| check(folder.path(), row).err()).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let unknown = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let unknown: Vec<String> = unknown.filter(|name| !OWN.iter().any(|(known, ..)| known == name)).collect();
    assert!(unknown.is_empty(), "files without a row in the table: {unknown:?}");
}

#[test]
fn small_files_give_the_mass_of_their_closed_form() {
    let folder = tempfile::tempdir().unwrap();
    own_files::write(folder.path());
    let star = own_files::star_mass();
    for (name, key, expected, within) in [
        // Zones hold their mass exactly.
        ("star.data", "total_cgs", star, 1e-9),
        // The interpolant misses pi^2/12 h^2 of the mass between radii h = 1/400 apart, 5e-6, and the last radius leaves out
        // the surface layer, where the density is 1 - x: pi^2/2 h^2, 3e-5.
        ("star.mesa", "total_cgs", star, 1e-4),
        ("kepler.data", "total", star, 1e-4),
        ("star.fgong", "total_cgs", star, 1e-4),
        // Densities of cells are differences of masses, which cancel in the center.
        ("star_presn", "total_cgs", star, 1e-9),
        ("evolved", "total_cgs", star, 1e-4),
        ("star.tab", "total", 4.0 / std::f64::consts::PI, 1e-4),
        // Layers and the box are exact but for the rounding of the quadrature.
        ("planet.txt", "total_cgs", own_files::planet_mass(), 1e-9),
        ("box.vtk", "total", own_files::BOX_MASS, 1e-9),
    ] {
        let report = placed(&folder.path().join(name), "atmosphere: keep", "cgs");
        let mass = report["mass"][key].as_f64().unwrap_or_else(|| panic!("{name}: no {key} in {}", report["mass"]));
        assert!((mass / expected - 1.0).abs() < within, "{name}: {mass:e} instead of {expected:e}");
    }
}

#[test]
fn a_small_mantle_over_depth_becomes_a_shell_of_its_mass() {
    let folder = tempfile::tempdir().unwrap();
    own_files::write(folder.path());
    let mass = shell_mass(&folder.path().join("mantle.nc"), own_files::MANTLE.0);
    // Linear over depth, as is the interpolation.
    assert!((mass / own_files::mantle_mass() - 1.0).abs() < 1e-9, "{mass:e}");
}

/// Mass in kg of the shell that a file of densities over depth gives.
fn shell_mass(file: &Path, planet_radius: f64) -> f64 {
    let report = placed(file, &format!("planet_radius: {planet_radius}, density_unit: kg/m^3"), "si");
    report["mass"]["total"].as_f64().unwrap()
}

/// The report on particles of a file, read with these keys; they add up to its mass.
fn placed(file: &Path, keys: &str, units: &str) -> serde_json::Value {
    let out = tempfile::tempdir().unwrap();
    let (scene, ic) = (out.path().join("scene.yaml"), out.path().join("ic.hdf5"));
    let text = format!(
        "input: {{file: '{}', {keys}}}\nparticles: {PARTICLES}\nwvt: {{iterations: 3}}\n\
         output: {{file: '{}', units: {units}}}\n",
        file.display(),
        ic.display()
    );
    std::fs::write(&scene, text).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_sph-prep"));
    let output = command.arg("--scene").arg(&scene).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(report["mass"]["defect"].as_f64().unwrap().abs() < 1e-12);
    report
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn each_file_gives_particles_or_the_true_reason() {
    let Some(folder) = folder() else { return };
    let present = TABLE.iter().filter(|(name, _, _)| folder.join(name).is_file());
    let faults: Vec<String> = present.filter_map(|&row| check(&folder, row).err()).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_mantle_over_depth_becomes_a_shell_of_its_mass() {
    // Sum over the layers between the 46 depths of the exact integral of the sphere's mean density, linear in radius
    // and in latitude (weights from cos), in kg; 9 depths are jumps.
    const MASS: f64 = 4.001_513_038_823e24;
    let Some(folder) = folder() else { return };
    let file = folder.join("netcdf/SAW642AN_rho.nc");
    if !file.is_file() {
        return println!("skipped: there is no '{}'", file.display());
    }
    let mass = shell_mass(&file, 6371.0);
    assert!((mass / MASS - 1.0).abs() < 1e-9, "{mass:e}");
}

#[test]
fn each_file_has_a_row() {
    let Some(folder) = folder() else { return };
    let mut unknown = Vec::new();
    for group in std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).filter(|p| p.is_dir()) {
        for file in std::fs::read_dir(group).unwrap() {
            let path = file.unwrap().path();
            let name = path.strip_prefix(&folder).unwrap().display().to_string();
            if !TABLE.iter().any(|(known, _, _)| *known == name) {
                unknown.push(name);
            }
        }
    }
    assert!(unknown.is_empty(), "files without a row in the table: {unknown:?}");
}
