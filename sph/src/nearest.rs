//! The nearest of a set of points, in a tree of `kiddo`, O(log n).
//!
//! The tree is generic and long to compile: what calls it here has no type parameters, so that this crate alone holds the code.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::num::NonZeroUsize;

/// Points in one to three dimensions, in a tree.
pub struct Nearest<const D: usize> {
    tree: AnyTree,
    len: usize,
}

/// Why points cannot be put into a tree.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{count} points in {dimension} dimensions cannot be indexed: {problem}")]
pub struct NearestError {
    pub count: usize,
    pub dimension: usize,
    pub problem: String,
}

enum AnyTree {
    One(ImmutableKdTree<f64, 1>),
    Two(ImmutableKdTree<f64, 2>),
    Three(ImmutableKdTree<f64, 3>),
}

impl<const D: usize> Nearest<D> {
    /// A tree of points with finite coordinates.
    ///
    /// # Errors
    /// No points, more than 2^32 of them, or more than three dimensions.
    pub fn new(points: &[[f64; D]]) -> Result<Self, NearestError> {
        let error = |problem| NearestError { count: points.len(), dimension: D, problem };
        if points.is_empty() {
            return Err(error("there are none".to_owned()));
        }
        let tree = AnyTree::new(points.as_flattened(), D).map_err(error)?;
        Ok(Self { tree, len: points.len() })
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Always false: there is a point at least.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The nearest `n` points to `x`, or all if they are fewer: their numbers and distances, ascending by distance.
    pub fn find(&self, x: &[f64; D], n: usize) -> Vec<(usize, f64)> {
        NonZeroUsize::new(n.min(self.len)).map_or_else(Vec::new, |n| self.tree.find(x, n))
    }

    /// All points no farther from `x` than `reach`, in no order that means anything: their numbers and distances.
    pub fn within(&self, x: &[f64; D], reach: f64) -> Vec<(usize, f64)> {
        if reach >= 0.0 { self.tree.within(x, reach) } else { Vec::new() }
    }

    /// The number of the point that is nearest to `x`, and its distance.
    pub fn one(&self, x: &[f64; D]) -> (usize, f64) {
        self.tree.one(x)
    }
}

/// `x` as an array, of as many numbers as the tree has dimensions.
fn place<const D: usize>(x: &[f64]) -> &[f64; D] {
    match x.first_chunk() {
        Some(x) => x,
        None => unreachable!("a tree is asked for places of its own dimension"),
    }
}

/// The same of a tree of any dimension.
macro_rules! in_dimension {
    ($any:expr, $tree:ident => $found:expr) => {
        match $any {
            Self::One($tree) => $found,
            Self::Two($tree) => $found,
            Self::Three($tree) => $found,
        }
    };
}

/// The numbers and distances that a query finds.
macro_rules! found {
    ($query:expr) => {
        $query.execute().into_iter().map(|found| (found.item as usize, found.distance.sqrt())).collect()
    };
}

impl AnyTree {
    fn new(flat: &[f64], dimension: usize) -> Result<Self, String> {
        match dimension {
            1 => ImmutableKdTree::new_from_slice(flat.as_chunks().0).map(Self::One),
            2 => ImmutableKdTree::new_from_slice(flat.as_chunks().0).map(Self::Two),
            3 => ImmutableKdTree::new_from_slice(flat.as_chunks().0).map(Self::Three),
            _ => return Err("there are trees in one to three dimensions".to_owned()),
        }
        .map_err(|e| e.to_string())
    }

    fn find(&self, x: &[f64], n: NonZeroUsize) -> Vec<(usize, f64)> {
        in_dimension!(self, tree => found!(tree.query(place(x)).nearest_n::<SquaredEuclidean<f64>>(n)))
    }

    fn within(&self, x: &[f64], reach: f64) -> Vec<(usize, f64)> {
        let square = reach * reach;
        in_dimension!(self, tree => found!(tree.query(place(x)).within::<SquaredEuclidean<f64>>(square).unsorted()))
    }

    fn one(&self, x: &[f64]) -> (usize, f64) {
        let found = in_dimension!(self, tree => {
            let found = tree.query(place(x)).nearest_one::<SquaredEuclidean<f64>>().execute();
            (found.item as usize, found.distance)
        });
        (found.0, found.1.sqrt())
    }
}
