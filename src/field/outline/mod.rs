//! Where a body of particles ends: a smooth surface half a spacing beyond the outermost of them.
//!
//! About a place `x` the particles nearer than their reach `R_j` have the mean offset `m = sum w_j (x_j - x) / sum w_j`, with the
//! weights `w_j = V_j (1 - (|x - x_j| / R_j)^2)^3`, the volume `V_j` of a particle and `R_j = 3 V_j^(1/d)`. Where matter goes on to all
//! sides it is 0; on a plane at which matter ends it is `c_d R` long. The surface is where `|m| = c_d R`, R being the mean reach (the
//! blobs of Zhu & Bridson 2005, ACM Trans. Graph. 24, 965, equations 2 to 5, with volumes as weights, so that it is the
//! same whatever the masses and however steep the density). It evens out steps of less than a reach, as those of a lattice that is cut.
//!
//! Behind a surface that is bent by `K`, the sum of its principal curvatures, the half of the ball that is filled lacks a layer
//! `(k_1 u^2 + k_2 v^2) / 2` thick, which lies in the plane and so changes the sum of the weights, but not that of the offsets: there the
//! mean offset is `c_d R (1 + b_d K R)`. `K` is that of the surface found with `K = 0`, evened out over a reach.
//!
//! Where spacings grow steeply outwards, the outermost particles may be too few to tell of a surface: it has holes, or leaves particles out. Then there
//! is none.
//!
//! Volumes follow from the distance of the `6 (d + 1)` nearest particles, less what of the ball about them is empty: half of it
//! where their mean offset is that of half a ball. Nothing here depends on units, masses or densities.

mod ends;
mod finding;
mod level;

pub(in crate::field) use ends::Ends;
pub(in crate::field) use finding::share;
pub(in crate::field) use level::Outline;
