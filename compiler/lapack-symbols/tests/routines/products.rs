//! Do the products agree with sums written out, for every transpose, triangle, leading dimension and increment?

use crate::stored::{Numbers, Stored};
use crate::strided::Strided;

const SIZES: [usize; 4] = [1, 3, 7, 12];

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-13 * (1.0 + expected.abs()), "{found} is not {expected}");
}

/// op(A)_ij.
fn entry(a: &Stored, trans: u8, i: usize, j: usize) -> f64 {
    if trans == b'N' { a.at(i, j) } else { a.at(j, i) }
}

fn stored(numbers: &mut Numbers, trans: u8, rows: usize, columns: usize) -> Stored {
    if trans == b'N' { numbers.matrix(rows, columns) } else { numbers.matrix(columns, rows) }
}

#[test]
fn general_products() {
    let mut numbers = Numbers::new(1);
    for (m, n, k) in SIZES.iter().flat_map(|&m| SIZES.iter().map(move |&n| (m, n, (m + 2 * n) % 9 + 1))) {
        for (ta, tb) in [(b'N', b'N'), (b'T', b'N'), (b'N', b'T'), (b'C', b'T')] {
            for (alpha, beta) in [(1.0, 0.0), (-0.7, 1.0), (0.0, 2.0), (2.5, -0.5)] {
                let (a, b) = (stored(&mut numbers, ta, m, k), stored(&mut numbers, tb, k, n));
                let c = numbers.matrix(m, n);
                let mut new = c.clone();
                unsafe {
                    blas::dgemm(
                        ta,
                        tb,
                        m as i32,
                        n as i32,
                        k as i32,
                        alpha,
                        &a.data,
                        a.ld,
                        &b.data,
                        b.ld,
                        beta,
                        &mut new.data,
                        new.ld,
                    );
                }
                for (i, j) in new.places() {
                    let product: f64 = (0..k).map(|l| entry(&a, ta, i, l) * entry(&b, tb, l, j)).sum();
                    close(new.at(i, j), alpha * product + beta * c.at(i, j));
                }
                assert!(new.padding_is(&c), "wrote between the columns");
            }
        }
    }
}

#[test]
fn beta_0_means_not_read() {
    let mut numbers = Numbers::new(2);
    let (a, mut c) = (numbers.matrix(6, 6), numbers.matrix(6, 6));
    c.places().for_each(|(i, j)| c.set(i, j, f64::NAN));
    unsafe { blas::dgemm(b'N', b'N', 6, 6, 6, 1.0, &a.data, a.ld, &a.data, a.ld, 0.0, &mut c.data, c.ld) };
    assert!(c.places().all(|(i, j)| c.at(i, j).is_finite()));
    c.places().for_each(|(i, j)| c.set(i, j, f64::NAN));
    unsafe { blas::dsyrk(b'U', b'N', 6, 6, 1.0, &a.data, a.ld, 0.0, &mut c.data, c.ld) };
    assert!(c.places().all(|(i, j)| c.at(i, j).is_finite() == (i <= j)));
}

#[test]
fn matrix_times_vector_with_every_increment() {
    let mut numbers = Numbers::new(3);
    for (m, n) in SIZES.iter().flat_map(|&m| SIZES.iter().map(move |&n| (m, n))) {
        for (trans, incx, incy) in [(b'N', 1, 1), (b'T', 2, 1), (b'N', -1, 3), (b'T', 1, -2)] {
            let a = numbers.matrix(m, n);
            let (rows, columns) = if trans == b'N' { (m, n) } else { (n, m) };
            let (x, y) = (Strided::random(&mut numbers, columns, incx), Strided::random(&mut numbers, rows, incy));
            let mut new = y.clone();
            let (alpha, beta) = (1.5, -0.5);
            unsafe {
                blas::dgemv(trans, m as i32, n as i32, alpha, &a.data, a.ld, &x.data, incx, beta, &mut new.data, incy);
            }
            for i in 0..rows {
                let product: f64 = (0..columns).map(|j| entry(&a, trans, i, j) * x.at(j)).sum();
                close(new.at(i), alpha * product + beta * y.at(i));
            }
        }
    }
}

#[test]
fn symmetric_matrix_times_vector_reads_one_triangle() {
    let mut numbers = Numbers::new(4);
    for n in SIZES {
        for uplo in [b'U', b'L'] {
            let a = numbers.matrix(n, n);
            let (x, y) = (Strided::random(&mut numbers, n, -2), Strided::random(&mut numbers, n, 1));
            let mut new = y.clone();
            unsafe { blas::dsymv(uplo, n as i32, 2.0, &a.data, a.ld, &x.data, -2, 0.5, &mut new.data, 1) };
            for i in 0..n {
                let product: f64 = (0..n).map(|j| a.symmetric(uplo, i, j) * x.at(j)).sum();
                close(new.at(i), 2.0 * product + 0.5 * y.at(i));
            }
        }
    }
}

#[test]
fn symmetric_updates_write_one_triangle() {
    let mut numbers = Numbers::new(5);
    for (n, k) in SIZES.iter().flat_map(|&n| SIZES.iter().map(move |&k| (n, k))) {
        for (uplo, trans) in [(b'U', b'N'), (b'U', b'T'), (b'L', b'N'), (b'L', b'T')] {
            let (a, b) = (stored(&mut numbers, trans, n, k), stored(&mut numbers, trans, n, k));
            let c = numbers.matrix(n, n);
            let (mut one, mut two) = (c.clone(), c.clone());
            let (alpha, beta) = (0.8, 0.3);
            unsafe {
                blas::dsyrk(uplo, trans, n as i32, k as i32, alpha, &a.data, a.ld, beta, &mut one.data, one.ld);
                blas::dsyr2k(
                    uplo,
                    trans,
                    n as i32,
                    k as i32,
                    alpha,
                    &a.data,
                    a.ld,
                    &b.data,
                    b.ld,
                    beta,
                    &mut two.data,
                    two.ld,
                );
            }
            let product = |x: &Stored, y: &Stored, i: usize, j: usize| -> f64 {
                (0..k).map(|l| entry(x, trans, i, l) * entry(y, trans, j, l)).sum()
            };
            for (i, j) in c.places() {
                if (i <= j) == (uplo == b'U') || i == j {
                    close(one.at(i, j), alpha * product(&a, &a, i, j) + beta * c.at(i, j));
                    let both = product(&a, &b, i, j) + product(&b, &a, i, j);
                    close(two.at(i, j), alpha * both + beta * c.at(i, j));
                } else {
                    assert_eq!((one.at(i, j), two.at(i, j)), (c.at(i, j), c.at(i, j)));
                }
            }
        }
    }
}
