//! `dpc-codegen new <dir>`: a crate to begin with.

use std::path::PathBuf;

use clap::Args;
use dpc_codegen::scaffold::{Template, create};

use super::failure::{Failure, say};

/// Begin a crate: a plant to change, its controllers, and a closed loop of them
#[derive(Args)]
pub struct Arguments {
    /// Folder of the crate: a new one, or an empty one
    folder: PathBuf,
    /// The plant that it begins with
    #[arg(long, value_enum, default_value_t)]
    template: Template,
    /// Name of the crate and of its network [default: the folder's]
    #[arg(long)]
    name: Option<String>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { folder, template, name } = arguments;
    let files = create(folder, name.as_deref(), *template)?;
    let files: String = files.iter().map(|file| format!("Written:   {}\n", file.display())).collect();
    let next = format!("cd {} && cargo run", folder.display());
    say(&format!("{files}\nA closed loop of all its controllers (the first build takes some minutes):\n\n    {next}\n"))
}
