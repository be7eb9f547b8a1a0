//! Rust for the nodes: one file per subsystem, and the list of them.
//!
//! An emitted file is data in the types of `dpc_runtime` and almost no logic: sizes, type aliases and links first,
//! then the tables. Whoever wants to know what the numbers do reads the runtime.
//!
//! | file | holds |
//! |---|---|
//! | `node` | a subsystem as its own node sees it: sizes, neighbours, where their messages go |
//! | `code` | the first half of a file: constants, types, links (`quote`, `prettyplease`) |
//! | `parts` | the second half: the runtime's tables as values |
//! | `monitors` | the sets that hold at every step, and the steady states |
//! | `starts` | the start-up plan, where there is one |
//! | `tables` | printing of values, one matrix row per line |
//! | `steady` | the maps from outputs and loads at rest to the states |
//! | `names` | identifiers and comments out of the user's names |
//! | `network` | the list of the modules, and who talks to whom |
//! | `together` | all controllers in one process, and the plant |
//! | `fingerprint` | what a start-up plan recognises its tables by, and messages their design |
//! | `wire` | messages as bytes |
//! | `package`, `manual` | a complete crate for a node, documented |
//! | `entries` | the same functions for C, for what measures them |
//! | `c` | a package for C around them |
//! | `manifest` | what `Cargo.toml` of a package says |
//! | `disk` | writing all files or none |

pub mod c;
mod code;
mod disk;
#[cfg(feature = "measure")]
pub(crate) mod entries;
mod fingerprint;
mod manifest;
#[cfg(feature = "measure")]
mod manual;
mod monitors;
mod names;
mod network;
mod node;
#[cfg(feature = "measure")]
mod package;
mod parts;
mod starts;
mod steady;
mod tables;
mod together;
mod wire;

use std::io;
use std::path::{Path, PathBuf};

pub use disk::write_all;
pub use fingerprint::{design_fingerprint, fingerprint, plan_number};
pub use manifest::{PROFILE, runtime};
pub use names::module_name;
#[cfg(feature = "measure")]
pub use package::{controllers, packages};
pub use wire::{MessagePart, message_layout};

use crate::design::Design;
use crate::network::{Network, Scalar};
use crate::sharing::spread;
use node::Node;
use steady::Steady;
use tables::{Value, item};

/// Whom subsystem `i` hears, by slot: indices of subsystems, ascending.
pub fn hears(design: &Design, i: usize) -> Vec<usize> {
    Node::new(design, i).neighbours.iter().map(|neighbour| neighbour.j).collect()
}

/// What the compiler writes for one network.
///
/// After this point: every text parses as Rust, is formatted, and is the same for the same design: no clock, no path,
/// no order of a hash.
#[derive(Debug, Clone)]
pub struct Emitted {
    /// Name and text of each file: `mod.rs`, then one per subsystem in the order of the network.
    pub files: Vec<(String, String)>,
    /// Bytes of constant data that the controller of each subsystem needs, on a machine of 64 bits.
    pub table_bytes: Vec<usize>,
    /// What messages recognise their design by: [`design_fingerprint`].
    pub fingerprint: u64,
}

impl Emitted {
    pub fn new(design: &Design) -> Self {
        let steady = Steady::new(design);
        let nodes: Vec<Node> = (0..design.network.subsystems.len()).map(|i| Node::new(design, i)).collect();
        let modules = names::module_names(design.network.subsystems.iter().map(|s| s.name.as_str()));
        let mut files = vec![("mod.rs".to_owned(), network::file(&nodes, &modules))];
        let tables = spread(nodes.len(), |i| parts::all(&nodes[i]));
        let fingerprint = fingerprint::of_tables(design, &tables);
        let texts = spread(nodes.len(), |i| subsystem_file(&nodes[i], &modules, fingerprint, &tables[i], &steady));
        files.extend(texts.into_iter().zip(&modules).map(|(text, module)| (format!("{module}.rs"), text)));
        let table_bytes = tables.iter().zip(&nodes).map(|(tables, node)| tables.bytes(node.scalar())).collect();
        Self { files, table_bytes, fingerprint }
    }

    /// Path in `folder` and text of each file.
    pub fn paths(&self, folder: &Path) -> Vec<(PathBuf, &str)> {
        self.files.iter().map(|(name, text)| (folder.join(name), text.as_str())).collect()
    }

    /// Writes all files into `folder`, or none; see [`write_all`].
    ///
    /// # Errors
    /// As [`write_all`].
    pub fn write(&self, folder: &Path) -> io::Result<Vec<bool>> {
        write_all(&self.paths(folder))
    }
}

/// The folder of a network's files: its name, fit for Rust. `four-tank` becomes `four_tank`, and `four_tank_single` where single
/// precision was asked for beside what the file says.
pub fn package_folder(network: &Network) -> String {
    folder_of(&network.name, Some(network.scalar), Some(network.stated_scalar()))
}

/// [`package_folder`] of a network by its name, the scalar type that was asked for, and the one that its file states.
pub fn folder_of(name: &str, asked: Option<Scalar>, stated: Option<Scalar>) -> String {
    let beside = asked == Some(Scalar::Single) && stated != Some(Scalar::Single);
    names::module_name(name) + if beside { "_single" } else { "" }
}

/// Code first, tables after.
fn subsystem_file(node: &Node, modules: &[String], fingerprint: u64, tables: &Value, steady: &Steady) -> String {
    let model = node.model();
    let what = format!("Controller of subsystem `{}` of network `{}`", model.name, node.design.network.name);
    let doc = "All that the controller of this subsystem is made of; each part says what it is.";
    let mut sections = vec![code::header(node.design, &what), code::text(node, modules, fingerprint)];
    sections.push(item(node.scalar(), doc, "TABLES", "Parts", tables));
    sections.extend(monitors::items(node, steady));
    sections.extend(starts::items(node));
    sections.join("\n")
}
