//! The finished design on one screen.

#![expect(non_snake_case, reason = "the paper's symbols")]

pub mod json;

use std::fmt;

use crate::convex::Polytope;
use crate::design::Design;
use crate::emit::Emitted;
use crate::gains::{Layer, origin};
use crate::network::{HoldError, NamedPolytope, Network, Norm, Scalar, Signal, Subsystem};
use crate::notices::notices;
use crate::problems::DpcProblem;
use crate::sets::{ReferenceShare, SubsystemSets};
use crate::sizing::{EndLimits, Slack, SubsystemSizing, TradePoint, end_limits};
use crate::tuning::{DesignFigures, Figures, Tuning};

/// Margins of Assumptions 1 to 4, sizes of the sets, problems and tables, the smallest slack of every equation, and
/// what a larger reserve would cost. The same design gives the same text; no line is longer than 100 columns.
pub struct Summary<'a> {
    design: &'a Design,
    emitted: &'a Emitted,
}

impl<'a> Summary<'a> {
    /// `emitted` must have been made from `design`.
    pub fn new(design: &'a Design, emitted: &'a Emitted) -> Self {
        Self { design, emitted }
    }
}

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lines = [
            vec![self.title()],
            self.assumptions(),
            self.tuning(),
            self.references(),
            self.arithmetic(),
            self.subsystems(),
            self.coupling(),
            self.slacks(),
            self.trade(),
            self.start(),
            self.notices(),
        ];
        lines.iter().flatten().try_for_each(|line| writeln!(f, "{}", clipped(line)))
    }
}

impl Summary<'_> {
    fn title(&self) -> String {
        let Network { name, subsystems, horizon, sample_time, hold, .. } = &self.design.network;
        format!(
            "{name}: {}, N = {horizon}, one step every {} s{}",
            count(subsystems.len(), "subsystem"),
            short(*sample_time),
            if hold.is_some() { ", sampled from continuous time" } else { "" }
        )
    }

    fn assumptions(&self) -> Vec<String> {
        let Design { gains, sets, .. } = self.design;
        vec![
            String::new(),
            "Assumptions, each with its margin".to_owned(),
            self.origins(),
            below_one("1  spectral radius of A + BK", gains.rho_F),
            self.rank(),
            below_one("3  spectral radius of calF", gains.rho_calF),
            below_one("4  small gain: spectral radius of S", sets.rho_small_gain),
        ]
    }

    fn rank(&self) -> String {
        match self.design.gains.rank_margin {
            Some(margin) => format!("  2  {:<40}{:<10} above 0", "smallest singular value, relative", short(margin)),
            None => "  2  full rank, since calF is stable (not measured: large network)".to_owned(),
        }
    }

    /// Where the gains came from; all subsystems mostly have the same origin.
    fn origins(&self) -> String {
        let of = |layer: Layer| {
            let all = self.design.network.subsystems.iter().map(|s| origin(s, layer));
            let distinct: std::collections::BTreeSet<&str> = all.collect();
            distinct.into_iter().collect::<Vec<_>>().join(" or ")
        };
        format!("  gains: K {}, calK {}", of(Layer::Local), of(Layer::Reference))
    }

    /// What the search for gains has brought, beside the plain design.
    fn tuning(&self) -> Vec<String> {
        let Some(Tuning { effort, compared, plain, tuned }) = &self.design.tuning else { return Vec::new() };
        let design = |figure: fn(&DesignFigures) -> Option<f64>| {
            let of = |figures: &Figures| figures.design.as_ref().ok().and_then(figure);
            (of(plain), of(tuned))
        };
        let mut rows = vec![format!("  {:<41}{:>14}{:>14}", "", "effort 0", format!("effort {}", effort.level()))];
        let mut row = |what: &str, (plain, tuned): (Option<f64>, Option<f64>)| {
            if plain.or(tuned).is_some() {
                let cell = |value: Option<f64>| value.map_or("-".to_owned(), short);
                rows.push(format!("  {what:<41}{:>14}{:>14}", cell(plain), cell(tuned)));
            }
        };
        row("eps", design(|d| Some(d.epsilon)));
        row("eps with this cover, reserve of effort 0", design(|d| d.covered_epsilon));
        row("volume of Y", design(|d| Some(d.y_volume)));
        row("reserve, geometric mean of Delta^z", design(|d| d.reserve));
        row("objective of the sizing", design(|d| Some(d.objective)));
        row("small gain", (plain.rho_small_gain, tuned.rho_small_gain));
        row("spectral radius of A + BK", (Some(plain.rho_F), Some(tuned.rho_F)));
        row("spectral radius of calF", (Some(plain.rho_calF), Some(tuned.rho_calF)));
        rows.extend(plain.design.as_ref().err().map(|why| format!("  without the search: {why}")));
        titled(&format!("Gains were searched for; {} compared", count(*compared, "design")), rows)
    }

    fn start(&self) -> Vec<String> {
        let Some(plan) = &self.design.start else { return Vec::new() };
        let mut lines = vec![String::new(), format!("Start-up plan of {}", count(plan.steps, "step"))];
        for ((s, part), x0) in self.design.network.subsystems.iter().zip(&plan.subsystems).zip(&plan.start.x0) {
            let list = |signals: &[Signal], values: &nalgebra::DVector<f64>| {
                let each =
                    signals.iter().zip(values).map(|(signal, value)| format!("{} {}", signal.name, short(*value)));
                each.collect::<Vec<_>>().join(", ")
            };
            let end = part.x.last().map(|x| &s.C * x).unwrap_or_else(|| nalgebra::DVector::zeros(s.p()));
            lines.push(format!("  {}: {} -> rest at {}", s.name, list(&s.states, x0), list(&s.outputs, &end)));
        }
        lines
    }

    fn references(&self) -> Vec<String> {
        let reference = &self.design.network.reference;
        let origin = if reference.epsilon.is_some() { "given" } else { "chosen" };
        let norm = match reference.norm {
            Norm::One => "1",
            Norm::Two => "2",
            Norm::Inf => "inf",
        };
        let epsilon = short(self.design.sizing.epsilon);
        vec![String::new(), format!("References move by eps = {epsilon} per step at most ({origin}; norm {norm})")]
    }

    /// All, or of a large network those whose set-points use least of their bounds.
    /// What single precision costs.
    fn arithmetic(&self) -> Vec<String> {
        if self.design.network.scalar == Scalar::Double {
            return Vec::new();
        }
        let lost = |share: f64| format!("; it takes {:.1} % of the volume of Y", 100.0 * (1.0 - share));
        let lost = self.design.sizing.share_of_double.map(lost).unwrap_or_default();
        vec![format!("Arithmetic in f32: rounding is charged to every set{lost}")]
    }

    fn subsystems(&self) -> Vec<String> {
        let count = self.design.network.subsystems.len();
        let limits = end_limits(&self.design.network, &self.design.sets, &self.design.sizing);
        if count <= MOST_SHOWN {
            return (0..count).flat_map(|i| self.subsystem(i, &limits[i])).collect();
        }
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&a, &b| self.least_share(a).total_cmp(&self.least_share(b)));
        let others = format!("{} others are in the file that `--design` writes", count - FEW_SHOWN);
        let head = format!("The {FEW_SHOWN} subsystems whose set-points use least of their bounds; the {others}");
        let shown = order[..FEW_SHOWN].iter().flat_map(|&i| self.subsystem(i, &limits[i]));
        [String::new(), head].into_iter().chain(shown).collect()
    }

    /// The smallest width of a set-point range over the natural size of its output.
    fn least_share(&self, i: usize) -> f64 {
        let (Y, natural) = (&self.design.sizing.subsystems[i].Y, &self.design.sets.subsystems[i].scales.y);
        (0..natural.len()).map(|k| (Y.max[k] - Y.min[k]) / natural[k]).fold(f64::INFINITY, f64::min)
    }

    fn subsystem(&self, i: usize, limits: &[EndLimits]) -> Vec<String> {
        let model = &self.design.network.subsystems[i];
        let sizes = &self.design.sizing.subsystems[i];
        let dpc = &self.design.problems.subsystems[i].dpc;
        let mut lines = vec![String::new(), format!("Subsystem {}", model.name)];
        let rho = self.design.gains.subsystems[i].rho_F;
        lines.push(item("local loop", &format!("spectral radius {}, margin {}", short(rho), short(1.0 - rho))));
        let (epsilon, sample_time) = (self.design.sizing.epsilon, self.design.network.sample_time);
        lines.extend(output_ranges(model, sizes, epsilon, sample_time, limits));
        lines.extend(reserves(model, sizes));
        lines.extend(charges(model, sizes, &self.design.sets.subsystems[i], epsilon));
        lines.extend(self.held(i));
        lines.extend(disturbances(model));
        lines.extend(tube_share(model, sizes));
        lines.extend(load_share(model, &self.design.sets.subsystems[i]));
        lines.push(item("facets", &format!("E {}, Sigma {}", sizes.E.facets(), sizes.Sigma.facets())));
        lines.push(item("terminal set", &upsets(model, sizes)));
        lines.push(item("i-DPC problem", &format!("{} unknowns, {}", dpc.H.nrows(), count(dpc.rows.len(), "row"))));
        lines.push(item("", &inequalities(dpc)));
        if let Some(count) = &self.design.problems.subsystems[i].iterations {
            let (origin, why) = count.origin();
            lines.push(item("changes", &format!("limit {}, {origin}", dpc.max_iterations)));
            lines.extend(why.map(|why| item("", &why.to_string())));
        }
        lines.push(item("tables", &format!("{} bytes", self.emitted.table_bytes[i])));
        lines
    }

    /// What holding the coupling over a period leaves out of x+, a few states per line.
    fn held(&self, i: usize) -> Vec<String> {
        let Network { hold: Some(hold), subsystems, .. } = &self.design.network else { return Vec::new() };
        let errors = match &hold.errors {
            Some(errors) => &errors[i],
            None => {
                return vec![item(
                    "coupling held",
                    "no bound of its error: the whole network has no exact discretisation here",
                )];
            }
        };
        let state = |(signal, error): (&Signal, &HoldError)| match error {
            HoldError::Within { below, above } => {
                format!("{} {}{}", signal.name, within(*below, *above), signal.unit_suffix())
            }
            HoldError::Unbounded(_) => format!("{} without bound", signal.name),
        };
        let states: Vec<String> = subsystems[i].states.iter().zip(errors).map(state).collect();
        let end = if hold.charged { " (in w)" } else { "" };
        let mut lines: Vec<String> = states.chunks(STATES_PER_LINE).map(|states| states.join(", ")).collect();
        lines[0].insert_str(0, "x+ off by ");
        lines.last_mut().into_iter().for_each(|line| line.push_str(end));
        let label = |k: usize| if k == 0 { "coupling held" } else { "" };
        lines.iter().enumerate().map(|(k, line)| item(label(k), line)).collect()
    }

    fn coupling(&self) -> Vec<String> {
        let Design { network, sizing, .. } = self.design;
        let rows = network.coupling_constraints.iter().zip(&sizing.l_tilde);
        let rows =
            rows.map(|(row, &l_tilde)| item(&row.name, &format!("{}, references {}", short(row.l), short(l_tilde))));
        let fixed = titled("Coupling constraints: limit, and what is left of it for the references", rows.collect());
        fixed.into_iter().chain(self.changing()).collect()
    }

    fn changing(&self) -> Vec<String> {
        let Network { changing_constraints, subsystems, .. } = &self.design.network;
        let rows = changing_constraints.iter().map(|row| {
            let members: Vec<&str> = row.members.iter().map(|&j| &*subsystems[j].name).collect();
            format!("  {}: between {}", row.name, members.join(", "))
        });
        let more = changing_constraints.len().checked_sub(MOST_SHOWN).filter(|more| *more > 0);
        let more = more.map(|more| format!("  and {more} more"));
        titled("Constraints whose rows change while running", rows.take(MOST_SHOWN).chain(more).collect())
    }

    /// One per equation.
    fn smallest_slacks(&self) -> Vec<&Slack> {
        let mut smallest: Vec<&Slack> = Vec::new();
        for slack in &self.design.sizing.slacks {
            match smallest.iter_mut().find(|known| known.equation == slack.equation) {
                Some(known) if slack.value < known.value => *known = slack,
                Some(_) => {}
                None => smallest.push(slack),
            }
        }
        smallest
    }

    fn slacks(&self) -> Vec<String> {
        let smallest = self.smallest_slacks();
        let rows =
            smallest.iter().map(|slack| format!("  {:<7}{:<11}{}", slack.equation, short(slack.value), slack.what));
        titled("Smallest slack of every inclusion, after rounding", rows.collect())
    }

    fn notices(&self) -> Vec<String> {
        let all = notices(self.design);
        let more = all.len().checked_sub(MOST_SHOWN).filter(|more| *more > 0);
        let more = more.map(|more| format!("and {more} more of this kind"));
        let notices = all.into_iter().take(MOST_SHOWN).chain(more).flat_map(|notice| wrapped(&notice, 96));
        titled("Worth a second look", notices.collect())
    }

    fn trade(&self) -> Vec<String> {
        let mut rows = vec![format!("  {:>9}{:>16}{:>12}", "reserve", "volume of Y", "eps")];
        rows.extend(self.design.sizing.trade.iter().map(trade_row));
        if self.design.sizing.trade.is_empty() {
            rows.clear();
        }
        titled("What reserve against upsets costs (relative to this design, marked >)", rows)
    }
}

/// Subsystems, or notices, that are all shown.
const MOST_SHOWN: usize = 20;
/// Subsystems that stand for more than that.
const FEW_SHOWN: usize = 5;

fn below_one(what: &str, value: f64) -> String {
    format!("  {what:<43}{:<10} margin {}", short(value), short(1.0 - value))
}

/// Y_i in the user's outputs, how long a reference takes from one end to the other, and what limits each end.
fn output_ranges(
    model: &Subsystem,
    sizes: &SubsystemSizing,
    epsilon: f64,
    sample_time: f64,
    limits: &[EndLimits],
) -> Vec<String> {
    let time = |width: f64| short((width / epsilon).ceil() * sample_time);
    let of = |(k, signal): (usize, &Signal)| {
        let (min, max) = (sizes.Y.min[k], sizes.Y.max[k]);
        let crossed = format!("{}, crossed in {} s", range(signal, min, max), time(max - min));
        let limited = format!("below by {}, above by {}", limits[k].low.row, limits[k].high.row);
        [item("set-points", &crossed), item("limited", &limited)]
    };
    model.outputs.iter().enumerate().flat_map(of).collect()
}

fn range(signal: &Signal, min: f64, max: f64) -> String {
    format!("{} from {} to {} {}", signal.name, short(min), short(max), unit(signal)).trim_end().to_owned()
}

fn reserves(model: &Subsystem, sizes: &SubsystemSizing) -> Vec<String> {
    let widths = model.coupling_outputs.iter().zip(sizes.dz.iter().zip(&sizes.zeta));
    widths
        .map(|(name, (dz, zeta))| item("reserve", &format!("{} of {} in z = {name}", short(*dz), short(*zeta))))
        .collect()
}

/// What (26) takes of rows that read one output, where rows are drawn later.
fn charges(model: &Subsystem, sizes: &SubsystemSizing, sets: &SubsystemSets, epsilon: f64) -> Vec<String> {
    let Some(exposed) = &model.exposed else { return Vec::new() };
    let taken = sizes.exposed.half_widths(model.p());
    let charge = |k: usize| {
        let (output, share) = (&model.outputs[k], &sets.outputs.axes[k]);
        let unit = output.unit_suffix();
        let most = exposed.margin.as_ref().map_or(String::new(), |margin| format!(" of {}", short(margin.value)));
        let moving = share.taken(epsilon);
        format!(
            "{}{most}{unit} of {}; references alone {} = {} eps",
            short(taken[k]),
            output.name,
            short(moving),
            short(moving / epsilon)
        )
    };
    (0..model.p()).map(|k| item("margin", &charge(k))).collect()
}

/// How many of the inequalities the controller has to look at.
fn inequalities(dpc: &DpcProblem) -> String {
    if dpc.pruned {
        format!("{} of {} inequalities can become active", dpc.facets_after, dpc.facets_before)
    } else {
        format!("{} inequalities, too many to look for those that never become active", dpc.facets_before)
    }
}

/// What the file says acts on the subsystem.
fn disturbances(model: &Subsystem) -> Option<String> {
    let loads = (!model.loads.is_empty()).then(|| count(model.loads.len(), "measured load"));
    let parts = [
        model.w.as_ref().map(|_| "unknown disturbances w".to_owned()),
        (model.measurement_error.amax() > 0.0).then(|| "measurement errors".to_owned()),
        loads,
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| item("acted on by", &parts.join(", ")))
}

/// The limit of which E_i, with measurement errors, takes the largest share.
fn tube_share(model: &Subsystem, sizes: &SubsystemSizing) -> Option<String> {
    let of = |whole: &NamedPolytope, nominal: &Polytope| {
        let taken = |r: usize| (1.0 - nominal.h[r] / whole.h[r], whole.rows[r].clone());
        (0..whole.h.len()).map(taken).collect::<Vec<_>>()
    };
    largest("tube", [of(&model.X, &sizes.X_nom), of(&model.U, &sizes.U_nom)].concat())
}

/// The limit of which references that follow the loads take the largest share.
fn load_share(model: &Subsystem, sets: &SubsystemSets) -> Option<String> {
    let of = |whole: &NamedPolytope, shares: &[ReferenceShare]| {
        let taken = |r: usize| (shares[r].load / whole.h[r], whole.rows[r].clone());
        (0..whole.h.len()).map(taken).collect::<Vec<_>>()
    };
    largest("loads", [of(&model.X, &sets.x_rows), of(&model.U, &sets.u_rows)].concat())
        .filter(|_| !model.loads.is_empty())
}

fn largest(what: &str, shares: Vec<(f64, String)>) -> Option<String> {
    let (share, row) = shares.into_iter().max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    let verb = if what.ends_with('s') { "take" } else { "takes" };
    Some(item(what, &format!("{verb} at most {} % of a limit: {row}", short(100.0 * share))))
}

/// `0.1`, where as much is possible to both sides up to the digits shown, `-0.1 to 0.2` else.
fn within(below: f64, above: f64) -> String {
    match short(below) == short(above) {
        true => short(above),
        false => format!("{} to {}", short(-below), short(above)),
    }
}

/// Half-axes of Sigma_i.
fn upsets(model: &Subsystem, sizes: &SubsystemSizing) -> String {
    let axes = model.states.iter().zip(&sizes.upset);
    let axes =
        axes.map(|(signal, upset)| format!("{} {} {}", signal.name, short(*upset), unit(signal)).trim_end().to_owned());
    format!("reaches {} off the reference", axes.collect::<Vec<_>>().join(", "))
}

fn unit(signal: &Signal) -> &str {
    signal.unit.as_deref().unwrap_or_default()
}

fn trade_row(point: &TradePoint) -> String {
    let mark = if point.reserve == 1.0 { ">" } else { " " };
    let (volume, epsilon) = match point.y_volume {
        Some(volume) => (short(volume), short(point.epsilon)),
        None => ("no design".to_owned(), "-".to_owned()),
    };
    format!("{mark} {:>9}{volume:>16}{epsilon:>12}", short(point.reserve))
}

/// States whose hold errors stand on one line.
const STATES_PER_LINE: usize = 3;

fn item(what: &str, value: &str) -> String {
    format!("  {what:<16}{value}")
}

fn titled(title: &str, rows: Vec<String>) -> Vec<String> {
    if rows.is_empty() { rows } else { [String::new(), title.to_owned()].into_iter().chain(rows).collect() }
}

fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// Four significant digits.
pub fn short(number: f64) -> String {
    let rounded = format!("{number:.3e}").parse().unwrap_or(number);
    let plain = rounded == 0.0 || (1e-3..1e6).contains(&f64::abs(rounded));
    if plain { format!("{rounded}") } else { format!("{rounded:e}") }
}

/// Lines of at most `columns` characters behind a dash or two spaces.
fn wrapped(text: &str, columns: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec!["  -".to_owned()];
    for word in text.split(' ') {
        let last = lines.len() - 1;
        if lines[last].chars().count() + 1 + word.chars().count() > columns {
            lines.push(format!("    {word}"));
        } else {
            lines[last] = format!("{} {word}", lines[last]);
        }
    }
    lines
}

/// The user's names can be of any length.
fn clipped(line: &str) -> String {
    const COLUMNS: usize = 100;
    match line.char_indices().nth(COLUMNS) {
        None => line.to_owned(),
        Some(_) => line.chars().take(COLUMNS - 3).chain("...".chars()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits() {
        assert_eq!(
            [0.0, 2.49444, -12.4, 1.23456e-9, 0.99999, 41.2567].map(short),
            ["0", "2.494", "-12.4", "1.235e-9", "1", "41.26"]
        );
    }
}
