//! GYRE's models in HDF5.

use rust_hdf5::H5File;
use sph_formats::{FORMATS, FieldRequest, FileContent, Geometry, RawField, Result, read};
use std::path::Path;

fn attempt(path: &Path) -> Result<RawField> {
    match read(FORMATS, path, None, &FieldRequest::default())? {
        FileContent::Field(field) => Ok(field),
        FileContent::Particles(_) => panic!("a star holds no particles"),
    }
}

fn values(field: &RawField, name: &str) -> Vec<f64> {
    field.variable(name).unwrap_or_else(|| panic!("no '{name}'")).values.to_f64()
}

fn radii(field: &RawField) -> &[f64] {
    match &field.geometry {
        Geometry::Radial { nodes, .. } => nodes,
        other => panic!("{}", other.kind()),
    }
}

fn file(path: &Path, numbers: &[(&str, f64)], columns: &[(&str, &[f64])]) {
    let file = H5File::create(path).unwrap();
    let root = file.root_group();
    numbers.iter().for_each(|(name, value)| root.set_attr_array_numeric(name, &[*value]).unwrap());
    for (name, values) in columns {
        file.new_dataset::<f64>().shape([values.len()]).create(name).unwrap().write_raw(values).unwrap();
    }
    file.close().unwrap();
}

/// Lane-Emden of index 1 in closed form: theta = sin z / z, mass 4 pi^2 at z = pi.
#[test]
fn a_polytrope_has_the_mass_and_pressure_of_its_equation() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poly.h5");
    let n = 401;
    let z: Vec<f64> = (0..n).map(|i| std::f64::consts::PI * i as f64 / (n - 1) as f64).collect();
    let theta: Vec<f64> = z.iter().map(|z| if *z == 0.0 { 1.0 } else { z.sin() / z }).collect();
    let slope: Vec<f64> = z.iter().map(|z| if *z == 0.0 { 0.0 } else { (z * z.cos() - z.sin()) / (z * z) }).collect();
    let scalars = [("n", n as f64), ("n_poly", 1.0), ("n_r", 1.0)];
    file(&path, &scalars, &[("z", &z), ("theta", &theta), ("dtheta", &slope)]);
    let field = attempt(&path).unwrap();
    assert_eq!((field.format, field.density.as_deref()), ("gyre-hdf5", Some("density")));
    assert_eq!(radii(&field), z);
    let (rho, mass, pressure) =
        (values(&field, "density"), values(&field, "enclosed_mass"), values(&field, "pressure"));
    assert!((mass[n - 1] - 4.0 * std::f64::consts::PI.powi(2)).abs() < 1e-12);
    // dP/dr = -G m rho / r^2 with G = 1, by central differences: error (dz)^2 / 6 times the third derivative, of order 10.
    for i in (20..n - 20).step_by(37) {
        let gradient = (pressure[i + 1] - pressure[i - 1]) / (z[i + 1] - z[i - 1]);
        let expected = -mass[i] * rho[i] / (z[i] * z[i]);
        assert!((gradient - expected).abs() < 2e-4, "{i}: {gradient} against {expected}");
    }
    file(&path, &[("n_r", 2.0), ("n_poly", 1.0)], &[("z", &z), ("theta", &theta)]);
    assert!(attempt(&path).unwrap_err().to_string().contains("composite polytrope of 2 regions"));
    file(&path, &[("n", 7.0), ("n_poly", 1.0)], &[("z", &z), ("theta", &theta)]);
    assert!(attempt(&path).unwrap_err().to_string().contains("has 401 values, but the attribute n is 7"));
}

#[test]
fn the_polytrope_of_gyre_has_the_constants_of_the_books() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/gyre/poly_n3.h5");
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return;
    }
    let field = attempt(&path).unwrap();
    let (r, rho) = (radii(&field), values(&field, "density"));
    // Chandrasekhar (1939), table 4: z = 6.89685, -z^2 theta' = 2.01824, central over mean density 54.1825.
    let (surface, mass) = (r[r.len() - 1], values(&field, "enclosed_mass")[r.len() - 1]);
    assert!((surface - 6.89685).abs() < 1e-5 && (mass / (4.0 * std::f64::consts::PI) - 2.01824).abs() < 1e-5);
    let trapezoid: f64 = (1..r.len()).map(|i| (r[i].powi(3) - r[i - 1].powi(3)) * (rho[i] + rho[i - 1]) / 6.0).sum();
    assert!((trapezoid / 2.01824 - 1.0).abs() < 1e-4, "{trapezoid}");
    assert!((surface.powi(3) / (3.0 * 2.01824) - 54.1825).abs() < 2e-3);
}

#[test]
fn gsm_models_of_both_kinds_give_the_same_star() {
    let folder = tempfile::tempdir().unwrap();
    let (old, new) = (folder.path().join("old.h5"), folder.path().join("new.gsm"));
    let (r, rho, mass) = ([0.0, 1e10, 2e10], [100.0, 10.0, 0.0], [0.0, 1.5e33, 2e33]);
    let w = [0.0, 3.0, f64::INFINITY];
    let star = [("n", 3.0), ("M_star", 2e33), ("R_star", 2e10), ("L_star", 4e33)];
    file(&old, &star, &[("r", &r), ("rho", &rho), ("w", &w), ("p", &[3.0, 2.0, 1.0])]);
    let versioned: Vec<_> = star.into_iter().chain([("version", 110.0)]).collect();
    file(&new, &versioned, &[("r", &r), ("rho", &rho), ("M_r", &mass), ("P", &[3.0, 2.0, 1.0])]);
    for (path, version) in [(&old, "0.00"), (&new, "1.10")] {
        let field = attempt(path).unwrap();
        assert_eq!((radii(&field), values(&field, "density")), (r.as_slice(), rho.to_vec()));
        assert_eq!((values(&field, "enclosed_mass"), values(&field, "pressure")), (mass.to_vec(), vec![3.0, 2.0, 1.0]));
        assert_eq!(field.variable("density").and_then(|v| v.unit.as_ref()).map(|u| u.to_cgs), Some(1.0));
        assert!(field.metadata.contains(&("version".into(), version.into())), "{:?}", field.metadata);
    }
    file(&new, &star, &[("r", &[0.0, f64::NAN, 1.0]), ("rho", &rho)]);
    assert!(attempt(&new).unwrap_err().to_string().contains("dataset 'r': value 1 is NaN"));
    file(&new, &star, &[("r", &r), ("rho", &[1.0])]);
    assert!(attempt(&new).unwrap_err().to_string().contains("dataset 'rho': has shape [1], expected (3)"));
}

#[test]
fn columns_that_no_model_has_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("other.h5");
    let (r, rho): (&[f64], &[f64]) = (&[0.0, 1.0, 2.0], &[3.0, 2.0, 0.0]);
    let notes = |more: &[&str]| {
        let columns: Vec<(&str, &[f64])> = more.iter().map(|name| (*name, rho)).collect();
        file(&path, &[("n", 3.0)], &[&[("r", r), ("rho", rho)][..], &columns].concat());
        match read(FORMATS, &path, Some("gyre-hdf5"), &FieldRequest::default()).unwrap() {
            FileContent::Field(field) => field.notes.join("; "),
            FileContent::Particles(_) => panic!("a star holds no particles"),
        }
    };
    let told = notes(&["v_r", "P", "kap_T", "helium"]);
    let unknown = told.split("as no model of GYRE has them: ").nth(1).unwrap_or_else(|| panic!("{told}"));
    assert!(unknown.contains("helium") && unknown.contains("v_r") && !unknown.contains("kap_T"), "{told}");
    assert!(!notes(&["P", "kap_T", "eps_rho", "N2"]).contains("left out"));
}
