//! Deviations from the reference, as large as the design admits.

use crate::node::Node;
use crate::random::Random;

/// Halvings of the interval in which the edge of what is feasible lies: to 1e-12 of the deviation.
const HALVINGS: usize = 40;

/// A state of `node`'s two tanks in a random direction from its present reference. `share` of 1 is the last state in
/// that direction from which the i-DPC problem is feasible, up to the accuracy of the bisection; 0 the reference.
pub fn admitted_state(node: &mut dyn Node, random: &mut Random, share: f64) -> [f64; 2] {
    let centre = node.probe(&[0.0; 2]).telemetry.x_ref;
    let direction: [f64; 2] = random.direction();
    let at = |distance: f64| [0, 1].map(|k| centre[k] + distance * direction[k]);
    let admitted = |distance: f64| node.probe(&at(distance)).control.is_admissible();
    at(share * edge(admitted))
}

/// The largest distance that is admitted; 0 is, and what lies between admitted distances is too.
fn edge(mut admitted: impl FnMut(f64) -> bool) -> f64 {
    let mut outside = 1e-3;
    while admitted(outside) {
        outside *= 2.0;
    }
    let mut inside = 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        if admitted(middle) { inside = middle } else { outside = middle }
    }
    inside
}
