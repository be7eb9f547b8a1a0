//! Names and texts in C.

use std::collections::BTreeSet;

use super::super::names::{free_name, module_name, one_line};
use crate::design::Design;

/// Names of a network and of its subsystems in C.
pub struct Words {
    /// `four_tank`
    pub network: String,
    /// `four_tank_left`, in the order of the network.
    pub subsystems: Vec<String>,
}

impl Words {
    pub fn new(design: &Design) -> Self {
        // `dpc.h` is the header of what all networks share.
        let network = match word(&design.network.name) {
            name if name == "dpc" => "dpc_network".to_owned(),
            name => name,
        };
        let mut taken = BTreeSet::new();
        let names = design.network.subsystems.iter().map(|s| free_name(word(&s.name), &mut taken));
        let subsystems = names.map(|name| format!("{network}_{name}")).collect();
        Self { network, subsystems }
    }
}

/// Without what makes a name fit for Rust: it is never alone here, and two underscores belong to the compiler in C++.
fn word(name: &str) -> String {
    module_name(name).trim_end_matches('_').to_owned()
}

/// In quotes. What is not printed, trigraphs and the ends of comments are no part of it.
pub fn c_string(text: &str) -> String {
    let quoted = one_line(text).chars().fold(String::new(), |text, c| match c {
        '"' | '\\' => text + &format!("\\{c}"),
        c => text + &c.to_string(),
    });
    format!("\"{quoted}\"")
}

/// In quotes, for C: `??` would begin a trigraph.
pub fn in_quotes(text: &str) -> String {
    c_string(text).replace("??", "?\\?")
}

/// As part of a comment.
pub fn comment(text: &str) -> String {
    one_line(text).replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?").replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_end_neither_strings_nor_comments() {
        assert_eq!(in_quotes("a \"b\" \\ ??= \n"), r#""a \"b\" \\ ?\?=  ""#);
        assert_eq!(comment("h [*/] /* ??/ \\"), "h [* /] / * ? ?/ /");
    }

    #[test]
    fn names_have_no_two_underscores() {
        let mut taken = BTreeSet::new();
        let names = ["type", "Type", "type 2", "con"].map(|name| free_name(word(name), &mut taken));
        assert_eq!(names, ["type", "type_2", "type_2_2", "con"]);
    }
}
