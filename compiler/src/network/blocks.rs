//! From blocks [A_ij B_ij] to the fewest coupling outputs that carry them.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, RowDVector};

use super::Signal;
use super::model::{Local, neighbour};
use super::roster::{Member, Roster};
use super::rows::{factorise, hstack};
use super::shape::{Shape, Side};
use super::words::names;
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::spec::{Import, Matrix, Spec};

/// The blocks [A_ij B_ij], n_i x (n_j + m_j), by (i, j), i != j.
pub(super) struct Coupling(pub BTreeMap<(usize, usize), DMatrix<f64>>);

/// What subsystem j exports.
pub(super) struct Exports {
    /// The rows of [Cz_j Dz_j].
    outputs: Vec<RowDVector<f64>>,
    width: usize,
    /// Row r of block (i, j) as a combination of the outputs, by (i, r); zero rows are absent.
    combinations: BTreeMap<(usize, usize), RowDVector<f64>>,
}

/// E_i and L_ij.
pub(super) struct Imports {
    pub E: DMatrix<f64>,
    pub L: BTreeMap<usize, DMatrix<f64>>,
}

/// The blocks of the `from` tables.
pub(super) fn coupling(spec: &Spec, roster: &Roster, errors: &mut Diagnostics) -> Option<Coupling> {
    let imports = spec.subsystems.iter().enumerate().flat_map(|(i, s)| s.from.iter().map(move |import| (i, import)));
    let all: Vec<_> = imports.map(|(i, import)| block(i, import, roster, errors)).collect();
    Some(Coupling(all.into_iter().collect::<Option<_>>()?))
}

type Block = ((usize, usize), DMatrix<f64>);

fn block(i: usize, import: &Import, roster: &Roster, errors: &mut Diagnostics) -> Option<Block> {
    let j = neighbour(i, import, roster, errors)?;
    let (to, from) = (&roster.members[i], &roster.members[j]);
    if import.A.is_none() && import.B.is_none() {
        let title = format!("nothing says what `{}` does to `{}`", from.name, to.name);
        let error = Diagnostic::error(code::MISSING_KEY, title);
        errors.push(error.at(import.neighbour.place.clone(), "needs `A`, `B` or both (or `L` in the form (1), (2))"));
        return None;
    }
    let A = imported("A", &import.A, to, from, ("state", &from.states), errors);
    let B = imported("B", &import.B, to, from, ("input", &from.inputs), errors);
    Some(((i, j), hstack(&A?, &B?)))
}

/// A_ij or B_ij; zero where absent.
fn imported(
    key: &str,
    given: &Option<Matrix>,
    to: &Member,
    from: &Member,
    (kind, signals): (&str, &[Signal]),
    errors: &mut Diagnostics,
) -> Option<DMatrix<f64>> {
    let Some(given) = given else { return Some(DMatrix::zeros(to.states.len(), signals.len())) };
    let what = format!("matrix `{key}` from `{}` to `{}`", from.name, to.name);
    let rows = Side::Exactly(to.states.len(), format!("one per state of `{}`: {}", to.name, names(&to.states)));
    let columns = Side::Exactly(signals.len(), format!("one per {kind} of `{}`: {}", from.name, names(signals)));
    Shape { what, rows, columns }.read(given, errors)
}

impl Coupling {
    /// The fewest outputs of `j` that span the non-zero rows of every [A_ij B_ij], each one of these rows.
    pub fn exports(&self, j: usize, local: &Local) -> Exports {
        let blocks = self.0.iter().filter(|((_, exporter), _)| *exporter == j);
        let rows = blocks
            .flat_map(|((i, _), block)| block.row_iter().enumerate().map(|(r, row)| ((*i, r), row.clone_owned())));
        let (keys, rows): (Vec<_>, Vec<_>) = rows.filter(|(_, row)| row.iter().any(|c| *c != 0.0)).unzip();
        let (outputs, combinations) = factorise(&rows);
        Exports {
            outputs,
            width: local.A.ncols() + local.B.ncols(),
            combinations: keys.into_iter().zip(combinations).collect(),
        }
    }

    /// E_i: one unit column per state that a neighbour moves; L_ij: how.
    pub fn imports(&self, i: usize, n: usize, exports: &[Exports]) -> Imports {
        let moved: Vec<_> = (0..n).filter(|&r| exports.iter().any(|e| e.combinations.contains_key(&(i, r)))).collect();
        let E = DMatrix::from_fn(n, moved.len(), |r, c| f64::from(u8::from(moved[c] == r)));
        let L = (0..exports.len()).filter_map(|j| Some((j, exports[j].onto(i, &moved)?))).collect();
        Imports { E, L }
    }
}

impl Exports {
    /// Cz_j and Dz_j for a subsystem of `n` states.
    pub fn output_matrices(&self, n: usize) -> (DMatrix<f64>, DMatrix<f64>) {
        let all = DMatrix::from_fn(self.outputs.len(), self.width, |r, c| self.outputs[r][c]);
        (all.columns(0, n).into_owned(), all.columns(n, self.width - n).into_owned())
    }

    /// L_ij over the `moved` states of i; `None` where nothing reaches i.
    fn onto(&self, i: usize, moved: &[usize]) -> Option<DMatrix<f64>> {
        let combination = |row: &usize| self.combinations.get(&(i, *row));
        moved.iter().any(|row| combination(row).is_some()).then(|| {
            DMatrix::from_fn(moved.len(), self.outputs.len(), |r, c| combination(&moved[r]).map_or(0.0, |x| x[c]))
        })
    }
}
