//! The quaquaversal tiling (Conway & Radin 1998, Invent. Math. 132, 179; as initial conditions: Hansen et al. 2007,
//! ApJ 656, 631): one particle at the centroid of each tile.
//!
//! The tile is the prism 0 <= x <= 1 over the triangle (0, 0), (1, 0), (0, sqrt 3) of the y-z plane. Eight copies of
//! half the size fill it, two of them turned by 120 and 180 degrees about axes across each other, so that the
//! directions of ever smaller tiles come to fill the sphere. The tiling neither repeats nor mirrors: a periodic box
//! has a seam.
//!
//! The centroid is the right place: mass and center of mass of every part are then those of the tile, at all levels.
//! Of eight other points all but one are noisier at 64 neighbors (cubic spline: incenter 48 % of random points', near a
//! corner 87 %, centroid 33 %), and that one, a little quieter there, is noisier at 128.

use super::pattern::Pattern;
use nalgebra::{Matrix3, Vector3};

/// `x -> rotation x + shift`.
#[derive(Debug, Clone, Copy)]
struct Motion {
    rotation: Matrix3<f64>,
    shift: Vector3<f64>,
}

const R3: f64 = 1.732_050_807_568_877_2;
const ONE: Matrix3<f64> = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);

const fn motion(rotation: Matrix3<f64>, shift: [f64; 3]) -> Motion {
    Motion { rotation, shift: Vector3::new(shift[0], shift[1], shift[2]) }
}

/// The motions that bring the tile to its eight parts, at twice their size.
const PARTS: [Motion; 8] = [
    motion(ONE, [1.0, 0.0, R3]),
    motion(ONE, [1.0, 1.0, 0.0]),
    motion(ONE, [0.0, 0.0, R3]),
    motion(Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0), [1.0, 1.0, 0.0]),
    motion(Matrix3::new(0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0), [2.0, 1.0, R3]),
    motion(Matrix3::new(-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0), [1.0, 0.0, R3]),
    motion(Matrix3::new(1.0, 0.0, 0.0, 0.0, -0.5, 0.5 * R3, 0.0, -0.5 * R3, -0.5), [0.0, 0.5, 0.5 * R3]),
    motion(Matrix3::new(-1.0, 0.0, 0.0, 0.0, 0.5, 0.5 * R3, 0.0, 0.5 * R3, -0.5), [1.0, 0.5, 0.5 * R3]),
];

const VOLUME: f64 = 0.5 * R3;
const CENTROID: Vector3<f64> = Vector3::new(0.5, 1.0 / 3.0, R3 / 3.0);
/// Radius of the largest ball in the tile, which touches the triangle's sides, and its center.
const INNER_RADIUS: f64 = 0.5 * (R3 - 1.0);
const INNER_CENTER: Vector3<f64> = Vector3::new(0.5, INNER_RADIUS, INNER_RADIUS);
/// From the centroid to the farthest corner, and a little.
const OUTER_RADIUS: f64 = 1.311;

/// A tile divided often enough that the ball in it holds what is asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quaquaversal {
    levels: i32,
}

/// Divisions beyond which f64 no longer tells tiles apart usefully.
const MOST_LEVELS: i32 = 40;

impl Quaquaversal {
    /// Covers a ball of this radius, in spacings, about any point within one spacing of the origin.
    pub fn covering(radius: f64) -> Self {
        let mut this = Self { levels: 1 };
        while this.scale() * INNER_RADIUS < radius + 1.0 && this.levels < MOST_LEVELS {
            this.levels += 1;
        }
        this
    }

    /// Size of the whole in units in which a last tile has volume 1.
    fn scale(self) -> f64 {
        2.0_f64.powi(self.levels) / VOLUME.cbrt()
    }
}

fn apply(motion: &Motion, size: f64, x: &Vector3<f64>) -> Vector3<f64> {
    size * (motion.rotation * x) + motion.shift
}

/// `outer` at the given size, after a part at half its size.
fn compose(outer: &Motion, size: f64, part: &Motion) -> Motion {
    Motion { rotation: outer.rotation * part.rotation, shift: apply(outer, size, &(0.5 * part.shift)) }
}

impl<const D: usize> Pattern<D> for Quaquaversal {
    fn visit(&self, lo: &[f64; D], hi: &[f64; D], out: &mut dyn FnMut([f64; D])) {
        let scale = self.scale();
        let root = Motion { rotation: ONE, shift: -scale * INNER_CENTER };
        divide(&root, scale, self.levels, &mut |centroid, reach| {
            let x: [f64; D] = sph::array(|k| centroid[k]);
            if reach == 0.0 {
                if (0..D).all(|k| x[k] >= lo[k] && x[k] < hi[k]) {
                    out(x);
                }
                return false;
            }
            (0..D).all(|k| x[k] + reach >= lo[k] && x[k] - reach <= hi[k])
        });
    }
}

/// Walks the tiles. `enter` gets each centroid with the tile's reach and says whether to go on into it; tiles of the
/// last level have reach 0.
fn divide(tile: &Motion, size: f64, levels: i32, enter: &mut dyn FnMut(Vector3<f64>, f64) -> bool) {
    let reach = if levels == 0 { 0.0 } else { OUTER_RADIUS * size };
    if enter(apply(tile, size, &CENTROID), reach) {
        for part in &PARTS {
            divide(&compose(tile, size, part), 0.5 * size, levels - 1, enter);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::testing::Random;

    fn in_tile(x: &[f64; 3]) -> bool {
        x.iter().all(|&v| v >= 0.0) && x[0] <= 1.0 && x[1] + x[2] / R3 <= 1.0
    }

    #[test]
    fn eight_parts_fill_the_tile_without_overlap() {
        let mut random = Random::new(3);
        let mut seen = 0;
        while seen < 5000 {
            let [a, b, c] = random.point::<3>();
            let x = [a, b, R3 * c];
            if !in_tile(&x) {
                continue;
            }
            seen += 1;
            let holders = PARTS.iter().filter(|p| {
                // The inverse of x -> (R y + t) / 2.
                in_tile(&p.rotation.tr_mul(&(2.0 * Vector3::from(x) - p.shift)).into())
            });
            assert_eq!(holders.count(), 1, "{x:?}");
        }
    }

    #[test]
    fn tiles_have_unit_density() {
        let q = Quaquaversal::covering(12.0);
        let half = [5.0; 3];
        let mut n = 0;
        q.visit(&half.map(|h: f64| -h), &half, &mut |_| n += 1);
        // Unit density: 1000 in the box, but for its surface.
        assert!((f64::from(n) - 1000.0).abs() < 60.0, "{n}");
    }
}
