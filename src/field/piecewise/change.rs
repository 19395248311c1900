//! Finds where a pattern of parts changes.

/// Parts in some order, by number, with their widths.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Pattern(Vec<(u64, f64)>);

impl Pattern {
    pub fn push(&mut self, part: u64, width: f64) {
        self.0.push((part, width));
    }

    /// Appends `other`, told apart from the same parts elsewhere by `place`.
    pub fn extend(&mut self, place: u64, other: &Self) {
        self.0.extend(other.0.iter().map(|&(part, width)| (mixed(place, part), width)));
    }

    /// One number for the parts.
    pub fn number(&self) -> u64 {
        self.0.iter().fold(1, |all, &(part, _)| mixed(all, part))
    }

    fn is_as(&self, other: &Self) -> bool {
        self.0.len() == other.0.len() && self.0.iter().zip(&other.0).all(|(a, b)| a.0 == b.0)
    }

    /// The width of the narrowest part of which `other` has fewer.
    fn vanishing(&self, other: &Self) -> Option<f64> {
        let count = |all: &Self, part: u64| all.0.iter().filter(|p| p.0 == part).count();
        let lost = self.0.iter().filter(|p| count(self, p.0) > count(other, p.0));
        lost.map(|p| p.1).reduce(f64::min)
    }
}

fn mixed(all: u64, next: u64) -> u64 {
    (all.rotate_left(29) ^ next).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// A pattern at a place.
#[derive(Debug, Clone)]
pub(super) struct Seen {
    pub t: f64,
    pub pattern: Pattern,
}

impl Seen {
    pub fn is_as(&self, other: &Self) -> bool {
        self.pattern.is_as(&other.pattern)
    }
}

/// The first place after `left` at which the pattern that `at` tells is another one than there, from both sides to within
/// `accuracy`; `right` has another pattern.
///
/// Where a part appears or vanishes its width runs to zero, most often linearly: that is where the place is sought, by
/// halving every fourth time.
pub(super) fn change(at: &dyn Fn(f64) -> Option<Seen>, left: Seen, right: Seen, accuracy: f64) -> Option<[Seen; 2]> {
    let (mut a, mut b) = (left, right);
    // The places before on either side, for their slopes.
    let (mut before, mut after): (Option<Seen>, Option<Seen>) = (None, None);
    for step in 0.. {
        let width = b.t - a.t;
        if width <= accuracy {
            break;
        }
        let half = 0.5 * (a.t + b.t);
        let expected = match (a.pattern.vanishing(&b.pattern), b.pattern.vanishing(&a.pattern)) {
            (Some(p), Some(q)) => Some(a.t + p / (p + q) * width),
            (Some(_), None) => before.as_ref().and_then(|other| extrapolated(other, &a, &b.pattern)),
            (None, Some(_)) => after.as_ref().and_then(|other| extrapolated(other, &b, &a.pattern)),
            (None, None) => None,
        };
        let side = if step % 2 == 0 { -0.4 } else { 0.4 };
        let within = |t: &f64| *t > a.t - accuracy && *t < b.t + accuracy;
        let t = match expected.filter(within) {
            Some(t) if step % 4 != 3 => (t + side * accuracy).clamp(a.t + 0.1 * accuracy, b.t - 0.1 * accuracy),
            _ => half,
        };
        let seen = at(t)?;
        if seen.is_as(&a) {
            before = Some(std::mem::replace(&mut a, seen));
        } else {
            after = Some(std::mem::replace(&mut b, seen)).filter(|old| old.is_as(&b));
        }
    }
    Some([a, b])
}

/// Where the part that vanishes on the way to `beyond` does so, from its widths at two places.
fn extrapolated(far: &Seen, near: &Seen, beyond: &Pattern) -> Option<f64> {
    let (wide, narrow) = (far.pattern.vanishing(beyond)?, near.pattern.vanishing(beyond)?);
    (wide > narrow).then(|| near.t + (near.t - far.t) * narrow / (wide - narrow))
}
