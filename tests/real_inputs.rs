//! Every file that was collected from real programs, through the built binary: particles, or an error that states
//! the true reason. The files are not part of the project; where their folder is absent there is nothing to test.

use Outcome::{Particles, Refused};
use assert_cmd::Command;
use std::path::{Path, PathBuf};

const PARTICLES: usize = 2000;

#[derive(Debug, Clone, Copy)]
enum Outcome {
    Particles,
    /// Texts that the error has to hold besides the file's name.
    Refused(&'static [&'static str]),
}

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

/// What a run does other than the table says.
fn fault(folder: &Path, (name, arguments, expected): (&str, &[&str], Outcome)) -> Option<String> {
    let out = tempfile::tempdir().unwrap();
    let (input, file) = (folder.join(name).display().to_string(), out.path().join("ic.hdf5"));
    let output = Command::new(env!("CARGO_BIN_EXE_sph-prep"))
        .args(["--in", &input, "--out", &file.display().to_string(), "--iterations", "3", "--json"])
        .args(["-n", &PARTICLES.to_string()])
        .args(arguments)
        .output()
        .unwrap();
    let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let code = output.status.code();
    let wrong = |what: String| Some(format!("{name} {arguments:?}: {what}; exit code {code:?}, {stderr}"));
    match expected {
        Particles if code == Some(0) => {
            let report: serde_json::Value = serde_json::from_str(&stdout).unwrap();
            let defect = report["mass"]["defect"].as_f64().unwrap();
            let count = report["particles"].as_u64().unwrap() as usize;
            let is_right = count == PARTICLES && defect.abs() < 1e-12 && file.exists();
            if is_right { None } else { wrong(format!("{count} particles, mass defect {defect:e}")) }
        }
        Refused(words) if code == Some(1) => {
            let unsaid = [input.as_str()].into_iter().chain(words.iter().copied()).find(|w| !stderr.contains(w));
            let left = std::fs::read_dir(out.path()).unwrap().count();
            match unsaid {
                Some(word) => wrong(format!("does not say {word:?}")),
                None if left > 0 || stderr.contains("panicked") => wrong(format!("{left} files left")),
                None => None,
            }
        }
        _ => wrong(format!("expected {expected:?}")),
    }
}

#[test]
fn each_file_gives_particles_or_the_true_reason() {
    let Some(folder) = folder() else { return };
    let present = TABLE.iter().filter(|(name, _, _)| folder.join(name).is_file());
    let faults: Vec<String> = present.filter_map(|&row| fault(&folder, row)).collect();
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
    let out = tempfile::tempdir().unwrap();
    let (scene, ic) = (out.path().join("mantle.yaml"), out.path().join("ic.hdf5"));
    let text = format!(
        "input: {{file: '{}', planet_radius: 6371, density_unit: kg/m^3}}\nparticles: {PARTICLES}\n\
         wvt: {{iterations: 3}}\noutput: {{file: '{}', units: si}}\n",
        file.display(),
        ic.display()
    );
    std::fs::write(&scene, text).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_sph-prep"));
    let output = command.arg("--scene").arg(&scene).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let mass = report["mass"]["total"].as_f64().unwrap();
    assert!((mass / MASS - 1.0).abs() < 1e-9, "{mass:e}");
    assert!(report["mass"]["defect"].as_f64().unwrap().abs() < 1e-12);
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
