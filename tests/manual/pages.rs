//! The generated files of `docs`.

use super::{command, page, repository, schema, source, table};

/// A file as it should be, relative to the repository.
pub struct Page {
    pub path: &'static str,
    pub text: String,
}

/// All of them.
///
/// # Panics
/// The checkout is broken, or the program cannot be built.
pub fn pages() -> [Page; 5] {
    let (network, starts, scenario) = (network(), starts(), scenario());
    let example = read("docs/system.toml");
    [
        Page {
            path: "docs/reference.md",
            text: page::page(include_str!("reference.in.md"), &example, &network, &starts),
        },
        Page {
            path: "docs/system.schema.json",
            text: schema::schema("A network of subsystems for dpc-codegen", &network),
        },
        Page {
            path: "docs/scenario.md",
            text: page::page(include_str!("scenario.in.md"), &read("docs/scenario.toml"), &scenario, &[]),
        },
        Page {
            path: "docs/scenario.schema.json",
            text: schema::schema("A scenario for dpc-codegen simulate", &scenario),
        },
        Page { path: "docs/cli.md", text: command::page(include_str!("cli.in.md")) },
    ]
}

/// The tables of `system.toml`, the first being the file itself.
pub fn network() -> Vec<table::Table> {
    table::tables(&source::structs(&read("compiler/src/spec.rs")), "Spec")
}

/// The tables of a scenario, the first being the file itself.
pub fn scenario() -> Vec<table::Table> {
    table::tables(&source::structs(&read("compiler/src/spec/scenario.rs")), "Scenario")
}

/// The table of a file of starts.
fn starts() -> Vec<table::Table> {
    let mut tables = table::tables(&source::structs(&read("compiler/src/spec.rs")), "StartOf");
    tables[0].path = vec!["NAME".to_owned()];
    tables
}

fn read(path: &str) -> String {
    std::fs::read_to_string(repository().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}
