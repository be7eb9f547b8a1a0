//! By what rule changing constraints are drawn.

use super::names;
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::network::{ChangingConstraint, Network};
use crate::spec::scenario::{self as written, RuleKind};

/// How the row of a changing constraint is drawn at every step.
#[derive(Debug, Clone, PartialEq)]
pub enum Rule {
    /// normal . (y_first - y_second) >= distance with the normal along the line of centres; first and second in the order of the
    /// network. The true outputs then stay at least `distance` apart, in their unit.
    Apart { distance: f64 },
    /// The same with the normal of the line that touches what the other covers, turned counter-clockwise, so that two pass each other:
    /// the paper's Section V. `share` of the room there is is left to both; 0 is the paper's rule to the letter. Two outputs each.
    Tangent { distance: f64, share: f64 },
    /// normal . y >= bound, over the outputs of the one member.
    Beyond { normal: Vec<f64>, bound: f64 },
}

/// Keeping a fifth of the room is what lets most robots past each other.
const SHARE: f64 = 0.2;

/// One per changing constraint; what is missing or does not fit is said.
pub fn of(given: &written::Scenario, network: &Network, errors: &mut Diagnostics) -> Vec<Rule> {
    let constraints = &network.changing_constraints;
    let mut rules: Vec<Option<Rule>> = vec![None; constraints.len()];
    let known: Vec<&str> = constraints.iter().map(|constraint| &*constraint.name).collect();
    // A rule of its own wins over one for all.
    let (all, own): (Vec<_>, Vec<_>) = given.rules.iter().partition(|rule| rule.constraint.is_none());
    for rule in all {
        let before = errors.0.len();
        for (constraint, place) in constraints.iter().zip(&mut rules) {
            if errors.0.len() == before {
                *place = one(rule, constraint, network, errors);
            }
        }
        if constraints.is_empty() {
            let error = Diagnostic::error(code::RULE, "this rule is for no constraint");
            let error = error.at(rule.place.clone(), "the network has no [[changing-constraint]]");
            errors.push(error.help("leave the rule out"));
        }
    }
    for rule in own {
        let Some(name) = &rule.constraint else { continue };
        let title = format!("there is no changing constraint `{}`", name.value);
        let error = || Diagnostic::error(code::RULE, title);
        if let Some(h) = names::find(name, &name.value, &known, "changing constraints", error, errors) {
            rules[h] = one(rule, &constraints[h], network, errors);
        }
    }
    if errors.is_empty() {
        missing(given, constraints, &rules, errors);
    }
    rules.into_iter().flatten().collect()
}

fn missing(
    given: &written::Scenario,
    constraints: &[ChangingConstraint],
    rules: &[Option<Rule>],
    errors: &mut Diagnostics,
) {
    let without = constraints.iter().zip(rules).find(|(_, rule)| rule.is_none());
    if let Some((constraint, _)) = without {
        let title = format!("constraint `{}` changes while running, and no rule says how", constraint.name);
        let error = Diagnostic::error(code::RULE, title).at(given.place.clone(), "the scenario has no [[rule]] for it");
        errors.push(error.help("add [[rule]] with kind = \"apart\" and distance = 1.0, say, and with constraint = \"..\" where not all have the same"));
    }
}

/// The rule for one constraint, where it fits.
fn one(
    rule: &written::Rule,
    constraint: &ChangingConstraint,
    network: &Network,
    errors: &mut Diagnostics,
) -> Option<Rule> {
    let outputs: Vec<usize> = constraint.members.iter().map(|i| network.subsystems[*i].p()).collect();
    let refuse = |why: String| {
        let title = format!("this rule does not fit constraint `{}`", constraint.name);
        Diagnostic::error(code::RULE, title).at(rule.kind.place.clone(), why)
    };
    match (rule.kind.value, &outputs[..]) {
        (RuleKind::Apart, [first, second]) if first == second => {
            distance(rule, errors).map(|distance| Rule::Apart { distance })
        }
        (RuleKind::Tangent, [2, 2]) => {
            let share = rule.share.as_ref().map_or(SHARE, |share| share.value);
            if let Some(given) = rule.share.as_ref().filter(|share| !(0.0..=1.0).contains(&share.value)) {
                errors.push(super::out_of_range("this is no share", given, "expected 0 to 1"));
                return None;
            }
            distance(rule, errors).map(|distance| Rule::Tangent { distance, share })
        }
        (RuleKind::Tangent, [first, second]) => {
            errors.push(refuse(format!(
                "its members have {first} and {second} outputs, expected two each: a point in the plane"
            )));
            None
        }
        (RuleKind::Apart, [first, second]) => {
            errors.push(refuse(format!("its members have {first} and {second} outputs, expected as many")));
            None
        }
        (RuleKind::Apart | RuleKind::Tangent, members) => {
            errors.push(refuse(format!("it is between {} subsystems, expected two", members.len())));
            None
        }
        (RuleKind::Beyond, [only]) => {
            let (normal, bound) = (rule.normal.as_ref()?, rule.bound.as_ref()?);
            let s = &network.subsystems[constraint.members[0]];
            names::vector("`normal` of this rule", normal, &s.outputs, errors)?;
            let normal: Vec<f64> = normal.value.iter().map(|entry| entry.value).collect();
            debug_assert_eq!(normal.len(), *only);
            Some(Rule::Beyond { normal, bound: bound.value })
        }
        (RuleKind::Beyond, members) => {
            errors.push(refuse(format!("it is between {} subsystems, expected one alone", members.len())));
            None
        }
    }
}

fn distance(rule: &written::Rule, errors: &mut Diagnostics) -> Option<f64> {
    let distance = rule.distance.as_ref()?;
    if distance.value <= 0.0 {
        errors.push(super::out_of_range("a distance is positive", distance, "expected more than 0"));
        return None;
    }
    Some(distance.value)
}
