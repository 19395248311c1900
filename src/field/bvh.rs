//! Bounding-box tree: finds the boxes that contain a point, and the nearest item. Unlike a tree of cell centers it stays exact for cells of very
//! different sizes. Built by median splits in O(n log n), depth log2 n.

const LEAF: usize = 4;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Aabb<const D: usize> {
    pub(crate) lo: [f64; D],
    pub(crate) hi: [f64; D],
}

impl<const D: usize> Aabb<D> {
    pub(crate) const EMPTY: Self = Self { lo: [f64::INFINITY; D], hi: [f64::NEG_INFINITY; D] };

    pub(crate) fn around<'a>(points: impl IntoIterator<Item = &'a [f64; D]>) -> Self {
        let mut b = Self::EMPTY;
        for p in points {
            for k in 0..D {
                b.lo[k] = b.lo[k].min(p[k]);
                b.hi[k] = b.hi[k].max(p[k]);
            }
        }
        b
    }

    fn join(&mut self, other: &Self) {
        for k in 0..D {
            self.lo[k] = self.lo[k].min(other.lo[k]);
            self.hi[k] = self.hi[k].max(other.hi[k]);
        }
    }

    /// Grown by `margin` on all sides.
    pub(crate) fn grown(mut self, margin: f64) -> Self {
        for k in 0..D {
            self.lo[k] -= margin;
            self.hi[k] += margin;
        }
        self
    }

    pub(crate) fn diagonal(&self) -> f64 {
        (0..D).map(|k| (self.hi[k] - self.lo[k]).powi(2)).sum::<f64>().sqrt()
    }

    /// The largest coordinate, or the diagonal where that is larger.
    pub(crate) fn reach(&self) -> f64 {
        self.lo.iter().chain(&self.hi).fold(self.diagonal(), |most, v| most.max(v.abs()))
    }

    /// The axis along which it is longest.
    pub(crate) fn longest(&self) -> usize {
        let edge = |k: usize| self.hi[k] - self.lo[k];
        (0..D).fold(0, |best, k| if edge(k) > edge(best) { k } else { best })
    }

    pub(crate) fn contains(&self, x: &[f64; D]) -> bool {
        (0..D).all(|k| x[k] >= self.lo[k] && x[k] <= self.hi[k])
    }

    pub(crate) fn distance_squared(&self, x: &[f64; D]) -> f64 {
        (0..D).map(|k| (self.lo[k] - x[k]).max(x[k] - self.hi[k]).max(0.0).powi(2)).sum()
    }
}

#[derive(Debug, Clone, Copy)]
struct Node<const D: usize> {
    bounds: Aabb<D>,
    /// Leaf: first item; inner: the right child (the left one follows its parent).
    first: u32,
    /// Items of a leaf, 0 for an inner node.
    count: u32,
}

#[derive(Debug)]
pub(crate) struct Bvh<const D: usize> {
    nodes: Vec<Node<D>>,
    items: Vec<u32>,
}

impl<const D: usize> Bvh<D> {
    /// Over `items`, whose boxes `bounds` tells.
    pub(crate) fn new(mut items: Vec<u32>, bounds: &dyn Fn(u32) -> Aabb<D>) -> Self {
        let boxes: Vec<(u32, Aabb<D>)> = items.drain(..).map(|i| (i, bounds(i))).collect();
        let mut tree = Self { nodes: Vec::with_capacity(boxes.len()), items: Vec::with_capacity(boxes.len()) };
        let mut boxes = boxes;
        if !boxes.is_empty() {
            tree.build(&mut boxes);
        }
        tree
    }

    fn build(&mut self, boxes: &mut [(u32, Aabb<D>)]) {
        let mut bounds = Aabb::EMPTY;
        let mut centers = Aabb::EMPTY;
        for (_, b) in boxes.iter() {
            bounds.join(b);
            let c: [f64; D] = sph::array(|k| 0.5 * (b.lo[k] + b.hi[k]));
            centers.join(&Aabb { lo: c, hi: c });
        }
        let here = self.nodes.len();
        if boxes.len() <= LEAF {
            let first = self.items.len() as u32;
            self.items.extend(boxes.iter().map(|b| b.0));
            self.nodes.push(Node { bounds, first, count: boxes.len() as u32 });
            return;
        }
        self.nodes.push(Node { bounds, first: 0, count: 0 });
        let mut axis = 0;
        for k in 1..D {
            if centers.hi[k] - centers.lo[k] > centers.hi[axis] - centers.lo[axis] {
                axis = k;
            }
        }
        let half = boxes.len() / 2;
        // The item number breaks ties, so that the tree does not depend on the order of a partial sort.
        boxes.select_nth_unstable_by(half, |(i, a), (j, b)| {
            (a.lo[axis] + a.hi[axis]).total_cmp(&(b.lo[axis] + b.hi[axis])).then(i.cmp(j))
        });
        let (left, right) = boxes.split_at_mut(half);
        self.build(left);
        self.nodes[here].first = self.nodes.len() as u32;
        self.build(right);
    }

    /// A value for each node: from the items of a leaf, and from the values of both children of the others.
    pub(crate) fn fold<M>(&self, leaf: impl Fn(&[u32]) -> M, join: impl Fn(&M, &M) -> M) -> Vec<M> {
        // Children come after their parents.
        let mut reversed: Vec<M> = Vec::with_capacity(self.nodes.len());
        let last = self.nodes.len().wrapping_sub(1);
        for (at, node) in self.nodes.iter().enumerate().rev() {
            let value = match node.count {
                0 => join(&reversed[last - at - 1], &reversed[last - node.first as usize]),
                _ => leaf(&self.items[node.first as usize..(node.first + node.count) as usize]),
            };
            reversed.push(value);
        }
        reversed.reverse();
        reversed
    }

    /// Goes down from the root: `enter` says of a node, by its number and box, whether its items are of interest, which
    /// `visit` then gets.
    pub(crate) fn walk(&self, mut enter: impl FnMut(usize, &Aabb<D>) -> bool, mut visit: impl FnMut(u32)) {
        let mut stack = [0_u32; 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let at = stack[depth] as usize;
            let node = &self.nodes[at];
            if !enter(at, &node.bounds) {
                continue;
            }
            if node.count > 0 {
                let items = &self.items[node.first as usize..(node.first + node.count) as usize];
                items.iter().for_each(|&item| visit(item));
            } else {
                stack[depth] = node.first;
                stack[depth + 1] = at as u32 + 1;
                depth += 2;
            }
        }
    }

    /// Calls `visit` with the items whose boxes hold `x`, until it returns a value.
    pub(crate) fn find<T>(&self, x: &[f64; D], mut visit: impl FnMut(u32) -> Option<T>) -> Option<T> {
        let mut stack = [0_u32; 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let at = stack[depth] as usize;
            let node = &self.nodes[at];
            if !node.bounds.contains(x) {
                continue;
            }
            if node.count > 0 {
                for &item in &self.items[node.first as usize..(node.first + node.count) as usize] {
                    if let Some(found) = visit(item) {
                        return Some(found);
                    }
                }
            } else {
                stack[depth] = node.first;
                stack[depth + 1] = at as u32 + 1;
                depth += 2;
            }
        }
        None
    }

    /// The item for which `distance_squared` is smallest, given that no item is nearer than its box; none where that is not below `limit`.
    pub(crate) fn nearest_below(
        &self,
        x: &[f64; D],
        limit: f64,
        distance_squared: impl FnMut(u32) -> f64,
    ) -> Option<u32> {
        self.nearest_by(|_, bounds, _| bounds.distance_squared(x), limit, distance_squared)
    }

    /// The same with what bounds the items of a node from below, by its number, its box and the smallest that is known.
    pub(crate) fn nearest_by(
        &self,
        bound: impl Fn(usize, &Aabb<D>, f64) -> f64,
        limit: f64,
        mut distance_squared: impl FnMut(u32) -> f64,
    ) -> Option<u32> {
        let mut best = (limit, None);
        let root = self.nodes.first()?;
        let mut stack = vec![(0_u32, bound(0, &root.bounds, limit))];
        while let Some((at, least)) = stack.pop() {
            if least >= best.0 {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for &item in &self.items[node.first as usize..(node.first + node.count) as usize] {
                    let d = distance_squared(item);
                    if d < best.0 {
                        best = (d, Some(item));
                    }
                }
            } else {
                let children =
                    [at + 1, node.first].map(|c| (c, bound(c as usize, &self.nodes[c as usize].bounds, best.0)));
                let [near, far] = if children[0].1 <= children[1].1 { children } else { [children[1], children[0]] };
                stack.push(far);
                stack.push(near);
            }
        }
        best.1
    }

    /// The box around all items.
    pub(crate) fn bounds(&self) -> Option<&Aabb<D>> {
        self.nodes.first().map(|node| &node.bounds)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;

    #[test]
    fn searches_agree_with_all_pairs() {
        let mut random = Random::new(3);
        let boxes: Vec<Aabb<2>> = (0..300)
            .map(|i| {
                let lo: [f64; 2] = random.point();
                let size = if i % 50 == 0 { 0.6 } else { 0.02 };
                Aabb { lo, hi: lo.map(|v| v + size * random.unit()) }
            })
            .collect();
        let tree = Bvh::new((0..300).collect(), &|i| boxes[i as usize]);
        for _ in 0..300 {
            let x = random.point();
            let mut found = Vec::new();
            tree.find(&x, |i| {
                if boxes[i as usize].contains(&x) {
                    found.push(i);
                }
                None::<()>
            });
            found.sort_unstable();
            let expected: Vec<u32> = (0..300).filter(|&i| boxes[i as usize].contains(&x)).collect();
            assert_eq!(found, expected);
            let d = |i: u32| boxes[i as usize].distance_squared(&x);
            let nearest = tree.nearest_below(&x, f64::INFINITY, d).unwrap();
            assert_eq!(d(nearest), (0..300).map(d).fold(f64::INFINITY, f64::min));
        }
    }

    #[test]
    fn identical_boxes_and_none_at_all_are_no_problem() {
        let b = Aabb { lo: [0.0], hi: [1.0] };
        let tree = Bvh::new((0..1000).collect(), &|_| b);
        assert!(tree.find(&[0.5], Some).is_some());
        let empty = Bvh::<1>::new(vec![], &|_| b);
        assert!(empty.nearest_below(&[0.0], f64::INFINITY, |_| 0.0).is_none());
    }
}
