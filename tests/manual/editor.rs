//! What an editor sees of a file by one of the schemas in docs.

use std::fs;

use boon::{Compiler, Draft, SchemaIndex, Schemas};

use super::repository;

/// A committed schema, ready to look at files.
pub struct Editor {
    schemas: Schemas,
    index: SchemaIndex,
}

impl Editor {
    /// With `docs/NAME.schema.json`.
    pub fn new(name: &str) -> Self {
        let file = format!("{name}.schema.json");
        let text = fs::read_to_string(repository().join("docs").join(&file)).expect("the schema is committed");
        let (mut schemas, mut compiler) = (Schemas::new(), Compiler::new());
        compiler.set_default_draft(Draft::V7);
        let value = serde_json::from_str(&text).expect("the schema is JSON");
        compiler.add_resource(&file, value).expect("the schema has an address");
        let index = compiler.compile(&file, &mut schemas).unwrap_or_else(|error| panic!("{error:#}"));
        Self { schemas, index }
    }

    pub fn accepts(&self, text: &str) -> bool {
        let value: toml::Table = toml::from_str(text).expect("the files of the repository are TOML");
        self.schemas.validate(&json(toml::Value::Table(value)), self.index).is_ok()
    }

    /// Panics unless every pair (what `text` says, what it says by mistake) makes the difference.
    pub fn assert_slips(&self, text: &str, slips: &[(&str, &str)]) {
        assert!(self.accepts(text));
        for (good, bad) in slips {
            assert!(text.contains(good), "{good}");
            assert!(!self.accepts(&text.replacen(good, bad, 1)), "{bad} for {good}");
        }
    }
}

/// With large numbers for infinite ones, which editors take for numbers too.
fn json(value: toml::Value) -> serde_json::Value {
    match value {
        toml::Value::Float(number) => number.clamp(f64::MIN, f64::MAX).into(),
        toml::Value::Array(values) => values.into_iter().map(json).collect(),
        toml::Value::Table(values) => values.into_iter().map(|(key, value)| (key, json(value))).collect(),
        other => serde_json::to_value(other).expect("the rest of TOML fits into JSON"),
    }
}
