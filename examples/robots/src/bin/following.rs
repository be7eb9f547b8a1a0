//! Measures how far simulated e-pucks stray from the double integrators they follow.
//!
//! `cargo run --release -p robots --bin following` prints, for classes of motions with limits per axis of velocities (|v|, cm/s) and
//! accelerations (|a|, cm/s^2), what random trajectories show, what a search over the class finds, and what is declared.

use example_kit::say;
use example_kit::table::table;
use robots::class::Grid;
use robots::declared::{DECLARED, Declared};
use robots::epuck::FOLLOWER;
use robots::following::Deviation;

const SEED: u64 = 1;
const PERIODS: usize = 20_000;
const GRID: Grid = Grid { speeds: 30, ends: 30, angles: 36, climbs: 40 };

type Measure = fn(&Deviation) -> f64;

fn main() {
    let head = ["tau (s)", "|v|", "|a|", "deviation", "median", "99 %", "99.9 %", "largest", "worst found", "declared"];
    let rows: Vec<Vec<String>> = DECLARED.iter().flat_map(rows).collect();
    say!("{}", table(&head.map(str::to_owned), &rows).trim_end());
}

fn rows(Declared { class, bound }: &Declared) -> Vec<Vec<String>> {
    let random = class.random(&FOLLOWER, SEED, PERIODS);
    let worst = class.worst(&FOLLOWER, &GRID);
    let measures: [(&str, Measure); 3] = [
        ("position at samples (cm)", |deviation| deviation.position),
        ("velocity at samples (cm/s)", |deviation| deviation.velocity),
        ("position in between (cm)", |deviation| deviation.between),
    ];
    let row = |(name, measure): (&str, Measure)| {
        let limits = [class.period, class.velocity, class.acceleration].map(|limit| limit.to_string());
        let figures = quantiles(&random, measure).into_iter().chain([measure(&worst), measure(bound)]);
        limits.into_iter().chain([name.to_owned()]).chain(figures.map(|figure| format!("{figure:.4}"))).collect()
    };
    measures.into_iter().map(row).collect()
}

fn quantiles(deviations: &[Deviation], measure: Measure) -> [f64; 4] {
    let mut values: Vec<f64> = deviations.iter().map(measure).collect();
    values.sort_by(f64::total_cmp);
    [0.5, 0.99, 0.999, 1.0].map(|part| values[((values.len() - 1) as f64 * part) as usize])
}
