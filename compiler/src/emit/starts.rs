//! The start-up plan of a node as constant data, and the function that starts a controller with one.

use nalgebra::DVector;
use proc_macro2::TokenStream;
use quote::quote;

use super::monitors::has_noise;
use super::names::code;
use super::node::{Node, labelled, labels};
use super::tables::{Field, Value, item};
use crate::network::Scalar;
use crate::start::{StartPlan, SubsystemPlan};

/// Whether controllers of this network may be started with a plan.
pub fn may_start(node: &Node) -> bool {
    node.design.network.start_anywhere || node.design.start.is_some()
}

/// The plan for the start that the file states.
pub fn items(node: &Node) -> Vec<String> {
    let Some(plan) = &node.design.start else { return Vec::new() };
    let part = &plan.subsystems[node.i];
    let mut items = vec![start_state(node, plan)];
    items.extend((!node.loads().is_empty()).then(|| start_loads(node, plan)));
    items.extend([start_plan(part), points(part)]);
    items
}

fn start_state(node: &Node, plan: &StartPlan) -> String {
    let doc = "The state that the start-up plan [`START`] was made for.";
    item(
        node.scalar(),
        doc,
        "START_X",
        "[f64; NX]",
        &Value::column(&plan.start.x0[node.i], &labels(&node.model().states)),
    )
}

fn start_loads(node: &Node, plan: &StartPlan) -> String {
    let doc = "The loads that the start-up plan [`START`] was made for.";
    item(
        node.scalar(),
        doc,
        "START_LOADS",
        "[f64; ND]",
        &Value::column(&plan.start.d0[node.i], &labels(&node.loads().signals)),
    )
}

fn start_plan(part: &SubsystemPlan) -> String {
    let doc = "This subsystem's part of the start-up plan of the network, for [`start_planned`]. All subsystems must start\n\
               with their parts of the same plan.";
    let du = part.du.iter().map(|du| (Value::row(du), String::new())).collect();
    let nominal = vec![Field::new("dx", "", Value::row(&part.dx)), Field::new("du", "", Value::List(du))];
    let fields = vec![
        Field::new("design", "Fingerprint of the tables it was made for", Value::Word(part.design)),
        Field::new("plan", "Number of the network's plan", Value::Count(part.plan as usize)),
        Field::new("points", "xref and uref, step by step", Value::Path("&START_POINTS")),
        Field::new("e", "eref at the last step", Value::row(&part.e)),
        Field::new(
            "nominal",
            "A solution of the first i-DPC problem: dx_0, du_0, ..., du_{N-1}",
            Value::Struct("Plan", nominal),
        ),
    ];
    item(Scalar::Double, doc, "START", "StartPlan<'static>", &Value::Struct("StartPlan", fields))
}

fn points(part: &SubsystemPlan) -> String {
    let point = |(step, (x, u)): (usize, (&DVector<f64>, &DVector<f64>))| {
        let fields = vec![Field::new("x", "", Value::row(x)), Field::new("u", "", Value::row(u))];
        (Value::Struct("PlannedPoint", fields), format!("step {step}"))
    };
    let points: Vec<_> = part.x.iter().zip(&part.u).enumerate().map(point).collect();
    let ty = format!("[PlannedPoint<NX, NU>; {}]", points.len());
    item(Scalar::Double, "The references of the start-up plan.", "START_POINTS", &ty, &Value::List(points))
}

/// `start_planned`, where controllers may be started with a plan.
pub fn function(node: &Node) -> Option<TokenStream> {
    let noise = if has_noise(node) { quote!(Some(&TUBE_NOISE)) } else { quote!(None) };
    let states = node.model().states.iter().map(|state| code(&labelled(state))).collect::<Vec<_>>().join(", ");
    let measured = format!(
        " A controller at the measured state `x` ({states}) with its part of a start-up plan, such as [`START`]"
    );
    let measured = if node.design.start.is_some() { measured } else { measured.replace(", such as [`START`]", "") };
    let function = if node.loads().is_empty() {
        let doc = format!("{measured}, and its first message to those who hear it.");
        quote! {
            #[doc = #doc]
            ///
            /// # Errors
            /// The state does not fit the plan, or the plan not this subsystem; see [`StartError`].
            pub fn start_planned<'a>(
                plan: &'a StartPlan<'a>,
                x: &[f64; NX],
            ) -> Result<(PlannedController<'a>, Message), StartError> {
                PlannedController::start_planned(&TABLES, plan, #noise, x)
            }
        }
    } else {
        let doc = format!(
            "{measured} and the loads the plan was made for, its loads, and its first message to those who hear it."
        );
        quote! {
            #[doc = #doc]
            ///
            /// # Errors
            /// The state does not fit the plan, or the plan not this subsystem; see [`StartError`].
            pub fn start_planned<'a>(
                plan: &'a StartPlan<'a>,
                loads: &[f64; ND],
                x: &[f64; NX],
            ) -> Result<(PlannedController<'a>, Loads, Message), StartError> {
                let (loads, load) = Loads::start(&LOAD_MODEL, loads)?;
                let (controller, message) = PlannedController::start_planned(&TABLES, plan, #noise, x)?;
                Ok((controller.under(&load), loads, message))
            }
        }
    };
    may_start(node).then_some(function)
}
