//! An i-DPC problem at one parameter, for the runtime's solver.

use dpc_runtime::solver::{Glance, Row, Rows, Side};
use nalgebra::DVector;

use super::space::{Parameters, Space};
use crate::problems::{DpcProblem, RowKind};

/// Rows of at most `NV` unknowns. They are looked at in the order of the emitted tables, so that a run makes the same changes.
pub struct Instance<const NV: usize> {
    normals: Vec<[f64; NV]>,
    scales: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    order: Vec<usize>,
}

impl<const NV: usize> Instance<NV> {
    /// With all parameters 0. `None` where there are more unknowns.
    pub fn new(dpc: &DpcProblem) -> Option<Self> {
        let (rows, unknowns) = dpc.V.shape();
        let normal = |r: usize| std::array::from_fn(|k| if k < unknowns { dpc.V[(r, k)] } else { 0.0 });
        let size = |limit: f64| if limit.is_finite() { limit.abs() } else { 0.0 };
        (unknowns <= NV).then(|| Self {
            normals: (0..rows).map(normal).collect(),
            scales: (0..rows).map(|r| size(dpc.lower[r]).max(size(dpc.upper[r]))).collect(),
            lower: dpc.lower.as_slice().to_vec(),
            upper: dpc.upper.as_slice().to_vec(),
            order: looked_at(dpc),
        })
    }

    /// Moves to the point `p` of the space.
    pub fn at(&mut self, space: &Space, p: &[f64]) {
        let value = |row: &[f64]| {
            row.iter().skip(1).zip(p).fold(row[0], |sum, (slope, p)| if *slope == 0.0 { sum } else { sum + slope * p })
        };
        for (limits, of) in [(&mut self.lower, &space.lower), (&mut self.upper, &space.upper)] {
            for (limit, row) in limits.iter_mut().zip(of.row_iter()) {
                *limit = value(row.clone_owned().as_slice());
            }
        }
    }

    /// Moves to other parameters.
    pub fn put(&mut self, dpc: &DpcProblem, at: &Parameters) {
        let mut tubes = at.tube.iter();
        for (r, row) in dpc.rows.iter().enumerate() {
            let offset = |of: &DVector<f64>| row.offset.dot(of);
            let (limits, offset) = match row.kind {
                RowKind::Tube => (tubes.next().copied(), offset(&at.e)),
                RowKind::State(k) => (None, offset(&at.x_ref[k])),
                RowKind::Input(k) => (None, offset(&at.u_ref[k])),
                RowKind::CouplingOutput(_) | RowKind::Terminal => (None, 0.0),
            };
            let (low, high) = limits.unwrap_or((dpc.lower[r], dpc.upper[r]));
            self.scales[r] = [low, high]
                .into_iter()
                .filter(|limit| limit.is_finite())
                .fold(0.0, |most, limit| most.max(limit.abs()));
            (self.lower[r], self.upper[r]) = (low - offset, high - offset);
        }
    }

    /// Whether 0 satisfies every row: nothing is to be solved.
    pub fn rests(&self) -> bool {
        self.lower.iter().zip(&self.upper).all(|(lower, upper)| *lower <= 0.0 && 0.0 <= *upper)
    }
}

/// The order in which the runtime's `Instance::look` or `look_by_rows` looks at the rows.
fn looked_at(dpc: &DpcProblem) -> Vec<usize> {
    let mut order: Vec<usize> = (0..dpc.rows.len()).collect();
    if dpc.staged {
        let stage = |r: &usize| match dpc.rows[*r].kind {
            RowKind::Tube => (0, 0),
            RowKind::State(k) => (1, 2 * k),
            RowKind::Input(k) => (1, 2 * k + 1),
            RowKind::CouplingOutput(_) => (2, 0),
            RowKind::Terminal => (3, 0),
        };
        order.sort_by_key(stage);
    }
    order
}

/// What a look overlooks, relative to the largest |w_k|: the runtime's `OVERLOOKED`, and by rows its `TOLERANCE`.
const OVERLOOKED: f64 = 1e-12;

impl<const NV: usize> Rows<NV> for Instance<NV> {
    fn iter(&self) -> impl Iterator<Item = Row<'_>> {
        (0..self.normals.len()).map_while(|r| self.get(r))
    }

    fn get(&self, r: usize) -> Option<Row<'_>> {
        Some(Row { normal: self.normals.get(r)?, lower: self.lower[r], upper: self.upper[r], scale: self.scales[r] })
    }

    fn normal(&self, r: usize) -> &[f64] {
        self.normals.get(r).map_or(&[0.0; NV], |normal| normal)
    }

    fn glance(&self, w: &[f64; NV], size: f64) -> Option<Glance> {
        let mut worst = OVERLOOKED * size;
        let mut found = Glance::NOTHING;
        for &r in &self.order {
            let value: f64 = self.normals[r].iter().zip(w).map(|(v, w)| v * w).sum();
            let (below, above) = (self.lower[r] - value, value - self.upper[r]);
            let excess = below.max(above);
            if excess > worst {
                worst = excess;
                found.push(r, if below > above { Side::Lower } else { Side::Upper });
            }
        }
        Some(found)
    }
}

/// Work that is done with room for the unknowns of a problem.
pub trait Task {
    type Output;

    fn run<const NV: usize>(self) -> Self::Output;
}

/// Runs a task with room for so many unknowns; `None` where there is not enough anywhere.
pub fn with_room<T: Task>(unknowns: usize, task: T) -> Option<T::Output> {
    Some(match unknowns {
        0..=8 => task.run::<8>(),
        9..=16 => task.run::<16>(),
        17..=32 => task.run::<32>(),
        33..=64 => task.run::<64>(),
        65..=144 => task.run::<144>(),
        _ => return None,
    })
}
