//! The runtime's tables of a design, made at run time: what an emitted file bakes in, for a number of robots that nobody knew
//! when this was compiled. All robots are alike, and sizes are constants of a type, so problems are padded
//! with rows that restrict nothing.

use std::fmt;

use dpc_codegen::design::Design;
use dpc_codegen::network::Subsystem;
use dpc_codegen::problems::{DpcProblem, ReferenceProblem, RowKind};
use dpc_runtime::tables::{self, Bounds, ChangingRow, Import, Member, Model, NO_ROW, Stage, StageRow};
use dpc_runtime::{Controller, Inbox, Link, Sender, StartError, SteadyState};
use example_kit::bus::{Datagram, NotReceived, decode, encode};
use nalgebra::{DMatrix, DVector};

use crate::arena::Point;
use crate::controllers::robot_1::{N, NV, Reference};
use crate::robot::{Robot, Started, step};

/// The largest number of robots. More would need more types.
pub const MOST: usize = 12;

/// Room for tube rows, state rows, input rows, and all rows of the i-DPC problem.
const NT: usize = 8;
const NS: usize = 16;
const NQ: usize = 12;
const NR: usize = 64;

/// Of a robot that hears `NB` others, whose `NJ` outputs it imports.
type Tables<const NJ: usize, const NB: usize> =
    tables::Tables<Reference, 4, 2, 2, 2, 0, NJ, 0, NB, N, NV, NR, NT, NS, NQ, NB>;
type Control<'a, const NJ: usize, const NB: usize> =
    Controller<'a, Reference, 4, 2, 2, 2, 0, NJ, 0, NB, N, NV, NR, NT, NS, NQ, NB>;

/// What does not fit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unfit {
    /// Fewer than two robots, or more than there are types for.
    Count(usize),
    /// The design has more rows than there is room for, or reference outputs of another form than the emitted robots'.
    Sizes { robot: usize, what: &'static str },
    /// A controller does not start where it is told to.
    Start { robot: usize, why: StartError },
}

/// Controllers of all robots of a design, with their references at rest at `positions`, counted from the centre.
///
/// # Errors
/// The number of robots, the sizes of the design, or the first controller that refuses to start.
pub fn start(design: &Design, positions: &[Point]) -> Result<Vec<Started<'static>>, Unfit> {
    macro_rules! by_number {
        ($($others:literal: $imports:literal),*) => {
            match positions.len() {
                $(n if n == $others + 1 => all::<$imports, $others>(design, positions),)*
                n => Err(Unfit::Count(n)),
            }
        };
    }
    by_number!(1: 2, 2: 4, 3: 6, 4: 8, 5: 10, 6: 12, 7: 14, 8: 16, 9: 18, 10: 20, 11: 22)
}

fn all<const NJ: usize, const NB: usize>(design: &Design, positions: &[Point]) -> Result<Vec<Started<'static>>, Unfit> {
    let one = |(robot, position): (usize, &Point)| {
        let tables = tables::<NJ, NB>(design, robot).map_err(|what| Unfit::Sizes { robot, what })?;
        // Tables of emitted files live as long as the program, and so do these.
        process(Box::leak(Box::new(tables)), robot, position).map_err(|why| Unfit::Start { robot, why })
    };
    positions.iter().enumerate().map(one).collect()
}

fn tables<const NJ: usize, const NB: usize>(design: &Design, i: usize) -> Result<Tables<NJ, NB>, &'static str> {
    let problems = &design.problems.subsystems[i];
    Ok(Tables {
        model: model(design, i),
        coupling: [],
        changing: std::array::from_fn(|slot| ChangingRow { members: members(design, i, slot) }),
        reference: reference(design, &problems.reference)?,
        problem: problem(&problems.dpc)?,
    })
}

/// This robot and the one in `slot`, in the order of the network.
fn members(design: &Design, i: usize, slot: usize) -> &'static [Member] {
    let other = slot + usize::from(slot >= i);
    let member = |j: usize| {
        let generators = design.sizing.subsystems[j].exposed.generators.iter();
        let generators: Vec<&'static [f64]> = generators.map(|g| &*g.as_slice().to_vec().leak()).collect();
        let import = (j != i).then_some(Import { slot, first: 2 * slot, outputs: 2 });
        Member { import, generators: generators.leak() }
    };
    vec![member(i.min(other)), member(i.max(other))].leak()
}

fn model(design: &Design, i: usize) -> Model<4, 2, 2, 2, 0> {
    let (s, g) = (&design.network.subsystems[i], &design.gains.subsystems[i]);
    Model {
        A: array(&s.A),
        B: array(&s.B),
        C: array(&s.C),
        Cz: array(&s.Cz),
        Dz: array(&s.Dz),
        EL: [[]; 4],
        K: array(&g.K),
        Kx: array(&g.Kx),
        Ke: array(&g.Ke),
        u_min: bound(s, -1.0),
        u_max: bound(s, 1.0),
        drift: vector(&design.sizing.subsystems[i].drift),
    }
}

/// The componentwise hull of U_i on one side.
fn bound(s: &Subsystem, side: f64) -> [f64; 2] {
    let of_input = |k: usize| {
        let rows = (0..s.U.h.len()).filter(move |&r| side * s.U.H[(r, k)] > 0.0);
        rows.map(|r| s.U.h[r] / s.U.H[(r, k)])
            .fold(side * f64::INFINITY, |a, b| if side > 0.0 { a.min(b) } else { a.max(b) })
    };
    std::array::from_fn(of_input)
}

fn reference(design: &Design, problem: &ReferenceProblem) -> Result<Reference, &'static str> {
    let ReferenceProblem::Nearest { basis, weights, set, set_limit, rate, euclidean, coupling } = problem else {
        return Err("reference outputs");
    };
    let layer = Reference {
        basis: array(basis),
        weights: vector(weights),
        gamma: design.network.reference.gamma,
        set: array(set),
        set_limit: vector(set_limit),
        rate: array(rate),
        epsilon: design.sizing.epsilon,
        euclidean: *euclidean,
        coupling: [],
    };
    let fits = set.nrows() == layer.set.len() && rate.nrows() == layer.rate.len() && coupling.nrows() == 0;
    fits.then_some(layer).ok_or("rows of the reference outputs")
}

type Problem = tables::DpcProblem<4, 2, N, NV, NR, NT, NS, NQ>;

/// Rows stand in groups of a fixed size, in the order of an emitted file; what is left of a group restricts nothing.
fn problem(dpc: &DpcProblem) -> Result<Problem, &'static str> {
    let mut problem = Problem {
        V: [[0.0; NV]; NR],
        gram: &[],
        extent: [0; NR],
        slack: &[],
        lower: [f64::NEG_INFINITY; NR],
        upper: [f64::INFINITY; NR],
        tube: [[0.0; 4]; NT],
        state: std::array::from_fn(|_| StageRow { stage: 0, row: [0.0; 4] }),
        input: std::array::from_fn(|_| StageRow { stage: 0, row: [0.0; 2] }),
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
        let group = group(row.kind);
        let k = filled[group];
        let at = FIRST[group] + k;
        if at >= FIRST[group + 1] {
            return Err(["tube rows", "state rows", "input rows", "rows without offset"][group]);
        }
        filled[group] += 1;
        places.push(at);
        problem.extent[at] = row.extent as u16;
        problem.V[at] = std::array::from_fn(|c| dpc.V[(r, c)]);
        (problem.lower[at], problem.upper[at]) = (dpc.lower[r], dpc.upper[r]);
        match row.kind {
            RowKind::Tube => problem.tube[k] = part(&row.offset),
            RowKind::State(stage) => problem.state[k] = StageRow { stage, row: part(&row.offset) },
            RowKind::Input(stage) => problem.input[k] = StageRow { stage, row: part(&row.offset) },
            RowKind::CouplingOutput(_) | RowKind::Terminal => {}
        }
    }
    for (at, to) in places.iter().zip(dpc.shift()) {
        problem.shift[*at] = places.get(to).map_or(NO_ROW, |&to| to as u16);
    }
    Ok(problem)
}

fn stage(stage: &dpc_codegen::problems::Stage) -> Stage<4, 2> {
    Stage {
        next: array(&stage.next),
        drive: array(&stage.drive),
        gain: array(&stage.gain),
        spread: array(&stage.spread),
    }
}

/// Where groups begin, and the end.
const FIRST: [usize; 5] = [0, NT, NT + NS, NT + NS + NQ, NR];

fn group(kind: RowKind) -> usize {
    match kind {
        RowKind::Tube => 0,
        RowKind::State(_) => 1,
        RowKind::Input(_) => 2,
        RowKind::CouplingOutput(_) | RowKind::Terminal => 3,
    }
}

fn part<const N: usize>(offset: &DVector<f64>) -> [f64; N] {
    std::array::from_fn(|k| offset[k])
}

fn array<const R: usize, const C: usize>(matrix: &DMatrix<f64>) -> [[f64; C]; R] {
    std::array::from_fn(|r| std::array::from_fn(|c| if r < matrix.nrows() { matrix[(r, c)] } else { 0.0 }))
}

fn vector<const R: usize>(vector: &DVector<f64>) -> [f64; R] {
    std::array::from_fn(|r| vector[r])
}

struct Process<'a, const NJ: usize, const NB: usize> {
    controller: Control<'a, NJ, NB>,
    inbox: Inbox<0, NJ, NB>,
    robot: usize,
}

fn process<'a, const NJ: usize, const NB: usize>(
    tables: &'a Tables<NJ, NB>,
    robot: usize,
    [x, y]: &Point,
) -> Result<Started<'a>, StartError> {
    let (controller, message) = Controller::start(tables, &SteadyState { x: [*x, 0.0, *y, 0.0], u: [0.0; 2] })?;
    Ok((Box::new(Process { controller, inbox: Inbox::new(), robot }), encode(&message)))
}

impl<const NJ: usize, const NB: usize> Robot for Process<'_, NJ, NB> {
    fn receive(&mut self, datagram: &Datagram) -> Result<(), NotReceived> {
        let message = decode(&datagram.bytes).map_err(NotReceived::WrongLength)?;
        let slot = datagram.from - usize::from(datagram.from > self.robot);
        let sender = Sender { design: 0, place: datagram.from as u32 };
        let link = Link::<2, 2> { slot, z: None, y: Some(2 * slot), sender };
        self.inbox.accept(&link, &message).map_err(NotReceived::Refused)
    }

    step!(NB);
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(n) => write!(f, "a fleet has 2 to {MOST} robots, not {n}"),
            Self::Sizes { robot, what } => {
                write!(f, "there is no room for the {what} of robot {}", robot + 1)
            }
            Self::Start { robot, why } => write!(f, "robot {} does not start: {why}", robot + 1),
        }
    }
}

impl std::error::Error for Unfit {}
