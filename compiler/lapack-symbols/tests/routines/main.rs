//! Does every routine do what BLAS and LAPACK say it does? Called as Clarabel calls them.
#![expect(unsafe_code, reason = "the crates `blas` and `lapack` declare the symbols as unsafe functions")]

use lapack_symbols as _;

mod factorisations;
mod products;
mod stored;
mod strided;
