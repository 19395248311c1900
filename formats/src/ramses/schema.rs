//! Names of files and variables.

pub const NAME: &str = "ramses";

/// Keys with which every info file begins.
const FIRST_KEYS: [&str; 3] = ["ncpu", "ndim", "levelmin"];

/// Whether a text is that of an info file.
pub fn is_info(text: &str) -> bool {
    let mut keys = text.lines().filter_map(|line| Some(line.split_once('=')?.0.trim()));
    FIRST_KEYS.iter().all(|key| keys.next() == Some(key))
}

/// The digits of `info_00001.txt`.
#[cfg(any(feature = "ramses", test))]
pub fn output_number(name: &str) -> Option<&str> {
    let digits = name.strip_prefix("info_")?.strip_suffix(".txt")?;
    (!digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())).then_some(digits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn info_files_are_known_by_name_and_content() {
        assert_eq!(output_number("info_00012.txt"), Some("00012"));
        for name in ["info_.txt", "info_rt_00012.txt", "info_00012", "info_+1.txt"] {
            assert_eq!(output_number(name), None, "{name}");
        }
        assert!(is_info("ncpu        =          2\nndim        =  3\nlevelmin    =  4\n"));
        assert!(!is_info("ncpu = 2\nlevelmin = 4\n") && !is_info("ncpu 2") && !is_info(""));
    }
}
