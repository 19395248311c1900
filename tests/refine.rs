//! Refinement spheres, in snapshots and in fields: what is far stays to the bit, totals are kept, densities are those of closed forms.

use sph_formats::common::particle_names as names;
use sph_formats::{FORMATS, FieldRequest, FileContent, ParticleFile};
use sph_prep::relaxation::Control;
use sph_prep::run::pipeline;
use sph_prep::scene::Scene;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

fn read(path: &Path) -> ParticleFile {
    match sph_formats::read(FORMATS, path, None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(file) => file,
        FileContent::Field(_) => panic!("a field"),
    }
}

/// Runs a scene on `input`, if there is one, into a file beside.
fn run(folder: &Path, name: &str, input: Option<&Path>, text: &str) -> Result<PathBuf, String> {
    let mut scene = Scene::parse(text).map_err(|e| e.to_string())?;
    let output = folder.join(name);
    if let Some(input) = input {
        scene.input.file = Some(input.into());
    }
    scene.output.file = Some(output.clone());
    pipeline::run(&scene, FORMATS, &Control::default()).map_err(|e| e.to_string())?;
    Ok(output)
}

fn numbers(file: &ParticleFile, name: &str) -> Vec<f64> {
    file.species[0].table.column(name).unwrap_or_else(|| panic!("no column {name}")).values.to_f64()
}

/// 1 + 0.4 sin(2 pi x), which repeats over the edge of 1.
fn density(x: f64) -> f64 {
    1.0 + 0.4 * (2.0 * PI * x).sin()
}

/// A periodic box of equal masses in `d` dimensions, in motion.
fn snapshot(folder: &Path, d: usize, count: usize) -> PathBuf {
    let corner = |v: &str| format!("[{}]", vec![v; d].join(", "));
    let velocity = ["1 + 0.2*sin(2*pi*x)", "0.3*cos(2*pi*x)", "0.1*sin(2*pi*y)"][..d].join(", ");
    let scene = format!(
        "input: {{expression: '1 + 0.4*sin(2*pi*x)'}}\ndomain: {{box: [{}, {}], boundary: [periodic]}}\nparticles: {count}\n\
         fields: {{velocity: [{velocity}], internal_energy: '2 + 0.5*cos(2*pi*x)'}}\noutput: {{units: code, double_precision: true}}",
        corner("0"),
        corner("1")
    );
    run(folder, &format!("box-{d}.hdf5"), None, &scene).unwrap()
}

/// Place, mass, velocity and energy of each particle by its number.
fn by_number(file: &ParticleFile) -> BTreeMap<i64, Vec<u64>> {
    let d = file.header.dimension;
    let ids = numbers(file, names::PARTICLE_IDS);
    let mut rows: BTreeMap<i64, Vec<u64>> = ids.iter().map(|id| (*id as i64, Vec::new())).collect();
    assert_eq!(rows.len(), ids.len(), "numbers are unique");
    let columns = [(names::COORDINATES, d), (names::MASSES, 1), (names::VELOCITIES, d), (names::INTERNAL_ENERGY, 1)];
    for (name, width) in columns {
        for (id, row) in ids.iter().zip(numbers(file, name).chunks_exact(width)) {
            rows.get_mut(&(*id as i64)).unwrap().extend(row.iter().map(|v| v.to_bits()));
        }
    }
    rows
}

/// Mass, momentum, angular momentum about the origin, kinetic with internal energy, by plain sums.
fn totals(file: &ParticleFile) -> (f64, Vec<f64>, [f64; 3], f64) {
    let d = file.header.dimension;
    let [x, v, m, u] =
        [names::COORDINATES, names::VELOCITIES, names::MASSES, names::INTERNAL_ENERGY].map(|name| numbers(file, name));
    let momentum = (0..d).map(|k| m.iter().enumerate().map(|(i, m)| m * v[i * d + k]).sum()).collect();
    let turning = |a: usize, b: usize| -> f64 {
        if a.max(b) >= d {
            0.0
        } else {
            m.iter().enumerate().map(|(i, m)| m * (x[i * d + a] * v[i * d + b] - x[i * d + b] * v[i * d + a])).sum()
        }
    };
    let energy =
        m.iter().enumerate().map(|(i, m)| m * (u[i] + 0.5 * v[i * d..(i + 1) * d].iter().map(|v| v * v).sum::<f64>()));
    (m.iter().sum(), momentum, [turning(1, 2), turning(2, 0), turning(0, 1)], energy.sum())
}

/// Sums over some thousand particles are off by 1e-13 of what is summed.
fn assert_same_totals(before: &ParticleFile, after: &ParticleFile, is_open: bool) {
    let (a, b) = (totals(before), totals(after));
    assert!((a.0 / b.0 - 1.0).abs() < 1e-12, "mass {a:?} {b:?}");
    let unit = a.0;
    assert!(a.1.iter().zip(&b.1).all(|(a, b)| (a - b).abs() < 1e-12 * unit), "momentum {a:?} {b:?}");
    assert!(
        !is_open || a.2.iter().zip(&b.2).all(|(a, b)| (a - b).abs() < 1e-12 * unit),
        "angular momentum {a:?} {b:?}"
    );
    assert!((a.3 / b.3 - 1.0).abs() < 1e-12, "energy {a:?} {b:?}");
}

/// Distance in a periodic box of edge 1.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| ((a - b) - (a - b).round()).powi(2)).sum::<f64>().sqrt()
}

/// Root mean square of the summed density over the true one, less its mean.
fn scatter(file: &ParticleFile, true_density: impl Fn(&[f64]) -> Option<f64>) -> f64 {
    let d = file.header.dimension;
    let x = numbers(file, names::COORDINATES);
    let pairs = numbers(file, names::DENSITY).into_iter().zip(x.chunks_exact(d));
    let ratios: Vec<f64> = pairs.filter_map(|(rho, x)| Some(rho / true_density(x)?)).collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    (ratios.iter().map(|r| (r / mean - 1.0).powi(2)).sum::<f64>() / ratios.len() as f64).sqrt()
}

/// Distance of the closest pair in a periodic box of edge 1, in the smaller spacing of the two.
fn closest(file: &ParticleFile) -> f64 {
    let d = file.header.dimension;
    let (x, m) = (numbers(file, names::COORDINATES), numbers(file, names::MASSES));
    let spacing = |i: usize| (m[i] / density(x[i * d])).powf(1.0 / d as f64);
    let place = |i: usize| &x[i * d..(i + 1) * d];
    let nearest = |i: usize| {
        let own = spacing(i);
        (0..i).map(|j| apart(place(i), place(j)) / own.min(spacing(j))).fold(f64::INFINITY, f64::min)
    };
    (1..m.len()).map(nearest).fold(f64::INFINITY, f64::min)
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn particles_far_from_a_sphere_stay_to_the_bit_in_every_dimension() {
    let folder = tempfile::tempdir().unwrap();
    for (d, count, factor) in [(1, 400, 2.0), (2, 2500, 4.0), (3, 8000, 8.0)] {
        let input = snapshot(folder.path(), d, count);
        let before = read(&input);
        // Across the face of the box.
        let center = [0.95, 0.5, 0.5][..d].to_vec();
        let scene = format!(
            "refine: {{center: {center:?}, radius: 0.2, shell: 0.1, factor: {factor}}}\noutput: {{double_precision: true}}"
        );
        let after = read(&run(folder.path(), &format!("fine-{d}.hdf5"), Some(&input), &scene).unwrap());
        assert_same_totals(&before, &after, false);
        let (old, new) = (by_number(&before), by_number(&after));
        let place = |row: &[u64]| row[..d].iter().map(|b| f64::from_bits(*b)).collect::<Vec<f64>>();
        let mut far = 0;
        for (id, row) in &old {
            if apart(&place(row), &center) > 0.3 {
                assert_eq!(new.get(id), Some(row), "{d}-D: particle {id}");
                far += 1;
            }
        }
        assert!(far > count / 4 && new.len() > count, "{d}-D: {far} of {count}, now {}", new.len());
        // Well within the mass of each is that of before over the factor: counts are whole numbers of some tens (1-D) to thousands.
        let within = |rows: &BTreeMap<i64, Vec<u64>>| -> (f64, f64, f64) {
            let masses = rows.values().filter(|r| apart(&place(r), &center) < 0.18).map(|r| f64::from_bits(r[d]));
            masses.fold((0.0, 0.0_f64, f64::INFINITY), |(n, hi, lo), m| (n + 1.0, hi.max(m), lo.min(m)))
        };
        let (a, b) = (within(&old), within(&new));
        assert!((b.0 / a.0 / factor - 1.0).abs() < 0.1, "{d}-D: {a:?} {b:?}");
        assert!(b.1 * factor / a.1 < 1.2 && b.2 * factor / a.2 > 0.8, "{d}-D: {a:?} {b:?}");
        // Summed densities about the true one: masses of new particles follow them, and what is left is the noise of sums over masses of which
        // some are 2 to 8 times as large as others within a kernel. Without a correction of masses that is 1 to 4 %.
        let off = scatter(&after, |x| Some(density(x[0])));
        println!("{d}-D: density {off}, {} of {}, closest {}", new.len(), old.len(), closest(&after));
        assert!(off < [0.003, 0.01, 0.02][d - 1], "{d}-D: {off}");
        // Random places would have pairs at a tenth of a spacing and less.
        assert!(closest(&after) > 0.4, "{d}-D: {}", closest(&after));
    }
}

/// Masses that vary are not what a snapshot with equal ones has.
#[test]
fn particles_that_are_replaced_beyond_the_shell_are_warned_about() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "input: {expression: '1', dimension: 2}\ndomain: {box: [[0, 0], [1, 1]], boundary: [periodic]}\nparticles: 500\n\
                 resolution: {number_density: '1 + 0.9*sin(2*pi*x)'}\noutput: {units: code}";
    let input = run(folder.path(), "varied.hdf5", None, scene).unwrap();
    let mut scene =
        Scene::parse("refine: {center: [0.5, 0.5], radius: 0.2, factor: 4}\noutput: {units: code}").unwrap();
    scene.input.file = Some(input);
    scene.output.file = Some(folder.path().join("finer.hdf5"));
    let report = pipeline::run(&scene, FORMATS, &Control::default()).unwrap();
    assert!(report.warnings.iter().any(|w| w.contains("beyond the shell")), "{:?}", report.warnings);
}

#[test]
fn a_sphere_that_moves_on_leaves_no_fine_particles_behind() {
    let folder = tempfile::tempdir().unwrap();
    let count = 2500;
    let input = snapshot(folder.path(), 2, count);
    let mass = 1.0 / count as f64;
    let at = |time: f64| {
        format!(
            "refine: {{center: [0.2, 0.5], velocity: [0.1, 0], time: {time}, radius: 0.15, factor: 4, particle_mass: {mass}}}\n\
             output: {{double_precision: true}}"
        )
    };
    let first = run(folder.path(), "first.hdf5", Some(&input), &at(0.0)).unwrap();
    // Where all is as it should be, nothing changes.
    let again = run(folder.path(), "again.hdf5", Some(&first), &at(0.0)).unwrap();
    assert_eq!(by_number(&read(&first)), by_number(&read(&again)));
    let next = run(folder.path(), "next.hdf5", Some(&first), &at(1.0)).unwrap();
    let (a, b) = (read(&first), read(&next));
    assert_same_totals(&a, &b, false);
    let (old, new) = (by_number(&a), by_number(&b));
    let stayed = old.iter().filter(|(id, row)| new.get(id) == Some(row)).count();
    let place = |row: &[u64]| [f64::from_bits(row[0]), f64::from_bits(row[1])];
    let mut fine = 0;
    for row in new.values() {
        let (r, m) = (apart(&place(row), &[0.3, 0.5]), f64::from_bits(row[2]));
        // What stays is right to a factor of 1.5, what is new to some percent of the whole.
        assert!(r < 0.1875 || m > mass / 1.7, "{m} at {r}");
        assert!(r > 0.15 || m < 1.7 * mass / 4.0, "{m} at {r}");
        fine += usize::from(r < 0.15);
    }
    // 4 times the particles that are there: the density of the sine over the disc about x = 0.3, to the grains of its rim.
    let expected = 4.0 * count as f64 * PI * 0.15_f64.powi(2) * (1.0 + 0.4 * (2.0 * PI * 0.3).sin());
    assert!((fine as f64 / expected - 1.0).abs() < 0.1, "{fine} against {expected}");
    // Only crescents of the two discs change: of the box less than half, and of the particles in both discs most stay.
    assert!(stayed > 2 * old.len() / 3, "{stayed} of {}", old.len());
    let off = scatter(&b, |x| Some(density(x[0])));
    println!("moved: density {off}, {stayed} of {} stay", old.len());
    assert!(off < 0.02, "{off}");
}

#[test]
fn a_field_is_finer_in_a_moving_interval_disc_or_sphere() {
    let folder = tempfile::tempdir().unwrap();
    for (d, count, factor) in [(1, 300, 4.0), (2, 2000, 4.0), (3, 4000, 8.0)] {
        let corner = |v: &str| format!("[{}]", vec![v; d].join(", "));
        let [center, velocity] = [["-0.1", "0.5", "0.5"], ["0.3", "0", "0"]].map(|v| v[..d].join(", "));
        let scene = format!(
            "input: {{expression: '1'}}\ndomain: {{box: [{}, {}], boundary: [periodic]}}\nparticles: {count}\n\
             refine: {{center: [{center}], velocity: [{velocity}], time: 2, radius: 0.2, shell: 0.1, factor: {factor}}}\noutput: {{units: code}}",
            corner("0"),
            corner("1")
        );
        let file = read(&run(folder.path(), &format!("field-{d}.hdf5"), None, &scene).unwrap());
        let (x, m) = (numbers(&file, names::COORDINATES), numbers(&file, names::MASSES));
        assert_eq!(m.len(), count);
        assert!((m.iter().sum::<f64>() - 1.0).abs() < 1e-5);
        let mean = |is_in: &dyn Fn(f64) -> bool| {
            let own: Vec<f64> =
                x.chunks_exact(d).zip(&m).filter(|(x, _)| is_in(apart(x, &[0.5; 3][..d]))).map(|p| *p.1).collect();
            own.iter().sum::<f64>() / own.len() as f64
        };
        // Masses are rho/n by the law itself.
        let ratio = mean(&|r| r > 0.3) / mean(&|r| r < 0.2);
        assert!((ratio / factor - 1.0).abs() < 1e-5, "{d}-D: {ratio}");
        // Sums over masses that differ by the factor within a kernel.
        let off = scatter(&file, |_| Some(1.0));
        println!("field in {d}-D: {off}");
        assert!(off < [0.03, 0.03, 0.06][d - 1], "{d}-D: {off}");
    }
}

/// The bundled snapshot, about its middle: rho = 15/(8 pi) (1 - r^2), v = (0.1 - 0.3 y, 0.3 x, 0), u = rho.
fn star(x: &[f64]) -> f64 {
    15.0 / (8.0 * PI) * (1.0 - x.iter().map(|v| v * v).sum::<f64>())
}

fn profiles() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles")
}

fn of_profile(folder: &Path, name: &str) -> (ParticleFile, ParticleFile) {
    let mut scene = Scene::load(&profiles().join(name)).unwrap();
    let (input, output) = (scene.input.file.clone().unwrap(), folder.join("out.hdf5"));
    (scene.output.file, scene.output.double_precision) = (Some(output.clone()), true);
    pipeline::run(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
    (read(&input), read(&output))
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn the_refinement_sphere_in_the_star_keeps_its_angular_momentum() {
    let folder = tempfile::tempdir().unwrap();
    let (before, after) = of_profile(folder.path(), "refinement-sphere.yaml");
    assert_same_totals(&before, &after, true);
    let (old, new) = (by_number(&before), by_number(&after));
    let from = |row: &[u64]| {
        [1.8_f64, 2.0, 2.0].iter().zip(row).map(|(c, b)| (f64::from_bits(*b) - c).powi(2)).sum::<f64>().sqrt()
    };
    let far: Vec<_> = old.iter().filter(|(_, row)| from(row) > 0.4).collect();
    assert!(far.len() > 3000 && far.iter().all(|(id, row)| new.get(id) == Some(row)));
    assert!(new.len() > 4300, "{}", new.len());
    // Of the snapshot's own densities and the new ones, away from the surface: kernel sums of 4000 particles smooth (1 - r^2) by
    // a constant, and scatter as those of the solver and of WVT do.
    let off = scatter(&after, |x| {
        let x: Vec<f64> = x.iter().map(|v| v - 2.0).collect();
        (x.iter().map(|v| v * v).sum::<f64>() < 0.4).then(|| star(&x))
    });
    println!("star: density {off}");
    assert!(off < 0.03, "{off}");
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn the_star_is_the_same_at_eight_times_and_at_an_eighth_of_its_resolution() {
    let folder = tempfile::tempdir().unwrap();
    for (name, count, radius, most) in
        [("resample-finer.yaml", 32_000, 0.8, 0.02), ("resample-coarser.yaml", 500, 0.55, 0.06)]
    {
        let (before, after) = of_profile(folder.path(), name);
        assert_eq!(numbers(&after, names::MASSES).len(), count);
        let (a, b) = (totals(&before), totals(&after));
        assert!((a.0 / b.0 - 1.0).abs() < 1e-12, "{name}: mass {a:?} {b:?}");
        assert!(a.1.iter().zip(&b.1).all(|(a, b)| (a - b).abs() < 1e-12), "{name}: momentum {a:?} {b:?}");
        assert!((a.3 / b.3 - 1.0).abs() < 1e-3, "{name}: energy {a:?} {b:?}");
        // About their centers of mass, which are in different boxes.
        let spin = |file: &ParticleFile, total: &(f64, Vec<f64>, [f64; 3], f64)| {
            let (x, m) = (numbers(file, names::COORDINATES), numbers(file, names::MASSES));
            let c: Vec<f64> =
                (0..3).map(|k| m.iter().enumerate().map(|(i, m)| m * x[3 * i + k]).sum::<f64>() / total.0).collect();
            (c.clone(), total.2[2] - (c[0] * total.1[1] - c[1] * total.1[0]))
        };
        let ((_, own), (center, found)) = (spin(&before, &a), spin(&after, &b));
        assert!((found / own - 1.0).abs() < 1e-11, "{name}: spin {own} {found}");
        // Against the true density, away from the surface: what the fit to 4000 noisy densities leaves, half a spacing of uncertainty of
        // where the surface is, and the smoothing over the new spacing.
        let (x, rho) = (numbers(&after, names::COORDINATES), numbers(&after, names::DENSITY));
        let offsets = x.chunks_exact(3).map(|x| (0..3).map(|k| x[k] - center[k]).collect::<Vec<f64>>()).zip(rho);
        let inner: Vec<f64> = offsets
            .filter(|(x, _)| x.iter().map(|v| v * v).sum::<f64>() < radius * radius)
            .map(|(x, rho)| rho / star(&x) - 1.0)
            .collect();
        let mean = inner.iter().map(|e| e.abs()).sum::<f64>() / inner.len() as f64;
        println!("{name}: density {mean} over {}", inner.len());
        assert!(mean < most, "{name}: {mean}");
    }
}

#[test]
fn what_would_change_all_particles_is_refused_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let input = snapshot(folder.path(), 1, 100);
    let refused = |text: &str, words: &[&str]| {
        let error = run(folder.path(), "no.hdf5", Some(&input), text).unwrap_err();
        assert!(words.iter().all(|w| error.contains(w)), "{text}: {error}");
    };
    let sphere = "refine: {center: [0.5], radius: 0.1}";
    refused(&format!("{sphere}\npolish: solver"), &["polish", "state `particles`"]);
    refused(&format!("{sphere}\nmotion: {{bulk: [1]}}"), &["motion", "stay as they are"]);
    refused(&format!("{sphere}\noutput: {{units: solar}}"), &["output.units"]);
    refused("refine: {center: [0.5, 0.5], radius: 0.1}", &["refine.center", "expected 1"]);
    refused("refine: {radius: -1}", &["refine.radius", "more than 0"]);
    refused("refine: {radius: 0.1, factor: 0}", &["refine.factor", "expected"]);
    refused("refine: {radius: 0.1, factor: .nan}", &["refine.factor"]);
    refused("refine: {radius: 0.1, velocity: [1e300], time: 1e300}", &["refine.center", "finite"]);
    refused("refine: {radius: 0.1, particle_mass: 1e-300}", &["refine.factor", "particles and more"]);
    refused("particles: 50\nrefine: {radius: 0.1, particle_mass: 1}", &["refine.particle_mass", "leave one out"]);
    refused("refine: {factor: 8}", &["radius"]);
    // A sphere about all of them, and one about none.
    let all =
        run(folder.path(), "all.hdf5", Some(&input), "refine: {center: [0.5], radius: 1e300, factor: 3}").unwrap();
    assert_eq!(numbers(&read(&all), names::MASSES).len(), 300);
    let none =
        run(folder.path(), "none.hdf5", Some(&input), "refine: {center: [0.5], radius: 1e-9, shell: 1e-9}").unwrap();
    assert_eq!(by_number(&read(&none)), by_number(&read(&input)));
    let scene = format!("input: {{file: '{}'}}\nrefine: {{center: [0.5], radius: 1e-9, shell: 1e-9}}", input.display());
    let (_, report) = sph_prep::place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap();
    assert!(report.warnings.iter().any(|w| w.contains("refine changes nothing")), "{:?}", report.warnings);
    let of_field = "input: {expression: '1', dimension: 2}\ndomain: {box: [[0, 0], [1, 1]]}\nparticles: 200\nrefine: {center: [3, 3], radius: 0.1}";
    for (scene, is_told) in [(of_field.to_owned(), true), (of_field.replace("[3, 3]", "[1, 1]"), false)] {
        let (_, report) = sph_prep::place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap();
        let told = report.warnings.iter().any(|w| w.contains("refine changes nothing"));
        assert_eq!(told, is_told, "{scene}: {:?}", report.warnings);
    }
    // With `particles` all of them are placed anew.
    let anew = run(folder.path(), "anew.hdf5", Some(&input), &format!("{sphere}\nparticles: 150")).unwrap();
    assert_eq!(numbers(&read(&anew), names::MASSES).len(), 150);
}

/// A snapshot of waves, coarser by 8 in a sphere of which the shell is about a coarse spacing wide: the new particles are judged by themselves, and of
/// several numbers of iterations the one counts that brings them nearest to the density.
#[test]
#[ignore = "slow: .ci/full runs it"]
fn a_narrow_shell_is_judged_by_the_new_particles() {
    let folder = tempfile::tempdir().unwrap();
    let input = snapshot(folder.path(), 3, 4000);
    let off = |iterations: &str| {
        let text = format!(
            "refine: {{center: [0.5, 0.5, 0.5], radius: 0.3, shell: 0.15, factor: 0.125}}\n{iterations}output: {{units: code, double_precision: true}}"
        );
        let mut scene = Scene::parse(&text).unwrap();
        scene.input.file = Some(input.clone());
        scene.output.file = Some(folder.path().join("coarse.hdf5"));
        let report = pipeline::run(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"));
        let told =
            report.verdict.iter().find(|f| f.text.contains("of the new particles")).expect("a verdict").text.clone();
        (report.renewed.unwrap(), told)
    };
    let (chosen, told) = off("");
    assert!(told.contains(&format!("{:.2} %", 100.0 * chosen)) && told.contains("refine.shell"), "{told}");
    let (most, _) = off("wvt: {iterations: 60}\n");
    println!("new particles: {chosen} off, after 60 iterations {most}");
    assert!(chosen <= most, "{chosen} {most}");
    // By the file alone, in the middle, where the new particles see each other.
    let file = read(&folder.path().join("coarse.hdf5"));
    assert!(numbers(&file, names::MASSES).len() < 3500);
}
