//! What a start-up plan recognises its tables by, and messages the design they belong to.

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

/// A number that other designs do not have: of this network with another model, weight or limit, of another scalar type, or of
/// another network. Messages carry it. FNV-1a, as [`fingerprint`], over names, sample time, horizon and all tables of all subsystems.
pub fn design_fingerprint(design: &Design) -> u64 {
    let tables = (0..design.network.subsystems.len()).map(|i| parts::all(&Node::new(design, i))).collect::<Vec<_>>();
    of_tables(design, &tables)
}

/// [`design_fingerprint`] where the tables of all subsystems are at hand.
pub fn of_tables(design: &Design, tables: &[Value]) -> u64 {
    let network = &design.network;
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    hash.text(&network.name);
    hash.number(network.sample_time);
    hash.word(network.horizon as u64);
    hash.word(network.scalar.bytes() as u64);
    for (subsystem, tables) in network.subsystems.iter().zip(tables) {
        hash.text(&subsystem.name);
        hash.value(tables);
    }
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
        self.word((number + 0.0).to_bits());
    }

    fn word(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0100_0000_01b3);
        self.0 ^= self.0 >> 32;
    }

    fn text(&mut self, text: &str) {
        self.word(text.len() as u64);
        text.bytes().for_each(|byte| self.word(byte.into()));
    }

    fn value(&mut self, value: &Value) {
        match value {
            Value::Number(number) => self.number(*number),
            Value::Row(row) => row.iter().for_each(|number| self.number(*number)),
            Value::Matrix(rows) => rows.iter().flat_map(|(row, _)| row).for_each(|number| self.number(*number)),
            Value::List(items) => items.iter().for_each(|(item, _)| self.value(item)),
            Value::Tuple(items) => items.iter().for_each(|item| self.value(item)),
            Value::Struct(_, fields) => fields.iter().for_each(|field| self.value(&field.value)),
            // No model has any of these, but other tables do.
            Value::Entries(rows) => rows.iter().flat_map(|(row, _)| row).for_each(|(k, number)| {
                self.word(*k as u64);
                self.number(*number);
            }),
            Value::Count(count) => self.word(*count as u64),
            Value::Counts(counts) => counts.iter().for_each(|count| self.word(*count as u64)),
            Value::Array(items) => items.iter().for_each(|item| self.value(item)),
            Value::Slice(list) => self.value(list),
            Value::Word(word) => self.word(*word),
            Value::Flag(flag) => self.word((*flag).into()),
            Value::Text(text) => self.text(text),
            Value::Path(path) => self.text(path),
            Value::Optional(value, _) => {
                self.word(value.is_some().into());
                value.iter().for_each(|value| self.value(value));
            }
        }
    }
}
