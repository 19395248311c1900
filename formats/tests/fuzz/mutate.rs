//! Mutants of files: by bytes, by words, by text, by pieces of other files.

/// SplitMix64 (Steele, Lea & Flood 2014, doi 10.1145/2660193.2660195).
pub struct Random(u64);

/// Numbers at which sizes overflow.
const WORDS: [u64; 16] = [
    0,
    1,
    2,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x1_0000_0000,
    0x7fff_ffff_ffff_ffff,
    0x8000_0000_0000_0000,
    0xffff_ffff_ffff_ffff,
    0x7ff8_0000_0000_0000,
];

/// Texts that stand where a number is expected.
const TEXTS: [&str; 14] = [
    "0",
    "-1",
    "1",
    "nan",
    "inf",
    "1e308",
    "-1e-320",
    "4294967296",
    "18446744073709551615",
    "999999999999",
    "",
    "\"",
    "\n",
    "x",
];

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    /// A place in a file; headers are hit as often as all the rest.
    fn place(&mut self, length: usize) -> usize {
        let head = length.min([64, 512, 4096, length][self.below(4)]);
        self.below(head)
    }

    /// One file of the corpus with 1 to 8 changes.
    pub fn mutant(&mut self, corpus: &[Vec<u8>], longest: usize) -> Vec<u8> {
        let Some(seed) = corpus.get(self.below(corpus.len())) else { return Vec::new() };
        let mut bytes = seed.clone();
        for _ in 0..1 << self.below(4) {
            self.change(&mut bytes, corpus);
        }
        bytes.truncate(longest);
        bytes
    }

    fn change(&mut self, bytes: &mut Vec<u8>, corpus: &[Vec<u8>]) {
        let at = self.place(bytes.len());
        match self.below(9) {
            0 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b ^= 1 << (self.next() % 8)),
            1 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b = self.next() as u8),
            2 | 3 => {
                let word = WORDS[self.below(WORDS.len())];
                let width = [1, 2, 4, 8][self.below(4)];
                let raw = if self.next().is_multiple_of(2) {
                    word.to_le_bytes()
                } else {
                    word.rotate_left(64 - 8 * width as u32).to_be_bytes()
                };
                for (b, new) in bytes.iter_mut().skip(at).zip(raw.iter().take(width)) {
                    *b = *new;
                }
            }
            4 => bytes.truncate(at),
            5 => {
                let end = bytes.len().min(at + 1 + self.below(64));
                bytes.drain(at.min(end)..end);
            }
            6 => {
                let end = bytes.len().min(at + 1 + self.below(256));
                let piece = bytes.get(at..end).unwrap_or_default().to_vec();
                let to = self.place(bytes.len() + 1).min(bytes.len());
                bytes.splice(to..to, piece);
            }
            7 => self.replace_number(bytes, at),
            _ => {
                let Some(other) = corpus.get(self.below(corpus.len())) else { return };
                let from = self.place(other.len());
                let piece = other.get(from..other.len().min(from + 1 + self.below(256))).unwrap_or_default().to_vec();
                let end = bytes.len().min(at + piece.len());
                bytes.splice(at.min(end)..end, piece);
            }
        }
    }

    /// Another text for the digits at or behind a place.
    fn replace_number(&mut self, bytes: &mut Vec<u8>, at: usize) {
        let is_digit = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'e' | b'E');
        let Some(start) = bytes.iter().skip(at).position(u8::is_ascii_digit).map(|i| at + i) else { return };
        let end = bytes.iter().skip(start).position(|b| !is_digit(b)).map_or(bytes.len(), |i| start + i);
        let text = TEXTS[self.below(TEXTS.len())];
        bytes.splice(start..end, text.bytes());
    }
}
