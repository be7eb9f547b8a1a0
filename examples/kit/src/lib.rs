//! What the examples share: an in-process bus, small matrices, pictures, tables, random numbers, and checks of what a design promises.

pub mod bus;
pub mod checks;
pub mod matrix;
pub mod random;
pub mod sets;
pub mod table;
pub mod trajectory;

pub use dpc_plot as plot;
/// Prints a line. A reader that stops early, such as `head`, is no mistake of the run.
#[macro_export]
macro_rules! say {
    ($($words:tt)*) => { $crate::print_line(format_args!($($words)*)) };
}

/// What [`say`] does.
pub fn print_line(line: std::fmt::Arguments<'_>) {
    use std::io::{ErrorKind, Write, stdout};
    match writeln!(stdout(), "{line}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => eprintln!("error: cannot print: {error}"),
        _ => {}
    }
}

/// The exit code of an example, which returns the promises that were broken; says what went wrong.
pub fn conclude(run: Result<Vec<String>, Box<dyn std::error::Error + Send + Sync>>) -> std::process::ExitCode {
    let broken = run.unwrap_or_else(|failure| vec![failure.to_string()]);
    broken.iter().for_each(|promise| eprintln!("error: {promise}"));
    if broken.is_empty() { std::process::ExitCode::SUCCESS } else { std::process::ExitCode::FAILURE }
}
