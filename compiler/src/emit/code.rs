//! The first half of an emitted file: sizes, names, types and links.

use proc_macro2::{Literal, TokenStream};
use quote::{ToTokens, format_ident, quote};

use super::names::{code, one_line};
use super::node::{Neighbour, Node, labelled, labels};
use crate::design::Design;
use crate::problems::ReferenceProblem;

/// Version of the runtime whose tables the emitted files fill: major, minor.
const RUNTIME: (u32, u32) = (0, 1);

/// `//` lines: what made the file, out of which file, how to make it again. An inner doc comment could not be included.
pub fn header(design: &Design, what: &str) -> String {
    let (file, folder) = (source_file(design), super::package_folder(&design.network));
    let (major, minor) = RUNTIME;
    format!(
        "// {}. Written by dpc-codegen {} from {file}; do not edit. To make it again:\n\
         //\n\
         //     dpc-codegen {file} --out {folder}\n\
         //\n\
         // Fits dpc-runtime {major}.{minor}. Numbers are in the units of {file}, as deviations from its operating point.\n",
        one_line(what),
        env!("CARGO_PKG_VERSION"),
    )
}

/// Name of the file the network was read from, without its folders: these differ between machines.
fn source_file(design: &Design) -> String {
    let path = &design.network.source.path;
    one_line(path.rsplit(['/', '\\']).next().unwrap_or(path))
}

/// The half, formatted, without the header.
pub fn text(node: &Node, modules: &[String]) -> String {
    let groups = [imports(node), sizes(node), names(node), types(node), links(node, modules), start()];
    let groups = groups.map(|tokens| formatted(tokens.into_iter().collect()));
    groups.into_iter().filter(|group| !group.is_empty()).collect::<Vec<_>>().join("\n")
}

/// What is made here is a list of items; a mistake in it is one of this module, found by its first test.
fn formatted(tokens: TokenStream) -> String {
    let text = tokens.to_string();
    let file = syn::parse2(tokens).unwrap_or_else(|error| unreachable!("{error} in {text}"));
    prettyplease::unparse(&file)
}

/// Only what the file names: an unused import would be a warning.
fn imports(node: &Node) -> Vec<TokenStream> {
    let sizes = &node.sizes;
    let mut names = vec!["DpcProblem", "Model", "Tables", reference_type(node)];
    names.extend((sizes.nc > 0).then_some("CouplingRow"));
    names.extend((!node.neighbours.is_empty()).then_some("Link"));
    names.extend((sizes.ns + sizes.nq > 0).then_some("StageRow"));
    names.sort_unstable();
    let names = names.iter().map(|name| format_ident!("{name}"));
    let (major, minor) = (Literal::u32_unsuffixed(RUNTIME.0), Literal::u32_unsuffixed(RUNTIME.1));
    vec![
        quote! { use dpc_runtime::StartError; },
        quote! { use dpc_runtime::linear::times; },
        quote! { use dpc_runtime::tables::{#(#names),*}; },
        quote! { const _: () = assert!(dpc_runtime::fits(#major, #minor), "made for another version of dpc-runtime"); },
    ]
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
    all.map(|(name, doc, value)| constant(name, doc, quote!(usize), Literal::usize_unsuffixed(value))).into()
}

fn names(node: &Node) -> Vec<TokenStream> {
    let model = node.model();
    let sample_time = Literal::f64_unsuffixed(node.design.network.sample_time);
    let list = |name, doc, size, names: Vec<String>| {
        let size = format_ident!("{size}");
        constant(name, doc, quote!([&str; #size]), quote!([#(#names),*]))
    };
    let rows = node.problems().dpc.rows.iter().map(|row| row.name.clone()).collect();
    vec![
        constant("SAMPLE_TIME", "Seconds per step.", quote!(f64), sample_time),
        constant("NAME", "As the user wrote it.", quote!(&str), Literal::string(&model.name)),
        list("STATES", "Names of the states, with units.", "NX", labels(&model.states)),
        list("INPUTS", "Names of the inputs, with units.", "NU", labels(&model.inputs)),
        list("OUTPUTS", "Names of the outputs, with units.", "NY", labels(&model.outputs)),
        list("COUPLING_OUTPUTS", "What the neighbours hear.", "NZ", model.coupling_outputs.clone()),
        list("ROWS", "What each row of the i-DPC problem asks, for reports and logs.", "NR", rows),
    ]
}

fn constant(name: &str, doc: &str, ty: TokenStream, value: impl ToTokens) -> TokenStream {
    let (name, doc) = (format_ident!("{name}"), format!(" {doc}"));
    quote! { #[doc = #doc] pub const #name: #ty = #value; }
}

fn types(node: &Node) -> Vec<TokenStream> {
    let alias = |name: &str, doc: &str, ty: TokenStream| {
        let (name, doc) = (format_ident!("{name}"), format!(" {doc}"));
        quote! { #[doc = #doc] pub type #name = #ty; }
    };
    vec![
        alias("Reference", "Reference-output layer (28)-(31).", reference_parameters(node)),
        alias(
            "Parts",
            "Type of [`TABLES`].",
            quote!(Tables<Reference, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ>),
        ),
        alias(
            "Controller",
            "What this node remembers from step to step.",
            quote!(dpc_runtime::Controller<'static, Reference, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ>),
        ),
        alias("Inbox", "Collects the neighbours' messages between two steps.", quote!(dpc_runtime::Inbox<NI, NJ, NB>)),
        alias("Message", "What the neighbours hear, once per step.", quote!(dpc_runtime::Message<NY, NZ>)),
        alias("Step", "What a step gives.", quote!(dpc_runtime::Step<NX, NU, NY, NZ, NB>)),
        alias("SteadyState", "A state and an input to start from.", quote!(dpc_runtime::SteadyState<NX, NU>)),
    ]
}

fn reference_parameters(node: &Node) -> TokenStream {
    match &node.problems().reference {
        ReferenceProblem::Clamp { .. } => quote!(Clamp<NY, NC>),
        ReferenceProblem::Nearest { set, rate, .. } => {
            let [facets, rates] = [set.nrows(), rate.nrows()].map(Literal::usize_unsuffixed);
            quote!(Nearest<NY, #facets, #rates, NC>)
        }
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
    let name = format_ident!("FROM_{}", module.to_uppercase());
    let doc = format!(" Where the messages of {} go: {}.", code(&other.name), imported(node, neighbour));
    let [ny, nz, slot] = [other.p(), other.nz(), slot].map(Literal::usize_unsuffixed);
    let (z, y) = (option(neighbour.z), option(neighbour.y));
    quote! { #[doc = #doc] pub const #name: Link<#ny, #nz> = Link { slot: #slot, z: #z, y: #y }; }
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
fn start() -> Vec<TokenStream> {
    vec![
        quote! {
            /// The state and input that this subsystem rests at when the outputs of the whole network rest at
            /// `outputs`, in the order of the columns of [`STEADY_X`].
            pub fn steady_state(outputs: &[f64; NETWORK_NY]) -> SteadyState {
                let (x, u) = (times(&STEADY_X, outputs), times(&STEADY_U, outputs));
                SteadyState { x, u }
            }
        },
        quote! {
            /// A controller whose references rest at `steady`, and its first message to those who hear it.
            ///
            /// # Errors
            /// No controller can start there; see [`StartError`].
            pub fn start(steady: &SteadyState) -> Result<(Controller, Message), StartError> {
                Controller::start(&TABLES, steady)
            }
        },
    ]
}
