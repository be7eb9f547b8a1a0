//! What a closed loop has shown, for a terminal.

use std::fmt;

use super::findings::{Findings, Least, NodeFindings};
use super::history::{EventKind, History};
use crate::summary::short;

/// Spells, settling times and limits that are named one by one.
const MOST: usize = 12;

/// Displays as the tables and lists that the command prints.
pub struct Report<'a> {
    pub history: &'a History,
    pub findings: &'a Findings,
}

impl fmt::Display for Report<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { history, findings } = self;
        writeln!(
            f,
            "Scenario `{}` on network `{}`: {} steps of {} s, seed {}",
            history.scenario, history.network, findings.steps, history.sample_time, history.seed
        )?;
        self.counts(f)?;
        self.guarantee(f)?;
        self.troubles(f)?;
        self.margins(f)?;
        self.settlings(f)?;
        self.broken(f)
    }
}

impl Report<'_> {
    fn counts(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let head = [
            "subsystem",
            "at reference",
            "solved",
            "rows active",
            "shifted plan",
            "infeasible",
            "no guarantee",
            "outside limits",
        ];
        let row = |node: &NodeFindings| {
            let counts = [
                node.at_reference,
                node.solved,
                node.active,
                node.fell_back,
                node.infeasible,
                node.unguaranteed,
                node.violations,
            ];
            std::iter::once(node.name.clone()).chain(counts.iter().map(usize::to_string)).collect::<Vec<_>>()
        };
        writeln!(f, "\nSteps")?;
        f.write_str(&table(&head.map(str::to_owned), &self.findings.subsystems.iter().map(row).collect::<Vec<_>>()))
    }

    fn guarantee(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\nGuarantee")?;
        if self.findings.is_guaranteed() {
            return writeln!(f, "  every subsystem says at every step that it holds");
        }
        let spells =
            self.findings.subsystems.iter().flat_map(|node| node.spells.iter().map(move |spell| (node, spell)));
        let lines = spells.map(|(node, spell)| {
            let until = match spell.to {
                Some(to) => format!("until step {to} ({} s)", self.time(to)),
                None => "to the end".to_owned(),
            };
            format!(
                "`{}` loses it at step {} ({} s), {until}: {}",
                node.name,
                spell.from,
                self.time(spell.from),
                spell.why
            )
        });
        listed(f, &lines.collect::<Vec<_>>())
    }

    /// Upsets, messages and what went beyond the design's assumptions.
    fn troubles(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kinds = [EventKind::Upset, EventKind::Message, EventKind::Beyond, EventKind::HeldUp, EventKind::Violated];
        let events = self.history.events.iter().filter(|event| kinds.contains(&event.kind));
        let lines: Vec<String> = events
            .map(|event| {
                let whose =
                    event.subsystem.map_or_else(String::new, |i| format!("`{}`: ", self.history.subsystems[i].name));
                format!("step {} ({} s), {whose}{}", event.step, short(event.time), event.words)
            })
            .collect();
        if lines.is_empty() {
            return Ok(());
        }
        writeln!(f, "\nEvents")?;
        listed(f, &lines)
    }

    fn margins(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\nLeast margins")?;
        let nodes =
            self.findings.subsystems.iter().flat_map(|node| node.least.iter().map(move |least| (&*node.name, least)));
        let all = nodes.chain(self.findings.couplings.iter().map(|least| ("(coupling)", least)));
        // Nearest first, as a share of the limit.
        let mut all: Vec<(&str, &Least)> = all.collect();
        let share = |least: &Least| least.value / least.limit.abs().max(f64::MIN_POSITIVE);
        all.sort_by(|(_, a), (_, b)| share(a).total_cmp(&share(b)));
        let rows: Vec<Vec<String>> = all
            .iter()
            .take(2 * MOST)
            .map(|(name, least)| {
                let unit = least.unit.as_ref().map_or_else(String::new, |unit| format!(" {unit}"));
                let value = format!("{}{unit}", short(least.value));
                vec![(*name).to_owned(), least.row.clone(), value, format!("{} s", self.time(least.step))]
            })
            .collect();
        f.write_str(&table(&["subsystem", "limit", "left", "at"].map(str::to_owned), &rows))?;
        match all.len().checked_sub(2 * MOST) {
            Some(more @ 1..) => writeln!(f, "  and {more} more, which were farther away"),
            _ => Ok(()),
        }
    }

    fn settlings(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = self.findings.subsystems.iter().flat_map(|node| node.settlings.iter().map(move |one| (node, one)));
        let lines: Vec<String> = all
            .map(|(node, one)| {
                let unit = one.unit.as_ref().map_or_else(String::new, |unit| format!(" {unit}"));
                let nearest = if one.target == one.set_point { "" } else { " (nearest in Y)" };
                let after = one.after.map_or_else(
                    || format!("not in time, {}{unit} off at the end", short(one.off)),
                    |after| format!("after {} s", short(after)),
                );
                format!(
                    "`{}`: `{}` to {}{unit}{nearest} at {} s: {after}",
                    node.name,
                    one.output,
                    short(one.target),
                    self.time(one.step)
                )
            })
            .collect();
        if lines.is_empty() {
            return Ok(());
        }
        writeln!(f, "\nSettling times (within 5 % of the change, to stay)")?;
        listed(f, &lines)
    }

    fn broken(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.findings.broken.is_empty() {
            return Ok(());
        }
        writeln!(f, "\nVIOLATED THOUGH GUARANTEED")?;
        let line = |broken: &super::findings::Broken| {
            let whose = broken.subsystem.as_ref().map_or_else(String::new, |name| format!("`{name}`: "));
            format!(
                "step {} ({} s), {whose}`{}` by {}",
                broken.step,
                self.time(broken.step),
                broken.row,
                short(broken.by)
            )
        };
        listed(f, &self.findings.broken.iter().map(line).collect::<Vec<_>>())
    }

    /// s.
    fn time(&self, step: usize) -> String {
        short(step as f64 * self.history.sample_time)
    }
}

fn listed(f: &mut fmt::Formatter<'_>, lines: &[String]) -> fmt::Result {
    lines.iter().take(MOST).try_for_each(|line| writeln!(f, "  {line}"))?;
    match lines.len().checked_sub(MOST) {
        Some(more @ 1..) => writeln!(f, "  and {more} more, in the files"),
        _ => Ok(()),
    }
}

/// Lines of cells under a head, two columns of words flush left, the rest flush right.
fn table(head: &[String], rows: &[Vec<String>]) -> String {
    let length = |text: &str| text.chars().count();
    let width = |column: usize| rows.iter().chain([&head.to_vec()]).map(|row| length(&row[column])).max().unwrap_or(0);
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let is_word = |column: usize| rows.iter().all(|row| row[column].parse::<f64>().is_err());
    let line = |row: &[String]| {
        let cells = row.iter().enumerate().map(|(column, cell)| {
            let gap = " ".repeat(widths[column] - length(cell));
            if is_word(column) { format!("{cell}{gap}") } else { format!("{gap}{cell}") }
        });
        format!("  {}\n", cells.collect::<Vec<_>>().join("  ").trim_end())
    };
    std::iter::once(line(head)).chain(rows.iter().map(|row| line(row))).collect()
}
