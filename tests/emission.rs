//! Does what the compiler writes parse, compile without a warning and run, whatever the names and shapes?

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use dpc_codegen::Build;
use dpc_codegen::build::Failure;
use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::Source;
use dpc_codegen::emit::Emitted;
use dpc_codegen::spec::Spec;
use dpc_tests::{cases, lower, read, root, sparsely};

#[test]
fn the_same_text_gives_the_same_bytes_wherever_the_file_is() {
    for (case, first) in networks() {
        // Files that the text names have to be found from there.
        let folder = if Spec::files(case).is_empty() { Path::new("/somewhere/else") } else { root() };
        let path = folder.join(&case.path).to_string_lossy().into_owned();
        let elsewhere = Source { path, text: case.text.clone() };
        let again = emitted(&elsewhere).expect("the design that existed a moment ago");
        assert_eq!(first.files, again.files, "{}", case.path);
    }
}

#[test]
fn every_file_parses_and_begins_with_a_plain_comment() {
    for (case, emitted) in networks() {
        for (name, text) in &emitted.files {
            syn::parse_file(text).unwrap_or_else(|error| panic!("{} {name}: {error}", case.path));
            assert!(text.starts_with("// Controller"), "{} {name}", case.path);
            assert!(!text.contains("//!"), "{} {name}: inner comments cannot be included", case.path);
            assert!(!text.contains("NaN") && !text.contains('\r'), "{} {name}", case.path);
        }
    }
}

/// A crate of its own, as a user would make it: out of `OUT_DIR`, in a binary, with every warning an error.
#[test]
fn odd_names_and_shapes_compile_without_a_warning_and_run() {
    let package = package();
    let lint = if cargo(&package, &["clippy", "--version"]).is_ok() { "clippy" } else { "check" };
    cargo(&package, &[lint, "--offline", "--quiet"]).unwrap_or_else(|errors| panic!("{errors}"));
    let output = cargo(&package, &["run", "--offline", "--quiet"]).unwrap_or_else(|errors| panic!("{errors}"));
    let sizes: Vec<usize> = output.lines().map(|line| line.parse().expect("a size in bytes")).collect();
    let odd = networks().iter().find(|(case, _)| case.path.ends_with("odd.toml")).expect("a design exists");
    assert_eq!(sizes, odd.1.table_bytes);
}

/// The networks that a design exists for, of the accepted ones and of those with odd names, and what is written.
fn networks() -> &'static [(Source, Emitted)] {
    static NETWORKS: OnceLock<Vec<(Source, Emitted)>> = OnceLock::new();
    let networks = NETWORKS.get_or_init(|| {
        let all = cases("accept").into_iter().chain(cases("emit"));
        all.filter_map(|case| emitted(&case).map(|emitted| (case, emitted))).collect()
    });
    assert!(networks.len() > 3, "{}", networks.len());
    networks
}

fn emitted(case: &Source) -> Option<Emitted> {
    Design::new(case.clone()).ok().map(|design| Emitted::new(&design))
}

fn package() -> PathBuf {
    let package = Path::new(env!("CARGO_TARGET_TMPDIR")).join("odd");
    fs::create_dir_all(package.join("src")).expect("the target folder is writable");
    let folder = written("odd", &package).expect("a design exists");
    assert_eq!(folder, package.join("emitted/mod_"));
    let sparse = lower(read("cases/emit/odd.toml".as_ref())).ok().and_then(sparsely).expect("a design exists");
    Emitted::new(&sparse).write(&package.join("emitted/sparse")).expect("the target folder is writable");
    for case in ["started", "changing", "single"] {
        written(case, &package).expect("a design exists");
    }
    let runtime = root().parent().expect("the workspace").join("runtime");
    let manifest = format!(
        "[package]\nname = \"odd\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n[dependencies]\n\
         dpc-runtime = {{ path = {runtime:?} }}\n\n[workspace]\n"
    );
    for (name, text) in [("Cargo.toml", manifest.as_str()), ("build.rs", BUILD), ("src/main.rs", MAIN)] {
        fs::write(package.join(name), text).expect("the target folder is writable");
    }
    package
}

fn written(case: &str, package: &Path) -> Result<PathBuf, Failure> {
    Build::new(root().join(format!("cases/emit/{case}.toml"))).out_dir(package.join("emitted")).write()
}

/// What `dpc_codegen::Build` does, but for the design, which is made already.
const BUILD: &str = r#"
fn main() {
    for folder in ["mod_", "sparse", "started", "changing", "single"] {
        let out = std::path::PathBuf::from(std::env::var_os("OUT_DIR").unwrap()).join(folder);
        std::fs::create_dir_all(&out).unwrap();
        for file in std::fs::read_dir(std::path::Path::new("emitted").join(folder)).unwrap() {
            let file = file.unwrap();
            std::fs::copy(file.path(), out.join(file.file_name())).unwrap();
        }
    }
}
"#;

/// Every controller starts at rest, hears its neighbours and makes one step that carries the guarantee.
const MAIN: &str = r#"
mod controllers {
    dpc_runtime::include_controllers!("mod_");
}

/// As large networks are written.
mod sparse {
    dpc_runtime::include_controllers!("sparse");
}

mod started {
    dpc_runtime::include_controllers!("started");
}

mod changing {
    dpc_runtime::include_controllers!("changing");
}

/// Of the tables of a subsystem, and what they refer to.
macro_rules! bytes {
    ($node:ident) => {
        size_of_val(&$node::TABLES)
            + size_of_val($node::TABLES.problem.terminal)
            + size_of_val($node::TABLES.problem.gram)
    };
}

mod single {
    dpc_runtime::include_controllers!("single");
}

/// In single precision: a step towards a set-point in the plane, with a share of a coupling constraint.
fn single_precision() {
    use single::{line, plane};

    let rest: [f32; 3] = [0.5, -0.25, 1.0];
    let (mut first, from_plane) = plane::start(&plane::steady_state(&rest)).unwrap();
    let (_, from_line) = line::start(&line::steady_state(&rest)).unwrap();
    let mut inbox = plane::Inbox::new();
    inbox.accept(&plane::FROM_LINE, &from_line).unwrap();
    assert_eq!(from_plane.y_ref.len(), 2);
    let mut x: [f32; 2] = plane::steady_state(&rest).x;
    x[0] += 0.01;
    let step = first.step(&x, &[3.0, 1.0], &mut inbox);
    assert!(step.status.is_guaranteed() && step.message.y_ref[0] > 0.504, "{:?}", step.status);
}

/// Controllers of two designs in one process: what one writes, the other refuses.
fn refuse_strangers() {
    use controllers::{tanks_1_2, type_};
    use dpc_runtime::{Delivery, Refused};

    let rest = [0.5, 1.0, 0.5, 0.25, -1.0];
    let (mut controller, from_type) = type_::start(&type_::steady_state(&rest)).unwrap();
    let (_, from_tanks) = tanks_1_2::start(&tanks_1_2::steady_state(&rest)).unwrap();
    let (_, _, from_others) =
        started::tanks_1_2::start_planned(&started::tanks_1_2::START, &started::tanks_1_2::START_LOADS, &started::tanks_1_2::START_X)
            .unwrap();
    let designs = (type_::DESIGN, started::type_::DESIGN);
    assert_ne!(designs.0, designs.1);

    let mut inbox = type_::Inbox::new();
    let refused = type_::accept_bytes(&mut inbox, &started::tanks_1_2::to_bytes(&from_others));
    assert_eq!(refused, Err(Refused::OtherDesign { expected: designs.0, got: designs.1 }));
    let refused = type_::accept_bytes(&mut inbox, &type_::to_bytes(&from_type));
    assert_eq!(refused, Err(Refused::NotHeard { sender: type_::SENDER.place }));
    let status = controller.step(&type_::steady_state(&rest).x, &[1.0], &mut inbox).status;
    assert_eq!(status.deliveries, [Delivery::OtherDesign, Delivery::Missing]);

    let mut other = started::type_::Inbox::new();
    let refused = started::type_::accept_bytes(&mut other, &tanks_1_2::to_bytes(&from_tanks));
    assert_eq!(refused, Err(Refused::OtherDesign { expected: designs.1, got: designs.0 }));
    let refused = started::type_::accept_bytes(&mut other, &single::line::to_bytes(&single_message()));
    assert_eq!(refused, Err(Refused::OtherScalar { expected: 8, got: 4 }));
    started::type_::accept_bytes(&mut other, &started::tanks_1_2::to_bytes(&from_others)).unwrap();
}

fn single_message() -> single::line::Message {
    single::line::start(&single::line::steady_state(&[0.5, -0.25, 1.0])).unwrap().1
}

/// Rows that are redrawn by all members alike.
fn redraw_rows() {
    use changing::{lift, robot_1, robot_2};
    use dpc_runtime::{NotRedrawn, References};

    assert_eq!(robot_1::CHANGING, ["robots apart", "moving wall", "lift - robot-1 - robot-2"]);
    assert_eq!((robot_2::COUPLING, robot_2::CHANGING[1]), (["lift `above` robot-2"], "lift - robot-1 - robot-2"));
    let rest = [-2.0, 0.0, 2.0, 0.0, 1.0];
    let (mut first, from_first) = robot_1::start(&robot_1::steady_state(&rest)).unwrap();
    let (mut second, from_second) = robot_2::start(&robot_2::steady_state(&rest)).unwrap();
    let (_, from_lift) = lift::start(&lift::steady_state(&rest)).unwrap();
    let mut inbox = robot_1::Inbox::new();
    inbox.accept(&robot_1::FROM_ROBOT_2, &from_second).unwrap();
    inbox.accept(&robot_1::FROM_LIFT, &from_lift).unwrap();
    let mut other = robot_2::Inbox::new();
    other.accept(&robot_2::FROM_ROBOT_1, &from_first).unwrap();
    other.accept(&robot_2::FROM_LIFT, &from_lift).unwrap();

    // Apart by 0.5 along the first axis; a wall at -1.2; all of them together below 10.
    let drawn = robot_1::redraw(&mut first, &inbox, |row, meeting| match row {
        0 => {
            let pair = meeting.pair()?;
            assert_eq!((pair.first, pair.second), ([-2.0, 0.0], [2.0, 0.0]));
            Some(pair.apart(&[-1.0, 0.0], 0.5))
        }
        1 => Some(robot_1::HalfSpace { own: [1.0, 0.0], others: [0.0; 3], l: -1.2 }),
        _ => Some(robot_1::HalfSpace { own: [0.0, 0.5], others: [0.0, 0.5, 1.0], l: 10.0 }),
    });
    assert!(matches!(drawn, [Ok(()), Err(NotRedrawn::Exceeded { .. }), Ok(())]), "{drawn:?}");
    let status = first.clone().step(&robot_1::steady_state(&rest).x, &[3.0, 0.0], &mut inbox.clone()).status;
    assert_eq!(status.references, References::Undrawn { row: 1 });
    let drawn = robot_1::redraw(&mut first, &inbox, |row, _| {
        (row == 1).then_some(robot_1::HalfSpace { own: [1.0, 0.0], others: [0.0; 3], l: 1.5 })
    });
    assert_eq!(drawn[1], Ok(()));
    let step = first.step(&robot_1::steady_state(&rest).x, &[3.0, 0.0], &mut inbox);
    assert!(step.status.is_guaranteed() && step.message.y_ref[0] > -1.9, "{:?}", step.status);

    let drawn = robot_2::redraw(&mut second, &other, |row, meeting| match row {
        0 => meeting.pair().map(|pair| pair.apart(&[-1.0, 0.0], 0.5)),
        _ => Some(robot_2::HalfSpace { own: [0.0, 0.5], others: [0.0, 0.5, 1.0], l: 10.0 }),
    });
    assert_eq!(drawn, [Ok(()), Ok(())]);
    let step = second.step(&robot_2::steady_state(&rest).x, &[-3.0, 0.0], &mut other);
    assert!(step.status.is_guaranteed() && step.message.y_ref[0] < 1.9, "{:?}", step.status);
}

/// Starts away from rest, with loads in one subsystem and a measurement error in another.
fn start_away_from_rest() {
    use started::{con_, plane, tanks_1_2, type_};

    let (mut first, from_type) = type_::start_planned(&type_::START, &type_::START_X).unwrap();
    let loads = &tanks_1_2::START_LOADS;
    let (mut second, mut loads, from_tanks) =
        tanks_1_2::start_planned(&tanks_1_2::START, loads, &tanks_1_2::START_X).unwrap();
    let (mut third, from_plane) = plane::start_planned(&plane::START, &plane::START_X).unwrap();
    con_::start_planned(&con_::START, &con_::START_X).unwrap();
    assert!(plane::start_planned(&plane::START, &[-9.0, 9.0]).is_err());

    let mut inbox = type_::Inbox::new();
    inbox.accept(&type_::FROM_TANKS_1_2, &from_tanks).unwrap();
    inbox.accept(&type_::FROM_PLANE, &from_plane).unwrap();
    let step = first.step(&type_::START_X, &[1.0], &mut inbox);
    assert!(step.status.is_guaranteed(), "{:?}", step.status);

    let load = loads.admit(&tanks_1_2::START_LOADS);
    let step = second.step_under(&tanks_1_2::START_X, &[0.0], &load, &mut tanks_1_2::Inbox::new());
    assert!(load.within && step.status.is_guaranteed(), "{:?}", step.status);

    let mut inbox = plane::Inbox::new();
    inbox.accept(&plane::FROM_TYPE_, &from_type).unwrap();
    let measured = [plane::START_X[0] + 0.01, plane::START_X[1] - 0.02];
    let step = third.step(&measured, &[1.0, 2.0], &mut inbox);
    assert!(step.status.is_guaranteed(), "{:?}", step.status);
}

/// The firmware of one node includes one file.
#[allow(unused)]
mod node {
    include!(concat!(env!("OUT_DIR"), "/mod_/con_.rs"));
}

use controllers::{con_, plane, tanks_1_2, type_};

fn main() {
    start_away_from_rest();
    redraw_rows();
    single_precision();
    refuse_strangers();
    let rest = [0.5, 1.0, 0.5, 0.25, -1.0];
    let (mut first, from_type) = type_::start(&type_::steady_state(&rest)).unwrap();
    let (mut second, from_tanks) = tanks_1_2::start(&tanks_1_2::steady_state(&rest)).unwrap();
    let (mut third, from_plane) = plane::start(&plane::steady_state(&rest)).unwrap();
    let (mut fourth, _) = con_::start(&con_::steady_state(&rest)).unwrap();
    node::start(&node::steady_state(&rest)).unwrap();

    let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-11);
    let (dense, sparse) = (plane::steady_state(&rest), sparse::plane::steady_state(&rest));
    assert!(near(&dense.x, &sparse.x) && near(&dense.u, &sparse.u));
    let (dense, sparse) = (type_::steady_state(&rest), sparse::type_::steady_state(&rest));
    assert!(near(&dense.x, &sparse.x) && near(&dense.u, &sparse.u));
    assert!(dense.x.iter().chain(&dense.u).any(|value| value.abs() > 0.1));

    let mut inbox = type_::Inbox::new();
    inbox.accept(&type_::FROM_TANKS_1_2, &from_tanks).unwrap();
    inbox.accept(&type_::FROM_PLANE, &from_plane).unwrap();
    let step = first.step(&type_::steady_state(&rest).x, &[1.0], &mut inbox);
    assert!(step.status.is_guaranteed(), "{:?}", step.status);

    let step = second.step(&tanks_1_2::steady_state(&rest).x, &[0.0], &mut tanks_1_2::Inbox::new());
    assert!(step.status.is_guaranteed(), "{:?}", step.status);

    let mut inbox = plane::Inbox::new();
    inbox.accept(&plane::FROM_TYPE_, &from_type).unwrap();
    let step = third.step(&plane::steady_state(&rest).x, &[1.0, 2.0], &mut inbox);
    assert!(step.status.is_guaranteed(), "{:?}", step.status);

    let step = fourth.step(&con_::steady_state(&rest).x, &[3.0], &mut con_::Inbox::new());
    assert!(step.status.is_guaranteed(), "{:?}", step.status);

    println!("{}", bytes!(type_));
    println!("{}", bytes!(tanks_1_2));
    println!("{}", bytes!(plane));
    println!("{}", bytes!(con_));
}
"#;

/// Runs cargo in a package; returns what it printed, or its complaints.
fn cargo(package: &Path, arguments: &[&str]) -> Result<String, String> {
    let mut command = Command::new(env!("CARGO"));
    command.args(arguments).current_dir(package).env("RUSTFLAGS", "-D warnings").env_remove("CARGO_ENCODED_RUSTFLAGS");
    command.env("CARGO_TARGET_DIR", package.join("target"));
    let output = command.output().map_err(|error| error.to_string())?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if output.status.success() { Ok(text(&output.stdout)) } else { Err(text(&output.stderr)) }
}
