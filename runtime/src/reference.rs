//! The reference-output layer (29)-(31) with (28).

use super::linear::{add, add_scaled, clip, dot, finite, largest, sqrt, subtract, times};
use super::solver::{Outcome, Row, Rows, Solver, WorkingSet};
use super::tables::{Clamp, Nearest};
use super::{Real, precision};

/// An output counts as inside Y_i when no limit is exceeded by more than this, relative to the limit.
const INSIDE: Real = precision::KEPT;

/// Steps of bisection for the multiplier of the Euclidean ball: to the last bit of a number of that magnitude.
const BISECTIONS: usize = Real::MANTISSA_DIGITS as usize + 7;

/// Set-points further away than this times epsilon are moved to this distance. The direction of the step that (30)
/// allows is the same to six digits, and no accuracy is lost to large numbers. In single precision, where these would lose more, it is
/// the same to a few percent.
const HORIZON: Real = precision::HORIZON;

/// Working-set changes of the tiny problems of [`Nearest`], per row.
const CHANGES_PER_ROW: usize = 10;

/// Rounds of projection that remove what the solver's tolerance left: each makes it smaller by the cosine between rows.
const TRIMS: usize = 4;

/// Chooses yref_{t+N}.
///
/// `NC` coupling rows are the same for ever; `NH` are redrawn while running.
pub trait ReferenceLayer<const NY: usize, const NC: usize, const NH: usize> {
    /// The next reference output: nearest to the (finite) `set_point`, within the rate of (30) around `previous`, in
    /// Y_i, with own . y <= `coupling` for every coupling row (28), and within every one of `changing`.
    ///
    /// `previous` is feasible up to rounding, and a limit it violates counts as reached. So the result violates no limit
    /// by more than `previous` does, or rounding. `None` if there is no trustworthy answer: keep `previous`.
    fn next(
        &self,
        previous: &[Real; NY],
        set_point: &[Real; NY],
        coupling: &[Real; NC],
        changing: &[Share<NY>; NH],
    ) -> Option<[Real; NY]>;

    /// Epsilon of (30), in the output's unit.
    fn epsilon(&self) -> Real;

    /// Whether `y` lies in Y_i, up to 1e-9 of each limit.
    fn contains(&self, y: &[Real; NY]) -> bool;
}

/// What (28) leaves to one subsystem: own . y <= limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share<const NY: usize> {
    pub own: [Real; NY],
    pub limit: Real,
}

impl<const NY: usize> Share<NY> {
    /// All of it.
    pub const NONE: Self = Self { own: [0.0; NY], limit: 0.0 };
}

impl<const NY: usize, const NC: usize> ReferenceLayer<NY, NC, 0> for Clamp<NY, NC> {
    fn next(
        &self,
        previous: &[Real; NY],
        set_point: &[Real; NY],
        coupling: &[Real; NC],
        _: &[Share<NY>; 0],
    ) -> Option<[Real; NY]> {
        let mut low = [0.0; NY];
        let mut high = [0.0; NY];
        for ((low, min), y) in low.iter_mut().zip(&self.y_min).zip(previous) {
            *low = (y - self.epsilon).max(*min);
        }
        for ((high, max), y) in high.iter_mut().zip(&self.y_max).zip(previous) {
            *high = (y + self.epsilon).min(*max);
        }
        for (&(output, coefficient), limit) in self.rows.iter().zip(coupling) {
            let end = limit / coefficient;
            if coefficient > 0.0 {
                high.iter_mut().skip(output).take(1).for_each(|high| *high = high.min(end));
            } else if coefficient < 0.0 {
                low.iter_mut().skip(output).take(1).for_each(|low| *low = low.max(end));
            }
        }
        let mut next = *previous;
        let ends = low.iter().zip(&high);
        for ((y, (low, high)), (weight, set_point)) in next.iter_mut().zip(ends).zip(self.weight.iter().zip(set_point))
        {
            *y = clip(*y + weight * (set_point - *y), low.min(*y), high.max(*y));
        }
        finite(&next).then_some(next)
    }

    fn epsilon(&self) -> Real {
        self.epsilon
    }

    fn contains(&self, y: &[Real; NY]) -> bool {
        y.iter()
            .zip(self.y_min.iter().zip(&self.y_max))
            .all(|(y, (min, max))| *y >= min - INSIDE * min.abs() && *y <= max + INSIDE * max.abs())
    }
}

impl<const NY: usize, const NA: usize, const NB: usize, const NC: usize, const NH: usize> ReferenceLayer<NY, NC, NH>
    for Nearest<NY, NA, NB, NC>
{
    fn next(
        &self,
        previous: &[Real; NY],
        set_point: &[Real; NY],
        coupling: &[Real; NC],
        changing: &[Share<NY>; NH],
    ) -> Option<[Real; NY]> {
        let room = self.room(previous, coupling, changing);
        let wish = self.wish(previous, set_point);
        let mut step = self.nearest(&room, &wish, 0.0)?;
        let length = |step: &[Real; NY]| sqrt(dot(step, step));
        if self.euclidean && length(&step) > self.reach() {
            step = self.on_ball(&room, &wish)?;
        }
        let step = self.trimmed(&room, step);
        if !precision::CHECKED {
            let next = add(previous, &step);
            return finite(&next).then_some(next);
        }
        // What rounding still takes beyond a limit would add up from step to step: a shorter step then, or none.
        let shorter = [1.0, 0.5, 0.25, 0.125].map(|part| add(previous, &step.map(|entry| part * entry)));
        shorter.into_iter().find(|next| self.admits(previous, next, coupling, changing))
    }

    fn epsilon(&self) -> Real {
        self.epsilon
    }

    fn contains(&self, y: &[Real; NY]) -> bool {
        self.set.iter().zip(&self.set_limit).all(|(row, limit)| dot(row, y) <= limit + INSIDE * limit.abs())
    }
}

/// How far y may move from the previous y in the direction of each row: never negative, so that not moving is exactly
/// feasible.
struct Room<const NY: usize, const NA: usize, const NB: usize, const NC: usize, const NH: usize> {
    set: [Real; NA],
    rate: [Real; NB],
    coupling: [Real; NC],
    /// The limits are those of the step.
    changing: [Share<NY>; NH],
}

/// The rows over w = D^1/2 (U' (y - previous) - centre), each normalised.
struct Scaled<const NY: usize, const NA: usize, const NB: usize, const NC: usize, const NH: usize> {
    set: [Half<NY>; NA],
    rate: [Half<NY>; NB],
    coupling: [Half<NY>; NC],
    changing: [Half<NY>; NH],
}

/// normal . w <= limit.
#[derive(Clone, Copy)]
struct Half<const NY: usize> {
    normal: [Real; NY],
    limit: Real,
    scale: Real,
}

/// The objective: sum over k of square_k (U' step - centre)_k^2.
struct Objective<const NY: usize> {
    /// Square roots of the weights.
    root: [Real; NY],
    centre: [Real; NY],
}

impl<const NY: usize, const NA: usize, const NB: usize, const NC: usize> Nearest<NY, NA, NB, NC> {
    /// Whether `next` exceeds no limit, as far as this arithmetic can tell, or none by more than `previous` does.
    fn admits<const NH: usize>(
        &self,
        previous: &[Real; NY],
        next: &[Real; NY],
        coupling: &[Real; NC],
        changing: &[Share<NY>; NH],
    ) -> bool {
        let step = subtract(next, previous);
        let kept = |row: &[Real; NY], limit: Real| dot(row, next) <= limit.max(dot(row, previous));
        let set = self.set.iter().zip(&self.set_limit).all(|(row, limit)| kept(row, *limit));
        let shares = self.coupling.iter().zip(coupling).all(|(row, limit)| kept(row, *limit));
        let redrawn = changing.iter().all(|share| kept(&share.own, share.limit));
        let rate = self.rate.iter().all(|row| dot(row, &step) <= self.epsilon);
        let ball = !self.euclidean || dot(&step, &step) <= self.epsilon * self.epsilon;
        finite(next) && set && shares && redrawn && rate && ball
    }

    /// Epsilon, less what rounding of a step may take.
    fn reach(&self) -> Real {
        (self.epsilon * (1.0 - 100.0 * precision::AIM)).max(0.0)
    }

    fn room<const NH: usize>(
        &self,
        previous: &[Real; NY],
        coupling: &[Real; NC],
        changing: &[Share<NY>; NH],
    ) -> Room<NY, NA, NB, NC, NH> {
        Room {
            set: room(&self.set, &self.set_limit, previous),
            rate: [self.reach(); NB],
            coupling: room(&self.coupling, coupling, previous),
            changing: changing.map(|Share { own, limit }| Share { own, limit: free(&own, limit, previous) }),
        }
    }

    /// The way to the set-point in the eigenbasis of T_i.
    fn wish(&self, previous: &[Real; NY], set_point: &[Real; NY]) -> [Real; NY] {
        let way = subtract(set_point, previous);
        let far = largest(&way) / (HORIZON * self.epsilon);
        let way = if far > 1.0 { way.map(|entry| entry / far) } else { way };
        let mut wish = [0.0; NY];
        for (row, entry) in self.basis.iter().zip(&way) {
            add_scaled(&mut wish, *entry, row);
        }
        wish
    }

    /// The step from the previous y that minimises (29) + `multiplier` |step|^2 in `room`.
    fn nearest<const NH: usize>(
        &self,
        room: &Room<NY, NA, NB, NC, NH>,
        wish: &[Real; NY],
        multiplier: Real,
    ) -> Option<[Real; NY]> {
        let objective = self.objective(wish, multiplier);
        let rows = Scaled {
            set: self.scaled(&self.set, &room.set, &objective),
            rate: self.scaled(&self.rate, &room.rate, &objective),
            coupling: self.scaled(&self.coupling, &room.coupling, &objective),
            changing: room.changing.each_ref().map(|share| self.half(&share.own, share.limit, &objective)),
        };
        let mut solver = Solver::NEW;
        let budget = CHANGES_PER_ROW * (NY + NA + NB + NC + NH);
        let Outcome::Optimal { .. } = solver.solve(&rows, &WorkingSet::EMPTY, budget) else { return None };
        let mut step = objective.centre;
        for ((entry, w), root) in step.iter_mut().zip(solver.w()).zip(&objective.root) {
            *entry += w / root;
        }
        Some(times(&self.basis, &step))
    }

    fn objective(&self, wish: &[Real; NY], multiplier: Real) -> Objective<NY> {
        let damping = self.gamma + multiplier;
        let mut centre = *wish;
        for (centre, weight) in centre.iter_mut().zip(&self.weights) {
            *centre *= weight / (weight + damping);
        }
        Objective { root: self.weights.map(|weight| sqrt(weight + damping)), centre }
    }

    fn scaled<const COUNT: usize>(
        &self,
        rows: &[[Real; NY]; COUNT],
        room: &[Real; COUNT],
        objective: &Objective<NY>,
    ) -> [Half<NY>; COUNT] {
        let mut scaled = [Half::NONE; COUNT];
        for ((place, row), room) in scaled.iter_mut().zip(rows).zip(room) {
            *place = self.half(row, *room, objective);
        }
        scaled
    }

    fn half(&self, row: &[Real; NY], room: Real, objective: &Objective<NY>) -> Half<NY> {
        let mut turned = [0.0; NY];
        for (basis, entry) in self.basis.iter().zip(row) {
            add_scaled(&mut turned, *entry, basis);
        }
        let way = dot(&turned, &objective.centre);
        for (entry, root) in turned.iter_mut().zip(&objective.root) {
            *entry /= root;
        }
        let length = sqrt(dot(&turned, &turned));
        if length > 0.0 {
            let normal = turned.map(|entry| entry / length);
            Half { normal, limit: (room - way) / length, scale: room / length }
        } else {
            Half::NONE
        }
    }

    /// The step on the Euclidean ball: the multiplier of the ball, between 0 and the bound that the optimality of the step
    /// gives, by bisection.
    fn on_ball<const NH: usize>(&self, room: &Room<NY, NA, NB, NC, NH>, wish: &[Real; NY]) -> Option<[Real; NY]> {
        let mut pull = *wish;
        for (pull, weight) in pull.iter_mut().zip(&self.weights) {
            *pull *= weight;
        }
        let mut low = 0.0;
        let reach = self.reach();
        let mut high = sqrt(dot(&pull, &pull)) / reach;
        let mut inside = self.nearest(room, wish, high)?;
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            let step = self.nearest(room, wish, middle)?;
            if dot(&step, &step) > reach * reach {
                low = middle;
            } else {
                high = middle;
                inside = step;
            }
        }
        Some(inside)
    }

    /// The step without what exceeds a limit by the solver's tolerance: projected onto the rows it exceeds.
    fn trimmed<const NH: usize>(&self, room: &Room<NY, NA, NB, NC, NH>, step: [Real; NY]) -> [Real; NY] {
        let mut step = step;
        for _ in 0..TRIMS {
            trim(&self.set, &room.set, &mut step);
            trim(&self.rate, &room.rate, &mut step);
            trim(&self.coupling, &room.coupling, &mut step);
            room.changing.iter().for_each(|share| trim_row(&share.own, share.limit, &mut step));
        }
        // Shrinking keeps every row: not moving satisfies all of them.
        let length = sqrt(dot(&step, &step));
        let part = if self.euclidean && length > self.reach() { self.reach() / length } else { 1.0 };
        step.map(|entry| part * entry)
    }
}

fn trim<const NY: usize, const COUNT: usize>(rows: &[[Real; NY]; COUNT], room: &[Real; COUNT], step: &mut [Real; NY]) {
    for (row, room) in rows.iter().zip(room) {
        trim_row(row, *room, step);
    }
}

fn trim_row<const NY: usize>(row: &[Real; NY], room: Real, step: &mut [Real; NY]) {
    let excess = dot(row, step) - room;
    if excess > 0.0 {
        add_scaled(step, -excess / dot(row, row), row);
    }
}

fn room<const NY: usize, const COUNT: usize>(
    rows: &[[Real; NY]; COUNT],
    limits: &[Real; COUNT],
    previous: &[Real; NY],
) -> [Real; COUNT] {
    let mut room = *limits;
    for (room, row) in room.iter_mut().zip(rows) {
        *room = free(row, *room, previous);
    }
    room
}

/// What is left of a limit, less what rounding of the sums may take.
fn free<const NY: usize>(row: &[Real; NY], limit: Real, previous: &[Real; NY]) -> Real {
    let left = limit - dot(row, previous);
    if precision::AIM == 0.0 {
        return left.max(0.0);
    }
    let size = row.iter().zip(previous).fold(limit.abs(), |size, (h, y)| size + (h * y).abs());
    (left - precision::AIM * size).max(0.0)
}

impl<const NY: usize> Half<NY> {
    /// A row without a normal, which restricts nothing.
    const NONE: Self = Self { normal: [0.0; NY], limit: Real::INFINITY, scale: 0.0 };
}

impl<const NY: usize, const NA: usize, const NB: usize, const NC: usize, const NH: usize> Rows<NY>
    for Scaled<NY, NA, NB, NC, NH>
{
    fn iter(&self) -> impl Iterator<Item = Row<'_>> {
        self.set.iter().chain(&self.rate).chain(&self.coupling).chain(&self.changing).map(|half| Row {
            normal: &half.normal,
            lower: Real::NEG_INFINITY,
            upper: half.limit,
            scale: half.scale,
        })
    }
}
