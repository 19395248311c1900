//! Spheres, cylinders and sheets in hydrostatic equilibrium by one equation,
//!
//! phi'' + (d - 1)/xi phi' = -f(phi),  phi(0) = phi_0,  phi'(0) = 0,
//!
//! which is that of Lane and Emden for f = theta^n, that of the isothermal gas for f = e^-psi with phi = -psi, and that of
//! Chandrasekhar's white dwarfs for f = (y^2 - 1)^(3/2) (Chandrasekhar 1939, An Introduction to the Study of Stellar Structure,
//! chapters IV and XI; cylinders: Ostriker 1964, ApJ 140, 1056).

use crate::ode;

/// Steps over which the radius grows by the scale of the center, or by itself farther out. The error of Runge-Kutta 4 is
/// some 1e-13 then, and cubics between the steps are as good as 1e-9.
const STEPS: f64 = 1000.0;
/// Larger ones are of a body without a surface.
const MOST_STEPS: usize = 60_000;

/// Part of the distance to the surface that a step towards it takes, and how many there are.
const APPROACH: f64 = 0.16;
const APPROACHES: usize = 160;
/// Steps by all of the distance after them; each squares it.
const REFINEMENTS: usize = 8;

/// The equation to be solved.
pub(super) struct Emden<'a> {
    pub dimension: usize,
    pub source: &'a dyn Fn(f64) -> f64,
    pub center: f64,
    /// Where the body ends.
    pub end: End,
}

/// Where a solution ends.
#[derive(Clone, Copy)]
pub(super) enum End {
    /// At this value of phi.
    Surface(f64),
    Radius(f64),
}

/// Where a solution is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point {
    pub xi: f64,
    pub phi: f64,
    /// -phi'.
    pub slope: f64,
}

impl Point {
    /// xi^(d-1) (-phi'), the integral of f xi^(d-1).
    pub fn mass(&self, d: usize) -> f64 {
        self.xi.powi(d as i32 - 1) * self.slope
    }
}

impl Emden<'_> {
    fn step(&self, from: Point, h: f64) -> Point {
        let d = self.dimension as f64;
        let slopes = |xi: f64, [phi, slope]: [f64; 2]| {
            let f = (self.source)(phi);
            // Near the center -phi' is f xi / d.
            let curvature = if xi > 0.0 { f - (d - 1.0) * slope / xi } else { f / d };
            [-slope, curvature]
        };
        let [phi, slope] = ode::step(from.xi, [from.phi, from.slope], h, slopes);
        Point { xi: from.xi + h, phi, slope }
    }

    /// Points from the center to the end; `None` where there is no end within reach.
    pub fn solve(&self) -> Option<Vec<Point>> {
        let (mut points, near) = self.parts()?;
        points.extend(near.last());
        Some(points)
    }

    /// The same with points ever nearer to the surface, for densities that end there with a slope that knows no bound.
    pub fn solve_closely(&self) -> Option<Vec<Point>> {
        let (mut points, near) = self.parts()?;
        points.extend(near);
        Some(points)
    }

    /// Points from the center on, and those of the approach to the surface, if that is where the solution ends.
    fn parts(&self) -> Option<(Vec<Point>, Vec<Point>)> {
        let d = self.dimension as f64;
        let fall = if let End::Surface(surface) = self.end { self.center - surface } else { 1.0 };
        let scale = (2.0 * d * fall / (self.source)(self.center)).sqrt();
        if !(scale.is_finite() && scale > 0.0) {
            return None;
        }
        let mut points = vec![Point { xi: 0.0, phi: self.center, slope: 0.0 }];
        let mut last = points[0];
        while points.len() < MOST_STEPS {
            let h = (scale + last.xi) / STEPS;
            let next = match self.end {
                End::Radius(outer) => self.step(last, h.min(outer - last.xi)),
                End::Surface(_) => self.step(last, h),
            };
            match self.end {
                End::Surface(surface) if !(next.phi > surface) => {
                    return Some((points, self.approach(last, surface)));
                }
                End::Radius(outer) if next.xi >= outer * (1.0 - 1e-12) => {
                    points.push(Point { xi: outer, ..next });
                    return Some((points, Vec::new()));
                }
                _ => {}
            }
            points.push(next);
            last = next;
        }
        None
    }

    /// Points on the way to the surface, ever nearer to it, and the one on it; phi falls all the way. One step would not follow a source that
    /// vanishes there with a slope that knows no bound.
    fn approach(&self, mut last: Point, surface: f64) -> Vec<Point> {
        let mut points = Vec::new();
        for step in 0.. {
            // By Newton; a part of it does not pass the surface.
            let left = (last.phi - surface) / last.slope;
            if step == APPROACHES + REFINEMENTS || !(left.abs() > 1e-15 * last.xi) {
                break;
            }
            let part = if step < APPROACHES { APPROACH } else { 1.0 };
            last = self.step(last, part * left);
            points.push(last);
        }
        points.push(Point { phi: surface, ..last });
        points.retain(|p| p.phi > surface || p.phi == surface && p.xi == last.xi);
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polytrope(d: usize, n: f64) -> Point {
        let source = |theta: f64| theta.max(0.0).powf(n);
        *Emden { dimension: d, source: &source, center: 1.0, end: End::Surface(0.0) }.solve().unwrap().last().unwrap()
    }

    /// Chandrasekhar (1939), table 4: xi_1 and -xi_1^2 theta'(xi_1); n = 0 and 1 in closed form, 0.5 as in Horedt (1986, Ap&SS 126, 357).
    #[test]
    fn polytropes_end_where_tables_say() {
        let pi = std::f64::consts::PI;
        for (n, surface, mass) in [
            (0.0, 6f64.sqrt(), 2.0 * 6f64.sqrt()),
            (0.5, 2.752_70, 3.788_65),
            (1.0, pi, pi),
            (1.5, 3.65375, 2.71406),
            (2.0, 4.35287, 2.41105),
            (3.0, 6.89685, 2.01824),
            (4.0, 14.97155, 1.79723),
            (4.5, 31.83646, 1.73780),
        ] {
            let end = polytrope(3, n);
            assert!((end.xi / surface - 1.0).abs() < 2e-5, "n = {n}: xi_1 = {}", end.xi);
            assert!((end.mass(3) / mass - 1.0).abs() < 2e-5, "n = {n}: mass {}", end.mass(3));
        }
    }

    /// The first zero of J0, and cos.
    #[test]
    fn cylinders_and_sheets_end_where_closed_forms_say() {
        assert!((polytrope(2, 1.0).xi - 2.404_825_557_695_773).abs() < 1e-9);
        assert!((polytrope(2, 1.0).slope - 0.519_147_497_289_467).abs() < 1e-9);
        assert!((polytrope(1, 1.0).xi - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
        assert!((polytrope(2, 0.0).xi - 2.0).abs() < 1e-9);
    }

    /// The critical Bonnor-Ebert sphere: xi = 6.451, rho_c / rho = 14.04, xi^2 psi' = 15.70.
    #[test]
    fn the_isothermal_sphere_is_that_of_bonnor_and_ebert() {
        let source = |phi: f64| phi.exp();
        let points = Emden { dimension: 3, source: &source, center: 0.0, end: End::Radius(6.451) }.solve().unwrap();
        let end = points.last().unwrap();
        assert!(((-end.phi).exp() / 14.04 - 1.0).abs() < 1e-3, "{end:?}");
        assert!((end.mass(3) / 15.70 - 1.0).abs() < 1e-3, "{end:?}");
        // Isothermal cylinders in closed form: rho = (1 + xi^2/8)^-2.
        let points = Emden { dimension: 2, source: &source, center: 0.0, end: End::Radius(5.0) }.solve().unwrap();
        for p in points.iter().step_by(100) {
            assert!((p.phi.exp() * (1.0 + p.xi * p.xi / 8.0).powi(2) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn bodies_without_a_surface_are_told() {
        let source = |theta: f64| theta.max(0.0).powi(5);
        let plummer = Emden { dimension: 3, source: &source, center: 1.0, end: End::Surface(0.0) };
        assert!(plummer.solve().is_none());
    }
}
