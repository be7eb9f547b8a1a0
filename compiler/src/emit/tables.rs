//! Values of static items, printed for reading: one matrix row per line, shortest digits that read back the same.
//!
//! `quote` and `prettyplease` serve code; they put long numbers on one line each and lose `//` comments.

use std::fmt::Write;
use std::ops::{Deref, DerefMut};

use nalgebra::{DMatrix, DVector};

use super::names::one_line;
use crate::network::Scalar;

/// A constant expression.
#[derive(Debug, Clone)]
pub enum Value {
    Number(f64),
    Count(usize),
    Word(u64),
    Flag(bool),
    Text(String),
    /// An expression that names another item.
    Path(&'static str),
    /// An array on one line.
    Row(Vec<f64>),
    /// An array of `u16` on one line.
    Counts(Vec<usize>),
    /// An array of any values on one line.
    Array(Vec<Value>),
    /// References to lists of indices and numbers, one per line, each with what it means.
    Entries(Vec<(Vec<(usize, f64)>, String)>),
    /// One row per line, each with what it means.
    Matrix(Vec<(Vec<f64>, String)>),
    /// One element per line, each with what it means.
    List(Vec<(Value, String)>),
    Tuple(Vec<Value>),
    /// A reference to a list.
    Slice(Box<Value>),
    /// An `Option` whose value takes so many bytes.
    Optional(Option<Box<Value>>, usize),
    /// Name of the type, and its fields.
    Struct(&'static str, Vec<Field>),
}

/// Field of a struct, and the comment above it.
#[derive(Debug, Clone)]
pub struct Field {
    pub name: &'static str,
    pub doc: String,
    pub value: Value,
}

impl Field {
    pub fn new(name: &'static str, doc: impl Into<String>, value: Value) -> Self {
        Self { name, doc: doc.into(), value }
    }
}

impl Value {
    /// `labels[k]` says what row k means.
    pub fn matrix(matrix: &DMatrix<f64>, labels: &[String]) -> Self {
        let row = |k: usize| matrix.row(k).iter().copied().collect();
        Value::Matrix((0..matrix.nrows()).map(|k| (row(k), labels.get(k).cloned().unwrap_or_default())).collect())
    }

    /// The entries of each row that are larger than `little` times the largest.
    pub fn entries(matrix: &DMatrix<f64>, little: f64, labels: &[String]) -> Self {
        let row = |k: usize| {
            let row = matrix.row(k);
            let least = little * row.amax();
            let large = row.iter().copied().enumerate().filter(|(_, entry)| entry.abs() > least).collect();
            (large, labels.get(k).cloned().unwrap_or_default())
        };
        Value::Entries((0..matrix.nrows()).map(row).collect())
    }

    pub fn row(row: &DVector<f64>) -> Self {
        Value::Row(row.iter().copied().collect())
    }

    /// One number per line; `labels[k]` says what number k means.
    pub fn column(numbers: &DVector<f64>, labels: &[String]) -> Self {
        let label = |k: usize| labels.get(k).cloned().unwrap_or_default();
        Value::List(numbers.iter().enumerate().map(|(k, &number)| (Value::Number(number), label(k))).collect())
    }

    /// Bytes that the value takes on a machine of 64 bits, at most.
    pub fn bytes(&self, scalar: Scalar) -> usize {
        match self {
            Value::Number(_) => scalar.bytes(),
            Value::Count(_) | Value::Word(_) => 8,
            // A slice: address and length.
            Value::Path(_) => 16,
            Value::Flag(_) => 1,
            Value::Text(text) => 16 + text.len(),
            Value::Row(row) => scalar.bytes() * row.len(),
            Value::Counts(counts) => 2 * counts.len(),
            Value::Array(items) => items.iter().map(|item| item.bytes(scalar)).sum(),
            Value::Entries(rows) => rows.iter().map(|(row, _)| 16 + 16 * row.len()).sum(),
            Value::Matrix(rows) => rows.iter().map(|(row, _)| scalar.bytes() * row.len()).sum(),
            Value::List(items) => items.iter().map(|(item, _)| item.bytes(scalar)).sum(),
            Value::Tuple(items) => padded(items.iter().map(|item| item.bytes(scalar)).sum()),
            Value::Slice(list) => 16 + list.bytes(scalar),
            Value::Optional(_, bytes) => 8 + bytes,
            Value::Struct(_, fields) => padded(fields.iter().map(|field| field.value.bytes(scalar)).sum()),
        }
    }
}

/// Every struct of the runtime holds a number or an address, hence is aligned to 8 bytes where not to fewer.
fn padded(bytes: usize) -> usize {
    bytes.next_multiple_of(8)
}

/// `pub static NAME: type = value;` below its doc comment.
pub fn item(scalar: Scalar, doc: &str, name: &str, ty: &str, value: &Value) -> String {
    let mut text = Text { text: String::new(), scalar };
    for line in doc.lines() {
        let _ = writeln!(text, "{}", format!("/// {line}").trim_end());
    }
    let _ = write!(text, "#[rustfmt::skip]\npub static {name}: {ty} = ");
    write_value(&mut text, value, 0);
    text.push_str(";\n");
    text.text
}

/// What is printed, and in which digits numbers are.
struct Text {
    text: String,
    scalar: Scalar,
}

impl Deref for Text {
    type Target = String;

    fn deref(&self) -> &String {
        &self.text
    }
}

impl DerefMut for Text {
    fn deref_mut(&mut self) -> &mut String {
        &mut self.text
    }
}

/// Shortest digits that read back to the same number.
fn number(number: f64, scalar: Scalar) -> String {
    match number {
        f64::INFINITY => format!("{}::INFINITY", scalar.name()),
        f64::NEG_INFINITY => format!("{}::NEG_INFINITY", scalar.name()),
        // -0.0 says nothing that 0.0 does not.
        0.0 => "0.0".to_owned(),
        finite if scalar == Scalar::Single => format!("{:?}", finite as f32),
        finite => format!("{finite:?}"),
    }
}

fn write_value(text: &mut Text, value: &Value, depth: usize) {
    match value {
        Value::Number(x) => {
            let digits = number(*x, text.scalar);
            text.push_str(&digits);
        }
        Value::Count(count) => text.push_str(&count.to_string()),
        Value::Word(word) => text.push_str(&format!("0x{word:016x}")),
        Value::Flag(flag) => text.push_str(&flag.to_string()),
        Value::Text(string) => text.push_str(&format!("{string:?}")),
        Value::Path(name) => text.push_str(name),
        Value::Row(row) => write_numbers(text, row),
        Value::Counts(counts) => {
            let _ = write!(text, "{counts:?}");
        }
        Value::Array(items) => write_array(text, items, depth),
        Value::Entries(rows) => write_lines(text, depth, rows, |text, row| write_pairs(text, row)),
        Value::Matrix(rows) => write_lines(text, depth, rows, |text, row| write_numbers(text, row)),
        Value::List(items) => write_lines(text, depth, items, |text, item| write_value(text, item, depth + 1)),
        Value::Tuple(items) => write_tuple(text, items, depth),
        Value::Slice(list) => {
            text.push('&');
            write_value(text, list, depth);
        }
        Value::Optional(None, _) => text.push_str("None"),
        Value::Optional(Some(value), _) => {
            text.push_str("Some(");
            write_value(text, value, depth);
            text.push(')');
        }
        Value::Struct(name, fields) => write_struct(text, name, fields, depth),
    }
}

fn write_numbers(text: &mut Text, row: &[f64]) {
    let numbers: Vec<_> = row.iter().map(|&x| number(x, text.scalar)).collect();
    let _ = write!(text, "[{}]", numbers.join(", "));
}

fn write_pairs(text: &mut Text, row: &[(usize, f64)]) {
    let pairs: Vec<_> = row.iter().map(|&(k, x)| format!("({k}, {})", number(x, text.scalar))).collect();
    let _ = write!(text, "&[{}]", pairs.join(", "));
}

fn write_lines<T>(text: &mut Text, depth: usize, items: &[(T, String)], write: impl Fn(&mut Text, &T)) {
    if items.is_empty() {
        return text.push_str("[]");
    }
    text.push_str("[\n");
    for (item, label) in items {
        indent(text, depth + 1);
        write(text, item);
        text.push(',');
        if !label.is_empty() {
            let _ = write!(text, " // {}", one_line(label));
        }
        text.push('\n');
    }
    indent(text, depth);
    text.push(']');
}

fn write_tuple(text: &mut Text, items: &[Value], depth: usize) {
    text.push('(');
    for (k, item) in items.iter().enumerate() {
        text.push_str(if k == 0 { "" } else { ", " });
        write_value(text, item, depth);
    }
    text.push(')');
}

fn write_array(text: &mut Text, items: &[Value], depth: usize) {
    text.push('[');
    for (k, item) in items.iter().enumerate() {
        text.push_str(if k == 0 { "" } else { ", " });
        write_value(text, item, depth);
    }
    text.push(']');
}

fn write_struct(text: &mut Text, name: &str, fields: &[Field], depth: usize) {
    // Short structs without comments, such as the rows of a problem, stay on their line.
    if fields.iter().all(|field| field.doc.is_empty()) {
        let _ = write!(text, "{name} {{ ");
        for (k, field) in fields.iter().enumerate() {
            let _ = write!(text, "{}{}: ", if k == 0 { "" } else { ", " }, field.name);
            write_value(text, &field.value, depth);
        }
        return text.push_str(" }");
    }
    let _ = writeln!(text, "{name} {{");
    for field in fields {
        write_field(text, field, depth + 1);
    }
    indent(text, depth);
    text.push('}');
}

fn write_field(text: &mut Text, field: &Field, depth: usize) {
    for line in field.doc.lines() {
        indent(text, depth);
        let _ = writeln!(text, "// {line}");
    }
    indent(text, depth);
    let _ = write!(text, "{}: ", field.name);
    write_value(text, &field.value, depth);
    text.push_str(",\n");
}

fn indent(text: &mut Text, depth: usize) {
    text.extend(std::iter::repeat_n("    ", depth));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_read_back_the_same() {
        for x in [0.1 + 0.2, 1e-300, -5e-324, 1e22, 123456789.0, 2.0_f64.sqrt(), f64::MAX, -3.0] {
            let text = number(x, Scalar::Double);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), x.to_bits(), "{text}");
            syn::parse_str::<syn::Expr>(&text).unwrap();
        }
        assert_eq!(number(-0.0, Scalar::Double), "0.0");
        assert_eq!(number(f64::NEG_INFINITY, Scalar::Double), "f64::NEG_INFINITY");
    }

    #[test]
    fn one_row_per_line() {
        let matrix = DMatrix::from_row_slice(2, 2, &[1.0, 0.5, -1e-9, f64::INFINITY]);
        let fields = vec![
            Field::new("A", "what A is", Value::matrix(&matrix, &["h1\n[cm]".to_owned()])),
            Field::new("none", "", Value::matrix(&DMatrix::zeros(0, 2), &[])),
        ];
        let text = item(Scalar::Double, "Doc.\n\nMore.", "T", "S", &Value::Struct("S", fields));
        let expected = "/// Doc.\n///\n/// More.\n#[rustfmt::skip]\npub static T: S = S {\n    // what A is\n    A: [\n        \
                        [1.0, 0.5], // h1 [cm]\n        [-1e-9, f64::INFINITY],\n    ],\n    none: [],\n};\n";
        assert_eq!(text, expected);
    }
}
