//! Fortran's calling convention: every argument is a pointer, matrices are stored by columns that lie a leading dimension
//! apart, and LAPACK reports in `info`: 0, minus the number of a wrong argument, or what went wrong.
//!
//! # Safety
//!
//! What the standard of BLAS and LAPACK asks of a caller is asked here: every pointer is valid; a matrix argument of r
//! rows, c columns and leading dimension ld >= r points to ld (c - 1) + r initialised numbers, a vector argument of n
//! entries and increment inc to |inc| (n - 1) + 1; what is written overlaps no other argument. Nothing is kept after the return.
#![expect(unsafe_code, reason = "symbols that Clarabel declares as C functions over raw pointers")]
#![expect(clippy::too_many_arguments, reason = "the argument lists of BLAS and LAPACK")]

use std::ffi::{c_char, c_int};

use nalgebra::{DMatrix, DVector, Dyn, U1};

use crate::arguments::{Triangle, View, ViewMut, extent, transposed};
use crate::{blas, jacobi, lapack};

// ---- from pointers to values ----

/// The character that an argument points to.
unsafe fn letter(pointer: *const c_char) -> u8 {
    // SAFETY: the caller's pointers are valid.
    unsafe { *pointer }.cast_unsigned()
}

/// A size or leading dimension; a negative one counts as 0 and then fails the checks of leading dimensions.
unsafe fn size(pointer: *const c_int) -> usize {
    // SAFETY: the caller's pointers are valid.
    usize::try_from(unsafe { *pointer }).unwrap_or(0)
}

/// `length` numbers; nothing is read through the pointer where there are none.
unsafe fn numbers<'a, T>(pointer: *const T, length: usize) -> &'a [T] {
    // SAFETY: the caller owns `length` initialised numbers there.
    if length == 0 { &[] } else { unsafe { std::slice::from_raw_parts(pointer, length) } }
}

unsafe fn numbers_mut<'a, T>(pointer: *mut T, length: usize) -> &'a mut [T] {
    // SAFETY: the caller owns `length` initialised numbers there, which no other argument overlaps.
    if length == 0 { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(pointer, length) } }
}

/// The matrix of `rows` x `columns` at `pointer`.
unsafe fn matrix<'a>(pointer: *const f64, rows: usize, columns: usize, ld: usize) -> View<'a> {
    check(ld, rows);
    // SAFETY: as `numbers`.
    let data = unsafe { numbers(pointer, extent(rows, columns, ld)) };
    View::from_slice_with_strides_generic(data, Dyn(rows), Dyn(columns), U1, Dyn(ld))
}

unsafe fn matrix_mut<'a>(pointer: *mut f64, rows: usize, columns: usize, ld: usize) -> ViewMut<'a> {
    check(ld, rows);
    // SAFETY: as `numbers_mut`.
    let data = unsafe { numbers_mut(pointer, extent(rows, columns, ld)) };
    ViewMut::from_slice_with_strides_generic(data, Dyn(rows), Dyn(columns), U1, Dyn(ld))
}

/// op(A), of `rows` x `columns`, of the matrix A at `pointer`.
unsafe fn operand(pointer: *const f64, rows: usize, columns: usize, ld: usize, transposed: bool) -> DMatrix<f64> {
    // SAFETY: as `matrix`.
    unsafe {
        if transposed {
            matrix(pointer, columns, rows, ld).transpose()
        } else {
            matrix(pointer, rows, columns, ld).clone_owned()
        }
    }
}

/// Columns that overlap: BLAS's own answer to a wrong argument is to stop the program.
fn check(ld: usize, rows: usize) {
    assert!(ld >= rows.max(1), "BLAS: leading dimension {ld} for {rows} rows");
}

/// Where entry k of n lies: a negative increment runs from the end.
fn place(k: usize, n: usize, increment: c_int) -> usize {
    let step = increment.unsigned_abs() as usize;
    if increment < 0 { (n - 1 - k) * step } else { k * step }
}

fn stretch(n: usize, increment: c_int) -> usize {
    assert!(increment != 0, "BLAS: increment 0");
    if n == 0 { 0 } else { (n - 1) * increment.unsigned_abs() as usize + 1 }
}

unsafe fn vector(pointer: *const f64, n: usize, increment: c_int) -> DVector<f64> {
    // SAFETY: as `numbers`.
    let data = unsafe { numbers(pointer, stretch(n, increment)) };
    DVector::from_fn(n, |k, _| data[place(k, n, increment)])
}

unsafe fn write_vector(values: &DVector<f64>, pointer: *mut f64, increment: c_int) {
    let n = values.len();
    // SAFETY: as `numbers_mut`.
    let data = unsafe { numbers_mut(pointer, stretch(n, increment)) };
    for (k, value) in values.iter().enumerate() {
        data[place(k, n, increment)] = *value;
    }
}

/// A character argument; BLAS's own answer to a wrong one is to stop the program.
fn known<T>(name: &str, meaning: Option<T>) -> T {
    meaning.unwrap_or_else(|| panic!("BLAS: `{name}` is none of the characters it can be"))
}

// ---- products ----

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgemm_(
    transa: *const c_char,
    transb: *const c_char,
    m: *const c_int,
    n: *const c_int,
    k: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    b: *const f64,
    ldb: *const c_int,
    beta: *const f64,
    c: *mut f64,
    ldc: *const c_int,
) {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (m, n, k) = (size(m), size(n), size(k));
        let a = operand(a, m, k, size(lda), known("transa", transposed(letter(transa))));
        let b = operand(b, k, n, size(ldb), known("transb", transposed(letter(transb))));
        blas::gemm(*alpha, &a, &b, *beta, &mut matrix_mut(c, m, n, size(ldc)));
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgemv_(
    trans: *const c_char,
    m: *const c_int,
    n: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    x: *const f64,
    incx: *const c_int,
    beta: *const f64,
    y: *mut f64,
    incy: *const c_int,
) {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let transposed = known("trans", transposed(letter(trans)));
        let (rows, columns) = if transposed { (size(n), size(m)) } else { (size(m), size(n)) };
        let a = operand(a, rows, columns, size(lda), transposed);
        let (x, old) = (vector(x, a.ncols(), *incx), vector(y, a.nrows(), *incy));
        write_vector(&blas::gemv(*alpha, &a, &x, *beta, &old), y, *incy);
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsymv_(
    uplo: *const c_char,
    n: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    x: *const f64,
    incx: *const c_int,
    beta: *const f64,
    y: *mut f64,
    incy: *const c_int,
) {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let n = size(n);
        let whole = blas::symmetric(&matrix(a, n, n, size(lda)), known("uplo", Triangle::of(letter(uplo))));
        let (x, old) = (vector(x, n, *incx), vector(y, n, *incy));
        write_vector(&blas::gemv(*alpha, &whole, &x, *beta, &old), y, *incy);
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsyrk_(
    uplo: *const c_char,
    trans: *const c_char,
    n: *const c_int,
    k: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    beta: *const f64,
    c: *mut f64,
    ldc: *const c_int,
) {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let n = size(n);
        let triangle = known("uplo", Triangle::of(letter(uplo)));
        let a = operand(a, n, size(k), size(lda), known("trans", transposed(letter(trans))));
        blas::syrk(triangle, *alpha, &a, *beta, &mut matrix_mut(c, n, n, size(ldc)));
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsyr2k_(
    uplo: *const c_char,
    trans: *const c_char,
    n: *const c_int,
    k: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    b: *const f64,
    ldb: *const c_int,
    beta: *const f64,
    c: *mut f64,
    ldc: *const c_int,
) {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (n, k) = (size(n), size(k));
        let triangle = known("uplo", Triangle::of(letter(uplo)));
        let transposed = known("trans", transposed(letter(trans)));
        let a = operand(a, n, k, size(lda), transposed);
        let b = operand(b, n, k, size(ldb), transposed);
        blas::syr2k(triangle, *alpha, &a, &b, *beta, &mut matrix_mut(c, n, n, size(ldc)));
    }
}

// ---- factorisations ----

/// What LAPACK writes to `info` for a factorisation that stops at some order.
fn order(result: Result<(), usize>) -> c_int {
    result.map_or_else(|order| c_int::try_from(order).unwrap_or(c_int::MAX), |()| 0)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dpotrf_(
    uplo: *const c_char,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (n, lda) = (size(n), size(lda));
        *info = match Triangle::of(letter(uplo)) {
            None => -1,
            Some(_) if lda < n.max(1) => -4,
            Some(triangle) => order(lapack::potrf(triangle, &mut matrix_mut(a, n, n, lda))),
        };
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dpotrs_(
    uplo: *const c_char,
    n: *const c_int,
    nrhs: *const c_int,
    a: *const f64,
    lda: *const c_int,
    b: *mut f64,
    ldb: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (n, lda, ldb) = (size(n), size(lda), size(ldb));
        *info = match Triangle::of(letter(uplo)) {
            None => -1,
            Some(_) if lda < n.max(1) => -5,
            Some(_) if ldb < n.max(1) => -7,
            Some(triangle) => {
                let mut b = matrix_mut(b, n, size(nrhs), ldb);
                lapack::potrs(triangle, &matrix(a, n, n, lda), &mut b);
                0
            }
        };
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgesv_(
    n: *const c_int,
    nrhs: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    ipiv: *mut c_int,
    b: *mut f64,
    ldb: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (n, lda, ldb) = (size(n), size(lda), size(ldb));
        if lda < n.max(1) || ldb < n.max(1) {
            *info = if lda < n.max(1) { -4 } else { -7 };
            return;
        }
        let mut pivots = vec![0; n];
        let mut b = matrix_mut(b, n, size(nrhs), ldb);
        *info = order(lapack::gesv(&mut matrix_mut(a, n, n, lda), &mut pivots, &mut b));
        for (written, row) in numbers_mut(ipiv, n).iter_mut().zip(pivots) {
            *written = c_int::try_from(row + 1).unwrap_or(c_int::MAX);
        }
    }
}

// ---- eigenvalues and singular values ----

/// The work space these routines ask for; they use none.
const WORK: f64 = 1.0;

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsyevr_(
    jobz: *const c_char,
    range: *const c_char,
    uplo: *const c_char,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    vl: *const f64,
    vu: *const f64,
    il: *const c_int,
    iu: *const c_int,
    _abstol: *const f64,
    m: *mut c_int,
    w: *mut f64,
    z: *mut f64,
    ldz: *const c_int,
    isuppz: *mut c_int,
    work: *mut f64,
    lwork: *const c_int,
    iwork: *mut c_int,
    liwork: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (n, lda, ldz) = (size(n), size(lda), size(ldz));
        let (job, range) = (letter(jobz).to_ascii_uppercase(), letter(range).to_ascii_uppercase());
        let wrong = match Triangle::of(letter(uplo)) {
            _ if job != b'N' && job != b'V' => Some(-1),
            _ if !b"AVI".contains(&range) => Some(-2),
            None => Some(-3),
            Some(_) if lda < n.max(1) => Some(-6),
            Some(_) if job == b'V' && ldz < n.max(1) => Some(-15),
            Some(_) => None,
        };
        *info = wrong.unwrap_or(0);
        if wrong.is_some() {
            return;
        }
        if *lwork == -1 || *liwork == -1 {
            *work = WORK;
            *iwork = 1;
            return;
        }
        let triangle = known("uplo", Triangle::of(letter(uplo)));
        let chosen = match range {
            b'V' => Chosen::Values(*vl, *vu),
            b'I' => Chosen::Places(size(il), size(iu)),
            _ => Chosen::All,
        };
        match lapack::eigen(&matrix(a, n, n, lda), triangle, job == b'V') {
            None => *info = 1,
            Some((values, vectors)) => {
                let chosen: Vec<usize> = (0..n).filter(|&k| chosen.has(k, values[k])).collect();
                *m = c_int::try_from(chosen.len()).unwrap_or(c_int::MAX);
                let written = numbers_mut(w, chosen.len()).iter_mut();
                chosen.iter().zip(written).for_each(|(&k, written)| *written = values[k]);
                if let Some(vectors) = vectors {
                    matrix_mut(z, n, chosen.len(), ldz).copy_from(&vectors.select_columns(&chosen));
                    let support = [1, c_int::try_from(n).unwrap_or(c_int::MAX)];
                    let written = numbers_mut(isuppz, 2 * chosen.len()).iter_mut();
                    written.zip(support.iter().cycle()).for_each(|(written, end)| *written = *end);
                }
            }
        }
    }
}

/// `range` of dsyevr.
enum Chosen {
    All,
    /// Above the first, up to the second.
    Values(f64, f64),
    /// From 1, both included.
    Places(usize, usize),
}

impl Chosen {
    fn has(&self, k: usize, value: f64) -> bool {
        match *self {
            Self::All => true,
            Self::Values(low, high) => low < value && value <= high,
            Self::Places(first, last) => (first..=last).contains(&(k + 1)),
        }
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgesdd_(
    jobz: *const c_char,
    m: *const c_int,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    s: *mut f64,
    u: *mut f64,
    ldu: *const c_int,
    vt: *mut f64,
    ldvt: *const c_int,
    work: *mut f64,
    lwork: *const c_int,
    _iwork: *mut c_int,
    info: *mut c_int,
) {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let sizes = SvdSizes { m: size(m), n: size(n), lda: size(lda), ldu: size(ldu), ldvt: size(ldvt) };
        let job = wanted(letter(jobz));
        *info = match job {
            None => -1,
            Some(vectors) => sizes.wrong(vectors, vectors, [5, 8, 10]),
        };
        if let (Some(vectors), 0) = (job, *info) {
            *info = sizes.answer(a, vectors, vectors, s, u, vt, work, *lwork);
        }
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgesvd_(
    jobu: *const c_char,
    jobvt: *const c_char,
    m: *const c_int,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    s: *mut f64,
    u: *mut f64,
    ldu: *const c_int,
    vt: *mut f64,
    ldvt: *const c_int,
    work: *mut f64,
    lwork: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let sizes = SvdSizes { m: size(m), n: size(n), lda: size(lda), ldu: size(ldu), ldvt: size(ldvt) };
        let jobs = (wanted(letter(jobu)), wanted(letter(jobvt)));
        *info = match jobs {
            (None, _) => -1,
            (_, None) => -2,
            (Some(left), Some(right)) => sizes.wrong(left, right, [6, 9, 11]),
        };
        if let (Some(left), Some(right), 0) = (jobs.0, jobs.1, *info) {
            *info = sizes.answer(a, left, right, s, u, vt, work, *lwork);
        }
    }
}

/// Whether singular vectors are wanted, of the jobs on offer.
fn wanted(job: u8) -> Option<bool> {
    match job.to_ascii_uppercase() {
        b'S' => Some(true),
        b'N' => Some(false),
        _ => None,
    }
}

struct SvdSizes {
    m: usize,
    n: usize,
    lda: usize,
    ldu: usize,
    ldvt: usize,
}

impl SvdSizes {
    fn least(&self) -> usize {
        self.m.min(self.n)
    }

    /// Minus the number of the first leading dimension that does not fit, else 0.
    fn wrong(&self, left: bool, right: bool, [lda, ldu, ldvt]: [c_int; 3]) -> c_int {
        match () {
            () if self.lda < self.m.max(1) => -lda,
            () if left && self.ldu < self.m.max(1) => -ldu,
            () if right && self.ldvt < self.least().max(1) => -ldvt,
            () => 0,
        }
    }

    /// Answers the work-size query or decomposes; returns `info`.
    unsafe fn answer(
        &self,
        a: *const f64,
        left: bool,
        right: bool,
        s: *mut f64,
        u: *mut f64,
        vt: *mut f64,
        work: *mut f64,
        lwork: c_int,
    ) -> c_int {
        // SAFETY: the contract at the head of this file.
        unsafe {
            if lwork == -1 {
                *work = WORK;
                return 0;
            }
            if self.least() == 0 {
                return 0;
            }
            let Some(svd) = jacobi::svd(&matrix(a, self.m, self.n, self.lda)) else { return 1 };
            numbers_mut(s, self.least()).copy_from_slice(svd.values.as_slice());
            if left {
                matrix_mut(u, self.m, self.least(), self.ldu).copy_from(&svd.u);
            }
            if right {
                matrix_mut(vt, self.least(), self.n, self.ldvt).copy_from(&svd.v.transpose());
            }
            0
        }
    }
}
