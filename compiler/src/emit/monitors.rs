//! Tables that no step needs but that whoever starts or watches a controller does: names of rows, steady states, and
//! the sets that state, input and deviations stay in at every step. A linker drops those that nobody names.

use nalgebra::{DMatrix, DVector};

use super::Steady;
use super::names::code;
use super::node::{Node, labelled, labels};
use super::tables::{Field, Value, item};
use crate::network::{NamedPolytope, Scalar, Signal, Subsystem};

/// All items, in the order of the file.
pub fn items(node: &Node, steady: &Steady) -> Vec<String> {
    let model = node.model();
    let (outputs, loads) = steady.rows(node.design.gains.chi_offset[node.i], model.n() + model.p());
    let [x, u] = steady_states(node, &Source::outputs(node, steady), &outputs);
    let mut items = vec![row_names(node), x, u];
    if node.network_loads() > 0 {
        items.extend(steady_states(node, &Source::loads(node, steady), &loads));
    }
    items.extend((!node.loads().is_empty()).then(|| load_model(node)));
    items.push(tube(node));
    items.extend(tube_noise(node));
    items.extend([
        coupling_deviation(node),
        limits(
            node.scalar(),
            "STATE_LIMITS",
            "X_i: row and limit, `row . x <= limit`, in the deviations the model is in.",
            "NX",
            &model.X,
        ),
        limits(
            node.scalar(),
            "INPUT_LIMITS",
            "U_i: row and limit, `row . u <= limit`, in the deviations the model is in.",
            "NU",
            &model.U,
        ),
    ]);
    items
}

/// Only where the file states a measurement error.
pub fn has_noise(node: &Node) -> bool {
    node.model().measurement_error.amax() > 0.0
}

fn tube_noise(node: &Node) -> Option<String> {
    let (dpc, s) = (&node.problems().dpc, node.model());
    let labels: Vec<String> = dpc.rows.iter().map(|row| row.name.clone()).collect();
    let errors = s.states.iter().zip(&s.measurement_error);
    let errors: Vec<String> = errors.map(|(state, error)| format!("{} by {error:?}", code(&labelled(state)))).collect();
    let doc = format!(
        "How far measurement errors move each tube row (35a), scaled as the row. Measured states may be off: {}.",
        errors.join(", ")
    );
    has_noise(node).then(|| item(node.scalar(), &doc, "TUBE_NOISE", "[f64; NT]", &Value::column(&dpc.noise, &labels)))
}

fn row_names(node: &Node) -> String {
    let names = node.problems().dpc.rows.iter().map(|row| (Value::Text(row.name.clone()), String::new()));
    let doc = "What each row of the i-DPC problem asks: the rows that a status speaks of.";
    item(node.scalar(), doc, "ROWS", "[&str; NR]", &Value::List(names.collect()))
}

/// What a steady state is a map of.
struct Source {
    scalar: Scalar,
    what: &'static str,
    /// Of the tables: `STEADY_X`, `STEADY_U` with this at the end.
    suffix: &'static str,
    count: &'static str,
    /// `left: h1 [cm]` for every signal of the network; `None` in a large one, whose rows list their entries.
    columns: Option<Vec<String>>,
}

impl Source {
    fn outputs(node: &Node, steady: &Steady) -> Self {
        let columns = (!steady.is_sparse()).then(|| network_signals(node, |s| &s.outputs));
        Self {
            scalar: node.scalar(),
            what: "the outputs of the whole network at rest",
            suffix: "",
            count: "NETWORK_NY",
            columns,
        }
    }

    fn loads(node: &Node, steady: &Steady) -> Self {
        let columns = (!steady.is_sparse()).then(|| network_signals(node, |s| &s.loads.signals));
        Self {
            scalar: node.scalar(),
            what: "the loads of the whole network, outputs at 0",
            suffix: "_LOADS",
            count: "NETWORK_ND",
            columns,
        }
    }
}

fn network_signals(node: &Node, of: fn(&Subsystem) -> &[Signal]) -> Vec<String> {
    let all = node.design.network.subsystems.iter();
    all.flat_map(|other| of(other).iter().map(|y| code(&format!("{}: {}", other.name, labelled(y))))).collect()
}

/// Rest of (9): chi = `steady` times the source, u = calK_i chi.
fn steady_states(node: &Node, source: &Source, steady: &DMatrix<f64>) -> [String; 2] {
    let (model, gains) = (node.model(), node.gains());
    let x = steady.rows(0, model.n()).into_owned();
    let u = gains.calK() * steady;
    [
        source.table("STEADY_X", "State", "NX", &x, &labels(&model.states)),
        source.table("STEADY_U", "Input", "NU", &u, &labels(&model.inputs)),
    ]
}

impl Source {
    fn table(&self, name: &str, state: &str, rows: &str, matrix: &DMatrix<f64>, labels: &[String]) -> String {
        let Self { scalar, what, suffix, count, columns } = self;
        let real = scalar.name();
        let map = format!("{state} at rest, (9), as a linear map of {what}. One row per entry");
        let (doc, ty, value) = match columns {
            Some(columns) => {
                let doc = format!("{map}; columns\n{}.", columns.join(", "));
                (doc, format!("[[{real}; {count}]; {rows}]"), Value::matrix(matrix, labels))
            }
            None => {
                let doc = format!("{map}: indices, in the order of the modules, and coefficients.");
                (doc, format!("[&[(usize, {real})]; {rows}]"), Value::entries(matrix, LITTLE, labels))
            }
        };
        item(*scalar, &doc, &format!("{name}{suffix}"), &ty, &value)
    }
}

/// Entries of a steady row below this share of the largest are left out: less than what rounding does to the others.
const LITTLE: f64 = 1e-15;

/// `dpc_runtime::tables::LoadModel`.
fn load_model(node: &Node) -> String {
    let (loads, names) = (node.loads(), labels(&node.loads().signals));
    let lag = loads.change(node.sizes.n - 1);
    let column = |name, doc: &str, numbers| Field::new(name, doc, Value::column(numbers, &names));
    let gain = Field::new(
        "M",
        format!("From the loads to the next states\ncolumns: {}", names.join(", ")),
        Value::matrix(&loads.M, &labels(&node.model().states)),
    );
    let fields = vec![
        gain,
        column("min", "Bounds the design was made for: lower ends", &loads.min),
        column("max", "Bounds the design was made for: upper ends", &loads.max),
        column("rate", "Largest change per step", &loads.rate),
        column("lag", "Largest change in N - 1 steps", &lag),
    ];
    let doc = "Measured disturbances, for [`Loads`].";
    item(node.scalar(), doc, "LOAD_MODEL", "LoadModel<ND, NX>", &Value::Struct("LoadModel", fields))
}

fn tube(node: &Node) -> String {
    let set = &node.sets().E;
    let real = node.scalar().name();
    let ty = format!("[([{real}; NX], {real}); {}]", set.q.len());
    let doc = "E_i of (18): row and width. `|row . (x - xhat)| <= width` at every step.";
    let q = set.q.map(|q| node.scalar().above(q));
    item(node.scalar(), doc, "TUBE", &ty, &rows_and_limits(&set.P, &q, &[]))
}

fn coupling_deviation(node: &Node) -> String {
    let doc =
        "Z_i of (21): half-widths. `|z - zref|` stays below them, and neighbours rely on it. One per coupling output.";
    let (ty, zeta) =
        (format!("[{}; NZ]", node.scalar().name()), node.sets().zeta.map(|zeta| node.scalar().above(zeta)));
    item(node.scalar(), doc, "Z_WIDTHS", &ty, &Value::column(&zeta, &node.model().coupling_outputs))
}

fn limits(scalar: Scalar, name: &str, doc: &str, width: &str, set: &NamedPolytope) -> String {
    let real = scalar.name();
    let ty = format!("[([{real}; {width}], {real}); {}]", set.h.len());
    item(scalar, doc, name, &ty, &rows_and_limits(&set.H, &set.h, &set.rows))
}

fn rows_and_limits(rows: &DMatrix<f64>, limits: &DVector<f64>, labels: &[String]) -> Value {
    let pair = |k: usize| {
        let row = Value::Row(rows.row(k).iter().copied().collect());
        (Value::Tuple(vec![row, Value::Number(limits[k])]), labels.get(k).cloned().unwrap_or_default())
    };
    Value::List((0..limits.len()).map(pair).collect())
}
