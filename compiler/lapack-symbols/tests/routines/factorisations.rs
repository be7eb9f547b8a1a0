//! Do the factorisations give back what was factored, and do they refuse what they must?

use crate::stored::{Numbers, Stored};
use nalgebra::DMatrix;

const SIZES: [usize; 5] = [1, 2, 4, 9, 30];

fn positive(numbers: &mut Numbers, n: usize) -> DMatrix<f64> {
    let a = numbers.matrix(n, n).dense();
    &a * a.transpose() + DMatrix::identity(n, n) * 0.1
}

fn symmetric(numbers: &mut Numbers, n: usize) -> DMatrix<f64> {
    let a = numbers.matrix(n, n).dense();
    &a + a.transpose()
}

/// Only one triangle of a symmetric matrix, NaN in the other.
fn half(matrix: &DMatrix<f64>, uplo: u8, ld: usize) -> Stored {
    let kept = |i: usize, j: usize| (i <= j) == (uplo == b'U') || i == j;
    let half = matrix.map_with_location(|i, j, entry| if kept(i, j) { entry } else { f64::NAN });
    Stored::store(&half, ld)
}

#[test]
fn cholesky_factors_solve() {
    let mut numbers = Numbers::new(11);
    for (n, uplo) in SIZES.iter().flat_map(|&n| [(n, b'U'), (n, b'L')]) {
        let whole = positive(&mut numbers, n);
        let expected = numbers.matrix(n, 3).dense();
        let (mut a, mut b) = (half(&whole, uplo, n + 2), Stored::store(&(&whole * &expected), n + 1));
        let mut info = -99;
        unsafe { lapack::dpotrf(uplo, n as i32, &mut a.data, a.ld, &mut info) };
        assert_eq!(info, 0);
        let factor = if uplo == b'U' { a.dense().upper_triangle() } else { a.dense().lower_triangle() };
        let product = if uplo == b'U' { factor.tr_mul(&factor) } else { &factor * factor.transpose() };
        assert!((product - &whole).amax() < 1e-13 * whole.amax() * n as f64);
        let other = whole.clone().cholesky().expect("positive definite").l();
        assert!((if uplo == b'U' { factor.transpose() } else { factor } - other).amax() < 1e-11);
        unsafe { lapack::dpotrs(uplo, n as i32, 3, &a.data, a.ld, &mut b.data, b.ld, &mut info) };
        assert_eq!(info, 0);
        assert!((b.dense() - expected).amax() < 1e-10);
    }
}

#[test]
fn cholesky_names_the_minor_that_is_not_positive() {
    let mut numbers = Numbers::new(12);
    for (k, uplo) in (0..6).flat_map(|k| [(k, b'U'), (k, b'L')]) {
        let mut whole = positive(&mut numbers, 6);
        whole[(k, k)] = -1.0;
        let mut a = half(&whole, uplo, 6);
        let mut info = 0;
        unsafe { lapack::dpotrf(uplo, 6, &mut a.data, a.ld, &mut info) };
        assert_eq!(info, k as i32 + 1);
    }
}

#[test]
fn wrong_arguments_are_named() {
    let (mut a, mut b, mut info) = ([1.0; 9], [1.0; 9], 0);
    unsafe { lapack::dpotrf(b'X', 3, &mut a, 3, &mut info) };
    assert_eq!(info, -1);
    unsafe { lapack::dpotrf(b'U', 3, &mut a, 2, &mut info) };
    assert_eq!(info, -4);
    unsafe { lapack::dpotrs(b'L', 3, 1, &a, 3, &mut b, 2, &mut info) };
    assert_eq!(info, -7);
    unsafe { lapack::dgesv(3, 1, &mut a, 1, &mut [0; 3], &mut b, 3, &mut info) };
    assert_eq!(info, -4);
}

#[test]
fn linear_equations() {
    let mut numbers = Numbers::new(13);
    for n in SIZES {
        let (whole, expected) = (numbers.matrix(n, n).dense(), numbers.matrix(n, 2).dense());
        let (mut a, mut b) = (Stored::store(&whole, n + 3), Stored::store(&(&whole * &expected), n));
        let (mut pivots, mut info) = (vec![0; n], -99);
        unsafe { lapack::dgesv(n as i32, 2, &mut a.data, a.ld, &mut pivots, &mut b.data, b.ld, &mut info) };
        assert_eq!(info, 0);
        assert!((b.dense() - expected).amax() < 1e-9);
        // P A = L U, with the exchanges of `ipiv` in order.
        let lu = a.dense();
        let lower = DMatrix::from_fn(n, n, |i, j| if i == j { 1.0 } else { lu[(i, j)] * f64::from(i > j) });
        let mut permuted = whole.clone();
        pivots.iter().enumerate().for_each(|(k, &p)| permuted.swap_rows(k, p as usize - 1));
        assert!((lower.clone() * lu.upper_triangle() - permuted).amax() < 1e-13 * n as f64);
        assert!(lower.amax() <= 1.0, "the largest pivot of each column is taken");
    }
}

#[test]
fn a_singular_matrix_is_refused() {
    let mut a = [1.0, 2.0, 2.0, 4.0];
    let (mut b, mut pivots, mut info) = ([1.0, 1.0], [0; 2], 0);
    unsafe { lapack::dgesv(2, 1, &mut a, 2, &mut pivots, &mut b, 2, &mut info) };
    assert_eq!((info, b), (2, [1.0, 1.0]));
}

/// The answer to a query, then the answer with what it asked for.
fn syevr(job: u8, range: u8, uplo: u8, whole: &DMatrix<f64>, bounds: (f64, f64), places: (i32, i32)) -> Eigen {
    let n = whole.nrows();
    let mut a = half(whole, uplo, n + 1);
    let (mut m, mut info) = (0, -99);
    let (mut values, mut z) = (vec![0.0; n], Stored::store(&DMatrix::zeros(n, n), n + 2));
    let mut support = vec![0; 2 * n];
    let (mut work, mut iwork) = (vec![0.0], vec![0]);
    for query in [true, false] {
        let (lwork, liwork) = if query { (-1, -1) } else { (work.len() as i32, iwork.len() as i32) };
        unsafe {
            lapack::dsyevr(
                job,
                range,
                uplo,
                n as i32,
                &mut a.data,
                a.ld,
                bounds.0,
                bounds.1,
                places.0,
                places.1,
                -1.0,
                &mut m,
                &mut values,
                &mut z.data,
                z.ld,
                &mut support,
                &mut work,
                lwork,
                &mut iwork,
                liwork,
                &mut info,
            );
        }
        assert_eq!(info, 0);
        if query {
            assert!(m == 0 && values.iter().all(|v| *v == 0.0), "a query computes nothing");
            let (more, imore) = (work[0] as usize, iwork[0] as usize);
            assert!(more >= 1 && imore >= 1);
            work.resize(more, 0.0);
            iwork.resize(imore, 0);
        }
    }
    values.truncate(m as usize);
    Eigen { values, vectors: z.dense().columns(0, m as usize).into_owned() }
}

struct Eigen {
    values: Vec<f64>,
    vectors: DMatrix<f64>,
}

const EVERYTHING: ((f64, f64), (i32, i32)) = ((0.0, 0.0), (0, 0));

#[test]
fn eigenvalues_ascend_and_vectors_give_the_matrix_back() {
    let mut numbers = Numbers::new(14);
    for (n, uplo) in SIZES.iter().flat_map(|&n| [(n, b'U'), (n, b'L')]) {
        let whole = symmetric(&mut numbers, n);
        let Eigen { values, vectors } = syevr(b'V', b'A', uplo, &whole, EVERYTHING.0, EVERYTHING.1);
        let alone = syevr(b'N', b'A', uplo, &whole, EVERYTHING.0, EVERYTHING.1).values;
        assert!(values.is_sorted() && alone.is_sorted());
        assert!(values.iter().zip(&alone).all(|(a, b)| (a - b).abs() < 1e-12 * n as f64));
        let back = &vectors * DMatrix::from_diagonal(&values.into()) * vectors.transpose();
        assert!((back - &whole).amax() < 1e-13 * n as f64);
        assert!((vectors.tr_mul(&vectors) - DMatrix::identity(n, n)).amax() < 1e-13 * n as f64);
    }
}

#[test]
fn eigenvalues_of_singular_and_badly_scaled_matrices() {
    let mut numbers = Numbers::new(18);
    for n in [4, 8, 16] {
        let thin = numbers.matrix(n, 2).dense();
        let root = DMatrix::from_fn(n, n, |i, j| 0.01_f64.powi((i + j) as i32 / 2) * numbers.number());
        let shift = DMatrix::from_fn(n, n, |i, j| f64::from(i.abs_diff(j) == 2));
        for whole in
            [&thin * thin.transpose(), &root + root.transpose(), shift, DMatrix::zeros(n, n), DMatrix::identity(n, n)]
        {
            let Eigen { values, vectors } = syevr(b'V', b'A', b'U', &whole, EVERYTHING.0, EVERYTHING.1);
            let back = &vectors * DMatrix::from_diagonal(&values.clone().into()) * vectors.transpose();
            assert!((back - &whole).amax() < 1e-13 * n as f64, "{whole}");
            assert!((vectors.tr_mul(&vectors) - DMatrix::identity(n, n)).amax() < 1e-13 * n as f64, "{whole}");
            let alone = syevr(b'N', b'A', b'U', &whole, EVERYTHING.0, EVERYTHING.1).values;
            assert!(values.iter().zip(&alone).all(|(a, b)| (a - b).abs() < 1e-13 * n as f64), "{whole}");
        }
    }
}

#[test]
fn eigenvalues_by_range() {
    let mut numbers = Numbers::new(15);
    let whole = symmetric(&mut numbers, 8);
    let all = syevr(b'N', b'A', b'U', &whole, EVERYTHING.0, EVERYTHING.1).values;
    let some = syevr(b'V', b'I', b'U', &whole, EVERYTHING.0, (3, 5));
    assert!(some.values.iter().zip(&all[2..5]).all(|(a, b)| (a - b).abs() < 1e-12) && some.values.len() == 3);
    for (k, value) in some.values.iter().enumerate() {
        let v = some.vectors.column(k);
        assert!((&whole * v - v * *value).norm() < 1e-12);
    }
    let between = (0.5 * (all[1] + all[2]), 0.5 * (all[5] + all[6]));
    assert_eq!(syevr(b'N', b'V', b'L', &whole, between, EVERYTHING.1).values.len(), 4);
}

#[test]
fn known_eigenvalues() {
    let whole = DMatrix::from_row_slice(
        4,
        4,
        &[3.0, 2.0, 4.0, 0.0, 2.0, 0.0, 2.0, 0.0, 4.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 9.0],
    );
    let values = syevr(b'N', b'A', b'U', &whole, EVERYTHING.0, EVERYTHING.1).values;
    assert!(values.iter().zip([-1.0, -1.0, 8.0, 9.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{values:?}");
}

struct Svd {
    values: Vec<f64>,
    u: DMatrix<f64>,
    vt: DMatrix<f64>,
}

/// By dgesdd where `divide`, else by dgesvd.
fn svd(divide: bool, job: u8, whole: &DMatrix<f64>) -> Svd {
    let ((m, n), k) = (whole.shape(), whole.nrows().min(whole.ncols()));
    let mut a = Stored::store(whole, m + 1);
    let mut values = vec![0.0; k];
    let mut u = Stored::store(&DMatrix::zeros(m, k), m + 2);
    let mut vt = Stored::store(&DMatrix::zeros(k, n), k + 1);
    let (mut work, mut iwork, mut info) = (vec![0.0], vec![0; 8 * k], -99);
    for lwork in [-1, 1] {
        let (m, n) = (m as i32, n as i32);
        unsafe {
            if divide {
                lapack::dgesdd(
                    job,
                    m,
                    n,
                    &mut a.data,
                    a.ld,
                    &mut values,
                    &mut u.data,
                    u.ld,
                    &mut vt.data,
                    vt.ld,
                    &mut work,
                    lwork,
                    &mut iwork,
                    &mut info,
                );
            } else {
                lapack::dgesvd(
                    job,
                    job,
                    m,
                    n,
                    &mut a.data,
                    a.ld,
                    &mut values,
                    &mut u.data,
                    u.ld,
                    &mut vt.data,
                    vt.ld,
                    &mut work,
                    lwork,
                    &mut info,
                );
            }
        }
        assert_eq!((info, work[0]), (0, 1.0));
    }
    Svd { values, u: u.dense(), vt: vt.dense() }
}

fn check_svd(whole: &DMatrix<f64>) {
    let size = whole.amax().max(f64::MIN_POSITIVE) * (whole.nrows() + whole.ncols()) as f64;
    for divide in [true, false] {
        let Svd { values, u, vt } = svd(divide, b'S', whole);
        let k = values.len();
        assert!(values.windows(2).all(|pair| pair[0] >= pair[1]) && values.iter().all(|v| *v >= 0.0), "{values:?}");
        let back = &u * DMatrix::from_diagonal(&values.clone().into()) * &vt;
        assert!((back - whole).amax() < 1e-14 * size, "{whole}");
        assert!((u.tr_mul(&u) - DMatrix::identity(k, k)).amax() < 1e-12, "{whole}");
        assert!((&vt * vt.transpose() - DMatrix::identity(k, k)).amax() < 1e-12, "{whole}");
        let alone = svd(divide, b'N', whole).values;
        assert!(alone.iter().zip(&values).all(|(a, b)| (a - b).abs() < 1e-14 * size));
    }
}

#[test]
fn singular_vectors_give_the_matrix_back() {
    let mut numbers = Numbers::new(16);
    for (m, n) in SIZES.iter().flat_map(|&m| SIZES.iter().map(move |&n| (m, n))) {
        check_svd(&numbers.matrix(m, n).dense());
    }
}

/// What an interior-point method produces near the boundary of the cone.
#[test]
fn badly_scaled_and_singular_matrices() {
    let mut numbers = Numbers::new(17);
    for n in [4, 8, 16] {
        for ratio in [1e-1_f64, 1e-2, 1e-3] {
            let graded = DMatrix::from_fn(n, n, |i, j| ratio.powi((i + j) as i32 / 2) * numbers.number());
            check_svd(&graded);
        }
        let thin = numbers.matrix(n, 2).dense();
        check_svd(&(&thin * thin.transpose()));
        check_svd(&DMatrix::zeros(n, n));
        check_svd(&DMatrix::identity(n, n));
        check_svd(&DMatrix::from_fn(n, n, |i, j| f64::from(j == i + 1)));
        check_svd(&(positive(&mut numbers, n).cholesky().expect("positive definite").l() * 1e-9));
    }
}

#[test]
fn not_a_number_is_an_error_and_not_an_endless_loop() {
    let mut a = [f64::NAN; 16];
    let (mut values, mut u, mut vt, mut info) = ([0.0; 4], [0.0; 16], [0.0; 16], 0);
    unsafe {
        lapack::dgesdd(
            b'S',
            4,
            4,
            &mut a,
            4,
            &mut values,
            &mut u,
            4,
            &mut vt,
            4,
            &mut [0.0],
            1,
            &mut [0; 32],
            &mut info,
        )
    };
    assert!(info > 0);
    let (mut m, mut isuppz) = (0, [0; 8]);
    unsafe {
        lapack::dsyevr(
            b'N',
            b'A',
            b'U',
            4,
            &mut a,
            4,
            0.0,
            0.0,
            0,
            0,
            -1.0,
            &mut m,
            &mut values,
            &mut u,
            4,
            &mut isuppz,
            &mut [0.0],
            1,
            &mut [0],
            1,
            &mut info,
        );
    }
    assert!(info > 0);
}
