//! Does the solver that the controllers carry agree with Clarabel, on every emitted problem, cold and warm?

use std::fmt;
use std::path::Path;

use dpc_codegen::design::Design;
use dpc_generated::four_tank;
use dpc_runtime::solver::{Outcome, Side, Solver, WorkingSet};
use dpc_tests::host_loop::{NV, edge};
use dpc_tests::least_distance::{Instance, Parameters, Truth};
use dpc_tests::problem_checker::Problem;
use dpc_tests::random_network::RandomNetwork;
use dpc_tests::{Random, cases_wanted, read};
use nalgebra::DVector;

/// Largest relative difference of two minimisers.
const AGREE: f64 = 1e-9;

/// Share of the distance to where the problem loses its solution, and a little beyond it.
const REACHES: [f64; 9] = [0.2, 0.5, 0.8, 0.95, 1.0 - 1e-3, 1.0 - 1e-6, 1.0 + 1e-6, 1.0 + 1e-3, 2.0];

/// What was compared.
#[derive(Debug, Default)]
struct Count {
    parameters: usize,
    /// Minimisers compared, from a cold and from a warm start.
    cold: usize,
    warm: usize,
    /// Of the cold ones, those with active rows, and those with more than the rows of (35a) active.
    active: usize,
    constrained: usize,
    /// Problems without a solution, proved by the solver, and by Clarabel too.
    refuted: usize,
    refuted_by_both: usize,
    /// Where Clarabel proved nothing and the solver's own proof was checked.
    alone: usize,
    worst: f64,
    most_iterations: usize,
}

impl fmt::Display for Count {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { parameters, cold, warm, active, constrained, refuted, refuted_by_both, alone, .. } = self;
        write!(f, "{parameters} parameters: {cold} cold and {warm} warm minimisers agree to {:.1e}, ", self.worst)?;
        write!(f, "{active} with active rows, {constrained} with rows other than (35a) active; ")?;
        write!(f, "{refuted} without solution ({refuted_by_both} proved twice); {alone} proved by the solver alone; ")?;
        write!(f, "at most {} iterations", self.most_iterations)
    }
}

/// One problem of a controller, as its tables state it.
struct Emitted<'a, Tables> {
    problem: Problem<'a>,
    tables: Tables,
}

impl<Tables> Emitted<'_, Tables> {
    /// Samples parameters: references mostly in the corners of what (25b) leaves them, deviations along rays that cross
    /// the edge of what is feasible. Warm starts are the last ray's working set and one that makes no sense.
    fn examine<const NV: usize>(&self, random: &mut Random, rays: usize, count: &mut Count)
    where
        Tables: Fn(&Parameters) -> Instance<NV>,
    {
        for _ in 0..rays {
            let at = self.problem.parameters(random);
            let direction = random.direction(at.e.len());
            let far = edge(&self.problem, &direction, &at);
            let mut last = nonsense(random, self.problem.dpc.rows.len());
            for reach in REACHES {
                let at = Parameters { e: &direction * (far * reach), ..at.clone() };
                last = self.compare(&(self.tables)(&at), &last, count);
            }
        }
    }

    /// Cold, then warm; returns the working set.
    fn compare<const NV: usize>(
        &self,
        instance: &Instance<NV>,
        warm: &WorkingSet<NV>,
        count: &mut Count,
    ) -> WorkingSet<NV> {
        let truth = instance.truth();
        count.parameters += 1;
        let solver = self.solve(instance, &WorkingSet::EMPTY, &truth, count);
        if let Some(solver) = &solver {
            let set = solver.working_set();
            count.cold += 1;
            count.active += usize::from(!set.is_empty());
            count.constrained += usize::from(set.iter().any(|(row, _)| row >= self.problem.sized.E.q.len()));
        }
        let again = self.solve(instance, warm, &truth, count);
        assert_eq!(solver.is_some(), again.is_some(), "cold and warm starts disagree whether there is a solution");
        count.warm += usize::from(again.is_some());
        solver.map_or(WorkingSet::EMPTY, |solver| solver.working_set())
    }

    /// The solver after it found a minimiser that stands the comparison; `None` where it proved that there is none.
    fn solve<const NV: usize>(
        &self,
        instance: &Instance<NV>,
        from: &WorkingSet<NV>,
        truth: &Truth,
        count: &mut Count,
    ) -> Option<Solver<NV>> {
        let mut solver = Solver::NEW;
        match solver.solve(instance, from, self.problem.dpc.max_iterations) {
            Outcome::Optimal { iterations } => {
                count.most_iterations = count.most_iterations.max(iterations);
                self.agree(instance, &solver, truth, count);
                Some(solver)
            }
            Outcome::Infeasible { .. } => {
                assert!(instance.refuted_by(&solver), "{}: the certificate proves nothing", self.problem.s.name);
                assert!(!matches!(truth, Truth::Minimiser(_)), "{}: Clarabel found a minimiser", self.problem.s.name);
                count.refuted += 1;
                count.refuted_by_both += usize::from(matches!(truth, Truth::Infeasible));
                None
            }
            Outcome::IterationLimit => panic!("{}: the budget ran out", self.problem.s.name),
        }
    }

    fn agree<const NV: usize>(&self, instance: &Instance<NV>, solver: &Solver<NV>, truth: &Truth, count: &mut Count) {
        let name = &self.problem.s.name;
        match truth {
            Truth::Minimiser(truth) => {
                let w = DVector::from_column_slice(solver.w());
                let size = truth.norm();
                let difference = if size > 0.0 { (&w - truth).norm() / size } else { w.norm() };
                assert!(difference <= AGREE, "{name}: minimisers differ by {difference:e}");
                count.worst = count.worst.max(difference);
            }
            Truth::Infeasible => panic!("{name}: Clarabel proved that there is no solution"),
            Truth::Unknown => {
                assert!(instance.proved_by(solver), "{name}: neither proof holds");
                count.alone += 1;
            }
        }
    }
}

/// Rows that need not exist, sides that need not be finite.
fn nonsense<const NV: usize>(random: &mut Random, rows: usize) -> WorkingSet<NV> {
    let mut set = WorkingSet::EMPTY;
    for _ in 0..random.below(NV + 1) {
        set.push(random.below(rows + 2), if random.chance(0.5) { Side::Lower } else { Side::Upper });
    }
    set
}

fn designed(path: &str) -> Design {
    let source = read(Path::new(path));
    Design::new(source.clone()).unwrap_or_else(|errors| panic!("{}", errors.render(&source, false)))
}

fn array<const COUNT: usize>(vector: &DVector<f64>) -> [f64; COUNT] {
    std::array::from_fn(|k| vector[k])
}

/// The emitted problem of a subsystem of the four-tank.
macro_rules! emitted {
    ($module:path) => {{
        use $module as emitted;
        |at: &Parameters| {
            let x_ref: [_; emitted::N] = std::array::from_fn(|k| array(&at.x_ref[k]));
            let u_ref: [_; emitted::N] = std::array::from_fn(|k| array(&at.u_ref[k]));
            Instance::copy(&emitted::TABLES.problem.at(&array(&at.e), &x_ref, &u_ref))
        }
    }};
}

#[test]
fn on_the_emitted_problems_of_the_four_tank() {
    let design = designed("../examples/four_tank/system.toml");
    let (mut count, random, rays) = (Count::default(), &mut Random(11), cases_wanted(200));
    Emitted { problem: Problem::new(&design, 0), tables: emitted!(four_tank::left) }.examine(random, rays, &mut count);
    Emitted { problem: Problem::new(&design, 1), tables: emitted!(four_tank::right) }.examine(random, rays, &mut count);
    println!("four-tank, emitted: {count}");
    assert!(count.constrained * 4 > count.cold && count.refuted > rays);
}

/// Every problem of a design, from the stage that the tables are printed from.
fn examine_stage(design: &Design, random: &mut Random, rays: usize, count: &mut Count) {
    for i in 0..design.network.subsystems.len() {
        let problem = Problem::new(design, i);
        let dpc = problem.dpc;
        let tables = |at: &Parameters| Instance::<NV>::new(dpc, at);
        Emitted { problem, tables }.examine(random, rays, count);
    }
}

#[test]
fn on_the_problems_of_other_shapes() {
    let (mut count, random, rays) = (Count::default(), &mut Random(12), cases_wanted(40));
    for case in ["four_tank_collective", "three_carts"] {
        examine_stage(&designed(&format!("cases/accept/{case}.toml")), random, rays, &mut count);
    }
    println!("accepted cases: {count}");
    assert!(count.constrained * 10 > count.cold);
}

/// The same with (35a'), where states are measured with an error and there is no forecast.
fn examine_in_doubt(design: &Design, random: &mut Random, rays: usize, count: &mut Count) {
    for i in 0..design.network.subsystems.len() {
        let problem = Problem::new(design, i);
        let dpc = problem.dpc;
        let room = |r: usize| dpc.upper[r] - dpc.noise[r];
        let limits: Vec<_> = (0..dpc.noise.len()).map(|r| (-room(r), room(r))).collect();
        let tables = |at: &Parameters| Instance::<NV>::new(dpc, at).with_tube(dpc, at, &limits);
        Emitted { problem, tables }.examine(random, rays, count);
    }
}

#[test]
fn on_the_problems_of_disturbed_networks() {
    let (mut count, mut designs) = (Count::default(), 0);
    for seed in 0..cases_wanted(12) as u64 {
        let Ok(design) = Design::new(RandomNetwork::disturbed(seed).source()) else { continue };
        examine_in_doubt(&design, &mut Random(seed), 4, &mut count);
        designs += 1;
    }
    println!("{designs} disturbed networks: {count}");
    assert!(count.constrained * 10 > count.cold && count.alone * 10 < count.parameters);
}

#[test]
fn on_the_problems_of_random_networks() {
    let (mut count, mut designs) = (Count::default(), 0);
    for seed in 0..cases_wanted(20) as u64 {
        let Ok(design) = Design::new(RandomNetwork::new(seed).source()) else { continue };
        examine_stage(&design, &mut Random(seed), 4, &mut count);
        designs += 1;
    }
    println!("{designs} random networks: {count}");
    assert!(count.constrained * 10 > count.cold && count.alone * 10 < count.parameters);
}
