//! The functions of an emitted file as a static library offers them, for what measures such a library.

use std::fmt::Write;

use super::code::{link_name, runtime};
use super::names::module_names;
use super::node::{Neighbour, Node};
use super::starts::may_start;
use crate::design::Design;

/// Arrays of zeros as large as what a node remembers from step to step: the controller, with its loads, and the inbox.
pub const CONTROLLER: &str = "dpc_controller";
pub const INBOX: &str = "dpc_inbox";

/// Prefix of everything that runs at every step.
pub const PERIODIC: [&str; 3] = ["dpc_accept", "dpc_redraw", "dpc_step"];
/// Prefix of what runs before.
pub const INITIAL: [&str; 2] = ["dpc_start", "dpc_rest"];

/// The root of a crate without a standard library whose module `controller`, in `file`, is what was emitted for subsystem `i`.
/// Every function of the module has an entry with C's calling convention; everything is passed by address.
pub fn library(design: &Design, i: usize, file: &str) -> String {
    let node = Node::new(design, i);
    let (runtime, real) = (runtime(&node).to_string().replace(' ', ""), node.scalar().name());
    let mut text = format!(
        "#![no_std]\n#![allow(improper_ctypes_definitions, reason = \"both sides are Rust\")]\n\
         use core::mem::MaybeUninit;\nuse controller::*;\nuse {runtime} as runtime;\ntype Scalar = {real};\n\
         #[forbid(unsafe_code)]\n#[allow(unused)]\n#[allow(clippy::all)]\n#[path = {file:?}]\npub mod controller;\n"
    );
    let loads = if node.loads().is_empty() { "" } else { " + size_of::<Loads>()" };
    for (name, ty, more) in [(CONTROLLER, "Controller", loads), (INBOX, "Inbox", "")] {
        let _ = writeln!(text, "#[unsafe(no_mangle)]\npub static {name}: [u8; size_of::<{ty}>(){more}] = [0; _];");
    }
    text += &start(&node);
    let modules = module_names(design.network.subsystems.iter().map(|s| s.name.as_str()));
    for (slot, neighbour) in node.neighbours.iter().enumerate() {
        text += &accept(&node, slot, neighbour, &link_name(&modules[neighbour.j]));
    }
    text += if node.sizes.nh > 0 { REDRAW } else { "" };
    text += if node.loads().is_empty() { STEP } else { STEP_UNDER };
    text
}

/// Everything that makes a controller.
fn start(node: &Node) -> String {
    let loads = !node.loads().is_empty();
    let all_loads = node.network_loads() > 0;
    let rest = if all_loads { ("all: &[Scalar; NETWORK_ND], ", ", all") } else { ("", "") };
    let given = if loads { "loads: &[Scalar; ND], " } else { "" };
    let [start, planned] = if loads { ["steady, loads", "plan, loads, x"] } else { ["steady", "plan, x"] };
    let mut text = format!(
        "#[unsafe(no_mangle)]\npub extern \"C\" fn dpc_rest(outputs: &[Scalar; NETWORK_NY], {}to: &mut SteadyState) {{\n    \
         *to = steady_state(outputs{});\n}}\n",
        rest.0, rest.1
    );
    text +=
        &made("dpc_start(", &format!("steady: &SteadyState, {given}"), "Controller", &format!("start({start})"), loads);
    if may_start(node) {
        let arguments = format!("plan: &'a StartPlan<'a>, {given}x: &[Scalar; NX], ");
        let made = made(
            "dpc_start_planned<'a>(",
            &arguments,
            "PlannedController<'a>",
            &format!("start_planned({planned})"),
            loads,
        );
        text += &made;
    }
    text
}

fn made(name: &str, arguments: &str, controller: &str, call: &str, loads: bool) -> String {
    let (to, parts, write) = match loads {
        true => ("l: &mut MaybeUninit<Loads>, ", "(a, b, d)", "l.write(b); "),
        false => ("", "(a, d)", ""),
    };
    format!(
        "#[unsafe(no_mangle)]\npub extern \"C\" fn {name}{arguments}c: &mut MaybeUninit<{controller}>, {to}m: &mut \
         MaybeUninit<Message>) -> bool {{\n    let Ok({parts}) = {call} else {{ return false }};\n    \
         c.write(a); {write}m.write(d);\n    true\n}}\n"
    )
}

fn accept(node: &Node, slot: usize, neighbour: &Neighbour, link: &str) -> String {
    let other = node.other(neighbour);
    format!(
        "#[unsafe(no_mangle)]\npub extern \"C\" fn dpc_accept_{slot}(inbox: &mut Inbox, message: &runtime::Message<{}, {}>) -> \
         bool {{\n    inbox.accept(&{link}, message).is_ok()\n}}\n",
        other.p(),
        other.nz(),
    )
}

const STEP: &str = "\
#[unsafe(no_mangle)]
pub extern \"C\" fn dpc_step(
    controller: &mut Controller,
    x: &[Scalar; NX],
    set_point: &[Scalar; NY],
    inbox: &mut Inbox,
    answer: &mut MaybeUninit<Step>,
) {
    answer.write(controller.step(x, set_point, inbox));
}
";

const STEP_UNDER: &str = "\
#[unsafe(no_mangle)]
pub extern \"C\" fn dpc_step(
    controller: &mut Controller,
    x: &[Scalar; NX],
    set_point: &[Scalar; NY],
    measured: &[Scalar; ND],
    loads: &mut Loads,
    inbox: &mut Inbox,
    answer: &mut MaybeUninit<Step>,
) {
    let load = loads.admit(measured);
    answer.write(controller.step_under(x, set_point, &load, inbox));
}
";

/// With rows that were made elsewhere: the rule is the user's.
const REDRAW: &str = "\
#[unsafe(no_mangle)]
pub extern \"C\" fn dpc_redraw(controller: &mut Controller, inbox: &Inbox, rows: &[Option<HalfSpace>; NH]) -> bool {
    redraw(controller, inbox, |row, _| rows.get(row).copied().flatten()).iter().all(Result::is_ok)
}
";
