use super::super::testing::Random;
use super::*;
use std::f64::consts::{PI, TAU};

type Triangles = Vec<Facet<3>>;

/// A surface over two angles, `n` and `2 n` steps around.
fn turned(n: usize, at: &dyn Fn(f64, f64) -> [f64; 3]) -> Triangles {
    let place = |i: usize, j: usize| at((i % (2 * n)) as f64 / (2 * n) as f64, j as f64 / n as f64);
    let mut triangles = Vec::new();
    for (i, j) in (0..2 * n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| place(i, j));
        triangles.extend([[a, c, b], [a, d, c]]);
    }
    triangles
}

fn sphere(n: usize, radius: f64, center: [f64; 3]) -> Triangles {
    let at = |u: f64, v: f64| {
        let (sin, cos) = (TAU * u).sin_cos();
        let (ring, z) = if v == 0.0 || v == 1.0 { (0.0, 1.0 - 2.0 * v) } else { (PI * v).sin_cos() };
        [ring * cos, ring * sin, z]
    };
    let moved = |x: [f64; 3]| sph::array(|k| center[k] + radius * x[k]);
    turned(n, &at).into_iter().map(|f| f.map(moved)).collect()
}

fn cuboid(lo: [f64; 3], hi: [f64; 3]) -> Triangles {
    let corner = |i: usize| sph::array(|k| if i >> k & 1 == 1 { hi[k] } else { lo[k] });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]].map(|f| f.map(corner))).collect()
}

fn torus(n: usize) -> Triangles {
    let at = |u: f64, v: f64| {
        let ((s, c), (t, z)) = ((TAU * u).sin_cos(), (TAU * (v % 1.0)).sin_cos());
        let ring = 1.0 + 0.4 * t;
        [ring * c, ring * s, 0.4 * z]
    };
    turned(n, &at)
}

fn surface<const D: usize>(facets: &[Facet<D>]) -> (Surface<D>, Vec<String>) {
    built(facets).unwrap()
}

/// As files have them: every facet with corners of its own.
fn built<const D: usize>(facets: &[Facet<D>]) -> Result<(Surface<D>, Vec<String>), String> {
    let points: Vec<[f64; D]> = facets.iter().flatten().copied().collect();
    let numbers = (0..facets.len() as u32).map(|i| sph::array(|k| D as u32 * i + k as u32)).collect();
    Surface::new(points, numbers)
}

fn inverted(facets: &[Facet<3>]) -> Triangles {
    facets.iter().map(|f| [f[1], f[0], f[2]]).collect()
}

fn off(found: f64, expected: f64) -> f64 {
    (found / expected - 1.0).abs()
}

#[test]
fn spheres_and_tori_have_the_volume_of_closed_forms() {
    // A surface of n steps lies (pi / n)^2 / 4 or so within the smooth one.
    let (ball, notes) = surface(&sphere(100, 1.0, [3.0, -2.0, 0.5]));
    assert!(off(ball.volume(), 4.0 / 3.0 * PI) < 1e-3, "{}", ball.volume());
    assert!(notes.iter().all(|n| n.contains("no extent")), "{notes:?}");
    let (ring, _) = surface(&torus(100));
    assert!(off(ring.volume(), TAU * PI * 0.16) < 2e-3, "{}", ring.volume());
    assert!(!ring.contains(&[0.0; 3]) && ring.contains(&[1.1, 0.0, 0.1]) && !ring.contains(&[1.1, 0.0, 0.41]));
    assert!(off(distance(&ring.nearest_on_surface(&[1.0, 0.0, 0.0]), &[1.0, 0.0, 0.0]), 0.4) < 1e-2);
}

#[test]
fn the_inside_agrees_with_the_shape_at_all_places() {
    let (ring, _) = surface(&torus(60));
    let mut random = Random::new(8);
    for _ in 0..5000 {
        let x = random.point::<3>().map(|v| 3.2 * v - 1.6);
        let depth = 0.4 - (x[0].hypot(x[1]) - 1.0).hypot(x[2]);
        let near = ring.nearest_within(&x, 0.3);
        if depth.abs() > 0.005 {
            assert_eq!(ring.contains(&x), depth > 0.0, "{x:?}");
            assert_eq!(ring.winds(&x), depth > 0.0, "{x:?}");
            assert_eq!(ring.times(&x), i32::from(depth > 0.0), "{x:?}");
            let chords = ring.chords(2, &x).unwrap();
            assert_eq!(chords.iter().any(|c| (c[0]..c[1]).contains(&x[2])), depth > 0.0, "{x:?}");
        }
        if (depth.abs() - 0.3).abs() > 0.005 && depth > -0.5 {
            assert_eq!(near.is_some(), depth.abs() < 0.3, "{x:?} {depth}");
        }
    }
}

/// A tank with a step, whose faces lie in the planes of the places that are asked for.
#[test]
fn places_in_the_planes_of_faces_are_where_they_are() {
    let quad = |a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]| [[a, b, c], [a, c, d]];
    // The outline in x and z, counterclockwise seen from -y.
    let outline = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.5, 0.5], [0.5, 1.0], [0.0, 1.0]];
    let at = |i: usize, y: f64| [outline[i % 6][0], y, outline[i % 6][1]];
    let mut facets: Triangles =
        (0..6).flat_map(|i| quad(at(i, 0.0), at(i, 1.0), at(i + 1, 1.0), at(i + 1, 0.0))).collect();
    for (y, is_front) in [(0.0, true), (1.0, false)] {
        for corners in [[0, 1, 2, 3], [0, 3, 4, 5]] {
            let [a, b, c, d] = corners.map(|i| at(i, y));
            facets.extend(if is_front { quad(a, b, c, d) } else { quad(a, d, c, b) });
        }
    }
    let (tank, notes) = surface(&facets);
    assert!(off(tank.volume(), 0.75) < 1e-12, "{} {notes:?}", tank.volume());
    for (i, j, k) in (0..32_usize.pow(3)).map(|n| (n % 32, n / 32 % 32, n / 1024)) {
        let x = [i, j, k].map(|n| (n as f64 + 0.5) / 16.0 - 0.5);
        let y = [i, j, k].map(|n| n as f64 / 16.0 - 0.5);
        for p in [x, [y[0], x[1], x[2]], [x[0], x[1], y[2]], [y[0], x[1], y[2]]] {
            let on_a_face = p[0] == 0.0 || p[2] == 0.0 || p[0] == 1.0 || p[2] == 1.0;
            let on_the_step = p[0] == 0.5 && p[2] >= 0.5 || p[2] == 0.5 && p[0] >= 0.5;
            if on_a_face || on_the_step {
                continue;
            }
            let is_within = p.iter().all(|c| (0.0..1.0).contains(c)) && (p[0] < 0.5 || p[2] < 0.5);
            assert_eq!(tank.contains(&p), is_within, "{p:?}");
        }
    }
}

#[test]
fn turned_facets_and_inverted_bodies_are_put_right() {
    let plain = sphere(24, 1.0, [0.0; 3]);
    let expected = surface(&plain).0.volume();
    let mut random = Random::new(2);
    let mixed: Triangles = plain.iter().map(|f| if random.unit() < 0.3 { [f[1], f[0], f[2]] } else { *f }).collect();
    for facets in [mixed, inverted(&plain)] {
        let (found, notes) = surface(&facets);
        assert!(off(found.volume(), expected) < 1e-12);
        assert!(notes.iter().any(|n| n.contains("were turned")), "{notes:?}");
        assert!(found.contains(&[0.9, 0.0, 0.0]) && !found.contains(&[1.1, 0.0, 0.0]));
    }
    // A hollow stays one, whole and inside out; of two bodies one that is inside out is turned.
    let hollow = [plain.clone(), inverted(&sphere(24, 0.5, [0.0; 3]))].concat();
    for facets in [hollow.clone(), inverted(&hollow)] {
        let shell = surface(&facets).0;
        assert!(off(shell.volume(), expected * 0.875) < 1e-12 && !shell.contains(&[0.3, 0.0, 0.0]));
    }
    let two = [plain, inverted(&sphere(24, 0.5, [3.0, 0.0, 0.0]))].concat();
    assert!(off(surface(&two).0.volume(), expected * 1.125) < 1e-12);
}

#[test]
fn holes_are_closed_and_the_volume_is_that_of_the_body_less_its_caps() {
    let all = sphere(100, 1.0, [0.0; 3]);
    let ways = [[1.0, 0.0, 0.0], [0.0, 0.957_826, 0.287_348], [0.0, 0.0, 1.0], [-0.5, -0.5, -0.707]];
    let seen = |f: &Facet<3>, way: &[f64; 3]| {
        let c = winding::centroid(f);
        (0..3).map(|k| c[k] * way[k]).sum::<f64>() > 0.2_f64.cos()
    };
    let left: Triangles = all.iter().filter(|f| !ways.iter().any(|w| seen(f, w))).copied().collect();
    let (body, notes) = surface(&left);
    let height = 1.0 - 0.2_f64.cos();
    let caps = 4.0 * PI * height * height * (3.0 - height) / 3.0;
    assert!(off(body.volume(), 4.0 / 3.0 * PI - caps) < 1e-3, "{}", body.volume());
    assert!(notes.iter().any(|n| n.starts_with("4 holes")), "{notes:?}");
    assert!(body.doubt().unwrap().contains("area is 6 %"), "{:?}", body.doubt());
    assert!(surface(&all).0.doubt().is_none());
    assert!(body.contains(&[0.97, 0.0, 0.0]) && !body.contains(&[0.99, 0.0, 0.0]));
}

/// A facet that is there again, from whichever of its corners on, is neither a hole nor another part.
#[test]
fn facets_that_come_twice_count_once() {
    let mut facets = cuboid([0.0; 3], [1.0, 2.0, 3.0]);
    let [a, b, c] = facets[3];
    facets.extend([[a, b, c], [b, c, a]]);
    let (body, notes) = surface(&facets);
    assert!(off(body.volume(), 6.0) < 1e-12 && body.contains(&[0.5, 1.0, 1.5]));
    assert_eq!(notes, ["2 of the surface's 14 facets are there more than once, and count once"]);
    let once = cuboid([0.0; 3], [1.0, 2.0, 3.0]);
    assert!(off(surface(&[once.clone(), once].concat()).0.volume(), 6.0) < 1e-12);
    let square: Vec<Facet<2>> =
        [[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 1.0]], [[1.0, 1.0], [0.0, 1.0]], [[0.0, 1.0], [0.0, 0.0]]]
            .to_vec();
    let (plane, notes) = surface(&[square.clone(), square].concat());
    assert!(off(plane.volume(), 1.0) < 1e-12 && notes.len() == 1, "{notes:?}");
}

/// Two boxes side by side, with a whole face in common or a part of one: nothing is a surface there.
#[test]
fn walls_between_bodies_that_touch_are_left_aside() {
    let first = cuboid([0.0; 3], [1.0; 3]);
    for (lo, hi) in [([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]), ([1.0, 0.2, 0.2], [2.0, 0.8, 0.8])] {
        let (body, notes) = surface(&[first.clone(), cuboid(lo, hi)].concat());
        let volume = 1.0 + (hi[1] - lo[1]) * (hi[2] - lo[2]);
        assert!(off(body.volume(), volume) < 1e-12, "{}", body.volume());
        assert!(notes.iter().any(|n| n.contains("touch each other")), "{notes:?}");
        assert!(body.contains(&[1.0, 0.5, 0.5]) && body.contains(&[1.0 + 1e-9, 0.5, 0.5]));
        let near = body.nearest_on_surface(&[1.0, 0.5, 0.5]);
        let away = (0..3).map(|k| (near[k] - [1.0, 0.5, 0.5][k]).powi(2)).sum::<f64>().sqrt();
        assert!(away > 0.27, "{near:?}");
    }
    assert!(!surface(&first).1.iter().any(|n| n.contains("touch")));
}

#[test]
fn bodies_that_pass_through_each_other_are_one() {
    let apart = 1.05_f64;
    let two = [sphere(100, 1.0, [0.0; 3]), sphere(100, 1.0, [apart, 0.0, 0.0])].concat();
    let (both, notes) = surface(&two);
    let lens = PI * (4.0 + apart) * (2.0 - apart).powi(2) / 12.0;
    assert!(off(both.volume(), 8.0 / 3.0 * PI - lens) < 1.5e-3, "{}", both.volume());
    assert!(notes.iter().any(|n| n.contains("passes through itself")), "{notes:?}");
    assert!(both.contains(&[0.5 * apart, 0.0, 0.0]));
    // Facets within it are no surface.
    let near = both.nearest_on_surface(&[0.9, 0.0, 0.1]);
    assert!((near[0].hypot(near[1]).hypot(near[2]) - 1.0).abs() < 1e-2 && near[0] < 0.55, "{near:?}");
    let within = [sphere(30, 1.0, [0.0; 3]), sphere(30, 0.5, [0.0; 3])].concat();
    let near = surface(&within).0.nearest_on_surface(&[0.6, 0.0, 0.0]);
    assert!((near[0] - 1.0).abs() < 2e-2, "{near:?}");
}

#[test]
fn cracks_everywhere_are_survived_and_open_sheets_are_refused() {
    let mut random = Random::new(3);
    let shaken: Triangles =
        sphere(40, 1.0, [0.0; 3]).iter().map(|f| f.map(|c| c.map(|v| v + 1e-3 * (random.unit() - 0.5)))).collect();
    let (ball, notes) = surface(&shaken);
    assert!(notes.iter().any(|n| n.contains("gaps")), "{notes:?}");
    assert!(off(ball.volume(), 4.0 / 3.0 * PI) < 5e-3, "{}", ball.volume());
    let sheet: Triangles = (0..400)
        .flat_map(|i| {
            let at = |i: usize, j: usize| [0.1 * i as f64, 0.1 * j as f64, 0.003 * (i * j) as f64];
            let (i, j) = (i % 20, i / 20);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let problem = built(&sheet).unwrap_err();
    assert!(problem.contains("open sheet"), "{problem}");
    let flat: Triangles = sheet.iter().map(|f| f.map(|c| [c[0], c[1], 0.0])).collect();
    assert!(built(&flat).unwrap_err().contains("it is flat"));
    assert!(built::<3>(&[[[1.0; 3]; 3]]).unwrap_err().contains("area"));
}

#[test]
fn curves_in_a_plane_enclose_areas() {
    let n = 400;
    let at = |i: usize| {
        let (sin, cos) = (TAU * i as f64 / n as f64).sin_cos();
        [2.0 * cos, sin]
    };
    let mut ellipse: Vec<Facet<2>> = (0..n).map(|i| [at(i), at((i + 1) % n)]).collect();
    let mut check = |expected: f64| {
        let (area, notes) = surface(&ellipse);
        assert!(off(area.volume(), expected) < 1e-3, "{} {notes:?}", area.volume());
        assert!(area.contains(&[1.9, 0.0]) && !area.contains(&[1.9, 0.5]));
        assert!(off(area.nearest_on_surface(&[0.0, 0.5])[1], 1.0) < 1e-3);
        ellipse.pop();
        notes
    };
    check(TAU);
    assert!(check(TAU).iter().any(|n| n.contains("1 holes")));
}
