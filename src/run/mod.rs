//! The order of a run: the plan, the stages as planned, checkpoints on the way, and the report at the end. No physics.

pub mod checkpoint;
mod doubts;
mod grading;
mod memory;
pub mod pipeline;
pub mod plan;
pub mod report;
pub mod stages;
pub mod variables;
pub mod verdict;
