//! Keys under which the provenance of a particle file is stored.

/// The key of the provenance under which readers of snapshots in several files say which ones those were.
pub const FILES_KEY: &str = "Files";

/// Keys of the provenance under which readers say what in a file contradicts the rest of it, and which data it lacks that codes read.
pub const DOUBT_KEY: &str = "contradiction";
pub const LACKS_KEY: &str = "lacks";

/// The key of the provenance under which readers say that a snapshot's box expands.
pub const COSMOLOGY_KEY: &str = "cosmology";

/// The key of the provenance under which readers say that the gas is cells of a mesh, and [`VORONOI`] that these are the places
/// nearest to each position.
pub const MESH_KEY: &str = "Mesh";
pub const VORONOI: &str = "Voronoi";

/// The key of the provenance under which the gas's adiabatic index is, where that is not [`ADIABATIC_INDEX`](crate::model::ADIABATIC_INDEX).
pub const ADIABATIC_INDEX_KEY: &str = "AdiabaticIndex";

/// The key of the provenance under which a file's gas is said to have no energies of its own.
pub const ISOTHERMAL_KEY: &str = "Isothermal";

/// The key of the provenance under which the constant of gravity of pure numbers is, of matter that attracts itself.
pub const GRAVITY_KEY: &str = "GravitationalConstant";

/// The key of the provenance under which a file's gas is said to be a disc whose temperature is that of its place.
pub const DISC_KEY: &str = "Disc";
