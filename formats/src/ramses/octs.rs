//! Octs of all files, level by level.

/// Octs of one level with the values of their cells.
#[derive(Debug, Default)]
pub struct Octs {
    /// Place of each along each axis, counted in octs of this level from the lower end of the coarse grid; 0 along axes that there
    /// are not.
    pub first: Vec<[u64; 3]>,
    /// A bit for each cell that holds no finer oct.
    pub leaves: Vec<u8>,
    /// The process that owns it, from 1.
    pub process: Vec<u32>,
    /// For each variable that is read the values of all cells, 2^d for each oct, x fastest.
    pub values: Vec<Vec<f64>>,
}

/// The octs of a file that it owns itself.
#[derive(Debug)]
pub struct Owned {
    /// How many octs of each level (rows) the file has of each process and boundary.
    pub counts: Vec<Vec<usize>>,
}
