//! The manual of a node: README and front page of its documentation.

use std::fmt::Write;

use super::code::link_name;
use super::names::{code, one_line};
use super::node::{Neighbour, Node, labelled, labels};
use super::parts::limit_origin;
use super::starts::may_start;
use super::wire;
use crate::footprint::noted;
use crate::network::{NamedPolytope, Signal};

pub struct Manual<'a> {
    pub node: &'a Node<'a>,
    pub modules: &'a [String],
    /// Of the crate.
    pub name: &'a str,
    /// The emitted file.
    pub text: &'a str,
}

impl Manual<'_> {
    /// The whole text, in Markdown.
    pub fn text(&self) -> String {
        let sections = [
            self.title(),
            self.usage(),
            self.signals(),
            self.sets(),
            self.neighbours(),
            self.message(),
            STATUSES.to_owned(),
            self.memory(),
            self.timing(),
            LICENCE.to_owned(),
        ];
        sections.into_iter().filter(|section| !section.is_empty()).collect::<Vec<_>>().join("\n")
    }

    fn title(&self) -> String {
        let (network, s) = (&self.node.design.network, self.node.model());
        let loads =
            if s.loads.is_empty() { String::new() } else { format!(", {}", count(s.loads.len(), "measured load")) };
        format!(
            "# `{}`\n\nThe controller of subsystem {} of network {}, by distributed predictive control for tracking: {}, {}, \
             {}{loads}; one step every {} s, {} steps ahead, in `{}`. It needs a core and `dpc-runtime`, which has `no_std`, no \
             allocation, no `unsafe` and no panic.\n\nNumbers are deviations from the operating point of the model, in its units.\n",
            self.name,
            code(&s.name),
            code(&network.name),
            count(s.n(), "state"),
            count(s.m(), "input"),
            count(s.p(), "output"),
            network.sample_time,
            network.horizon,
            network.scalar.name(),
        )
    }

    /// A loop that compiles: what is asked of the hardware is a trait.
    fn usage(&self) -> String {
        let (real, s) = (self.node.scalar().name(), self.node.model());
        let hears = !self.node.neighbours.is_empty();
        let (own, all) = (!s.loads.is_empty(), self.node.network_loads() > 0);
        let when = |condition: bool, text: &'static str| if condition { text } else { "" };
        let rest = if all { "&[0.0; node::NETWORK_NY], &[0.0; node::NETWORK_ND]" } else { "&[0.0; node::NETWORK_NY]" };
        let mut text = format!("## The loop of the node\n\n```rust\nuse {} as node;\n\n", self.name);
        let _ = write!(
            text,
            "/// What is yours: sensors, actuators, the bus and the clock.\ntrait Machine {{\n    \
             /// Waits for the next period; false ends the loop.\n    fn next_period(&mut self) -> bool;\n    \
             fn measured(&self) -> [{real}; node::NX];\n    fn set_point(&self) -> [{real}; node::NY];\n{}    \
             fn apply(&mut self, input: &[{real}; node::NU]);\n    fn send(&mut self, bytes: &[u8]);\n{}    \
             fn report(&mut self, trouble: &dyn core::fmt::Display);\n}}\n\n",
            if own { format!("    fn loads(&self) -> [{real}; node::ND];\n") } else { String::new() },
            when(
                hears,
                "    /// A message that has arrived from a neighbour and was not asked for yet.\n    fn received(&mut self) -> Option<&[u8]>;\n"
            ),
        );
        if self.node.sizes.nh > 0 {
            text += "/// The row of a changing constraint; the same rule on all of its members.\n\
                     fn rule(_row: usize, _meeting: &node::Meeting<'_>) -> Option<node::HalfSpace> {\n    None // the row before stays\n}\n\n";
        }
        let _ = write!(
            text,
            "fn run(machine: &mut impl Machine) -> Result<(), dpc_runtime::StartError> {{\n    \
             // At rest, where all outputs of the network are 0: the same numbers on every node.\n    \
             let rest = node::steady_state({rest});\n    let (mut controller, {}message) = node::start(&rest{})?;\n    \
             let mut inbox = node::Inbox::new();\n    \
             machine.send(&node::to_bytes(&message));\n    while machine.next_period() {{\n{}{}        \
             let step = controller.{};\n        machine.apply(&step.input);\n        \
             machine.send(&node::to_bytes(&step.message)); // due before the neighbours' next step\n        \
             if !step.status.is_guaranteed() {{\n            machine.report(&step.status);\n        }}\n    }}\n    Ok(())\n}}\n```\n",
            when(own, "mut loads, "),
            when(own, ", &machine.loads()"),
            when(hears, RECEIVE),
            when(self.node.sizes.nh > 0, REDRAW),
            if own {
                "step_under(&machine.measured(), &machine.set_point(), &loads.admit(&machine.loads()), &mut inbox)"
            } else {
                "step(&machine.measured(), &machine.set_point(), &mut inbox)"
            },
        );
        text + self.starts()
    }

    fn starts(&self) -> &'static str {
        if may_start(self.node) {
            "\nAway from rest, `start_planned` begins with this node's part of a start-up plan of the network instead.\n"
        } else {
            ""
        }
    }

    fn signals(&self) -> String {
        let s = self.node.model();
        let mut text = "## Signals\n\n| place | signal | limits |\n|---|---|---|\n".to_owned();
        for (signals, what, set) in
            [(&s.states, "state", Some(&s.X)), (&s.inputs, "input", Some(&s.U)), (&s.outputs, "output", None)]
        {
            text += &rows(signals, what, set);
        }
        for (k, load) in s.loads.signals.iter().enumerate() {
            let (min, max, rate) = (s.loads.min[k], s.loads.max[k], s.loads.rate[k]);
            let limits = format!("from {min} to {max}, by at most {rate} per step");
            let _ = writeln!(text, "| load {k} | {} | {limits} |", cell(&code(&labelled(load))));
        }
        text + &self.joint_limits()
    }

    /// Rows over several signals.
    fn joint_limits(&self) -> String {
        let s = self.node.model();
        let several = |set: &NamedPolytope| -> Vec<String> {
            let rows = set.H.row_iter().zip(&set.rows);
            rows.filter(|(row, _)| row.iter().filter(|entry| **entry != 0.0).count() > 1)
                .map(|(_, name)| code(name))
                .collect()
        };
        let rows = [several(&s.X), several(&s.U)].concat();
        if rows.is_empty() { String::new() } else { format!("\nTogether: {}.\n", rows.join(", ")) }
    }

    fn sets(&self) -> String {
        let (s, sets) = (self.node.model(), self.node.sets());
        let mut text = "## What it keeps\n\nLimits hold at every step if the plant is the model, disturbances stay within their bounds, \
                        and messages arrive.\n\n| set | | |\n|---|---|---|\n".to_owned();
        for (y, (low, high)) in s.outputs.iter().zip(sets.Y.min.iter().zip(&sets.Y.max)) {
            let _ = writeln!(
                text,
                "| Y (31) | set-points of {} that are reached | {} |",
                cell(&code(&labelled(y))),
                between(*low, *high)
            );
        }
        let epsilon = self.node.design.sizing.epsilon;
        let _ = writeln!(text, "| epsilon (30) | largest step of a reference | {epsilon} |");
        for (k, q) in sets.E.q.iter().enumerate() {
            let terms: Vec<(f64, &str)> =
                sets.E.P.row(k).iter().copied().zip(s.states.iter().map(|x| x.name.as_str())).collect();
            let _ = writeln!(text, "| E (18) | off the plan by {} | at most {q:.4} |", cell(&code(&sum(&terms))));
        }
        for (z, zeta) in s.coupling_outputs.iter().zip(&sets.zeta) {
            let _ = writeln!(text, "| Z (21) | off its reference by {} | at most {zeta:.4} |", cell(&code(z)));
        }
        if let Some(w) = &s.w {
            let hull: Vec<String> =
                s.states.iter().zip(&w.hull).map(|(x, w)| format!("{} by {w:.4}", code(&labelled(x)))).collect();
            let _ = writeln!(text, "| W | unknown, added in a step | at most {} |", cell(&hull.join(", ")));
        }
        for (x, error) in s.states.iter().zip(&s.measurement_error).filter(|(_, error)| **error > 0.0) {
            let _ = writeln!(text, "| | error of the measured {} | at most {error} |", cell(&code(&labelled(x))));
        }
        text + &self.constraints()
    }

    fn constraints(&self) -> String {
        let fixed = self.node.constraints.iter().map(|&h| self.node.constraint(h).name.as_str());
        let changing = self.node.changing.iter().map(|&h| self.node.changing_constraint(h).name.as_str());
        let names: Vec<String> =
            fixed.chain(changing).enumerate().map(|(row, name)| format!("{row} {}", code(name))).collect();
        if names.is_empty() {
            return String::new();
        }
        format!("\nIt takes part in coupling constraints, by the numbers that a status gives: {}.\n", names.join(", "))
    }

    fn neighbours(&self) -> String {
        let heard: Vec<String> = self.node.neighbours.iter().map(|neighbour| self.heard(neighbour)).collect();
        let heard = if heard.is_empty() {
            "It hears nobody.\n".to_owned()
        } else {
            format!(
                "| hears | bytes per message | what it takes from it | link |\n|---|---|---|---|\n{}",
                heard.concat()
            )
        };
        let design = self.node.design;
        let others = (0..design.network.subsystems.len()).filter(|j| *j != self.node.i).map(|j| Node::new(design, j));
        let hearers = others.filter(|other| other.neighbours.iter().any(|neighbour| neighbour.j == self.node.i));
        let hearers: Vec<String> = hearers.map(|other| code(&other.model().name)).collect();
        let sends = if hearers.is_empty() {
            "Nobody hears it.".to_owned()
        } else {
            format!("It is heard by {}.", hearers.join(", "))
        };
        format!("## Neighbours\n\n{heard}\n{sends} One message per period to each, which has a period to arrive.\n")
    }

    fn heard(&self, neighbour: &Neighbour) -> String {
        let other = self.node.other(neighbour);
        let outputs = labels(&other.outputs);
        let z = neighbour.z.map(|_| other.coupling_outputs.as_slice()).unwrap_or_default();
        let y = neighbour.y.map(|_| outputs.as_slice()).unwrap_or_default();
        let taken: Vec<String> = z.iter().chain(y).map(|signal| code(signal)).collect();
        let bytes = wire::length(&Node::new(self.node.design, neighbour.j));
        let link = link_name(&self.modules[neighbour.j]);
        format!("| {} | {bytes} | {} | `{link}` |\n", cell(&code(&other.name)), cell(&taken.join(", ")))
    }

    fn message(&self) -> String {
        let length = wire::length(self.node);
        let mut text = format!(
            "## Its message: {length} bytes\n\nLittle-endian, without padding. A receiver refuses messages of another layout, scalar \
             type, design or sender: all nodes of a network are flashed from one run of the compiler.\n\n| bytes | type | |\n|---|---|---|\n"
        );
        for part in wire::parts(self.node) {
            let _ = writeln!(text, "| {} | {} | {} |", part.place(), part.ty, cell(&part.what));
        }
        text
    }

    fn memory(&self) -> String {
        let tables = super::parts::all(self.node).bytes(self.node.scalar());
        let measured = match noted(self.text) {
            Some(block) => format!("\n```text\n{block}\n```\n"),
            None => "\n`dpc-codegen --measure=TARGET` adds code, working memory and stack, read from what the compiler makes for that target.\n"
                .to_owned(),
        };
        format!(
            "## Memory\n\nTables: {tables} bytes of constant data, on a machine of 64 bits. Nothing is allocated; what changes is in \
                 the controller and the inbox, which are yours to place.\n{measured}"
        )
    }

    fn timing(&self) -> String {
        let dpc = &self.node.problems().dpc;
        let (unknowns, rows) = (dpc.H.nrows(), dpc.rows.len());
        format!(
            "## Time\n\nA step at which the plan is followed is one test per row ({rows} rows, {unknowns} unknowns). Otherwise a problem \
             is solved, by at most {} changes of its working set ({}); then a plan that is known to be feasible is used, and the guarantee \
             holds. Each change takes a number of operations that the sizes bound, so the longest step is found by measuring one that \
             needs them all.\n",
            dpc.max_iterations,
            one_line(&limit_origin(self.node)),
        )
    }
}

const RECEIVE: &str = "        while let Some(bytes) = machine.received() {
            if let Err(refused) = node::accept_bytes(&mut inbox, bytes) {
                machine.report(&refused);
            }
        }
";

const REDRAW: &str =
    "        for refused in node::redraw(&mut controller, &inbox, rule).iter().filter_map(|drawn| drawn.err()) {
            machine.report(&refused);
        }
";

/// By the names of `dpc_runtime`; a test compares them.
pub const STATUSES: &str = "\
## Statuses, and what to do

There is an input at every step. `status.is_guaranteed()` says whether it carries the guarantee; the network has it where all
nodes say so. Each status prints itself in words.

| `status.control` | guarantee | what to do |
|---|---|---|
| `AtReference`, `Optimal` | holds | nothing |
| `Candidate` | holds | nothing; if it is frequent, let `--iterations` set the limit |
| `Infeasible` | not in this step | the plant moved more than the model and `w` allow, or a neighbour did: `ROWS` names the row; widen `w`, or look for the fault |
| `IterationLimit` | not in this step | as before |
| `NotFinite` | not in this step | a measured state is no number: look at the sensor |

| `status.references` | guarantee | what to do |
|---|---|---|
| `Nearest`, `Planned` | holds | nothing |
| `Blocked` | holds | nothing; a coupling constraint holds it up while others move |
| `Deadlock` | holds | change a set-point: nobody in the constraint moves any more |
| `Kept` | holds | nothing; the reference rests for a step |
| `SetPointNotFinite` | holds | give a number as set-point |
| `Waiting` | holds, unless coupling outputs are imported | see to the messages of the members of its constraints |
| `Undrawn` | not until a row is accepted | redraw the changing constraints at every step; keep starts apart |
| `NotSteady`, `OffPlan`, `CouplingExceeded` | lost | start all nodes again, from the same numbers |

| `status.deliveries` | what to do |
|---|---|
| `InSequence` | nothing |
| `Missing`, `OutOfSequence` | see to the bus, or to a neighbour that was started alone; where coupling outputs are imported, start all nodes again |
| `NotFinite`, `Unreadable` | see to the sender, or to what happens to its bytes on the way |
| `OtherDesign` | flash all nodes from one run of the compiler |

`status.certified` is false where measurement errors may hide that the state left its tube, `status.load_within` where a load left
its bounds or rates: the guarantee is not there in this step. `status.degraded` stays true once references lost it: start all
nodes again.
";

const LICENCE: &str = "\
## Licence

The files of this crate are yours: the compiler's authors claim nothing in what it writes out of your model. `dpc-runtime`, which
they call, is under MIT or Apache-2.0, at your choice.
";

/// A line per signal, with the limits on it alone.
fn rows(signals: &[Signal], what: &str, set: Option<&NamedPolytope>) -> String {
    let line = |(k, signal): (usize, &Signal)| {
        let limits: Vec<String> = set.map(|set| alone(set, k)).unwrap_or_default();
        format!("| {what} {k} | {} | {} |\n", cell(&code(&labelled(signal))), cell(&limits.join(", ")))
    };
    signals.iter().enumerate().map(line).collect()
}

/// The rows of `set` on signal `k` and no other.
fn alone(set: &NamedPolytope, k: usize) -> Vec<String> {
    let on = |row: &[f64]| row.iter().enumerate().all(|(j, entry)| (*entry != 0.0) == (j == k));
    let rows = set.H.row_iter().zip(&set.rows);
    rows.filter(|(row, _)| on(&row.iter().copied().collect::<Vec<_>>())).map(|(_, name)| code(name)).collect()
}

fn sum(terms: &[(f64, &str)]) -> String {
    let terms = terms.iter().filter(|(factor, _)| *factor != 0.0);
    let term =
        |(factor, name): &(f64, &str)| if *factor == 1.0 { (*name).to_owned() } else { format!("{factor:.4} {name}") };
    terms.map(term).collect::<Vec<_>>().join(" + ").replace("+ -", "- ")
}

fn between(low: f64, high: f64) -> String {
    match (low.is_finite(), high.is_finite()) {
        (true, true) => format!("from {low:.4} to {high:.4}"),
        (true, false) => format!("from {low:.4} on"),
        (false, true) => format!("up to {high:.4}"),
        (false, false) => "all".to_owned(),
    }
}

fn count(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// In a table, where a bar would end the cell.
fn cell(text: &str) -> String {
    text.replace('|', "/")
}
