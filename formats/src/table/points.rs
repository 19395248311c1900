//! Tables over x, y, z: grids if the points fill one, clouds otherwise.

/// Points that fill a rectilinear grid.
pub struct Arrangement {
    /// Strictly ascending positions on each axis.
    pub axes: Vec<Vec<f64>>,
    /// Row of each grid point, the first axis running fastest.
    pub rows: Vec<usize>,
}

/// Finds the grid that the rows fill, each point once, in whatever order they come; `None` where there is none.
pub fn arrange(coordinates: &[&[f64]]) -> Option<Arrangement> {
    let count = coordinates.first()?.len();
    let axes: Vec<Vec<f64>> = coordinates.iter().map(|values| distinct(values)).collect();
    let size = axes.iter().try_fold(1_usize, |size, axis| size.checked_mul(axis.len()))?;
    if size != count || axes.iter().any(|axis| axis.len() < 2) {
        return None;
    }
    let mut rows = vec![usize::MAX; count];
    for row in 0..count {
        let mut index = 0;
        for (axis, values) in axes.iter().zip(coordinates).rev() {
            // Zero may have a sign, which total_cmp tells apart.
            let value = values.get(row)? + 0.0;
            index = index * axis.len() + axis.binary_search_by(|a| a.total_cmp(&value)).ok()?;
        }
        let slot = rows.get_mut(index)?;
        if *slot != usize::MAX {
            return None;
        }
        *slot = row;
    }
    Some(Arrangement { axes, rows })
}

/// Distinct values, ascending.
pub fn distinct(values: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.iter().map(|v| v + 0.0).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.dedup();
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_are_found_in_any_order_of_rows() {
        let (x, y) = ([1.0, 0.0, 1.0, 0.0, 0.0, 1.0], [5.0, 5.0, 7.0, 9.0, 7.0, 9.0]);
        let found = arrange(&[&x, &y]).unwrap();
        assert_eq!(found.axes, [vec![0.0, 1.0], vec![5.0, 7.0, 9.0]]);
        assert_eq!(found.rows, [1, 0, 4, 2, 3, 5]);
    }

    #[test]
    fn gaps_and_repeats_are_no_grid() {
        assert!(arrange(&[&[0.0, 1.0, 0.0, 1.0], &[0.0, 0.0, 1.0, 1.5]]).is_none());
        assert!(arrange(&[&[0.0, 1.0, 0.0, 0.0], &[0.0, 0.0, 1.0, 1.0]]).is_none());
        assert!(arrange(&[&[0.0, 0.0]]).is_none());
        assert!(arrange(&[&[-0.0, 1.0]]).is_some());
        assert!(arrange(&[]).is_none());
    }
}
