//! Three bodies in the plane, small enough to design by hand:
//!
//!     x+ = x + u,   y = x,   |x| <= 100,   |u| <= 10 per axis,   horizon 2.
//!
//! uref = -2 xref + eref is dead-beat: xref_t = yref_{t-1}. So C xref - yref is at most epsilon per axis, which is the whole margin of
//! (26): there is no tube, since nothing disturbs. K = -1.

use std::array;
use std::f64::consts::FRAC_PI_2;

use dpc_runtime::tables::{Bounds, ChangingRow, DpcProblem, Import, Member, Model, NO_ROW, Nearest, Stage};
use dpc_runtime::{Controller, HalfSpace, Inbox, Link, Meeting, Message, Sender, SteadyState, Tables};

pub const EPSILON: f64 = 1.0;
/// Of the true positions.
pub const DISTANCE: f64 = 3.0;
const BODIES: usize = 3;

pub type Layer = Nearest<2, 4, 4, 0>;
pub type Body<'a> = Controller<'a, Layer, 2, 2, 2, 2, 0, 4, 0, 2, 2, 6, 2, 2, 0, 0, 2>;
pub type BodyTables = Tables<Layer, 2, 2, 2, 2, 0, 4, 0, 2, 2, 6, 2, 2, 0, 0, 2>;
pub type BodyInbox = Inbox<0, 4, 2>;
pub type BodyMessage = Message<2, 2>;
pub type BodySpace = HalfSpace<2, 4>;

/// The others are heard in the order of the network.
pub const LINKS: [Link<2, 2>; 2] = [link(0), link(1)];

const fn link(slot: usize) -> Link<2, 2> {
    Link { slot, z: None, y: Some(2 * slot), sender: Sender { design: 0, place: 0 } }
}

/// With the reserve that accepting a row takes.
const HALF_WIDTH: f64 = EPSILON * (1.0 + 1e-8);
/// What (26) takes of a row along an axis.
pub const MARGIN_OF_TWO: f64 = 2.0 * HALF_WIDTH;
const MARGIN: &[&[f64]] = &[&[HALF_WIDTH, 0.0], &[0.0, HALF_WIDTH]];
const OWN: Member = Member { import: None, generators: MARGIN };
const A: Member = Member { import: Some(Import { slot: 0, first: 0, outputs: 2 }), generators: MARGIN };
const B: Member = Member { import: Some(Import { slot: 1, first: 2, outputs: 2 }), generators: MARGIN };

/// By body: a row with each of the two others.
const ROWS: [[ChangingRow; 2]; BODIES] = [
    [ChangingRow { members: &[OWN, A] }, ChangingRow { members: &[OWN, B] }],
    [ChangingRow { members: &[A, OWN] }, ChangingRow { members: &[OWN, B] }],
    [ChangingRow { members: &[A, OWN] }, ChangingRow { members: &[B, OWN] }],
];

pub fn tables(body: usize) -> BodyTables {
    let identity = [[1.0, 0.0], [0.0, 1.0]];
    let scaled = |factor: f64| identity.map(|row| row.map(|entry| factor * entry));
    let model = Model {
        A: identity,
        B: identity,
        C: identity,
        Cz: identity,
        Dz: scaled(0.0),
        EL: [[]; 2],
        K: scaled(-1.0),
        Kx: scaled(-2.0),
        Ke: identity,
        u_min: [-10.0; 2],
        u_max: [10.0; 2],
        drift: [1e-9; 2],
    };
    Tables { model, coupling: [], changing: ROWS[body], reference: layer(), problem: problem() }
}

fn layer() -> Layer {
    let axes = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
    Nearest {
        basis: [[1.0, 0.0], [0.0, 1.0]],
        weights: [4.0; 2],
        gamma: 1.0,
        set: axes,
        set_limit: [50.0; 4],
        rate: axes,
        epsilon: EPSILON,
        euclidean: false,
        coupling: [],
    }
}

/// Nothing disturbs, so the tube rows alone are left: x stays on its reference.
fn problem() -> DpcProblem<2, 2, 2, 6, 2, 2, 0, 0> {
    let unit = |k: usize| array::from_fn(|j| if j == k { 1.0 } else { 0.0 });
    let identity = [[1.0, 0.0], [0.0, 1.0]];
    let stage = || Stage { next: identity, drive: identity, gain: [[0.0; 2]; 2], spread: identity };
    DpcProblem {
        V: array::from_fn(unit),
        gram: &[],
        extent: [1, 2],
        slack: &[],
        lower: [-1e-6; 2],
        upper: [1e-6; 2],
        tube: [[-1.0, 0.0], [0.0, -1.0]],
        state: [],
        input: [],
        terminal: &[],
        shift: [NO_ROW; 2],
        root: identity,
        stages: [stage(), stage()],
        x: Bounds::NONE,
        u: Bounds::NONE,
        boxed: false,
        staged: false,
        max_iterations: 50,
    }
}

/// The rule of a pair.
#[derive(Debug, Clone, Copy)]
pub enum Rule {
    /// The extreme rotation of the normal that leaves a fifth of the room along the line of centres, to the left.
    Tangent,
    /// Along the line of centres.
    Centres,
}

impl Rule {
    /// Directions are tried one by one, so that the test shares nothing with a clever rule.
    pub fn draw(self, meeting: &Meeting<'_, 2, 4>) -> Option<BodySpace> {
        let pair = meeting.pair()?;
        let apart = [pair.first[0] - pair.second[0], pair.first[1] - pair.second[1]];
        let centre = apart[1].atan2(apart[0]);
        let row = |angle: f64| pair.apart(&[angle.cos(), angle.sin()], DISTANCE);
        let room = |row: &BodySpace| meeting.l_tilde(row) - meeting.k(row);
        let along = row(centre);
        match self {
            Self::Centres => Some(along),
            Self::Tangent => {
                let least = 0.2 * room(&along).max(0.0);
                let mut rows = (-160..=160).rev().map(|k| row(centre + f64::from(k) * 0.01));
                rows.find(|row| room(row) >= least).or_else(|| Some(row(roomiest(|angle| room(&row(angle)), centre))))
            }
        }
    }
}

/// Where a function that falls away from its only maximum is largest, within a right angle of `centre`.
fn roomiest(room: impl Fn(f64) -> f64, centre: f64) -> f64 {
    let (mut low, mut high) = (centre - FRAC_PI_2, centre + FRAC_PI_2);
    for _ in 0..120 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if room(a) < room(b) { low = a } else { high = b }
    }
    0.5 * (low + high)
}

/// Where everybody is.
pub struct Field<'a> {
    pub bodies: Vec<Body<'a>>,
    pub inboxes: Vec<BodyInbox>,
    pub sent: Vec<BodyMessage>,
    pub x: [[f64; 2]; BODIES],
}

pub fn field(tables: &[BodyTables; BODIES], x: [[f64; 2]; BODIES]) -> Field<'_> {
    let started = tables.iter().zip(&x).map(|(tables, x)| Body::start(tables, &SteadyState { x: *x, u: [0.0; 2] }));
    let (bodies, sent) = started.map(|started| started.expect("a steady state in Y")).unzip();
    Field { bodies, inboxes: vec![BodyInbox::new(); BODIES], sent, x }
}

impl Field<'_> {
    /// Delivers what arrives: `arrives(from, to)`.
    pub fn deliver(&mut self, mut arrives: impl FnMut(usize, usize) -> bool) {
        for to in 0..BODIES {
            for (link, from) in LINKS.iter().zip((0..BODIES).filter(|from| *from != to)) {
                if arrives(from, to) {
                    self.inboxes[to].accept(link, &self.sent[from]).expect("in sequence");
                }
            }
        }
    }

    /// One period of one body: its rows by `rule`, its step.
    pub fn step(&mut self, body: usize, rule: Rule, set_point: [f64; 2]) -> dpc_runtime::Status<2> {
        let (controller, inbox) = (&mut self.bodies[body], &mut self.inboxes[body]);
        for row in 0..2 {
            let _ = controller.redraw(row, inbox, |meeting| rule.draw(meeting));
        }
        let step = controller.step(&self.x[body], &set_point, inbox);
        self.sent[body] = step.message;
        self.x[body] = array::from_fn(|k| self.x[body][k] + step.input[k]);
        step.status
    }

    /// Smallest distance of two bodies.
    pub fn distance(&self) -> f64 {
        let pairs = [(0, 1), (0, 2), (1, 2)];
        let between = |(i, j): (usize, usize)| {
            let [dx, dy]: [f64; 2] = array::from_fn(|k| self.x[i][k] - self.x[j][k]);
            dx.hypot(dy)
        };
        pairs.into_iter().map(between).fold(f64::INFINITY, f64::min)
    }
}
