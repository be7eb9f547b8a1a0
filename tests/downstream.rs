//! Does a crate outside of the workspace get its controllers from its build script: without a warning, again only where something
//! has changed, and with mistakes as errors of the compiler, where they are in the file?

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

use serde_json::Value;

/// `examples/downstream`, with lints that a user may have on, run as it is.
#[test]
fn a_downstream_crate_without_a_standard_library_builds_without_a_warning_and_runs() {
    let package = Package::new();
    for arguments in [&["clippy", "--all-targets", "--", "-D", "warnings"][..], &["test"], &["doc", "--no-deps"]] {
        let built = package.cargo(arguments);
        assert!(built.succeeded && !built.errors.contains("warning"), "{arguments:?}: {}", built.errors);
    }
}

#[test]
fn a_second_build_runs_nothing_and_a_touched_file_is_not_designed_again() {
    let package = Package::new();
    let first = package.built();
    let (script, design) = (first.script_run(), first.designed());
    let second = package.built();
    assert_eq!(second.script_run(), script, "the build script ran again");
    assert!(second.everything_fresh, "something was compiled again");

    let text = package.read("system.toml");
    package.write("system.toml", &text);
    let touched = package.built();
    assert!(touched.script_run() > script, "cargo does not look at the file's date any more");
    assert_eq!(touched.designed(), design, "designed again, or written");

    package.write("system.toml", &text.replace("[-60.0]", "[-50.0]"));
    let changed = package.built();
    assert!(changed.designed() > design, "a change was not noticed");
}

#[test]
fn mistakes_are_errors_of_the_compiler_with_their_places_in_the_file() {
    let package = Package::new();
    package.built();
    let text = package.read("system.toml");
    let mistaken = text.replace("sample-time = 60.0", "sample-tim = 60.0").replacen(
        "B = [[0.03], [0.0]]",
        "B = [[0.03], [\"0\"]]",
        1,
    );
    package.write("system.toml", &mistaken);
    let file = package.folder.join("system.toml");
    let at = |what: &str| {
        let before = &mistaken[..mistaken.find(what).expect("a mistake")];
        let line = before.lines().count().max(1) + usize::from(before.ends_with('\n'));
        format!("{}:{line}:", file.display())
    };
    let errors = package.errors();
    assert!(errors.len() >= 2, "{errors:#?}");
    let starts_with =
        |code: &str, place: &str| errors.iter().any(|error| error.starts_with(code) && error.contains(place));
    assert!(starts_with("E0102", &at("sample-tim =")), "{errors:#?}");
    assert!(starts_with("E0104", &at("B = [[0.03], [\"0\"]]")), "{errors:#?}");
    assert!(errors.iter().all(|error| error.starts_with("E0")), "nothing else is an error: {errors:#?}");

    // Also where the text is no TOML from there on.
    package.write("system.toml", &text.replacen("C = [[1.0, 0.0]]", "C = [[1.0, 0.0]", 1));
    let errors = package.errors();
    assert!(errors.len() == 1 && errors[0].starts_with("E0101"), "{errors:#?}");

    package.write("system.toml", &text);
    package.built();
}

#[test]
fn a_network_that_was_renamed_is_no_longer_included_by_its_old_name() {
    let package = Package::new();
    package.built();
    let text = package.read("system.toml");
    package.write("system.toml", &text.replace("\"greenhouses\"", "\"glass-houses\""));
    let errors = package.errors();
    assert!(errors.len() == 1 && errors[0].contains("\"glass_houses\""), "{errors:#?}");
}

#[test]
fn a_file_that_is_missing_or_nameless_fails_the_build_script() {
    let package = Package::new();
    fs::remove_file(package.folder.join("system.toml")).expect("a file in the target folder");
    let built = package.cargo(&["build"]);
    assert!(!built.succeeded && built.errors.contains("error: downstream@0.1.0: cannot read"), "{}", built.errors);
}

/// A copy of `examples/downstream` somewhere else.
struct Package {
    folder: PathBuf,
    /// The copy has one place, so that cargo builds its dependencies once.
    _alone: MutexGuard<'static, ()>,
}

struct Built {
    succeeded: bool,
    output: String,
    errors: String,
    everything_fresh: bool,
}

impl Package {
    fn new() -> Self {
        static ALONE: Mutex<()> = Mutex::new(());
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("downstream");
        let package = Self { folder, _alone: alone };
        for file in ["Cargo.toml", "Cargo.lock", "build.rs", "system.toml", "src/lib.rs"] {
            let text = fs::read_to_string(workspace.join("examples/downstream").join(file)).expect("an example");
            let text = text.replace("\"../../", &format!("\"{}/", workspace.display()));
            if package.folder.join(file).is_file() && package.read(file) == text {
                continue;
            }
            package.write(file, &text);
        }
        package
    }

    fn read(&self, file: &str) -> String {
        fs::read_to_string(self.folder.join(file)).expect("a file in the target folder")
    }

    /// Newer than what cargo has built of the file before, in whole seconds too.
    fn write(&self, file: &str, text: &str) {
        let path = self.folder.join(file);
        fs::create_dir_all(path.parent().expect("a folder")).expect("the target folder is writable");
        fs::write(path, text).expect("the target folder is writable");
    }

    fn cargo(&self, arguments: &[&str]) -> Built {
        let mut command = Command::new(env!("CARGO"));
        command.args(arguments).current_dir(&self.folder).env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
        command.env("CARGO_TARGET_DIR", Path::new(env!("CARGO_TARGET_TMPDIR")).join("users"));
        // The compiler unoptimised: it is built in a fifth of the time, and the designs here are small.
        command.env("CARGO_PROFILE_DEV_BUILD_OVERRIDE_OPT_LEVEL", "0");
        let output = command.output().expect("cargo runs");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Built {
            succeeded: output.status.success(),
            output: text(&output.stdout),
            errors: text(&output.stderr),
            everything_fresh: false,
        }
    }

    fn built(&self) -> Built {
        let mut built = self.cargo(&["build", "--message-format=json"]);
        assert!(built.succeeded, "{}", built.errors);
        built.everything_fresh = built.messages("compiler-artifact").iter().all(|message| message["fresh"] == true);
        built
    }

    /// What the compiler says that is wrong, the text before its own snippet.
    fn errors(&self) -> Vec<String> {
        let built = self.cargo(&["build", "--message-format=json"]);
        assert!(!built.succeeded);
        let messages = built.messages("compiler-message");
        let errors = messages.iter().filter(|message| message["message"]["level"] == "error");
        let text = |message: &Value| message["message"]["message"].as_str().unwrap_or_default().to_owned();
        errors.map(text).filter(|text| !text.starts_with("aborting due to")).collect()
    }
}

impl Built {
    fn messages(&self, reason: &str) -> Vec<Value> {
        let messages = self.output.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
        messages.filter(|message| message["reason"] == reason).collect()
    }

    fn out_dir(&self) -> PathBuf {
        let executed = self.messages("build-script-executed");
        let ours =
            executed.iter().find(|message| message["package_id"].as_str().is_some_and(|id| id.contains("downstream")));
        PathBuf::from(ours.expect("a build script")["out_dir"].as_str().expect("a folder"))
    }

    /// When cargo ran the build script.
    fn script_run(&self) -> SystemTime {
        date(&self.out_dir().with_file_name("output"))
    }

    /// When the controllers were written.
    fn designed(&self) -> SystemTime {
        date(&self.out_dir().join("greenhouses/east.rs"))
    }
}

fn date(path: &Path) -> SystemTime {
    fs::metadata(path).and_then(|file| file.modified()).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}
