//! The balance of pressure and gravity: figures against direct sums, and what the stage does to bodies at rest.

use rayon::prelude::*;
use sph::domain::{Axis, Domain, Region};
use sph::kernel::{KernelName, default_kernel_neighbors, support_over_spacing};
use sph::random::keyed;
use sph_prep::metrics::{BalanceFigures, Measured, Thermodynamics};
use sph_prep::relaxation::Control;
use sph_prep::run::report::Report;
use sph_prep::scene::Scene;
use sph_prep::target::{Equilibrium, Positions};
use std::sync::atomic::AtomicBool;

/// A pressure and a gravity without any symmetry.
struct Tilted;
impl<const D: usize> Equilibrium<D> for Tilted {
    fn pressure(&self, x: &[f64; D]) -> f64 {
        2.0 + x.iter().enumerate().map(|(k, v)| (0.3 + k as f64 * 0.2) * v).sum::<f64>()
    }
    fn gravity(&self, x: &[f64; D], _: f64) -> [f64; D] {
        std::array::from_fn(|k| 0.5 + x[k])
    }
    fn has_gravity(&self) -> bool {
        true
    }
    fn gamma(&self) -> f64 {
        1.4
    }
}

/// W of Wendland C4 and its gradient, written out.
fn wendland_c4<const D: usize>(d: [f64; D], support: f64) -> (f64, [f64; D]) {
    let pi = std::f64::consts::PI;
    let r = d.iter().map(|v| v * v).sum::<f64>().sqrt();
    let q = r / support;
    if q >= 1.0 || r == 0.0 {
        return (0.0, [0.0; D]);
    }
    let norm = [1.5, 9.0 / pi, 495.0 / (32.0 * pi)][D - 1] / support.powi(D as i32);
    let (value, slope) = if D == 1 {
        ((1.0 - q).powi(5) * (8.0 * q * q + 5.0 * q + 1.0), -(1.0 - q).powi(4) * 14.0 * q * (4.0 * q + 1.0))
    } else {
        (
            (1.0 - q).powi(6) * (35.0 / 3.0 * q * q + 6.0 * q + 1.0),
            -(1.0 - q).powi(5) * 56.0 / 3.0 * q * (5.0 * q + 1.0),
        )
    };
    (norm * value, d.map(|v| norm * slope / support * v / r))
}

/// The mean of |a + g| / |g| by a loop over all pairs. Omega by differences of the summed density.
fn direct<const D: usize>(positions: &Positions<D>, measured: &Measured<D>, energy: &[f64]) -> f64 {
    let n = energy.len();
    let mass = 1.0 / n as f64;
    let kernel = |i: usize, j: usize, support: f64| {
        wendland_c4::<D>(std::array::from_fn(|k| positions[k][i] - positions[k][j]), support)
    };
    let own = |support: f64| {
        [1.5, 9.0 / std::f64::consts::PI, 495.0 / (32.0 * std::f64::consts::PI)][D - 1] / support.powi(D as i32)
    };
    let density =
        |i: usize, h: f64| mass * (own(h) + (0..n).filter(|&j| j != i).map(|j| kernel(i, j, h).0).sum::<f64>());
    let strength: Vec<f64> = (0..n)
        .map(|i| {
            let (h, step) = (measured.support[i], 1e-5 * measured.support[i]);
            let rho = density(i, h);
            let slope = (density(i, h + step) - density(i, h - step)) / (2.0 * step);
            0.4 * energy[i] / (rho * (1.0 + h * slope / (D as f64 * rho)))
        })
        .collect();
    let errors: Vec<f64> = (0..n)
        .into_par_iter()
        .map(|i| {
            let mut net: [f64; D] = std::array::from_fn(|k| 0.5 + positions[k][i]);
            let pull = net.iter().map(|g| g * g).sum::<f64>();
            for j in (0..n).filter(|&j| j != i) {
                let (a, b) = (kernel(i, j, measured.support[i]).1, kernel(i, j, measured.support[j]).1);
                (0..D).for_each(|k| net[k] -= mass * (strength[i] * a[k] + strength[j] * b[k]));
            }
            (net.iter().map(|f| f * f).sum::<f64>() / pull).sqrt()
        })
        .collect();
    errors.iter().sum::<f64>() / n as f64
}

fn check_figures<const D: usize>() {
    let n = 400;
    let domain = Domain::new([0.0; D], [1.0; D], [Axis::OPEN; D], Region::Box).unwrap();
    let mut positions: Positions<D> = std::array::from_fn(|_| Vec::new());
    for i in 0..n {
        let mut rng = keyed(5, 3, i);
        positions.iter_mut().for_each(|x| x.push(rand::RngExt::random::<f64>(&mut rng)));
        // In layers, so that no pair is so close that single precision tells its direction badly.
        positions[0][i as usize] = (i as f64 + 0.8 * positions[0][i as usize]) / n as f64;
    }
    let masses = vec![1.0 / n as f64; n as usize];
    let neighbors = default_kernel_neighbors(D).min(40.0);
    let guess = vec![support_over_spacing(D, neighbors) * (n as f64).powf(-1.0 / D as f64); n as usize];
    let kernel = KernelName::WendlandC4;
    let measured = Measured::new(kernel, &domain, &positions, &masses, &guess, neighbors);
    let energy: Vec<f64> = (0..n as usize).map(|i| 1.0 + 0.5 * positions[0][i]).collect();
    let thermodynamics = Thermodynamics { equilibrium: &Tilted, internal_energy: Some(&energy) };
    let density = vec![1.0; n as usize];
    let figures =
        BalanceFigures::new(kernel, &measured, &domain, &positions, (&masses, &density), &thermodynamics).unwrap();
    let expected = direct(&positions, &measured, &energy);
    assert!((figures.all / expected - 1.0).abs() < 1e-4, "{D}-D: {} against {expected}", figures.all);
}

#[test]
fn force_figures_are_those_of_a_direct_sum() {
    check_figures::<1>();
    check_figures::<2>();
    check_figures::<3>();
}

fn run(yaml: &str) -> Report {
    attempt(yaml).unwrap()
}

fn attempt(yaml: &str) -> sph_prep::Result<Report> {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = Scene::parse(yaml).unwrap();
    if let Some(file) = &mut scene.input.file {
        *file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(&*file);
    }
    scene.output.file = Some(folder.path().join("ic.hdf5"));
    let never = AtomicBool::new(false);
    let control = Control { deadline: None, interrupted: &never, observer: &|_| {} };
    sph_prep::run::pipeline::run(&scene, sph_formats::FORMATS, &control)
}

fn interior(report: &Report) -> f64 {
    report.balance.expect("pressure and gravity are known").interior.expect("there is an interior")
}

#[test]
fn a_balanced_star_feels_a_tenth_of_the_net_force_of_wvt() {
    let star = "input: {file: profiles/polytrope-1.5.nc}\nparticles: 4000\n";
    let wvt = run(&format!("{star}polish: none"));
    let balanced = run(&format!("{star}balance: {{evaluations: 150}}"));
    eprintln!("WVT {:.3}, balanced {:.4}", interior(&wvt), interior(&balanced));
    assert!(interior(&balanced) < 0.1 * interior(&wvt), "{} against {}", interior(&balanced), interior(&wvt));
}

/// Mean net force over gravity before and after the balance of a scene that is placed by WVT alone.
fn before_and_after(scene: &str, balance: &str) -> (f64, f64) {
    let before = run(&format!("{scene}balance: {{evaluations: 2, {balance}}}"));
    let after = run(&format!("{scene}balance: {{evaluations: 120, {balance}}}"));
    (interior(&before), interior(&after))
}

#[test]
fn atmospheres_come_to_rest_in_every_dimension() {
    let isothermal = "gravity: field, equation_of_state: {isothermal: {sound_speed: 0.7}}";
    for (count, domain) in [
        (60, "box: [[0], [1]], boundary: [reflecting]"),
        (900, "box: [[0, 0], [1, 1]], boundary: [reflecting, periodic]"),
        (3000, "box: [[0, 0, 0], [1, 1, 1]], boundary: [reflecting, periodic, periodic]"),
    ] {
        let scene = format!(
            "input: {{expression: 'exp(-2 * x)'}}\ndomain: {{{domain}}}\nparticles: {count}\npolish: none\nthermal: {{gamma: 1.4}}\n"
        );
        let (before, after) = before_and_after(&scene, isothermal);
        eprintln!("{count}: {before:.4} -> {after:.4}");
        assert!(after < 0.2 * before, "{domain}: {before} -> {after}");
    }
}

/// Where the pressure is the same everywhere no force holds it, and there is nothing that a net force could be a part of.
#[test]
fn an_even_pressure_is_balanced_without_gravity() {
    let scene = |balance: &str| {
        format!(
            "input: {{expression: 1 + 0.3*sin(2*pi*x), dimension: 2}}\ndomain: {{box: [[0, 0], [1, 1]], boundary: periodic}}\nparticles: 800\n\
             fields: {{pressure: '3'}}\npolish: none\nbalance: {{{balance}}}\noutput: {{units: code}}\n"
        )
    };
    let [by_default, without] = ["", "gravity: none"].map(|balance| run(&scene(balance)));
    assert!(by_default.balance.is_none(), "{:?}", by_default.balance);
    assert_eq!(by_default.noise.all, without.noise.all);
    let own = by_default.stages.iter().find(|stage| stage.stage.name == "balance").unwrap();
    assert!(own.history.len() > 5, "{}", own.history.len());
    for report in [&by_default, &without] {
        assert!(!report.notes.iter().any(|note| note.contains("holds gravity")), "{:?}", report.notes);
        assert!(report.notes.iter().any(|note| note.contains("against no gravity")), "{:?}", report.notes);
    }
}

#[test]
fn bodies_without_thermal_columns_are_balanced_by_their_own_weight() {
    for (dimension, count) in [(1, 80), (2, 1000), (3, 1500)] {
        let scene = format!(
            "input: {{file: profiles/polytrope-1.5.nc, carry: [], dimension: {dimension}}}\nparticles: {count}\npolish: none\n"
        );
        let (before, after) = before_and_after(&scene, "gravity: own");
        eprintln!("{dimension}-D: {before:.4} -> {after:.4}");
        assert!(after < 0.2 * before, "{dimension}-D: {before} -> {after}");
    }
}

#[test]
fn the_balance_does_not_depend_on_units() {
    let report = |length: f64, density: f64| {
        let k = 0.3 * length * length / density.powf(2.0 / 3.0);
        run(&format!(
            "input: {{expression: '{density:e} * exp(-(r/{length:e})^2)'}}\ndomain: {{ball: {{center: [0, 0, 0], radius: {:e}}}}}\nparticles: 600\n\
             polish: none\nbalance: {{evaluations: 30, equation_of_state: {{polytrope: {{constant: {k:e}, gamma: 1.6666666666666667}}}}}}\n",
            1.5 * length
        ))
    };
    let (unit, large) = (report(1.0, 1.0), report(1024.0, 0.125));
    // Rounding of powers grows from step to step; a wrong unit would change the force by its factor.
    assert!((interior(&unit) / interior(&large) - 1.0).abs() < 1e-2, "{} {}", interior(&unit), interior(&large));
}

#[test]
fn what_cannot_be_balanced_is_refused_with_the_remedy() {
    let refused = |yaml: &str| {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = Scene::parse(yaml).unwrap();
        scene.output.file = Some(folder.path().join("ic.hdf5"));
        let never = AtomicBool::new(false);
        let control = Control { deadline: None, interrupted: &never, observer: &|_| {} };
        sph_prep::run::pipeline::run(&scene, sph_formats::FORMATS, &control).unwrap_err().to_string()
    };
    let square = "input: {expression: '1 + x'}\ndomain: {box: [[0, 0], [1, 1]]}\nparticles: 100\n";
    assert!(refused(&format!("{square}balance: {{}}")).contains("equation_of_state"));
    assert!(refused(&format!("{square}balance: {{gravity: own}}")).contains("radial profile"));
    assert!(refused(&format!("{square}balance: {{constant: -1}}")).contains("balance.constant"));
    assert!(refused(&format!("{square}trim_masses: 0.1\nbalance: {{}}")).contains("trim_masses"));
}

/// Past the pairing instability no arrangement of particles apart is a minimum, but some are free of forces.
/// Its radius, mass and G are 1: so are those of the same model in units.
#[test]
fn a_model_in_pure_numbers_is_balanced_for_a_code() {
    let scene = |of: &str| {
        format!(
            "input: {{profile: {{polytrope: {{n: 1.5, {of}}}}}}}\nparticles: 1000\ntarget_code: swift\nbalance: {{evaluations: 20}}\n"
        )
    };
    let asked = run(&scene("mass: 1, radius: 1"));
    let by_itself = run(&scene("mass: 1, radius: 1").replace("balance: {evaluations: 20}\n", ""));
    let with_units = run(&scene("mass: 1 Msun, radius: 1 Rsun"));
    assert!(by_itself.plan.stages.contains(&sph_prep::relaxation::BALANCE), "{}", by_itself.text());
    let net = |report: &Report| report.balance.as_ref().map_or(f64::NAN, |balance| balance.all);
    assert!((net(&asked) / net(&with_units) - 1.0).abs() < 0.02, "{} {}", net(&asked), net(&with_units));
    assert!(net(&by_itself) <= net(&asked), "{} {}", net(&by_itself), net(&asked));
}

#[test]
fn forces_that_make_pairs_vanish_with_particles_apart() {
    let scene = "input: {file: profiles/polytrope-1.5.nc}\nparticles: 2000\nkernel: cubic-spline\nneighbors: 64\n";
    let report = run(&format!("{scene}balance: {{evaluations: 500}}\n"));
    assert!(report.neighbors.closest_pair > 0.4, "{:?}", report.neighbors);
    assert!(interior(&report) < 0.015, "{}", interior(&report));
    // Few evaluations take the systematic part all the same.
    let report = run(&format!("{scene}balance: {{evaluations: 60}}\n"));
    assert!(interior(&report) < 0.1, "{}", interior(&report));
}

#[test]
fn a_star_for_a_code_is_balanced_with_what_that_code_sums() {
    let scene = "input: {file: profiles/polytrope-1.5.nc}\nparticles: 2000\n";
    let report = run(&format!("{scene}target_code: swift\n"));
    assert_eq!(report.kernel, "cubic spline");
    assert!(report.stages.iter().any(|s| s.stage.name == "balance"));
    assert!(report.notes.iter().any(|n| n.starts_with("made for SWIFT") && n.contains("48.0 neighbors")));
    assert!(interior(&report) < 0.012, "{}", interior(&report));
    let other = run(scene);
    assert!(other.plan.left_out.iter().any(|l| l.what.contains("balance") && l.why.contains("--for")));
    assert!(other.notes.iter().any(|n| n.contains("--for swift")), "{:?}", other.notes);
}

/// A polytrope of index 1 as a table: radius, density, specific internal energy times `factor`, in numbers with G = 1.
fn polytrope_table(folder: &std::path::Path, factor: f64) -> std::path::PathBuf {
    let pi = std::f64::consts::PI;
    let mut text = String::from("# radius density internal_energy\n");
    for i in 0..=400 {
        let r = f64::from(i) / 400.0;
        let rho = if i == 0 { 1.0 } else { ((pi * r).sin() / (pi * r)).max(0.0) };
        // P = (2/pi) rho^2, u = P / ((gamma - 1) rho).
        text += &format!("{r:.12e} {rho:.12e} {:.12e}\n", factor * 1.5 * 2.0 / pi * rho);
    }
    let path = folder.join("star.txt");
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn an_energy_that_does_not_hold_the_body_is_not_replaced_silently() {
    let folder = tempfile::tempdir().unwrap();
    let scene = |factor: f64, rest: &str| {
        let path = polytrope_table(folder.path(), factor);
        format!("input: {{file: '{}'}}\nparticles: 1000\nbalance: {{evaluations: 20{rest}}}\n", path.display())
    };
    assert!(attempt(&scene(1.0, "")).is_ok());
    for factor in [0.1, 5.0] {
        let text = attempt(&scene(factor, "")).unwrap_err().to_string();
        for part in ["'internal_energy' is", "times (in the median", "thermal.gamma", "input.carry"] {
            assert!(text.contains(part), "{factor}: {text}");
        }
        assert!(attempt(&scene(factor, ", equation_of_state: at-rest")).is_ok());
    }
}

/// What a code is given moves, and so does what is followed; that forces are balanced is said to be of the body at rest.
#[test]
fn a_star_that_moves_is_followed_with_its_velocities() {
    let of = |rest: &str| {
        let scene = format!(
            "input: {{profile: {{polytrope: {{n: 1.5, mass: 1, radius: 1}}}}}}\nparticles: 600\nbalance: {{evaluations: 60}}\ncertify: 0.3\n{rest}"
        );
        sph_prep::place(&Scene::parse(&scene).unwrap(), sph_prep::FORMATS, &Control::default()).unwrap()
    };
    let told = |report: &sph_prep::Report| report.verdict.iter().any(|f| f.text.contains("its motion carries"));
    let (_, still) = of("");
    assert!(still.motion.is_none() && !told(&still) && still.certificate.unwrap().states[0].kinetic == 0.0);
    // A drift of the whole is no motion of the star.
    let (_, drifting) = of("motion: {bulk: [3, 0, 0]}\n");
    assert!(drifting.motion.is_none() && drifting.certificate.unwrap().states[0].kinetic < 1e-20);
    let (file, report) = of("fields: {v_r: '0.5*r', v_phi: '0.4*R'}\n");
    let column = |name: &str| file.species[0].table.column(name).unwrap().values.to_f64();
    let (v, u) = (column("Velocities"), column("InternalEnergy"));
    // 2 K/(3 (gamma - 1) U), with energies that the balance has changed by some percent.
    let expected = v.iter().map(|v| v * v).sum::<f64>() / (2.0 * u.iter().sum::<f64>());
    let motion = report.motion.unwrap();
    assert!((motion / expected - 1.0).abs() < 0.1 && told(&report), "{motion} {expected}");
    let states = report.certificate.unwrap().states;
    assert!(states[0].kinetic > 0.01, "{:?}", states[0]);
    assert!(states.last().unwrap().half_mass_radius > 1.05, "{:?}", states.last());
}

/// A body whose energy is not that of the pressure that holds it is no good for a code, and `balance: false` is obeyed.
#[test]
fn a_carried_energy_that_does_not_hold_the_body_is_bad_for_a_code() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("star.csv");
    // An n = 1 polytrope of 1e10 cm with 1 g/cm^3 in its center: P = 2 G R^2/pi rho^2.
    let made = |factor: f64, rest: &str| {
        let constant = 2.0 * 6.674_3e-8 * 1e20 / std::f64::consts::PI;
        let row = |i: i32| {
            let r = f64::from(i) / 400.0;
            let rho = if i == 0 { 1.0 } else { (std::f64::consts::PI * r).sin() / (std::f64::consts::PI * r) };
            format!("{},{},{}\n", 1e10 * r, rho.max(0.0), factor * 1.5 * constant * rho.max(0.0))
        };
        let rows: String = (0..=400).map(row).collect();
        std::fs::write(&path, format!("radius,density,internal_energy\n{rows}")).unwrap();
        let scene = format!(
            "input: {{file: '{}'}}\nunits: cgs\ntarget_code: swift\nparticles: 1200\npolish: none\n{rest}",
            path.display()
        );
        sph_prep::place(&Scene::parse(&scene).unwrap(), sph_prep::FORMATS, &Control::default()).unwrap().1
    };
    let balanced = |report: &sph_prep::Report| report.plan.stages.iter().any(|s| s.name == "balance");
    let bad = |report: &sph_prep::Report| {
        report.verdict.iter().any(|f| f.text.contains("will move when the simulation starts"))
    };
    let right = made(1.0, "balance: {evaluations: 5}\n");
    assert!(balanced(&right) && !bad(&right), "{:?}", right.verdict);
    let wrong = made(1.5, "");
    assert!(!balanced(&wrong) && bad(&wrong), "{:?}", wrong.verdict);
    let off = made(1.0, "balance: false\n");
    assert!(!balanced(&off) && !bad(&off), "{:?}", off.verdict);
    assert!(off.plan.left_out.iter().any(|l| l.why == "balance is false"), "{:?}", off.plan.left_out);
}

/// Energy and angular momentum are conserved, a balanced star is far quieter than a bare one, and what one and the other do
/// is what the forces in the report say: a star whose net force is a tenth of gravity moves.
#[test]
fn the_certificate_tells_a_quiet_star_from_one_that_moves() {
    let scene = "input: {file: profiles/polytrope-1.5.nc}\nparticles: 2000\ncertify: 1\n";
    let of = |rest: &str| run(&format!("{scene}{rest}")).certificate.unwrap();
    let balanced = of("target_code: swift\n");
    let bare = of("kernel: cubic-spline\nneighbors: 48\npolish: none\n");
    assert!(balanced.kinetic < 0.1 * bare.kinetic, "{:e} {:e}", balanced.kinetic, bare.kinetic);
    for c in [&balanced, &bare] {
        assert!(c.is_whole && c.states.len() == 11);
        assert!((c.states[10].time - 1.0).abs() < 1e-12);
        for s in &c.states {
            assert!(s.energy.abs() < 2e-4 && s.angular_momentum < 2e-3, "{s:?}");
        }
    }
    assert!(balanced.central_density_drift < 0.01 && balanced.half_mass_radius_drift < 0.01, "{balanced:?}");
    let first = balanced.states[0];
    assert!(first.kinetic == 0.0 && first.virial.abs() < 0.02, "{first:?}");
    let text = attempt("input: {expression: '1'}\ndomain: {box: [[0, 0], [1, 1]]}\nparticles: 100\ncertify: 1\n");
    assert!(text.unwrap_err().to_string().contains("its own gravity holds"));
}
