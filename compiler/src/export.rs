#![doc = include_str!("../design-json.md")]
#![expect(non_snake_case, reason = "the keys are the paper's symbols")]

use nalgebra::{DMatrix, DVector};
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::value::RawValue;

use crate::convex::{Box as Intervals, Polytope, Strips};
use crate::design::Design;
use crate::network::{ChangingConstraint, CouplingConstraint, NamedPolytope, Network, Norm};

/// The text of `design.json`: same bytes for the same design, one matrix row per line, floats in the shortest form
/// that reads back the same, a line break at the end.
pub fn design_json(design: &Design) -> String {
    let document = Document::new(design);
    // Maps have text keys and rows are made below, so writing to memory cannot fail.
    serde_json::to_string_pretty(&document).unwrap_or_else(|error| unreachable!("design.json: {error}")) + "\n"
}

#[derive(serde::Serialize)]
struct Document<'a> {
    name: &'a str,
    sample_time: f64,
    horizon: usize,
    norm: &'static str,
    epsilon: f64,
    gamma: f64,
    subsystems: Vec<Subsystem<'a>>,
    coupling_constraints: Vec<Coupling<'a>>,
    changing_constraints: Vec<Changing<'a>>,
    scalar: &'static str,
}

#[derive(serde::Serialize)]
struct Subsystem<'a> {
    name: &'a str,
    A: Rows,
    B: Rows,
    C: Rows,
    E: Rows,
    L: Keyed<'a, Rows>,
    Cz: Rows,
    Dz: Rows,
    Q: Rows,
    R: Rows,
    T: Rows,
    K: Rows,
    Kx: Rows,
    Ke: Rows,
    P: Rows,
    X: Set,
    U: Set,
    rpi: Option<Set>,
    z_set: Set,
    dz_set: Set,
    x_hat: Set,
    u_hat: Set,
    sigma: Set,
    y_set: Set,
    disturbance: Option<Set>,
    measurement_error: Row,
    M: Rows,
    load_set: Option<Set>,
    load_rate: Row,
}

#[derive(serde::Serialize)]
struct Coupling<'a> {
    H: Keyed<'a, Row>,
    Hz: Keyed<'a, Row>,
    l: f64,
    l_tilde: f64,
}

#[derive(serde::Serialize)]
struct Changing<'a> {
    name: &'a str,
    generators: Keyed<'a, Rows>,
}

/// A map whose keys stand in the order of the network, not of the alphabet.
struct Keyed<'a, T>(Vec<(&'a str, T)>);

/// One line of numbers.
type Row = Box<RawValue>;
type Rows = Vec<Row>;

/// {x : H x <= h}.
#[derive(serde::Serialize)]
struct Set {
    H: Rows,
    h: Row,
}

impl<'a> Document<'a> {
    fn new(design: &'a Design) -> Self {
        let Design { network, sizing, .. } = design;
        let couplings = network.coupling_constraints.iter().zip(&sizing.l_tilde);
        Self {
            name: &network.name,
            sample_time: network.sample_time,
            horizon: network.horizon,
            norm: norm_name(network.reference.norm),
            epsilon: sizing.epsilon,
            gamma: network.reference.gamma,
            subsystems: (0..network.subsystems.len()).map(|i| Subsystem::new(design, i)).collect(),
            coupling_constraints: couplings.map(|(row, &l_tilde)| Coupling::new(network, row, l_tilde)).collect(),
            changing_constraints: network.changing_constraints.iter().map(|row| Changing::new(design, row)).collect(),
            scalar: network.scalar.name(),
        }
    }
}

impl<'a> Subsystem<'a> {
    fn new(design: &'a Design, i: usize) -> Self {
        let model = &design.network.subsystems[i];
        let gains = &design.gains.subsystems[i];
        let sizes = &design.sizing.subsystems[i];
        let links = model.L.iter().map(|(&j, L)| (design.network.subsystems[j].name.as_str(), rows(L)));
        Self {
            name: &model.name,
            A: rows(&model.A),
            B: rows(&model.B),
            C: rows(&model.C),
            E: rows(&model.E),
            L: Keyed(links.collect()),
            Cz: rows(&model.Cz),
            Dz: rows(&model.Dz),
            Q: rows(&model.Q),
            R: rows(&model.R),
            T: rows(&model.T),
            K: rows(&gains.K),
            Kx: rows(&gains.Kx),
            Ke: rows(&gains.Ke),
            P: rows(&gains.P),
            X: Set::named(&model.X),
            U: Set::named(&model.U),
            rpi: sizes.E.q.iter().any(|width| *width > 0.0).then(|| Set::strips(&sizes.E)),
            z_set: Set::symmetric(&sizes.zeta),
            dz_set: Set::symmetric(&sizes.dz),
            x_hat: Set::polytope(&sizes.X_nom),
            u_hat: Set::polytope(&sizes.U_nom),
            sigma: Set::strips(&sizes.Sigma),
            y_set: Set::intervals(&sizes.Y),
            disturbance: model.w.as_ref().map(|w| Set::polytope(&w.set)),
            measurement_error: row(model.measurement_error.iter()),
            M: rows(&model.loads.M),
            load_set: (!model.loads.is_empty())
                .then(|| Set::intervals(&Intervals { min: model.loads.min.clone(), max: model.loads.max.clone() })),
            load_rate: row(model.loads.rate.iter()),
        }
    }
}

impl<'a> Coupling<'a> {
    fn new(network: &'a Network, constraint: &CouplingConstraint, l_tilde: f64) -> Self {
        let keyed = |parts: &std::collections::BTreeMap<usize, DVector<f64>>| {
            Keyed(parts.iter().map(|(&j, part)| (network.subsystems[j].name.as_str(), row(part.iter()))).collect())
        };
        Self { H: keyed(&constraint.H), Hz: keyed(&constraint.Hz), l: constraint.l, l_tilde }
    }
}

impl<'a> Changing<'a> {
    fn new(design: &'a Design, constraint: &'a ChangingConstraint) -> Self {
        let member = |&j: &usize| {
            let generators = &design.sizing.subsystems[j].exposed.generators;
            (design.network.subsystems[j].name.as_str(), generators.iter().map(|g| row(g.iter())).collect())
        };
        Self { name: &constraint.name, generators: Keyed(constraint.members.iter().map(member).collect()) }
    }
}

impl Set {
    fn new(H: &DMatrix<f64>, h: &DVector<f64>) -> Self {
        Self { H: rows(H), h: row(h.iter()) }
    }

    fn named(set: &NamedPolytope) -> Self {
        Self::new(&set.H, &set.h)
    }

    fn polytope(set: &Polytope) -> Self {
        Self::new(&set.H, &set.h)
    }

    /// Rows P, then rows -P.
    fn strips(set: &Strips) -> Self {
        Self::polytope(&set.to_polytope())
    }

    /// Upper limits, then lower limits.
    fn intervals(set: &Intervals) -> Self {
        let p = set.max.len();
        let H = DMatrix::from_fn(2 * p, p, |i, j| f64::from(i == j) - f64::from(i == j + p));
        Self::new(&H, &DVector::from_fn(2 * p, |i, _| if i < p { set.max[i] } else { -set.min[i - p] }))
    }

    fn symmetric(half_widths: &DVector<f64>) -> Self {
        Self::intervals(&Intervals { min: -half_widths, max: half_widths.clone() })
    }
}

impl<T: Serialize> Serialize for Keyed<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (key, value) in &self.0 {
            map.serialize_entry(key, value)?;
        }
        map.end()
    }
}

fn norm_name(norm: Norm) -> &'static str {
    match norm {
        Norm::One => "1",
        Norm::Two => "2",
        Norm::Inf => "inf",
    }
}

fn rows(matrix: &DMatrix<f64>) -> Rows {
    matrix.row_iter().map(|r| row(r.iter())).collect()
}

/// `[1.0, -2e-7]`; every number of a design is finite.
fn row<'n>(numbers: impl Iterator<Item = &'n f64>) -> Row {
    let text = numbers.map(|number| format!("{:?}", number + 0.0)).collect::<Vec<_>>().join(", ");
    RawValue::from_string(format!("[{text}]")).unwrap_or_else(|error| unreachable!("a row of numbers: {error}"))
}
