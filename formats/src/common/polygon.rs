//! Polygons in space as triangles.

use earcut::Earcut;
use earcut::utils3d::project3d_to_2d;

/// Sine of an angle that is taken for none.
const FLAT: f64 = 1e-9;

/// Triangles of a polygon, turning as it does, by the numbers of their points: a fan about the first corner where it is convex, else what cutting off
/// ears leaves. A polygon that is no plane one, or crosses itself, becomes a fan, whose parts cover with opposite signs what they cover twice.
pub fn triangles(points: &[[f64; 3]], corners: &[u32]) -> Vec<u32> {
    let fan = |corners: &[u32]| match corners {
        [first, rest @ ..] => rest.windows(2).flat_map(|pair| [*first, pair[0], pair[1]]).collect(),
        [] => Vec::new(),
    };
    if corners.len() < 4 {
        return fan(corners);
    }
    let places: Option<Vec<[f64; 3]>> = corners.iter().map(|p| points.get(*p as usize).copied()).collect();
    let concave = places.filter(|places| !is_convex(places));
    concave.and_then(|places| by_ears(&places, corners)).unwrap_or_else(|| fan(corners))
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Twice the area of a polygon, along its normal.
fn area(places: &[[f64; 3]]) -> [f64; 3] {
    let first = places[0];
    places.windows(2).fold([0.0; 3], |sum, pair| {
        let part = cross(minus(pair[0], first), minus(pair[1], first));
        [sum[0] + part[0], sum[1] + part[1], sum[2] + part[2]]
    })
}

/// Whether no corner turns against the whole.
fn is_convex(places: &[[f64; 3]]) -> bool {
    let normal = area(places);
    let n = places.len();
    (0..n).all(|i| {
        let (a, b, c) = (places[i], places[(i + 1) % n], places[(i + 2) % n]);
        let (to, from) = (minus(b, a), minus(c, b));
        let scale = (dot(to, to) * dot(from, from) * dot(normal, normal)).sqrt();
        dot(cross(to, from), normal) >= -FLAT * scale
    })
}

/// The triangles of a plane polygon; `None` where they do not make it up.
fn by_ears(places: &[[f64; 3]], corners: &[u32]) -> Option<Vec<u32>> {
    let mut plane: Vec<[f64; 2]> = Vec::new();
    if !project3d_to_2d(places, places.len(), &mut plane) {
        return None;
    }
    let (mut cut, none): (Vec<u32>, [u32; 0]) = (Vec::new(), []);
    Earcut::new().earcut(plane, &none, &mut cut);
    let normal = area(places);
    let part = |t: &[u32]| dot(area(&[t[0], t[1], t[2]].map(|i| places[i as usize])), normal);
    let of_parts: f64 = cut.chunks_exact(3).map(|t| part(t).abs()).sum();
    let whole = dot(normal, normal);
    if !((of_parts / whole - 1.0).abs() < FLAT) {
        return None;
    }
    let oriented =
        cut.chunks_exact(3).flat_map(|t| if part(t) < 0.0 { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] });
    Some(oriented.map(|i| corners[i as usize]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Areas of triangles along the normal of the whole, and of the whole.
    fn areas(points: &[[f64; 3]], corners: &[u32]) -> (Vec<f64>, f64) {
        let place = |i: &u32| points[*i as usize];
        let normal = area(&corners.iter().map(place).collect::<Vec<_>>());
        let size = dot(normal, normal).sqrt();
        let cut = triangles(points, corners);
        let of = |t: &[u32]| dot(area(&t.iter().map(place).collect::<Vec<_>>()), normal) / size;
        (cut.chunks_exact(3).map(of).collect(), size)
    }

    #[test]
    fn a_concave_polygon_is_covered_once_from_any_corner_and_side() {
        // An L in a plane at an angle.
        let flat = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let points: Vec<[f64; 3]> = flat.iter().map(|[x, y]| [x + 7.0, y - 0.3 * x, 0.7 * x + 0.2 * y]).collect();
        for first in 0..6 {
            let mut corners: Vec<u32> = (0..6).map(|i| (i + first) % 6).collect();
            for _ in 0..2 {
                let (parts, whole) = areas(&points, &corners);
                assert_eq!(parts.len(), 4);
                assert!(parts.iter().all(|part| *part > 0.0), "{first}: {parts:?}");
                assert!((parts.iter().sum::<f64>() / whole - 1.0).abs() < 1e-12);
                corners.reverse();
            }
        }
    }

    #[test]
    fn convex_polygons_and_those_that_are_none_are_fans() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [1.0, 1.0, 0.0], [0.0, 1.0, 0.1]];
        assert_eq!(triangles(&points, &[0, 1, 2, 3]), [0, 1, 2, 0, 2, 3]);
        // Crossing itself, out of range, and too few.
        assert_eq!(triangles(&points, &[0, 1, 3, 2]), [0, 1, 3, 0, 3, 2]);
        assert_eq!(triangles(&points, &[0, 1, 9, 2]), [0, 1, 9, 0, 9, 2]);
        assert_eq!(triangles(&points, &[0, 1]), [0; 0]);
        assert_eq!(triangles(&points, &[]), [0; 0]);
    }
}
