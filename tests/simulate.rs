//! Does a simulation run the emitted controllers, and say what they said?

use std::path::{Path, PathBuf};

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::Source;
use dpc_codegen::emit::Emitted;
use dpc_codegen::network::Scalar;
use dpc_codegen::simulate::{
    EventKind, Findings, Format, History, Library, Report, Scenario, Shared, Start, picture, run,
};
use dpc_runtime::{Control, Delivery, References};
use dpc_tests::{read, root};

/// The plant of the four-tank example, with the sums of its own program, under the emitted files that are compiled into this test.
mod tanks {
    use dpc_generated::four_tank::{left, right};

    const A: [[f64; 4]; 4] =
        [[0.9921, 0.0, 0.0, 0.0206], [0.0, 0.9835, 0.0, 0.0], [0.0, 0.0165, 0.9945, 0.0], [0.0, 0.0, 0.0, 0.9793]];
    const B: [[f64; 2]; 4] = [[0.0417, 2.47e-4], [0.0156, 0.0], [1.30e-4, 0.0311], [0.0, 0.0235]];

    /// States and inputs of one step.
    pub type Moment = ([f64; 4], [f64; 2]);

    /// From rest at 0; `before` may move the state before each step.
    pub fn run(
        steps: usize,
        set_points: impl Fn(usize) -> [f64; 2],
        before: impl Fn(usize, &mut [f64; 4]),
    ) -> Vec<Moment> {
        let (mut one, to_right) = left::start(&left::steady_state(&[0.0; 2])).expect("rest is a start");
        let (mut other, to_left) = right::start(&right::steady_state(&[0.0; 2])).expect("rest is a start");
        let (mut of_one, mut of_other) = (left::Inbox::new(), right::Inbox::new());
        let mut mail = (to_left, to_right);
        let mut x = [0.0; 4];
        let step = |step: usize| {
            before(step, &mut x);
            of_one.accept(&left::FROM_RIGHT, &mail.0).expect("in sequence");
            of_other.accept(&right::FROM_LEFT, &mail.1).expect("in sequence");
            let [y1, y2] = set_points(step);
            let a = one.step(&[x[0], x[1]], &[y1], &mut of_one);
            let b = other.step(&[x[2], x[3]], &[y2], &mut of_other);
            mail = (b.message, a.message);
            let (now, u) = (x, [a.input[0], b.input[0]]);
            x = std::array::from_fn(|k| dot(&A[k], &now) + dot(&B[k], &u));
            (now, u)
        };
        (0..steps).map(step).collect()
    }

    fn dot<const N: usize>(row: &[f64; N], x: &[f64; N]) -> f64 {
        row.iter().zip(x).map(|(a, b)| a * b).sum()
    }
}

#[test]
fn a_loaded_library_decides_as_the_emitted_files_do_bit_by_bit() {
    let text = "steps = 1000\n\
        subsystem.left.set-point.h1 = [{ at = 0.0, to = 1.0 }, { at = 150.0, to = 9.0 }, { at = 300.0, to = -1.0 }]\n\
        subsystem.right.set-point.h3 = [{ at = 0.0, to = 1.0 }, { at = 200.0, to = -1.0 }]\n\
        [[upset]]\nat = 100.0\nsubsystem = \"left\"\nby = [-4.0, 0.35]\n\
        [[upset]]\nat = 300.0\nsubsystem = \"right\"\nby = [4.0, -0.5]\n";
    let (history, _) = simulated(&design("../examples/four_tank/system.toml"), text);
    let of = |changes: &[(usize, f64)], step: usize| {
        changes.iter().rfind(|(from, _)| *from <= step).map_or(0.0, |(_, to)| *to)
    };
    let set_points = |step: usize| [of(&[(0, 1.0), (300, 9.0), (600, -1.0)], step), of(&[(0, 1.0), (400, -1.0)], step)];
    let upset = |step: usize, x: &mut [f64; 4]| match step {
        200 => (x[0], x[1]) = (x[0] - 4.0, x[1] + 0.35),
        600 => (x[2], x[3]) = (x[2] + 4.0, x[3] - 0.5),
        _ => {}
    };
    let expected = tanks::run(1000, set_points, upset);
    let [left, right] = &history.subsystems[..] else { panic!("two subsystems") };
    for (step, (x, u)) in expected.iter().enumerate() {
        let states =
            [&left.states[0], &left.states[1], &right.states[0], &right.states[1]].map(|c| c.values[step].to_bits());
        let inputs = [&left.inputs[0], &right.inputs[0]].map(|c| c.values[step].to_bits());
        assert_eq!((states, inputs), (x.map(f64::to_bits), u.map(f64::to_bits)), "step {step}");
    }
    let solved = history.subsystems.iter().flat_map(|track| &track.status);
    let solved = solved.filter(|status| matches!(status.control, Control::Optimal { active: 1.., .. })).count();
    assert!(solved > 50, "{solved} steps with active rows");
}

#[test]
fn troubles_are_named() {
    let design = design("../examples/four_tank/system.toml");
    let source = read(Path::new("../examples/four_tank/scenarios/troubles.toml"));
    let (history, findings) = simulated(&design, &source.text);
    let [left, right] = &findings.subsystems[..] else { panic!("two subsystems") };
    // The upset leaves no plan: a row says why, by its name, and the guarantee comes back.
    let first = &left.spells[0];
    assert_eq!((first.from, first.to.is_some()), (100, true));
    assert!(first.why.starts_with("infeasible: `") && first.why.contains(" at step "), "{}", first.why);
    assert!(matches!(history.subsystems[0].status[100].control, Control::Infeasible { .. }));
    // The message of 120 s, which is of step 240, is missed one step later; and the guarantee does not come back.
    assert_eq!((right.spells.len(), right.spells[0].from, right.spells[0].to), (1, 241, None));
    assert_eq!(right.spells[0].why, "message of `left` missing");
    assert_eq!(history.subsystems[1].status[241].deliveries, [Delivery::Missing]);
    assert!(history.subsystems[1].words[300].contains("guarantee lost until a new start"));
    // What is late is missing first, and refused when it comes.
    let late = history.events.iter().filter(|event| event.words == "message of `right` late by 2 periods").count();
    let refused = history.events.iter().filter(|event| event.words.starts_with("message of `right` refused")).count();
    assert!(late > 0 && refused == late, "{late} late, {refused} refused");
    assert!(findings.broken.is_empty() && !findings.is_guaranteed());
    let printed = Report { history: &history, findings: &findings }.to_string();
    for words in ["`left` loses it at step 100 (50 s)", "upset moves `h2` by 2 cm", "message of `left` lost"] {
        assert!(printed.contains(words), "{words} is not in\n{printed}");
    }
}

#[test]
fn limits_are_reached_and_kept_under_the_scenario_of_the_example() {
    let design = design("../examples/four_tank/system.toml");
    let source = read(Path::new("../examples/four_tank/scenarios/limits.toml"));
    let (_, findings) = simulated(&design, &source.text);
    assert!(findings.is_guaranteed() && findings.broken.is_empty());
    assert!(findings.subsystems.iter().all(|node| node.active > 50 && node.violations == 0), "{findings:?}");
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let design = design("../examples/four_tank/designs/disturbed.toml");
    let text = |seed: u64| {
        format!(
            "steps = 200\nseed = {seed}\n[subsystem.left]\ndisturbance = \"random\"\nmeasurement-error = \"worst-case\"\nset-point.h1 = \"random\"\n\
             [subsystem.right]\ndisturbance = \"worst-case\"\nmeasurement-error = \"random\"\n[[lost]]\nprobability = 0.01\n"
        )
    };
    let files = |seed: u64| {
        let (history, findings) = simulated(&design, &text(seed));
        assert!(findings.broken.is_empty());
        let mut files: Vec<Vec<u8>> =
            Format::ALL.iter().map(|format| format.bytes(&history).expect("written")).collect();
        files.push(picture(&history, 0).expect("drawn").into_bytes());
        files
    };
    let (one, again, other) = (files(1), files(1), files(2));
    assert!(one == again);
    assert!(one.iter().zip(&other).all(|(one, other)| one != other));
}

#[test]
fn tables_hold_what_happened() {
    let design = design("../examples/four_tank/system.toml");
    let (history, _) = simulated(&design, "steps = 30\nsubsystem.left.set-point.h1 = 1.0\n");
    let csv = String::from_utf8(Format::Csv.bytes(&history).expect("written")).expect("text");
    let mut lines = csv.lines();
    let names: Vec<&str> = lines.next().expect("a head").split(',').collect();
    for name in [
        "time [s]",
        "left.x.h2 [cm]",
        "right.u.v2 [V]",
        "left.set_point.h1 [cm]",
        "left.margin.h2 >= -1.4 cm [cm]",
        "left.status",
    ] {
        assert!(names.contains(&name), "{name} is not in {names:?}");
    }
    let k = names.iter().position(|name| *name == "left.u.v1 [V]").expect("an input");
    let written: Vec<u64> =
        lines.map(|line| line.split(',').nth(k).expect("a cell").parse::<f64>().expect("a number").to_bits()).collect();
    let values: Vec<u64> = history.subsystems[0].inputs[0].values.iter().map(|value| value.to_bits()).collect();
    assert_eq!(written, values);
    let json: serde_json::Value =
        serde_json::from_slice(&Format::Json.bytes(&history).expect("written")).expect("JSON");
    assert_eq!(json["subsystems"][0]["inputs"][0]["values"].as_array().map(Vec::len), Some(30));
    let npz = Format::Npz.bytes(&history).expect("written");
    assert!(npz.starts_with(b"PK") && npz.windows(13).any(|bytes| bytes == b"'descr': '<f8"));
}

/// Robots draw lines between them; a run of the paper's scenario, disturbed.
#[test]
fn robots_keep_their_distance() {
    let design = design("../examples/robots/system.toml");
    let source = read(Path::new("../examples/robots/scenarios/crossing.toml"));
    let (history, findings) = simulated(&design, &source.text);
    assert!(findings.is_guaranteed() && findings.broken.is_empty());
    assert_eq!(findings.couplings.len(), 3);
    assert!(findings.couplings.iter().all(|pair| pair.value >= 0.0), "{:?}", findings.couplings);
    let arrived = findings.subsystems.iter().flat_map(|node| &node.settlings).all(|one| one.after.is_some());
    assert!(arrived, "{:?}", findings.subsystems);
    // By the line of centres they stop for each other, which a status says, with the name of the constraint.
    let (stopped, findings) = simulated(&design, &source.text.replace("\"tangent\"", "\"apart\""));
    assert!(findings.is_guaranteed() && findings.couplings.iter().all(|pair| pair.value >= 0.0));
    let last = stopped.steps() - 1;
    let held =
        stopped.subsystems.iter().filter(|track| matches!(track.status[last].references, References::Deadlock { .. }));
    assert!(
        held.count() > 0
            && stopped.events.iter().any(|event| event.kind == EventKind::HeldUp && event.words.contains("robots "))
    );
    assert_eq!(history.steps(), 60);
}

#[test]
fn loads_are_followed() {
    let design = design("../examples/power_network/system.toml");
    let source = read(Path::new("../examples/power_network/scenarios/loads.toml"));
    let (history, findings) = simulated(&design, &source.text);
    assert!(findings.is_guaranteed() && findings.broken.is_empty());
    assert!(history.assumed.iter().all(|assumed| *assumed));
    // Beyond its bounds, a load is named.
    let (beyond, findings) = simulated(&design, "steps = 20\nsubsystem.area_1.loads.dPL = [{ at = 5.0, to = 0.3 }]\n");
    assert!(!findings.is_guaranteed());
    let event = beyond.events.iter().find(|event| event.kind == EventKind::Beyond).expect("noticed");
    assert_eq!((event.step, &*event.words), (5, "load `dPL` left its bounds or rates"));
    assert!(findings.subsystems[0].spells[0].why.contains("a load left its bounds or rates"));
}

/// Every plant of the examples, without a scenario.
#[test]
fn set_points_visit_the_ends_of_y() {
    for path in [
        "four_tank/system.toml",
        "four_tank/designs/started.toml",
        "power_network/system.toml",
        "mass_chain/system.toml",
    ] {
        let design = design(&format!("../examples/{path}"));
        let scenario = Scenario::visiting(&design).expect("no rule is needed");
        let history = of_scenario(&design, &scenario);
        let findings = Findings::new(&history, &design);
        assert!(findings.is_guaranteed() && findings.broken.is_empty(), "{path}");
        assert!(findings.subsystems.iter().all(|node| node.settlings.iter().any(|one| one.after.is_some())), "{path}");
        let planned = matches!(history.subsystems[0].status[0].references, References::Planned);
        assert_eq!(planned, design.start.is_some(), "{path}");
    }
}

#[test]
fn single_precision_runs_too() {
    let source = read(Path::new("../examples/four_tank/system.toml"));
    let design =
        Design::in_scalar(source, Scalar::Single, None, &mut ()).expect("there is a design in single precision");
    let (history, findings) = simulated(&design, "steps = 300\nsubsystem.left.set-point.h1 = 1.0\n");
    assert!(findings.is_guaranteed() && findings.broken.is_empty());
    let inputs = history.subsystems.iter().flat_map(|track| &track.inputs[0].values);
    assert!(inputs.into_iter().all(|u| f64::from(*u as f32) == *u), "inputs are of single precision");
}

/// A plant that is not the model is a disturbance that the design does not know of.
#[test]
fn another_plant_is_noticed() {
    let design = design("../examples/four_tank/system.toml");
    let text = read(Path::new("../examples/four_tank/system.toml")).text;
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("truth");
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("truth.toml"), text.replace("[0.0156]", "[0.0165]")).expect("a file");
    let source = Source {
        path: "truth".to_owned(),
        text: "steps = 200\nplant = \"truth.toml\"\nsubsystem.left.set-point.h1 = 1.0\n".to_owned(),
    };
    let scenario = Scenario::read(&source, &folder, &design).expect("the same network");
    let history = of_scenario(&design, &scenario);
    assert!(history.assumed[0] && !history.assumed[199]);
    let beyond = history.events.iter().find(|event| event.kind == EventKind::Beyond).expect("noticed");
    assert_eq!(&*beyond.words, "a disturbance acts, and the design knows of none");
}

#[test]
fn a_start_by_plan_is_followed() {
    let source = read(Path::new("../examples/four_tank/system.toml"));
    let design = Design::anywhere(source, None, &mut ()).expect("a design");
    let text = "steps = 300\nsubsystem.left.start.x0 = [-6.0, 0.5]\nsubsystem.right.start.x0 = [3.0, 0.0]\n";
    let source = Source { path: "start".to_owned(), text: text.to_owned() };
    let scenario = Scenario::read(&source, root(), &design).expect("a scenario");
    let Start::Planned(start) = &scenario.start else { panic!("x0 asks for a plan") };
    let plan = design.plan_from(start).expect("a plan leads from there");
    let design = Design { start: Some(plan), ..design };
    let history = of_scenario(&design, &scenario);
    let findings = Findings::new(&history, &design);
    assert!(findings.is_guaranteed() && findings.broken.is_empty());
    assert_eq!([0, 1].map(|k| history.subsystems[0].states[k].values[0]), [-6.0, 0.5]);
    assert_eq!(history.subsystems[0].status[0].references, References::Planned);
}

fn design(path: &str) -> Design {
    Design::new(read(Path::new(path))).expect("examples have designs")
}

fn simulated(design: &Design, text: &str) -> (History, Findings) {
    let source = Source { path: "scenario".to_owned(), text: text.to_owned() };
    let scenario = Scenario::read(&source, root(), design)
        .unwrap_or_else(|mistakes| panic!("{}", mistakes.render(&source, false)));
    let history = of_scenario(design, &scenario);
    let findings = Findings::new(&history, design);
    (history, findings)
}

/// With controllers from one cache that all tests share, and that stays.
fn of_scenario(design: &Design, scenario: &Scenario) -> History {
    let cache = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("controllers");
    let library = Library::of(design, &Emitted::new(design), &cache);
    library.build().unwrap_or_else(|error| panic!("{error}"));
    assert!(library.is_built());
    let mut controllers = Shared::load(&library, design).unwrap_or_else(|error| panic!("{error}"));
    run(design, scenario, &mut controllers, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"))
}
