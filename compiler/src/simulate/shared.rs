//! The emitted controllers, loaded from a shared library.
//!
//! The only file of the compiler with `unsafe` in it: calls into code that was compiled from [`glue`]. What makes them sound is that
//! [`Library`] is the only maker of such files, names them after a hash of their source, and that this file and [`glue`] state the
//! same types.
#![expect(unsafe_code, reason = "calls into a library that is loaded at run time")]

use std::ffi::c_void;
use std::sync::Arc;

use dpc_runtime::{Control, Delivery, References};
use libloading::Symbol;
use nalgebra::DVector;

use super::controllers::{Answer, Controller, Controllers, Given, HalfSpace, Sent, Started};
use super::glue::{PER_NEIGHBOUR, STATUS};
use super::history::Status;
use super::library::Library;
use super::scenario::Start;
use crate::design::Design;
use crate::emit::{Heard, hears};

/// The controllers of one network.
pub struct Shared {
    entries: Arc<Entries>,
    shapes: Vec<Shape>,
}

/// Of one subsystem.
#[derive(Debug, Clone)]
struct Shape {
    n: usize,
    m: usize,
    p: usize,
    nz: usize,
    /// Imported outputs.
    imported: usize,
    heard: Vec<Heard>,
    /// Of a number in a message.
    bytes: usize,
}

/// Numbers at an address, as the library declares them.
#[repr(C)]
struct Numbers {
    data: *const f64,
    length: usize,
}

/// Room at an address, and how much of it was filled.
#[repr(C)]
struct Room<T> {
    data: *mut T,
    length: usize,
    filled: usize,
}

type Node = *mut c_void;
type StartFn = extern "C" fn(usize, bool, &[Numbers; 4], &mut Room<f64>, &mut Room<u8>, &mut Room<u8>) -> Node;
type AcceptFn = unsafe extern "C" fn(Node, *const u8, usize, &mut Room<u8>) -> bool;
type RedrawFn = unsafe extern "C" fn(Node, usize, &Numbers, &Numbers, f64, &mut Room<u8>) -> bool;
type StepFn = unsafe extern "C" fn(Node, &[Numbers; 3], &mut Room<f64>, &mut Room<u8>, &mut Room<i64>);
type EndFn = unsafe extern "C" fn(Node);

/// The functions of a library, which stays loaded for as long as they are there.
struct Entries {
    start: StartFn,
    accept: AcceptFn,
    redraw: RedrawFn,
    step: StepFn,
    end: EndFn,
    _library: libloading::Library,
}

/// Longest reason that is given, in bytes; longer ones are cut.
const WHY: usize = 512;

/// Bytes of a message before its numbers.
const HEADER: usize = dpc_runtime::HEADER_BYTES;

impl Shared {
    /// Loads a library that was built.
    ///
    /// # Errors
    /// What the system reports, as text for the user.
    pub fn load(library: &Library, design: &Design) -> Result<Self, String> {
        let entries = Entries::load(library)
            .map_err(|error| format!("error: cannot load {}: {error}", library.file.display()))?;
        let network = &design.network;
        let shape = |i: usize| {
            let s = &network.subsystems[i];
            let heard = hears(design, i);
            let imported = heard.iter().filter(|heard| heard.outputs.is_some());
            let imported = imported.map(|heard| network.subsystems[heard.subsystem].p()).sum();
            Shape { n: s.n(), m: s.m(), p: s.p(), nz: s.nz(), imported, heard, bytes: network.scalar.bytes() }
        };
        let shapes = (0..network.subsystems.len()).map(shape).collect();
        Ok(Self { entries: Arc::new(entries), shapes })
    }
}

impl Entries {
    fn load(library: &Library) -> Result<Self, libloading::Error> {
        // SAFETY: the file was compiled from `glue` by `Library`, whose name is a hash of its source: it has these functions with these
        // types, and nothing runs when it is loaded.
        unsafe {
            let library = libloading::Library::new(&library.file)?;
            let start: Symbol<StartFn> = library.get(b"dpc_node_start\0")?;
            let accept: Symbol<AcceptFn> = library.get(b"dpc_node_accept\0")?;
            let redraw: Symbol<RedrawFn> = library.get(b"dpc_node_redraw\0")?;
            let step: Symbol<StepFn> = library.get(b"dpc_node_step\0")?;
            let end: Symbol<EndFn> = library.get(b"dpc_node_end\0")?;
            let (start, accept, redraw, step, end) = (*start, *accept, *redraw, *step, *end);
            Ok(Self { start, accept, redraw, step, end, _library: library })
        }
    }
}

impl Controllers for Shared {
    fn start(&mut self, i: usize, start: &Start) -> Result<Started, String> {
        let shape = self.shapes[i].clone();
        let flat = |vectors: &[DVector<f64>]| vectors.iter().flat_map(|v| v.iter().copied()).collect::<Vec<f64>>();
        let zeros: Vec<f64> = self.shapes.iter().flat_map(|shape| vec![0.0; shape.p]).collect();
        let (planned, outputs, loads, x) = match start {
            Start::Rest { outputs, loads, .. } => (false, flat(outputs), loads, vec![0.0; shape.n]),
            Start::Planned(start) => (true, zeros, &start.d0, start.x0[i].as_slice().to_vec()),
        };
        let (all_loads, loads) = (flat(loads), loads[i].as_slice());
        let given = [Numbers::of(&outputs), Numbers::of(&all_loads), Numbers::of(loads), Numbers::of(&x)];
        let (mut rest, mut message, mut why) = (vec![0.0; shape.n], vec![0; shape.message()], vec![0; WHY]);
        let mut reason = Room::of(&mut why);
        let node = (self.entries.start)(
            i,
            planned,
            &given,
            &mut Room::of(&mut rest),
            &mut Room::of(&mut message),
            &mut reason,
        );
        let filled = reason.filled;
        if node.is_null() {
            return Err(words(&why, filled));
        }
        let message = shape.sent(message);
        let rest = (!planned).then(|| DVector::from_vec(rest));
        let controller = Box::new(Loaded { node, shape, entries: self.entries.clone() });
        Ok(Started { controller, message, rest })
    }
}

/// A controller in the library's memory.
struct Loaded {
    node: Node,
    shape: Shape,
    entries: Arc<Entries>,
}

impl Controller for Loaded {
    fn accept(&mut self, _from: usize, message: &[u8]) -> Result<(), String> {
        let mut why = vec![0; WHY];
        let mut reason = Room::of(&mut why);
        // SAFETY: `node` came from `start` and was not ended; the message is as long as is said.
        let accepted = unsafe { (self.entries.accept)(self.node, message.as_ptr(), message.len(), &mut reason) };
        let filled = reason.filled;
        if accepted { Ok(()) } else { Err(words(&why, filled)) }
    }

    fn redraw(&mut self, row: usize, drawn: &HalfSpace) -> Result<(), String> {
        let mut others = vec![0.0; self.shape.imported];
        for (j, theirs) in &drawn.others {
            let heard = self.shape.heard.iter().find(|heard| heard.subsystem == *j);
            let first = heard.and_then(|heard| heard.outputs).ok_or("a member is not heard")?;
            others.iter_mut().skip(first).zip(theirs).for_each(|(place, entry)| *place = *entry);
        }
        let mut why = vec![0; WHY];
        let mut reason = Room::of(&mut why);
        let (own, others) = (Numbers::of(&drawn.own), Numbers::of(&others));
        // SAFETY: `node` came from `start` and was not ended.
        let redrawn = unsafe { (self.entries.redraw)(self.node, row, &own, &others, drawn.l, &mut reason) };
        let filled = reason.filled;
        if redrawn { Ok(()) } else { Err(words(&why, filled)) }
    }

    fn step(&mut self, given: &Given<'_>) -> Answer {
        let Shape { n, m, p, .. } = self.shape;
        let given = [Numbers::of(given.x), Numbers::of(given.set_point), Numbers::of(given.loads)];
        let mut told = vec![0.0; m + n + m + p + n + m];
        let mut message = vec![0; self.shape.message()];
        let mut status = vec![0; STATUS + PER_NEIGHBOUR * self.shape.heard.len()];
        let (mut all, mut bytes, mut words) = (Room::of(&mut told), Room::of(&mut message), Room::of(&mut status));
        // SAFETY: `node` came from `start` and was not ended; states, set-points and loads are as many as its subsystem has.
        unsafe { (self.entries.step)(self.node, &given, &mut all, &mut bytes, &mut words) };
        let mut told = told.into_iter();
        let mut next = |count: usize| told.by_ref().take(count).collect::<Vec<f64>>();
        let (input, x_ref, u_ref, y_ref) = (next(m), next(n), next(m), next(p));
        let (x_nom, u_nom) = (next(n), next(m));
        let message = self.shape.sent(message);
        Answer { input, message, status: read_status(&status), x_ref, u_ref, y_ref, x_nom, u_nom }
    }
}

impl Drop for Loaded {
    fn drop(&mut self) {
        // SAFETY: `node` came from `start`, and is not used again.
        unsafe { (self.entries.end)(self.node) };
    }
}

impl Shape {
    /// Bytes of a message.
    fn message(&self) -> usize {
        HEADER + self.bytes * (self.p + self.nz)
    }

    fn sent(&self, bytes: Vec<u8>) -> Sent {
        let numbers = bytes[HEADER..].chunks(self.bytes).take(self.p);
        let y_ref = numbers.map(|number| match number {
            [a, b, c, d] => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
            number => number.try_into().map_or(f64::NAN, f64::from_le_bytes),
        });
        let y_ref = y_ref.collect();
        Sent { bytes, y_ref }
    }
}

impl Numbers {
    /// For as long as the slice is there.
    fn of(numbers: &[f64]) -> Self {
        Self { data: numbers.as_ptr(), length: numbers.len() }
    }
}

impl<T> Room<T> {
    fn of(room: &mut [T]) -> Self {
        Self { data: room.as_mut_ptr(), length: room.len(), filled: 0 }
    }
}

fn words(why: &[u8], filled: usize) -> String {
    String::from_utf8_lossy(&why[..filled.min(why.len())]).into_owned()
}

/// What `put_status` of the library writes.
fn read_status(numbers: &[i64]) -> Status {
    let count = |k: usize| usize::try_from(numbers[k]).unwrap_or(usize::MAX);
    let control = match numbers[0] {
        0 => Control::AtReference,
        1 => Control::Optimal { iterations: count(1), active: count(2) },
        2 => Control::Candidate,
        3 => Control::Infeasible { row: count(1) },
        4 => Control::IterationLimit,
        _ => Control::NotFinite,
    };
    let row = count(4);
    let references = match numbers[3] {
        0 => References::Nearest,
        1 => References::Planned,
        2 => References::OffPlan,
        3 => References::SetPointNotFinite,
        4 => References::Kept,
        5 => References::Waiting,
        6 => References::Undrawn { row },
        7 => References::Blocked { row },
        8 => References::Deadlock { row },
        9 => References::CouplingExceeded { row },
        _ => References::NotSteady,
    };
    let delivery = |pair: &[i64]| match pair[0] {
        0 => Delivery::InSequence,
        1 => Delivery::Missing,
        2 => Delivery::OutOfSequence(pair[1]),
        3 => Delivery::NotFinite,
        4 => Delivery::OtherDesign,
        _ => Delivery::Unreadable,
    };
    let [certified, load_within, degraded] = [5, 6, 7].map(|k| numbers[k] != 0);
    let deliveries = numbers[STATUS..].chunks_exact(PER_NEIGHBOUR).map(delivery).collect();
    Status { control, references, deliveries, certified, load_within, degraded }
}
