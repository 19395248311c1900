//! Scaling and rotation of shapes from files.

/// How the points of a surface are scaled, and then turned, about the origin of its file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orientation {
    /// Factors on x, y and z.
    pub scale: [f64; 3],
    /// Angles in degrees about the axes x, y and z, in this order; in 2-D the last alone.
    pub rotate: [f64; 3],
}

impl Default for Orientation {
    fn default() -> Self {
        Self { scale: [1.0; 3], rotate: [0.0; 3] }
    }
}

impl Orientation {
    /// Where a point comes to be.
    pub fn apply(&self, point: &[f64; 3]) -> [f64; 3] {
        let scaled = sph::array(|k| self.scale[k] * point[k]);
        rotated(&self.rotate, &scaled)
    }
}

/// A vector turned about x, y and z by so many degrees.
pub fn rotated(degrees: &[f64; 3], vector: &[f64; 3]) -> [f64; 3] {
    let mut v = *vector;
    for (axis, angle) in degrees.iter().enumerate().filter(|(_, angle)| **angle != 0.0) {
        let (sin, cos) = exact_sin_cos(*angle);
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        (v[i], v[j]) = (cos * v[i] - sin * v[j], sin * v[i] + cos * v[j]);
    }
    v
}

/// A vector that [`rotated`] by the same angles brings back.
pub fn turned_back(degrees: &[f64; 3], vector: &[f64; 3]) -> [f64; 3] {
    let about = |axis: usize| sph::array(|k| if k == axis { -degrees[axis] } else { 0.0 });
    [2, 1, 0].into_iter().fold(*vector, |v, axis| rotated(&about(axis), &v))
}

/// Sine and cosine, exact for right angles.
fn exact_sin_cos(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        angle => angle.to_radians().sin_cos(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_turned_back_is_where_it_was() {
        let (angles, v) = ([20.0, -75.0, 130.0], [0.3, -1.2, 2.5]);
        let there = rotated(&angles, &v);
        let back = turned_back(&angles, &there);
        assert!((0..3).all(|k| (back[k] - v[k]).abs() < 1e-14) && (there[0] - v[0]).abs() > 0.1, "{there:?} {back:?}");
    }
}
