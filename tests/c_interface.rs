//! Do the controllers say the same in C and in Python as in Rust, bit for bit, and do their functions refuse what they must?

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

use dpc_codegen::c_library;
use dpc_codegen::design::Design;
use dpc_codegen::emit::Emitted;
use dpc_codegen::emit::c::Package;
use dpc_codegen::footprint::{Target, Workshop, needs};
use dpc_codegen::network::Scalar;
use dpc_tests::{read, root, tank_runs};

/// What a static library may ask of whoever links it.
const ALLOWED: [&str; 4] = ["memcpy", "memmove", "memset", "memcmp"];

/// Packages are built one after the other.
static BUILDING: Mutex<()> = Mutex::new(());

#[test]
fn the_example_in_c_computes_the_bits_of_rust() {
    if !has("cc") || !has("make") || !has("c++") {
        return;
    }
    for (scalar, expected) in runs() {
        let (package, out) =
            (package("../examples/four_tank/system.toml", scalar), folder(&format!("c_{}", scalar.name())));
        let example = root().join("../examples/c");
        let variables = [format!("PACKAGE={}", package.display()), format!("OUT={}", out.display())];
        let make =
            |target: &str| run(Command::new("make").arg("-C").arg(&example).args(&variables).args(["-s", target]));
        make("headers");
        assert_same(&make("run"), &expected, scalar);
    }
}

#[test]
fn the_example_in_python_computes_the_bits_of_rust() {
    if !has("python3") {
        return;
    }
    for (scalar, expected) in runs() {
        let package = package("../examples/four_tank/system.toml", scalar);
        let program = root().join("../examples/python/four_tank.py");
        assert_same(&run(Command::new("python3").arg(program).arg(package)), &expected, scalar);
    }
}

/// Three networks in one program: starts with plans, loads, rows that change, and mistakes of every kind.
#[test]
fn functions_do_what_the_headers_say() {
    if !has("cc") {
        return;
    }
    let networks = ["../examples/four_tank/system.toml", "cases/emit/started.toml", "cases/emit/changing.toml"];
    let packages = networks.map(|file| package(file, Scalar::Double));
    let program = folder("c_program").join("program");
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic"]);
    compiler.args(packages.iter().map(|package| format!("-I{}", package.join("include").display())));
    compiler.arg(root().join("cases/c/program.c"));
    compiler.args(packages.iter().flat_map(|package| {
        let files = fs::read_dir(package.join("lib")).expect("a library was built");
        let paths = files.map(|file| file.expect("a readable folder").path());
        paths.filter(|path| path.extension().is_some_and(|extension| extension == "a")).collect::<Vec<_>>()
    }));
    run(compiler.arg("-o").arg(&program));
    let printed = run(&mut Command::new(&program));
    assert!(printed.ends_with("all checks passed\n"), "{printed}");
}

/// On this machine; `.ci/metal` looks at others.
#[test]
fn static_libraries_cannot_panic_and_need_nothing() {
    for (file, prefix) in [
        ("../examples/four_tank/system.toml", "four_tank_"),
        ("cases/emit/started.toml", "started_"),
        ("cases/emit/changing.toml", "changing_"),
    ] {
        let library = package(file, Scalar::Double).join("lib").join(format!("lib{}.a", prefix.trim_end_matches('_')));
        let needs = needs(&library, prefix).expect("a library was built");
        assert!(needs.panics.is_empty(), "{prefix}: {:?}", needs.panics);
        assert!(needs.foreign.iter().all(|name| ALLOWED.contains(&name.as_str())), "{prefix}: {:?}", needs.foreign);
    }
}

#[test]
fn the_same_design_gives_the_same_package() {
    let design = design("cases/emit/odd.toml", Scalar::Double);
    let emitted = Emitted::new(&design);
    let (first, again) = (Package::new(&design, &emitted), Package::new(&design, &emitted));
    assert_eq!(first.files, again.files);
    let mut names = first.prefixes.clone();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), design.network.subsystems.len());
    for (name, text) in first.files.iter().filter(|(name, _)| name.ends_with(".rs")) {
        syn::parse_file(text).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

/// The lines that the examples print, as Rust makes them.
fn runs() -> [(Scalar, String); 2] {
    let lines = |run: Vec<tank_runs::Line>, digits: usize| {
        run.iter().fold(String::new(), |mut text, line| {
            let _ = writeln!(
                text,
                "{:0digits$x} {:0digits$x}  {} {}",
                line.bits[0], line.bits[1], line.controls[0], line.controls[1]
            );
            text
        })
    };
    [(Scalar::Double, lines(tank_runs::double(), 16)), (Scalar::Single, lines(tank_runs::single(), 8))]
}

/// Bits and control codes; the rest of a line is for people.
fn assert_same(printed: &str, expected: &str, scalar: Scalar) {
    assert!(!printed.contains("NOT"), "{printed}");
    assert_eq!(printed.lines().count(), expected.lines().count());
    for (printed, expected) in printed.lines().zip(expected.lines()) {
        let got = printed.split_once(" V  v2").and_then(|(_, rest)| rest.split_once(" V  "));
        let got = got.map(|(_, rest)| rest.trim_end_matches("guaranteed").trim()).unwrap_or_default();
        assert_eq!(got, expected, "{} in {printed}", scalar.name());
    }
}

fn design(file: &str, scalar: Scalar) -> Design {
    let source = read(file.as_ref());
    let design = Design::in_scalar(source.clone(), scalar, None, &mut ());
    design.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(&source, false)))
}

/// The package of a network, built.
fn package(file: &str, scalar: Scalar) -> PathBuf {
    let _building = BUILDING.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let design = design(file, scalar);
    let name = format!("{}_{}", design.network.name.replace('-', "_"), scalar.name());
    let package = folder(&format!("package_{name}"));
    let workshop = Workshop::new(folder(&format!("workshop_{name}")));
    c_library::write(&design, &Emitted::new(&design), &package, &Target::HOST, &workshop)
        .unwrap_or_else(|error| panic!("{error}"));
    package
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("c_interface").join(name);
    fs::create_dir_all(&folder).expect("the target folder is writable");
    folder
}

fn has(program: &str) -> bool {
    let found = Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success());
    if !found {
        eprintln!("skipped: there is no {program} here");
    }
    found
}

/// What a program prints; it must succeed.
fn run(command: &mut Command) -> String {
    let output = command.output().expect("a program that was found");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{command:?}\n{}{}", text(&output.stdout), text(&output.stderr));
    text(&output.stdout)
}
