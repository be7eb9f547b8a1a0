//! Names of the user, made fit for Rust: identifiers, file names, and text inside comments.

use std::collections::BTreeSet;

/// One identifier per name, in the order of the names: lower case, usable as module and as file name on every
/// system, no two alike.
pub fn module_names<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut taken = BTreeSet::new();
    names.into_iter().map(|name| free_name(module_name(name), &mut taken)).collect()
}

/// `Tanks 1-2` becomes `tanks_1_2`, `type` becomes `type_`, and a name without any letter or digit `unnamed`.
pub fn module_name(name: &str) -> String {
    let words: Vec<String> = name
        .split(|c: char| !c.is_ascii_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_lowercase)
        .collect();
    let ident = words.join("_");
    match ident.chars().next() {
        None => "unnamed".to_owned(),
        Some(first) if first.is_ascii_digit() => format!("n{ident}"),
        Some(_) if is_reserved(&ident) => ident + "_",
        Some(_) => ident,
    }
}

/// Adds `_2`, `_3`, ... where the name is taken.
pub fn free_name(name: String, taken: &mut BTreeSet<String>) -> String {
    let numbered = (2..).map(|k| format!("{name}_{k}"));
    let free = std::iter::once(name.clone()).chain(numbered).find(|candidate| !taken.contains(candidate));
    let free = free.unwrap_or(name);
    taken.insert(free.clone());
    free
}

/// Keywords, the file of the network itself, and names that Windows keeps for devices.
fn is_reserved(ident: &str) -> bool {
    const DEVICES: [&str; 4] = ["con", "prn", "aux", "nul"];
    let is_port = ident.len() == 4 && (ident.starts_with("com") || ident.starts_with("lpt"));
    syn::parse_str::<syn::Ident>(ident).is_err() || DEVICES.contains(&ident) || is_port
}

/// `text` on one line of a comment: no control character, and nothing that changes the direction of writing.
pub fn one_line(text: &str) -> String {
    let is_odd = |c: char| {
        c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    text.chars().map(|c| if is_odd(c) { ' ' } else { c }).collect()
}

/// `text` as code in a doc comment, so that `h1 [cm]` is no link and `x <= 1` no tag.
pub fn code(text: &str) -> String {
    format!("`{}`", one_line(text).replace('`', "'"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_identifiers() {
        let names = [
            "tanks 1-2",
            "Tanks 1-2",
            "tanks 1 2 2",
            "type",
            "3",
            "Übung",
            "",
            "…",
            "Self",
            "nul",
            "mod",
            "com1",
            "async",
        ];
        let idents = module_names(names);
        let expected = [
            "tanks_1_2",
            "tanks_1_2_2",
            "tanks_1_2_2_2",
            "type_",
            "n3",
            "bung",
            "unnamed",
            "unnamed_2",
            "self_",
            "nul_",
            "mod_",
            "com1_",
            "async_",
        ];
        assert_eq!(idents, expected);
        assert!(idents.iter().all(|ident| syn::parse_str::<syn::Ident>(ident).is_ok()));
    }

    #[test]
    fn comments_stay_on_their_line() {
        assert_eq!(one_line("a\nb\r\u{202e}c"), "a b  c");
        assert_eq!(code("h1 [`cm`]"), "`h1 ['cm']`");
    }
}
