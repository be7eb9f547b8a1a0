//! What a controller takes on the machine it is to run on: code, constants, working memory, stack.
//!
//! The emitted file of every subsystem is built as a static library of its own, as the firmware of its node would be, with the
//! user's cargo and the profile [`PROFILE`]; then the library is read. What counts is what a linker keeps: everything that the
//! functions of the file reach, and nothing else.
//!
//! A bound of the stack needs a call graph without cycles. Cycles of several functions are found and refused. That of one which calls
//! itself is not: the assembler settles such a call and leaves no relocation. The runtime and the emitted files have none.
//!
//! | file | holds |
//! |---|---|
//! | `target` | what is built for, and with which compiler |
//! | `build` | the package of a subsystem |
//! | `cargo` | what builds it |
//! | `library` | a static library as a graph of sections |
//! | `reach` | what is reached in it, and how deep the stack gets |
//! | `header` | the comment in the emitted files |

mod build;
pub(crate) mod cargo;
mod header;
mod library;
mod reach;
mod target;

use std::path::Path;

pub use crate::emit::{PROFILE, runtime};
pub use build::{Workshop, source};
pub use header::{Measured, without};
pub use target::Target;

use crate::design::Design;
use crate::emit::Emitted;
use crate::emit::entries::{CONTROLLER, INBOX, INITIAL, PERIODIC};
use library::Library;
use reach::Reached;

/// Of one subsystem's controller; bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Footprint {
    /// Machine code.
    pub code: u64,
    /// Constant data: the tables, and what the code itself keeps beside it.
    pub constants: u64,
    /// Working memory between two steps: the controller, and its loads where there are any.
    pub controller: u64,
    /// The inbox.
    pub inbox: u64,
    /// The most stack that a step, a message that is accepted or a row that is redrawn takes, with its return addresses.
    pub step_stack: u64,
    /// The functions that take it, each called by the one before, and their frames.
    pub step_calls: Vec<(String, u64)>,
    /// The most stack that a start takes.
    pub start_stack: u64,
    /// What the library calls and has not got, in order: memory moves where there is an operating system to bring them.
    /// Their stack is not counted.
    pub foreign: Vec<String>,
    /// Functions by the names of a panic that are reached.
    pub panics: Vec<String>,
    /// Functions without a known stack that are reached: of a library compiled elsewhere, or assembly. Their stack is not counted.
    pub unmeasured: Vec<String>,
}

/// What some functions of a static library reach.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Needs {
    /// As [`Footprint::panics`].
    pub panics: Vec<String>,
    /// As [`Footprint::foreign`].
    pub foreign: Vec<String>,
}

/// What the functions whose names begin with `prefix` reach in the static library at `path`.
///
/// # Errors
/// The library cannot be read.
pub fn needs(path: &Path, prefix: &str) -> Result<Needs, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("error: {}: {error}", path.display()))?;
    let library = Library::read(&bytes).map_err(|error| format!("error: {}: {error}", path.display()))?;
    let reached = Reached::from(&library, &[prefix]);
    Ok(Needs { panics: reached.named("panic"), foreign: reached.foreign() })
}

/// Builds the controllers of a design for `target` and measures them in the order of the subsystems.
///
/// # Errors
/// A sentence for the user: cargo or the compiler is missing or fails, or the library is none this understands.
pub fn measure(
    design: &Design,
    emitted: &Emitted,
    target: &Target,
    workshop: &Workshop,
) -> Result<Vec<Footprint>, String> {
    let libraries = build::libraries(design, emitted, target, workshop)?;
    libraries
        .iter()
        .map(|path| of_library(path).map_err(|error| format!("error: {}: {error}", path.display())))
        .collect()
}

fn of_library(path: &Path) -> Result<Footprint, String> {
    let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
    let library = Library::read(&bytes)?;
    let periodic = Reached::from(&library, &PERIODIC);
    let initial = Reached::from(&library, &INITIAL);
    let all = Reached::from(&library, &[&PERIODIC[..], &INITIAL[..]].concat());
    let size = |name: &str| library.size(name).ok_or(format!("no symbol {name}"));
    let (step_stack, step_calls) = periodic.stack()?;
    Ok(Footprint {
        code: all.code(),
        constants: all.constants(),
        controller: size(CONTROLLER)?,
        inbox: size(INBOX)?,
        step_stack,
        step_calls,
        start_stack: initial.stack()?.0,
        foreign: all.foreign(),
        panics: all.named("panic"),
        unmeasured: all.unmeasured(),
    })
}
