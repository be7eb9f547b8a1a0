//! Do robots keep apart, wherever they start and go, and does everyone arrive or say that nobody moves?

use robots::campaign::Tally;
use robots::command::Fleet;
use robots::pace::Pace;
use robots::rule::Rule;

const SEEDS: u64 = 3;

/// `cargo run --release -p robots -- --campaign 200` is the long form.
#[test]
fn random_scenarios_see_no_collision() {
    let mut all = 0;
    for (robots, pace) in [(2, Pace::FAST), (4, Pace::FAST), (3, Pace::SLOW), (8, Pace::SLOW)] {
        let fleet = Fleet::new(robots, pace).unwrap();
        for rule in [Rule::TANGENT, Rule::PLAIN, Rule::LineOfCentres] {
            let tally = Tally::of(&fleet, robots, SEEDS, rule).unwrap();
            assert_eq!(tally.runs, SEEDS as usize);
            assert_eq!(
                (tally.collisions, tally.unguaranteed, tally.left + tally.strayed),
                (0, 0, 0),
                "{robots} {rule:?} {tally:?}"
            );
            assert!(tally.closest >= robots::arena::DIAMETER);
            all += tally.arrived;
        }
    }
    assert!(all > 0, "nobody arrives anywhere");
}
