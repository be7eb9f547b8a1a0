//! Why the program has no point: which wish is too large, and how large it may be.

use nalgebra::DVector;

use super::program::{Asks, Goal, Program};
use super::settle::tubes;
use super::{Context, Proofs, ROUNDS};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::network::{Margin, NamedPolytope, Signal, Subsystem};
use crate::optim::conic::Answer;
use crate::optim::rounding::{down_to_digits, up_to_digits};
use crate::sets::SubsystemSets;

/// Emptied rows that one message names.
const MOST_EMPTIED: usize = 3;

/// Drops the wishes one after the other and says which one was too much, with the largest value that is not.
pub fn no_point(context: &Context, proofs: Vec<Proofs>, answer: Answer) -> Diagnostics {
    if context.network.is_disturbed()
        && let Some(limit) = Limit::of(context, &proofs, Goal::Disturbance)
        && limit.value < 1.0 - 1e-6
    {
        return disturbance_too_large(context, proofs, &limit).into();
    }
    let given = context.network.reference.epsilon;
    if let Some(epsilon) = given
        && let Some(limit) = Limit::of(context, &proofs, Goal::Epsilon)
        && limit.value < epsilon * (1.0 + 1e-6)
    {
        return epsilon_too_large(context, epsilon, &limit).into();
    }
    if context.network.has_margins()
        && let Some(limit) = Limit::of(context, &proofs, Goal::Margin)
        && limit.value < 1.0 - 1e-6
    {
        return margin_too_small(context, &limit).into();
    }
    if let Some(limit) = Limit::of(context, &proofs, Goal::Reserve).filter(|limit| limit.value < 1.0 - 1e-6) {
        return reserve_too_large(context, &limit).into();
    }
    if let Some(limit) = Limit::of(context, &proofs, Goal::Cover).filter(|limit| limit.value < 1.0 - 1e-6) {
        return cover_too_large(context, &limit).into();
    }
    not_solved(context, &answer).into()
}

/// The normals were chosen so that every needed direction has a multiplier: only conditioning can take it away.
pub fn no_proof(context: &Context, i: usize) -> Diagnostic {
    let s = &context.network.subsystems[i];
    Diagnostic::error(code::NOT_SIZED, format!("the sets of subsystem `{}` are too badly scaled to be sized", s.name))
        .at(s.places.header.clone(), "no multiplier reaches working accuracy")
        .note("a row of x, of u through K, or of the coupling outputs has no accurate bound on the chosen normals")
        .help("scale the units of states and inputs so that their ranges lie between 0.01 and 100")
}

/// The largest value of a goal, and the rows that stop it.
struct Limit {
    value: f64,
    /// (subsystem, row) pairs without slack.
    tight: Vec<(usize, String)>,
}

impl Limit {
    /// The best of a few rounds, each with the multipliers of the one before.
    fn of(context: &Context, proofs: &[Proofs], goal: Goal) -> Option<Self> {
        let mut best: Option<Self> = None;
        let mut proofs = proofs.to_vec();
        for _ in 0..ROUNDS {
            let program = Program::new(context, proofs, &Asks { goal, ..Asks::default() });
            let Answer::Point(point) = program.solve() else { break };
            let value = program.factor(&point).unwrap_or_else(|| program.epsilon(&point));
            if best.as_ref().is_none_or(|best| value > best.value) {
                let tight = program.rows.iter().filter(|(_, _, row)| program.left(*row, &point) < 1e-6);
                best = Some(Self { value, tight: tight.map(|(i, name, _)| (*i, name.clone())).collect() });
            }
            match context.better_proofs(&program, &point) {
                Some(better) => proofs = better,
                None => break,
            }
        }
        best
    }

    fn rows(&self, context: &Context) -> String {
        let names: Vec<String> = self
            .tight
            .iter()
            .map(|(i, name)| format!("`{name}` of `{}`", context.network.subsystems[*i].name))
            .collect();
        if names.is_empty() { "the coupling between the subsystems".to_owned() } else { names.join(", ") }
    }
}

/// Names rows that the tubes alone leave nothing of, with the smallest Z_i for which they close.
fn disturbance_too_large(context: &Context, proofs: Vec<Proofs>, limit: &Limit) -> Diagnostic {
    let program = Program::new(context, proofs, &Asks::default());
    let mut error =
        Diagnostic::error(code::DISTURBANCE_TOO_LARGE, "what acts on the states leaves no set-point at all");
    let share = format!("{:.1} % of this, and of all the others, is possible", 100.0 * limit.value);
    for s in &context.network.subsystems {
        for place in [&s.places.w, &s.places.measurement_error, &s.places.loads].into_iter().flatten() {
            error = error.at(place.clone(), share.clone());
        }
    }
    error = error.note(format!(
        "all of them together, the largest share with any set-point is {:.4} with these gains; what stops it: {}",
        limit.value,
        limit.rows(context)
    ));
    let no_reserve: Vec<_> = context.network.subsystems.iter().map(|s| DVector::zeros(s.nz())).collect();
    let tubes = tubes(context, &program, &no_reserve).into_iter().flatten().enumerate();
    let emptied = tubes.flat_map(|(i, (q, _))| emptied_by_tube(context, &program, i, &q)).collect();
    worst(emptied).into_iter().fold(error, Diagnostic::note).help("state smaller bounds, widen the limit that stops them, or choose gains that reject what acts on its states (a larger Q or a smaller R in `gain-weights`)")
}

/// A row of X_i or U_i that nothing is left of.
struct Emptied<'a> {
    subsystem: &'a Subsystem,
    set: &'a NamedPolytope,
    row: usize,
    /// How much of its room is taken; 1 or more.
    share: f64,
    how: String,
}

impl<'a> Emptied<'a> {
    /// `None` where `taken` leaves some of the room; `how` says what takes it, given the unit of the row.
    fn by(
        subsystem: &'a Subsystem,
        (set, signals): (&'a NamedPolytope, &[Signal]),
        row: usize,
        taken: f64,
        how: impl FnOnce(&str) -> String,
    ) -> Option<Self> {
        let room = set.h[row];
        let unit = unit(set, row, signals);
        let how = || format!("its room is {room:.4}{unit}, {}", how(&unit));
        (taken >= room).then(|| Self { subsystem, set, row, share: taken / room, how: how() })
    }

    fn is_opposite(&self, other: &Self) -> bool {
        std::ptr::eq(self.set, other.set) && self.set.H.row(self.row) == -other.set.H.row(other.row)
    }

    fn line(&self) -> String {
        format!("`{}` of `{}` is emptied: {}", self.set.rows[self.row], self.subsystem.name, self.how)
    }
}

/// ` cm` for a bound of one signal, as in the name of its row; nothing for a combination.
fn unit(set: &NamedPolytope, row: usize, signals: &[Signal]) -> String {
    let normal = set.H.row(row);
    let mut concerned = signals.iter().zip(&normal).filter(|(_, c)| **c != 0.0);
    match (concerned.next(), concerned.next()) {
        (Some((signal, c)), None) if c.abs() == 1.0 => signal.unit_suffix(),
        _ => String::new(),
    }
}

/// The rows that lose the largest share of their room, the worst first; of two opposite bounds the worse.
fn worst(mut emptied: Vec<Emptied<'_>>) -> Vec<String> {
    emptied.sort_by(|a, b| b.share.total_cmp(&a.share));
    let worse = |(k, row): &(usize, &Emptied<'_>)| !emptied[..*k].iter().any(|before| row.is_opposite(before));
    let lines: Vec<_> = emptied.iter().enumerate().filter(worse).map(|(_, row)| row.line()).collect();
    let more = lines.len().checked_sub(MOST_EMPTIED).filter(|more| *more > 0);
    lines.into_iter().take(MOST_EMPTIED).chain(more.map(|more| format!("... and {more} more"))).collect()
}

/// The rows of X_i and U_i that E_i with offsets q, the measurement error and the loads take as a whole.
fn emptied_by_tube<'a>(context: &Context<'a>, program: &Program, i: usize, q: &DVector<f64>) -> Vec<Emptied<'a>> {
    let (s, proofs, sets) = (&context.network.subsystems[i], &program.proofs[i], &context.sets.subsystems[i]);
    let noise = context.noise(i);
    let of_x = (0..s.X.h.len()).map(|r| (over_x(s), r, proofs.tube_x[r].on(q), noise.x[r], sets.x_rows[r].load));
    let of_u = (0..s.U.h.len()).map(|r| (over_u(s), r, proofs.tube_u[r].on(q), noise.u[r], sets.u_rows[r].load));
    let of = |(set, row, tube, noise, load)| {
        Emptied::by(s, set, row, tube + noise + load, |unit| taken_by_tube(tube, noise, load, unit))
    };
    of_x.chain(of_u).filter_map(of).collect()
}

fn taken_by_tube(tube: f64, noise: f64, load: f64, unit: &str) -> String {
    let takes = if noise > 0.0 { "the tube E and K times measurement errors take" } else { "the tube E takes" };
    let loads = if load > 0.0 { format!(", the references need {load:.4}{unit} for the loads") } else { String::new() };
    format!("{takes} {:.4}{unit} of it{loads}", tube + noise)
}

fn over_x(s: &Subsystem) -> (&NamedPolytope, &[Signal]) {
    (&s.X, &s.states)
}

fn over_u(s: &Subsystem) -> (&NamedPolytope, &[Signal]) {
    (&s.U, &s.inputs)
}

/// The epsilon the message suggests: a little inside the limit, two digits.
fn inside(value: f64) -> f64 {
    down_to_digits(0.95 * value, 2)
}

fn epsilon_too_large(context: &Context, epsilon: f64, limit: &Limit) -> Diagnostic {
    let place = context.network.places.epsilon.clone().unwrap_or_default();
    let error = Diagnostic::error(code::EPSILON, format!("epsilon = {epsilon} leaves no set-point at all"))
        .at(place, "references may move this far in one step, in every direction, for ever")
        .note(format!(
            "the largest epsilon with any set-point is {:.4}; what stops it: {}",
            limit.value,
            limit.rows(context)
        ));
    let subsystems = 0..context.network.subsystems.len();
    let emptied = subsystems.flat_map(|i| emptied_by_references(context, i, epsilon)).collect();
    worst(emptied)
        .into_iter()
        .fold(error, Diagnostic::note)
        .help(format!("choose epsilon = {} or less, or leave it out and let the compiler choose", inside(limit.value)))
}

/// The rows of X_i and U_i that references take as a whole that move by epsilon per step.
fn emptied_by_references<'a>(context: &Context<'a>, i: usize, epsilon: f64) -> Vec<Emptied<'a>> {
    let (s, sets) = (&context.network.subsystems[i], &context.sets.subsystems[i]);
    let of_x = sets.x_rows.iter().enumerate().map(|(row, share)| (over_x(s), row, epsilon * share.rate));
    let of_u = sets.u_rows.iter().enumerate().map(|(row, share)| (over_u(s), row, epsilon * share.rate));
    let how = |taken: f64, unit: &str| format!("moving references take {taken:.4}{unit} of it (Delta^chi in (25b))");
    let of = |(set, row, taken)| Emptied::by(s, set, row, taken, |unit| how(taken, unit));
    of_x.chain(of_u).filter_map(of).collect()
}

/// What is recommended is this much more than what is just possible, which rounding might not survive.
const SAFE: f64 = 1.01;

/// Names what moving references alone take of the outputs that exceed their margin, or come closest to it.
fn margin_too_small(context: &Context, limit: &Limit) -> Diagnostic {
    let mut error = Diagnostic::error(code::MARGIN_TOO_SMALL, "the margins of the changing constraints are too small");
    let mut places: Vec<&Margin> = context.network.subsystems.iter().filter_map(Subsystem::margin).collect();
    places.sort_by_key(|margin| margin.place.start);
    places.dedup_by_key(|margin| margin.place.start);
    let needed = |margin: &Margin| up_to_digits((2.0 - limit.value) * margin.value * SAFE, 3);
    for margin in places {
        error = error.at(margin.place.clone(), format!("{} would do, all of them together", needed(margin)));
    }
    error = error.note(format!("what stops smaller ones: {}", limit.rows(context)));
    let taken = most_exposed(context);
    taken.into_iter().take(MOST_EMPTIED).fold(error, Diagnostic::note).help(
        "state larger margins, a smaller epsilon or reserve, or choose reference gains whose outputs stay closer to yref (see `reference-weights`)",
    )
}

/// `px` of `robot1`: what is taken of its margin, the largest share first.
fn most_exposed(context: &Context) -> Vec<String> {
    let Some(epsilon) = context.network.reference.epsilon else { return Vec::new() };
    let of = |(s, sets): (&Subsystem, &SubsystemSets)| -> Vec<(f64, String)> {
        let Some(margin) = s.margin() else { return Vec::new() };
        let taken = s.outputs.iter().zip(&sets.outputs.axes).map(|(output, share)| {
            let (moving, unit) = (share.taken(epsilon), output.unit_suffix());
            let words = format!(
                "moving references take {moving:.4}{unit} of {} of `{}` ({:.3} times epsilon), of a margin of {}{unit}",
                output.name, s.name, share.rate, margin.value
            );
            (moving / margin.value, words)
        });
        taken.collect()
    };
    let mut all: Vec<_> = context.network.subsystems.iter().zip(&context.sets.subsystems).flat_map(of).collect();
    all.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    all.into_iter().map(|(_, words)| words).collect()
}

fn reserve_too_large(context: &Context, limit: &Limit) -> Diagnostic {
    let mut error = Diagnostic::error(code::RESERVE_TOO_LARGE, "the reserve is larger than the constraints allow");
    for s in context.network.subsystems.iter().filter(|s| s.reserve.iter().any(|r| *r > 0.0)) {
        error = error.at(s.places.or_header(&s.places.reserve), "wanted half-width of Delta^z");
    }
    error
        .note(format!("{:.1} % of it is possible; what stops it: {}", 100.0 * limit.value, limit.rows(context)))
        .help("ask for less reserve, a smaller epsilon, or choose gains that reject disturbances faster")
}

fn cover_too_large(context: &Context, limit: &Limit) -> Diagnostic {
    let mut error = Diagnostic::error(code::COVER_TOO_LARGE, "the set-points to cover cannot all be held");
    for s in context.network.subsystems.iter().filter(|s| s.cover.iter().any(Option::is_some)) {
        let label = format!("{:.1} % of this is possible: {}", 100.0 * limit.value, share_of_cover(s, limit.value));
        error = error.at(s.places.or_header(&s.places.cover), label);
    }
    error
        .note(format!(
            "all ranges together, the largest common share is {:.4}; what stops it: {}",
            limit.value,
            limit.rows(context)
        ))
        .help("cover less, choose a smaller epsilon or reserve, or widen the bound that stops it")
}

/// `h1 from -0.9 to 2.2 cm`: this share of what is to be covered, rounded to the inside.
fn share_of_cover(s: &Subsystem, share: f64) -> String {
    let end = |value: f64| value.signum() * down_to_digits(share * value.abs(), 3) + 0.0;
    let ranges = s.outputs.iter().zip(&s.cover).filter_map(|(output, cover)| {
        let (low, high) = (*cover)?;
        Some(format!("{} from {} to {}{}", output.name, end(low), end(high), output.unit_suffix()))
    });
    ranges.collect::<Vec<_>>().join(", ")
}

fn not_solved(context: &Context, answer: &Answer) -> Diagnostic {
    let what = match answer {
        Answer::Infeasible => "no point satisfies (18)-(26), though each wish alone can be met".to_owned(),
        Answer::Unbounded => "nothing bounds the sets".to_owned(),
        Answer::Failed(status) => format!("the solver stopped with {status}"),
        Answer::Point(_) => "the point was lost".to_owned(),
    };
    let places: Vec<Place> = match &context.network.places.sizing {
        Some(place) => vec![place.clone()],
        None => context.network.subsystems.iter().map(|s| s.places.header.clone()).collect(),
    };
    let error = Diagnostic::error(code::NOT_SIZED, "the sizes of the sets could not be chosen");
    places
        .into_iter()
        .fold(error, |error, place| error.at(place, "sized here"))
        .note(what)
        .help("scale the units so that bounds lie between 0.01 and 100, bound states and inputs that are free, or reduce reserve, cover and epsilon together")
}
