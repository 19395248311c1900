//! The sums over neighbors that all measures share.

use crate::target::{Positions, Target, at};
use sph::domain::{Domain, Wall};
use sph::kernel::{KernelName, support_over_spacing};
use sph::neighbors::{GhostTree, Reach, Sources, Tree};
use sph::parallel;
use sph::sums::{Actors, DensitySums, largest_support, scatter_gradient, solve_support_radii};

/// Sums of every particle at its own support radius, in the particles' order.
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
        let solved = solve_support_radii::<D, 1, f32>(kernel, domain, &sources, kernel_neighbors, largest);
        drop(sources);
        let mut support = vec![0.0; n];
        let mut sums = vec![DensitySums::default(); n];
        for (s, &i) in solved.iter().zip(tree.order()) {
            support[i as usize] = s.support;
            sums[i as usize] = s.sums;
        }
        let interior = parallel::map(n, |i| !domain.is_edge_within(&at(positions, i), support[i]));
        Self { support, sums, interior, tree, ghosts }
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
            out[i as usize] = std::array::from_fn(|k| -own_strength[i as usize] * own[k] - seen.0[k]);
        }
        out
    }

    /// Takes particles out of the interior about which the target is too sharp to be followed (steep surfaces,
    /// discontinuities, vanishing density), see [`Target::sharpness`], and goes by the target's own support radii with
    /// `kernel_neighbors`: what is interior depends on places, not on where particles have gathered.
    pub fn leave_out_unresolved(&mut self, target: &Target<'_, D>, positions: &Positions<D>, kernel_neighbors: f64) {
        let ratio = support_over_spacing(D, kernel_neighbors);
        parallel::update(&mut self.interior, |i, inside| {
            let x = at(positions, i);
            let wanted = target.number_density(&x);
            let support = target.support(wanted, ratio);
            *inside = !target.domain.is_edge_within(&x, support) && target.sharpness(&x, wanted, support) < 1.0;
        });
    }
}
