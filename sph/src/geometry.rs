//! Points, distances and volumes in one to three dimensions.

/// Structure-of-arrays positions.
pub type Positions<const D: usize> = [Vec<f64>; D];

/// Position of particle `i`.
#[inline]
pub fn at<const D: usize>(positions: &Positions<D>, i: usize) -> [f64; D] {
    crate::array(|k| positions[k][i])
}

/// Volume of the unit ball: 2, pi, 4 pi/3.
pub fn unit_ball_volume(d: usize) -> f64 {
    match d {
        1 => 2.0,
        2 => std::f64::consts::PI,
        _ => 4.0 * std::f64::consts::PI / 3.0,
    }
}

/// Surface of the unit ball: 2, 2 pi, 4 pi.
pub fn unit_sphere_area(d: usize) -> f64 {
    d as f64 * unit_ball_volume(d)
}

/// |a - b|, without images.
#[inline]
pub fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}
