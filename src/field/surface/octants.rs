//! Boxes that are known to lie inside or outside of a closed surface; most of space is far from it.

use super::super::bvh::Aabb;

/// Halvings along each axis, at most.
const fn depth(d: usize) -> usize {
    if d == 2 { 9 } else { 6 }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Octant {
    Inside,
    Outside,
    /// The surface may pass through it.
    Mixed,
    /// Number of the first of 2^D parts.
    Divided(u32),
}

/// The tree of boxes.
#[derive(Debug)]
pub(crate) struct Octants<const D: usize> {
    bounds: Aabb<D>,
    nodes: Vec<Octant>,
}

impl<const D: usize> Octants<D> {
    /// `is_clear` says whether nothing of the surface is within a distance of a point, `contains` whether a point is inside.
    pub(crate) fn new(
        bounds: Aabb<D>,
        is_clear: &dyn Fn(&[f64; D], f64) -> bool,
        contains: &dyn Fn(&[f64; D]) -> bool,
    ) -> Self {
        let mut octants = Self { bounds, nodes: vec![Octant::Mixed] };
        let mut open = vec![(0_usize, bounds, 0)];
        while let Some((node, part, level)) = open.pop() {
            let center: [f64; D] = sph::array(|k| 0.5 * (part.lo[k] + part.hi[k]));
            // A little more than half of the diagonal: the distance is rounded.
            if is_clear(&center, 0.5001 * part.diagonal()) {
                octants.nodes[node] = if contains(&center) { Octant::Inside } else { Octant::Outside };
            } else if level < depth(D) {
                let first = octants.nodes.len();
                octants.nodes[node] = Octant::Divided(first as u32);
                for code in 0..1_usize << D {
                    let (mut lo, mut hi) = (part.lo, center);
                    for k in (0..D).filter(|k| code >> k & 1 == 1) {
                        (lo[k], hi[k]) = (center[k], part.hi[k]);
                    }
                    octants.nodes.push(Octant::Mixed);
                    open.push((first + code, Aabb { lo, hi }, level + 1));
                }
            }
        }
        octants
    }

    /// Whether `x` is inside; `None` where the surface is near.
    pub(crate) fn contains(&self, x: &[f64; D]) -> Option<bool> {
        if !self.bounds.contains(x) {
            return Some(false);
        }
        let (mut lo, mut hi, mut node) = (self.bounds.lo, self.bounds.hi, 0);
        loop {
            match self.nodes[node] {
                Octant::Inside => return Some(true),
                Octant::Outside => return Some(false),
                Octant::Mixed => return None,
                Octant::Divided(first) => {
                    let mut code = 0;
                    for k in 0..D {
                        let middle = 0.5 * (lo[k] + hi[k]);
                        if x[k] < middle {
                            hi[k] = middle;
                        } else {
                            lo[k] = middle;
                            code |= 1 << k;
                        }
                    }
                    node = first as usize + code;
                }
            }
        }
    }
}
