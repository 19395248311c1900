//! The state that stages keep so that an interrupted run continues bit for bit.
//!
//! A stage offers itself at the top of each iteration; what keeps it decides whether a snapshot is due. Particles
//! are kept in the order of their tree, whose structure depends on their number alone: with the same positions
//! in the same places all sums come out the same. Snapshots read, and never change, the state.
//!
//! Making a snapshot copies the state, and so takes up to half of a stage's memory for the time of writing.

use super::report::Progress;
use crate::target::Positions;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Appends a state to `to`: floating-point numbers bit by bit.
///
/// # Errors
/// What cannot be encoded.
pub(super) fn encode<T: Serialize>(state: &T, to: Vec<u8>) -> Result<Vec<u8>, String> {
    postcard::to_extend(state, to).map_err(|e| e.to_string())
}

/// The state of bytes that [`encode`] made.
///
/// # Errors
/// What is wrong with them.
pub(super) fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    postcard::from_bytes(bytes).map_err(|e| format!("its content cannot be read ({e}); start without it"))
}

/// The best state met.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Best<const D: usize> {
    pub epsilon: f64,
    pub iteration: usize,
    #[serde(with = "axes")]
    pub positions: Positions<D>,
}

impl<const D: usize> Best<D> {
    /// Takes over a state that is better.
    pub fn note(&mut self, epsilon: f64, iteration: usize, positions: &Positions<D>) {
        if epsilon < self.epsilon {
            *self = Self { epsilon, iteration, positions: positions.clone() };
        }
    }
}

/// The history of a stage over all runs that it took.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Trace {
    pub history: Vec<Progress>,
    /// Seconds that went by before this run.
    earlier: f64,
    #[serde(skip)]
    start: Option<Instant>,
}

impl Trace {
    /// A trace that begins now.
    pub fn new() -> Self {
        Self { start: Some(Instant::now()), ..Self::default() }
    }

    /// A kept trace that goes on now.
    pub fn resumed(self) -> Self {
        Self { start: Some(Instant::now()), ..self }
    }

    /// What to keep.
    pub fn kept(&self) -> Self {
        Self { history: self.history.clone(), earlier: self.seconds(), start: None }
    }

    pub fn seconds(&self) -> f64 {
        self.earlier + self.start.map_or(0.0, |s| s.elapsed().as_secs_f64())
    }
}

/// What is wrong with a kept state of a stage over `count` particles.
pub(super) struct Check {
    count: usize,
    fault: Option<String>,
}

impl Check {
    pub fn new(count: usize) -> Self {
        Self { count, fault: None }
    }

    pub fn holds(mut self, condition: bool, fault: &str) -> Self {
        if !condition && self.fault.is_none() {
            self.fault = Some(fault.into());
        }
        self
    }

    /// One finite value per particle.
    pub fn scalars(self, name: &str, values: &[f64]) -> Self {
        let count = self.count;
        self.holds(values.len() == count, &format!("has {} values of {name} for {count} particles", values.len()))
            .holds(values.iter().all(|v| v.is_finite()), &format!("has values of {name} that are not finite"))
    }

    pub fn vectors<V: Copy + Into<f64>, const D: usize>(self, name: &str, values: &[[V; D]]) -> Self {
        let (count, is_finite) = (self.count, values.iter().flatten().all(|&v| v.into().is_finite()));
        self.holds(values.len() == count, &format!("has {} values of {name} for {count} particles", values.len()))
            .holds(is_finite, &format!("has values of {name} that are not finite"))
    }

    pub fn positions<const D: usize>(self, name: &str, positions: &Positions<D>) -> Self {
        positions.iter().fold(self, |check, axis| check.scalars(name, axis))
    }

    pub fn result(self) -> Result<(), String> {
        self.fault.map_or(Ok(()), Err)
    }
}

/// Serde for [`Positions`]: arrays of a length that is a parameter are beyond serde's own.
pub(crate) mod axes {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer, const D: usize>(axes: &[Vec<f64>; D], to: S) -> Result<S::Ok, S::Error> {
        axes.as_slice().serialize(to)
    }

    pub fn deserialize<'de, T: Deserializer<'de>, const D: usize>(from: T) -> Result<[Vec<f64>; D], T::Error> {
        let axes = Vec::<Vec<f64>>::deserialize(from)?;
        let found = axes.len();
        axes.try_into().map_err(|_| T::Error::custom(format!("{found} axes, expected {D}")))
    }
}

/// Serde for a vector per particle, as one flat sequence.
pub(super) mod rows {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer, V: Serialize, const D: usize>(rows: &[[V; D]], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(rows.as_flattened())
    }

    pub fn deserialize<'de, T, V, const D: usize>(from: T) -> Result<Vec<[V; D]>, T::Error>
    where
        T: Deserializer<'de>,
        V: Deserialize<'de> + Copy,
    {
        let flat = Vec::<V>::deserialize(from)?;
        let (rows, rest) = flat.as_chunks::<D>();
        if rest.is_empty() { Ok(rows.to_vec()) } else { Err(T::Error::custom("a vector that is cut off")) }
    }
}
