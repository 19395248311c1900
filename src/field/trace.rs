//! Identifies the part of a piecewise smooth field that contains a point.

/// Levels that are kept; of more, a field's first.
pub(super) const MOST_LEVELS: usize = 8;

/// A number for what `all` stands for, and `outcome` after it: FNV-1a over words, then SplitMix64's finalizer.
#[inline]
pub(super) fn chained(all: u64, outcome: f64) -> u64 {
    // One zero, and one NaN.
    let bits = if outcome.is_nan() { u64::MAX } else { (outcome + 0.0).to_bits() };
    let mut z = (all ^ bits).wrapping_mul(0x0100_0000_01b3).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A quantity that is smooth within a part of a field, which ends where it leaves the interval `lo` to `hi`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    pub value: f64,
    pub lo: f64,
    pub hi: f64,
}

/// What is known of the field about a point.
#[derive(Debug, Clone, Copy)]
pub struct Trace {
    /// As `ScalarField::piece` says.
    pub piece: u64,
    /// As the piece, but different beyond kinks too: within a part the field is smooth.
    pub part: u64,
    levels: [Level; MOST_LEVELS],
    count: usize,
    is_complete: bool,
}

impl Trace {
    /// A point of which the piece alone is known.
    pub fn of_piece(piece: u64) -> Self {
        Self { is_complete: false, ..Self::new(piece, piece) }
    }

    /// A point without levels as yet.
    pub fn new(piece: u64, part: u64) -> Self {
        Self { piece, part, levels: [Level { value: 0.0, lo: 0.0, hi: 0.0 }; MOST_LEVELS], count: 0, is_complete: true }
    }

    /// Adds what became of a step that can be discontinuous.
    pub(crate) fn discontinuity(&mut self, outcome: f64) {
        self.piece = chained(self.piece, outcome);
        self.part = chained(self.part, outcome);
    }

    /// Adds on which side of a kink the point lies.
    pub(crate) fn kink(&mut self, side: f64) {
        self.part = chained(self.part, side);
    }

    /// Adds a level, in the same order at all points of a part.
    pub fn push(&mut self, level: Level) {
        match self.levels.get_mut(self.count) {
            Some(place) => (*place, self.count) = (level, self.count + 1),
            None => self.is_complete = false,
        }
    }

    /// Adds all that another field tells of the point.
    pub(crate) fn append(&mut self, other: &Self) {
        self.piece = other.piece;
        self.part = chained(self.part, f64::from_bits(other.part >> 2));
        other.levels().iter().for_each(|level| self.push(*level));
        self.is_complete &= other.is_complete;
    }

    pub fn levels(&self) -> &[Level] {
        &self.levels[..self.count]
    }

    /// Whether the part can end only where one of the levels leaves its interval.
    pub fn is_complete(&self) -> bool {
        self.is_complete
    }
}
