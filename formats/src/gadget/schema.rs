//! Datasets of the GADGET layout (GADGET-4 `src/io/snap_io.cc`, GIZMO `read_ic.c`).

use crate::common::particle_names as names;
use crate::common::snapshot::{Absent, DatasetSpec, Flavor, SmoothingLength, Storage};

const fn spec(name: &'static str, storage: Storage, components: usize, absent: Absent) -> DatasetSpec {
    DatasetSpec { name, column: name, storage, components, absent }
}

const NO_ENERGY: Absent = Absent::Refuse("set `thermal.internal_energy` in the scene");

pub(super) const FLAVOR: Flavor = Flavor {
    format: "gadget",
    datasets: &[
        spec(names::COORDINATES, Storage::Double, 3, Absent::Refuse("the table has no positions")),
        spec(names::VELOCITIES, Storage::Float, 3, Absent::Zero),
        spec(names::MASSES, Storage::Float, 1, Absent::Refuse("the table has no masses")),
        spec(names::INTERNAL_ENERGY, Storage::Float, 1, NO_ENERGY),
        spec(names::DENSITY, Storage::Float, 1, Absent::Skip),
        spec(names::PARTICLE_IDS, Storage::Identifier, 1, Absent::Refuse("the table has no identifiers")),
    ],
    smoothing_length: SmoothingLength::SupportRadius,
    box_may_differ: false,
};
