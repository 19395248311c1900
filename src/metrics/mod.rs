//! Measures of the result: density error, mass ledger, force noise, neighbor numbers, isotropy.
//!
//! Measures use the domain as it is: open faces are vacuum, reflecting ones and reflecting surfaces mirror.

mod balance;
mod centers;
mod density_error;
mod density_fold;
mod detail;
mod isotropy;
mod ledger;
mod measured;
mod minimum;
mod neighbors;
mod noise;
mod outcome;
mod own_units;
mod patches;
mod quality;
mod smoothed;
mod wholes;

pub(crate) use balance::strengths;
pub use balance::{BalanceFigures, NetForce, Thermodynamics, mean_net_force};
pub use density_error::{DensityError, ErrorFigures};
pub use density_fold::{DensityFold, FiguresFold, Ratios};
pub use detail::{Detail, Wanted};
pub use isotropy::BondOrder;
pub use ledger::{IN_PLACE, Ledger, LedgerFigures, LedgerLevel, LedgerOf, RegionFigures};
pub use measured::Measured;
pub use minimum::lowest_epsilon;
pub use neighbors::NeighborFigures;
pub use noise::{NoiseFigures, NoiseParts, poisson_force};
pub use outcome::Outcome;
pub use own_units::{InOwnUnits, Stated};
pub use patches::{PatchFigures, Patches};
pub use quality::{Aim, Quality};
pub(crate) use quality::{BIAS, least_closest_pair};
pub(crate) use smoothed::{Looking, smoothed_densities};
pub use wholes::Moving;
