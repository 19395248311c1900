//! The names of columns, by which a file is recognized.

pub const NAME: &str = "kepler";

/// Columns that every header names.
const NAMES: [&str; 2] = ["cell outer radius", "cell density"];

/// Whether a text has the line that names the columns, above the cells.
pub fn is_model(text: &str) -> bool {
    text.lines().take_while(|line| !is_row(line)).any(is_header)
}

/// Whether a line names the columns.
pub fn is_header(line: &str) -> bool {
    NAMES.iter().all(|name| line.contains(name))
}

/// Whether a line is a cell: it begins with its number, and goes on.
pub fn is_row(line: &str) -> bool {
    let mut words = line.split_whitespace();
    let number = words.next().map(|word| word.trim_end_matches(':'));
    number.is_some_and(|n| n.parse::<f64>().is_ok()) && words.next().is_some()
}
