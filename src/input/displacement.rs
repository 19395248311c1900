//! Displacements of particles from their undisturbed positions, x = q + psi(q), which turn a uniform arrangement into density waves.
//!
//! To first order in psi the contrast of the density is delta = -div psi; the density itself is rho(q) / det(1 + d psi/d q) for as
//! long as paths do not cross (Zel'dovich 1970, A&A 5, 84, equations 3 to 5). A random field is a sum over all k of whole waves
//! across the box, one of each pair k and -k,
//!
//! delta(q) = sum_k a_k cos(k q) + b_k sin(k q),   psi(q) = sum_k (k/k^2) (b_k cos(k q) - a_k sin(k q)),
//!
//! with normal numbers a_k and b_k of the variance 2 P(k)/V each, so that P(k) = V <|delta_k|^2> of Fourier's coefficients in the
//! volume V (in d dimensions a length^d), with k in radians per length. Numbers are keyed by the seed and k: they do not change
//! with particles, threads, or other waves. A growing mode of linear theory moves with d psi/dt = f H psi.

use super::differences;
use super::waves::{Whole, normal, whole_waves};
use crate::error::{Error, Result};
use crate::field::{Expression, probes};
use crate::input::constants::Constants;
use crate::input::internal_units::Prepared;
use crate::random::{Purpose, keyed};
use crate::scene::{Conversion, DisplacementInput, Scene, SpectrumInput, Term, check_points};
use crate::target::{Positions, at};
use sph::domain::{Axis, Domain, Region};
use sph::{parallel, reduce};
use sph_formats::{FormatError, UnitDimension};
use std::path::Path;

const KEY: &str = "displacement";
/// Of derivatives of stated fields, in units of the domain's size: waves of a fifth of it are good to ten digits.
const STEP: f64 = 1e-3;
/// A stated field may differ by this share of its largest value between opposite faces of the box.
const REPEATS: f64 = 1e-9;
/// Places at which that is looked for.
const LOOKS: usize = 256;
/// A file of a spectrum may have so many bytes.
const MOST_BYTES: u64 = 1 << 26;
/// Particles between two looks at an interrupt.
const AT_ONCE: usize = 1 << 14;

/// A displacement as a function of the place, in internal units.
pub(crate) struct Displacement<const D: usize> {
    kind: Kind<D>,
    notes: Vec<String>,
}

enum Kind<const D: usize> {
    Waves(Waves<D>),
    Stated(Box<Stated<D>>),
}

/// Components in the scene's units.
struct Stated<const D: usize> {
    components: Vec<Expression>,
    /// The scene's units of length per internal one.
    unit: f64,
    center: [f64; D],
    step: f64,
}

/// psi = Re sum_k k c_k e^(i k (q - corner)), in rows along the first axis.
struct Waves<const D: usize> {
    corner: [f64; D],
    /// k of one wave along each edge.
    lowest: [f64; D],
    reach: [usize; D],
    rows: Vec<Row<D>>,
    coefficients: Vec<[f64; 2]>,
}

/// Waves that differ by their number along the first axis alone, one after the other.
struct Row<const D: usize> {
    /// Numbers along the axes; that along the first is the row's first.
    count: [i64; D],
    /// Its first coefficient, and how many there are.
    start: usize,
    length: usize,
}

/// A move, and its derivatives d psi_i / d q_j.
type Move<const D: usize> = ([f64; D], [[f64; D]; D]);

/// Particles that are moved.
pub struct Displaced<const D: usize> {
    /// Where they are, in internal units.
    pub positions: Positions<D>,
    /// psi of each, in internal units.
    pub moves: Vec<[f64; D]>,
    /// det(1 + d psi/d q): by how much the volume around each has grown.
    pub volumes: Vec<f64>,
    /// Whether particles have the velocities of where they are, not of where they were.
    pub is_at_rest: bool,
    pub note: String,
}

impl<const D: usize> Displacement<D> {
    /// What the scene asks for, if it does; `conversion` leads from the scene's numbers to those of the input.
    ///
    /// # Errors
    /// A box that is not periodic, particles beside gas, no waves in the range, a spectrum beyond f64 or a file that is none, a
    /// stated field that does not repeat over the box.
    pub fn new(scene: &Scene, prepared: &Prepared<D>, conversion: &Conversion) -> Result<Option<Self>> {
        let Some(input) = &scene.displacement else { return Ok(None) };
        let domain = &prepared.source.domain;
        if !(matches!(domain.region, Region::Box) && domain.axes.iter().all(|a| *a == Axis::Periodic)) {
            let problem = "needs a box that is periodic along all axes (domain.boundary: periodic)";
            return Err(Error::scene(KEY, problem));
        }
        if prepared.of_snapshot.as_ref().is_some_and(|s| !s.others.is_empty()) {
            let problem = "moves gas alone, but the input has particles of other types; leave those out (input.other_types: drop)";
            return Err(Error::scene(KEY, problem));
        }
        let unit = prepared.length / conversion.factor(UnitDimension::LENGTH);
        if !input.field.is_empty() {
            let stated = Stated::new(input, domain, unit, &Constants::new(scene, conversion.from))?;
            return Ok(Some(Self { kind: Kind::Stated(Box::new(stated)), notes: Vec::new() }));
        }
        let seed = input.seed.unwrap_or(scene.seed);
        let rms = input.rms.as_ref().map(|rms| rms.value("displacement.rms", UnitDimension::LENGTH, conversion));
        let rms = rms.transpose()?.map(|rms| rms / prepared.length);
        let spectrum = Spectrum::new(input)?;
        let (waves, left_out) = Waves::new(input, &spectrum, (domain, unit), (seed, rms))?;
        let number = waves.coefficients.len();
        let mut notes = vec![format!("the displacement is a sum of {number} waves, seed {seed}")];
        if left_out > 0 {
            notes.push(format!("{left_out} more waves of displacement.wavenumbers lie beyond the ends of displacement.spectrum and have no power"));
        }
        Ok(Some(Self { kind: Kind::Waves(waves), notes }))
    }

    /// Decisions, for the report.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    fn at(&self, q: &[f64; D]) -> Move<D> {
        match &self.kind {
            Kind::Waves(waves) => waves.at(q),
            Kind::Stated(stated) => stated.at(q),
        }
    }

    /// Moves the particles.
    ///
    /// # Errors
    /// Values that are not finite, paths that cross, an interrupt.
    pub fn displaced(
        &self,
        domain: &Domain<D>,
        positions: &Positions<D>,
        is_interrupted: &dyn Fn() -> bool,
    ) -> Result<Displaced<D>> {
        let n = positions[0].len();
        let mut all: Vec<(Move<D>, f64)> = Vec::with_capacity(n);
        while all.len() < n {
            if is_interrupted() {
                return Err(Error::Interrupted);
            }
            let first = all.len();
            all.extend(parallel::map((n - first).min(AT_ONCE), |i| {
                let (psi, slopes) = self.at(&at(positions, first + i));
                ((psi, slopes), grown(&slopes))
            }));
        }
        let is_finite = |(psi, slopes): &Move<D>| psi.iter().chain(slopes.iter().flatten()).all(|v| v.is_finite());
        if let Some(i) = all.iter().position(|(found, _)| !is_finite(found)) {
            let problem = format!("is {:?} at particle {i}, expected finite numbers", all[i].0.0);
            return Err(Error::scene("displacement.field", problem));
        }
        let crossed = all.iter().filter(|(found, _)| !is_one_to_one(&found.1)).count();
        if crossed > 0 {
            let steepest = all.iter().flat_map(|((_, s), _)| (0..D).map(|k| -s[k][k])).fold(0.0, f64::max);
            let problem = format!(
                "is so steep that paths cross near {crossed} of {n} particles, where its density is infinite: d psi/dq reaches -{steepest:.3}, expected \
                 less than 1 in size; make it smaller, or leave out short waves (displacement.wavenumbers)"
            );
            return Err(Error::scene(KEY, problem));
        }
        let square = |i: usize| all[i].0.0.iter().map(|c| c * c).sum::<f64>();
        let rms = (reduce::sum(n, square) / n.max(1) as f64).sqrt();
        let most = reduce::max(n, square).max(0.0).sqrt();
        let spacing = domain.mean_spacing(n.max(1));
        let (thin, dense) =
            all.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), (_, j)| (a.min(1.0 / j), b.max(1.0 / j)));
        let unsampled = match &self.kind {
            Kind::Waves(waves) if waves.shortest() < 2.0 * spacing => {
                format!(
                    ". The shortest waves are {:.2} spacings long and not sampled: keep displacement.wavenumbers below half of the particles along an edge",
                    waves.shortest() / spacing
                )
            }
            _ => String::new(),
        };
        let note = format!(
            "particles are displaced by {:.3} spacings rms, {:.3} at most; their density is {thin:.4} to {dense:.4} of what it was. Figures of density, noise and neighbors are those of \
             the arrangement before{unsampled}",
            rms / spacing,
            most / spacing
        );
        let mut moved: Positions<D> = std::array::from_fn(|_| Vec::with_capacity(n));
        for (i, ((psi, _), _)) in all.iter().enumerate() {
            let q = at(positions, i);
            let x = domain.wrapped(&sph::array(|k| q[k] + psi[k]));
            (0..D).for_each(|k| moved[k].push(x[k]));
        }
        let (moves, volumes) = all.into_iter().map(|((psi, _), volume)| (psi, volume)).unzip();
        Ok(Displaced { positions: moved, moves, volumes, is_at_rest: false, note })
    }
}

/// det(1 + slopes).
fn grown<const D: usize>(slopes: &[[f64; D]; D]) -> f64 {
    minor(D, |i, j| slopes[i][j])
}

/// Whether the map is one to one all along the way: the symmetric part of 1 + slopes is positive definite (Sylvester).
fn is_one_to_one<const D: usize>(slopes: &[[f64; D]; D]) -> bool {
    (1..=D).all(|order| minor(order, |i, j| 0.5 * (slopes[i][j] + slopes[j][i])) > 0.0)
}

/// The determinant of the first `order` rows and columns of 1 + `part`.
fn minor(order: usize, part: impl Fn(usize, usize) -> f64) -> f64 {
    let m = |i: usize, j: usize| f64::from(u8::from(i == j)) + part(i, j);
    match order {
        1 => m(0, 0),
        2 => m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0),
        _ => (0..3)
            .map(|k| {
                let (a, b) = ((k + 1) % 3, (k + 2) % 3);
                m(0, k) * (m(1, a) * m(2, b) - m(1, b) * m(2, a))
            })
            .sum(),
    }
}

impl<const D: usize> Stated<D> {
    fn new(input: &DisplacementInput, domain: &Domain<D>, unit: f64, constants: &Constants) -> Result<Self> {
        let key = |k: usize| format!("displacement.field[{k}]");
        if input.field.len() != D {
            let problem = format!("has {} components, expected {D}", input.field.len());
            return Err(Error::scene("displacement.field", problem));
        }
        let parsed = |(k, term): (usize, &Term)| constants.expression::<D>(&key(k), &term.text(), &[]);
        let components = input.field.iter().enumerate().map(parsed).collect::<Result<Vec<_>>>()?;
        let stated = Self { components, unit, center: domain.center(), step: STEP * domain.size() };
        stated.check(domain)?;
        Ok(stated)
    }

    /// Whether it is finite and repeats.
    fn check(&self, domain: &Domain<D>) -> Result<()> {
        let places: Vec<[f64; D]> = probes(domain).into_iter().take(LOOKS).collect();
        let values: Vec<[f64; D]> = places.iter().map(|q| self.value(q)).collect();
        if let Some((q, psi)) = places.iter().zip(&values).find(|(_, psi)| psi.iter().any(|v| !v.is_finite())) {
            let problem = format!("is {psi:?} at {:?}, expected finite numbers", q.map(|v| v * self.unit));
            return Err(Error::scene("displacement.field", problem));
        }
        let largest = values.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
        for k in 0..D {
            let jump = |q: &[f64; D]| {
                let end = |side: f64| self.value(&sph::array(|j| if j == k { side } else { q[j] }));
                let (low, high) = (end(domain.lo[k]), end(domain.hi[k]));
                (0..D).map(|j| (high[j] - low[j]).abs()).fold(0.0, f64::max)
            };
            let jump = places.iter().map(jump).fold(0.0, f64::max);
            if !(jump <= REPEATS * largest) {
                let axis = ["x", "y", "z"][k];
                let problem = format!(
                    "differs by {:e} between the ends of the box along {axis}, expected a field that repeats, such as one of sin(2*pi*{axis}/L)",
                    jump * self.unit
                );
                return Err(Error::scene("displacement.field", problem));
            }
        }
        Ok(())
    }

    /// psi in internal units.
    fn value(&self, q: &[f64; D]) -> [f64; D] {
        let mut values = [0.0; 4];
        (0..D).for_each(|k| values[k] = q[k] * self.unit);
        values[3] = (0..D).map(|k| (q[k] - self.center[k]).powi(2)).sum::<f64>().sqrt() * self.unit;
        sph::array(|k| self.components[k].evaluate_with(&values) / self.unit)
    }

    fn at(&self, q: &[f64; D]) -> Move<D> {
        let slope = |i: usize, j: usize| {
            differences::slope(self.step, |h| {
                let mut y = *q;
                y[j] += h;
                self.value(&y)[i]
            })
        };
        (self.value(q), std::array::from_fn(|i| std::array::from_fn(|j| slope(i, j))))
    }
}

/// P(k), with k and P in the scene's units.
enum Spectrum {
    /// Amplitude and power.
    Power(f64, f64),
    /// Logarithms of both, with P > 0.
    Points(Vec<[f64; 2]>),
}

impl Spectrum {
    fn new(input: &DisplacementInput) -> Result<Self> {
        let points = match (&input.spectrum, input.slope) {
            (None, slope) => return Ok(Self::Power(input.amplitude.unwrap_or(1.0), slope.unwrap_or(0.0))),
            (Some(SpectrumInput::Points(points)), _) => points.clone(),
            (Some(SpectrumInput::File(path)), _) => read_points(path)?,
        };
        Ok(Self::Points(points))
    }

    /// 0 beyond the ends of points; straight lines between them in the logarithms, where both ends have power.
    fn power(&self, k: f64) -> f64 {
        match self {
            Self::Power(amplitude, slope) => amplitude * k.powf(*slope),
            Self::Points(points) => {
                let next = points.partition_point(|p| p[0] < k);
                let (Some(high), Some(low)) = (points.get(next), points.get(next.max(1) - 1)) else { return 0.0 };
                if high[0] == k {
                    return high[1];
                }
                if next == 0 {
                    return 0.0;
                }
                if !(low[1] > 0.0 && high[1] > 0.0) {
                    return low[1] + (high[1] - low[1]) * (k - low[0]) / (high[0] - low[0]);
                }
                let t = (k / low[0]).ln() / (high[0] / low[0]).ln();
                (low[1].ln() + t * (high[1].ln() - low[1].ln())).exp()
            }
        }
    }

    fn reaches(&self, k: f64) -> bool {
        match self {
            Self::Power(..) => true,
            Self::Points(points) => {
                points.first().is_some_and(|p| p[0] <= k) && points.last().is_some_and(|p| p[0] >= k)
            }
        }
    }
}

/// The first two columns of a text file; lines that begin with # are comments.
fn read_points(path: &Path) -> Result<Vec<[f64; 2]>> {
    let wrong = |problem: String| Error::scene("displacement.spectrum", format!("'{}' {problem}", path.display()));
    let bytes = std::fs::metadata(path).map_err(|e| FormatError::io(path, "read", e))?.len();
    if bytes > MOST_BYTES {
        return Err(wrong(format!("has {bytes} bytes, expected a table of at most {MOST_BYTES}")));
    }
    let text = std::fs::read_to_string(path).map_err(|e| FormatError::io(path, "read", e))?;
    let mut points = Vec::new();
    for (i, line) in text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.trim().starts_with('#')) {
        let mut words = line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty());
        let mut number = || words.next().and_then(|w| w.parse::<f64>().ok());
        let (Some(k), Some(power)) = (number(), number()) else {
            return Err(wrong(format!("has '{}' in line {}, expected two numbers, k and P", line.trim(), i + 1)));
        };
        points.push([k, power]);
    }
    check_points(&points).map_err(wrong)?;
    Ok(points)
}

impl<const D: usize> Waves<D> {
    /// With `rms` in internal units; beside them, how many waves the spectrum does not reach.
    fn new(
        input: &DisplacementInput,
        spectrum: &Spectrum,
        (domain, unit): (&Domain<D>, f64),
        (seed, rms): (u64, Option<f64>),
    ) -> Result<(Self, usize)> {
        let all = whole_waves(domain, input.wavenumbers);
        let length = |w: &Whole<D>| w.k.iter().map(|v| v * v).sum::<f64>().sqrt();
        let number = all.len();
        let volume = domain.volume() * unit.powi(D as i32);
        let mut waves = Self {
            corner: domain.lo,
            lowest: domain.extent().map(|e| std::f64::consts::TAU / e),
            reach: [0; D],
            rows: Vec::new(),
            coefficients: Vec::new(),
        };
        let mut square = 0.0;
        for wave in all.iter().filter(|w| spectrum.reaches(length(w) / unit)) {
            let k = length(wave) / unit;
            let mut random = keyed(seed, Purpose::Displacement, key_of(&wave.count));
            let [a, b] = [normal(&mut random), normal(&mut random)];
            // Of the input's units in internal ones twice: psi and 1/k are lengths.
            let size = (2.0 * spectrum.power(k) / volume).sqrt() / (k * unit).powi(2);
            let c = [b * size, a * size];
            square += 0.5 * (k * unit).powi(2) * (c[0] * c[0] + c[1] * c[1]);
            waves.push(wave, c);
        }
        let [least, most] = input.wavenumbers;
        if waves.coefficients.is_empty() {
            let of = if number > 0 {
                "of which displacement.spectrum has none"
            } else {
                "in which no wave fits the box a whole number of times"
            };
            return Err(Error::scene("displacement.wavenumbers", format!("are {least} to {most}, {of}")));
        }
        if !(square > 0.0 && square.is_finite()) {
            let problem = format!(
                "comes to a mean square displacement of {square:e} in this box, expected a positive finite one; choose other units or another amplitude"
            );
            return Err(Error::scene(KEY, problem));
        }
        if let Some(rms) = rms {
            let factor = rms / square.sqrt();
            waves.coefficients.iter_mut().flatten().for_each(|v| *v *= factor);
        }
        let left_out = number - waves.coefficients.len();
        Ok((waves, left_out))
    }

    /// Length of the shortest along any edge.
    fn shortest(&self) -> f64 {
        (0..D)
            .map(|d| std::f64::consts::TAU / (self.lowest[d] * self.reach[d].max(1) as f64))
            .fold(f64::INFINITY, f64::min)
    }

    fn push(&mut self, wave: &Whole<D>, c: [f64; 2]) {
        let follows = self
            .rows
            .last()
            .is_some_and(|row| row.count[1..] == wave.count[1..] && row.count[0] + row.length as i64 == wave.count[0]);
        match self.rows.last_mut().filter(|_| follows) {
            Some(row) => row.length += 1,
            None => self.rows.push(Row { count: wave.count, start: self.coefficients.len(), length: 1 }),
        }
        self.coefficients.push(c);
        (0..D).for_each(|d| self.reach[d] = self.reach[d].max(wave.count[d].unsigned_abs() as usize));
    }

    fn at(&self, q: &[f64; D]) -> Move<D> {
        // e^(i m phase) along each axis.
        let powers: [Vec<[f64; 2]>; D] = std::array::from_fn(|d| {
            let phase = self.lowest[d] * (q[d] - self.corner[d]);
            (0..=self.reach[d])
                .map(|m| {
                    let (sin, cos) = (m as f64 * phase).sin_cos();
                    [cos, sin]
                })
                .collect()
        });
        let (mut psi, mut slopes) = ([0.0; D], [[0.0; D]; D]);
        for row in &self.rows {
            // Sums of c e^(i n phase) times 1, n and n^2 along the row.
            let mut sums = [[0.0; 2]; 3];
            let first = row.count[0] as usize;
            let waves = &self.coefficients[row.start..row.start + row.length];
            for (j, (c, e)) in waves.iter().zip(&powers[0][first..]).enumerate() {
                let n = (first + j) as f64;
                let term = product(*c, *e);
                for (sum, weight) in sums.iter_mut().zip([1.0, n, n * n]) {
                    sum[0] += weight * term[0];
                    sum[1] += weight * term[1];
                }
            }
            let lead = (1..D).fold([1.0, 0.0], |lead, d| {
                let [cos, sin] = powers[d][row.count[d].unsigned_abs() as usize];
                product(lead, if row.count[d] < 0 { [cos, -sin] } else { [cos, sin] })
            });
            let sums = sums.map(|sum| product(lead, sum));
            let k: [f64; D] =
                sph::array(|d| if d == 0 { self.lowest[0] } else { self.lowest[d] * row.count[d] as f64 });
            for i in 0..D {
                let order = usize::from(i == 0);
                psi[i] += k[i] * sums[order][0];
                for j in 0..D {
                    slopes[i][j] -= k[i] * k[j] * sums[order + usize::from(j == 0)][1];
                }
            }
        }
        (psi, slopes)
    }
}

fn product(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// A number for a wave, whatever others there are.
fn key_of<const D: usize>(count: &[i64; D]) -> u64 {
    count.iter().fold(0, |key, n| (key << 16) | (n + (1 << 15)) as u64)
}
