//! The plan of a run: the stages that a scene needs, and those that it does not need, with the reasons.

use crate::input::hydrostatics::Doubt;
use crate::metrics::IN_PLACE;
use crate::relaxation::{BALANCE, SolverOptions, StageName, TRIMMING, WVT, WvtOptions};
use crate::scene::{Atmosphere, Order, Polish, Scene};
use crate::seeding::{Seeding, discontinuity_share, is_radial, is_uniform, shifted_share};
use crate::target::mass_points::MassPoints;
use crate::target::{Resolution, Target};
use serde::Serialize;
use sph::domain::{Axis, Domain, Region, Wall};
use std::cell::LazyCell;

/// Something that the plan drops.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    pub what: String,
    pub why: String,
}

/// Of trimming, enough for rounding; each costs a density pass in double precision.
pub(super) const TRIM_ITERATIONS: usize = 60;

/// Seeding and stages in order, and what is dropped.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Plan {
    pub seeding: Seeding,
    pub stages: Vec<StageName>,
    pub left_out: Vec<LeftOut>,
    /// 0 where WVT is left out.
    pub wvt_iterations: usize,
    pub polish: Polish,
    /// Stages of particle splitting within ALARIC.
    pub splittings: usize,
    /// Evaluations of the density solver, at most.
    pub evaluations: usize,
    /// Evaluations of the balance of pressure and gravity; 0 where it is left out.
    pub balance: usize,
    /// Whether the density solver brings mass to where the target has it, in place of summed densities.
    pub aims_at_mass: bool,
    /// Whether a body is not balanced for a code since what is carried contradicts what holds it.
    pub is_contradicted: bool,
}

/// What is known of the forces on a body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Held {
    /// Pressure against its own gravity.
    ByItself,
    /// Why it is not balanced unless that is asked for.
    Unsure(String),
    /// How what is carried contradicts that.
    Contradicted(String),
    Not,
}

impl Held {
    /// What `doubt` leaves of it, where the body's `own` gravity may hold it.
    pub(super) fn of(doubt: Option<Doubt>, own: bool) -> Self {
        match doubt {
            Some(Doubt::Contradicted(why)) => Self::Contradicted(why),
            Some(Doubt::Unasked(why)) => Self::Unsure(why),
            None if own => Self::ByItself,
            None => Self::Not,
        }
    }
}

impl Plan {
    /// Decides from the scene, the target that it came to, whether that is from a radial profile, and what holds it.
    pub fn new<const D: usize>(scene: &Scene, target: &Target<'_, D>, has_profile: bool, held: &Held) -> Self {
        Self::among(scene, target, has_profile, held, 1)
    }

    /// [`Self::new`] where so many ranks share the particles.
    pub fn among<const D: usize>(
        scene: &Scene,
        target: &Target<'_, D>,
        has_profile: bool,
        held: &Held,
        ranks: usize,
    ) -> Self {
        let (domain, count) = (target.domain, target.count);
        let mut plan = Self {
            seeding: scene.seeding.unwrap_or(match scene.order {
                Some(Order::Crystal) => Seeding::CubicClosePacked,
                _ => Seeding::default(),
            }),
            stages: Vec::new(),
            left_out: Vec::new(),
            wvt_iterations: 0,
            polish: Polish::None,
            splittings: 0,
            evaluations: 0,
            balance: 0,
            aims_at_mass: false,
            is_contradicted: false,
        };
        if count < MIN_RELAXED {
            plan.drop("relaxation", format!("{count} particles have no neighbors to relax against"));
        } else {
            let neighbors = scene.kernel_neighbors(D);
            let share = LazyCell::new(|| discontinuity_share(target, neighbors));
            let has_shells = are_shells(scene, target) && *share <= FEW_JUMPS;
            plan.choose_polish(scene, (count, count.div_ceil(ranks)), (D, has_shells));
            let thin = thinner_than_a_spacing(domain, count);
            if plan.polish != Polish::None && thin {
                plan.drop("polish", THIN);
                plan.polish = Polish::None;
            }
            let asks = plan.polish == Polish::Solver || plan.is_bare(scene, count);
            let jumps = if asks { *share } else { 0.0 };
            plan.choose_seeding(scene, target, jumps);
            let even = plan.seed_is_better(target, jumps);
            plan.choose_wvt(scene, D, jumps, (thin, even));
            plan.choose_balance(scene, count, held);
            plan.choose_aim(scene, target, || *share);
        }
        match scene.trim_masses {
            Some(_) => plan.stages.push(TRIMMING),
            None => plan.drop("mass trimming", "trim_masses is not set: masses are what the target says"),
        }
        if !domain.axes.contains(&Axis::Periodic) {
            plan.drop("periodic images", "no axis is periodic");
        }
        if matches!(domain.region, Region::Box) {
            plan.drop("ghost particles", "no surface is curved; flat walls mirror without them");
        }
        if !scene.has_own_resolution() {
            plan.drop("variable masses", "the resolution follows the density, so all masses are equal");
        }
        if !has_profile {
            plan.drop("atmosphere cut", "the input is not a radial profile");
        } else if scene.input.atmosphere == Atmosphere::Keep {
            plan.drop("atmosphere cut", "input.atmosphere is keep");
        }
        plan
    }

    /// For `count` particles, so many of which are on each rank.
    fn choose_polish(&mut self, scene: &Scene, (count, each): (usize, usize), (d, has_shells): (usize, bool)) {
        let neighbors = scene.kernel_neighbors(d);
        let lattice = scene.seeding == Some(Seeding::VariableMasses);
        let automatic = if lattice || has_shells || each > MAX_AUTOMATIC { Polish::None } else { Polish::Solver };
        match scene.polish.unwrap_or(automatic) {
            Polish::None if scene.polish.is_none() && lattice => {
                self.drop("density solver", "the lattice is even already; ask for it with polish: solver");
            }
            Polish::None if scene.polish.is_none() && has_shells => self.drop(
                "density solver",
                format!(
                    "shells of over {MAX_BESIDE_SHELLS} particles are as near to the density; ask for it with polish: solver"
                ),
            ),
            Polish::None if scene.polish.is_none() => self.drop(
                "density solver",
                format!("with more than {MAX_AUTOMATIC} particles it takes many minutes; request it with polish: \
                         solver"),
            ),
            Polish::None => self.drop("polish", NO_POLISH),
            _ if (count as f64) < 2.0 * neighbors => {
                self.drop("polish", format!("{count} particles all see each other with {neighbors:.0} neighbors"));
            }
            chosen => self.polish = chosen,
        }
        if self.polish == Polish::Solver {
            let affordable = affordable_evaluations(each, d, scene.tolerance.is_some());
            self.evaluations = scene.solver.evaluations.unwrap_or(affordable);
        }
        if self.polish == Polish::DampedRelaxation {
            self.drop("velocity stops and particle splitting", "damped relaxation has friction and viscosity alone");
        }
        if self.polish != Polish::Alaric {
            return;
        }
        self.splittings = scene.alaric.splittings.unwrap_or_else(|| {
            let coarse_features = scene.seeding == Some(Seeding::Random);
            usize::from(coarse_features && count >= MIN_SPLIT)
        });
        if self.splittings == 0 {
            self.drop(
                "particle splitting",
                match scene.seeding {
                    _ if scene.alaric.splittings.is_some() => "alaric.splittings is 0".to_string(),
                    None | Some(Seeding::MassBisection) => {
                        "mass bisection leaves no coarse features to converge first".into()
                    }
                    _ => format!("under {MIN_SPLIT} particles it saves nothing"),
                },
            );
        }
        if !scene.alaric.viscosity {
            self.drop("viscosity", "alaric.viscosity is false");
        }
    }

    /// Whether seeding and WVT go without a polish because of the number of particles, or because of a seeding that may not need
    /// WVT.
    fn is_bare(&self, scene: &Scene, count: usize) -> bool {
        self.polish == Polish::None
            && (scene.polish.is_none() && count > MAX_BESIDE_SHELLS || scene.seeding.is_some() || scene.order.is_some())
    }

    /// For a radial target in a ball, shells of the right masses are nearer to the density than WVT gets, and
    /// the solver ends at a third of the error that it reaches from mass bisection (`cargo bench --bench peers`).
    /// Where most of a body is near one jump or another, shells that a solver may not move are not enough. Where there
    /// are many particles, shells alone do as well as with the solver, and have a third of WVT's mean error, in a hundredth of its time.
    fn choose_seeding<const D: usize>(&mut self, scene: &Scene, target: &Target<'_, D>, jumps: f64) {
        let most = match self.polish {
            Polish::Solver => MOST_JUMPS,
            _ if self.is_bare(scene, target.count) => FEW_JUMPS,
            _ => return,
        };
        let suits = target.count >= MIN_SHELLS && jumps <= most;
        let free = scene.seeding.is_none() && scene.order != Some(Order::Crystal);
        if free && suits && is_radial(target) {
            self.seeding = Seeding::EqualAreaShells;
        }
    }

    /// Whether the seeded positions alone, without a polish, match the density better than WVT would: a lattice where the target is
    /// uniform, shells of many particles without jumps between them.
    fn seed_is_better<const D: usize>(&self, target: &Target<'_, D>, jumps: f64) -> bool {
        let shells = matches!(self.seeding, Seeding::EqualAreaShells | Seeding::Shells);
        let follows = D == 3 && target.count >= MIN_BARE_SHELLS && jumps <= FEW_JUMPS && is_radial(target);
        shells && follows || self.seeding.is_lattice() && is_uniform(target)
    }

    /// The solver leaves particles near jumps alone, so that WVT has to bring them into order there; elsewhere the
    /// solver does in one evaluation what takes WVT many iterations. Where it is to reach a tolerance soon it does not
    /// bring them to rest first, and needs the order that WVT leaves; so does a tolerance that is hard to reach from shells
    /// with a jump between them (`cargo bench --bench tolerances`, the planet).
    fn choose_wvt(&mut self, scene: &Scene, d: usize, jumps: f64, (thin, even): (bool, bool)) {
        let shells = self.seeding == Seeding::EqualAreaShells && self.polish == Polish::Solver && d == 3;
        let tight = scene.tolerance.is_some_and(|tolerance| tolerance < TIGHT);
        self.wvt_iterations = scene.wvt.iterations.unwrap_or(match (self.polish, self.seeding) {
            (Polish::None, Seeding::VariableMasses) => 0,
            (Polish::None, _) if thin || even => 0,
            (Polish::None, _) => WvtOptions::new(3).iterations,
            (polish, _) if polish.follows_seeding() => 0,
            _ if shells && jumps > FEW_JUMPS && tight => 20,
            _ if shells => 0,
            (Polish::Solver, lattice) if lattice.is_lattice() => 0,
            (Polish::Solver, Seeding::MassBisection) if jumps > FEW_JUMPS || scene.tolerance.is_some() => {
                MANY_ITERATIONS
            }
            (_, Seeding::MassBisection) => 5,
            (_, _) => MANY_ITERATIONS,
        });
        if self.wvt_iterations == 0 {
            let why = match self.polish {
                polish if polish.follows_seeding() => "the stage after it starts from the seeded positions",
                Polish::None if scene.wvt.iterations.is_none() && thin => THIN,
                _ if scene.wvt.iterations.is_some() => "wvt.iterations is 0",
                _ if self.seeding.is_lattice() || self.seeding == Seeding::VariableMasses => {
                    "the lattice is even already"
                }
                _ => "the shells already match the density better than WVT would",
            };
            self.drop("WVT", why);
        } else {
            self.stages.push(WVT);
        }
        self.stages.extend(self.polish.stage());
    }

    /// By itself for a body that its own gravity holds, where the code is known that it is for.
    fn choose_balance(&mut self, scene: &Scene, count: usize, held: &Held) {
        let asked = scene.balance.on();
        let why = match held {
            _ if asked.is_some() => None,
            _ if scene.balance.is_off() => Some(UNASKED[2]),
            Held::Not => Some(UNASKED[0]),
            Held::Unsure(why) | Held::Contradicted(why) => Some(why.as_str()),
            Held::ByItself if scene.target_code.is_none() => Some(UNASKED[1]),
            Held::ByItself if count < MIN_BALANCED => Some("there are too few particles"),
            Held::ByItself => None,
        };
        if let Some(why) = why {
            self.is_contradicted = scene.target_code.is_some() && matches!(held, Held::Contradicted(_));
            return self.drop(PRESSURE_AND_GRAVITY, why);
        }
        let share = (USUAL_BALANCE / count as f64).cbrt().powi(2);
        let usual = (MOST_BALANCE * share).clamp(LEAST_BALANCE, MOST_BALANCE);
        self.balance = asked.and_then(|b| b.evaluations).unwrap_or(usual as usize);
        if scene.solver.evaluations.is_none() && scene.tolerance.is_none() {
            // What it leaves decides over the density; the solver brings particles into order.
            self.evaluations = self.evaluations.min(BEFORE_BALANCE);
        }
        self.stages.push(BALANCE);
    }

    /// Sums over neighbors have the target's density where particles lie somewhat closer together than the mass, by what the kernel's
    /// smoothing takes. Of what is steep that is more than the mass may be off. Shells have the right mass by themselves, a balance
    /// decides over the density, and beside jumps and vacuum, and at curved surfaces, points of mass do not tell where particles belong.
    fn choose_aim<const D: usize>(&mut self, scene: &Scene, target: &Target<'_, D>, jumps: impl FnOnce() -> f64) {
        let asked = scene.aims_at_mass().or_else(|| scene.tolerance.map(|_| false));
        self.aims_at_mass = self.polish == Polish::Solver && asked == Some(true);
        let follows_mass = matches!(target.resolution, Resolution::EqualMass);
        if self.polish != Polish::Solver
            || asked.is_some()
            || self.balance > 0
            || !(follows_mass && matches!(target.domain.region, Region::Box))
            || self.starts_in_order()
            || MassPoints::are_too_many(target)
            || jumps() > FEW_JUMPS
        {
            return;
        }
        let shifted = shifted_share(target, scene.kernel(), scene.kernel_neighbors(D), IN_PLACE);
        if shifted > FEW_SHIFTED {
            self.aims_at_mass = true;
            self.drop(
                "summed densities that are the target's",
                format!(
                    "by the kernel's smoothing some {:.0} % of the mass would be off by more than {:.0} %; set solver.aim to density for them",
                    100.0 * shifted,
                    100.0 * IN_PLACE
                ),
            );
        }
    }

    /// Whether the solver begins with particles in order, which nothing has to bring to rest.
    pub fn starts_in_order(&self) -> bool {
        self.wvt_iterations == 0 && self.seeding.is_in_order()
    }

    /// Why there is no balance, where it would take more than asking for it.
    pub fn why_unbalanced(&self) -> Option<&str> {
        let dropped = self.left_out.iter().find(|l| l.what == PRESSURE_AND_GRAVITY)?;
        (!UNASKED.contains(&dropped.why.as_str())).then_some(&dropped.why)
    }

    /// Whether asking for a balance is all that it would take.
    pub fn is_balance_unasked(&self) -> bool {
        self.left_out.iter().any(|l| l.what == PRESSURE_AND_GRAVITY) && self.why_unbalanced().is_none()
    }

    /// Whether asking for the solver would polish particles with it.
    pub fn takes_a_solver(&self) -> bool {
        let is_left_out = |l: &LeftOut| l.what == "density solver" || l.why == NO_POLISH;
        !matches!(self.polish, Polish::None | Polish::Solver) || self.left_out.iter().any(is_left_out)
    }

    pub fn drop(&mut self, what: impl Into<String>, why: impl Into<String>) {
        self.left_out.push(LeftOut { what: what.into(), why: why.into() });
    }
}

const NO_POLISH: &str = "polish is none";
const PRESSURE_AND_GRAVITY: &str = "balance of pressure and gravity";
const UNASKED: [&str; 3] = [
    "balance is not set (--balance)",
    "neither balance (--balance) nor a target code (--for) is set",
    "balance is false",
];
/// Evaluations of a balance: those for the usual number of particles, and at least.
const MOST_BALANCE: f64 = 600.0;
const USUAL_BALANCE: f64 = 3e4;
const LEAST_BALANCE: f64 = 120.0;
/// Evaluations of the density solver before a balance, at most: more of them change neither its net force nor how still the body stays.
const BEFORE_BALANCE: usize = 60;
/// Bodies of fewer particles are not balanced unless asked for.
const MIN_BALANCED: usize = 1000;

const THIN: &str = "the domain is thinner than the particles' spacing: its faces are all they see";

/// Whether an open axis of a box is shorter than the mean spacing: the mirror images that relaxation sees there
/// and the vacuum that it is measured by have nothing to do with each other.
fn thinner_than_a_spacing<const D: usize>(domain: &Domain<D>, count: usize) -> bool {
    let spacing = domain.mean_spacing(count);
    let extent = domain.extent();
    matches!(domain.region, Region::Box)
        && (0..D).any(|k| {
            extent[k] < spacing
                && matches!(domain.axes[k], Axis::Walls { lo, hi } if Wall::Open == lo || Wall::Open == hi)
        })
}

/// Whether particles are on shells, where jumps do not forbid it, and so many that these do as well alone as with a polish.
fn are_shells<const D: usize>(scene: &Scene, target: &Target<'_, D>) -> bool {
    let is_free = scene.seeding.is_none() && scene.order != Some(Order::Crystal);
    D == 3 && target.count > MAX_BESIDE_SHELLS && is_free && is_radial(target)
}

/// Evaluations that a user waits for: few particles get more of them, which their error and noise gain from, and a
/// million stay within a minute. A tolerance stops them early, so that more are allowed.
fn affordable_evaluations(count: usize, d: usize, stops_early: bool) -> usize {
    let usual = SolverOptions::new(d).evaluations as f64 * (USUAL / count as f64).sqrt();
    let affordable = usual.clamp(30.0, 240.0) as usize;
    if stops_early { 4 * affordable } else { affordable }
}

/// Shares of the domain near jumps: below the one they do not matter, above the other nothing else does.
const FEW_JUMPS: f64 = 1e-3;
const MOST_JUMPS: f64 = 0.5;
/// Share of the mass that may be off by more than [`IN_PLACE`] where summed densities are the target's.
const FEW_SHIFTED: f64 = 0.25;
/// A smaller tolerance is hard to reach.
const TIGHT: f64 = 5e-6;
/// WVT's iterations before a polish where few are not enough.
const MANY_ITERATIONS: usize = 40;
/// Fewer particles make no shells worth the name.
const MIN_SHELLS: usize = 1000;
/// Bare shells of more particles have less than half the mean error that WVT ends with, and less noise.
const MIN_BARE_SHELLS: usize = 30_000;
/// Fewer particles are left where the seeding puts them.
const MIN_RELAXED: usize = 3;
/// More particles are not polished unless asked for.
const MAX_AUTOMATIC: usize = 10_000_000;
/// Shells of more particles end no nearer to the density when they are polished: 0.05 % on average at 1e7 with the solver and without.
const MAX_BESIDE_SHELLS: usize = 3_000_000;
/// Particles for which the solver's default evaluations are meant.
const USUAL: f64 = 1e5;
/// Fewer particles converge at once; splitting only adds its noise.
const MIN_SPLIT: usize = 4000;
