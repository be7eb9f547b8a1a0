//! A package for C: the emitted controllers, functions around them with C's calling convention, and headers.
//!
//! The package is a crate that cargo builds as a static library without a standard library, or as a shared one; `c_library` does
//! so. Every controller is one structure that the caller owns, with its inbox in it; nothing is global.
//!
//! | file | holds |
//! |---|---|
//! | `functions` | the functions of a subsystem, in Rust |
//! | `header` | the same for C |
//! | `codes` | what functions return and statuses say, for both |
//! | `words` | the user's names in C |
//! | `support` | what every package has: the only unsafe code, and statuses as numbers |

mod codes;
mod functions;
mod header;
mod words;

use super::manifest::runtime;
use super::node::Node;
use super::{Emitted, names};
use crate::design::Design;
use crate::network::Scalar;
use words::Words;

/// In `Cargo.toml`. Link-time optimisation leaves nothing in a static library but what its functions reach, so that it needs neither the
/// formatting nor the unwinding of Rust's core library.
const PROFILE: &str =
    "[profile.release]\nopt-level = 3\npanic = \"abort\"\ncodegen-units = 1\nlto = \"fat\"\ndebug = false\n";

/// What the compiler writes for C.
///
/// After this point: every text is the same for the same design.
#[derive(Debug, Clone)]
pub struct Package {
    /// Path in the package and text of each file of the crate.
    pub files: Vec<(String, String)>,
    /// Name of the crate, of its libraries and of the header that includes all others: `four_tank`.
    pub name: String,
    /// What the functions and the structure of each subsystem begin with, in the order of the network: `four_tank_left`.
    pub prefixes: Vec<String>,
    /// Name of the array in the library that [`Sizes`] come from.
    pub sizes: String,
    /// [`Emitted::fingerprint`].
    pub fingerprint: u64,
}

/// Bytes of the structures of one subsystem on the machine that the library was built for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    pub controller: u64,
    /// 0 where controllers cannot be started with a plan.
    pub plan: u64,
}

impl Package {
    pub fn new(design: &Design, emitted: &Emitted) -> Self {
        let words = Words::new(design);
        let modules = names::module_names(design.network.subsystems.iter().map(|s| s.name.as_str()));
        let nodes: Vec<Node> = (0..modules.len()).map(|i| Node::new(design, i)).collect();
        let mut files = vec![
            ("Cargo.toml".to_owned(), manifest(&words.network)),
            ("panic/Cargo.toml".to_owned(), PANIC_MANIFEST.to_owned()),
            ("panic/src/lib.rs".to_owned(), PANIC.to_owned()),
            ("src/lib.rs".to_owned(), functions::root(design, &words, &modules, &nodes)),
            ("src/address.rs".to_owned(), include_str!("support/address.rs").to_owned()),
            ("src/codes.rs".to_owned(), codes_file(&words, design.network.scalar)),
        ];
        files.extend(emitted.files.iter().map(|(name, text)| (format!("src/controllers/{name}"), text.clone())));
        let functions = nodes.iter().zip(&modules).zip(&words.subsystems);
        files.extend(functions.map(|((node, module), prefix)| {
            (format!("src/functions/{module}.rs"), functions::file(node, module, prefix))
        }));
        let sizes = format!("{}_sizes", words.network);
        Self { files, name: words.network, prefixes: words.subsystems, sizes, fingerprint: emitted.fingerprint }
    }

    /// Path in the package and text of each header; `sizes` in the order of the network.
    pub fn headers(&self, design: &Design, sizes: &[Sizes]) -> Vec<(String, String)> {
        let words = Words { network: self.name.clone(), subsystems: self.prefixes.clone() };
        let mut files = vec![
            ("include/dpc.h".to_owned(), header::common()),
            (format!("include/{}.h", self.name), header::network(design, &words, self.fingerprint)),
        ];
        files.extend(sizes.iter().enumerate().map(|(i, sizes)| {
            let node = Node::new(design, i);
            (format!("include/{}.h", words.subsystems[i]), header::subsystem(&node, &words, sizes))
        }));
        files
    }
}

fn manifest(name: &str) -> String {
    format!(
        "[package]\nname = \"{name}\"\nversion = \"0.0.0\"\nedition = \"2024\"\npublish = false\n\n\
         # `rlib` for firmware in Rust; the libraries for C are built by\n\
         #     cargo rustc --release --crate-type staticlib --features panic-handler\n\
         #     cargo rustc --release --crate-type cdylib --features std\n\
         [lib]\ncrate-type = [\"rlib\"]\n\n\
         [features]\n\
         # What a static library needs that is not linked into a Rust program; no controller panics, so nothing calls it.\n\
         panic-handler = [\"dep:dpc-panic\"]\n\
         # For shared libraries, which bring along what the system asks of them.\n\
         std = []\n\n\
         [dependencies]\n{}dpc-panic = {{ path = \"panic\", optional = true }}\n\n[workspace]\n\n{PROFILE}",
        runtime()
    )
}

const PANIC_MANIFEST: &str =
    "[package]\nname = \"dpc-panic\"\nversion = \"0.0.0\"\nedition = \"2024\"\npublish = false\n";

/// A package of its own, so that it is an object of its own: a linker takes it only if something calls it, and two libraries in one
/// program do not collide.
const PANIC: &str = "\
//! What a static library without a standard library must say a panic does.
#![no_std]

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
";

fn codes_file(words: &Words, scalar: Scalar) -> String {
    let runtime = match scalar {
        Scalar::Double => "dpc_runtime",
        Scalar::Single => "dpc_runtime::single",
    };
    format!(
        "//! Statuses and refusals as numbers, and what they mean; the header `dpc.h` has the same.\n\
         #![allow(unused, reason = \"a network uses the part that it needs\")]\n\n\
         use core::ffi::{{CStr, c_char}};\n\n\
         use dpc_runtime::{{Control, Delivery, References, Refused, StartError}};\n\
         use {runtime}::NotRedrawn;\n\n\
         use crate::address::Out;\n\n{}{}",
        codes::in_rust(&words.network),
        include_str!("support/codes.rs")
    )
}
