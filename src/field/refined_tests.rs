//! Fields of cells of several sizes against closed forms.

use super::*;
use crate::field::testing::Random;
use crate::field::{FieldOptions, Missing, Source, from_raw, total_mass};
use sph_formats::{Geometry, Location, RawField, RefinedAxis, RefinedBlock, Unit, Variable};

const NAMES: [&str; 3] = ["x", "y", "z"];
/// Ends of the box along each axis.
const LO: [f64; 3] = [-1.0, 2.0, -0.5];
const HI: [f64; 3] = [2.0, 3.0, 1.5];
/// Blocks of level 0, and cells of a block, along each axis: all of them different.
const ROOTS: [u64; 3] = [3, 1, 2];
const CELLS: [u64; 3] = [4, 2, 3];

/// A tree of blocks in `d` dimensions: those of which `divides` says so of a level and corners become 2^d of the next.
fn tree(d: usize, depth: u8, divides: &dyn Fn(u8, [f64; 3], [f64; 3]) -> bool) -> RefinedGrid {
    let cut = |v: [u64; 3]| sph::array(|k| if k < d { v[k] } else { 1 });
    let (roots, cells): ([u64; 3], [u64; 3]) = (cut(ROOTS), cut(CELLS));
    let mut blocks = Vec::new();
    let all: u64 = roots.iter().product();
    let mut open: Vec<(u8, [u64; 3])> =
        (0..all).map(|i| (0, [i % roots[0], i / roots[0] % roots[1], i / roots[0] / roots[1]])).collect();
    while let Some((level, place)) = open.pop() {
        let corner = |shift: u64| -> [f64; 3] {
            sph::array(|k| LO[k] + (HI[k] - LO[k]) * (place[k] + shift) as f64 / (roots[k] << level) as f64)
        };
        if level < depth && divides(level, corner(0), corner(1)) {
            for child in 0..1_u64 << d {
                open.push((level + 1, sph::array(|k| if k < d { 2 * place[k] + (child >> k & 1) } else { 0 })));
            }
        } else {
            let first = sph::array(|k| place[k] * if k < d { cells[k] } else { 0 });
            blocks.push(RefinedBlock { number: blocks.len(), level, first, cells });
        }
    }
    let axis = |k: usize| RefinedAxis {
        name: NAMES[k].into(),
        lo: LO[k],
        hi: HI[k],
        cells: roots[k] * cells[k],
        is_periodic: false,
    };
    let ratios = (0..=depth).map(|l| 1 << l).collect();
    RefinedGrid { axes: (0..d).map(axis).collect(), unit: None, ratios, blocks }
}

/// Blocks that reach the place where all coordinates are 0.3 of the box are divided.
fn toward_a_point(d: usize, depth: u8) -> RefinedGrid {
    tree(d, depth, &|_, a, b| (0..d).all(|k| (a[k]..=b[k]).contains(&(LO[k] + 0.3 * (HI[k] - LO[k])))))
}

/// Corners of each cell, in the order of values.
fn cells(grid: &RefinedGrid) -> Vec<[[f64; 3]; 2]> {
    let corners = |i: usize| {
        let (block, at) = grid.place(i).unwrap();
        let face = |k: usize, shift: u64| match k < grid.dimension() {
            true => grid.face(k, block.level, block.first[k] + at[k] + shift),
            false => shift as f64,
        };
        [sph::array(|k| face(k, 0)), sph::array(|k| face(k, 1))]
    };
    (0..grid.cell_count()).map(corners).collect()
}

fn volume([a, b]: &[[f64; 3]; 2]) -> f64 {
    (0..3).map(|k| b[k] - a[k]).product()
}

fn middle([a, b]: &[[f64; 3]; 2]) -> [f64; 3] {
    sph::array(|k| 0.5 * (a[k] + b[k]))
}

fn variable(name: &str, components: usize, values: Vec<f64>) -> Variable {
    let unit = None::<Unit>;
    let values = Values::F64(values);
    Variable { name: name.into(), description: None, unit, location: Location::Cell, components, values }
}

fn raw(grid: RefinedGrid, variables: Vec<Variable>) -> RawField {
    RawField {
        path: "test".into(),
        format: "test",
        geometry: Geometry::Refined(grid),
        density: Some(variables[0].name.clone()),
        variables,
        metadata: vec![],
        notes: vec![],
    }
}

fn source<const D: usize>(grid: RefinedGrid, variables: Vec<Variable>, options: &FieldOptions<D>) -> Source<D> {
    from_raw(raw(grid, variables), options).unwrap()
}

fn constant<const D: usize>() -> FieldOptions<D> {
    FieldOptions { interpolation: Some(Interpolation::Constant), ..FieldOptions::default() }
}

fn linear<const D: usize>() -> FieldOptions<D> {
    FieldOptions { interpolation: Some(Interpolation::Linear), ..FieldOptions::default() }
}

/// 1 + x + 2 y + 3 z from the lower corner of the box.
fn slanted(d: usize, x: [f64; 3]) -> f64 {
    1.0 + (0..d).map(|k| (k as f64 + 1.0) * (x[k] - LO[k])).sum::<f64>()
}

fn masses_are_exact<const D: usize>() {
    let grid = toward_a_point(D, 4);
    let all = cells(&grid);
    let rho: Vec<f64> = all.iter().map(|c| slanted(D, middle(c))).collect();
    // Means over cells of a linear function are its values in the middle, so that all mass is that of the function.
    let center: [f64; 3] = sph::array(|k| 0.5 * (LO[k] + HI[k]));
    let expected = slanted(D, center) * (0..D).map(|k| HI[k] - LO[k]).product::<f64>();
    // A box about the place of the smallest cells that cuts those of several levels, by cells alone.
    let at = |share: f64| -> [f64; D] { sph::array(|k| LO[k] + share * (HI[k] - LO[k])) };
    let (lo, hi) = (at(0.2031), at(0.3213));
    let part = Domain::new(lo, hi, [Axis::OPEN; D], Region::Box).unwrap();
    let share =
        |c: &[[f64; 3]; 2]| -> f64 { (0..D).map(|k| (c[1][k].min(hi[k]) - c[0][k].max(lo[k])).max(0.0)).product() };
    let of_part: f64 = all.iter().zip(&rho).map(|(c, rho)| rho * share(c)).sum();
    for options in [constant::<D>(), linear::<D>()] {
        let source = source::<D>(grid.clone(), vec![variable("rho", 1, rho.clone())], &options);
        // Sums of some thousand terms of one sign, to their rounding.
        assert!((source.mass.unwrap().value / expected - 1.0).abs() < 1e-13, "{D}: {:?} {expected}", source.mass);
        let cut = total_mass(source.density.as_ref(), &part, 1e-9).unwrap().value;
        if options.interpolation == Some(Interpolation::Constant) {
            assert!((cut / of_part - 1.0).abs() < 1e-13, "{D}: {cut} {of_part}");
        } else {
            // All slopes of the function are met, also beside larger and smaller cells: cells at the ends of the box are not cut.
            let middle: [f64; 3] = sph::array(|k| if k < D { 0.5 * (lo[k] + hi[k]) } else { 0.0 });
            let exact = slanted(D, middle) * part.volume();
            assert!((cut / exact - 1.0).abs() < 1e-12, "{D}: {cut} {of_part} {exact}");
        }
    }
}

#[test]
fn all_mass_and_that_of_parts_is_exact_in_every_dimension() {
    masses_are_exact::<1>();
    masses_are_exact::<2>();
    masses_are_exact::<3>();
}

fn cells_keep_their_mass<const D: usize>() {
    // Steep, with empty cells and zeros beside.
    let grid = toward_a_point(D, 3);
    let all = cells(&grid);
    let mut random = Random::new(5);
    let rho: Vec<f64> = all.iter().map(|_| random.unit().powi(6) * f64::from(u8::from(random.unit() > 0.2))).collect();
    let source = source::<D>(grid, vec![variable("rho", 1, rho.clone())], &linear());
    for (cell, rho) in all.iter().zip(&rho) {
        // Gauss's rule of two points is exact for a linear function; no point is negative.
        let inset = 0.5 - 0.5 / 3.0_f64.sqrt();
        let mut mean = 0.0;
        for corner in 0..1 << D {
            let x: [f64; D] = sph::array(|k| {
                let [a, b] = [cell[0][k], cell[1][k]];
                a + (b - a) * if corner >> k & 1 == 1 { 1.0 - inset } else { inset }
            });
            let value = source.density.value(&x);
            assert!(value >= 0.0);
            mean += value / f64::from(1 << D);
        }
        assert!((mean - rho).abs() < 1e-14, "{D}: {mean} {rho}");
        // At the corners too, which is why the density need not be cut off at zero.
        let corner: [f64; D] = sph::array(|k| cell[0][k] + 1e-9 * (cell[1][k] - cell[0][k]));
        assert!(source.density.value(&corner) >= 0.0);
    }
}

#[test]
fn linear_reconstruction_keeps_the_mass_of_every_cell_and_is_never_negative() {
    cells_keep_their_mass::<1>();
    cells_keep_their_mass::<2>();
    cells_keep_their_mass::<3>();
}

#[test]
fn places_lead_to_their_cells() {
    let grid = toward_a_point(3, 5);
    let all = cells(&grid);
    let numbers: Vec<f64> = (0..all.len()).map(|i| 1.0 + i as f64).collect();
    let velocity: Vec<f64> = all.iter().flat_map(middle).collect();
    let variables = vec![variable("rho", 1, numbers), variable("Velocities", 3, velocity)];
    let source = source::<3>(grid, variables, &constant::<3>());
    let mut random = Random::new(11);
    for _ in 0..2000 {
        // More of them where cells are small.
        let scale = random.unit().powi(3);
        let x: [f64; 3] = sph::array(|k| LO[k] + (HI[k] - LO[k]) * (0.3 + (random.unit() - 0.3) * scale));
        let i = source.density.value(&x) as usize - 1;
        let [a, b] = all[i];
        assert!((0..3).all(|k| a[k] <= x[k] && x[k] <= b[k]), "{x:?} in {a:?} {b:?}");
        let mut v = [0.0; 3];
        source.carried[0].evaluate(&x, &mut v);
        assert_eq!(v, middle(&all[i]));
    }
    // All faces, and the ends of the box, belong to some cell; beyond there is nothing, and what is carried comes from the nearest.
    for [a, b] in &all {
        assert!(source.density.value(a) > 0.0 && source.density.value(b) > 0.0);
    }
    assert_eq!(source.density.value(&[HI[0] + 0.1, HI[1], HI[2]]), 0.0);
    let mut v = [0.0; 3];
    source.carried[0].evaluate(&[99.0, HI[1], HI[2]], &mut v);
    assert!(v[0] > HI[0] - 0.3 && v[0] < HI[0], "{v:?}");
}

#[test]
fn blocks_of_one_level_are_a_uniform_grid() {
    use sph_formats::{Coordinates, GridAxis};
    let grid = tree(3, 0, &|_, _, _| false);
    let all = cells(&grid);
    // The same cells as a grid has them: x fastest.
    let axis = |k: usize| {
        let n = ROOTS[k] * CELLS[k];
        let faces: Vec<f64> = (0..=n).map(|i| LO[k] + (HI[k] - LO[k]) * (i as f64 / n as f64)).collect();
        let nodes = faces.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
        GridAxis { name: NAMES[k].into(), nodes, unit: None, bounds: Some(faces) }
    };
    let axes: Vec<GridAxis> = (0..3).map(axis).collect();
    let f = |x: [f64; 3]| 5.0 + (3.0 * x[0]).sin() * x[1] + x[2];
    let mut uniform = Vec::new();
    for z in &axes[2].nodes {
        for y in &axes[1].nodes {
            uniform.extend(axes[0].nodes.iter().map(|x| f([*x, *y, *z])));
        }
    }
    let mut of_grid = raw(grid.clone(), vec![variable("rho", 1, uniform)]);
    of_grid.geometry = Geometry::Grid { coordinates: Coordinates::Cartesian, axes };
    of_grid.variables[0].location = Location::Node;
    let rho: Vec<f64> = all.iter().map(|c| f(middle(c))).collect();
    for interpolation in [None, Some(Interpolation::Linear), Some(Interpolation::Cubic)] {
        for period in [None, Some(Period::Auto)] {
            let options = FieldOptions { interpolation, periodic: [period; 3], ..FieldOptions::default() };
            let one = source::<3>(grid.clone(), vec![variable("rho", 1, rho.clone())], &options);
            let other = from_raw::<3>(of_grid.clone(), &options).unwrap();
            assert!((one.mass.unwrap().value / other.mass.unwrap().value - 1.0).abs() < 1e-14);
            let mut random = Random::new(3);
            for _ in 0..300 {
                let x = sph::array(|k| LO[k] - 0.1 + (HI[k] - LO[k] + 0.2) * random.unit());
                let (a, b) = (one.density.value(&x), other.density.value(&x));
                assert!((a - b).abs() < 1e-12, "{x:?}: {a} {b}");
            }
        }
    }
    // The sampler of several levels says the same of one.
    let periods = [None; 3];
    let sampler = Refined::<3>::new("rho", grid, periods, Some(Interpolation::Constant)).unwrap();
    let values = Values::F64(rho);
    let other = from_raw::<3>(of_grid, &constant::<3>()).unwrap();
    let domain = sampler.domain().unwrap();
    let mass = sampler.integral(&values, &domain).unwrap();
    assert!((mass.value / other.mass.unwrap().value - 1.0).abs() < 1e-14);
    let mut random = Random::new(8);
    for _ in 0..500 {
        let x = sph::array(|k| LO[k] + (HI[k] - LO[k]) * random.unit());
        let mut out = [0.0];
        assert!(sampler.sample(&values, 1, &x, Outside::Reject, &mut out));
        assert_eq!(out[0], other.density.value(&x));
    }
}

#[test]
fn boxes_repeat_where_the_file_or_the_scene_says_so() {
    let mut grid = toward_a_point(2, 2);
    let all = cells(&grid);
    // A wave of the box's length along x.
    let k = std::f64::consts::TAU / (HI[0] - LO[0]);
    let rho: Vec<f64> = all.iter().map(|c| 2.0 + (k * (middle(c)[0] - LO[0])).sin()).collect();
    let variables = || vec![variable("rho", 1, rho.clone())];
    let asked = FieldOptions { periodic: [Some(Period::Auto), None], ..linear::<2>() };
    let by_scene = source::<2>(grid.clone(), variables(), &asked);
    assert!(by_scene.notes.is_empty());
    grid.axes[0].is_periodic = true;
    let source = source::<2>(grid, variables(), &linear());
    assert_eq!(source.domain.axes, [Axis::Periodic, Axis::OPEN]);
    assert!(source.notes.iter().any(|n| n.contains("repeats along axis 'x'")), "{:?}", source.notes);
    let mut random = Random::new(17);
    for _ in 0..300 {
        let x: [f64; 2] = sph::array(|k| LO[k] + (HI[k] - LO[k]) * random.unit());
        let value = source.density.value(&x);
        assert_eq!(by_scene.density.value(&x), value);
        let beyond = source.density.value(&[x[0] + 2.0 * (HI[0] - LO[0]), x[1]]);
        // Off by the rounding of the place, where the slope is k at most.
        assert!((value - beyond).abs() < 1e-13, "{x:?}: {value} {beyond}");
    }
    // At the boundary the slope is that of the wave, not flat: the outermost cells are 0.25 wide.
    let [a, b] = [0.01, 0.2].map(|dx| source.density.value(&[LO[0] + dx, HI[1] - 0.01]));
    assert!(b > a + 0.1, "{a} {b}");
    // A shifted box holds all.
    let shifted =
        Domain::new([LO[0] + 0.77, LO[1]], [HI[0] + 0.77, HI[1]], [Axis::Periodic, Axis::OPEN], Region::Box).unwrap();
    let mass = source.density.integral(&shifted).unwrap().value;
    assert!((mass / source.mass.unwrap().value - 1.0).abs() < 1e-14);
}

#[test]
fn what_cannot_be_is_refused_with_its_place() {
    let grid = toward_a_point(2, 2);
    let n = grid.cell_count();
    let refused = |grid: &RefinedGrid, rho: Vec<f64>, options: &FieldOptions<2>| {
        from_raw::<2>(raw(grid.clone(), vec![variable("rho", 1, rho)]), options).map(drop).unwrap_err().to_string()
    };
    let plain = FieldOptions::default();
    let mut rho = vec![1.0; n];
    rho[9] = -1.0;
    let text = refused(&grid, rho.clone(), &plain);
    assert!(text.contains("cell (1, 0) of block 1 of level 0, position"), "{text}");
    rho[9] = f64::NAN;
    assert!(refused(&grid, rho.clone(), &plain).contains("not finite"));
    let zero = FieldOptions { missing: Missing::Zero, ..FieldOptions::default() };
    assert!(from_raw::<2>(raw(grid.clone(), vec![variable("rho", 1, rho)]), &zero).is_ok());
    let cubic = FieldOptions { interpolation: Some(Interpolation::Cubic), ..FieldOptions::default() };
    let text = refused(&grid, vec![1.0; n], &cubic);
    assert!(text.contains("input.interpolation") && text.contains("linear"), "{text}");
    let period = FieldOptions { periodic: [Some(Period::Length(1.0)), None], ..FieldOptions::default() };
    assert!(refused(&grid, vec![1.0; n], &period).contains("axis 'x'"));
    let mut broken = grid.clone();
    broken.blocks.pop();
    let left = broken.cell_count();
    assert!(refused(&broken, vec![1.0; left], &plain).contains("are missing"));
    let text = from_raw::<3>(raw(grid, vec![variable("rho", 1, vec![1.0; n])]), &FieldOptions::default());
    assert!(text.map(drop).unwrap_err().to_string().contains("the refined grid has 2 dimension(s)"));
}

#[test]
fn extreme_densities_keep_their_mass() {
    let grid = toward_a_point(3, 2);
    for scale in [1e-300, 1e300] {
        let rho: Vec<f64> = cells(&grid).iter().map(|c| scale * (1.0 + volume(c))).collect();
        let expected: f64 = cells(&grid).iter().map(|c| (1.0 + volume(c)) * volume(c)).sum();
        let source = source::<3>(grid.clone(), vec![variable("rho", 1, rho)], &FieldOptions::default());
        assert!((source.mass.unwrap().value / scale / expected - 1.0).abs() < 1e-13);
    }
}
