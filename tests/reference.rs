//! Does the manual say what the compiler reads: every key and no other, which are required, what they may be, and their defaults?

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostic, Diagnostics, Source, code};
use dpc_codegen::export::design_json;
use dpc_codegen::spec::Spec;
use dpc_tests::manual::editor::Editor;
use dpc_tests::manual::kind::Kind;
use dpc_tests::manual::pages::{network, pages};
use dpc_tests::manual::repository;
use dpc_tests::manual::table::{Key, Table};
use dpc_tests::{cases, read};

/// Far from every key, and a date is none of the kinds.
const NONSENSE: &str = "zzzzzzzzzzzz";
const DATE: &str = "1979-05-27";

#[test]
fn generated_pages_are_fresh() {
    for page in pages() {
        let committed = fs::read_to_string(repository().join(page.path)).unwrap_or_default();
        let command = "cargo run --release -p dpc-tests --bin manual";
        assert!(committed == page.text, "{} is not what its sources say now; refresh it with: {command}", page.path);
    }
}

#[test]
fn the_reference_has_every_key_that_is_read_and_no_other() {
    let file = File::new(|_| format!("{NONSENSE} = 1\n"));
    let mistakes = file.mistakes();
    for part in &file.parts {
        let unknown = part.find(&mistakes, code::UNKNOWN_KEY);
        let help =
            unknown.first().and_then(|mistake| mistake.helps.first()).unwrap_or_else(|| panic!("{}", part.header));
        let read = help.strip_prefix("the keys here are: ").expect("such a mistake lists the keys");
        let read = read.split(", ").map(str::to_owned).collect::<BTreeSet<_>>();
        let told = part.keys.iter().cloned().collect::<BTreeSet<_>>();
        assert_eq!(read, told, "{}", part.header);
    }
}

#[test]
fn keys_are_required_where_the_reference_says_so() {
    let file = File::new(|_| format!("{NONSENSE} = 1\n"));
    let mistakes = file.mistakes();
    for part in &file.parts {
        let missing = part.find(&mistakes, code::MISSING_KEY).into_iter().filter_map(|mistake| quoted(&mistake.title));
        let missing = missing.map(str::to_owned).collect::<BTreeSet<_>>();
        assert_eq!(missing, part.required.iter().cloned().collect(), "{}", part.header);
    }
    let nothing = self::mistakes("\n".to_owned());
    let missing = nothing.0.iter().filter_map(|mistake| quoted(&mistake.title)).collect::<BTreeSet<_>>();
    let tables = network();
    let required = tables[0].keys.iter().filter(|key| key.required).map(|key| &*key.name);
    assert_eq!(missing, required.collect(), "an empty file");
}

#[test]
fn values_are_of_the_kinds_that_the_reference_says() {
    let file = File::new(|table| leaves(table).map(|key| format!("{} = {DATE}\n", key.name)).collect());
    let mistakes = file.mistakes();
    let tables = network();
    for (table, part) in tables.iter().zip(&file.parts) {
        let wrong = part.find(&mistakes, code::WRONG_TYPE);
        for key in leaves(table) {
            let demanded = format!("must be {}", key.kind.demanded());
            let found = wrong.iter().find(|mistake| quoted(&mistake.title) == Some(&key.name));
            let title = &found.unwrap_or_else(|| panic!("{}: {} may be a date", part.header, key.name)).title;
            assert!(title.contains(&demanded), "{}: {title}, not {demanded}", part.header);
        }
        assert_eq!(wrong.len(), leaves(table).count(), "{}", part.header);
    }
}

#[test]
fn tables_are_tables() {
    for table in network() {
        for key in table.keys.iter().filter(|key| !is_leaf(key)) {
            let header = concrete(&table.header());
            let mistakes = mistakes(format!("{header}\n{} = {DATE}\n", key.name));
            let demanded = format!("must be {}", key.kind.demanded());
            assert!(mistakes.0.iter().any(|mistake| mistake.title.contains(&demanded)), "{header} {}", key.name);
        }
    }
}

#[test]
fn choices_are_those_on_offer() {
    for table in network() {
        for key in &table.keys {
            let Kind::Choice(values) = &key.kind else { continue };
            let refused = |value: &str| {
                let mistakes = mistakes(format!("{}\n{} = {value}\n", concrete(&table.header()), key.name));
                mistakes.0.iter().any(|mistake| mistake.code == code::UNKNOWN_CHOICE)
            };
            assert!(values.iter().all(|value| !refused(value)), "{}", key.name);
            assert!(refused(&format!("\"{NONSENSE}\"")), "{}", key.name);
        }
    }
}

#[test]
fn examples_are_read() {
    let file = File::new(|table| {
        table.keys.iter().filter_map(|key| key.example.clone()).map(|example| example + "\n").collect()
    });
    let mistakes = file.mistakes();
    let wrong = mistakes.0.iter().filter(|mistake| mistake.code != code::MISSING_KEY).collect::<Vec<_>>();
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn defaults_are_what_holds_without_the_key() {
    let plain = minimal(|_| String::new());
    let without = designed(&plain);
    for table in network() {
        // It goes with what the network does not have.
        let checked = table.keys.iter().filter(|key| key.name != "hold-error");
        for (key, default) in checked.filter_map(|key| Some((key, literal(key)?))) {
            let stated = minimal(|header| match header == concrete(&table.header()) {
                true => format!("{} = {default}\n", key.name),
                false => String::new(),
            });
            if stated == plain {
                continue;
            }
            assert!(designed(&stated) == without, "{} {} = {default} changes the design", table.header(), key.name);
        }
    }
}

#[test]
fn the_schema_accepts_what_the_compiler_accepts_and_refuses_slips() {
    let editor = Editor::new("system");
    let mut good = cases("accept");
    good.extend(cases("emit"));
    good.extend(cases("plants"));
    let examples = ["examples/four_tank", "examples/mass_chain", "examples/power_network", "examples/robots"];
    good.extend(examples.map(|folder| read(format!("../{folder}/system.toml").as_ref())));
    for source in &good {
        assert!(editor.accepts(&source.text), "{}", source.path);
    }
    let text = &read("../docs/system.toml".as_ref()).text;
    let slips = [
        ("horizon = 3", "horizont = 3"),
        ("horizon = 3", "horizon = 3.5"),
        ("horizon = 3", ""),
        ("norm = \"inf\"", "norm = 3"),
        ("gains = \"auto\"", "gains = \"pid\""),
        ("C = [[1.0, 0.0]]", "C = [1.0, 0.0]"),
        ("{ min = [-3.0], max = [3.0] }", "{ low = [-3.0], max = [3.0] }"),
        ("cover = { h1 = [-0.5, 1.0] }", "cover = { h1 = 1.0 }"),
        ("max = 20.0", ""),
    ];
    editor.assert_slips(text, &slips);
}

/// A file with every table once.
struct File {
    text: String,
    parts: Vec<Part>,
}

/// The lines of one table.
struct Part {
    header: String,
    lines: std::ops::Range<usize>,
    keys: Vec<String>,
    required: Vec<String>,
}

impl File {
    /// With what `lines` says in the tables, and in those within values after them.
    fn new(lines: impl Fn(&Table) -> String) -> Self {
        let mut file = Self { text: String::new(), parts: Vec::new() };
        let tables = network();
        for table in &tables {
            let keys = table.keys.iter().map(|key| key.name.clone()).collect();
            let required = leaves(table).filter(|key| key.required).map(|key| key.name.clone()).collect();
            file.push(concrete(&table.header()), &lines(table), keys, required);
        }
        if lines(&tables[0]).starts_with(NONSENSE) {
            tables.iter().for_each(|table| file.push_inner(table));
        }
        file
    }

    fn push_inner(&mut self, table: &Table) {
        for key in table.keys.iter().filter(|key| !key.kind.inner_keys().is_empty()) {
            let header = format!("[{}.{}]", concrete(&table.path.join(".")), key.name);
            let keys = key.kind.inner_keys().iter().map(|key| (*key).to_owned()).collect::<Vec<_>>();
            let required = if keys.len() == 1 { keys.clone() } else { Vec::new() };
            self.push(header, &format!("{NONSENSE} = 1\n"), keys, required);
        }
    }

    fn push(&mut self, header: String, lines: &str, keys: Vec<String>, required: Vec<String>) {
        let start = self.text.len();
        let _ = writeln!(self.text, "{header}\n{lines}");
        self.parts.push(Part { header, lines: start..self.text.len(), keys, required });
    }

    fn mistakes(&self) -> Diagnostics {
        mistakes(self.text.clone())
    }
}

impl Part {
    /// The mistakes of one code in these lines.
    fn find<'a>(&self, mistakes: &'a Diagnostics, code: &str) -> Vec<&'a Diagnostic> {
        let here = |mistake: &&Diagnostic| {
            mistake.code == code && mistake.labels.first().is_some_and(|(place, _)| self.lines.contains(&place.start))
        };
        mistakes.0.iter().filter(here).collect()
    }
}

fn mistakes(text: String) -> Diagnostics {
    Spec::parse(&Source { path: "system.toml".to_owned(), text }).err().unwrap_or_default()
}

fn leaves(table: &Table) -> impl Iterator<Item = &Key> {
    table.keys.iter().filter(|key| is_leaf(key))
}

fn is_leaf(key: &Key) -> bool {
    !matches!(key.kind, Kind::Table(_) | Kind::Tables(_) | Kind::List(_))
}

/// What stands between the first two backticks.
fn quoted(title: &str) -> Option<&str> {
    title.split('`').nth(1)
}

/// With names of subsystems for the words that stand for them.
fn concrete(header: &str) -> String {
    header.replace("NEIGHBOUR", "right").replace("NAME", "left")
}

/// A default that can be written into a file: one value in backticks.
fn literal(key: &Key) -> Option<&str> {
    key.default.as_ref()?.strip_prefix('`')?.strip_suffix('`')
}

/// A network with few keys; `more` adds lines to its tables, by their headers.
fn minimal(more: impl Fn(&str) -> String) -> String {
    let matrices = "A = [[0.9, 0.0], [0.1, 0.8]]\nB = [[0.1], [0.0]]\nC = [[1.0, 0.0]]";
    let limits = "x = { min = -10, max = 10 }\nu = { min = -5, max = 5 }";
    let signals = |k: usize| format!("states = [\"a{k}\", \"b{k}\"]\ninputs = [\"u{k}\"]\noutputs = [\"a{k}\"]");
    let load = "loads = [\"q\"]\nM = [[0.01], [0.0]]\nd = { min = -1, max = 1 }\nx0 = [0.0, 0.0]";
    let coupling = "A = [[0.0, 0.02], [0.0, 0.0]]";
    let parts = [
        ("", "name = \"least\"\nsample-time = 1\nhorizon = 2".to_owned()),
        ("[reference]", String::new()),
        ("[sizing]", String::new()),
        ("[subsystem.left]", format!("{}\n{matrices}\n{limits}\n{load}", signals(1))),
        ("[subsystem.left.gain-weights]", String::new()),
        ("[subsystem.left.reference-weights]", String::new()),
        ("[subsystem.left.from.right]", coupling.to_owned()),
        ("[subsystem.right]", format!("{}\n{matrices}\n{limits}", signals(2))),
    ];
    parts.iter().map(|(header, lines)| format!("{header}\n{lines}\n{}", more(header))).collect()
}

fn designed(text: &str) -> String {
    let source = Source { path: "least.toml".to_owned(), text: text.to_owned() };
    let design =
        Design::new(source.clone()).unwrap_or_else(|errors| panic!("{}\n{text}", errors.render(&source, false)));
    design_json(&design)
}
