//! The sums over neighbors that all measures share.

use crate::target::{Positions, Target, at};
use sph::domain::{Domain, Wall};
use sph::exchange::Exchange;
use sph::kernel::{KernelName, support_over_spacing};
use sph::neighbors::{GhostTree, Groups, Halo, Reach, Seeing, Sees, Sources, Tree};
use sph::parallel;
use sph::sums::{
    Actors, DensitySums, Search, Solved, Vector, largest_support, scatter_gradient, solve_support_radii,
    solve_within_reach,
};
use std::collections::BTreeSet;

/// Particles that are looked at together, at most.
const GROUP: usize = 8;

/// Particles up to which sums are in double precision, which costs little: in the leaves of few, spacings at a cusp differ by more than single precision
/// resolves.
const FEW: usize = 1 << 12;

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

/// Support radii, and sums there, of the first of the `sources`, with all of `count` particles.
fn solved<const D: usize>(
    count: usize,
    kernel: KernelName,
    domain: &Domain<D>,
    sources: &[Sources<'_, D, 1>],
    kernel_neighbors: f64,
) -> Vec<Solved<D>> {
    let largest = largest_support(domain, count, kernel_neighbors);
    let solve = if count <= FEW { solve_support_radii::<D, 1, f64> } else { solve_support_radii::<D, 1, f32> };
    solve(kernel, domain, sources, (kernel_neighbors, Search::EXACT), largest)
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
        let (guess, mass) = (tree.to_tree_order(guess), tree.to_tree_order(masses));
        let ghost_mass = ghosts.as_ref().map(|g| g.inherit(masses, 1.0)).unwrap_or_default();
        let ghost_support = vec![0.0; ghost_mass.len()];
        let mut sources = vec![Sources::new(&tree, &guess, [mass.as_slice()], Reach::Target)];
        if let Some(ghosts) = &ghosts {
            sources.push(Sources::new(&ghosts.tree, &ghost_support, [ghost_mass.as_slice()], Reach::Target));
        }
        let solved = solved(n, kernel, domain, &sources, kernel_neighbors);
        drop(sources);
        drop((guess, mass));
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
        let count = exchange.count(masses.len());
        let largest = largest_support(domain, count, kernel_neighbors);
        let solved = solve_within_reach(exchange, (&guess, largest), |reach| {
            let halo = Halo::new(exchange, domain, (&tree, reach), None, Sees::Targets);
            let [there] = halo.values(exchange, [[&mass, &[]]]);
            let sources = [
                Sources::new(&tree, &guess, [mass.as_slice()], Reach::Target),
                Sources::new(&halo.tree, &[], [there.as_slice()], Reach::Target),
            ];
            solved(count, kernel, domain, &sources, kernel_neighbors)
        });
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

    /// Particles that are close together; those of other ranks among them.
    pub fn groups(&self) -> Groups {
        Groups::new(&self.tree, GROUP)
    }

    /// How many particles are those of this rank.
    pub fn own(&self) -> usize {
        self.sums.len() - self.foreign.len()
    }

    /// Acceleration of a constant pressure P = 1, as a standard SPH code sums it:
    /// a_i = -sum_j m_j (grad W(H_i)/rho_i^2 + grad W(H_j)/rho_j^2), in the particles' order.
    pub fn constant_pressure_force(&self, kernel: KernelName, domain: &Domain<D>, masses: &[f64]) -> Vec<[f64; D]> {
        self.in_own_order(&self.constant_pressure_forces(kernel, domain, masses))
    }

    /// The same in the tree's order.
    pub(super) fn constant_pressure_forces(
        &self,
        kernel: KernelName,
        domain: &Domain<D>,
        masses: &[f64],
    ) -> Vec<Vector<D>> {
        self.forces(kernel, domain, masses, &|i| self.sums[i].weighted.powi(2).recip())
    }

    /// a_i = -sum_j m_j (s_i grad W(H_i) + s_j grad W(H_j)) for s = P / rho^2, in the particles' order.
    pub fn pressure_force(
        &self,
        kernel: KernelName,
        domain: &Domain<D>,
        masses: &[f64],
        strength: &[f64],
    ) -> Vec<[f64; D]> {
        self.in_own_order(&self.forces(kernel, domain, masses, &|i| strength[i]))
    }

    /// The same at some places in the tree's order alone.
    pub(super) fn pressure_force_at(
        &self,
        kernel: KernelName,
        domain: &Domain<D>,
        (masses, strength): (&[f64], &[f64]),
        places: &[usize],
    ) -> Vec<[f64; D]> {
        if places.is_empty() {
            return Vec::new();
        }
        let (strength, order) = (|i: usize| strength[i], self.tree.order());
        let acting = self.acting(masses, &strength);
        let some: Positions<D> = std::array::from_fn(|k| places.iter().map(|&p| self.tree.position(p)[k]).collect());
        let tree = Tree::build(&some);
        let support: Vec<f64> = tree.order().iter().map(|&j| acting.support[places[j as usize]]).collect();
        let unit = vec![1.0; support.len()];
        let mut actors = vec![Actors { tree: &tree, support: &support, strength: &unit, silent: true }];
        actors.extend(acting.actors(&self.tree));
        let seen = scatter_gradient::<D, f32>(kernel, domain, &actors);
        let mut out = vec![[0.0; D]; places.len()];
        for (seen, &j) in seen.iter().zip(tree.order()) {
            let i = order[places[j as usize]] as usize;
            out[j as usize] = sph::array(|k| -strength(i) * self.sums[i].gradient[k] - seen.0[k]);
        }
        out
    }

    /// a_i for strengths s_i, in the tree's order.
    fn forces(
        &self,
        kernel: KernelName,
        domain: &Domain<D>,
        masses: &[f64],
        strength: &(dyn Fn(usize) -> f64 + Sync),
    ) -> Vec<Vector<D>> {
        let acting = self.acting(masses, strength);
        let mut forces = scatter_gradient::<D, f32>(kernel, domain, &acting.actors(&self.tree));
        drop(acting);
        let order = self.tree.order();
        parallel::update(&mut forces, |place, force| {
            let i = order[place] as usize;
            let (own, gradient) = (strength(i), &self.sums[i].gradient);
            force.0 = sph::array(|k| -own * gradient[k] - force.0[k]);
        });
        forces
    }

    fn acting(&self, masses: &[f64], strength: &(dyn Fn(usize) -> f64 + Sync)) -> Acting<'_, D> {
        let own = self.own();
        let weight = |i: usize| strength(i) * if i < own { masses[i] } else { self.foreign[i - own] };
        let order = self.tree.order();
        let ghosts = self.ghosts.as_ref().map(|ghosts| {
            let weights = parallel::map(order.len(), weight);
            (&ghosts.tree, ghosts.inherit(&self.support, 1.0 / D as f64), ghosts.inherit(&weights, 1.0))
        });
        Acting {
            support: self.tree.to_tree_order(&self.support),
            strength: parallel::map(order.len(), |place| weight(order[place] as usize)),
            ghosts,
        }
    }

    /// Vectors of this rank's particles, in their order.
    fn in_own_order(&self, vectors: &[Vector<D>]) -> Vec<[f64; D]> {
        let mut out = vec![[0.0; D]; vectors.len()];
        vectors.iter().zip(self.tree.order()).for_each(|(v, &i)| out[i as usize] = v.0);
        out.truncate(self.own());
        out
    }

    /// Takes particles out of the interior about which the target is too sharp to be followed (steep surfaces,
    /// discontinuities, vanishing density), see [`Target::sharpness`], and goes by the target's own support radii with
    /// `kernel_neighbors`: what is interior depends on places, not on where particles have gathered. `groups` are [`Self::groups`].
    pub fn leave_out_unresolved(
        &mut self,
        target: &Target<'_, D>,
        positions: &Positions<D>,
        (groups, kernel_neighbors): (&Groups, f64),
    ) {
        let ratio = support_over_spacing(D, kernel_neighbors);
        let own = self.own();
        let members = |group: usize| groups.members(group).iter().map(|&i| i as usize).filter(|&i| i < own);
        let resolved = parallel::map(groups.len(), |group| {
            let places: Vec<[f64; D]> = members(group).map(|i| at(positions, i)).collect();
            target.are_resolved_at(&places, ratio)
        });
        for (group, bits) in resolved.into_iter().enumerate() {
            members(group).enumerate().for_each(|(bit, i)| self.interior[i] = bits >> bit & 1 == 1);
        }
    }

    /// Which particles of the interior neither see one on the other side of a jump of the target, nor are seen by one: forces between the two
    /// sides are of the jump, and of no arrangement. All of the interior where there are no jumps, or too many pieces.
    pub fn apart_from_jumps(&self, target: &Target<'_, D>, positions: &Positions<D>) -> Vec<bool> {
        let mut interior = self.interior.clone();
        let own = self.own();
        let side = |i: usize| -> u64 {
            let x = at(positions, i);
            match (target.regions(), target.has_equal_masses()) {
                (Some(regions), true) => regions.of(&x).map_or(0, |region| region as u64 + 1),
                (None, true) => 0,
                // Masses vary where the density jumps, and the number of particles need not.
                _ => target.density.piece(&x),
            }
        };
        let sides = parallel::map(own, side);
        let all: BTreeSet<u64> = sides.iter().copied().collect();
        if !(2..=MOST_SIDES).contains(&all.len()) {
            return interior;
        }
        for side in all {
            let chosen = |is_of: bool| (0..own).filter(|&i| (sides[i] == side) == is_of).collect::<Vec<usize>>();
            let places = |of: &[usize]| -> Positions<D> {
                std::array::from_fn(|k| of.iter().map(|&i| positions[k][i]).collect())
            };
            let radii = |of: &[usize]| of.iter().map(|&i| self.support[i]).collect::<Vec<f64>>();
            let (here, there) = (chosen(true), chosen(false));
            let seen = Seeing::new(&places(&there), &radii(&there)).reach(target.domain, &places(&here), &radii(&here));
            here.into_iter().zip(seen).filter(|(_, seen)| *seen).for_each(|(i, _)| interior[i] = false);
        }
        interior
    }
}

/// Pieces of a target that are looked at one by one.
const MOST_SIDES: usize = 16;

/// What acts on particles: support radii and m_j s_j in the tree's order, and those of ghosts.
struct Acting<'a, const D: usize> {
    support: Vec<f64>,
    strength: Vec<f64>,
    ghosts: Option<(&'a Tree<D>, Vec<f64>, Vec<f64>)>,
}

impl<const D: usize> Acting<'_, D> {
    fn actors<'b>(&'b self, tree: &'b Tree<D>) -> Vec<Actors<'b, D>> {
        let all = Actors { tree, support: &self.support, strength: &self.strength, silent: false };
        let ghosts = self.ghosts.as_ref();
        let ghosts = ghosts.map(|(tree, support, strength)| Actors { tree, support, strength, silent: false });
        [all].into_iter().chain(ghosts).collect()
    }
}
