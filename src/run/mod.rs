//! The order of a run: the plan, the stages as planned, checkpoints on the way, and the report at the end. No physics.

mod ambient;
pub(crate) mod assembly;
pub mod bodies;
pub mod bodies_report;
pub(crate) mod cache;
mod carving;
mod certifying;
pub(crate) mod checkpoint;
mod checkpoint_file;
mod checkpoint_parts;
pub(crate) mod destination;
mod doubts;
pub(crate) mod drawings;
pub mod duration;
mod dust;
pub(crate) mod fingerprint;
pub mod forecast;
mod gathered;
mod grading;
pub mod in_turn;
mod layer;
mod memory;
pub mod orbit;
mod overlap;
#[cfg(feature = "plots")]
pub(crate) mod page;
#[cfg(feature = "plots")]
mod page_of_bodies;
mod pages;
mod parts;
pub mod pipeline;
pub mod plan;
pub mod rank_forecast;
pub mod ranks;
mod refining;
pub mod remarks;
mod renewed;
pub mod replicate;
pub mod report;
pub mod seeds;
mod settling;
mod shares;
pub(crate) mod stages;
pub(crate) mod streamed;
pub mod variables;
pub mod verdict;
