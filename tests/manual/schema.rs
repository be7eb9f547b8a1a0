//! The reference as a JSON schema, for editors.

use serde_json::{Map, Value, json};

use super::kind::{definition, definitions};
use super::table::{Key, Table};

/// The schema (draft 7) of a file whose tables these are, the first of them being the file itself.
pub fn schema(title: &str, tables: &[Table]) -> String {
    let mut all = tables.iter().map(|table| (table.name.clone(), object(table))).collect::<Map<_, _>>();
    // From the last to the first, since a definition refers to those before it.
    for (name, schema) in definitions().into_iter().rev() {
        let is_used = Value::Object(all.clone()).to_string().contains(&definition(name).to_string());
        if is_used {
            all.insert(name.to_owned(), schema);
        }
    }
    let schema = json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": title,
        "definitions": all,
        "allOf": [definition(&tables[0].name)],
    });
    let text = serde_json::to_string_pretty(&schema).expect("the keys of a schema are texts");
    text + "\n"
}

fn object(table: &Table) -> Value {
    let required = table.keys.iter().filter(|key| key.required).map(|key| &key.name).collect::<Vec<_>>();
    json!({
        "type": "object",
        "description": table.about,
        "properties": table.keys.iter().map(property).collect::<Map<_, _>>(),
        "required": required,
        "additionalProperties": false,
    })
}

/// With its words beside what it may be: a `$ref` hides what stands beside it.
fn property(key: &Key) -> (String, Value) {
    let default = key.default.as_ref().map_or_else(String::new, |default| format!(" Default: {default}."));
    let description = format!("{}{default}", key.about);
    (key.name.clone(), json!({ "description": description.trim(), "allOf": [key.kind.schema()] }))
}
