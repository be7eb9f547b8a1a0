//! Has every code a page, whose wrong example is refused for that reason and whose right one is designed?

use std::collections::BTreeSet;

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostics, Source, code};
use dpc_codegen::explain::{PAGES, Page, nearest, page};
use dpc_codegen::simulate::Scenario;
use dpc_tests::{compile, root};

#[test]
fn every_code_has_a_page_and_every_page_a_code() {
    let codes: BTreeSet<&str> = code::ALL.into_iter().chain(code::NUMERICAL).chain(code::SCENARIO).collect();
    let pages: Vec<&str> = PAGES.iter().map(|page| page.code).collect();
    assert!(pages.is_sorted(), "{pages:?}");
    assert_eq!(pages.into_iter().collect::<BTreeSet<_>>(), codes);
}

#[test]
fn every_page_says_what_it_is_about_and_what_to_try() {
    for page in PAGES {
        assert!(page.text.starts_with(&format!("# {}: ", page.code)), "{}", page.code);
        assert!(page.text.contains("\n## What to try\n") && !page.title().is_empty(), "{}", page.code);
        let prose = page.text.split("## Wrong").next().unwrap_or_default();
        let longest = prose.lines().map(|line| line.chars().count()).max();
        assert!(longest <= Some(160), "{}: {longest:?}", page.code);
    }
}

#[test]
fn wrong_examples_are_refused_for_that_reason() {
    for page in PAGES {
        let Some(wrong) = page.wrong() else {
            assert!(code::NUMERICAL.contains(&page.code), "{} has no example", page.code);
            continue;
        };
        let Err(Diagnostics(mistakes)) = accepted(page, wrong) else { panic!("{} is accepted", page.code) };
        assert!(mistakes.iter().any(|mistake| mistake.code == page.code), "{}: {mistakes:?}", page.code);
    }
}

#[test]
fn right_examples_are_designed_or_can_be_simulated() {
    for page in PAGES {
        assert_eq!(page.wrong().is_some(), page.right().is_some(), "{}", page.code);
        let Some(right) = page.right() else { continue };
        if let Err(mistakes) = accepted(page, right) {
            panic!("{}: {mistakes}", page.code);
        }
    }
}

#[test]
fn examples_of_scenarios_are_scenarios() {
    for page in PAGES {
        assert_eq!(page.network().is_some(), code::SCENARIO.contains(&page.code), "{}", page.code);
    }
}

#[test]
fn pages_are_found_and_near_misses_are_suggested() {
    assert_eq!(page("e0104").map(|page| page.code), Some("E0104"));
    assert_eq!((page("E0199"), page("104")), (None, None));
    assert_eq!([nearest("104"), nearest("E0133"), nearest("0409")], [Some("E0104"), Some("E0132"), Some("E0407")]);
    assert_eq!([nearest("E9999"), nearest("weights"), nearest("")], [None; 3]);
}

/// An example of a page: a network, or a scenario for the network of the page. Files that it names are those of `cases/explain`.
fn accepted(page: &Page, example: &str) -> Result<(), Diagnostics> {
    let folder = root().join("cases/explain");
    let source = |name: &str, text: &str| Source {
        path: folder.join(format!("{}{name}.toml", page.code)).display().to_string(),
        text: text.to_owned(),
    };
    let Some(network) = page.network() else { return compile(source("", example)) };
    let design = Design::new(source("_network", network)).unwrap_or_else(|errors| panic!("{}: {errors}", page.code));
    Scenario::read(&source("", example), &folder, &design).map(drop)
}
