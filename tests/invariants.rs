//! Does what each stage promises hold on random networks, by separate code?
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostics, Source, code};
use dpc_tests::checker::{self, Claim, Collective, Rates};
use dpc_tests::exposed::Taken;
use dpc_tests::load_shares::LoadShares;
use dpc_tests::random_network::{Kind, RandomNetwork};
use dpc_tests::strips::SymmetricSet;
use dpc_tests::{Random, cases_wanted, problem_checker, read};
use nalgebra::DVector;

/// The slowest design that a user should have to wait for.
const PATIENCE: Duration = Duration::from_secs(30);

/// What a support value of Delta^chi may be charged above its sum without being counted.
const OVERCHARGE: f64 = 1e-6;

/// Codes that say "the compiler's numerics gave up", not "your network cannot be controlled so".
const WEAKNESS: [&str; 6] = ["E0302", "E0303", "E0304", "E0404", "E0405", "E0502"];

/// What became of the networks.
#[derive(Default)]
struct Campaign {
    designs: usize,
    claims: usize,
    /// The smallest slack of all claims that have one.
    worst: f64,
    /// Designs that charge more than 1e-6 too much for Delta^chi, and the most that is charged.
    overcharged: usize,
    overcharge: f64,
    slowest: (Duration, u64),
    /// Networks by the code of their first diagnostic.
    refused: BTreeMap<&'static str, Vec<u64>>,
    failures: Vec<String>,
}

impl Campaign {
    fn examine(&mut self, case: &RandomNetwork) {
        let seed = case.seed;
        let start = Instant::now();
        let design = match catch_unwind(AssertUnwindSafe(|| Design::new(case.source()))) {
            Ok(design) => design,
            Err(_) => return self.failures.push(format!("seed {seed}: the compiler panicked\n{}", case.text)),
        };
        self.slowest = self.slowest.max((start.elapsed(), seed));
        match design {
            Ok(design) => self.accept(case, &design),
            Err(diagnostics) => self.refuse(case, &diagnostics),
        }
    }

    fn accept(&mut self, case: &RandomNetwork, design: &Design) {
        self.designs += 1;
        let lowering = checker::lowering_error(&case.plant, &design.network);
        let mut claims = vec![Claim { what: "the network is what the text says".into(), slack: 1e-12 - lowering }];
        claims.extend(all_claims(design, case.seed));
        self.claims += claims.len();
        self.worst = claims.iter().map(|claim| claim.slack).fold(self.worst, f64::min);
        let overcharge = claims.iter().filter_map(Claim::overcharge).fold(0.0, f64::max);
        self.overcharged += usize::from(overcharge > OVERCHARGE);
        self.overcharge = self.overcharge.max(overcharge);
        for claim in claims.iter().filter(|claim| !claim.holds()) {
            self.failures.push(format!("seed {}: {} has slack {:e}", case.seed, claim.what, claim.slack));
        }
    }

    fn refuse(&mut self, case: &RandomNetwork, diagnostics: &Diagnostics) {
        let source = case.source();
        let shown = diagnostics.render(&source, false);
        for diagnostic in &diagnostics.0 {
            let places = diagnostic.labels.iter().map(|(place, _)| place);
            let in_text =
                |place: &std::ops::Range<usize>| !place.is_empty() && source.text.get(place.clone()).is_some();
            if diagnostic.labels.is_empty() || !places.into_iter().all(in_text) || diagnostic.helps.is_empty() {
                self.failures.push(format!("seed {}: a diagnostic without a place or a help\n{shown}", case.seed));
            }
        }
        let code = diagnostics.0.first().map_or("none", |diagnostic| diagnostic.code);
        self.refused.entry(code).or_default().push(case.seed);
        if WEAKNESS.contains(&code) {
            println!("seed {}: {shown}", case.seed);
        }
    }

    fn print(&self) {
        let refused: Vec<_> = self.refused.iter().map(|(code, seeds)| format!("{code} {}", seeds.len())).collect();
        let total = self.designs + self.refused.values().map(Vec::len).sum::<usize>();
        println!(
            "{total} networks: {} designs, {} refused ({})",
            self.designs,
            total - self.designs,
            refused.join(", ")
        );
        println!("{} claims, smallest relative slack {:.1e}", self.claims, self.worst);
        println!(
            "{} designs charge over {OVERCHARGE:e} too much for Delta^chi, at most {:.1e}",
            self.overcharged, self.overcharge
        );
        println!("slowest design: {:.2} s (seed {})", self.slowest.0.as_secs_f64(), self.slowest.1);
        self.failures.iter().for_each(|failure| println!("{failure}"));
    }
}

/// Every claim about a design and its problems.
fn all_claims(design: &Design, seed: u64) -> Vec<Claim> {
    let mut claims = checker::claims(design);
    claims.extend(problem_checker::claims(design, &mut Random(seed), 3));
    claims
}

/// `DPC_CASES` networks, or as many as `default` says, from seed `DPC_SEED` on.
fn campaign(default: usize, network: fn(u64) -> RandomNetwork) {
    let first = std::env::var("DPC_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(0_u64);
    let cases = cases_wanted(default) as u64;
    let mut campaign = Campaign::default();
    (first..first + cases).for_each(|seed| campaign.examine(&network(seed)));
    campaign.print();
    assert!(campaign.failures.is_empty(), "{} failures", campaign.failures.len());
    assert!(2 * campaign.designs as u64 >= cases, "the generator makes too many networks that cannot be designed");
    assert!(5 * campaign.overcharged < 2 * campaign.designs, "too many designs charge too much for Delta^chi");
    assert!(campaign.slowest.0 < PATIENCE, "seed {} takes too long", campaign.slowest.1);
}

#[test]
fn on_random_networks() {
    campaign(60, RandomNetwork::new);
}

/// The same networks with disturbances, measurement errors and loads.
#[test]
fn on_disturbed_networks() {
    campaign(40, RandomNetwork::disturbed);
}

/// The same networks with constraints whose rows change while running.
#[test]
fn on_networks_with_changing_constraints() {
    campaign(30, RandomNetwork::changing);
}

/// Ways to spoil what is charged for the outputs of one subsystem, and the claim that must then be broken.
const SPOILT_CHARGES: [Spoil; 5] = [
    ("changing rows are charged in full", |d, part| {
        d.sizing.subsystems[0].exposed.generators.iter_mut().for_each(|g| *g *= 1.0 - part);
    }),
    ("changing rows are charged in full", |d, _| drop(d.sizing.subsystems[0].exposed.generators.pop())),
    ("changing rows are charged in full", |d, part| d.sizing.epsilon *= 1.0 + part),
    ("changing rows are charged once", |d, part| {
        d.sizing.subsystems[0].exposed.generators.iter_mut().for_each(|g| *g *= 1.0 + part + 1e-4);
    }),
    ("(26') within the margin", |d, part| {
        let taken = d.sizing.subsystems[0].exposed.half_widths(2).max();
        let exposed = d.network.subsystems[0].exposed.as_mut().and_then(|exposed| exposed.margin.as_mut());
        exposed.into_iter().for_each(|margin| margin.value = taken * (1.0 - part));
    }),
];

#[test]
fn a_changing_row_that_is_charged_wrongly_is_caught() {
    let robots = read("../examples/robots/system.toml".as_ref());
    for (claim, spoil) in SPOILT_CHARGES {
        let mut design = Design::new(robots.clone()).expect("a design exists");
        assert_eq!(checker::broken(&design).len(), 0);
        spoil(&mut design, 1e-5);
        assert!(checker::broken(&design).iter().any(|broken| broken.what.ends_with(claim)), "{claim}");
    }
}

/// The robots' sets are fat: in any direction hardly more is charged than is taken, for every norm.
#[test]
fn hardly_more_is_charged_than_is_taken() {
    let robots = read("../examples/robots/system.toml".as_ref());
    for norm in ["1", "2", "\"inf\""] {
        let text = robots.text.replace("norm = 2", &format!("norm = {norm}"));
        let design = Design::new(Source { text, ..robots.clone() }).expect("a design exists");
        let model = Collective::new(&design);
        let rates = Rates::new(&model, design.network.reference.norm).expect("references settle");
        let loads = LoadShares::new(&model, &design.network).expect("references settle");
        let taken = Taken::new(&design, 0, &model, &rates, &loads);
        let random = &mut Random(7);
        for h in (0..300).map(|_| random.direction(2)) {
            let ratio = taken.charged(&h) / taken.least(&h);
            assert!((1.0..1.03).contains(&ratio), "norm {norm}, {h}: {ratio}");
        }
    }
}

/// Four times too much acts on this network, and the interior-point method stalls far away: the message must say the former.
#[test]
fn what_acts_on_the_states_is_to_blame_where_it_is() {
    let Err(diagnostics) = Design::new(RandomNetwork::disturbed(1026).source()) else { panic!("it can be designed") };
    assert_eq!(diagnostics.0[0].code, code::DISTURBANCE_TOO_LARGE);
}

/// A design that was made without one kind of what acts on the plant, and a claim that must then be broken.
const UNAWARE: [(Kind, &str); 4] = [
    (Kind::Disturbance, "(18)"),
    (Kind::Error, "(18)"),
    (Kind::Loads, "loads charged in full"),
    (Kind::Loads, "(25b) what references may take"),
];

/// Whether a network's unknowns, as the design is not aware of them, are more than rounding and floor beside its states.
fn matters(case: &RandomNetwork, kind: Kind) -> bool {
    case.plant.parts.iter().any(|part| match kind {
        Kind::Disturbance => part.unknowns.corners.iter().any(|w| w.amax() > 1e-5),
        Kind::Error => part.unknowns.error.amax() > 1e-5,
        Kind::Loads => part.unknowns.loads.iter().any(|load| load.max > load.min) && part.unknowns.M.amax() > 0.0,
    })
}

/// Gives every subsystem of the design the unknowns that it has in truth.
fn inform(design: &mut Design, informed: &Design) {
    for (s, other) in design.network.subsystems.iter_mut().zip(&informed.network.subsystems) {
        s.w.clone_from(&other.w);
        s.measurement_error.clone_from(&other.measurement_error);
        s.loads.clone_from(&other.loads);
    }
}

#[test]
fn a_design_that_left_something_out_is_caught() {
    for (kind, claim) in UNAWARE {
        let mut caught = 0;
        for seed in 0..8 {
            let (case, unaware) = (RandomNetwork::disturbed(seed), RandomNetwork::unaware(seed, kind));
            let (Ok(informed), Ok(mut design)) = (Design::new(case.source()), Design::new(unaware.source())) else {
                continue;
            };
            inform(&mut design, &informed);
            let broken = checker::broken(&design);
            let found = broken.iter().any(|found| found.what.contains(claim));
            assert_eq!(found, matters(&case, kind), "seed {seed}, {kind:?}: {claim}");
            caught += usize::from(found);
        }
        assert!(caught > 2, "{kind:?}: {caught} designs caught");
    }
}

/// A way to spoil a design a little, in what it takes for unknowns.
const SPOILT_MARGINS: [Spoil; 6] = [
    ("(18)", |d, part| {
        d.network.subsystems[0].w.iter_mut().for_each(|w| w.set.h *= 1.0 + part);
    }),
    ("Uhat_i", |d, part| d.network.subsystems[0].measurement_error *= 1.0 + part),
    ("(35a')", |d, part| spoil_measurement(d, part)),
    ("loads charged in full", |d, part| d.sets.subsystems[0].x_rows.iter_mut().for_each(|row| row.load *= 1.0 - part)),
    ("(25b) what references may take", |d, part| d.network.subsystems[0].loads.max *= 1.0 + part),
    // One step more than the references are behind.
    ("(18)", |d, _| d.network.horizon += 1),
];

/// An error that is a little more than (35a') can allow at rest.
fn spoil_measurement(design: &mut Design, part: f64) {
    let (s, E) = (&mut design.network.subsystems[0], &design.sizing.subsystems[0].E);
    let noise = E.P.abs() * &s.measurement_error;
    let most = E.q.iter().zip(&noise).map(|(q, noise)| q / (2.0 * noise)).fold(f64::INFINITY, f64::min);
    s.measurement_error *= most * (1.0 + part);
}

#[test]
fn a_design_with_spoilt_margins_is_caught() {
    for part in [1e-2, 1e-4] {
        for (k, (claim, spoil)) in SPOILT_MARGINS.iter().enumerate() {
            let mut design = designed("../examples/four_tank/designs/disturbed.toml");
            spoil(&mut design, part);
            let broken = checker::broken(&design);
            assert!(broken.iter().any(|found| found.what.contains(claim)), "{k}: {claim} by {part:e}: {broken:?}");
        }
    }
}

fn designed(path: &str) -> Design {
    let source = read(Path::new(path));
    Design::new(source.clone()).unwrap_or_else(|errors| panic!("{}", errors.render(&source, false)))
}

const FOUR_TANK: &str = "../examples/four_tank/system.toml";

#[test]
fn on_the_designs_of_the_repository() {
    let designs = ["system", "designs/reserve", "designs/minimal_reserve", "designs/disturbed"]
        .map(|name| format!("../examples/four_tank/{name}.toml"));
    let cases = ["four_tank_collective", "three_carts"].map(|name| format!("cases/accept/{name}.toml"));
    for path in designs.iter().chain(&cases) {
        let claims = all_claims(&designed(path), 1);
        let broken: Vec<_> = claims.iter().filter(|claim| !claim.holds()).collect();
        assert!(broken.is_empty(), "{path}: {broken:?}");
        assert!(claims.iter().filter_map(Claim::overcharge).all(|overcharge| overcharge < OVERCHARGE), "{path}");
    }
}

/// A way to spoil a design a little, and a claim that must then be broken.
type Spoil = (&'static str, fn(&mut Design, f64));

/// Each is exact to about the margins of the sizing program, 1e-6, so a part of 1e-5 shows. Sigma has a small share of
/// (25b) only, so it takes more of it.
const SPOILT: [Spoil; 17] = [
    ("(18)", |d, part| d.sizing.subsystems[0].E.q *= 1.0 - part),
    ("(18)", |d, part| d.sizing.subsystems[1].zeta *= 1.0 + part),
    ("(21)", |d, part| d.sizing.subsystems[0].zeta *= 1.0 - part),
    ("(21)", |d, part| d.sizing.subsystems[1].dz *= 1.0 + part),
    ("(25b)", |d, part| d.sizing.subsystems.iter_mut().for_each(|s| s.Y.max *= 1.0 + part)),
    ("(25b)", |d, part| d.sizing.subsystems.iter_mut().for_each(|s| s.Y.min *= 1.0 + part)),
    ("(25b)", |d, part| {
        d.sizing
            .subsystems
            .iter_mut()
            .for_each(|s| s.x_ref.iter_mut().chain(&mut s.u_ref).for_each(|r| *r *= 1.0 - part))
    }),
    ("Xhat_i", |d, part| d.sizing.subsystems[0].X_nom.h *= 1.0 + part),
    ("Uhat_i", |d, part| d.sizing.subsystems[0].U_nom.h *= 1.0 + part),
    ("(25b)", |d, part| d.sizing.subsystems.iter_mut().for_each(|s| s.Sigma.q *= 1.0 + 100.0 * part)),
    ("(25a)", |d, part| spoil_outputs(d, part)),
    ("(24)", |d, part| spoil_invariance(d, part)),
    ("epsilon as given", |d, part| d.sizing.epsilon *= 1.0 + part),
    ("Delta^chi charged in full", |d, part| d.sets.subsystems[0].x_rows[0].rate *= 1.0 - part),
    ("F_ii = A_ii", |d, part| d.gains.subsystems[0].K[(0, 0)] *= 1.0 + part),
    ("(37)", |d, part| d.gains.subsystems[0].P *= 1.0 - part),
    ("Y_i holds 0", |d, part| {
        d.network.subsystems[0].cover[0] = Some((-1.0, d.sizing.subsystems[0].Y.max[0] * (1.0 + part)))
    }),
];

/// Delta_1^z a little smaller than what Sigma_1 takes of it.
fn spoil_outputs(design: &mut Design, part: f64) {
    let (s, g) = (&design.network.subsystems[0], &design.gains.subsystems[0]);
    let sized = &mut design.sizing.subsystems[0];
    let set = SymmetricSet::new(&sized.Sigma.P, &sized.Sigma.q).expect("Sigma is bounded");
    let z = &s.Cz + &s.Dz * &g.K;
    sized.dz = DVector::from_fn(z.nrows(), |k, _| set.support(&z.row(k).transpose()).proved * (1.0 - part));
}

/// Sigma_1 with all facets but one as far away as the invariance of that one allows, then a little farther.
fn spoil_invariance(design: &mut Design, part: f64) {
    let F = &design.gains.subsystems[0].F;
    let Sigma = &mut design.sizing.subsystems[0].Sigma;
    let with_others = |r: usize, factor: f64| {
        let q = DVector::from_fn(Sigma.q.len(), |k, _| Sigma.q[k] * if k == r { 1.0 } else { factor });
        let set = SymmetricSet::new(&Sigma.P, &q).expect("Sigma is bounded");
        let invariant = set.support(&(Sigma.P.row(r) * F).transpose()).proved <= q[r];
        (invariant, q)
    };
    let r = (0..Sigma.q.len()).find(|&r| !with_others(r, 1e3).0).expect("a facet that leans on the others");
    let (mut low, mut high) = (1.0, 1e3);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if with_others(r, middle).0 { &mut low } else { &mut high }) = middle;
    }
    Sigma.q = with_others(r, high * (1.0 + part)).1;
}

#[test]
fn a_spoilt_design_is_caught() {
    for part in [1e-2, 1e-5] {
        for (k, (claim, spoil)) in SPOILT.iter().enumerate() {
            let mut design = designed(FOUR_TANK);
            spoil(&mut design, part);
            let broken = checker::broken(&design);
            assert!(broken.iter().any(|found| found.what.contains(claim)), "{k}: {claim} by {part:e}: {broken:?}");
        }
    }
}

#[test]
fn a_gain_of_the_wrong_sign_is_caught() {
    let mut design = designed(FOUR_TANK);
    design.gains.subsystems[0].K *= -1.0;
    let broken = checker::broken(&design);
    assert!(broken.iter().any(|claim| claim.what.contains("(18)")), "{broken:?}");
    let mut design = designed(FOUR_TANK);
    design.gains.subsystems[1].Ke *= -1.0;
    let broken = checker::broken(&design);
    assert!(broken.iter().any(|claim| claim.what.contains("Assumption 3")), "{broken:?}");
}

/// A way to spoil the problem of the first subsystem.
const SPOILT_PROBLEMS: [Spoil; 6] = [
    ("H is the cost", |d, part| d.problems.subsystems[0].dpc.H *= 1.0 + part),
    ("T'HT = I", |d, part| d.problems.subsystems[0].dpc.T *= 1.0 + part),
    ("rows of V have unit length", |d, part| d.problems.subsystems[0].dpc.V *= 1.0 + part),
    ("the emitted rows are", |d, part| d.problems.subsystems[0].dpc.upper *= 1.0 + part),
    ("the emitted rows are", |d, part| d.problems.subsystems[0].dpc.lower *= 1.0 - part),
    ("a facet left out is implied", |d, _| {
        d.problems.subsystems[0].dpc.upper.iter_mut().skip(2).for_each(|u| *u = f64::INFINITY)
    }),
];

#[test]
fn a_spoilt_problem_is_caught() {
    for part in [1e-2, 1e-5] {
        for (claim, spoil) in &SPOILT_PROBLEMS {
            let mut design = designed(FOUR_TANK);
            spoil(&mut design, part);
            let claims = problem_checker::claims(&design, &mut Random(3), 100);
            assert!(claims.iter().any(|found| !found.holds() && found.what.contains(claim)), "{claim} by {part:e}");
        }
    }
}
