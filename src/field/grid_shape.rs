//! The variation of a density within a cell of a grid.

/// How values change within a cell, by the place in it, from -1 to 1 along each axis.
#[derive(Clone, Copy)]
pub(crate) struct Shape<const D: usize> {
    pub(super) changes: [f64; D],
    /// Of two axes each, by [`pair`].
    pub(super) mixed: [f64; 3],
}

/// Where the mixed derivative along two axes is, the first before the second.
pub(super) fn pair(k: usize, l: usize) -> usize {
    k + l - 1
}

impl<const D: usize> Shape<D> {
    /// No change.
    pub(super) const EVEN: Self = Self { changes: [0.0; D], mixed: [0.0; 3] };

    #[inline]
    pub(super) fn at(&self, place: &[f64; D]) -> f64 {
        let mut sum = 0.0;
        for k in 0..D {
            let mut rest = 0.0;
            for l in k + 1..D {
                rest += self.mixed[pair(k, l)] * place[l];
            }
            sum += place[k] * (self.changes[k] + rest);
        }
        sum
    }

    /// The integral over a part of the cell: lengths along the axes, and integrals of the place over these.
    pub(super) fn over(&self, shares: &[[f64; 2]; D]) -> f64 {
        let product = |first: usize, second: usize| {
            (0..D).map(|k| shares[k][usize::from(k == first || k == second)]).product::<f64>()
        };
        let along = |k: usize| {
            let mixed: f64 = (k + 1..D).map(|l| self.mixed[pair(k, l)] * product(k, l)).sum();
            self.changes[k] * product(k, k) + mixed
        };
        (0..D).map(along).sum()
    }

    /// Reduces all changes from `size` until no corner is below `least`; `sign` times the changes are compared.
    pub(super) fn end_at(&mut self, size: f64, least: f64, sign: f64) {
        let mut reach = 0.0;
        for k in 0..D {
            reach += self.changes[k].abs();
            for l in k + 1..D {
                reach += self.mixed[pair(k, l)].abs();
            }
        }
        if size - reach >= least {
            return;
        }
        let corner = |i: usize| sign * self.at(&sph::array(|k| if i >> k & 1 == 0 { -1.0 } else { 1.0 }));
        let lowest = (0..1 << D).map(corner).fold(0.0, f64::min);
        if size + lowest < least {
            let share = ((size - least) / -lowest).clamp(0.0, 1.0);
            self.changes = sph::array(|k| share * self.changes[k]);
            self.mixed.iter_mut().for_each(|c| *c *= share);
        }
    }
}
