//! Does a search for gains bring what it promises, and nothing but that?

use std::path::Path;

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Source, code};
use dpc_codegen::sizing::Sizing;
use dpc_codegen::summary::short;
use dpc_codegen::tuning::{Effort, Tuning, frozen};
use dpc_tests::{cases, read};

fn plant(name: &str) -> Source {
    read(&Path::new("cases/plants").join(name))
}

fn designed(source: &Source, effort: u8) -> Design {
    let effort = Effort::new(effort).expect("a level");
    Design::with_effort(source.clone(), effort).unwrap_or_else(|mistakes| panic!("{}", mistakes.render(source, false)))
}

fn tuning(design: &Design) -> &Tuning {
    design.tuning.as_ref().expect("a search")
}

/// Y as the product of intervals, Delta^z, and the largest epsilon for them.
fn shown(sizing: &Sizing) -> String {
    let interval =
        |k: usize| format!("[{}, {}]", short(sizing.subsystems[k].Y.min[0]), short(sizing.subsystems[k].Y.max[0]));
    let reserve: Vec<_> = sizing.subsystems.iter().map(|s| short(s.dz[0])).collect();
    format!("{:<38} {:<22} {:<9}", [interval(0), interval(1)].join(" x "), reserve.join(", "), short(sizing.epsilon))
}

/// Set-points and reserve are stated in the file and hold in both designs; nothing else is wished for, so that all a
/// design has left goes into epsilon. 1.4, 1.56 and 1.7 were known for three choices of Y.
#[test]
fn at_stated_set_points_and_reserve_epsilon_grows_by_1_4() {
    let file = plant("four_tank_speed.toml");
    println!("{:<22}{:<10}{:<39}{:<23}eps", "set-points to cover", "", "Y", "Delta^z");
    for (left, right) in [([0.0, 6.0], [0.0, 6.0]), ([-2.0, 2.0], [-2.0, 2.0]), ([-1.0, 2.5], [-1.0, 1.0])] {
        let text = file.text.replace("h1 = [0.0, 6.0]", &format!("h1 = {left:?}"));
        let source = Source { text: text.replace("h3 = [0.0, 6.0]", &format!("h3 = {right:?}")), ..file.clone() };
        let (plain, tuned) = (designed(&source, 0), designed(&source, 2));
        for (label, design) in [(format!("{left:?} x {right:?}"), &plain), (String::new(), &tuned)] {
            let level = design.tuning.as_ref().map_or(0, |tuning| tuning.effort.level());
            println!("{label:<22}effort {level}  {}", shown(&design.sizing));
            for (s, [low, high]) in design.sizing.subsystems.iter().zip([left, right]) {
                assert!(s.Y.min[0] <= low && s.Y.max[0] >= high && s.dz[0] >= 0.002, "{s:?}");
            }
        }
        let gain = tuned.sizing.epsilon / plain.sizing.epsilon;
        println!("{:32}{gain:.3} times, {} designs compared", "", tuning(&tuned).compared);
        assert!(gain >= 1.4, "{gain}");
    }
}

fn print(name: &str, tuning: &Tuning) {
    println!("{name}, effort {}: {} designs compared", tuning.effort.level(), tuning.compared);
    for (what, figures) in [("effort 0", &tuning.plain), ("tuned", &tuning.tuned)] {
        println!("  {what:<9} {figures:?}");
    }
}

/// 1.19 -> 0.39 was known with other weights.
#[test]
fn a_stiff_chain_passes_the_small_gain_test_once_tuned() {
    let file = plant("chain_eth10.toml");
    let lqr = Source { text: file.text.replacen("horizon = 5", "horizon = 5\ngains = \"lqr\"", 1), ..file };
    let design = designed(&lqr, 1);
    let Tuning { plain, tuned, .. } = tuning(&design);
    print("chain of 10 masses", tuning(&design));
    assert!(plain.rho_small_gain.is_some_and(|rho| rho > 1.0) && plain.design.is_err(), "{plain:?}");
    assert!(tuned.rho_small_gain.is_some_and(|rho| rho < 0.6), "{tuned:?}");
    assert!(design.sets.rho_small_gain < 0.6 && design.gains.rho_calF < 1.0);
}

/// The matrix inequality gives the better start, equal Riccati gains of equal masses the shorter way.
#[test]
fn a_search_starts_from_both_kinds_of_gains() {
    let design = designed(&plant("chain_eth10.toml"), 2);
    let Tuning { plain, tuned, .. } = tuning(&design);
    print("chain of 10 masses", tuning(&design));
    assert!(tuned.rho_small_gain.is_some_and(|rho| rho < 0.6), "{tuned:?}");
    let (Ok(plain), Ok(tuned)) = (&plain.design, &tuned.design) else { panic!("two designs") };
    assert!(tuned.objective > plain.objective + 0.2, "{plain:?} {tuned:?}");
}

/// 0.71 -> 0.28 was known for the small gain alone; here it has to be below 0.5, and the design is to gain.
#[test]
fn the_power_network_gains_speed_reserve_and_margin() {
    let design = designed(&plant("power_network.toml"), 1);
    let Tuning { plain, tuned, .. } = tuning(&design);
    print("power network", tuning(&design));
    assert!(plain.rho_small_gain.is_some_and(|rho| rho > 0.7), "{plain:?}");
    assert!(tuned.rho_small_gain.is_some_and(|rho| rho < 0.501), "{tuned:?}");
    let (Ok(plain), Ok(tuned)) = (&plain.design, &tuned.design) else { panic!("two designs") };
    assert!(tuned.objective > plain.objective + 1.0 && tuned.epsilon > 10.0 * plain.epsilon, "{plain:?} {tuned:?}");
}

/// What the summary calls objective is what the search compares where no question of speed is asked.
#[test]
fn a_search_is_never_behind_the_plain_design() {
    for source in cases("accept") {
        let (plain, tuned) = (designed(&source, 0), designed(&source, 1));
        let (before, after) = (plain.sizing.objective, tuned.sizing.objective);
        println!("{}: {before:.4} -> {after:.4}", source.path);
        assert!(after >= before - 1e-3, "{}: {before} {after}", source.path);
        assert_eq!(tuning(&tuned).plain.design.as_ref().map(|d| d.objective), Ok(before));
    }
}

/// With plain gains moving references take 21 cm of every output.
#[test]
fn a_search_meets_margins_that_plain_gains_do_not() {
    let robots = read("../examples/robots/system.toml".as_ref());
    let is_gain = |line: &&str| ["K = ", "Kx = ", "Ke = "].iter().any(|key| line.starts_with(key));
    let lines: Vec<&str> = robots.text.lines().filter(|line| !is_gain(line)).collect();
    let text = lines.join("\n").replace("margin = 8.5", "margin = 9.5");
    let source = Source { text, ..robots };
    let Err(mistakes) = Design::new(source.clone()) else { panic!("plain gains are good enough") };
    assert_eq!(mistakes.0[0].code, code::MARGIN_TOO_SMALL);
    let tuned = designed(&source, 1);
    for sized in &tuned.sizing.subsystems {
        assert!(sized.exposed.half_widths(2).max() <= 9.5, "{:?}", sized.exposed);
    }
}

#[test]
fn the_same_file_gives_the_same_gains() {
    let source = plant("four_tank_speed.toml");
    let gains = || frozen_gains(&designed(&source, 1));
    assert_eq!(gains(), gains());
}

fn frozen_gains(design: &Design) -> String {
    frozen(&design.network, &design.gains)
}

/// The lines go below the headers they name.
#[test]
fn frozen_gains_give_the_same_design_without_a_search() {
    let source = plant("four_tank_speed.toml");
    let tuned = designed(&source, 1);
    let mut text = source.text.clone();
    for part in frozen_gains(&tuned).split("\n[").skip(1) {
        let (header, lines) = part.split_once("]\n").expect("a header above its lines");
        let at = text.find(&format!("[{header}]")).expect("the same header");
        let end = at + text[at..].find('\n').expect("a line") + 1;
        text.insert_str(end, &format!("{lines}\n"));
    }
    let frozen = Design::new(Source { text, ..source }).expect("the tuned gains hold");
    assert!(frozen.tuning.is_none());
    assert_eq!(frozen_gains(&frozen), frozen_gains(&tuned));
    assert_eq!(shown(&frozen.sizing), shown(&tuned.sizing));
    assert_eq!(frozen.sizing.epsilon.to_bits(), tuned.sizing.epsilon.to_bits());
}

#[test]
fn stated_gains_are_left_alone() {
    let source = plant("four_tank_speed.toml");
    let stated = "K = [[-0.5, 0.0]]\nKx = [[-1.0, 0.0]]\nKe = [[0.05]]\nQ = 1.0";
    let text = source.text.replacen("Q = 1.0", stated, 1);
    let design = designed(&Source { text, ..source.clone() }, 1);
    let left = &design.gains.subsystems[0];
    assert_eq!((left.K[(0, 0)], left.Kx[(0, 0)], left.Ke[(0, 0)]), (-0.5, -1.0, 0.05));
    assert!(tuning(&design).compared > 10, "the other subsystem's gains are open");
    let text = source.text.replace("Q = 1.0", stated);
    assert!(designed(&Source { text, ..source }, 3).tuning.is_none(), "nothing to search for");
}

/// Set-points that plain gains cannot cover at this reserve are covered by tuned ones; where no gains do, the message
/// says that they were searched for.
#[test]
fn a_search_meets_wishes_that_plain_gains_do_not() {
    let source = plant("four_tank_speed.toml");
    let wish = |reserve: &str| Source { text: source.text.replace("reserve = 0.002", reserve), ..source.clone() };
    let larger = wish("reserve = 0.02");
    assert!(Design::new(larger.clone()).is_err());
    let epsilon = designed(&larger, 1).sizing.epsilon;
    println!("reserve 0.02: no design with plain gains, epsilon = {epsilon} with tuned ones");
    assert!(epsilon > 0.02);
    let effort = Effort::new(1).expect("a level");
    let mistakes = Design::with_effort(wish("reserve = 5.0"), effort).expect_err("no tank holds this");
    let shown = mistakes.render(&source, false);
    assert!(shown.contains("effort 1"), "{shown}");
}
