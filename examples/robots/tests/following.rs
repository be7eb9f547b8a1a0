//! Do simulated e-pucks follow double integrators as closely as declared?

use robots::class::{Class, Grid};
use robots::declared::{DECLARED, Declared};
use robots::epuck::{Epuck, FOLLOWER};
use robots::following::{Deviation, follow};

const GRID: Grid = Grid { speeds: 12, ends: 12, angles: 18, climbs: 4 };

#[test]
fn random_trajectories_stray_no_further_than_declared() {
    for (seed, Declared { class, bound }) in (100..).zip(DECLARED) {
        let strayed = class.random(&FOLLOWER, seed, 3000).into_iter().fold(Deviation::default(), Deviation::max);
        assert!(strayed.is_within(&bound), "{class:?}: {strayed:?}");
        assert!(strayed.between > 0.0 && strayed.position > 0.0 && strayed.velocity > 0.0);
    }
}

#[test]
fn the_worst_that_is_found_is_no_worse_than_declared() {
    for Declared { class, bound } in DECLARED {
        let worst = class.worst(&FOLLOWER, &GRID);
        assert!(worst.is_within(&bound), "{class:?}: {worst:?}");
    }
}

/// Without trigonometry and with a fixed seed, figures are the same on every machine.
#[test]
fn the_same_trajectory_strays_by_the_same_bits() {
    let class = DECLARED[0].class;
    assert_eq!(class.random(&FOLLOWER, 3, 200), class.random(&FOLLOWER, 3, 200));
    assert_ne!(class.random(&FOLLOWER, 3, 200), class.random(&FOLLOWER, 4, 200));
}

#[test]
fn a_robot_at_rest_that_is_to_rest_stays() {
    let mut robot = Epuck::at([30.0, 20.0], [0.6, 0.8]);
    assert_eq!(follow(&FOLLOWER, &mut robot, [0.0; 2], 2.0), Deviation::default());
    assert_eq!(robot, Epuck::at([30.0, 20.0], [0.6, 0.8]));
}

/// From rest into every direction: the robot turns by a quarter at most, on the spot, and is at the end where it should be.
#[test]
fn starts_in_every_direction_are_caught_up_with() {
    for k in 0..36 {
        let angle = f64::from(k) * std::f64::consts::TAU / 36.0;
        let mut robot = Epuck::at([0.0; 2], [1.0, 0.0]);
        let deviation = follow(&FOLLOWER, &mut robot, [2.0 * angle.cos(), 2.0 * angle.sin()], 2.0);
        let bound = Deviation { position: 0.02, velocity: 0.02, between: 0.25 };
        assert!(deviation.is_within(&bound), "{angle}: {deviation:?}");
        let backward = robot.motion().speed < 0.0;
        assert_eq!(backward, angle.cos() < -1e-9, "{angle}");
    }
}

/// What is beyond the drive shows as a deviation, not as a slip of the path: the robot is late on the line.
#[test]
fn what_the_wheels_cannot_do_leaves_the_robot_behind_on_its_line() {
    let mut robot = Epuck::at([0.0; 2], [1.0, 0.0]);
    let deviation = follow(&FOLLOWER, &mut robot, [12.0, 0.0], 2.0);
    assert!(deviation.position > 3.0 && robot.position[1].abs() < 1e-9, "{deviation:?}");
}

#[test]
fn the_search_finds_what_random_trajectories_do_not() {
    let Declared { class, .. } = DECLARED[0];
    let random = class.random(&FOLLOWER, 1, 500).into_iter().fold(Deviation::default(), Deviation::max);
    let worst = class.worst(&FOLLOWER, &GRID);
    assert!(random.is_within(&worst), "{random:?} {worst:?}");
    assert!(Class { acceleration: 0.5 * class.acceleration, ..class }.worst(&FOLLOWER, &GRID).between < worst.between);
}
