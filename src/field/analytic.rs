//! Fields stated as expressions.

use super::check::point_text;
use super::quadrature::radical_inverse;
use super::{CarriedField, CarriedInfo, Enclosure, Expression, Patch, ScalarField, Trace};
use crate::error::{Error, Result};
use sph::domain::Domain;
use std::collections::VecDeque;

/// Points at which an expression is tried before it is used.
const PROBES: usize = 4096;
/// Boxes whose bounds are looked at where these all are zero.
const LOOKED_AT: usize = 1 << 17;

/// A density, spacing or number density as an expression.
#[derive(Debug, Clone)]
pub struct AnalyticField<const D: usize> {
    expression: Expression,
    center: [f64; D],
}

impl<const D: usize> AnalyticField<D> {
    /// `key` names the place in the scene; `r` is the distance from `center`.
    ///
    /// # Errors
    /// See [`Expression::parse`].
    pub fn new(key: &str, text: &str, center: [f64; D]) -> Result<Self> {
        Ok(Self::with(Expression::parse(key, text, D)?, center))
    }

    /// `r` of the expression is the distance from `center`; it has no other variables but x, y and z.
    pub(crate) fn with(expression: Expression, center: [f64; D]) -> Self {
        Self { expression, center }
    }

    /// The value of an expression without variables.
    pub(crate) fn constant(&self) -> Option<f64> {
        self.expression.is_constant().then(|| self.expression.evaluate(&self.center, &self.center))
    }

    /// Tries the expression at some thousand points of `domain`, its center and its corners.
    ///
    /// # Errors
    /// A value that is negative or not finite (a pole right at `center` is let pass), or zero at all points.
    pub fn check(&self, domain: &Domain<D>) -> Result<()> {
        let name = self.expression.text();
        let mut positive = false;
        for x in probes(domain) {
            let v = self.expression.evaluate(&x, &self.center);
            let problem = if !v.is_finite() {
                if x == self.center {
                    continue;
                }
                "not finite"
            } else if v < 0.0 {
                "negative"
            } else {
                positive |= v > 0.0;
                continue;
            };
            // No bound makes a number of what is none.
            let remedy = match v {
                v if v.is_nan() => format!("leave such places out, as by if(condition, {name}, 0)"),
                f64::INFINITY => {
                    "bound what it grows with, as in 1/max(r, 0.01), or leave such places out of the domain".to_owned()
                }
                _ => format!("bound it, for instance by max({name}, 0) or if(condition, {name}, 0)"),
            };
            return Err(Error::field(
                name,
                format!(
                    "is {v} at {}, which is {problem}; a density must be finite and not negative within the domain: {remedy}",
                    point_text(&x)
                ),
            ));
        }
        if positive || self.is_somewhere(domain) {
            return Ok(());
        }
        Err(Error::field(
            name,
            format!(
                "is zero at all {PROBES} points tried in the domain, and wherever its bounds were looked at: a domain that is hardly larger than what it \
                 describes shows whether there is anything"
            ),
        ))
    }

    /// Whether there is matter in parts of the domain that points by chance miss: its box is halved where the bounds of the expression leave any.
    fn is_somewhere(&self, domain: &Domain<D>) -> bool {
        let mut boxes = VecDeque::from([(domain.lo, domain.hi)]);
        for _ in 0..LOOKED_AT {
            let Some((lo, hi)) = boxes.pop_front() else { return false };
            let patch = Patch::of_box(lo, hi);
            if self.value(&patch.middle) > 0.0 && domain.region.contains(&patch.middle) {
                return true;
            }
            let has_none = self.enclosure(&patch).is_some_and(|found| found.most <= 0.0);
            if has_none {
                continue;
            }
            let widest = (0..D).fold(0, |best, k| if hi[k] - lo[k] > hi[best] - lo[best] { k } else { best });
            let halved = |corner: [f64; D]| sph::array(|k| if k == widest { patch.middle[k] } else { corner[k] });
            boxes.extend([(lo, halved(hi)), (halved(lo), hi)]);
        }
        false
    }
}

impl<const D: usize> ScalarField<D> for AnalyticField<D> {
    /// 0 where the expression is negative or not finite, which [`AnalyticField::check`] looks for beforehand.
    fn value(&self, x: &[f64; D]) -> f64 {
        let v = self.expression.evaluate(x, &self.center);
        if v > 0.0 && v.is_finite() { v } else { 0.0 }
    }

    /// By the outcomes of all that is discontinuous in the expression, as far as it is evaluated at `x`.
    fn piece(&self, x: &[f64; D]) -> u64 {
        self.value_and_piece(x).1
    }

    fn value_and_piece(&self, x: &[f64; D]) -> (f64, u64) {
        let (v, piece) = self.expression.value_and_piece(x, &self.center);
        if v > 0.0 && v.is_finite() { (v, piece.max(1)) } else { (0.0, 0) }
    }

    fn trace(&self, x: &[f64; D]) -> Trace {
        let mut trace = Trace::new(0, 0);
        let v = self.expression.trace(x, &self.center, &mut trace);
        let is_empty = !(v > 0.0 && v.is_finite());
        trace.kink(f64::from(is_empty));
        trace.piece = if is_empty { 0 } else { trace.piece.max(1) };
        trace
    }

    fn enclosure(&self, patch: &Patch<D>) -> Option<Enclosure> {
        let found = self.expression.enclosure(patch, &self.center);
        Some(found.within(found.least.max(0.0), found.most.max(0.0)))
    }

    fn is_piecewise(&self) -> bool {
        self.expression.is_piecewise()
    }

    fn has_parts(&self) -> bool {
        self.expression.has_parts()
    }

    fn center(&self) -> Option<[f64; D]> {
        self.expression.is_radial().then_some(self.center)
    }
}

/// A carried variable as one expression per component.
#[derive(Debug, Clone)]
pub struct AnalyticCarried<const D: usize> {
    info: CarriedInfo,
    expressions: Vec<Expression>,
    center: [f64; D],
}

impl<const D: usize> AnalyticCarried<D> {
    /// # Errors
    /// A number of components other than 1 or D; see also [`Expression::parse`].
    pub fn new(name: &str, texts: &[&str], center: [f64; D]) -> Result<Self> {
        if texts.len() != 1 && texts.len() != D {
            return Err(Error::scene(
                name,
                format!("has {} components; expected 1 (a scalar) or {D} (a vector)", texts.len()),
            ));
        }
        let expressions = texts.iter().map(|t| Expression::parse(name, t, D)).collect::<Result<Vec<_>>>()?;
        let info = CarriedInfo { name: name.to_owned(), unit: None, components: texts.len() };
        Ok(Self { info, expressions, center })
    }
}

impl<const D: usize> CarriedField<D> for AnalyticCarried<D> {
    fn info(&self) -> &CarriedInfo {
        &self.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        for (v, e) in out.iter_mut().zip(&self.expressions) {
            *v = e.evaluate(x, &self.center);
        }
    }
}

/// Halton points of the bounding box that lie in the region, the box's corners and the region's center.
pub(crate) fn probes<const D: usize>(domain: &Domain<D>) -> Vec<[f64; D]> {
    let extent = domain.extent();
    let place = |u: [f64; D]| -> [f64; D] { sph::array(|k| domain.lo[k] + u[k] * extent[k]) };
    let mut all: Vec<[f64; D]> =
        (1..=PROBES).map(|i| place(sph::array(|k| radical_inverse(i, [2, 3, 5][k])))).collect();
    all.extend((0..1 << D).map(|c: usize| place(sph::array(|k| (c >> k & 1) as f64))));
    all.push(place([0.5; D]));
    if let Some(round) = domain.region.round() {
        // A thin shell would get few of the box's points.
        let d = round.curved() as i32 + 1;
        let mean = round.radius * (0.5 * (1.0 + (round.inner_radius / round.radius).powi(d))).powf(1.0 / f64::from(d));
        let onto = |x: &[f64; D]| Some(round.distance(x)).filter(|r| *r > 0.0).map(|r| round.scaled(x, mean / r));
        let moved: Vec<[f64; D]> = all.iter().filter_map(onto).take(256).collect();
        all.extend(moved);
    }
    all.retain(|x| domain.region.contains(x));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use sph::domain::Wall;

    fn check(text: &str) -> Result<()> {
        AnalyticField::<3>::new("density", text, [0.0; 3])?.check(&Domain::ball([0.0; 3], 1.0, Wall::Open)?)
    }

    #[test]
    fn densities_are_tried_before_use() {
        check("exp(-r^2)").unwrap();
        check("r^-2").unwrap();
        let text = check("x").unwrap_err().to_string();
        assert!(text.contains("negative") && text.contains("max(x, 0)"), "{text}");
        let text = check("1/(r - r)").unwrap_err().to_string();
        assert!(text.contains("not finite") && !text.contains("max(1/(r - r), 0)"), "{text}");
        let text = check("sqrt(x)").unwrap_err().to_string();
        assert!(text.contains("if(condition, sqrt(x), 0)"), "{text}");
        assert!(check("0").unwrap_err().to_string().contains("zero at all"));
    }

    /// In a share of 1e-7 of the domain.
    #[test]
    fn matter_that_no_probe_meets_is_found_by_its_bounds() {
        check("if((x - 0.501)^2 + (y + 0.313)^2 + (z - 0.127)^2 < 0.003^2, 1, 0)").unwrap();
        check("if(r < 0.001, 1, 0)").unwrap();
        check("max(1 - 1e6*((x - 0.501)^2 + (y + 0.313)^2 + (z - 0.127)^2), 0)").unwrap();
        // Beyond the ball, though within its box.
        assert!(check("if((x - 0.9)^2 + (y - 0.9)^2 + (z - 0.9)^2 < 0.003^2, 1, 0)").is_err());
    }

    #[test]
    fn pieces_end_at_discontinuities_and_vacuum_is_the_piece_0() {
        let field = AnalyticField::<2>::new("density", "if(r < 1, 2 - r, if(x > 3, 0, 0.1))", [1.0, 0.0]).unwrap();
        assert!(field.is_piecewise());
        assert_eq!(field.piece(&[1.0, 0.9]), field.piece(&[0.2, 0.0]));
        assert_eq!(field.piece(&[1.0, 1.1]), field.piece(&[-7.0, 0.0]));
        assert_ne!(field.piece(&[1.0, 0.9]), field.piece(&[1.0, 1.1]));
        assert_eq!(field.piece(&[4.0, 0.0]), 0);
        let smooth = AnalyticField::<2>::new("density", "max(1 - r^2, 0)", [0.0; 2]).unwrap();
        assert!(!smooth.is_piecewise());
        assert_eq!([[0.5, 0.0], [0.0, 0.0], [1.0, 1.0]].map(|x| smooth.piece(&x)), [1, 1, 0]);
        let pole = AnalyticField::<1>::new("density", "1/r", [0.0]).unwrap();
        assert_eq!((pole.piece(&[0.0]), pole.piece(&[0.1])), (0, 1));
    }

    #[test]
    fn vectors_have_one_expression_per_component() {
        let field = AnalyticCarried::<2>::new("velocity", &["-y", "x"], [0.0; 2]).unwrap();
        let mut out = [0.0; 2];
        field.evaluate(&[3.0, 4.0], &mut out);
        assert_eq!(out, [-4.0, 3.0]);
        assert!(AnalyticCarried::<3>::new("velocity", &["x", "y"], [0.0; 3]).is_err());
    }
}
