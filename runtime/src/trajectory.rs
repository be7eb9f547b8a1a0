//! The reference trajectory (7) that a controller carries: from now to one step before the horizon.

use crate::linear::{add, largest, shift_in, subtract, times};
use crate::tables::Model;

/// xref, uref and yref at t, ..., t + N - 1, and eref at t + N - 1.
#[derive(Debug, Clone)]
pub(crate) struct Trajectory<const NX: usize, const NU: usize, const NY: usize, const N: usize> {
    pub x: [[f64; NX]; N],
    pub u: [[f64; NU]; N],
    pub y: [[f64; NY]; N],
    e: [f64; NY],
}

/// References at one step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point<const NX: usize, const NU: usize, const NY: usize> {
    pub x: [f64; NX],
    pub u: [f64; NU],
    pub y: [f64; NY],
}

impl<const NX: usize, const NU: usize, const NY: usize, const N: usize> Trajectory<NX, NU, NY, N> {
    /// The trajectory that stays at one point; `e` is eref there.
    pub fn constant(point: Point<NX, NU, NY>, e: [f64; NY]) -> Self {
        Self { x: [point.x; N], u: [point.u; N], y: [point.y; N], e }
    }

    /// Step t.
    pub fn now(&self) -> Point<NX, NU, NY> {
        Point { x: or_zero(self.x.first()), u: or_zero(self.u.first()), y: or_zero(self.y.first()) }
    }

    /// Step t + N - 1.
    pub fn newest(&self) -> Point<NX, NU, NY> {
        Point { x: or_zero(self.x.last()), u: or_zero(self.u.last()), y: or_zero(self.y.last()) }
    }

    /// Goes on by one step: appends t + N by (7), drops t. `y` is yref_{t+N}, `z` what is imported at t + N - 1.
    pub fn advance<const NZ: usize, const NI: usize>(
        &mut self,
        model: &Model<NX, NU, NY, NZ, NI>,
        y: [f64; NY],
        z: &[f64; NI],
    ) {
        let newest = self.newest();
        let x = successor(model, &newest, z);
        self.e = add(&self.e, &subtract(&y, &times(&model.C, &newest.x)));
        let u = add(&times(&model.Kx, &x), &times(&model.Ke, &self.e));
        shift_in(&mut self.x, x);
        shift_in(&mut self.u, u);
        shift_in(&mut self.y, y);
    }

    /// How far the newest state is from steady when `z` is imported: the largest |x+ - x| relative to the numbers it is
    /// the sum of.
    pub fn drift<const NZ: usize, const NI: usize>(&self, model: &Model<NX, NU, NY, NZ, NI>, z: &[f64; NI]) -> f64 {
        let newest = self.newest();
        let moved = largest(&subtract(&successor(model, &newest, z), &newest.x));
        let pushes = largest(&times(&model.B, &newest.u)).max(largest(&times(&model.EL, z)));
        if moved > 0.0 { moved / largest(&newest.x).max(pushes) } else { 0.0 }
    }
}

impl<const NX: usize, const NU: usize, const NY: usize> Point<NX, NU, NY> {
    /// z of (7c).
    pub fn coupling_output<const NZ: usize, const NI: usize>(&self, model: &Model<NX, NU, NY, NZ, NI>) -> [f64; NZ] {
        add(&times(&model.Cz, &self.x), &times(&model.Dz, &self.u))
    }
}

/// (7a) with (7d).
fn successor<const NX: usize, const NU: usize, const NY: usize, const NZ: usize, const NI: usize>(
    model: &Model<NX, NU, NY, NZ, NI>,
    point: &Point<NX, NU, NY>,
    z: &[f64; NI],
) -> [f64; NX] {
    let own = add(&times(&model.A, &point.x), &times(&model.B, &point.u));
    add(&own, &times(&model.EL, z))
}

fn or_zero<const COUNT: usize>(values: Option<&[f64; COUNT]>) -> [f64; COUNT] {
    values.copied().unwrap_or([0.0; COUNT])
}
