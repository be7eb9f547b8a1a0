//! The loops on the machine that builds the firmware.

use std::io::Write;

use metal::{Board, Line, Ticks, run_all};

struct Host;

impl Board for Host {
    fn print(&mut self, line: &Line) {
        let mut out = std::io::stdout().lock();
        out.write_all(line.bytes()).and_then(|()| out.write_all(b"\n")).expect("the output is open");
    }

    fn ticks(&mut self) -> Ticks {
        0
    }

    fn since(&mut self, _: Ticks) -> Ticks {
        0
    }

    fn instructions_per_tick(&self) -> u64 {
        0
    }
}

fn main() {
    run_all(&mut Host);
}
