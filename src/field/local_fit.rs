//! Polynomials of second degree about a point by weighted least squares, which smooth the noise of the values around it.
//!
//! Offsets are in units of the distance up to which the weights `(1 - (d/R)^2)^2` reach. Where points lie in a plane or on a line, or are too
//! few, the polynomial is of first degree.

use nalgebra::{Cholesky, Const, SMatrix, SVector};

/// Terms in three dimensions.
pub(crate) const MOST_TERMS: usize = 10;

type Row = SVector<f64, MOST_TERMS>;
type Matrix = SMatrix<f64, MOST_TERMS, MOST_TERMS>;

/// A pivot below this share of its column's square belongs to a term that the others nearly make up.
const SMALLEST_PIVOT: f64 = 1e-9;

/// Terms of a polynomial of second degree in `d` dimensions.
pub(crate) const fn terms(d: usize) -> usize {
    (d + 1) * (d + 2) / 2
}

/// 1, the offsets, and their products; the rest is 0.
pub(crate) fn monomials<const D: usize>(offset: &[f64; D]) -> [f64; MOST_TERMS] {
    let mut row = [0.0; MOST_TERMS];
    row[0] = 1.0;
    row[1..=D].copy_from_slice(offset);
    let mut next = D + 1;
    for k in 0..D {
        for l in k..D {
            row[next] = offset[k] * offset[l];
            next += 1;
        }
    }
    row
}

/// Points about a center with their weights, ready for any values on them.
pub(crate) struct Design {
    rows: Vec<Row>,
    weights: Vec<f64>,
    normal: Cholesky<f64, Const<MOST_TERMS>>,
    /// What independent noise of variance 1 leaves in the value at the center.
    pub(crate) variance: f64,
    /// Sum of the weights less what the terms take of it.
    freedom: f64,
}

/// Values about a center.
pub(crate) struct Fit {
    pub(crate) coefficients: [f64; MOST_TERMS],
    /// Variance of what the polynomial leaves; `None` where it goes through all points.
    pub(crate) variance: Option<f64>,
}

impl Design {
    /// Of points by their offsets from the center, in units of the weights' reach; `None` where they do not determine
    /// even a plane.
    pub(crate) fn new<const D: usize>(offsets: &[[f64; D]]) -> Option<Self> {
        [terms(D), D + 1].into_iter().find_map(|used| Self::of_terms(offsets, used))
    }

    fn of_terms<const D: usize>(offsets: &[[f64; D]], used: usize) -> Option<Self> {
        let weight = |x: &[f64; D]| (1.0 - x.iter().map(|v| v * v).sum::<f64>()).max(0.0).powi(2);
        let weights: Vec<f64> = offsets.iter().map(weight).collect();
        if weights.iter().filter(|w| **w > 0.0).count() < used {
            return None;
        }
        let row = |x: &[f64; D]| {
            let mut row = Row::from(monomials(x));
            row.rows_mut(used, MOST_TERMS - used).fill(0.0);
            row
        };
        let rows: Vec<Row> = offsets.iter().map(row).collect();
        let (mut normal, mut squared) = (Matrix::zeros(), Matrix::zeros());
        for (row, &w) in rows.iter().zip(&weights).filter(|(_, w)| **w > 0.0) {
            add_products(row, w, &mut normal, &mut squared);
        }
        // Terms that are not used have equations of their own, with the solution 0.
        (used..MOST_TERMS).for_each(|i| normal[(i, i)] = 1.0);
        normal.fill_upper_triangle_with_lower_triangle();
        squared.fill_upper_triangle_with_lower_triangle();
        let diagonal = normal.diagonal();
        let normal = Cholesky::new(normal)?;
        let factor = normal.l_dirty();
        if (0..used).any(|i| factor[(i, i)].powi(2) <= SMALLEST_PIVOT * diagonal[i]) {
            return None;
        }
        let middle = normal.solve(&Row::from_fn(|i, _| if i == 0 { 1.0 } else { 0.0 }));
        let variance = middle.dot(&(squared * middle));
        let freedom = weights.iter().sum::<f64>() - normal.solve(&squared).trace();
        Some(Self { rows, weights, normal, variance, freedom })
    }

    /// The polynomial through values on the points.
    pub(crate) fn fit(&self, value: impl Fn(usize) -> f64) -> Fit {
        let mut right = Row::zeros();
        for (i, (row, w)) in self.rows.iter().zip(&self.weights).enumerate() {
            right += row * (w * value(i));
        }
        let solution = self.normal.solve(&right);
        let left: f64 = self
            .rows
            .iter()
            .zip(&self.weights)
            .enumerate()
            .map(|(i, (row, w))| w * (value(i) - row.dot(&solution)).powi(2))
            .sum();
        let total: f64 = self.weights.iter().sum();
        let variance = (self.freedom > 1e-3 * total).then(|| left / self.freedom);
        Fit { coefficients: solution.into(), variance }
    }
}

/// Adds the products of the terms of `row` to the lower triangles, with the weight and with its square. By hand: it is most of the work
/// of a fit, and these loops have lengths that the compiler knows.
fn add_products(row: &Row, w: f64, normal: &mut Matrix, squared: &mut Matrix) {
    let weighted = row * w;
    let twice = weighted * w;
    for j in 0..MOST_TERMS {
        for i in j..MOST_TERMS {
            normal[(i, j)] += weighted[j] * row[i];
            squared[(i, j)] += twice[j] * row[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;

    fn offsets<const D: usize>(n: usize) -> Vec<[f64; D]> {
        let mut random = Random::new(3);
        (0..n).map(|_| random.point::<D>().map(|v| 1.2 * v - 0.6)).collect()
    }

    fn meets_quadratics<const D: usize>() {
        let points = offsets::<D>(60);
        let design = Design::new(&points).unwrap();
        let polynomial = |x: &[f64; D]| {
            let sum: f64 = x.iter().enumerate().map(|(k, v)| (k + 1) as f64 * v).sum();
            2.0 + sum + 0.5 * sum * sum
        };
        let fit = design.fit(|i| polynomial(&points[i]));
        assert!(fit.variance.unwrap() < 1e-20);
        let at = [0.3; D];
        let value: f64 = fit.coefficients.iter().zip(monomials(&at)).map(|(c, m)| c * m).sum();
        assert!((value - polynomial(&at)).abs() < 1e-10, "{value}");
    }

    #[test]
    fn quadratics_are_met_in_every_dimension() {
        meets_quadratics::<1>();
        meets_quadratics::<2>();
        meets_quadratics::<3>();
    }

    /// Both variances against those of many sets of noise.
    #[test]
    fn noise_and_what_is_left_of_it_are_known() {
        let points = offsets::<2>(50);
        let design = Design::new(&points).unwrap();
        let mut random = Random::new(9);
        let (mut of_values, mut of_center, sets) = (0.0, 0.0, 4000);
        for _ in 0..sets {
            // Variance 1/12 times 12.
            let noise: Vec<f64> = points.iter().map(|_| 12_f64.sqrt() * (random.unit() - 0.5)).collect();
            let fit = design.fit(|i| noise[i]);
            of_values += fit.variance.unwrap() / f64::from(sets);
            of_center += fit.coefficients[0].powi(2) / f64::from(sets);
        }
        assert!((of_values - 1.0).abs() < 0.03, "{of_values}");
        assert!((of_center / design.variance - 1.0).abs() < 0.08, "{of_center} {}", design.variance);
    }

    #[test]
    fn points_in_a_plane_have_a_plane_and_fewer_nothing() {
        let flat: Vec<[f64; 3]> = offsets::<2>(40).into_iter().map(|p| [p[0], p[1], 0.0]).collect();
        assert!(Design::new(&flat).is_none());
        let few = [[0.0, 0.0], [0.3, 0.0], [0.0, 0.3], [0.2, 0.4]];
        let design = Design::new(&few).unwrap();
        let fit = design.fit(|i| 1.0 + few[i][0] - 2.0 * few[i][1]);
        assert!((fit.coefficients[1] - 1.0).abs() < 1e-10 && (fit.coefficients[2] + 2.0).abs() < 1e-10);
        assert!(Design::new(&few[..2]).is_none());
    }
}
