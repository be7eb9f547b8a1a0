//! What a start-up plan recognises its tables by.

use super::node::Node;
use super::parts;
use super::tables::Value;
use crate::design::Design;

/// `dpc_runtime::Tables::fingerprint` of the tables of subsystem `i`: FNV-1a over the numbers of its model, in the order of their
/// fields, and over the limits of its problem.
pub fn fingerprint(design: &Design, i: usize) -> u64 {
    let node = Node::new(design, i);
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    hash.value(&parts::model(&node));
    let problem = &node.problems().dpc;
    problem.lower.iter().chain(&problem.upper).for_each(|limit| hash.number(*limit));
    hash.0
}

struct Fnv(u64);

impl Fnv {
    fn number(&mut self, number: f64) {
        // -0.0 and 0.0 are one number.
        self.0 = (self.0 ^ (number + 0.0).to_bits()).wrapping_mul(0x0100_0000_01b3);
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
            Value::Entries(_) | Value::Count(_) | Value::Word(_) | Value::Flag(_) | Value::Text(_) | Value::Path(_) => {
            }
        }
    }
}
