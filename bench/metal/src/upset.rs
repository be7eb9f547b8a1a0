//! How far a state may be off its reference.

use crate::scalar::Scalar;

/// Halvings of the interval in which the edge of what is feasible lies.
const HALVINGS: usize = 20;
/// Doublings until one end of it is outside.
const DOUBLINGS: usize = 20;

/// The largest distance found that `admitted` admits; it admits 0 and what lies between admitted distances.
pub fn edge<S: Scalar>(mut admitted: impl FnMut(S) -> bool) -> S {
    let mut outside = S::ratio(1, 10);
    for _ in 0..DOUBLINGS {
        if !admitted(outside) {
            break;
        }
        outside = outside + outside;
    }
    let mut inside = S::default();
    for _ in 0..HALVINGS {
        let middle = S::ratio(1, 1) * (inside + outside);
        if admitted(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

/// `centre` moved along `direction`.
pub fn moved<S: Scalar, const N: usize>(centre: &[S; N], direction: &[S; N], distance: S) -> [S; N] {
    let mut state = *centre;
    state.iter_mut().zip(direction).for_each(|(x, d)| *x = *x + distance * *d);
    state
}
