//! The layout of an HDF5 file with GADGET's groups. The readers here accept more layouts than any code does, and map them to one meaning; a code
//! opens a dataset by its exact name, and relies on its length.

/// One file as it was written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    /// Attributes of the header with their numbers; none of texts.
    pub header: Vec<(String, Vec<f64>)>,
    /// The same of the group of units; `None` where there is no such group.
    pub units: Option<Vec<(String, Vec<f64>)>>,
    pub datasets: Vec<Dataset>,
    /// Support radii over the numbers of the file's smoothing lengths, where the file or its author says what these are.
    pub support_over_length: Option<f64>,
    /// Version of the container's superblock, by which old libraries know what is too new for them.
    pub superblock: Option<u8>,
}

/// A column of particles as the file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    pub part_type: u8,
    /// In the file.
    pub name: String,
    /// The name by which codes ask for such numbers in initial conditions.
    pub meaning: String,
    /// Rows and, of more than one component, columns.
    pub shape: Vec<u64>,
}

impl Layout {
    /// The numbers of an attribute of the header.
    pub fn of_header(&self, name: &str) -> Option<&[f64]> {
        self.header.iter().find(|(key, _)| key == name).map(|(_, numbers)| numbers.as_slice())
    }
}
