//! Steps 2 and 3: the shapes of the sets, their invariance multipliers, support sums, and the small gain.
