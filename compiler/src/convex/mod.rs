//! Mathematics of sets; knows no subsystem.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::{DMatrix, DVector};

/// {x : |P x| <= q}, symmetric about 0; q >= 0. Two facets per row.
#[derive(Debug, Clone, PartialEq)]
pub struct Strips {
    pub P: DMatrix<f64>,
    pub q: DVector<f64>,
}

/// {x : min <= x <= max}.
#[derive(Debug, Clone, PartialEq)]
pub struct Box {
    pub min: DVector<f64>,
    pub max: DVector<f64>,
}

/// {x : H x <= h}.
#[derive(Debug, Clone, PartialEq)]
pub struct Polytope {
    pub H: DMatrix<f64>,
    pub h: DVector<f64>,
}
