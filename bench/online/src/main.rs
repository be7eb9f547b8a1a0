//! Time of one on-line step, from its parameters to its solution, beside other solvers, interleaved in one process.
//!
//!     bench/online/peers/fetch                                              # once: DAQP and quadprog, from PyPI
//!     cargo run --release --manifest-path bench/online/Cargo.toml           # every problem
//!     cargo run --release --manifest-path bench/online/Cargo.toml -- size   # those whose name contains `size`
//!
//! Five plants of growing size (`plants/`) and every emitted problem of the examples. Each runs in a closed loop under its own
//! controller, with set-points that jump and upsets that nearly make the problem infeasible; the parameters of every step are
//! recorded, and each solver gets them in that order, so that warm starts are worth what they are in a loop. A figure is the
//! mean of the faster half of several passes for each step, each of them after one without the clock; then come statistics over the
//! steps.
//!
//! Time runs from the parameters (x - xref and the references) to the plan (the inputs), for all alike: peers have V precomputed, and
//! their limits are computed from the parameters as sparsely as ours, by `limits_at`; their plan is made of w by the runtime's
//! simulation, which is cheaper than a product with the dense T. "Alone" is a peer that finds the limits ready and stops at w: less
//! than a step. What it starts from and how exact it is are its own: DAQP keeps its last working set with the factor and
//! stops at rows violated by 1e-6; ours starts from the shifted set and stops at rounding.

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
