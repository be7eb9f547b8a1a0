//! The headers.

use std::fmt::Write;

use super::super::code::source_file;
use super::super::node::{Node, labelled, labels};
use super::super::starts::may_start;
use super::super::wire::{length, parts};
use super::Sizes;
use super::codes;
use super::words::{Words, comment, in_quotes};
use crate::design::Design;
use crate::network::Signal;

/// `dpc.h`: the same for all networks.
pub fn common() -> String {
    let text = format!("{STATUS}{}", codes::in_c());
    guarded(
        "/* What the controllers of all networks share. Written by dpc-codegen; do not edit. */\n",
        "DPC_H",
        "#include <stdint.h>\n",
        &text,
    )
}

/// The header that includes all others.
pub fn network(design: &Design, words: &Words, fingerprint: u64) -> String {
    let name = &words.network;
    let upper = name.to_uppercase();
    let includes: String = words.subsystems.iter().map(|prefix| format!("#include \"{prefix}.h\"\n")).collect();
    let head = head(design, &format!("Controllers of network `{}`", design.network.name));
    let mut text = format!(
        "/* The design's fingerprint, which messages carry: of these headers, and of the library. */\n\
         #define {upper}_DESIGN UINT64_C(0x{fingerprint:016x})\nuint64_t {name}_design(void);\n\n\
         /* What numbers mean; NULL for any other. */\n"
    );
    for codes in &codes::ALL {
        let _ = writeln!(text, "const char *{name}_{}_text(int32_t code);", codes.name);
    }
    guarded(&head, &format!("{upper}_H"), &format!("#include \"dpc.h\"\n{includes}"), &(text + "\n"))
}

/// Of one subsystem.
pub fn subsystem(node: &Node, words: &Words, sizes: &Sizes) -> String {
    let prefix = &words.subsystems[node.i];
    let what = format!("Controller of subsystem `{}` of network `{}`", node.model().name, node.design.network.name);
    let header = Header { node, words, prefix, upper: prefix.to_uppercase() };
    let sections = [
        header.numbers(),
        header.names(),
        header.structures(sizes),
        header.starts(),
        header.step(),
        header.messages(),
        header.changing(),
        header.looking(),
    ];
    let includes = "#include <stddef.h>\n#include <stdint.h>\n#include \"dpc.h\"\n";
    guarded(&head(node.design, &what), &format!("{}_H", header.upper), includes, &sections.concat())
}

struct Header<'a> {
    node: &'a Node<'a>,
    words: &'a Words,
    prefix: &'a str,
    upper: String,
}

impl Header<'_> {
    /// `double` or `float`.
    fn real(&self) -> &'static str {
        match self.node.scalar().bytes() {
            4 => "float",
            _ => "double",
        }
    }

    fn numbers(&self) -> String {
        let (node, upper) = (self.node, &self.upper);
        let sizes = &node.sizes;
        let mut text = String::new();
        let mut define = |name: &str, value: String, what: &str| {
            let _ = writeln!(text, "#define {upper}_{name} {value} /* {what} */");
        };
        define("REAL", self.real().to_owned(), "type of all numbers");
        define("NX", sizes.nx.to_string(), "states");
        define("NU", sizes.nu.to_string(), "inputs");
        define("NY", sizes.ny.to_string(), "outputs");
        define("ND", node.loads().len().to_string(), "loads: measured disturbances");
        define("NB", node.neighbours.len().to_string(), "neighbours that this subsystem hears");
        define("ROWS", sizes.nr.to_string(), "rows of the i-DPC problem");
        define("CONSTRAINTS", (sizes.nc + sizes.nh).to_string(), "coupling constraints on this subsystem");
        define("CHANGING", sizes.nh.to_string(), "those whose rows are redrawn while running: the last of them");
        define("HORIZON", sizes.n.to_string(), "steps");
        define("NETWORK_NY", node.design.gains.calG.ncols().to_string(), "outputs of the whole network");
        define("NETWORK_ND", node.network_loads().to_string(), "loads of the whole network");
        define("SAMPLE_TIME", format!("{:?}", node.design.network.sample_time), "s, between two steps");
        define("PLACE", node.i.to_string(), "in the network, counted from 0: the sender in its messages");
        define("MESSAGE_BYTES", length(node).to_string(), "length of the messages it sends");
        text + "\n"
    }

    fn names(&self) -> String {
        let (node, upper) = (self.node, &self.upper);
        let model = node.model();
        let neighbours: Vec<String> = node.neighbours.iter().map(|n| node.other(n).name.clone()).collect();
        let lists = [
            ("STATES", labels(&model.states)),
            ("INPUTS", labels(&model.inputs)),
            ("OUTPUTS", labels(&model.outputs)),
            ("LOADS", labels(&model.loads.signals)),
            ("NEIGHBOURS", neighbours),
        ];
        let mut text = format!(
            "/* Names, with units, to initialise an array with:\n     const char *const states[] = {upper}_STATES; */\n#define {upper}_NAME {}\n",
            in_quotes(&model.name)
        );
        for (name, names) in lists.into_iter().filter(|(_, names)| !names.is_empty()) {
            let names: Vec<String> = names.iter().map(|name| in_quotes(name)).collect();
            let _ = writeln!(text, "#define {upper}_{name} {{ {} }}", names.join(", "));
        }
        text + "\n"
    }

    fn structures(&self, sizes: &Sizes) -> String {
        let prefix = self.prefix;
        let structure = |name: &str, bytes: u64, doc: &str| {
            format!(
                "/* {doc} */\ntypedef struct {name} {{\n    uint64_t memory[{}]; /* {bytes} bytes, for the library alone */\n}} {name};\n\n",
                bytes.div_ceil(8)
            )
        };
        let mut text = structure(
            prefix,
            sizes.controller,
            &format!(
                "A controller and its inbox: all that it remembers. It begins with {prefix}_start; before, its contents do not matter.\n   It \
                 may be copied and moved within the process and the library that started it, and holds nothing that has to be given back. One thread at a time may use it."
            ),
        );
        if may_start(self.node) {
            text += &structure(
                &format!("{prefix}_start_plan"),
                sizes.plan,
                "This subsystem's part of a start-up plan. It must stay where it is, unchanged, and its points too, until the controller and its copies have passed its last step.",
            );
        }
        let _ = writeln!(
            text,
            "/* Bytes of these, by the library. */\nsize_t {prefix}_size(void);{}\n",
            if may_start(self.node) { format!("\nsize_t {prefix}_plan_size(void);") } else { String::new() }
        );
        text + &self.order()
    }

    /// What stands at which place of the arrays.
    fn order(&self) -> String {
        let model = self.node.model();
        let signals = [("x", &model.states), ("u, input", &model.inputs), ("set_point, y_ref, e", &model.outputs)];
        let loads = ("loads", &model.loads.signals);
        let all = signals.into_iter().chain((!self.node.loads().is_empty()).then_some(loads));
        let list: Vec<String> = all.map(|(names, signals)| format!("{names}: {}", self.list(signals))).collect();
        wrapped(&format!("What arrays hold. {}.", list.join("; "))) + "\n"
    }

    fn list(&self, signals: &[Signal]) -> String {
        comment(&labels(signals).join(", "))
    }

    /// An argument and what its entries are.
    fn array(&self, constant: bool, name: &str, size: &str) -> String {
        let of = if constant { "const " } else { "" };
        let upper = &self.upper;
        format!("{of}{} {name}[{upper}_{size}]", self.real())
    }

    fn loads(&self) -> Vec<String> {
        if self.node.loads().is_empty() { Vec::new() } else { vec![self.array(true, "loads", "ND")] }
    }

    fn message(&self) -> String {
        format!("uint8_t message[{}_MESSAGE_BYTES]", self.upper)
    }

    fn function(&self, doc: &str, verb: &str, arguments: Vec<String>) -> String {
        let doc = wrapped(doc);
        let prefix = self.prefix;
        let one = format!("int32_t {prefix}_{verb}({});", arguments.join(", "));
        let declaration = match one.len() {
            ..=100 => one,
            _ => format!("int32_t {prefix}_{verb}(\n    {});", arguments.join(",\n    ")),
        };
        format!("{doc}{declaration}\n\n")
    }

    fn starts(&self) -> String {
        let prefix = self.prefix;
        let network = &self.node.design.network;
        let outputs = network
            .subsystems
            .iter()
            .flat_map(|s| s.outputs.iter().map(move |y| format!("{} {}", s.name, labelled(y))));
        let outputs: Vec<String> = outputs.collect();
        let mut arguments = vec![self.array(true, "outputs", "NETWORK_NY")];
        let mut doc =
            "The state and input that this subsystem rests at when the outputs of the whole network rest at `outputs`"
                .to_owned();
        if self.node.network_loads() > 0 {
            doc += " under `loads`, those of the whole network";
            arguments.push(self.array(true, "loads", "NETWORK_ND"));
        }
        if outputs.len() <= MOST_NAMED {
            doc += &format!(", which are in this order: {}", outputs.join(", "));
        } else {
            doc += ", in the order of the network";
        }
        arguments.extend([self.array(false, "x", "NX"), self.array(false, "u", "NU")]);
        let mut text = self.function(&(doc + "."), "steady_state", arguments);
        let mut arguments = vec![
            format!("{prefix} *controller"),
            "size_t size".to_owned(),
            self.array(true, "x", "NX"),
            self.array(true, "u", "NU"),
        ];
        arguments.extend(self.loads());
        arguments.extend([self.message(), "int32_t *which".to_owned()]);
        let doc = format!(
            "Starts a controller whose references rest at the state `x` with the input `u`, and gives its first message to all who hear it. \
             `size` is sizeof({prefix}). `which`, unless NULL, is what a DPC_START_... code speaks of, else -1. The plant may be off by as much as \
             the first step's problem admits."
        );
        text += &self.function(&doc, "start", arguments);
        if may_start(self.node) {
            text += &self.plans();
        }
        text
    }

    fn plans(&self) -> String {
        let (prefix, upper) = (self.prefix, &self.upper);
        let real = self.real();
        let mut text = String::new();
        if self.node.design.start.is_some() {
            let _ = writeln!(
                text,
                "{}const {prefix}_start_plan *{prefix}_stated_plan(void);\n",
                wrapped("The plan for the start that the file of the network states.")
            );
            let mut arguments = vec![self.array(false, "x", "NX")];
            arguments.extend((!self.node.loads().is_empty()).then(|| self.array(false, "loads", "ND")));
            let doc = "The state, and the loads, that plan was made for.";
            text += &self.function(doc, "stated_start", arguments);
        }
        let arguments = vec![
            format!("{prefix}_start_plan *plan"),
            "size_t size".to_owned(),
            "uint32_t number".to_owned(),
            format!("const {real} *points"),
            "size_t count".to_owned(),
            self.array(true, "e", "NY"),
            self.array(true, "dx", "NX"),
            format!("const {real} du[{upper}_HORIZON * {upper}_NU]"),
        ];
        let doc = format!(
            "Makes a start-up plan of numbers that were computed elsewhere. `size` is sizeof({prefix}_start_plan); `number` is the same for all parts of \
             one plan of the network, not 0; `points` has `count` times {upper}_NX + {upper}_NU numbers, the planned state and input step by step, of which \
             there are more than {upper}_HORIZON; `e` is eref at the last; `dx` and `du` solve the first i-DPC problem: xhat_0 - xref_0 and \
             uhat_k - uref_k, step by step."
        );
        text += &self.function(&doc, "plan", arguments);
        let mut arguments =
            vec![format!("{prefix} *controller"), "size_t size".to_owned(), format!("const {prefix}_start_plan *plan")];
        arguments.extend(self.loads());
        arguments.extend([self.array(true, "x", "NX"), self.message(), "int32_t *which".to_owned()]);
        let doc = "Starts a controller at the measured state `x` with its part of a start-up plan, and gives its first message. All subsystems must start \
                   with their parts of the same plan.";
        text + &self.function(doc, "start_planned", arguments)
    }

    fn step(&self) -> String {
        let prefix = self.prefix;
        let controller = format!("{prefix} *controller");
        let (x, set_point) = (self.array(true, "x", "NX"), self.array(true, "set_point", "NY"));
        let (input, status) = (self.array(false, "input", "NU"), "dpc_status *status".to_owned());
        let mut arguments = vec![controller.clone(), x.clone(), set_point.clone()];
        arguments.extend(self.loads());
        arguments.extend([input.clone(), self.message(), status.clone()]);
        let doc = format!(
            "One period, every {:?} s: from the measured state, the set-point and the messages accepted since the last one to the input and to the \
             message for all who hear it. `status` may be NULL, but what it says matters.",
            self.node.design.network.sample_time
        );
        let mut text = self.function(&doc, "step", arguments);
        let doc = "The first half of a step: the input, which depends on no message and not on the set-point. Until the second half, calling it \
                   again replaces the answer. Of the status, the fields about control.";
        text += &self.function(doc, "input", vec![controller.clone(), x, input, status.clone()]);
        let mut arguments = vec![controller, set_point];
        arguments.extend(self.loads());
        arguments.extend([self.message(), status]);
        text + &self.function("The second half, which ends the period.", "references", arguments)
    }

    fn messages(&self) -> String {
        let (node, prefix) = (self.node, self.prefix);
        let mut text = "/* Bytes of the messages that this subsystem sends; numbers are little-endian:\n".to_owned();
        let table: Vec<(String, &str, String)> =
            parts(node).into_iter().map(|part| (part.place(), part.ty, comment(&part.what))).collect();
        let width = table.iter().map(|(place, ..)| place.len()).max().unwrap_or(0);
        for (place, ty, what) in table {
            let _ = writeln!(text, "     {place:<width$}  {ty:<3}  {what}");
        }
        text += "*/\n\n";
        if node.neighbours.is_empty() {
            return text;
        }
        let slots: Vec<String> =
            node.neighbours.iter().enumerate().map(|(slot, n)| format!("{slot} {}", node.other(n).name)).collect();
        let heard: Vec<String> = node
            .neighbours
            .iter()
            .map(|n| format!("{}_MESSAGE_BYTES", self.words.subsystems[n.j].to_uppercase()))
            .collect();
        let doc = format!(
            "Files a message of a neighbour ({}), whichever it is from; `bytes` may be anything, the right ones are {} long.",
            slots.iter().map(|slot| slot.split_once(' ').map_or("", |(_, name)| name)).collect::<Vec<_>>().join(", "),
            if heard.len() <= MOST_NAMED { heard.join(", ") } else { "as their senders' headers say".to_owned() }
        );
        text += &self.function(
            &doc,
            "accept",
            vec![format!("{prefix} *controller"), "const uint8_t *bytes".to_owned(), "size_t length".to_owned()],
        );
        let doc = format!(
            "What became of a neighbour's message at the last step: a DPC_DELIVERY_... code and, unless NULL, the step it was of where that is the \
             trouble. Neighbours: {}.",
            slots.join(", ")
        );
        text + &self.function(
            &doc,
            "delivery",
            vec![
                format!("const {prefix} *controller"),
                "uint32_t neighbour".to_owned(),
                "int32_t *code".to_owned(),
                "int64_t *step".to_owned(),
            ],
        )
    }

    /// Where there are constraints whose rows are redrawn while running.
    fn changing(&self) -> String {
        let (node, prefix) = (self.node, self.prefix);
        if node.changing.is_empty() {
            return String::new();
        }
        let mut text = "/* Coupling constraints that change, and the outputs that their rows are about, in this order: that of the network, so that\n   all members write a row alike.\n".to_owned();
        for (row, &h) in node.changing.iter().enumerate() {
            let constraint = node.changing_constraint(h);
            let members = constraint.members.iter().map(|&j| &node.design.network.subsystems[j]);
            let outputs: Vec<String> =
                members.flat_map(|s| s.outputs.iter().map(|y| format!("{} {}", s.name, labelled(y)))).collect();
            let _ = writeln!(
                text,
                "     {row}  {}: {} ({})",
                comment(&constraint.name),
                comment(&outputs.join(", ")),
                outputs.len()
            );
        }
        text += "*/\n\n";
        let doc = "What all members of a changing constraint know at this step: their reference outputs, all of them one after the other. To be asked for \
                   once the messages are there; a rule must draw its row from nothing else.";
        let real = self.real();
        text += &self.function(
            doc,
            "meeting",
            vec![
                format!("const {prefix} *controller"),
                "uint32_t row".to_owned(),
                format!("{real} *outputs"),
                "size_t length".to_owned(),
            ],
        );
        let doc = "Redraws a row for this step: normal . outputs <= limit, which is what the true outputs are to keep, without margins. To be called \
                   at every step between the messages and the references, or the row is not known to be shared; where it is refused, the one \
                   before stays in force. `which`, unless NULL, is the neighbour that DPC_REDRAW_NOT_HEARD speaks of, else -1.";
        text + &self.function(
            doc,
            "redraw",
            vec![
                format!("{prefix} *controller"),
                "uint32_t row".to_owned(),
                format!("const {real} *normal"),
                "size_t length".to_owned(),
                format!("{real} limit"),
                "int32_t *which".to_owned(),
            ],
        )
    }

    fn looking(&self) -> String {
        let (node, prefix) = (self.node, self.prefix);
        let signals = [("x_ref", "NX"), ("u_ref", "NU"), ("y_ref", "NY"), ("x_nom", "NX"), ("u_nom", "NU")];
        let mut arguments = vec![format!("const {prefix} *controller")];
        arguments.extend(signals.map(|(name, size)| self.array(false, name, size)));
        let doc = "The signals inside at the last step: references xref, uref, yref, and the nominal xhat, uhat. NULL for those that are not wanted.";
        let mut text = self.function(doc, "telemetry", arguments);
        let _ = writeln!(
            text,
            "/* What row k of the i-DPC problem asks, as control_row counts; NULL beyond the last. */\nconst char *{prefix}_row_name(uint32_t row);\n"
        );
        if node.sizes.nc + node.sizes.nh > 0 {
            let _ = writeln!(
                text,
                "/* Coupling constraint k, as references_row counts; NULL beyond the last. */\nconst char *{prefix}_constraint_name(uint32_t row);\n"
            );
        }
        text
    }
}

/// Names that are listed in a comment.
const MOST_NAMED: usize = 12;

/// `dpc_status`, with what comes before the numbers.
const STATUS: &str = "\
/* What a step says about itself. */
typedef struct dpc_status {
    int32_t control;          /* DPC_CONTROL_... */
    int32_t control_row;      /* row of the i-DPC problem that cannot be satisfied, or -1 */
    int32_t iterations;       /* changes of the solver's working set */
    int32_t active_rows;      /* rows that hold with equality */
    int32_t references;       /* DPC_REFERENCES_... */
    int32_t references_row;   /* coupling constraint that the references speak of, or -1 */
    int32_t messages_missing; /* neighbours whose message did not arrive in sequence */
    uint8_t guaranteed;       /* 1: all assumptions of Theorem 1 that this subsystem can see hold */
    uint8_t certified;        /* 1: the true state is known to be in its tube */
    uint8_t load_within;      /* 1: the loads keep their bounds and rates */
    uint8_t degraded;         /* 1: the guarantee was lost for good; start anew */
} dpc_status;

";

fn head(design: &Design, what: &str) -> String {
    let (what, file) = (comment(what), comment(&source_file(design)));
    format!(
        "/* {what}.\n   Written by dpc-codegen {} from {file}; do not edit. Numbers are in the units of {file}, as deviations from its\n   operating \
         point. Functions return DPC_OK or another number of dpc.h, and then have done nothing. */\n",
        env!("CARGO_PKG_VERSION")
    )
}

fn guarded(head: &str, guard: &str, includes: &str, text: &str) -> String {
    format!(
        "{head}#ifndef {guard}\n#define {guard}\n\n{includes}\n#ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n{text}#ifdef __cplusplus\n}}\n#endif\n\n#endif\n"
    )
}

/// A comment in lines of at most 120 letters.
fn wrapped(text: &str) -> String {
    let (mut lines, mut line) = (String::new(), "/*".to_owned());
    for word in comment(text).split_whitespace().chain(["*/"]) {
        if line.len() + word.len() + 1 > 120 {
            lines += &format!("{line}\n");
            line = "  ".to_owned();
        }
        line += &format!(" {word}");
    }
    lines + &line + "\n"
}
