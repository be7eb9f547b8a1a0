//! Plant, controllers and bus, one sampling period after the other.

use dpc_runtime::Message;

use crate::bus::Bus;
use crate::node::{Node, NotReceived};
use crate::nuisance::Nuisance;
use crate::plant::{Levels, Plant};
use crate::sets::Promise;
use crate::trajectory::{NodeSample, Sample};

/// The tanks under control; all values are deviations from the working point.
pub struct ClosedLoop<'a> {
    plant: &'a dyn Plant,
    promise: &'a Promise,
    nodes: [Box<dyn Node>; 2],
    bus: Bus,
    x: Levels,
}

impl<'a> ClosedLoop<'a> {
    /// The plant at `x`, and controllers with what each of them sends at its start.
    pub fn new(
        plant: &'a dyn Plant,
        promise: &'a Promise,
        started: [(Box<dyn Node>, Message<1, 1>); 2],
        x: Levels,
    ) -> Self {
        let mut bus = Bus::default();
        started.iter().enumerate().for_each(|(i, (_, message))| bus.send(i, 1 - i, message));
        Self { plant, promise, nodes: started.map(|(node, _)| node), bus, x }
    }

    /// One period. The messages of the period before are there at its beginning; what is sent now is there in the next.
    ///
    /// # Errors
    /// A message got lost in the bus.
    pub fn step(&mut self, set_points: [f64; 2]) -> Result<Sample, NotReceived> {
        self.step_under(set_points, [Nuisance::default(); 2])
    }

    /// The same, while the levels are disturbed and measured with an error.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_under(&mut self, set_points: [f64; 2], acting: [Nuisance; 2]) -> Result<Sample, NotReceived> {
        for (i, node) in self.nodes.iter_mut().enumerate() {
            self.bus.receive(i).try_for_each(|datagram| node.receive(&datagram))?;
        }
        let sample = Sample { nodes: [0, 1].map(|i| self.step_node(i, set_points[i], acting[i].v)) };
        self.x = self.plant.advance(&self.x, &sample.voltages());
        let added = acting.iter().flat_map(|nuisance| nuisance.w);
        self.x.iter_mut().zip(added).for_each(|(x, w)| *x += w);
        Ok(sample)
    }

    /// Puts the tanks of subsystem `i` where `choose` says, who may ask its controller.
    pub fn upset(&mut self, i: usize, choose: impl FnOnce(&mut dyn Node) -> [f64; 2]) {
        let x = choose(self.nodes[i].as_mut());
        self.x[2 * i..2 * i + 2].copy_from_slice(&x);
    }

    /// Moves the state of subsystem `i`.
    pub fn push(&mut self, i: usize, by: [f64; 2]) {
        self.x[2 * i..2 * i + 2].iter_mut().zip(by).for_each(|(x, by)| *x += by);
    }

    /// Tells subsystem `i` its loads of the step to come.
    pub fn measure(&mut self, i: usize, loads: &[f64]) {
        self.nodes[i].measure(loads);
    }

    fn step_node(&mut self, i: usize, set_point: f64, error: [f64; 2]) -> NodeSample {
        let x = [self.x[2 * i], self.x[2 * i + 1]];
        let step = self.nodes[i].step(&[0, 1].map(|k| x[k] + error[k]), set_point);
        self.bus.send(i, 1 - i, &step.message);
        let reference = &step.telemetry;
        NodeSample {
            x,
            u: step.input,
            set_point,
            y_ref: reference.y_ref[0],
            x_nom: reference.x_nom,
            z_ref: self.promise.subsystems[i].coupling_output(&reference.x_ref, &reference.u_ref),
            status: step.status,
        }
    }
}
