//! What the runtime promises, each file one question.
#![expect(non_snake_case, reason = "the paper's symbols")]

mod changing;
mod pair;
mod plan;
mod planar;
mod random;
mod reference;
mod single;
mod solver;
mod step;
mod wire;

use lapack_symbols as _;
