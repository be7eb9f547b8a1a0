//! The tables of the file and their keys.

use super::kind::{Kind, bare};
use super::source::{Field, Struct};

/// A table of the file.
pub struct Table {
    /// The struct it is read into; with a hyphen and the key, where keys differ from one table of that struct to the other.
    pub name: String,
    /// The way to it: `subsystem`, `NAME`, `from`, `NEIGHBOUR`; empty for the file itself.
    pub path: Vec<String>,
    /// One of several in a row: `[[..]]`.
    pub in_list: bool,
    pub about: String,
    pub keys: Vec<Key>,
}

pub struct Key {
    pub name: String,
    pub kind: Kind,
    pub required: bool,
    pub about: String,
    /// What holds without it.
    pub default: Option<String>,
    pub example: Option<String>,
}

/// The table that `root` of `structs` is read from, then the tables in it, outer ones first.
///
/// # Panics
/// A field's type is none that a key can have: [`Kind`] has to learn it.
pub fn tables(structs: &[Struct], root: &str) -> Vec<Table> {
    let mut found = vec![table(structs, root, Vec::new(), false)];
    let mut next = 0;
    while let Some(outer) = found.get(next) {
        let inner = outer.keys.iter().filter_map(|key| inner(structs, outer, key)).collect::<Vec<_>>();
        found.splice(next + 1..next + 1, inner);
        next += 1;
    }
    found
}

fn inner(structs: &[Struct], outer: &Table, key: &Key) -> Option<Table> {
    let (name, in_list) = match &key.kind {
        Kind::Table(name) | Kind::TableOr(name, _) | Kind::Tables(name) => (name, false),
        Kind::List(name) => (name, true),
        _ => return None,
    };
    let mut path = outer.path.clone();
    path.push(key.name.clone());
    path.extend(users_name(find(structs, name)?));
    Some(table(structs, name, path, in_list))
}

fn table(structs: &[Struct], name: &str, path: Vec<String>, in_list: bool) -> Table {
    let of = find(structs, name).unwrap_or_else(|| panic!("the reader has no struct {name}"));
    let is_here = |field: &&Field| {
        let only = field.doc.note("Only in:").map(|only| only.trim_matches('`'));
        !field.doc.has("Not a key:") && only.is_none_or(|only| path.last().is_some_and(|last| last == only))
    };
    let keys = of.fields.iter().filter(is_here);
    let keys = keys.map(|field| key(structs, field)).collect();
    Table { name: name.to_owned(), path, in_list, about: of.doc.about.clone(), keys }
}

fn key(structs: &[Struct], field: &Field) -> Key {
    let doc = &field.doc;
    let written = doc.note("Key:").map_or_else(|| hyphens(&field.name), |key| key.trim_matches('`').to_owned());
    let (name, inner) = written.split_once('.').map_or((&*written, None), |(outer, inner)| (outer, Some(inner)));
    let kind = match doc.note("One of:") {
        Some(values) => Kind::Choice(values.split(", ").map(|value| value.trim_matches('`').to_owned()).collect()),
        None if inner == Some("max") => Kind::Magnitudes,
        None => kind(structs, &field.of_type, name),
    };
    let about = if doc.about.is_empty() { about(structs, &kind) } else { doc.about.clone() };
    let given = |word| doc.note(word).map(str::to_owned);
    Key {
        name: name.to_owned(),
        kind,
        required: doc.has("Required.") || !(doc.has("Default:") || may_be_absent(structs, &field.of_type)),
        about,
        default: given("Default:"),
        example: doc.note("Example:").map(|example| example.trim_matches('`').to_owned()),
    }
}

fn kind(structs: &[Struct], of_type: &str, key: &str) -> Kind {
    if let Some(kind) = Kind::of(of_type) {
        return kind;
    }
    let bare = bare(of_type);
    let several = bare.strip_prefix("Vec<").and_then(|inner| inner.strip_suffix('>'));
    let name = several.unwrap_or(bare);
    let of = find(structs, name).unwrap_or_else(|| panic!("the reference does not know the type {of_type}"));
    if let (None, Some(word)) = (several, of.doc.note("Or only:")) {
        return Kind::TableOr(name.to_owned(), word.trim_matches('`').to_owned());
    }
    match (several, users_name(of)) {
        (None, _) => Kind::Table(name.to_owned()),
        (Some(_), Some(_)) => Kind::Tables(name.to_owned()),
        (Some(_), None) if of.fields.iter().any(|field| field.doc.has("Only in:")) => {
            Kind::List(format!("{name}-{key}"))
        }
        (Some(_), None) => Kind::List(name.to_owned()),
    }
}

fn about(structs: &[Struct], kind: &Kind) -> String {
    match kind {
        Kind::Table(name) | Kind::TableOr(name, _) | Kind::Tables(name) | Kind::List(name) => {
            find(structs, name).map_or_else(String::new, |of| of.doc.about.clone())
        }
        _ => String::new(),
    }
}

fn may_be_absent(structs: &[Struct], of_type: &str) -> bool {
    let has_default = find(structs, of_type).is_some_and(|of| of.has_default);
    of_type.starts_with("Option<") || of_type.starts_with("Vec<") || has_default
}

/// The word that stands for the user's name of such a table.
fn users_name(of: &Struct) -> Option<String> {
    let note = of.fields.iter().find_map(|field| field.doc.note("Not a key:")?.strip_prefix("the "))?;
    Some(note.split_whitespace().next()?.to_owned())
}

/// By the name of a struct or of a table.
fn find<'a>(structs: &'a [Struct], name: &str) -> Option<&'a Struct> {
    let name = name.split('-').next()?;
    structs.iter().find(|of| of.name == name)
}

fn hyphens(field: &str) -> String {
    field.replace('_', "-")
}

impl Table {
    /// `[subsystem.NAME]`; empty for the file itself.
    pub fn header(&self) -> String {
        match (self.path.is_empty(), self.in_list) {
            (true, _) => String::new(),
            (false, true) => format!("[[{}]]", self.path.join(".")),
            (false, false) => format!("[{}]", self.path.join(".")),
        }
    }
}
