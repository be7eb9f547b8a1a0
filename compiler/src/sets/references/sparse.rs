//! By sparse rows, for large networks.
//!
//! With x_0 = d (I - calF)^-1 and x_k = x_0 calF^k, the row d of the steady state of (9) is x_0 calG, and since
//! d calF^k (I - calF)^-1 calF calG = x_{k+1} calG, the support of Delta^chi in direction d is the sum over k >= 1 of the dual
//! norm of x_k calG: entries of x_k, and no matrix of the size of the network is ever formed. The rows are sparse in effect: what
//! of x_k is so small that it hardly counts is dropped, and charged by the most that could become of it.
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::{ReferenceShare, Shares, Sums, Transients, collective_floor, different};
use crate::convex::{Care, Charge, Front, LANES, RateNorm, Space};
use crate::gains::Gains;
use crate::network::{Network, Subsystem};
use crate::optim::block_lu::BlockLu;
use crate::optim::responses::Responses;
use crate::optim::rounding::sum_upper;
use crate::optim::sparse::Sparse;
use crate::sets::CAP_MARGIN;
use crate::sharing::spread_with;

/// The reference system's steady states and Delta^chi, (9)-(13).
pub struct References {
    front: Front,
    lu: BlockLu,
    /// First state of each subsystem.
    chi: Vec<usize>,
    calG: Sparse,
    outputs: Input,
    loads: Option<Loads>,
    /// Sum over k of |e_j' calF^k| over the floor boxes.
    drift: DVector<f64>,
    /// The same over what a step rounds.
    rounded: Option<DVector<f64>>,
    y_caps: DVector<f64>,
}

/// Something that drives the references, and bounds of what it does.
struct Input {
    charge: Charge,
    /// Sum over k of |e_j' calF^k| times `charge.later`: what an error of a residual may do.
    again: DVector<f64>,
}

/// The loads of all subsystems.
struct Loads {
    /// Mcal = diag([M_i; 0]).
    Mcal: Sparse,
    min: DVector<f64>,
    max: DVector<f64>,
    /// At full rate, and any sequence inside half of the range.
    at_rate: Input,
    in_range: Input,
    /// Sum over k of |e_j' calF^k Mcal| at the ends of the range.
    ends: DVector<f64>,
}

/// x_0 with a bound of the residual d - x_0 (I - calF).
struct Solved {
    x0: DVector<f64>,
    residual: DVector<f64>,
}

impl Input {
    /// B has one block of rows per subsystem.
    fn new(front: &Front, responses: &Responses, B: Vec<DMatrix<f64>>, norm: RateNorm) -> Self {
        let rows =
            B.iter().flat_map(|B| B.row_iter().map(|row| row.iter().map(|b| b.abs()).sum()).collect::<Vec<f64>>());
        let later = responses.to(&DVector::from_vec(rows.collect()));
        let again = responses.to(&later);
        Self { charge: Charge::new(front, B, norm, later), again }
    }

    /// What an unknown part of x_0 with (I - calF) times it within `residual` adds to a sum.
    fn error(&self, residual: &DVector<f64>) -> f64 {
        residual.dot(&self.again)
    }
}

impl References {
    /// `None` where the steady states cannot be computed.
    pub fn new(
        network: &Network,
        gains: &Gains,
        responses: &Responses,
        y_caps: DVector<f64>,
        rounded: Option<DVector<f64>>,
    ) -> Option<Self> {
        let starts = gains.chi_starts();
        let lu = BlockLu::of_identity_minus(&gains.calF, &starts)?;
        let front = Front::new(gains.calF.clone(), starts);
        let integrators = |s: &Subsystem| DMatrix::from_fn(s.n() + s.p(), s.p(), |r, c| f64::from(r == s.n() + c));
        let G = network.subsystems.iter().map(integrators).collect();
        Some(Self {
            outputs: Input::new(&front, responses, G, network.reference.norm),
            loads: Loads::new(network, gains, &front, responses),
            drift: responses.to(&collective_floor(network, gains)),
            rounded: rounded.map(|rounded| responses.to(&rounded)),
            chi: gains.chi_offset.clone(),
            calG: gains.calG.clone(),
            front,
            lu,
            y_caps,
        })
    }

    pub fn shares(&self, network: &Network, gains: &Gains, sums: Sums) -> Vec<Shares> {
        let care = if sums == Sums::Proved { Care::PROVED } else { Care::ESTIMATED };
        let of = |space: &mut Space, i: usize| {
            let (s, g) = (&network.subsystems[i], &gains.subsystems[i]);
            let (rows, limits) = (super::rows(s, g), s.X.h.iter().chain(&s.U.h));
            let (different, of) = different(&rows);
            let known: Vec<Direction> =
                different.chunks(LANES).flat_map(|rows| self.directions(space, i, rows, care)).collect();
            let mut x_rows: Vec<_> =
                of.iter().zip(limits).map(|((k, sign), limit)| self.share(&known[*k], *sign, *limit)).collect();
            let u_rows = x_rows.split_off(s.X.h.len());
            (x_rows, u_rows)
        };
        spread_with(network.subsystems.len(), || self.front.space(), of)
    }

    /// The share of one row over chi_i, with every entry of its steady state.
    pub fn whole_share(&self, i: usize, row: &DVector<f64>) -> Option<ReferenceShare> {
        let known = self.directions(&mut self.front.space(), i, std::slice::from_ref(row), Care::PROVED);
        known.first().map(|known| self.share(known, 1.0, 0.0))
    }

    /// All that is to be known of a few rows over chi_i.
    fn directions(&self, space: &mut Space, i: usize, rows: &[DVector<f64>], care: Care) -> Vec<Direction> {
        let d: Vec<_> = rows.iter().map(|row| self.placed(i, row)).collect();
        let solved: Vec<_> = d.iter().map(|d| self.solved(d)).collect();
        let x0: Vec<_> = solved.iter().map(|solved| &solved.x0).collect();
        let rates = self.front.sums(space, &x0, &self.outputs.charge, 1, care);
        let loads = self.loads.as_ref().map(|loads| {
            let at_rate = self.front.sums(space, &x0, &loads.at_rate.charge, 1, care);
            let in_range = self.front.sums(space, &d.iter().collect::<Vec<_>>(), &loads.in_range.charge, 0, care);
            (loads, at_rate, in_range)
        });
        let one = |(l, (d, Solved { x0, residual })): (usize, (DVector<f64>, Solved))| Direction {
            rate: rates[l] + self.outputs.error(&residual),
            steady: self.calG.row_times(&x0),
            steady_error: residual.dot(self.outputs.charge.later()),
            drift: d.abs().dot(&self.drift),
            rounding: self.rounded.as_ref().map_or(0.0, |rounded| d.abs().dot(rounded)),
            loads: loads.as_ref().map(|(loads, at_rate, in_range)| LoadShare {
                steady: loads.Mcal.row_times(&x0),
                error: residual.dot(&loads.ends) + self.front.unit() * x0.abs().dot(&loads.ends),
                at_rate: at_rate[l] + loads.at_rate.error(&residual),
                in_range: in_range[l],
            }),
        };
        d.into_iter().zip(solved).enumerate().map(one).collect()
    }

    /// A row over chi_i as a row over the collective chi.
    fn placed(&self, i: usize, row: &DVector<f64>) -> DVector<f64> {
        let mut d = DVector::zeros(self.drift.len());
        d.rows_mut(self.chi[i], row.len()).copy_from(row);
        d
    }

    fn solved(&self, d: &DVector<f64>) -> Solved {
        let F = self.front.matrix();
        let first = self.lu.solve_row(d);
        let x0 = &first + self.lu.solve_row(&(d - &first + F.row_times(&first)));
        let size = d.abs() + x0.abs() + self.front.abs().row_times(&x0.abs());
        let residual = (d - &x0 + F.row_times(&x0)).abs() + size * self.front.unit();
        Solved { x0, residual }
    }

    fn share(&self, direction: &Direction, sign: f64, limit: f64) -> ReferenceShare {
        let (steady, rest) = self.kept(direction, FAR * limit);
        ReferenceShare {
            doubt: 0.0,
            rate: direction.rate,
            steady: steady.into_iter().map(|(k, gain)| (k, sign * gain)).collect(),
            steady_error: direction.steady_error,
            rest,
            drift: direction.drift,
            load: self.load(direction, sign),
        }
    }

    /// What loads and rounding take.
    fn load(&self, direction: &Direction, sign: f64) -> f64 {
        let loads = match (&direction.loads, &self.loads) {
            (Some(share), Some(loads)) => loads.taken(share, sign),
            _ => 0.0,
        };
        loads + direction.rounding
    }

    /// The entries of the steady row without those that together take at most `budget`, and what these take.
    fn kept(&self, direction: &Direction, budget: f64) -> (Vec<(usize, f64)>, f64) {
        let taken =
            |k: usize| (direction.steady[k].abs() + direction.steady_error) * self.y_caps[k] * (1.0 + CAP_MARGIN);
        let mut order: Vec<usize> = (0..direction.steady.len()).collect();
        order.sort_by(|&a, &b| taken(a).total_cmp(&taken(b)));
        let (mut rest, mut dropped) = (0.0, 0);
        while dropped < order.len() && rest + taken(order[dropped]) <= budget {
            rest += taken(order[dropped]);
            dropped += 1;
        }
        let mut kept = order.split_off(dropped);
        kept.sort_unstable();
        (kept.into_iter().map(|k| (k, direction.steady[k])).collect(), rest * (1.0 + 1e-9))
    }

    /// A row over x_i, in either direction.
    pub fn output(&self, i: usize, row: &DVector<f64>, sums: Sums) -> Transients {
        let care = if sums == Sums::Proved { Care::PROVED } else { Care::ESTIMATED };
        let known = self.directions(&mut self.front.space(), i, std::slice::from_ref(row), care);
        // One row was given, and one direction comes back.
        known.first().map_or(Transients::UNKNOWN, |known| Transients {
            rate: known.rate,
            load: self.load(known, 1.0).max(self.load(known, -1.0)),
            drift: known.drift,
        })
    }

    pub fn coupling(&self, network: &Network) -> Vec<BTreeMap<usize, f64>> {
        self.of_constraints(network, |c, known| c.H.keys().copied().zip(known.iter().map(|known| known.rate)).collect())
    }

    pub fn coupling_loads(&self, network: &Network) -> Vec<f64> {
        self.of_constraints(network, |_, known| sum_upper(known.iter().map(|known| self.load(known, 1.0))))
    }

    fn of_constraints<T: Send>(
        &self,
        network: &Network,
        of: impl Fn(&crate::network::CouplingConstraint, &[Direction]) -> T + Sync,
    ) -> Vec<T> {
        let constraints = &network.coupling_constraints;
        let one = |space: &mut Space, h: usize| {
            let members = constraints[h].H.iter();
            let row = |(&j, H): (&usize, &DVector<f64>)| (j, network.subsystems[j].C.tr_mul(H));
            let known = members.map(row).flat_map(|(j, row)| self.directions(space, j, &[row], Care::PROVED));
            of(&constraints[h], &known.collect::<Vec<_>>())
        };
        spread_with(constraints.len(), || self.front.space(), one)
    }
}

/// What of a limit is kept back for outputs that are so far away that they hardly move the row: the price of programs that
/// stay sparse.
const FAR: f64 = 1e-4;

/// What is known of a row, whatever its sign.
struct Direction {
    rate: f64,
    /// Over the collective y.
    steady: DVector<f64>,
    /// Bound of the sum of the errors of `steady`.
    steady_error: f64,
    drift: f64,
    rounding: f64,
    loads: Option<LoadShare>,
}

struct LoadShare {
    /// Over all loads.
    steady: DVector<f64>,
    /// What its error may take at the ends of the range.
    error: f64,
    at_rate: f64,
    in_range: f64,
}

impl Loads {
    fn new(network: &Network, gains: &Gains, front: &Front, responses: &Responses) -> Option<Self> {
        let all = |of: fn(&crate::network::Loads) -> &DVector<f64>| {
            let parts = network.subsystems.iter().flat_map(|s| of(&s.loads).iter().copied());
            DVector::from_vec(parts.collect::<Vec<f64>>())
        };
        let (min, max) = (all(|d| &d.min), all(|d| &d.max));
        if min.is_empty() {
            return None;
        }
        let blocks: Vec<DMatrix<f64>> =
            network.subsystems.iter().map(|s| s.loads.M.clone().resize_vertically(s.n() + s.p(), 0.0)).collect();
        let columns = crate::optim::responses::starts(network.subsystems.iter().map(|s| s.loads.len()));
        let places = gains.chi_offset.iter().copied().zip(columns);
        let scaled = |of: fn(&crate::network::Loads) -> DVector<f64>| {
            let parts = blocks.iter().zip(&network.subsystems);
            Input::new(
                front,
                responses,
                parts.map(|(M, s)| M * DMatrix::from_diagonal(&of(&s.loads))).collect(),
                RateNorm::Inf,
            )
        };
        let ends = scaled(|d| d.max.sup(&-&d.min)).charge.later().clone();
        Some(Self {
            Mcal: Sparse::from_blocks(gains.calF.nrows(), min.len(), places.zip(&blocks)),
            at_rate: scaled(|d| d.rate.clone()),
            in_range: scaled(|d| (&d.max - &d.min) * 0.5),
            ends,
            min,
            max,
        })
    }

    /// As in [`super::loads::Response::share`].
    fn taken(&self, share: &LoadShare, sign: f64) -> f64 {
        let row = &share.steady * sign;
        let ends = sum_upper((0..row.len()).map(|k| (row[k] * self.max[k]).max(row[k] * self.min[k])));
        let centre = sum_upper((0..row.len()).map(|k| row[k] * 0.5 * (self.max[k] + self.min[k])));
        sum_upper([ends, share.error, share.at_rate]).min(sum_upper([centre, share.error, share.in_range]))
    }
}
