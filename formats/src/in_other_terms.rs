//! The same particles in other terms: counted from another point, or in other units.

use crate::model::{ParticleFile, Values};
use crate::units::{UnitDimension, UnitSystem};

impl ParticleFile {
    /// Counts coordinates from the lower corner of the box, where its place was chosen.
    pub fn move_corner_to_origin(&mut self) {
        let Some(corner) = self.header.box_corner.take() else { return };
        for column in self.species.iter_mut().flat_map(|s| &mut s.table.columns) {
            if column.name == crate::particle_names::COORDINATES {
                let (d, values) = (column.components.max(1), &column.values);
                let moved = |i: usize| values.get(i) - corner.get(i % d).copied().unwrap_or(0.0);
                column.values = Values::F64((0..values.len()).map(moved).collect());
            }
        }
    }

    /// Expresses all numbers in other units.
    pub fn change_units(&mut self, to: UnitSystem) {
        let from = self.header.units;
        let factor = |d: UnitDimension| from.to_cgs(d) / to.to_cgs(d);
        for column in self.species.iter_mut().flat_map(|s| &mut s.table.columns) {
            let f = factor(column.dimension);
            if f != 1.0 {
                column.values = Values::F64((0..column.values.len()).map(|i| f * column.values.get(i)).collect());
            }
        }
        let corner = self.header.box_corner.iter_mut().flatten();
        self.header.box_size.iter_mut().chain(corner).for_each(|l| *l *= factor(UnitDimension::LENGTH));
        self.header.time *= factor(UnitDimension::TIME);
        self.header.units = to;
    }
}
