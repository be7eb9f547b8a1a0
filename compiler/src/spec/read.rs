//! The tables of the file, one function each.

use toml::de::DeValue;

use super::imported::is_reference;
use super::table::{Table, Value};
use super::value::{
    all, boolean, bounds, finite, integer, interval, list, magnitudes, matrix, per_signal, row, signals, text, title,
    weight,
};
use super::{
    At, ChangingConstraint, Coefficients, Collective, CouplingConstraint, Cover, GainWeights, HoldWish, Import, Layer,
    OutputRow, Reference, ReferenceWeights, Sizing, Spec, StartOf, Subsystem, Time,
};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::gains::GainChoice;
use crate::network::{Norm, Scalar};

pub(super) fn spec(file: &mut Table<'_>, errors: &mut Diagnostics) -> Option<Spec> {
    let name = file.required("name", errors, title);
    let time = file.optional("time", errors, time).unwrap_or_default();
    let hold_error = file.optional("hold-error", errors, hold_error);
    let sample_time = file.required("sample-time", errors, finite);
    let horizon = file.required("horizon", errors, integer);
    let reference = file.optional("reference", errors, reference).unwrap_or_default();
    let sizing = file.optional("sizing", errors, sizing).unwrap_or_default();
    let gains = file.optional("gains", errors, gains);
    let scalar = file.optional("scalar", errors, scalar);
    let start_anywhere = file.optional("start-anywhere", errors, |value, errors| {
        boolean(value, errors).map(|anywhere| At::new(anywhere, value.place.clone()))
    });
    let collective = file.optional("collective", errors, collective);
    let subsystems = file.required("subsystem", errors, subsystems);
    let coupling_constraints = file.optional("coupling-constraint", errors, constraints).unwrap_or_default();
    let changing_constraints = file.optional("changing-constraint", errors, changing_constraints).unwrap_or_default();
    file.refuse_unknown(errors);
    if collective.is_none() && file.key_place("collective").is_some() {
        return None;
    }
    Some(Spec {
        name: name.unwrap_or_else(|| At::new(String::new(), file.place())),
        time,
        hold_error,
        sample_time: sample_time.unwrap_or_else(|| At::new(1.0, file.place())),
        horizon: horizon.unwrap_or_else(|| At::new(1, file.place())),
        reference,
        sizing,
        gains,
        scalar,
        start_anywhere,
        collective,
        subsystems: subsystems?,
        coupling_constraints,
        changing_constraints,
        files: Vec::new(),
    })
}

fn reference(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Reference> {
    let mut table = Table::of("`reference`", value, errors)?;
    let layer = table.optional("layer", errors, layer);
    let epsilon = table.optional("epsilon", errors, finite);
    let norm = table.optional("norm", errors, norm);
    let gamma = table.optional("gamma", errors, finite);
    table.refuse_unknown(errors);
    Some(Reference { layer, epsilon, norm, gamma })
}

/// Only the paper's reference layer is there; the key keeps room for others.
fn layer(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Layer> {
    let layer = text(value, errors)?;
    let error = match &*layer.value {
        "paper" => return Some(Layer::Paper),
        "governor" => choice("the reference layer \"governor\" is not available yet", layer.place),
        other => choice(format!("there is no reference layer \"{other}\""), layer.place),
    };
    errors.push(error.help("write layer = \"paper\", or leave the key out"));
    None
}

fn gains(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<GainChoice>> {
    let written = text(value, errors)?;
    let choice = match &*written.value {
        "auto" => GainChoice::Auto,
        "lqr" => GainChoice::Lqr,
        "lmi" => GainChoice::Lmi,
        other => {
            let error = choice(format!("there is no way \"{other}\" to find gains"), written.place);
            errors.push(error.help(
                "write gains = \"lqr\" (local Riccati equations), \"lmi\" (matrix inequality) or \"auto\", the default (the first, and where it fails the second)",
            ));
            return None;
        }
    };
    Some(At::new(choice, written.place))
}

fn time(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Time> {
    let written = text(value, errors)?;
    match &*written.value {
        "discrete" => Some(Time::Discrete),
        "continuous" => Some(Time::Continuous),
        other => {
            let error = choice(format!("there is no time \"{other}\""), written.place);
            errors.push(error.help(
                "write time = \"continuous\" for matrices of x' = A x + B u, or \"discrete\", the default, for x+ = A x + B u",
            ));
            None
        }
    }
}

fn hold_error(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<HoldWish>> {
    let written = text(value, errors)?;
    let wish = match &*written.value {
        "report" => HoldWish::Report,
        "disturbance" => HoldWish::Disturbance,
        other => {
            let error =
                choice(format!("there is nothing called \"{other}\" to do about the hold error"), written.place);
            errors.push(
                error.help("write hold-error = \"report\", the default, or \"disturbance\" to make it a part of w"),
            );
            return None;
        }
    };
    Some(At::new(wish, written.place))
}

fn scalar(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<Scalar>> {
    let written = text(value, errors)?;
    let scalar = match written.value.parse() {
        Ok(scalar) => scalar,
        Err(_) => {
            let error = choice(format!("there is no scalar type \"{}\" to compute in", written.value), written.place);
            errors.push(
                error.help("write scalar = \"f64\", the default, or \"f32\" for processors without double precision"),
            );
            return None;
        }
    };
    Some(At::new(scalar, written.place))
}

fn norm(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Norm> {
    let written = match value.toml {
        DeValue::String(written) => written.to_string(),
        DeValue::Integer(written) => written.to_string(),
        DeValue::Float(written) => written.to_string(),
        _ => return value.refuse("1, 2 or \"inf\"", errors),
    };
    match &*written {
        "1" => Some(Norm::One),
        "2" => Some(Norm::Two),
        "inf" => Some(Norm::Inf),
        _ => {
            let error = choice(format!("there is no norm {written} to choose"), value.place.clone());
            errors.push(error.help("write norm = 1, norm = 2 or norm = \"inf\": the q of (6)"));
            None
        }
    }
}

fn choice(title: impl Into<String>, place: Place) -> Diagnostic {
    Diagnostic::error(code::UNKNOWN_CHOICE, title).at(place, "not on offer")
}

fn sizing(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Sizing> {
    let mut table = Table::of("`sizing`", value, errors)?;
    let keys = ["y-weight", "reserve-weight", "terminal-weight", "epsilon-weight", "end-weight", "facet-loss"];
    let [y_weight, reserve_weight, terminal_weight, epsilon_weight, end_weight, facet_loss] =
        keys.map(|key| table.optional(key, errors, finite));
    let symmetric = table.optional("symmetric", errors, boolean);
    let effort = table.optional("effort", errors, integer);
    table.refuse_unknown(errors);
    let place = Some(value.place.clone());
    #[rustfmt::skip]
    let sizing = Sizing {
        place, y_weight, reserve_weight, terminal_weight, epsilon_weight, end_weight, facet_loss, symmetric, effort,
    };
    Some(sizing)
}

fn collective(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Collective> {
    let mut table = Table::of("`collective`", value, errors)?;
    let [states, inputs, outputs] = ["states", "inputs", "outputs"].map(|key| table.required(key, errors, signals));
    let [A, B, C] = ["A", "B", "C"].map(|key| table.required(key, errors, matrix));
    table.refuse_unknown(errors);
    Some(Collective { place: table.place(), states: states?, inputs: inputs?, outputs: outputs?, A: A?, B: B?, C: C? })
}

fn subsystems(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Vec<Subsystem>> {
    let Some(subsystems) = value.toml.as_table() else {
        errors.push(value.wrong_type("a table of subsystems").help("head each subsystem with [subsystem.NAME]"));
        return None;
    };
    let table = Table::new("`subsystem`", value.place.clone(), subsystems, value.files);
    if table.named().next().is_none() {
        let error = Diagnostic::error(code::MISSING_KEY, "there is no subsystem");
        errors.push(error.at(table.place(), "needs at least one table [subsystem.NAME]"));
    }
    all(table.named().map(|(entry, value)| subsystem(entry.name(), &value, errors)))
}

fn subsystem(name: At<String>, value: &Value<'_>, errors: &mut Diagnostics) -> Option<Subsystem> {
    check_subsystem_name(&name, errors);
    let mut table = Table::of(format!("subsystem `{}`", name.value), value, errors)?.at(name.place.clone());
    let [states, inputs, outputs] = ["states", "inputs", "outputs"].map(|key| table.required(key, errors, signals));
    let [A, B, C] = ["A", "B", "C"].map(|key| table.optional(key, errors, matrix));
    let [E, Cz, Dz] = ["E", "Cz", "Dz"].map(|key| table.optional(key, errors, matrix));
    let [x, u] = ["x", "u"].map(|key| table.optional(key, errors, bounds));
    let w = table.optional("w", errors, bounds);
    let measurement_error = table.optional("measurement-error", errors, magnitudes).flatten();
    let loads = table.optional("loads", errors, signals);
    let M = table.optional("M", errors, matrix);
    let d = table.optional("d", errors, bounds);
    let d_rate = table.optional("d-rate", errors, per_signal);
    let [Q, R, T] = ["Q", "R", "T"].map(|key| table.optional(key, errors, weight));
    let [K, Kx, Ke] = ["K", "Kx", "Ke"].map(|key| table.optional(key, errors, matrix));
    let gain_weights = table.optional("gain-weights", errors, gain_weights).unwrap_or_default();
    let reference_weights = table.optional("reference-weights", errors, reference_weights).unwrap_or_default();
    let cover = table.optional("cover", errors, cover).unwrap_or_default();
    let cover_place = table.key_place("cover");
    let [reserve, y_weight] = ["reserve", "y-weight"].map(|key| table.optional(key, errors, per_signal));
    let [x0, d0] = ["x0", "d0"].map(|key| table.optional(key, errors, row));
    let from = table.optional("from", errors, |from, errors| neighbours(&name.value, from, errors)).unwrap_or_default();
    table.refuse_unknown(errors);
    #[rustfmt::skip]
    let subsystem = Subsystem {
        name, states: states?, inputs: inputs?, outputs: outputs?, A, B, C, E, Cz, Dz, x, u, w, measurement_error, loads, M, d, d_rate,
        Q, R, T, K, Kx, Ke, gain_weights, reference_weights, cover, cover_place, reserve, y_weight, x0, d0,
        from,
    };
    Some(subsystem)
}

/// The tables of a file of starts.
pub(super) fn starts(file: &Table<'_>, errors: &mut Diagnostics) -> Option<Vec<StartOf>> {
    all(file.named().map(|(entry, value)| start(entry.name(), &value, errors)))
}

fn start(subsystem: At<String>, value: &Value<'_>, errors: &mut Diagnostics) -> Option<StartOf> {
    let what = format!("the start of subsystem `{}`", subsystem.value);
    let mut table = Table::of(what, value, errors)?.at(subsystem.place.clone());
    if nested_starts(&subsystem, &table, errors) {
        return None;
    }
    let [x0, d0] = ["x0", "d0"].map(|key| table.optional(key, errors, row));
    table.refuse_unknown(errors);
    Some(StartOf { subsystem, x0, d0 })
}

/// Refuses `[subsystem.front]`, as the file of the network would have it; a subsystem of that name has `x0` or `d0`.
fn nested_starts(subsystem: &At<String>, table: &Table<'_>, errors: &mut Diagnostics) -> bool {
    let is_prefix = subsystem.value == "subsystem" && ["x0", "d0"].iter().all(|key| table.key_place(key).is_none());
    let nested = table.named().filter(|(_, value)| is_prefix && matches!(value.toml, DeValue::Table(_)));
    let before = errors.0.len();
    for (entry, _) in nested {
        let title = format!("unknown key `{}` in the start of subsystem `subsystem`", entry.key);
        let error = Diagnostic::error(code::UNKNOWN_KEY, title).at(entry.key_place.clone(), "not a key of this table");
        errors.push(error.help(format!("write [{}]: the start file has one table per subsystem", entry.key)));
    }
    errors.0.len() > before
}

/// Subsystem names become names of files and of Rust items.
fn check_subsystem_name(name: &At<String>, errors: &mut Diagnostics) {
    let starts = name.value.starts_with(|c: char| c.is_ascii_alphabetic());
    if !starts || !name.value.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_') {
        let error = Diagnostic::error(code::BAD_NAME, format!("`{}` cannot be the name of a subsystem", name.value));
        let label = "needs a letter first, then letters, digits, `-` or `_`";
        errors.push(error.at(name.place.clone(), label).note("the name becomes that of an emitted file"));
    }
}

fn neighbours(to: &str, value: &Value<'_>, errors: &mut Diagnostics) -> Option<Vec<Import>> {
    let table = Table::of(value.what.clone(), value, errors)?;
    all(table.named().map(|(entry, value)| neighbour(to, entry.name(), &value, errors)))
}

fn neighbour(to: &str, neighbour: At<String>, value: &Value<'_>, errors: &mut Diagnostics) -> Option<Import> {
    let what = format!("the coupling from `{}` to `{to}`", neighbour.value);
    let mut table = Table::of(what, value, errors)?.at(neighbour.place.clone());
    let [A, B, L] = ["A", "B", "L"].map(|key| table.optional(key, errors, matrix));
    table.refuse_unknown(errors);
    Some(Import { neighbour, A, B, L })
}

fn gain_weights(value: &Value<'_>, errors: &mut Diagnostics) -> Option<GainWeights> {
    let mut table = Table::of(value.what.clone(), value, errors)?;
    let [Q, R] = ["Q", "R"].map(|key| table.optional(key, errors, weight));
    table.refuse_unknown(errors);
    Some(GainWeights { place: Some(table.place()), Q, R })
}

fn reference_weights(value: &Value<'_>, errors: &mut Diagnostics) -> Option<ReferenceWeights> {
    let mut table = Table::of(value.what.clone(), value, errors)?;
    let [Q, Qe, R] = ["Q", "Qe", "R"].map(|key| table.optional(key, errors, weight));
    table.refuse_unknown(errors);
    Some(ReferenceWeights { place: Some(table.place()), Q, Qe, R })
}

fn cover(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Vec<Cover>> {
    let table = Table::of(value.what.clone(), value, errors)?;
    let read = |(output, interval): (At<String>, _)| Some(Cover { output, interval: interval? });
    all(table.named().map(|(entry, value)| read((entry.name(), interval(&value, errors)))))
}

fn constraints(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Vec<CouplingConstraint>> {
    let tables = match value.toml {
        DeValue::Array(tables) => tables,
        _ => return value.refuse("a list of tables, each headed [[coupling-constraint]]", errors),
    };
    let each = tables.iter().enumerate().map(|(k, table)| {
        let what = format!("coupling constraint {}", k + 1);
        constraint(&Value { what, ..value.element(k, table) }, errors)
    });
    all(each)
}

fn constraint(value: &Value<'_>, errors: &mut Diagnostics) -> Option<CouplingConstraint> {
    let mut table = Table::of(value.what.clone(), value, errors)?;
    let name = table.optional("name", errors, title);
    let H = table.required("H", errors, output_rows);
    let max = table.required("max", errors, finite);
    table.refuse_unknown(errors);
    Some(CouplingConstraint { place: table.place(), name, H: H?, max: max? })
}

fn changing_constraints(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Vec<ChangingConstraint>> {
    let tables = match value.toml {
        DeValue::Array(tables) => tables,
        _ => return value.refuse("a list of tables, each headed [[changing-constraint]]", errors),
    };
    let each = tables.iter().enumerate().map(|(k, table)| {
        let what = format!("changing constraint {}", k + 1);
        changing_constraint(&Value { what, ..value.element(k, table) }, errors)
    });
    all(each)
}

fn changing_constraint(value: &Value<'_>, errors: &mut Diagnostics) -> Option<ChangingConstraint> {
    let mut table = Table::of(value.what.clone(), value, errors)?;
    let name = table.optional("name", errors, title);
    let between = table.required("between", errors, |value, errors| {
        list(value, errors, "a list of subsystems such as [\"left\", \"right\"]", text)
    });
    let margin = table.optional("margin", errors, finite);
    table.refuse_unknown(errors);
    Some(ChangingConstraint { place: table.place(), name, between: between?, margin })
}

fn output_rows(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Vec<OutputRow>> {
    let table = Table::of(value.what.clone(), value, errors)?;
    let read = |(subsystem, coefficients): (At<String>, _)| Some(OutputRow { subsystem, coefficients: coefficients? });
    all(table.named().map(|(entry, value)| read((entry.name(), coefficients(&value, errors)))))
}

fn coefficients(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Coefficients> {
    match value.toml {
        DeValue::Array(_) => row(value, errors).map(Coefficients::List),
        _ if is_reference(value) => row(value, errors).map(Coefficients::List),
        DeValue::Table(_) => {
            let table = Table::of(value.what.clone(), value, errors)?;
            let named = all(table.named().map(|(entry, value)| Some((entry.name(), finite(&value, errors)?))));
            Some(Coefficients::ByOutput(At::new(named?, table.place())))
        }
        _ => value.refuse("a list with one coefficient per output, or a table by output name", errors),
    }
}
