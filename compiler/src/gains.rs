//! Step 1 of the off-line design: K_i, calK_i, P_i, and Assumptions 1-3 with their margins.
#![expect(non_snake_case, reason = "the paper's symbols")]

mod inequality;
mod interconnection;
mod large;
mod pairing;
mod settle;

use lapack_symbols::singular_values;
use nalgebra::{DMatrix, SymmetricEigen};

use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::network::{Network, Subsystem};
use crate::optim::lyapunov::{Contraction, eigenvalues, lyapunov, spectral_radius};
use crate::optim::responses::Responses;
use crate::optim::riccati::lqr;
use crate::optim::rounding::to_digits;
use crate::optim::sparse::Sparse;
use crate::sets::small_gain_mistake;
use crate::sharing::{Key, shared};
pub use interconnection::{Layer, interconnection};
pub use large::{MOST_DENSE, is_too_large_for_dense, reference_states};
pub use pairing::is_wrongly_paired;
pub use settle::{GainChoice, Settled, origin};

/// After this point: A + BK, every F_ii and calF are Schur (proved by Lyapunov certificates, not by eigenvalues
/// alone), and Assumption 2 holds; the margins are recorded. In a large network calF is proved by [`Proof::Responses`], and
/// that A + BK is Schur follows from Assumption 4, which the next stage asks for.
#[derive(Debug)]
pub struct Gains {
    pub subsystems: Vec<SubsystemGains>,
    /// calF of Assumption 3, over (chi_1, ..., chi_M), chi_i = (xref_i, eref_i).
    pub calF: Sparse,
    /// calG = diag(G_i), (n + p) x p.
    pub calG: Sparse,
    /// The proof of Assumption 3.
    pub proof: Proof,
    /// First row of chi_i in the collective chi.
    pub chi_offset: Vec<usize>,
    /// First row of y_i in the collective y.
    pub y_offset: Vec<usize>,
    /// Spectral radius of F = A + BK (Assumption 1); of a large network a bound, 1 where only Assumption 4 proves that it is
    /// below.
    pub rho_F: f64,
    /// Smallest singular value of the matrix of Assumption 2, relative to its largest; `None` in a large network, where full
    /// rank follows from Assumption 3.
    pub rank_margin: Option<f64>,
    /// Spectral radius of calF (Assumption 3); of a large network a bound, 1 where only the loop gain proves that it is below.
    pub rho_calF: f64,
}

/// Why calF is Schur, and what sums over its powers are bounded by.
#[derive(Debug, Clone)]
pub enum Proof {
    /// A norm in which calF contracts.
    Norm(Contraction),
    /// The local loops and what they send each other: in large networks.
    Responses(Responses),
}

#[derive(Debug, Clone)]
pub struct SubsystemGains {
    /// K_i, m x n.
    pub K: DMatrix<f64>,
    /// K_i^x, m x n.
    pub Kx: DMatrix<f64>,
    /// K_i^e, m x p.
    pub Ke: DMatrix<f64>,
    /// P_i of (37).
    pub P: DMatrix<f64>,
    /// F_ii = A_ii + B_ii K_i.
    pub F: DMatrix<f64>,
    /// The norm in which F_ii contracts.
    pub contraction: Contraction,
    /// Spectral radius of F_ii.
    pub rho_F: f64,
}

impl Gains {
    /// Gains as given, as settled by the matrix inequality, or by local Riccati equations; then Assumptions 1, 2, 3.
    /// [`Settled::new`] chooses between the latter two.
    ///
    /// # Errors
    /// E0201 a subsystem has no stabilising Riccati gain, E0202 F_ii is not Schur, E0203 A + BK is not Schur (in large networks
    /// this is left to Assumption 4), E0204 Assumption 2 fails, E0205 calF is not Schur, E0207 calF of a large network is not
    /// proved to be.
    pub fn new(network: &Network) -> Result<Self, Diagnostics> {
        if reference_states(network) <= large::DENSE {
            return Self::dense(network, None);
        }
        if is_too_large_for_dense(network) {
            return Self::sparse(network);
        }
        let made = Self::large(network, gains_of_each(network)?);
        made.or_else(|(_, subsystems)| Self::dense(network, Some(subsystems)))
    }

    /// [`Gains::new`] by the proof that large networks have, [`Proof::Responses`], whatever the size.
    ///
    /// # Errors
    /// E0201, E0202, E0206 as there, and E0207 where the proof fails.
    pub fn sparse(network: &Network) -> Result<Self, Diagnostics> {
        let made = Self::large(network, gains_of_each(network)?);
        made.map_err(|(radius, _)| large::no_sparse_proof(network, radius).into())
    }

    /// With collective matrices; the gains of the subsystems are made where they are not known.
    fn dense(network: &Network, known: Option<Vec<SubsystemGains>>) -> Result<Self, Diagnostics> {
        let collective = Collective::new(network);
        let rank_margin = collective.assumption_2(network);
        let subsystems = known.map_or_else(|| gains_of_each(network), Ok);
        let (rank_margin, subsystems) = both(rank_margin, subsystems)?;
        let calK: Vec<_> = subsystems.iter().map(SubsystemGains::calK).collect();
        let calF = collective.calF(network, &calK.iter().collect::<Vec<_>>());
        let rho_calF = spectral_radius(&calF);
        let rho_F = collective.assumption_1(network, &subsystems);
        let contraction =
            Contraction::new(&calF).ok_or_else(|| assumption_3_fails(network, &collective, &subsystems, rho_calF));
        let (rho_F, contraction) = all_of(network, &subsystems, rho_F, contraction)?;
        let calG = collective.calG(network);
        Ok(Self {
            calG: Sparse::from_blocks(calG.nrows(), calG.ncols(), [((0, 0), &calG)]),
            chi_offset: offsets(network.subsystems.iter().map(|s| s.n() + s.p())),
            y_offset: collective.y,
            subsystems,
            calF: Sparse::from_blocks(calF.nrows(), calF.ncols(), [((0, 0), &calF)]),
            proof: Proof::Norm(contraction),
            rho_F,
            rank_margin: Some(rank_margin),
            rho_calF,
        })
    }

    /// chi = `steady` y: the collective steady state of (9), (I - calF)^-1 calG, by dense matrices; `None` only where rounding
    /// defeats the inverse.
    pub fn steady(&self) -> Option<DMatrix<f64>> {
        let n = self.calF.nrows();
        (DMatrix::identity(n, n) - self.calF.to_dense()).lu().solve(&self.calG.to_dense())
    }

    /// First reference state of each subsystem, and the number of all at the end.
    pub fn chi_starts(&self) -> Vec<usize> {
        self.chi_offset.iter().copied().chain([self.calF.nrows()]).collect()
    }
}

/// Assumption 2, and the gains of the subsystems. Where the first fails, that a subsystem cannot integrate the error of its outputs
/// says the same once more.
fn both(
    rank_margin: Result<f64, Diagnostic>,
    subsystems: Result<Vec<SubsystemGains>, Diagnostics>,
) -> Result<(f64, Vec<SubsystemGains>), Diagnostics> {
    match (rank_margin, subsystems) {
        (Ok(margin), Ok(subsystems)) => Ok((margin, subsystems)),
        (Ok(_), Err(mistakes)) => Err(mistakes),
        (Err(mistake), Ok(_)) => Err(mistake.into()),
        (Err(mistake), Err(Diagnostics(others))) => {
            let others = others.into_iter().filter(|other| other.code != code::NO_INTEGRATION);
            Err(Diagnostics(std::iter::once(mistake).chain(others).collect()))
        }
    }
}

/// Assumptions 1 and 3; where only the latter fails, Assumption 4 is asked too, since the K_i are all that it rests on. (Where the
/// first fails, the fourth does.)
fn all_of<T>(
    network: &Network,
    gains: &[SubsystemGains],
    first: Result<f64, Diagnostic>,
    third: Result<T, Diagnostic>,
) -> Result<(f64, T), Diagnostics> {
    match (first, third) {
        (Ok(rho), Ok(proof)) => Ok((rho, proof)),
        (Ok(_), Err(mistake)) => {
            Err(Diagnostics(std::iter::once(mistake).chain(small_gain_mistake(network, gains)).collect()))
        }
        (Err(mistake), third) => Err(Diagnostics(std::iter::once(mistake).chain(third.err()).collect())),
    }
}

/// [`SubsystemGains::new`] of each, once for those that are equal.
fn gains_of_each(network: &Network) -> Result<Vec<SubsystemGains>, Diagnostics> {
    let parts = &network.subsystems;
    let made = shared(parts.len(), |i| parts[i].gain_key(), |i| SubsystemGains::new(&parts[i]));
    match made.into_iter().collect() {
        Ok(gains) => Ok(gains),
        // The mistakes of one stand in the name of all that share its work.
        Err(_) => each(parts, SubsystemGains::new),
    }
}

impl Subsystem {
    /// All that the gains of this subsystem follow from.
    fn gain_key(&self) -> Key {
        let wishes = &self.gains;
        let fixed = [Layer::Local, Layer::Reference].map(|layer| layer.fixed(self));
        let weights = [&wishes.weights, &wishes.reference_weights].map(|(Q, R)| [Q, R]);
        let own = [&self.A, &self.B, &self.C, &self.Q, &self.R];
        let key = own.into_iter().chain(weights.into_iter().flatten()).fold(Key::default(), Key::matrix);
        fixed.into_iter().fold(key, Key::maybe)
    }
}

impl SubsystemGains {
    /// The gains of one subsystem, by itself.
    ///
    /// # Errors
    /// E0201, E0206 a Riccati equation has no stabilising solution, E0202 F_ii is not Schur.
    pub fn new(subsystem: &Subsystem) -> Result<Self, Diagnostics> {
        let K = K_i(subsystem)?;
        let calK = calK_i(subsystem)?;
        let F = &subsystem.A + &subsystem.B * &K;
        let rho_F = spectral_radius(&F);
        let contraction = Contraction::new(&F).ok_or_else(|| F_ii_unstable(subsystem, rho_F))?;
        let stage = &subsystem.Q + K.transpose() * &subsystem.R * &K;
        let P = terminal_weight(&F, &stage).ok_or_else(|| F_ii_unstable(subsystem, rho_F))?;
        let n = subsystem.n();
        Ok(Self {
            Kx: calK.columns(0, n).into_owned(),
            Ke: calK.columns(n, subsystem.p()).into_owned(),
            P,
            K,
            F,
            contraction,
            rho_F,
        })
    }

    /// K_i and calK_i as [`Gains::new`] computes or takes them, before it asks whether the loops are stable.
    ///
    /// # Errors
    /// E0201, E0206: a Riccati equation has no stabilising solution.
    pub fn local(subsystem: &Subsystem) -> Result<(DMatrix<f64>, DMatrix<f64>), Diagnostic> {
        Ok((K_i(subsystem)?, calK_i(subsystem)?))
    }

    /// [K_i^x K_i^e].
    pub fn calK(&self) -> DMatrix<f64> {
        let (m, n) = self.Kx.shape();
        DMatrix::from_fn(m, n + self.Ke.ncols(), |i, j| if j < n { self.Kx[(i, j)] } else { self.Ke[(i, j - n)] })
    }
}

/// Spectral radii of the loops that some gains close: what has to be below 1 before [`Gains::new`] accepts them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radii {
    /// The largest of the F_ii.
    pub local: f64,
    /// A + BK.
    pub F: f64,
    pub calF: f64,
}

impl Radii {
    /// Of (K_i, calK_i), one pair per subsystem.
    pub fn new(network: &Network, gains: &[(DMatrix<f64>, DMatrix<f64>)]) -> Self {
        let collective = Collective::new(network);
        let loops = network.subsystems.iter().zip(gains).map(|(s, (K, _))| spectral_radius(&(&s.A + &s.B * K)));
        Self {
            local: loops.fold(0.0, f64::max),
            F: spectral_radius(&collective.F(gains.iter().map(|(K, _)| K))),
            calF: spectral_radius(&collective.calF(network, &gains.iter().map(|(_, calK)| calK).collect::<Vec<_>>())),
        }
    }

    pub fn largest(&self) -> f64 {
        self.local.max(self.F).max(self.calF)
    }
}

/// Gains are rounded to this many digits: any stabilising gain will do, the emitted file stays readable, and every
/// machine goes on from the same numbers.
const GAIN_DIGITS: usize = 9;

pub(crate) fn short(matrix: DMatrix<f64>) -> DMatrix<f64> {
    matrix.map(|value| to_digits(value, GAIN_DIGITS))
}

/// P_i of (37) with the inequality that its proof needs, F'PF - P <= -(Q + K'RK), kept through rounding: checked by a
/// Cholesky factorisation. All digits stay where short ones do not keep it.
fn terminal_weight(F: &DMatrix<f64>, stage: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let P = lyapunov(F, &(stage * (1.0 + 1e-6)))?;
    let rounded = short(P.clone());
    let left = &rounded - F.transpose() * &rounded * F - stage;
    Some(if left.cholesky().is_some() { rounded } else { P })
}

fn K_i(subsystem: &Subsystem) -> Result<DMatrix<f64>, Diagnostic> {
    if let Some(K) = Layer::Local.fixed(subsystem) {
        return Ok(K.clone());
    }
    let (Q, R) = &subsystem.gains.weights;
    lqr(&subsystem.A, &subsystem.B, Q, R).map(short).ok_or_else(|| unstabilisable(subsystem))
}

fn calK_i(subsystem: &Subsystem) -> Result<DMatrix<f64>, Diagnostic> {
    if let Some(calK) = Layer::Reference.fixed(subsystem) {
        return Ok(calK.clone());
    }
    let (Q, R) = &subsystem.gains.reference_weights;
    let (A, B) = augmented(subsystem);
    lqr(&A, &B, Q, R).map(short).ok_or_else(|| unstabilisable_reference(subsystem))
}

/// calA_ii, calB_ii of (7e).
fn augmented(subsystem: &Subsystem) -> (DMatrix<f64>, DMatrix<f64>) {
    let (n, m, p) = (subsystem.n(), subsystem.m(), subsystem.p());
    let mut A = DMatrix::identity(n + p, n + p);
    A.view_mut((0, 0), (n, n)).copy_from(&subsystem.A);
    A.view_mut((n, 0), (p, n)).copy_from(&-&subsystem.C);
    let mut B = DMatrix::zeros(n + p, m);
    B.view_mut((0, 0), (n, m)).copy_from(&subsystem.B);
    (A, B)
}

/// The collective (A, B, C) of (5).
struct Collective {
    A: DMatrix<f64>,
    B: DMatrix<f64>,
    C: DMatrix<f64>,
    x: Vec<usize>,
    u: Vec<usize>,
    y: Vec<usize>,
}

impl Collective {
    fn new(network: &Network) -> Self {
        let parts = &network.subsystems;
        let (n, m, p) = parts.iter().fold((0, 0, 0), |(n, m, p), s| (n + s.n(), m + s.m(), p + s.p()));
        let x = offsets(parts.iter().map(Subsystem::n));
        let u = offsets(parts.iter().map(Subsystem::m));
        let y = offsets(parts.iter().map(Subsystem::p));
        let (mut A, mut B, mut C) = (DMatrix::zeros(n, n), DMatrix::zeros(n, m), DMatrix::zeros(p, n));
        for (i, s) in parts.iter().enumerate() {
            A.view_mut((x[i], x[i]), s.A.shape()).copy_from(&s.A);
            B.view_mut((x[i], u[i]), s.B.shape()).copy_from(&s.B);
            C.view_mut((y[i], x[i]), s.C.shape()).copy_from(&s.C);
            for (&j, L) in &s.L {
                let exporter = &parts[j];
                let EL = &s.E * L;
                A.view_mut((x[i], x[j]), (s.n(), exporter.n())).copy_from(&(&EL * &exporter.Cz));
                B.view_mut((x[i], u[j]), (s.n(), exporter.m())).copy_from(&(&EL * &exporter.Dz));
            }
        }
        Self { A, B, C, x, u, y }
    }

    /// F = A + B diag(K_1, ..., K_M).
    fn F<'a>(&self, gains: impl Iterator<Item = &'a DMatrix<f64>>) -> DMatrix<f64> {
        let mut K = DMatrix::zeros(self.B.ncols(), self.A.nrows());
        for (i, K_i) in gains.enumerate() {
            K.view_mut((self.u[i], self.x[i]), K_i.shape()).copy_from(K_i);
        }
        &self.A + &self.B * K
    }

    /// F = A + BK Schur (the local F_ii are checked where they are made); returns its spectral radius.
    fn assumption_1(&self, network: &Network, gains: &[SubsystemGains]) -> Result<f64, Diagnostic> {
        let F = self.F(gains.iter().map(|g| &g.K));
        let rho = spectral_radius(&F);
        if Contraction::new(&F).is_some() { Ok(rho) } else { Err(assumption_1_fails(network, self, rho)) }
    }

    /// Rank n + p of the matrix in Assumption 2; returns its smallest singular value over its largest.
    fn assumption_2(&self, network: &Network) -> Result<f64, Diagnostic> {
        let (n, m, p) = (self.A.nrows(), self.B.ncols(), self.C.nrows());
        let mut matrix = DMatrix::zeros(n + p, n + m);
        matrix.view_mut((0, 0), (n, n)).copy_from(&(DMatrix::identity(n, n) - &self.A));
        matrix.view_mut((0, n), (n, m)).copy_from(&-&self.B);
        matrix.view_mut((n, 0), (p, n)).copy_from(&self.C);
        equilibrate(&mut matrix);
        let margin = singular_values(&matrix).map_or(0.0, |values| values.min() / values.max());
        if margin > 1e-9 { Ok(margin) } else { Err(assumption_2_fails(network, margin, &lost(&matrix, n))) }
    }

    /// calF_ij = calA_ij + calB_ij calK_j.
    fn calF(&self, network: &Network, calK: &[&DMatrix<f64>]) -> DMatrix<f64> {
        let chi = offsets(network.subsystems.iter().map(|s| s.n() + s.p()));
        let size = self.A.nrows() + self.C.nrows();
        let mut calF = DMatrix::zeros(size, size);
        for (i, s) in network.subsystems.iter().enumerate() {
            let (A, B) = augmented(s);
            let F = A + B * calK[i];
            calF.view_mut((chi[i], chi[i]), F.shape()).copy_from(&F);
            for (&j, L) in &s.L {
                let exporter = &network.subsystems[j];
                let EL = &s.E * L;
                let mut block = DMatrix::zeros(s.n(), exporter.n() + exporter.p());
                block.view_mut((0, 0), (s.n(), exporter.n())).copy_from(&(&EL * &exporter.Cz));
                block += &EL * &exporter.Dz * calK[j];
                calF.view_mut((chi[i], chi[j]), block.shape()).copy_from(&block);
            }
        }
        calF
    }

    fn calG(&self, network: &Network) -> DMatrix<f64> {
        let p = self.C.nrows();
        let mut calG = DMatrix::zeros(self.A.nrows() + p, p);
        let mut row = 0;
        for (i, s) in network.subsystems.iter().enumerate() {
            row += s.n();
            for k in 0..s.p() {
                calG[(row + k, self.y[i] + k)] = 1.0;
            }
            row += s.p();
        }
        calG
    }
}

/// The part that each row from the `first` on has in the combination of rows, of unit length, that comes closest to zero.
fn lost(matrix: &DMatrix<f64>, first: usize) -> Vec<f64> {
    let eigen = SymmetricEigen::new(matrix * matrix.transpose());
    let combination = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    combination.rows(first, matrix.nrows() - first).iter().map(|part| part.abs()).collect()
}

/// Rows, then columns, scaled to unit length: units must not decide about rank.
fn equilibrate(matrix: &mut DMatrix<f64>) {
    for mut row in matrix.row_iter_mut() {
        let norm = row.norm();
        if norm > 0.0 {
            row /= norm;
        }
    }
    for mut column in matrix.column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
        }
    }
}

fn offsets(sizes: impl Iterator<Item = usize>) -> Vec<usize> {
    sizes.scan(0, |next, size| Some(std::mem::replace(next, *next + size))).collect()
}

/// Runs `make` for every subsystem and collects all mistakes before stopping.
fn each<T>(
    subsystems: &[Subsystem],
    make: impl Fn(&Subsystem) -> Result<T, Diagnostics>,
) -> Result<Vec<T>, Diagnostics> {
    let (mut made, mut mistakes) = (Vec::new(), Vec::new());
    for subsystem in subsystems {
        match make(subsystem) {
            Ok(value) => made.push(value),
            Err(Diagnostics(more)) => mistakes.extend(more),
        }
    }
    if mistakes.is_empty() { Ok(made) } else { Err(Diagnostics(mistakes)) }
}

/// The eigenvalue outside the open unit disc that B moves least (Popov-Belevitch-Hautus), with that distance.
fn stuck_mode(A: &DMatrix<f64>, B: &DMatrix<f64>) -> Option<((f64, f64), f64)> {
    let unstable = eigenvalues(A)?.into_iter().filter(|(re, im)| re.hypot(*im) >= 1.0 - 1e-9);
    unstable.map(|e| (e, hautus(A, B, e))).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Smallest singular value of [lambda I - A, B] as a real matrix of twice the size.
fn hautus(A: &DMatrix<f64>, B: &DMatrix<f64>, (re, im): (f64, f64)) -> f64 {
    let (n, m) = B.shape();
    let pencil = DMatrix::from_fn(2 * n, 2 * (n + m), |i, j| {
        let (bi, i) = (i / n, i % n);
        let (bj, j) = (j / (n + m), j % (n + m));
        match (bi == bj, j < n) {
            (true, true) => f64::from(i == j) * re - A[(i, j)],
            (true, false) => B[(i, j - n)],
            (false, true) => f64::from(i == j) * if bi < bj { -im } else { im },
            (false, false) => 0.0,
        }
    });
    singular_values(&pencil).map_or(0.0, |values| values.min())
}

/// What rounding leaves of a zero is one.
fn small(value: f64) -> String {
    if value < 1e-13 { "0".to_owned() } else { format!("{value:.2e}") }
}

fn mode(eigenvalue: (f64, f64)) -> String {
    let (re, im) = eigenvalue;
    if im == 0.0 {
        format!("{re:.6}")
    } else {
        format!("{re:.6} {} {:.6}i", if im < 0.0 { '-' } else { '+' }, im.abs())
    }
}

fn unstabilisable(subsystem: &Subsystem) -> Diagnostic {
    let error = Diagnostic::error(
        code::UNSTABILISABLE,
        format!("subsystem `{}` cannot be stabilised by its own inputs", subsystem.name),
    )
    .at(subsystem.places.or_header(&subsystem.places.B), "these inputs do not reach every unstable mode");
    let error = match stuck_mode(&subsystem.A, &subsystem.B) {
        Some((eigenvalue, distance)) => error.note(format!(
            "the mode of A_ii with eigenvalue {} is out of reach: the smallest singular value of [lambda I - A, B] is {}",
            mode(eigenvalue),
            small(distance)
        )),
        None => error.note("the Riccati equation for K_i has no stabilising solution"),
    };
    error.help("give this subsystem an input that moves the mode, or merge it with the neighbour whose input does; Assumption 1 asks for a stable A_ii + B_ii K_i")
}

fn unstabilisable_reference(subsystem: &Subsystem) -> Diagnostic {
    let (A, B) = augmented(subsystem);
    let error = Diagnostic::error(
        code::NO_INTEGRATION,
        format!("subsystem `{}` cannot integrate the error of its outputs", subsystem.name),
    )
    .at(
        subsystem.places.or_header(&subsystem.places.C),
        "these outputs cannot be held at a set-point by this subsystem's inputs",
    );
    let error = match stuck_mode(&A, &B) {
        Some((eigenvalue, distance)) => error.note(format!(
            "the reference system (7) has the mode {} out of reach: the smallest singular value of [lambda I - calA, calB] is {}",
            mode(eigenvalue),
            small(distance)
        )),
        None => error.note("the Riccati equation for calK_i has no stabilising solution"),
    };
    error.help("pair each output with an input that can hold it (A_ii, B_ii, C_i must have no zero at 1), or move the output to another subsystem; Assumptions 2 and 3 ask for it")
}

fn F_ii_unstable(subsystem: &Subsystem, rho: f64) -> Diagnostic {
    Diagnostic::error(code::LOCAL_LOOP, format!("A_ii + B_ii K_i of subsystem `{}` is not stable", subsystem.name))
        .at(subsystem.places.or_header(&subsystem.places.K), format!("spectral radius {rho:.6}, must be below 1"))
        .note("Assumption 1, part 2: every subsystem has to be stable on its own under u = K x")
        .help(
            "check the sign convention (u = K x, not u = -K x), or leave K out and let the Riccati equation choose it",
        )
}

fn assumption_1_fails(network: &Network, collective: &Collective, rho: f64) -> Diagnostic {
    let error = Diagnostic::error(code::COLLECTIVE_LOOP, "the subsystems destabilise each other: A + BK is not stable");
    let error = coupling_labels(error, network).note(format!(
        "Assumption 1, part 1: the spectral radius of A + B diag(K_1, ..., K_M) is {rho:.6}, must be below 1"
    ));
    let pairs = pairing::wrong_pairs(network, collective);
    let error = pairs.iter().cloned().fold(error, Diagnostic::note);
    error.help(if !pairs.is_empty() {
        PAIR_AGAIN
    } else if network.subsystems.iter().all(|s| s.gains.K.is_some()) {
        "leave some K out and let the compiler choose it, check the signs (u = K x), or merge the subsystems that are coupled most"
    } else {
        "change `gain-weights` (a larger R in a strongly coupled subsystem often helps, or a larger Q), state K, or merge the subsystems that are coupled most"
    })
}

/// Outputs with a smaller part have nothing to do with it.
const INVOLVED: f64 = 1e-3;

const PAIR_AGAIN: &str = "give each output to the subsystem whose input is to hold it: no gains repair wrong pairs";

/// `parts`: what each output has to do with it.
fn assumption_2_fails(network: &Network, margin: f64, parts: &[f64]) -> Diagnostic {
    let mut error =
        Diagnostic::error(code::ASSUMPTION_2, "the outputs cannot be held at arbitrary set-points (Assumption 2)");
    let mut parts = parts.iter();
    for s in &network.subsystems {
        let outputs = s.outputs.iter().zip(parts.by_ref());
        let involved = outputs.filter(|(_, part)| **part > INVOLVED).map(|(output, _)| format!("`{}`", output.name));
        let involved: Vec<String> = involved.collect();
        if !involved.is_empty() {
            error = error
                .at(s.places.or_header(&s.places.C), format!("{} cannot be held at every value", involved.join(", ")));
        }
    }
    if error.labels.is_empty() {
        for s in &network.subsystems {
            error = error.at(s.places.header.clone(), "one of the subsystems");
        }
    }
    error
        .note(format!("[I - A, -B; C, 0] loses rank: its smallest singular value is {margin:.2e} of its largest (rows and columns scaled), more than 1e-9 is needed"))
        .help("track outputs that the inputs can hold at a constant value: no more outputs than inputs, no transmission zero at 1 (an output that is the rate of another state has one)")
}

fn assumption_3_fails(network: &Network, collective: &Collective, gains: &[SubsystemGains], rho: f64) -> Diagnostic {
    let given = network.subsystems.iter().any(|s| s.gains.calK.is_some());
    let mut error =
        Diagnostic::error(code::ASSUMPTION_3, "the reference system is not stable: calF of Assumption 3 is not Schur");
    for (s, g) in network.subsystems.iter().zip(gains) {
        let (A, B) = augmented(s);
        let local = spectral_radius(&(A + B * g.calK()));
        error = error.at(
            s.places.or_header(&s.places.calK),
            format!("alone, calF_ii of `{}` has spectral radius {local:.6}", s.name),
        );
    }
    let error = error.note(format!("together, calF has spectral radius {rho:.6}, must be below 1"));
    let pairs = pairing::wrong_pairs(network, collective);
    let error = pairs.iter().cloned().fold(error, Diagnostic::note);
    error.help(if !pairs.is_empty() {
        PAIR_AGAIN
    } else if given {
        "leave Kx and Ke out and let the Riccati equation choose them, or check their signs: u = Kx x + Ke e with e the integral of (y_ref - y)"
    } else {
        "change `reference-weights` (a smaller Qe integrates more slowly), check that each output is paired with the input that moves it most, or merge subsystems"
    })
}

/// A label on each `from` table, so that the couplings stand in the message.
fn coupling_labels(mut error: Diagnostic, network: &Network) -> Diagnostic {
    for s in &network.subsystems {
        for (&j, place) in &s.places.from {
            error = error.at(place.clone(), format!("`{}` acts on `{}` here", network.subsystems[j].name, s.name));
        }
    }
    if error.labels.is_empty() {
        for s in &network.subsystems {
            error = error.at(s.places.header.clone(), "one of the subsystems");
        }
    }
    error
}
