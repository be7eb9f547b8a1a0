//! The generated pages of the manual: the references of `system.toml` and of scenarios with their JSON schemas, made of the types that the
//! files are read into, and the command line's, made of its help.

pub mod command;
pub mod console;
pub mod editor;
pub mod kind;
pub mod markdown;
pub mod page;
pub mod pages;
pub mod schema;
pub mod session;
pub mod source;
pub mod table;

use std::path::PathBuf;

/// The repository.
pub fn repository() -> PathBuf {
    crate::root().parent().expect("this package is a folder of the repository").to_path_buf()
}
