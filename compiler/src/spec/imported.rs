//! Values that stand in a file: `"A.csv"`, or `{ file = "plant.npz", name = "A", rows = [1, 2], columns = .. }`.

use toml::de::DeValue;

use super::nearest::did_you_mean;
use super::table::{Table, Value};
use super::value::{LARGEST, list, text};
use super::{At, Matrix, Row, Weight};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::import::{Array, Contents, Unusable};

/// Whether `value` names a file: a table that says so, or text that ends like the name of one.
pub(super) fn is_reference(value: &Value<'_>) -> bool {
    match value.toml {
        DeValue::String(text) => text.rsplit_once('.').is_some_and(|(_, ending)| {
            !ending.is_empty()
                && ending.chars().all(char::is_alphanumeric)
                && !ending.chars().all(|c| c.is_ascii_digit())
        }),
        DeValue::Table(table) => table.iter().any(|(key, file)| &**key.get_ref() == "file" && file.get_ref().is_str()),
        _ => false,
    }
}

pub(super) fn matrix(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Matrix> {
    let array = finite(value, errors)?;
    if array.flat {
        let length = array.entries().len();
        let error = Diagnostic::error(code::SHAPE, format!("{} must be a matrix", value.what));
        let error = error.at(value.place.clone(), format!("is a list of {length} in the file"));
        errors.push(
            error.help(
                "save it with two dimensions: in Python, b.reshape(-1, 1) is a column and b.reshape(1, -1) a row",
            ),
        );
        return None;
    }
    Some(rows(&array, &value.place))
}

/// A list of numbers, from a row, a column or a list; infinite ones where `infinities` are allowed.
pub(super) fn row(value: &Value<'_>, infinities: bool, errors: &mut Diagnostics) -> Option<Row> {
    let array = read(value, infinities, errors)?;
    if array.is_vector() {
        return Some(one_row(array.entries(), &value.place));
    }
    let error = Diagnostic::error(code::SHAPE, format!("{} must be a list of numbers", value.what));
    errors.push(error.at(value.place.clone(), format!("is {} in the file", array.size())));
    None
}

/// A number for one signal, a row, a column or a list with the diagonal, or a matrix.
pub(super) fn weight(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Weight> {
    let array = finite(value, errors)?;
    Some(match array.is_vector() && array.entries().len() > 1 {
        true => Weight::Diagonal(one_row(array.entries(), &value.place)),
        false => Weight::Full(rows(&array, &value.place)),
    })
}

fn rows(array: &Array, place: &Place) -> Matrix {
    let columns = array.columns();
    let row = |r: usize| one_row(&array.entries()[r * columns..(r + 1) * columns], place);
    At::new((0..array.rows()).map(row).collect(), place.clone())
}

fn one_row(numbers: &[f64], place: &Place) -> Row {
    At::new(numbers.iter().map(|number| At::new(*number, place.clone())).collect(), place.clone())
}

fn finite(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Array> {
    read(value, false, errors)
}

fn read(value: &Value<'_>, infinities: bool, errors: &mut Diagnostics) -> Option<Array> {
    let array = Reference::of(value, errors)?.read(value, errors)?;
    let usable = |number: f64| number.abs() <= LARGEST || infinities && number.is_infinite();
    let wrong: Vec<usize> = (0..array.entries().len()).filter(|k| !usable(array.entries()[*k])).collect();
    let Some(first) = wrong.first() else { return Some(array) };
    let error = Diagnostic::error(code::NOT_FINITE, format!("{} has numbers that are not usable", value.what));
    let label = format!("{} is {:e}", position(&array, *first), array.entries()[*first]);
    let error = error.at(value.place.clone(), label);
    let others: Vec<String> = wrong.iter().skip(1).take(4).map(|k| position(&array, *k)).collect();
    let more = wrong.len().saturating_sub(5);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    errors.push(match others.is_empty() {
        true => error,
        false => error.note(format!("so are {}{more}", others.join("; "))),
    });
    None
}

/// `row 2, column 3`.
fn position(array: &Array, k: usize) -> String {
    let (r, c) = (k / array.columns() + 1, k % array.columns() + 1);
    if array.flat { format!("entry {c}") } else { format!("row {r}, column {c}") }
}

/// What a value says about where it stands.
struct Reference {
    file: At<String>,
    name: Option<At<String>>,
    rows: Option<Picked>,
    columns: Option<Picked>,
}

/// Which rows or columns, in the order that is wanted.
struct Picked {
    choices: Vec<Choice>,
    place: Place,
}

enum Choice {
    /// Counted from 1.
    Number(At<i64>),
    /// As the file names it.
    Name(At<String>),
    /// First and last, counted from 1.
    Range(At<i64>, At<i64>),
}

impl Reference {
    fn of(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Self> {
        if value.toml.is_str() {
            let file = text(value, errors)?;
            return Some(Self { file, name: None, rows: None, columns: None });
        }
        let mut table = Table::of(value.what.clone(), value, errors)?;
        let before = errors.0.len();
        let file = table.required("file", errors, text);
        let name = table.optional("name", errors, text);
        let [rows, columns] = ["rows", "columns"].map(|key| table.optional(key, errors, picked));
        table.refuse_unknown(errors);
        Some(Self { file: file?, name, rows, columns }).filter(|_| errors.0.len() == before)
    }

    fn read(&self, value: &Value<'_>, errors: &mut Diagnostics) -> Option<Array> {
        let contents = value.files.get(&self.file.value);
        let array = match &*contents {
            Ok(contents) => self.variable(contents, value, errors)?,
            Err(unusable) => return refuse(&self.file.value, unusable, &self.file.place, errors),
        };
        let file = &self.file.value;
        let rows = Lines { kind: "row", count: array.rows(), names: &array.row_names, file };
        let columns = Lines { kind: "column", count: array.columns(), names: &array.column_names, file };
        let (rows, columns) = (rows.indices(&self.rows, errors), columns.indices(&self.columns, errors));
        Some(array.select(&rows?, &columns?))
    }

    /// The variable that is named, else the only one, else the one that has the name of the key.
    fn variable<'a>(&self, contents: &'a Contents, value: &Value<'_>, errors: &mut Diagnostics) -> Option<&'a Array> {
        let wanted = self.name.as_ref().map_or(value.key, |name| &name.value);
        let named = contents.variables.iter().find(|variable| variable.name.as_deref() == Some(wanted));
        let only = || contents.variables.first().filter(|_| self.name.is_none() && contents.variables.len() == 1);
        let Some(variable) = named.or_else(only) else {
            errors.push(self.no_such(wanted, contents));
            return None;
        };
        let what =
            variable.name.as_ref().map_or(self.file.value.clone(), |name| format!("{name} in {}", self.file.value));
        match &variable.content {
            Ok(array) => Some(array),
            Err(unusable) => {
                let shown =
                    Unusable { what: format!("cannot be used: {}", unusable.what), help: unusable.help.clone() };
                refuse(&what, &shown, self.name.as_ref().map_or(&self.file.place, |name| &name.place), errors)
            }
        }
    }

    fn no_such(&self, wanted: &str, contents: &Contents) -> Diagnostic {
        let file = &self.file.value;
        let error = Diagnostic::error(code::NOT_IN_FILE, format!("there is no variable `{wanted}` in {file}"));
        let place = self.name.as_ref().map_or(&self.file.place, |name| &name.place).clone();
        if contents.names().next().is_none() && !contents.variables.is_empty() {
            return error.at(place, "files of this kind have one matrix without a name").help("leave `name` out");
        }
        let error = error.note(format!("{file} has {}", contents.describe()));
        match did_you_mean(wanted, contents.names()) {
            Some(near) if self.name.is_some() => error.at(place, format!("did you mean \"{near}\"?")),
            _ if self.name.is_none() => error
                .at(place, format!("has several variables, and none is called `{wanted}`"))
                .help(format!("say which: {{ file = \"{file}\", name = \"..\" }}")),
            _ => error.at(place, "not in the file"),
        }
    }
}

fn refuse<T>(what: &str, unusable: &Unusable, place: &Place, errors: &mut Diagnostics) -> Option<T> {
    let joint = if unusable.what.starts_with("line ") { ", " } else { " " };
    let error =
        Diagnostic::error(code::FILE, format!("{what}{joint}{}", unusable.what)).at(place.clone(), "named here");
    errors.push(match &unusable.help {
        Some(help) => error.help(help.clone()),
        None => error,
    });
    None
}

/// `[1, 3]`, `["h1", "h2"]` or `{ first = 1, last = 4 }`.
fn picked(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Picked> {
    const EXPECTED: &str = "a list of numbers (the first is 1) or names, or { first = .., last = .. }";
    let choices = match value.toml {
        DeValue::Array(_) => list(value, errors, EXPECTED, choice)?.value,
        DeValue::Table(_) => {
            let mut table = Table::of(value.what.clone(), value, errors)?;
            let [first, last] = ["first", "last"].map(|key| table.required(key, errors, super::value::integer));
            table.refuse_unknown(errors);
            vec![Choice::Range(first?, last?)]
        }
        _ => return value.refuse(EXPECTED, errors),
    };
    Some(Picked { choices, place: value.place.clone() })
}

fn choice(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Choice> {
    match value.toml {
        DeValue::String(_) => text(value, errors).map(Choice::Name),
        DeValue::Integer(_) => super::value::integer(value, errors).map(Choice::Number),
        _ => value.refuse("a number (the first is 1) or a name", errors),
    }
}

/// The rows or columns of an array, and the file that has it.
struct Lines<'a> {
    /// `row` or `column`.
    kind: &'static str,
    count: usize,
    names: &'a [String],
    file: &'a str,
}

impl Lines<'_> {
    /// The indices that are picked; all where none are.
    fn indices(&self, picked: &Option<Picked>, errors: &mut Diagnostics) -> Option<Vec<usize>> {
        let Some(picked) = picked else { return Some((0..self.count).collect()) };
        let found: Vec<_> = picked.choices.iter().map(|choice| self.chosen(choice, errors)).collect();
        let indices = found.into_iter().collect::<Option<Vec<_>>>()?.concat();
        let mut seen = vec![false; self.count];
        let twice = indices.iter().find(|index| std::mem::replace(&mut seen[**index], true));
        let (kind, file) = (self.kind, self.file);
        let (title, label) = match twice {
            Some(index) => (format!("{kind} {} of {file} is picked twice", index + 1), "each belongs to one signal"),
            None if indices.is_empty() => (format!("no {kind} of {file} is picked"), "empty"),
            None => return Some(indices),
        };
        errors.push(Diagnostic::error(code::NOT_IN_FILE, title).at(picked.place.clone(), label));
        None
    }

    fn chosen(&self, choice: &Choice, errors: &mut Diagnostics) -> Option<Vec<usize>> {
        match choice {
            Choice::Number(number) => self.numbered(number, errors).map(|index| vec![index]),
            Choice::Range(first, last) => {
                let (first, last) = (self.numbered(first, errors), self.numbered(last, errors));
                Some((first?..=last?).collect())
            }
            Choice::Name(name) => {
                let index = self.names.iter().position(|known| *known == name.value);
                if index.is_none() {
                    errors.push(unnamed(self.kind, name, self.names, self.file));
                }
                index.map(|index| vec![index])
            }
        }
    }

    fn numbered(&self, number: &At<i64>, errors: &mut Diagnostics) -> Option<usize> {
        let index = usize::try_from(number.value).ok().filter(|number| (1..=self.count).contains(number));
        if index.is_none() {
            let title = format!("there is no {} {} in {}", self.kind, number.value, self.file);
            let label = format!("it has {}s 1 to {}", self.kind, self.count);
            errors.push(Diagnostic::error(code::NOT_IN_FILE, title).at(number.place.clone(), label));
        }
        index.map(|index| index - 1)
    }
}

fn unnamed(kind: &str, name: &At<String>, names: &[String], file: &str) -> Diagnostic {
    let error = Diagnostic::error(code::NOT_IN_FILE, format!("there is no {kind} `{}` in {file}", name.value));
    match did_you_mean(&name.value, names.iter().map(String::as_str)) {
        Some(near) => error.at(name.place.clone(), format!("did you mean \"{near}\"?")),
        None if names.is_empty() => error
            .at(name.place.clone(), format!("the file has no names of {kind}s"))
            .help(format!("pick {kind}s by their numbers, the first is 1; a .csv file may have names")),
        None => error.at(name.place.clone(), format!("its {kind}s are {}", names.join(", "))),
    }
}
