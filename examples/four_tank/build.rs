//! Designs and emits the controllers of `system.toml`, and keeps what the compiler says of the design.

use std::error::Error;
use std::path::{Path, PathBuf};

use dpc_codegen::build::read;
use dpc_codegen::design::Design;
use dpc_codegen::emit::Emitted;
use dpc_codegen::export::design_json;
use dpc_codegen::summary::Summary;

fn main() {
    println!("cargo::rerun-if-changed=system.toml");
    if let Err(message) = compile() {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

/// One design for the controllers, the summary and `design.json`.
fn compile() -> Result<(), Box<dyn Error>> {
    let source = read(Path::new("system.toml"))?;
    let design = Design::new(source.clone()).map_err(|mistakes| mistakes.render(&source, false))?;
    let emitted = Emitted::new(&design);
    let out = PathBuf::from(std::env::var("OUT_DIR")?);
    emitted.write(&out.join("four_tank"))?;
    std::fs::write(out.join("summary.txt"), Summary::new(&design, &emitted).to_string())?;
    std::fs::write(out.join("design.json"), design_json(&design))?;
    Ok(())
}
