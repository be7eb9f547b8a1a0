//! The reference as a page.

use std::fmt::Write;

use super::table::{Key, Table};

/// The page that `frame` is for: `{{example}}`, `{{tables}}` and `{{starts}}` in it are replaced.
pub fn page(frame: &str, example: &str, network: &[Table], starts: &[Table]) -> String {
    let of = |tables: &[Table]| tables.iter().map(section).collect::<Vec<_>>().join("\n");
    frame
        .replace("{{example}}", example.trim_end())
        .replace("{{tables}}", of(network).trim_end())
        .replace("{{starts}}", of(starts).trim_end())
}

fn section(table: &Table) -> String {
    let title = if table.path.is_empty() { "Top of the file".to_owned() } else { format!("`{}`", table.header()) };
    let mut text = format!("### {title}\n\n{}\n\n", table.about);
    text.push_str("| key | value | default | meaning |\n|---|---|---|---|\n");
    table.keys.iter().for_each(|key| text.push_str(&row(key)));
    text
}

fn row(key: &Key) -> String {
    let default = match (&key.default, key.required) {
        (_, true) => "**required**",
        (Some(default), _) => default,
        (None, _) => "",
    };
    let mut meaning = key.about.clone();
    if let Some(example) = &key.example {
        let _ = write!(meaning, " Example: `{example}`");
    }
    format!("| `{}` | {} | {default} | {} |\n", key.name, key.kind.words(), meaning.trim().replace('|', "\\|"))
}
