//! The loops on a Cortex-M4 or Cortex-M7 without an operating system.
//!
//! No C: the vector table and the start are ten lines of assembly, output is semihosting, time is the system timer. A C library would
//! bring an allocator and a start-up of its own into a proof that there is none.
#![no_std]
#![no_main]

mod cortex_m;

use core::panic::PanicInfo;

use cortex_m::Mps2;
use metal::{Board, Line, run_all};

/// What `reset` calls.
#[unsafe(no_mangle)]
extern "C" fn start() -> ! {
    let mut board = Mps2::new();
    board.print(&Line::new().text("# instructions per tick: ").decimal(board.instructions_per_tick()));
    run_all(&mut board);
    board.end()
}

/// Nothing calls it: the linker leaves it out, which `.ci/metal` looks for.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {}
}
