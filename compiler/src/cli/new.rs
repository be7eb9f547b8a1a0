//! `dpc-codegen new <dir>`: a crate to begin with.

use std::path::PathBuf;

use clap::Args;
use dpc_codegen::scaffold::{Template, create};

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

pub fn run(arguments: &Arguments) -> Result<(), String> {
    let Arguments { folder, template, name } = arguments;
    for file in create(folder, name.as_deref(), *template)? {
        println!("Written:   {}", file.display());
    }
    println!(
        "\nA closed loop of all its controllers (the first build takes some minutes):\n\n    cd {} && cargo run",
        folder.display()
    );
    Ok(())
}
