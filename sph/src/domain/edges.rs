//! Mirror images near the edges of a hull, where the surface is more than one face.
//!
//! A particle is mirrored in each face that is near; beside an edge both images count, each on its own side of the middle between the faces outside,
//! and those mirrored twice fill what is left of the space beyond a sharp edge (all of it for right angles, three times in a corner of them). With the
//! nearest face alone, as on a smooth surface, an edge would have half of its right angle filled, and particles would gather there.

use super::region::Hull;
use crate::geometry::distance;

/// Faces whose normals have a larger cosine between them are one smooth surface.
const SMOOTH: f64 = 0.6;
/// Faces whose normals have a smaller one are opposite sides of a thin body, or of a blade: of so many images some would be missing.
const OPPOSITE: f64 = -0.7;
/// Faces whose normals have a smaller cosine between them meet at right angles, near enough.
const RIGHT: f64 = 0.3;
/// Right above the foot of a place on its plane, so many reaches, a face has nothing of the body: the plane of a surface that goes on has.
const ABOVE: f64 = 0.1;

/// Another part of the surface is nearer to an image than its own face if its distance is below this share: facets of a curved surface are not.
const NEARER: f64 = 0.9;
/// Edges farther than so many reaches do not count.
const FAR: f64 = 2.0;
/// How far a look from farther inside goes, in units of the reach: bodies may be thin there.
const STEPS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// A face: its plane, by a point and the normal that points outward.
#[derive(Clone, Copy)]
struct Face<const D: usize> {
    point: [f64; D],
    normal: [f64; D],
}

impl<const D: usize> Face<D> {
    /// The nearest to a place inside, if it is nearer than `reach`; none right on the surface.
    fn nearest(hull: &dyn Hull<D>, x: &[f64; D], reach: f64) -> Option<Self> {
        Self::seen(hull.nearest_within(x, reach)?, x)
    }

    /// That of a point of the surface, which is the nearest to a place inside; none where they are the same.
    fn seen(point: [f64; D], x: &[f64; D]) -> Option<Self> {
        let way: [f64; D] = crate::array(|k| point[k] - x[k]);
        let length = way.iter().map(|v| v * v).sum::<f64>().sqrt();
        (length > 0.0).then(|| Self { point, normal: way.map(|v| v / length) })
    }

    /// Height of a place above the plane, outside.
    fn height(&self, x: &[f64; D]) -> f64 {
        (0..D).map(|k| self.normal[k] * (x[k] - self.point[k])).sum()
    }

    fn reflected(&self, x: &[f64; D]) -> [f64; D] {
        let height = self.height(x);
        crate::array(|k| x[k] - 2.0 * height * self.normal[k])
    }

    fn cosine(&self, other: &Self) -> f64 {
        (0..D).map(|k| self.normal[k] * other.normal[k]).sum()
    }
}

/// The images of a place inside, in all faces that are nearer than `reach`.
pub(super) fn images<const D: usize>(hull: &dyn Hull<D>, x: &[f64; D], reach: f64) -> Vec<[f64; D]> {
    let Some(nearest) = hull.nearest_within(x, reach) else { return Vec::new() };
    // Right on the surface it is its own image.
    let Some(first) = Face::seen(nearest, x) else { return vec![nearest] };
    // Faces of a thin smooth body may be as steep to each other, with no edge between them.
    if !hull.is_edge_within(x, FAR * reach) {
        return vec![first.reflected(x)];
    }
    let mut faces = vec![first];
    let mut from = *x;
    while faces.len() < D {
        // Away from the faces that are known the next one is the nearest, unless the way leads out of it.
        let last = faces[faces.len() - 1];
        let away = STEPS.map(|step| (step, crate::array(|k| from[k] - step * reach * last.normal[k])));
        let Some((step, to)) = away.into_iter().find(|(_, to)| hull.contains(to)) else { break };
        let seen = Face::nearest(hull, &to, (1.0 + 0.5 * step) * reach);
        let Some(next) = seen.filter(|face| is_another(hull, x, face, (&faces, reach))) else { break };
        from = to;
        faces.push(next);
    }
    let mut images = Vec::new();
    for (i, face) in faces.iter().enumerate() {
        let image = face.reflected(x);
        if others(&faces, &[i]).all(|other| is_nearer(&image, (i, face), other)) && is_beyond(hull, &image, face) {
            images.push(image);
        }
        for (j, second) in faces.iter().enumerate().filter(|(j, _)| *j != i) {
            let twice = second.reflected(&image);
            let near = |other: (usize, &Face<D>)| is_nearer(&twice, (j, second), other);
            if near((i, face)) && others(&faces, &[i, j]).all(near) && !hull.contains(&twice) {
                images.push(twice);
            }
        }
    }
    if let [a, b, c] = faces.as_slice()
        && [a.cosine(b), a.cosine(c), b.cosine(c)].iter().all(|cosine| cosine.abs() < RIGHT)
    {
        images.push(c.reflected(&b.reflected(&a.reflected(x))));
    }
    images
}

/// Whether an image in a face is outside, and no other part of the surface is nearer to it: beside an edge that is re-entrant, and across a gap, it is
/// those of the particles there that count.
fn is_beyond<const D: usize>(hull: &dyn Hull<D>, image: &[f64; D], face: &Face<D>) -> bool {
    !hull.contains(image) && hull.nearest_within(image, NEARER * face.height(image)).is_none()
}

fn others<'a, const D: usize>(
    faces: &'a [Face<D>],
    but: &'a [usize],
) -> impl Iterator<Item = (usize, &'a Face<D>)> + use<'a, D> {
    faces.iter().enumerate().filter(move |(k, _)| !but.contains(k))
}

/// Whether a place outside is on the first face's side of the middle between two; of equal ones the earlier counts.
fn is_nearer<const D: usize>(x: &[f64; D], (i, face): (usize, &Face<D>), (j, other): (usize, &Face<D>)) -> bool {
    let (own, its) = (face.height(x), other.height(x));
    own > its || own == its && i < j
}

/// Whether a face is one beside those that are known, and near to `x`.
fn is_another<const D: usize>(
    hull: &dyn Hull<D>,
    x: &[f64; D],
    face: &Face<D>,
    (known, reach): (&[Face<D>], f64),
) -> bool {
    let depth = -face.height(x);
    let foot: [f64; D] = crate::array(|k| x[k] + depth * face.normal[k]);
    let above = crate::array(|k| foot[k] + ABOVE * reach * face.normal[k]);
    let is_its_own = known.iter().all(|one| (OPPOSITE..SMOOTH).contains(&one.cosine(face)));
    let is_near = depth > 0.0 && depth < reach && distance(&foot, &face.point) < 1.5 * reach;
    is_its_own && is_near && !hull.contains(&above)
}
