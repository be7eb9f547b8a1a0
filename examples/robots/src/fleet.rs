//! Robots of one kind, any number of them, as the compiler reads them.

use std::fmt::Write;

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostics, Source};

use crate::arena::SIZE;
use crate::declared::Declared;
use crate::pace::Pace;
use crate::scenario::Space;

/// Robots that controllers are emitted for.
pub const EMITTED: usize = 3;

/// `system.toml` for `n` robots.
pub fn text(n: usize, pace: Pace) -> String {
    let mut text = head(n, pace);
    (1..=n).for_each(|robot| text += &subsystem(robot, pace));
    (1..=n).flat_map(|j| (1..j).map(move |i| (i, j))).for_each(|(i, j)| {
        let _ = write!(
            text,
            "\n[[changing-constraint]]\nname = \"robots {i} and {j}\"\nbetween = [\"robot_{i}\", \"robot_{j}\"]\nmargin = {:?}\n",
            pace.margin
        );
    });
    text
}

/// The source of a design of `n` robots.
pub fn source(n: usize, pace: Pace) -> Source {
    Source { path: format!("{n} robots"), text: text(n, pace) }
}

/// What a design allows of positions, for any two of its robots: they are all alike.
pub fn space(design: &Design, pace: Pace) -> Space {
    let sized = &design.sizing.subsystems[0];
    let generators = sized.exposed.generators.iter();
    Space {
        low: [sized.Y.min[0], sized.Y.min[1]],
        high: [sized.Y.max[0], sized.Y.max[1]],
        clearance: pace.clearance(),
        margin: generators.map(|g| [2.0 * g[0], 2.0 * g[1]]).collect(),
    }
}

fn head(n: usize, pace: Pace) -> String {
    format!(
        "# {n} e-pucks of Section V on a floor of {} x {} cm. Positions count from its centre, in cm; a robot's centre stays\n\
         # on the floor, between the samples too. As double integrators after the feedback linearisation (42); what the wheels make of it is\n\
         # measured by `cargo run --release -p robots --bin following`, and declared as `w`. Written by `-- --design`.\n\
         name = \"robots\"\n\
         sample-time = {:?}                 # s\n\
         horizon = 3\n\
         \n\
         [reference]\n\
         epsilon = {:?}                     # cm per step\n\
         norm = 2\n\
         gamma = 1.0\n",
        SIZE[0],
        SIZE[1],
        pace.period(),
        pace.epsilon,
    )
}

fn subsystem(robot: usize, pace: Pace) -> String {
    let Declared { class, bound } = pace.declared;
    let t = class.period;
    let half = 0.5 * t * t;
    let [x, y] = pace.floor().high.map(|end| (1000.0 * end).floor() / 1000.0);
    let (v, a) = (class.velocity, class.acceleration);
    let (p, q) = (bound.position, bound.velocity);
    format!(
        r#"
[subsystem.robot_{robot}]
states = ["px [cm]", "vx [cm/s]", "py [cm]", "vy [cm/s]"]
inputs = ["ax [cm/s2]", "ay [cm/s2]"]
outputs = ["px", "py"]
A = [[1, {t:?}, 0, 0], [0, 1, 0, 0], [0, 0, 1, {t:?}], [0, 0, 0, 1]]
B = [[{half:?}, 0], [{t:?}, 0], [0, {half:?}], [0, {t:?}]]
C = [[1, 0, 0, 0], [0, 0, 1, 0]]
x = {{ min = [-{x:?}, -{v:?}, -{y:?}, -{v:?}], max = [{x:?}, {v:?}, {y:?}, {v:?}] }}
u = {{ min = [-{a:?}, -{a:?}], max = [{a:?}, {a:?}] }}
w = {{ min = [-{p:?}, -{q:?}, -{p:?}, -{q:?}], max = [{p:?}, {q:?}, {p:?}, {q:?}] }}
Q = 1.0
R = 0.01
T = 4.0
Kx = [[-0.625, -0.875, 0, 0], [0, 0, -0.625, -0.875]]   # dead-beat: the least that references may lag, 1.5 epsilon
Ke = [[0.25, 0], [0, 0.25]]
reserve = 0.15
cover = {{ px = [-45.0, 25.0], py = [-27.0, 15.0] }}   # the starts and goals of Section V
"#,
    )
}

/// The design of `n` robots.
///
/// # Errors
/// What the compiler says of `n` robots.
pub fn design(n: usize, pace: Pace) -> Result<Design, Diagnostics> {
    Design::new(source(n, pace))
}
