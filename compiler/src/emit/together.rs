//! `network` in `mod.rs`: all controllers in one process, and the plant of the file. What simulations, tests and a first run on a
//! desk need, whatever the network looks like; firmware has no use for it.

use std::fmt::Write;

use nalgebra::{DVector, RowDVector};

use super::code::link_name;
use super::names::{code, one_line};
use super::node::{Node, labelled};
use crate::network::{NamedPolytope, Scalar, Signal, Subsystem};

/// Name of the module, which no subsystem's may have.
pub const MODULE: &str = "network";

/// The module, without its attributes.
pub fn module(nodes: &[Node], modules: &[String]) -> String {
    let network = Together::new(nodes, modules);
    let sections = [
        network.sizes(),
        network.names(),
        network.structs(),
        network.starts(),
        network.deliver(),
        network.step(),
        network.guaranteed(),
        network.statuses(),
        network.model(),
        network.margins(),
    ];
    format!("pub mod {MODULE} {{\n{}}}\n", sections.concat())
}

struct Together<'a> {
    nodes: &'a [Node<'a>],
    modules: &'a [String],
    /// Index of the first state, input, output and load of each subsystem.
    first: Vec<[usize; 4]>,
    totals: [usize; 4],
}

const SIGNALS: [&str; 4] = ["states", "inputs", "outputs", "loads"];

impl<'a> Together<'a> {
    fn new(nodes: &'a [Node<'a>], modules: &'a [String]) -> Self {
        let mut totals = [0; 4];
        let mut first = Vec::new();
        for node in nodes {
            first.push(totals);
            let s = node.model();
            totals.iter_mut().zip([s.n(), s.m(), s.p(), s.loads.len()]).for_each(|(total, more)| *total += more);
        }
        Self { nodes, modules, first, totals }
    }

    fn each(&self, text: impl Fn(usize, &str) -> String) -> String {
        self.modules.iter().enumerate().map(|(i, module)| text(i, module)).collect()
    }

    fn sizes(&self) -> String {
        let mut text = format!("    /// Subsystems.\n    pub const SUBSYSTEMS: usize = {};\n", self.nodes.len());
        for ((name, total), what) in ["NX", "NU", "NY", "ND"].iter().zip(self.totals).zip(SIGNALS) {
            let _ = writeln!(
                text,
                "    /// All {what}, one subsystem's after the other's.\n    pub const {name}: usize = {total};"
            );
        }
        let seconds = self.nodes[0].design.network.sample_time;
        let _ = writeln!(text, "    /// Seconds per step.\n    pub const SAMPLE_TIME: f64 = {seconds:?};");
        text
    }

    fn names(&self) -> String {
        let of: [fn(&Subsystem) -> &[Signal]; 4] = [|s| &s.states, |s| &s.inputs, |s| &s.outputs, |s| &s.loads.signals];
        let mut text = String::new();
        for (((name, size), what), signals) in
            [("STATES", "NX"), ("INPUTS", "NU"), ("OUTPUTS", "NY"), ("LOADS", "ND")].iter().zip(SIGNALS).zip(of)
        {
            let labels = self.nodes.iter().flat_map(|node| {
                let s = node.model();
                signals(s).iter().map(|signal| format!("{:?}", format!("{}: {}", s.name, labelled(signal))))
            });
            let labels = labels.collect::<Vec<_>>().join(", ");
            let _ = writeln!(
                text,
                "    /// Names of all {what}, with units.\n    pub const {name}: [&str; {size}] = [{labels}];"
            );
        }
        text + &self.ranges()
    }

    fn ranges(&self) -> String {
        let list = |of: &dyn Fn(&Node) -> Vec<String>| self.nodes.iter().flat_map(of).collect::<Vec<_>>().join(", ");
        let reach = list(&|node| ranges(&node.sets().Y.min, &node.sets().Y.max));
        let epsilon = number(self.nodes[0].design.sizing.epsilon);
        let disturbances = list(&|node| {
            let (low, high) = disturbances(node.model());
            ranges(&low, &high)
        });
        let loads = list(&|node| ranges(&node.loads().min, &node.loads().max));
        let rates = list(&|node| node.loads().rate.iter().map(|rate| number(*rate)).collect());
        fill(RANGES, [&reach, &epsilon, &disturbances, &loads, &rates])
    }

    fn structs(&self) -> String {
        let nodes = self.each(|i, module| {
            let loads = if self.nodes[i].loads().is_empty() { "" } else { &format!(", super::{module}::Loads") };
            format!(
                "        /// Of {}.\n        pub {module}: Node<super::{module}::Controller, super::{module}::Inbox, \
                 super::{module}::Message{loads}>,\n",
                code(&self.nodes[i].model().name)
            )
        });
        let steps = self.each(|i, module| {
            format!(
                "        /// Of {}.\n        pub {module}: super::{module}::Step,\n",
                code(&self.nodes[i].model().name)
            )
        });
        fill(STRUCTS, [&nodes, &steps])
    }

    /// `&[x[2], x[3]]`, in what the controllers compute in.
    fn part(&self, name: &str, i: usize, kind: usize, count: usize) -> String {
        let conversion = if self.nodes[i].scalar() == Scalar::Single { " as f32" } else { "" };
        let first = self.first[i][kind];
        let entries: Vec<String> = (first..first + count).map(|k| format!("{name}[{k}]{conversion}")).collect();
        format!("&[{}]", entries.join(", "))
    }

    fn starts(&self) -> String {
        let single = self.nodes[0].scalar() == Scalar::Single;
        let outputs = if single { "&outputs.map(|y| y as f32)" } else { "outputs" };
        let at = if self.totals[3] > 0 { format!("{outputs}, loads") } else { outputs.to_owned() };
        let nodes = self.each(|i, module| {
            let steady = format!("&super::{module}::steady_state({at})");
            self.node(i, module, &format!("start({steady}{})", self.own_loads(i)))
        });
        fill(START, [&nodes]) + &self.planned()
    }

    fn own_loads(&self, i: usize) -> String {
        let count = self.nodes[i].loads().len();
        if count == 0 { String::new() } else { format!(", {}", self.part("loads", i, 3, count)) }
    }

    /// The field of a node that starts by `call`.
    fn node(&self, i: usize, module: &str, call: &str) -> String {
        let (parts, loads) = if self.nodes[i].loads().is_empty() {
            ("(controller, message)", "()")
        } else {
            ("(controller, loads, message)", "loads")
        };
        format!(
            "                {module}: {{\n                    let {parts} = super::{module}::{call}?;\n                    \
             Node {{ controller, inbox: super::{module}::Inbox::new(), message, loads: {loads} }}\n                }},\n"
        )
    }

    /// Where the file, or the command, states a start.
    fn planned(&self) -> String {
        let Some(plan) = &self.nodes[0].design.start else { return String::new() };
        let list = |parts: &[DVector<f64>]| {
            let entries: Vec<String> = parts.iter().flat_map(|part| part.iter().map(|v| format!("{v:?}"))).collect();
            entries.join(", ")
        };
        let nodes = self.each(|i, module| {
            let loads = if self.nodes[i].loads().is_empty() { "" } else { &format!("&super::{module}::START_LOADS, ") };
            let x = self.part("x", i, 0, self.nodes[i].model().n());
            self.node(i, module, &format!("start_planned(&super::{module}::START, {loads}{x})"))
        });
        fill(PLANNED, [&list(&plan.start.x0), &list(&plan.start.d0), &nodes])
    }

    fn deliver(&self) -> String {
        let accept = self.each(|i, module| {
            let links = self.nodes[i].neighbours.iter().map(|neighbour| {
                let from = &self.modules[neighbour.j];
                format!(
                    "            let _ = self.{module}.inbox.accept(&super::{module}::{}, &self.{from}.message);\n",
                    link_name(from)
                )
            });
            links.collect()
        });
        fill(DELIVER, [&accept])
    }

    fn step(&self) -> String {
        let steps = self.each(|i, module| {
            let s = self.nodes[i].model();
            let (x, set_point) = (self.part("x", i, 0, s.n()), self.part("set_points", i, 2, s.p()));
            let call = if s.loads.is_empty() {
                format!("step({x}, {set_point}, &mut self.{module}.inbox)")
            } else {
                let load = format!("&self.{module}.loads.admit({})", self.part("loads", i, 3, s.loads.len()));
                format!("step_under({x}, {set_point}, {load}, &mut self.{module}.inbox)")
            };
            format!("                {module}: self.{module}.controller.{call},\n")
        });
        let sent = self.each(|_, module| format!("            self.{module}.message = nodes.{module}.message;\n"));
        let inputs = self.each(|i, module| {
            let conversion = |k| match self.nodes[i].scalar() {
                Scalar::Double => format!("nodes.{module}.input[{k}], "),
                Scalar::Single => format!("f64::from(nodes.{module}.input[{k}]), "),
            };
            (0..self.nodes[i].model().m()).map(conversion).collect()
        });
        fill(STEP, [&steps, &sent, inputs.trim_end_matches(", ")])
    }

    fn guaranteed(&self) -> String {
        let all = self.each(|_, module| format!("self.{module}.status.is_guaranteed(), "));
        fill(STATUSES, [all.trim_end_matches(", ")])
    }

    fn statuses(&self) -> String {
        let each = self.each(|i, module| {
            let name = &self.nodes[i].model().name;
            format!("                ({name:?}, self.{module}.status.is_guaranteed(), &self.{module}.status),\n")
        });
        fill(EACH_STATUS, [&each])
    }

    fn model(&self) -> String {
        let next = self.each(|i, _| {
            let s = self.nodes[i].model();
            self.states(i).zip(&s.states).map(|(sum, x)| entry(&sum, &labelled(x))).collect()
        });
        let outputs = self.each(|i, _| {
            let s = self.nodes[i].model();
            let sum = |k| Sum::default().add(&s.C.row(k).into_owned(), "x", self.first[i][0]).text();
            (0..s.p()).zip(&s.outputs).map(|(k, y)| entry(&sum(k), &labelled(y))).collect()
        });
        fill(MODEL, [&next, &outputs])
    }

    /// The next states of subsystem `i`: A x + B u + what the neighbours add + M d.
    fn states(&self, i: usize) -> impl Iterator<Item = String> {
        let (nodes, s) = (self.nodes, self.nodes[i].model());
        (0..s.n()).map(move |k| {
            let [x, u, _, d] = self.first[i];
            let mut sum = Sum::default().add(&s.A.row(k).into_owned(), "x", x).add(&s.B.row(k).into_owned(), "u", u);
            for (&j, link) in &s.L {
                let (other, from): (_, RowDVector<f64>) = (nodes[j].model(), s.E.row(k) * link);
                sum = sum.add(&(&from * &other.Cz), "x", self.first[j][0]).add(
                    &(&from * &other.Dz),
                    "u",
                    self.first[j][1],
                );
            }
            sum.add(&s.loads.M.row(k).into_owned(), "loads", d).text()
        })
    }

    fn margins(&self) -> String {
        let (mut names, mut values) = (Vec::new(), String::new());
        for (i, node) in self.nodes.iter().enumerate() {
            let s = node.model();
            let [x, u, ..] = self.first[i];
            for (set, variable, first) in [(&s.X, "x", x), (&s.U, "u", u)] {
                names.extend(set.rows.iter().map(|row| format!("{:?}", format!("{}: {row}", s.name))));
                values += &rows(set, variable, first);
            }
        }
        for constraint in &self.nodes[0].design.network.coupling_constraints {
            names.push(format!("{:?}", constraint.name));
            let sum = constraint.H.iter().fold(Sum::default(), |sum, (&j, row)| {
                sum.add(&(-row.transpose() * &self.nodes[j].model().C), "x", self.first[j][0])
            });
            values += &entry(&sum.constant(constraint.l).text(), &constraint.name);
        }
        let count = names.len().to_string();
        fill(MARGINS, [&count, &names.join(", "), &count, &values])
    }
}

/// `limit - row . x` of every row.
fn rows(set: &NamedPolytope, variable: &str, first: usize) -> String {
    let row = |k: usize| {
        let row: RowDVector<f64> = -set.H.row(k);
        Sum::default().add(&row, variable, first).constant(set.h[k]).text()
    };
    set.rows.iter().enumerate().map(|(k, name)| entry(&row(k), name)).collect()
}

/// A box in W_i, as large along each axis as W_i where that is a box itself; 0 without disturbances.
fn disturbances(s: &Subsystem) -> (DVector<f64>, DVector<f64>) {
    let Some(w) = &s.w else { return (DVector::zeros(s.n()), DVector::zeros(s.n())) };
    let (mut low, mut high) = (-&w.hull, w.hull.clone());
    let (rows, limits) = (w.set.H.row_iter(), w.set.h.iter());
    let alone = |row: &RowDVector<f64>| row.iter().filter(|entry| **entry != 0.0).count() == 1;
    let rows: Vec<(RowDVector<f64>, f64)> = rows.map(|row| row.into_owned()).zip(limits.copied()).collect();
    for (row, limit) in rows.iter().filter(|(row, _)| alone(row)) {
        for (k, entry) in row.iter().enumerate() {
            if *entry > 0.0 {
                high[k] = high[k].min(limit / entry);
            } else if *entry < 0.0 {
                low[k] = low[k].max(limit / entry);
            }
        }
    }
    let share = |(row, limit): &(RowDVector<f64>, f64)| {
        let ends = row.iter().zip(low.iter().zip(&high));
        limit / ends.map(|(entry, (low, high))| (entry * low).max(entry * high)).sum::<f64>()
    };
    let share = rows.iter().filter(|(row, _)| !alone(row)).map(share).fold(1.0, f64::min);
    (low * share, high * share)
}

fn ranges(low: &DVector<f64>, high: &DVector<f64>) -> Vec<String> {
    low.iter().zip(high).map(|(low, high)| format!("({}, {})", number(*low), number(*high))).collect()
}

/// As Rust writes it.
fn number(value: f64) -> String {
    match value {
        f64::INFINITY => "f64::INFINITY".to_owned(),
        f64::NEG_INFINITY => "f64::NEG_INFINITY".to_owned(),
        // Not -0.0.
        value => format!("{:?}", value + 0.0),
    }
}

fn entry(value: &str, what: &str) -> String {
    format!("            {value}, // {}\n", one_line(what))
}

/// A linear expression in Rust.
#[derive(Default)]
struct Sum {
    constant: f64,
    terms: Vec<(f64, String)>,
}

impl Sum {
    /// `row . variable[first..]`
    fn add(mut self, row: &RowDVector<f64>, variable: &str, first: usize) -> Self {
        let entries = row.iter().enumerate().filter(|(_, factor)| **factor != 0.0);
        self.terms.extend(entries.map(|(k, factor)| (*factor, format!("{variable}[{}]", first + k))));
        self
    }

    fn constant(mut self, value: f64) -> Self {
        self.constant += value;
        self
    }

    /// `0.5 + 2.0 * x[0] - x[1]`
    fn text(&self) -> String {
        let constant =
            (self.constant != 0.0).then(|| (self.constant.is_sign_negative(), format!("{:?}", self.constant.abs())));
        let terms = self.terms.iter().map(|(factor, variable)| {
            let product =
                if factor.abs() == 1.0 { variable.clone() } else { format!("{:?} * {variable}", factor.abs()) };
            (factor.is_sign_negative(), product)
        });
        let mut text = String::new();
        for (negative, term) in constant.into_iter().chain(terms) {
            let sign = match (text.is_empty(), negative) {
                (true, false) => "",
                (true, true) => "-",
                (false, false) => " + ",
                (false, true) => " - ",
            };
            text += sign;
            text += &term;
        }
        if text.is_empty() { "0.0".to_owned() } else { text }
    }
}

/// `template` with a text in the place of each `@@`.
fn fill<const COUNT: usize>(template: &str, texts: [&str; COUNT]) -> String {
    let mut pieces = template.split("@@");
    let first = pieces.next().unwrap_or_default().to_owned();
    texts.iter().zip(pieces).fold(first, |filled, (text, piece)| filled + text + piece)
}

const RANGES: &str =
    "    /// Y of (31): the set-points of each output that are followed all the way. Of farther ones, to its ends.
    pub const SET_POINTS: [(f64, f64); NY] = [@@];
    /// The most that references move per step.
    pub const EPSILON: f64 = @@;
    /// Disturbances that the design covers, in any combination: what may be added to each of [`STATES`] in a step.
    pub const DISTURBANCES: [(f64, f64); NX] = [@@];
    /// Least and most of each of [`LOADS`].
    pub const LOAD_RANGES: [(f64, f64); ND] = [@@];
    /// Their largest change per step.
    pub const LOAD_RATES: [f64; ND] = [@@];
";

const STRUCTS: &str = "
    /// All controllers of the network, and what is on its way between them. Each node is open to look at, or to draw rows for.
    #[derive(Debug, Clone)]
    pub struct Network {
@@    }

    /// One subsystem's.
    #[derive(Debug, Clone)]
    pub struct Node<Controller, Inbox, Message, Loads = ()> {
        /// What it remembers from step to step.
        pub controller: Controller,
        /// What has arrived for it.
        pub inbox: Inbox,
        /// The last one it sent.
        pub message: Message,
        /// Its measured disturbances, where it has any.
        pub loads: Loads,
    }

    /// What a step of all controllers gives.
    #[derive(Debug, Clone, Copy)]
    pub struct Step {
        /// In the order of [`INPUTS`].
        pub input: [f64; NU],
        /// What each controller gives, with its status.
        pub nodes: Steps,
    }

    /// The step of each subsystem.
    #[derive(Debug, Clone, Copy)]
    pub struct Steps {
@@    }

    impl Network {
";

const START: &str =
    "        /// All controllers at rest where the outputs are `outputs` (in the order of [`OUTPUTS`]) under `loads`.
        ///
        /// # Errors
        /// A controller cannot start there; see [`dpc_runtime::StartError`].
        #[inline]
        pub fn start(outputs: &[f64; NY], loads: &[f64; ND]) -> Result<Self, dpc_runtime::StartError> {
            Ok(Self {
@@            })
        }
";

const PLANNED: &str = "
        /// The states that the start-up plan was made for.
        pub const START_X: [f64; NX] = [@@];
        /// The loads that the start-up plan was made for.
        pub const START_LOADS: [f64; ND] = [@@];

        /// All controllers at the measured states `x`, about [`Self::START_X`], with their parts of the start-up plan.
        ///
        /// # Errors
        /// A state does not fit the plan; see [`dpc_runtime::StartError`].
        #[inline]
        pub fn start_planned(x: &[f64; NX]) -> Result<Self, dpc_runtime::StartError> {
            Ok(Self {
@@            })
        }
";

const DELIVER: &str = "
        /// Every node hears its neighbours' last messages. [`Self::step`] begins with it; constraints that change while running are
        /// redrawn in between. What is refused shows in the status.
        #[inline]
        pub fn deliver(&mut self) {
@@        }
";

const STEP: &str = "
        /// One period of all controllers: messages, then their steps. Measured states in the order of [`STATES`], set-points of
        /// [`OUTPUTS`], measured loads of [`LOADS`].
        #[inline]
        pub fn step(&mut self, x: &[f64; NX], set_points: &[f64; NY], loads: &[f64; ND]) -> Step {
            self.deliver();
            let nodes = Steps {
@@            };
@@            Step { input: [@@], nodes }
        }
    }
";

const STATUSES: &str = "
    impl Steps {
        /// Whether every subsystem says that the guarantee holds: then it does, for the network.
        #[inline]
        pub fn are_guaranteed(&self) -> bool {
            [@@].iter().all(|guaranteed| *guaranteed)
        }
";

const EACH_STATUS: &str = "
        /// Of each subsystem: name, whether the guarantee holds, and its status in words.
        #[inline]
        pub fn statuses(&self) -> [(&'static str, bool, &dyn core::fmt::Display); SUBSYSTEMS] {
            [
@@            ]
        }
    }
";

const MODEL: &str = "
    /// x+ = A x + B u + M d of the file, for all subsystems together: the plant of the design, without disturbances `w`.
    #[inline]
    pub fn plant(x: &[f64; NX], u: &[f64; NU], loads: &[f64; ND]) -> [f64; NX] {
        [
@@        ]
    }

    /// y = C x.
    #[inline]
    pub fn outputs(x: &[f64; NX]) -> [f64; NY] {
        [
@@        ]
    }
";

const MARGINS: &str = "
    /// Limits of states and inputs, and coupling constraints.
    pub const LIMITS: [&str; @@] = [@@];

    /// How far the network is from each of [`LIMITS`], in the unit of the signal; below 0 it is violated.
    #[inline]
    pub fn margins(x: &[f64; NX], u: &[f64; NU]) -> [f64; @@] {
        [
@@        ]
    }
";
