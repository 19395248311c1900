//! Gathered particles, in arrays from which vector registers are loaded.

use crate::lanes::{MAX_LANES, Real};
use crate::pack::{EIGHT, SIXTEEN};
use pulp::Simd;

/// Buffer position of padding: its square still fits f32, and no support radius is 1e8 times the leaf's reach.
const FAR: f64 = 1e8;

/// Positions and channels of sources, in buffer units.
pub(super) struct Buffers<const D: usize, const C: usize, R: Real> {
    used: usize,
    positions: [Vec<R>; D],
    channels: [Vec<R>; C],
}

/// The first `count` of each array as registers. A loop: closures over arrays are not always inlined here.
#[inline(always)]
fn all_vectors<const N: usize, R: Real, S: Simd>(arrays: &[Vec<R>; N], count: usize) -> [&[R::Vector<S>]; N] {
    let mut out: [&[R::Vector<S>]; N] = [&[]; N];
    for k in 0..N {
        out[k] = R::vectors::<S>(&arrays[k][..count]);
    }
    out
}

impl<const D: usize, const C: usize, R: Real> Buffers<D, C, R> {
    pub fn new() -> Self {
        Self { used: 0, positions: std::array::from_fn(|_| Vec::new()), channels: std::array::from_fn(|_| Vec::new()) }
    }

    pub fn clear(&mut self) {
        self.used = 0;
    }

    pub fn len(&self) -> usize {
        self.used
    }

    #[inline(always)]
    pub fn position(&self, j: usize) -> [R; D] {
        crate::array(|k| self.positions[k][j])
    }

    #[inline(always)]
    pub fn channel(&self, c: usize, j: usize) -> R {
        self.channels[c][j]
    }

    /// See [`super::Batch::registers`].
    #[inline(always)]
    pub fn registers<S: Simd>(&self) -> ([&[R::Vector<S>]; D], [&[R::Vector<S>]; C]) {
        let padded = self.used.next_multiple_of(MAX_LANES);
        (all_vectors::<D, R, S>(&self.positions, padded), all_vectors::<C, R, S>(&self.channels, padded))
    }

    /// What appends up to `more` sources, eight at a time.
    pub fn filled(&mut self, more: usize) -> Filled<'_, D, C, R> {
        let needed = (self.used + more + SIXTEEN).next_multiple_of(MAX_LANES) + MAX_LANES;
        if self.positions[0].len() < needed {
            self.positions.iter_mut().for_each(|p| p.resize(2 * needed, R::default()));
            self.channels.iter_mut().for_each(|c| c.resize(2 * needed, R::default()));
        }
        Filled {
            used: &mut self.used,
            positions: self.positions.each_mut().map(Vec::as_mut_slice),
            channels: self.channels.each_mut().map(Vec::as_mut_slice),
        }
    }

    /// Fills up the last registers with sources that no kernel reaches.
    pub fn pad(&mut self) {
        let padded = self.used.next_multiple_of(MAX_LANES);
        if self.positions[0].len() < padded {
            self.positions.iter_mut().for_each(|p| p.resize(padded, R::default()));
            self.channels.iter_mut().for_each(|c| c.resize(padded, R::default()));
        }
        for j in self.used..padded {
            self.positions.iter_mut().for_each(|p| p[j] = R::from_f64(FAR));
            self.channels.iter_mut().for_each(|c| c[j] = R::default());
        }
    }

    /// What is used of each array, padded.
    #[inline(always)]
    fn sixteens<'s, const N: usize>(&self, arrays: &'s [Vec<R>; N]) -> [&'s [[R; SIXTEEN]]; N] {
        let mut out: [&[[R; SIXTEEN]]; N] = [&[]; N];
        for k in 0..N {
            out[k] = &arrays[k].as_chunks().0[..self.used.div_ceil(SIXTEEN)];
        }
        out
    }

    /// Takes those of `from`, which is padded, whose distance from the box about `center` has a square below `limit`.
    #[inline(always)]
    pub fn take_near<S: Simd>(&mut self, simd: S, from: &Self, (center, half): (&[R; D], &[R; D]), limit: R) {
        self.used = 0;
        let Filled { used: kept, positions, channels } = self.filled(from.used);
        let blocks = from.used.div_ceil(SIXTEEN);
        let (from_positions, from_channels) = (from.sixteens(&from.positions), from.sixteens(&from.channels));
        let mut used = 0;
        for block in 0..blocks {
            let mut gap2 = [R::default(); SIXTEEN];
            for k in 0..D {
                let x = &from_positions[k][block];
                for j in 0..SIXTEEN {
                    gap2[j] = x[j].add_gap2(center[k], half[k], gap2[j]);
                }
            }
            let bits = R::below_sixteen(simd, &gap2, limit);
            for k in 0..D {
                R::pack_sixteen(simd, &from_positions[k][block], bits, &mut positions[k][used..]);
            }
            for c in 0..C {
                R::pack_sixteen(simd, &from_channels[c][block], bits, &mut channels[c][used..]);
            }
            used += bits.count_ones() as usize;
        }
        *kept = used;
        self.pad();
    }
}

/// Buffers that are being filled.
pub(super) struct Filled<'b, const D: usize, const C: usize, R> {
    used: &'b mut usize,
    positions: [&'b mut [R]; D],
    channels: [&'b mut [R]; C],
}

impl<const D: usize, const C: usize, R: Real> Filled<'_, D, C, R> {
    /// Appends those of eight sources whose bits are set.
    #[inline(always)]
    pub fn push<S: Simd>(&mut self, simd: S, positions: &[[R; EIGHT]; D], channels: &[[R; EIGHT]; C], bits: u8) {
        let places = *self.used..*self.used + EIGHT;
        for k in 0..D {
            self.positions[k][places.clone()].copy_from_slice(&R::packed(simd, positions[k], bits));
        }
        for c in 0..C {
            self.channels[c][places.clone()].copy_from_slice(&R::packed(simd, channels[c], bits));
        }
        *self.used += bits.count_ones() as usize;
    }
}
