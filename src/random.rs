//! Random numbers of a run, in streams by what they are for.

use rand_xoshiro::Xoshiro256PlusPlus;

/// Purposes that draw random numbers; each has streams of its own.
#[derive(Debug, Clone, Copy)]
pub enum Purpose {
    RandomSeed = 1,
    SeedJitter = 2,
    Measure = 3,
    ShellRotation = 4,
    Parting = 5,
    Turbulence = 6,
    Displacement = 7,
    Velocity = 8,
}

/// The generator of one particle for one purpose.
pub fn keyed(seed: u64, purpose: Purpose, particle: u64) -> Xoshiro256PlusPlus {
    sph::random::keyed(seed, purpose as u64, particle)
}
