//! Plotfiles of AMReX. Values are functions of x, y and z at the middle of their cell.

use crate::support::plotfile::{HI, LO, Plot, Variable};
use crate::support::{attempt, refusal, replace};
use sph_formats::{
    FORMATS, FieldRequest, FileContent, Geometry, RawField, RefinedGrid, UnitDimension, Values, files_of, read,
};
use std::fs;
use std::path::Path;

const VARIABLES: [Variable; 3] = [("density", f), ("x_velocity", |x| -x[1]), ("X(he4)", |_| 0.25)];

fn plot(dimension: usize) -> Plot {
    Plot::new(dimension, &VARIABLES)
}

fn f(x: [f64; 3]) -> f64 {
    1000.0 + x[0] + 10.0 * x[1] + 100.0 * x[2]
}

fn refined(field: &RawField) -> &RefinedGrid {
    let Geometry::Refined(grid) = &field.geometry else { panic!("{:?}", field.geometry) };
    grid
}

/// Every value is its function at the middle of its cell, and the cells fill the box.
fn check(field: &RawField, d: usize) {
    let grid = refined(field);
    assert_eq!((grid.dimension(), grid.ratios.as_slice()), (d, &[1, 2, 8][..]));
    let variable = |name: &str| &field.variable(name).unwrap().values;
    let (density, velocity) = (variable("density"), variable("x_velocity"));
    let mut volume = 0.0;
    for i in 0..grid.cell_count() {
        let (block, at) = grid.place(i).unwrap();
        let face = |k: usize, shift| grid.face(k, block.level, block.first[k] + at[k] + shift);
        let x: [f64; 3] = std::array::from_fn(|k| if k < d { 0.5 * (face(k, 0) + face(k, 1)) } else { 0.0 });
        assert!((density.get(i) - f(x)).abs() < 1e-6 * f(x), "{x:?}: {}", density.get(i));
        assert!((velocity.get(i) + x[1]).abs() < 1e-5, "{x:?}: {}", velocity.get(i));
        volume += (0..d).map(|k| face(k, 1) - face(k, 0)).product::<f64>();
    }
    assert!((volume / (0..d).map(|k| HI[k] - LO[k]).product::<f64>() - 1.0).abs() < 1e-12);
}

#[test]
fn cells_of_plotfiles_lie_where_they_say_and_covered_ones_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    for d in 1..=3 {
        for (is_double, is_little) in [(true, true), (true, false), (false, true), (false, false)] {
            for (ghosts, corner) in [(0, [0; 3]), (2, [-3, 5, 1])] {
                let path = folder.path().join("plt00100");
                Plot { ghosts, corner, is_double, is_little, ..plot(d) }.write(&path);
                for name in [path.clone(), path.join("Header")] {
                    let field = attempt(&name).unwrap();
                    check(&field, d);
                    assert_eq!((field.format, field.density.as_deref()), ("amrex", Some("density")));
                    assert_eq!(matches!(field.variables[0].values, Values::F64(_)), is_double);
                    assert_eq!(field.metadata, [("time".to_owned(), "1.5".to_owned())]);
                    assert!(field.variable("X(he4)").unwrap().values.to_f64().iter().all(|x| *x == 0.25));
                    assert!(field.notes[0].contains("cells of level 2"), "{:?}", field.notes);
                }
            }
        }
    }
}

#[test]
fn parts_of_cells_that_remain_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plt");
    plot(3).write(&path);
    let field = attempt(&path).unwrap();
    let cells: Vec<u64> = refined(&field).levels().iter().map(|[_, cells]| *cells).collect();
    // By hand: 8 x 12 x 6 less 2 x 6 x 4 and 2 x 3 x 3; 4 x 12 x 8 and 4 x 6 x 6 less 2 x 2 x 2; 8^3.
    assert_eq!(cells, [576 - 48 - 18, 384 + 144 - 8, 512]);
    // All of level 0 covered.
    let mut own = plot(3);
    own.levels[1] = vec![[[0, 0, 0], [15, 23, 11]]];
    own.write(&path);
    let field = attempt(&path).unwrap();
    check(&field, 3);
    assert!(field.notes.iter().any(|n| n.contains("no cell of level 0")), "{:?}", field.notes);
    // One variable alone.
    let request = FieldRequest { density: Some("X(he4)".into()), carry: Some(vec![]), ..FieldRequest::default() };
    let FileContent::Field(field) = read(FORMATS, &path, None, &request).unwrap() else { panic!() };
    assert_eq!(field.variables.iter().map(|v| v.name.as_str()).collect::<Vec<_>>(), ["X(he4)"]);
}

#[test]
fn all_files_of_a_folder_are_known() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plt");
    Plot { job: Some(CASTRO), ..plot(1) }.write(&path);
    let names = |path: &Path| -> Vec<String> {
        let files = files_of(path).unwrap();
        files.iter().map(|f| f.strip_prefix(folder.path()).unwrap().display().to_string()).collect()
    };
    let all = names(&path);
    assert_eq!(all[..3], ["plt/Header", "plt/Level_0/Cell_D_00000", "plt/Level_0/Cell_D_00001"]);
    assert_eq!((all.len(), all[10].as_str()), (11, "plt/job_info"));
    assert_eq!(names(&path.join("Header")), all);
    assert_eq!(names(&path.join("job_info")), ["plt/job_info"]);
    assert_eq!(names(folder.path()), [""]);
}

const CASTRO: &str = "=====\n Castro Job Information\n=====\n\n Grid Information\n   -x: interior\n   +x: interior\n\n\
   -y: outflow\n   +y: symmetry\n\n   -z: interior\n   +z: outflow\n";

#[test]
fn what_codes_say_of_their_run_is_heeded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plt");
    Plot { job: Some(CASTRO), ..plot(3) }.write(&path);
    let field = attempt(&path).unwrap();
    assert_eq!(refined(&field).axes.iter().map(|a| a.is_periodic).collect::<Vec<_>>(), [true, false, false]);
    assert_eq!(refined(&field).unit.as_ref().map(|u| u.to_cgs), Some(1.0));
    let density = field.variable("density").unwrap().unit.clone();
    assert_eq!(density.map(|u| u.dimension), Some(UnitDimension::mass_density(3)));
    Plot { job: Some(" Nyx Job Information\n"), ..plot(3) }.write(&path);
    let field = attempt(&path).unwrap();
    assert!(refined(&field).unit.is_none() && field.variables.iter().all(|v| v.unit.is_none()));
    // The densities of WarpX are none of mass.
    fs::write(path.join("WarpXHeader"), "1\n").unwrap();
    let field = attempt(&path).unwrap();
    assert!(field.density.is_none() && field.notes.iter().any(|n| n.contains("WarpX")));
}

#[test]
fn what_does_not_fit_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plt");
    let refused = |change: &dyn Fn(&mut Plot)| {
        let mut own = plot(3);
        change(&mut own);
        own.write(&path);
        refusal(&path)
    };
    let text = refused(&|p| p.levels[0].truncate(1));
    assert!(text.contains("are missing"), "{text}");
    let text = refused(&|p| p.levels[0][1][0][0] = 3);
    assert!(text.contains("block 0 of level 0") && text.contains("overlaps block 1"), "{text}");
    let text = refused(&|p| p.levels[1][1][1][0] = 12);
    assert!(text.contains("patch 1 of level 1") && text.contains("end within a cell"), "{text}");
    let text = refused(&|p| p.levels[0][1][1][2] = 6);
    assert!(text.contains("patch 1 of level 0") && text.contains("outside"), "{text}");
    // A patch of level 2 that no patch of level 1 surrounds.
    let text = refused(&|p| p.levels[2] = vec![[[0, 0, 0], [7, 7, 7]]]);
    assert!(text.contains("overlaps"), "{text}");

    let in_file = |name: &str, from: &str, to: &str| {
        plot(3).write(&path);
        let text = fs::read_to_string(path.join(name)).unwrap();
        assert!(text.contains(from), "{text}");
        fs::write(path.join(name), text.replacen(from, to, 1)).unwrap();
        refusal(&path)
    };
    assert!(in_file("Header", "\n0\n0\n0 2", "\n1\n0\n0 2").contains("cylindrical coordinates"));
    assert!(in_file("Header", "\n3\n1.5", "\n4\n1.5").contains("number of dimensions"));
    assert!(in_file("Header", "((0,0,0) (15,23,11)", "((0,0,0) (15,23,12)").contains("box of level 1"));
    assert!(in_file("Header", "Level_1/Cell", "../Level_1/Cell").contains("within the folder"));
    assert!(in_file("Header", "1.5\n2\n", "1.5\n900\n").contains("the finest level"));
    assert!(in_file("Header", "HyperCLaw-V1.1\n3\n", "HyperCLaw-V1.1\n99999999999\n").contains("line 2"));
    assert!(in_file("Level_0/Cell_H", "1\n1\n3\n", "3\n1\n3\n").contains("version 3"));
    assert!(in_file("Level_0/Cell_H", "1\n1\n3\n", "1\n1\n2\n").contains("level 0"));
    assert!(in_file("Level_0/Cell_H", "(2 0", "(4000000000 0").contains("number of patches"));
    assert!(in_file("Level_0/Cell_H", "Cell_D_00000 0", "Cell_D_00000 1").contains("does not begin with FAB"));
    assert!(in_file("Level_0/Cell_H", "Cell_D_00000 0", "Cell_D_00009 0").contains("Cell_D_00009"));
    // The same patch twice in the file of values.
    let text = in_file("Level_0/Cell_H", "FabOnDisk: Cell_D_00001 0", "FabOnDisk: Cell_D_00000 0");
    assert!(text.contains("patch 1 at byte 0") && text.contains("expected 3 in [4, 0, 0]"), "{text}");
    // A folder of something else.
    fs::remove_file(path.join("Header")).unwrap();
    assert!(refusal(&path).contains("it is a directory"), "{}", refusal(&path));
}

#[test]
fn truncated_and_damaged_files_are_refused_or_read_but_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plt");
    let own = plot(2);
    for name in ["Header", "Level_1/Cell_H", "Level_0/Cell_D_00000", "Level_2/Cell_D_00001"] {
        own.write(&path);
        let file = path.join(name);
        let whole = fs::read(&file).unwrap();
        for n in 1..=20 {
            replace(&file, &whole[..whole.len() * (20 - n) / 20]);
            let cut = attempt(&path);
            // The end of Cell_H, least and largest values, is not needed.
            assert!(cut.is_err() || name.ends_with("Cell_H") && n < 12, "{name} to {n}/20");
        }
        let mut refused = 0;
        for n in 0..600 {
            let mut bytes = whole.clone();
            let at = n * 7919 % bytes.len();
            bytes[at] ^= 1 << (n % 7);
            replace(&file, &bytes);
            refused += usize::from(attempt(&path).is_err());
        }
        // Of files of values only their first lines can be wrong.
        assert!(refused > if name.contains("Cell_D") { 0 } else { 150 }, "{name}: {refused} of 600 refused");
    }
}
