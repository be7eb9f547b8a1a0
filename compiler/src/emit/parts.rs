//! The runtime's tables of one subsystem as values; field by field what `dpc_runtime::tables` declares.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::{DMatrix, DVector};

use super::names::one_line;
use super::node::{Node, labels};
use super::tables::{Field, Value};
use crate::network::{CouplingConstraint, Scalar};
use crate::problems::{Bound, DpcProblem, ReferenceProblem, Row, RowKind, Stage};

/// `dpc_runtime::tables::Tables`.
pub fn all(node: &Node) -> Value {
    Value::Struct(
        "Tables",
        vec![
            Field::new("model", "Model (1), (2) and gains.", model(node)),
            Field::new(
                "coupling",
                format!("(28): H_h^[i], then H_h^[j] over {}; l~_h of (26); members", list(&node.imported_y())),
                coupling(node),
            ),
            Field::new("changing", "(3) with rows that are redrawn while running: who is in it", changing(node)),
            Field::new("reference", "Reference outputs (29)-(31).", reference(node)),
            Field::new("problem", "i-DPC problem (33)-(36), lower <= V w + offset <= upper.", dpc(node)),
        ],
    )
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

/// `dpc_runtime::tables::Model`.
pub fn model(node: &Node) -> Value {
    let (model, gains) = (node.model(), node.gains());
    let (x, u, y) = (labels(&model.states), labels(&model.inputs), labels(&model.outputs));
    let z = &model.coupling_outputs;
    let e: Vec<String> = y.iter().map(|y| format!("sum of errors of {y}")).collect();
    let (u_min, u_max) = input_hull(node);
    Value::Struct(
        "Model",
        vec![
            matrix("A", "A_ii of (1a): from the states to the next states", &model.A, &x, &x),
            matrix("B", "B_ii of (1a): from the inputs to the next states", &model.B, &x, &u),
            matrix("C", "C_i of (1b): from the states to the outputs", &model.C, &y, &x),
            matrix("Cz", "C_zi of (1c): from the states to the coupling outputs", &model.Cz, z, &x),
            matrix("Dz", "D_zi of (1c): from the inputs to the coupling outputs", &model.Dz, z, &u),
            matrix(
                "EL",
                "[E_i L_ij ...] of (1a), (2): from the neighbours' coupling outputs to the next states",
                &node.import_gain(),
                &x,
                &node.imported_z(),
            ),
            matrix("K", "K_i of (17): from x - xhat to the inputs", &gains.K, &u, &x),
            matrix("Kx", "K_i^x of (7f): from xref to uref", &gains.Kx, &u, &x),
            matrix("Ke", "K_i^e of (7f): from eref to uref", &gains.Ke, &u, &e),
            Field::new(
                "u_min",
                "Componentwise hull of U_i: lower ends",
                Value::column(&u_min.map(|end| node.scalar().above(end)), &u),
            ),
            Field::new(
                "u_max",
                "Componentwise hull of U_i: upper ends",
                Value::column(&u_max.map(|end| node.scalar().below(end)), &u),
            ),
            Field::new(
                "drift",
                "Largest |x+ - x| of a state that references start from",
                Value::column(&node.sets().drift.map(|drift| node.scalar().below(drift)), &x),
            ),
        ],
    )
}

/// `[dpc_runtime::tables::CouplingRow; NC]`.
fn coupling(node: &Node) -> Value {
    let row = |&h: &usize| (coupling_row(node, h), node.constraint(h).name.clone());
    Value::List(node.constraints.iter().map(row).collect())
}

fn coupling_row(node: &Node, h: usize) -> Value {
    let constraint = node.constraint(h);
    let field = |name, value| Field::new(name, "", value);
    Value::Struct(
        "CouplingRow",
        vec![
            field("own", Value::row(&constraint.H[&node.i])),
            field("others", Value::Row(others_row(node, constraint))),
            field("l_tilde", Value::Number(node.scalar().below(node.design.sizing.l_tilde[h]))),
            field("members", Value::Number(constraint.H.len() as f64)),
        ],
    )
}

/// `[dpc_runtime::tables::ChangingRow; NH]`.
fn changing(node: &Node) -> Value {
    let row = |&h: &usize| {
        let members = node.changing_constraint(h).members.iter();
        let members = Value::List(members.map(|&j| (member(node, j), String::new())).collect());
        let doc = format!("{}, in the order of the network", one_line(&node.changing_constraint(h).name));
        (Value::Struct("ChangingRow", vec![Field::new("members", doc, Value::Slice(Box::new(members)))]), String::new())
    };
    Value::List(node.changing.iter().map(row).collect())
}

/// `dpc_runtime::tables::Member`.
fn member(node: &Node, j: usize) -> Value {
    let (model, sized) = (&node.design.network.subsystems[j], &node.design.sizing.subsystems[j]);
    let (place, import) = import(node, j);
    let generator = |g: &DVector<f64>| (Value::Slice(Box::new(Value::row(g))), String::new());
    let generators = Value::List(sized.exposed.generators.iter().map(generator).collect());
    let outputs = labels(&model.outputs).join(", ");
    let doc = format!("What (26) takes of a row over {outputs}: the sum of |g . row| over these");
    let fields = vec![
        Field::new("import", format!("{}: {place}", model.name), import),
        Field::new("generators", one_line(&doc), Value::Slice(Box::new(generators))),
    ];
    Value::Struct("Member", fields)
}

/// `Option<dpc_runtime::tables::Import>`, and what it means.
fn import(node: &Node, j: usize) -> (&'static str, Value) {
    let place = node.neighbours.iter().enumerate().find(|(_, neighbour)| neighbour.j == j);
    let Some((slot, first)) = place.and_then(|(slot, neighbour)| Some((slot, neighbour.y?))) else {
        return ("this subsystem", Value::Optional(None, IMPORT_BYTES));
    };
    let count = |name, count| Field::new(name, "", Value::Count(count));
    let outputs = node.design.network.subsystems[j].p();
    let import = Value::Struct("Import", vec![count("slot", slot), count("first", first), count("outputs", outputs)]);
    ("its slot, its first of the imported outputs, and how many", Value::Optional(Some(Box::new(import)), IMPORT_BYTES))
}

/// Three counts.
const IMPORT_BYTES: usize = 24;

/// H_h^[j] of the others, over the imported outputs.
fn others_row(node: &Node, constraint: &CouplingConstraint) -> Vec<f64> {
    let imported = node.neighbours.iter().filter(|neighbour| neighbour.y.is_some());
    imported
        .flat_map(|neighbour| match constraint.H.get(&neighbour.j) {
            Some(row) => row.iter().copied().collect(),
            None => vec![0.0; node.other(neighbour).p()],
        })
        .collect()
}

/// `dpc_runtime::tables::Clamp` or `Nearest`.
fn reference(node: &Node) -> Value {
    let scalar = node.scalar();
    let off = &node.design.sets.subsystems[node.i].rounding.y;
    let epsilon = scalar.below(node.design.sizing.epsilon - off.sum());
    let epsilon = Field::new("epsilon", "Epsilon of (30), per step", Value::Number(epsilon));
    // Inside Y_i however a start is tested, and rows over yref are rounded; a clamp is exact.
    let inside = |end: f64, off: f64| scalar.below(end - off - scalar.share_kept() * end.abs());
    let y = labels(&node.model().outputs);
    match &node.problems().reference {
        ReferenceProblem::Clamp { weight, rows } => {
            let pair = |&(output, coefficient): &(usize, f64)| {
                (Value::Tuple(vec![Value::Count(output), Value::Number(coefficient)]), String::new())
            };
            let fields = vec![
                Field::new("weight", "t / (t + gamma) of (29)", Value::column(weight, &y)),
                epsilon,
                Field::new(
                    "y_min",
                    "Y_i of (31): lower ends",
                    Value::column(&node.sets().Y.min.map(|end| -inside(-end, 0.0)), &y),
                ),
                Field::new(
                    "y_max",
                    "Y_i of (31): upper ends",
                    Value::column(&node.sets().Y.max.map(|end| inside(end, 0.0)), &y),
                ),
                Field::new("rows", "(28): output and coefficient", Value::List(rows.iter().map(pair).collect())),
            ];
            Value::Struct("Clamp", fields)
        }
        ReferenceProblem::Nearest { basis, weights, set, set_limit, rate, euclidean, coupling } => {
            let off = set.abs() * off;
            let gamma = Value::Number(node.design.network.reference.gamma);
            let fields = vec![
                matrix("basis", "U: eigenvectors of T_i", basis, &y, &[]),
                Field::new("weights", "Eigenvalues of T_i (29)", Value::row(weights)),
                Field::new("gamma", "gamma of (29)", gamma),
                matrix("set", "Y_i of (31): one row per facet", set, &[], &y),
                Field::new(
                    "set_limit",
                    "Y_i of (31): limit of each facet",
                    Value::row(&set_limit.zip_map(&off, inside)),
                ),
                matrix("rate", "Ball of (30): one row per facet", rate, &[], &y),
                epsilon,
                Field::new("euclidean", "Whether (30) is a Euclidean ball", Value::Flag(*euclidean)),
                matrix("coupling", "H_h^[i] of (28): one row per constraint", coupling, &[], &y),
            ];
            Value::Struct("Nearest", fields)
        }
    }
}

/// `dpc_runtime::tables::DpcProblem`.
fn dpc(node: &Node) -> Value {
    let (dpc, scalar) = (&node.problems().dpc, node.scalar());
    let names: Vec<String> = dpc.rows.iter().map(|row| row.name.clone()).collect();
    let tube = offsets(dpc, |kind, offset| (kind == RowKind::Tube).then(|| Value::row(offset)));
    let state = offsets(dpc, |kind, offset| match kind {
        RowKind::State(stage) => Some(stage_row(stage, offset)),
        _ => None,
    });
    let input = offsets(dpc, |kind, offset| match kind {
        RowKind::Input(stage) => Some(stage_row(stage, offset)),
        _ => None,
    });
    let extents = dpc.rows.iter().map(|row| row.extent).collect();
    Value::Struct(
        "DpcProblem",
        vec![
            matrix("V", "Rows of unit length in w: (35a), (35c), (35d), (35b), (36)", &dpc.V, &names, &[]),
            gram(dpc, &names),
            Field::new("extent", "Entries of each row before its last zeros", Value::Counts(extents)),
            Field::new(
                "lower",
                "Lower limits of the rows",
                Value::column(&dpc.lower.map(|limit| scalar.above(limit)), &names),
            ),
            Field::new(
                "upper",
                "Upper limits of the rows",
                Value::column(&dpc.upper.map(|limit| scalar.below(limit)), &names),
            ),
            Field::new("slack", slack_doc(scalar), slack(dpc, scalar)),
            Field::new("tube", "Offsets of the first rows, over e = x - xref", tube),
            Field::new("state", "Offsets of the next rows, over xref_{t+k}, k the stage", state),
            Field::new("input", "Offsets of the next rows, over uref_{t+k}, k the stage", input),
            Field::new("terminal", "The rows (36) over dx_N", terminal(dpc)),
            Field::new("shift", "The row that asks the same one stage earlier", Value::Counts(dpc.shift())),
            matrix("root", "T'HT = I, v = T w by simulation: dx_0 = root w_x", &dpc.root, &[], &[]),
            Field::new("stages", "du_k = gain dx_k + spread w_k, dx_{k+1} = next dx_k + drive w_k", stages(dpc)),
            Field::new(
                "x",
                "Bounds of xhat_k, what they are multiplied by in their rows, and the rows",
                bounds(dpc, scalar, |s| &s.x),
            ),
            Field::new("u", "The same of uhat_k", bounds(dpc, scalar, |s| &s.u)),
            Field::new("boxed", "Whether these bounds are all state and input rows", Value::Flag(dpc.boxed)),
            Field::new("staged", "Whether violated rows are looked for by the simulation", Value::Flag(dpc.staged)),
            Field::new(
                "max_iterations",
                format!("Working-set changes before the shifted candidate (47) is used\n{}", limit_origin(node)),
                Value::Count(dpc.max_iterations),
            ),
        ],
    )
}

fn slack_doc(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::Double => "What rounding may take of each row besides 1e-9 of its magnitude: nothing",
        Scalar::Single => "What rounding may take of each row",
    }
}

fn slack(dpc: &DpcProblem, scalar: Scalar) -> Value {
    let slack = dpc.rows.iter().filter(|_| scalar == Scalar::Single).map(|row| scalar.below(row.reserve.slack));
    Value::Slice(Box::new(Value::Row(slack.collect())))
}

/// Where the limit comes from.
pub fn limit_origin(node: &Node) -> String {
    let counted = node.problems().iterations.as_ref();
    counted.map_or("4 (rows + unknowns); `--iterations` looks closer".to_owned(), |count| {
        let (origin, why) = count.origin();
        why.map_or(origin.clone(), |why| format!("{origin}; {why}"))
    })
}

/// The Gram matrix, or why there is none.
fn gram(dpc: &DpcProblem, names: &[String]) -> Field {
    let (rows, unknowns) = dpc.V.shape();
    let (doc, matrix) = match dpc.gram() {
        Some(gram) => ("V V': products of so few rows are looked up instead of computed".to_owned(), gram),
        None => {
            let doc = format!(
                "V V' is not stored: {rows} x {rows} numbers would save products of no more than {unknowns} entries"
            );
            (doc, DMatrix::zeros(0, rows))
        }
    };
    let rows = matrix.row_iter().zip(names).map(|(row, name)| (row.iter().copied().collect(), name.clone()));
    Field::new("gram", doc, Value::Slice(Box::new(Value::Matrix(rows.collect()))))
}

/// The rows over dx_N, where the simulation looks at them.
fn terminal(dpc: &DpcProblem) -> Value {
    let rows = dpc.rows.iter().filter(|row| dpc.staged && row.kind == RowKind::Terminal);
    let rows = rows.map(|row| (row.end.iter().copied().collect(), row.name.clone())).collect();
    Value::Slice(Box::new(Value::Matrix(rows)))
}

fn stages(dpc: &DpcProblem) -> Value {
    let stage = |(k, stage): (usize, &Stage)| {
        let field = |name, value| Field::new(name, "", value);
        let fields = vec![
            field("next", rows(&stage.next)),
            field("drive", rows(&stage.drive)),
            field("gain", rows(&stage.gain)),
            field("spread", rows(&stage.spread)),
        ];
        (Value::Struct("Stage", fields), format!("step {k}"))
    };
    Value::List(dpc.stages.iter().enumerate().map(stage).collect())
}

fn bounds(dpc: &DpcProblem, scalar: Scalar, of: fn(&Stage) -> &Vec<Bound>) -> Value {
    let each =
        |value: &dyn Fn(&[Bound]) -> Value| Value::Array(dpc.stages.iter().map(|stage| value(of(stage))).collect());
    let numbers = |of: &dyn Fn(&Bound) -> f64| each(&|bounds| Value::Row(bounds.iter().map(of).collect()));
    let fields = vec![
        Field::new("low", "Lower ends", numbers(&|bound| scalar.above(bound.low))),
        Field::new("high", "Upper ends", numbers(&|bound| scalar.below(bound.high))),
        Field::new("unit", "Factors", numbers(&|bound| bound.unit)),
        Field::new("row", "Rows", each(&|bounds| Value::Counts(bounds.iter().map(|bound| bound.row).collect()))),
    ];
    Value::Struct("Bounds", fields)
}

/// A small matrix on one line.
fn rows(matrix: &DMatrix<f64>) -> Value {
    Value::Array(matrix.row_iter().map(|row| Value::Row(row.iter().copied().collect())).collect())
}

fn offsets(dpc: &DpcProblem, value: impl Fn(RowKind, &DVector<f64>) -> Option<Value>) -> Value {
    let row = |row: &Row| value(row.kind, &row.offset).map(|value| (value, row.name.clone()));
    Value::List(dpc.rows.iter().filter_map(row).collect())
}

fn stage_row(stage: usize, offset: &DVector<f64>) -> Value {
    let fields = vec![Field::new("stage", "", Value::Count(stage)), Field::new("row", "", Value::row(offset))];
    Value::Struct("StageRow", fields)
}

fn matrix(name: &'static str, doc: &str, matrix: &DMatrix<f64>, rows: &[String], columns: &[String]) -> Field {
    let columns = if columns.is_empty() { String::new() } else { format!("\ncolumns: {}", columns.join(", ")) };
    Field::new(name, format!("{doc}{columns}"), Value::matrix(matrix, rows))
}

/// Smallest box around U_i; infinite where U_i has no bound.
fn input_hull(node: &Node) -> (DVector<f64>, DVector<f64>) {
    let U = crate::convex::Polytope { H: node.model().U.H.clone(), h: node.model().U.h.clone() };
    let m = node.sizes.nu;
    let reach = |sign: f64| {
        DVector::from_fn(m, |k, _| {
            let mut direction = DVector::zeros(m);
            direction[k] = sign;
            U.support(&direction).map_or(sign * f64::INFINITY, |(value, _)| sign * value)
        })
    };
    (reach(-1.0), reach(1.0))
}
