//! Which input moves which output at rest: the relative gains of the network (Bristol, "On a new measure of interaction
//! for multivariable process control", IEEE TAC 11, 1966).

use nalgebra::DMatrix;

use super::Collective;
use crate::network::{Network, Signal};

/// Sentences on outputs that are paired with inputs of negative relative gain: integrating control of such a pair is unstable,
/// or becomes so when another loop stands still, with any gains (Grosdidier, Morari, Holt, 1985).
pub(super) fn wrong_pairs(network: &Network, collective: &Collective) -> Vec<String> {
    let Some(relative) = relative_gains(collective) else { return Vec::new() };
    let mut notes = Vec::new();
    for (i, s) in network.subsystems.iter().enumerate() {
        for (k, output) in s.outputs.iter().enumerate() {
            let row = relative.row(collective.y[i] + k);
            let own = row.columns(collective.u[i], s.m()).sum();
            let best = (0..row.len()).max_by(|&a, &b| row[a].total_cmp(&row[b]));
            if let (true, Some(best)) = (own < -SIGNIFICANT, best) {
                notes.push(wrong_pair(output, &s.inputs, own, input(network, collective, best), row[best]));
            }
        }
    }
    notes
}

/// A relative gain closer to 0 says nothing about signs.
const SIGNIFICANT: f64 = 1e-6;

fn wrong_pair(output: &Signal, inputs: &[Signal], own: f64, better: &str, gain: f64) -> String {
    let output = &output.name;
    let mine: Vec<&str> = inputs.iter().map(|signal| &*signal.name).collect();
    let paired = match &mine[..] {
        [one] => format!("input {one} whose relative gain is {own:.2}"),
        several => format!("inputs {} whose relative gains add up to {own:.2}", several.join(", ")),
    };
    format!("output {output} is paired with {paired}; pair it with {better} (relative gain {gain:.2})")
}

/// The name of entry `column` of the collective u.
fn input<'a>(network: &'a Network, collective: &Collective, column: usize) -> &'a str {
    let owner = collective.u.iter().rposition(|first| *first <= column).unwrap_or(0);
    &network.subsystems[owner].inputs[column - collective.u[owner]].name
}

/// G entrywise times the transposed pseudo-inverse of G, where G = C (I - A)^-1 B, the map from u to y at rest, exists and
/// has full row rank.
fn relative_gains(collective: &Collective) -> Option<DMatrix<f64>> {
    let Collective { A, B, C, .. } = collective;
    let rest = DMatrix::identity(A.nrows(), A.nrows()) - A;
    let states = rest.clone().lu().solve(B)?;
    // An integrator in the plant has no rest.
    let exists = (&rest * &states - B).norm() <= 1e-9 * B.norm() && states.norm() <= 1e9 * (1.0 + B.norm());
    let G = exists.then(|| C * states)?;
    let inverse = G.transpose() * (&G * G.transpose()).try_inverse()?;
    let relative = G.component_mul(&inverse.transpose());
    relative.iter().all(|gain| gain.is_finite()).then_some(relative)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_rest(G: DMatrix<f64>) -> Collective {
        let (p, m) = G.shape();
        Collective {
            A: DMatrix::zeros(p, p),
            B: G,
            C: DMatrix::identity(p, p),
            x: vec![0],
            u: (0..m).collect(),
            y: (0..p).collect(),
        }
    }

    /// Bristol's own example: gains 1, 2; 3, 4 have the relative gain -2 on the diagonal.
    #[test]
    fn two_by_two_has_the_closed_form() {
        let relative = relative_gains(&at_rest(DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 3.0, 4.0]))).unwrap();
        let expected = DMatrix::from_row_slice(2, 2, &[-2.0, 3.0, 3.0, -2.0]);
        assert!((relative - expected).amax() < 1e-12);
    }

    #[test]
    fn rows_add_up_to_one_also_with_spare_inputs() {
        let relative =
            relative_gains(&at_rest(DMatrix::from_row_slice(2, 3, &[1.0, 2.0, -0.5, 3.0, 4.0, 0.7]))).unwrap();
        assert!(relative.row_iter().all(|row| (row.sum() - 1.0).abs() < 1e-12));
    }

    #[test]
    fn an_integrator_has_no_rest() {
        let mut collective = at_rest(DMatrix::identity(2, 2));
        collective.A = DMatrix::identity(2, 2);
        assert!(relative_gains(&collective).is_none());
    }
}
