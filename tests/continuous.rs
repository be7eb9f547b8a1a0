//! Is a model in continuous time sampled as it should be, and does the disturbance that is offered cover what holding the
//! coupling leaves out? References are exponentials of 106 bits, made here from series.
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::path::Path;

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Source, code};
use dpc_codegen::emit::Emitted;
use dpc_codegen::network::{HoldError, Network, Subsystem};
use dpc_codegen::notices::notices;
use dpc_codegen::optim::exponential::{Enclosure, exponential};
use dpc_codegen::summary::Summary;
use dpc_tests::double_double::Wide;
use dpc_tests::{Random, lower, read};
use nalgebra::{DMatrix, DVector, dmatrix};

type Rows = Vec<Vec<Wide>>;

fn accepted(source: &Source) -> Network {
    lower(source.clone()).unwrap_or_else(|errors| panic!("{}", errors.render(source, false)))
}

fn case(name: &str) -> Source {
    read(&Path::new("cases/accept").join(name))
}

/// The same file with matrices taken as they stand, which are those of continuous time then.
fn unsampled(source: &Source) -> Network {
    let line = "hold-error = \"disturbance\"\n";
    let text = source.text.replace("time = \"continuous\"\n", "").replace(line, "");
    accepted(&Source { text, ..source.clone() })
}

fn wide(matrix: &DMatrix<f64>) -> Rows {
    matrix.row_iter().map(|row| row.iter().map(|entry| Wide::from(*entry)).collect()).collect()
}

fn times(a: &Rows, b: &Rows) -> Rows {
    let columns = b.first().map_or(0, Vec::len);
    let entry = |row: &[Wide], c: usize| row.iter().zip(b).fold(Wide::ZERO, |sum, (x, row)| sum + *x * row[c]);
    a.iter().map(|row| (0..columns).map(|c| entry(row, c)).collect()).collect()
}

fn map(a: &Rows, b: &Rows, f: impl Fn(Wide, Wide) -> Wide) -> Rows {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect()).collect()
}

/// e^A by scaling, 30 terms and squaring.
fn reference(A: &Rows) -> Rows {
    let n = A.len();
    let norm = A.iter().map(|row| row.iter().map(|x| x.abs().value()).sum::<f64>()).fold(0.0, f64::max);
    let halvings = (norm * 8.0).log2().ceil().max(0.0) as i32;
    let scale = Wide::from(0.5f64.powi(halvings));
    let scaled: Rows = A.iter().map(|row| row.iter().map(|x| *x * scale).collect()).collect();
    let mut sum = wide(&DMatrix::identity(n, n));
    let mut term = sum.clone();
    for k in 1..=30 {
        term = times(&term, &scaled);
        term.iter_mut().flatten().for_each(|x| *x = *x / Wide::from(f64::from(k)));
        sum = map(&sum, &term, |a, b| a + b);
    }
    (0..halvings).for_each(|_| sum = times(&sum, &sum));
    sum
}

/// e^{A h} and its integral times B.
fn sampled(A: &Rows, B: &Rows, h: f64) -> (Rows, Rows) {
    let (n, m) = (A.len(), B.first().map_or(0, Vec::len));
    let h = Wide::from(h);
    let mut whole = vec![vec![Wide::ZERO; n + m]; n + m];
    for r in 0..n {
        (0..n).for_each(|c| whole[r][c] = A[r][c] * h);
        (0..m).for_each(|c| whole[r][n + c] = B[r][c] * h);
    }
    let after = reference(&whole);
    (after[..n].iter().map(|row| row[..n].to_vec()).collect(), after[..n].iter().map(|row| row[n..].to_vec()).collect())
}

fn value(rows: &Rows) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows.first().map_or(0, Vec::len), |r, c| rows[r][c].value())
}

#[test]
fn the_enclosure_holds_the_exact_exponential() {
    let mut random = Random(3);
    let mut widest: f64 = 0.0;
    for k in 0..300 {
        let n = 1 + random.below(7);
        let size = random.magnitude(1e-3, 30.0);
        let mut A = DMatrix::from_fn(n, n, |_, _| size * random.between(-1.0, 1.0));
        if k % 3 == 0 {
            // Stiff, and far from symmetric.
            (0..n).for_each(|r| A[(r, r)] -= random.magnitude(1.0, 1e3));
            (1..n).for_each(|r| A[(0, r)] *= 100.0);
        }
        let (found, exact) = (exponential(&Enclosure::exactly(A.clone())).expect("finite"), reference(&wide(&A)));
        let largest = found.middle.amax().max(1e-12);
        for (r, c) in (0..n).flat_map(|r| (0..n).map(move |c| (r, c))) {
            let off = (Wide::from(found.middle[(r, c)]) - exact[r][c]).abs().value();
            assert!(off <= found.radius[(r, c)], "{A}{off:e} {:e}", found.radius[(r, c)]);
            assert!(off <= 1e-10 * largest, "{A}{off:e} {largest:e}");
        }
        widest = widest.max(found.radius.amax() / largest);
        if k % 3 != 0 {
            assert!((A.exp() - &found.middle).amax() <= 1e-11 * largest, "{A}");
        }
    }
    println!("widest enclosure, relative: {widest:.2e}");
    assert!(widest < 1e-6);
}

#[test]
fn easy_exponentials_are_exact() {
    let nilpotent = exponential(&Enclosure::exactly(dmatrix![0.0, 0.5; 0.0, 0.0])).expect("finite");
    assert_eq!(nilpotent.middle, dmatrix![1.0, 0.5; 0.0, 1.0]);
    assert!(nilpotent.radius.amax() < 1e-14);
    assert!(exponential(&Enclosure::exactly(dmatrix![1e4])).is_none(), "overflows");
    assert!(exponential(&Enclosure::exactly(dmatrix![f64::NAN])).is_none());
}

/// x1+ = e^{-h/T1} x1 + (1 - e^{-h/T1}) (T1/T4 h4 + T1 g v1): the flow from the other subsystem is held.
#[test]
fn the_four_tank_is_sampled_tank_by_tank() {
    let network = accepted(&case("four_tank_continuous.toml"));
    let [left, right] = &network.subsystems[..] else { panic!("two subsystems") };
    let (T1, T4, h): (f64, f64, f64) = (62.70338973387792, 23.890015378634814, 0.5);
    let decay = (-h / T1).exp();
    assert!((left.A[(0, 0)] - decay).abs() < 1e-15 && left.A[(0, 1)] == 0.0);
    let held = (&left.E * &left.L[&1] * &right.Cz)[(0, 1)];
    assert!((held - (1.0 - decay) * T1 / T4).abs() < 1e-15, "{held}");
    assert!((left.B[(0, 0)] - (1.0 - decay) * T1 * 0.7 * 3.35 / 28.0).abs() < 1e-15);
    // The printed model of the paper is the exact discretisation, rounded.
    assert!((left.A[(0, 0)] - 0.9921).abs() < 5e-5 && (held - 0.0206).abs() < 3e-4);
}

/// The example's discrete model was made elsewhere, with neighbours' angles held, and rounded to 12 digits.
#[test]
fn the_power_network_is_the_one_of_the_example() {
    let example = accepted(&read(Path::new("../examples/power_network/system.toml")));
    let network = accepted(&case("power_network_continuous.toml"));
    let near = |a: &DMatrix<f64>, b: &DMatrix<f64>| {
        (a - b).iter().zip(b).all(|(off, b)| off.abs() <= 1e-11 * b.abs().max(1e-3))
    };
    for (ours, theirs) in network.subsystems.iter().zip(&example.subsystems) {
        assert!(near(&ours.A, &theirs.A) && near(&ours.B, &theirs.B) && near(&ours.loads.M, &theirs.loads.M));
        for (j, L) in &theirs.L {
            let coupling = |s: &Subsystem, L: &DMatrix<f64>, from: &Subsystem| &s.E * L * &from.Cz;
            let (a, b) = (&network.subsystems[*j], &example.subsystems[*j]);
            assert!(near(&coupling(ours, &ours.L[j], a), &coupling(theirs, L, b)));
        }
    }
}

/// However it is stated, it is the same network; `w`, if any, stays what it was.
#[test]
fn three_ways_to_state_a_model_are_sampled_alike() {
    let [blocks, collective, interaction] =
        ["four_tank_blocks.toml", "four_tank_collective.toml", "four_tank_interaction.toml"].map(|name| {
            let case = case(name);
            let text = case.text.replacen("sample-time", "time = \"continuous\"\nsample-time", 1);
            accepted(&Source { text, ..case })
        });
    for other in [&collective, &interaction] {
        let (a, b) = (Whole::of(&blocks), Whole::of(other));
        assert!((a.A - b.A).amax() < 1e-15 && (a.from - b.from).amax() < 1e-15);
        let (Some(a), Some(b)) = (&blocks.hold, &other.hold) else { panic!("sampled") };
        for (a, b) in a.errors.iter().flatten().flatten().zip(b.errors.iter().flatten().flatten()) {
            let ((a, b), (c, d)) = (ends(a), ends(b));
            assert!((a - c).abs() <= 1e-5 * a && (b - d).abs() <= 1e-5 * b);
        }
    }
}

/// The model of all subsystems together: over states, and over inputs and loads, subsystem by subsystem.
struct Whole {
    A: DMatrix<f64>,
    from: DMatrix<f64>,
}

impl Whole {
    fn of(network: &Network) -> Self {
        let all = &network.subsystems;
        let offsets = |size: fn(&Subsystem) -> usize| -> Vec<usize> {
            (0..=all.len()).map(|k| all[..k].iter().map(size).sum()).collect()
        };
        let driven: fn(&Subsystem) -> usize = |s| s.m() + s.loads.len();
        let (x, v) = (offsets(Subsystem::n), offsets(driven));
        let mut whole =
            Self { A: DMatrix::zeros(x[all.len()], x[all.len()]), from: DMatrix::zeros(x[all.len()], v[all.len()]) };
        for (i, s) in all.iter().enumerate() {
            whole.A.view_mut((x[i], x[i]), s.A.shape()).copy_from(&s.A);
            whole.from.view_mut((x[i], v[i]), s.B.shape()).copy_from(&s.B);
            whole.from.view_mut((x[i], v[i] + s.m()), s.loads.M.shape()).copy_from(&s.loads.M);
            for (&j, L) in &s.L {
                let z = &s.E * L;
                whole.A.view_mut((x[i], x[j]), (s.n(), all[j].n())).copy_from(&(&z * &all[j].Cz));
                whole.from.view_mut((x[i], v[j]), (s.n(), all[j].m())).copy_from(&(&z * &all[j].Dz));
            }
        }
        whole
    }
}

/// What the exact discretisation adds to the sampled network, and where states, inputs and loads may be.
struct Difference {
    of_x: DMatrix<f64>,
    of_v: DMatrix<f64>,
    x: Vec<(f64, f64)>,
    v: Vec<(f64, f64)>,
    claimed: Vec<(f64, f64)>,
}

impl Difference {
    /// Of a file whose signals have bounds one by one.
    fn of(source: &Source) -> Self {
        let (continuous, network) = (Whole::of(&unsampled(source)), accepted(source));
        let (A, from) = sampled(&wide(&continuous.A), &wide(&continuous.from), network.sample_time);
        let held = Whole::of(&network);
        let less = |exact: &Rows, held: &DMatrix<f64>| value(&map(exact, &wide(held), |a, b| a - b));
        let bounds = |set: &dpc_codegen::network::NamedPolytope| {
            (0..set.H.ncols()).map(|k| (end(set, k, -1.0), end(set, k, 1.0))).collect::<Vec<_>>()
        };
        let of_loads = |s: &Subsystem| (0..s.loads.len()).map(|k| (s.loads.min[k], s.loads.max[k])).collect::<Vec<_>>();
        let hold = network.hold.as_ref().expect("sampled");
        Self {
            of_x: less(&A, &held.A),
            of_v: less(&from, &held.from),
            x: network.subsystems.iter().flat_map(|s| bounds(&s.X)).collect(),
            v: network.subsystems.iter().flat_map(|s| [bounds(&s.U), of_loads(s)].concat()).collect(),
            claimed: hold.errors.iter().flatten().flatten().map(ends).collect(),
        }
    }

    fn at(&self, x: &DVector<f64>, v: &DVector<f64>) -> DVector<f64> {
        &self.of_x * x + &self.of_v * v
    }

    /// The corner at which state r is furthest off.
    fn worst(&self, r: usize, sign: f64) -> (DVector<f64>, DVector<f64>) {
        let corner = |row: Vec<f64>, bounds: &[(f64, f64)]| {
            DVector::from_fn(bounds.len(), |k, _| if sign * row[k] > 0.0 { bounds[k].1 } else { bounds[k].0 })
        };
        let row = |matrix: &DMatrix<f64>| matrix.row(r).iter().copied().collect::<Vec<_>>();
        (corner(row(&self.of_x), &self.x), corner(row(&self.of_v), &self.v))
    }
}

/// The bound of signal k in a box.
fn end(set: &dpc_codegen::network::NamedPolytope, k: usize, sign: f64) -> f64 {
    let row = set.H.row_iter().position(|row| row[k] == sign).expect("a bound of every signal");
    sign * set.h[row]
}

/// (below, above)
fn ends(error: &HoldError) -> (f64, f64) {
    match error {
        HoldError::Within { below, above } => (*below, *above),
        HoldError::Unbounded(signals) => panic!("unbounded: {signals:?}"),
    }
}

/// With bounds on everything.
fn bounded_power_network() -> Source {
    let case = case("power_network_continuous.toml");
    let text =
        case.text.replace("-inf, -inf, -inf]", "-0.05, -0.4, -0.5]").replace("inf, inf, inf]", "0.03, 0.5, 0.4]");
    Source { text, ..case }
}

/// Three subsystems in a ring that act on each other by states and inputs, with loads.
fn random_ring(seed: u64) -> Source {
    let mut random = Random(seed);
    let period = random.magnitude(0.01, 1.0);
    let mut text = format!("name = \"ring\"\ntime = \"continuous\"\nsample-time = {period}\nhorizon = 2\n");
    for i in 0..3 {
        let mut A = random.matrix(3, 3);
        (0..3).for_each(|k| A[(k, k)] -= random.between(0.0, 3.0));
        let bounds = |random: &mut Random, n: usize| {
            let side = |random: &mut Random| (0..n).map(|_| random.magnitude(0.1, 10.0)).collect::<Vec<_>>();
            let min: Vec<f64> = side(random).iter().map(|end| -end).collect();
            format!("{{ min = {min:?}, max = {:?} }}", side(random))
        };
        let (x, u, d) = (bounds(&mut random, 3), bounds(&mut random, 2), bounds(&mut random, 1));
        text += &format!(
            "[subsystem.s{i}]\nstates = [\"a\", \"b\", \"c\"]\ninputs = [\"u\", \"v\"]\noutputs = [\"a\"]\nA = {}\nB = {}\nC = [[1, 0, 0]]\nx = {x}\nu = {u}\nloads = [\"d\"]\nM = {}\nd = {d}\n[subsystem.s{i}.from.s{}]\nA = {}\nB = {}\n",
            rows(&A),
            rows(&random.matrix(3, 2)),
            rows(&random.matrix(3, 1)),
            (i + 1) % 3,
            rows(&random.matrix(3, 3)),
            rows(&random.matrix(3, 2)),
        );
    }
    Source { path: "ring.toml".to_owned(), text }
}

fn rows(matrix: &DMatrix<f64>) -> String {
    let rows: Vec<Vec<f64>> = matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
    format!("{rows:?}")
}

#[test]
fn the_offered_disturbance_covers_the_exact_discretisation_and_is_tight() {
    let mut sources = vec![case("four_tank_continuous.toml"), bounded_power_network()];
    sources.extend((0..40).map(random_ring));
    let mut random = Random(17);
    let mut loosest: f64 = 1.0;
    for source in &sources {
        let difference = Difference::of(source);
        let inside = |random: &mut Random, bounds: &[(f64, f64)]| {
            DVector::from_fn(bounds.len(), |k, _| random.between(bounds[k].0, bounds[k].1))
        };
        let check = |off: &DVector<f64>| {
            for (off, (below, above)) in off.iter().zip(&difference.claimed) {
                // Where nothing is held, the two differ by the rounding of e^{A_ii h} alone.
                let exact = *below == 0.0 && *above == 0.0 && off.abs() < 1e-13;
                assert!(exact || -below <= *off && *off <= *above, "{}: {off:e} of {below:e}, {above:e}", source.path);
            }
        };
        for _ in 0..200 {
            check(&difference.at(&inside(&mut random, &difference.x), &inside(&mut random, &difference.v)));
        }
        let mut least: f64 = 1.0;
        for (r, (below, above)) in difference.claimed.iter().enumerate() {
            for (sign, claimed) in [(1.0, above), (-1.0, below)] {
                let (x, v) = difference.worst(r, sign);
                let off = difference.at(&x, &v);
                check(&off);
                if *claimed > 1e-9 {
                    least = least.min(sign * off[r] / claimed);
                }
            }
        }
        if source.path != "ring.toml" {
            println!("{}: corners reach {least:.8} of every bound; bounds {:?}", source.path, difference.claimed);
        }
        loosest = loosest.min(least);
    }
    println!("corners reach at least {loosest:.8} of the bound");
    assert!(loosest > 0.9999, "{loosest}");
}

/// Sets that are no boxes: the bound holds at their corners, and is below that of the box around them.
#[test]
fn general_constraints_are_used() {
    let boxed = case("four_tank_continuous.toml");
    let slanted = boxed.text.replace("max = [27.6, 38.6] }", "max = [27.6, 38.6], H = [[1, 1]], h = [30] }");
    let slanted = Source {
        text: slanted.replace("max = [27.3, 38.2] }", "max = [27.3, 38.2], H = [[1, 1]], h = [10] }"),
        ..boxed.clone()
    };
    let [all, fewer] = [&boxed, &slanted].map(|source| {
        let network = accepted(source);
        network.hold.and_then(|hold| hold.errors).expect("bounds").iter().flatten().map(ends).collect::<Vec<_>>()
    });
    assert!(all.iter().zip(&fewer).all(|(all, fewer)| fewer.0 <= all.0 && fewer.1 <= all.1));
    assert!(fewer[0].0 < 0.65 * all[0].0, "h4 reaches 22.7 cm now: {all:?} {fewer:?}");
    let difference = Difference::of(&boxed);
    // h3 = -12.7, h4 = 22.7, and inputs at their ends.
    let (x, _) = (DVector::from_vec(vec![0.0, 0.0, -12.7, 22.7]), ());
    let (_, v) = difference.worst(0, -1.0);
    let off = -difference.at(&x, &v)[0];
    assert!(off <= fewer[0].0 && off > 0.99 * fewer[0].0, "{off} {:?}", fewer[0]);
}

/// A stated w and the hold error together: every sum of both is inside, and a box stays a box.
#[test]
fn a_stated_disturbance_is_added() {
    let plain = case("four_tank_continuous.toml");
    let boxed =
        plain.text.replacen("u = { min = -3", "w = { min = [-0.002, 0], max = [0.001, 0.003] }\nu = { min = -3", 1);
    let general = plain.text.replacen(
        "u = { min = -3",
        "w = { H = [[1, 1], [-1, -1], [1, -1], [-1, 1]], h = [1e-3, 1e-3, 2e-3, 1e-3] }\nu = { min = -3",
        1,
    );
    let network = |text: String| accepted(&Source { text, ..plain.clone() });
    let (hold, boxed, general) = (network(plain.text.clone()), network(boxed), network(general));
    let (below, above) = ends(&hold.hold.as_ref().and_then(|hold| hold.errors.as_ref()).expect("bounds")[0][0]);
    let set = |network: &Network| network.subsystems[0].w.as_ref().expect("charged").set.clone();
    let support =
        |network: &Network, d: [f64; 2]| set(network).support(&DVector::from_row_slice(&d)).expect("bounded").0;
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
    assert!(near(support(&hold, [1.0, 0.0]), above) && near(support(&hold, [-1.0, 0.0]), below));
    assert!(near(support(&boxed, [1.0, 0.0]), above + 0.001) && near(support(&boxed, [-1.0, 0.0]), below + 0.002));
    assert!(near(support(&boxed, [0.0, 1.0]), 0.003));
    let mut random = Random(23);
    let mut farthest = f64::NEG_INFINITY;
    for _ in 0..2000 {
        let s = [random.between(-1e-3, 1e-3), random.between(-1e-3, 2e-3)];
        // Coordinates of a point of the stated set.
        let w = DVector::from_vec(vec![0.5 * (s[0] + s[1]) + random.between(-below, above), 0.5 * (s[0] - s[1])]);
        farthest = farthest.max(set(&general).violation(&w));
    }
    assert!(farthest <= 0.0 && farthest > -1e-4, "{farthest}");
}

/// Own states may go without bounds: nothing about them is held. Those that reach a neighbour and come back may not.
#[test]
fn only_what_the_error_depends_on_needs_bounds() {
    let case = case("power_network_continuous.toml");
    let network = accepted(&case);
    let errors = network.hold.as_ref().and_then(|hold| hold.errors.as_ref()).expect("a small network");
    let HoldError::Unbounded(signals) = &errors[0][0] else { panic!("bounded") };
    assert!(
        signals.contains(&"domega of area_2".to_owned())
            && !signals.iter().any(|s| s.starts_with("dtheta") || s.starts_with("dPref"))
    );
    let one_way = r#"
name = "one-way"
time = "continuous"
sample-time = 0.1
horizon = 2
[subsystem.up]
states = ["p", "q"]
inputs = ["u"]
outputs = ["p"]
A = [[-1, 1], [0, -1]]
B = [[0], [1]]
C = [[1, 0]]
x = { min = -1, max = 1 }
u = { min = -1, max = 1 }
[subsystem.down]
states = ["r"]
inputs = ["v"]
outputs = ["r"]
A = [[-1]]
B = [[1]]
C = [[1]]
[subsystem.down.from.up]
A = [[1, 0]]
"#;
    let network = accepted(&Source { path: "one_way.toml".to_owned(), text: one_way.to_owned() });
    let errors = network.hold.as_ref().and_then(|hold| hold.errors.as_ref()).expect("a small network");
    assert!(errors[0].iter().all(|error| ends(error) == (0.0, 0.0)), "nothing acts on `up`: {:?}", errors[0]);
    // p moves by at most 0.2 within a period, of which half counts for 0.1 s.
    assert!((1e-3..2e-2).contains(&ends(&errors[1][0]).1), "{:?}", errors[1]);
}

/// No dense exponential of a network that is far too large for it, and no promise either.
#[test]
fn large_networks_are_sampled_without_a_bound() {
    let one = |k: usize| {
        format!(
            "[subsystem.s{k}]\nstates = [\"x\"]\ninputs = [\"u\"]\noutputs = [\"x\"]\nA = [[-1]]\nB = [[1]]\nC = [[1]]\nx = {{ min = -1, max = 1 }}\nu = {{ min = -1, max = 1 }}\n[subsystem.s{k}.from.s{}]\nA = [[0.1]]\n",
            (k + 1) % 501
        )
    };
    let head = "name = \"long\"\ntime = \"continuous\"\nsample-time = 0.1\nhorizon = 1\n";
    let text: String = std::iter::once(head.to_owned()).chain((0..501).map(one)).collect();
    let reported = accepted(&Source { path: "long.toml".to_owned(), text: text.clone() });
    assert!(reported.hold.as_ref().is_some_and(|hold| hold.errors.is_none()));
    assert!((reported.subsystems[7].A[(0, 0)] - (-0.1f64).exp()).abs() < 1e-15);
    let charged = text.replacen("sample-time", "hold-error = \"disturbance\"\nsample-time", 1);
    let errors = lower(Source { path: "long.toml".to_owned(), text: charged }).expect_err("no bound");
    assert_eq!(errors.0.iter().map(|error| error.code).collect::<Vec<_>>(), [code::HOLD_ERROR]);
}

#[test]
fn the_summary_says_what_was_left_out() {
    let charged = case("four_tank_continuous.toml");
    let reported = Source { text: charged.text.replace("hold-error = \"disturbance\"\n", ""), ..charged.clone() };
    let summary = |source: &Source| {
        let design = Design::new(source.clone()).unwrap_or_else(|errors| panic!("{}", errors.render(source, false)));
        let emitted = Emitted::new(&design);
        Summary::new(&design, &emitted).to_string()
    };
    let header = |source: &Source| {
        let design = Design::new(source.clone()).expect("a design");
        Emitted::new(&design).files[1]
            .1
            .lines()
            .take_while(|line| line.starts_with("//"))
            .collect::<Vec<_>>()
            .join("\n")
    };
    assert!(
        header(&charged).contains("// Matrices come from ../import/four_tank_continuous.npz.\n"),
        "{}",
        header(&charged)
    );
    assert!(header(&charged).ends_with("what that leaves out is part of w."), "{}", header(&charged));
    assert!(header(&reported).ends_with("what that leaves out is not charged."), "{}", header(&reported));
    let [charged, reported] = [&charged, &reported].map(summary);
    println!("{charged}\n{reported}");
    assert!(charged.contains("sampled from continuous time") && charged.contains("h2 0 cm (in w)\n"));
    assert!(!reported.contains("(in w)") && reported.contains("hold-error = \"disturbance\""));
    let unbounded = summary(&case("power_network_continuous.toml"));
    let unbounded = unbounded.split_whitespace().collect::<Vec<_>>().join(" ");
    println!("{unbounded}");
    assert!(unbounded.contains("dtheta without bound") && unbounded.contains("has no bound: dPm of area_1"));
}

#[test]
fn conspicuous_sample_times_are_noted() {
    let case = case("four_tank_continuous.toml");
    let text =
        case.text.replace("sample-time = 0.5", "sample-time = 200").replace("hold-error = \"disturbance\"\n", "");
    let slow = Source { text: text.replace("epsilon = 0.02", ""), ..case };
    let design = Design::new(slow.clone()).unwrap_or_else(|errors| panic!("{}", errors.render(&slow, false)));
    let hold = design.network.hold.as_ref().expect("sampled");
    assert!((hold.fastest[1].decay - 1.0 / 23.890015378634814).abs() < 1e-12 && hold.fastest[1].turn == 0.0);
    let notices = notices(&design);
    assert!(
        notices.iter().any(|notice| notice.contains("a mode of `right` (time constant 23.89 s) dies out")),
        "{notices:?}"
    );
}
