//! Detects bodies that overlap, and points within others.

use super::assembly::{Body, Frame, State, length};
use crate::error::{Error, Result};

/// Particles of two bodies that are nearer than this many spacings are in each other's way.
const NEAREST: f64 = 0.5;
/// Part of the box's edge that is no distance, and of a speed that is no motion.
const ROUNDING: f64 = 1e-9;
/// Of a body's radius: a point nearer to its center is its core.
const CENTERED: f64 = 0.05;

/// Refuses bodies that are in each other's way, or in that of an image in a periodic box (`frame`): collisionless ones never are.
///
/// # Errors
/// The first pair that is, with how near they are.
pub fn refuse_overlap(bodies: &[Body], states: &[State], frame: Option<&Frame>) -> Result<()> {
    for (i, a) in bodies.iter().enumerate().filter(|(_, a)| !a.is_collisionless) {
        for (j, b) in bodies.iter().enumerate().skip(i).filter(|(_, b)| !b.is_collisionless) {
            let direct: [f64; 3] = sph::array(|k| states[j].position[k] - states[i].position[k]);
            for way in ways(direct, frame) {
                let apart = length(way);
                if apart >= a.radius + b.radius || i == j && way == [0.0; 3] {
                    continue;
                }
                let there = State { position: sph::array(|k| states[i].position[k] + way[k]), ..states[j] };
                if let Some(near) = nearest_pair((a, &states[i]), (b, &there)) {
                    let other = if i == j { "its own image" } else { b.title.as_str() };
                    let (across, remedy) = match way == direct {
                        true => ("", "move them apart"),
                        false => (" across the periodic box", "move them apart or make domain.box larger"),
                    };
                    let problem = format!(
                        "and {other} overlap{across}: their centers are {apart:.6e} apart and their radii {:.6e} and {:.6e}, with \
                         particles at {near:.2} spacings from each other; {remedy}",
                        a.radius, b.radius
                    );
                    return Err(Error::scene(format!("bodies[{}]", a.title), problem));
                }
            }
        }
    }
    Ok(())
}

/// Refuses bodies whose center is out of a periodic box, where another place is meant than that which its images come to.
///
/// # Errors
/// The first of them.
pub fn refuse_out_of_box(bodies: &[Body], states: &[State], frame: Option<&Frame>) -> Result<()> {
    let Some(frame) = frame else { return Ok(()) };
    for (body, state) in bodies.iter().zip(states) {
        for k in (0..3).filter(|&k| frame.periodic[k]) {
            let (at, lo, hi) = (state.position[k], frame.lo[k], frame.lo[k] + frame.edges[k]);
            if !(lo - ROUNDING * frame.edges[k]..=hi + ROUNDING * frame.edges[k]).contains(&at) {
                let problem = format!(
                    "has its center at {at:.6e} on axis {k}, out of the periodic box from {lo:.6e} to {hi:.6e}; give a place within it, or make \
                     domain.box larger"
                );
                return Err(Error::scene(format!("bodies[{}]", body.title), problem));
            }
        }
    }
    Ok(())
}

/// Particles other than gas that a periodic box has no room for: what is beyond one face comes in at the other.
pub fn folded(bodies: &[Body], states: &[State], frame: Option<&Frame>) -> Vec<String> {
    let Some(frame) = frame else { return Vec::new() };
    let told = |(body, state): (&Body, &State)| {
        let places: Vec<[f64; 3]> = body.moved(state).into_iter().map(|p| p.0).collect();
        let [lo, hi] = reach(&places.iter().map(|x| (*x, 0.0)).collect::<Vec<_>>(), 0.0);
        let is_wide = (0..3).any(|k| frame.periodic[k] && hi[k] - lo[k] > frame.edges[k]);
        let is_beyond = |x: &&[f64; 3]| {
            (0..3).any(|k| frame.periodic[k] && !(0.0..=frame.edges[k]).contains(&(x[k] - frame.lo[k])))
        };
        is_wide.then(|| {
            format!(
                "body {} is wider than the periodic box: {} of its {} particles are beyond a face, and come in at the other; make domain.box larger, or its \
                 boundary open",
                body.title,
                places.iter().filter(is_beyond).count(),
                places.len()
            )
        })
    };
    bodies.iter().zip(states).filter_map(told).collect()
}

/// Refuses point masses at one place, where no distance is left between them.
///
/// # Errors
/// The first two.
pub fn refuse_coincident_points(bodies: &[Body], states: &[State]) -> Result<()> {
    let points: Vec<usize> = (0..bodies.len()).filter(|&i| !bodies[i].is_gas() && bodies[i].radius == 0.0).collect();
    for (k, &i) in points.iter().enumerate() {
        if let Some(&j) = points[..k].iter().find(|&&j| states[i].position == states[j].position) {
            let problem = format!("and {} are points at one place; state their positions", bodies[i].title);
            return Err(Error::scene(format!("bodies[{}]", bodies[j].title), problem));
        }
    }
    Ok(())
}

/// Bodies about one center that part from each other at once.
pub fn parting(bodies: &[Body], states: &[State]) -> Vec<String> {
    let mut told = Vec::new();
    for (i, (a, of_a)) in bodies.iter().zip(states).enumerate() {
        for (b, of_b) in bodies.iter().zip(states).skip(i + 1).filter(|(_, of_b)| of_b.position == of_a.position) {
            let apart = length(sph::array(|k| of_b.velocity[k] - of_a.velocity[k]));
            if apart > ROUNDING * length(of_a.velocity).max(length(of_b.velocity)) {
                told.push(format!(
                    "bodies {} and {} are at one place, but move against each other at {apart:.4e}, so that they are not in equilibrium with each other; \
                     state the same `velocity` for both",
                    a.title, b.title
                ));
            }
        }
    }
    told
}

/// Points that lie within gas, but not in the middle of it, which nothing holds there.
pub fn points_within(bodies: &[Body], states: &[State]) -> Vec<String> {
    let mut told = Vec::new();
    for (i, point) in bodies.iter().enumerate().filter(|(_, b)| !b.is_gas() && b.radius == 0.0) {
        for (j, body) in bodies.iter().enumerate().filter(|(_, b)| b.is_gas()) {
            let apart = length(sph::array(|k| states[i].position[k] - states[j].position[k]));
            if apart > CENTERED * body.radius && apart < body.radius {
                let [point, body] = [&point.title, &body.title];
                told.push(format!(
                    "the point mass {point} is within body {body}, {apart:.6e} from its center, and the gas about it is not in balance with it"
                ));
            }
        }
    }
    told
}

/// The way from one place to another that is `direct`ly that far, and those to its nearest images in a periodic box.
fn ways(direct: [f64; 3], frame: Option<&Frame>) -> Vec<[f64; 3]> {
    let mut ways = vec![direct];
    let Some(frame) = frame else { return ways };
    for k in (0..3).filter(|&k| frame.periodic[k]) {
        let edge = frame.edges[k];
        let turns = (direct[k] / edge).round();
        let along = [turns, turns - 1.0, turns + 1.0].map(|n| direct[k] - n * edge);
        ways = ways.iter().flat_map(|way| along.map(|v| sph::array(|c| if c == k { v } else { way[c] }))).collect();
    }
    ways
}

/// The smallest distance of particles of two bodies in units of their spacing, where it is too small. Sorted by x, only
/// particles within a spacing along it are looked at, of those that lie where both bodies reach.
fn nearest_pair(a: (&Body, &State), b: (&Body, &State)) -> Option<f64> {
    let listed = |(body, state): (&Body, &State)| -> Vec<([f64; 3], f64)> {
        body.moved(state).into_iter().map(|p| p.0).zip(body.spacings()).collect()
    };
    let (mut a, mut b) = (listed(a), listed(b));
    // Nearer than half of the smaller spacing of two is nearer than half of the largest here.
    let window = NEAREST * b.iter().map(|p| p.1).fold(0.0, f64::max);
    let (of_a, of_b) = (reach(&a, window), reach(&b, window));
    let is_within = |x: &[f64; 3], [lo, hi]: &[[f64; 3]; 2]| (0..3).all(|k| lo[k] <= x[k] && x[k] <= hi[k]);
    a.retain(|p| is_within(&p.0, &of_b));
    b.retain(|p| is_within(&p.0, &of_a));
    a.sort_by(|p, q| p.0[0].total_cmp(&q.0[0]));
    b.sort_by(|p, q| p.0[0].total_cmp(&q.0[0]));
    let mut first = 0;
    for (x, spacing) in &a {
        while first < b.len() && b[first].0[0] < x[0] - window {
            first += 1;
        }
        for (y, other) in b[first..].iter().take_while(|p| p.0[0] <= x[0] + window) {
            let distance = length(sph::array(|k| y[k] - x[k]));
            let common = spacing.min(*other);
            if distance < NEAREST * common {
                return Some(distance / common);
            }
        }
    }
    None
}

/// The box about all of `places`, wider by `margin` on each side.
fn reach(places: &[([f64; 3], f64)], margin: f64) -> [[f64; 3]; 2] {
    let along = |k: usize| places.iter().map(move |p| p.0[k]);
    [
        sph::array(|k| along(k).fold(f64::INFINITY, f64::min) - margin),
        sph::array(|k| along(k).fold(f64::NEG_INFINITY, f64::max) + margin),
    ]
}
