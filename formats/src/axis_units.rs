//! One unit of length for all axes of a grid.

use crate::model::{Coordinates, Geometry, GridAxis, RawField};
use crate::units::{Unit, UnitDimension};

/// Takes all lengths along a field's axes into the unit of the first that states one, and notes what was changed.
pub(crate) fn unify(field: &mut RawField) {
    let Geometry::Grid { coordinates, axes } = &mut field.geometry else { return };
    let Some((first, unit)) = axes.iter().find_map(|a| Some((a.name.clone(), length_of(a)?))) else { return };
    for axis in axes.iter_mut() {
        match length_of(axis) {
            Some(own) if own.to_cgs != unit.to_cgs => {
                let factor = own.to_cgs / unit.to_cgs;
                axis.nodes.iter_mut().chain(axis.bounds.iter_mut().flatten()).for_each(|x| *x *= factor);
                axis.unit = Some(unit.clone());
                field.notes.push(format!(
                    "axis '{}' is in {}, and was taken into {}, the unit of axis '{first}'",
                    axis.name, own.symbol, unit.symbol
                ));
            }
            None if axis.unit.is_none() && *coordinates == Coordinates::Cartesian => field.notes.push(format!(
                "axis '{}' states no unit, and is taken to be in {}, the unit of axis '{first}'",
                axis.name, unit.symbol
            )),
            _ => {}
        }
    }
}

fn length_of(axis: &GridAxis) -> Option<Unit> {
    axis.unit.clone().filter(|unit| unit.dimension == UnitDimension::LENGTH)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(name: &str, unit: Option<&str>, bounds: bool) -> GridAxis {
        let nodes = vec![1.0, 2.0, 3.0];
        GridAxis {
            name: name.into(),
            nodes,
            unit: unit.and_then(Unit::parse),
            bounds: bounds.then(|| vec![0.5, 1.5, 2.5, 3.5]),
        }
    }

    fn unified(coordinates: Coordinates, axes: Vec<GridAxis>) -> (Vec<GridAxis>, Vec<String>) {
        let mut field = RawField {
            path: "grid.nc".into(),
            format: "netcdf",
            geometry: Geometry::Grid { coordinates, axes },
            variables: Vec::new(),
            density: None,
            metadata: Vec::new(),
            notes: Vec::new(),
        };
        unify(&mut field);
        let Geometry::Grid { axes, .. } = field.geometry else { panic!() };
        (axes, field.notes)
    }

    #[test]
    fn all_lengths_are_in_the_unit_of_the_first() {
        let given = vec![axis("x", Some("km"), false), axis("y", Some("m"), true), axis("z", None, false)];
        let (axes, notes) = unified(Coordinates::Cartesian, given);
        assert_eq!(axes[0].nodes, [1.0, 2.0, 3.0]);
        assert_eq!(axes[1].nodes, [1e-3, 2e-3, 3e-3]);
        assert_eq!(axes[1].bounds.as_deref().unwrap()[3], 3.5e-3);
        assert_eq!(axes[1].unit.as_ref().unwrap().symbol, "km");
        assert_eq!(notes.len(), 2);
        assert!(notes[0].contains("'y' is in m") && notes[1].contains("'z' states no unit"), "{notes:?}");
    }

    #[test]
    fn angles_and_like_units_stay() {
        let given = vec![axis("R", Some("cm"), false), axis("phi", None, false), axis("z", Some("cm"), false)];
        let (axes, notes) = unified(Coordinates::Polar, given);
        assert!(axes.iter().all(|axis| axis.nodes == [1.0, 2.0, 3.0]) && notes.is_empty(), "{notes:?}");
        let bare = vec![axis("x", None, false), axis("y", None, false)];
        assert!(unified(Coordinates::Cartesian, bare).1.is_empty());
    }
}
