//! Does everything that the README and the manual show work as printed: commands, files, links?

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::Source;
use dpc_codegen::spec::scenario::Scenario;
use dpc_tests::manual::console::{Command, agrees, commands};
use dpc_tests::manual::kind::Kind;
use dpc_tests::manual::markdown::{Block, Markdown};
use dpc_tests::manual::pages::network;
use dpc_tests::manual::repository;
use dpc_tests::manual::session::Session;
use dpc_tests::manual::table::Table;

/// Commands that are not run here, by their beginning, and why. That the packages, programs and files exist that they name is
/// checked.
const NOT_RUN: [(&str, &str); 12] = [
    ("cargo test", "runs this test"),
    ("cargo run --release -p four-tank", ".ci/run does, and the package's own tests run its loops"),
    ("cargo run --release -p power-network", "the package's own tests run its loops; minutes"),
    ("cargo run --release -p mass-chain", "the package's own tests run its loops; minutes"),
    ("cargo run --release -p robots", "the package's own tests run its loops; minutes"),
    ("cargo run --release -p bench", "measures this machine; .ci/run counts instructions"),
    ("cargo run --release -p dpc-tests --bin manual", "the freshness of its files is tested in reference.rs"),
    ("cargo install", "installs on this machine; what it builds is what the other commands here run"),
    ("cargo doc", "opens a browser; .ci/run builds all of it"),
    ("bench/online/peers/fetch", "needs PyPI and a C compiler"),
    (".ci/", "runs this test, or needs Debian's archive"),
    ("git clone", "needs the network"),
];

/// A page whose commands start in an empty folder, with the repository beside it as `dpc-codegen`, says so.
const EMPTY: &str = "<!-- runs in an empty folder -->";

#[test]
fn commands_do_what_is_printed() {
    let wanted = std::env::var("DPC_PAGE").unwrap_or_default();
    for (path, page) in pages().into_iter().filter(|(path, _)| path.ends_with(&wanted)) {
        let shows_commands = page.blocks.iter().any(|block| block.language == "console");
        if shows_commands {
            run(&path, &page);
        }
    }
}

fn run(path: &Path, page: &Markdown) {
    let is_empty = page.comments.iter().any(|comment| comment == EMPTY);
    let mut session = Session::new(Path::new(env!("CARGO_TARGET_TMPDIR")), is_empty);
    for block in &page.blocks {
        match (block.language.as_str(), block.file()) {
            (_, Some(file)) => session.write(file, &block.text),
            ("console", None) => {
                commands(&block.text).iter().for_each(|command| check(path, block, command, &mut session));
            }
            _ => {}
        }
    }
}

fn check(path: &Path, block: &Block, command: &Command, session: &mut Session) {
    let place = format!("{}:{}: $ {}", path.display(), block.line, command.text);
    if not_run(&command.text) {
        return exists(&place, &command.text);
    }
    let outcome = session.run(&command.text);
    let printed = &outcome.printed;
    assert_eq!(outcome.succeeded, !command.fails(), "{place}\n{printed}");
    let agrees = command.printed.is_empty() || agrees(&command.printed, printed);
    assert!(agrees, "{place}\nprints\n{printed}\nand not\n{}", command.printed.join("\n"));
}

fn not_run(command: &str) -> bool {
    NOT_RUN.iter().any(|(start, _)| command.starts_with(start))
}

/// What a command names is there: packages, programs, files.
fn exists(place: &str, command: &str) {
    let command = command.split(" #").next().unwrap_or_default();
    for part in command.split(" && ") {
        let words = part.split_whitespace().take_while(|word| *word != "--").collect::<Vec<_>>();
        let after = |flag: &str| words.iter().position(|word| *word == flag).and_then(|at| words.get(at + 1)).copied();
        if let Some(package) = after("-p") {
            let folder = packages().remove(package).unwrap_or_else(|| panic!("{place}: there is no package {package}"));
            let named =
                |name: &str| fs::read_to_string(folder.join("Cargo.toml")).is_ok_and(|text| text.contains(name));
            let found =
                |name: &str| folder.join(format!("src/bin/{name}.rs")).exists() || named(&format!("\"{name}\""));
            assert!(after("--bin").is_none_or(found), "{place}: there is no such program");
        }
        let files = ["--path", "--manifest-path"].into_iter().filter_map(after);
        let program = words.first().copied().filter(|word| word.contains('/'));
        for file in files.chain(program) {
            let file = file.trim_start_matches("dpc-codegen/");
            assert!(repository().join(file).exists(), "{place}: there is no {file}");
        }
    }
}

/// The packages of the workspace with their folders.
fn packages() -> BTreeMap<String, PathBuf> {
    let manifest = |folder: &Path| -> toml::Table {
        let text = fs::read_to_string(folder.join("Cargo.toml")).expect("a package has a manifest");
        toml::from_str(&text).expect("a manifest is TOML")
    };
    let members =
        manifest(&repository())["workspace"]["members"].as_array().cloned().expect("the workspace has members");
    let folders = members.iter().filter_map(|member| Some(repository().join(member.as_str()?)));
    folders
        .map(|folder| (manifest(&folder)["package"]["name"].as_str().unwrap_or_default().to_owned(), folder))
        .collect()
}

#[test]
fn networks_in_the_pages_have_designs_or_are_fragments() {
    for (path, page) in pages() {
        for block in page.blocks.iter().filter(|block| block.language == "toml") {
            let place = format!("{}:{}", path.display(), block.line);
            let is = |word| block.is("toml", word);
            let table: toml::Table = toml::from_str(&block.text).unwrap_or_else(|error| panic!("{place}: {error}"));
            match () {
                () if is("manifest") => assert!(is_manifest(&table), "{place}: not a manifest of cargo"),
                () if is("scenario") => is_scenario(&place, &block.text),
                () if is("fragment") => known(&place, &table, &network()),
                () => designed(&place, &block.text),
            }
        }
    }
}

fn is_manifest(table: &toml::Table) -> bool {
    table.keys().all(|key| ["package", "dependencies", "build-dependencies", "profile", "workspace"].contains(&&**key))
}

fn is_scenario(place: &str, text: &str) {
    let source = Source { path: place.to_owned(), text: text.to_owned() };
    if let Err(mistakes) = Scenario::parse(&source) {
        panic!("{}", mistakes.render(&source, false));
    }
}

fn designed(place: &str, text: &str) {
    let source = Source { path: place.to_owned(), text: text.to_owned() };
    if let Err(mistakes) = Design::new(source.clone()) {
        panic!("{}", mistakes.render(&source, false));
    }
}

/// Every key of a fragment is one that the reference has, with values of its kind.
fn known(place: &str, fragment: &toml::Table, tables: &[Table]) {
    let find = |name: &str| tables.iter().find(|table| table.name == name).expect("kinds name tables");
    walk(place, fragment, &tables[0], &find);
}

fn walk<'a>(place: &str, values: &toml::Table, table: &Table, find: &dyn Fn(&str) -> &'a Table) {
    for (name, value) in values {
        let key = table.keys.iter().find(|key| key.name == *name);
        let key = key.unwrap_or_else(|| panic!("{place}: {} has no key {name}", table.header()));
        let inside = |value: &toml::Value, of: &str| match value.as_table() {
            Some(values) => walk(place, values, find(of), find),
            None => panic!("{place}: {name} is no table"),
        };
        match &key.kind {
            Kind::Table(of) => inside(value, of),
            Kind::Tables(of) => value.as_table().into_iter().flatten().for_each(|(_, value)| inside(value, of)),
            Kind::List(of) => value.as_array().into_iter().flatten().for_each(|value| inside(value, of)),
            _ => {}
        }
    }
}

#[test]
fn links_lead_somewhere() {
    let pages = pages();
    for (path, page) in &pages {
        for link in page.links.iter().filter(|link| !link.contains("://")) {
            let (file, anchor) = link.split_once('#').map_or((&**link, None), |(file, anchor)| (file, Some(anchor)));
            let target = if file.is_empty() { path.clone() } else { path.parent().expect("a file").join(file) };
            assert!(target.exists(), "{}: there is no {link}", path.display());
            let Some(anchor) = anchor else { continue };
            let text = fs::read_to_string(&target).unwrap_or_default();
            let found = Markdown::new(&text).anchors.iter().any(|found| found == anchor);
            assert!(found, "{}: {file} has no heading for #{anchor}", path.display());
        }
    }
}

#[test]
fn every_page_can_be_reached() {
    let index = repository().join("docs/README.md");
    let text = fs::read_to_string(&index).expect("the manual has an index");
    let links = Markdown::new(&text).links;
    for (path, _) in pages().iter().filter(|(path, _)| *path != index && path.starts_with(repository().join("docs"))) {
        let name = path.file_name().expect("a file").to_string_lossy();
        assert!(links.iter().any(|link| *link == name), "docs/README.md does not link {name}");
    }
}

/// The README and the manual.
fn pages() -> Vec<(PathBuf, Markdown)> {
    let folder = repository().join("docs");
    let mut paths: Vec<_> =
        fs::read_dir(folder).expect("there is a manual").flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    paths.sort();
    paths.insert(0, repository().join("README.md"));
    let read = |path: PathBuf| {
        let text = fs::read_to_string(&path).expect("pages are text");
        (path, Markdown::new(&text))
    };
    paths.into_iter().map(read).collect()
}
