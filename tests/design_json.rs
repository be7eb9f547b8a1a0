//! Does `design.json` say what the design is, in the order that is documented?

use dpc_codegen::design::Design;
use dpc_codegen::export::design_json;
use dpc_tests::{cases, read, root};
use nalgebra::DMatrix;
use serde_json::Value;

#[test]
fn the_format_is_stable() {
    let design = design("cases/accept/four_tank_blocks.toml");
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path(root().join("snapshots/design_json"));
    settings.set_prepend_module_to_snapshot(false);
    settings.bind(|| insta::assert_snapshot!("four_tank", design_json(&design)));
}

#[test]
fn every_documented_key_is_there_in_its_order() {
    let documented = include_str!("../compiler/design-json.md");
    let text = design_json(&design("cases/emit/odd.toml"));
    let tables: Vec<Vec<&str>> = documented.split("\n| key |").skip(1).map(keys_of_table).collect();
    let [network, subsystem, coupling, changing] = &tables[..] else { panic!("four tables, got {}", tables.len()) };
    let document: Value = serde_json::from_str(&text).expect("valid JSON");
    assert_eq!(keys(&document, &text), *network);
    for part in document["subsystems"].as_array().expect("a list") {
        assert_eq!(keys(part, &text), *subsystem);
    }
    assert_eq!(keys(&document["coupling_constraints"][0], &text), *coupling);
    let text = design_json(&design("cases/emit/changing.toml"));
    let document: Value = serde_json::from_str(&text).expect("valid JSON");
    let rows = document["changing_constraints"].as_array().expect("a list");
    assert_eq!(keys(&document, &text), *network);
    assert_eq!(keys(&rows[0], &text), *changing);
    assert_eq!(rows[0]["name"], "robots apart");
    let (_, after) = text.split_once("\"changing_constraints\"").expect("the key");
    assert_eq!(keys(&rows[0]["generators"], after), ["robot-1", "robot-2"]);
}

#[test]
fn numbers_read_back_to_the_same_bits() {
    for case in cases("accept").into_iter().chain(cases("emit")) {
        let Ok(design) = Design::new(case.clone()) else { continue };
        let document: Value = serde_json::from_str(&design_json(&design)).expect("valid JSON");
        assert_eq!(document["epsilon"].as_f64(), Some(design.sizing.epsilon));
        for (i, (model, gains)) in design.network.subsystems.iter().zip(&design.gains.subsystems).enumerate() {
            let part = &document["subsystems"][i];
            let sizes = &design.sizing.subsystems[i];
            assert_eq!(part["name"].as_str(), Some(model.name.as_str()));
            for (key, matrix) in [("A", &model.A), ("B", &model.B), ("C", &model.C), ("E", &model.E), ("T", &model.T)] {
                assert_eq!(rows(&part[key]), rows_of(matrix), "{} {key}", case.path);
            }
            for (key, matrix) in [("K", &gains.K), ("Kx", &gains.Kx), ("Ke", &gains.Ke), ("P", &gains.P)] {
                assert_eq!(rows(&part[key]), rows_of(matrix), "{} {key}", case.path);
            }
            assert_eq!(rows(&part["x_hat"]["H"]), rows_of(&sizes.X_nom.H), "{}", case.path);
            assert_eq!(numbers(&part["u_hat"]["h"]), sizes.U_nom.h.as_slice(), "{}", case.path);
            let generators = design.network.changing_constraints.iter().position(|c| c.members.contains(&i));
            if let Some(h) = generators {
                let written = rows(&document["changing_constraints"][h]["generators"][&model.name]);
                let exposed: Vec<_> = sizes.exposed.generators.iter().map(|g| g.as_slice().to_vec()).collect();
                assert_eq!(written, exposed, "{}", case.path);
            }
            let both: Vec<f64> = sizes.Sigma.q.iter().chain(&sizes.Sigma.q).copied().collect();
            assert_eq!(numbers(&part["sigma"]["h"]), both, "{}", case.path);
            let ends: Vec<f64> = sizes.Y.max.iter().copied().chain(sizes.Y.min.iter().map(|end| 0.0 - end)).collect();
            assert_eq!(numbers(&part["y_set"]["h"]), ends, "{}", case.path);
        }
    }
}

fn design(case: &str) -> Design {
    let source = read(case.as_ref());
    Design::new(source.clone()).unwrap_or_else(|errors| panic!("{}", errors.render(&source, false)))
}

/// First column of the table that begins the text; a cell may hold several keys.
fn keys_of_table(text: &str) -> Vec<&str> {
    let rows = text.lines().skip(2).take_while(|line| line.starts_with('|'));
    rows.flat_map(|line| line.split('|').nth(1).unwrap_or_default().split('`').skip(1).step_by(2)).collect()
}

/// Keys of an object in the order of the text; `serde_json` sorts them.
fn keys<'v>(object: &'v Value, text: &str) -> Vec<&'v str> {
    let mut keys: Vec<&str> = object.as_object().expect("an object").keys().map(String::as_str).collect();
    keys.sort_by_key(|key| text.find(&format!("\"{key}\":")));
    keys
}

fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().expect("a list of rows").iter().map(numbers).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|number| number.as_f64().expect("a number")).collect()
}

fn rows_of(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}
