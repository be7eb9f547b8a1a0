//! Kinds of values a key may have.

use serde_json::{Value, json};

/// What a key's value is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kind {
    Text,
    Number,
    Integer,
    Boolean,
    /// As written in the file, with quotes where they are texts.
    Choice(Vec<String>),
    Names,
    Signals,
    Row,
    Matrix,
    Weight,
    PerSignal,
    Bounds,
    Cover,
    OutputRows,
    /// `{ max = PerSignal }`
    Magnitudes,
    /// Signals over time, by name.
    Courses,
    /// A time, or several.
    Times,
    Interval,
    /// A table of its own, whose keys are the fields of this struct.
    Table(String),
    /// The same, or the value of one of its keys.
    TableOr(String, String),
    /// Tables under names of the user's.
    Tables(String),
    /// Tables in a row: `[[..]]`.
    List(String),
}

impl Kind {
    /// The kind of a field of this type, where it is not a table.
    pub fn of(of_type: &str) -> Option<Self> {
        Some(match bare(of_type) {
            "String" => Self::Text,
            "f64" => Self::Number,
            "i64" => Self::Integer,
            "bool" => Self::Boolean,
            "Vec<At<String>>" => Self::Names,
            "Signals" => Self::Signals,
            "Row" => Self::Row,
            "Matrix" => Self::Matrix,
            "Weight" => Self::Weight,
            "PerSignal" => Self::PerSignal,
            "Bounds" => Self::Bounds,
            "Vec<Cover>" => Self::Cover,
            "Vec<OutputRow>" => Self::OutputRows,
            "Vec<(At<String>,Course)>" => Self::Courses,
            "Times" => Self::Times,
            "(f64,f64)" => Self::Interval,
            _ => return None,
        })
    }

    /// As the reference has it.
    pub fn words(&self) -> String {
        match self {
            Self::Text => "text",
            Self::Number => "number",
            Self::Integer => "integer",
            Self::Boolean => "true or false",
            Self::Choice(values) => {
                return values.iter().map(|value| format!("`{value}`")).collect::<Vec<_>>().join(", ");
            }
            Self::Names => "list of names",
            Self::Signals => "[signals](#signals)",
            Self::Row => "list of numbers",
            Self::Matrix => "[matrix](#matrix)",
            Self::Weight => "[weight](#weight)",
            Self::PerSignal => "[one or each](#one-or-each)",
            Self::Bounds => "[bounds](#bounds)",
            Self::Cover => "table of intervals",
            Self::OutputRows => "table of rows",
            Self::Magnitudes => "`{ max }`, [one or each](#one-or-each)",
            Self::Courses => "table of [courses](#course)",
            Self::Times => "number, or list of numbers",
            Self::Interval => "`[low, high]`",
            Self::Table(_) => "table",
            Self::TableOr(_, word) => return format!("table, or its `{word}` alone"),
            Self::Tables(_) => "tables by name",
            Self::List(_) => "list of tables",
        }
        .to_owned()
    }

    /// How the compiler complains about a value of another kind: after "must be".
    pub fn demanded(&self) -> &'static str {
        match self {
            Self::Text => "a string",
            Self::Number | Self::Times => "a number",
            Self::Integer => "an integer",
            Self::Boolean => "true or false",
            Self::Choice(values) if values.iter().any(|value| !value.starts_with('"')) => "1, 2 or \"inf\"",
            Self::Choice(_) => "a string",
            Self::Names => "a list of subsystems such as",
            Self::Signals => "a list of names such as",
            Self::Row => "a list of numbers",
            Self::Matrix => "a matrix, written as a list of rows",
            Self::Weight => "a number, a list with the diagonal, or a matrix",
            Self::PerSignal => "a number for all, or a list with one number each",
            Self::Bounds => "a table of bounds",
            Self::Courses => "a table with an entry per signal",
            Self::Interval => "an interval [low, high]",
            Self::Cover | Self::OutputRows | Self::Table(_) | Self::TableOr(..) => "a table",
            Self::Magnitudes => "a table with the largest error of each state",
            Self::Tables(_) => "a table",
            Self::List(_) => "a list of tables",
        }
    }

    /// In a JSON schema; numbers may be infinite in bounds, which JSON has no word for, so that editors only see numbers.
    pub fn schema(&self) -> Value {
        match self {
            Self::Text => json!({ "type": "string" }),
            Self::Number => json!({ "type": "number" }),
            Self::Integer => json!({ "type": "integer" }),
            Self::Boolean => json!({ "type": "boolean" }),
            Self::Choice(values) => {
                json!({ "enum": values.iter().map(|value| choice(value)).collect::<Vec<_>>() })
            }
            Self::Names => json!({ "type": "array", "items": { "type": "string" }, "minItems": 1 }),
            Self::Cover => json!({ "type": "object", "additionalProperties": definition("interval") }),
            Self::OutputRows => json!({ "type": "object", "additionalProperties": definition("coefficients") }),
            Self::Magnitudes => json!({
                "type": "object",
                "properties": { "max": definition("one-or-each") },
                "required": ["max"],
                "additionalProperties": false,
            }),
            Self::Courses => json!({ "type": "object", "additionalProperties": definition("course") }),
            Self::Times => definition("one-or-each"),
            Self::Interval => definition("interval"),
            Self::Signals => definition("signals"),
            Self::Row => definition("row"),
            Self::Matrix => definition("matrix"),
            Self::Weight => definition("weight"),
            Self::PerSignal => definition("one-or-each"),
            Self::Bounds => definition("bounds"),
            Self::Table(name) => definition(name),
            Self::TableOr(name, word) => json!({
                "anyOf": [definition(name), { "$ref": format!("#/definitions/{name}/properties/{word}") }],
            }),
            Self::Tables(name) => {
                json!({ "type": "object", "additionalProperties": definition(name), "minProperties": 1 })
            }
            Self::List(name) => json!({ "type": "array", "items": definition(name) }),
        }
    }

    /// The tables inside a value of this kind whose keys are the compiler's: none for tables of their own.
    pub fn inner_keys(&self) -> &'static [&'static str] {
        match self {
            Self::Bounds => &["min", "max", "H", "h"],
            Self::Magnitudes => &["max"],
            _ => &[],
        }
    }
}

/// The definitions that the schemas of kinds refer to; each refers to ones before it only.
pub fn definitions() -> [(&'static str, Value); 10] {
    let numbers = || json!({ "type": "array", "items": { "type": "number" } });
    let number = || json!({ "type": "number" });
    [
        (
            "signals",
            json!({ "type": "array", "items": { "type": "string", "pattern": "^[^\\s\\[\\]]+(\\s*\\[[^\\[\\]]+\\])?$" } }),
        ),
        ("file", file()),
        ("row", json!({ "anyOf": [numbers(), definition("file")] })),
        ("matrix", json!({ "anyOf": [{ "type": "array", "items": numbers() }, definition("file")] })),
        ("weight", json!({ "anyOf": [number(), numbers(), definition("matrix")] })),
        ("one-or-each", json!({ "anyOf": [number(), definition("row")] })),
        (
            "bounds",
            json!({
                "type": "object",
                "properties": {
                    "min": definition("one-or-each"),
                    "max": definition("one-or-each"),
                    "H": definition("matrix"),
                    "h": definition("row"),
                },
                "dependencies": { "H": ["h"], "h": ["H"] },
                "additionalProperties": false,
            }),
        ),
        ("interval", json!({ "type": "array", "items": number(), "minItems": 2, "maxItems": 2 })),
        (
            "coefficients",
            json!({ "anyOf": [definition("row"), { "type": "object", "additionalProperties": number() }] }),
        ),
        ("course", course()),
    ]
}

/// A value that stands in a file of its own.
fn file() -> Value {
    let pick = json!({ "type": ["array", "string", "integer"] });
    json!({
        "anyOf": [
            { "type": "string", "pattern": "\\.[^.]+$" },
            {
                "type": "object",
                "properties": { "file": { "type": "string" }, "name": { "type": "string" }, "rows": pick, "columns": pick },
                "required": ["file"],
                "additionalProperties": false,
            },
        ],
    })
}

/// A signal over time.
fn course() -> Value {
    let table = |keys: &[&str], required: &[&str]| {
        let kind = |key: &str| match key {
            "csv" | "column" => json!({ "type": "string" }),
            "kind" => json!({ "enum": ["random"] }),
            _ => json!({ "type": "number" }),
        };
        let properties = keys.iter().map(|key| ((*key).to_owned(), kind(key))).collect::<serde_json::Map<_, _>>();
        json!({ "type": "object", "properties": properties, "required": required, "additionalProperties": false })
    };
    let moves = [table(&["at", "to", "over"], &["at", "to"]), table(&["at", "by", "for"], &["at", "by", "for"])];
    json!({
        "anyOf": [
            { "type": "number" },
            { "enum": ["random"] },
            { "type": "array", "items": { "anyOf": moves } },
            table(&["csv", "column"], &["csv", "column"]),
            table(&["kind", "every"], &["kind"]),
        ],
    })
}

pub fn definition(name: &str) -> Value {
    json!({ "$ref": format!("#/definitions/{name}") })
}

/// A type without what says where it was read, and that it may be absent.
pub fn bare(of_type: &str) -> &str {
    let inner = ["Option<", "At<"].iter().find_map(|outer| of_type.strip_prefix(outer)?.strip_suffix('>'));
    inner.map_or(of_type, bare)
}

fn choice(value: &str) -> Value {
    serde_json::from_str(value).expect("choices are texts in quotes, or numbers")
}
