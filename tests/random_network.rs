//! Random sparse networks as a user would write them, and the plant their text means.
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::collections::BTreeMap;
use std::fmt::Write;
use std::ops::Range;

use dpc_codegen::diagnostic::Source;
use nalgebra::{DMatrix, DVector};

use crate::Random;
use crate::unknowns::{Stated, Unknowns};

/// A network in one of the three ways to state it.
#[derive(Debug, Clone)]
pub struct RandomNetwork {
    pub seed: u64,
    pub text: String,
    /// What the text means, without the compiler's help.
    pub plant: Plant,
}

/// The collective plant (5) and its constraints, subsystem by subsystem in the order of the file.
#[derive(Debug, Clone)]
pub struct Plant {
    pub A: DMatrix<f64>,
    pub B: DMatrix<f64>,
    pub C: DMatrix<f64>,
    pub parts: Vec<Part>,
    /// (3): row over the collective y, and its limit.
    pub coupling: Vec<(DVector<f64>, f64)>,
}

/// What one subsystem owns of the collective vectors, and its sets.
#[derive(Debug, Clone)]
pub struct Part {
    pub x: Range<usize>,
    pub u: Range<usize>,
    pub y: Range<usize>,
    pub X: Region,
    pub U: Region,
    pub unknowns: Unknowns,
}

/// A box with perhaps infinite ends, cut by rows.
#[derive(Debug, Clone)]
pub struct Region {
    pub min: Vec<f64>,
    pub max: Vec<f64>,
    pub rows: Vec<(Vec<f64>, f64)>,
}

impl Region {
    /// Largest violation of a bound, relative to it; not positive inside.
    pub fn violation(&self, x: &[f64]) -> f64 {
        let low = self.min.iter().zip(x).map(|(min, x)| (min - x) / min.abs());
        let high = self.max.iter().zip(x).map(|(max, x)| (x - max) / max.abs());
        let rows = self.rows.iter().map(|(row, h)| (row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>() - h) / h);
        low.chain(high).filter(|v| !v.is_nan()).chain(rows).fold(f64::NEG_INFINITY, f64::max)
    }

    /// As H x <= h.
    pub fn halfspaces(&self) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.min.len();
        let axis = |k: usize, sign: f64| (0..n).map(|j| if j == k { sign } else { 0.0 }).collect::<Vec<_>>();
        let mut sides = self.rows.clone();
        sides.extend((0..n).map(|k| (axis(k, 1.0), self.max[k])));
        sides.extend((0..n).map(|k| (axis(k, -1.0), -self.min[k])));
        sides.retain(|(_, limit)| limit.is_finite());
        let H = DMatrix::from_fn(sides.len(), n, |r, k| sides[r].0[k]);
        (H, DVector::from_fn(sides.len(), |r, _| sides[r].1))
    }

    fn is_everything(&self) -> bool {
        self.rows.is_empty() && self.min.iter().chain(&self.max).all(|end| end.is_infinite())
    }

    /// `{ min = [..], max = [..], H = [[..]], h = [..] }` without what says nothing.
    pub fn toml(&self) -> String {
        let mut keys = Vec::new();
        for (key, ends) in [("min", &self.min), ("max", &self.max)] {
            if ends.iter().any(|end| end.is_finite()) {
                keys.push(format!("{key} = {ends:?}"));
            }
        }
        if !self.rows.is_empty() {
            let (H, h): (Vec<_>, Vec<_>) = self.rows.iter().cloned().unzip();
            keys.push(format!("H = {H:?}, h = {h:?}"));
        }
        format!("{{ {} }}", keys.join(", "))
    }
}

/// One subsystem in interaction form, before it is written.
struct Draft {
    name: String,
    A: DMatrix<f64>,
    B: DMatrix<f64>,
    C: DMatrix<f64>,
    E: DMatrix<f64>,
    L: BTreeMap<usize, DMatrix<f64>>,
    Cz: DMatrix<f64>,
    Dz: DMatrix<f64>,
    X: Region,
    U: Region,
    /// Keys that say nothing about the plant.
    tuning: String,
    unknowns: Option<Stated>,
}

/// Kinds of what a file says of unknowns that can be left out of it again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Disturbance,
    Error,
    Loads,
}

impl RandomNetwork {
    /// The network of a seed: the same one for ever.
    pub fn new(seed: u64) -> Self {
        Self::with(seed, |_| {})
    }

    /// The same network with disturbances, measurement errors and loads on some of its subsystems.
    pub fn disturbed(seed: u64) -> Self {
        Self::with(seed, |drafts| disturb(seed, drafts))
    }

    /// The same network with constraints among its subsystems whose rows change while running; every other one disturbed.
    pub fn changing(seed: u64) -> Self {
        let network = if seed.is_multiple_of(2) { Self::new(seed) } else { Self::disturbed(seed) };
        let text = network.text.clone() + &changing_toml(&mut Random(seed ^ 0x5bd1_e995), network.plant.parts.len());
        Self { text, ..network }
    }

    /// [`Self::disturbed`], whose text does not mention one kind of what the plant has.
    pub fn unaware(seed: u64, kind: Kind) -> Self {
        let whole = Self::disturbed(seed);
        let text = Self::with(seed, |drafts| {
            disturb(seed, drafts);
            drafts.iter_mut().filter_map(|draft| draft.unknowns.as_mut()).for_each(|stated| match kind {
                Kind::Disturbance => stated.w.clear(),
                Kind::Error => stated.error.clear(),
                Kind::Loads => stated.loads.clear(),
            });
        })
        .text;
        Self { text, ..whole }
    }

    fn with(seed: u64, change: impl FnOnce(&mut [Draft])) -> Self {
        let random = &mut Random(seed.wrapping_mul(0x2545_f491_4f6c_dd1d));
        let mut drafts = drafts(random);
        change(&mut drafts);
        let coupling = coupling_constraints(random, &drafts);
        let head = head(seed, random);
        let (body, A, B) = match random.below(3) {
            0 => blocks(&drafts),
            1 => collective(random, &drafts),
            _ => interaction(&drafts),
        };
        let text = [head, body, coupling_toml(&drafts, &coupling)].concat();
        Self { seed, text, plant: plant(drafts, A, B, coupling) }
    }

    pub fn source(&self) -> Source {
        Source { path: format!("random_{}.toml", self.seed), text: self.text.clone() }
    }
}

/// Three significant digits, as a person would write.
fn short(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

fn rows(matrix: &DMatrix<f64>) -> String {
    let rows: Vec<Vec<f64>> = matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
    format!("{rows:?}")
}

fn head(seed: u64, random: &mut Random) -> String {
    let mut head = format!("name = \"random {seed}\"\nsample-time = 0.1\nhorizon = {}\n\n", 1 + random.below(6));
    let norm = ["1", "2", "\"inf\""][random.below(3)];
    let _ = writeln!(head, "[reference]\nnorm = {norm}");
    if random.chance(0.5) {
        let _ = writeln!(head, "epsilon = {:?}", short(random.magnitude(1e-3, 2e-2)));
    }
    if random.chance(0.3) {
        let _ = writeln!(head, "gamma = {:?}", short(random.magnitude(1e-6, 1e-2)));
    }
    if random.chance(0.2) {
        let _ = writeln!(head, "\n[sizing]\nsymmetric = {}\nfacet-loss = 0.05", random.chance(0.5));
    }
    head
}

/// With a random stream of its own: the plant, its limits and its tuning stay.
fn disturb(seed: u64, drafts: &mut [Draft]) {
    let random = &mut Random(seed.wrapping_mul(0x9fb2_1c65_1e98_df25) ^ 0x5bf0_3635);
    let size = random.magnitude(3e-4, 0.15);
    let sure = random.below(drafts.len());
    for (i, draft) in drafts.iter_mut().enumerate() {
        if i == sure || random.chance(0.6) {
            draft.unknowns = Some(Stated::new(random, &draft.name, draft.A.nrows(), size));
        }
    }
}

fn drafts(random: &mut Random) -> Vec<Draft> {
    let M = 2 + random.below(5);
    let strength = random.magnitude(0.003, 0.2);
    let graph = graph(random, M);
    let mut drafts: Vec<Draft> = (0..M).map(|i| local(random, i)).collect();
    for &(i, j) in &graph {
        connect(random, &mut drafts, i, j, strength);
    }
    for i in 0..M {
        let (nz, nx) = (drafts[i].Cz.nrows(), drafts[i].A.nrows());
        drafts.iter_mut().filter_map(|draft| draft.L.get_mut(&i)).for_each(|L| L.resize_mut(L.nrows(), nz, 0.0));
        debug_assert_eq!(drafts[i].E.nrows(), nx);
    }
    drafts
}

/// Who acts on whom: pairs (receiver, sender).
fn graph(random: &mut Random, M: usize) -> Vec<(usize, usize)> {
    let chain = (1..M).flat_map(|i| [(i, i - 1), (i - 1, i)]);
    match random.below(4) {
        0 => chain.collect(),
        1 => (0..M).map(|i| (i, (i + 1) % M)).collect(),
        2 => (1..M).flat_map(|i| [(i, 0), (0, i)]).collect(),
        _ => {
            let all = (0..M).flat_map(|i| (0..M).filter(move |j| *j != i).map(move |j| (i, j)));
            all.filter(|_| random.chance(0.3)).collect()
        }
    }
}

fn local(random: &mut Random, i: usize) -> Draft {
    let n = 1 + random.below(4);
    let m = 1 + random.below(2);
    let p = 1 + random.below(m.min(n));
    let A = dynamics(random, n);
    let B = DMatrix::from_fn(n, m, |_, _| short(random.sign() * random.between(0.1, 1.0)));
    let C = outputs(random, p, n);
    let X = region(random, n, 2.0, 20.0);
    let U = region(random, m, 1.0, 5.0);
    let tuning = tuning(random, &A, m, p);
    let (E, Cz, Dz) = (DMatrix::zeros(n, 0), DMatrix::zeros(0, n), DMatrix::zeros(0, m));
    Draft { name: format!("s{i}"), A, B, C, E, L: BTreeMap::new(), Cz, Dz, X, U, tuning, unknowns: None }
}

/// Stable, slow, unstable, or a chain of integrators.
fn dynamics(random: &mut Random, n: usize) -> DMatrix<f64> {
    if n > 1 && random.chance(0.2) {
        let step = short(random.between(0.1, 0.5));
        return DMatrix::from_fn(n, n, |i, j| if i == j { 1.0 } else { f64::from(j == i + 1) * step });
    }
    let radius = if random.chance(0.15) { random.between(1.0, 1.1) } else { random.between(0.2, 0.98) };
    let A = DMatrix::from_fn(n, n, |i, j| random.between(-1.0, 1.0) + f64::from(i == j));
    let size = A.complex_eigenvalues().iter().fold(1e-3, |size: f64, e| size.max(e.norm()));
    A.map(|a| short(a * radius / size))
}

fn outputs(random: &mut Random, p: usize, n: usize) -> DMatrix<f64> {
    let order = random.order(n);
    let plain = random.chance(0.6);
    DMatrix::from_fn(p, n, |r, k| match plain {
        true => f64::from(order[r] == k),
        false => f64::from(order[r] == k) + short(random.between(-0.5, 0.5)),
    })
}

fn region(random: &mut Random, n: usize, least: f64, most: f64) -> Region {
    let mut end = |sign: f64| (0..n).map(|_| sign * short(random.between(least, most))).collect::<Vec<_>>();
    let (mut min, mut max, mut rows) = (end(-1.0), end(1.0), Vec::new());
    let absent = |ends: &mut Vec<f64>, random: &mut Random, share: f64| {
        ends.iter_mut().filter(|_| random.chance(share)).for_each(|end| *end *= f64::INFINITY);
    };
    match random.below(10) {
        0 => [&mut min, &mut max].into_iter().for_each(|ends| absent(ends, random, 0.5)),
        1 => [&mut min, &mut max].into_iter().for_each(|ends| absent(ends, random, 1.0)),
        2 | 3 => rows = (0..1 + random.below(3)).map(|_| cut(random, n, least, most)).collect(),
        _ => {}
    }
    Region { min, max, rows }
}

fn cut(random: &mut Random, n: usize, least: f64, most: f64) -> (Vec<f64>, f64) {
    let row = (0..n).map(|_| short(random.sign() * random.between(0.1, 1.0))).collect();
    (row, short(random.between(least, most)))
}

/// Weights in their three ways, gains, set-points to cover, reserve.
fn tuning(random: &mut Random, A: &DMatrix<f64>, m: usize, p: usize) -> String {
    let n = A.nrows();
    let mut text = String::new();
    for (key, size, share) in [("Q", n, 0.3), ("R", m, 0.3), ("T", p, 0.4)] {
        if random.chance(share) {
            let _ = writeln!(text, "{key} = {}", weight(random, size));
        }
    }
    if random.chance(0.3) {
        let _ = writeln!(text, "gain-weights = {{ R = {:?} }}", short(random.magnitude(0.1, 10.0)));
    }
    if random.chance(0.3) {
        let _ = writeln!(text, "reference-weights = {{ Qe = {:?} }}", short(random.magnitude(0.01, 1.0)));
    }
    let radius = A.complex_eigenvalues().iter().fold(0.0, |size: f64, e| size.max(e.norm()));
    if radius < 0.9 && random.chance(0.1) {
        let _ = writeln!(text, "K = {}", rows(&DMatrix::zeros(m, n)));
    }
    text
}

fn weight(random: &mut Random, size: usize) -> String {
    match random.below(3) {
        0 => format!("{:?}", short(random.magnitude(0.1, 10.0))),
        1 => format!("{:?}", (0..size).map(|_| short(random.magnitude(0.1, 10.0))).collect::<Vec<_>>()),
        _ => {
            let root = DMatrix::from_fn(size, size, |_, _| (random.below(5) as f64 - 2.0) / 2.0);
            rows(&(root.transpose() * &root + DMatrix::identity(size, size) * 0.5))
        }
    }
}

/// `from` acts on `to` through one coupling input and one coupling output, often shared with others.
fn connect(random: &mut Random, drafts: &mut [Draft], to: usize, from: usize, strength: f64) {
    let (n, m) = (drafts[from].A.nrows(), drafts[from].B.ncols());
    if drafts[from].Cz.nrows() == 0 || random.chance(0.2) {
        let on_x = sparse_row(random, n, strength);
        let on_u = if random.chance(0.3) { sparse_row(random, m, strength) } else { DVector::zeros(m) };
        push_row(&mut drafts[from].Cz, &on_x);
        push_row(&mut drafts[from].Dz, &on_u);
    }
    let receiver = drafts[to].A.nrows();
    if drafts[to].E.ncols() == 0 || random.chance(0.2) {
        let column = sparse_row(random, receiver, 1.0);
        let ns = drafts[to].E.ncols();
        drafts[to].E.resize_mut(receiver, ns + 1, 0.0);
        drafts[to].E.set_column(ns, &column);
        drafts[to].L.values_mut().for_each(|L| L.resize_mut(ns + 1, L.ncols(), 0.0));
    }
    let (ns, nz) = (drafts[to].E.ncols(), drafts[from].Cz.nrows());
    let mut L = DMatrix::zeros(ns, nz);
    L[(ns - 1, nz - 1)] = short(random.sign() * random.between(0.3, 1.0));
    if nz > 1 && random.chance(0.3) {
        L[(0, 0)] = short(random.sign() * random.between(0.1, 0.5));
    }
    drafts[to].L.insert(from, L);
}

fn sparse_row(random: &mut Random, n: usize, size: f64) -> DVector<f64> {
    let sure = random.below(n);
    let entry = |k: usize, _| match k == sure || random.chance(0.2) {
        true => short(size * random.sign() * random.between(0.2, 1.0)),
        false => 0.0,
    };
    DVector::from_fn(n, entry)
}

fn push_row(matrix: &mut DMatrix<f64>, row: &DVector<f64>) {
    let r = matrix.nrows();
    matrix.resize_mut(r + 1, row.len(), 0.0);
    matrix.set_row(r, &row.transpose());
}

/// (subsystem, row over its outputs) pairs and the limit.
type Coupling = (Vec<(usize, Vec<f64>)>, f64);

fn coupling_constraints(random: &mut Random, drafts: &[Draft]) -> Vec<Coupling> {
    let count = if random.chance(0.35) { 1 + random.below(2) } else { 0 };
    let one = |_| {
        let members = (2 + random.below(2)).min(drafts.len());
        let chosen = random.order(drafts.len());
        let row = |i: &usize| {
            let p = drafts[*i].C.nrows();
            (*i, (0..p).map(|_| short(random.sign() * random.between(0.3, 1.5))).collect())
        };
        (chosen[..members].iter().map(row).collect(), short(random.between(0.5, 4.0)))
    };
    (0..count).map(one).collect()
}

fn coupling_toml(drafts: &[Draft], constraints: &[Coupling]) -> String {
    let one = |(H, l): &Coupling| {
        let rows: Vec<_> = H.iter().map(|(i, row)| format!("{} = {row:?}", drafts[*i].name)).collect();
        format!("\n[[coupling-constraint]]\nH = {{ {} }}\nmax = {l:?}\n", rows.join(", "))
    };
    constraints.iter().map(one).collect()
}

/// One to three, mostly between two subsystems, some with a margin that leaves much room.
fn changing_toml(random: &mut Random, subsystems: usize) -> String {
    let one = |random: &mut Random| {
        let members = [1, 2, 2, 2, 3][random.below(5)].min(subsystems);
        let names: Vec<_> = random.order(subsystems)[..members].iter().map(|i| format!("s{i}")).collect();
        let margin = if random.chance(0.3) {
            format!("margin = {:?}\n", short(random.magnitude(0.5, 5.0)))
        } else {
            String::new()
        };
        format!("\n[[changing-constraint]]\nbetween = {names:?}\n{margin}")
    };
    let count = 1 + random.below(3);
    (0..count).map(|_| one(random)).collect()
}

impl Draft {
    fn signals(&self, letter: &str, count: usize) -> Vec<String> {
        (1..=count).map(|k| format!("{letter}{}{k}", self.name)).collect()
    }

    /// `states`, `inputs`, `outputs`.
    fn names(&self) -> [Vec<String>; 3] {
        [("x", self.A.nrows()), ("u", self.B.ncols()), ("y", self.C.nrows())]
            .map(|(letter, count)| self.signals(letter, count))
    }

    /// The table's head, names, bounds and tuning.
    fn head(&self) -> String {
        let [states, inputs, outputs] = self.names();
        let mut head = format!(
            "\n[subsystem.{}]\nstates = {states:?}\ninputs = {inputs:?}\noutputs = {outputs:?}\n{}",
            self.name, self.tuning
        );
        for (key, region) in [("x", &self.X), ("u", &self.U)] {
            if !region.is_everything() {
                let _ = writeln!(head, "{key} = {}", region.toml());
            }
        }
        head + &self.unknowns.as_ref().map_or(String::new(), Stated::toml)
    }

    fn own_matrices(&self) -> String {
        format!("A = {}\nB = {}\nC = {}\n", rows(&self.A), rows(&self.B), rows(&self.C))
    }

    /// A_ij and B_ij.
    fn imported(&self, from: &Draft, j: usize) -> (DMatrix<f64>, DMatrix<f64>) {
        let EL = &self.E * &self.L[&j];
        (&EL * &from.Cz, &EL * &from.Dz)
    }
}

/// The text after the head, and A, B as it states them.
type Written = (String, DMatrix<f64>, DMatrix<f64>);

fn collect(drafts: &[Draft]) -> (DMatrix<f64>, DMatrix<f64>) {
    let (x, u) = (starts(drafts, |d| d.A.nrows()), starts(drafts, |d| d.B.ncols()));
    let (mut A, mut B) =
        (DMatrix::zeros(x[drafts.len()], x[drafts.len()]), DMatrix::zeros(x[drafts.len()], u[drafts.len()]));
    for (i, draft) in drafts.iter().enumerate() {
        A.view_mut((x[i], x[i]), draft.A.shape()).copy_from(&draft.A);
        B.view_mut((x[i], u[i]), draft.B.shape()).copy_from(&draft.B);
        for &j in draft.L.keys() {
            let (A_ij, B_ij) = draft.imported(&drafts[j], j);
            A.view_mut((x[i], x[j]), A_ij.shape()).copy_from(&A_ij);
            B.view_mut((x[i], u[j]), B_ij.shape()).copy_from(&B_ij);
        }
    }
    (A, B)
}

/// First index of each subsystem, and the number of all at the end.
fn starts(drafts: &[Draft], size: impl Fn(&Draft) -> usize) -> Vec<usize> {
    let mut starts = vec![0];
    drafts.iter().for_each(|draft| starts.push(starts[starts.len() - 1] + size(draft)));
    starts
}

fn blocks(drafts: &[Draft]) -> Written {
    let mut text = String::new();
    for draft in drafts {
        text += &[draft.head(), draft.own_matrices()].concat();
        for &j in draft.L.keys() {
            let (A, B) = draft.imported(&drafts[j], j);
            let _ = writeln!(text, "[subsystem.{}.from.{}]", draft.name, drafts[j].name);
            let _ = writeln!(text, "A = {}\nB = {}", rows(&A), rows(&B));
        }
    }
    let (A, B) = collect(drafts);
    (text, A, B)
}

fn interaction(drafts: &[Draft]) -> Written {
    let mut text = String::new();
    for draft in drafts {
        text += &[draft.head(), draft.own_matrices()].concat();
        for (key, matrix) in [("E", &draft.E), ("Cz", &draft.Cz), ("Dz", &draft.Dz)] {
            if !matrix.is_empty() {
                let _ = writeln!(text, "{key} = {}", rows(matrix));
            }
        }
        for (&j, L) in &draft.L {
            let _ = writeln!(text, "from.{}.L = {}", drafts[j].name, rows(L));
        }
    }
    let (A, B) = collect(drafts);
    (text, A, B)
}

/// The collective form, its signals in a random order.
fn collective(random: &mut Random, drafts: &[Draft]) -> Written {
    let (A, B) = collect(drafts);
    let C = collective_outputs(drafts);
    let names = |k: usize| drafts.iter().flat_map(|draft| draft.names()[k].clone()).collect::<Vec<_>>();
    let orders = [A.nrows(), B.ncols(), C.nrows()].map(|n| random.order(n));
    let mut text = "\n[collective]\n".to_owned();
    for (k, key) in ["states", "inputs", "outputs"].into_iter().enumerate() {
        let names = names(k);
        let listed: Vec<_> = orders[k].iter().map(|&r| &names[r]).collect();
        let _ = writeln!(text, "{key} = {listed:?}");
    }
    let [x, u, y] = &orders;
    for (key, matrix, r, c) in [("A", &A, x, x), ("B", &B, x, u), ("C", &C, y, x)] {
        let _ = writeln!(text, "{key} = {}", rows(&matrix.select_rows(r).select_columns(c)));
    }
    drafts.iter().for_each(|draft| text += &draft.head());
    (text, A, B)
}

fn collective_outputs(drafts: &[Draft]) -> DMatrix<f64> {
    let (x, y) = (starts(drafts, |d| d.A.nrows()), starts(drafts, |d| d.C.nrows()));
    let mut C = DMatrix::zeros(y[drafts.len()], x[drafts.len()]);
    for (i, draft) in drafts.iter().enumerate() {
        C.view_mut((y[i], x[i]), draft.C.shape()).copy_from(&draft.C);
    }
    C
}

fn plant(drafts: Vec<Draft>, A: DMatrix<f64>, B: DMatrix<f64>, coupling: Vec<Coupling>) -> Plant {
    let (x, u, y) =
        (starts(&drafts, |d| d.A.nrows()), starts(&drafts, |d| d.B.ncols()), starts(&drafts, |d| d.C.nrows()));
    let C = collective_outputs(&drafts);
    let row = |(H, l): Coupling| {
        let mut row = DVector::zeros(C.nrows());
        H.into_iter().for_each(|(i, own)| row.rows_mut(y[i], own.len()).copy_from_slice(&own));
        (row, l)
    };
    let coupling = coupling.into_iter().map(row).collect();
    let part = |(i, draft): (usize, Draft)| Part {
        x: x[i]..x[i + 1],
        u: u[i]..u[i + 1],
        y: y[i]..y[i + 1],
        unknowns: draft.unknowns.map_or_else(|| Unknowns::none(draft.A.nrows()), |stated| stated.unknowns),
        X: draft.X,
        U: draft.U,
    };
    let parts = drafts.into_iter().enumerate().map(part).collect();
    Plant { A, B, C, parts, coupling }
}
