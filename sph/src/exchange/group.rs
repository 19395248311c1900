//! A subset of the ranks of a run, which work together while the other ranks continue.

use super::{Exchange, Traffic, doubling};

/// Ranks of `parent`, numbered from 0. Only these call it, all in the same order; where ranks are in several groups, all have to come to them
/// in one order that the groups have.
pub struct Group<'a> {
    parent: &'a dyn Exchange,
    /// Their numbers there, ascending.
    members: Vec<usize>,
    own: usize,
}

impl<'a> Group<'a> {
    /// `None` where the calling rank is not a member.
    pub fn new(parent: &'a dyn Exchange, members: Vec<usize>) -> Option<Self> {
        let own = members.iter().position(|m| *m == parent.rank())?;
        Some(Self { parent, members, own })
    }
}

impl Exchange for Group<'_> {
    fn rank(&self) -> usize {
        self.own
    }

    fn ranks(&self) -> usize {
        self.members.len()
    }

    fn on_this_machine(&self) -> usize {
        self.parent.on_this_machine().min(self.members.len())
    }

    fn swap(&self, to: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let (mut own, mut sent) = (Vec::new(), Vec::with_capacity(to.len()));
        for (member, message) in to.into_iter().enumerate() {
            match member == self.own {
                true => own = message,
                false => sent.push((self.members[member], message)),
            }
        }
        let from: Vec<usize> = sent.iter().map(|(rank, _)| *rank).collect();
        let mut received = self.parent.pass(sent, &from);
        received.insert(self.own, own);
        received
    }

    fn all(&self, own: &[f64]) -> Vec<Vec<f64>> {
        doubling((self.own, self.members.len()), own, |(to, message), from| {
            self.parent.pass(vec![(self.members[to], message)], &[self.members[from]]).remove(0)
        })
    }

    fn pass(&self, to: Vec<(usize, Vec<f64>)>, from: &[usize]) -> Vec<Vec<f64>> {
        let to = to.into_iter().map(|(member, message)| (self.members[member], message)).collect();
        self.parent.pass(to, &from.iter().map(|member| self.members[*member]).collect::<Vec<_>>())
    }

    fn traffic(&self) -> Traffic {
        self.parent.traffic()
    }
}
