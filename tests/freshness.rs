//! Is `generated/` what the compiler writes now? What its controllers take on the machines they were measured on depends on
//! compilers beside this one: `footprint.rs` looks at it.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use dpc_codegen::design::Design;
use dpc_codegen::emit::{Emitted, package_folder};
use dpc_codegen::footprint::without;
use dpc_tests::{read, root};

/// Examples whose controllers are committed.
const EXAMPLES: [&str; 1] = ["four_tank"];

#[test]
fn generated_files_are_fresh() {
    for example in EXAMPLES {
        let (folder, emitted) = emitted(example);
        for (name, text) in &emitted.files {
            let committed = fs::read_to_string(folder.join(name)).unwrap_or_default();
            assert!(
                without(&committed) == *text,
                "generated/{example}/{name} is not what the compiler writes now; {}",
                refresh(example)
            );
        }
    }
}

#[test]
fn nothing_else_is_generated() {
    for example in EXAMPLES {
        let (folder, emitted) = emitted(example);
        let written: BTreeSet<String> = emitted.files.into_iter().map(|(name, _)| name).collect();
        let present = fs::read_dir(folder).expect("generated controllers are committed");
        let present = present.map(|entry| entry.expect("a readable folder").file_name().to_string_lossy().into_owned());
        assert_eq!(present.collect::<BTreeSet<_>>(), written, "{}", refresh(example));
    }
}

/// What the compiler writes for an example, and where it is committed.
fn emitted(example: &str) -> (PathBuf, Emitted) {
    let source = read(&PathBuf::from("../examples").join(example).join("system.toml"));
    let design = Design::new(source.clone()).unwrap_or_else(|errors| panic!("{}", errors.render(&source, false)));
    (root().join("../generated").join(package_folder(&design.network)), Emitted::new(&design))
}

fn refresh(example: &str) -> String {
    format!(
        "refresh it with: .ci/metal keep, or cargo run --release -p dpc-codegen -- examples/{example}/system.toml --measure"
    )
}
