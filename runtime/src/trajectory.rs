//! The reference trajectory (7) that a controller carries: from now to one step before the horizon.

use super::Real;
use super::linear::{add, shift_in, subtract, times};
use super::plan::{Passage, PlannedPoint};
use super::tables::Model;

/// xref, uref and yref at t, ..., t + N - 1, and eref at t + N - 1; where that is before the end of a start-up plan, de of
/// [`StartPlan`](super::StartPlan).
#[derive(Debug, Clone)]
pub(crate) struct Trajectory<const NX: usize, const NU: usize, const NY: usize, const N: usize> {
    pub x: [[Real; NX]; N],
    pub u: [[Real; NU]; N],
    pub y: [[Real; NY]; N],
    e: [Real; NY],
}

/// References at one step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point<const NX: usize, const NU: usize, const NY: usize> {
    pub x: [Real; NX],
    pub u: [Real; NU],
    pub y: [Real; NY],
}

impl<const NX: usize, const NU: usize, const NY: usize, const N: usize> Trajectory<NX, NU, NY, N> {
    /// The trajectory that stays at chi = (x, e): yref = C x, so that eref stays by (7b), and uref = calK chi, (7f).
    pub fn constant<const NZ: usize, const NI: usize>(
        model: &Model<NX, NU, NY, NZ, NI>,
        x: [Real; NX],
        e: [Real; NY],
    ) -> Self {
        Self { x: [x; N], u: [input(model, &x, &e); N], y: [times(&model.C, &x); N], e }
    }

    /// Steps 0, ..., N - 1 of a start-up plan.
    pub fn planned<const NZ: usize, const NI: usize>(
        model: &Model<NX, NU, NY, NZ, NI>,
        points: &[PlannedPoint<NX, NU>],
    ) -> Self {
        let (mut x, mut u) = ([[0.0; NX]; N], [[0.0; NU]; N]);
        for (point, (x, u)) in points.iter().zip(x.iter_mut().zip(&mut u)) {
            (*x, *u) = (point.x, point.u);
        }
        let y = x.each_ref().map(|x| times(&model.C, x));
        Self { x, u, y, e: [0.0; NY] }
    }

    /// Step t.
    pub fn now(&self) -> Point<NX, NU, NY> {
        Point { x: or_zero(self.x.first()), u: or_zero(self.u.first()), y: or_zero(self.y.first()) }
    }

    /// Step t + N - 1.
    pub fn newest(&self) -> Point<NX, NU, NY> {
        Point { x: or_zero(self.x.last()), u: or_zero(self.u.last()), y: or_zero(self.y.last()) }
    }

    /// Goes on by one step: appends t + N by (7), drops t. `y` is yref_{t+N}, `z` what is imported at t + N - 1, `push` what
    /// loads add to the state then.
    pub fn advance<const NZ: usize, const NI: usize>(
        &mut self,
        model: &Model<NX, NU, NY, NZ, NI>,
        y: [Real; NY],
        z: &[Real; NI],
        push: &[Real; NX],
    ) {
        let newest = self.newest();
        let x = add(&successor(model, &newest, z), push);
        self.e = add(&self.e, &subtract(&y, &times(&model.C, &newest.x)));
        shift_in(&mut self.x, x);
        shift_in(&mut self.u, input(model, &x, &self.e));
        shift_in(&mut self.y, y);
    }

    /// Goes on by one step of a start-up plan; `z` and `push` as for [`Self::advance`].
    pub fn replay<const NZ: usize, const NI: usize>(
        &mut self,
        model: &Model<NX, NU, NY, NZ, NI>,
        plan: &Passage<'_, NX, NU, NY>,
        z: &[Real; NI],
        push: &[Real; NX],
    ) {
        let newest = self.newest();
        let x = add(&successor(model, &newest, z), push);
        self.e = subtract(&self.e, &times(&model.C, &subtract(&newest.x, &plan.before.x)));
        let u = match plan.end {
            None => add(&plan.at.u, &input(model, &subtract(&x, &plan.at.x), &self.e)),
            Some(e) => {
                self.e = add(&self.e, e);
                input(model, &x, &self.e)
            }
        };
        shift_in(&mut self.x, x);
        shift_in(&mut self.u, u);
        shift_in(&mut self.y, times(&model.C, &plan.at.x));
    }

    /// Whether every newest state comes within this share of [`Model::drift`] of `next` when `z` is imported and loads add `push`.
    pub fn arrives<const NZ: usize, const NI: usize>(
        &self,
        model: &Model<NX, NU, NY, NZ, NI>,
        next: &[Real; NX],
        z: &[Real; NI],
        push: &[Real; NX],
        share: Real,
    ) -> bool {
        let missed = subtract(&add(&successor(model, &self.newest(), z), push), next);
        missed.iter().zip(&model.drift).all(|(missed, drift)| missed.abs() <= share * drift)
    }

    /// Whether every newest state stays within [`Model::drift`] of where it is when `z` is imported and loads add `push`.
    pub fn stays<const NZ: usize, const NI: usize>(
        &self,
        model: &Model<NX, NU, NY, NZ, NI>,
        z: &[Real; NI],
        push: &[Real; NX],
    ) -> bool {
        self.arrives(model, &self.newest().x, z, push, 1.0)
    }
}

impl<const NX: usize, const NU: usize, const NY: usize> Point<NX, NU, NY> {
    /// z of (7c).
    pub fn coupling_output<const NZ: usize, const NI: usize>(&self, model: &Model<NX, NU, NY, NZ, NI>) -> [Real; NZ] {
        add(&times(&model.Cz, &self.x), &times(&model.Dz, &self.u))
    }
}

/// (7a) with (7d).
fn successor<const NX: usize, const NU: usize, const NY: usize, const NZ: usize, const NI: usize>(
    model: &Model<NX, NU, NY, NZ, NI>,
    point: &Point<NX, NU, NY>,
    z: &[Real; NI],
) -> [Real; NX] {
    let own = add(&times(&model.A, &point.x), &times(&model.B, &point.u));
    add(&own, &times(&model.EL, z))
}

/// (7f).
fn input<const NX: usize, const NU: usize, const NY: usize, const NZ: usize, const NI: usize>(
    model: &Model<NX, NU, NY, NZ, NI>,
    x: &[Real; NX],
    e: &[Real; NY],
) -> [Real; NU] {
    add(&times(&model.Kx, x), &times(&model.Ke, e))
}

fn or_zero<const COUNT: usize>(values: Option<&[Real; COUNT]>) -> [Real; COUNT] {
    values.copied().unwrap_or([0.0; COUNT])
}

#[cfg(test)]
mod tests {
    use super::super::Real;
    use super::super::tables::Model;
    use super::Trajectory;

    /// How far a state of the model below may drift, relative to its size.
    const DRIFT: Real = 256.0 * Real::EPSILON;

    /// A level of about 1e6 units and a concentration of about 1e-3 beside each other, one import into each.
    fn model() -> Model<2, 1, 1, 0, 2> {
        Model {
            A: [[0.9, 0.0], [0.0, 0.7]],
            B: [[1.0], [0.0]],
            C: [[1.0, 0.0]],
            Cz: [],
            Dz: [],
            EL: [[1.0, 0.0], [0.0, 1.0]],
            K: [[0.0, 0.0]],
            Kx: [[-0.3, 0.1]],
            Ke: [[0.7]],
            u_min: [-1e9],
            u_max: [1e9],
            drift: [1e6 * DRIFT, 1e-3 * DRIFT],
        }
    }

    /// At x = (1e6, 1e-3) with the input 1e5 - `pull`.
    fn start(pull: Real) -> Trajectory<2, 1, 1, 3> {
        let x = [1e6, 1e-3];
        let e = (1e5 - pull + 0.3 * 1e6 - 0.1 * 1e-3) / 0.7;
        Trajectory::constant(&model(), x, [e])
    }

    #[test]
    fn stays_as_far_as_each_state_does_in_its_unit() {
        let model = model();
        let steady = [0.0, 0.3e-3];
        assert!(start(0.0).stays(&model, &steady, &[0.0; 2]));
        let [near, far] = [0.9e6 * DRIFT, 1.1e6 * DRIFT];
        assert!(start(near).stays(&model, &steady, &[0.0; 2]) && !start(far).stays(&model, &steady, &[0.0; 2]));
        assert!(start(0.0).stays(&model, &[-near, 0.3e-3 + 0.9e-3 * DRIFT], &[0.0; 2]));
        // 1e-9 of what the first state may drift, and yet too far for the second.
        assert!(!start(0.0).stays(&model, &[0.0, 0.3e-3 + 1.1e-3 * DRIFT], &[0.0; 2]));
        assert!(!start(0.0).stays(&model, &[0.0, 0.3e-3 - 1.1e-3 * DRIFT], &[0.0; 2]));
        assert!(!start(0.0).stays(&model, &[Real::MAX, Real::NAN], &[0.0; 2]));
        // What loads add counts like what is imported.
        assert!(start(0.0).stays(&model, &[-7.0, 0.2e-3], &[7.0, 0.1e-3]));
        assert!(!start(0.0).stays(&model, &steady, &[far, 0.0]));
    }

    /// (7f) gives the next input from the same eref and the same state: to the last bit the one of the start.
    #[test]
    fn starts_on_its_own_input_law() {
        let mut model = model();
        model.A = [[1.0, 0.0], [0.0, 1.0]];
        model.B = [[0.0], [0.0]];
        let mut trajectory = start(0.1 + 0.2);
        let first = trajectory.clone();
        for _ in 0..3 {
            trajectory.advance(&model, first.newest().y, &[0.0, 0.0], &[0.0, 0.0]);
        }
        assert_eq!((trajectory.x, trajectory.u, trajectory.e), (first.x, first.u, first.e));
    }
}
