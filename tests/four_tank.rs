//! Does the four-tank's design reach the figures it is known for?

use std::path::Path;

use dpc_codegen::design::Design;
use dpc_codegen::sizing::SubsystemSizing;
use dpc_tests::read;

fn design(file: &str) -> Design {
    let source = read(&Path::new("../examples/four_tank").join(file));
    let text = source.clone();
    Design::new(source).unwrap_or_else(|mistakes| panic!("{}", mistakes.render(&text, false)))
}

fn shown(design: &Design) -> String {
    let one = |s: &SubsystemSizing| format!("[{}, {}] with Delta^z = {}", s.Y.min[0], s.Y.max[0], s.dz[0]);
    design.sizing.subsystems.iter().map(one).collect::<Vec<_>>().join(" x ")
}

/// Plain Riccati gains, epsilon = 0.02, N = 3, no wish for a reserve: 6.29 x 6.56 = 41 was known.
#[test]
fn without_a_reserve_the_set_points_fill_41_square_centimetres() {
    let design = design("designs/minimal_reserve.toml");
    let area: f64 = design.sizing.subsystems.iter().map(|s| s.Y.volume()).product();
    println!("minimal reserve: Y = {}, area {area}", shown(&design));
    assert_eq!((design.sizing.epsilon, design.network.horizon), (0.02, 3));
    assert!(area >= 41.0, "{area}");
}

/// Delta^z >= 0.05 and Y = -Y: 2.49 was known.
#[test]
fn with_a_reserve_of_0_05_the_half_width_is_2_49() {
    let design = design("designs/reserve.toml");
    println!("reserve 0.05: Y = {}", shown(&design));
    assert_eq!((design.sizing.epsilon, design.network.horizon), (0.02, 3));
    for s in &design.sizing.subsystems {
        assert!(s.dz[0] >= 0.05, "{}", s.dz[0]);
        assert!(s.Y.max[0] >= 2.49 && s.Y.min[0] <= -2.49, "{:?}", s.Y);
    }
}

/// The example covers what it announces and keeps a reserve that is not at the end of what can be had.
#[test]
fn the_example_covers_its_set_points_and_sits_inside_the_trade() {
    let design = design("system.toml");
    println!("example: Y = {}", shown(&design));
    let [left, right] = &design.sizing.subsystems[..] else { panic!("two subsystems") };
    assert!(left.Y.min[0] <= -1.0 && left.Y.max[0] >= 2.5 && right.Y.min[0] <= -1.0 && right.Y.max[0] >= 1.0);
    let volume = |reserve: f64| design.sizing.trade.iter().find(|point| point.reserve == reserve)?.y_volume;
    assert!(volume(0.1).is_some_and(|volume| volume > 1.0), "less reserve would give more set-points");
    assert!(volume(1.5).is_some_and(|volume| volume < 1.0), "more reserve could be had");
}
