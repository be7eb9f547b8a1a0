//! A complete crate for the node of a subsystem: the emitted file, a manifest, and a manual.
//!
//! One crate per subsystem and not one of all: a node's firmware needs one controller and may be built, released and audited
//! without the others' tables. That nodes fit together is what the fingerprint in their messages is for.

use std::path::{Path, PathBuf};

use super::manual::Manual;
use super::names::module_names;
use super::node::Node;
use super::{Emitted, package_folder};
use crate::dependency::{RUNTIME, pinned};
use crate::design::Design;

/// Path under `folder` and text of every file of the crates of all subsystems: one folder each, named as its module.
pub fn packages(design: &Design, emitted: &Emitted, folder: &Path) -> Vec<(PathBuf, String)> {
    let modules = module_names(design.network.subsystems.iter().map(|s| s.name.as_str()));
    let of = |(i, module): (usize, &String)| {
        let package = Package { node: Node::new(design, i), modules: &modules, text: &emitted.files[i + 1].1 };
        let inner = folder.join(module);
        package.files().map(|(name, text)| (inner.join(name), text))
    };
    modules.iter().enumerate().flat_map(of).collect()
}

/// Where the crate of each subsystem keeps the emitted file, in the order of the network.
pub fn controllers(design: &Design, folder: &Path) -> Vec<PathBuf> {
    let modules = module_names(design.network.subsystems.iter().map(|s| s.name.as_str()));
    modules.iter().map(|module| folder.join(module).join(CONTROLLER)).collect()
}

const CONTROLLER: &str = "src/controller.rs";

struct Package<'a> {
    node: Node<'a>,
    modules: &'a [String],
    /// The emitted file, perhaps with what it takes in its header.
    text: &'a str,
}

impl Package<'_> {
    fn files(&self) -> [(&'static str, String); 4] {
        let name = self.name();
        let manual = Manual { node: &self.node, modules: self.modules, name: &name, text: self.text };
        [
            ("Cargo.toml", self.manifest(&name)),
            ("README.md", manual.text()),
            ("src/lib.rs", LIBRARY.to_owned()),
            (CONTROLLER, self.text.to_owned()),
        ]
    }

    /// `four_tank_left`
    fn name(&self) -> String {
        format!("{}_{}", package_folder(&self.node.design.network), self.modules[self.node.i])
    }

    fn manifest(&self, name: &str) -> String {
        let (network, subsystem) = (&self.node.design.network.name, &self.node.model().name);
        let description = format!("Predictive controller of subsystem {subsystem} of network {network}");
        format!(
            "[package]\nname = {name:?}\nversion = \"0.1.0\"\nedition = \"2024\"\ndescription = {}\nreadme = \"README.md\"\n\
             publish = false\n\n[dependencies]\n# The runtime that the tables were made for.\n{}",
            toml::Value::String(description),
            pinned(RUNTIME)
        )
    }
}

/// The manual is the documentation of the crate.
const LIBRARY: &str = "\
#![doc = include_str!(\"../README.md\")]
#![no_std]
#![forbid(unsafe_code)]

#[rustfmt::skip]
#[allow(clippy::all, clippy::pedantic, reason = \"written by a program\")]
mod controller;

pub use controller::*;
";
