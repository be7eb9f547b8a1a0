//! Tables that no step needs but that whoever starts or watches a controller does: steady states, and the sets that
//! state, input and deviations stay in at every step. A linker drops those that nobody names.

use nalgebra::{DMatrix, DVector};

use super::names::code;
use super::node::{Node, labelled, labels};
use super::tables::{Value, item};
use crate::network::NamedPolytope;

/// All items, in the order of the file. `steady` maps the outputs of the network to chi of (9).
pub fn items(node: &Node, steady: &DMatrix<f64>) -> Vec<String> {
    let model = node.model();
    vec![
        steady_state(node, steady),
        tube(node),
        coupling_deviation(node),
        limits("STATE_LIMITS", "X_i: row and limit, `row . x <= limit`, in the deviations the model is in.", "NX", &model.X),
        limits("INPUT_LIMITS", "U_i: row and limit, `row . u <= limit`, in the deviations the model is in.", "NU", &model.U),
    ]
}

fn steady_state(node: &Node, steady: &DMatrix<f64>) -> String {
    let names: Vec<String> = network_outputs(node).iter().map(|name| code(name)).collect();
    let doc = format!(
        "Steady state of (9), (I - calF)^-1 calG, as a map from the constant outputs of all subsystems to `xref`, `eref`,\n\
         `uref` of this one, then to the coupling outputs it hears. One row per entry; columns {}.",
        names.join(", ")
    );
    let (map, labels) = steady_rows(node, steady);
    item(&doc, "STEADY_STATE", "[[f64; NETWORK_NY]; NX + NY + NU + NI]", &Value::matrix(&map, &labels))
}

/// `left: h1 [cm]` for every output of the network.
pub fn network_outputs(node: &Node) -> Vec<String> {
    let all = node.design.network.subsystems.iter();
    all.flat_map(|other| other.outputs.iter().map(|y| format!("{}: {}", other.name, labelled(y)))).collect()
}

fn steady_rows(node: &Node, steady: &DMatrix<f64>) -> (DMatrix<f64>, Vec<String>) {
    let model = node.model();
    let dynamic: Vec<usize> = node.neighbours.iter().filter(|other| other.z.is_some()).map(|other| other.j).collect();
    let (chi, u) = chi_and_u(node, node.i, steady);
    let imported = dynamic.iter().map(|&j| z_map(node, j, steady));
    let rows: Vec<_> = [chi, u].into_iter().chain(imported).flat_map(|part| rows_of(&part)).collect();
    let mut names = labels(&model.states);
    names.extend(model.outputs.iter().map(|y| format!("sum of errors of {}", labelled(y))));
    names.extend(labels(&model.inputs));
    names.extend(node.imported_z());
    (DMatrix::from_rows(&rows), names)
}

fn rows_of(matrix: &DMatrix<f64>) -> Vec<nalgebra::RowDVector<f64>> {
    matrix.row_iter().map(|row| row.into_owned()).collect()
}

/// The maps to chi_j and to u_j = calK_j chi_j.
fn chi_and_u(node: &Node, j: usize, steady: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let (model, gains) = (&node.design.network.subsystems[j], &node.design.gains.subsystems[j]);
    let chi = steady.rows(node.design.gains.chi_offset[j], model.n() + model.p()).into_owned();
    let u = &gains.Kx * chi.rows(0, model.n()) + &gains.Ke * chi.rows(model.n(), model.p());
    (chi, u)
}

fn z_map(node: &Node, j: usize, steady: &DMatrix<f64>) -> DMatrix<f64> {
    let model = &node.design.network.subsystems[j];
    let (chi, u) = chi_and_u(node, j, steady);
    &model.Cz * chi.rows(0, model.n()) + &model.Dz * u
}

fn tube(node: &Node) -> String {
    let set = &node.sets().E;
    let ty = format!("[([f64; NX], f64); {}]", set.q.len());
    let doc = "E_i of (18): row and width. `|row . (x - xhat)| <= width` at every step.";
    item(doc, "TUBE", &ty, &rows_and_limits(&set.P, &set.q, &[]))
}

fn coupling_deviation(node: &Node) -> String {
    let doc = "Z_i of (21): half-widths. `|z - zref|` stays below them, and neighbours rely on it. One per coupling output.";
    item(doc, "Z_WIDTHS", "[f64; NZ]", &Value::column(&node.sets().zeta, &node.model().coupling_outputs))
}

fn limits(name: &str, doc: &str, width: &str, set: &NamedPolytope) -> String {
    let ty = format!("[([f64; {width}], f64); {}]", set.h.len());
    item(doc, name, &ty, &rows_and_limits(&set.H, &set.h, &set.rows))
}

fn rows_and_limits(rows: &DMatrix<f64>, limits: &DVector<f64>, labels: &[String]) -> Value {
    let pair = |k: usize| {
        let row = Value::Row(rows.row(k).iter().copied().collect());
        (Value::Tuple(vec![row, Value::Number(limits[k])]), labels.get(k).cloned().unwrap_or_default())
    };
    Value::List((0..limits.len()).map(pair).collect())
}
