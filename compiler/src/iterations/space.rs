//! The parameters that an i-DPC problem can meet, and its rows as functions of them.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::convex::Polytope;
use crate::network::{Network, Subsystem};
use crate::problems::{DpcProblem, RowKind};
use crate::sizing::SubsystemSizing;

/// One number that the limits of the rows depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Entry of e = x_t - xref_t.
    Deviation(usize),
    /// Entry of xref_{t+k}: k, entry.
    State(usize, usize),
    /// Entry of uref_{t+k}: k, entry.
    Input(usize, usize),
    /// Limits of a tube row where states are measured with an error (35a').
    TubeLower(usize),
    TubeUpper(usize),
}

/// e, the references over the horizon, and the limits of the tube rows: all that the runtime makes a problem of.
#[derive(Debug, Clone)]
pub struct Parameters {
    /// x_t - xref_t.
    pub e: DVector<f64>,
    /// xref_t, ..., xref_{t+N-1}.
    pub x_ref: Vec<DVector<f64>>,
    pub u_ref: Vec<DVector<f64>>,
    /// Limits of the tube rows on `offset . (e - dx_0)`.
    pub tube: Vec<(f64, f64)>,
}

/// The admissible parameters of one problem as the box |p_k| <= 1 without what its `facets` cut off.
#[derive(Debug, Clone)]
pub struct Space {
    n: usize,
    m: usize,
    N: usize,
    /// What p_k is, and its value: middle + half p_k.
    entries: Vec<(Quantity, f64, f64)>,
    /// Limits of the rows of V as functions of (1, p).
    pub lower: DMatrix<f64>,
    pub upper: DMatrix<f64>,
    /// c . (1, p) >= 0.
    pub facets: Vec<DVector<f64>>,
}

/// Where nothing bounds a parameter it may be so many times the limits of the rows it is in.
const FAR: f64 = 100.0;

/// Linear programs end a little inside.
const ROUNDED: f64 = 1.0 + 1e-6;

type Ranges = BTreeMap<Quantity, (f64, f64)>;

impl Space {
    /// What the runtime can meet while the guarantee holds. xref_{t+k} and uref_{t+k} are anything that (25b) leaves them, or
    /// where the network is started by plans, anything in Xhat_i and Uhat_i; e is anything for which there can be a solution.
    ///
    /// Of a linear program's value this is larger by a millionth, and may hold more than that: hulls of sets, reference
    /// trajectories that no (7a) leads through, e without solution.
    pub fn new(dpc: &DpcProblem, s: &Subsystem, sized: &SubsystemSizing, network: &Network) -> Self {
        let (x_limit, u_limit) = match network.start_anywhere {
            true => (&sized.X_nom.h, &sized.U_nom.h),
            false => (&sized.x_ref, &sized.u_ref),
        };
        let (X, U) = (set(&s.X.H, x_limit), set(&s.U.H, u_limit));
        let mut ranges = Ranges::new();
        for (r, row) in dpc.rows.iter().enumerate() {
            let (set, quantity): (_, fn(usize, usize) -> Quantity) = match row.kind {
                RowKind::State(_) => (&X, Quantity::State),
                RowKind::Input(_) => (&U, Quantity::Input),
                RowKind::Tube => {
                    ranges.extend(doubtful(dpc, r));
                    continue;
                }
                _ => continue,
            };
            let (RowKind::State(k) | RowKind::Input(k)) = row.kind else { continue };
            for (j, entry) in row.offset.iter().enumerate().filter(|(_, entry)| **entry != 0.0) {
                let far = FAR * limit(dpc, r) / entry.abs();
                ranges.entry(quantity(k, j)).or_insert_with(|| range(set, j, far));
            }
        }
        let mut space = Self {
            n: s.n(),
            m: s.m(),
            N: network.horizon,
            entries: entries(&ranges),
            lower: DMatrix::zeros(0, 0),
            upper: DMatrix::zeros(0, 0),
            facets: Vec::new(),
        };
        space.limit(dpc);
        let reach = space.reach(dpc);
        let tube = tube(dpc, &reach);
        for k in 0..s.n() {
            let far = reach.iter().fold(1.0, |far: f64, (_, low, high)| far.max(-low).max(*high));
            ranges.insert(Quantity::Deviation(k), range(&tube, k, far));
        }
        space.entries = entries(&ranges);
        space.limit(dpc);
        space.bound(&tube, &Quantity::Deviation);
        for k in 0..network.horizon {
            space.bound(&X, &|j| Quantity::State(k, j));
            space.bound(&U, &|j| Quantity::Input(k, j));
        }
        space
    }

    /// How many parameters there are.
    pub fn dimension(&self) -> usize {
        self.entries.len()
    }

    /// What `p` stands for. References that no row depends on are 0.
    pub fn parameters(&self, p: &[f64], dpc: &DpcProblem) -> Parameters {
        let values: BTreeMap<_, _> =
            self.entries.iter().zip(p).map(|((q, middle, half), p)| (*q, middle + half * p)).collect();
        let value = |q: Quantity| values.get(&q).copied();
        let tubes = (0..dpc.noise.len()).map(|r| {
            let low = value(Quantity::TubeLower(r)).unwrap_or(dpc.lower[r]);
            (low, value(Quantity::TubeUpper(r)).unwrap_or(dpc.upper[r]))
        });
        let vector =
            |count: usize, of: &dyn Fn(usize) -> Quantity| DVector::from_fn(count, |j, _| value(of(j)).unwrap_or(0.0));
        Parameters {
            e: vector(self.n, &Quantity::Deviation),
            x_ref: (0..self.N).map(|k| vector(self.n, &|j| Quantity::State(k, j))).collect(),
            u_ref: (0..self.N).map(|k| vector(self.m, &|j| Quantity::Input(k, j))).collect(),
            tube: tubes.collect(),
        }
    }

    /// Sets the limits of the rows as functions of the entries.
    fn limit(&mut self, dpc: &DpcProblem) {
        let columns = 1 + self.entries.len();
        let places: BTreeMap<_, _> = self.entries.iter().enumerate().map(|(at, (q, ..))| (*q, at)).collect();
        (self.lower, self.upper) = (DMatrix::zeros(dpc.rows.len(), columns), DMatrix::zeros(dpc.rows.len(), columns));
        for (r, row) in dpc.rows.iter().enumerate() {
            let (lower, upper) = (&mut self.lower, &mut self.upper);
            (lower[(r, 0)], upper[(r, 0)]) = (dpc.lower[r], dpc.upper[r]);
            for (limits, quantity) in [(&mut *lower, Quantity::TubeLower(r)), (&mut *upper, Quantity::TubeUpper(r))] {
                if let Some(&at) = places.get(&quantity) {
                    (limits[(r, 0)], limits[(r, 1 + at)]) = (self.entries[at].1, self.entries[at].2);
                }
            }
            for (j, entry) in row.offset.iter().enumerate() {
                let Some(&at) = of(row.kind, j).and_then(|quantity| places.get(&quantity)) else { continue };
                let (_, middle, half) = self.entries[at];
                for limits in [&mut *lower, &mut *upper].into_iter().filter(|limits| limits[(r, 0)].is_finite()) {
                    limits[(r, 0)] -= entry * middle;
                    limits[(r, 1 + at)] -= entry * half;
                }
            }
        }
    }

    /// Per tube row, its offset row and the least and largest value of its product with e for which the row leaves a dx_0.
    fn reach<'a>(&self, dpc: &'a DpcProblem) -> Vec<(&'a DVector<f64>, f64, f64)> {
        let plans = self.plans(dpc);
        let tube = dpc.rows.iter().enumerate().filter(|(_, row)| row.kind == RowKind::Tube);
        tube.map(|(r, row)| {
            let widest =
                |limits: &DMatrix<f64>, sign: f64| sign * limits[(r, 0)] + limits.row(r).columns_range(1..).abs().sum();
            let mut direction = DVector::zeros(plans.H.ncols());
            direction.rows_mut(0, dpc.V.ncols()).copy_from(&dpc.V.row(r).transpose());
            let most = |direction: &DVector<f64>| match plans.support(direction) {
                Some((value, _)) => value + (ROUNDED - 1.0) * value.abs(),
                None => FAR * limit(dpc, r).max(limits_size(dpc)),
            };
            // The row is -offset . dx_0 in w.
            let (low, high) =
                (-widest(&self.lower, -1.0) - most(&direction), widest(&self.upper, 1.0) + most(&-&direction));
            (&row.offset, low, high)
        })
        .collect()
    }

    /// (w, references) that satisfy all rows but those of the tube.
    fn plans(&self, dpc: &DpcProblem) -> Polytope {
        let (unknowns, parameters) = (dpc.V.ncols(), self.entries.len());
        let mut rows: Vec<(DVector<f64>, f64)> = Vec::new();
        for (r, _) in dpc.rows.iter().enumerate().filter(|(_, row)| row.kind != RowKind::Tube) {
            for (limits, sign) in [(&self.lower, -1.0), (&self.upper, 1.0)] {
                if limits[(r, 0)].is_finite() {
                    let mut whole = DVector::zeros(unknowns + parameters);
                    whole.rows_mut(0, unknowns).copy_from(&(dpc.V.row(r).transpose() * sign));
                    whole
                        .rows_mut(unknowns, parameters)
                        .copy_from(&(limits.row(r).columns_range(1..).transpose() * -sign));
                    rows.push((whole, sign * limits[(r, 0)]));
                }
            }
        }
        for k in 0..parameters {
            let axis =
                |sign: f64| DVector::from_fn(unknowns + parameters, |j, _| if j == unknowns + k { sign } else { 0.0 });
            rows.extend([(axis(1.0), 1.0), (axis(-1.0), 1.0)]);
        }
        polytope(&rows, unknowns + parameters)
    }

    /// Makes the box as small as the facets allow.
    pub fn tighten(&mut self, dpc: &DpcProblem) {
        let d = self.entries.len();
        let axis = |k: usize, sign: f64| DVector::from_fn(d, |j, _| if j == k { sign } else { 0.0 });
        let mut rows: Vec<_> = (0..d).flat_map(|k| [(axis(k, 1.0), 1.0), (axis(k, -1.0), 1.0)]).collect();
        rows.extend(self.facets.iter().map(|facet| (-facet.rows_range(1..).into_owned(), facet[0])));
        let whole = polytope(&rows, d);
        let ranges: Vec<(f64, f64)> =
            (0..d).map(|k| range(&whole, k, 1.0)).map(|(low, high)| (low.max(-1.0), high.min(1.0))).collect();
        for ((_, middle, half), (low, high)) in self.entries.iter_mut().zip(&ranges) {
            *middle += *half * 0.5 * (low + high);
            *half *= 0.5 * (high - low);
        }
        for facet in &mut self.facets {
            for (k, (low, high)) in ranges.iter().enumerate() {
                facet[0] += facet[1 + k] * 0.5 * (low + high);
                facet[1 + k] *= 0.5 * (high - low);
            }
        }
        self.limit(dpc);
    }

    /// Adds the rows of a set that are not those of the box, where all their entries are parameters.
    fn bound(&mut self, set: &Polytope, quantity: &dyn Fn(usize) -> Quantity) {
        let place = |q: Quantity| self.entries.iter().position(|(other, ..)| *other == q);
        let facet = |r: usize| {
            let entries: Vec<_> = (0..set.H.ncols()).filter(|&j| set.H[(r, j)] != 0.0).collect();
            let mut facet = DVector::zeros(1 + self.entries.len());
            facet[0] = set.h[r];
            for &j in &entries {
                let at = place(quantity(j))?;
                let (_, middle, half) = self.entries[at];
                facet[0] -= set.H[(r, j)] * middle;
                facet[1 + at] = -set.H[(r, j)] * half;
            }
            (entries.len() > 1).then_some(facet)
        };
        let facets: Vec<_> = (0..set.h.len()).filter_map(facet).collect();
        self.facets.extend(facets);
    }
}

fn of(kind: RowKind, entry: usize) -> Option<Quantity> {
    match kind {
        RowKind::Tube => Some(Quantity::Deviation(entry)),
        RowKind::State(k) => Some(Quantity::State(k, entry)),
        RowKind::Input(k) => Some(Quantity::Input(k, entry)),
        RowKind::CouplingOutput(_) | RowKind::Terminal => None,
    }
}

/// What (35a') may make of the limits of tube row `r`: see `dpc_runtime`'s `DpcProblem::doubt`.
fn doubtful(dpc: &DpcProblem, r: usize) -> Vec<(Quantity, (f64, f64))> {
    let (q, noise) = (dpc.upper[r], dpc.noise[r]);
    if noise <= 0.0 {
        return Vec::new();
    }
    let (room, most) = ((q - noise).max(0.0), (q + noise) * ROUNDED);
    vec![(Quantity::TubeLower(r), (-most, -room)), (Quantity::TubeUpper(r), (room, most))]
}

/// The largest finite limit of row `r`.
fn limit(dpc: &DpcProblem, r: usize) -> f64 {
    [dpc.lower[r], dpc.upper[r]]
        .into_iter()
        .filter(|limit| limit.is_finite())
        .fold(0.0, |most, limit| most.max(limit.abs()))
}

fn limits_size(dpc: &DpcProblem) -> f64 {
    (0..dpc.rows.len()).fold(0.0, |most: f64, r| most.max(limit(dpc, r)))
}

/// The interval of coordinate `j` over a set, cut at `far`.
fn range(set: &Polytope, j: usize, far: f64) -> (f64, f64) {
    let most = |sign: f64| {
        let axis = DVector::from_fn(set.H.ncols(), |k, _| if k == j { sign } else { 0.0 });
        set.support(&axis).map_or(far, |(value, _)| value + (ROUNDED - 1.0) * value.abs())
    };
    (-most(-1.0), most(1.0))
}

fn entries(ranges: &Ranges) -> Vec<(Quantity, f64, f64)> {
    let entry = |(quantity, (low, high)): (&Quantity, &(f64, f64))| {
        (*quantity, 0.5 * (low + high), 0.5 * (high - low).max(0.0))
    };
    ranges.iter().map(entry).collect()
}

fn set(H: &DMatrix<f64>, h: &DVector<f64>) -> Polytope {
    Polytope { H: H.clone(), h: h.clone() }
}

fn tube(_: &DpcProblem, reach: &[(&DVector<f64>, f64, f64)]) -> Polytope {
    let rows: Vec<_> = reach.iter().flat_map(|(row, low, high)| [((*row).clone(), *high), (-*row, -low)]).collect();
    polytope(&rows, reach.first().map_or(0, |(row, ..)| row.len()))
}

/// Facets with unit normals.
fn polytope(rows: &[(DVector<f64>, f64)], dimension: usize) -> Polytope {
    let H = DMatrix::from_fn(rows.len(), dimension, |r, j| rows[r].0[j] / rows[r].0.norm());
    let h = DVector::from_fn(rows.len(), |r, _| rows[r].1 / rows[r].0.norm());
    Polytope { H, h }
}
