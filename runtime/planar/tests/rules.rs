//! The rules against a scan of all directions.

use dpc_planar::{LineOfCentres, Need, Obstacle, Row, Rule, Sum, Tangent, Turn, Zonotope};
use example_kit::random::Random;

const LEFT: Tangent = Tangent::new(Turn::CounterClockwise);
const RIGHT: Tangent = Tangent::new(Turn::Clockwise);
/// Directions of a scan.
const DIRECTIONS: usize = 3600;

struct Pair {
    first: [f64; 2],
    second: [f64; 2],
    distance: f64,
    generators: Vec<[f64; 2]>,
}

impl Pair {
    /// From far apart to overlapping, with needs from round to flat, at positions from nearby to far from the origin.
    fn random(random: &mut Random) -> Self {
        let second = [random.between(-130.0, 130.0), random.between(-80.0, 80.0)];
        let distance = random.between(0.1, 8.0);
        let count = random.integer(0, 6);
        let size = random.between(0.0, 12.0);
        let flat = random.direction::<2>();
        let along = random.integer(0, 1) == 0;
        let generators = (0..count).map(|_| {
            let way: [f64; 2] = if along { flat } else { random.direction() };
            way.map(|w| w * size * random.between(0.0, 1.0))
        });
        let generators: Vec<[f64; 2]> = generators.collect();
        let apart = random.direction::<2>();
        let length = distance * random.between(0.9, 1.0) + random.between(0.0, 1.0).powi(3) * 100.0;
        Self { first: [second[0] + length * apart[0], second[1] + length * apart[1]], second, distance, generators }
    }

    fn apart(&self) -> [f64; 2] {
        [self.first[0] - self.second[0], self.first[1] - self.second[1]]
    }

    fn need(&self) -> impl Need + '_ {
        Sum(|n: &[f64; 2]| self.distance * n[0].hypot(n[1]), Zonotope { generators: &self.generators })
    }

    fn row(&self, rule: &impl Rule) -> Option<Row> {
        rule.row(&self.first, &self.second, &self.need())
    }

    fn slack(&self, normal: &[f64; 2]) -> f64 {
        let [x, y] = self.apart();
        normal[0] * x + normal[1] * y - self.need().need(normal)
    }

    /// Of all scanned directions, by angle.
    fn scan(&self) -> Vec<(f64, f64)> {
        let step = std::f64::consts::TAU / DIRECTIONS as f64;
        let slack = |angle: f64| self.slack(&[angle.cos(), angle.sin()]);
        (0..DIRECTIONS).map(|k| step * k as f64).map(|angle| (angle, slack(angle))).collect()
    }

    /// The greatest slack over all unit normals, which is at most this: between two scanned directions it rises by no more
    /// than half an angle times the largest slope.
    fn greatest(&self) -> (f64, f64) {
        let found = self.scan().into_iter().map(|(_, slack)| slack).fold(f64::NEG_INFINITY, f64::max);
        let [x, y] = self.apart();
        let slope = x.hypot(y) + self.generators.iter().map(|g| g[0].hypot(g[1])).sum::<f64>();
        (found, found + slope * std::f64::consts::PI / DIRECTIONS as f64)
    }
}

/// Counter-clockwise from `from` to `to`, in (-pi, pi].
fn angle([a, b]: [f64; 2], [c, d]: [f64; 2]) -> f64 {
    (a * d - b * c).atan2(a * c + b * d)
}

fn turned([a, b]: [f64; 2], by: f64) -> [f64; 2] {
    [a * by.cos() - b * by.sin(), a * by.sin() + b * by.cos()]
}

fn pairs(seed: u64, count: usize) -> impl Iterator<Item = Pair> {
    let mut random = Random::new(seed);
    (0..count).map(move |_| Pair::random(&mut random))
}

#[test]
fn rows_are_admissible_in_any_order_of_summation() {
    let mut rows = 0;
    for pair in pairs(1, 4000) {
        let share = Tangent { share: 0.25, ..LEFT };
        let found = [pair.row(&LEFT), pair.row(&RIGHT), pair.row(&LineOfCentres), pair.row(&share)];
        for Row { normal: [a, b], bound } in found.into_iter().flatten() {
            rows += 1;
            assert!((a.hypot(b) - 1.0).abs() < 4.0 * f64::EPSILON);
            assert_eq!(bound, pair.need().need(&[a, b]));
            let ([x1, y1], [x2, y2]) = (pair.first, pair.second);
            let sums = [
                a * (x1 - x2) + b * (y1 - y2) - bound,
                (a * x1 + b * y1) - (a * x2 + b * y2) - bound,
                (a * x1 - bound) - a * x2 + b * y1 - b * y2,
                -(a * x2) + (b * y1 - (b * y2 + bound)) + a * x1,
            ];
            assert!(sums.iter().all(|sum| *sum >= 0.0), "{sums:?}");
        }
    }
    assert!(rows > 8000, "{rows}");
}

#[test]
fn a_row_is_found_where_a_direction_is_admissible_and_nowhere_else() {
    let (mut found, mut none, mut beside) = (0, 0, 0);
    for pair in pairs(2, 3000) {
        let (least, most) = pair.greatest();
        let rows = [pair.row(&LEFT), pair.row(&RIGHT), pair.row(&LineOfCentres)];
        if least > 1e-11 {
            assert!(rows.iter().all(Option::is_some), "a direction with slack {least}");
            found += 1;
            let length = pair.apart()[0].hypot(pair.apart()[1]);
            beside += usize::from(pair.slack(&pair.apart().map(|x| x / length)) < 0.0);
        }
        if most < 0.0 {
            assert!(rows.iter().all(Option::is_none), "no direction has slack beyond {most}: {rows:?}");
            none += 1;
        }
    }
    assert!(found > 1000 && none > 300 && beside > 30, "{found} {none} {beside}");
}

#[test]
fn the_tangent_is_the_extreme_admissible_rotation() {
    for pair in pairs(3, 3000) {
        let (Some(left), Some(right)) = (pair.row(&LEFT), pair.row(&RIGHT)) else { continue };
        assert!(angle(right.normal, left.normal) >= 0.0);
        for (row, side) in [(left, 1.0), (right, -1.0)] {
            let scanned = pair.scan().into_iter().filter(|(_, slack)| *slack > 1e-11);
            let beyond = scanned.map(|(a, _)| side * angle(row.normal, [a.cos(), a.sin()])).filter(|by| *by > 0.0);
            assert_eq!(beyond.count(), 0, "{side}");
        }
    }
}

/// The line is active: a turn by 1e-8 more is not admissible, however the need is shaped, unless the arc is nearly closed.
#[test]
fn the_tangent_is_extreme_to_near_machine_precision() {
    let mut open = 0;
    for pair in pairs(4, 3000) {
        let (Some(left), Some(right)) = (pair.row(&LEFT), pair.row(&RIGHT)) else { continue };
        if angle(right.normal, left.normal) < 1e-3 {
            continue;
        }
        open += 1;
        for (row, side) in [(left, 1.0), (right, -1.0)] {
            assert!(pair.slack(&row.normal) < 1e-11, "{:e}", pair.slack(&row.normal));
            assert!(pair.slack(&turned(row.normal, side * 1e-8)) < 0.0);
        }
    }
    assert!(open > 1500, "{open}");
}

/// For a round need d the cosine of the rotation is d over the distance of the centres.
#[test]
fn round_bodies_have_the_tangent_of_elementary_geometry() {
    let mut random = Random::new(5);
    for _ in 0..1000 {
        let length = random.between(7.5, 150.0);
        let apart = random.direction::<2>().map(|x| x * length);
        let need = |_: &[f64; 2]| 7.4;
        let left = LEFT.row(&apart, &[0.0; 2], &need).unwrap();
        let right = RIGHT.row(&apart, &[0.0; 2], &need).unwrap();
        let expected = (7.4 / apart[0].hypot(apart[1])).acos();
        assert!((angle(apart, left.normal) - expected).abs() < 1e-12);
        assert!((angle(apart, right.normal) + expected).abs() < 1e-12);
    }
}

#[test]
fn the_line_of_centres_is_taken_or_else_what_is_nearest_to_it() {
    let mut beside = 0;
    for pair in pairs(6, 3000) {
        let Some(row) = pair.row(&LineOfCentres) else { continue };
        let length = pair.apart()[0].hypot(pair.apart()[1]);
        let off = angle(pair.apart(), row.normal);
        if pair.slack(&pair.apart().map(|x| x / length)) > 1e-11 {
            assert!(off.abs() < 1e-15);
        } else {
            beside += 1;
            let nearer = pair.scan().into_iter().filter(|(_, slack)| *slack > 1e-11);
            assert!(nearer.map(|(a, _)| angle(pair.apart(), [a.cos(), a.sin()])).all(|a| a.abs() >= off.abs() - 1e-12));
        }
    }
    assert!(beside > 30, "{beside}");
}

#[test]
fn a_share_of_the_greatest_slack_is_left_where_one_asks_for_it() {
    let tangent = |share| Tangent { share, ..LEFT };
    for pair in pairs(7, 1000) {
        let Some(plain) = pair.row(&LEFT) else { continue };
        let (least, most) = pair.greatest();
        for share in [0.1, 0.5, 0.9] {
            let row = pair.row(&tangent(share)).expect("some row is admissible");
            let slack = pair.slack(&row.normal);
            assert!(
                slack >= share * least - 1e-9 && slack <= share * most + 1e-9,
                "{share}: {slack} of {least}..{most}"
            );
            assert!(angle(row.normal, plain.normal) >= 0.0);
        }
        assert_eq!(pair.row(&tangent(0.0)), Some(plain));
    }
}

#[test]
fn exchanging_the_bodies_gives_the_opposite_normal_bit_for_bit() {
    for pair in pairs(8, 2000) {
        for rule in [LEFT, RIGHT, Tangent { share: 0.3, ..LEFT }] {
            let there = pair.row(&rule);
            let back = rule.row(&pair.second, &pair.first, &pair.need());
            assert_eq!(there.map(|row| row.normal.map(|n| -n)), back.map(|row| row.normal));
            assert_eq!(there.map(|row| row.bound), back.map(|row| row.bound));
        }
    }
}

#[test]
fn where_nothing_can_be_said_there_is_no_row() {
    let need = |_: &[f64; 2]| 1.0;
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX];
    for value in odd {
        for second in [[value, 0.0], [0.0, value], [-value, value]] {
            let rows = [LEFT.row(&[1.0, 2.0], &second, &need), LineOfCentres.row(&second, &[3.0, 1.0], &need)];
            assert!(value == f64::MAX || rows.iter().all(Option::is_none), "{value}");
        }
        let constant = |_: &[f64; 2]| value;
        let row = LEFT.row(&[9.0, 0.0], &[0.0; 2], &constant);
        assert_eq!(row, None, "a need of {value}");
    }
    assert_eq!(LEFT.row(&[3.0, 4.0], &[3.0, 4.0], &need), None);
    assert_eq!(LEFT.row(&[f64::MAX, 0.0], &[-f64::MAX, 0.0], &need), None);
    assert_eq!(LineOfCentres.row(&[1e-320, 0.0], &[0.0; 2], &need), None);
    assert_eq!(Tangent { share: f64::NAN, ..LEFT }.row(&[9.0, 0.0], &[0.0; 2], &need), None);
}

#[test]
fn an_obstacle_is_a_body_that_stays() {
    let disc = Obstacle { centre: [40.0, 30.0], radius: 5.0 };
    let row = disc.row(&LEFT, &[10.0, 30.0], &|_: &[f64; 2]| 4.0).unwrap();
    let pair = LEFT.row(&[10.0, 30.0], &[40.0, 30.0], &|_: &[f64; 2]| 9.0).unwrap();
    assert_eq!(row.normal, pair.normal);
    let [a, b] = row.normal;
    assert!((a * 40.0 + b * 30.0 + 9.0 - row.bound).abs() < 1e-12);
    assert!(a * 10.0 + b * 30.0 >= row.bound);
    assert!(disc.row(&LEFT, &[35.0, 30.0], &|_: &[f64; 2]| 4.0).is_none());
}

/// Two bodies that go straight at one another, each in the half-plane that (28) leaves it: with the tangent they pass on
/// the right-hand side of their ways, with the line of centres they stop in front of one another.
#[test]
fn bodies_that_meet_pass_each_other_with_the_tangent_and_stop_with_the_line_of_centres() {
    let met = |rule: &dyn Fn(&Bodies) -> Option<Row>| Meeting::run(rule, [[50.0, 0.0], [0.0, 0.0]]);
    let passed = met(&|[first, second]| LEFT.row(first, second, &ten));
    let stopped = met(&|[first, second]| LineOfCentres.row(first, second, &ten));
    assert!(passed.end[0][0] > 49.9 && passed.end[1][0] < 0.1, "{passed:?}");
    assert!(stopped.end[0][0] < stopped.end[1][0], "{stopped:?}");
    assert!(passed.least >= 10.0 - 1e-9 && stopped.least >= 10.0 - 1e-9);
    assert!(
        passed.aside < 0.0,
        "the first keeps to the right of its way, which leads along the first axis: {passed:?}"
    );
}

/// The first body's goal is across the line that keeps it away from the second, which rests far away.
#[test]
fn a_share_lets_a_body_cross_the_line_that_the_plain_tangent_holds_it_at() {
    let crossing = |share| {
        let rule = Tangent { share, ..LEFT };
        Meeting::run(&|[first, second]| rule.row(first, second, &ten), [[0.0, 40.0], [50.0, 0.0]])
    };
    let (held, crossed) = (crossing(0.0), crossing(0.2));
    assert!(held.end[0][1] < 5.0, "{held:?}");
    assert!(crossed.end[0][1] > 39.9 && crossed.least >= 10.0, "{crossed:?}");
}

type Bodies = [[f64; 2]; 2];

fn ten(_: &[f64; 2]) -> f64 {
    10.0
}

/// Of two bodies that begin at (0, 0) and (50, 0).
#[derive(Debug)]
struct Meeting {
    end: Bodies,
    /// Distance on the way.
    least: f64,
    /// The first one's largest deviation from the first axis.
    aside: f64,
}

impl Meeting {
    fn run(rule: &dyn Fn(&Bodies) -> Option<Row>, goals: Bodies) -> Self {
        let mut met = Self { end: [[0.0, 0.0], [50.0, 0.0]], least: f64::INFINITY, aside: 0.0 };
        let mut row = rule(&met.end).expect("they begin apart");
        for _ in 0..100 {
            row = rule(&met.end).unwrap_or(row);
            let [first, second] = met.end;
            let [a, b] = row.normal;
            let room = (a * (first[0] - second[0]) + b * (first[1] - second[1]) - row.bound).max(0.0) / 2.0;
            met.end = [step(first, goals[0], [-a, -b], room), step(second, goals[1], [a, b], room)];
            let [first, second] = met.end;
            met.least = met.least.min((first[0] - second[0]).hypot(first[1] - second[1]));
            met.aside = if first[1].abs() > met.aside.abs() { first[1] } else { met.aside };
        }
        met
    }
}

/// At most 2 towards the goal, of which no more than `room` along `normal`.
fn step(from: [f64; 2], goal: [f64; 2], normal: [f64; 2], room: f64) -> [f64; 2] {
    let way = [goal[0] - from[0], goal[1] - from[1]];
    let excess = (normal[0] * way[0] + normal[1] * way[1] - room).max(0.0);
    let way = [way[0] - excess * normal[0], way[1] - excess * normal[1]];
    let part = (2.0 / way[0].hypot(way[1])).min(1.0);
    [from[0] + part * way[0], from[1] + part * way[1]]
}

/// Also where the line of centres is not admissible, where nothing is, and with a share to leave.
#[test]
fn calls_evaluate_the_need_a_bounded_number_of_times() {
    let most = |rule: Tangent| {
        let counted = pairs(9, 1000).map(|pair| {
            let count = std::cell::Cell::new(0);
            let need = |normal: &[f64; 2]| {
                count.set(count.get() + 1);
                pair.need().need(normal)
            };
            rule.row(&pair.first, &pair.second, &need);
            count.get()
        });
        counted.max().unwrap()
    };
    let (plain, shared) = (most(LEFT), most(Tangent { share: 0.3, ..LEFT }));
    assert!((66..=240).contains(&plain) && (66..=470).contains(&shared), "{plain} {shared}");
}
