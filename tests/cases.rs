//! How many of a test's cases are run.

/// The first `few` of them, or all where `SPH_PREP_CASES=all` says so, as it does in `.ci/full`: for cases that take seconds each and
/// seldom fail alone.
pub fn first<T>(few: usize, all: impl IntoIterator<Item = T>) -> impl Iterator<Item = T> {
    let is_all = std::env::var_os("SPH_PREP_CASES").is_some_and(|value| value == "all");
    all.into_iter().take(if is_all { usize::MAX } else { few })
}
