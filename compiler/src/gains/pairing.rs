//! Outputs that are paired with the wrong inputs.
//!
//! Where every subsystem has as many inputs as outputs, the reference system (7) of the network satisfies
//!
//! ```text
//! det(I - calF) = det M  prod det Ke_i,        M = [I - A, -B; C, 0],
//! ```
//!
//! whatever the Kx_i are, and that of subsystem i alone det(I - calF_ii) = det M_i det Ke_i. The determinant of I minus a Schur
//! matrix is positive. So where det M and prod det M_i have different signs, no calK_i at all make both the network and every
//! subsystem alone stable: neither local Riccati equations nor a block-diagonal Lyapunov matrix can. M and M_i are
//! taken in the order (x_1, u_1, x_2, u_2, ...), in which their signs can be compared, and exist for plants with integrators too.
//! (For one input and output each this is Grosdidier, Morari, Holt, "Closed-loop properties from steady-state gain
//! information", 1985.)
//!
//! Which pairs to change is a suggestion only: those of negative relative gain (Bristol, "On a new measure of interaction for
//! multivariable process control", IEEE TAC 11, 1966).

#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::DMatrix;

use super::{Collective, equilibrate};
use crate::network::{Network, Signal, Subsystem};

/// Sentences on wrong pairs, with what proves that there are some; none where nothing does.
pub(super) fn wrong_pairs(network: &Network, collective: &Collective) -> Vec<String> {
    if !contradicts(network, collective) {
        return Vec::new();
    }
    let proof = "outputs are paired with the wrong inputs: no calK_i at all make the references of the network, and of every subsystem alone, stable (det [I - A, -B; C, 0] of the network and those of its subsystems contradict each other in sign)";
    std::iter::once(proof.to_owned()).chain(suggestions(network, collective)).collect()
}

/// Whether no calK_i make the network and every subsystem alone stable: what the notes on wrong pairs rest on.
pub fn is_wrongly_paired(network: &Network) -> bool {
    contradicts(network, &Collective::new(network))
}

/// Whether det M and prod det M_i have different signs for certain.
fn contradicts(network: &Network, collective: &Collective) -> bool {
    let square = network.subsystems.iter().all(|s| s.m() == s.p());
    if !square || collective.A.nrows() > MOST_STATES {
        return false;
    }
    let alone = network.subsystems.iter().map(|s| sign(rosenbrock(&s.A, &s.B, &s.C)));
    let together = sign(rosenbrock(&collective.A, &collective.B, &collective.C));
    let product = alone.fold(together, |product, sign| Some(product? * sign?));
    product.is_some_and(|product| product < 0.0)
}

/// Factors of larger matrices take too long for a note.
const MOST_STATES: usize = 1000;

/// [I - A, -B; C, 0]. In this order, too, signs can be compared: rows and columns of all subsystems' u and y move alike.
fn rosenbrock(A: &DMatrix<f64>, B: &DMatrix<f64>, C: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, m) = B.shape();
    let mut M = DMatrix::zeros(n + C.nrows(), n + m);
    M.view_mut((0, 0), (n, n)).copy_from(&(DMatrix::identity(n, n) - A));
    M.view_mut((0, n), (n, m)).copy_from(&-B);
    M.view_mut((n, 0), C.shape()).copy_from(C);
    M
}

/// Sign of a determinant; `None` where rounding may have decided.
fn sign(mut matrix: DMatrix<f64>) -> Option<f64> {
    // By positive factors only.
    equilibrate(&mut matrix);
    let factors = matrix.full_piv_lu();
    let pivots = factors.u().diagonal();
    let clear = pivots.iter().all(|pivot| pivot.abs() > 1e-9);
    let swaps = factors.p().determinant::<f64>() * factors.q().determinant::<f64>();
    clear.then(|| pivots.iter().fold(swaps, |sign, pivot| sign * pivot.signum()))
}

/// Outputs whose own inputs have a negative relative gain, each with the input of another subsystem that moves it most.
fn suggestions(network: &Network, collective: &Collective) -> Vec<String> {
    let Some(relative) = relative_gains(collective) else { return Vec::new() };
    let mut notes = Vec::new();
    for (i, s) in network.subsystems.iter().enumerate() {
        for (k, output) in s.outputs.iter().enumerate() {
            let row = relative.row(collective.y[i] + k);
            let mine = collective.u[i]..collective.u[i] + s.m();
            let own = row.columns(mine.start, mine.len()).sum();
            let others = (0..row.len()).filter(|column| !mine.contains(column));
            let best = others.max_by(|&a, &b| row[a].total_cmp(&row[b]));
            if let (true, Some(best)) = (own < -SIGNIFICANT, best) {
                notes.push(wrong_pair(output, s, own, &input(network, collective, best), row[best]));
            }
        }
    }
    notes
}

/// A relative gain closer to 0 says nothing about signs.
const SIGNIFICANT: f64 = 1e-6;

fn wrong_pair(output: &Signal, s: &Subsystem, own: f64, better: &str, gain: f64) -> String {
    let (output, owner) = (&output.name, &s.name);
    let mine: Vec<&str> = s.inputs.iter().map(|signal| &*signal.name).collect();
    let paired = match &mine[..] {
        [one] => format!("input {one} whose relative gain is {own:.2}"),
        several => format!("inputs {} whose relative gains add up to {own:.2}", several.join(", ")),
    };
    format!("`{output}` of `{owner}` is paired with {paired}; pair it with {better} (relative gain {gain:.2})")
}

/// Entry `column` of the collective u, with its owner.
fn input(network: &Network, collective: &Collective, column: usize) -> String {
    let owner = collective.u.iter().rposition(|first| *first <= column).unwrap_or(0);
    let s = &network.subsystems[owner];
    format!("`{}` of `{}`", s.inputs[column - collective.u[owner]].name, s.name)
}

/// G entrywise times the transposed pseudo-inverse of G, G = C (I - A)^-1 B the map from u to y at rest, where it has full row
/// rank. With integrators in the plant, which has no rest then, G = C ((1 + slow) I - A)^-1 B.
fn relative_gains(collective: &Collective) -> Option<DMatrix<f64>> {
    let Collective { A, B, C, .. } = collective;
    let states = [0.0, SLOW].into_iter().find_map(|slow| {
        let rest = DMatrix::identity(A.nrows(), A.nrows()) * (1.0 + slow) - A;
        let states = rest.clone().lu().solve(B)?;
        let exists = (&rest * &states - B).norm() <= 1e-9 * B.norm() && states.norm() <= 1e9 * (1.0 + B.norm());
        exists.then_some(states)
    })?;
    let G = C * states;
    let inverse = G.transpose() * (&G * G.transpose()).try_inverse()?;
    let relative = G.component_mul(&inverse.transpose());
    relative.iter().all(|gain| gain.is_finite()).then_some(relative)
}

/// Slow enough for a suggestion, fast enough for its rounding.
const SLOW: f64 = 1e-6;

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

    /// A pure integrator's gains are those of its input matrix.
    #[test]
    fn integrators_have_relative_gains_too() {
        let mut collective = at_rest(DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 3.0, 4.0]));
        collective.A = DMatrix::identity(2, 2);
        let relative = relative_gains(&collective).unwrap();
        assert!((relative - DMatrix::from_row_slice(2, 2, &[-2.0, 3.0, 3.0, -2.0])).amax() < 1e-4);
    }

    #[test]
    fn signs_of_determinants() {
        for (entries, expected) in
            [([1.0, 2.0, 3.0, 4.0], Some(-1.0)), ([4.0, 2.0, 3.0, 1e9], Some(1.0)), ([1.0, 2.0, 2.0, 4.0], None)]
        {
            assert_eq!(sign(DMatrix::from_row_slice(2, 2, &entries)), expected);
        }
    }
}
