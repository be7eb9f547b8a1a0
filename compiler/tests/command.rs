//! Does the command keep its promises: exit codes, files, and nothing written where anything is wrong?

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const GOOD: &str = include_str!("../../examples/four_tank/system.toml");

#[test]
fn a_good_file_is_designed_written_and_summarised() {
    let folder = Folder::new("good");
    fs::write(folder.0.join("system.toml"), GOOD).unwrap();
    let first = folder.run(&["system.toml", "--design", "deep/design.json"]);
    assert_eq!(first.status.code(), Some(0), "{}", stderr(&first));
    assert_eq!(folder.files("generated/four_tank"), ["left.rs", "mod.rs", "right.rs"]);
    assert_eq!(folder.files("deep"), ["design.json"]);
    let summary = stdout(&first);
    let longest = summary.lines().map(|line| line.chars().count()).max();
    assert!(longest <= Some(100), "{longest:?}: {summary}");
    for word in ["small gain", "eps", "h1 from", "facets", "inequalities", "bytes", "(25b)", "Sizing", "Written"] {
        assert!(summary.contains(word), "no {word} in {summary}");
    }
}

#[test]
fn the_second_run_changes_nothing() {
    let folder = Folder::new("again");
    fs::write(folder.0.join("system.toml"), GOOD).unwrap();
    let date = |folder: &Folder| fs::metadata(folder.0.join("out/left.rs")).unwrap().modified().unwrap();
    folder.run(&["system.toml", "--out", "out"]);
    let before = date(&folder);
    let second = folder.run(&["system.toml", "--out", "out"]);
    assert_eq!(stdout(&second).matches("Unchanged").count(), 3, "{}", stdout(&second));
    assert_eq!(before, date(&folder));
}

#[test]
fn a_mistake_is_shown_and_nothing_is_written_or_overwritten() {
    let folder = Folder::new("mistake");
    fs::create_dir_all(folder.0.join("out")).unwrap();
    fs::write(folder.0.join("out/left.rs"), "precious").unwrap();
    fs::write(folder.0.join("system.toml"), GOOD.replace("B = [[0.0417], [0.0156]]", "B = [[0.0417]]")).unwrap();
    let output = folder.run(&["system.toml", "--out", "out", "--design", "out/design.json"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).starts_with("error[E0"), "{}", stderr(&output));
    assert!(stderr(&output).contains("system.toml:"), "{}", stderr(&output));
    assert_eq!(stdout(&output), "");
    assert_eq!(folder.files("out"), ["left.rs"]);
    assert_eq!(fs::read_to_string(folder.0.join("out/left.rs")).unwrap(), "precious");
}

#[test]
fn a_network_without_a_design_writes_nothing_either() {
    let folder = Folder::new("no-design");
    fs::write(folder.0.join("system.toml"), GOOD.replace("epsilon = 0.02", "epsilon = 2.0")).unwrap();
    let output = folder.run(&["system.toml"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).starts_with("error[E0"), "{}", stderr(&output));
    assert_eq!(folder.files("."), ["system.toml"]);
}

#[test]
fn a_file_that_cannot_be_read_or_written_is_named() {
    let folder = Folder::new("unreadable");
    let output = folder.run(&["missing.toml"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("cannot read missing.toml"), "{}", stderr(&output));

    fs::write(folder.0.join("system.toml"), GOOD).unwrap();
    let output = folder.run(&["system.toml", "--out", "system.toml/inside"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("cannot write system.toml/inside"), "{}", stderr(&output));
    assert_eq!(fs::read_to_string(folder.0.join("system.toml")).unwrap(), GOOD);
}

#[test]
fn controllers_and_design_are_written_together_or_not_at_all() {
    let folder = Folder::new("together");
    fs::write(folder.0.join("system.toml"), GOOD).unwrap();
    let output = folder.run(&["system.toml", "--out", "out", "--design", "system.toml/design.json"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(!folder.0.join("out/left.rs").exists() && !folder.0.join("out/mod.rs").exists());
}

#[test]
fn the_effort_of_the_command_line_wins_over_the_files() {
    let folder = Folder::new("effort");
    fs::write(folder.0.join("system.toml"), GOOD.replace("[reference]", "[sizing]\neffort = 1\n\n[reference]"))
        .unwrap();
    let tuned = folder.run(&["system.toml", "--gains-out", "gains.toml"]);
    assert_eq!(tuned.status.code(), Some(0), "{}", stderr(&tuned));
    assert_eq!(stderr(&tuned), "", "a progress bar is for terminals");
    for word in ["searched", "effort 0", "effort 1", "volume of Y", "Tuning"] {
        assert!(stdout(&tuned).contains(word), "no {word} in {}", stdout(&tuned));
    }
    let longest = stdout(&tuned).lines().map(|line| line.chars().count()).max();
    assert!(longest <= Some(100), "{longest:?}");
    let gains = fs::read_to_string(folder.0.join("gains.toml")).unwrap();
    let table: toml::Table = gains.parse().unwrap();
    assert!(["K", "Kx", "Ke"].iter().all(|key| table["subsystem"]["left"].get(key).is_some()), "{gains}");
    assert!(folder.read("generated/four_tank/left.rs").contains("--effort 1"));

    let plain = folder.run(&["system.toml", "--effort", "0"]);
    assert!(!stdout(&plain).contains("searched"), "{}", stdout(&plain));
    fs::write(folder.0.join("system.toml"), GOOD).unwrap();
    let without = folder.run(&["system.toml"]);
    assert!(stdout(&without).contains("Unchanged:"), "{}", stdout(&without));
    assert_eq!(folder.run(&["system.toml", "--effort", "4"]).status.code(), Some(2));
}

#[test]
fn a_search_for_gains_that_are_all_stated_is_said_to_be_in_vain() {
    let folder = Folder::new("in-vain");
    fs::write(folder.0.join("system.toml"), GOOD).unwrap();
    assert_eq!(folder.run(&["system.toml", "--gains-out", "gains.toml"]).status.code(), Some(0));
    let gains: toml::Table = fs::read_to_string(folder.0.join("gains.toml")).unwrap().parse().unwrap();
    let mut stated: toml::Table = GOOD.parse().unwrap();
    for name in ["left", "right"] {
        let given = gains["subsystem"][name].as_table().unwrap().clone();
        stated["subsystem"][name].as_table_mut().unwrap().extend(given);
    }
    let words = ["effort 2 changes nothing", "`gains = \"lmi\"` changes nothing"];
    let said = |table: &toml::Table, options: &[&str]| {
        fs::write(folder.0.join("system.toml"), table.to_string()).unwrap();
        let output = folder.run(&[&["system.toml"], options].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        words.map(|word| stdout(&output).contains(word))
    };
    assert_eq!(said(&stated, &[]), [false, false]);
    assert_eq!(said(&stated, &["--effort", "2"]), [true, false]);
    stated.insert("gains".to_owned(), "lmi".into());
    assert_eq!(said(&stated, &[]), [false, true]);
    stated["subsystem"]["left"].as_table_mut().unwrap().remove("K");
    assert_eq!(said(&stated, &[]), [false, false]);
}

#[test]
fn a_file_of_starts_gives_plans_or_says_why_not() {
    let folder = Folder::new("starts");
    fs::write(folder.0.join("system.toml"), GOOD).unwrap();
    fs::write(folder.0.join("start.toml"), "[left]\nx0 = [-12.0, -1.3]\n\n[right]\nx0 = [20.0, 25.0]\n").unwrap();
    let output = folder.run(&["system.toml", "--start", "start.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("Start-up plan of"), "{}", stdout(&output));
    assert!(stdout(&output).lines().all(|line| line.chars().count() <= 100));
    let left = folder.read("generated/four_tank/left.rs");
    assert!(left.contains("--start start.toml") && left.contains("pub static START: StartPlan<'static>"));
    for (text, code) in [
        ("[left]\nx0 = [27.0, 38.0]\n[right]\nx0 = [27.0, 38.0]\n", "E0504"),
        ("[left]\nx0 = [0.0]\n", "E0110"),
        ("[middle]\nx0 = [0.0]\n", "E0112"),
        ("[left]\nx0 = [0.0, -1.5]\n", "E0129"),
        ("[left\n", "E0101"),
    ] {
        fs::write(folder.0.join("start.toml"), text).unwrap();
        let output = folder.run(&["system.toml", "--start", "start.toml", "--out", "none"]);
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains(&format!("error[{code}]")), "{}", stderr(&output));
        assert!(stderr(&output).contains("start.toml:") && !folder.0.join("none").exists(), "{}", stderr(&output));
    }
}

#[test]
fn a_start_written_as_in_the_file_of_the_network_says_how_to_write_it() {
    let folder = Folder::new("nested-starts");
    fs::write(folder.0.join("system.toml"), GOOD).unwrap();
    fs::write(folder.0.join("start.toml"), "[subsystem.left]\nx0 = [0.0, 0.0]\n").unwrap();
    let output = folder.run(&["system.toml", "--start", "start.toml"]);
    assert_eq!(output.status.code(), Some(1));
    let said = stderr(&output);
    assert!(said.contains("error[E0102]") && said.contains("start.toml:1:12"), "{said}");
    assert!(said.contains("help: write [left]: the start file has one table per subsystem"), "{said}");
}

const ROBOTS: &str = include_str!("../../examples/robots/system.toml");

#[test]
fn constraints_that_change_while_running_are_summarised_and_have_no_start_up_plan() {
    let folder = Folder::new("changing");
    fs::write(folder.0.join("system.toml"), ROBOTS).unwrap();
    fs::write(folder.0.join("start.toml"), "[robot_1]\nx0 = [1.0, 0.0, 0.0, 0.0]\n").unwrap();
    let output = folder.run(&["system.toml", "--out", "out"]);
    let summary = stdout(&output);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(summary.lines().all(|line| line.chars().count() <= 100), "{summary}");
    for words in [" of 8.5 cm of px; references alone 7.5 = 1.5 eps", "between robot_1, robot_2", "(26')"] {
        assert!(summary.contains(words), "no {words} in {summary}");
    }
    let output = folder.run(&["system.toml", "--start", "start.toml", "--out", "none"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("error[E0131]") && stderr(&output).contains("system.toml:"),
        "{}",
        stderr(&output)
    );
    assert!(!folder.0.join("none").exists());
}

#[test]
fn a_check_designs_and_writes_nothing() {
    let folder = Folder::new("check");
    fs::write(folder.0.join("system.toml"), GOOD).unwrap();
    let output = folder.run(&["check", "system.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for word in ["small gain", "limited         below by `h2 >= -1.4 cm` of `left`", "(25b)"] {
        assert!(stdout(&output).contains(word), "no {word} in {}", stdout(&output));
    }
    assert_eq!(folder.files("."), ["system.toml"]);
    fs::write(folder.0.join("system.toml"), GOOD.replace("epsilon = 0.02", "epsilon = 2.0")).unwrap();
    let output = folder.run(&["check", "system.toml"]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(stderr(&output).matches("dpc-codegen explain E0401").count(), 1, "{}", stderr(&output));
}

#[test]
fn machines_are_told_everything_on_the_standard_output_and_nothing_else() {
    let folder = Folder::new("json");
    fs::write(folder.0.join("system.toml"), GOOD).unwrap();
    for arguments in
        [&["check", "system.toml", "--format", "json"][..], &["system.toml", "--format", "json", "--timings"]]
    {
        let output = folder.run(arguments);
        assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
        let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((&told["outcome"], &told["diagnostics"]), (&"done".into(), &serde_json::json!([])));
        let range = &told["summary"]["subsystems"][0]["set_points"][0];
        assert!(range["min"].as_f64() <= Some(-1.0) && range["max"].as_f64() > Some(2.5), "{range}");
        assert_eq!(range["min_limited_by"]["row"], "`h2 >= -1.4 cm` of `left`");
        assert!(told["summary"]["assumptions"]["rho_small_gain"].as_f64() < Some(1.0));
        let files = told["files"].as_array().map_or(0, Vec::len);
        assert_eq!(files, if arguments[0] == "check" { 0 } else { 3 });
    }
    fs::write(folder.0.join("system.toml"), GOOD.replace("B = [[0.0417], [0.0156]]", "B = [[0.0417]]")).unwrap();
    let output = folder.run(&["check", "system.toml", "--format", "json"]);
    assert_eq!((output.status.code(), stderr(&output)), (Some(1), String::new()));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let (mistake, label) = (&told["diagnostics"][0], &told["diagnostics"][0]["labels"][0]);
    assert_eq!(
        (&told["outcome"], &mistake["code"], &label["file"]),
        (&"mistakes".into(), &"E0110".into(), &"system.toml".into())
    );
    let text = folder.read("system.toml");
    let line = text.lines().nth(label["line"].as_u64().unwrap() as usize - 1).unwrap();
    assert!(line.starts_with("B = [[0.0417]]"), "{line}");
    let place = label["start"].as_u64().unwrap() as usize..label["end"].as_u64().unwrap() as usize;
    assert_eq!(&text[place], "[[0.0417]]");
    let output = folder.run(&["missing.toml", "--format", "json"]);
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), &told["outcome"]), (Some(3), &"system".into()));
}

#[test]
fn codes_are_explained() {
    let folder = Folder::new("explain");
    let page = folder.run(&["explain", "e0301"]);
    assert_eq!(page.status.code(), Some(0));
    for word in ["# E0301: ", "Assumption 4", "(21)", "## What to try", "## Wrong", "## Right"] {
        assert!(stdout(&page).contains(word), "no {word} in {}", stdout(&page));
    }
    let list = stdout(&folder.run(&["explain"]));
    assert!(list.lines().count() > 50 && list.contains("\nE0117  a weight that is not symmetric\n"), "{list}");
    let unknown = folder.run(&["explain", "E0144"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(stderr(&unknown).contains("did you mean E0143?"), "{}", stderr(&unknown));
    let told: serde_json::Value = serde_json::from_slice(&folder.run(&["explain", "--format", "json"]).stdout).unwrap();
    assert_eq!(told["pages"].as_array().map(Vec::len), Some(list.lines().count()));
}

#[test]
fn every_shell_has_its_completions() {
    let folder = Folder::new("completions");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let output = folder.run(&["completions", shell]);
        assert_eq!(output.status.code(), Some(0), "{shell}: {}", stderr(&output));
        for word in ["check", "explain", "effort"] {
            assert!(stdout(&output).contains(word), "{shell}: no {word}");
        }
    }
    assert_eq!(folder.run(&["completions", "csh"]).status.code(), Some(2));
}

#[test]
fn a_file_that_is_no_text_has_its_place_too() {
    let folder = Folder::new("latin");
    fs::write(folder.0.join("system.toml"), [b"# Pr\xfcfstand\n", GOOD.as_bytes()].concat()).unwrap();
    let output = folder.run(&["system.toml"]);
    assert_eq!(output.status.code(), Some(1));
    for word in ["error[E0101]", "system.toml:1:5", "byte 4 is 0xfc", "UTF-8"] {
        assert!(stderr(&output).contains(word), "no {word} in {}", stderr(&output));
    }
}

#[test]
fn a_start_and_a_scalar_type_go_together_where_the_scalar_type_has_plans() {
    let folder = Folder::new("start-scalar");
    let single = GOOD.replace("horizon = 3", "horizon = 3\nscalar = \"f32\"");
    fs::write(folder.0.join("system.toml"), single).unwrap();
    fs::write(folder.0.join("start.toml"), "[left]\nx0 = [-12.0, -1.3]\n\n[right]\nx0 = [20.0, 25.0]\n").unwrap();
    let output = folder.run(&["system.toml", "--start", "start.toml", "--scalar", "f64"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("Start-up plan of"), "{}", stdout(&output));
    let output = folder.run(&["system.toml", "--start", "start.toml", "--out", "none"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("error[E0132]"), "{}", stderr(&output));
}

#[test]
fn mistakes_of_several_stages_are_told_in_one_run() {
    let folder = Folder::new("several");
    let wrong = GOOD
        .replace("sample-time = 0.5", "sample-time = -0.5")
        .replace("B = [[0.0417], [0.0156]]\n", "")
        .replace("\nQ = 1.0\n", "\nQ = [[1.0, 0.2], [0.1, 1.0]]\n");
    fs::write(folder.0.join("system.toml"), wrong).unwrap();
    let output = folder.run(&["check", "system.toml"]);
    for code in ["error[E0103]", "error[E0109]", "error[E0117]"] {
        assert_eq!(stderr(&output).matches(code).count(), 1, "{code}: {}", stderr(&output));
    }
    assert_eq!(stderr(&output).matches("error[").count(), 3, "{}", stderr(&output));
}

#[test]
fn help_says_what_exit_codes_mean() {
    let folder = Folder::new("help");
    let help = stdout(&folder.run(&["--help"]));
    for word in
        ["Exit codes:", "1  the input has mistakes", "3  the file system failed", "check", "explain", "completions"]
    {
        assert!(help.contains(word), "no {word} in {help}");
    }
}

#[test]
fn a_wrong_call_is_a_usage_error() {
    let folder = Folder::new("usage");
    assert_eq!(folder.run(&[]).status.code(), Some(2));
    assert_eq!(folder.run(&["system.toml", "--no-such-option"]).status.code(), Some(2));
    assert_eq!(folder.run(&["--help"]).status.code(), Some(0));
}

/// A folder to run in, empty at first.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn run(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_dpc-codegen")).args(arguments).current_dir(&self.0).output().unwrap()
    }

    fn read(&self, path: &str) -> String {
        fs::read_to_string(self.0.join(path)).unwrap()
    }

    fn files(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.0.join(folder)).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
