//! The finished design on one screen.

use std::fmt;

use crate::design::Design;
use crate::emit::Emitted;
use crate::gains::{Layer, origin};
use crate::network::{Network, Norm, Signal, Subsystem};
use crate::notices::notices;
use crate::sizing::{Slack, SubsystemSizing, TradePoint};
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
            (0..self.design.network.subsystems.len()).flat_map(|i| self.subsystem(i)).collect(),
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
        let Network { name, subsystems, horizon, sample_time, .. } = &self.design.network;
        format!(
            "{name}: {}, N = {horizon}, one step every {} s",
            count(subsystems.len(), "subsystem"),
            short(*sample_time)
        )
    }

    fn assumptions(&self) -> Vec<String> {
        let Design { gains, sets, .. } = self.design;
        vec![
            String::new(),
            "Assumptions, each with its margin".to_owned(),
            self.origins(),
            below_one("1  spectral radius of A + BK", gains.rho_F),
            format!("  2  {:<40}{:<10} above 0", "smallest singular value, relative", short(gains.rank_margin)),
            below_one("3  spectral radius of calF", gains.rho_calF),
            below_one("4  small gain: spectral radius of S", sets.rho_small_gain),
        ]
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

    fn subsystem(&self, i: usize) -> Vec<String> {
        let model = &self.design.network.subsystems[i];
        let sizes = &self.design.sizing.subsystems[i];
        let dpc = &self.design.problems.subsystems[i].dpc;
        let mut lines = vec![String::new(), format!("Subsystem {}", model.name)];
        let rho = self.design.gains.subsystems[i].rho_F;
        lines.push(item("local loop", &format!("spectral radius {}, margin {}", short(rho), short(1.0 - rho))));
        let (epsilon, sample_time) = (self.design.sizing.epsilon, self.design.network.sample_time);
        lines.extend(output_ranges(model, sizes, epsilon, sample_time));
        lines.extend(reserves(model, sizes));
        lines.push(item("facets", &format!("E {}, Sigma {}", sizes.E.facets(), sizes.Sigma.facets())));
        lines.push(item("terminal set", &upsets(model, sizes)));
        lines.push(item("i-DPC problem", &format!("{} unknowns, {}", dpc.H.nrows(), count(dpc.rows.len(), "row"))));
        lines.push(item("", &format!("{} of {} inequalities can become active", dpc.facets_after, dpc.facets_before)));
        lines.push(item("tables", &format!("{} bytes", self.emitted.table_bytes[i])));
        lines
    }

    fn coupling(&self) -> Vec<String> {
        let Design { network, sizing, .. } = self.design;
        let rows = network.coupling_constraints.iter().zip(&sizing.l_tilde);
        let rows =
            rows.map(|(row, &l_tilde)| item(&row.name, &format!("{}, references {}", short(row.l), short(l_tilde))));
        titled("Coupling constraints: limit, and what is left of it for the references", rows.collect())
    }

    fn slacks(&self) -> Vec<String> {
        let mut smallest: Vec<&Slack> = Vec::new();
        for slack in &self.design.sizing.slacks {
            match smallest.iter_mut().find(|known| known.equation == slack.equation) {
                Some(known) if slack.value < known.value => *known = slack,
                Some(_) => {}
                None => smallest.push(slack),
            }
        }
        let rows =
            smallest.iter().map(|slack| format!("  {:<7}{:<11}{}", slack.equation, short(slack.value), slack.what));
        titled("Smallest slack of every inclusion, after rounding", rows.collect())
    }

    fn notices(&self) -> Vec<String> {
        let notices = notices(self.design).into_iter().flat_map(|notice| wrapped(&notice, 96));
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

fn below_one(what: &str, value: f64) -> String {
    format!("  {what:<43}{:<10} margin {}", short(value), short(1.0 - value))
}

/// Y_i in the user's outputs, and how long a reference takes from one end to the other.
fn output_ranges(model: &Subsystem, sizes: &SubsystemSizing, epsilon: f64, sample_time: f64) -> Vec<String> {
    let ranges = model.outputs.iter().zip(sizes.Y.min.iter().zip(&sizes.Y.max));
    let time = |width: f64| short((width / epsilon).ceil() * sample_time);
    ranges
        .map(|(signal, (min, max))| {
            item("set-points", &format!("{}, crossed in {} s", range(signal, *min, *max), time(max - min)))
        })
        .collect()
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
