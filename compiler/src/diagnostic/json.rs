//! Mistakes for machines, and what `--format json` prints.
//!
//! With `--format json` the program prints one object on the standard output and nothing anywhere else:
//!
//! | key | holds |
//! |---|---|
//! | `outcome` | `done` (exit code 0), `mistakes` (1), `usage` (2) or `system` (3) |
//! | `diagnostics` | the mistakes, as below; empty but for the outcome `mistakes` |
//! | `message` | a sentence, where what is wrong has no place in a file |
//! | `summary` | the design, where it is done: [`crate::summary::json`] |
//! | `files` | of the main job: `path`, and `changed`, false where the file held the same before |
//! | `timings` | with `--timings`: `stage`, `seconds`, `peak_bytes` |
//! | `pages` | of `explain`: `code`, `title`, `page` (markdown) |
//!
//! A command line that makes no sense is told as text, on the standard error stream, since nobody knows then what was asked for.
//!
//! Every mistake is an object
//!
//! ```json
//! {
//!   "code": "E0117",
//!   "severity": "error",
//!   "title": "weight `Q` of subsystem `left` is not symmetric",
//!   "labels": [
//!     {
//!       "file": "system.toml", "start": 417, "end": 420, "primary": true,
//!       "line": 21, "column": 18, "end_line": 21, "end_column": 21,
//!       "text": "row 2, column 1: 0.3"
//!     }
//!   ],
//!   "notes": [],
//!   "helps": ["write the same number twice; 0.25 in both places weighs the same"]
//! }
//! ```
//!
//! `start` and `end` are bytes from the beginning of the file, `end` is the first byte behind the place; lines and columns
//! start at 1, columns count characters. The first label is the primary one, and there is always one. Keys may be added;
//! those that are here keep their meaning.

use serde_json::{Value, json};

use super::{Diagnostic, Diagnostics, Place, Source};

/// Mistakes that machines are told: who makes more of them made one, many times.
pub const MOST_TOLD: usize = 1000;

impl Diagnostics {
    /// A list with an object per mistake, in the order of [`Diagnostics::render`]; of very many the first [`MOST_TOLD`].
    pub fn to_json(&self, source: &Source) -> Value {
        let lines = Lines::new(&source.text);
        self.0.iter().take(MOST_TOLD).map(|mistake| mistake.to_json(source, &lines)).collect()
    }
}

impl Diagnostic {
    fn to_json(&self, source: &Source, lines: &Lines) -> Value {
        let labels = self.labels.iter().enumerate().map(|(k, (place, text))| {
            let place = source.within(place);
            let ((line, column), (end_line, end_column)) = lines.range(&source.text, &place);
            json!({
                "file": source.path, "start": place.start, "end": place.end, "primary": k == 0,
                "line": line, "column": column, "end_line": end_line, "end_column": end_column, "text": text,
            })
        });
        json!({
            "code": self.code, "severity": "error", "title": self.title, "labels": labels.collect::<Vec<_>>(),
            "notes": self.notes, "helps": self.helps,
        })
    }
}

/// Where the lines of a text start, so that a thousand places in a large file are found at once.
struct Lines(Vec<usize>);

impl Lines {
    fn new(text: &str) -> Self {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        Self(std::iter::once(0).chain(ends.map(|(at, _)| at + 1)).collect())
    }

    fn position(&self, text: &str, byte: usize) -> (usize, usize) {
        let line = self.0.partition_point(|start| *start <= byte);
        (line, text[self.0[line - 1]..byte].chars().count() + 1)
    }

    fn range(&self, text: &str, place: &Place) -> ((usize, usize), (usize, usize)) {
        (self.position(text, place.start), self.position(text, place.end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_characters_from_one() {
        let source = Source { path: "x.toml".to_owned(), text: "a = 1\nµ = \"ü\"\n".to_owned() };
        let at = source.text.find("\"ü").unwrap();
        let lines = Lines::new(&source.text);
        assert_eq!(lines.range(&source.text, &(at..at + 4)), ((2, 5), (2, 8)));
        assert_eq!(lines.position(&source.text, 0), (1, 1));
        assert_eq!(lines.position(&source.text, source.text.len()), (3, 1));
        let all = 0..=source.text.len();
        all.filter(|byte| source.text.is_char_boundary(*byte))
            .for_each(|byte| assert_eq!(lines.position(&source.text, byte), source.position(byte)));
    }

    #[test]
    fn a_mistake_has_its_places() {
        let source = Source { path: "x.toml".to_owned(), text: "a = 1\n".to_owned() };
        let mistakes = Diagnostics::from(Diagnostic::error("E0102", "unknown").at(0..1, "here").at(4..99, "there"));
        let json = mistakes.to_json(&source);
        assert_eq!(json[0]["labels"][0]["line"], 1);
        assert_eq!(json[0]["labels"][1]["end"], source.text.len());
        assert_eq!((&json[0]["code"], &json[0]["labels"][1]["primary"]), (&"E0102".into(), &false.into()));
    }
}
