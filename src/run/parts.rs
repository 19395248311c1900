//! Runs that are divided, over ranks or block by block: the scenes that they refuse, and how they start.

use super::destination::{Destination, intended_format, refuse_box, refuse_what_the_format_cannot_hold};
use super::plan::{Held, Plan};
use super::stages::check_neighbors;
use super::streamed::Read;
use crate::error::{Error, Result};
use crate::input::ingest::RawInput;
use crate::input::internal_units::Prepared;
use crate::input::units::RunUnits;
use crate::scene::{Order, Polish, Scene};
use crate::seeding::{Blockwise, Seeding};
use crate::target::Target;
use sph::domain::Wall;
use sph::sums::Bias;
use sph_formats::FormatSpec;

/// The parts of a run, in words.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parts {
    pub how: &'static str,
    pub who: &'static str,
}

impl Parts {
    /// Refuses what is not done so and a scene asks for, but for seedings.
    pub fn refuse(self, scene: &Scene) -> Result<()> {
        let lacks = |key: &str, what: &str| Err(Error::scene(key, format!("{what} {}; leave it out", self.how)));
        let undone = "is not done";
        match scene.polish {
            None | Some(Polish::None | Polish::Solver) => {}
            Some(_) => return lacks("polish", "other than the density solver is not done"),
        }
        let asked = [
            (scene.order == Some(Order::Crystal), "order: crystal"),
            (scene.wvt.bias == Bias::Plain, "wvt.bias: plain"),
            (scene.balance.is_on(), "balance"),
            (scene.certify.is_some(), "certify"),
            (scene.settle.is_some(), "settle"),
            (scene.trim_masses.is_some(), "trim_masses"),
            (scene.refine.is_some(), "refine"),
            (scene.input.core.is_some(), "input.core"),
            (scene.output.report.is_some(), "output.report"),
            (scene.output.parameters, "output.parameters"),
        ];
        match asked.iter().find(|(is_asked, _)| *is_asked) {
            Some((_, key)) => lacks(key, undone),
            None => Ok(()),
        }
    }

    /// The scene with a seeding that goes part by part, and the plan for it: that of a run by itself, if it goes so, else mass bisection.
    pub fn planned<const D: usize>(
        self,
        scene: &Scene,
        (prepared, target): (&Prepared<D>, &Target<'_, D>),
        parts: usize,
    ) -> (Scene, Plan) {
        let held = Held::Unsure(format!("it is not done {}", self.how));
        let plan = |scene: &Scene| Plan::among(scene, target, prepared.source.radial.is_some(), &held, parts);
        let seeding = match (scene.seeding, plan(scene).seeding) {
            (None, planned) if !Blockwise::<D>::can_make(planned) => Seeding::MassBisection,
            (_, planned) => planned,
        };
        let scene = Scene { seeding: Some(seeding), ..scene.clone() };
        let plan = plan(&scene);
        (scene, plan)
    }

    /// What is tried before the work.
    pub fn begin<'f>(self, scene: &Scene, formats: &'f [FormatSpec]) -> Result<(Read, &'f FormatSpec)> {
        let destination = Destination::new(scene, formats)?;
        destination.refuse_overwriting_inputs(scene)?;
        let Some(format) = intended_format(scene, formats)? else {
            let problem = format!("is a picture, which is not drawn {}; write particles", self.how);
            return Err(Error::scene("output.file", problem));
        };
        if format.stream.is_none() {
            let able: Vec<&str> = formats.iter().filter(|f| f.stream.is_some()).map(|f| f.name).collect();
            let problem = format!(
                "'{}' is not written part by part, as it has to be {}; use {}",
                format.name,
                self.how,
                able.join(", ")
            );
            return Err(Error::scene("output.format", problem));
        }
        let read = Read::new(scene, formats)?;
        scene.check_units(&read.units.to_input())?;
        refuse_what_the_format_cannot_hold(scene, format, read.dimension)?;
        Ok((read, format))
    }

    /// The source, of which each part can make its own.
    pub fn prepared<const D: usize>(
        self,
        (scene, formats, format): (&Scene, &[FormatSpec], &FormatSpec),
        (raw, units): (RawInput, &RunUnits),
        count: usize,
    ) -> Result<Prepared<D>> {
        let prepared = Prepared::<D>::new(scene, formats, (raw, units), count)?;
        if prepared.of_snapshot.is_some() {
            let problem = format!("is a particle file, which is not taken {}", self.how);
            return Err(Error::scene("input.file", problem));
        }
        if prepared.source.domain.region.wall() == Some(Wall::Reflecting) {
            let who = self.who;
            let problem = format!("has a curved surface that reflects, through which {who} cannot see; leave it open");
            return Err(Error::scene("domain", problem));
        }
        check_neighbors::<D>(scene)?;
        refuse_box(scene, Some(format), (&prepared, None), &units.to_input())?;
        Ok(prepared)
    }
}
