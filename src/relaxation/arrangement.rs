//! Particles in a domain with the data that all force computations need: tree, ghosts, sums and their gradients.

use super::interfaces::{Beyond, Interfaces, Missing};
use crate::target::{Positions, Target, at};
use sph::domain::{Domain, Round};
use sph::exchange::{Alone, Exchange};
use sph::kernel::{KernelName, support_over_spacing};
use sph::lanes::Real;
use sph::neighbors::{GhostTree, Halo, Reach, Sees, Sources, Tree};
use sph::parallel;
use sph::sums::{
    Actors, Away, DensitySums, Search, Solved, Vector, away_from_closest, density, largest_support, scatter_gradient,
    solve_support_radii, solve_within_reach,
};
use std::marker::PhantomData;

/// Depth below a curved surface, in support radii, from which particles are mirrored. More than one, since a
/// target at the surface may have a larger radius than the particles below it.
const GHOST_DEPTH: f64 = 1.5;
/// Particles that are moved together.
const BLOCK: usize = 1 << 16;
/// Moves between sortings, where steps are short.
pub(super) const SORT_INTERVAL: usize = 8;

/// Ghosts with the surface that mirrors them.
struct GhostLayer<const D: usize> {
    images: GhostTree<D>,
    round: Option<Round<D>>,
}

impl<const D: usize> GhostLayer<D> {
    fn new(domain: &Domain<D>, positions: &Positions<D>, support: &[f64]) -> Option<Self> {
        let images = GhostTree::mirror(domain, positions, |i| GHOST_DEPTH * support[i])?;
        Some(Self { images, round: domain.region.round() })
    }

    fn len(&self) -> usize {
        self.images.parents.len()
    }

    fn parent(&self, g: usize) -> usize {
        self.images.parents[g] as usize
    }

    /// Unit normal of the mirror between a ghost and its parent, which is where it was mirrored.
    fn normal(&self, g: usize, positions: &Positions<D>) -> [f64; D] {
        let (ghost, parent) = (self.images.tree.position(g), self.parent(g));
        let away: [f64; D] = sph::array(|k| ghost[k] - positions[k][parent]);
        let length = away.iter().map(|a| a * a).sum::<f64>().sqrt();
        sph::array(|k| if length > 0.0 { away[k] / length } else { 0.0 })
    }

    /// Change of the parent's gradient by that of its ghost: the transposed derivative of mirroring, which
    /// turns the normal `n` around and stretches what is tangential.
    fn pull_back(&self, g: usize, n: &[f64; D], gradient: &[f64; D]) -> [f64; D] {
        let along: f64 = (0..D).map(|k| gradient[k] * n[k]).sum();
        let curved = self.round.map_or(0, |round| round.curved());
        let tangential = if curved > 0 { self.images.stretch[g].powf(1.0 / curved as f64) } else { 1.0 };
        let straight = self.round.and_then(|round| round.axis);
        sph::array(|k| {
            let stretch = if straight == Some(k) { 1.0 } else { tangential };
            stretch * (gradient[k] - along * n[k]) - along * n[k]
        })
    }
}

/// A vector as the mirror with normal `n` shows it.
fn reflected<const D: usize>(n: &[f64; D], vector: [f64; D]) -> [f64; D] {
    let along: f64 = (0..D).map(|k| vector[k] * n[k]).sum();
    sph::array(|k| vector[k] - 2.0 * along * n[k])
}

/// Particles, in tree order, under a kernel with N_H neighbors. `R` is the precision of pair distances.
pub(super) struct Arrangement<'a, const D: usize, R> {
    pub kernel: KernelName,
    pub target: Target<'a, D>,
    /// The domain as forces see it: usually [`Domain::mirrored`].
    pub domain: Domain<D>,
    pub kernel_neighbors: f64,
    /// Whether particles may go where the target has nothing.
    pub leaves_target: bool,
    tree: Tree<D>,
    ghosts: Option<GhostLayer<D>>,
    /// Over which ranks the particles are, where these are not all, and whom of other ranks the sums ask for.
    exchange: &'a dyn Exchange,
    sees: Sees,
    /// Those of other ranks that are seen here.
    halo: Option<Halo<D>>,
    moves: usize,
    /// n* at the particles, where the last move has told it.
    target_density: Option<Vec<f64>>,
    /// Of a region that is relaxed by itself.
    interfaces: Option<(Interfaces, Beyond)>,
    /// n* over the number density that support radii stand for. Summed densities are larger than what is there by what
    /// particles count themselves; a medium does not count itself.
    pub medium: f64,
    precision: PhantomData<R>,
}

impl<'a, const D: usize, R: Real> Arrangement<'a, D, R> {
    /// Sorts `positions` into tree order.
    pub fn new(
        kernel: KernelName,
        target: Target<'a, D>,
        domain: Domain<D>,
        positions: Positions<D>,
        kernel_neighbors: f64,
    ) -> Self {
        Self::with_order(kernel, target, domain, positions, kernel_neighbors).0
    }

    /// [`Self::new`] with the particle that each place of the tree order held before.
    pub fn with_order(
        kernel: KernelName,
        target: Target<'a, D>,
        domain: Domain<D>,
        positions: Positions<D>,
        kernel_neighbors: f64,
    ) -> (Self, Vec<u32>) {
        let mut tree = Tree::build(&positions);
        drop(positions);
        let order = tree.take_order();
        (Self::with_tree(kernel, target, domain, tree, 0, kernel_neighbors), order)
    }

    /// Particles that are in tree order already, `moves` after the last sorting.
    pub fn of_sorted(
        kernel: KernelName,
        target: Target<'a, D>,
        domain: Domain<D>,
        positions: Positions<D>,
        moves: usize,
        kernel_neighbors: f64,
    ) -> Self {
        Self::with_tree(kernel, target, domain, Tree::of_sorted(&positions), moves, kernel_neighbors)
    }

    fn with_tree(
        kernel: KernelName,
        target: Target<'a, D>,
        domain: Domain<D>,
        tree: Tree<D>,
        moves: usize,
        kernel_neighbors: f64,
    ) -> Self {
        Self {
            kernel,
            target,
            domain,
            kernel_neighbors,
            leaves_target: false,
            tree,
            ghosts: None,
            exchange: &Alone,
            sees: Sees::Targets,
            halo: None,
            moves,
            target_density: None,
            interfaces: None,
            medium: 1.0,
            precision: PhantomData,
        }
    }

    /// Declares that other ranks have particles of the same arrangement. Those that particles here see are in densities and in
    /// [`Self::with_channels`]; a [`Self::gradient`] asks for `sees` to be [`Sees::Either`].
    pub fn share(&mut self, exchange: &'a dyn Exchange, sees: Sees) {
        (self.exchange, self.sees) = (exchange, sees);
    }

    /// Over which ranks the particles are.
    pub fn exchange(&self) -> &'a dyn Exchange {
        self.exchange
    }

    pub fn tree(&self) -> &Tree<D> {
        &self.tree
    }

    pub fn positions(&self) -> &Positions<D> {
        self.tree.positions()
    }

    /// The positions alone.
    pub fn into_positions(self) -> Positions<D> {
        self.tree.into_positions()
    }

    /// Moves since the last sorting.
    pub fn moves(&self) -> usize {
        self.moves
    }

    /// Support radius over spacing.
    pub fn ratio(&self) -> f64 {
        support_over_spacing(D, self.kernel_neighbors)
    }

    /// Support radii that the target's spacing gives.
    pub fn target_supports(&self) -> Vec<f64> {
        let (ratio, largest) = (self.ratio(), self.domain.size());
        let density = self.target.number_densities(self.positions());
        parallel::map(density.len(), |i| ratio * self.target.spacing(density[i]).min(largest))
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
        self.tree = Tree::build(self.tree.positions());
        let order = self.tree.take_order();
        self.moves = 0;
        self.target_density = None;
        if let Some((interfaces, _)) = &mut self.interfaces {
            interfaces.reorder(&order);
        }
        order
    }

    /// Lets the particles of a region feel a medium that goes on beyond its surfaces, which are `known` or looked for;
    /// `weight` is that of pushes by the distance in support radii. Of no effect for a target without regions.
    pub fn see_interfaces(&mut self, known: Option<Interfaces>, weight: &dyn Fn(f64) -> f64) {
        if self.target.part.is_none_or(|part| !part.is_cut()) {
            return;
        }
        let beyond = Beyond::new::<D>(self.kernel, weight);
        let find = || Interfaces::find(&self.target, &beyond, self.positions(), &self.target_supports());
        self.interfaces = known.or_else(find).map(|found| (found, beyond));
    }

    /// Looks for surfaces anew about particles that have moved far; for how many.
    pub fn refresh_interfaces(&mut self) -> usize {
        let Some((mut interfaces, beyond)) = self.interfaces.take() else { return 0 };
        let changed = interfaces.refresh(&self.target, &beyond, self.positions(), &self.target_supports());
        self.interfaces = Some((interfaces, beyond));
        changed
    }

    /// Lets particles feel no medium beyond the surfaces of their region.
    pub fn forget_interfaces(&mut self) {
        self.interfaces = None;
    }

    /// The surfaces that were found.
    pub fn interfaces(&self) -> Option<&Interfaces> {
        self.interfaces.as_ref().map(|(interfaces, _)| interfaces)
    }

    /// What a particle with this support radius lacks beyond the surfaces of its region, with the number density of the medium
    /// there. `None` where there is no surface.
    pub fn missing(&self, i: usize, support: f64) -> Option<(Missing<D>, f64)> {
        let (interfaces, beyond) = self.interfaces.as_ref()?;
        let medium = self.medium * (self.ratio() / support).powi(D as i32);
        Some((interfaces.missing(&self.domain, beyond, i, (&at(self.positions(), i), support)), medium))
    }

    /// Puts the particles where they have been.
    pub fn put_back(&mut self, positions: Positions<D>) {
        self.tree.move_particles(|own| *own = positions);
        self.moves += 1;
        self.target_density = None;
    }

    /// Moves all particles to what `place` says of each and of where it is, in blocks, so that hardly anything is held twice; `take` gets what it
    /// says with it, in the particles' order.
    fn move_each<T: Send + Sync>(
        &mut self,
        place: impl Fn(&Self, usize, [f64; D]) -> ([f64; D], T) + Sync,
        mut take: impl FnMut(&[([f64; D], T)]),
    ) {
        // What moves is not what is looked at: the tree is left out meanwhile.
        let mut tree = std::mem::replace(&mut self.tree, Tree::build(&std::array::from_fn(|_| Vec::new())));
        tree.move_particles(|positions| {
            let count = positions[0].len();
            for first in (0..count).step_by(BLOCK) {
                let some = BLOCK.min(count - first);
                let moved = parallel::map(some, |i| place(self, first + i, at(positions, first + i)));
                for (k, axis) in positions.iter_mut().enumerate() {
                    parallel::update(&mut axis[first..first + some], |i, x| *x = moved[i].0[k]);
                }
                take(&moved);
            }
        });
        self.tree = tree;
        self.moves += 1;
        self.target_density = None;
    }

    /// n* at the particles.
    pub fn target_density(&mut self) -> Vec<f64> {
        self.target_density.take().unwrap_or_else(|| self.target.number_densities(self.positions()))
    }

    /// Moves all particles from `from` by `t` times `direction` (in units of `unit`), each by at most
    /// `max_step` of its spacing, and none out of the domain (of forces where they may leave the target's).
    pub fn displace<V: Copy + Into<f64> + Sync>(
        &mut self,
        from: &Positions<D>,
        direction: &[[V; D]],
        t: f64,
        unit: &[f64],
        spacing: &[f64],
        max_step: f64,
    ) {
        let mut densities = Vec::with_capacity(direction.len());
        let place = |own: &Self, i: usize, _: [f64; D]| {
            let (x0, d): (_, [f64; D]) = (at(from, i), direction[i].map(Into::into));
            let length = t * unit[i] / spacing[i] * d.iter().map(|v| v * v).sum::<f64>().sqrt();
            let limited = t * if length > max_step { max_step / length } else { 1.0 };
            let mut x: [f64; D] = sph::array(|k| x0[k] + limited * unit[i] * d[k]);
            let (target, leaves) = (&own.target, own.leaves_target);
            own.domain.confine(&x0, &mut x);
            let inside = target.domain.contains(&x);
            let allowed = (inside || leaves) && target.keeps_region(&x0, &x);
            let mut density = if allowed && inside { target.number_density(&x) } else { 0.0 };
            if !(density > 0.0 || allowed && leaves) {
                x = x0;
                density = target.number_density(&x);
            }
            (x, density)
        };
        self.move_each(place, |moved| densities.extend(moved.iter().map(|(_, density)| *density)));
        self.target_density = Some(densities);
    }

    /// The move of a particle since it was at `from`, in units of `unit`.
    pub fn step(&self, i: usize, from: &Positions<D>, unit: &[f64]) -> [f64; D] {
        self.domain.displacement(&at(from, i), &at(self.positions(), i)).map(|step| step / unit[i])
    }

    /// Moves each particle to where `step` says, with the length of the step in spacings, unless the target has no place for
    /// it there. Returns the largest length.
    pub fn shift(&mut self, step: impl Fn(usize, [f64; D]) -> ([f64; D], f64) + Sync) -> f64 {
        let mut largest = f64::NEG_INFINITY;
        let place = |own: &Self, i: usize, from: [f64; D]| {
            let (mut x, length) = step(i, from);
            own.domain.confine(&from, &mut x);
            if own.target.admits(&x) && own.target.keeps_region(&from, &x) { (x, length) } else { (from, 0.0) }
        };
        self.move_each(place, |moved| largest = moved.iter().fold(largest, |most, (_, length)| most.max(*length)));
        largest
    }

    /// Puts each particle where `x` says, which is in the domain.
    pub fn place(&mut self, x: impl Fn(usize) -> [f64; D] + Sync) {
        self.move_each(|_, i, _| (x(i), ()), |_| ());
    }

    /// Mirrors particles at curved surfaces, and looks for those of other ranks, for the sums to come; `support` are the radii
    /// to be covered.
    pub fn mirror(&mut self, support: &[f64]) {
        self.ghosts = GhostLayer::new(&self.domain, self.positions(), support);
        self.halo = (!self.exchange.is_alone()).then(|| {
            let ghosts = self.ghosts.as_ref().map(|g| &g.images.tree);
            Halo::new(self.exchange, &self.domain, (&self.tree, support), ghosts, self.sees)
        });
    }

    /// Number density sums at given support radii, with what lies beyond the surfaces of a region.
    pub fn densities(&self, support: &[f64]) -> Vec<DensitySums<D>> {
        let mut sums = density::<D, 0, R>(self.kernel, &self.domain, &self.sources(support));
        if self.interfaces.is_some() {
            parallel::update(&mut sums, |i, sums| {
                if let Some((missing, medium)) = self.missing(i, support[i]) {
                    sums.number_density += medium * missing.share;
                    sums.slope += medium * (missing.slope - D as f64 * missing.share);
                    (0..D).for_each(|k| sums.gradient[k] += medium * missing.gradient[k]);
                }
            });
        }
        sums
    }

    /// sum_b w_b W(r_ab, H_a) for weights per particle.
    pub fn weighted(&self, support: &[f64], weights: &[f64]) -> Vec<f64> {
        let sums = self
            .with_channels(support, [weights], [0.0], |sources| density::<D, 1, R>(self.kernel, &self.domain, sources));
        parallel::map(sums.len(), |i| sums[i].weighted)
    }

    /// The direction away from each particle's closest neighbor within `support`, by distance in units of the pair's mean
    /// `spacing`.
    pub fn away_from_closest(&self, support: &[f64], spacing: &[f64]) -> Vec<Away<D>> {
        self.with_channels(support, [spacing], [0.0], |sources| away_from_closest(&self.domain, sources))
    }

    /// Calls `pass` with the sources within each target's `support`, and channels of which ghosts inherit a power of the
    /// ratio of volumes each.
    pub fn with_channels<const C: usize, T>(
        &self,
        support: &[f64],
        channels: [&[f64]; C],
        powers: [f64; C],
        pass: impl Fn(&[Sources<'_, D, C>]) -> T,
    ) -> T {
        let mut all = vec![Sources::new(&self.tree, support, channels, Reach::Target)];
        let ghosts = self.ghosts.as_ref().map(|g| &g.images);
        let inherited: [Vec<f64>; C] =
            std::array::from_fn(|c| ghosts.map_or_else(Vec::new, |g| g.inherit(channels[c], powers[c])));
        let of_ghosts = inherited.each_ref().map(Vec::as_slice);
        all.extend(ghosts.map(|g| Sources::new(&g.tree, &[], of_ghosts, Reach::Target)));
        let seen = self
            .halo
            .as_ref()
            .map(|halo| (&halo.tree, halo.values(self.exchange, sph::array(|c| [channels[c], of_ghosts[c]]))));
        all.extend(
            seen.as_ref().map(|(tree, v)| Sources::new(tree, &[], v.each_ref().map(Vec::as_slice), Reach::Target)),
        );
        pass(&all)
    }

    /// Support radii with n V_d H^d = N_H, and the sums at them.
    pub fn solve(&self, guess: &[f64], search: Search) -> Vec<Solved<D>> {
        let largest = largest_support(&self.domain, self.exchange.count(self.len()), self.kernel_neighbors);
        let sources = self.sources(guess);
        solve_support_radii::<D, 0, R>(self.kernel, &self.domain, &sources, (self.kernel_neighbors, search), largest)
    }

    /// [`Self::solve`] with what other ranks have. All ranks call it together.
    pub fn solve_among(&mut self, guess: &[f64], search: Search) -> Vec<Solved<D>> {
        let exchange = self.exchange;
        if exchange.is_alone() {
            return self.solve(guess, search);
        }
        solve_within_reach(exchange, (guess, self.domain.size()), |reach| {
            self.mirror(reach);
            self.solve(guess, search)
        })
    }

    fn sources<'s>(&'s self, support: &'s [f64]) -> Vec<Sources<'s, D, 0>> {
        let mut sources = vec![Sources::new(&self.tree, support, [], Reach::Target)];
        let others =
            self.ghosts.as_ref().map(|g| &g.images.tree).into_iter().chain(self.halo.as_ref().map(|h| &h.tree));
        sources.extend(others.map(|tree| Sources::new(tree, &[], [], Reach::Target)));
        sources
    }

    /// The derivative of sum_b A_b n_b (A and H held) by each particle's position: what it sees itself, which is `own`
    /// ([`Self::own_gradient`]), and what others see of it and of its ghosts. All ranks call it together.
    pub fn gradient(&self, support: &[f64], strength: &[f64], own: Vec<[f64; D]>) -> Vec<[f64; D]> {
        let theirs = self.halo.as_ref().map(|halo| self.acting_of_others(halo, support, strength));
        let mut acting = vec![Actors { tree: &self.tree, support, strength, silent: false }];
        acting.extend(self.halo.as_ref().zip(theirs.as_ref()).map(|(halo, [support, strength])| Actors {
            tree: &halo.tree,
            support,
            strength,
            silent: false,
        }));
        let seen = scatter_gradient::<D, R>(self.kernel, &self.domain, &acting);
        let mut out = own;
        parallel::update(&mut out, |i, out| (0..D).for_each(|k| out[k] += seen[i].0[k]));
        drop(seen);
        if let Some(ghosts) = &self.ghosts {
            for (g, Vector(seen)) in self.seen_of_ghosts(ghosts, &acting).iter().enumerate() {
                let pulled = ghosts.pull_back(g, &ghosts.normal(g, self.positions()), seen);
                let parent = &mut out[ghosts.parent(g)];
                (0..D).for_each(|k| parent[k] += pulled[k]);
            }
        }
        out
    }

    /// What each particle sees itself of that derivative.
    pub fn own_gradient(strength: &[f64], sums: &[DensitySums<D>]) -> Vec<[f64; D]> {
        parallel::map(sums.len(), |i| sums[i].gradient.map(|g| strength[i] * g))
    }

    /// Support radii and strengths of what other ranks have, of which ghosts see nothing themselves.
    fn acting_of_others(&self, halo: &Halo<D>, support: &[f64], strength: &[f64]) -> [Vec<f64>; 2] {
        let ghosts = self.ghosts.as_ref().map(|g| &g.images);
        let of_ghosts = ghosts.map_or_else(Vec::new, |g| g.inherit(support, 1.0 / D as f64));
        halo.values(self.exchange, [[support, &of_ghosts], [strength, &vec![0.0; of_ghosts.len()]]])
    }

    /// What those that are `acting` see of the ghosts.
    fn seen_of_ghosts(&self, ghosts: &GhostLayer<D>, acting: &[Actors<'_, D>]) -> Vec<Vector<D>> {
        let images = &ghosts.images;
        let support = images.inherit(acting[0].support, 1.0 / D as f64);
        let silence = vec![0.0; support.len()];
        let targets = Actors { tree: &images.tree, support: &support, strength: &silence, silent: true };
        let all: Vec<Actors<'_, D>> = std::iter::once(targets).chain(acting.iter().copied()).collect();
        // Ghosts lie beyond the domain: they are seen where they are, not through the images of walls.
        scatter_gradient::<D, R>(self.kernel, &self.domain, &all)
    }

    /// Calls `pass` with the sources of all pairs within the larger radius of the two; ghosts have the channels of their
    /// parents.
    pub fn with_pairs<const C: usize, T>(
        &self,
        support: &[f64],
        channels: [&[f64]; C],
        powers: [f64; C],
        pass: impl Fn(&[Sources<'_, D, C>]) -> T,
    ) -> T {
        let real = Sources::new(&self.tree, support, channels, Reach::Either);
        let Some(ghosts) = &self.ghosts else { return pass(&[real]) };
        let inherited: [Vec<f64>; C] = std::array::from_fn(|c| ghosts.images.inherit(channels[c], powers[c]));
        let ghost_support = ghosts.images.inherit(support, 1.0 / D as f64);
        let others =
            Sources::new(&ghosts.images.tree, &ghost_support, inherited.each_ref().map(Vec::as_slice), Reach::Either);
        pass(&[real, others])
    }

    /// [`Self::with_pairs`] with the first `D` channels being a vector, which mirrors reflect, and radii that ghosts have
    /// from their parents as they are.
    pub fn with_moving_pairs<const C: usize, T>(
        &self,
        support: &[f64],
        channels: [&[f64]; C],
        pass: impl Fn(&[Sources<'_, D, C>]) -> T,
    ) -> T {
        let real = Sources::new(&self.tree, support, channels, Reach::Either).with_vector();
        let Some(ghosts) = &self.ghosts else { return pass(&[real]) };
        let value = |c: usize, g: usize| {
            let p = ghosts.parent(g);
            if c < D {
                let normal = ghosts.normal(g, self.positions());
                reflected(&normal, sph::array(|k| channels[k][p]))[c]
            } else {
                channels[c][p]
            }
        };
        let inherited: [Vec<f64>; C] = std::array::from_fn(|c| (0..ghosts.len()).map(|g| value(c, g)).collect());
        let ghost_support = ghosts.images.inherit(support, 0.0);
        let others =
            Sources::new(&ghosts.images.tree, &ghost_support, inherited.each_ref().map(Vec::as_slice), Reach::Either);
        pass(&[real, others])
    }
}
