//! The small gain alone: a local function of every K_i, so thousands of gains are compared in milliseconds.
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::blocks::{Block, Group, groups};
use super::candidate::Candidate;
use crate::gains::Layer;
use crate::network::{Network, Subsystem};
use crate::optim::climb::climb;
use crate::optim::lyapunov::spectral_radius;
use crate::sets::{assembled, small_gain_rows_with, small_gain_with, z_starts};

/// Lowers the small-gain radius by the K_i until it is below `wanted`, or no sweep lowers it; returns also the radius
/// before and after. `None` where some F_ii is not stable.
///
/// By Collatz and Wielandt the radius is the least number r with S v <= r v for some v > 0. One sweep takes v from the
/// present S and minimises, for each group of subsystems by itself, the largest (S v)_k / v_k of its rows.
pub fn lower(network: &Network, start: &Candidate, wanted: f64) -> Option<(Candidate, (f64, f64))> {
    let mut best = start.clone();
    let mut rows = all_rows(network, &best)?;
    let mut radius = spectral_radius(&assembled(network, &rows));
    let before = radius;
    let groups = groups(network, start, Layer::Local);
    for _ in 0..SWEEPS {
        if radius < wanted {
            break;
        }
        let v = perron(network, &assembled(network, &rows));
        let next = groups.iter().fold(best.clone(), |candidate, group| lowered(network, candidate, group, &v));
        rows = all_rows(network, &next)?;
        let reached = spectral_radius(&assembled(network, &rows));
        if reached.is_nan() || reached > radius * (1.0 - 1e-3) {
            break;
        }
        (best, radius) = (next, reached);
    }
    Some((best, (before, radius)))
}

/// The small-gain radius; `None` where some F_ii is not stable.
pub fn radius(network: &Network, candidate: &Candidate) -> Option<f64> {
    Some(spectral_radius(&assembled(network, &all_rows(network, candidate)?)))
}

const SWEEPS: usize = 20;
/// Evaluations of one row block per variable, and its first step.
const PER_VARIABLE: usize = 40;
const STEP: f64 = 0.3;

type Rows = BTreeMap<usize, DMatrix<f64>>;

fn all_rows(network: &Network, candidate: &Candidate) -> Option<Vec<Rows>> {
    small_gain_with(network, candidate.0.iter().map(|(K, _)| K))
}

fn lowered(network: &Network, candidate: Candidate, group: &Group, v: &[DVector<f64>]) -> Candidate {
    let block = Block { groups: vec![group.clone()], layer: Layer::Local };
    let variables = block.len(&candidate);
    let value = |x: &[f64]| {
        let moved = block.moved(&candidate, STEP, x);
        let K = moved.get(group[0], Layer::Local);
        let values = group.iter().map(|&i| ratio(&network.subsystems[i], K, &v[i], v));
        -values.fold(0.0, f64::max)
    };
    let (x, _) = climb(&vec![0.0; variables], PER_VARIABLE * variables, 1e-3, value);
    block.moved(&candidate, STEP, &x)
}

/// Largest (S v)_k / v_k over the rows of one subsystem; unstable gains come after all others.
fn ratio(s: &Subsystem, K: &DMatrix<f64>, own: &DVector<f64>, v: &[DVector<f64>]) -> f64 {
    match small_gain_rows_with(s, K) {
        Some(rows) => {
            let sums = rows.iter().fold(DVector::zeros(own.len()), |sum, (&j, block)| sum + block * &v[j]);
            sums.iter().zip(own).map(|(sum, own)| sum / own).fold(0.0, f64::max)
        }
        None => 1e9 * spectral_radius(&(&s.A + &s.B * K)),
    }
}

/// Perron vector of S and a little coupling between all, which makes it positive; by subsystem.
fn perron(network: &Network, S: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let little = 1e-4 * S.amax().max(f64::MIN_POSITIVE);
    let mut v = DVector::from_element(S.nrows(), 1.0);
    for _ in 0..POWERS {
        // Half a step of the identity makes the iteration converge on periodic loops too.
        let next = (S * &v).add_scalar(little * v.sum()) + &v * S.amax();
        v = &next / next.amax();
    }
    let z = z_starts(network);
    z.windows(2).map(|ends| v.rows(ends[0], ends[1] - ends[0]).into_owned()).collect()
}

const POWERS: usize = 500;
