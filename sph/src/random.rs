//! Random numbers keyed by their purpose, not by the thread that draws them.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// The generator of one particle: `stream` tells apart the purposes that draw random numbers for one seed.
pub fn keyed(seed: u64, stream: u64, particle: u64) -> Xoshiro256PlusPlus {
    let mixed = mix(mix(seed) ^ mix(stream << 56 ^ particle));
    Xoshiro256PlusPlus::seed_from_u64(mixed)
}

/// SplitMix64's finalizer: neighboring keys give unrelated streams.
fn mix(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
