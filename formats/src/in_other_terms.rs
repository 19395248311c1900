//! Transforms particles to another origin or to other units.

use crate::model::{Column, ParticleFile, Values};
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

    /// Puts a body together that lies across faces of a periodic box, each of its particles being the image that is nearest to its middle; what
    /// fills an axis of the box stays.
    pub fn join_images(&mut self) {
        let (periodic, edges) = (self.header.periodic, self.header.box_size);
        for k in (0..self.header.dimension).filter(|&k| periodic[k] && edges[k] > 0.0) {
            let turn = std::f64::consts::TAU / edges[k];
            let (mut sum, mut count) = ([0.0; 2], 0_usize);
            for column in self.coordinates() {
                let d = column.components;
                for i in (k..column.values.len()).step_by(d) {
                    let (sin, cos) = (turn * column.values.get(i)).sin_cos();
                    (sum, count) = ([sum[0] + cos, sum[1] + sin], count + 1);
                }
            }
            if !(sum[0].hypot(sum[1]) > COMPACT * count as f64) {
                continue;
            }
            let middle = sum[1].atan2(sum[0]) / turn;
            for column in self.coordinates() {
                let d = column.components;
                let nearest = |i: usize| {
                    let x = column.values.get(i);
                    if i % d == k { x - edges[k] * ((x - middle) / edges[k]).round() } else { x }
                };
                column.values = Values::F64((0..column.values.len()).map(nearest).collect());
            }
        }
    }

    fn coordinates(&mut self) -> impl Iterator<Item = &mut Column> {
        let columns = self.species.iter_mut().flat_map(|s| &mut s.table.columns);
        columns.filter(|c| c.name == crate::particle_names::COORDINATES && c.components > 0)
    }
}

/// Length of the mean of unit vectors, by places on the circle that an axis is, from which on particles are together: 0 of what fills it.
const COMPACT: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{ParticleTable, RunHeader, Species};

    fn file(places: &[f64]) -> ParticleFile {
        let column = Column::new("Coordinates", 2, Values::F64(places.to_vec()), UnitDimension::LENGTH);
        let header = RunHeader {
            dimension: 2,
            box_size: [10.0, 4.0, 0.0],
            box_corner: None,
            periodic: [true, true, false],
            units: UnitSystem::CODE,
            time: 0.0,
            kernel: String::new(),
            kernel_neighbors: 0.0,
            provenance: Vec::new(),
            layouts: Vec::new(),
        };
        let table = ParticleTable { count: places.len() / 2, columns: vec![column] };
        ParticleFile { header, species: vec![Species { part_type: 0, table }] }
    }

    #[test]
    fn a_body_across_a_face_is_put_together_and_what_fills_the_box_stays() {
        // Along x about the face, along y all around.
        let mut file = file(&[9.5, 0.5, 0.5, 1.5, 9.0, 2.5, 1.0, 3.5]);
        file.join_images();
        let found = file.species[0].table.columns[0].values.to_f64();
        let x: Vec<f64> = found.chunks(2).map(|x| x[0]).collect();
        let apart = x.iter().map(|y| y - x[0]).collect::<Vec<f64>>();
        assert_eq!(apart, [0.0, 1.0, -0.5, 1.5]);
        assert_eq!(found.chunks(2).map(|x| x[1]).collect::<Vec<f64>>(), [0.5, 1.5, 2.5, 3.5]);
    }
}
