//! `mod.rs`: the list of the modules, and who talks to whom.

use std::fmt::Write;

use super::code::header;
use super::names::{code, one_line};
use super::node::{Node, labels};
use super::together::module;

/// The whole file. It holds no inner attribute and no inner doc comment, so that it can be included.
pub fn file(nodes: &[Node], modules: &[String]) -> String {
    let Some(first) = nodes.first() else { return String::new() };
    let network = &first.design.network;
    let mut text = header(first.design, &format!("Controllers of network `{}`", network.name));
    let _ = writeln!(text, "//\n// One step every {} s. Who hears whom:\n//", network.sample_time);
    for node in nodes {
        let _ = writeln!(text, "//     {}: {}", one_line(&node.model().name), hears(node));
    }
    for (node, module) in nodes.iter().zip(modules) {
        let _ = write!(text, "\n/// {}\n{ATTRIBUTES}pub mod {module};\n", doc(node));
    }
    let _ = write!(
        text,
        "\n/// All of them in one process, and the plant: for simulations and tests.\n{ATTRIBUTES}{}",
        module(nodes, modules)
    );
    text
}

/// On the modules, since the files themselves must begin with items.
const ATTRIBUTES: &str = "\
#[rustfmt::skip]
#[allow(unused, reason = \"a node uses the part that it needs\")]
#[allow(clippy::all, clippy::pedantic, reason = \"written by a program\")]
";

/// `right (0.0206 h4 + 0.000247 v2)`
fn hears(node: &Node) -> String {
    let heard = node.neighbours.iter().map(|neighbour| {
        let other = node.other(neighbour);
        let outputs = labels(&other.outputs);
        let z = neighbour.z.map(|_| other.coupling_outputs.as_slice()).unwrap_or_default();
        let y = neighbour.y.map(|_| outputs.as_slice()).unwrap_or_default();
        format!("{} ({})", other.name, [z, y].concat().join("; "))
    });
    let heard: Vec<String> = heard.collect();
    if heard.is_empty() { "nobody".to_owned() } else { format!("hears {}", one_line(&heard.join(", "))) }
}

fn doc(node: &Node) -> String {
    let model = node.model();
    let list = |signals| labels(signals).iter().map(|name| code(name)).collect::<Vec<_>>().join(", ");
    format!(
        "Subsystem {}: states {}, inputs {}, outputs {}.",
        code(&model.name),
        list(&model.states),
        list(&model.inputs),
        list(&model.outputs)
    )
}
