//! Plant, controllers and bus, one sampling period after the other.

use dpc_runtime::StartError;
use example_kit::bus::{Bus, Datagram, NotReceived};
use example_kit::sets::Promise;
use example_kit::trajectory::{NodeSample, Sample};

use crate::areas::{AREAS, NX, neighbours};
use crate::files::Design;
use crate::model::Model;
use crate::node::{Node, start};

/// The network under control.
pub struct ClosedLoop<'a> {
    plant: &'a Model,
    promise: &'a Promise,
    nodes: Vec<Box<dyn Node>>,
    bus: Bus,
    pub x: Vec<f64>,
    /// Steps of an area at which a load was not what its design assumes.
    pub outside: usize,
}

impl<'a> ClosedLoop<'a> {
    /// The plant at the operating point without loads, and controllers at rest there.
    ///
    /// # Errors
    /// A controller refuses to start.
    pub fn at_rest(design: Design, plant: &'a Model, promise: &'a Promise) -> Result<Self, StartError> {
        let started = start(design, &[0.0; AREAS], &[0.0; AREAS])?;
        let mut network =
            Self { plant, promise, nodes: Vec::new(), bus: Bus::default(), x: vec![0.0; AREAS * NX], outside: 0 };
        for (i, (node, message)) in started.into_iter().enumerate() {
            network.nodes.push(node);
            network.send(i, &message);
        }
        Ok(network)
    }

    /// One period. The messages of the period before are there at its beginning; what is sent now is there in the next.
    ///
    /// # Errors
    /// A message got lost in the bus.
    pub fn step(&mut self, loads: &[f64; AREAS], set_points: &[f64; AREAS]) -> Result<Sample, NotReceived> {
        for (i, node) in self.nodes.iter_mut().enumerate() {
            self.bus.receive(i).try_for_each(|datagram| node.receive(&datagram))?;
        }
        let nodes: Vec<_> = (0..AREAS).map(|i| self.step_area(i, loads[i], set_points[i])).collect();
        let u: Vec<f64> = nodes.iter().map(|node| node.u[0]).collect();
        self.x = self.plant.next(&self.x, &u, loads);
        Ok(Sample { nodes })
    }

    /// Puts area `i` where `choose` says, who may ask its controller.
    pub fn upset(&mut self, i: usize, choose: impl FnOnce(&mut dyn Node) -> [f64; NX]) {
        let x = choose(self.nodes[i].as_mut());
        self.x[NX * i..NX * (i + 1)].copy_from_slice(&x);
    }

    fn step_area(&mut self, i: usize, load: f64, set_point: f64) -> NodeSample {
        let x: [f64; NX] = std::array::from_fn(|k| self.x[NX * i + k]);
        let answer = self.nodes[i].step(&x, load, set_point);
        self.outside += usize::from(!answer.within);
        self.send(i, &answer.message);
        let told = &answer.telemetry;
        NodeSample {
            x: x.to_vec(),
            u: vec![answer.input],
            set_point: vec![set_point],
            y_ref: told.y_ref.to_vec(),
            x_nom: told.x_nom.to_vec(),
            z_ref: self.promise.subsystems[i].coupling_output(&told.x_ref, &told.u_ref),
            control: answer.control,
            unguaranteed: answer.unguaranteed,
        }
    }

    fn send(&mut self, from: usize, bytes: &[u8]) {
        neighbours(from).for_each(|to| self.bus.pass(Datagram { from, to, bytes: bytes.to_vec() }));
    }
}
