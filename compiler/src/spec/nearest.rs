//! "Did you mean ...?"

/// The candidate a person may have meant by `written`: at most a third of its letters away, the first of the nearest.
pub(crate) fn did_you_mean<'a>(written: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (written.chars().count() / 3).max(1);
    let near = candidates.into_iter().map(|known| (distance(written, known), known));
    // A lone letter is one edit away from every other lone letter: only its case can be a slip.
    let likely = near.filter(|(d, known)| *d <= limit && (known.len() > 1 || *d == 0));
    likely.min_by_key(|(d, _)| *d).map(|(_, known)| known)
}

/// Edits from one name to the other, blind to case: letters inserted, left out, replaced, or swapped with the next
/// (optimal string alignment).
fn distance(a: &str, b: &str) -> usize {
    let [a, b] = [a, b].map(|name| name.to_lowercase().chars().collect::<Vec<_>>());
    let mut table = vec![(0..=b.len()).collect::<Vec<_>>()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = table[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            let swap = if swapped { table[i - 2][j - 2] + 1 } else { usize::MAX };
            row.push(replaced.min(row[j - 1] + 1).min(table[i - 1][j] + 1).min(swap));
        }
        table.push(row);
    }
    table[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::{did_you_mean, distance};

    #[test]
    fn distance_counts_edits() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("Horizon", "horizon"), 0);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("nrom", "norm"), 1);
    }

    #[test]
    fn near_names_are_found_and_far_ones_are_not() {
        assert_eq!(did_you_mean("sample_time", ["name", "sample-time"]), Some("sample-time"));
        assert_eq!(did_you_mean("a", ["A", "B"]), Some("A"));
        assert_eq!(did_you_mean("z", ["A", "B"]), None);
        assert_eq!(did_you_mean("colour", ["name", "horizon"]), None);
    }
}
