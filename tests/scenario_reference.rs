//! Does the manual say what a scenario may say: every key and no other, which are required, what they may be?

use std::collections::BTreeSet;
use std::fs;

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostic, Source, code};
use dpc_codegen::simulate::Scenario;
use dpc_codegen::spec::scenario::Scenario as Written;
use dpc_tests::manual::editor::Editor;
use dpc_tests::manual::kind::Kind;
use dpc_tests::manual::pages::scenario;
use dpc_tests::manual::repository;
use dpc_tests::manual::table::{Key, Table};
use dpc_tests::read;

/// Far from every key, and a date is none of the kinds.
const NONSENSE: &str = "zzzzzzzzzzzz";
const DATE: &str = "1979-05-27";

/// Which keys a rule has depends on its kind.
const RULES: [&str; 3] = ["kind = \"apart\"\n", "kind = \"tangent\"\n", "kind = \"beyond\"\n"];

#[test]
fn the_page_has_every_key_that_is_read_and_no_other() {
    for table in scenario() {
        let read = variants(&table)
            .iter()
            .flat_map(|lines| listed(&file(&table, &format!("{lines}{NONSENSE} = 1"))))
            .collect::<BTreeSet<_>>();
        let told = table.keys.iter().map(|key| key.name.clone()).collect::<BTreeSet<_>>();
        assert_eq!(read, told, "{}", table.header());
    }
}

#[test]
fn keys_are_required_where_the_page_says_so() {
    for table in scenario() {
        let mistakes = mistakes(&file(&table, ""));
        let missing = mistakes.iter().filter(|mistake| mistake.code == code::MISSING_KEY);
        let missing = missing.filter_map(|mistake| quoted(&mistake.title)).collect::<BTreeSet<_>>();
        let told = table.keys.iter().filter(|key| key.required).map(|key| &*key.name).collect();
        assert_eq!(missing, told, "{}", table.header());
    }
}

#[test]
fn values_are_of_the_kinds_that_the_page_says() {
    for table in scenario() {
        for key in &table.keys {
            let demanded = format!("must be {}", key.kind.demanded());
            let of_key =
                |mistake: &Diagnostic| quoted(&mistake.title) == Some(&key.name) && mistake.title.contains(&demanded);
            let text = |lines: &str| file(&table, &format!("{}{} = {DATE}\n", besides(lines, key), key.name));
            let found = variants(&table).iter().any(|lines| mistakes(&text(lines)).iter().any(of_key));
            assert!(found, "{} {} may be a date, or must be something else", table.header(), key.name);
        }
    }
}

#[test]
fn choices_are_those_on_offer() {
    for table in scenario() {
        for key in &table.keys {
            let Kind::Choice(values) = &key.kind else { continue };
            let refused = |value: &str| {
                let mistakes = mistakes(&file(&table, &format!("{} = {value}\n", key.name)));
                mistakes.iter().any(|mistake| mistake.code == code::UNKNOWN_CHOICE)
            };
            assert!(values.iter().all(|value| !refused(value)), "{}", key.name);
            assert!(refused(&format!("\"{NONSENSE}\"")), "{}", key.name);
        }
    }
}

#[test]
fn examples_and_words_in_place_of_tables_are_read() {
    let usable = |text: &str| {
        let mistakes = mistakes(text);
        let wrong = mistakes.iter().filter(|mistake| mistake.code != code::MISSING_KEY).collect::<Vec<_>>();
        assert!(wrong.is_empty(), "{text}: {wrong:?}");
    };
    for table in scenario() {
        table.keys.iter().filter_map(|key| key.example.as_ref()).for_each(|example| usable(&file(&table, example)));
        let words = table.keys.iter().filter(|key| matches!(key.kind, Kind::TableOr(..)));
        words.for_each(|key| usable(&file(&table, &format!("{} = \"random\"\n", key.name))));
    }
}

/// The page has them by hand.
#[test]
fn the_page_has_every_key_of_a_course() {
    let page = fs::read_to_string(repository().join("docs/scenario.md")).expect("the page is committed");
    let (_, courses) = page.split_once("\n### Course\n").expect("the page says what a course is");
    let forms = ["{ csv = \"a.csv\", column = \"h\", ! }", "{ kind = \"random\", ! }", "[{ at = 1.0, to = 1.0, ! }]"];
    for form in forms.map(|form| form.replace('!', &format!("{NONSENSE} = 1"))) {
        let keys = listed(&format!("[subsystem.left]\nset-point.h1 = {form}\n"));
        assert!(keys.len() >= 2, "{form}: {keys:?}");
        for key in keys {
            assert!(courses.contains(&format!("{key} = ")), "{key} of {form}");
        }
    }
}

#[test]
fn the_example_can_be_simulated() {
    let example = read("../docs/scenario.toml".as_ref());
    let design = Design::new(read("../docs/system.toml".as_ref())).expect("the example of the reference is designed");
    if let Err(mistakes) = Scenario::read(&example, &repository().join("docs"), &design) {
        panic!("{}", mistakes.render(&example, false));
    }
}

#[test]
fn the_schema_accepts_what_the_compiler_accepts_and_refuses_slips() {
    let editor = Editor::new("scenario");
    let scenarios = ["four_tank/scenarios/limits", "four_tank/scenarios/troubles", "power_network/scenarios/loads"];
    for name in scenarios.into_iter().chain(["robots/scenarios/crossing"]) {
        assert!(editor.accepts(&read(format!("../examples/{name}.toml").as_ref()).text), "{name}");
    }
    let text = &read("../docs/scenario.toml".as_ref()).text;
    let slips = [
        ("duration = 300.0", "length = 300.0"),
        ("seed = 7", "seed = 0.5"),
        ("disturbance = \"random\"", "disturbance = \"uniform\""),
        ("kind = \"worst-case\"", "kind = \"worst\""),
        ("over = 30.0", "during = 30.0"),
        (", for = 20.0", ""),
        ("during = [220.0, 300.0]", "during = [220.0]"),
        ("by = 2\n", ""),
        ("at = [120.0, 121.5]", "at = [120.0, 121.5]\nby = 2"),
    ];
    editor.assert_slips(text, &slips);
}

/// What else a table needs to say before all of its keys are asked for.
fn variants(table: &Table) -> &'static [&'static str] {
    if table.header() == "[[rule]]" { &RULES } else { &[""] }
}

/// Without a line about the key itself.
fn besides<'a>(lines: &'a str, key: &Key) -> &'a str {
    if lines.starts_with(&*key.name) { "" } else { lines }
}

/// A scenario of one table with these lines.
fn file(table: &Table, lines: &str) -> String {
    format!("{}\n{lines}\n", table.header().replace("NAME", "left"))
}

/// The keys that the refusal of one that is none lists.
fn listed(text: &str) -> Vec<String> {
    let unknown = mistakes(text).into_iter().filter(|mistake| mistake.code == code::UNKNOWN_KEY);
    let helps = unknown.flat_map(|mistake| mistake.helps).collect::<Vec<_>>();
    let keys = helps.iter().filter_map(|help| help.strip_prefix("the keys here are: "));
    keys.flat_map(|keys| keys.split(", ")).map(str::to_owned).collect()
}

fn mistakes(text: &str) -> Vec<Diagnostic> {
    let source = Source { path: "scenario.toml".to_owned(), text: text.to_owned() };
    Written::parse(&source).err().unwrap_or_default().0
}

/// What stands between the first two backticks.
fn quoted(title: &str) -> Option<&str> {
    title.split('`').nth(1)
}
