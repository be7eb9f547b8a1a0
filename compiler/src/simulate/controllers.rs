//! What a closed loop needs of the controllers, whatever runs them.

use nalgebra::DVector;

use super::history::Status;
use super::scenario::Start;

/// A way to run the controllers of a network.
pub trait Controllers {
    /// The controller of subsystem `i`, and what it sends first.
    ///
    /// # Errors
    /// It refuses to start there: why, in words.
    fn start(&mut self, i: usize, start: &Start) -> Result<Started, String>;
}

pub struct Started {
    pub controller: Box<dyn Controller>,
    pub message: Sent,
    /// The state that references rest at; `None` where a start-up plan leads away from its own.
    pub rest: Option<DVector<f64>>,
}

/// A message on its way.
#[derive(Debug, Clone, PartialEq)]
pub struct Sent {
    /// As it crosses the wire.
    pub bytes: Vec<u8>,
    /// What it says of yref_{t+N}.
    pub y_ref: Vec<f64>,
}

/// One subsystem's controller with its inbox. Numbers are in the user's units.
pub trait Controller {
    /// Takes in what subsystem `from` sent.
    ///
    /// # Errors
    /// It was refused: why, in words. The step that needs it says so in its status.
    fn accept(&mut self, from: usize, message: &[u8]) -> Result<(), String>;

    /// Redraws a changing constraint for this step; `row` counts those that this subsystem is in. The rows that all members draw
    /// must be the same.
    ///
    /// # Errors
    /// The row was not accepted: why, in words. The one before stays in force.
    fn redraw(&mut self, row: usize, drawn: &HalfSpace) -> Result<(), String>;

    /// One period.
    fn step(&mut self, given: &Given<'_>) -> Answer;
}

/// normal . (outputs of all members, in the order of the network) <= limit.
#[derive(Debug, Clone, PartialEq)]
pub struct HalfSpace {
    pub normal: Vec<f64>,
    pub limit: f64,
}

/// What a step is given.
#[derive(Debug, Clone, Copy)]
pub struct Given<'a> {
    /// The measured state.
    pub x: &'a [f64],
    pub set_point: &'a [f64],
    /// The measured loads; none where there are none.
    pub loads: &'a [f64],
}

/// What a step gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    pub input: Vec<f64>,
    pub message: Sent,
    pub status: Status,
    /// xref_t, uref_t, yref_t, xhat_{t|t}, uhat_{t|t}.
    pub x_ref: Vec<f64>,
    pub u_ref: Vec<f64>,
    pub y_ref: Vec<f64>,
    pub x_nom: Vec<f64>,
    pub u_nom: Vec<f64>,
}
