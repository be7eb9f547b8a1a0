//! The first half of an emitted file: sizes, names, types and links.

use proc_macro2::{Ident, Literal, TokenStream};
use quote::{ToTokens, format_ident, quote};

use super::monitors::has_noise;
use super::names::{code, one_line};
use super::node::{Neighbour, Node, labelled, labels};
use super::starts::{self, may_start};
use super::wire;
use crate::design::Design;
use crate::gains::Proof;
use crate::network::Scalar;
use crate::problems::ReferenceProblem;

/// Version of the runtime whose tables the emitted files fill: major, minor.
const RUNTIME: (u32, u32) = (0, 1);

/// `//` lines: what made the file, out of which file, how to make it again. An inner doc comment could not be included.
pub fn header(design: &Design, what: &str) -> String {
    header_with(design, what, &format!("--out {}", super::package_folder(&design.network)))
}

/// With what the command that makes the file says besides the network's.
pub fn header_with(design: &Design, what: &str, option: &str) -> String {
    let file = source_file(design);
    let (major, minor) = RUNTIME;
    let effort =
        design.tuning.as_ref().map(|tuning| format!(" --effort {}", tuning.effort.level())).unwrap_or_default();
    let scalar = if design.network.scalar != design.network.stated_scalar() {
        format!(" --scalar {}", design.network.scalar.name())
    } else {
        String::new()
    };
    let start = design.start.as_ref().and_then(|plan| plan.start.file.as_ref());
    let start = start.map(|path| format!(" --start {}", file_name(path))).unwrap_or_default();
    let samples = design.samples.map(|samples| format!(" --iterations={samples}")).unwrap_or_default();
    format!(
        "// {}.\n\
         //\n\
         // Written by dpc-codegen {} from {file}; do not edit. To make it again:\n\
         //\n\
         //     dpc-codegen {file} {option}{effort}{scalar}{start}{samples}\n\
         //\n\
         // Fits dpc-runtime {major}.{minor}. Numbers are in the units of {file}, as deviations from its operating point.\n{}",
        one_line(what),
        env!("CARGO_PKG_VERSION"),
        origin(design),
    )
}

/// Where the model comes from, where that is not all in the file: other files, as it names them, and continuous time.
fn origin(design: &Design) -> String {
    let files: Vec<String> = design.network.files.iter().map(|file| one_line(file)).collect();
    let imported = (!files.is_empty()).then(|| format!("// Matrices come from {}.\n", files.join(", ")));
    let sampled = design.network.hold.as_ref().map(|hold| {
        let charged =
            if hold.charged { "what that leaves out is part of w" } else { "what that leaves out is not charged" };
        format!("// The model is sampled from continuous time with the coupling held over each period; {charged}.\n")
    });
    [imported, sampled].into_iter().flatten().collect()
}

/// Name of the file the network was read from, without its folders: these differ between machines.
pub fn source_file(design: &Design) -> String {
    file_name(&design.network.source.path)
}

fn file_name(path: &str) -> String {
    one_line(path.rsplit(['/', '\\']).next().unwrap_or(path))
}

/// The half, formatted, without the header.
pub fn text(node: &Node, modules: &[String], fingerprint: u64) -> String {
    let groups = [
        formatted(imports(node)),
        formatted(vec![version()]),
        formatted(sizes(node)),
        formatted(names(node)),
        formatted(wire::constants(node, fingerprint)),
        types(node),
        formatted(links(node, modules)),
        separate(wire::functions(node, modules)),
        separate(start(node)),
    ];
    groups.into_iter().filter(|group| !group.is_empty()).collect::<Vec<_>>().join("\n")
}

/// Each item on its own, with a line between them.
fn separate(items: Vec<TokenStream>) -> String {
    items.into_iter().map(|item| formatted(vec![item])).collect::<Vec<_>>().join("\n")
}

/// What is made here is a list of items; a mistake in it is one of this module, found by its first test.
pub fn formatted(items: Vec<TokenStream>) -> String {
    let tokens: TokenStream = items.into_iter().collect();
    let text = tokens.to_string();
    let file = syn::parse2(tokens).unwrap_or_else(|error| unreachable!("{error} in {text}"));
    prettyplease::unparse(&file)
}

/// Only what the file names: an unused import would be a warning.
fn imports(node: &Node) -> Vec<TokenStream> {
    let sizes = &node.sizes;
    let mut names = vec!["Bounds", "DpcProblem", "Model", "Stage", "Tables", reference_type(node)];
    names.extend((sizes.nc > 0).then_some("CouplingRow"));
    if sizes.nh > 0 {
        names.extend(["ChangingRow", "Member"]);
        // Where another one is in it.
        names.extend(node.changing.iter().any(|&h| node.changing_constraint(h).members.len() > 1).then_some("Import"));
    }
    names.extend((!node.neighbours.is_empty()).then_some("Link"));
    names.extend((!node.loads().is_empty()).then_some("LoadModel"));
    names.extend((sizes.ns + sizes.nq > 0).then_some("StageRow"));
    names.sort_unstable();
    let names = names.iter().map(|name| format_ident!("{name}"));
    let runtime = runtime(node);
    let tables = quote! { use #runtime::tables::{#(#names),*}; };
    let refused = (!node.neighbours.is_empty()).then_some("Refused");
    let planned = node.design.start.is_some().then_some("PlannedPoint");
    let used = planned.into_iter().chain(refused).chain(["Sender", "StartError"]).map(|name| format_ident!("{name}"));
    let used = quote! { use dpc_runtime::{#(#used),*}; };
    if node.design.start.is_none() {
        return vec![tables, used];
    }
    vec![quote! { use dpc_runtime::problem::Plan; }, tables, used]
}

fn version() -> TokenStream {
    let (major, minor) = RUNTIME;
    let message = format!("made for dpc-runtime {major}.{minor}");
    let (major, minor) = (Literal::u32_unsuffixed(major), Literal::u32_unsuffixed(minor));
    quote! { const _: () = assert!(dpc_runtime::fits(#major, #minor), #message); }
}

fn reference_type(node: &Node) -> &'static str {
    match node.problems().reference {
        ReferenceProblem::Clamp { .. } => "Clamp",
        ReferenceProblem::Nearest { .. } => "Nearest",
    }
}

fn sizes(node: &Node) -> Vec<TokenStream> {
    let sizes = &node.sizes;
    let all = [
        ("NX", "States.", sizes.nx),
        ("NU", "Inputs.", sizes.nu),
        ("NY", "Outputs.", sizes.ny),
        ("NZ", "Coupling outputs.", sizes.nz),
        ("NB", "Neighbours that this subsystem hears.", node.neighbours.len()),
        ("NI", "Imported coupling outputs.", sizes.ni),
        ("NJ", "Imported outputs, for coupling constraints.", sizes.nj),
        ("NC", "Coupling constraints on this subsystem.", sizes.nc),
        ("N", "Horizon, in steps.", sizes.n),
        ("NV", "Unknowns of the i-DPC problem.", sizes.nv),
        ("NR", "Rows of the i-DPC problem, of which:", sizes.nr),
        ("NT", "tube rows (35a),", sizes.nt),
        ("NS", "state rows (35c),", sizes.ns),
        ("NQ", "input rows (35d).", sizes.nq),
        ("NETWORK_NY", "Outputs of the whole network.", node.design.gains.calG.ncols()),
    ];
    let loads = [
        ("ND", "Loads: measured disturbances.", node.loads().len()),
        ("NETWORK_ND", "Loads of the whole network.", node.network_loads()),
    ];
    let changing = [("NH", "Coupling constraints whose rows are redrawn while running.", sizes.nh)];
    let loads = changing.into_iter().chain(loads).filter(|(_, _, value)| *value > 0);
    let count = |(name, doc, value)| constant(name, doc, quote!(usize), Literal::usize_unsuffixed(value));
    all.into_iter().chain(loads).map(count).collect()
}

fn names(node: &Node) -> Vec<TokenStream> {
    let model = node.model();
    let sample_time = Literal::f64_unsuffixed(node.design.network.sample_time);
    let list = |name, doc, size, names: Vec<String>| {
        let size = format_ident!("{size}");
        constant(name, doc, quote!([&str; #size]), quote!([#(#names),*]))
    };
    let mut names = vec![
        constant("SAMPLE_TIME", "Seconds per step.", real(node).to_token_stream(), sample_time),
        constant("NAME", "As the user wrote it.", quote!(&str), Literal::string(&model.name)),
        list("STATES", "Names of the states, with units.", "NX", labels(&model.states)),
        list("INPUTS", "Names of the inputs, with units.", "NU", labels(&model.inputs)),
        list("OUTPUTS", "Names of the outputs, with units.", "NY", labels(&model.outputs)),
        list("COUPLING_OUTPUTS", "What the neighbours hear.", "NZ", model.coupling_outputs.clone()),
    ];
    let loads = labels(&node.loads().signals);
    names.extend((!loads.is_empty()).then(|| list("LOADS", "Names of the loads, with units.", "ND", loads)));
    let fixed: Vec<_> = node.constraints.iter().map(|&h| node.constraint(h).name.clone()).collect();
    let doc = "Names of the coupling constraints: the first that the rows of a status count.";
    names.extend((!fixed.is_empty()).then(|| list("COUPLING", doc, "NC", fixed)));
    let changing: Vec<_> = node.changing.iter().map(|&h| node.changing_constraint(h).name.clone()).collect();
    let doc = "Names of the changing constraints: the rows of [`redraw`]; those of a status count on after the others.";
    names.extend((!changing.is_empty()).then(|| list("CHANGING", doc, "NH", changing)));
    names
}

fn constant(name: &str, doc: &str, ty: TokenStream, value: impl ToTokens) -> TokenStream {
    let (name, doc) = (format_ident!("{name}"), format!(" {doc}"));
    quote! { #[doc = #doc] pub const #name: #ty = #value; }
}

/// Written out, since one parameter per line would take a screen.
fn types(node: &Node) -> String {
    let (parameters, runtime) = (parameters(node), runtime(node).to_string().replace(' ', ""));
    format!(
        "/// Reference-output layer (28)-(31).\n\
         pub type Reference = {};\n\
         /// Type of [`TABLES`].\n\
         pub type Parts = Tables<Reference, {parameters}>;\n\
         /// What this node remembers from step to step.\n\
         pub type Controller = {runtime}::Controller<'static, Reference, {parameters}>;\n\
         /// Collects the neighbours' messages between two steps.\n\
         pub type Inbox = {runtime}::Inbox<NI, NJ, NB>;\n\
         /// What the neighbours hear, once per step.\n\
         pub type Message = {runtime}::Message<NY, NZ>;\n\
         /// What a step gives.\n\
         pub type Step = {runtime}::Step<NX, NU, NY, NZ, NB>;\n\
         /// A state and an input to start from.\n\
         pub type SteadyState = {runtime}::SteadyState<NX, NU>;\n{}{}",
        reference_parameters(node),
        if may_start(node) { STARTS } else { "" },
        [if node.loads().is_empty() { "" } else { LOADS }, if node.changing.is_empty() { "" } else { CHANGING }]
            .concat()
    )
}

const LOADS: &str = "\
/// The measured disturbances of this subsystem.
pub type Loads = dpc_runtime::Loads<'static, ND, NX, N>;
/// What they mean for one step.
pub type Load = dpc_runtime::Load<NX>;
";

const CHANGING: &str = "\
/// What all members of a changing constraint know at a step.
pub type Meeting<'a> = dpc_runtime::Meeting<'a, NY, NJ>;
/// A row of a changing constraint, as this subsystem sees it.
pub type HalfSpace = dpc_runtime::HalfSpace<NY, NJ>;
";

const STARTS: &str = "\
/// This node's part of a start-up plan.
pub type StartPlan<'a> = dpc_runtime::StartPlan<'a, NX, NU, NY, N>;
/// [`Controller`], for as long as its start-up plan lives.
pub type PlannedController<'a> = dpc_runtime::Controller<'a, Reference, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ>;
";

/// Of `dpc_runtime::Tables` and `dpc_runtime::Controller`, after the reference layer.
fn parameters(node: &Node) -> &'static str {
    match node.sizes.nh {
        0 => "NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ",
        _ => "NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ, NH",
    }
}

fn reference_parameters(node: &Node) -> String {
    match &node.problems().reference {
        ReferenceProblem::Clamp { .. } => "Clamp<NY, NC>".to_owned(),
        ReferenceProblem::Nearest { set, rate, .. } => format!("Nearest<NY, {}, {}, NC>", set.nrows(), rate.nrows()),
    }
}

fn links(node: &Node, modules: &[String]) -> Vec<TokenStream> {
    node.neighbours
        .iter()
        .enumerate()
        .map(|(slot, neighbour)| link(node, slot, neighbour, &modules[neighbour.j]))
        .collect()
}

/// `FROM_RIGHT`
fn link(node: &Node, slot: usize, neighbour: &Neighbour, module: &str) -> TokenStream {
    let other = node.other(neighbour);
    let name = format_ident!("{}", link_name(module));
    let doc = format!(" Where the messages of {} go: {}.", code(&other.name), imported(node, neighbour));
    let [ny, nz, slot, place] = [other.p(), other.nz(), slot, neighbour.j].map(Literal::usize_unsuffixed);
    let (z, y) = (option(neighbour.z), option(neighbour.y));
    quote! {
        #[doc = #doc]
        pub const #name: Link<#ny, #nz> =
            Link { slot: #slot, z: #z, y: #y, sender: Sender { design: DESIGN, place: #place } };
    }
}

/// Of the link to the neighbour in `module`.
pub fn link_name(module: &str) -> String {
    format!("FROM_{}", module.to_uppercase())
}

fn imported(node: &Node, neighbour: &Neighbour) -> String {
    let other = node.other(neighbour);
    let z = neighbour.z.iter().flat_map(|_| other.coupling_outputs.iter().cloned());
    let y = neighbour.y.iter().flat_map(|_| other.outputs.iter().map(labelled));
    z.chain(y).map(|name| code(&name)).collect::<Vec<_>>().join(", ")
}

fn option(first: Option<usize>) -> TokenStream {
    match first.map(Literal::usize_unsuffixed) {
        Some(first) => quote!(Some(#first)),
        None => quote!(None),
    }
}

/// The only functions of the file: the runtime's, with this subsystem's tables.
fn start(node: &Node) -> Vec<TokenStream> {
    let last = [starts::function(node), redraw(node)].into_iter().flatten();
    [steady_state(node), start_at(node)].into_iter().chain(last).collect()
}

/// Where there are changing constraints.
fn redraw(node: &Node) -> Option<TokenStream> {
    let function = quote! {
        /// Redraws the rows of all changing constraints, in the order of [`CHANGING`], by one rule: to be called at every step once
        /// the messages have arrived and before [`Controller::references`], or the whole step; and with the same rule by all
        /// members. A rule sees what they all know, yref at t + N - 1, and gives `None` where the row is to stay. For two robots
        /// that are to stay `apart` from each other:
        ///
        /// ```ignore
        /// let drawn = redraw(&mut controller, &inbox, |_, meeting| {
        ///     let pair = meeting.pair()?;
        ///     let normal = normal_between(&pair.first, &pair.second)?;
        ///     Some(pair.apart(&normal, apart))
        /// });
        /// ```
        ///
        /// # Errors
        /// Of each row that did not qualify, why: then the one before stays in force. See [`dpc_runtime::NotRedrawn`].
        pub fn redraw(
            controller: &mut Controller,
            inbox: &Inbox,
            rule: impl Fn(usize, &Meeting<'_>) -> Option<HalfSpace>,
        ) -> [Result<(), dpc_runtime::NotRedrawn>; NH] {
            core::array::from_fn(|row| controller.redraw(row, inbox, |meeting| rule(row, meeting)))
        }
    };
    (node.sizes.nh > 0).then_some(function)
}

fn steady_state(node: &Node) -> TokenStream {
    if is_sparse(node) {
        return sparse_steady_state(node);
    }
    let real = real(node);
    if node.network_loads() == 0 {
        return quote! {
            /// The state and input that this subsystem rests at when the outputs of the whole network rest at
            /// `outputs`, in the order of the columns of [`STEADY_X`].
            pub fn steady_state(outputs: &[#real; NETWORK_NY]) -> SteadyState {
                let at_rest = |row: &[#real; NETWORK_NY]| row.iter().zip(outputs).map(|(a, y)| a * y).sum();
                SteadyState { x: STEADY_X.each_ref().map(at_rest), u: STEADY_U.each_ref().map(at_rest) }
            }
        };
    }
    quote! {
        /// The state and input that this subsystem rests at when the outputs of the whole network rest at `outputs` under
        /// `loads`, in the order of the columns of [`STEADY_X`] and of [`STEADY_X_LOADS`].
        pub fn steady_state(outputs: &[#real; NETWORK_NY], loads: &[#real; NETWORK_ND]) -> SteadyState {
            let at_rest = |row: &[#real; NETWORK_NY]| row.iter().zip(outputs).map(|(a, y)| a * y).sum();
            let under = |row: &[#real; NETWORK_ND]| row.iter().zip(loads).map(|(a, d)| a * d).sum::<#real>();
            let mut steady = SteadyState { x: STEADY_X.each_ref().map(at_rest), u: STEADY_U.each_ref().map(at_rest) };
            steady.x.iter_mut().zip(&STEADY_X_LOADS).for_each(|(x, row)| *x += under(row));
            steady.u.iter_mut().zip(&STEADY_U_LOADS).for_each(|(u, row)| *u += under(row));
            steady
        }
    }
}

/// Whether the tables of steady states list the entries of their rows.
fn is_sparse(node: &Node) -> bool {
    matches!(node.design.gains.proof, Proof::Responses(_))
}

fn sparse_steady_state(node: &Node) -> TokenStream {
    let real = real(node);
    let sum =
        quote! { |row: &[(usize, #real)], values: &[#real]| row.iter().map(|(k, a)| a * values[*k]).sum::<#real>() };
    if node.network_loads() == 0 {
        return quote! {
            /// The state and input that this subsystem rests at when the outputs of the whole network rest at
            /// `outputs`, in the order of the modules.
            pub fn steady_state(outputs: &[#real; NETWORK_NY]) -> SteadyState {
                let sum = #sum;
                SteadyState { x: STEADY_X.map(|row| sum(row, outputs)), u: STEADY_U.map(|row| sum(row, outputs)) }
            }
        };
    }
    quote! {
        /// The state and input that this subsystem rests at when the outputs of the whole network rest at `outputs` under
        /// `loads`, both in the order of the modules.
        pub fn steady_state(outputs: &[#real; NETWORK_NY], loads: &[#real; NETWORK_ND]) -> SteadyState {
            let sum = #sum;
            let mut steady =
                SteadyState { x: STEADY_X.map(|row| sum(row, outputs)), u: STEADY_U.map(|row| sum(row, outputs)) };
            steady.x.iter_mut().zip(&STEADY_X_LOADS).for_each(|(x, row)| *x += sum(row, loads));
            steady.u.iter_mut().zip(&STEADY_U_LOADS).for_each(|(u, row)| *u += sum(row, loads));
            steady
        }
    }
}

/// `dpc_runtime`, or its part in single precision.
pub fn runtime(node: &Node) -> TokenStream {
    match node.scalar() {
        Scalar::Double => quote!(dpc_runtime),
        Scalar::Single => quote!(dpc_runtime::single),
    }
}

pub fn real(node: &Node) -> Ident {
    format_ident!("{}", node.scalar().name())
}

fn start_at(node: &Node) -> TokenStream {
    let noise = has_noise(node).then(|| quote!(.with_measurement_error(&TUBE_NOISE)));
    if !node.loads().is_empty() {
        return quote! {
            /// A controller whose references rest at `steady` under `loads`, its loads, and its first message to those who
            /// hear it.
            ///
            /// # Errors
            /// No controller can start there; see [`StartError`].
            pub fn start(steady: &SteadyState, loads: &[f64; ND]) -> Result<(Controller, Loads, Message), StartError> {
                let (loads, load) = Loads::start(&LOAD_MODEL, loads)?;
                let (controller, message) = Controller::start(&TABLES, steady)?;
                Ok((controller.under(&load) #noise, loads, message))
            }
        };
    }
    let started = match noise {
        None => quote! { Controller::start(&TABLES, steady) },
        Some(noise) => quote! {
            let (controller, message) = Controller::start(&TABLES, steady)?;
            Ok((controller #noise, message))
        },
    };
    quote! {
        /// A controller whose references rest at `steady`, and its first message to those who hear it.
        ///
        /// # Errors
        /// No controller can start there; see [`StartError`].
        pub fn start(steady: &SteadyState) -> Result<(Controller, Message), StartError> {
            #started
        }
    }
}
