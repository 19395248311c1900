//! Relaxation: stages that move particles until their density, and the forces on them, match the target.
//!
//! Each stage is a file with its options, its name and its implementation of [`Stage`]; [`relax`] runs any of them.

mod acceptance;
mod afc;
#[cfg(test)]
mod afc_tests;
mod aim;
mod alaric;
mod arrangement;
mod balance;
mod balance_states;
mod by_body;
mod certificate;
mod conservation;
mod contacts;
mod control;
mod course;
mod crowding;
mod equilibrium;
mod fit;
mod fluid;
mod followed;
#[cfg(test)]
mod force_tests;
#[cfg(test)]
mod gradient_tests;
mod hold;
mod interfaces;
mod layers;
mod lbfgs;
mod newton;
mod objective;
mod on_ranks;
mod orbiting;
mod outside;
mod pairs;
mod pulls;
mod report;
mod schedule;
mod separation;
mod snapshot;
mod solver;
mod splitting;
mod stage;
mod states;
mod stiffness;
mod structure;
mod swelling;
mod thermal;
mod trimming;
mod wvt;

pub use acceptance::{Accepted, Judge, given_and_own};
pub use afc::{AfcOptions, AwayFromClosest, NAME as AFC};
pub use alaric::{Alaric, DAMPED as DAMPED_RELAXATION, NAME as ALARIC};
pub use balance::{BalanceOptions, NAME as BALANCE, PressureBalance};
pub use by_body::ByBody;
pub use certificate::{
    Certificate, CertificateVerdict, HeldBy, Matter, NAME as CERTIFICATE, SETTLING, State, certify, follow, opened,
    settle, space, too_few,
};
pub use conservation::{Drift, conservation};
pub use control::{Control, Event, Step};
pub use fluid::AlaricOptions;
pub use followed::{End, Followed, Point};
pub use hold::Hold;
pub use on_ranks::{OnRanks, OverRanks, agreed_stop};
pub use outside::Field;
pub use pairs::{COINCIDENT, PAIRED, part_pairs, part_pairs_of_block};
pub use report::{Progress, StageName, StageReport, StopReason};
pub use schedule::SolverOptions;
pub(crate) use snapshot::axes;
pub use solver::{DensitySolver, NAME as SOLVER};
pub use sph::sums::{Bias, Weight};
pub use splitting::{children, coarse_count, family, split};
pub use stage::{Keep, Particles, Relaxed, Running, Snapshot, Stage, Start, relax, relax_new};
pub use trimming::{MassTrimming, NAME as TRIMMING, TrimOptions};
pub use wvt::{Holding, NAME as WVT, Others, Wvt, WvtOptions};
