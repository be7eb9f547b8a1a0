//! Do matrices from files mean the same as matrices in the text, and is every other file refused with a reason?

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostics, Source, code};
use dpc_codegen::emit::Emitted;
use dpc_codegen::import::{self, Array};
use dpc_codegen::network::Network;
use dpc_codegen::spec::Spec;
use dpc_codegen::summary::Summary;
use dpc_tests::{Random, lower, read, root};

const FOLDER: &str = "cases/import";

/// The collective four-tank, with values of `A`, `B` and `C` as given.
fn four_tank(references: [&str; 3]) -> Source {
    let case = read(Path::new("cases/accept/four_tank_collective.toml"));
    let (head, rest) = case.text.split_once("A = [\n").expect("the case has A");
    let (_, tail) = rest.split_once("C = [[1, 0, 0, 0], [0, 0, 1, 0]]\n").expect("the case has C");
    let [a, b, c] = references;
    beside(format!("{head}A = {a}\nB = {b}\nC = {c}\n{tail}"))
}

/// `text` as a file of the folder with the fixtures.
fn beside(text: String) -> Source {
    Source { path: format!("{FOLDER}/plant.toml"), text }
}

fn accepted(source: Source) -> Network {
    let text = source.clone();
    lower(source).unwrap_or_else(|errors| panic!("{}", errors.render(&text, false)))
}

fn refused(source: Source) -> String {
    let Diagnostics(errors) = lower(source.clone()).expect_err("a mistake");
    for error in &errors {
        let (place, _) = error.labels.first().expect("a place");
        assert!(place.start < place.end && place.end <= source.text.len(), "{}", error.title);
    }
    Diagnostics(errors).render(&source, false)
}

fn assert_same(one: &Network, other: &Network) {
    for (a, b) in one.subsystems.iter().zip(&other.subsystems) {
        assert_eq!((&a.A, &a.B, &a.C, &a.E, &a.L), (&b.A, &b.B, &b.C, &b.E, &b.L), "{}", a.name);
        assert_eq!((&a.Cz, &a.Dz, &a.X.h, &a.Q), (&b.Cz, &b.Dz, &b.X.h, &b.Q), "{}", a.name);
    }
}

#[test]
fn every_format_gives_the_same_network() {
    let stated = accepted(read(Path::new("cases/accept/four_tank_collective.toml")));
    let archive = |file: &str| ["A", "B", "C"].map(|name| format!("{{ file = \"{file}\", name = \"{name}\" }}"));
    let short = |file: &str| [file; 3].map(|file| format!("\"{file}\""));
    let files = |files: [&str; 3]| files.map(|file| format!("\"{file}\""));
    let structure =
        ["sys.A", "sys.B", "sys.C"].map(|name| format!("{{ file = \"structure.mat\", name = \"{name}\" }}"));
    let ways = [
        archive("stored.npz"),
        archive("deflated.npz"),
        short("deflated.npz"),
        archive("uncompressed.mat"),
        short("compressed.mat"),
        structure,
        files(["A.npy", "B_fortran.npy", "C_int.npy"]),
        files(["A.csv", "B_header.csv", "C.txt"]),
        files(["A_named.csv", "B_decimal_commas.csv", "C_header.txt"]),
        files(["A_sparse.mtx", "B_array.mtx", "C_integer.mtx"]),
    ];
    for way in &ways {
        assert_same(&accepted(four_tank([&way[0], &way[1], &way[2]])), &stated);
    }
}

#[test]
fn sparse_and_single_precision_matrices_of_matlab_are_read() {
    let contents = contents("sparse.mat");
    let [a, b, c] = ["A", "B", "C"].map(|name| array(&contents, name).clone());
    let stated = accepted(read(Path::new("cases/accept/four_tank_collective.toml")));
    assert_eq!(a.entries()[0..4], [0.9921, 0.0, 0.0, 0.0206]);
    assert_eq!(
        (a.rows(), a.columns(), b.size(), c.entries()),
        (4, 4, "4 x 2".to_owned(), &[1., 0., 0., 0., 0., 0., 1., 0.][..])
    );
    assert!((b.entries()[0] - stated.subsystems[0].B[(0, 0)]).abs() < 1e-8 && b.entries()[0] != 0.0417);
}

#[test]
fn symmetric_matrix_market_files_are_mirrored() {
    for file in ["symmetric.mtx", "symmetric_array.mtx"] {
        let contents = contents(file);
        let array = contents.variables[0].content.as_ref().expect("a matrix");
        assert_eq!(array.entries(), [2., -1., 0., -1., 2., 0., 0., 0., 3.], "{file}");
    }
    let skew = "%%MatrixMarket matrix coordinate integer skew-symmetric\n2 2 1\n2 1 3\n";
    let skew = import::read("a.mtx", skew.as_bytes()).expect("a matrix");
    assert_eq!(skew.variables[0].content.as_ref().expect("a matrix").entries(), [0., -3., 3., 0.]);
}

/// One subsystem cut out of the collective matrices, by numbers, ranges and names.
#[test]
fn blocks_are_cut_out() {
    let block = |rows: &str, columns: &str, file: &str| format!("{{ {file}, rows = {rows}, columns = {columns} }}");
    let text = |own: &str, input: &str, output: &str, weight: &str| {
        format!(
            "name = \"tank\"\nsample-time = 0.5\nhorizon = 3\n[subsystem.right]\nstates = [\"h3\", \"h4\"]\ninputs = [\"v2\"]\noutputs = [\"h3\"]\nA = {own}\nB = {input}\nC = {output}\nQ = {weight}\n"
        )
    };
    let whole = r#"file = "compressed.mat", name = "#;
    let numbers = text(
        &block("[3, 4]", "{ first = 3, last = 4 }", &format!("{whole}\"A\"")),
        &block("{ first = 3, last = 4 }", "[2]", &format!("{whole}\"B\"")),
        &block("[2]", "[3, 4]", "file = \"C.txt\""),
        "1",
    );
    let names = text(
        &block("[\"h3\", \"h4\"]", "[\"h3\", \"h4\"]", "file = \"A_named.csv\""),
        "{ file = \"B_header.csv\", rows = [3, 4], columns = [\"v2\"] }",
        &block("[2]", "[3, 4]", "file = \"C.txt\""),
        "{ file = \"symmetric.mtx\", rows = [1, 2], columns = [1, 2] }",
    );
    let [numbers, names] = [numbers, names].map(|text| accepted(beside(text)));
    let stated = accepted(read(Path::new("cases/accept/four_tank_collective.toml")));
    for network in [&numbers, &names] {
        let (s, right) = (&network.subsystems[0], &stated.subsystems[1]);
        assert_eq!((&s.A, &s.B, &s.C), (&right.A, &right.B, &right.C));
    }
    assert_eq!(names.subsystems[0].Q.as_slice(), [2., -1., -1., 2.]);
}

#[test]
fn lists_come_from_files_too() {
    let text = r#"
name = "tank"
sample-time = 0.5
horizon = 3
[subsystem.a]
states = ["p", "q", "r", "s"]
inputs = ["u"]
outputs = ["p"]
A = "A.npy"
B = { file = "B_fortran.npy", columns = [1] }
C = { file = "C_int.npy", rows = [1] }
Q = { file = "limits.csv", columns = ["weight"] }
x = { min = -1, max = { file = "limits.csv", columns = ["max"] } }
w = { min = 0, max = "b_list.npy" }
x0 = { file = "limits.csv", columns = ["start"] }
"#;
    let network = accepted(beside(text.to_owned()));
    let (s, start) = (&network.subsystems[0], network.start.as_ref().expect("a start"));
    let w = s.w.as_ref().expect("a disturbance");
    assert!((w.hull[0] - 0.0417).abs() < 1e-9 && (w.hull[2] - 1.3e-4).abs() < 1e-9);
    assert_eq!(s.Q.diagonal().as_slice(), [1., 2., 3., 4.]);
    assert_eq!(start.x0[0].as_slice(), [0.5, 0., 0., -0.5]);
    // No bound of the third state.
    assert_eq!(s.X.rows, ["p <= 10", "p >= -1", "q <= 20", "q >= -1", "r >= -1", "s <= 40", "s >= -1"]);
}

/// What is wrong with each file, in its words.
#[test]
fn unusable_files_are_refused_with_a_reason() {
    let cases = [
        ("\"A.npz\"", "A.npz is not there"),
        ("\"stored.npzz\"", "stored.npzz is not there"),
        ("\"../import\"", "must be a matrix"),
        ("{ file = \"../import\" }", "../import is not a file"),
        ("{ file = \"make.py\" }", "ends in nothing that tells a format"),
        ("{ file = \"/etc/hostname.csv\" }", "absolute path"),
        ("{ file = \"stored.npz\", name = \"a\" }", "did you mean \"A\"?"),
        ("{ file = \"stored.npz\", name = \"Phi\" }", "stored.npz has A (4 x 4), B (4 x 2), C (2 x 4)"),
        ("{ file = \"A.csv\", name = \"A\" }", "leave `name` out"),
        ("{ file = \"A.csv\", rows = [0] }", "it has rows 1 to 4"),
        ("{ file = \"A.csv\", rows = [1, 2, 3, 1] }", "row 1 of A.csv is picked twice"),
        ("{ file = \"A.csv\", columns = [\"h1\"] }", "the file has no names of columns"),
        ("{ file = \"A_named.csv\", columns = [\"H1\"] }", "did you mean \"h1\"?"),
        ("{ file = \"A_named.csv\", rows = [\"x9\"] }", "its rows are h1, h2, h3, h4"),
        ("{ file = \"A.csv\", row = [1] }", "unknown key `row`"),
        ("\"B_fortran.npy\"", "each row has 2 numbers, expected 4"),
        ("\"b_list.npy\"", "b.reshape(-1, 1) is a column"),
        ("\"complex.npy\"", "np.real(..)"),
        ("\"cube.npy\"", "3 dimensions"),
        ("\"nan.npy\"", "row 1, column 4 is NaN"),
        ("\"ragged.csv\"", "line 2 has 1 numbers, line 1 has 2"),
        ("\"words.csv\"", "line 2, column 2: `O.5` is not a number"),
        ("\"doubled.mtx\"", "line 4 states entry (1, 1) again"),
        ("\"complex.mat\"", "A = real(A)"),
        ("{ file = \"compressed.mat\", name = \"note\" }", "text"),
        ("{ file = \"compressed.mat\", name = \"cells\" }", "a cell array"),
        ("{ file = \"object.mat\", name = \"sys\" }", "ssdata(sys)"),
        ("\"version4.mat\"", "version 4"),
        ("\"version73.mat\"", "save('plant.mat', 'A', 'B', 'C', '-v7')"),
    ];
    for (reference, reason) in cases {
        let shown = refused(four_tank([reference, "\"B_array.mtx\"", "\"C.txt\""]));
        assert!(shown.contains(reason), "{reference}:\n{shown}");
    }
}

/// A build script that reads a file has to run again when it changes, and when a missing one appears.
#[test]
fn the_files_of_a_text_are_known() {
    let source = four_tank(["\"stored.npz\"", "{ file = \"stored.npz\", name = \"B\" }", "\"../missing.csv\""]);
    let names: Vec<_> = Spec::files(&source).iter().map(|path| path.to_string_lossy().into_owned()).collect();
    assert_eq!(names, [format!("{FOLDER}/../missing.csv"), format!("{FOLDER}/stored.npz")]);
    let network = accepted(four_tank(["\"stored.npz\"", "\"stored.npz\"", "\"C.txt\""]));
    assert_eq!(network.files, ["C.txt", "stored.npz"]);
}

fn contents(file: &str) -> import::Contents {
    let bytes = fs::read(root().join(FOLDER).join(file)).expect("the fixture is there");
    import::read(file, &bytes).unwrap_or_else(|error| panic!("{file} {}", error.what))
}

fn array<'a>(contents: &'a import::Contents, name: &str) -> &'a Array {
    let found = contents.variables.iter().find(|variable| variable.name.as_deref() == Some(name));
    found.and_then(|variable| variable.content.as_ref().ok()).unwrap_or_else(|| panic!("{}", contents.describe()))
}

/// Cut off anywhere, or with bytes changed: refused or read, never a panic, and nothing huge is asked for.
#[test]
fn damaged_files_are_survived() {
    let mut random = Random(11);
    let (mut read, mut refused) = (0, 0);
    for name in fixtures() {
        let bytes = fs::read(root().join(FOLDER).join(&name)).expect("a fixture");
        let mut tries: Vec<Vec<u8>> =
            (0..bytes.len()).step_by(1 + bytes.len() / 300).map(|end| bytes[..end].to_vec()).collect();
        for _ in 0..600 {
            let mut bytes = bytes.clone();
            for _ in 0..=random.below(4) {
                let (at, extreme) = (random.below(bytes.len()), random.chance(0.3));
                bytes[at] = if extreme { 0xff } else { random.below(256) as u8 };
            }
            tries.push(bytes);
        }
        for bytes in tries {
            match import::read(&name, &bytes) {
                Ok(contents) => {
                    read += 1;
                    let arrays = contents.variables.iter().filter_map(|variable| variable.content.as_ref().ok());
                    arrays.for_each(|array| assert_eq!(array.entries().len(), array.rows() * array.columns()));
                }
                Err(error) => {
                    refused += 1;
                    assert!(!error.what.is_empty());
                }
            }
        }
    }
    println!("{read} read, {refused} refused");
    assert!(read > 1000 && refused > 1000, "{read} read, {refused} refused");
}

/// Sizes that no bytes stand behind.
#[test]
fn claims_of_size_are_not_believed() {
    let header = |shape: &str| {
        let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
        [b"\x93NUMPY\x01\x00".as_slice(), &u16::try_from(text.len()).expect("short").to_le_bytes(), text.as_bytes()]
            .concat()
    };
    for shape in ["(100000, 100000)", "(18446744073709551615, 3)", "(2000, 2000)", "(0, 99999999999999999999)"] {
        import::read("a.npy", &header(shape)).expect_err("too large");
    }
    for market in ["coordinate real general\n100000 100000 0\n", "array real general\n3000000000 3000000000\n"] {
        import::read("a.mtx", format!("%%MatrixMarket matrix {market}").as_bytes()).expect_err("too large");
    }
}

fn fixtures() -> Vec<String> {
    let folder = fs::read_dir(root().join(FOLDER)).expect("the fixtures are there");
    let mut names: Vec<String> =
        folder.map(|entry| entry.expect("a readable folder").file_name().to_string_lossy().into_owned()).collect();
    names.retain(|name| {
        !name.ends_with(".py")
            && !name.ends_with(".toml")
            && fs::metadata(root().join(FOLDER).join(name)).is_ok_and(|about| about.is_file())
    });
    names.sort();
    assert!(names.len() > 25);
    names
}

#[test]
fn every_mistake_has_its_code() {
    let codes = |reference: &str| {
        let errors = lower(four_tank([reference, "\"B_array.mtx\"", "\"C.txt\""])).expect_err("a mistake");
        errors.0.iter().map(|error| error.code).collect::<Vec<_>>()
    };
    assert_eq!(codes("\"A.npz\""), [code::FILE]);
    assert_eq!(codes("{ file = \"stored.npz\", name = \"D\" }"), [code::NOT_IN_FILE]);
    assert_eq!(codes("\"nan.npy\""), [code::NOT_FINITE]);
    assert_eq!(codes("\"b_list.npy\""), [code::SHAPE]);
}

/// The script that is said to have made the fixtures makes these.
#[test]
fn the_fixtures_are_what_the_script_writes() {
    let has = Command::new("python3").args(["-c", "import numpy, scipy.io"]).output();
    if !has.is_ok_and(|output| output.status.success()) {
        eprintln!("SKIPPED: there is no python3 with numpy and scipy here");
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("import");
    fs::create_dir_all(&folder).expect("a folder for the fixtures");
    let script = root().join(FOLDER).join("make.py");
    let made = Command::new("python3").arg(script).current_dir(&folder).status().expect("python3 runs");
    assert!(made.success());
    for name in fixtures() {
        let [committed, made] = [root().join(FOLDER), folder.clone()].map(|folder| {
            let bytes = fs::read(folder.join(&name)).unwrap_or_else(|error| panic!("{name}: {error}"));
            // Bytes may depend on the version of zlib; what they mean does not.
            import::read(&name, &bytes).map(|contents| contents.describe()).map_err(|error| error.what)
        });
        assert_eq!(committed, made, "{name}");
    }
}

/// The pages in `docs/import`: their models give the design whose summary they show.
#[test]
fn the_pages_show_what_is_printed() {
    let fixture = |from: &str, to: &str| (root().join(FOLDER).join(from), to.to_owned());
    let julia = ["A", "B", "C"].map(|name| fixture(&format!("page_{name}.csv"), &format!("{name}.csv")));
    let pages = [("matlab", vec![fixture("page.mat", "plant.mat")]), ("julia", julia.to_vec())];
    for (page, files) in pages {
        let folder = scratch(page);
        for (from, to) in files {
            fs::copy(from, folder.join(to)).expect("a fixture");
        }
        assert_printed(page, &folder);
    }
}

#[test]
fn the_python_page_runs_as_printed() {
    if !python(&["-c", "import numpy"], Path::new(".")) {
        eprintln!("SKIPPED: there is no python3 with numpy here");
        return;
    }
    let folder = scratch("python");
    fs::write(folder.join("export.py"), block("python", "python")).expect("a script");
    if !python(&["-c", "import control"], &folder) {
        eprintln!("python-control is not here: its model is replaced by one that holds the matrices");
        let model =
            "from types import SimpleNamespace\ndef ss(A, B, C, D):\n    return SimpleNamespace(A=A, B=B, C=C, D=D)\n";
        fs::write(folder.join("control.py"), model).expect("a module");
    }
    assert!(python(&["export.py"], &folder));
    assert_printed("python", &folder);
}

fn python(arguments: &[&str], folder: &Path) -> bool {
    Command::new("python3").args(arguments).current_dir(folder).output().is_ok_and(|output| output.status.success())
}

fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pages").join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("a folder of an earlier run");
    }
    fs::create_dir_all(&folder).expect("a folder for the page");
    folder
}

/// The first block in a language of a page.
fn block(page: &str, language: &str) -> String {
    let path = root().join("../docs/import").join(page).with_extension("md");
    let text = fs::read_to_string(path).expect("the page is there");
    let (_, rest) = text.split_once(&format!("```{language}\n")).expect("a block in this language");
    rest.split_once("\n```").expect("its end").0.to_owned()
}

fn assert_printed(page: &str, folder: &Path) {
    let path = folder.join("system.toml").to_string_lossy().into_owned();
    let source = Source { path, text: block(page, "toml") };
    let design = Design::new(source.clone()).unwrap_or_else(|errors| panic!("{}", errors.render(&source, false)));
    let emitted = Emitted::new(&design);
    assert!(emitted.files.iter().all(|(_, text)| !text.contains(&*folder.to_string_lossy())), "no path is emitted");
    let printed = Summary::new(&design, &emitted).to_string();
    let shown = block(page, "text");
    assert!(printed.contains(&shown), "{page}.md shows\n{shown}\nprinted is\n{printed}");
}
