//! Is each rejected file explained well? One snapshot per file of `cases/reject`, for a person to judge.

use std::collections::BTreeSet;
use std::fs;

use dpc_codegen::diagnostic::{Diagnostics, Source};
use dpc_tests::{cases, compile, root};

#[test]
fn every_rejected_file_is_explained() {
    let settings = settings();
    settings.bind(|| {
        for case in cases("reject") {
            let errors = compile(case.clone()).err().unwrap_or_else(|| panic!("{} was accepted", case.path));
            insta::assert_snapshot!(stem(&case), errors.render(&case, false));
        }
    });
}

#[test]
fn every_snapshot_has_its_case() {
    let cases: BTreeSet<_> = cases("reject").iter().map(|case| format!("{}.snap", stem(case))).collect();
    let folder = fs::read_dir(root().join("snapshots/reject")).expect("snapshots are committed");
    let snapshots: BTreeSet<_> = folder
        .map(|entry| entry.expect("a readable folder").file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".snap"))
        .collect();
    assert_eq!(snapshots, cases);
}

#[test]
fn every_error_points_into_the_file_and_says_what_it_found() {
    for case in cases("reject") {
        let Diagnostics(errors) = compile(case.clone()).expect_err("rejected");
        for error in errors {
            let (place, label) = error.labels.first().unwrap_or_else(|| panic!("{}: no place", case.path));
            assert!(place.start <= place.end && place.end <= case.text.len(), "{}: {place:?}", case.path);
            assert!(!label.is_empty(), "{}: {}", case.path, error.title);
        }
    }
}

#[test]
fn every_code_is_explained_by_a_case() {
    let rejected = cases("reject").into_iter().filter_map(|case| compile(case).err());
    let shown: BTreeSet<_> = rejected.flat_map(|Diagnostics(errors)| errors).map(|error| error.code).collect();
    let codes: BTreeSet<_> = dpc_codegen::diagnostic::code::ALL.into_iter().collect();
    assert_eq!(codes.difference(&shown).collect::<Vec<_>>(), [] as [&&str; 0]);
}

#[test]
fn styling_changes_nothing_but_the_colours() {
    for case in cases("reject") {
        let errors = compile(case.clone()).expect_err("rejected");
        assert_eq!(without_escapes(&errors.render(&case, true)), errors.render(&case, false));
    }
}

/// A missing or different snapshot fails; `INSTA_UPDATE=always cargo test -p dpc-tests` accepts what is printed now.
fn settings() -> insta::Settings {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("snapshots/reject");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings
}

fn stem(case: &Source) -> &str {
    let name = case.path.rsplit('/').next().unwrap_or(&case.path);
    name.strip_suffix(".toml").unwrap_or(name)
}

fn without_escapes(styled: &str) -> String {
    let mut parts = styled.split("\u{1b}[");
    let first = parts.next().unwrap_or_default().to_string();
    parts.fold(first, |text, part| text + part.split_once('m').map_or(part, |(_, rest)| rest))
}
