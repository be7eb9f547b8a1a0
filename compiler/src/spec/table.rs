//! A table of the file that knows which keys were asked for.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::At;
use super::files::Files;
use super::nearest::did_you_mean;
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};

/// A value with the words and the place to complain about it.
pub(super) struct Value<'a> {
    /// In the user's words: ``` `A` of subsystem `left` ```.
    pub what: String,
    /// The key it stands behind, of a list's entries that of the list.
    pub key: &'a str,
    pub place: Place,
    pub toml: &'a DeValue<'a>,
    /// What it may name.
    pub files: &'a Files,
}

/// A key with its value.
pub(super) struct Entry<'a> {
    pub key: &'a str,
    pub key_place: Place,
    value: &'a Spanned<DeValue<'a>>,
}

pub(super) struct Table<'a> {
    /// In the user's words: ``` subsystem `left` ```; empty for the file itself.
    what: String,
    /// Where to point when a key is missing.
    place: Place,
    /// In the order of the file.
    entries: Vec<Entry<'a>>,
    asked: Vec<&'static str>,
    files: &'a Files,
}

impl<'a> Table<'a> {
    pub fn new(what: impl Into<String>, place: Place, table: &'a DeTable<'a>, files: &'a Files) -> Self {
        let entry = |(key, value): (&'a Spanned<_>, _)| Entry { key: key_text(key), key_place: key.span(), value };
        let mut entries: Vec<_> = table.iter().map(entry).collect();
        entries.sort_by_key(|entry| entry.key_place.start);
        Self { what: what.into(), place, entries, asked: Vec::new(), files }
    }

    /// The table in `value`, called `what` from here on.
    pub fn of(what: impl Into<String>, value: &Value<'a>, errors: &mut Diagnostics) -> Option<Self> {
        match value.toml {
            DeValue::Table(table) => Some(Self::new(what, value.place.clone(), table, value.files)),
            _ => value.refuse("a table", errors),
        }
    }

    /// The same table, complaining about missing keys at `place`.
    pub fn at(mut self, place: Place) -> Self {
        self.place = place;
        self
    }

    pub fn place(&self) -> Place {
        self.place.clone()
    }

    /// `None` where the key is absent or wrong; if wrong, `errors` says so.
    pub fn optional<T>(
        &mut self,
        key: &'static str,
        errors: &mut Diagnostics,
        read: impl FnOnce(&Value<'a>, &mut Diagnostics) -> Option<T>,
    ) -> Option<T> {
        self.asked.push(key);
        let entry = self.entries.iter().find(|entry| entry.key == key)?;
        read(&entry.value(&self.what, self.files), errors)
    }

    /// `None` where the key is absent or wrong; `errors` says which.
    pub fn required<T>(
        &mut self,
        key: &'static str,
        errors: &mut Diagnostics,
        read: impl FnOnce(&Value<'a>, &mut Diagnostics) -> Option<T>,
    ) -> Option<T> {
        if self.key_place(key).is_none() {
            self.asked.push(key);
            errors.push(self.missing(key));
            return None;
        }
        self.optional(key, errors, read)
    }

    /// Every entry, for tables whose keys are the user's names.
    pub fn named(&self) -> impl Iterator<Item = (&Entry<'a>, Value<'a>)> {
        self.entries.iter().map(|entry| (entry, entry.value(&self.what, self.files)))
    }

    pub fn key_place(&self, key: &str) -> Option<Place> {
        self.entries.iter().find(|entry| entry.key == key).map(|entry| entry.key_place.clone())
    }

    /// Keys that would have been asked for had another one been there.
    pub fn also(&mut self, keys: &[&'static str]) {
        self.asked.extend(keys);
    }

    /// Refuses what nobody asked for. Call it last.
    pub fn refuse_unknown(&self, errors: &mut Diagnostics) {
        for entry in self.entries.iter().filter(|entry| !self.asked.contains(&entry.key)) {
            // A key that is there under a wrong name is not missing too.
            if let Some(meant) = did_you_mean(entry.key, self.asked.iter().copied()) {
                let echo = self.missing(meant);
                errors.0.retain(|error| *error != echo);
            }
            errors.push(self.unknown(entry));
        }
    }

    fn unknown(&self, entry: &Entry<'_>) -> Diagnostic {
        let title = format!("unknown key `{}`{}", entry.key, self.inside());
        let error = Diagnostic::error(code::UNKNOWN_KEY, title);
        match did_you_mean(entry.key, self.asked.iter().copied()) {
            Some(known) => error.at(entry.key_place.clone(), format!("did you mean `{known}`?")),
            None => error
                .at(entry.key_place.clone(), "not a key of this table")
                .help(format!("the keys here are: {}", self.asked.join(", "))),
        }
    }

    fn missing(&self, key: &str) -> Diagnostic {
        let title = format!("`{key}` is missing{}", self.inside());
        let whither = if self.what.is_empty() { "at the top of the file, above all tables" } else { "here" };
        Diagnostic::error(code::MISSING_KEY, title).at(self.place(), format!("`{key}` belongs {whither}"))
    }

    fn inside(&self) -> String {
        if self.what.is_empty() { String::new() } else { format!(" in {}", self.what) }
    }
}

impl<'a> Entry<'a> {
    /// The key, where it is the user's name for something.
    pub fn name(&self) -> At<String> {
        At::new(self.key.to_string(), self.key_place.clone())
    }

    fn value(&self, table: &str, files: &'a Files) -> Value<'a> {
        let what = if table.is_empty() { format!("`{}`", self.key) } else { format!("`{}` of {table}", self.key) };
        Value { what, key: self.key, place: self.value.span(), toml: self.value.get_ref(), files }
    }
}

impl<'a> Value<'a> {
    /// Element `index` of the list this value is.
    pub fn element(&self, index: usize, element: &'a Spanned<DeValue<'a>>) -> Self {
        let what = format!("entry {} of {}", index + 1, self.what);
        Self { what, place: element.span(), toml: element.get_ref(), ..*self }
    }

    /// Says that `expected` belongs here.
    pub fn refuse<T>(&self, expected: &str, errors: &mut Diagnostics) -> Option<T> {
        errors.push(self.wrong_type(expected));
        None
    }

    pub fn wrong_type(&self, expected: &str) -> Diagnostic {
        Diagnostic::error(code::WRONG_TYPE, format!("{} must be {expected}", self.what))
            .at(self.place.clone(), format!("found {}", kind(self.toml)))
    }
}

fn key_text<'a>(key: &'a Spanned<toml::de::DeString<'a>>) -> &'a str {
    key.get_ref()
}

fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "an integer",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "a boolean",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}
