//! Warnings about features of a scene that a code will not reproduce from its file.

use super::facts::{Doubts, Facts};
use crate::codes::{AS_PLANETARY, Contrast};
use sph_formats::common::particle_names as names;
use sph_formats::phantom::LocallyIsothermal;

/// Reaches of a kernel in the shortest edge of a periodic box, below which a particle meets two images of another.
const IMAGES: f64 = 2.0;

/// More particles are no remedy where the resolution says how masses differ: the contrast grows.
const LESS_APART: &str = "give all gas particles one mass (`particle_mass`), or a `resolution` that changes less";

/// Each in a sentence, with the remedy where there is one.
pub(super) fn doubts(facts: &Facts<'_>) -> Doubts {
    let (mut stops, mut doubts) = (Vec::new(), Vec::new());
    let (header, title) = (&facts.file.header, facts.code.sheet.title);
    let periodic = &header.periodic[..header.dimension];
    let name = facts.code.sheet.name;
    let by_axis = ["sph-exa", "arepo", "pysph", "dualsphysics"].contains(&name);
    let is_held = name == "dualsphysics" && facts.has_walls();
    if periodic.contains(&true) && periodic.contains(&false) && !by_axis {
        doubts.push(format!(
            "{title} is periodic along all axes or none, but the box is periodic along some: matter that leaves \
             through the other faces re-enters on the opposite side"
        ));
    } else if facts.reflects && !is_held && !["arepo", "pysph"].contains(&name) {
        doubts.push(format!(
            "{title} has no reflecting walls: matter that they confine in the scene flows out, unless walls of \
             particles confine it"
        ));
    }
    let is_planetary = AS_PLANETARY.contains(&facts.code.scheme.name);
    if facts.gas.materials().is_some() && !is_planetary {
        let remedy = match facts.code.sheet.schemes.iter().find(|s| AS_PLANETARY.contains(&s.name)) {
            Some(scheme) => format!("--for {}:scheme={} is for them", facts.code.sheet.name, scheme.name),
            None => "--for swift:scheme=planetary is for them".into(),
        };
        doubts.push(format!(
            "{title} ({}) treats the materials of the file as an ideal gas, whose pressure differs: {remedy}",
            facts.code.scheme.name
        ));
    }
    if facts.gas.column(names::MAGNETIC_FIELD).is_some()
        && ["gadget4", "swift", "sph-exa", "pysph", "dualsphysics"].contains(&name)
    {
        doubts
            .push(format!("{title} in its default build has no magnetic fields: the gas moves as if there were none"));
    }
    // Liquids have the gravity that their pressures are in balance with.
    if facts.in_field && !["pysph", "dualsphysics"].contains(&name) {
        doubts.push(format!(
            "{title} does not receive the external force that balances the pressure (balance.gravity): set it up in \
             the code, or nothing confines the gas"
        ));
    }
    if facts.is_attracted {
        doubts.push(format!(
            "{title} does not receive the gravity of what `gravity_of` names, which is not in the file: without it the gas does not stay as it is; place it as a \
             body of the scene (`bodies`), or set its potential up in the code"
        ));
    }
    if facts.holds_itself && header.dimension < 3 {
        doubts.push(format!(
            "{title} is started without gravity, which it has between matter in three dimensions only: a body that its own gravity holds in {}-D disperses",
            header.dimension
        ));
    }
    if name != "phantom"
        && let Some(dust) = facts.gas.column(names::DUST_FRACTION)
    {
        let most = dust.values.range().1;
        doubts.push(format!(
            "{title} knows no dust in the gas: with the internal energies of the file, which are those of the gas alone, the pressure it computes is up to {:.3} \
             times the scene's; give the dust particles of its own (`dust`), or leave fields.dust_fraction out",
            1.0 / (1.0 - most)
        ));
    }
    if facts.has_grains && name == "gizmo" {
        doubts.push(format!(
            "{title} computes drag on dust only if it is built with GRAIN_FLUID and given the size of the grains, \
             which the scene does not state: add both, or there is no drag"
        ));
    }
    if let Some([least, largest]) =
        facts.softened_apart().filter(|_| ["swift", "gadget4", "gizmo", "arepo"].contains(&name))
    {
        doubts.push(format!(
            "{title} softens all point masses with one length, but their radii range from {least:.4e} to {largest:.4e}: \
             give them one radius, or change the parameter file"
        ));
    }
    if let Some([least, largest]) = facts.masses_apart().filter(|_| name == "phantom" && facts.gravity.is_some()) {
        doubts.push(format!(
            "{title} softens the attraction of two particles by the mean of what each is of the other with its own mass, which is wrong where masses differ, and \
             these go from {least:.4e} to {largest:.4e}: energy and momentum drift; give all bodies particles of one mass"
        ));
    }
    let masses = facts.gas.column(names::MASSES);
    if let Some(contrast) = masses.and_then(|masses| facts.code.contrast(&masses.values, header.dimension)) {
        let (Contrast { least, most, is_out_of_reach, .. }, outcome) = (contrast, contrast.outcome());
        let remedy = if is_out_of_reach { "give all gas particles one mass, or use more of them" } else { LESS_APART };
        (if contrast.stops() { &mut stops } else { &mut doubts }).push(format!(
            "masses of gas particles range from {least:.4e} to {most:.4e}, and {title} {outcome}; {remedy}"
        ));
    }
    if name == "sph-exa" && facts.gravity.is_some() {
        doubts.push(format!(
            "{title} softens gravity within the sum of two smoothing lengths, whatever `eps` says, and gravity here is that of points: a body at rest here starts there with a \
             net force of a tenth of gravity and more"
        ));
    }
    if facts.lacks_gravity {
        doubts.push(format!(
            "{title} is started without gravity, since the box is periodic, so a self-gravitating body will disperse: \
             open boundaries have gravity"
        ));
    }
    if facts.may_lack_gravity {
        doubts.push(format!(
            "{title} is started without gravity: the numbers of the snapshot have no units, and nothing says whether its gas attracts itself; if it does, state \
             `units`, or switch gravity on with your constant"
        ));
    }
    if let Some(constant) = facts.gravity.and_then(|g| g.stated).filter(|g| name == "phantom" && *g != 1.0) {
        doubts.push(format!(
            "the constant of gravity of {title} is 1 in pure numbers, but the scene's is {constant}: state its units, or scale its masses"
        ));
    }
    if name == "phantom" && LocallyIsothermal::is_meant(facts.file) && LocallyIsothermal::of(facts.file).is_none() {
        doubts.push(format!(
            "{title} keeps temperatures of the distance from a star (`ieos = 6`) where one disc is all gas of the file and they fall by one power of it: it \
             computes this file's gas as adiabatic (`ieos = 2`)"
        ));
    }
    match name {
        // In two dimensions there is a mesh with a vacuum in it.
        "arepo" => (if header.dimension == 3 { &mut stops } else { &mut doubts }).extend(facts.arepo_doubt()),
        "pysph" => doubts.extend(facts.pysph_doubts()),
        "dualsphysics" => doubts.extend(facts.dualsphysics_doubts()),
        "swift" => {
            stops.extend(facts.swift_stops());
            doubts.extend(facts.swift_doubts());
        }
        _ => doubts.extend(facts.too_few(IMAGES).map(|(reach, least, enough)| {
            format!(
                "{title} pairs a particle with one image of another, but its kernels reach {reach:.3e} in a box whose shortest edge is {least:.3e}; \
                 use {enough:.0} particles or more"
            )
        })),
    }
    Doubts { stops, others: doubts }
}
