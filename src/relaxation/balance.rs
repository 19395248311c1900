//! Balance of the pressure force: moves particles until the SPH acceleration of the target code cancels gravity.
//!
//! The force is that of standard SPH with grad-h terms (Springel & Hernquist 2002, MNRAS 333, 649, eq. 8; the
//! density-energy form of GADGET, Phantom and SWIFT):
//!
//! a_i = -sum_j m_j (P_i/(Omega_i rho_i^2) grad W_ij(H_i) + P_j/(Omega_j rho_j^2) grad W_ij(H_j)).
//!
//! With P_i = A_i rho_i^gamma and A_i held by the particle it is minus the gradient of the internal energy, and
//! an arrangement at rest is a minimum of that energy and the potential together, found by L-BFGS over the
//! positions, and in its last steps, where that is slow, by Newton's method. Past the neighbor number at which a B-spline's
//! pairing instability sets in, the energy is lowest where particles pair, and Newton's method alone leads from the order in
//! which particles come to the force-free arrangement nearby, a saddle in which they lie apart.
//! A_i = P*/rho*^gamma is taken anew from the target between stages. The internal energy that comes
//! out, u_i = A_i rho_i^(gamma-1)/(gamma-1) with the summed density, gives the target code the very pressures
//! that were balanced, and each particle then keeps its A_i there too, so that what is at rest stays at rest.
//!
//! Gravity is what the particles attract each other with where the body holds itself, as in the target code, else the
//! target's. Summed densities are off by the self-contribution, about 1 %, and so is the force; the mass within a particle's
//! radius is not quite the target's. A factor on A_i that depends smoothly on the enclosed mass (one common factor where nothing
//! is radial), fitted to gravity over the interior, takes that out instead of letting the body swell or shrink.
//!
//! Materials with equations of state of their own keep their adiabat in place of A_i: P_i = P(rho_i, u_i), u_i following du = P/rho^2 drho
//! from the target's density and energy. What makes their pressure is the density rather than the heat, so that no factor on
//! the thermal state is fitted; moves alone bring the summed densities to where the pressures hold gravity.
//!
//! Line searches use slopes alone (no potential is needed, so any field may be balanced). At an open edge there
//! is vacuum, as in the target code; particles leave the domain only where the body holds itself, and find their places
//! beyond its surface as they would in the code.

use super::arrangement::Arrangement;
use super::balance_states::{Best, Descent, Newton};
use super::equilibrium::Balance;
use super::report::{Progress, StageName, StageReport, StopReason};
use super::snapshot::{Check, Trace, axes, decode, encode};
use super::stage::{Particles, Relaxed, Running, Stage};
use super::thermal::Factor;
use crate::target::{Equilibrium, Positions, Target};
use serde::{Deserialize, Serialize};
use sph::domain::{Domain, Region, Wall};
use sph::kernel::KernelName;

pub const NAME: StageName = StageName { name: "balance", title: "balance" };

/// Parameters of the balance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BalanceOptions {
    /// N_H = V_d n H^d.
    pub kernel_neighbors: f64,
    /// Evaluations of the force, at most.
    pub evaluations: usize,
    /// The mean net force over gravity at which it ends.
    pub enough: f64,
}

impl BalanceOptions {
    /// The defaults in `d` dimensions.
    pub fn new(d: usize) -> Self {
        Self { kernel_neighbors: sph::kernel::default_kernel_neighbors(d), evaluations: 200, enough: 0.0 }
    }
}

/// Shares of the evaluations after which A_i, and gravity, are taken anew.
const SHARES: [f64; 4] = [0.06, 0.15, 0.35, 1.0];
/// Radius of what is there for a body that holds itself, in the body's own: its particles come to rest within it, and one that has lost touch with the
/// others goes no farther.
const SPACE: f64 = 1.02;

/// The stage: moves particles of equal mass towards balance. The state with the smallest force error comes out, with the
/// internal energy that each particle needs there. Pair distances are in single precision.
pub struct PressureBalance<'a, const D: usize> {
    pub kernel: KernelName,
    pub target: Target<'a, D>,
    pub equilibrium: &'a dyn Equilibrium<D>,
    pub options: BalanceOptions,
}

impl<const D: usize> Stage<D> for PressureBalance<'_, D> {
    fn name(&self) -> StageName {
        NAME
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        let (positions, neighbors) = (particles.positions, self.options.kernel_neighbors);
        let space = self.space();
        let arrangement = Arrangement::<D, f32>::new(self.kernel, self.target, space, positions, neighbors);
        let mut balance = Balance::new(arrangement, self.equilibrium);
        let way = if balance.makes_pairs() { Way::Newton(None) } else { Way::Descent(balance.descend()) };
        Box::new(Run { options: &self.options, balance, share: 0, way })
    }

    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        let kept: Snapshot<D> = decode(kept)?;
        kept.check(self.target.count)?;
        let Snapshot { share, positions, moves, way, factor, fitted_factor, evaluations, best, trace } = kept;
        let (space, neighbors) = (self.space(), self.options.kernel_neighbors);
        let arrangement =
            Arrangement::<D, f32>::of_sorted(self.kernel, self.target, space, positions, moves, neighbors);
        let trace = trace.resumed();
        let balance =
            Balance { factor, fitted_factor, evaluations, best, trace, ..Balance::new(arrangement, self.equilibrium) };
        Ok(Box::new(Run { options: &self.options, balance, share, way }))
    }
}

impl<const D: usize> PressureBalance<'_, D> {
    /// Where particles may go: to somewhat beyond the surface of a body that holds itself in vacuum, else not out of the domain.
    fn space(&self) -> Domain<D> {
        let domain = self.target.domain;
        match &domain.region {
            Region::Ball { center, radius, wall: Wall::Open, .. } if self.equilibrium.own_center().is_some() => {
                Domain::ball(*center, SPACE * radius, Wall::Open).unwrap_or_else(|_| domain.clone())
            }
            _ => domain.clone(),
        }
    }
}

/// How particles are moved at present.
#[derive(Clone, Serialize, Deserialize)]
enum Way<const D: usize> {
    Descent(Descent<D>),
    Newton(Option<Newton<D>>),
}

/// What goes on after an interrupt.
#[derive(Serialize, Deserialize)]
struct Snapshot<const D: usize> {
    /// In [`SHARES`].
    share: usize,
    #[serde(with = "axes")]
    positions: Positions<D>,
    moves: usize,
    way: Way<D>,
    factor: Factor,
    fitted_factor: Factor,
    evaluations: usize,
    best: Best<D>,
    trace: Trace,
}

impl<const D: usize> Snapshot<D> {
    /// # Errors
    /// What is wrong with it for `count` particles.
    fn check(&self, count: usize) -> Result<(), String> {
        let check = Check::new(count)
            .holds(self.share < SHARES.len(), "is of a part of the balance that this run does not have")
            .positions("positions", &self.positions)
            .positions("the best positions", &self.best.positions)
            .scalars("the best internal energies", &self.best.internal_energy);
        let other = "has another number of gradients than of particles";
        match &self.way {
            Way::Descent(Descent { frame, support, gradient, memory, .. }) => frame
                .check::<D>(check, count)
                .scalars("support radii", support)
                .vectors("the gradient", gradient)
                .holds(memory.is_of(count), other),
            Way::Newton(Some(Newton { frame, from, support, gradient, solver, .. })) => frame
                .check::<D>(check, count)
                .positions("the first positions", from)
                .scalars("support radii", support)
                .vectors("the gradient", gradient)
                .holds(solver.is_of(count), other),
            Way::Newton(None) => check,
        }
        .result()
    }
}

/// The stage under way.
struct Run<'a, const D: usize> {
    options: &'a BalanceOptions,
    balance: Balance<'a, D, f32>,
    /// In [`SHARES`].
    share: usize,
    way: Way<D>,
}

impl<const D: usize> Running<D> for Run<'_, D> {
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason> {
        if outside.is_some() {
            return outside;
        }
        let all = self.options.evaluations;
        let is_last = self.share + 1 == SHARES.len() || matches!(self.way, Way::Newton(_));
        if is_last && self.balance.is_at_rest(self.options.enough) {
            return Some(StopReason::ToleranceReached);
        }
        let descent = match &mut self.way {
            Way::Descent(descent) => descent,
            Way::Newton(newton) => return self.balance.advance_newton(newton, all),
        };
        let descents = self.balance.share_of_descents();
        let end = (descents * SHARES[self.share] * all as f64).ceil() as usize;
        let stop = self.balance.advance(descent, (end, is_last))?;
        if is_last {
            if descents == 1.0 {
                return Some(stop);
            }
            self.way = Way::Newton(None);
        } else {
            self.share += 1;
            self.way = Way::Descent(self.balance.descend());
        }
        None
    }

    fn progress(&self) -> (&[Progress], usize) {
        (&self.balance.trace.history, self.options.evaluations)
    }

    fn snapshot(&self, to: Vec<u8>) -> Result<Vec<u8>, String> {
        let balance = &self.balance;
        encode(
            &Snapshot {
                share: self.share,
                positions: balance.arrangement.positions().clone(),
                moves: balance.arrangement.moves(),
                way: self.way.clone(),
                factor: balance.factor.clone(),
                fitted_factor: balance.fitted_factor.clone(),
                evaluations: balance.evaluations,
                best: balance.best.clone(),
                trace: balance.trace.kept(),
            },
            to,
        )
    }

    fn finish(self: Box<Self>, stop: StopReason) -> Relaxed<D> {
        let Balance { best, trace, equilibrium, .. } = self.balance;
        let (best_iteration, seconds) = (best.iteration, trace.seconds());
        let report = StageReport { stage: NAME, stop, best_iteration, history: trace.history, seconds };
        let note = match equilibrium.materials() {
            Some(materials) => Some(format!(
                "internal energies are the target's, compressed to the summed densities without exchange of heat by {}",
                materials.names()
            )),
            None => equilibrium.has_gravity().then(|| factor_note(&best.factors)),
        };
        let particles =
            Particles { positions: best.positions, masses: None, internal_energy: Some(best.internal_energy) };
        Relaxed { particles, reports: vec![report], notes: Vec::from_iter(note) }
    }
}

fn factor_note([factor, fitted]: &[Factor; 2]) -> String {
    let is = |factor: &Factor| match *factor == Factor::one() {
        true => "internal energies are those of the target".to_owned(),
        false => format!("internal energies are those of the target times {factor}"),
    };
    if factor == fitted {
        return format!("{}, with which the pressure force balances gravity", is(factor));
    }
    format!(
        "the pressure would have to be {fitted} times the target's to hold gravity; {}, \
         and what comes out is a body that settles: check the input's pressure, units and balance.constant",
        is(factor)
    )
}
