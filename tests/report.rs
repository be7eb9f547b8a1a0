//! Does the page about a design say what the design is, and does it work in a browser?

#![expect(non_snake_case, reason = "the paper's symbols")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use dpc_codegen::convex::{Box as Intervals, Polytope};
use dpc_codegen::design::Design;
use dpc_codegen::emit::Emitted;
use dpc_codegen::report::Report;
use dpc_codegen::report::SteadyStates;
use dpc_codegen::report::budget::{self, Budget, Part, Side};
use dpc_codegen::report::outline::{Outline, RESOLUTION, selection};
use dpc_codegen::report::planes::{self, Kind};
use dpc_codegen::simulate::{History, Library, Scenario, Shared, run};
use dpc_tests::large_network::{LargeNetwork, Plant, Shape};
use dpc_tests::{Random, cases, read};
use nalgebra::DMatrix;
use serde_json::Value;

fn design(path: &str) -> Design {
    Design::new(read(Path::new(path))).expect("a design")
}

const EXAMPLES: [&str; 6] = [
    "../examples/four_tank/system.toml",
    "../examples/four_tank/designs/disturbed.toml",
    "../examples/four_tank/designs/started.toml",
    "../examples/robots/system.toml",
    "../examples/power_network/system.toml",
    "../examples/mass_chain/system.toml",
];

fn rooms(width: usize, count: usize) -> LargeNetwork {
    LargeNetwork { plant: Plant::Rooms, shape: Shape::Grid(width), count, kinds: 3 }
}

#[test]
fn the_parts_of_a_range_sum_to_it() {
    let designs =
        EXAMPLES.iter().map(|path| design(path)).chain(cases("accept").into_iter().filter_map(|c| Design::new(c).ok()));
    let large = Design::new(rooms(12, 96).source()).expect("a design");
    for design in designs.chain([large]) {
        for (i, s) in design.network.subsystems.iter().enumerate() {
            let budgets = [budget::inputs(&design, i), budget::states(&design, i)].concat();
            let sides: Vec<&Side> = budgets.iter().flat_map(|b| b.low.iter().chain(&b.high)).collect();
            assert!(sides.len() <= s.U.h.len() + s.X.h.len());
            for side in sides {
                let sum: f64 = side.parts.iter().sum();
                assert!((sum - side.limit).abs() <= 1e-12 * side.limit, "{}: {side:?}", s.name);
                assert!(side.parts.iter().all(|part| *part >= -1e-9 * side.limit), "{}: {side:?}", s.name);
            }
            let left =
                budgets.iter().flat_map(|b| b.low.iter().chain(&b.high)).map(|side| side.parts[Part::Left as usize]);
            assert!(left.fold(f64::INFINITY, f64::min) >= smallest_slack(&design, &s.name, &budgets) - 1e-9);
        }
    }
}

/// Of (25b) of one subsystem, where every bound is on one signal with coefficient 1.
fn smallest_slack(design: &Design, subsystem: &str, budgets: &[Budget]) -> f64 {
    let alone = |budget: &&Budget| budget.low.is_some() || budget.unit.is_some();
    if budgets.iter().filter(alone).count() < budgets.len() {
        return 0.0;
    }
    let own = format!("{subsystem}: ");
    let slacks = design.sizing.slacks.iter().filter(|slack| slack.equation == "(25b)" && slack.what.starts_with(&own));
    slacks.map(|slack| slack.value).fold(f64::INFINITY, f64::min)
}

/// What acts on a subsystem alone is told apart from what its neighbours do.
#[test]
fn tubes_are_split_by_what_acts_on_them() {
    let of = |design: &Design, part: Part| {
        let all = budget::inputs(design, 0);
        all[0].high.as_ref().expect("a bounded input").parts[part as usize]
    };
    let coupled = design(EXAMPLES[0]);
    assert!(of(&coupled, Part::Neighbours) > 1e3 * of(&coupled, Part::Disturbances));
    let alone = design(EXAMPLES[3]);
    assert!(of(&alone, Part::Neighbours) == 0.0 && of(&alone, Part::Disturbances) > 0.0);
    let loaded = design(EXAMPLES[4]);
    assert!(of(&loaded, Part::Loads) > 0.0);
}

/// Outlines against support values of the sets they are projections of, in many directions.
#[test]
fn outlines_are_the_projections() {
    let mut random = Random(7);
    for path in EXAMPLES {
        let design = design(path);
        for (s, sized) in design.network.subsystems.iter().zip(&design.sizing.subsystems) {
            for axes in (0..s.n()).flat_map(|b| (0..b).map(move |a| [a, b])) {
                for set in [sized.E.to_polytope(), sized.Sigma.to_polytope()] {
                    agrees(&set, axes, &mut random);
                }
            }
        }
    }
}

fn agrees(set: &Polytope, axes: [usize; 2], random: &mut Random) {
    let map: DMatrix<f64> = selection(set.H.ncols(), axes);
    let reach = |a: usize| set.support(&map.row(a).transpose()).expect("bounded").0;
    let size = [2.0 * reach(0), 2.0 * reach(1)];
    let outline = Outline::of_image(set, &map, size).expect("bounded");
    for _ in 0..20 {
        let unit = random.direction(2);
        let d = [unit[0] / size[0], unit[1] / size[1]];
        let (whole, _) =
            set.support(&(map.row(0).transpose() * d[0] + map.row(1).transpose() * d[1])).expect("bounded");
        let drawn = outline.vertices.iter().map(|v| d[0] * v[0] + d[1] * v[1]).fold(f64::NEG_INFINITY, f64::max);
        assert!(drawn <= whole + 1e-9 && drawn >= whole - 1.0 / RESOLUTION, "{drawn} of {whole}");
    }
}

/// What is drawn lies in what it has to lie in.
#[test]
fn steady_states_are_drawn_inside_the_limits() {
    for path in EXAMPLES {
        let design = design(path);
        let steady = SteadyStates::new(&design);
        for i in 0..design.network.subsystems.len() {
            for axes in planes::state_pairs(&design, i, 3) {
                let plane = planes::states(&design, &steady, i, axes).places;
                let outline = |kind: Kind| plane.shapes.iter().find(|shape| shape.kind == kind)?.outline.as_ref();
                let [limits, tightened, rest] = [Kind::Limits, Kind::Tightened, Kind::SteadyStates].map(outline);
                let (limits, tightened) = (limits.expect("X is drawn"), tightened.expect("Xhat is drawn"));
                let rest = rest.expect("the steady states are drawn");
                for ((inner, outer), [low, high]) in [(tightened, limits), (rest, tightened)]
                    .map(|(a, b)| (a.ranges(), b.ranges()))
                    .into_iter()
                    .zip([plane.ranges[0]; 2])
                {
                    let room = 1e-6 * (high - low);
                    let within = |axis: usize| {
                        inner[axis][0] >= outer[axis][0] - room && inner[axis][1] <= outer[axis][1] + room
                    };
                    assert!((0..2).all(within), "{path} {i} {axes:?}");
                }
            }
        }
    }
}

/// Larger epsilon, less of everything else; and at the design's own epsilon the design's own Y.
#[test]
fn speed_is_paid_for() {
    for path in [EXAMPLES[0], EXAMPLES[5]] {
        let design = design(path);
        let points = design.sizing.against_epsilon(&design.network, &design.gains, &design.sets, 6);
        assert!(points.len() == 7 && points.windows(2).all(|pair| pair[0].epsilon <= pair[1].epsilon));
        let objectives: Vec<f64> = points.iter().map_while(|point| Some(point.sizes.as_ref()?.objective)).collect();
        assert!(objectives.len() >= 6 && objectives.windows(2).all(|pair| pair[1] < pair[0] + 1e-6), "{objectives:?}");
        let own = points.iter().find(|point| point.epsilon == design.sizing.epsilon).expect("the design's epsilon");
        let widths = |all: &[&Intervals]| -> f64 { all.iter().map(|Y| Y.volume().ln()).sum() };
        let found: Vec<&Intervals> = own.sizes.iter().flat_map(|sizes| &sizes.Y).collect();
        let chosen: Vec<&Intervals> = design.sizing.subsystems.iter().map(|s| &s.Y).collect();
        assert!((widths(&found) - widths(&chosen)).abs() < 0.02, "{path}: {found:?} {chosen:?}");
    }
}

#[test]
fn pages_need_nothing_else_and_lead_nowhere_else() {
    for path in EXAMPLES {
        let page = page(&design(path), None);
        assert!(!page.contains("http:") && !page.contains("https:") && !page.contains("@import"), "{path}");
        let references: Vec<&str> = values(&page, "href=\"").chain(values(&page, "src=\"")).collect();
        let ids: Vec<&str> = values(&page, " id=\"").collect();
        assert_eq!(ids.len(), ids.iter().collect::<BTreeSet<_>>().len(), "{path}: ids are unique");
        for reference in references.into_iter().filter(|reference| *reference != "data:,") {
            let target = reference.strip_prefix('#').unwrap_or_else(|| panic!("{path}: {reference} is elsewhere"));
            assert!(ids.contains(&target), "{path}: {reference} is nowhere");
        }
        assert!(page.split("url(").skip(1).all(|rest| rest.starts_with('#')), "{path}");
        balanced(&page);
    }
}

fn values<'a>(page: &'a str, attribute: &'a str) -> impl Iterator<Item = &'a str> {
    page.split(attribute).skip(1).map(|rest| &rest[..rest.find('"').expect("a closed attribute")])
}

/// Every element is closed by the one that opened it.
fn balanced(page: &str) {
    const VOID: [&str; 3] = ["meta", "link", "br"];
    let script = page.find("<script>").expect("a script");
    let (head, tail) = (&page[..script], &page[page.find("</script>").expect("its end") + "</script>".len()..]);
    let style = head.find("<style>").expect("a style sheet");
    let head = [&head[..style], &head[head.find("</style>").expect("its end") + "</style>".len()..]].concat();
    let mut open: Vec<&str> = Vec::new();
    let text = [&head, tail].concat();
    for tag in text.split('<').skip(1).map(|rest| &rest[..rest.find('>').expect("a closed tag")]) {
        let name = tag.trim_start_matches('/').split([' ', '>']).next().unwrap_or_default();
        match tag.strip_prefix('/') {
            Some(_) => assert_eq!(open.pop(), Some(name)),
            None if tag.starts_with('!') || VOID.contains(&name) => {}
            None => open.push(name),
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn the_same_design_gives_the_same_page() {
    let pages = [0, 1].map(|_| page(&design(EXAMPLES[0]), None));
    assert!(pages[0] == pages[1]);
}

#[test]
fn names_are_text() {
    let source = read(Path::new(EXAMPLES[0]));
    let text = source.text.replace("\"h1 [cm]\"", "\"<b>h&1 [cm]\"").replace("h1 =", "\"<b>h&1\" =");
    let page = page(&Design::new(dpc_codegen::diagnostic::Source { text, ..source }).expect("a design"), None);
    assert!(page.contains("&lt;b&gt;h&amp;1") && !page.contains("<b>h&"));
}

fn page(design: &Design, history: Option<&History>) -> String {
    let emitted = Emitted::new(design);
    let report = Report::new(design, &emitted);
    history.map_or_else(|| report.html(), |history| Report::new(design, &emitted).with_history(history).html())
}

/// The emitted controllers in a scenario, or in the default one.
fn simulated(design: &Design, scenario: Option<&str>) -> History {
    let emitted = Emitted::new(design);
    let library = Library::of(design, &emitted, &folder().join("controllers"));
    library.build().expect("controllers that compile");
    let scenario = match scenario.map(|path| (read(Path::new(path)), Path::new(path).parent())) {
        Some((source, folder)) => Scenario::read(&source, folder.unwrap_or(Path::new("")), design),
        None => Scenario::visiting(design),
    };
    let scenario = scenario.expect("a scenario");
    let mut controllers = Shared::load(&library, design).expect("a library that loads");
    run(design, &scenario, &mut controllers, &mut |_| ()).expect("a run")
}

/// Where pages and pictures are left to be looked at.
fn folder() -> PathBuf {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target folder");
    target.join("report")
}

#[test]
fn pages_work_in_a_browser() {
    let Some(browser) = Browser::found() else {
        // Past the test harness, which keeps what passing tests print.
        let _ = writeln!(
            std::io::stderr(),
            "skipped: no browser (set DPC_BROWSER, or install chromium): pages were not opened"
        );
        return;
    };
    fs::create_dir_all(folder()).expect("a folder for pages");
    let everything = ["verdict", "network", "set-points", "subsystems", "speed", "simulation", "margins", "equations"];
    let still: Vec<&str> = everything.into_iter().filter(|section| *section != "simulation").collect();
    let crossing = Some("../examples/robots/scenarios/crossing.toml");
    for (name, path, scenario) in [("four_tank", EXAMPLES[0], None), ("robots", EXAMPLES[3], crossing)] {
        let design = design(path);
        let history = simulated(&design, scenario);
        browser.check(name, &page(&design, Some(&history)), &everything);
        browser.pictures(name, "dark");
    }
    browser.check("mass_chain", &page(&design(EXAMPLES[5]), None), &still);
    browser.check("rooms_36", &page(&Design::new(rooms(6, 36).source()).expect("a design"), None), &still);
    let large = page(&Design::new(rooms(10, 100).source()).expect("a design"), None);
    assert!(large.len() < 5_000_000, "{} bytes", large.len());
    browser.check("rooms_100", &large, &still);
}

struct Browser(PathBuf);

/// Names and sizes of windows.
const SHAPES: [(&str, u32, u32); 2] = [("wide", 1280, 8000), ("narrow", 500, 8000)];

impl Browser {
    fn found() -> Option<Self> {
        let stated = std::env::var_os("DPC_BROWSER").map(PathBuf::from);
        let paths = std::env::var_os("PATH").unwrap_or_default();
        let folders: Vec<PathBuf> = std::env::split_paths(&paths).collect();
        let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
        let known = names.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
        stated.into_iter().chain(known).find(|path| path.is_file()).map(Self)
    }

    /// Opens the page wide and narrow; leaves pictures; and reads what the page found out about itself.
    fn check(&self, name: &str, page: &str, sections: &[&str]) {
        let file = folder().join(format!("{name}.html"));
        fs::write(&file, page).expect("a page");
        self.pictures(name, "light");
        for (shape, width, _) in SHAPES {
            let document = self.open(&file, "selftest", (width, 1000), &["--dump-dom"]);
            assert!(document.contains("data-script=\"ran\""), "{name}: the script did not run to its end");
            assert!(!document.contains("id=\"errors\""), "{name}: {}", last(&document));
            sections.iter().for_each(|section| {
                assert!(document.contains(&format!("<section id=\"{section}\"")), "{name}: {section}")
            });
            let found = found_out(&document);
            let number = |key: &str| found[key].as_u64().unwrap_or_else(|| panic!("{name}: no {key} in {found:?}"));
            assert_eq!((number("count"), number("requests")), (0, 0), "{name}, {shape}: {:?}", found["flaws"]);
            assert!(number("boxes") > 200 && number("readouts") > 20, "{name}: {found:?}");
        }
    }

    fn pictures(&self, name: &str, theme: &str) {
        for (shape, width, height) in SHAPES {
            let picture = folder().join(format!("{name}_{shape}_{theme}.png"));
            let _ = fs::remove_file(&picture);
            let page = folder().join(format!("{name}.html"));
            self.open(&page, theme, (width, height), &[&format!("--screenshot={}", picture.display())]);
            let bytes = fs::metadata(&picture).map_or(0, |picture| picture.len());
            assert!(bytes > 30_000, "{} has {bytes} bytes", picture.display());
        }
    }

    /// What the browser prints.
    fn open(&self, file: &Path, fragment: &str, (width, height): (u32, u32), options: &[&str]) -> String {
        let profile = folder().join(format!("profile-{}", std::process::id()));
        let _ = fs::remove_dir_all(&profile);
        let printed = folder().join(format!("printed-{}", std::process::id()));
        let fixed = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-component-update \
                     --disable-sync --hide-scrollbars --virtual-time-budget=20000";
        let mut child = Command::new(&self.0)
            .args(fixed.split_whitespace())
            .arg(format!("--user-data-dir={}", profile.display()))
            .arg(format!("--window-size={width},{height}"))
            .args(options)
            .arg(format!("file://{}#{fragment}", file.display()))
            .stdin(Stdio::null())
            .stderr(Stdio::null())
            .stdout(fs::File::create(&printed).expect("a file"))
            .spawn()
            .expect("a browser that starts");
        let mut patience = 600;
        while child.try_wait().expect("a browser").is_none() {
            patience -= 1;
            if patience == 0 {
                let _ = child.kill();
                panic!("{} does not come back from {}", self.0.display(), file.display());
            }
            std::thread::sleep(Duration::from_millis(200));
        }
        let text = fs::read(&printed).expect("what was printed");
        let _ = (fs::remove_dir_all(&profile), fs::remove_file(&printed));
        String::from_utf8_lossy(&text).into_owned()
    }
}

fn last(document: &str) -> &str {
    &document[document.len().saturating_sub(600)..]
}

fn found_out(document: &str) -> BTreeMap<String, Value> {
    let start =
        document.find("<pre id=\"selftest\">").unwrap_or_else(|| panic!("no test of itself: {}", last(document)));
    let text = &document[start + "<pre id=\"selftest\">".len()..];
    let text =
        text[..text.find("</pre>").expect("its end")].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}
