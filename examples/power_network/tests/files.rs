//! Are the committed files what the model says, is the model the published one, and is what it leaves out bounded by w?

use std::path::Path;

use example_kit::random::Random;
use power_network::areas::{AREA, AREAS, NX};
use power_network::files::{Design, Known, Plant};
use power_network::model::Model;
use power_network::runs::promise;
use power_network::shares::{largest, largest_error};

#[test]
fn committed_files_are_what_the_model_says() {
    for design in Design::ALL {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(design.path());
        let committed = std::fs::read_to_string(path).unwrap();
        assert!(
            committed == design.text(),
            "{} is stale: cargo run --release -p power-network -- --designs",
            design.path()
        );
    }
}

/// Rows of area 1 and of area 3, and the load of area 4, as `dataSim.mat` of MPT3 has them, to its last digits.
#[test]
fn the_model_is_the_published_one() {
    let close = |a: &[f64], b: &[f64]| assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-11), "{a:?} {b:?}");
    let held = Model::angles_held();
    close(
        &held.A.rows[0][..5],
        &[0.9232015251377648, 0.8485640628171588, 0.012029039486303678, 0.0015931028348010715, 0.07679847486201574],
    );
    close(
        &held.A.rows[10][8..12],
        &[1.65752552188499, -8.090346252470061, -0.11316735455268294, -0.030016992648621538],
    );
    close(&[held.B.rows[15][3], held.M.rows[15][3]], &[0.7354968833352158, 0.6127229153613254]);
    let exact = Model::exact();
    close(
        &exact.A.rows[3][4..9],
        &[-2.5014042387049282, -1.1461172855878268, -0.011336263350006542, -0.002199564760228738, -0.03723425052882727],
    );
    close(&[exact.B.rows[3][1], exact.M.rows[3][1]], &[-0.0052877375344889035, 0.01882356564472408]);
}

/// Random states, inputs and loads at their bounds: the exact plant's next state is the model's and something of w.
#[test]
fn what_the_model_leaves_out_lies_in_w() {
    for design in Design::ALL.into_iter().filter(|design| design.plant == Plant::Exact) {
        let (promise, exact, model) = (promise(design).unwrap(), Model::exact(), design.model());
        let mut random = Random::new(5);
        let mut closest = f64::INFINITY;
        for _ in 0..3000 {
            let x: Vec<f64> =
                (0..AREAS * NX).map(|k| corner(&mut random, promise.subsystems[k / NX].X.interval(k % NX))).collect();
            let u = AREA.map(|area| corner(&mut random, [-area.power, area.power]));
            let d = AREA.map(|area| corner(&mut random, area.load));
            let known = if design.loads == Known::Measured { d } else { [0.0; AREAS] };
            let (next, told) = (exact.next(&x, &u, &d), model.next(&x, &u, &known));
            for (i, subsystem) in promise.subsystems.iter().enumerate() {
                let w: Vec<f64> = (NX * i..NX * (i + 1)).map(|k| next[k] - told[k]).collect();
                let set = subsystem.disturbance.as_ref().unwrap();
                let left = set.margins(&w).zip(&set.h).map(|(margin, h)| margin / h).fold(f64::INFINITY, f64::min);
                assert!(left >= -1e-9, "{design}: {w:?}");
                closest = closest.min(left);
            }
        }
        assert!(closest < 0.5, "{design}: w is far too large, {closest}");
    }
}

fn corner(random: &mut Random, [low, high]: [f64; 2]) -> f64 {
    if random.integer(0, 1) == 0 { low } else { high }
}

/// The benchmark's loads can be designed for, measured or not, on the model and on the exact plant; twice of them cannot.
#[test]
fn all_of_the_benchmarks_loads_have_a_design() {
    for design in Design::ALL {
        let share = largest(design, design.horizon()).unwrap();
        println!("{design}: {share:.3}");
        assert!((1.0..2.0).contains(&share), "{design}: {share}");
    }
}

/// Angles alone are not enough of a model for the exact plant, whatever the loads.
#[test]
fn the_exact_plant_needs_the_neighbours_frequencies() {
    let share = |plant| largest_error(Design { plant, loads: Known::Measured }, 1).unwrap();
    let (angles, frequencies) = (share(Plant::ExactByAngles), share(Plant::Exact));
    println!("of what the model leaves out: {angles:.3} by angles alone, {frequencies:.3} with frequencies");
    assert!((0.5..1.0).contains(&angles) && frequencies > 2.0);
}
