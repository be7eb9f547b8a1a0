//! Time of one on-line step, from its parameters to its solution, beside other solvers, interleaved in one process.
//!
//!     bench/online/peers/fetch                                              # once: DAQP and quadprog, from PyPI
//!     cargo run --release --manifest-path bench/online/Cargo.toml           # every problem
//!     cargo run --release --manifest-path bench/online/Cargo.toml -- size   # those whose name contains `size`
//!
//! Five plants of growing size (`plants/`) and every emitted problem of the examples. Each runs in a closed loop under its own
//! controller, with set-points that jump and upsets that nearly make the problem infeasible; the parameters of every step are
//! recorded, and each solver gets them in that order, so that warm starts are worth what they are in a loop. A figure is the
//! smallest of several passes for each step; then come statistics over the steps. Peers get the row limits ready computed by
//! the runtime's own code and are not asked for the plan, only for w.

mod emitted;
mod peers;
mod record;
mod statistics;
mod step;
mod timing;

use std::process::ExitCode;

use statistics::Report;

/// Module of the network, module of the subsystem.
macro_rules! problems {
    ($($network:ident :: $node:ident),* $(,)?) => {
        fn problems(wanted: &[String]) -> Vec<Report> {
            let mut reports = Vec::new();
            $({
                let name = concat!(stringify!($network), "::", stringify!($node));
                if wanted.is_empty() || wanted.iter().any(|part| name.contains(part.as_str())) {
                    let report = timing::measure!(name, emitted::$network::$node);
                    println!("{report}");
                    reports.push(report);
                }
            })*
            reports
        }
    };
}

problems!(
    size_2_1_3::plant,
    size_4_2_10::plant,
    size_4_2_20::plant,
    size_6_3_15::plant,
    size_10_4_30::plant,
    four_tank::left,
    four_tank::right,
    power_network::area_1,
    power_network::area_2,
    power_network::area_3,
    power_network::area_4,
    mass_chain::mass_1,
    mass_chain::mass_2,
    mass_chain::mass_5,
    mass_chain::mass_10,
);

fn main() -> ExitCode {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let reports = problems(&wanted);
    println!("{}", statistics::summary(&reports));
    step::report();
    if reports.is_empty() { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}
