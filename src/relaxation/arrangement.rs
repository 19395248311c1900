//! Particles in a domain with what every force on them needs: tree, ghosts, sums and their gradients.

use crate::target::{Positions, Target, at};
use rayon::prelude::*;
use sph::domain::{Domain, Round};
use sph::kernel::{KernelName, support_over_spacing};
use sph::lanes::Real;
use sph::neighbors::{GhostTree, Reach, Sources, Tree};
use sph::sums::{
    Actors, Away, DensitySums, Solved, Vector, away_from_closest, density, largest_support, scatter_gradient,
    solve_support_radii,
};
use std::marker::PhantomData;

/// Depth below a curved surface, in support radii, from which particles are mirrored. More than one, since a
/// target at the surface may have a larger radius than the particles below it.
pub(super) const GHOST_DEPTH: f64 = 1.5;
/// Moves between sortings, where steps are short.
pub(super) const SORT_INTERVAL: usize = 8;

/// Values in a new order, which names the old place of each, see [`Arrangement::sort`].
pub(super) fn reordered<T: Copy + Send + Sync>(values: &[T], order: &[u32]) -> Vec<T> {
    order.par_iter().map(|&i| values[i as usize]).collect()
}

/// Ghosts with what mirrors them.
struct GhostLayer<const D: usize> {
    images: GhostTree<D>,
    /// Unit normal of the mirror.
    normals: Vec<[f64; D]>,
    /// The surface that mirrors, where it is curved.
    round: Option<Round<D>>,
}

impl<const D: usize> GhostLayer<D> {
    fn new(domain: &Domain<D>, positions: &Positions<D>, support: &[f64]) -> Option<Self> {
        let images = GhostTree::mirror(domain, positions, |i| GHOST_DEPTH * support[i])?;
        let normal = |(g, &p): (usize, &u32)| {
            let away: [f64; D] = std::array::from_fn(|k| images.tree.position(g)[k] - positions[k][p as usize]);
            let length = away.iter().map(|a| a * a).sum::<f64>().sqrt();
            away.map(|a| if length > 0.0 { a / length } else { 0.0 })
        };
        let normals = images.parents.iter().enumerate().map(normal).collect();
        Some(Self { normals, round: domain.region.round(), images })
    }

    /// A vector of the parent as the mirror shows it.
    fn reflected(&self, g: usize, vector: [f64; D]) -> [f64; D] {
        let n = &self.normals[g];
        let along: f64 = (0..D).map(|k| vector[k] * n[k]).sum();
        std::array::from_fn(|k| vector[k] - 2.0 * along * n[k])
    }

    /// Change of the parent's gradient by that of its ghost: the transposed derivative of mirroring, which
    /// turns the normal around and stretches what is tangential.
    fn pull_back(&self, g: usize, gradient: &[f64; D]) -> [f64; D] {
        let n = &self.normals[g];
        let along: f64 = (0..D).map(|k| gradient[k] * n[k]).sum();
        let curved = self.round.map_or(0, |round| round.curved());
        let tangential = if curved > 0 { self.images.stretch[g].powf(1.0 / curved as f64) } else { 1.0 };
        let straight = self.round.and_then(|round| round.axis);
        std::array::from_fn(|k| {
            let stretch = if straight == Some(k) { 1.0 } else { tangential };
            stretch * (gradient[k] - along * n[k]) - along * n[k]
        })
    }
}

/// Particles, in tree order, under a kernel with N_H neighbors. `R` is the precision of pair distances.
pub(super) struct Arrangement<'a, const D: usize, R> {
    pub kernel: KernelName,
    pub target: &'a Target<'a, D>,
    /// The domain as forces see it, see [`Domain::mirrored`].
    pub domain: &'a Domain<D>,
    pub kernel_neighbors: f64,
    pub positions: Positions<D>,
    tree: Tree<D>,
    ghosts: Option<GhostLayer<D>>,
    moves: usize,
    /// The target at the particles, where the last move has told it.
    wanted: Option<Vec<f64>>,
    precision: PhantomData<R>,
}

impl<'a, const D: usize, R: Real> Arrangement<'a, D, R> {
    /// Sorts `positions` into tree order.
    pub fn new(
        kernel: KernelName,
        target: &'a Target<'a, D>,
        domain: &'a Domain<D>,
        positions: Positions<D>,
        kernel_neighbors: f64,
    ) -> Self {
        Self::with_order(kernel, target, domain, positions, kernel_neighbors).0
    }

    /// [`Self::new`] with the particle that each place of the tree order held before.
    pub fn with_order(
        kernel: KernelName,
        target: &'a Target<'a, D>,
        domain: &'a Domain<D>,
        positions: Positions<D>,
        kernel_neighbors: f64,
    ) -> (Self, Vec<u32>) {
        let mut tree = Tree::build(&positions);
        let positions = std::array::from_fn(|k| tree.to_tree_order(&positions[k]));
        let order = tree.order().to_vec();
        tree.forget_order();
        let arrangement = Self {
            kernel,
            target,
            domain,
            kernel_neighbors,
            positions,
            tree,
            ghosts: None,
            moves: 0,
            wanted: None,
            precision: PhantomData,
        };
        (arrangement, order)
    }

    /// Particles that are in tree order already, `moves` after the last sorting.
    pub fn of_sorted(
        kernel: KernelName,
        target: &'a Target<'a, D>,
        domain: &'a Domain<D>,
        positions: Positions<D>,
        moves: usize,
        kernel_neighbors: f64,
    ) -> Self {
        let tree = Tree::of_sorted(&positions);
        let precision = PhantomData;
        Self { kernel, target, domain, kernel_neighbors, positions, tree, ghosts: None, moves, wanted: None, precision }
    }

    /// Moves since the last sorting.
    pub fn moves(&self) -> usize {
        self.moves
    }

    /// Support radii that the target's spacing gives.
    pub fn target_supports(&self) -> Vec<f64> {
        let ratio = support_over_spacing(D, self.kernel_neighbors);
        let (target, largest) = (self.target, self.domain.size());
        let wanted = target.number_densities(&self.positions);
        wanted.into_par_iter().map(|w| ratio * target.spacing(w).min(largest)).collect()
    }

    pub fn len(&self) -> usize {
        self.tree.len()
    }

    /// Whether the tree should be sorted anew after so many moves, see [`Self::sort`]. In between its boxes are fitted
    /// to the moved particles.
    pub fn is_stale(&self, moves: usize) -> bool {
        self.moves >= moves
    }

    /// Sorts particles into the order of a new tree. Returns new place -> old place, for other arrays.
    pub fn sort(&mut self) -> Vec<u32> {
        self.tree = Tree::build(&self.positions);
        self.positions = std::array::from_fn(|k| self.tree.to_tree_order(&self.positions[k]));
        let order = self.tree.order().to_vec();
        self.tree.forget_order();
        self.moves = 0;
        self.wanted = None;
        order
    }

    /// Takes over that `positions` have changed.
    pub fn moved(&mut self) {
        self.tree.refit(&self.positions);
        self.moves += 1;
        self.wanted = None;
    }

    /// n* at the particles.
    pub fn wanted(&mut self) -> Vec<f64> {
        self.wanted.take().unwrap_or_else(|| self.target.number_densities(&self.positions))
    }

    /// Moves all particles from `from` by `t` times `direction` (in units of `unit`), each by at most
    /// `max_step` of its spacing, and none out of the domain. Returns the moves made, in units of `unit`.
    pub fn displace(
        &mut self,
        from: &Positions<D>,
        direction: &[[f64; D]],
        t: f64,
        unit: &[f64],
        spacing: &[f64],
        max_step: f64,
    ) -> Vec<[f64; D]> {
        let (target, domain) = (self.target, self.domain);
        let moved: Vec<([f64; D], [f64; D], f64)> = direction
            .par_iter()
            .enumerate()
            .map(|(i, d)| {
                let x0 = at(from, i);
                let length = t * unit[i] / spacing[i] * d.iter().map(|v| v * v).sum::<f64>().sqrt();
                let limited = t * if length > max_step { max_step / length } else { 1.0 };
                let mut x: [f64; D] = std::array::from_fn(|k| x0[k] + limited * unit[i] * d[k]);
                domain.confine(&x0, &mut x);
                let mut wanted = if target.domain.contains(&x) { target.number_density(&x) } else { 0.0 };
                if !(wanted > 0.0) {
                    x = x0;
                    wanted = target.number_density(&x);
                }
                (x, domain.displacement(&x0, &x).map(|v| v / unit[i]), wanted)
            })
            .collect();
        for k in 0..D {
            self.positions[k].par_iter_mut().zip(&moved).for_each(|(x, m)| *x = m.0[k]);
        }
        self.moved();
        self.wanted = Some(moved.par_iter().map(|m| m.2).collect());
        moved.into_par_iter().map(|m| m.1).collect()
    }

    /// Mirrors particles at curved surfaces for the sums to come; `support` are the radii to be covered.
    pub fn mirror(&mut self, support: &[f64]) {
        self.ghosts = GhostLayer::new(self.domain, &self.positions, support);
    }

    /// Number density sums at given support radii.
    pub fn densities(&self, support: &[f64]) -> Vec<DensitySums<D>> {
        density::<D, 0, R>(self.kernel, self.domain, &self.sources(support))
    }

    /// sum_b w_b W(r_ab, H_a) for weights per particle.
    pub fn weighted(&self, support: &[f64], weights: &[f64]) -> Vec<f64> {
        let inherited = self.ghosts.as_ref().map(|g| g.images.inherit(weights, 0.0)).unwrap_or_default();
        let mut sources = vec![Sources::new(&self.tree, support, [weights], Reach::Target)];
        if let Some(ghosts) = &self.ghosts {
            sources.push(Sources::new(&ghosts.images.tree, &[], [inherited.as_slice()], Reach::Target));
        }
        let sums = density::<D, 1, R>(self.kernel, self.domain, &sources);
        sums.into_par_iter().map(|s| s.weighted).collect()
    }

    /// The direction away from each particle's closest neighbor within `support`, by distance in units of the pair's mean
    /// `spacing`.
    pub fn away_from_closest(&self, support: &[f64], spacing: &[f64]) -> Vec<Away<D>> {
        let inherited = self.ghosts.as_ref().map(|g| g.images.inherit(spacing, 0.0)).unwrap_or_default();
        let mut sources = vec![Sources::new(&self.tree, support, [spacing], Reach::Target)];
        if let Some(ghosts) = &self.ghosts {
            sources.push(Sources::new(&ghosts.images.tree, &[], [inherited.as_slice()], Reach::Target));
        }
        away_from_closest(self.domain, &sources)
    }

    /// Support radii with n V_d H^d = N_H, and the sums at them.
    pub fn solve(&self, guess: &[f64]) -> Vec<Solved<D>> {
        let largest = largest_support(self.domain, self.len(), self.kernel_neighbors);
        let sources = self.sources(guess);
        solve_support_radii::<D, 0, R>(self.kernel, self.domain, &sources, self.kernel_neighbors, largest)
    }

    fn sources<'s>(&'s self, support: &'s [f64]) -> Vec<Sources<'s, D, 0>> {
        let mut sources = vec![Sources::new(&self.tree, support, [], Reach::Target)];
        if let Some(ghosts) = &self.ghosts {
            sources.push(Sources::new(&ghosts.images.tree, &[], [], Reach::Target));
        }
        sources
    }

    /// The derivative of sum_b A_b n_b (A and H held) by each particle's position: what it sees itself, in
    /// `sums`, and what others see of it and of its ghosts.
    pub fn gradient(&self, support: &[f64], strength: &[f64], sums: &[DensitySums<D>]) -> Vec<[f64; D]> {
        let real = Actors { tree: &self.tree, support, strength, silent: false };
        let mut out: Vec<[f64; D]> = scatter_gradient::<D, R>(self.kernel, self.domain, &[real])
            .into_par_iter()
            .zip(sums)
            .zip(strength)
            .map(|((Vector(seen), sums), a)| std::array::from_fn(|k| seen[k] + a * sums.gradient[k]))
            .collect();
        if let Some(ghosts) = &self.ghosts {
            for (g, Vector(seen)) in self.seen_of_ghosts(ghosts, support, strength).iter().enumerate() {
                let pulled = ghosts.pull_back(g, seen);
                let parent = &mut out[ghosts.images.parents[g] as usize];
                (0..D).for_each(|k| parent[k] += pulled[k]);
            }
        }
        out
    }

    fn seen_of_ghosts(&self, ghosts: &GhostLayer<D>, support: &[f64], strength: &[f64]) -> Vec<Vector<D>> {
        let (ghost_support, ghost_strength) =
            (ghosts.images.inherit(support, 1.0 / D as f64), ghosts.images.inherit(strength, 0.0));
        let targets =
            Actors { tree: &ghosts.images.tree, support: &ghost_support, strength: &ghost_strength, silent: true };
        let real = Actors { tree: &self.tree, support, strength, silent: false };
        // Ghosts lie beyond the domain: they are seen where they are, not through the images of walls.
        scatter_gradient::<D, R>(self.kernel, self.domain, &[targets, real])
    }

    /// Calls `pass` with the sources of all pairs within the larger radius of the two, the first `D` channels
    /// being a vector.
    pub fn with_pairs<const C: usize, T>(
        &self,
        support: &[f64],
        channels: [&[f64]; C],
        pass: impl Fn(&[Sources<'_, D, C>]) -> T,
    ) -> T {
        let real = Sources::new(&self.tree, support, channels, Reach::Either).with_vector();
        let Some(ghosts) = &self.ghosts else {
            return pass(&[real]);
        };
        let inherited: [Vec<f64>; C] = std::array::from_fn(|c| {
            ghosts
                .images
                .parents
                .iter()
                .enumerate()
                .map(|(g, &p)| match c {
                    c if c < D => ghosts.reflected(g, std::array::from_fn(|k| channels[k][p as usize]))[c],
                    _ => channels[c][p as usize],
                })
                .collect()
        });
        let ghost_support = ghosts.images.inherit(support, 0.0);
        let others =
            Sources::new(&ghosts.images.tree, &ghost_support, inherited.each_ref().map(Vec::as_slice), Reach::Either);
        pass(&[real, others])
    }
}
