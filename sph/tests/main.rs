//! Tests of the core as its users see it. They are a program of their own, so that the passes over neighbors, which are
//! long to compile, are not compiled once more for tests within the crate.

mod domain;
mod edges;
mod exchange;
mod gravity;
mod groups;
mod halo;
mod kernels;
mod lanes;
mod nearest;
mod parallel;
mod point_mass;
mod reached;
mod reduce;
