//! A whole step of the two controllers of the four-tank at rest: message in, input, references, message out.

use std::hint::black_box;

use crate::emitted::four_tank::{left, right};
use crate::timing::{calibration, ticks};

/// Steps per measurement, and measurements, of which the fastest half counts.
const STEPS: usize = 1000;
const RUNS: usize = 200;

/// Bytes below the caller that are looked at.
const STACK: usize = 64 << 10;

/// Prints time, tables, memory and stack.
pub fn report() {
    let (rate, _) = calibration();
    let mut pair = Pair::new();
    let mut times: Vec<f64> = (0..RUNS).map(|_| pair.time() * rate).collect();
    times.sort_by(f64::total_cmp);
    let time = times.iter().take(RUNS / 2).sum::<f64>() / (RUNS / 2) as f64;
    println!("four-tank at rest, one subsystem: {time:.0} ns per step with its message accepted");
    let gram = [size_of_val(left::TABLES.problem.gram), size_of_val(right::TABLES.problem.gram)];
    let tables = [size_of_val(&left::TABLES) + gram[0], size_of_val(&right::TABLES) + gram[1]];
    println!("  tables     {} and {} bytes", tables[0], tables[1]);
    println!("  controller {} bytes, inbox {} bytes", size_of::<left::Controller>(), size_of::<left::Inbox>());
    println!("  stack      {} bytes at rest, {} where the problem is solved", pair.stack(0.0), Pair::new().stack(20.0));
}

struct Pair {
    left: left::Controller,
    right: right::Controller,
    to_left: left::Inbox,
    to_right: right::Inbox,
    from_left: left::Message,
    from_right: right::Message,
}

impl Pair {
    fn new() -> Self {
        let rest = left::SteadyState { x: [0.0; left::NX], u: [0.0; left::NU] };
        let (left, from_left) = left::Controller::start(&left::TABLES, &rest).expect("rest at zero is admissible");
        let rest = right::SteadyState { x: [0.0; right::NX], u: [0.0; right::NU] };
        let (right, from_right) = right::Controller::start(&right::TABLES, &rest).expect("rest at zero is admissible");
        Self { left, right, to_left: left::Inbox::new(), to_right: right::Inbox::new(), from_left, from_right }
    }

    /// Ticks per step of one subsystem.
    fn time(&mut self) -> f64 {
        let start = ticks();
        (0..STEPS).for_each(|_| self.step(0.0));
        (ticks() - start) as f64 / (2 * STEPS) as f64
    }

    fn step(&mut self, upset: f64) {
        let from_left = self.from_left;
        self.step_left(upset);
        self.to_right.accept(&right::FROM_LEFT, &from_left).expect("in sequence");
        let step = self.right.step(black_box(&[upset, 0.0]), black_box(&[0.0]), &mut self.to_right);
        self.from_right = step.message;
        black_box(step.input);
    }

    #[inline(never)]
    fn step_left(&mut self, upset: f64) {
        self.to_left.accept(&left::FROM_RIGHT, &self.from_right).expect("in sequence");
        let step = self.left.step(black_box(&[upset, 0.0]), black_box(&[0.0]), &mut self.to_left);
        self.from_left = step.message;
        black_box(step.input);
    }

    /// Bytes of stack that a step of the left subsystem touches, and this loop with it: those that have lost their paint.
    #[inline(never)]
    fn stack(&mut self, upset: f64) -> usize {
        let mark = 0_u8;
        let top = black_box(&raw const mark).cast_mut();
        // SAFETY: the main thread's stack is larger by far, and nothing lives below the frame that is being run.
        (PAST..STACK).for_each(|k| unsafe { top.wrapping_sub(k).write_volatile(PAINT) });
        self.step_left(upset);
        // SAFETY: as above.
        (PAST..STACK).rev().find(|&k| unsafe { top.wrapping_sub(k).read_volatile() } != PAINT).unwrap_or(0)
    }
}

const PAINT: u8 = 0xa5;

/// This frame and what it calls to paint.
const PAST: usize = 512;
