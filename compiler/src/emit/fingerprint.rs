//! What a start-up plan recognises its tables by.

use super::node::Node;
use super::parts;
use super::tables::Value;
use crate::design::Design;
use crate::problems::RowKind;
use crate::start::SubsystemPlan;

/// `dpc_runtime::Tables::fingerprint` of the tables of subsystem `i`: FNV-1a over the numbers of its model, in the order of their
/// fields, and over the limits and tube rows of its problem.
pub fn fingerprint(design: &Design, i: usize) -> u64 {
    let node = Node::new(design, i);
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    hash.value(&parts::model(&node));
    let problem = &node.problems().dpc;
    problem.lower.iter().chain(&problem.upper).for_each(|limit| hash.number(*limit));
    let tube = problem.rows.iter().filter(|row| row.kind == RowKind::Tube);
    tube.flat_map(|row| row.offset.iter()).for_each(|number| hash.number(*number));
    hash.0
}

/// What all parts of one plan for the network share, and those of another do not; never 0.
pub fn plan_number(parts: &[SubsystemPlan]) -> u32 {
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    for part in parts {
        part.x.iter().chain(&part.u).chain([&part.e]).flatten().for_each(|number| hash.number(*number));
    }
    (hash.0 as u32).max(1)
}

struct Fnv(u64);

impl Fnv {
    fn number(&mut self, number: f64) {
        // -0.0 and 0.0 are one number.
        self.0 = (self.0 ^ (number + 0.0).to_bits()).wrapping_mul(0x0100_0000_01b3);
        self.0 ^= self.0 >> 32;
    }

    fn value(&mut self, value: &Value) {
        match value {
            Value::Number(number) => self.number(*number),
            Value::Row(row) => row.iter().for_each(|number| self.number(*number)),
            Value::Matrix(rows) => rows.iter().flat_map(|(row, _)| row).for_each(|number| self.number(*number)),
            Value::List(items) => items.iter().for_each(|(item, _)| self.value(item)),
            Value::Tuple(items) => items.iter().for_each(|item| self.value(item)),
            Value::Struct(_, fields) => fields.iter().for_each(|field| self.value(&field.value)),
            // No model has any of these.
            Value::Entries(_)
            | Value::Count(_)
            | Value::Counts(_)
            | Value::Array(_)
            | Value::Slice(_)
            | Value::Word(_)
            | Value::Flag(_)
            | Value::Text(_)
            | Value::Path(_)
            | Value::Optional(..) => {}
        }
    }
}
