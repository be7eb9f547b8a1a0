//! Where the range of each input and of each bounded state goes: (25b), row by row.
//!
//! A row H x <= h of X_i or U_i gives its limit away in parts that sum to it:
//!
//! | part | of a row d over x (d K_i for inputs) | |
//! |---|---|---|
//! | set-points | largest d over the steady states of all yref in Y | (9), (25b) |
//! | moving references | support of Delta_i^chi | (12), (13) |
//! | measured loads | what references that follow the loads take, with rounding | (25b') |
//! | terminal set | support of Sigma_i | (24), (25b) |
//! | own disturbances | share of the tube that w, measurement errors, late loads and rounding make | (18'), (35c), (35d) |
//! | neighbours | the rest of the tube E_i: what neighbours may be off their references | (18), (35c), (35d) |
//! | left over | what no set needs | |
//!
//! The offsets of E_i are linear in what acts on it, q = (I - |Lambda|)^-1 (h_own + h_neighbours); the tube of a row is split as
//! these are.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::{DMatrix, DVector};

use crate::convex::{multiplier, multipliers};
use crate::design::Design;
use crate::network::{NamedPolytope, Signal};
use crate::sets::{ReferenceShare, floor_support, import_gain};

/// What takes a part of a limit; in the order they are stacked from 0 outwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    SetPoints,
    Moving,
    Loads,
    Terminal,
    Disturbances,
    Neighbours,
    Left,
}

impl Part {
    pub const ALL: [Self; 7] =
        [Self::SetPoints, Self::Moving, Self::Loads, Self::Terminal, Self::Disturbances, Self::Neighbours, Self::Left];
}

/// One bound and its parts, in the unit of the signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// Distance of the bound from 0; positive.
    pub limit: f64,
    /// In the order of [`Part::ALL`]; they sum to `limit`, and only that of the set-points may be negative: where 0 is no
    /// steady state between the ends.
    pub parts: [f64; 7],
}

/// The bounds of one signal, or one bound over several.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// The signal; of a bound over several the row in the user's words.
    pub name: String,
    pub unit: Option<String>,
    /// Below 0; `None` where nothing bounds it there.
    pub low: Option<Side>,
    pub high: Option<Side>,
}

/// Budgets of the inputs of subsystem i, in their order, with bounds over several at the end.
pub fn inputs(design: &Design, i: usize) -> Vec<Budget> {
    let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
    let tube = Tube::new(design, i);
    let K = &design.gains.subsystems[i].K;
    let side = |r: usize| {
        let share = &design.sets.subsystems[i].u_rows[r];
        let row = (s.U.H.row(r) * K).transpose();
        tube.side(&row, s.U.h[r], s.U.h[r] - sized.U_nom.h[r], share)
    };
    gathered(&s.inputs, &s.U, side)
}

/// Budgets of the bounded states of subsystem i, likewise.
pub fn states(design: &Design, i: usize) -> Vec<Budget> {
    let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
    let tube = Tube::new(design, i);
    let side = |r: usize| {
        let share = &design.sets.subsystems[i].x_rows[r];
        tube.side(&s.X.H.row(r).transpose(), s.X.h[r], s.X.h[r] - sized.X_nom.h[r], share)
    };
    gathered(&s.states, &s.X, side)
}

/// One budget per signal that a row bounds alone, by its tightest rows, and one per other row.
fn gathered(signals: &[Signal], set: &NamedPolytope, side: impl Fn(usize) -> Side) -> Vec<Budget> {
    let of = |signal: &Signal| Budget { name: signal.name.clone(), unit: signal.unit.clone(), low: None, high: None };
    let mut alone: Vec<Budget> = signals.iter().map(of).collect();
    let mut others = Vec::new();
    for r in 0..set.h.len() {
        let read: Vec<usize> = (0..signals.len()).filter(|&k| set.H[(r, k)] != 0.0).collect();
        match read[..] {
            [k] => {
                let coefficient = set.H[(r, k)];
                let place = if coefficient > 0.0 { &mut alone[k].high } else { &mut alone[k].low };
                let side = side(r).scaled(1.0 / coefficient.abs());
                if place.as_ref().is_none_or(|known| side.limit < known.limit) {
                    *place = Some(side);
                }
            }
            _ => others.push(Budget { name: set.rows[r].clone(), unit: None, low: None, high: Some(side(r)) }),
        }
    }
    alone.retain(|budget| budget.low.is_some() || budget.high.is_some());
    alone.extend(others);
    alone
}

impl Side {
    fn scaled(self, factor: f64) -> Self {
        Self { limit: self.limit * factor, parts: self.parts.map(|part| part * factor) }
    }
}

/// What the tube of one subsystem is made of.
struct Tube<'a> {
    design: &'a Design,
    i: usize,
    /// Offsets that its own disturbances and its neighbours make.
    offsets: Option<(DVector<f64>, DVector<f64>)>,
}

impl<'a> Tube<'a> {
    fn new(design: &'a Design, i: usize) -> Self {
        let (own, neighbours) = acting(design, i, &design.sizing.subsystems[i].E.P);
        let E = &design.sizing.subsystems[i].E;
        let Lambda = multipliers(&E.P, &E.q, &(&E.P * &design.gains.subsystems[i].F));
        let offsets = Lambda.and_then(|Lambda| {
            let size = E.q.len();
            let step = DMatrix::from_fn(size, size, |r, k| f64::from(r == k) - Lambda[r].mu[k].abs());
            let lu = step.lu();
            lu.solve(&own).zip(lu.solve(&neighbours))
        });
        Self { design, i, offsets }
    }

    /// `row` over x, the limit, what the tube takes of it, and the references' share.
    fn side(&self, row: &DVector<f64>, limit: f64, tube: f64, share: &ReferenceShare) -> Side {
        let Design { sizing, .. } = self.design;
        let Sigma = &sizing.subsystems[self.i].Sigma;
        let steady: f64 = share.steady.iter().map(|&(y, gain)| gain * self.end(y, gain)).sum();
        let terminal = multiplier(&Sigma.P, &Sigma.q, row).map_or(0.0, |proof| proof.on(&Sigma.q));
        let own = tube * self.own_share(row);
        let moving = sizing.epsilon * share.rate;
        let loads = share.load + share.rest;
        let taken = [steady, moving, loads, terminal, own, tube - own];
        let [steady, moving, loads, terminal, own, neighbours] = taken;
        let left = limit - taken.iter().sum::<f64>();
        Side { limit, parts: [steady, moving, loads, terminal, own, neighbours, left] }
    }

    /// The end of Y at entry y of the collective outputs in the direction of `gain`.
    fn end(&self, y: usize, gain: f64) -> f64 {
        let starts = &self.design.gains.y_offset;
        let owner = starts.partition_point(|start| *start <= y) - 1;
        let Y = &self.design.sizing.subsystems[owner].Y;
        let k = y - starts[owner];
        if gain > 0.0 { Y.max[k] } else { Y.min[k] }
    }

    /// How much of the tube in this row its own disturbances make, 0 to 1.
    fn own_share(&self, row: &DVector<f64>) -> f64 {
        let E = &self.design.sizing.subsystems[self.i].E;
        let by_offsets = self.offsets.as_ref().and_then(|(own, neighbours)| {
            let proof = multiplier(&E.P, &E.q, row)?;
            Some((proof.on(own), proof.on(neighbours)))
        });
        let (own, neighbours) = by_offsets.unwrap_or_else(|| {
            let row = DMatrix::from_row_slice(1, row.len(), row.as_slice());
            let (own, neighbours) = acting(self.design, self.i, &row);
            (own[0], neighbours[0])
        });
        if own + neighbours > 0.0 { (own / (own + neighbours)).clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// Support of the parts of W_i in the rows of P: what acts on the subsystem itself, and what neighbours send.
fn acting(design: &Design, i: usize, P: &DMatrix<f64>) -> (DVector<f64>, DVector<f64>) {
    let (s, sets) = (&design.network.subsystems[i], &design.sets.subsystems[i]);
    let own = floor_support(P, &sets.floor) * 2.0 + sets.exogenous.support(P);
    let sent = |sum: DVector<f64>, &j: &usize| sum + import_gain(P, s, j) * &design.sizing.subsystems[j].zeta;
    (own, s.L.keys().fold(DVector::zeros(P.nrows()), sent))
}
