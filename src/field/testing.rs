//! Helpers of this module's tests.

/// Small deterministic generator (SplitMix64) for test points.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in [lo, hi).
    pub(crate) fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + self.unit() * (hi - lo)
    }

    /// Uniform in lo to hi - 1.
    pub(crate) fn whole(&mut self, lo: usize, hi: usize) -> usize {
        self.between(lo as f64, hi as f64) as usize
    }

    pub(crate) fn point<const D: usize>(&mut self) -> [f64; D] {
        sph::array(|_| self.unit())
    }
}
