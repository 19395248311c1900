//! The Kronecker sequence of the generalized golden ratio (Roberts 2018, "R_d"): the fractional parts of
//! 1/2 + (i + 1) g^-k, k = 1..d, with g the positive root of g^(d+1) = g + 1. For d = 1 g is the golden ratio.

/// (1/g, 1/g^2, ...).
pub(super) fn generator<const D: usize>() -> [f64; D] {
    let mut g = 1.5_f64;
    // The fixed point of g = (1 + g)^(1/(d+1)) attracts: each step gains a factor of three at least.
    for _ in 0..60 {
        g = (1.0 + g).powf(1.0 / (D as f64 + 1.0));
    }
    sph::array(|k| g.powi(-(k as i32 + 1)))
}

/// Point `i`, in [0, 1).
pub(super) fn point<const D: usize>(generator: &[f64; D], i: usize) -> [f64; D] {
    generator.map(|a| (0.5 + (i as f64 + 1.0) * a).fract())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn generators_are_the_known_constants() {
        assert!((1.0 / generator::<1>()[0] - 1.618_033_988_749_895).abs() < 1e-14);
        assert!((1.0 / generator::<2>()[0] - 1.324_717_957_244_746).abs() < 1e-14);
        assert!((1.0 / generator::<3>()[0] - 1.220_744_084_605_759_5).abs() < 1e-14);
    }
}
