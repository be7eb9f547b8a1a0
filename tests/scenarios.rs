//! Is each mistake in a scenario explained well? One snapshot per file of `cases/scenario`, for a person to judge.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostics, Source, code};
use dpc_codegen::simulate::Scenario;
use dpc_tests::{cases, read, root};

#[test]
fn every_mistake_is_explained() {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("snapshots/scenario");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(|| {
        for case in cases("scenario") {
            insta::assert_snapshot!(stem(&case), mistakes(&case).render(&case, false));
        }
    });
}

#[test]
fn every_snapshot_has_its_case() {
    let cases: BTreeSet<_> = cases("scenario").iter().map(|case| format!("{}.snap", stem(case))).collect();
    let folder = fs::read_dir(root().join("snapshots/scenario")).expect("snapshots are committed");
    let snapshots: BTreeSet<_> =
        folder.map(|entry| entry.expect("a readable folder").file_name().to_string_lossy().into_owned()).collect();
    assert_eq!(snapshots.into_iter().filter(|name| name.ends_with(".snap")).collect::<BTreeSet<_>>(), cases);
}

#[test]
fn every_code_of_a_scenario_is_explained_by_a_case() {
    let shown: BTreeSet<_> =
        cases("scenario").iter().flat_map(|case| mistakes(case).0).map(|error| error.code).collect();
    let codes: BTreeSet<_> = code::SCENARIO.into_iter().collect();
    assert_eq!(codes.difference(&shown).collect::<Vec<_>>(), [] as [&&str; 0]);
}

#[test]
fn every_error_points_into_the_file_and_says_what_it_found() {
    for case in cases("scenario") {
        for error in mistakes(&case).0 {
            let (place, label) = error.labels.first().unwrap_or_else(|| panic!("{}: no place", case.path));
            assert!(place.start <= place.end && place.end <= case.text.len(), "{}: {place:?}", case.path);
            assert!(!label.is_empty(), "{}: {}", case.path, error.title);
        }
    }
}

/// A network whose constraints change cannot be simulated without a scenario; the message points into the network's file.
#[test]
fn without_a_scenario_a_rule_is_missing() {
    let mistakes = Scenario::visiting(robots()).expect_err("there are no rules");
    assert_eq!(mistakes.0.iter().map(|error| error.code).collect::<Vec<_>>(), [code::RULE]);
    let shown = mistakes.render(&robots().network.source, false);
    assert!(shown.contains("[[changing-constraint]]") && shown.contains("--scenario"), "{shown}");
}

fn mistakes(case: &Source) -> Diagnostics {
    let design = if stem(case).starts_with("robots") { robots() } else { tanks() };
    let folder = root().join("cases/scenario");
    Scenario::read(case, &folder, design).err().unwrap_or_else(|| panic!("{} was accepted", case.path))
}

fn robots() -> &'static Design {
    static DESIGN: OnceLock<Design> = OnceLock::new();
    DESIGN.get_or_init(|| design("../examples/robots/system.toml"))
}

fn tanks() -> &'static Design {
    static DESIGN: OnceLock<Design> = OnceLock::new();
    DESIGN.get_or_init(|| design("../examples/four_tank/system.toml"))
}

fn design(path: &str) -> Design {
    Design::new(read(Path::new(path))).expect("examples have designs")
}

fn stem(case: &Source) -> &str {
    let name = case.path.rsplit('/').next().unwrap_or(&case.path);
    name.strip_suffix(".toml").unwrap_or(name)
}
