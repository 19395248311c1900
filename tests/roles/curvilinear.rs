//! Grids of Athena++, PLUTO, NetCDF and NumPy on coordinates of a sphere or a cylinder: masses against closed forms, and vectors in space.
//!
//! The cloud is v = H x + W e_z x x, B = b e_z + t e_z x x, rho = 3 - |x|^2 / 2; files have the values in the middles of cells,
//! which for the mass is an error of second order in their size.

use crate::grids::{archive, npy};
use rust_hdf5::H5File;
use sph_formats::ParticleFile;
use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use sph_formats::common::particle_names as columns;
use sph_prep::relaxation::Control;
use sph_prep::{FORMATS, Report, Scene, place};
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::Path;

const EXPANSION: f64 = 0.5;
const ROTATION: f64 = 2.0;
const ALONG: f64 = 4.0;
const AROUND: f64 = -3.0;

#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    Spherical,
    Polar,
    Cylindrical,
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Code {
    Athena,
    Pluto,
    Netcdf,
    Numpy,
}

/// Names of the axes, and of the components along them.
type Names = ([&'static str; 3], [&'static str; 3], [&'static str; 3]);

/// Faces of the cells along the axes, in the order of the file.
struct Mesh {
    kind: Kind,
    faces: [Vec<f64>; 3],
}

fn even(n: usize, lo: f64, hi: f64) -> Vec<f64> {
    (0..=n).map(|i| lo + (hi - lo) * i as f64 / n as f64).collect()
}

impl Mesh {
    fn counts(&self) -> [usize; 3] {
        std::array::from_fn(|k| self.faces[k].len() - 1)
    }

    /// Place, and directions of the axes, of coordinates.
    fn frame(&self, u: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        let [a, b, c] = u;
        let around = |phi: f64| [-phi.sin(), phi.cos(), 0.0];
        match self.kind {
            Kind::Spherical => {
                let (st, ct, sp, cp) = (b.sin(), b.cos(), c.sin(), c.cos());
                let out = [st * cp, st * sp, ct];
                (out.map(|x| a * x), [out, [ct * cp, ct * sp, -st], around(c)])
            }
            Kind::Polar => ([a * b.cos(), a * b.sin(), c], [[b.cos(), b.sin(), 0.0], around(b), [0.0, 0.0, 1.0]]),
            Kind::Cylindrical => ([a * c.cos(), a * c.sin(), b], [[c.cos(), c.sin(), 0.0], [0.0, 0.0, 1.0], around(c)]),
        }
    }

    /// Values in the middles of cells, the first coordinate fastest.
    fn values(&self, f: &dyn Fn([f64; 3], [[f64; 3]; 3]) -> f64) -> Vec<f64> {
        let middle: [Vec<f64>; 3] =
            std::array::from_fn(|k| self.faces[k].windows(2).map(|w| 0.5 * (w[0] + w[1])).collect());
        let mut all = Vec::new();
        for &w in &middle[2] {
            for &v in &middle[1] {
                for &u in &middle[0] {
                    let (x, directions) = self.frame([u, v, w]);
                    all.push(f(x, directions));
                }
            }
        }
        all
    }

    fn variables(&self, velocity: [&'static str; 3], field: [&'static str; 3]) -> Vec<(&'static str, Vec<f64>)> {
        let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
        let mut all = vec![("rho", self.values(&|x, _| 3.0 - 0.5 * dot(x, x)))];
        for k in 0..3 {
            all.push((velocity[k], self.values(&|x, e| dot(motion(x), e[k]))));
            all.push((field[k], self.values(&|x, e| dot(magnetic(x), e[k]))));
        }
        all
    }

    fn write(&self, code: Code, folder: &Path) -> String {
        match code {
            Code::Athena => self.athena(&folder.join("cloud.athdf")),
            Code::Pluto => self.pluto(folder),
            Code::Netcdf => self.netcdf(&folder.join("cloud.nc")),
            Code::Numpy => self.numpy(&folder.join("cloud.npz")),
        }
    }

    fn names(&self) -> Names {
        let (x, v, b) =
            (["r", "theta", "phi", "z"], ["v_r", "v_theta", "v_phi", "v_z"], ["B_r", "B_theta", "B_phi", "B_z"]);
        let places = match self.kind {
            Kind::Spherical => [0, 1, 2],
            Kind::Polar => [0, 2, 3],
            Kind::Cylindrical => [0, 3, 2],
        };
        let mut names = [x, v, b].map(|all| places.map(|k| all[k]));
        if self.kind != Kind::Spherical {
            (names[0][0], names[1][0], names[2][0]) = ("R", "v_rcyl", "B_rcyl");
        }
        (names[0], names[1], names[2])
    }

    /// Axes of a single cell are left out; the others have CF bounds, and angles degrees.
    fn netcdf(&self, path: &Path) -> String {
        let (axes, velocity, field) = self.names();
        let mut file = ClassicFile::new();
        let counts = self.counts();
        let turned: [Vec<f64>; 3] = std::array::from_fn(|k| {
            let degrees = if ["theta", "phi"].contains(&axes[k]) { 180.0 / PI } else { 1.0 };
            self.faces[k].iter().map(|face| degrees * face).collect()
        });
        let middles = turned.each_ref().map(|f| f.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect::<Vec<f64>>());
        let pairs = turned.each_ref().map(|f| f.windows(2).flat_map(|w| [w[0], w[1]]).collect::<Vec<f64>>());
        let names = axes.map(|name| format!("{name}_bounds"));
        let two = file.dimension("two", 2);
        let mut order = Vec::new();
        for k in (0..3).filter(|&k| counts[k] > 1) {
            let own = file.dimension(axes[k], counts[k]);
            let units = if ["theta", "phi"].contains(&axes[k]) { "degrees" } else { "cm" };
            let attributes = [("bounds", names[k].as_str().into()), ("units", units.into())];
            file.variable(&names[k], &[own, two], Data::F64(&pairs[k]), &[]);
            file.variable(axes[k], &[own], Data::F64(&middles[k]), &attributes);
            order.insert(0, own);
        }
        let variables = self.variables(velocity, field);
        for (name, values) in &variables {
            file.variable(name, &order, Data::F64(values), &[]);
        }
        file.write(path).unwrap();
        path.display().to_string()
    }

    /// Axes are the faces of cells; those of a single cell are left out.
    fn numpy(&self, path: &Path) -> String {
        let (axes, velocity, field) = self.names();
        let counts = self.counts();
        let kept: Vec<usize> = (0..3).filter(|&k| counts[k] > 1).collect();
        let line = |k: &usize| (axes[*k], npy(&format!("({},)", counts[*k] + 1), &self.faces[*k]));
        let shape = kept.iter().map(|k| format!("{}, ", counts[*k])).collect::<String>();
        let variables = self.variables(velocity, field);
        let arrays = variables.iter().map(|(name, values)| (*name, npy(&format!("({shape})"), values)));
        archive(path, kept.iter().map(line).chain(arrays));
        path.display().to_string()
    }

    /// Two blocks along x1.
    fn athena(&self, path: &Path) -> String {
        let file = H5File::create(path).unwrap();
        let root = file.root_group();
        let [nx, ny, nz] = self.counts();
        let half = nx / 2;
        let sizes = |n: [usize; 3]| n.map(|n| n as i32);
        root.set_attr_string(
            "Coordinates",
            if self.kind == Kind::Spherical { "spherical_polar" } else { "cylindrical" },
        )
        .unwrap();
        root.set_attr_array_numeric("RootGridSize", &sizes([nx, ny, nz])).unwrap();
        root.set_attr_array_numeric("MeshBlockSize", &sizes([half, ny, nz])).unwrap();
        root.set_attr_numeric("NumMeshBlocks", &2_i32).unwrap();
        root.set_attr_numeric("MaxLevel", &0_i32).unwrap();
        let variables = self.variables(["vel1", "vel2", "vel3"], ["Bcc1", "Bcc2", "Bcc3"]);
        root.set_attr_string_array("DatasetNames", &["prim"]).unwrap();
        root.set_attr_array_numeric("NumVariables", &[variables.len() as i32]).unwrap();
        root.set_attr_string_array("VariableNames", &variables.iter().map(|v| v.0).collect::<Vec<_>>()).unwrap();
        let places = file.new_dataset::<i64>().shape([2, 3]).create("LogicalLocations").unwrap();
        places.write_raw(&[0_i64, 0, 0, 1, 0, 0]).unwrap();
        for (k, faces) in self.faces.iter().enumerate() {
            let n = [half, ny, nz][k];
            let start = |b: usize| if k == 0 { b * half } else { 0 };
            // In single precision, as the code writes them: pi comes out larger than it is.
            let rows: Vec<f32> =
                (0..2).flat_map(|b| faces[start(b)..=start(b) + n].iter().map(|x| *x as f32)).collect();
            let set = file.new_dataset::<f32>().shape([2, n + 1]).create(&format!("x{}f", k + 1)).unwrap();
            set.write_raw(&rows).unwrap();
        }
        let mut all: Vec<f64> = Vec::new();
        for (_, values) in &variables {
            for b in 0..2 {
                all.extend(values.chunks(nx).flat_map(|row| &row[b * half..(b + 1) * half]));
            }
        }
        let shape = [variables.len(), 2, nz, ny, half];
        file.new_dataset::<f64>().shape(shape).create("prim").unwrap().write_raw(&all).unwrap();
        file.close().unwrap();
        path.display().to_string()
    }

    fn pluto(&self, folder: &Path) -> String {
        let counts = self.counts();
        let rank = counts.iter().filter(|n| **n > 1).count();
        let name = format!("{:?}", self.kind).to_uppercase();
        let mut text =
            format!("# ****\n# PLUTO 4.4-patch2 Grid File\n# DIMENSIONS: {rank}\n# GEOMETRY:   {name}\n# ****\n");
        for faces in &self.faces {
            writeln!(text, "{} ", faces.len() - 1).unwrap();
            for (i, w) in faces.windows(2).enumerate() {
                writeln!(text, " {}   {:18.12e}    {:18.12e}", i + 1, w[0], w[1]).unwrap();
            }
        }
        std::fs::write(folder.join("grid.out"), text).unwrap();
        let path = folder.join("data.0000.dbl.h5");
        let file = H5File::create(&path).unwrap();
        let step = file.create_group("Timestep_0").unwrap();
        step.set_attr_numeric("Time", &0.0_f64).unwrap();
        let vars = step.create_group("vars").unwrap();
        let shape: Vec<usize> = counts[..rank].iter().rev().copied().collect();
        for (name, values) in self.variables(["vx1", "vx2", "vx3"], ["Bx1", "Bx2", "Bx3"]) {
            vars.new_dataset::<f64>().shape(&shape).create(name).unwrap().write_raw(&values).unwrap();
        }
        let nodes = file.create_group("node_coords").unwrap();
        let corners: Vec<usize> = shape.iter().map(|n| n + 1).collect();
        for (k, name) in ["X", "Y", "Z"].iter().enumerate().take(rank) {
            let at = |flat: usize| {
                let mut rest = flat;
                let mut u = [0.0; 3];
                for axis in 0..rank {
                    u[axis] = self.faces[axis][rest % (counts[axis] + 1)];
                    rest /= counts[axis] + 1;
                }
                match (self.kind, rank) {
                    // The half-plane of a meridian is x and y.
                    (Kind::Spherical, 2) => [u[0] * u[1].sin(), u[0] * u[1].cos(), 0.0][k],
                    (Kind::Cylindrical, _) => u[k],
                    _ => self.frame(u).0[k],
                }
            };
            let all: Vec<f32> = (0..corners.iter().product()).map(|flat| at(flat) as f32).collect();
            nodes.new_dataset::<f32>().shape(&corners).create(name).unwrap().write_raw(&all).unwrap();
        }
        file.close().unwrap();
        path.display().to_string()
    }
}

fn motion(x: [f64; 3]) -> [f64; 3] {
    [EXPANSION * x[0] - ROTATION * x[1], EXPANSION * x[1] + ROTATION * x[0], EXPANSION * x[2]]
}

fn magnetic(x: [f64; 3]) -> [f64; 3] {
    [-AROUND * x[1], AROUND * x[0], ALONG]
}

fn run(file: &str, more: &str) -> (ParticleFile, Report) {
    let scene =
        format!("input: {{file: '{file}', density: rho{more}}}\nparticles: 300\npolish: none\nwvt: {{iterations: 0}}");
    place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{file}: {e}"))
}

/// Integral of rho over radii a to b, colatitudes to c and d, a part of the circle.
fn sphere([a, b]: [f64; 2], [c, d]: [f64; 2], turn: f64) -> f64 {
    let power = |n: i32| (b.powi(n) - a.powi(n)) / f64::from(n);
    turn * (c.cos() - d.cos()) * (3.0 * power(3) - 0.5 * power(5))
}

fn cylinder([a, b]: [f64; 2], [low, high]: [f64; 2], turn: f64) -> f64 {
    let power = |n: i32| (b.powi(n) - a.powi(n)) / f64::from(n);
    let cubes = (high.powi(3) - low.powi(3)) / 3.0;
    turn * ((3.0 * power(2) - 0.5 * power(4)) * (high - low) - 0.5 * power(2) * cubes)
}

fn disc([a, b]: [f64; 2], turn: f64) -> f64 {
    let power = |n: i32| (b.powi(n) - a.powi(n)) / f64::from(n);
    turn * (3.0 * power(2) - 0.5 * power(4))
}

struct Case {
    code: Code,
    kind: Kind,
    /// Numbers of cells, and ends, along the axes.
    axes: [(usize, f64, f64); 3],
    mass: f64,
}

fn cases() -> Vec<Case> {
    use Code::{Athena, Netcdf, Numpy, Pluto};
    use Kind::{Cylindrical, Polar, Spherical};
    let one = (1, 0.0, 1.0);
    let plane = (1, -0.5, 0.5);
    let mut all = Vec::new();
    for code in [Athena, Pluto, Netcdf, Numpy] {
        for (kind, axes, mass) in [
            (Spherical, [(12, 0.2, 1.5), (16, 0.0, PI), (16, 0.0, TAU)], sphere([0.2, 1.5], [0.0, PI], TAU)),
            (Spherical, [(12, 0.0, 1.5), (16, 0.0, PI), one], sphere([0.0, 1.5], [0.0, PI], TAU)),
            // A flaring disc, and a quarter of it.
            (Spherical, [(12, 0.5, 1.5), (16, 1.2, PI - 1.2), one], sphere([0.5, 1.5], [1.2, PI - 1.2], TAU)),
            (
                Spherical,
                [(12, 0.5, 1.5), (16, 1.0, PI - 1.0), (16, 0.25 * PI, 0.75 * PI)],
                sphere([0.5, 1.5], [1.0, PI - 1.0], 0.5 * PI),
            ),
            (Polar, [(12, 0.2, 1.5), (16, -PI, PI), (10, -1.0, 0.5)], cylinder([0.2, 1.5], [-1.0, 0.5], TAU)),
            (Polar, [(12, 0.0, 1.5), (16, 0.0, TAU), plane], disc([0.0, 1.5], TAU)),
            (Polar, [(12, 0.4, 1.5), (16, 0.5 * PI, PI), plane], disc([0.4, 1.5], 0.5 * PI)),
            (Cylindrical, [(12, 0.0, 1.5), (10, -1.0, 0.5), one], cylinder([0.0, 1.5], [-1.0, 0.5], TAU)),
        ] {
            // Athena++ has its axes as PLUTO's POLAR.
            if (code, kind) != (Athena, Cylindrical) {
                all.push(Case { code, kind, axes, mass });
            }
        }
    }
    all
}

impl Case {
    fn mesh(&self, finer: usize) -> Mesh {
        let faces = self.axes.map(|(n, lo, hi)| even(if n > 1 { finer * n } else { 1 }, lo, hi));
        Mesh { kind: self.kind, faces }
    }
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn masses_are_those_of_the_closed_forms() {
    let folder = tempfile::tempdir().unwrap();
    for case in cases() {
        let label = format!("{:?} {:?} {:?}", case.code, case.kind, case.axes);
        let error = |finer: usize, more: &str| {
            let (_, report) = run(&case.mesh(finer).write(case.code, folder.path()), more);
            // In a plane, components along z have no column; numbers have no units beside those of some axes.
            let is_meant = |w: &String| {
                w.contains("is named like") && w.contains("out of the 2-D space") || w.contains("no unit is used")
            };
            assert!(report.warnings.iter().all(is_meant), "{label}: {:?}", report.warnings);
            report.mass.total / case.mass - 1.0
        };
        // Middles instead of averages: of second order in the cells.
        let (coarse, fine) = (error(1, ""), error(3, ""));
        assert!(coarse.abs() < 5e-3, "{label}: {coarse:e}");
        assert!(fine.abs() < 6e-4 && fine.abs() < coarse.abs() / 7.0, "{label}: {coarse:e}, {fine:e}");
        let linear = error(3, ", interpolation: linear");
        assert!(linear.abs() < 6e-3, "{label}: {linear:e}");
    }
}

#[test]
fn vectors_point_where_they_should() {
    // Of each code and each shape, some.
    vectors_point(cases().into_iter().step_by(3).collect());
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn vectors_point_where_they_should_in_all_cases() {
    vectors_point(cases());
}

fn vectors_point(cases: Vec<Case>) {
    let folder = tempfile::tempdir().unwrap();
    for case in cases {
        let mesh = case.mesh(2);
        let label = format!("{:?} {:?} {:?}", case.code, case.kind, case.axes);
        let (file, _) = run(&mesh.write(case.code, folder.path()), ", interpolation: linear");
        let table = &file.species[0].table;
        let d = file.header.dimension;
        assert_eq!(d, if case.kind == Kind::Polar && case.axes[2].0 == 1 { 2 } else { 3 }, "{label}");
        let column = |name: &str| table.column(name).unwrap_or_else(|| panic!("{label}: no {name}"));
        let (x, v, b) = (column(columns::COORDINATES), column(columns::VELOCITIES), column(columns::MAGNETIC_FIELD));
        let middle = middle_of_bounds(&mesh);
        let mut compared = 0;
        for i in 0..table.count {
            let at = |c: &sph_formats::Column, k: usize| if k < d { c.values.get(i * d + k) } else { 0.0 };
            let x: [f64; 3] =
                std::array::from_fn(|k| if k < d { at(x, k) - 0.5 * file.header.box_size[k] + middle[k] } else { 0.0 });
            if !is_within_middles(&mesh, x) {
                continue;
            }
            compared += 1;
            let (velocity, field) = (motion(x), magnetic(x));
            for k in 0..d {
                // Chords of pi/32 in an angle: (pi/32)^2 / 8 = 1.2e-3 of at most 3 * 1.5.
                assert!(
                    (at(v, k) - velocity[k]).abs() < 6e-3,
                    "{label}: v[{k}] = {} at {x:?}, not {velocity:?}",
                    at(v, k)
                );
                assert!((at(b, k) - field[k]).abs() < 9e-3, "{label}: B[{k}] = {} at {x:?}, not {field:?}", at(b, k));
            }
        }
        assert!(compared > 100, "{label}: {compared}");
    }
}

/// The middle of the smallest box about all cells.
fn middle_of_bounds(mesh: &Mesh) -> [f64; 3] {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let is_round = |faces: &[f64]| faces.len() == 2;
    let azimuth = if mesh.kind == Kind::Polar { 1 } else { 2 };
    let turns = if is_round(&mesh.faces[azimuth]) { even(64, 0.0, TAU) } else { mesh.faces[azimuth].clone() };
    for &r in &mesh.faces[0] {
        for &height in &mesh.faces[3 - azimuth] {
            for &phi in &turns {
                let u = if azimuth == 1 { [r, phi, height] } else { [r, height, phi] };
                let x = mesh.frame(u).0;
                for k in 0..3 {
                    lo[k] = lo[k].min(x[k]);
                    hi[k] = hi[k].max(x[k]);
                }
            }
        }
    }
    std::array::from_fn(|k| 0.5 * (lo[k] + hi[k]))
}

/// Beyond the outermost middles of cells values are constant, but for an axis and the center.
fn is_within_middles(mesh: &Mesh, x: [f64; 3]) -> bool {
    let ring = x[0].hypot(x[1]);
    let u = match mesh.kind {
        Kind::Spherical => [ring.hypot(x[2]), ring.atan2(x[2]), x[1].atan2(x[0])],
        Kind::Polar => [ring, x[1].atan2(x[0]), x[2]],
        Kind::Cylindrical => [ring, x[2], x[1].atan2(x[0])],
    };
    (0..3).all(|k| {
        let faces = &mesh.faces[k];
        let (n, first, last) = (faces.len() - 1, faces[0], faces[faces.len() - 1]);
        let half = 0.5 * (last - first) / n as f64;
        let is_angle = k > 0 && !(mesh.kind == Kind::Polar && k == 2 || mesh.kind == Kind::Cylindrical && k == 1);
        let goes_on = n == 1 || is_angle && (last - first > 3.1);
        goes_on || u[k] < last - half && (first == 0.0 && k == 0 || u[k] > first + half)
    })
}

#[test]
fn the_report_says_what_the_grid_leaves_out() {
    let folder = tempfile::tempdir().unwrap();
    let note = |case: usize, part: &str| {
        let case = &cases()[case];
        let (_, report) = run(&case.mesh(1).write(case.code, folder.path()), "");
        assert!(report.notes.iter().any(|n| n.contains(part)), "{part}: {:?}", report.notes);
    };
    note(0, "the grid begins at r = 0.2");
    note(1, "one cell in phi");
    note(2, "theta from 1.2");
    note(3, "25.0 % of the circle");
    note(5, "the domain is the plane of R and phi");
}

#[test]
fn a_grid_file_of_another_run_is_not_believed() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = |outer: f64, n: usize| Mesh {
        kind: Kind::Spherical,
        faces: [even(6, 0.5, outer), even(n, 0.0, PI), even(1, 0.0, TAU)],
    };
    let refusal = |path: &str| {
        let scene = format!("input: {{file: '{path}', density: rho}}");
        place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap_err().to_string()
    };
    let path = mesh(1.5, 8).pluto(folder.path());
    let other = tempfile::tempdir().unwrap();
    for (outer, n, part) in [(1.6, 8, "has a corner at"), (1.5, 9, "has [6, 8] cells, grid.out [6, 9, 1]")] {
        mesh(outer, n).pluto(other.path());
        std::fs::copy(other.path().join("grid.out"), folder.path().join("grid.out")).unwrap();
        let text = refusal(&path);
        assert!(text.contains(part) && text.contains("of another run"), "{text}");
    }
    let whole = std::fs::read_to_string(other.path().join("grid.out")).unwrap();
    for (text, part) in [
        (whole.lines().take(9).collect::<Vec<_>>().join("\n"), "the file ends after 3 of 6 cells"),
        (whole.replacen("\n6 \n", "\n6.5 \n", 1), "expected the number of cells along X1"),
        (whole.replacen(" 2 ", " 2 nan ", 1), "left and the right face of cell 2 along X1"),
        (whole.replace("SPHERICAL", "TOROIDAL"), "coordinates 'TOROIDAL'"),
    ] {
        std::fs::write(folder.path().join("grid.out"), text).unwrap();
        let found = refusal(&path);
        assert!(found.contains(part) && found.contains("grid.out"), "{found}");
    }
}
