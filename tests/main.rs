//! All integration tests in one binary: it is linked once, and what its modules share is compiled once.
//!
//! ```sh
//! cargo test --test all                    # all of them
//! cargo test --test all seeding::          # one module
//! cargo test --release --test all -- --ignored --nocapture extreme::   # the long ones of a module
//! ```

mod ambient;
mod architecture;
mod balance;
mod blocks;
mod bodies;
mod cases;
mod cli;
mod collisionless;
mod compare;
mod contacts;
mod convert;
mod cores;
mod discs;
mod docs;
mod dust;
mod extreme;
mod fields;
mod figures;
mod follow;
mod gallery;
mod grids;
mod in_turn;
mod lattices;
mod made;
mod magnetic;
mod marks;
mod mass_in_place;
mod meaning;
mod origin;
mod own_files;
mod panel;
mod paper;
mod parity;
mod periodic_grids;
mod pipeline;
mod plan;
mod planets;
mod profile_inputs;
mod random;
mod ranks;
mod ranks_resume;
mod real_inputs;
mod refine;
mod refined;
mod resample;
mod results;
mod resume;
mod roles;
mod scene_text;
mod scenes;
mod seeding;
mod settling;
mod setups;
mod shapes;
mod stages;
mod sums;
mod support;
mod units;
mod walls;
mod zeldovich;
