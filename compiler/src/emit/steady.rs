//! chi at rest, (9), as a linear map of the outputs and of the loads of the network.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::{DMatrix, DVector};

use crate::design::Design;
use crate::gains::Proof;
use crate::optim::block_lu::BlockLu;
use crate::optim::responses::starts;
use crate::optim::sparse::Sparse;

pub enum Steady {
    /// From the outputs of the network, and from its loads.
    Dense { outputs: DMatrix<f64>, loads: DMatrix<f64> },
    /// Of a large network, by one sparse row after the other.
    Sparse { lu: BlockLu, calF: Sparse, calG: Sparse, Mcal: Sparse },
}

impl Steady {
    pub fn new(design: &Design) -> Self {
        let steady = match design.gains.proof {
            Proof::Norm(_) => Self::dense(design),
            Proof::Responses(_) => Self::sparse(design),
        };
        steady.unwrap_or_else(|| unreachable!("calF has no eigenvalue 1: Gains proved it Schur"))
    }

    fn dense(design: &Design) -> Option<Self> {
        let outputs = design.gains.steady()?;
        let loads = crate::sets::loads::steady(&design.network, &design.gains)?;
        Some(Self::Dense { outputs, loads })
    }

    fn sparse(design: &Design) -> Option<Self> {
        let (network, gains) = (&design.network, &design.gains);
        let columns = starts(network.subsystems.iter().map(|s| s.loads.len()));
        let places = gains.chi_offset.iter().copied().zip(columns.iter().copied());
        let blocks = places.zip(network.subsystems.iter().map(|s| &s.loads.M));
        let Mcal = Sparse::from_blocks(gains.calF.nrows(), columns[network.subsystems.len()], blocks);
        let lu = BlockLu::of_identity_minus(&gains.calF, &gains.chi_starts())?;
        Some(Self::Sparse { lu, calF: gains.calF.clone(), calG: gains.calG.clone(), Mcal })
    }

    /// Whether rows are to be written as lists of their entries.
    pub fn is_sparse(&self) -> bool {
        matches!(self, Self::Sparse { .. })
    }

    /// Rows `first`, ... of chi at rest, over the outputs and over the loads of the network.
    pub fn rows(&self, first: usize, count: usize) -> (DMatrix<f64>, DMatrix<f64>) {
        match self {
            Self::Dense { outputs, loads } => {
                (outputs.rows(first, count).into_owned(), loads.rows(first, count).into_owned())
            }
            Self::Sparse { lu, calF, calG, Mcal } => {
                let row = |k: usize| {
                    let d = DVector::from_fn(calF.nrows(), |j, _| f64::from(j == first + k));
                    let x = lu.solve_row(&d);
                    &x + lu.solve_row(&(d - &x + calF.row_times(&x)))
                };
                let rows: Vec<_> = (0..count).map(row).collect();
                let onto = |matrix: &Sparse| {
                    let mut onto = DMatrix::zeros(count, matrix.ncols());
                    for (k, x) in rows.iter().enumerate() {
                        onto.row_mut(k).tr_copy_from(&matrix.row_times(x));
                    }
                    onto
                };
                (onto(calG), onto(Mcal))
            }
        }
    }
}
