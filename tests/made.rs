//! When and where a page of results was made.

use std::time::{SystemTime, UNIX_EPOCH};

/// `Made on 2026-11-25 on x86_64 (AMD EPYC, 2 cores) by sph-prep 0.1.0.`
pub fn line() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |t| t.as_secs());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    // Linux alone names its processor in a file.
    let processor = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = processor.lines().find_map(|l| l.strip_prefix("model name")?.split_once(": "));
    let model = model.map_or(String::new(), |(_, name)| format!("{}, ", name.trim()));
    let (day, machine, version) = (date(seconds / 86_400), std::env::consts::ARCH, env!("CARGO_PKG_VERSION"));
    format!("Made on {day} on {machine} ({model}{cores} cores) by sph-prep {version}.\n")
}

/// The Gregorian date so many days after 1970-01-01.
fn date(days: u64) -> String {
    // Counted from 0000-03-01: a leap day is then the last of its year, and 400 years have 146 097 days.
    let (era, day) = ((days + 719_468) / 146_097, (days + 719_468) % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    // Months from March on have 31, 30, 31, 30, 31 days, over and over.
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    format!("{}-{month:02}-{day:02}", 400 * era + year + next)
}

#[test]
fn days_have_their_dates() {
    for (days, expected) in [
        (0, "1970-01-01"),
        (58, "1970-02-28"),
        (59, "1970-03-01"),
        (11_016, "2000-02-29"),
        (19_782, "2024-02-29"),
        (19_783, "2024-03-01"),
        (20_453, "2025-12-31"),
        (20_782, "2026-11-25"),
    ] {
        assert_eq!(date(days), expected);
    }
    assert!(line().starts_with("Made on 20") && line().contains(std::env::consts::ARCH), "{}", line());
}
