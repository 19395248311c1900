//! The line that a profile begins with.

pub const NAME: &str = "mesa";

/// Names of which every header has at least one among its first.
pub const HEADER_NAMES: [&str; 5] = ["model_number", "num_zones", "star_age", "initial_mass", "version_number"];

/// Whether a line is `1 2 3 ...`.
pub fn is_numbering(line: &str) -> bool {
    let mut count = 0_u64;
    for field in line.split_whitespace() {
        count += 1;
        if field.parse() != Ok(count) {
            return false;
        }
    }
    count > 1
}
