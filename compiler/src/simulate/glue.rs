//! The crate around the emitted files of a network that is loaded as a shared library: one function per verb, for every subsystem.
//!
//! Both sides are Rust, but perhaps not of one compiler: so all calls have C's convention, all numbers are `f64`, and everything goes by
//! address and length.

use std::fmt::Write;

use crate::design::Design;
use crate::emit::Emitted;
use crate::network::Scalar;

/// Numbers that a status takes, and what each neighbour's delivery adds.
pub const STATUS: usize = 8;
pub const PER_NEIGHBOUR: usize = 2;

/// Text of `lib.rs`; the emitted files are in its module `controllers`.
pub fn library(design: &Design, emitted: &Emitted) -> String {
    let modules: Vec<&str> = emitted.files.iter().skip(1).map(|(name, _)| name.trim_end_matches(".rs")).collect();
    let (runtime, real) = match design.network.scalar {
        Scalar::Double => ("dpc_runtime", "f64"),
        Scalar::Single => ("dpc_runtime::single", "f32"),
    };
    let mut text = format!("{HEAD}use {runtime} as runtime;\ntype Scalar = {real};\n\n{COMMON}");
    for (i, module) in modules.iter().enumerate() {
        text += &node(design, i, module);
    }
    let arms =
        |call: &str| (0..modules.len()).map(|i| format!("        {i} => node_{i}::{call},\n")).collect::<String>();
    let _ = write!(
        text,
        "\nfn begin(i: usize, given: &Start<'_>, rest: &mut [f64], message: &mut Vec<u8>) -> Made {{\n    match i {{\n{}        _ => Err(\"no such subsystem\".into()),\n    }}\n}}\n",
        arms("begin(given, rest, message)")
    );
    text
}

/// The module of one subsystem.
fn node(design: &Design, i: usize, module: &str) -> String {
    let network = &design.network;
    let s = &network.subsystems[i];
    let loads = !s.loads.is_empty();
    let any_loads = network.subsystems.iter().any(|s| !s.loads.is_empty());
    let changing = network.changing_constraints.iter().any(|c| c.members.contains(&i));
    let all = if any_loads { ", &array(given.all_loads)" } else { "" };
    let (field, parts, argument) = if loads {
        ("    loads: own::Loads,\n", "controller, loads, first", ", &array(given.loads)")
    } else {
        ("", "controller, first", "")
    };
    let kept =
        if loads { "controller, inbox: own::Inbox::new(), loads" } else { "controller, inbox: own::Inbox::new()" };
    let planned = match &design.start {
        Some(_) => {
            let loads = if loads { "&array(given.loads), " } else { "" };
            format!(
                "        if given.planned {{\n            let ({parts}) = own::start_planned(&own::START, {loads}&array(given.x)).map_err(text)?;\n            \
                 message.extend(own::to_bytes(&first));\n            return Ok(Box::new(Process {{ {kept} }}));\n        }}\n"
            )
        }
        None => String::new(),
    };
    let step = if loads {
        "let load = self.loads.admit(&array(given.loads));\n            let step = self.controller.step_under(&array(given.x), &array(given.set_point), &load, &mut self.inbox);"
    } else {
        "let step = self.controller.step(&array(given.x), &array(given.set_point), &mut self.inbox);"
    };
    let redraw = if changing {
        "let row = own::HalfSpace { own: array(own_row), others: array(others), l: l as Scalar };\n            \
         self.controller.redraw(row_index, &self.inbox, |_| Some(row)).map_err(text)"
    } else {
        "let _ = (row_index, own_row, others, l);\n            Err(\"no constraint of this subsystem changes\".into())"
    };
    format!(
        "
mod node_{i} {{
    use super::controllers::{module} as own;
    use super::*;

    struct Process {{
        controller: own::Controller,
        inbox: own::Inbox,
    {field}    }}

    pub fn begin(given: &Start<'_>, rest: &mut [f64], message: &mut Vec<u8>) -> Made {{
{planned}        let steady = own::steady_state(&array(given.outputs){all});
        let ({parts}) = own::start(&steady{argument}).map_err(text)?;
        put(rest, &steady.x);
        message.extend(own::to_bytes(&first));
        Ok(Box::new(Process {{ {kept} }}))
    }}

    impl Node for Process {{
        fn accept(&mut self, bytes: &[u8]) -> Result<(), String> {{
            own::accept_bytes(&mut self.inbox, bytes).map_err(text)
        }}

        fn redraw(&mut self, row_index: usize, own_row: &[f64], others: &[f64], l: f64) -> Result<(), String> {{
            {redraw}
        }}

        fn step(&mut self, given: &Given<'_>, told: &mut [f64], message: &mut Vec<u8>, status: &mut [i64]) {{
            {step}
            let told_of = &step.telemetry;
            let all = [&step.input[..], &told_of.x_ref, &told_of.u_ref, &told_of.y_ref, &told_of.x_nom, &told_of.u_nom].concat();
            put(told, &all);
            message.extend(own::to_bytes(&step.message));
            put_status(status, &step.status);
        }}
    }}
}}
"
    )
}

const HEAD: &str = "\
//! The controllers of a network, for a program that simulates them. Written by dpc-codegen.

#[forbid(unsafe_code)]
#[allow(dead_code)]
mod controllers;

use std::slice::{from_raw_parts, from_raw_parts_mut};

use dpc_runtime::{Control, Delivery, References, Status};
#[allow(unused_imports)]
";

const COMMON: &str = r#"type Made = Result<Box<dyn Node>, String>;

struct Start<'a> {
    planned: bool,
    outputs: &'a [f64],
    #[allow(dead_code)]
    all_loads: &'a [f64],
    #[allow(dead_code)]
    loads: &'a [f64],
    #[allow(dead_code)]
    x: &'a [f64],
}

struct Given<'a> {
    x: &'a [f64],
    set_point: &'a [f64],
    #[allow(dead_code)]
    loads: &'a [f64],
}

trait Node {
    fn accept(&mut self, bytes: &[u8]) -> Result<(), String>;
    fn redraw(&mut self, row_index: usize, own_row: &[f64], others: &[f64], l: f64) -> Result<(), String>;
    fn step(&mut self, given: &Given<'_>, told: &mut [f64], message: &mut Vec<u8>, status: &mut [i64]);
}

fn array<const N: usize>(numbers: &[f64]) -> [Scalar; N] {
    std::array::from_fn(|k| numbers[k] as Scalar)
}

fn put(places: &mut [f64], numbers: &[Scalar]) {
    places.iter_mut().zip(numbers).for_each(|(place, number)| *place = f64::from(*number));
}

fn text(error: impl std::fmt::Display) -> String {
    error.to_string()
}

fn put_status<const NB: usize>(places: &mut [i64], status: &Status<NB>) {
    let control = match status.control {
        Control::AtReference => [0, 0, 0],
        Control::Optimal { iterations, active } => [1, iterations as i64, active as i64],
        Control::Candidate => [2, 0, 0],
        Control::Infeasible { row } => [3, row as i64, 0],
        Control::IterationLimit => [4, 0, 0],
        Control::NotFinite => [5, 0, 0],
    };
    let references = match status.references {
        References::Nearest => [0, 0],
        References::Planned => [1, 0],
        References::OffPlan => [2, 0],
        References::SetPointNotFinite => [3, 0],
        References::Kept => [4, 0],
        References::Waiting => [5, 0],
        References::Undrawn { row } => [6, row as i64],
        References::Blocked { row } => [7, row as i64],
        References::Deadlock { row } => [8, row as i64],
        References::CouplingExceeded { row } => [9, row as i64],
        References::NotSteady => [10, 0],
    };
    let flags = [status.certified, status.load_within, status.degraded].map(i64::from);
    let deliveries = status.deliveries.iter().flat_map(|delivery| match delivery {
        Delivery::InSequence => [0, 0],
        Delivery::Missing => [1, 0],
        Delivery::OutOfSequence(step) => [2, *step],
        Delivery::NotFinite => [3, 0],
        Delivery::OtherDesign => [4, 0],
        Delivery::Unreadable => [5, 0],
    });
    let all = control.into_iter().chain(references).chain(flags).chain(deliveries);
    places.iter_mut().zip(all).for_each(|(place, number)| *place = number);
}

/// Numbers at an address.
#[repr(C)]
pub struct Numbers {
    data: *const f64,
    length: usize,
}

/// Room at an address, and how much of it was filled.
#[repr(C)]
pub struct Room<T> {
    data: *mut T,
    length: usize,
    filled: usize,
}

impl Numbers {
    fn all(&self) -> &[f64] {
        unsafe { from_raw_parts(self.data, self.length) }
    }
}

impl<T> Room<T> {
    fn all(&mut self) -> &mut [T] {
        unsafe { from_raw_parts_mut(self.data, self.length) }
    }
}

impl Room<u8> {
    fn fill(&mut self, bytes: &[u8]) {
        self.filled = bytes.len();
        self.all().iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
    }
}

fn told(outcome: Result<(), String>, why: &mut Room<u8>) -> bool {
    outcome.inspect_err(|error| why.fill(error.as_bytes())).is_ok()
}

#[unsafe(no_mangle)]
pub extern "C" fn dpc_node_start(
    i: usize,
    planned: bool,
    given: &[Numbers; 4],
    rest: &mut Room<f64>,
    message: &mut Room<u8>,
    why: &mut Room<u8>,
) -> *mut Box<dyn Node> {
    let [outputs, all_loads, loads, x] = given.each_ref().map(Numbers::all);
    let given = Start { planned, outputs, all_loads, loads, x };
    let mut bytes = Vec::new();
    match begin(i, &given, rest.all(), &mut bytes) {
        Ok(node) => {
            message.fill(&bytes);
            Box::into_raw(Box::new(node))
        }
        Err(error) => {
            why.fill(error.as_bytes());
            std::ptr::null_mut()
        }
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dpc_node_accept(node: *mut Box<dyn Node>, bytes: *const u8, length: usize, why: &mut Room<u8>) -> bool {
    let (node, bytes) = unsafe { (&mut *node, from_raw_parts(bytes, length)) };
    told(node.accept(bytes), why)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dpc_node_redraw(
    node: *mut Box<dyn Node>,
    row: usize,
    own: &Numbers,
    others: &Numbers,
    l: f64,
    why: &mut Room<u8>,
) -> bool {
    let node = unsafe { &mut *node };
    told(node.redraw(row, own.all(), others.all(), l), why)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dpc_node_step(
    node: *mut Box<dyn Node>,
    given: &[Numbers; 3],
    told: &mut Room<f64>,
    message: &mut Room<u8>,
    status: &mut Room<i64>,
) {
    let node = unsafe { &mut *node };
    let [x, set_point, loads] = given.each_ref().map(Numbers::all);
    let mut bytes = Vec::new();
    node.step(&Given { x, set_point, loads }, told.all(), &mut bytes, status.all());
    message.fill(&bytes);
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dpc_node_end(node: *mut Box<dyn Node>) {
    drop(unsafe { Box::from_raw(node) });
}
"#;
