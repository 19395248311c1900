//! Communication between the ranks of a run: one small interface, without physics.
//!
//! A run over several ranks gives each a part of the particles. All ranks call the same functions in the same order; totals are
//! added in the order of ranks, so that each rank has the same bits and comes to the same decisions.
//!
//! [`Alone`] is a run on one rank: it hands back what it is given. [`together`] runs several ranks as threads of one process. [`Group`] is
//! some of the ranks, for work that the others have no part in.

mod group;
mod threads;

pub use group::Group;
pub use threads::{together, words};

use std::sync::atomic::{AtomicU64, Ordering};

/// Messages between ranks.
pub trait Exchange: Sync {
    /// Number of this rank, from 0.
    fn rank(&self) -> usize;

    /// How many ranks there are.
    fn ranks(&self) -> usize;

    /// How many of them share the memory of this machine.
    fn on_this_machine(&self) -> usize;

    /// Gives `to[r]` to rank `r`; returns what each rank has given to this one, in the order of ranks. What a rank gives itself
    /// comes back. `to` has an entry for each rank.
    fn swap(&self, to: Vec<Vec<f64>>) -> Vec<Vec<f64>>;

    /// What each rank has given to all, in the order of ranks.
    fn all(&self, own: &[f64]) -> Vec<Vec<f64>>;

    /// Sends messages to some other ranks, and returns what those of `from` send to this one, in their order. Between two ranks messages
    /// arrive as they were sent; other ranks need not call this.
    fn pass(&self, to: Vec<(usize, Vec<f64>)>, from: &[usize]) -> Vec<Vec<f64>>;

    /// What this rank has sent to others so far.
    fn traffic(&self) -> Traffic;
}

/// Messages that were not empty, and their bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Traffic {
    pub messages: u64,
    pub bytes: u64,
}

impl Traffic {
    /// What has been sent since there was so much `before`.
    pub fn since(self, before: Self) -> Self {
        Self { messages: self.messages - before.messages, bytes: self.bytes - before.bytes }
    }
}

/// Counts what is sent.
#[derive(Debug, Default)]
pub struct Tally {
    messages: AtomicU64,
    bytes: AtomicU64,
}

impl Tally {
    /// Counts what `rank` gives to the others.
    pub fn count(&self, rank: usize, to: &[Vec<f64>]) {
        let others = to.iter().enumerate().filter(|(r, m)| *r != rank && !m.is_empty());
        others.for_each(|(_, message)| self.add(1, message.len()));
    }

    /// Counts so many messages of `numbers` together.
    pub fn add(&self, messages: u64, numbers: usize) {
        self.messages.fetch_add(messages, Ordering::Relaxed);
        self.bytes.fetch_add(8 * numbers as u64, Ordering::Relaxed);
    }

    pub fn traffic(&self) -> Traffic {
        Traffic { messages: self.messages.load(Ordering::Relaxed), bytes: self.bytes.load(Ordering::Relaxed) }
    }
}

impl dyn Exchange + '_ {
    /// Whether there is no other rank.
    pub fn is_alone(&self) -> bool {
        self.ranks() == 1
    }

    /// The sum of each entry over all ranks, in their order; all give as many.
    pub fn sums(&self, own: Vec<f64>) -> Vec<f64> {
        if self.is_alone() {
            return own;
        }
        let mut total = vec![0.0; own.len()];
        self.all(&own).iter().for_each(|part| total.iter_mut().zip(part).for_each(|(sum, x)| *sum += x));
        total
    }

    /// The sums of some numbers over all ranks, in their order, by one message to each.
    pub fn together<const K: usize>(&self, own: [f64; K]) -> [f64; K] {
        if self.is_alone() {
            return own;
        }
        let total = self.sums(own.to_vec());
        crate::array(|k| total[k])
    }

    /// The sum over all ranks, in their order.
    pub fn sum(&self, own: f64) -> f64 {
        if self.is_alone() { own } else { self.all(&[own]).iter().flatten().sum() }
    }

    /// The sum of whole numbers, of which f64 holds those below 2^53.
    pub fn count(&self, own: usize) -> usize {
        if self.is_alone() { own } else { self.sum(own as f64) as usize }
    }

    /// The largest over all ranks. NaN is passed over.
    pub fn max(&self, own: f64) -> f64 {
        if self.is_alone() { own } else { self.all(&[own]).iter().flatten().fold(f64::NEG_INFINITY, |m, x| m.max(*x)) }
    }

    /// Whether it is so on any rank.
    pub fn any(&self, own: bool) -> bool {
        if self.is_alone() { own } else { self.max(f64::from(u8::from(own))) > 0.0 }
    }

    /// The value that has `n` smaller ones before it among those of all ranks, which are more than `n`. `values` lose their order.
    pub fn nth(&self, values: &mut [f64], n: usize) -> f64 {
        if self.is_alone() {
            return *values.select_nth_unstable_by(n, f64::total_cmp).1;
        }
        values.sort_unstable_by(f64::total_cmp);
        // The smallest key with more than n values up to it, digit by digit.
        let mut key = 0_u64;
        for shift in (0..u64::BITS).step_by(DIGIT).rev() {
            let last = |digit: u64| key | (digit << shift) | ((1 << shift) - 1);
            let up_to = |digit: u64| values.partition_point(|v| ordered(*v) <= last(digit)) as f64;
            let all = self.sums((0..1 << DIGIT).map(up_to).collect());
            let digit = all.iter().position(|count| *count > n as f64).unwrap_or(all.len() - 1);
            key |= (digit as u64) << shift;
        }
        unordered(key)
    }
}

/// Bits of a number that are found at once: few rounds of short messages.
const DIGIT: usize = 8;

const SIGN: u64 = 1 << 63;

/// Bits in the order of `f64::total_cmp`.
fn ordered(value: f64) -> u64 {
    let bits = value.to_bits();
    if bits & SIGN == 0 { bits | SIGN } else { !bits }
}

fn unordered(key: u64) -> f64 {
    f64::from_bits(if key & SIGN == 0 { !key } else { key & !SIGN })
}

/// A run on one rank.
#[derive(Debug, Clone, Copy, Default)]
pub struct Alone;

impl Exchange for Alone {
    fn rank(&self) -> usize {
        0
    }

    fn ranks(&self) -> usize {
        1
    }

    fn on_this_machine(&self) -> usize {
        1
    }

    fn swap(&self, to: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        to
    }

    fn all(&self, own: &[f64]) -> Vec<Vec<f64>> {
        vec![own.to_vec()]
    }

    fn pass(&self, _: Vec<(usize, Vec<f64>)>, _: &[usize]) -> Vec<Vec<f64>> {
        Vec::new()
    }

    fn traffic(&self) -> Traffic {
        Traffic::default()
    }
}

/// What each of several ranks has given to all, of which this is number `own`; `pass` sends a message to a number and returns that of another. What
/// is known doubles with each of log2(ranks) messages (Bruck et al. 1997, IEEE Trans. Parallel Distrib. Syst. 8, 1143).
fn doubling(
    (own, ranks): (usize, usize),
    given: &[f64],
    mut pass: impl FnMut((usize, Vec<f64>), usize) -> Vec<f64>,
) -> Vec<Vec<f64>> {
    // Of this rank and those after it.
    let mut known = vec![given.to_vec()];
    while known.len() < ranks {
        let far = known.len();
        let given = &known[..far.min(ranks - far)];
        let lengths = given.iter().map(|block| block.len() as f64);
        let message: Vec<f64> = lengths.chain(given.iter().flatten().copied()).collect();
        let count = given.len();
        let received = pass(((own + ranks - far) % ranks, message), (own + far) % ranks);
        let (lengths, mut rest) = received.split_at(count);
        for length in lengths {
            let (block, after) = rest.split_at(*length as usize);
            known.push(block.to_vec());
            rest = after;
        }
    }
    known.rotate_right(own);
    known
}
