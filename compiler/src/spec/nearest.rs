//! "Did you mean ...?"

/// The candidate a person may have meant by `written`: at most a third of its letters away, the first of the nearest.
pub(crate) fn did_you_mean<'a>(written: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (written.chars().count() / 3).max(1);
    let near = candidates.into_iter().map(|known| (distance(written, known), known));
    // A lone letter is one edit away from every other lone letter: only its case can be a slip.
    let likely = near.filter(|(d, known)| *d <= limit && (known.len() > 1 || *d == 0));
    likely.min_by_key(|(d, _)| *d).map(|(_, known)| known)
}

/// Edits (Levenshtein) from one name to the other, blind to case.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.to_lowercase().chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.to_lowercase().chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::{did_you_mean, distance};

    #[test]
    fn distance_counts_edits() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("Horizon", "horizon"), 0);
        assert_eq!(distance("", "abc"), 3);
    }

    #[test]
    fn near_names_are_found_and_far_ones_are_not() {
        assert_eq!(did_you_mean("sample_time", ["name", "sample-time"]), Some("sample-time"));
        assert_eq!(did_you_mean("a", ["A", "B"]), Some("A"));
        assert_eq!(did_you_mean("z", ["A", "B"]), None);
        assert_eq!(did_you_mean("colour", ["name", "horizon"]), None);
    }
}
