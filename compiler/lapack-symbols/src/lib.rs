//! The BLAS and LAPACK routines of Clarabel's semidefinite cone, in Rust.
//!
//! Clarabel's feature `sdp` calls eleven routines by their Fortran names and leaves it to the program to bring them along.
//! Every common provider needs a Fortran or C compiler, a system package or a download. This package brings them over
//! `nalgebra` instead, so that cargo alone builds the compiler, also inside a build script.
//!
//! Whoever links it says `use lapack_symbols as _;`. A program must not link another BLAS or LAPACK besides. From Rust
//! there is one function to call: [`singular_values`], because nalgebra's own are wrong on many singular matrices.
//!
//! | symbols | what they do | restrictions |
//! |---|---|---|
//! | `dgemm_` `dgemv_` `dsymv_` `dsyrk_` `dsyr2k_` | products | none |
//! | `dpotrf_` `dpotrs_` | Cholesky factor, solve with it | none |
//! | `dgesv_` | solve by LU with partial pivoting | none |
//! | `dsyevr_` | eigenvalues, eigenvectors of a symmetric matrix | none; `isuppz` is that of full vectors |
//! | `dgesdd_` `dgesvd_` | singular values and vectors | jobs `S` and `N` only |
//!
//! The single precision twins, which Clarabel also declares, are missing: nothing that solves in double precision
//! reaches them, and linkers drop what nobody reaches. All routines answer a work-size query (`lwork = -1`) with 1, since they
//! bring their own work space.
//!
//! `symbols` turns Fortran's arguments into matrix views and is all there is of `unsafe`; `blas`, `lapack` and `jacobi` are
//! ordinary Rust on these views.

mod arguments;
mod blas;
mod jacobi;
mod lapack;
mod symbols;

pub use jacobi::singular_values;
