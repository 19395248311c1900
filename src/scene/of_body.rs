//! The scenes of single bodies, and the keys that cannot be combined with them.

use super::{
    AttractorInput, BodyInput, BoundaryName, DomainInput, Input, Motion, OriginInput, OriginName, OwnTurning, Scene,
    Thermal, check_all, in_body,
};
use crate::error::{Error, Result};
use sph_formats::UnitDimension;

impl Scene {
    /// The scene of one body by itself, for as many particles as it is to have; without any before that is known.
    pub(crate) fn of_body(&self, index: usize, particles: Option<usize>) -> Self {
        let body = &self.bodies[index];
        let certify = self.certify_at_once().filter(|_| body.collisionless.is_none() && !self.holds_its_medium());
        Self {
            input: body.input.clone(),
            resolution: body.resolution.clone(),
            domain: body.domain.clone(),
            particles: particles.or(body.particles),
            seeding: body.seeding.or(self.seeding),
            polish: body.polish.or(self.polish),
            balance: match body.collisionless {
                Some(_) => body.balance.clone(),
                None => body.balance.clone().or(self.balance.clone()),
            },
            certify,
            fields: body.fields.clone(),
            turbulence: body.turbulence.clone(),
            thermal: body.thermal.clone().unwrap_or_else(|| match body.collisionless {
                None => self.thermal.clone(),
                Some(_) => Thermal::default(),
            }),
            collisionless: body.collisionless.clone(),
            dust: body.dust.clone(),
            turning: match certify {
                Some(_) => OwnTurning { spin: body.spin.clone(), orientation: body.orientation.clone() },
                None => OwnTurning::default(),
            },
            gravity_of: self.others_about(index).into_iter().chain(body.gravity_of.iter().cloned()).collect(),
            material: body.material.clone(),
            ..self.without_bodies()
        }
    }

    /// Whether the particles of a body that is a snapshot stay as they are: where it says so, or where nothing says of how many it should be, and
    /// the body states nothing of how they are placed.
    pub(crate) fn keeps_body(&self, index: usize) -> bool {
        let body = &self.bodies[index];
        let placed = BodyInput {
            name: body.name.clone(),
            input: body.input.clone(),
            domain: DomainInput { boundary: body.domain.boundary.clone(), ..DomainInput::default() },
            orientation: body.orientation.clone(),
            position: body.position.clone(),
            velocity: body.velocity.clone(),
            spin: body.spin.clone(),
            ..BodyInput::default()
        };
        let is_counted = self.particles.is_some() || self.particle_mass.is_some();
        body.input.keep_particles.unwrap_or(!is_counted && *body == placed)
    }

    /// A body whose particles stay as they are, of which what the scene says of those that are placed is not meant.
    pub(crate) fn of_kept_body(&self, index: usize) -> Self {
        let (body, own) = (&self.bodies[index], self.of_body(index, None));
        let mut kept = Self {
            particles: body.particles,
            seeding: body.seeding,
            polish: body.polish,
            balance: body.balance.clone(),
            thermal: body.thermal.clone().unwrap_or_default(),
            certify: None,
            turning: OwnTurning::default(),
            order: None,
            trim_masses: None,
            gravity_of: Vec::new(),
            checkpoint: Default::default(),
            ..own
        };
        kept.input.keep_particles = Some(true);
        kept.output.origin = None;
        kept
    }

    /// What a body or the medium about bodies has of the scene, whose bodies it is placed without.
    pub(super) fn without_bodies(&self) -> Self {
        let mut alone = Self {
            bodies: Vec::new(),
            orbit: None,
            ambient: None,
            particle_mass: None,
            cache: None,
            settle: None,
            ..self.clone()
        };
        alone.output.parameters = false;
        alone.output.report = None;
        // Bodies are moved to their places later.
        alone.output.origin = Some(OriginInput::Named(OriginName::Corner));
        alone
    }

    /// The bodies about the same center as body `index`, whose gravity it feels: where it is a disc or gas that follows from it, or any body is
    /// collisionless. Others are held by what their own scenes say.
    fn others_about(&self, index: usize) -> Vec<AttractorInput> {
        let own = &self.bodies[index].input;
        let follows = own.disc().is_some() || own.hydrostatic().is_some();
        if self.orbit.is_some() || !(follows || self.bodies.iter().any(|b| b.collisionless.is_some())) {
            return Vec::new();
        }
        let attracting = self.at_the_place_of(index).map(|(i, other)| {
            // Gas that is held by others is what it is among them.
            let held = self.at_the_place_of(i).filter(|(_, body)| body.input.hydrostatic().is_none());
            let holding = held.map(|(_, body)| attractor(body)).filter(|_| other.input.hydrostatic().is_some());
            let stated = other.gravity_of.iter().filter(|_| other.input.hydrostatic().is_some()).cloned();
            AttractorInput { gravity_of: holding.chain(stated).collect(), ..attractor(other) }
        });
        attracting.collect()
    }

    /// The other bodies at the position of body `index`.
    fn at_the_place_of(&self, index: usize) -> impl Iterator<Item = (usize, &BodyInput)> {
        let place = |body: &BodyInput| match body.position.iter().all(|q| q.number() == 0.0) {
            true => Vec::new(),
            false => body.position.clone(),
        };
        let own = place(&self.bodies[index]);
        self.bodies.iter().enumerate().filter(move |(i, other)| *i != index && place(other) == own)
    }

    /// Checks bodies, each as a scene of its own, and what says where they go.
    pub(super) fn check_bodies(&self) -> Result<()> {
        if self.bodies.is_empty() {
            let of_bodies = [
                ("orbit", self.orbit.is_some()),
                ("particle_mass", self.particle_mass.is_some()),
                ("cache", self.cache.is_some()),
            ];
            return match of_bodies.iter().find(|(_, is_given)| *is_given) {
                Some((key, _)) => Err(Error::scene(*key, "is of scenes with `bodies`; leave it out")),
                None => Ok(()),
            };
        }
        if self.input != Input::default() {
            return Err(Error::scene("input", "stands beside `bodies`, which have their own; leave one out"));
        }
        for (key, is_given) in [
            ("resolution", self.resolution.is_some()),
            ("fields", !self.fields.is_empty()),
            ("turbulence", self.turbulence.is_some()),
            ("material", !self.material.is_empty()),
            ("collisionless", self.collisionless.is_some()),
            ("dust", self.dust.is_some()),
            ("gravity_of", !self.gravity_of.is_empty()),
        ] {
            if is_given {
                return Err(Error::scene(key, "cannot stand beside `bodies`; state it for each of them"));
            }
        }
        for (key, is_given, remedy) in [
            ("motion", self.motion != Motion::default(), "`velocity` and `spin` of each body are what moves it"),
            ("checkpoint", !self.checkpoint.is_default(), "with `cache` each body is kept as soon as it is placed"),
            ("walls", self.walls.is_some(), "make the fluid and its walls a scene of their own"),
            ("refine", self.refine.is_some(), "a body may have a `resolution`, or refine the file that comes out"),
        ] {
            if is_given {
                return Err(Error::scene(key, format!("cannot stand beside `bodies`; leave it out: {remedy}")));
            }
        }
        let is_open = self.domain.boundary.iter().all(|b| *b == BoundaryName::Open);
        if !is_open && self.domain.bounds.is_none() {
            let problem = "is that of a `box` where there are `bodies`; state `domain.box`, or leave the boundary out";
            return Err(Error::scene("domain.boundary", problem));
        }
        if self.displacement.is_some() {
            return Err(Error::scene(
                "displacement",
                "is of one periodic box and cannot stand beside `bodies`; leave it out",
            ));
        }
        if self.domain.has_extent() && self.domain.bounds.is_none() {
            return Err(Error::scene("domain", "of a scene with `bodies` is a `box`, or left out"));
        }
        for (i, body) in self.bodies.iter().enumerate() {
            let key = |name: &str| format!("bodies[{}].{name}", body.title(i));
            if self.bodies.iter().take(i).enumerate().any(|(k, other)| other.title(k) == body.title(i)) {
                return Err(Error::scene(key("name"), "is that of another body as well; give each its own"));
            }
            match &body.point_mass {
                Some(mass) => body.validate_point(mass, &body.title(i))?,
                None if body.radii().next().is_some() => {
                    return Err(Error::scene(
                        key("point_mass"),
                        "is missing, which softening and accretion radii are of",
                    ));
                }
                None if body.part_type.is_some() => {
                    let problem =
                        "is of a point_mass; gas has type 0, and collisionless particles that of collisionless.type";
                    return Err(Error::scene(key("type"), problem));
                }
                None => self.of_body(i, None).validate().map_err(|e| in_body(&body.title(i), e))?,
            }
            if body.domain.boundary.contains(&BoundaryName::Periodic) {
                let problem = "is periodic, but a body ends somewhere; the box of all of them is the scene's `domain`";
                return Err(Error::scene(key("domain.boundary"), problem));
            }
            if !([0, 1, 3].contains(&body.orientation.len()) && body.orientation.iter().all(|angle| angle.is_finite()))
            {
                let problem = format!(
                    "is {:?}, expected three angles in degrees about x, y and z, or in 2-D one",
                    body.orientation
                );
                return Err(Error::scene(key("orientation"), problem));
            }
            check_all(&key("position"), &body.position, UnitDimension::LENGTH)?;
            check_all(&key("velocity"), &body.velocity, UnitDimension::VELOCITY)?;
            check_all(&key("spin"), &body.spin, UnitDimension::RATE)?;
            if self.particle_mass.is_some() && body.particles.is_some() {
                return Err(Error::scene(key("particles"), "and particle_mass are both given; leave one out"));
            }
        }
        self.check_types()?;
        if self.bodies.iter().all(|b| b.point_mass.is_some()) {
            return Err(Error::scene("bodies", "are points all of them; a scene has gas in one at least"));
        }
        if let (Some(_), Some(_)) = (&self.particle_mass, self.particles) {
            return Err(Error::scene("particle_mass", "and particles are both given; leave one out"));
        }
        if let Some(orbit) = &self.orbit {
            orbit.validate()?;
            if self.bodies.len() != 2 {
                return Err(Error::scene("orbit", format!("is of two bodies, but there are {}", self.bodies.len())));
            }
            if let Some((i, _)) =
                self.bodies.iter().enumerate().find(|(_, b)| !(b.position.is_empty() && b.velocity.is_empty()))
            {
                let key = format!("bodies[{}]", self.bodies[i].title(i));
                return Err(Error::scene(key, "has a position or velocity, which the orbit settles; leave one out"));
            }
            if let Some((i, _)) = self.bodies.iter().enumerate().find(|(_, b)| orbit.corotation && !b.spin.is_empty()) {
                let key = format!("bodies[{}].spin", self.bodies[i].title(i));
                return Err(Error::scene(key, "and orbit.corotation are both given; leave one out"));
            }
        }
        Ok(())
    }
    /// Refuses a point of the type that many particles have: files would not tell them apart.
    fn check_types(&self) -> Result<()> {
        let taken: Vec<u8> = self.bodies.iter().filter_map(|b| Some(b.collisionless.as_ref()?.part_type)).collect();
        let is_taken = |body: &BodyInput| body.point_mass.is_some() && taken.contains(&body.part_type.unwrap_or(1));
        match self.bodies.iter().enumerate().find(|(_, body)| is_taken(body)) {
            Some((i, body)) => {
                let problem = format!(
                    "is {}, as that of collisionless particles; state another, as 5 for a black hole",
                    body.part_type.unwrap_or(1)
                );
                Err(Error::scene(format!("bodies[{}].type", body.title(i)), problem))
            }
            None => Ok(()),
        }
    }
}

/// A body as one that attracts.
fn attractor(body: &BodyInput) -> AttractorInput {
    AttractorInput {
        input: body.input.clone(),
        domain: body.domain.clone(),
        point_mass: body.point_mass.clone(),
        softening_radius: body.softening_radius.clone(),
        gravity_of: Vec::new(),
    }
}
