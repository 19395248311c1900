//! The sums over neighbors that all measures share.

use crate::target::{Positions, Target, at};
use sph::domain::{Domain, Wall};
use sph::exchange::Exchange;
use sph::kernel::{KernelName, support_over_spacing};
use sph::neighbors::{GhostTree, Halo, Reach, Sees, Sources, Tree};
use sph::parallel;
use sph::sums::{Actors, DensitySums, Search, Solved, largest_support, scatter_gradient, solve_support_radii};
use std::borrow::Cow;

/// Reach of the first solution over the guessed radii.
const FIRST_REACH: f64 = 1.3;
/// The next reach over radii that came out: more than they are solved to.
const SOLVED: f64 = 1.0 + 1e-4;

/// Sums of every particle at its own support radius, in the particles' order. Of particles over several ranks, those of others that
/// are seen here follow.
pub struct Measured<const D: usize> {
    /// Support radii, in the unit of the positions.
    pub support: Vec<f64>,
    /// Densities and gradients at these radii.
    pub sums: Vec<DensitySums<D>>,
    /// Whether a particle can have the target density: its whole support lies inside the domain and, after
    /// [`Self::leave_out_unresolved`], the target is resolved there.
    pub interior: Vec<bool>,
    pub(super) tree: Tree<D>,
    ghosts: Option<GhostTree<D>>,
    /// Masses of those of other ranks.
    foreign: Vec<f64>,
}

impl<const D: usize> Measured<D> {
    /// Solves n V_d H^d = N_H for every particle and sums densities at the solution. `guess` are support radii
    /// to start from.
    pub fn new(
        kernel: KernelName,
        domain: &Domain<D>,
        positions: &Positions<D>,
        masses: &[f64],
        guess: &[f64],
        kernel_neighbors: f64,
    ) -> Self {
        let n = masses.len();
        let tree = Tree::build(positions);
        let ghosts = match domain.region.wall() {
            Some(Wall::Reflecting) => GhostTree::mirror(domain, positions, |i| 2.0 * guess[i]),
            _ => None,
        };
        let largest = largest_support(domain, n, kernel_neighbors);
        let (guess, mass) = (tree.to_tree_order(guess), tree.to_tree_order(masses));
        let ghost_mass = ghosts.as_ref().map(|g| g.inherit(masses, 1.0)).unwrap_or_default();
        let ghost_support = vec![0.0; ghost_mass.len()];
        let mut sources = vec![Sources::new(&tree, &guess, [mass.as_slice()], Reach::Target)];
        if let Some(ghosts) = &ghosts {
            sources.push(Sources::new(&ghosts.tree, &ghost_support, [ghost_mass.as_slice()], Reach::Target));
        }
        let solved =
            solve_support_radii::<D, 1, f32>(kernel, domain, &sources, (kernel_neighbors, Search::EXACT), largest);
        drop(sources);
        let mut support = vec![0.0; n];
        let mut sums = vec![DensitySums::default(); n];
        for (s, &i) in solved.iter().zip(tree.order()) {
            support[i as usize] = s.support;
            sums[i as usize] = s.sums;
        }
        let interior = parallel::map(n, |i| !domain.is_edge_within(&at(positions, i), support[i]));
        Self { support, sums, interior, tree, ghosts, foreign: Vec::new() }
    }

    /// [`Self::new`] of particles that are over several ranks, which all call it together. Curved surfaces that mirror are not
    /// seen through.
    ///
    /// Radii are solved for with what other ranks have within a reach, and once more where a radius came out beyond it: with
    /// neighbors missing it comes out too large, so that the second reach is enough.
    pub fn among(
        exchange: &dyn Exchange,
        kernel: KernelName,
        domain: &Domain<D>,
        positions: &Positions<D>,
        masses: &[f64],
        guess: &[f64],
        kernel_neighbors: f64,
    ) -> Self {
        if exchange.is_alone() {
            return Self::new(kernel, domain, positions, masses, guess, kernel_neighbors);
        }
        let tree = Tree::build(positions);
        let (guess, mass) = (tree.to_tree_order(guess), tree.to_tree_order(masses));
        let largest = largest_support(domain, exchange.count(masses.len()), kernel_neighbors);
        let mut reach: Vec<f64> = guess.iter().map(|h| (FIRST_REACH * h).min(largest)).collect();
        let solved: Vec<Solved<D>> = loop {
            let halo = Halo::new(exchange, domain, (&tree, &reach), None, Sees::Targets);
            let [there] = halo.values(exchange, [[&mass, &[]]]);
            let sources = [
                Sources::new(&tree, &guess, [mass.as_slice()], Reach::Target),
                Sources::new(&halo.tree, &[], [there.as_slice()], Reach::Target),
            ];
            let solved =
                solve_support_radii::<D, 1, f32>(kernel, domain, &sources, (kernel_neighbors, Search::EXACT), largest);
            let is_beyond = |(s, r): (&Solved<D>, &f64)| s.support > *r;
            if !exchange.any(solved.iter().zip(&reach).any(is_beyond)) {
                break solved;
            }
            reach.iter_mut().zip(&solved).for_each(|(r, s)| *r = r.max(s.support * SOLVED));
        };
        Self::joined(exchange, domain, positions, (&tree, &mass), &solved)
    }

    /// Particles with their sums, followed by those of other ranks that see them or are seen.
    fn joined(
        exchange: &dyn Exchange,
        domain: &Domain<D>,
        positions: &Positions<D>,
        (tree, mass): (&Tree<D>, &[f64]),
        solved: &[Solved<D>],
    ) -> Self {
        let column = |of: fn(&Solved<D>) -> f64| solved.iter().map(of).collect::<Vec<f64>>();
        let (radii, number, weighted) =
            (column(|s| s.support), column(|s| s.sums.number_density), column(|s| s.sums.weighted));
        let halo = Halo::new(exchange, domain, (tree, &radii), None, Sees::Either);
        let channels = [[mass, &[]], [&radii, &[]], [&number, &[]], [&weighted, &[]]];
        let [foreign, their_radii, their_number, their_weighted] = halo.values(exchange, channels);
        let mut support = vec![0.0; solved.len()];
        let mut sums = vec![DensitySums::default(); solved.len()];
        for (s, &i) in solved.iter().zip(tree.order()) {
            support[i as usize] = s.support;
            sums[i as usize] = s.sums;
        }
        let own = solved.len();
        let mut interior = parallel::map(own, |i| !domain.is_edge_within(&at(positions, i), support[i]));
        interior.resize(own + foreign.len(), false);
        support.extend(their_radii);
        sums.extend(their_number.iter().zip(&their_weighted).map(|(&number_density, &weighted)| DensitySums {
            number_density,
            weighted,
            ..DensitySums::default()
        }));
        let all = std::array::from_fn(|k| {
            let theirs = (0..halo.tree.len()).map(|i| halo.tree.position(i)[k]);
            positions[k].iter().copied().chain(theirs).collect()
        });
        Self { support, sums, interior, tree: Tree::build(&all), ghosts: None, foreign }
    }

    /// How many particles are those of this rank.
    pub fn own(&self) -> usize {
        self.sums.len() - self.foreign.len()
    }

    /// Acceleration of a constant pressure P = 1, as a standard SPH code sums it:
    /// a_i = -sum_j m_j (grad W(H_i)/rho_i^2 + grad W(H_j)/rho_j^2), in the particles' order.
    pub fn constant_pressure_force(&self, kernel: KernelName, domain: &Domain<D>, masses: &[f64]) -> Vec<[f64; D]> {
        let strength: Vec<f64> = self.sums.iter().map(|s| 1.0 / s.weighted.powi(2)).collect();
        self.pressure_force(kernel, domain, masses, &strength)
    }

    /// a_i = -sum_j m_j (s_i grad W(H_i) + s_j grad W(H_j)) for s = P / rho^2, in the particles' order.
    pub fn pressure_force(
        &self,
        kernel: KernelName,
        domain: &Domain<D>,
        masses: &[f64],
        strength: &[f64],
    ) -> Vec<[f64; D]> {
        let masses = match self.foreign.as_slice() {
            [] => Cow::Borrowed(masses),
            foreign => Cow::Owned([masses, foreign].concat()),
        };
        let masses = masses.as_ref();
        let n = masses.len();
        let own_strength = strength;
        let strength: Vec<f64> = masses.iter().zip(strength).map(|(m, s)| m * s).collect();
        let tree_support = self.tree.to_tree_order(&self.support);
        let tree_strength = self.tree.to_tree_order(&strength);
        let ghost = self
            .ghosts
            .as_ref()
            .map(|g| (&g.tree, g.inherit(&self.support, 1.0 / D as f64), g.inherit(&strength, 1.0)));
        let mut actors =
            vec![Actors { tree: &self.tree, support: &tree_support, strength: &tree_strength, silent: false }];
        if let Some((tree, support, strength)) = &ghost {
            actors.push(Actors { tree, support, strength, silent: false });
        }
        let seen = scatter_gradient::<D, f32>(kernel, domain, &actors);
        let mut out = vec![[0.0; D]; n];
        for (seen, &i) in seen.iter().zip(self.tree.order()) {
            let own = &self.sums[i as usize].gradient;
            out[i as usize] = sph::array(|k| -own_strength[i as usize] * own[k] - seen.0[k]);
        }
        out.truncate(self.own());
        out
    }

    /// Takes particles out of the interior about which the target is too sharp to be followed (steep surfaces,
    /// discontinuities, vanishing density), see [`Target::sharpness`], and goes by the target's own support radii with
    /// `kernel_neighbors`: what is interior depends on places, not on where particles have gathered.
    pub fn leave_out_unresolved(&mut self, target: &Target<'_, D>, positions: &Positions<D>, kernel_neighbors: f64) {
        let ratio = support_over_spacing(D, kernel_neighbors);
        let own = self.own();
        parallel::update(&mut self.interior[..own], |i, inside| {
            *inside = target.is_resolved_at(&at(positions, i), ratio);
        });
    }
}
