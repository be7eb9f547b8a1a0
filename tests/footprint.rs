//! Is every emitted controller a library that needs next to nothing, and do its figures hold?

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use dpc_codegen::design::Design;
use dpc_codegen::emit::Emitted;
use dpc_codegen::footprint::{Footprint, Measured, PROFILE, Target, Workshop, measure, runtime, source};
use dpc_tests::{lower, read, root, sparsely};

/// What the compiler itself asks for in code without a standard library, and every C library has.
const ALLOWED: [&str; 4] = ["memcpy", "memmove", "memset", "memcmp"];

/// The files that the examples emit controllers of.
const FILES: [&str; 9] = [
    "four_tank/system",
    "four_tank/designs/disturbed",
    "four_tank/designs/started",
    "power_network/system",
    "power_network/designs/unknown",
    "power_network/designs/exact",
    "power_network/designs/exact_unknown",
    "mass_chain/system",
    "robots/system",
];

/// Of a subsystem of the four-tank: 4 KiB of tables, 2 KiB of stack.
const MOST_CONSTANTS: u64 = 4096;
const MOST_STACK: u64 = 2048;

#[test]
fn no_controller_of_the_examples_can_panic_or_needs_more_than_memory_moves() {
    for file in FILES {
        let footprints = measured(&example(file), file, Emitted::new);
        footprints.iter().for_each(|footprint| assert_bare(footprint, file));
        if file == "four_tank/system" {
            footprints.iter().for_each(assert_small);
        }
    }
}

#[test]
fn neither_can_odd_names_and_shapes() {
    for (name, case) in [("odd", "odd"), ("started", "started"), ("changing", "changing")] {
        let design = Design::new(read(format!("cases/emit/{case}.toml").as_ref())).expect("a design exists");
        measured(&design, name, Emitted::new).iter().for_each(|footprint| assert_bare(footprint, name));
    }
    let sparse = lower(read("cases/emit/odd.toml".as_ref())).ok().and_then(sparsely).expect("a design exists");
    measured(&sparse, "sparse", Emitted::new).iter().for_each(|footprint| assert_bare(footprint, "sparse"));
}

/// What looks for panics, calls and recursion finds them where there are any.
#[test]
fn a_panic_a_call_and_a_recursion_are_found() {
    let design = example("four_tank/system");
    let panicking =
        measured(&design, "panicking", |design| spoilt(design, "assert!(outputs[outputs[0] as usize] < 9.0);"));
    assert!(panicking.iter().all(|footprint| !footprint.panics.is_empty()), "{panicking:?}");
    let calling = "if outputs[0] % 0.3 > 0.2 { return SteadyState { x: [1.0; NX], u: [1.0; NU] } }";
    let calling = measured(&design, "calling", |design| spoilt(design, calling));
    assert!(calling.iter().all(|footprint| footprint.unmeasured.iter().any(|name| name == "fmod")), "{calling:?}");
    let recursive = "#[inline(never)] fn deep(n: u64) -> u64 { if n < 2 { n } else { down(n - 1) + down(n / 2) } }\n    \
                     #[inline(never)] fn down(n: u64) -> u64 { if n < 3 { 1 } else { deep(n - 2) * deep(n / 3) } }\n    \
                     if deep(outputs[0] as u64) > 9 { return SteadyState { x: [1.0; NX], u: [1.0; NU] } }";
    let emitted = spoilt(&design, recursive);
    let refused = try_measured(&design, &emitted, "recursive");
    assert!(refused.as_ref().is_err_and(|error| error.contains("may call itself")), "{refused:?}");
}

/// A program that runs steps on a stack of its own and looks how much of it has lost its paint.
#[test]
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
fn no_step_takes_more_stack_than_its_bound() {
    for (file, name, scale) in [("four_tank/system", "four_tank", "6.0"), ("mass_chain/system", "mass_chain", "0.2")] {
        let design = example(file);
        let bound = measured(&design, file, Emitted::new)[0].step_stack;
        let package = painted(&design, name, scale);
        let output = Command::new(env!("CARGO"))
            .args(["run", "--release", "--offline", "--quiet", "--manifest-path"])
            .arg(package.join("Cargo.toml"))
            .arg("--target-dir")
            .arg(package.join("target"))
            .env_remove("CARGO_ENCODED_RUSTFLAGS")
            // As it is measured: frames that say all they touch.
            .env("RUSTFLAGS", "-C no-redzone")
            .output()
            .expect("cargo runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).expect("numbers");
        let [solved, touched]: [u64; 2] = text
            .split_whitespace()
            .map(|word| word.parse().expect("a number"))
            .collect::<Vec<_>>()
            .try_into()
            .expect("two numbers");
        assert!(solved > 50, "{file}: {solved} steps that solve");
        println!("{file}: {touched} bytes of stack touched, {bound} is the bound");
        // A memcpy at the end of the chain comes on top, as the header says.
        assert!(touched <= bound + 64 && 2 * touched > bound, "{file}: touched {touched} of {bound} bytes");
    }
}

/// The headers of `generated/` say what is measured now, up to a tenth, if this is the compiler they were measured with.
#[test]
fn the_committed_headers_hold() {
    let design = example("four_tank/system");
    let mut emitted = Emitted::new(&design);
    let alone = CARGO.lock().unwrap_or_else(PoisonError::into_inner);
    let measured = Measured::new(&design, &emitted, &[Target::HOST], &workshop("four_tank/system"));
    drop(alone);
    measured.expect("cargo builds").note(&mut emitted);
    for (name, text) in emitted.files.iter().skip(1) {
        let committed = fs::read_to_string(root().join("../generated/four_tank").join(name)).expect("it is committed");
        let host = Target::HOST.name().expect("rustc runs");
        let (now, then) = (row(text, &host).expect("just noted"), row(&committed, &host));
        let then = then.unwrap_or_else(|| panic!("{name} does not say what it takes on {host}: .ci/metal keep"));
        if now[1] != then[1] {
            println!("{name} was measured with rustc {}", then[1]);
            continue;
        }
        let numbers = |row: &[String]| row[2..].iter().map(|word| word.parse().expect("bytes")).collect::<Vec<f64>>();
        for (now, then) in numbers(&now).iter().zip(numbers(&then)) {
            assert!((now - then).abs() <= 0.1 * then + 64.0, "{name}: {now} bytes now, {then} then: .ci/metal keep");
        }
    }
}

/// The words of a target's line in a header.
fn row(text: &str, target: &str) -> Option<Vec<String>> {
    let line = text.lines().find(|line| line.starts_with(&format!("//     {target} ")))?;
    Some(line.split_whitespace().skip(1).map(str::to_owned).collect())
}

fn assert_bare(footprint: &Footprint, file: &str) {
    assert!(footprint.panics.is_empty(), "{file}: {:?}", footprint.panics);
    let mut foreign = footprint.foreign.clone();
    foreign.retain(|name| !ALLOWED.contains(&name.as_str()));
    assert!(foreign.is_empty(), "{file} needs {foreign:?}");
    assert!(footprint.unmeasured.is_empty(), "{file}: nobody knows the stack of {:?}", footprint.unmeasured);
}

fn assert_small(footprint: &Footprint) {
    assert!(footprint.constants < MOST_CONSTANTS, "{footprint:?}");
    assert!(footprint.step_stack.max(footprint.start_stack) < MOST_STACK, "{footprint:?}");
}

fn example(file: &str) -> Design {
    let source = read(format!("../examples/{file}.toml").as_ref());
    Design::new(source.clone()).unwrap_or_else(|errors| panic!("{}", errors.render(&source, false)))
}

/// Held by whoever uses the one folder of what cargo makes.
static CARGO: Mutex<()> = Mutex::new(());

fn measured(design: &Design, name: &str, emit: impl Fn(&Design) -> Emitted) -> Vec<Footprint> {
    try_measured(design, &emit(design), name).unwrap_or_else(|error| panic!("{error}"))
}

fn try_measured(design: &Design, emitted: &Emitted, name: &str) -> Result<Vec<Footprint>, String> {
    let _alone = CARGO.lock().unwrap_or_else(PoisonError::into_inner);
    measure(design, emitted, &Target::HOST, &workshop(name))
}

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("footprint").join(name)
}

fn workshop(name: &str) -> Workshop {
    Workshop { packages: folder("packages").join(name), out: folder("target") }
}

/// What is emitted, with `statement` at the beginning of `steady_state`.
fn spoilt(design: &Design, statement: &str) -> Emitted {
    let mut emitted = Emitted::new(design);
    let head = "pub fn steady_state(outputs: &[f64; NETWORK_NY]) -> SteadyState {";
    for (name, text) in emitted.files.iter_mut().skip(1) {
        assert!(text.contains(head), "{name}");
        *text = text.replace(head, &format!("{head}\n    {statement}"));
    }
    emitted
}

/// The package of a program that makes steps of the first subsystem from states up to `scale` off its reference.
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
fn painted(design: &Design, name: &str, scale: &str) -> PathBuf {
    let package = folder("painted").join(name);
    let node = "[package]\nname = \"node\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n[dependencies]\n".to_owned()
        + &runtime();
    let root = format!(
        "[package]\nname = \"painted\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n[workspace]\n\n\
         [dependencies]\nnode = {{ path = \"node\" }}\n{}\n{PROFILE}",
        runtime()
    );
    let files = [
        ("Cargo.toml", root),
        ("src/main.rs", PAINTED.replace("SCALE", scale)),
        ("node/Cargo.toml", node),
        ("node/src/lib.rs", source(design, 0, "controller.rs".as_ref())),
        ("node/src/controller.rs", Emitted::new(design).files[1].1.clone()),
    ];
    for (name, text) in files {
        let path = package.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("the target folder is writable");
        fs::write(path, text).expect("the target folder is writable");
    }
    package
}

/// What it does.
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
const PAINTED: &str = r#"
use std::arch::asm;
use std::mem::MaybeUninit;

use dpc_runtime::Control;
use node::controller::{Inbox, NETWORK_NY, NX, NY, Step, start, steady_state};

const PAINT: u8 = 0xa5;

fn main() {
    let (mut controller, _) = start(&steady_state(&[0.0; NETWORK_NY])).unwrap();
    let mut inbox = Inbox::new();
    let mut stack = vec![PAINT; 1 << 16];
    let top = stack.as_mut_ptr().wrapping_add(1 << 16).map_addr(|top| top & !15);
    let (mut seed, mut solved) = (1_u64, 0);
    for _ in 0..400 {
        let x: [f64; NX] = std::array::from_fn(|_| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            SCALE * ((seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
        });
        let set_point = [0.0; NY];
        let mut step = MaybeUninit::<Step>::uninit();
        // SAFETY: the stack is long enough, nothing else uses it, and the function gets what it asks for.
        let step = unsafe {
            asm!(
                "mov r12, rsp", "mov rsp, {top}", "call {step}", "mov rsp, r12",
                top = in(reg) top, step = sym node::dpc_step, out("r12") _,
                in("rdi") &raw mut controller, in("rsi") &raw const x, in("rdx") &raw const set_point,
                in("rcx") &raw mut inbox, in("r8") step.as_mut_ptr(), clobber_abi("C"),
            );
            step.assume_init()
        };
        solved += u32::from(step.status.control != Control::AtReference);
    }
    let untouched = stack.iter().take_while(|byte| **byte == PAINT).count();
    println!("{solved} {}", top.addr() - stack.as_ptr().addr() - untouched);
}
"#;
