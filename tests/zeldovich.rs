//! Displacements of arranged particles: plane waves against their closed forms, random fields against their spectra by own sums.

use sph_prep::scene::WvtInput;
use sph_prep::{Control, FORMATS, ParticleFile, Report, Scene, place};
use std::f64::consts::TAU;
use std::path::Path;

fn placed(text: &str) -> (ParticleFile, Report) {
    let scene = Scene::parse(text).unwrap_or_else(|e| panic!("{text}: {e}"));
    place(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{text}: {e}"))
}

fn refused(text: &str) -> String {
    let scene = Scene::parse(text).unwrap_or_else(|e| panic!("{text}: {e}"));
    place(&scene, FORMATS, &Control::default()).err().unwrap_or_else(|| panic!("{text} is placed")).to_string()
}

/// Rows of a column of the gas.
fn rows(file: &ParticleFile, name: &str) -> Vec<Vec<f64>> {
    let table = &file.species[0].table;
    let c = table.column(name).unwrap_or_else(|| panic!("no '{name}'"));
    (0..table.count).map(|i| (0..c.components).map(|k| c.values.get(i * c.components + k)).collect()).collect()
}

/// Places before, and displacements, of a lattice in the unit box.
fn moved(head: &str, displacement: &str) -> (Vec<Vec<f64>>, Vec<Vec<f64>>, ParticleFile) {
    let before = rows(&placed(head).0, "Coordinates");
    let (file, _) = placed(&format!("{head}displacement: {displacement}\n"));
    let shift = |(x, q): (&Vec<f64>, &Vec<f64>)| x.iter().zip(q).map(|(x, q)| x - q - (x - q).round()).collect();
    let shifts = rows(&file, "Coordinates").iter().zip(&before).map(shift).collect();
    (before, shifts, file)
}

fn head(dimension: usize, particles: usize) -> String {
    let corner = |v: &str| vec![v; dimension].join(", ");
    format!(
        "input: {{expression: '1'}}\ndomain: {{box: [[{}], [{}]], boundary: [periodic]}}\nparticles: {particles}\nseeding: cubic\nwvt: {{iterations: 0}}\npolish: none\n\
         thermal: {{internal_energy: 1}}\noutput: {{units: code, target_density: true}}\n",
        corner("0"),
        corner("1")
    )
}

/// psi = A sin(k q) with A k = 1/2: rho = 1/(1 + A k cos(k q)). The field is taken at the very places, so that only digits are lost
/// (1e-12); derivatives are differences of sixth order, whose truncation (k h)^6/140 with h = 1e-3 is 4e-16, and whose rounding
/// 1e-16/h is 1e-13 of A k.
#[test]
fn a_plane_wave_has_the_density_of_its_closed_form() {
    for (dimension, particles) in [(1, 500), (2, 2500), (3, 8000)] {
        let others = ", 0".repeat(dimension - 1);
        let displacement = format!("{{field: ['sin(2*pi*x)/(4*pi)'{others}], velocity_factor: 3}}");
        let (q, psi, file) = moved(&head(dimension, particles), &displacement);
        let columns = rows(&file, "TargetDensity").into_iter().zip(rows(&file, "Velocities"));
        for ((q, psi), (density, velocity)) in q.iter().zip(&psi).zip(columns) {
            let expected = (TAU * q[0]).sin() / (2.0 * TAU);
            assert!((psi[0] - expected).abs() < 1e-12 && psi[1..].iter().all(|v| v.abs() < 1e-12), "{q:?}: {psi:?}");
            assert!((velocity[0] - 3.0 * expected).abs() < 1e-12 && velocity[1..].iter().all(|v| *v == 0.0));
            let wave = 1.0 / (1.0 + 0.5 * (TAU * q[0]).cos());
            assert!((density[0] / wave - 1.0).abs() < 1e-11, "{dimension}-D at {q:?}: {density:?}, expected {wave}");
        }
    }
}

/// The summed density of the wave above. In one dimension the kernel's own width is some 2.5 of 500 spacings, so that smoothing, (its
/// second moment/2) rho'' <= 0.04 (2.5/500)^2 4 (2 pi)^2, is 2e-4 of the density, and the kernel's own sum over even points 1e-3.
#[test]
fn the_summed_density_of_a_plane_wave_is_the_closed_form_too() {
    let (q, _, file) = moved(&head(1, 500), "{field: ['sin(2*pi*x)/(4*pi)']}");
    for (q, density) in q.iter().zip(rows(&file, "Density")) {
        let wave = 1.0 / (1.0 + 0.5 * (TAU * q[0]).cos());
        assert!((density[0] / wave - 1.0).abs() < 5e-3, "at {q:?}: {density:?}, expected {wave}");
    }
    assert!(file.species[0].table.column("Velocities").is_none(), "nothing moves without a factor");
}

/// Waves n with |n| from 1 to `most`, one of each pair.
fn waves(dimension: usize, most: i64) -> Vec<Vec<i64>> {
    let side = 2 * most + 1;
    (0..side.pow(dimension as u32))
        .map(|code| (0..dimension).map(|d| code / side.pow(d as u32) % side - most).collect::<Vec<i64>>())
        .filter(|n| n.iter().find(|v| **v != 0).is_some_and(|v| *v > 0))
        .filter(|n| n.iter().map(|v| v * v).sum::<i64>() <= most * most)
        .collect()
}

/// psi_k = mean of psi exp(-i k q), real and imaginary parts of each component.
fn transformed(q: &[Vec<f64>], psi: &[Vec<f64>], n: &[i64]) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 2]; n.len()];
    for (q, psi) in q.iter().zip(psi) {
        let phase: f64 = TAU * q.iter().zip(n).map(|(q, n)| q * *n as f64).sum::<f64>();
        let (sin, cos) = phase.sin_cos();
        for (sum, psi) in sums.iter_mut().zip(psi) {
            sum[0] += psi * cos;
            sum[1] -= psi * sin;
        }
    }
    sums.iter().map(|s| s.map(|v| v / q.len() as f64)).collect()
}

fn square(v: &[[f64; 2]]) -> f64 {
    v.iter().flatten().map(|c| c * c).sum()
}

/// k psi_k, which is i delta_k, for a wave.
fn along(psi: &[[f64; 2]], n: &[i64]) -> [f64; 2] {
    let of = |part: usize| psi.iter().zip(n).map(|(p, n)| TAU * *n as f64 * p[part]).sum();
    [of(0), of(1)]
}

/// On a lattice with more than twice as many points along an edge as waves, sums over points are integrals. V |delta_k|^2 / P(k) has
/// an exponential distribution of mean 1: the mean over M waves is 1 to 1/sqrt(M), here within four of these. Fourth moments of M = 2 x
/// 1000 normal numbers are 3 to sqrt(96/M), likewise.
#[test]
fn random_fields_have_their_spectrum_and_neither_mean_nor_curl() {
    // P(k) = 2e-6 k^-1 as a law, and as points that lie on it.
    let law = |k: f64| 2e-6 / k;
    let points = format!("[[1, {:e}], [30, {:e}], [1000, {:e}]]", law(1.0), law(30.0), law(1000.0));
    for (dimension, particles, most, spectrum) in [
        (3, 8000, 8, "slope: -1, amplitude: 2e-6".to_owned()),
        (3, 8000, 8, format!("spectrum: {points}")),
        (2, 10_000, 40, "slope: -1, amplitude: 2e-6".to_owned()),
        (1, 300, 60, format!("spectrum: {points}")),
    ] {
        let displacement = format!("{{{spectrum}, wavenumbers: [1, {most}], seed: 3}}");
        let (q, psi, _) = moved(&head(dimension, particles), &displacement);
        let waves = waves(dimension, most);
        let (mut ratio, mut fourth, mut all) = (0.0, 0.0, 0.0);
        for n in &waves {
            let found = transformed(&q, &psi, n);
            let k = TAU * n.iter().map(|v| (v * v) as f64).sum::<f64>().sqrt();
            let delta = along(&found, n);
            let power = delta[0] * delta[0] + delta[1] * delta[1];
            // What is not along k is a curl; displacements are differences of coordinates, good to 1e-16 each.
            let across = |(n, psi): (&i64, &[f64; 2])| [0, 1].map(|p| psi[p] - TAU * *n as f64 * delta[p] / (k * k));
            let curl: Vec<[f64; 2]> = n.iter().zip(&found).map(across).collect();
            assert!(square(&curl) < 1e-20 * square(&found) + 1e-32, "{n:?}: {curl:?} of {found:?}");
            ratio += power / law(k) / waves.len() as f64;
            fourth += delta.iter().map(|d| (d / (0.5 * law(k)).sqrt()).powi(4)).sum::<f64>() / (2 * waves.len()) as f64;
            all += 2.0 * square(&found);
        }
        let number = waves.len() as f64;
        assert!((ratio - 1.0).abs() < 4.0 / number.sqrt(), "{dimension}-D {spectrum}: {ratio}, {number} waves");
        assert!((fourth - 3.0).abs() < 4.0 * (96.0 / (2.0 * number)).sqrt(), "{dimension}-D: fourth moment {fourth}");
        // All of the field is in these waves, and none in its mean.
        let mean_square = psi.iter().flatten().map(|v| v * v).sum::<f64>() / psi.len() as f64;
        assert!((all / mean_square - 1.0).abs() < 1e-9, "{dimension}-D: {all} {mean_square}");
        let mean = |k: usize| psi.iter().map(|p| p[k]).sum::<f64>() / psi.len() as f64;
        assert!((0..dimension).all(|k| mean(k).abs() < 1e-12), "{dimension}-D");
    }
}

/// The halves of the waves by length, of a steep and of a flat law, to four standard deviations of the longer of 500 waves.
#[test]
fn spectra_have_their_slopes() {
    for slope in [-3.0, 0.0, 1.0] {
        let (q, psi, _) =
            moved(&head(3, 8000), &format!("{{slope: {slope}, amplitude: 1e-7, wavenumbers: [1, 8], seed: 5}}"));
        let waves = waves(3, 8);
        for (least, most) in [(1.0, 5.5), (5.5, 8.1)] {
            let length = |n: &Vec<i64>| n.iter().map(|v| (v * v) as f64).sum::<f64>().sqrt();
            let within: Vec<&Vec<i64>> = waves.iter().filter(|n| length(n) >= least && length(n) < most).collect();
            let of = |n: &Vec<i64>| {
                let delta = along(&transformed(&q, &psi, n), n);
                (delta[0] * delta[0] + delta[1] * delta[1]) / (1e-7 * (TAU * length(n)).powf(slope))
            };
            let mean = within.iter().map(|n| of(n)).sum::<f64>() / within.len() as f64;
            assert!((mean - 1.0).abs() < 4.0 / (within.len() as f64).sqrt(), "k^{slope}, {least} to {most}: {mean}");
        }
    }
}

/// The root mean square over a lattice is exact, to digits. With a seed the waves are the same for other particles, other cutoffs and
/// any number of threads.
#[test]
fn fields_are_scaled_and_depend_on_the_seed_alone() {
    let displacement =
        |seed: u64, most: f64| format!("{{slope: -2, rms: 0.01, wavenumbers: [1, {most}], seed: {seed}}}");
    let (q, psi, _) = moved(&head(3, 8000), &displacement(3, 8.0));
    let rms = (psi.iter().flatten().map(|v| v * v).sum::<f64>() / psi.len() as f64).sqrt();
    assert!((rms / 0.01 - 1.0).abs() < 1e-9, "{rms}");
    let (finer, by_finer, _) = moved(&head(3, 13_824), &displacement(3, 8.0));
    let (_, by_other, _) = moved(&head(3, 8000), &displacement(4, 8.0));
    let (_, by_fewer, _) = moved(&head(3, 8000), &displacement(3, 3.0));
    for n in [[1, 0, 0], [0, 1, -2], [2, -1, 1]] {
        let own = transformed(&q, &psi, &n);
        let size = square(&own);
        let difference = |other: &[[f64; 2]]| -> f64 {
            own.iter().flatten().zip(other.iter().flatten()).map(|(a, b)| (a - b) * (a - b)).sum()
        };
        assert!(difference(&transformed(&finer, &by_finer, &n)) < 1e-18 * size, "{n:?}");
        assert!(difference(&transformed(&q, &by_other, &n)) > 1e-3 * size, "{n:?}");
        // Fewer waves of one mean square are larger, all by one factor.
        let fewer = transformed(&q, &by_fewer, &n);
        let factor = (square(&fewer) / size).sqrt();
        let scaled: Vec<[f64; 2]> = fewer.iter().map(|c| c.map(|v| v / factor)).collect();
        assert!(factor > 1.0 && difference(&scaled) < 1e-18 * size, "{n:?}: {factor}");
    }
    let text = format!("{}displacement: {}\n", head(3, 1000), displacement(3, 8.0));
    let by_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| placed(&text).0)
    };
    let (one, three) = (by_threads(1), by_threads(3));
    for name in ["Coordinates", "Density", "SupportRadius", "TargetDensity"] {
        assert_eq!(rows(&one, name), rows(&three, name), "{name}");
    }
}

/// Relaxed, not on a lattice: summed densities follow the displaced target's to the noise of the arrangement and the smoothing of
/// waves of 5 spacings and more: 2 % of waves of 13 %. The report is of the arrangement, and says so.
#[test]
fn the_density_of_a_relaxed_box_follows_its_waves() {
    let text = head(3, 8000).replace("seeding: cubic\nwvt: {iterations: 0}\npolish: none\n", "");
    let (file, report) =
        placed(&format!("{text}displacement: {{slope: -2, rms: 0.012, wavenumbers: [1, 4], seed: 1}}\n"));
    let (density, target) = (rows(&file, "Density"), rows(&file, "TargetDensity"));
    let n = density.len() as f64;
    let spread = (target.iter().map(|t| (t[0] - 1.0).powi(2)).sum::<f64>() / n).sqrt();
    let off = (density.iter().zip(&target).map(|(d, t)| (d[0] / t[0] - 1.0).powi(2)).sum::<f64>() / n).sqrt();
    assert!(spread > 0.1 && off < 0.2 * spread, "{off} of {spread}");
    assert!(report.density_error.all_refitted.mean < 0.01);
    let told = |text: &str| report.notes.iter().any(|note| note.contains(text));
    assert!(told("arrangement before") && told("sum of 128 waves, seed 1"), "{:?}", report.notes);
    assert!(report.plan.left_out.iter().any(|l| l.what.contains("after the displacement")));
}

#[test]
fn displacements_that_cannot_be_are_refused_with_a_remedy() {
    let periodic = head(2, 400);
    let open = periodic.replace("boundary: [periodic]", "boundary: [periodic, open]");
    let scratch = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = scratch.path().join(name);
        std::fs::write(&path, text).unwrap();
        format!("{{spectrum: '{}'}}", path.display())
    };
    let wrong = file("words.txt", "# k P\n1 2\n3 four\n");
    let descending = file("down.txt", "2 1\n1 1\n");
    let far = file("far.txt", "1e5, 1\n2e5, 1\n");
    for (head, displacement, words) in [
        (&open, "{slope: -2, rms: 0.01}", &["displacement", "periodic"][..]),
        (&periodic, "{}", &["0 of `field`, `slope` and `spectrum`"]),
        (&periodic, "{slope: 1, field: [0, 0], rms: 1}", &["2 of"]),
        (&periodic, "{slope: 1}", &["one of the two"]),
        (&periodic, "{slope: 1, rms: 0.1, amplitude: 1}", &["one of the two"]),
        (&periodic, "{slope: .nan, rms: 0.1}", &["displacement.slope", "NaN"]),
        (&periodic, "{slope: 1, amplitude: -1}", &["displacement.amplitude", "positive"]),
        (&periodic, "{slope: 1, rms: -0.1}", &["displacement.rms", "more than 0"]),
        (&periodic, "{slope: 1, rms: 1 km}", &["displacement.rms", "states no units"]),
        (&periodic, "{slope: 1, rms: 0.1, wavenumbers: [3, 2]}", &["displacement.wavenumbers", "ascend"]),
        (&periodic, "{slope: 1, rms: 0.1, wavenumbers: [1, 1e300]}", &["displacement.wavenumbers", "up to 64"]),
        (&periodic, "{slope: 1, rms: 0.1, wavenumbers: [1.1, 1.2]}", &["displacement.wavenumbers", "no wave"]),
        (&periodic, "{slope: 1e300, rms: 0.1}", &["displacement", "mean square"]),
        (&periodic, "{slope: -2, rms: 1}", &["displacement", "cross", "smaller"]),
        (&periodic, "{field: [x, 0]}", &["displacement.field", "repeats", "along x"]),
        (&periodic, "{field: [1/(x - 0.5), 0]}", &["displacement.field", "finite"]),
        (&periodic, "{field: [0]}", &["displacement.field", "1 components, expected 2"]),
        (&periodic, "{field: [0, w]}", &["displacement.field[1]", "w"]),
        (&periodic, "{field: [0, 0], seed: 3}", &["displacement.seed", "leave it out"]),
        (&periodic, "{field: [0.3*sin(2*pi*x), 0]}", &["displacement", "cross"]),
        (&periodic, "{spectrum: [[1, 1]]}", &["displacement.spectrum", "two at least"]),
        (&periodic, "{spectrum: [[1, 1], [2, -1]]}", &["displacement.spectrum", "P = -1"]),
        (&periodic, "{spectrum: [[1, 1], [2, 1]], amplitude: 1}", &["displacement.amplitude", "power law"]),
        (&periodic, "{spectrum: nowhere.txt}", &["nowhere.txt"]),
        (&periodic, &wrong, &["words.txt", "line 3", "two numbers"]),
        (&periodic, &descending, &["down.txt", "ascend"]),
        (&periodic, &far, &["displacement.wavenumbers", "has none"]),
    ] {
        let error = refused(&format!("{head}displacement: {displacement}\n"));
        for word in words {
            assert!(error.contains(word), "{displacement}: {error} lacks {word:?}");
        }
    }
    let balanced =
        format!("{periodic}displacement: {{slope: -2, rms: 0.01}}\nfields: {{pressure: 1}}\nbalance: true\n")
            .replace("thermal: {internal_energy: 1}\n", "");
    assert!(refused(&balanced).contains("displacement: the balance would undo it"), "{}", refused(&balanced));
}

/// v = f H psi with 70 km/s/Mpc, and psi of 0.5 Mpc rms, which 4000 particles sample to a percent.
#[test]
fn the_bundled_box_moves_as_its_growing_mode() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles/zeldovich.yaml");
    let scene = Scene::load(&path).unwrap();
    let scene = Scene { particles: Some(4000), wvt: WvtInput { iterations: Some(3), ..scene.wvt }, ..scene };
    let (file, report) = place(&scene, FORMATS, &Control::default()).unwrap();
    let q = place(&Scene { displacement: None, ..scene }, FORMATS, &Control::default()).unwrap().0;
    let edge = file.header.box_size[0];
    let (length, time) = (file.header.units.length, file.header.units.time);
    assert!((edge * length / 3.085_677_6e24 / 50.0 - 1.0).abs() < 1e-6, "{edge}");
    // 70 km/s/Mpc in the file's units of time.
    let rate = 70e5 / 3.085_677_581_49e24 * time;
    let mut mean = 0.0;
    for ((x, q), v) in rows(&file, "Coordinates").iter().zip(rows(&q, "Coordinates")).zip(rows(&file, "Velocities")) {
        for k in 0..3 {
            let psi = x[k] - q[k] - edge * ((x[k] - q[k]) / edge).round();
            assert!((v[k] - rate * psi).abs() < 1e-9 * rate * edge, "{v:?} {psi}");
            mean += psi * psi / 4000.0;
        }
    }
    assert!((mean.sqrt() / edge * 100.0 - 1.0).abs() < 0.02, "{mean}");
    assert!((report.mass.total * file.header.units.mass / 1.988_4e33 / (6.2e9 * 1.25e5) - 1.0).abs() < 1e-3);
}

/// A magnetic field is one of places: that of a vector potential has no divergence where particles are, not where they were.
#[test]
fn a_magnetic_field_is_taken_where_particles_are_moved_to() {
    let fields = "fields: {vector_potential: [0, 0, 'sin(2*pi*x)*cos(2*pi*y)/(2*pi)'], tag: x}\n";
    let text = format!("{}{fields}displacement: {{field: ['0.05*sin(2*pi*x)', 0, 0]}}\n", head(3, 1000));
    let (file, _) = placed(&text);
    let columns = rows(&file, "Coordinates").into_iter().zip(rows(&file, "MagneticField")).zip(rows(&file, "tag"));
    let mut most: f64 = 0.0;
    for ((x, b), q) in columns {
        let (cos, sin) = ((TAU * x[0]).cos(), (TAU * x[0]).sin());
        let expected = [-sin * (TAU * x[1]).sin(), -cos * (TAU * x[1]).cos(), 0.0];
        assert!(b.iter().zip(expected).all(|(b, e)| (b - e).abs() < 1e-9), "{x:?}: {b:?}, expected {expected:?}");
        // What else is carried goes along.
        assert!((q[0] + 0.05 * (TAU * q[0]).sin() - x[0]).abs() < 1e-9, "{x:?}: {q:?}");
        most = most.max((q[0] - x[0]).abs());
    }
    assert!(most > 0.045, "{most}");
}
