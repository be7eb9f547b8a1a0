//! `dpc-codegen explain E0104`: what a mistake means, and what to do about it.

use clap::Args;
use dpc_codegen::explain::{PAGES, Page, nearest, page};
use serde_json::json;

use super::failure::{Failure, say};
use super::output::{Format, print_json};

/// Explain a code of a message: what it means, the equation behind it, what to try, an example
#[derive(Args)]
pub struct Arguments {
    /// Such as E0104; without one, all of them are listed
    code: Option<String>,
    /// For whom
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t)]
    pub format: Format,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Some(code) = &arguments.code else { return list(arguments.format) };
    let page = page(code).ok_or_else(|| unknown(code))?;
    match arguments.format {
        Format::Text => say(page.text),
        Format::Json => told(&[page]),
    }
}

fn list(format: Format) -> Result<(), Failure> {
    let line = |page: &Page| format!("{}  {}\n", page.code, page.title());
    match format {
        Format::Text => say(&PAGES.iter().map(line).collect::<String>()),
        Format::Json => told(&PAGES.iter().collect::<Vec<_>>()),
    }
}

fn told(pages: &[&Page]) -> Result<(), Failure> {
    let object = |page: &&Page| json!({ "code": page.code, "title": page.title(), "page": page.text });
    let pages: Vec<_> = pages.iter().map(object).collect();
    print_json(&json!({ "outcome": "done", "pages": pages }))
        .map_err(|error| Failure::System(format!("error: cannot print: {error}")))
}

fn unknown(code: &str) -> Failure {
    let near = match nearest(code) {
        Some(near) => format!("did you mean {near}?"),
        None => "`dpc-codegen explain` lists all".to_owned(),
    };
    Failure::Usage(format!("error: there is no code {code}; {near}"))
}
