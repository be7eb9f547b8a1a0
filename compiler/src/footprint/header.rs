//! The comment in the emitted files.

use super::target::Target;
use super::{Footprint, Workshop, measure};
use crate::design::Design;
use crate::emit::Emitted;

/// What begins the comment, and nothing else in a file's header.
const FIRST: &str = "// Takes, in bytes";

const HEAD: [&str; 8] = ["target", "rustc", "code", "constants", "controller", "inbox", "step", "start"];

/// The controllers of a network on several machines.
#[derive(Debug, Clone)]
pub struct Measured {
    rows: Vec<Row>,
}

#[derive(Debug, Clone)]
struct Row {
    target: String,
    rustc: String,
    footprints: Vec<Footprint>,
}

impl Measured {
    /// On every target; see [`measure`].
    ///
    /// # Errors
    /// As [`measure`].
    pub fn new(design: &Design, emitted: &Emitted, targets: &[Target], workshop: &Workshop) -> Result<Self, String> {
        let row = |target: &Target| {
            let footprints = measure(design, emitted, target, workshop)?;
            Ok(Row { target: target.name()?, rustc: target.version()?.release, footprints })
        };
        Ok(Self { rows: targets.iter().map(row).collect::<Result<_, String>>()? })
    }

    /// Writes the figures into the header of every subsystem's file.
    pub fn note(&self, emitted: &mut Emitted) {
        for (i, (_, text)) in emitted.files.iter_mut().skip(1).enumerate() {
            // The header ends with the first empty line.
            if let Some(end) = text.find("\n\n") {
                text.insert_str(end, &format!("\n//\n{}", self.block(i)));
            }
        }
    }

    fn block(&self, i: usize) -> String {
        let rows = self.rows.iter().filter_map(|row| Some((row, row.footprints.get(i)?)));
        let cells = rows.clone().map(|(row, footprint)| row.cells(footprint));
        let table: Vec<[String; 8]> = std::iter::once(HEAD.map(str::to_owned)).chain(cells).collect();
        let width = |column: usize| table.iter().map(|row| row[column].len()).max().unwrap_or(0);
        let widths: [usize; 8] = std::array::from_fn(width);
        let mut text = format!("{FIRST} (`--measure`; opt-level 3, no link-time optimisation):\n//\n");
        for row in &table {
            let [name, rest @ ..] = row;
            let rest: String = rest.iter().zip(&widths[1..]).map(|(cell, width)| format!("  {cell:>width$}")).collect();
            text += &format!("//     {name:<width$}{rest}\n", width = widths[0]);
        }
        text += "//\n// Code and constants are what a linker keeps of the functions below; step and start are the most stack of\n\
                 // these, their own frames and all they call.";
        for (row, footprint) in rows {
            text += &format!("\n// {}: {}", row.target, needs(footprint));
        }
        text
    }
}

impl Row {
    fn cells(&self, footprint: &Footprint) -> [String; 8] {
        let Footprint { code, constants, controller, inbox, step_stack, start_stack, .. } = footprint;
        let numbers = [code, constants, controller, inbox, step_stack, start_stack].map(u64::to_string);
        let [a, b, c, d, e, f] = numbers;
        [self.target.clone(), self.rustc.clone(), a, b, c, d, e, f]
    }
}

/// `no panic; calls memcpy, memset`
fn needs(footprint: &Footprint) -> String {
    let panics = match footprint.panics.first() {
        None => "no panic".to_owned(),
        Some(name) => format!("may panic ({name})"),
    };
    let calls = match footprint.foreign.as_slice() {
        [] => ", nothing else is needed".to_owned(),
        names => format!("; calls {}, whose stack comes on top", names.join(", ")),
    };
    match footprint.unmeasured.as_slice() {
        [] => panics + &calls,
        names => format!("{panics}{calls}; so does that of {}", names.join(", ")),
    }
}

/// An emitted text without what [`Measured::note`] has written into it.
pub fn without(text: &str) -> String {
    let Some(end) = text.find("\n\n") else { return text.to_owned() };
    let (header, rest) = text.split_at(end);
    let kept = header.split_once(&format!("\n//\n{FIRST}")).map_or(header, |(kept, _)| kept);
    format!("{kept}{rest}")
}

/// What [`Measured::note`] has written into an emitted text, without the comment's slashes.
pub fn noted(text: &str) -> Option<String> {
    let (header, _) = text.split_once("\n\n")?;
    let (_, block) = header.split_once(&format!("\n//\n{FIRST}"))?;
    let lines = block.lines().skip(1).map(|line| line.trim_start_matches("//").trim_end());
    Some(
        lines
            .map(|line| line.strip_prefix(' ').unwrap_or(line))
            .skip_while(|line| line.is_empty())
            .collect::<Vec<_>>()
            .join("\n"),
    )
}
