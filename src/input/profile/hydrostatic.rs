//! Gas at rest in the gravity of others and its own: its temperature by radius or by density determines its density,
//!
//! dP/dr = -rho G (M(r) + m(r)) / r^2,  dm/dr = 4 pi r^2 rho,
//!
//! with the mass M of others and m of the gas. It is followed outward by Runge-Kutta, with P/P_c as exp(y), or, where P = K rho^(1 + 1/n), by the
//! specific enthalpy h = (n + 1) P/rho, which falls as the potential rises. Central values are those with which the gas has its mass, and,
//! where nothing says how hot it is, ends at the outer radius.

use super::table::Table;
use super::well::Well;
use crate::ode;
use crate::roots::root;
use crate::scene::HydrostaticInput;
use std::f64::consts::PI;

/// Steps over which the radius grows by itself.
const STEPS: f64 = 200.0;
/// Steps grow from this part of the outer radius, unless the density asks for shorter ones.
const FIRST: f64 = 1e-6;
/// Of y, or of h in itself, over a step.
const LARGEST_CHANGE: f64 = 0.02;
/// A surface is reached where so small a part of its radius is left: steps towards it are a hundredth of that, which must not be lost in rounding.
const AT_SURFACE: f64 = 1e-12;
/// Shorter steps, as parts of the outer radius, are of a well without a bottom.
const SHORTEST: f64 = 1e-14;
/// More are of gas whose density falls by more than any code can follow.
const MOST_STEPS: usize = 60_000;
/// By how much a central density grows until the mass is large enough, and how often at most.
const GROWTH: f64 = 1.2;
const MOST_GROWTHS: usize = 400;
/// A bracket that narrows to the largest mass: thirds, so often.
const NARROWINGS: usize = 60;

/// A solution whose mass is another is none.
const MASS_TOLERANCE: f64 = 1e-9;
/// Masses and ends that are off by less are what is looked for: closer ones are lost in rounding.
const CLOSE: [f64; 2] = [1e-11, 1e-12];

/// What relates pressure and density.
pub(super) enum Heat<'a> {
    /// sqrt(P/rho) by radius.
    Speeds(&'a dyn Fn(f64) -> f64),
    /// n of P = K rho^(1 + 1/n).
    Polytrope(f64),
}

/// The gas but for its central values.
pub(super) struct Gas<'a> {
    pub gravity: f64,
    pub well: &'a Well,
    pub feels_itself: bool,
    pub outer: f64,
    pub heat: Heat<'a>,
}

/// Why there is no such gas.
#[derive(Debug, PartialEq)]
pub(super) enum Refusal {
    /// Nothing is felt where it becomes ever denser inward.
    Bottomless,
    /// Its density falls over too many decades.
    TooSteep,
    /// The largest mass that can be held up.
    TooHeavy(f64),
    /// It does not end at any radius.
    Endless,
}

impl Refusal {
    /// The key of what is wrong with gas of this mass, and the problem.
    pub fn explain(&self, input: &HydrostaticInput, mass: f64) -> (&'static str, String) {
        let heat = if input.sound_speed.is_some() { "sound_speed" } else { "n" };
        match self {
            Self::Bottomless => {
                let problem = "lets the gas fall without end towards a point mass; give that a `softening_radius`";
                (heat, problem.to_owned())
            }
            Self::TooSteep => {
                let problem = "makes a density that falls over more decades than particles can follow; expected a hotter gas, or a smaller outer_radius";
                (heat, problem.to_owned())
            }
            Self::TooHeavy(most) => {
                let problem = format!(
                    "is {}, but the pressure holds up {:.4e} of that at most; expected less, or a hotter gas",
                    input.mass,
                    most / mass
                );
                ("mass", problem)
            }
            Self::Endless => {
                let n = input.n.unwrap_or_default();
                (
                    "n",
                    format!(
                        "is {n}, with which the gas does not end at any radius; expected less than 5, or a sound_speed"
                    ),
                )
            }
        }
    }
}

/// Central density, and h there (1 where y counts).
#[derive(Clone, Copy)]
struct Center {
    density: f64,
    height: f64,
}

#[derive(Clone, Copy)]
struct Row {
    r: f64,
    /// y or h.
    height: f64,
    mass: f64,
}

impl Gas<'_> {
    /// The gas of this mass. A polytrope has the sound speed `central` in its center, or, without one, its surface at the outer radius.
    pub fn table(&self, mass: f64, central: Option<f64>) -> Result<Table, Refusal> {
        let (center, mut rows) = match (&self.heat, central) {
            (Heat::Polytrope(_), None) => self.with_surface(mass)?,
            (Heat::Polytrope(n), Some(speed)) => self.with_mass(mass, (n + 1.0) * speed * speed)?,
            (Heat::Speeds(_), _) => self.with_mass(mass, 1.0)?,
        };
        let found = rows.last().map_or(0.0, |row| row.mass);
        if !((found / mass - 1.0).abs() < MASS_TOLERANCE) {
            return Err(Refusal::TooSteep);
        }
        if let (Some(last), (Heat::Polytrope(_), None)) = (rows.last_mut(), (&self.heat, central)) {
            last.r = self.outer;
        }
        let state = |row: &Row| {
            let density = self.density(center, row.r, row.height);
            let specific = match &self.heat {
                Heat::Speeds(speed) => speed(row.r.max(self.innermost())).powi(2),
                Heat::Polytrope(n) => row.height / (n + 1.0),
            };
            (density, density * specific)
        };
        let (density, pressure) = rows.iter().map(state).unzip();
        Ok(Table {
            radii: rows.iter().map(|row| row.r).collect(),
            density,
            pressure: Some(pressure),
            ..Table::default()
        })
    }

    /// In place of the center, where a speed may have a pole.
    fn innermost(&self) -> f64 {
        SHORTEST * self.outer
    }

    fn density(&self, center: Center, r: f64, height: f64) -> f64 {
        match &self.heat {
            Heat::Speeds(speed) => {
                let [at, there] = [self.innermost(), r.max(self.innermost())].map(speed);
                center.density * (at / there).powi(2) * height.exp()
            }
            Heat::Polytrope(n) => center.density * (height.max(0.0) / center.height).powf(*n),
        }
    }

    /// d(height)/dr and dm/dr.
    fn slopes(&self, center: Center, row: Row) -> [f64; 2] {
        let r = row.r.max(self.innermost());
        let others = self.well.mass(r);
        let own = if self.feels_itself { row.mass } else { 0.0 };
        let pull = self.gravity * (others + own) / (r * r);
        let fall = match &self.heat {
            Heat::Speeds(speed) => pull / speed(r).powi(2),
            Heat::Polytrope(_) => pull,
        };
        [-fall, 4.0 * PI * row.r * row.r * self.density(center, row.r, row.height)]
    }

    fn step(&self, center: Center, from: Row, h: f64) -> Row {
        let slopes = |r: f64, [height, mass]: [f64; 2]| self.slopes(center, Row { r, height, mass });
        let [height, mass] = ode::step(from.r, [from.height, from.mass], h, slopes);
        Row { r: from.r + h, height, mass }
    }

    /// Rows from the center to the outer radius, or to where h is 0 before.
    fn rows(&self, center: Center) -> Result<Vec<Row>, Refusal> {
        let is_polytrope = matches!(self.heat, Heat::Polytrope(_));
        let height = if is_polytrope { center.height } else { 0.0 };
        let mut last = Row { r: 0.0, height, mass: 0.0 };
        let mut rows = vec![last];
        while last.r < self.outer {
            if rows.len() > MOST_STEPS {
                return Err(Refusal::TooSteep);
            }
            if is_polytrope {
                let left = -last.height / self.slopes(center, last)[0];
                if left <= AT_SURFACE * last.r {
                    let end = Row { r: last.r + left, height: 0.0, ..last };
                    rows.pop();
                    rows.push(end);
                    break;
                }
            }
            let most = if is_polytrope { LARGEST_CHANGE * last.height } else { LARGEST_CHANGE };
            let mut h = ((FIRST * self.outer + last.r) / STEPS).min(self.outer - last.r);
            last = loop {
                let next = self.step(center, last, h);
                if (next.height - last.height).abs() <= most {
                    break next;
                }
                h *= 0.5;
                if h < SHORTEST * self.outer && last.r < FIRST * self.outer {
                    return Err(Refusal::Bottomless);
                }
                if !(last.r + h > last.r) {
                    return Err(Refusal::TooSteep);
                }
            };
            if last.r > self.outer * (1.0 - AT_SURFACE) {
                last.r = self.outer;
            }
            rows.push(last);
        }
        Ok(rows)
    }

    /// The mass of some central values, and the rows that have it.
    fn weighed(&self, center: Center) -> Result<(f64, Vec<Row>), Refusal> {
        let rows = self.rows(center)?;
        Ok((rows.last().map_or(0.0, |row| row.mass), rows))
    }

    /// The gas of this mass and central h: of several solutions the one with the smallest central density, which is stable, or nearest to that.
    fn with_mass(&self, mass: f64, height: f64) -> Result<(Center, Vec<Row>), Refusal> {
        let at = |density: f64| Center { density, height };
        let light = Gas { feels_itself: false, heat: self.heat.borrowed(), ..*self };
        // Without its own gravity the mass is in proportion to the density, and with it less.
        let mut density = mass / light.weighed(at(1.0))?.0;
        if !self.feels_itself {
            return Ok((at(density), self.rows(at(density))?));
        }
        let excess = |density: f64| {
            let found = self.weighed(at(density)).map_or(f64::NAN, |(found, _)| found);
            unless_close(found / mass - 1.0, CLOSE[0])
        };
        let mut low = (density, self.weighed(at(density))?.0 / mass - 1.0);
        for _ in 0..MOST_GROWTHS {
            if low.1 >= 0.0 {
                break;
            }
            density *= GROWTH;
            let mut high = (density, excess(density));
            if !(high.1 > low.1) {
                high = highest(&excess, low.0 / GROWTH, density);
                if !(high.1 > 0.0) {
                    return Err(Refusal::TooHeavy(mass * (1.0 + high.1)));
                }
            }
            if high.1 >= 0.0 {
                density = root(&excess, low, high);
                return Ok((at(density), self.rows(at(density))?));
            }
            low = high;
        }
        if low.1 >= 0.0 { Ok((at(density), self.rows(at(density))?)) } else { Err(Refusal::TooSteep) }
    }

    /// The polytrope of this mass that ends at the outer radius.
    fn with_surface(&self, mass: f64) -> Result<(Center, Vec<Row>), Refusal> {
        let depth = self.depth()?;
        let found = |density: f64| -> Result<(Center, Vec<Row>), Refusal> {
            let center = Center { density, height: self.height_to_end(density, depth)? };
            Ok((center, self.rows(center)?))
        };
        let excess = |density: f64| {
            let ended = found(density).map_or(f64::NAN, |(_, rows)| rows.last().map_or(0.0, |row| row.mass));
            unless_close(ended / mass - 1.0, CLOSE[0])
        };
        // The density is largest in the center.
        let mut low = mass / (4.0 / 3.0 * PI * self.outer.powi(3));
        found(low)?;
        let mut before = (low, excess(low));
        for _ in 0..MOST_GROWTHS {
            if before.1 >= 0.0 {
                break;
            }
            low *= 2.0;
            let next = (low, excess(low));
            if next.1 >= 0.0 {
                return found(root(&excess, before, next));
            }
            if next.1.is_nan() {
                found(low)?;
            }
            before = next;
        }
        if before.1 >= 0.0 { found(before.0) } else { Err(Refusal::TooSteep) }
    }

    /// By how much the potential of others rises to the outer radius.
    fn depth(&self) -> Result<f64, Refusal> {
        if self.well.is_empty() {
            return Ok(0.0);
        }
        // An isothermal gas of any speed knows it; steps are as short as that of the well's own scale.
        let speed = (self.gravity * self.well.mass(self.outer) / self.outer).sqrt();
        let everywhere = |_: f64| speed;
        let alone = Gas { feels_itself: false, heat: Heat::Speeds(&everywhere), ..*self };
        let rows = alone.rows(Center { density: 1.0, height: 1.0 })?;
        Ok(-speed * speed * rows.last().map_or(0.0, |row| row.height))
    }

    /// The central h with which a polytrope of this central density ends at the outer radius.
    fn height_to_end(&self, density: f64, depth: f64) -> Result<f64, Refusal> {
        if !self.feels_itself {
            return Ok(depth);
        }
        let beyond = |height: f64| {
            let end = self.rows(Center { density, height }).ok().and_then(|rows| rows.last().copied());
            let off = end
                .map_or(f64::NAN, |end| if end.height > 0.0 { end.height / height } else { end.r / self.outer - 1.0 });
            unless_close(off, CLOSE[1])
        };
        // A sphere of the central density has the deepest potential.
        let most = 2.0 / 3.0 * PI * self.gravity * density * self.outer * self.outer;
        let mut high = (depth + most, beyond(depth + most));
        let mut share = 0.5;
        for _ in 0..NARROWINGS {
            let low = depth + share * most;
            let value = beyond(low);
            if value < 0.0 {
                return Ok(root(&beyond, (low, value), high));
            }
            if value.is_nan() {
                return self.rows(Center { density, height: low }).map(|_| low);
            }
            high = (low, value);
            share *= 0.5;
        }
        if depth > 0.0 { Ok(depth) } else { Err(Refusal::Endless) }
    }
}

impl Heat<'_> {
    fn borrowed(&self) -> Heat<'_> {
        match self {
            Self::Speeds(speed) => Heat::Speeds(speed),
            Self::Polytrope(n) => Heat::Polytrope(*n),
        }
    }
}

fn unless_close(value: f64, tolerance: f64) -> f64 {
    if value.abs() < tolerance { 0.0 } else { value }
}

/// Where a function with one maximum between two places is largest, and its value there.
fn highest(function: &dyn Fn(f64) -> f64, mut low: f64, mut high: f64) -> (f64, f64) {
    for _ in 0..NARROWINGS {
        let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
        if function(a) < function(b) { low = a } else { high = b }
    }
    let middle = 0.5 * (low + high);
    (middle, function(middle))
}

#[cfg(test)]
mod tests {
    use super::super::spheres::{self, Cut};
    use super::*;
    use crate::field::RadialProfile;
    use crate::input::weight::Beside;
    use sph::point_mass::{PointMass, Softening};

    fn near(found: f64, expected: f64, tolerance: f64, what: &str) {
        assert!((found / expected - 1.0).abs() < tolerance, "{what}: {found:e}, expected {expected:e}");
    }

    /// An NFW halo of mass 100 within 10 scale radii.
    fn halo() -> Beside {
        let cut = Cut { mass: 100.0, scale: 1.0, outer: 10.0 };
        let table = spheres::cusped(cut, 2.0, &|x| 1.0 / (x * (1.0 + x).powi(2)));
        let profile = RadialProfile::from_nodes(3, &table.radii, &table.density);
        Beside { spheres: vec![(profile, 10.0)], points: Vec::new() }
    }

    fn gas<'a>(well: &'a Well, outer: f64, heat: Heat<'a>, feels_itself: bool) -> Gas<'a> {
        Gas { gravity: 2.0, well, feels_itself, outer, heat }
    }

    /// Those of Lane and Emden, and of Bonnor and Ebert.
    #[test]
    fn gas_by_itself_is_that_of_the_known_spheres() {
        let none = Well::new(&Beside::default(), 3.0);
        for n in [0.0, 0.7, 1.5, 3.0, 4.5] {
            let found = gas(&none, 3.0, Heat::Polytrope(n), true).table(5.0, None).unwrap();
            let expected = spheres::polytrope(3, n, 5.0, 3.0, 2.0).unwrap();
            near(found.density[0], expected.density[0], 1e-7, &format!("n = {n}, rho_c"));
            near(found.pressure.unwrap()[0], expected.pressure.unwrap()[0], 1e-7, &format!("n = {n}, P_c"));
            near(*found.radii.last().unwrap(), 3.0, 1e-12, "R");
        }
        let sphere = spheres::bonnor_ebert(3, 3.0, 5.0, 3.0, 2.0).unwrap();
        let square = sphere.pressure.as_ref().unwrap()[0] / sphere.density[0];
        let found = gas(&none, 3.0, Heat::Speeds(&|_| square.sqrt()), true).table(5.0, None).unwrap();
        near(found.density[0], sphere.density[0], 1e-8, "rho_c");
        near(*found.density.last().unwrap(), *sphere.density.last().unwrap(), 1e-8, "rho at the edge");
        // As a polytrope of ever larger n with the sound speed in its center.
        let found = gas(&none, 3.0, Heat::Polytrope(1e6), true).table(5.0, Some(square.sqrt())).unwrap();
        near(found.density[0], sphere.density[0], 1e-5, "rho_c of n = 1e6");
    }

    /// G M/(R c^2) = 2.518 at most (Bonnor 1956, MNRAS 116, 351), and n = 5 or more has no surface.
    #[test]
    fn what_cannot_be_is_refused() {
        let none = Well::new(&Beside::default(), 3.0);
        let Err(Refusal::TooHeavy(most)) = gas(&none, 3.0, Heat::Speeds(&|_| 1.0), true).table(5.0, None) else {
            panic!("isothermal gas of any mass");
        };
        near(most, 2.5175 * 3.0 / 2.0, 1e-4, "the largest mass");
        assert_eq!(gas(&none, 3.0, Heat::Polytrope(5.5), true).table(5.0, None).err(), Some(Refusal::Endless));
        let point = |radius: f64| Beside {
            spheres: Vec::new(),
            points: vec![PointMass { center: [0.0], mass: 1.0, radius, softening: Softening::CubicSpline }],
        };
        let [hard, soft] = [0.0, 0.1].map(|radius| Well::new(&point(radius), 3.0));
        let of = |well| gas(well, 3.0, Heat::Speeds(&|_| 1.0), true).table(1e-3, None);
        assert_eq!(of(&hard).err(), Some(Refusal::Bottomless));
        assert!(of(&soft).is_ok());
    }

    /// rho = rho_0 e^-b (1 + x)^(b/x), b = 4 pi G rho_s r_s^2/c^2 (Makino, Sasaki & Suto 1998, ApJ 497, 555).
    #[test]
    fn isothermal_gas_in_an_nfw_halo_has_its_closed_form() {
        let well = Well::new(&halo(), 8.0);
        let scale = 100.0 / (4.0 * PI * (11.0_f64.ln() - 10.0 / 11.0));
        let speed = 7.0;
        let b = 4.0 * PI * 2.0 * scale / (speed * speed);
        let table = gas(&well, 8.0, Heat::Speeds(&|_| speed), false).table(3.0, None).unwrap();
        let law = |x: f64| (b * (x.ln_1p() / x - 1.0)).exp();
        // The halo's own table is constant within 1e-5.
        let first = table.radii.iter().position(|r| *r > 1e-2).unwrap();
        let unit = table.density[first] / law(table.radii[first]);
        for (r, rho) in table.radii.iter().zip(&table.density).skip(first) {
            near(rho / unit, law(*r), 1e-6, &format!("at {r}"));
        }
        let mass = RadialProfile::from_nodes(3, &table.radii, &table.density).total_mass().value;
        near(mass, 3.0, 1e-6, "mass");
    }

    /// dP/dr = -rho G M/r^2 by differences, with masses counted anew.
    #[test]
    fn pressure_holds_gas_in_all_gravity() {
        let beside = halo();
        let well = Well::new(&beside, 8.0);
        let rising = |r: f64| 5.0 + r;
        let cases: [(Heat<'_>, Option<f64>); 4] = [
            (Heat::Speeds(&rising), None),
            (Heat::Polytrope(1.5), None),
            (Heat::Polytrope(6.0), None),
            (Heat::Polytrope(6.0), Some(9.0)),
        ];
        for (case, (heat, central)) in cases.into_iter().enumerate() {
            let table = gas(&well, 8.0, heat, true).table(30.0, central).unwrap();
            let own = RadialProfile::from_nodes(3, &table.radii, &table.density);
            near(own.total_mass().value, 30.0, 1e-5, "mass");
            let pressure = table.pressure.unwrap();
            let mut seen = 0;
            for i in (1..table.radii.len() - 1).filter(|i| table.radii[*i] > 1e-3 && table.density[*i] > 1e-6) {
                let (a, b) = (table.radii[i - 1], table.radii[i + 1]);
                let r = 0.5 * (a + b);
                let slope = (pressure[i + 1] - pressure[i - 1]) / (b - a);
                let mass = beside.enclosed_mass(r) + own.enclosed_mass(r);
                near(-slope, 2.0 * mass * own.density(r) / (r * r), 2e-3, &format!("case {case} at {r}"));
                seen += 1;
            }
            assert!(seen > 500, "case {case}: {seen} rows");
        }
    }
}
