//! A scenario as written: what is asked of a network in closed loop, and what acts on it.

use toml::de::{DeTable, DeValue};

use super::files::Files;
use super::table::{Table, Value};
use super::value::{all, finite, integer, interval, list, row, text, title};
use super::{At, Row, first_line, syntax};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, Source, code};

/// The file of a scenario. Keys at the top of the file, above all tables.
///
/// After this point: as after [`Spec`](super::Spec), whose comment also says how the manual's page about this file is made of the
/// comments here. A line `Only in:` names the one table that has a key, of several with the same struct; `Or only:` the key
/// whose value may stand in place of the table.
#[derive(Debug, Clone, Default)]
pub struct Scenario {
    /// Name of the scenario: of the folder that is written, and in tables and pictures.
    ///
    /// Default: the name of the file
    /// Example: `name = "night"`
    pub name: Option<At<String>>,
    /// How long it lasts, in s, rounded to sampling periods, of which there are at most a million.
    ///
    /// Default: 500 periods
    /// Example: `duration = 86400.0`
    pub duration: Option<At<f64>>,
    /// The same in sampling periods, instead of `duration`.
    ///
    /// Example: `steps = 600`
    pub steps: Option<At<i64>>,
    /// What random numbers start from, not negative: the same seed gives the same numbers on every machine. `--seed` replaces it.
    ///
    /// Default: `0`
    pub seed: Option<At<i64>>,
    /// A file like the network's with other numbers: the true plant that the controllers run on. Subsystems, signals and sample
    /// time are those of the network. It is looked for beside the scenario.
    ///
    /// Default: the network itself
    /// Example: `plant = "warmer.toml"`
    pub plant: Option<At<String>>,
    /// One table per subsystem that is not left at rest.
    ///
    /// Key: `subsystem`
    pub subsystems: Vec<Acting>,
    /// Key: `upset`
    pub upsets: Vec<Upset>,
    /// Messages that do not arrive.
    pub lost: Vec<Trouble>,
    /// Messages that arrive too late.
    pub late: Vec<Trouble>,
    /// Key: `rule`
    pub rules: Vec<Rule>,
    /// Not a key: where to point when something is missing in the file as a whole.
    pub place: Place,
}

/// What acts on a subsystem, and what is asked of it. Left out: nothing acts on it, and its set-points are 0.
#[derive(Debug, Clone)]
pub struct Acting {
    /// Not a key: the NAME in `[subsystem.NAME]`, with its place.
    pub name: At<String>,
    pub start: Option<Start>,
    /// What outputs are to follow, by output. Set-points outside of Y are followed to the nearest point of Y.
    ///
    /// Key: `set-point`
    /// Default: zero
    /// Example: `set-point = { h1 = 1.0 }`
    pub set_points: Vec<(At<String>, Course)>,
    /// What is measured and disturbs, by load. The guarantee holds while loads keep to `d` and `d-rate` of the network's file.
    ///
    /// Default: zero
    pub loads: Vec<(At<String>, Course)>,
    /// What is added to the state at every step.
    pub disturbance: Option<Nuisance>,
    /// Measured minus true state, at every step.
    pub measurement_error: Option<Nuisance>,
}

/// Where a subsystem starts: with references at rest at `outputs` and the state off that by `deviation`; or from `x0` by a start-up
/// plan, which is then made for the whole network. The two do not go together. Without this table: at rest at 0, or where the network's
/// file has a start.
#[derive(Debug, Clone)]
pub struct Start {
    /// Not a key: its place.
    pub place: Place,
    /// The outputs that references rest at, inside Y.
    ///
    /// Default: zero
    pub outputs: Option<Row>,
    /// What the state is off that, one number per state.
    ///
    /// Default: zero
    pub deviation: Option<Row>,
    /// The state that a start-up plan leads from.
    ///
    /// Example: `x0 = [-1.0, -0.5]`
    pub x0: Option<Row>,
    /// The loads at the start.
    ///
    /// Default: those of step 0, within `d`
    pub d0: Option<Row>,
}

/// A signal over time.
#[derive(Debug, Clone)]
pub enum Course {
    Constant(At<f64>),
    Moves(At<Vec<Move>>),
    Csv { file: At<String>, column: At<String> },
    Random { place: Place, every: Option<At<f64>> },
}

/// One entry of a course.
#[derive(Debug, Clone)]
pub struct Move {
    /// Seconds.
    pub at: At<f64>,
    pub what: Change,
}

#[derive(Debug, Clone)]
pub enum Change {
    /// From here on this value, reached by a ramp over so many seconds.
    To { value: At<f64>, over: Option<At<f64>> },
    /// Added for so many seconds.
    By { value: At<f64>, lasting: At<f64> },
}

/// Something unknown that acts, drawn from the set that the network's file bounds it by. `disturbance = "random"` is short for
/// `disturbance = { kind = "random" }`.
///
/// Or only: `kind`
#[derive(Debug, Clone)]
pub struct Nuisance {
    /// Not a key: its place.
    pub place: Place,
    /// Nothing; uniform in the set, at every step anew; or a corner of it for some steps at a time, chosen to drive states apart
    /// from their plans.
    ///
    /// One of: `"none"`, `"random"`, `"worst-case"`
    /// Default: `"none"`
    pub kind: Kind,
    /// How much of the set, not negative; beyond 1 the guarantee does not hold.
    ///
    /// Default: `1.0`
    pub share: Option<At<f64>>,
    /// What is added besides, by state; the guarantee holds as far as the sum stays in the set.
    ///
    /// Default: zero
    pub add: Vec<(At<String>, Course)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    None,
    /// Uniform, at every step anew.
    Random,
    /// A corner at a time, chosen to drive states apart from their plans.
    WorstCase,
}

/// The state of a subsystem is moved before a step: `by` or `to`, one of them.
#[derive(Debug, Clone)]
pub struct Upset {
    /// Not a key: its place.
    pub place: Place,
    /// When, in s: before the first step from there on.
    pub at: At<f64>,
    /// Whose state.
    pub subsystem: At<String>,
    /// What is added, one number per state.
    ///
    /// Example: `by = [0.5, 0.0]`
    pub by: Option<Row>,
    /// The state there is afterwards.
    pub to: Option<Row>,
}

/// Trouble with messages, by the time they are sent: at the times `at`, or `during` an interval, or by chance with `probability`, in that
/// interval where there is one. What is both lost and late is lost. The guarantee ends with a message that is not there in time,
/// but where only coupling constraints join the subsystems.
#[derive(Debug, Clone)]
pub struct Trouble {
    /// Not a key: its place.
    pub place: Place,
    /// The sender.
    ///
    /// Default: anyone
    pub from: Option<At<String>>,
    /// The receiver.
    ///
    /// Default: anyone
    pub to: Option<At<String>>,
    /// When the messages are sent, in s.
    ///
    /// Example: `at = [10.0, 12.5]`
    pub at: Option<Times>,
    /// From and to, in s.
    ///
    /// Default: the whole scenario
    /// Example: `during = [140.0, 200.0]`
    pub during: Option<At<(f64, f64)>>,
    /// Of trouble with a message, 0 to 1.
    ///
    /// Default: `1.0` where there is `during`
    pub probability: Option<At<f64>>,
    /// How many periods late, at least 1.
    ///
    /// Only in: `late`
    /// Required.
    pub by: Option<At<i64>>,
}

/// A time, or several.
pub type Times = Row;

/// How the row of a changing constraint is drawn at every step. Each of them needs a rule.
#[derive(Debug, Clone)]
pub struct Rule {
    /// Not a key: its place.
    pub place: Place,
    /// Its name in the network's file.
    ///
    /// Default: all changing constraints that have no rule of their own
    pub constraint: Option<At<String>>,
    /// `"apart"`: the outputs of two subsystems stay `distance` apart, by a line across the line between them. `"tangent"`: the same by a
    /// line turned until it touches what the other covers, so that two in the plane pass each other (Section V). `"beyond"`: `normal . y >=
    /// bound` over the outputs of one.
    ///
    /// One of: `"apart"`, `"tangent"`, `"beyond"`
    pub kind: At<RuleKind>,
    /// What true outputs stay apart, above 0, in their unit. Required with `"apart"` and `"tangent"`, and only there.
    pub distance: Option<At<f64>>,
    /// How much of the room there is a tangent leaves to both, 0 (the paper's rule) to 1. Only with `"tangent"`.
    ///
    /// Default: `0.2`
    pub share: Option<At<f64>>,
    /// One number per output. Required with `"beyond"`, and only there.
    pub normal: Option<Row>,
    /// Required with `"beyond"`, and only there.
    pub bound: Option<At<f64>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RuleKind {
    /// Normal to the line of centres: the outputs of two stay `distance` apart.
    Apart,
    /// The same, along the line that touches what the other covers: the paper's rule. Only for two outputs.
    Tangent,
    /// `normal . y >= bound`, over the outputs of the one member.
    Beyond,
}

impl Scenario {
    /// Reads the text of `source`.
    ///
    /// # Errors
    /// As [`Spec::parse`](super::Spec::parse).
    pub fn parse(source: &Source) -> Result<Self, Diagnostics> {
        let document = DeTable::parse(&source.text).map_err(|mistake| syntax(&mistake, &source.text))?;
        let mut errors = Diagnostics::default();
        let files = Files::beside(source);
        let mut file = Table::new("", first_line(&source.text), document.get_ref(), &files);
        let scenario = scenario(&mut file, &mut errors);
        errors.finish(Some(scenario))
    }
}

impl Course {
    /// Where to complain about it.
    pub fn place(&self) -> Place {
        match self {
            Self::Constant(value) => value.place.clone(),
            Self::Moves(moves) => moves.place.clone(),
            Self::Csv { file, .. } => file.place.clone(),
            Self::Random { place, .. } => place.clone(),
        }
    }
}

fn scenario(file: &mut Table<'_>, errors: &mut Diagnostics) -> Scenario {
    let name = file.optional("name", errors, title);
    let duration = file.optional("duration", errors, finite);
    let [steps, seed] = ["steps", "seed"].map(|key| file.optional(key, errors, integer));
    let plant = file.optional("plant", errors, text);
    let subsystems = file.optional("subsystem", errors, subsystems).unwrap_or_default();
    let upsets = file.optional("upset", errors, |value, errors| tables(value, errors, "upset", upset));
    let [lost, late] = ["lost", "late"].map(|key| {
        let read = |value: &Value<'_>, errors: &mut Diagnostics| {
            tables(value, errors, key, |value, errors| trouble(value, errors, key == "late"))
        };
        file.optional(key, errors, read).unwrap_or_default()
    });
    let rules = file.optional("rule", errors, |value, errors| tables(value, errors, "rule", rule));
    file.refuse_unknown(errors);
    let (upsets, rules) = (upsets.unwrap_or_default(), rules.unwrap_or_default());
    Scenario { name, duration, steps, seed, plant, subsystems, upsets, lost, late, rules, place: file.place() }
}

/// A list of tables headed `[[key]]`.
fn tables<'a, T>(
    value: &Value<'a>,
    errors: &mut Diagnostics,
    key: &str,
    read: impl Fn(&Value<'a>, &mut Diagnostics) -> Option<T>,
) -> Option<Vec<T>> {
    let DeValue::Array(tables) = value.toml else {
        return value.refuse(&format!("a list of tables, each headed [[{key}]]"), errors);
    };
    all(tables.iter().enumerate().map(|(k, table)| {
        let what = format!("`{key}` {}", k + 1);
        read(&Value { what, ..value.element(k, table) }, errors)
    }))
}

fn subsystems(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Vec<Acting>> {
    let DeValue::Table(subsystems) = value.toml else {
        errors.push(value.wrong_type("a table of subsystems").help("head each with [subsystem.NAME]"));
        return None;
    };
    let table = Table::new("`subsystem`", value.place.clone(), subsystems, value.files);
    all(table.named().map(|(entry, value)| acting(entry.name(), &value, errors)))
}

fn acting(name: At<String>, value: &Value<'_>, errors: &mut Diagnostics) -> Option<Acting> {
    let mut table = Table::of(format!("subsystem `{}`", name.value), value, errors)?.at(name.place.clone());
    let start = table.optional("start", errors, start);
    let [set_points, loads] =
        ["set-point", "loads"].map(|key| table.optional(key, errors, courses).unwrap_or_default());
    let [disturbance, measurement_error] =
        ["disturbance", "measurement-error"].map(|key| table.optional(key, errors, nuisance));
    table.refuse_unknown(errors);
    Some(Acting { name, start, set_points, loads, disturbance, measurement_error })
}

fn start(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Start> {
    let mut table = Table::of(value.what.clone(), value, errors)?;
    let [outputs, deviation, x0, d0] = ["outputs", "deviation", "x0", "d0"].map(|key| table.optional(key, errors, row));
    table.refuse_unknown(errors);
    Some(Start { place: table.place(), outputs, deviation, x0, d0 })
}

fn courses(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Vec<(At<String>, Course)>> {
    let Some(table) = value.toml.as_table() else {
        errors.push(value.wrong_type("a table with an entry per signal").help("write { h1 = 1.0 }, say"));
        return None;
    };
    let table = Table::new(value.what.clone(), value.place.clone(), table, value.files);
    all(table.named().map(|(entry, value)| Some((entry.name(), course(&value, errors)?))))
}

const COURSE: &str = "a number, a list of moves, \"random\", or a table with a file or a kind";

fn course(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Course> {
    match value.toml {
        DeValue::Float(_) | DeValue::Integer(_) => finite(value, errors).map(Course::Constant),
        DeValue::Array(moves) => {
            let moves = all(moves.iter().enumerate().map(|(k, one)| change(&value.element(k, one), errors)));
            Some(Course::Moves(At::new(moves?, value.place.clone())))
        }
        DeValue::String(_) => {
            random(value, errors)?;
            Some(Course::Random { place: value.place.clone(), every: None })
        }
        DeValue::Table(_) => described(value, errors),
        _ => value.refuse(COURSE, errors),
    }
}

/// `{ csv, column }` or `{ kind = "random", every }`.
fn described(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Course> {
    let mut table = Table::of(value.what.clone(), value, errors)?;
    if table.key_place("kind").is_some() {
        let kind = table.required("kind", errors, random);
        let every = table.optional("every", errors, finite);
        table.refuse_unknown(errors);
        return kind.map(|()| Course::Random { place: table.place(), every });
    }
    let [file, column] = ["csv", "column"].map(|key| table.required(key, errors, text));
    table.also(&["kind", "every"]);
    table.refuse_unknown(errors);
    Some(Course::Csv { file: file?, column: column? })
}

fn random(value: &Value<'_>, errors: &mut Diagnostics) -> Option<()> {
    let written = text(value, errors)?;
    if written.value == "random" {
        return Some(());
    }
    let error = unknown_choice(format!("there is no kind of course \"{}\"", written.value), written.place);
    errors.push(error.help("write \"random\", a number, or a list of moves such as [{ at = 10.0, to = 1.0 }]"));
    None
}

fn change(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Move> {
    let Some(table) = value.toml.as_table() else {
        let error = value.wrong_type("a move");
        errors.push(error.help(
            "write { at = 10.0, to = 1.0 }, with over = 5.0 for a ramp, or { at = 10.0, by = 0.1, for = 2.0 } for a pulse",
        ));
        return None;
    };
    let mut table = Table::new(value.what.clone(), value.place.clone(), table, value.files);
    let at = table.required("at", errors, finite);
    let what = if table.key_place("by").is_some() {
        let [value, lasting] = ["by", "for"].map(|key| table.required(key, errors, finite));
        table.also(&["to", "over"]);
        value.zip(lasting).map(|(value, lasting)| Change::By { value, lasting })
    } else {
        let value = table.required("to", errors, finite);
        let over = table.optional("over", errors, finite);
        table.also(&["by", "for"]);
        value.map(|value| Change::To { value, over })
    };
    table.refuse_unknown(errors);
    Some(Move { at: at?, what: what? })
}

/// A word, or a table with `kind`, `share` and `add`.
fn nuisance(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Nuisance> {
    if value.toml.is_str() {
        let kind = kind(value, errors)?;
        return Some(Nuisance { place: value.place.clone(), kind, share: None, add: Vec::new() });
    }
    let mut table = Table::of(value.what.clone(), value, errors)?;
    let kind = table.optional("kind", errors, kind).unwrap_or(Kind::None);
    let share = table.optional("share", errors, finite);
    let add = table.optional("add", errors, courses).unwrap_or_default();
    table.refuse_unknown(errors);
    Some(Nuisance { place: value.place.clone(), kind, share, add })
}

fn kind(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Kind> {
    let written = text(value, errors)?;
    match &*written.value {
        "none" => Some(Kind::None),
        "random" => Some(Kind::Random),
        "worst-case" => Some(Kind::WorstCase),
        other => {
            let error = unknown_choice(format!("there is no kind \"{other}\""), written.place);
            errors.push(error.help(
                "write \"random\" (uniform in what the design assumes), \"worst-case\" (its corners) or \"none\"",
            ));
            None
        }
    }
}

fn upset(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Upset> {
    let mut table = Table::of(value.what.clone(), value, errors)?;
    let at = table.required("at", errors, finite);
    let subsystem = table.required("subsystem", errors, text);
    let [by, to] = ["by", "to"].map(|key| table.optional(key, errors, row));
    table.refuse_unknown(errors);
    Some(Upset { place: table.place(), at: at?, subsystem: subsystem?, by, to })
}

fn trouble(value: &Value<'_>, errors: &mut Diagnostics, is_late: bool) -> Option<Trouble> {
    let mut table = Table::of(value.what.clone(), value, errors)?;
    let [from, to] = ["from", "to"].map(|key| table.optional(key, errors, text));
    let at = table.optional("at", errors, times);
    let during = table.optional("during", errors, interval);
    let probability = table.optional("probability", errors, finite);
    let by = if is_late { table.required("by", errors, integer) } else { None };
    table.refuse_unknown(errors);
    Some(Trouble { place: table.place(), from, to, at, during, probability, by })
}

/// A time or a list of them.
fn times(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Times> {
    match value.toml {
        DeValue::Array(_) => list(value, errors, "a time in s, or a list of them", finite),
        _ => finite(value, errors).map(|time| At::new(vec![time], value.place.clone())),
    }
}

fn rule(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Rule> {
    let mut table = Table::of(value.what.clone(), value, errors)?;
    let constraint = table.optional("constraint", errors, text);
    let kind = table.required("kind", errors, rule_kind)?;
    let is_apart = kind.value != RuleKind::Beyond;
    let distance = is_apart.then(|| table.required("distance", errors, finite)).flatten();
    let share = (kind.value == RuleKind::Tangent).then(|| table.optional("share", errors, finite)).flatten();
    let normal = (!is_apart).then(|| table.required("normal", errors, row)).flatten();
    let bound = (!is_apart).then(|| table.required("bound", errors, finite)).flatten();
    table.refuse_unknown(errors);
    Some(Rule { place: table.place(), constraint, kind, distance, share, normal, bound })
}

fn rule_kind(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<RuleKind>> {
    let written = text(value, errors)?;
    let kind = match &*written.value {
        "apart" => RuleKind::Apart,
        "tangent" => RuleKind::Tangent,
        "beyond" => RuleKind::Beyond,
        other => {
            let error = unknown_choice(format!("there is no rule \"{other}\""), written.place);
            errors.push(error.help(
                "write kind = \"apart\" or \"tangent\" with a `distance` that two subsystems keep, or kind = \"beyond\" with `normal` and `bound`: normal . y >= bound",
            ));
            return None;
        }
    };
    Some(At::new(kind, written.place))
}

fn unknown_choice(title: String, place: Place) -> Diagnostic {
    Diagnostic::error(code::UNKNOWN_CHOICE, title).at(place, "not on offer")
}
