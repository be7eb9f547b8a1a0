//! The numbers that functions of the C interface return and write, and what they mean: for the header and for the crate.

use std::fmt::Write;

use super::words::c_string;

/// Numbers of one kind.
pub struct Codes {
    /// `control`: of the function that gives the sentence.
    pub name: &'static str,
    /// What they are, as a comment.
    pub what: &'static str,
    pub codes: &'static [Code],
}

/// Name, number, and what it means.
pub type Code = (&'static str, i32, &'static str);

pub const ALL: [Codes; 4] = [
    Codes {
        name: "result",
        what: "What every function returns. Unless it is DPC_OK, nothing was changed or written, but that the next status tells of a message that was refused, or that it is missing where its sender could not be told.",
        codes: &RESULTS,
    },
    Codes {
        name: "control",
        what: "dpc_status.control: how the input of a step came about. The guarantee of Theorem 1 holds for 1, 2 and 3.",
        codes: &CONTROLS,
    },
    Codes {
        name: "references",
        what: "dpc_status.references: how the references of a step came about.",
        codes: &REFERENCES,
    },
    Codes { name: "delivery", what: "What became of a neighbour's message that a step needed.", codes: &DELIVERIES },
];

const RESULTS: [Code; 31] = [
    ("DPC_OK", 0, "done"),
    ("DPC_NULL", 1, "an address is NULL that must not be"),
    ("DPC_SIZE", 2, "the size of the structure is not the library's: header and library are of different builds"),
    ("DPC_MISALIGNED", 3, "an address is not aligned for its type"),
    ("DPC_NOT_STARTED", 4, "the structure holds no controller, or no plan, of this subsystem; it was not started"),
    ("DPC_LENGTH", 5, "an array has another length than is asked for"),
    ("DPC_NO_SUCH_NEIGHBOUR", 6, "there is no such neighbour"),
    ("DPC_START_NOT_FINITE", 16, "a number of the start is not finite"),
    ("DPC_START_OUTPUT_OUTSIDE", 17, "the output to rest at lies outside Y"),
    ("DPC_START_INPUT_OUTSIDE", 18, "an input to rest at lies outside its limits; `which` is its index"),
    ("DPC_START_INPUT_OUT_OF_REACH", 19, "the gain Ke reaches no reference with the steady state's input"),
    ("DPC_START_LOAD_OUTSIDE", 20, "a load lies outside its bounds; `which` is its index"),
    ("DPC_START_OTHER_DESIGN", 21, "the start-up plan belongs to another subsystem or another design"),
    ("DPC_START_PLAN_TOO_SHORT", 22, "the start-up plan is shorter than the horizon"),
    ("DPC_START_CHANGING_CONSTRAINTS", 23, "start-up plans know no changing coupling constraints"),
    ("DPC_START_NO_PLAN", 24, "the start-up plan has the number 0"),
    (
        "DPC_START_STATE_DOES_NOT_FIT",
        25,
        "the measured state does not fit the start-up plan; `which` is the row of the first problem",
    ),
    ("DPC_START_UNDECIDED", 26, "the iteration budget was used up before the measured state was seen to fit"),
    ("DPC_MESSAGE_LENGTH", 32, "the message has another length than the neighbour's"),
    ("DPC_MESSAGE_LAYOUT", 33, "the message is in another layout: its sender has another version"),
    ("DPC_MESSAGE_SCALAR", 34, "the message is of a controller that computes in another scalar type"),
    ("DPC_MESSAGE_DESIGN", 35, "the message is of a controller of another design"),
    ("DPC_MESSAGE_SENDER", 36, "the message is of a subsystem that this one does not hear"),
    ("DPC_MESSAGE_MALFORMED", 37, "the message has sizes or flags that no sender writes"),
    ("DPC_MESSAGE_NOT_FINITE", 38, "the message holds a number that is not finite"),
    ("DPC_MESSAGE_OUT_OF_SEQUENCE", 39, "the message is neither of the step expected next nor of the one after"),
    ("DPC_REDRAW_NO_SUCH_ROW", 48, "there is no such changing constraint"),
    ("DPC_REDRAW_NOT_HEARD", 49, "the message of a member is missing"),
    ("DPC_REDRAW_NOT_FINITE", 50, "the row holds a number that is not finite"),
    ("DPC_REDRAW_NOT_MEMBER", 51, "the row has a coefficient on an output of a subsystem that is no member"),
    (
        "DPC_REDRAW_EXCEEDED",
        52,
        "the row does not hold for the references now, with its margin; the one before stays in force",
    ),
];

const CONTROLS: [Code; 7] = [
    ("DPC_CONTROL_NONE", 0, "no input was asked for in this period"),
    ("DPC_CONTROL_AT_REFERENCE", 1, "at reference: nothing had to be solved"),
    ("DPC_CONTROL_OPTIMAL", 2, "optimal: the i-DPC problem was solved"),
    ("DPC_CONTROL_CANDIDATE", 3, "no solution found, shifted candidate is feasible"),
    ("DPC_CONTROL_INFEASIBLE", 4, "infeasible, shifted candidate used; control_row cannot be satisfied"),
    ("DPC_CONTROL_ITERATION_LIMIT", 5, "iteration budget used up, shifted candidate is not feasible"),
    ("DPC_CONTROL_NOT_FINITE", 6, "measured state not finite, shifted candidate used without feedback"),
];

const REFERENCES: [Code; 12] = [
    ("DPC_REFERENCES_NONE", 0, "the period has not been ended"),
    ("DPC_REFERENCES_NEAREST", 1, "nearest to the set-point"),
    ("DPC_REFERENCES_PLANNED", 2, "those of the start-up plan; the set-point counts from its end on"),
    ("DPC_REFERENCES_SET_POINT_NOT_FINITE", 3, "set-point not finite, reference kept"),
    ("DPC_REFERENCES_KEPT", 4, "no reference found, kept"),
    ("DPC_REFERENCES_WAITING", 5, "kept until all members of the coupling constraints meet"),
    ("DPC_REFERENCES_BLOCKED", 6, "held up by coupling constraint references_row"),
    ("DPC_REFERENCES_DEADLOCK", 7, "held up by coupling constraint references_row, and nobody moves"),
    (
        "DPC_REFERENCES_UNDRAWN",
        8,
        "no row of changing constraint references_row was accepted yet; nothing is promised about it",
    ),
    ("DPC_REFERENCES_OFF_PLAN", 9, "the start-up plan does not fit the neighbours; the guarantee is lost"),
    ("DPC_REFERENCES_COUPLING_EXCEEDED", 10, "coupling constraint references_row is exceeded; the guarantee is lost"),
    ("DPC_REFERENCES_NOT_STEADY", 11, "the start is not steady with the neighbours; the guarantee is lost"),
];

const DELIVERIES: [Code; 6] = [
    ("DPC_DELIVERY_MISSING", 0, "nothing arrived"),
    ("DPC_DELIVERY_IN_SEQUENCE", 1, "it arrived in time"),
    ("DPC_DELIVERY_OUT_OF_SEQUENCE", 2, "only a message of another step arrived"),
    ("DPC_DELIVERY_NOT_FINITE", 3, "it held a number that is not finite"),
    ("DPC_DELIVERY_OTHER_DESIGN", 4, "bytes came from a controller of another design"),
    ("DPC_DELIVERY_UNREADABLE", 5, "bytes came that are no message of this neighbour"),
];

/// The constants in Rust, and the functions `<network>_<kind>_text`.
pub fn in_rust(network: &str) -> String {
    let mut text = String::new();
    for codes in &ALL {
        let _ = writeln!(text, "// {}", codes.what);
        for (name, number, _) in codes.codes {
            let _ = writeln!(text, "pub const {name}: i32 = {number};");
        }
        let arms: String =
            codes.codes.iter().map(|(name, _, what)| format!("        {name} => c{},\n", c_string(what))).collect();
        let _ = writeln!(
            text,
            "\n#[unsafe(no_mangle)]\npub extern \"C\" fn {network}_{}_text(code: i32) -> *const c_char {{\n    let text = match code {{\n{arms}        \
             _ => return core::ptr::null(),\n    }};\n    text.as_ptr()\n}}\n",
            codes.name,
        );
    }
    text
}

/// `#define`s for the header.
pub fn in_c() -> String {
    let mut text = String::new();
    for codes in &ALL {
        let _ = writeln!(text, "/* {} */", codes.what);
        for (name, number, what) in codes.codes {
            let _ = writeln!(text, "#define {name} {number} /* {what} */");
        }
        text.push('\n');
    }
    text
}
