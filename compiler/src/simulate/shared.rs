//! The emitted controllers behind their C interface, loaded from a shared library.
//!
//! The only file of the compiler with `unsafe` in it. What makes it sound: [`Library`] makes such files, from the package for C that the
//! compiler writes for the same design, under a name that is a hash of its source. So the functions that are looked up here have the
//! types that `emit::c` gives them, and arrays are as long as the design's signals.
#![expect(unsafe_code, reason = "calls into a library that is loaded at run time")]

use std::ffi::{CStr, c_char, c_void};
use std::sync::Arc;

use dpc_runtime::{Control, Delivery, References};
use nalgebra::DVector;

use super::controllers::{Answer, Controller, Controllers, Given, HalfSpace, Sent, Started};
use super::history::Status;
use super::library::Library;
use super::reals::Reals;
use super::scenario::Start;
use crate::design::Design;
use crate::emit::hears;
use crate::network::Scalar;

/// The controllers of one network.
pub struct Shared {
    nodes: Vec<Arc<Node>>,
}

/// Numbers, messages, structures.
type In = *const c_void;
type Out = *mut c_void;

/// A function that takes loads where the subsystem, or the network, has any.
enum Loaded<Without, With> {
    Without(Without),
    With(With),
}

type SizeFn = extern "C" fn() -> usize;
type SteadyFn = Loaded<unsafe extern "C" fn(In, Out, Out) -> i32, unsafe extern "C" fn(In, In, Out, Out) -> i32>;
type StartFn = Loaded<
    unsafe extern "C" fn(Out, usize, In, In, Out, *mut i32) -> i32,
    unsafe extern "C" fn(Out, usize, In, In, In, Out, *mut i32) -> i32,
>;
type PlannedFn = Loaded<
    unsafe extern "C" fn(Out, usize, In, In, Out, *mut i32) -> i32,
    unsafe extern "C" fn(Out, usize, In, In, In, Out, *mut i32) -> i32,
>;
type PlanFn = extern "C" fn() -> In;
type AcceptFn = unsafe extern "C" fn(Out, In, usize) -> i32;
type DeliveryFn = unsafe extern "C" fn(Out, u32, *mut i32, *mut i64) -> i32;
type StepFn = Loaded<
    unsafe extern "C" fn(Out, In, In, Out, Out, *mut Word) -> i32,
    unsafe extern "C" fn(Out, In, In, In, Out, Out, *mut Word) -> i32,
>;
type RedrawFn = Loaded<
    unsafe extern "C" fn(Out, u32, In, usize, f64, *mut i32) -> i32,
    unsafe extern "C" fn(Out, u32, In, usize, f32, *mut i32) -> i32,
>;
type TelemetryFn = unsafe extern "C" fn(Out, Out, Out, Out, Out, Out) -> i32;
type TextFn = extern "C" fn(i32) -> *const c_char;

/// `dpc_status` of the header.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
struct Word {
    control: i32,
    control_row: i32,
    iterations: i32,
    active_rows: i32,
    references: i32,
    references_row: i32,
    messages_missing: i32,
    guaranteed: u8,
    certified: u8,
    load_within: u8,
    degraded: u8,
}

/// The functions and sizes of one subsystem. The library stays loaded for as long as one of them is there.
struct Node {
    size: SizeFn,
    steady: SteadyFn,
    start: StartFn,
    planned: Option<(PlannedFn, PlanFn)>,
    accept: Option<AcceptFn>,
    delivery: Option<DeliveryFn>,
    redraw: Option<RedrawFn>,
    step: StepFn,
    telemetry: TelemetryFn,
    text: TextFn,
    scalar: Scalar,
    n: usize,
    m: usize,
    p: usize,
    nz: usize,
    /// Neighbours that it hears.
    heard: usize,
    _library: Arc<libloading::Library>,
}

/// Bytes of a message before its numbers.
const HEADER: usize = dpc_runtime::HEADER_BYTES;

impl Shared {
    /// Loads a library that was built.
    ///
    /// # Errors
    /// What the system reports, as text for the user.
    pub fn load(library: &Library, design: &Design) -> Result<Self, String> {
        let failed = |error: libloading::Error| format!("error: cannot load {}: {error}", library.file.display());
        // SAFETY: nothing of such a library runs when it is loaded or unloaded.
        let loaded = Arc::new(unsafe { libloading::Library::new(&library.file) }.map_err(failed)?);
        let node = |(i, prefix): (usize, &String)| Node::load(&loaded, library, prefix, design, i).map(Arc::new);
        let nodes = library.prefixes.iter().enumerate().map(node).collect::<Result<_, _>>().map_err(failed)?;
        Ok(Self { nodes })
    }
}

impl Node {
    fn load(
        library: &Arc<libloading::Library>,
        built: &Library,
        prefix: &str,
        design: &Design,
        i: usize,
    ) -> Result<Self, libloading::Error> {
        let network = &design.network;
        let s = &network.subsystems[i];
        let (own_loads, any_loads) = (!s.loads.is_empty(), network.subsystems.iter().any(|s| !s.loads.is_empty()));
        let heard = hears(design, i).len();
        let changes = network.changing_constraints.iter().any(|c| c.members.contains(&i));
        let single = network.scalar == Scalar::Single;
        macro_rules! get {
            ($verb:literal) => {
                // SAFETY: the types are those of `emit::c`, for the same design.
                *unsafe { library.get(format!("{prefix}_{}\0", $verb).as_bytes()) }?
            };
        }
        macro_rules! loaded {
            ($loads:expr, $verb:literal) => {
                if $loads { Loaded::With(get!($verb)) } else { Loaded::Without(get!($verb)) }
            };
        }
        let text = format!("{}_result_text\0", built.network);
        Ok(Self {
            size: get!("size"),
            steady: loaded!(any_loads, "steady_state"),
            start: loaded!(own_loads, "start"),
            planned: match design.start {
                Some(_) => Some((loaded!(own_loads, "start_planned"), get!("stated_plan"))),
                None => None,
            },
            accept: if heard > 0 { Some(get!("accept")) } else { None },
            delivery: if heard > 0 { Some(get!("delivery")) } else { None },
            redraw: if changes { Some(loaded!(single, "redraw")) } else { None },
            step: loaded!(own_loads, "step"),
            telemetry: get!("telemetry"),
            // SAFETY: as above.
            text: *unsafe { library.get(text.as_bytes()) }?,
            scalar: network.scalar,
            n: s.n(),
            m: s.m(),
            p: s.p(),
            nz: s.nz(),
            heard,
            _library: library.clone(),
        })
    }

    fn zeros(&self, count: usize) -> Reals {
        Reals::zeros(self.scalar, count)
    }

    fn reals(&self, numbers: &[f64]) -> Reals {
        Reals::new(self.scalar, numbers)
    }

    fn message(&self) -> Vec<u8> {
        vec![0; HEADER + self.scalar.bytes() * (self.p + self.nz)]
    }

    fn sent(&self, bytes: Vec<u8>) -> Sent {
        let y_ref = Reals::read(self.scalar, &bytes[HEADER..], self.p);
        Sent { bytes, y_ref }
    }

    /// What a function returned.
    fn done(&self, code: i32, which: i32) -> Result<(), String> {
        if code == 0 {
            return Ok(());
        }
        let text = (self.text)(code);
        if text.is_null() {
            return Err(format!("code {code}"));
        }
        // SAFETY: not NULL, so a text that lives as long as the library.
        let text = unsafe { CStr::from_ptr(text) }.to_string_lossy();
        Err(if which < 0 { text.into_owned() } else { format!("{text}: {which}") })
    }
}

impl Controllers for Shared {
    fn start(&mut self, i: usize, start: &Start) -> Result<Started, String> {
        let node = self.nodes[i].clone();
        let memory = vec![0_u64; (node.size)().div_ceil(8)];
        let mut controller = Running { node, memory };
        match start {
            Start::Rest { outputs, loads, .. } => {
                let (rest, message) = controller.rest(&flat(outputs), &flat(loads), loads[i].as_slice())?;
                Ok(Started { controller: Box::new(controller), message, rest: Some(rest) })
            }
            Start::Planned(start) => {
                let message = controller.planned(start.x0[i].as_slice(), start.d0[i].as_slice())?;
                Ok(Started { controller: Box::new(controller), message, rest: None })
            }
        }
    }
}

fn flat(vectors: &[DVector<f64>]) -> Vec<f64> {
    vectors.iter().flat_map(|v| v.iter().copied()).collect()
}

/// A controller, in memory of its own.
struct Running {
    node: Arc<Node>,
    memory: Vec<u64>,
}

impl Running {
    fn address(&mut self) -> Out {
        self.memory.as_mut_ptr().cast()
    }

    /// The state it rests at and its first message.
    fn rest(&mut self, outputs: &[f64], all_loads: &[f64], loads: &[f64]) -> Result<(DVector<f64>, Sent), String> {
        let node = self.node.clone();
        let (outputs, all_loads, loads) = (node.reals(outputs), node.reals(all_loads), node.reals(loads));
        let (mut x, mut u, mut message, mut which) = (node.zeros(node.n), node.zeros(node.m), node.message(), -1);
        // SAFETY: arrays are as long as the network's outputs and loads and the subsystem's states and inputs.
        let code = unsafe {
            match node.steady {
                Loaded::Without(steady) => steady(outputs.ptr(), x.mut_ptr(), u.mut_ptr()),
                Loaded::With(steady) => steady(outputs.ptr(), all_loads.ptr(), x.mut_ptr(), u.mut_ptr()),
            }
        };
        node.done(code, -1)?;
        let (size, place, first) = ((node.size)(), self.address(), message.as_mut_ptr().cast());
        // SAFETY: the memory has the size that is said; arrays as above, and room for a message.
        let code = unsafe {
            match node.start {
                Loaded::Without(start) => start(place, size, x.ptr(), u.ptr(), first, &raw mut which),
                Loaded::With(start) => start(place, size, x.ptr(), u.ptr(), loads.ptr(), first, &raw mut which),
            }
        };
        node.done(code, which)?;
        Ok((DVector::from_vec(x.to_f64()), node.sent(message)))
    }

    /// Its first message.
    fn planned(&mut self, x: &[f64], loads: &[f64]) -> Result<Sent, String> {
        let node = self.node.clone();
        let (start, plan) = node.planned.as_ref().ok_or("it was made without a start-up plan")?;
        let (x, loads, mut message, mut which) = (node.reals(x), node.reals(loads), node.message(), -1);
        let (size, place, first, plan) = ((node.size)(), self.address(), message.as_mut_ptr().cast(), plan());
        // SAFETY: as for a start at rest; the plan is the library's own.
        let code = unsafe {
            match start {
                Loaded::Without(start) => start(place, size, plan, x.ptr(), first, &raw mut which),
                Loaded::With(start) => start(place, size, plan, loads.ptr(), x.ptr(), first, &raw mut which),
            }
        };
        node.done(code, which)?;
        Ok(node.sent(message))
    }

    fn deliveries(&mut self) -> Vec<Delivery> {
        let node = self.node.clone();
        let place = self.address();
        let of = |slot: usize| {
            let (mut code, mut step) = (0, 0);
            let delivery = node.delivery?;
            // SAFETY: the memory holds a controller that was started.
            unsafe { delivery(place, slot as u32, &raw mut code, &raw mut step) };
            Some(read_delivery(code, step))
        };
        (0..node.heard).filter_map(of).collect()
    }
}

impl Controller for Running {
    fn accept(&mut self, _from: usize, message: &[u8]) -> Result<(), String> {
        let node = self.node.clone();
        let accept = node.accept.ok_or("it hears nobody")?;
        // SAFETY: the memory holds a controller that was started; the message is as long as is said.
        let code = unsafe { accept(self.address(), message.as_ptr().cast(), message.len()) };
        node.done(code, -1)
    }

    fn redraw(&mut self, row: usize, drawn: &HalfSpace) -> Result<(), String> {
        let node = self.node.clone();
        let (normal, count, mut which) = (node.reals(&drawn.normal), drawn.normal.len(), -1);
        let place = self.address();
        // SAFETY: the memory holds a controller that was started; the row is as long as is said.
        let code = unsafe {
            match node.redraw.as_ref().ok_or("none of its constraints changes")? {
                Loaded::Without(redraw) => redraw(place, row as u32, normal.ptr(), count, drawn.limit, &raw mut which),
                Loaded::With(redraw) => {
                    redraw(place, row as u32, normal.ptr(), count, drawn.limit as f32, &raw mut which)
                }
            }
        };
        node.done(code, which)
    }

    fn step(&mut self, given: &Given<'_>) -> Answer {
        let node = self.node.clone();
        let (x, set_point, loads) = (node.reals(given.x), node.reals(given.set_point), node.reals(given.loads));
        let (mut u, mut message, mut word) = (node.zeros(node.m), node.message(), Word::default());
        let [mut x_ref, mut x_nom] = [(); 2].map(|()| node.zeros(node.n));
        let [mut u_ref, mut u_nom] = [(); 2].map(|()| node.zeros(node.m));
        let mut y_ref = node.zeros(node.p);
        let (place, sent) = (self.address(), message.as_mut_ptr().cast());
        // SAFETY: the memory holds a controller that was started; arrays are as long as the subsystem's signals, and there is room for a
        // message and a status.
        unsafe {
            match node.step {
                Loaded::Without(step) => step(place, x.ptr(), set_point.ptr(), u.mut_ptr(), sent, &raw mut word),
                Loaded::With(step) => {
                    step(place, x.ptr(), set_point.ptr(), loads.ptr(), u.mut_ptr(), sent, &raw mut word)
                }
            };
            let [a, b, c] = [&mut x_ref, &mut u_ref, &mut y_ref].map(Reals::mut_ptr);
            (node.telemetry)(place, a, b, c, x_nom.mut_ptr(), u_nom.mut_ptr());
        }
        let status = read_status(&word, self.deliveries());
        let [x_ref, u_ref, y_ref, x_nom, u_nom] = [x_ref, u_ref, y_ref, x_nom, u_nom].map(|reals| reals.to_f64());
        Answer { input: u.to_f64(), message: node.sent(message), status, x_ref, u_ref, y_ref, x_nom, u_nom }
    }
}

/// The numbers of `emit::c`'s codes.
fn read_status(word: &Word, deliveries: Vec<Delivery>) -> Status {
    let count = |number: i32| usize::try_from(number).unwrap_or(0);
    let control = match word.control {
        1 => Control::AtReference,
        2 => Control::Optimal { iterations: count(word.iterations), active: count(word.active_rows) },
        3 => Control::Candidate,
        4 => Control::Infeasible { row: count(word.control_row) },
        5 => Control::IterationLimit,
        _ => Control::NotFinite,
    };
    let row = count(word.references_row);
    let references = match word.references {
        1 => References::Nearest,
        2 => References::Planned,
        3 => References::SetPointNotFinite,
        4 => References::Kept,
        5 => References::Waiting,
        6 => References::Blocked { row },
        7 => References::Deadlock { row },
        8 => References::Undrawn { row },
        9 => References::OffPlan,
        10 => References::CouplingExceeded { row },
        _ => References::NotSteady,
    };
    let [certified, load_within, degraded] = [word.certified, word.load_within, word.degraded].map(|flag| flag != 0);
    Status { control, references, deliveries, certified, load_within, degraded }
}

fn read_delivery(code: i32, step: i64) -> Delivery {
    match code {
        0 => Delivery::Missing,
        1 => Delivery::InSequence,
        2 => Delivery::OutOfSequence(step),
        3 => Delivery::NotFinite,
        4 => Delivery::OtherDesign,
        _ => Delivery::Unreadable,
    }
}
