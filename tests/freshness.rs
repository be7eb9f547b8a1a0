//! Is `generated/` what the compiler writes now? What its controllers take on the machines they were measured on depends on
//! compilers beside this one: `footprint.rs` looks at it.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use dpc_codegen::design::Design;
use dpc_codegen::emit::{Emitted, package_folder};
use dpc_codegen::footprint::without;
use dpc_codegen::network::Scalar;
use dpc_tests::{read, root};

/// Examples whose controllers are committed, in which scalar type.
const EXAMPLES: [(&str, Scalar); 2] = [("four_tank", Scalar::Double), ("four_tank", Scalar::Single)];

#[test]
fn generated_files_are_fresh() {
    for example in EXAMPLES {
        let (folder, emitted) = emitted(example);
        for (name, text) in &emitted.files {
            let committed = fs::read_to_string(folder.join(name)).unwrap_or_default();
            assert!(
                without(&committed) == *text,
                "{} is not what the compiler writes now; {}",
                folder.join(name).display(),
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
fn emitted((example, scalar): (&str, Scalar)) -> (PathBuf, Emitted) {
    let source = read(&PathBuf::from("../examples").join(example).join("system.toml"));
    let design = Design::in_scalar(source.clone(), scalar, None, &mut ());
    let design = design.unwrap_or_else(|errors| panic!("{}", errors.render(&source, false)));
    let folder = package_folder(&design.network);
    (root().join("../generated").join(folder), Emitted::new(&design))
}

fn refresh((example, scalar): (&str, Scalar)) -> String {
    let single = match scalar {
        Scalar::Double => String::new(),
        Scalar::Single => " --scalar f32".to_owned(),
    };
    format!(
        "refresh it with: .ci/metal keep, or cargo run --release -p dpc-codegen -- examples/{example}/system.toml{single} --measure"
    )
}
