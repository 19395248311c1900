//! A target divided into cells, with smaller cells where more mass is.

use super::cells::{Cell, Rule};
use super::matter::{Matter, Within};
use crate::error::{Error, Result};
use sph::parallel;

/// How closely a target is looked at.
#[derive(Debug, Clone, Copy)]
struct Effort {
    /// Cells of the first, uniform division.
    first: usize,
    /// Cells after refinement, at most.
    most: usize,
    /// Whether what the bounds of the density say counts, too, where nothing has been seen of it.
    by_bounds: bool,
}

impl Effort {
    /// What does for most: where nothing jumps, few particles do with few cells. How regions are connected a few say as well: lines find what they
    /// miss of thin ones.
    fn usual<const D: usize>(target: &dyn Matter<D>, rule: Rule) -> Self {
        let most = match D {
            1 => 1 << 10,
            2 => 1 << 14,
            _ => 1 << 15,
        };
        let (per_particle, fewer) = match (target.may_jump(), target.is_cut()) {
            (false, _) => (CELLS_PER_PARTICLE, FEWER),
            (true, true) => (CELLS_PER_PARTICLE_OF_PART, FEWER),
            (true, false) => (most, 0),
        };
        let first = per_particle.saturating_mul(target.count()).clamp(most >> fewer, most);
        let most = if is_outline(target, rule) { OUTLINE_CELLS } else { MAX_CELLS };
        let most = (CELLS_PER_PARTICLE * target.count()).clamp(FEW_CELLS, most);
        Self { first, most, by_bounds: false }
    }

    /// A first look at a part that has few particles: lines say where most surfaces are. None where it has many.
    fn little<const D: usize>(self, target: &dyn Matter<D>, rule: Rule) -> Option<Self> {
        let first = self.first.min((LITTLE * target.count()).max(self.first >> FEWER));
        let most = self.most.min((LITTLE_AT_MOST * target.count()).max(self.most >> FEWER));
        let is_part = target.is_cut() && target.may_jump() && rule != Rule::Midpoint;
        (is_part && first < self.first).then_some(Self { first, most, ..self })
    }
}

/// Whether cells are to say where surfaces are, and not how much mass there is.
fn is_outline<const D: usize>(target: &dyn Matter<D>, rule: Rule) -> bool {
    rule == Rule::Midpoint && target.may_jump()
}

/// Cells to each particle of a first look at a part, in the first division and at most.
const LITTLE: usize = 16;
const LITTLE_AT_MOST: usize = 128;

/// Halvings of which few particles do without.
const FEWER: usize = 3;

/// Most cells after refinement, for few and for many particles, and for how regions are connected.
const FEW_CELLS: usize = 1 << 16;
const MAX_CELLS: usize = 1 << 18;
const OUTLINE_CELLS: usize = 1 << 17;
/// Cells beyond these, of an outline that hides so many particles in one.
const EXTRA_CELLS: usize = 1 << 13;
const WORTH: f64 = 1.0;
const CELLS_PER_PARTICLE: usize = 32;
const CELLS_PER_PARTICLE_OF_PART: usize = 128;
/// Halvings of a cell, at most: f64 resolves no more.
const MAX_SWEEPS: usize = 120;
/// A cell is refined while midpoint and corner rule differ by more than this fraction ...
const DISAGREEMENT: f64 = 0.3;
/// ... and the larger is above this fraction of the whole.
const NEGLIGIBLE: f64 = 1e-7;

/// The whole domain, refined until no cell hides mass that its midpoint does not show.
///
/// # Errors
/// A target that is zero at the midpoints of all cells.
pub(crate) fn partition<const D: usize>(target: &dyn Matter<D>, rule: Rule) -> Result<Vec<Cell<D>>> {
    let cells = refined(target, rule);
    if cells.iter().map(|c| c.mass).sum::<f64>() > 0.0 {
        return Ok(cells);
    }
    let problem = "the target is zero everywhere in the domain, as far as it was looked at: if it is not, what is there is finer than the cells of the domain; \
                   take a domain that is nearer to it";
    Err(Error::Numeric { stage: "seed", problem: problem.into() })
}

/// Looked at once more by the bounds of the density where the masses of cells do not add up to the whole: places that are looked at may all miss a
/// thin layer, or a narrow peak. The masses of cells that a surface goes through are then found more closely.
fn refined<const D: usize>(target: &dyn Matter<D>, rule: Rule) -> Vec<Cell<D>> {
    let usual = Effort::usual(target, rule);
    let first_look = |effort: Effort| refined_by(target, rule, effort, divided(target, rule, effort.first));
    let off = |cells: &[Cell<D>]| cells.iter().map(|c| c.mass).sum::<f64>() / target.count() as f64 - 1.0;
    let off_by = if target.is_cut() { MISSED_OF_PART.max(PARTICLE / target.count() as f64) } else { MISSED };
    let little = usual.little(target, rule).map(first_look).filter(|cells| off(cells).abs() <= off_by);
    let mut cells = little.unwrap_or_else(|| first_look(usual));
    // The bounds of a part are those of the field, which may have far more beside it.
    let missed = if target.is_cut() { off(&cells) < -off_by } else { off(&cells).abs() > off_by };
    let (lo, hi) = target.bounds();
    if missed && target.within(&lo, &hi).is_some() {
        let has_room = cells.len() < usual.most / 2;
        let start = if has_room { cells } else { divided(target, rule, usual.first) };
        cells = refined_by(target, rule, Effort { by_bounds: true, ..usual }, start);
    }
    if target.may_jump() && rule != Rule::Midpoint {
        weigh_closely(target, &mut cells);
    }
    cells
}

/// Part of the whole, or of a part of it, that cells may miss, and how much of a particle: parts have a whole number of these.
const MISSED: f64 = 0.01;
const MISSED_OF_PART: f64 = 3e-3;
const PARTICLE: f64 = 0.5;

/// Finds the masses of cells that a surface goes through from parts of them: of the largest, which hold most of what is not known, as many as
/// evaluations allow.
fn weigh_closely<const D: usize>(target: &dyn Matter<D>, cells: &mut [Cell<D>]) {
    let is_crossed = parallel::map(cells.len(), |i| {
        let cell = &cells[i];
        target.mass_within(&cell.lo, &cell.hi).is_none() && cell.is_crossed(target)
    });
    let mut crossed: Vec<usize> = (0..cells.len()).filter(|&i| is_crossed[i]).collect();
    crossed.sort_by(|&i, &j| cells[j].volume().total_cmp(&cells[i].volume()));
    crossed.truncate(MOST_EVALUATIONS >> (D as u32 * (HALVINGS + 1) + 1));
    let masses = parallel::map(crossed.len(), |i| cells[crossed[i]].mass_of_parts(target, HALVINGS));
    crossed.into_iter().zip(masses).for_each(|(i, mass)| cells[i].mass = mass);
}

/// Halvings of a cell along each axis, and evaluations of the density for all of them, about.
const HALVINGS: u32 = 2;
const MOST_EVALUATIONS: usize = 1 << 21;

/// Cells of a uniform division.
fn divided<const D: usize>(target: &dyn Matter<D>, rule: Rule, least: usize) -> Vec<Cell<D>> {
    let (lo, hi) = target.bounds();
    let whole = Cell::new(lo, hi);
    let mut boxes = vec![whole];
    for axis in 0..D {
        for plane in target.planes(axis) {
            boxes = boxes.iter().flat_map(|c| c.cut_at(axis, plane)).collect();
        }
    }
    while boxes.len() < least {
        boxes = boxes.iter().flat_map(|c| c.boxes_along(c.longest())).collect();
    }
    // As many lines as for what a cell has on average.
    let mean = target.count() as f64 / boxes.len() as f64;
    parallel::map(boxes.len(), |i| Cell { mass: mean, ..boxes[i] }.weighed(target, rule))
}

/// The cells, refined.
fn refined_by<const D: usize>(target: &dyn Matter<D>, rule: Rule, effort: Effort, cells: Vec<Cell<D>>) -> Vec<Cell<D>> {
    let floor = NEGLIGIBLE * target.count() as f64;
    let mut pending = cells;
    let mut done = Vec::new();
    let mut extra = if is_outline(target, rule) { EXTRA_CELLS } else { 0 };
    for _ in 0..MAX_SWEEPS {
        let room = effort.most.saturating_sub(done.len() + pending.len());
        if pending.is_empty() || room == 0 && extra == 0 {
            break;
        }
        let looks = parallel::map(pending.len(), |i| match look(&pending[i], target, floor) {
            // What lines cross they see.
            Look { hidden: 0.0, .. } if effort.by_bounds && pending[i].across.is_none() => {
                unseen(&pending[i], target, floor)
            }
            rough => rough,
        });
        let mut hidden: Vec<f64> = looks.iter().map(|look| look.hidden).collect();
        if room > 0 {
            leave_largest(&mut hidden, room);
        } else {
            // What is small and dense takes many halvings, and those of wide surfaces may have left none.
            hidden.iter_mut().filter(|v| **v < WORTH).for_each(|v| *v = 0.0);
            extra -= leave_largest(&mut hidden, extra);
        }
        let halved = parallel::map(pending.len(), |i| {
            let cell = &pending[i];
            (hidden[i] > 0.0).then(|| {
                let axis = looks[i].axis.unwrap_or_else(|| cell.roughest(target, looks[i].changes));
                let known = looks[i].halves.filter(|_| rule == Rule::Gauss && axis == cell.longest());
                known.unwrap_or_else(|| cell.halves_along(axis, target, rule))
            })
        });
        let kept = (0..pending.len()).filter(|&i| halved[i].is_none());
        done.extend(kept.map(|i| Cell { mass: looks[i].mass().unwrap_or(pending[i].mass), ..pending[i] }));
        pending = halved.into_iter().flatten().flatten().collect();
    }
    done.extend(pending);
    done
}

/// Sets all but the `most` largest values to 0; of equal ones the first stay. How many are left.
fn leave_largest(values: &mut [f64], most: usize) -> usize {
    let count = values.iter().filter(|v| **v > 0.0).count();
    if count <= most {
        return count;
    }
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_unstable_by(|&i, &j| values[j].total_cmp(&values[i]).then(i.cmp(&j)));
    order.into_iter().skip(most).for_each(|i| values[i] = 0.0);
    most
}

/// What a look at a cell says.
struct Look<const D: usize> {
    /// The mass that its middle may not show; 0 where it shows enough.
    hidden: f64,
    /// The axis across which it is halved best, where that is known.
    axis: Option<usize>,
    /// The changes of the density on lines through the middle, where these were looked at.
    changes: Option<[f64; D]>,
    /// Its halves across the longest edge with masses by Gauss's rule, where these were looked at.
    halves: Option<[Cell<D>; 2]>,
}

impl<const D: usize> Look<D> {
    fn hiding(hidden: f64) -> Self {
        Self { hidden, axis: None, changes: None, halves: None }
    }

    /// What the halves have, which is known better than the mass of the whole.
    fn mass(&self) -> Option<f64> {
        self.halves.map(|[a, b]| a.mass + b.mass).filter(|both| *both > 0.0)
    }
}

/// A look at its middle, its corners and places between; of a cell that lines cross, at its halves.
fn look<const D: usize>(cell: &Cell<D>, target: &dyn Matter<D>, floor: f64) -> Look<D> {
    let off_by = |mass: f64| {
        let (larger, off) = (mass.max(cell.mass), (mass - cell.mass).abs());
        if larger > floor && off > DISAGREEMENT * larger { off } else { 0.0 }
    };
    if cell.across.is_some() {
        if cell.within.is_some_and(|within| within.most * cell.volume() <= SEEN) {
            return Look::hiding(0.0);
        }
        // Surfaces are seen; there may be more between the lines.
        let halves = cell.halves(target, Rule::Gauss);
        return Look { halves: Some(halves), ..Look::hiding(off_by(halves[0].mass + halves[1].mass)) };
    }
    let inside = cell.corners().filter(|x| target.domain().contains(x));
    let corners: f64 = inside.map(|x| target.number_density(&x)).sum();
    let corner_mass = corners * cell.volume() / (1_usize << D) as f64;
    let off = off_by(corner_mass);
    // A discontinuity may pass between the middle and the corners.
    if off > 0.0 || !target.is_piecewise() || shows_all(cell, target, floor) {
        return Look::hiding(off);
    }
    let changes = cell.hidden_changes(target);
    let change = changes.iter().fold(0.0, |most: f64, c| most.max(*c)) * cell.volume();
    let is_hidden = change > floor && change > DISAGREEMENT * corner_mass.max(cell.mass);
    Look { changes: Some(changes), ..Look::hiding(if is_hidden { change } else { 0.0 }) }
}

/// Whether bounds of the density say that it has no surface and no more than its middle shows, or next to nothing.
fn shows_all<const D: usize>(cell: &Cell<D>, target: &dyn Matter<D>, floor: f64) -> bool {
    let Some(Within { most, is_continuous }) = cell.within.or_else(|| target.within(&cell.lo, &cell.hi)) else {
        return false;
    };
    let most = most * cell.volume();
    most <= floor || most <= UNSEEN * cell.mass && is_continuous
}

/// The mass that there may be where nothing has been seen of it, by the bounds of the density, and the axis across which halves are bounded best;
/// 0 where the bounds are no more than some times what was seen.
fn unseen<const D: usize>(cell: &Cell<D>, target: &dyn Matter<D>, floor: f64) -> Look<D> {
    let bound = |cell: &Cell<D>| target.within(&cell.lo, &cell.hi).map_or(0.0, |within| within.most);
    let (most, volume) = (bound(cell), cell.volume());
    if !(most.is_finite() && most * volume > UNSEEN * cell.mass.max(floor)) {
        return Look::hiding(0.0);
    }
    let halves = |axis: usize| cell.boxes_along(axis).iter().map(bound).sum::<f64>();
    let bounds: [f64; D] = sph::array(halves);
    let least = bounds.iter().fold(f64::INFINITY, |m, b| m.min(*b));
    let edge = |k: usize| if bounds[k] <= least { cell.hi[k] - cell.lo[k] } else { 0.0 };
    let axis = (0..D).fold(0, |best, k| if edge(k) > edge(best) { k } else { best });
    Look { axis: Some(axis), ..Look::hiding(most * volume) }
}

/// Particles in all of a cell with surfaces, at most, up to which the lines that it was weighed by see enough of it.
const SEEN: f64 = 1.0 / 16.0;

/// What the bounds of a density may say over what was seen of it: those of smooth functions are wide, too.
const UNSEEN: f64 = 4.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::ScalarField;
    use crate::target::Target;
    use sph::domain::{Axis, Domain, Region};

    /// A product of steps, each in so many equal cells along its axis, high in every other one.
    struct Steps;
    const CELLS: f64 = 7.0;
    const HIGH: f64 = 1e4;

    impl Steps {
        fn between(&self, a: f64, b: f64) -> f64 {
            let overlap = |i: f64| (b.min((i + 1.0) / CELLS) - a.max(i / CELLS)).max(0.0);
            (0..CELLS as usize).map(|i| overlap(i as f64) * if i % 2 == 1 { HIGH } else { 1.0 }).sum()
        }
    }

    impl<const D: usize> ScalarField<D> for Steps {
        fn value(&self, x: &[f64; D]) -> f64 {
            x.iter().map(|v| if (v * CELLS) as usize % 2 == 1 { HIGH } else { 1.0 }).product()
        }

        fn integral_of_box(&self, lo: &[f64; D], hi: &[f64; D], _: &dyn Fn(u64) -> bool) -> Option<f64> {
            Some((0..D).map(|k| self.between(lo[k], hi[k])).product())
        }
    }

    fn check<const D: usize>() {
        let domain = Domain::new([0.0; D], [1.0; D], [Axis::OPEN; D], Region::Box).unwrap();
        let mass = Steps.between(0.0, 1.0).powi(D as i32);
        let target = Target::of_equal_masses(&domain, &Steps, 1000, mass);
        for rule in [Rule::Midpoint, Rule::Gauss] {
            let cells = partition(&target, rule).unwrap();
            let exact = |c: &Cell<D>| 1000.0 / mass * (0..D).map(|k| Steps.between(c.lo[k], c.hi[k])).product::<f64>();
            assert!(cells.iter().all(|c| (c.mass - exact(c)).abs() < 1e-9 * exact(c).max(1e-6)), "{D}-D {rule:?}");
            let sum: f64 = cells.iter().map(|c| c.mass).sum();
            assert!((sum / 1000.0 - 1.0).abs() < 1e-9, "{D}-D {rule:?}: {sum}");
        }
    }

    #[test]
    fn cells_have_the_masses_that_the_field_knows() {
        check::<1>();
        check::<2>();
        check::<3>();
    }
}
