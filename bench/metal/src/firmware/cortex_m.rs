//! Start, output and time of the board.

use core::arch::{asm, global_asm};

use metal::{Board, Line, Ticks};

// The processor takes its stack from the first word and begins at the second; any fault ends in a loop. The floating-point
// unit is off until coprocessors 10 and 11 are enabled.
global_asm!(
    ".section .vectors, \"a\"",
    ".word top_of_stack",
    ".word reset",
    ".rept 14",
    ".word fault",
    ".endr",
    ".section .text.reset, \"ax\"",
    ".thumb_func",
    ".global reset",
    "reset:",
    "movw r0, #0xed88",
    "movt r0, #0xe000",
    "ldr r1, [r0]",
    "orr r1, r1, #(0xf << 20)",
    "str r1, [r0]",
    "dsb",
    "isb",
    "bl start",
    ".thumb_func",
    "fault:",
    "b fault",
);

const SYST_CSR: *mut u32 = 0xe000_e010 as *mut u32;
const SYST_RVR: *mut u32 = 0xe000_e014 as *mut u32;
const SYST_CVR: *mut u32 = 0xe000_e018 as *mut u32;
/// The timer counts down from there.
const FULL: u32 = 0x00ff_ffff;

/// Semihosting operations.
const WRITE0: u32 = 0x04;
const EXIT: u32 = 0x18;
const APPLICATION_EXIT: u32 = 0x2_0026;

/// Arm's MPS2 board.
pub struct Mps2 {
    instructions_per_tick: u64,
}

impl Mps2 {
    /// With its timer running, driven by the processor's clock.
    pub fn new() -> Self {
        // SAFETY: these are the timer's registers, and nothing else uses it.
        unsafe {
            SYST_RVR.write_volatile(FULL);
            SYST_CVR.write_volatile(0);
            SYST_CSR.write_volatile(5);
        }
        let mut board = Self { instructions_per_tick: 0 };
        let before = board.ticks();
        // SAFETY: counts a register down; two instructions per turn, a million together.
        unsafe {
            asm!("2:", "subs {n}, {n}, #1", "bne 2b", n = inout(reg) 500_000 => _);
        }
        let ticks = u64::from(board.since(before));
        board.instructions_per_tick = (1_000_000 + ticks / 2).checked_div(ticks).unwrap_or(0);
        board
    }

    /// Ends the emulation.
    pub fn end(&self) -> ! {
        semihost(EXIT, APPLICATION_EXIT);
        loop {}
    }
}

impl Board for Mps2 {
    fn print(&mut self, line: &Line) {
        for byte in line.bytes().iter().chain(b"\n") {
            let text = [*byte, 0];
            semihost(WRITE0, text.as_ptr() as u32);
        }
    }

    fn ticks(&mut self) -> Ticks {
        // SAFETY: a register that may be read at any time.
        FULL - (unsafe { SYST_CVR.read_volatile() } & FULL)
    }

    fn since(&mut self, before: Ticks) -> Ticks {
        self.ticks().wrapping_sub(before) & FULL
    }

    fn instructions_per_tick(&self) -> u64 {
        self.instructions_per_tick
    }
}

/// Asks the debugger, which is the emulator.
fn semihost(operation: u32, argument: u32) {
    // SAFETY: the operations above read what `argument` points to, if anything, and write nothing.
    unsafe {
        asm!("bkpt 0xab", inout("r0") operation => _, in("r1") argument);
    }
}
