//! Builds the particle file from placed particles.

use super::columns::{self, EnergySource, KnownEnergy};
use super::conservation::{Conserved, conserve};
use super::frame::{Factors, Frame};
use super::origin;
use super::others::Others;
use super::walls::{Fluid, Walls};
use crate::error::{Error, Result};
use crate::input::collisionless::Drawn;
use crate::input::displacement::Displaced;
use crate::input::internal_units::Prepared;
use crate::input::totals::MassPoints;
use crate::scene::{CheckpointInput, Conversion, OriginInput, Quantity, Scene, values};
use crate::target::{Positions, at};
use sph::domain::Axis;
use sph::parallel;
use sph_formats::common::particle_names as names;
use sph_formats::model::{DISC_KEY, GRAVITY_KEY, adiabatic_fact};
use sph_formats::{Column, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension, UnitSystem, Values};

/// How the note begins that says where a body alone has been moved.
pub const MOVED: &str = "the body is moved to the middle";

/// Columns in internal units.
pub struct RawColumns<'a, const D: usize> {
    pub positions: &'a Positions<D>,
    pub masses: Vec<f64>,
    pub support: Vec<f64>,
    pub density: Vec<f64>,
    pub target_density: Vec<f64>,
    /// Internal energies, and the unit of them in cgs (or in the input's numbers).
    pub balanced: Option<(Vec<f64>, f64)>,
    /// Random velocities of collisionless particles.
    pub(crate) drawn: Option<&'a Drawn>,
    /// Where particles are moved in the end; what they carry is that of `positions`.
    pub displaced: Option<&'a Displaced<D>>,
}

/// What the file says of its making.
pub struct Making<'a> {
    pub kernel: &'a str,
    pub kernel_neighbors: f64,
    /// Why relaxation ended.
    pub stop: String,
    /// Whether the format cannot do without internal energies.
    pub requires_energy: bool,
    /// Whether `units` have a meaning: the input's are known.
    pub units_known: bool,
    /// From the scene's plain numbers to those of the file.
    pub conversion: Conversion,
    /// What is at the origin, where that is chosen.
    pub origin: Option<OriginInput>,
}

/// A file, with what there is to be said of it.
pub struct Made {
    pub file: ParticleFile,
    pub notes: Vec<String>,
    /// What is probably not meant.
    pub warnings: Vec<String>,
    /// Columns that it does without, and why.
    pub left_out: Vec<(&'static str, &'static str)>,
    /// Of a snapshot.
    pub conserved: Option<Conserved>,
}

/// Makes the file of `raw`, in `units`.
///
/// # Errors
/// A motion with the wrong number of components, or a carried pressure that is not positive.
pub(crate) fn particle_file<const D: usize>(
    scene: &Scene,
    prepared: &Prepared<D>,
    raw: RawColumns<'_, D>,
    (units, factors): (UnitSystem, &Factors),
    walls: Option<&Walls<D>>,
    making: &Making<'_>,
) -> Result<Made> {
    let domain = &prepared.source.domain;
    let n = raw.masses.len();
    let others = Others::of(prepared)?;
    let frame = match (walls, &others) {
        (Some(walls), Some(others)) => Frame::new(&others.around(&walls.frame)?, 1.0),
        (Some(walls), None) => Frame::new(&walls.frame, 1.0),
        (None, Some(others)) => Frame::new(&others.around(domain)?, scene.output.box_factor),
        (None, None) => Frame::new(domain, scene.output.box_factor),
    };
    let fluid = Fluid::of(&prepared.target().densities(raw.positions), &raw.support, factors);
    let (mut notes, mut warnings, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
    let places = raw.displaced.map_or(raw.positions, |d| &d.positions);
    let frame = placed(frame, prepared, (places, &raw.masses), factors, making)?;
    let corner: Option<[f64; 3]> = frame.corner(factors.length).map(filled);
    if let (Some(origin), Some(corner), Some(at)) = (&making.origin, corner, frame.origin(factors.length)) {
        let edges = frame.box_size.map(|b| b * factors.length);
        notes.push(origin::describe(origin, &at, (&corner[..D], &edges[..D])));
    } else if frame.isolated {
        let edges: Vec<String> =
            frame.box_size[..D].iter().map(|edge| format!("{:.6e}", edge * factors.length)).collect();
        let edges = match edges.iter().all(|edge| *edge == edges[0]) {
            true => format!("edge {}", edges[0]),
            false => format!("edges {}", edges.join(" x ")),
        };
        notes.push(format!("{MOVED} of a box of {edges} (output.box_factor {})", scene.output.box_factor));
    }
    // A magnetic field is one of places, where its divergence vanishes, and so is what keeps a body in balance; what else is carried goes along with
    // the gas.
    let is_at_rest = raw.displaced.is_some_and(|d| d.is_at_rest);
    let is_of_places = |name: &str| name == names::MAGNETIC_FIELD || is_at_rest && name == names::VELOCITIES;
    let taken_at = |name: &str| if is_of_places(name) { places } else { raw.positions };
    let carried = prepared.source.carried.iter();
    let mut carried: Vec<Column> =
        carried.map(|f| columns::column(f.as_ref(), taken_at(&f.info().name), &units)).collect();
    columns::check_finite(&carried)?;
    let conserved = kept_totals(prepared, (raw.positions, &raw.masses), raw.balanced.is_some(), &units, &mut carried);
    notes.extend(conserved.as_ref().map(Conserved::describe));
    let mut velocities =
        placed_columns(scene, prepared, raw.positions, (factors.length, &making.conversion), &mut carried)?;
    let collisionless = scene.collisionless.as_ref();
    if let Some(drawn) = raw.drawn {
        add_drawn(drawn, (&units, making.units_known), velocities.get_or_insert_with(|| vec![0.0; D * n]));
    }
    if let Some(displaced) = raw.displaced {
        add_streams(scene, displaced, (factors.length, &making.conversion), &mut velocities)?;
    }
    let target_density = parallel::map(n, |i| raw.target_density[i] * factors.density);
    let energy_unit = if making.units_known { 1.0 / units.to_cgs(UnitDimension::SPECIFIC_ENERGY) } else { 1.0 };
    let balanced = raw.balanced.map(|(u, unit)| parallel::map(n, |i| u[i] * unit * energy_unit));
    let thermal = &scene.thermal;
    let energy = || {
        let energy = thermal.internal_energy.as_ref();
        let value =
            |u: &Quantity| u.value("thermal.internal_energy", UnitDimension::SPECIFIC_ENERGY, &making.conversion);
        energy.map(value).transpose()
    };
    if balanced.is_some() && scene.states_balanced_energies() {
        let before = carried.len();
        carried.retain(|c| c.name != names::PRESSURE);
        if carried.len() < before {
            left_out.push(("Pressure", "the input's is not that of balance.equation_of_state"));
        }
    }
    let known = KnownEnergy { balanced, given: energy()?, gamma: thermal.gamma };
    let has_temperature = carried.iter().any(|c| c.name == names::TEMPERATURE);
    if collisionless.is_some() {
        carried.retain(|c| !OF_GAS.contains(&c.name.as_str()));
    }
    let energies = match collisionless {
        // There is none, and nothing to say of it.
        Some(_) => EnergySource::Carried,
        None => columns::internal_energy(&mut carried, &target_density, known, making.requires_energy)?,
    };
    match energies {
        EnergySource::Placeholder if has_temperature || scene.code().is_some() => {
            warnings.push(placeholder_note(has_temperature));
        }
        EnergySource::Placeholder => notes.push(placeholder_note(false)),
        EnergySource::NotWritten if has_temperature => {
            left_out.push(("InternalEnergy", "a temperature gives none without fields.mean_molecular_weight"));
        }
        EnergySource::NotWritten => left_out.push(("InternalEnergy", "nothing thermal came in")),
        EnergySource::Pressure { has_dust } => notes.push(format!(
            "InternalEnergy is P/((gamma - 1) rho) from the carried pressure, gamma = {}{}",
            thermal.gamma,
            if has_dust { ", rho that of the gas without its dust" } else { "" }
        )),
        EnergySource::Carried if collisionless.is_none() => {
            let other = columns::other_gamma(&carried, &target_density, thermal.gamma);
            warnings.extend(other.map(|other| {
                format!(
                    "by the input's pressure and internal energy gamma is {other:.4} everywhere, but thermal.gamma is {:.4}, with which \
                     balance, certificate and parameter files reckon; `thermal: {{gamma: {other:.4}}}` states the input's",
                    thermal.gamma
                )
            }));
        }
        EnergySource::Carried | EnergySource::Given | EnergySource::Balanced => {}
    }
    if velocities.is_none() {
        left_out.push(("velocities", "nothing moves"));
    }
    let scaled = |v: Vec<f64>, factor: f64| Values::F64(parallel::map(v.len(), |i| v[i] * factor));
    let coordinates = Values::F64(frame.coordinates(places, factors.length));
    let mut all = vec![
        Column::new(names::COORDINATES, D, coordinates, UnitDimension::LENGTH),
        Column::new(names::MASSES, 1, scaled(raw.masses, factors.mass), UnitDimension::new(D as i8 - 3, 1, 0, 0)),
        Column::new(names::SUPPORT_RADIUS, 1, scaled(raw.support, factors.length), UnitDimension::LENGTH),
        Column::new(names::DENSITY, 1, scaled(raw.density, factors.density), UnitDimension::mass_density(3)),
        Column::new(names::PARTICLE_IDS, 1, Values::I64((1..=n as i64).collect()), UnitDimension::NONE),
    ];
    if scene.output.target_density {
        let volume = |i: usize| raw.displaced.map_or(1.0, |d| d.volumes[i]);
        let values = Values::F64(parallel::map(n, |i| target_density[i] / volume(i)));
        all.push(Column::new(names::TARGET_DENSITY, 1, values, UnitDimension::mass_density(3)));
    }
    all.extend(velocities.map(|v| Column::new(names::VELOCITIES, D, Values::F64(v), UnitDimension::VELOCITY)));
    carried.retain(|c| !all.iter().any(|own| own.name == c.name));
    all.extend(carried);
    columns::set_apart(&mut all);
    let header = RunHeader {
        dimension: D,
        box_size: frame.box_size.map(|b| b * factors.length),
        box_corner: corner,
        periodic: sph::array(|k| k < D && domain.axes[k] == Axis::Periodic),
        units,
        time: 0.0,
        kernel: making.kernel.into(),
        kernel_neighbors: making.kernel_neighbors,
        provenance: provenance(scene, &making.stop, (making.kernel, making.kernel_neighbors)),
        layouts: Vec::new(),
    };
    let part_type = collisionless.map_or(0, |c| c.part_type);
    let mut species = vec![Species { part_type, table: ParticleTable { count: n, columns: all } }];
    if let Some(walls) = walls {
        notes.push(walls.describe(factors.length));
        species.push(walls.species(frame.coordinates(&walls.positions(), factors.length), factors.length, &fluid));
    }
    if let Some(others) = &others {
        let first = species.iter().map(|s| s.table.count as i64).sum::<i64>() + 1;
        notes.push(others.describe());
        // A snapshot of a periodic box may have some beyond its faces.
        warnings.extend(others.doubt().filter(|_| scene.input.others.is_some()));
        let moved = |places: &Positions<D>, mut own: Vec<Column>| {
            placed_columns(scene, prepared, places, (factors.length, &making.conversion), &mut own)
        };
        species.extend(others.species(&frame, (factors.length, &units), first, &moved)?);
    }
    if let Some(core) = &prepared.core {
        let first = species.iter().map(|s| s.table.count as i64).sum::<i64>() + 1;
        let moves = species[0].table.column(names::VELOCITIES).is_some();
        let center = core.scaled(prepared.length, 1.0).center;
        let velocity = if moves { velocity_at(scene, prepared, (center, factors), (&units, making))? } else { None };
        let place = frame.coordinates(&center.map(|c| vec![c]), factors.length);
        let mass = core.point.mass * factors.input_mass;
        let radii = [
            (names::SOFTENING_RADIUS, core.point.radius * factors.length / prepared.length),
            (names::ACCRETION_RADIUS, 0.0),
        ];
        let table = point_table((place, mass, velocity), &radii, Some(first));
        species.push(Species { part_type: core.part_type, table });
    }
    Ok(Made { file: ParticleFile { header, species }, notes, warnings, left_out, conserved })
}

/// What gas alone has.
const OF_GAS: [&str; 3] = [names::INTERNAL_ENERGY, names::PRESSURE, names::TEMPERATURE];

/// Adds random velocities, in the output's units.
fn add_drawn(drawn: &Drawn, (units, are_known): (&UnitSystem, bool), velocities: &mut [f64]) {
    let unit = if are_known { units.to_cgs(UnitDimension::SPECIFIC_ENERGY) } else { 1.0 };
    let speed = (drawn.specific_energy / unit).sqrt();
    velocities.iter_mut().zip(&drawn.velocities).for_each(|(v, own)| *v += speed * own);
}

/// Adds the velocities that go with displacements, where the scene asks for them.
fn add_streams<const D: usize>(
    scene: &Scene,
    displaced: &Displaced<D>,
    (length, conversion): (f64, &Conversion),
    velocities: &mut Option<Vec<f64>>,
) -> Result<()> {
    let Some(factor) = scene.displacement.as_ref().and_then(|d| d.velocity_factor.as_ref()) else { return Ok(()) };
    let factor = length * factor.value("displacement.velocity_factor", UnitDimension::RATE, conversion)?;
    let own = velocities.get_or_insert_with(|| vec![0.0; D * displaced.moves.len()]);
    parallel::update_rows(own, D, |i, v| v.iter_mut().zip(displaced.moves[i]).for_each(|(v, psi)| *v += factor * psi));
    Ok(())
}

/// Gives carried columns the totals of a snapshot, where the input is one.
fn kept_totals<const D: usize>(
    prepared: &Prepared<D>,
    (positions, masses): (&Positions<D>, &[f64]),
    is_balanced: bool,
    units: &UnitSystem,
    carried: &mut [Column],
) -> Option<Conserved> {
    let mut totals = prepared.of_snapshot.as_ref()?.totals.in_units(units);
    if is_balanced {
        totals.thermal = None;
    }
    let axes = &prepared.source.domain.axes;
    let new = MassPoints {
        positions: &(0..masses.len()).flat_map(|i| at(positions, i).map(|x| x * prepared.length)).collect::<Vec<f64>>(),
        masses,
        dimension: D,
        periodic: sph::array(|k| k < D && axes[k] == Axis::Periodic),
    };
    conserve(carried, &new, &totals)
}

/// The frame with the point at the origin that is asked for.
fn placed<const D: usize>(
    frame: Frame<D>,
    prepared: &Prepared<D>,
    (positions, masses): (&Positions<D>, &[f64]),
    factors: &Factors,
    making: &Making<'_>,
) -> Result<Frame<D>> {
    let Some(origin) = &making.origin else { return Ok(frame) };
    let core = prepared.point_mass().map(|p| (p.center.map(|c| vec![c]), [p.mass]));
    let mut all = vec![(positions, masses)];
    all.extend(core.iter().map(|(place, mass)| (place, &mass[..])));
    let point = origin::point(origin, &frame, (&making.conversion, factors.length), &all)?;
    Ok(frame.with_origin(Some(point)))
}

/// Of all three axes.
fn filled<const D: usize>(values: [f64; D]) -> [f64; 3] {
    sph::array(|k| values.get(k).copied().unwrap_or(0.0))
}

/// The velocity of a particle at `center`, in internal units.
fn velocity_at<const D: usize>(
    scene: &Scene,
    prepared: &Prepared<D>,
    (center, factors): ([f64; D], &Factors),
    (units, making): (&UnitSystem, &Making<'_>),
) -> Result<Option<Vec<f64>>> {
    let place: Positions<D> = center.map(|c| vec![c]);
    let mut carried: Vec<Column> =
        prepared.source.carried.iter().map(|f| columns::column(f.as_ref(), &place, units)).collect();
    carried.retain(|c| c.name == names::VELOCITIES);
    let found = placed_columns(scene, prepared, &place, (factors.length, &making.conversion), &mut carried)?;
    match found.iter().flatten().find(|v| !v.is_finite()) {
        None => Ok(found),
        Some(v) => {
            let problem = format!("is {v} in the center, where the point mass of input.core is; expected a finite one");
            Err(Error::scene("fields.velocity", problem))
        }
    }
}

/// A single particle that is no gas: its place, mass and perhaps velocity, and radii by their names.
pub(crate) fn point_table(
    (place, mass, velocity): (Vec<f64>, f64, Option<Vec<f64>>),
    radii: &[(&str, f64)],
    id: Option<i64>,
) -> ParticleTable {
    let d = place.len();
    let mut columns = vec![
        Column::new(names::COORDINATES, d, Values::F64(place), UnitDimension::LENGTH),
        Column::new(names::MASSES, 1, Values::F64(vec![mass]), UnitDimension::new(d as i8 - 3, 1, 0, 0)),
    ];
    columns.extend(id.map(|id| Column::new(names::PARTICLE_IDS, 1, Values::I64(vec![id]), UnitDimension::NONE)));
    columns.extend(velocity.map(|v| Column::new(names::VELOCITIES, d, Values::F64(v), UnitDimension::VELOCITY)));
    let radius = |(name, value): &(&str, f64)| Column::new(name, 1, Values::F64(vec![*value]), UnitDimension::LENGTH);
    columns.extend(radii.iter().map(radius));
    ParticleTable { count: 1, columns }
}

/// What depends on where particles are in the output's units of length: velocities, which are returned, and materials.
fn placed_columns<const D: usize>(
    scene: &Scene,
    prepared: &Prepared<D>,
    positions: &Positions<D>,
    (length, conversion): (f64, &Conversion),
    carried: &mut Vec<Column>,
) -> Result<Option<Vec<f64>>> {
    let placed: Positions<D> = std::array::from_fn(|k| parallel::map(positions[k].len(), |i| positions[k][i] * length));
    let domain = prepared.source.domain.scaled(length);
    let motion = columns::SetMotion {
        bulk: values("motion.bulk", &scene.motion.bulk, UnitDimension::VELOCITY, conversion)?,
        rotation: values("motion.rotation", &scene.motion.rotation, UnitDimension::RATE, conversion)?,
    };
    let velocities = columns::velocities(carried, &placed, &domain, &motion)?;
    if !scene.material.is_empty() {
        let middle = prepared.source.center().map(|x| x * length);
        carried.retain(|c| c.name != names::MATERIAL_IDS);
        let radius = |r: &Quantity| r.value("material.radius", UnitDimension::LENGTH, conversion);
        let layers = scene.material.iter().map(|layer| Ok((layer.id, layer.radius.as_ref().map(radius).transpose()?)));
        let layers: Vec<(i32, Option<f64>)> = layers.collect::<Result<_>>()?;
        carried.push(columns::materials(&placed, &middle, &layers));
    }
    Ok(velocities)
}

/// What a file says of its making; the kernel with its number of neighbors is that of the densities.
pub(crate) fn provenance(scene: &Scene, stop: &str, (kernel, neighbors): (&str, f64)) -> Vec<(String, String)> {
    // The recipe must not depend on where the output goes.
    let mut recipe = scene.clone();
    recipe.output.file = None;
    recipe.output.report = None;
    recipe.checkpoint = CheckpointInput::default();
    let mut facts = vec![
        ("Version".into(), format!("sph-prep {}", env!("CARGO_PKG_VERSION"))),
        ("Seed".into(), scene.seed.to_string()),
        ("StopReason".into(), stop.into()),
        (
            "DensityDefinition".into(),
            format!(
                "sum over particles of m_j W(|r_i - r_j|, H_i), itself included, with {kernel} and {neighbors:.1} neighbors"
            ),
        ),
        ("Scene".into(), recipe.to_yaml()),
    ];
    facts.extend(scene.adiabatic_index().and_then(adiabatic_fact));
    facts.extend(scene.own_gravity().map(|constant| (GRAVITY_KEY.to_owned(), constant.to_string())));
    facts
        .extend(scene.keeps_disc_temperatures().then(|| (DISC_KEY.to_owned(), "temperatures of the place".to_owned())));
    facts
}

/// Why the internal energy is a placeholder, and what would give one.
fn placeholder_note(has_temperature: bool) -> String {
    let (came, remedy) = if has_temperature {
        (
            "a temperature came in, which gives no energy without a mean molecular weight,",
            "fields.mean_molecular_weight (0.6 for ionized gas of solar composition, 2.3 for molecular gas) or thermal.internal_energy",
        )
    } else {
        ("nothing thermal came in,", "thermal.internal_energy")
    };
    format!("{came} but the format needs InternalEnergy: it is set to 1 everywhere; set {remedy}")
}
