// Controllers of network `four-tank`.
//
// Written by dpc-codegen 0.1.0 from system.toml; do not edit. To make it again:
//
//     dpc-codegen system.toml --out four_tank_single --scalar f32
//
// Fits dpc-runtime 0.1. Numbers are in the units of system.toml, as deviations from its operating point.
//
// One step every 0.5 s. Who hears whom:
//
//     left: hears right (0.0206 h4 + 0.000247 v2)
//     right: hears left (0.0165 h2 + 0.00013 v1)

/// Subsystem `left`: states `h1 [cm]`, `h2 [cm]`, inputs `v1 [V]`, outputs `h1 [cm]`.
#[rustfmt::skip]
#[allow(unused, reason = "a node uses the part that it needs")]
#[allow(clippy::all, clippy::pedantic, reason = "written by a program")]
pub mod left;

/// Subsystem `right`: states `h3 [cm]`, `h4 [cm]`, inputs `v2 [V]`, outputs `h3 [cm]`.
#[rustfmt::skip]
#[allow(unused, reason = "a node uses the part that it needs")]
#[allow(clippy::all, clippy::pedantic, reason = "written by a program")]
pub mod right;

/// All of them in one process, and the plant: for simulations and tests.
#[rustfmt::skip]
#[allow(unused, reason = "a node uses the part that it needs")]
#[allow(clippy::all, clippy::pedantic, reason = "written by a program")]
pub mod network {
    /// Subsystems.
    pub const SUBSYSTEMS: usize = 2;
    /// All states, one subsystem's after the other's.
    pub const NX: usize = 4;
    /// All inputs, one subsystem's after the other's.
    pub const NU: usize = 2;
    /// All outputs, one subsystem's after the other's.
    pub const NY: usize = 2;
    /// All loads, one subsystem's after the other's.
    pub const ND: usize = 0;
    /// Seconds per step.
    pub const SAMPLE_TIME: f64 = 0.5;
    /// Names of all states, with units.
    pub const STATES: [&str; NX] = ["left: h1 [cm]", "left: h2 [cm]", "right: h3 [cm]", "right: h4 [cm]"];
    /// Names of all inputs, with units.
    pub const INPUTS: [&str; NU] = ["left: v1 [V]", "right: v2 [V]"];
    /// Names of all outputs, with units.
    pub const OUTPUTS: [&str; NY] = ["left: h1 [cm]", "right: h3 [cm]"];
    /// Names of all loads, with units.
    pub const LOADS: [&str; ND] = [];
    /// Y of (31): the set-points of each output that are followed all the way. Of farther ones, to its ends.
    pub const SET_POINTS: [(f64, f64); NY] = [(-1.0, 3.70961), (-1.0, 3.85501)];
    /// The most that references move per step.
    pub const EPSILON: f64 = 0.02;
    /// Disturbances that the design covers, in any combination: what may be added to each of [`STATES`] in a step.
    pub const DISTURBANCES: [(f64, f64); NX] = [(0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)];
    /// Least and most of each of [`LOADS`].
    pub const LOAD_RANGES: [(f64, f64); ND] = [];
    /// Their largest change per step.
    pub const LOAD_RATES: [f64; ND] = [];

    /// All controllers of the network, and what is on its way between them. Each node is open to look at, or to draw rows for.
    #[derive(Debug, Clone)]
    pub struct Network {
        /// Of `left`.
        pub left: Node<super::left::Controller, super::left::Inbox, super::left::Message>,
        /// Of `right`.
        pub right: Node<super::right::Controller, super::right::Inbox, super::right::Message>,
    }

    /// One subsystem's.
    #[derive(Debug, Clone)]
    pub struct Node<Controller, Inbox, Message, Loads = ()> {
        /// What it remembers from step to step.
        pub controller: Controller,
        /// What has arrived for it.
        pub inbox: Inbox,
        /// The last one it sent.
        pub message: Message,
        /// Its measured disturbances, where it has any.
        pub loads: Loads,
    }

    /// What a step of all controllers gives.
    #[derive(Debug, Clone, Copy)]
    pub struct Step {
        /// In the order of [`INPUTS`].
        pub input: [f64; NU],
        /// What each controller gives, with its status.
        pub nodes: Steps,
    }

    /// The step of each subsystem.
    #[derive(Debug, Clone, Copy)]
    pub struct Steps {
        /// Of `left`.
        pub left: super::left::Step,
        /// Of `right`.
        pub right: super::right::Step,
    }

    impl Network {
        /// All controllers at rest where the outputs are `outputs` (in the order of [`OUTPUTS`]) under `loads`.
        ///
        /// # Errors
        /// A controller cannot start there; see [`dpc_runtime::StartError`].
        #[inline]
        pub fn start(outputs: &[f64; NY], loads: &[f64; ND]) -> Result<Self, dpc_runtime::StartError> {
            Ok(Self {
                left: {
                    let (controller, message) = super::left::start(&super::left::steady_state(&outputs.map(|y| y as f32)))?;
                    Node { controller, inbox: super::left::Inbox::new(), message, loads: () }
                },
                right: {
                    let (controller, message) = super::right::start(&super::right::steady_state(&outputs.map(|y| y as f32)))?;
                    Node { controller, inbox: super::right::Inbox::new(), message, loads: () }
                },
            })
        }

        /// Every node hears its neighbours' last messages. [`Self::step`] begins with it; constraints that change while running are
        /// redrawn in between. What is refused shows in the status.
        #[inline]
        pub fn deliver(&mut self) {
            let _ = self.left.inbox.accept(&super::left::FROM_RIGHT, &self.right.message);
            let _ = self.right.inbox.accept(&super::right::FROM_LEFT, &self.left.message);
        }

        /// One period of all controllers: messages, then their steps. Measured states in the order of [`STATES`], set-points of
        /// [`OUTPUTS`], measured loads of [`LOADS`].
        #[inline]
        pub fn step(&mut self, x: &[f64; NX], set_points: &[f64; NY], loads: &[f64; ND]) -> Step {
            self.deliver();
            let nodes = Steps {
                left: self.left.controller.step(&[x[0] as f32, x[1] as f32], &[set_points[0] as f32], &mut self.left.inbox),
                right: self.right.controller.step(&[x[2] as f32, x[3] as f32], &[set_points[1] as f32], &mut self.right.inbox),
            };
            self.left.message = nodes.left.message;
            self.right.message = nodes.right.message;
            Step { input: [f64::from(nodes.left.input[0]), f64::from(nodes.right.input[0])], nodes }
        }
    }

    impl Steps {
        /// Whether every subsystem says that the guarantee holds: then it does, for the network.
        #[inline]
        pub fn are_guaranteed(&self) -> bool {
            [self.left.status.is_guaranteed(), self.right.status.is_guaranteed()].iter().all(|guaranteed| *guaranteed)
        }

        /// Of each subsystem: name, whether the guarantee holds, and its status in words.
        #[inline]
        pub fn statuses(&self) -> [(&'static str, bool, &dyn core::fmt::Display); SUBSYSTEMS] {
            [
                ("left", self.left.status.is_guaranteed(), &self.left.status),
                ("right", self.right.status.is_guaranteed(), &self.right.status),
            ]
        }
    }

    /// x+ = A x + B u + M d of the file, for all subsystems together: the plant of the design, without disturbances `w`.
    #[inline]
    pub fn plant(x: &[f64; NX], u: &[f64; NU], loads: &[f64; ND]) -> [f64; NX] {
        [
            0.9921 * x[0] + 0.0417 * u[0] + 0.0206 * x[3] + 0.000247 * u[1], // h1 [cm]
            0.9835 * x[1] + 0.0156 * u[0], // h2 [cm]
            0.9945 * x[2] + 0.0311 * u[1] + 0.0165 * x[1] + 0.00013 * u[0], // h3 [cm]
            0.9793 * x[3] + 0.0235 * u[1], // h4 [cm]
        ]
    }

    /// y = C x.
    #[inline]
    pub fn outputs(x: &[f64; NX]) -> [f64; NY] {
        [
            x[0], // h1 [cm]
            x[2], // h3 [cm]
        ]
    }

    /// Limits of states and inputs, and coupling constraints.
    pub const LIMITS: [&str; 12] = ["left: h1 <= 27.6 cm", "left: h1 >= -12.4 cm", "left: h2 <= 38.6 cm", "left: h2 >= -1.4 cm", "left: v1 <= 3 V", "left: v1 >= -3 V", "right: h3 <= 27.3 cm", "right: h3 >= -12.7 cm", "right: h4 <= 38.2 cm", "right: h4 >= -1.8 cm", "right: v2 <= 3 V", "right: v2 >= -3 V"];

    /// How far the network is from each of [`LIMITS`], in the unit of the signal; below 0 it is violated.
    #[inline]
    pub fn margins(x: &[f64; NX], u: &[f64; NU]) -> [f64; 12] {
        [
            27.6 - x[0], // h1 <= 27.6 cm
            12.4 + x[0], // h1 >= -12.4 cm
            38.6 - x[1], // h2 <= 38.6 cm
            1.4 + x[1], // h2 >= -1.4 cm
            3.0 - u[0], // v1 <= 3 V
            3.0 + u[0], // v1 >= -3 V
            27.3 - x[2], // h3 <= 27.3 cm
            12.7 + x[2], // h3 >= -12.7 cm
            38.2 - x[3], // h4 <= 38.2 cm
            1.8 + x[3], // h4 >= -1.8 cm
            3.0 - u[1], // v2 <= 3 V
            3.0 + u[1], // v2 >= -3 V
        ]
    }
}
