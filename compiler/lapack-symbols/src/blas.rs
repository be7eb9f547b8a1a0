//! Products.

use nalgebra::{DMatrix, DVector};

use crate::arguments::{Triangle, View, ViewMut};

/// C = alpha A B + beta C.
pub(crate) fn gemm(alpha: f64, a: &DMatrix<f64>, b: &DMatrix<f64>, beta: f64, c: &mut ViewMut<'_>) {
    c.apply(|entry| *entry = scaled(beta, *entry));
    if alpha != 0.0 {
        c.gemm(alpha, a, b, 1.0);
    }
}

/// alpha A x + beta y.
pub(crate) fn gemv(alpha: f64, a: &DMatrix<f64>, x: &DVector<f64>, beta: f64, y: &DVector<f64>) -> DVector<f64> {
    let y = y.map(|entry| scaled(beta, entry));
    if alpha == 0.0 { y } else { a * x * alpha + y }
}

/// The symmetric matrix of which `a` states one triangle.
pub(crate) fn symmetric(a: &View<'_>, triangle: Triangle) -> DMatrix<f64> {
    DMatrix::from_fn(a.nrows(), a.nrows(), |i, j| if triangle.contains(i, j) { a[(i, j)] } else { a[(j, i)] })
}

/// C = alpha A A' + beta C in one triangle; the other is left alone.
pub(crate) fn syrk(triangle: Triangle, alpha: f64, a: &DMatrix<f64>, beta: f64, c: &mut ViewMut<'_>) {
    let product = if alpha == 0.0 { None } else { Some(a * a.transpose()) };
    update(triangle, c, |i, j, entry| scaled(beta, entry) + product.as_ref().map_or(0.0, |p| alpha * p[(i, j)]));
}

/// C = alpha A B' + alpha B A' + beta C in one triangle; the other is left alone.
pub(crate) fn syr2k(
    triangle: Triangle,
    alpha: f64,
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    beta: f64,
    c: &mut ViewMut<'_>,
) {
    let product = if alpha == 0.0 { None } else { Some(a * b.transpose()) };
    let both = |i, j| product.as_ref().map_or(0.0, |p| alpha * (p[(i, j)] + p[(j, i)]));
    update(triangle, c, |i, j, entry| scaled(beta, entry) + both(i, j));
}

fn update(triangle: Triangle, c: &mut ViewMut<'_>, new: impl Fn(usize, usize, f64) -> f64) {
    for j in 0..c.ncols() {
        for i in (0..c.nrows()).filter(|&i| triangle.contains(i, j)) {
            c[(i, j)] = new(i, j, c[(i, j)]);
        }
    }
}

/// beta = 0 stands for "not read": NaN must not survive it.
fn scaled(beta: f64, entry: f64) -> f64 {
    if beta == 0.0 { 0.0 } else { beta * entry }
}
