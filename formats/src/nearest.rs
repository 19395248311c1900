//! "Did you mean": the known word that is most similar to an unknown one.

/// The candidate that differs from `word` by its case alone, else the one that is fewest typing errors away (insertions,
/// deletions, replacements and swaps of neighbors: Damerau 1964), if these are at most a third of its letters.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = word.to_lowercase();
    let distance = |candidate: &str| strsim::damerau_levenshtein(&lower, &candidate.to_lowercase());
    let all = candidates.into_iter().map(|c| (distance(c), c));
    let (errors, candidate) = all.min_by_key(|(errors, candidate)| (*errors, candidate.len().abs_diff(word.len())))?;
    let letters = word.chars().count().max(candidate.chars().count());
    (errors == 0 || errors * 3 <= letters).then_some(candidate)
}

/// `; did you mean 'NAME'?` for the end of a message, or nothing.
pub fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    nearest(word, candidates).map_or_else(String::new, |c| format!("; did you mean '{c}'?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_slips_are_led_back_and_other_words_are_not() {
        let names = ["swift", "gadget4", "gadget2", "phantom", "au"];
        for (word, found) in [
            ("swfit", Some("swift")),
            ("SWIFT", Some("swift")),
            ("gadget", Some("gadget4")),
            ("phantoms", Some("phantom")),
            ("AU", Some("au")),
            ("ab", None),
            ("arepo", None),
            ("", None),
        ] {
            assert_eq!(nearest(word, names), found, "{word}");
        }
        assert_eq!(nearest("a", []), None);
        assert_eq!(did_you_mean("swfit", names), "; did you mean 'swift'?");
        assert_eq!(did_you_mean("x", names), "");
    }
}
