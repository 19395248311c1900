//! Mass of a snapshot that is re-sampled stays where its particles have it, beside jumps as well.

use sph_formats::common::particle_names as names;
use sph_formats::{Column, ParticleTable, RunHeader, Species, UnitDimension, UnitSystem, Values};
use sph_prep::{Control, FORMATS, ParticleFile, Scene, WriteOptions, place, write};
use std::path::{Path, PathBuf};

const INNER: f64 = 0.25;

/// A lattice of `side` particles along each axis of the unit box, heavier by `contrast` within a ball in its middle, with densities that jump there.
fn snapshot(folder: &Path, (d, side): (usize, usize), contrast: f64, is_periodic: bool) -> (PathBuf, ParticleFile) {
    let n = side.pow(d as u32);
    let at = |i: usize| (0..d).map(move |k| ((i / side.pow(k as u32) % side) as f64 + 0.5) / side as f64);
    let density: Vec<f64> = (0..n).map(|i| if from_middle(at(i)) < INNER { contrast } else { 1.0 }).collect();
    let column = |name: &str, components: usize, values: Vec<f64>, dimension| {
        Column::new(name, components, Values::F64(values), dimension)
    };
    let columns = vec![
        column(names::COORDINATES, d, (0..n).flat_map(at).collect(), UnitDimension::LENGTH),
        column(
            names::MASSES,
            1,
            density.iter().map(|rho| rho / n as f64).collect(),
            UnitDimension::new(d as i8 - 3, 1, 0, 0),
        ),
        column(names::DENSITY, 1, density, UnitDimension::mass_density(3)),
    ];
    let header = RunHeader {
        dimension: d,
        box_size: [1.0; 3],
        periodic: [is_periodic; 3],
        box_corner: None,
        units: UnitSystem::CODE,
        time: 0.0,
        kernel: "Wendland C4".into(),
        kernel_neighbors: 64.0,
        provenance: Vec::new(),
        layouts: Vec::new(),
    };
    let file =
        ParticleFile { header, species: vec![Species { part_type: 0, table: ParticleTable { count: n, columns } }] };
    let path = folder.join("snapshot.npz");
    write(FORMATS, &path, Some("numpy"), &file, WriteOptions::default()).unwrap();
    (path, file)
}

fn from_middle(x: impl Iterator<Item = f64>) -> f64 {
    x.map(|x| (x - 0.5).powi(2)).sum::<f64>().sqrt()
}

/// Share of the mass farther from the middle than `radius`.
fn beyond(file: &ParticleFile, radius: f64) -> f64 {
    let table = &file.species[0].table;
    let (x, m) = (table.column(names::COORDINATES).unwrap(), table.column(names::MASSES).unwrap());
    let d = x.components;
    let masses: Vec<f64> = m.values.to_f64();
    let is_beyond = |i: &usize| from_middle((0..d).map(|k| x.values.get(d * i + k))) > radius;
    (0..table.count).filter(is_beyond).map(|i| masses[i]).sum::<f64>() / masses.iter().sum::<f64>()
}

/// A field that is smooth across the jump has some of the heavier side's mass on the lighter one, and as much too little of it as a whole; a factor on all of
/// it made the surroundings a seventh too heavy.
#[test]
fn the_surroundings_of_something_dense_keep_their_mass() {
    let folder = tempfile::tempdir().unwrap();
    let (d, side, count, contrast) = (3, 20, 3000, 20.0);
    let (path, own) = snapshot(folder.path(), (d, side), contrast, true);
    let scene = format!(
        "input: {{file: '{}'}}\ndomain: {{box: [[0, 0, 0], [1, 1, 1]], boundary: periodic}}\nparticles: {count}\noutput: {{units: code}}\n",
        path.display()
    );
    let (file, report) =
        place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"));
    // Three spacings from the jump.
    let radius = INNER + 3.0 / side as f64;
    let (found, wanted) = (beyond(&file, radius), beyond(&own, radius));
    // A percent, and the root of the number of particles that a sphere of that radius cuts.
    let n = f64::from(count) * wanted;
    let cut = n.powf((d - 1) as f64 / d as f64).sqrt() / n;
    assert!((found / wanted - 1.0).abs() < 0.01 + cut, "{found} for {wanted}");
    assert!(report.notes.iter().any(|n| n.contains("as beside jumps that sums")), "{:?}", report.notes);
}
