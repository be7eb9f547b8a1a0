//! The runtime's tables of a design, made at run time: what an emitted file bakes in, for a number of masses that nobody knew
//! when this was compiled. Sizes are constants of a type, so problems are padded with rows that restrict nothing.
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::fmt;

use dpc_codegen::design::Design;
use dpc_codegen::problems::{DpcProblem, ReferenceProblem, Row, RowKind};
use dpc_runtime::tables::{self, Bounds, Clamp, Model, NO_ROW, Stage, StageRow};
use dpc_runtime::{Controller, Inbox, Link, Sender, StartError, SteadyState};
use example_kit::bus::{Datagram, NotReceived, decode, encode};
use nalgebra::DMatrix;

use crate::chain::{FORCE, HORIZON};
use crate::node::{Node, Started, control};

/// Unknowns: two states, one force per stage.
const NV: usize = 2 + HORIZON;
/// Room for tube rows, state rows, input rows, and all rows.
const NT: usize = 16;
const NS: usize = 32;
const NQ: usize = 16;
const NR: usize = 96;

/// Of a mass with `NB` neighbours, which sends and hears one coupling output each.
type Tables<const NB: usize> = tables::Tables<Clamp<1, 0>, 2, 1, 1, 1, NB, 0, 0, NB, HORIZON, NV, NR, NT, NS, NQ>;

/// The tables of one mass: next to a wall, or between others.
pub enum Mass {
    End { tables: Box<Tables<1>>, hears: [usize; 1] },
    Middle { tables: Box<Tables<2>>, hears: [usize; 2] },
}

/// A design that is not of a chain, or has more rows than there is room for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unfit {
    pub mass: String,
    pub why: String,
}

/// The tables of every mass of a chain of two or more.
///
/// # Errors
/// The first mass whose problem does not fit.
pub fn tables(design: &Design) -> Result<Vec<Mass>, Unfit> {
    (0..design.network.subsystems.len()).map(|i| Mass::new(design, i)).collect()
}

/// All controllers at rest at q = 0.
///
/// # Errors
/// The first controller that refuses to start there.
pub fn start(masses: &[Mass]) -> Result<Vec<Started<'_>>, StartError> {
    masses.iter().map(Mass::start).collect()
}

impl Mass {
    fn new(design: &Design, i: usize) -> Result<Self, Unfit> {
        let s = &design.network.subsystems[i];
        let unfit = |why: String| Unfit { mass: s.name.clone(), why };
        let hears: Vec<usize> = s.L.keys().copied().collect();
        match hears[..] {
            [a] => Ok(Self::End { tables: Box::new(mass(design, i, &[a]).map_err(unfit)?), hears: [a] }),
            [a, b] => Ok(Self::Middle { tables: Box::new(mass(design, i, &[a, b]).map_err(unfit)?), hears: [a, b] }),
            _ => Err(unfit(format!("{} neighbours, expected 1 or 2", hears.len()))),
        }
    }

    fn start(&self) -> Result<Started<'_>, StartError> {
        match self {
            Self::End { tables, hears } => process(tables, *hears),
            Self::Middle { tables, hears } => process(tables, *hears),
        }
    }
}

fn mass<const NB: usize>(design: &Design, i: usize, hears: &[usize; NB]) -> Result<Tables<NB>, String> {
    let (sized, problems) = (&design.sizing.subsystems[i], &design.problems.subsystems[i]);
    let ReferenceProblem::Clamp { weight, .. } = &problems.reference else {
        return Err("its reference outputs are no interval".to_owned());
    };
    Ok(Tables {
        model: model(design, i, hears),
        coupling: [],
        changing: [],
        reference: Clamp {
            weight: [weight[0]],
            epsilon: design.sizing.epsilon,
            y_min: [sized.Y.min[0]],
            y_max: [sized.Y.max[0]],
            rows: [],
        },
        problem: problem(&problems.dpc)?,
    })
}

fn model<const NB: usize>(design: &Design, i: usize, hears: &[usize; NB]) -> Model<2, 1, 1, 1, NB> {
    let (s, g) = (&design.network.subsystems[i], &design.gains.subsystems[i]);
    let mut EL = [[0.0; NB]; 2];
    for (slot, j) in hears.iter().enumerate() {
        let column = &s.E * &s.L[j];
        (0..2).for_each(|k| EL[k][slot] = column[(k, 0)]);
    }
    Model {
        A: array(&s.A),
        B: array(&s.B),
        C: array(&s.C),
        Cz: array(&s.Cz),
        Dz: array(&s.Dz),
        EL,
        K: array(&g.K),
        Kx: array(&g.Kx),
        Ke: array(&g.Ke),
        u_min: [-FORCE],
        u_max: [FORCE],
        drift: std::array::from_fn(|k| design.sizing.subsystems[i].drift[k]),
    }
}

type Problem = tables::DpcProblem<2, 1, HORIZON, NV, NR, NT, NS, NQ>;

/// Rows stand in groups of a fixed size; the last group is what has no offset.
fn problem(dpc: &DpcProblem) -> Result<Problem, String> {
    let mut problem = Problem {
        V: [[0.0; NV]; NR],
        gram: &[],
        extent: [0; NR],
        slack: &[],
        lower: [f64::NEG_INFINITY; NR],
        upper: [f64::INFINITY; NR],
        tube: [[0.0; 2]; NT],
        state: std::array::from_fn(|_| StageRow { stage: 0, row: [0.0; 2] }),
        input: std::array::from_fn(|_| StageRow { stage: 0, row: [0.0] }),
        terminal: &[],
        shift: [NO_ROW; NR],
        root: array(&dpc.root),
        stages: std::array::from_fn(|k| stage(&dpc.stages[k])),
        x: Bounds::NONE,
        u: Bounds::NONE,
        // Rows are looked for where they are: by V.
        boxed: false,
        staged: false,
        max_iterations: dpc.max_iterations,
    };
    let mut filled = [0; 4];
    let mut places = Vec::new();
    for (r, row) in dpc.rows.iter().enumerate() {
        let group = Group::of(row.kind);
        let k = filled[group as usize];
        if k >= group.room() {
            return Err(format!("its i-DPC problem has more than {} {}", group.room(), group.name()));
        }
        filled[group as usize] += 1;
        let at = group.first() + k;
        places.push(at);
        problem.extent[at] = row.extent as u16;
        problem.V[at] = std::array::from_fn(|c| dpc.V[(r, c)]);
        (problem.lower[at], problem.upper[at]) = (dpc.lower[r], dpc.upper[r]);
        problem.offset(row, k);
    }
    problem.gram = gram(dpc, &places);
    for (at, to) in places.iter().zip(dpc.shift()) {
        problem.shift[*at] = places.get(to).map_or(NO_ROW, |&to| to as u16);
    }
    Ok(problem)
}

/// The products of all rows, where the compiler stores them: kept for good, as tables refer to what never changes.
fn gram(dpc: &DpcProblem, places: &[usize]) -> &'static [[f64; NR]] {
    let Some(products) = dpc.gram() else { return &[] };
    let mut gram = vec![[0.0; NR]; NR];
    for (a, row) in places.iter().enumerate() {
        places.iter().enumerate().for_each(|(b, column)| gram[*row][*column] = products[(a, b)]);
    }
    gram.leak()
}

fn stage(stage: &dpc_codegen::problems::Stage) -> Stage<2, 1> {
    Stage {
        next: array(&stage.next),
        drive: array(&stage.drive),
        gain: array(&stage.gain),
        spread: array(&stage.spread),
    }
}

trait Offset {
    fn offset(&mut self, row: &Row, k: usize);
}

impl Offset for Problem {
    fn offset(&mut self, row: &Row, k: usize) {
        let of_x = || [row.offset[0], row.offset[1]];
        match row.kind {
            RowKind::Tube => self.tube[k] = of_x(),
            RowKind::State(stage) => self.state[k] = StageRow { stage, row: of_x() },
            RowKind::Input(stage) => self.input[k] = StageRow { stage, row: [row.offset[0]] },
            RowKind::CouplingOutput(_) | RowKind::Terminal => {}
        }
    }
}

#[derive(Clone, Copy)]
enum Group {
    Tube,
    State,
    Input,
    Rest,
}

impl Group {
    fn of(kind: RowKind) -> Self {
        match kind {
            RowKind::Tube => Self::Tube,
            RowKind::State(_) => Self::State,
            RowKind::Input(_) => Self::Input,
            RowKind::CouplingOutput(_) | RowKind::Terminal => Self::Rest,
        }
    }

    fn first(self) -> usize {
        [0, NT, NT + NS, NT + NS + NQ][self as usize]
    }

    fn room(self) -> usize {
        [NT, NS, NQ, NR - NT - NS - NQ][self as usize]
    }

    fn name(self) -> &'static str {
        ["tube rows", "state rows", "input rows", "rows without offset"][self as usize]
    }
}

fn array<const R: usize, const C: usize>(matrix: &DMatrix<f64>) -> [[f64; C]; R] {
    std::array::from_fn(|r| std::array::from_fn(|c| matrix[(r, c)]))
}

type Control<'a, const NB: usize> = Controller<'a, Clamp<1, 0>, 2, 1, 1, 1, NB, 0, 0, NB, HORIZON, NV, NR, NT, NS, NQ>;

struct Process<'a, const NB: usize> {
    controller: Control<'a, NB>,
    inbox: Inbox<NB, 0, NB>,
    hears: [usize; NB],
}

fn process<const NB: usize>(tables: &Tables<NB>, hears: [usize; NB]) -> Result<Started<'_>, StartError> {
    let (controller, message) = Controller::start(tables, &SteadyState { x: [0.0; 2], u: [0.0] })?;
    Ok((Box::new(Process { controller, inbox: Inbox::new(), hears }), encode(&message)))
}

impl<const NB: usize> Node for Process<'_, NB> {
    fn receive(&mut self, datagram: &Datagram) -> Result<(), NotReceived> {
        let message = decode(&datagram.bytes).map_err(NotReceived::WrongLength)?;
        match self.hears.iter().position(|&j| j == datagram.from) {
            Some(slot) => {
                let sender = Sender { design: 0, place: datagram.from as u32 };
                let link = Link::<1, 1> { slot, z: Some(slot), y: None, sender };
                self.inbox.accept(&link, &message).map_err(NotReceived::Refused)
            }
            // Nobody else is a neighbour, and neighbours alone are sent to.
            None => Ok(()),
        }
    }

    control!();
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the design of {} does not fit: {}", self.mass, self.why)
    }
}

impl std::error::Error for Unfit {}
