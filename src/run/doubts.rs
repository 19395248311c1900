//! Warnings about settings that are probably not intended, with the remedy; the run continues as requested.

use super::periodic;
use crate::error::{Error, Result};
use crate::field::probes;
use crate::input::internal_units::Prepared;
use crate::input::refinement::Refinement;
use crate::input::slips::slips;
use crate::input::solenoidal;
use crate::scene::{AfcInput, AlaricInput, BoundaryName, Polish, Scene, SolverInput};
use crate::target::{LeftOut, Positions, Regions, Resolution, Target, at};
use sph::domain::{Axis, Domain, Region};
use sph::kernel::support_over_spacing;

/// A domain that holds less than this share of the input is probably in the wrong place, or in other units.
const LITTLE: f64 = 1e-3;
/// Bodies under so many spacings across are not resolved.
const THIN: f64 = 2.0;
/// Share of the particles in layers that thin from which on it is worth a word.
const SHARE: f64 = 0.1;
/// Particles that are looked at.
const SAMPLES: usize = 2000;
/// Halvings of the spacing up to which particles are asked for: millions of times as many are no advice.
const MOST_HALVINGS: u32 = 7;

/// On a snapshot that is placed for a code.
const UNBALANCED: &str = "forces on a re-sampled body are not balanced: `sph-prep check FILE --for CODE` reports the \
                          net force that the code will compute, and `sph-prep run FILE --for CODE --settle 3` brings \
                          the gas to rest";

/// Doubts that need no particles.
pub(crate) fn before<const D: usize>(scene: &Scene, prepared: &Prepared<D>, count: usize) -> Vec<String> {
    let mut doubts: Vec<String> = prepared.of_snapshot.iter().flat_map(|snapshot| snapshot.doubts.clone()).collect();
    let domain = &prepared.source.domain;
    let is_open = (0..D).all(|k| domain.axes[k] != Axis::Periodic);
    if prepared.of_snapshot.is_some()
        && scene.target_code.is_some()
        && !scene.balance.is_on()
        && is_open
        && !scene.input.keeps_particles()
    {
        doubts.push(UNBALANCED.into());
    }
    let share = prepared.input_mass.map(|input| prepared.mass.value / input);
    if let Some(share) = share.filter(|share| *share < LITTLE) {
        doubts.push(format!(
            "the domain contains {share:.1e} of the input's mass: check its position and units (plain numbers are in \
             the scene's `units`)"
        ));
    }
    if scene.domain.boundary.contains(&BoundaryName::Periodic) && prepared.source.radial.is_some() {
        doubts.push(match domain.region {
            Region::Box => "the boundary is periodic, but the input is a star, which will be surrounded by its \
                            images; `boundary: open` has no images"
                .into(),
            _ => "the boundary is periodic, which the surface of a star cannot be: it is treated as open; set \
                  `domain.box` for a box around the star, or leave the boundary out"
                .to_owned(),
        });
    }
    let spacing = domain.mean_spacing(count);
    for Extent { what, extent, why } in extents(domain) {
        let spacings = extent / spacing;
        if spacings < THIN {
            let factor = (THIN / spacings).powi(D as i32);
            doubts.push(format!(
                "the domain is {spacings:.2} spacings thick {what}, {why} (at least {THIN}): use some {:.0e} particles, or fewer dimensions",
                count as f64 * factor
            ));
        }
    }
    doubts.extend(periodic::doubts(scene, prepared));
    if let Region::Hull(hull, _) = &domain.region {
        doubts.extend(hull.doubt());
    }
    doubts.extend(slips(scene));
    doubts.extend(solenoidal::doubts(scene, prepared));
    doubts
}

/// Options of stages that do not run, which change nothing.
pub(crate) fn unused(scene: &Scene) -> Option<String> {
    let is_alaric = matches!(scene.polish, Some(Polish::Alaric | Polish::DampedRelaxation));
    let stated = [
        ("afc", scene.afc != AfcInput::default() && scene.polish != Some(Polish::Afc), "polish: afc"),
        ("alaric", scene.alaric != AlaricInput::default() && !is_alaric, "polish: alaric"),
        (
            "solver",
            scene.solver != SolverInput::default() && scene.polish.is_some_and(|polish| polish != Polish::Solver),
            "polish: solver",
        ),
    ];
    let (key, _, with) = stated.iter().find(|(_, is_unused, _)| *is_unused)?;
    Some(format!("the options of `{key}` change nothing: they are for `{with}`"))
}

/// Options of the input that are for inputs of another kind, which change nothing.
pub(crate) fn unused_of_input<const D: usize>(scene: &Scene, prepared: &Prepared<D>) -> Option<String> {
    let input = &scene.input;
    let (is_file, is_snapshot) = (input.file.is_some(), prepared.of_snapshot.is_some() && input.others.is_none());
    let is_table = is_file && !is_snapshot && prepared.source.radial.is_some();
    let is_field = is_file && !is_snapshot && !is_table;
    let stated = [
        ("time", input.time.is_some(), is_file),
        ("interpolation", input.interpolation.is_some(), is_field || is_snapshot),
        ("staggering", !input.staggering.is_auto(), is_table),
        ("centering", input.centering.is_some(), is_field),
        ("planet_radius", input.planet_radius.is_some(), is_field),
        ("magnetic_field_unit", input.magnetic_field_unit.is_some(), is_file),
        ("carry", input.carry.is_some(), is_file || input.profile.is_some()),
        ("format", input.format.is_some(), is_file),
    ];
    let unused: Vec<String> = stated
        .iter()
        .filter(|(_, is_stated, is_used)| *is_stated && !is_used)
        .map(|s| format!("input.{}", s.0))
        .collect();
    let kind = match () {
        () if is_snapshot => "a snapshot",
        () if is_table => "a radial table",
        () if is_file => "a grid, a mesh or points",
        () => "no file",
    };
    let (verb, of) = if unused.len() == 1 { ("changes", "is for inputs") } else { ("change", "are for inputs") };
    (!unused.is_empty())
        .then(|| format!("{} {verb} nothing: the input is {kind}, and {of} of another kind", unused.join(", ")))
}

/// What is said of regions that no particle is placed in: a doubt, or a note where next to nothing is in them.
pub(crate) fn left_out<const D: usize>(regions: Option<&Regions<'_, D>>, count: usize) -> Option<Told> {
    let LeftOut { share, volume } = regions?.left_out()?;
    let worth = share * count as f64;
    let text = format!(
        "no particle is placed in {:.3} % of the domain: that part holds {worth:.2e} particles' mass, a share of \
         {share:.1e}, which the others carry; use {:.0e} particles to resolve it, or give it a `resolution` of its own",
        100.0 * volume,
        1.0 / share
    );
    Some(if worth < NEXT_TO_NOTHING { Told::Note(text) } else { Told::Doubt(text) })
}

/// What is said of a run.
pub(crate) enum Told {
    Doubt(String),
    Note(String),
}

impl Told {
    /// Puts it where it belongs.
    pub fn among(self, doubts: &mut Vec<String>, notes: &mut Vec<String>) {
        match self {
            Self::Doubt(text) => doubts.push(text),
            Self::Note(text) => notes.push(text),
        }
    }
}

/// Particles that a region is worth which is there to be next to empty.
const NEXT_TO_NOTHING: f64 = 1e-3;

/// The share of the mass that may be where a resolution of its own has no particles.
const FORGOTTEN: f64 = 0.01;

/// Refuses a resolution with which part of the mass is where spacings are larger than the domain: no particle is there, and others carry that mass.
///
/// # Errors
/// Such a resolution.
pub(crate) fn refuse_places_without_particles<const D: usize>(target: &Target<'_, D>) -> Result<()> {
    if !matches!(target.resolution, Resolution::NumberDensity(_)) {
        return Ok(());
    }
    let size = target.domain.extent().into_iter().fold(0.0, f64::max);
    let (mut all, mut forgotten) = (0.0, 0.0);
    for x in probes(target.domain) {
        let density = target.density.value(&x);
        all += density;
        if target.number_density(&x) * size.powi(D as i32) < 1.0 {
            forgotten += density;
        }
    }
    if forgotten > FORGOTTEN * all {
        let problem = format!(
            "has spacings larger than the whole domain where about {:.0} % of the mass is: no particle would be \
             placed there, and others would carry that mass; request a larger number density there, or more particles",
            100.0 * forgotten / all
        );
        return Err(Error::scene("resolution", problem));
    }
    Ok(())
}

/// Refuses a periodic box so flat that each kernel reaches over too many of its images, and a domain so far from the origin that its places are
/// not resolved.
///
/// # Errors
/// The axis, with the remedy.
pub(crate) fn refuse_domain<const D: usize>(scene: &Scene, domain: &Domain<D>, count: usize) -> Result<()> {
    let spacing = domain.mean_spacing(count);
    let reach = spacing * support_over_spacing(D, scene.kernel_neighbors(D));
    let far = domain.lo.iter().chain(&domain.hi).fold(0.0_f64, |m, x| m.max(x.abs()));
    if f64::EPSILON * far > RESOLVED * spacing {
        let problem = format!(
            "is {:.1e} edge lengths away from the origin, where f64 resolves positions to {:.1e} spacings, expected \
             {RESOLVED:e} at most; move it nearer",
            far / domain.size(),
            f64::EPSILON * far / spacing
        );
        return Err(Error::scene("domain.box", problem));
    }
    let flat = (0..D).find(|&k| domain.axes[k] == Axis::Periodic && reach > MOST_IMAGES * domain.extent()[k]);
    let Some(k) = flat else { return Ok(()) };
    let problem = format!(
        "is periodic and {:.1e} spacings thick along {}: each kernel would extend over {:.0e} images of the box, \
         expected {MOST_IMAGES} at most; use fewer dimensions, a thicker box, or `boundary: open` along this axis",
        domain.extent()[k] / spacing,
        ["x", "y", "z"][k],
        reach / domain.extent()[k]
    );
    Err(Error::scene("domain.box", problem))
}

/// Spacings that places may be off by because of their digits.
const RESOLVED: f64 = 1e-3;
/// Images of a box to either side that a kernel may reach over.
const MOST_IMAGES: f64 = 1e3;

/// The width of a domain.
struct Extent {
    /// From where to where.
    what: String,
    extent: f64,
    /// What it means if that is too little.
    why: &'static str,
}

const ACROSS: &str = "too thin for the density to be summed across it";
const OF_ITSELF: &str = "so that particles are neighbors of themselves";

fn extents<const D: usize>(domain: &Domain<D>) -> Vec<Extent> {
    let along = |k: usize| Extent {
        what: format!("along {}", ["x", "y", "z"][k]),
        extent: domain.extent()[k],
        why: if domain.axes[k] == Axis::Periodic { OF_ITSELF } else { ACROSS },
    };
    let between =
        |what: &str, inner: f64, outer: f64| Extent { what: what.into(), extent: shell(inner, outer), why: ACROSS };
    match &domain.region {
        Region::Box => (0..D).map(along).collect(),
        Region::Ball { inner_radius, radius, .. } => vec![between("from surface to surface", *inner_radius, *radius)],
        Region::Cylinder { axis, inner_radius, radius, .. } => {
            vec![between("across its axis", *inner_radius, *radius), along(*axis)]
        }
        Region::Hull(..) => Vec::new(),
    }
}

fn shell(inner: f64, outer: f64) -> f64 {
    if inner > 0.0 { outer - inner } else { 2.0 * outer }
}

/// A sphere of other resolution in which there is nothing.
pub(crate) fn unrefined<const D: usize>(
    refinement: Option<&Refinement<D>>,
    positions: &Positions<D>,
) -> Option<String> {
    let refinement = refinement?;
    let is_empty = (0..positions[0].len()).all(|i| refinement.factor(&at(positions, i)) == 1.0);
    let text = "refine changes nothing: no particle is in its sphere or in the shell around it; check `refine.center` \
                and `radius` against the domain and the spacing";
    is_empty.then(|| text.to_owned())
}

/// Doubts about a body that is thin somewhere: about a particle the target falls by more than a factor e within a spacing on
/// both sides. With how many times as many particles, whose spacing is half as large or a fourth and so on, it would not.
pub(crate) fn after<const D: usize>(target: &Target<'_, D>, positions: &Positions<D>) -> Option<String> {
    let n = positions[0].len();
    let step = n.div_ceil(SAMPLES).max(1);
    let samples: Vec<[f64; D]> = (0..n).step_by(step).map(|i| at(positions, i)).collect();
    let thin = |halvings: u32| {
        let spacing = |x: &[f64; D]| target.spacing(target.number_density(x)) * 0.5_f64.powi(halvings as i32);
        let mut along = [0_usize; 3];
        samples.iter().filter_map(|x| target.thin_along(x, spacing(x))).for_each(|k| along[k] += 1);
        let (k, found) = along.into_iter().enumerate().max_by_key(|(_, found)| *found)?;
        let share = found as f64 / samples.len() as f64;
        (share > SHARE).then_some((["x", "y", "z"][k], share))
    };
    let (axis, share) = thin(0).filter(|_| D > 1)?;
    let more = match (1..MOST_HALVINGS).find(|halvings| thin(*halvings).is_none()) {
        Some(halvings) => format!("use {} times as many particles", 1_u64 << (D as u32 * halvings)),
        None => "use fewer dimensions, or a thicker layer".to_owned(),
    };
    Some(format!(
        "{:.0} % of the particles are in layers less than two spacings thick along {axis}, whose height is not \
         resolved: {more}",
        100.0 * share,
    ))
}
