//! SPH kernels W(r, H) = sigma_d / H^d K(r/H) with support radius H.

/// Volume of the unit ball: 2, pi, 4 pi/3.
pub fn unit_ball_volume(d: usize) -> f64 {
    match d {
        1 => 2.0,
        2 => std::f64::consts::PI,
        _ => 4.0 * std::f64::consts::PI / 3.0,
    }
}
