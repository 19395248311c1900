//! Refined grids of Athena++ and FLASH. Values are functions of x, y and z at the middle of their cell, so that a cell in the wrong
//! place has a wrong value.

use crate::support::trees::{self, Block, HI, LO, ROOTS, Run, Variable, run};
use crate::support::{attempt, refusal, refuses_flipped_bits, replace};
use sph_formats::{FieldRequest, Geometry, RawField, RefinedGrid, UnitDimension};
use std::path::Path;

fn f(x: [f64; 3]) -> f64 {
    1000.0 + x[0] + 10.0 * x[1] + 100.0 * x[2]
}

const OF_ATHENA: [Variable; 2] = [("press", |_| 7.0), ("rho", f)];
const OF_FLASH: [Variable; 4] = [("dens", f), ("velx", |x| -x[1]), ("vely", |x| x[0]), ("he4", |_| 0.25)];

fn athena(path: &Path, d: usize, coordinates: &str, change: impl Fn(&mut Vec<Block>)) {
    trees::athena(path, d, coordinates, &OF_ATHENA, change);
}

fn flash(path: &Path, d: usize, run: &Run, change: impl Fn(&mut Vec<Block>)) {
    trees::flash(path, d, run, &OF_FLASH, change);
}

/// Every value is the function at the middle of its cell, and the cells fill the box.
fn check(field: &RawField, d: usize) {
    let grid = refined(field);
    assert_eq!(grid.dimension(), d);
    let names: Vec<&str> = grid.axes.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, &["x", "y", "z"][..d]);
    assert_eq!(grid.ratios, [1, 2, 4]);
    let leaves = (ROOTS[..d].iter().product::<u64>() - 1, (1 << d) - 1, 1 << d);
    let of_levels: Vec<u64> = grid.levels().iter().map(|[blocks, _]| *blocks).collect();
    assert_eq!(of_levels, [leaves.0, leaves.1, leaves.2]);
    let density = field.variable(field.density.as_deref().unwrap()).unwrap();
    let mut volume = 0.0;
    for i in 0..grid.cell_count() {
        let (block, at) = grid.place(i).unwrap();
        let face = |k: usize, shift| grid.face(k, block.level, block.first[k] + at[k] + shift);
        let x = std::array::from_fn(|k| if k < d { 0.5 * (face(k, 0) + face(k, 1)) } else { 0.0 });
        // Values are in f32.
        assert!((density.values.get(i) - f(x)).abs() < 1e-6 * f(x), "{x:?}: {}", density.values.get(i));
        volume += (0..d).map(|k| face(k, 1) - face(k, 0)).product::<f64>();
    }
    assert!((volume - (0..d).map(|k| HI[k] - LO[k]).product::<f64>()).abs() < 1e-12);
}

fn refined(field: &RawField) -> &RefinedGrid {
    let Geometry::Refined(grid) = &field.geometry else { panic!("{:?}", field.geometry) };
    grid
}

#[test]
fn refined_blocks_of_athena_lie_where_they_say() {
    let folder = tempfile::tempdir().unwrap();
    for d in 1..=3 {
        let path = folder.path().join("a.athdf");
        athena(&path, d, "cartesian", |_| ());
        let field = attempt(&path).unwrap();
        check(&field, d);
        assert_eq!((field.format, field.density.as_deref()), ("grid-hdf5", Some("rho")));
        assert_eq!(field.metadata, [("time".to_owned(), "0.75".to_owned())]);
        assert!(field.variable("press").unwrap().values.to_f64().iter().all(|p| *p == 7.0));
        assert!(field.notes[0].starts_with("Athena++ grid of") && field.notes[0].contains("cells of level 2"));
    }
}

#[test]
fn refined_blocks_of_athena_that_do_not_fit_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.athdf");
    athena(&path, 3, "spherical_polar", |_| ());
    let text = refusal(&path);
    assert!(text.contains("refined grid in coordinates 'spherical_polar'"), "{text}");
    athena(&path, 3, "cartesian", |b| b.truncate(b.len() - 1));
    assert!(refusal(&path).contains("are missing: none of the"), "{}", refusal(&path));
    athena(&path, 3, "cartesian", |b| b[4] = b[5]);
    assert!(refusal(&path).contains("overlaps block") || refusal(&path).contains("missing"), "{}", refusal(&path));
    athena(&path, 3, "cartesian", |b| b[1].place[0] += 2);
    let text = refusal(&path);
    assert!(text.contains("block 1 of level") && text.contains("expected less than"), "{text}");
    athena(&path, 3, "cartesian", |b| b[1].level = 3);
    assert!(refusal(&path).contains("block 1 is of level 3, expected 0 to 2"), "{}", refusal(&path));
    // A block that is said to be elsewhere than its faces are.
    athena(&path, 2, "cartesian", |_| ());
    let whole = std::fs::read(&path).unwrap();
    for length in [whole.len() / 2, whole.len() - 100] {
        replace(&path, &whole[..length]);
        assert!(attempt(&path).is_err());
    }
    athena(&path, 1, "cartesian", |b| {
        b.retain(|b| b.level > 0);
        for level in [1, 2] {
            assert!(b.iter().any(|b| b.level == level));
        }
    });
    assert!(attempt(&path).is_err(), "half of the box is not covered");
}

#[test]
fn leaves_of_flash_lie_where_they_say() {
    let folder = tempfile::tempdir().unwrap();
    for d in 1..=3 {
        for name in ["sedov_hdf5_chk_0001", "sedov.h5"] {
            let path = folder.path().join(name);
            flash(&path, d, &run(d), |_| ());
            let field = attempt(&path).unwrap();
            check(&field, d);
            assert_eq!((field.format, field.density.as_deref()), ("grid-hdf5", Some("dens")));
            assert_eq!(field.metadata, [("time".to_owned(), "2.5".to_owned())]);
            assert!(field.notes[0].starts_with("FLASH grid of"), "{:?}", field.notes);
            let grid = refined(&field);
            assert!(grid.axes[0].is_periodic && !grid.axes[1..].iter().any(|a| a.is_periodic));
            assert_eq!(grid.unit.as_ref().map(|u| (u.symbol.as_str(), u.to_cgs)), Some(("cm", 1.0)));
            let unit = |name: &str| field.variable(name).unwrap().unit.clone().map(|u| (u.to_cgs, u.dimension));
            assert_eq!(unit("dens"), Some((1.0, UnitDimension::mass_density(3))));
            assert_eq!((unit("velx"), unit("he4")), (Some((1.0, UnitDimension::VELOCITY)), None));
            assert!(field.variable("he4").unwrap().values.to_f64().iter().all(|x| *x == 0.25));
        }
    }
}

#[test]
fn what_flash_says_of_its_run_is_heeded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plt_cnt_0001");
    let mut other = run(2);
    other.texts = vec![("geometry", "cylindrical")];
    flash(&path, 2, &other, |_| ());
    assert!(refusal(&path).contains("geometry 'cylindrical'"));
    other.texts = vec![("pc_unitsbase", "none")];
    flash(&path, 2, &other, |_| ());
    let field = attempt(&path).unwrap();
    assert!(refined(&field).unit.is_none() && field.variables.iter().all(|v| v.unit.is_none()));
    assert!(field.notes.iter().any(|n| n.contains("does not name its geometry")), "{:?}", field.notes);
    other.texts = vec![("pc_unitsbase", "MKS")];
    flash(&path, 2, &other, |_| ());
    assert_eq!(refined(&attempt(&path).unwrap()).unit.as_ref().map(|u| u.to_cgs), Some(100.0));
    other.counts.push(("globalnumblocks", 99));
    flash(&path, 2, &other, |_| ());
    assert!(refusal(&path).contains("but the run has 99"));
    let mut other = run(2);
    other.counts[0].1 = 12;
    flash(&path, 2, &other, |_| ());
    assert!(refusal(&path).contains("guard cells"));
    // Blocks of one cell along y, which do not become narrower along it with their level.
    let mut other = run(1);
    other.counts[3].1 = 2;
    flash(&path, 1, &other, |_| ());
    assert!(
        refusal(&path).contains("dataset 'bounding box'") && refusal(&path).contains("of level"),
        "{}",
        refusal(&path)
    );
}

#[test]
fn blocks_of_flash_that_do_not_fit_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    let refused = |change: &dyn Fn(&mut Vec<Block>)| {
        flash(&path, 3, &run(3), change);
        refusal(&path)
    };
    assert!(refused(&|b| b.truncate(b.len() - 1)).contains("are missing"));
    let text = refused(&|b| b.push(b[0]));
    assert!(text.contains("overlaps block") && text.contains("block 0 of level 0"), "{text}");
    let text = refused(&|b| b.iter_mut().for_each(|b| b.is_leaf = false));
    assert!(text.contains("is a leaf"), "{text}");
    flash(&path, 3, &run(3), |_| ());
    let whole = std::fs::read(&path).unwrap();
    for length in [whole.len() / 2, whole.len() - 200] {
        replace(&path, &whole[..length]);
        assert!(attempt(&path).is_err());
    }
    replace(&path, &whole);
    refuses_flipped_bits(&path, "grid-hdf5", &FieldRequest::default());
}

#[test]
fn a_uniform_grid_of_flash_is_one_level() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ug_hdf5_plt_cnt_0000");
    flash(&path, 3, &run(3), |b| {
        b.retain(|b| b.level == 0);
        b.iter_mut().for_each(|b| b.is_leaf = true);
    });
    let field = attempt(&path).unwrap();
    assert_eq!(refined(&field).ratios, [1]);
    assert_eq!(refined(&field).levels(), [[6, 144]]);
}
