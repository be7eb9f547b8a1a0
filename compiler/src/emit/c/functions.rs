//! The functions of a subsystem for C, in Rust.

use proc_macro2::{Ident, Literal, TokenStream};
use quote::{ToTokens, format_ident, quote};

use super::super::code::{formatted, header_with, real, runtime};
use super::super::names::one_line;
use super::super::node::Node;
use super::super::starts::may_start;
use super::words::{Words, c_string};
use crate::design::Design;

/// `src/lib.rs`
pub fn root(design: &Design, words: &Words, modules: &[String], nodes: &[Node]) -> String {
    let mods: Vec<Ident> = modules.iter().map(|module| format_ident!("{module}")).collect();
    let entries = nodes.iter().zip(&mods).flat_map(|(node, module)| {
        let plan = if may_start(node) { quote!(size_of::<Held<functions::#module::Plan>>()) } else { quote!(0) };
        [quote!(size_of::<Held<functions::#module::Memory>>()), plan]
    });
    let (sizes, count) = (format_ident!("{}_sizes", words.network), Literal::usize_unsuffixed(2 * modules.len()));
    let (fingerprint, first) = (format_ident!("{}_design", words.network), mods.first());
    let items = quote! {
        use crate::address::Held;
        #[cfg(feature = "panic-handler")]
        extern crate dpc_panic as _;
        #[cfg(feature = "std")]
        extern crate std as _;
        mod address;
        mod codes;
        pub mod controllers;
        /// What C calls, by subsystem.
        pub mod functions {
            #(#[allow(unused, reason = "a subsystem uses the part that it needs")] pub mod #mods;)*
        }
        /// Bytes of the structures in the headers: per subsystem that of the controller, then that of the start-up plan or 0.
        #[unsafe(no_mangle)]
        #[allow(non_upper_case_globals, reason = "a name in C")]
        pub static #sizes: [usize; #count] = [#(#entries),*];
        /// The design's fingerprint, which messages carry.
        #[unsafe(no_mangle)]
        pub extern "C" fn #fingerprint() -> u64 {
            controllers::#first::DESIGN
        }
    };
    let what = format!("C interface of the controllers of network `{}`", design.network.name);
    format!("{}\n#![no_std]\n\n{}", header_with(design, &what, OPTION), spaced(items))
}

/// `src/functions/<module>.rs`
pub fn file(node: &Node, module: &str, prefix: &str) -> String {
    let what = format!("What C calls of subsystem `{}` of network `{}`", node.model().name, node.design.network.name);
    let file = File { node, prefix, real: real(node) };
    let mut groups = vec![file.imports(module), file.memory()];
    groups.extend([file.size(), file.steady_state(), file.start()]);
    groups.extend(may_start(node).then(|| file.plans()));
    groups.extend((!node.neighbours.is_empty()).then(|| file.messages()));
    groups.extend((node.sizes.nh > 0).then(|| file.changing()));
    groups.extend([file.step(), file.telemetry(), file.names()]);
    let text: Vec<String> = groups.into_iter().map(spaced).collect();
    format!("{}\n{}", header_with(node.design, &what, OPTION), text.join("\n"))
}

/// Of the command that makes these files.
const OPTION: &str = "--emit c";

/// With a line between items, but for `use` and `mod`.
fn spaced(items: TokenStream) -> String {
    let file: syn::File = syn::parse2(items).unwrap_or_else(|error| unreachable!("{error}"));
    let is_short = |item: &syn::Item| {
        matches!(item, syn::Item::Use(_) | syn::Item::Mod(_) | syn::Item::ExternCrate(_) | syn::Item::Type(_))
    };
    let mut text = String::new();
    for (k, item) in file.items.iter().enumerate() {
        let apart = k > 0 && !(is_short(item) && is_short(&file.items[k - 1]));
        text += if apart { "\n" } else { "" };
        text += &formatted(vec![item.to_token_stream()]);
    }
    text
}

struct File<'a> {
    node: &'a Node<'a>,
    prefix: &'a str,
    real: Ident,
}

impl File<'_> {
    fn name(&self, verb: &str) -> Ident {
        format_ident!("{}_{verb}", self.prefix)
    }

    fn loads(&self) -> bool {
        !self.node.loads().is_empty()
    }

    /// `loads: In<[f64; ND]>,`
    fn loads_argument(&self) -> Option<TokenStream> {
        let real = &self.real;
        self.loads().then(|| quote!(loads: In<[#real; ND]>,))
    }

    fn imports(&self, module: &str) -> TokenStream {
        let (module, runtime, real) = (format_ident!("{module}"), runtime(self.node), &self.real);
        quote! {
            use crate::address::{Held, In, Many, Out, Place, Tagged};
            use crate::codes::{self, Refusal, finish, finish_at};
            use crate::controllers::#module::*;
            use core::ffi::{CStr, c_char};
            use dpc_runtime::{Control, Delivery};
            use #runtime as runtime;

            type Real = #real;
            type Telemetry = runtime::Telemetry<NX, NU, NY>;
        }
    }

    /// What the structure in the header holds.
    fn memory(&self) -> TokenStream {
        let loads = self.loads();
        let field = loads.then(|| quote!(loads: Loads,));
        let (argument, given) = if loads { (Some(quote!(loads: Loads,)), Some(quote!(loads,))) } else { (None, None) };
        let tag = Literal::u64_unsuffixed(self.node.i as u64 + 1);
        let measured = loads.then(|| quote!(loads: &[Real; ND],));
        let references = if loads {
            quote! {
                let load = self.loads.admit(loads);
                let next = self.controller.references_under(set_point, &load, &mut self.inbox);
            }
        } else {
            quote! { let next = self.controller.references(set_point, &mut self.inbox); }
        };
        quote! {
            /// What the structure of the header holds.
            pub struct Memory {
                controller: Controller,
                inbox: Inbox,
                #field
                /// Of this period, until it ends.
                control: Option<Control>,
                status: codes::Status,
                deliveries: [Delivery; NB],
                telemetry: Telemetry,
            }

            impl Tagged for Memory {
                const TAG: u64 = DESIGN.rotate_left(1) ^ #tag;
            }

            impl Memory {
                fn new(controller: Controller, #argument) -> Self {
                    Self {
                        controller,
                        inbox: Inbox::new(),
                        #given
                        control: None,
                        status: codes::Status::NONE,
                        deliveries: [Delivery::Missing; NB],
                        telemetry: Telemetry {
                            x_ref: [0.0; NX],
                            u_ref: [0.0; NU],
                            y_ref: [0.0; NY],
                            x_nom: [0.0; NX],
                            u_nom: [0.0; NU],
                        },
                    }
                }

                fn input(&mut self, x: &[Real; NX]) -> [Real; NU] {
                    let now = self.controller.input(x);
                    self.status = codes::Status::of_input(&now.control, self.controller.is_degraded());
                    self.control = Some(now.control);
                    self.telemetry = now.telemetry;
                    now.input
                }

                fn references(&mut self, set_point: &[Real; NY], #measured) -> [u8; MESSAGE_BYTES] {
                    #references
                    let now = self.control.take();
                    let begun = if now.is_some() { self.status } else { codes::Status::NONE };
                    self.status = begun.with_references(&dpc_runtime::Status {
                        control: now.unwrap_or(Control::NotFinite),
                        references: next.references,
                        deliveries: next.deliveries,
                        certified: next.certified,
                        load_within: next.load_within,
                        degraded: self.controller.is_degraded(),
                    });
                    self.deliveries = next.deliveries;
                    to_bytes(&next.message)
                }
            }
        }
    }

    fn size(&self) -> TokenStream {
        let (size, plan_size) = (self.name("size"), self.name("plan_size"));
        let plan = may_start(self.node).then(|| {
            quote! {
                #[unsafe(no_mangle)]
                pub extern "C" fn #plan_size() -> usize {
                    size_of::<Held<Plan>>()
                }
            }
        });
        quote! {
            #[unsafe(no_mangle)]
            pub extern "C" fn #size() -> usize {
                size_of::<Held<Memory>>()
            }
            #plan
        }
    }

    fn steady_state(&self) -> TokenStream {
        let name = self.name("steady_state");
        let loaded = self.node.network_loads() > 0;
        let (argument, given) = if loaded {
            (Some(quote!(loads: In<[Real; NETWORK_ND]>,)), Some(quote!(, &loads.get()?)))
        } else {
            (None, None)
        };
        quote! {
            #[unsafe(no_mangle)]
            pub extern "C" fn #name(
                outputs: In<[Real; NETWORK_NY]>,
                #argument
                x: Out<[Real; NX]>,
                u: Out<[Real; NU]>,
            ) -> i32 {
                finish(|| {
                    let steady = steady_state(&outputs.get()? #given);
                    let (x, u) = (x.ready()?, u.ready()?);
                    x.put(steady.x);
                    u.put(steady.u);
                    Ok(())
                })
            }
        }
    }

    /// `start(..)?` and what comes of it.
    fn made(&self, call: TokenStream) -> TokenStream {
        if self.loads() {
            quote! {
                let (made, loads, first) = #call?;
                place.make(Memory::new(made, loads));
            }
        } else {
            quote! {
                let (made, first) = #call?;
                place.make(Memory::new(made));
            }
        }
    }

    fn start(&self) -> TokenStream {
        let (name, loads) = (self.name("start"), self.loads_argument());
        let call = if self.loads() { quote!(start(&steady, &loads.get()?)) } else { quote!(start(&steady)) };
        let made = self.made(call);
        quote! {
            #[unsafe(no_mangle)]
            pub extern "C" fn #name(
                controller: Place<Memory>,
                size: usize,
                x: In<[Real; NX]>,
                u: In<[Real; NU]>,
                #loads
                message: Out<[u8; MESSAGE_BYTES]>,
                which: Out<i32>,
            ) -> i32 {
                finish_at(which, || {
                    let (place, message) = (controller.fits(size)?, message.ready()?);
                    let steady = SteadyState { x: x.get()?, u: u.get()? };
                    #made
                    message.put(to_bytes(&first));
                    Ok(())
                })
            }
        }
    }

    fn plans(&self) -> TokenStream {
        let (name, plan_name, loads) = (self.name("start_planned"), self.name("plan"), self.loads_argument());
        let call = if self.loads() {
            quote!(start_planned(&plan.look()?.0, &loads.get()?, &x.get()?))
        } else {
            quote!(start_planned(&plan.look()?.0, &x.get()?))
        };
        let (made, stated) = (self.made(call), self.stated());
        let tag = Literal::u64_unsuffixed(self.node.i as u64 + 1);
        quote! {
            /// What the structure of the header for start-up plans holds.
            pub struct Plan(StartPlan<'static>);

            impl Tagged for Plan {
                const TAG: u64 = !DESIGN.rotate_left(1) ^ #tag;
            }

            #stated

            #[unsafe(no_mangle)]
            pub extern "C" fn #plan_name(
                plan: Place<Plan>,
                size: usize,
                number: u32,
                points: Many<runtime::PlannedPoint<NX, NU>>,
                count: usize,
                e: In<[Real; NY]>,
                dx: In<[Real; NX]>,
                du: In<[[Real; NU]; N]>,
            ) -> i32 {
                finish(|| {
                    let place = plan.fits(size)?;
                    let nominal = runtime::problem::Plan { dx: dx.get()?, du: du.get()? };
                    let (points, e) = (points.get(count)?, e.get()?);
                    let design = TABLES.fingerprint();
                    place.make(Plan(StartPlan { design, plan: number, points, e, nominal }));
                    Ok(())
                })
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn #name(
                controller: Place<Memory>,
                size: usize,
                plan: Place<Plan>,
                #loads
                x: In<[Real; NX]>,
                message: Out<[u8; MESSAGE_BYTES]>,
                which: Out<i32>,
            ) -> i32 {
                finish_at(which, || {
                    let (place, message) = (controller.fits(size)?, message.ready()?);
                    #made
                    message.put(to_bytes(&first));
                    Ok(())
                })
            }
        }
    }

    /// The plan for the start that the file states.
    fn stated(&self) -> Option<TokenStream> {
        let (name, state) = (self.name("stated_plan"), self.name("stated_start"));
        let loads =
            self.loads().then(|| (quote!(, loads: Out<[Real; ND]>), quote! { loads.ready()?.put(START_LOADS); }));
        let (argument, put) = loads.unzip();
        let stated = quote! {
            static STATED: Held<Plan> = Held::new(Plan(START));

            #[unsafe(no_mangle)]
            pub extern "C" fn #name() -> *const core::ffi::c_void {
                (&raw const STATED).cast()
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn #state(x: Out<[Real; NX]> #argument) -> i32 {
                finish(|| {
                    let x = x.ready()?;
                    #put
                    x.put(START_X);
                    Ok(())
                })
            }
        };
        self.node.design.start.is_some().then_some(stated)
    }

    fn messages(&self) -> TokenStream {
        let (accept, delivery) = (self.name("accept"), self.name("delivery"));
        quote! {
            #[unsafe(no_mangle)]
            pub extern "C" fn #accept(controller: Place<Memory>, bytes: Many<u8>, length: usize) -> i32 {
                finish(|| Ok(accept_bytes(&mut controller.get()?.inbox, bytes.get(length)?)?))
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn #delivery(controller: Place<Memory>, neighbour: u32, code: Out<i32>, step: Out<i64>) -> i32 {
                finish(|| {
                    let deliveries = &controller.look()?.deliveries;
                    let known = usize::try_from(neighbour).ok().and_then(|slot| deliveries.get(slot));
                    let (told, of_step) = codes::delivery(*known.ok_or(Refusal::NO_SUCH_NEIGHBOUR)?);
                    let (code, step) = (code.ready()?, step.wanted()?);
                    code.put(told);
                    if let Some(step) = step {
                        step.put(of_step);
                    }
                    Ok(())
                })
            }
        }
    }

    fn changing(&self) -> TokenStream {
        let (meeting, redraw) = (self.name("meeting"), self.name("redraw"));
        quote! {
            #[unsafe(no_mangle)]
            pub extern "C" fn #meeting(controller: Place<Memory>, row: u32, outputs: Out<Real>, length: usize) -> i32 {
                finish(|| {
                    let (memory, outputs) = (controller.look()?, outputs.ready()?);
                    let row = usize::try_from(row).map_err(|_| Refusal::NO_SUCH_ROW)?;
                    memory.controller.meet(row, &memory.inbox, |meeting| {
                        let count: usize = meeting.outputs().map(<[Real]>::len).sum();
                        if count != length {
                            return Err(Refusal::LENGTH);
                        }
                        outputs.put_all(length, meeting.outputs().flatten());
                        Ok(())
                    })?
                })
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn #redraw(
                controller: Place<Memory>,
                row: u32,
                normal: Many<Real>,
                length: usize,
                limit: Real,
                which: Out<i32>,
            ) -> i32 {
                finish_at(which, || {
                    let (memory, normal) = (controller.get()?, normal.get(length)?);
                    let row = usize::try_from(row).map_err(|_| Refusal::NO_SUCH_ROW)?;
                    let fits = memory.controller.meet(row, &memory.inbox, |meeting| meeting.below(normal, limit).is_some())?;
                    if !fits {
                        return Err(Refusal::LENGTH);
                    }
                    Ok(memory.controller.redraw(row, &memory.inbox, |meeting| meeting.below(normal, limit))?)
                })
            }
        }
    }

    fn step(&self) -> TokenStream {
        let [step, input, references] = ["step", "input", "references"].map(|verb| self.name(verb));
        let loads = self.loads_argument();
        let (given, read) = if self.loads() {
            (Some(quote!(&loads)), Some(quote! { let loads = loads.get()?; }))
        } else {
            (None, None)
        };
        quote! {
            #[unsafe(no_mangle)]
            pub extern "C" fn #step(
                controller: Place<Memory>,
                x: In<[Real; NX]>,
                set_point: In<[Real; NY]>,
                #loads
                input: Out<[Real; NU]>,
                message: Out<[u8; MESSAGE_BYTES]>,
                status: Out<codes::Status>,
            ) -> i32 {
                finish(|| {
                    let (memory, x, set_point) = (controller.get()?, x.get()?, set_point.get()?);
                    #read
                    let (input, message, status) = (input.ready()?, message.ready()?, status.wanted()?);
                    input.put(memory.input(&x));
                    message.put(memory.references(&set_point, #given));
                    if let Some(status) = status {
                        status.put(memory.status);
                    }
                    Ok(())
                })
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn #input(
                controller: Place<Memory>,
                x: In<[Real; NX]>,
                input: Out<[Real; NU]>,
                status: Out<codes::Status>,
            ) -> i32 {
                finish(|| {
                    let (memory, x) = (controller.get()?, x.get()?);
                    let (input, status) = (input.ready()?, status.wanted()?);
                    input.put(memory.input(&x));
                    if let Some(status) = status {
                        status.put(memory.status);
                    }
                    Ok(())
                })
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn #references(
                controller: Place<Memory>,
                set_point: In<[Real; NY]>,
                #loads
                message: Out<[u8; MESSAGE_BYTES]>,
                status: Out<codes::Status>,
            ) -> i32 {
                finish(|| {
                    let (memory, set_point) = (controller.get()?, set_point.get()?);
                    #read
                    let (message, status) = (message.ready()?, status.wanted()?);
                    message.put(memory.references(&set_point, #given));
                    if let Some(status) = status {
                        status.put(memory.status);
                    }
                    Ok(())
                })
            }
        }
    }

    fn telemetry(&self) -> TokenStream {
        let name = self.name("telemetry");
        let signals = ["x_ref", "u_ref", "y_ref", "x_nom", "u_nom"].map(|name| format_ident!("{name}"));
        let sizes = ["NX", "NU", "NY", "NX", "NU"].map(|name| format_ident!("{name}"));
        quote! {
            #[unsafe(no_mangle)]
            pub extern "C" fn #name(controller: Place<Memory>, #(#signals: Out<[Real; #sizes]>),*) -> i32 {
                finish(|| {
                    let telemetry = controller.look()?.telemetry;
                    #(let #signals = #signals.wanted()?;)*
                    #(if let Some(place) = #signals { place.put(telemetry.#signals); })*
                    Ok(())
                })
            }
        }
    }

    fn names(&self) -> TokenStream {
        let rows = self.node.problems().dpc.rows.iter().map(|row| row.name.clone()).collect();
        let fixed = self.node.constraints.iter().map(|&h| self.node.constraint(h).name.clone());
        let changing = self.node.changing.iter().map(|&h| self.node.changing_constraint(h).name.clone());
        let constraints: Vec<String> = fixed.chain(changing).collect();
        let constraints = (!constraints.is_empty()).then(|| self.list("constraint_name", constraints));
        let rows = self.list("row_name", rows);
        quote! { #rows #constraints }
    }

    fn list(&self, verb: &str, names: Vec<String>) -> TokenStream {
        let name = self.name(verb);
        let names = names.iter().map(|name| {
            let literal = format!("c{}", c_string(&one_line(name)));
            literal.parse::<TokenStream>().unwrap_or_else(|error| unreachable!("{error} in {literal}"))
        });
        quote! {
            #[unsafe(no_mangle)]
            pub extern "C" fn #name(row: u32) -> *const c_char {
                const NAMES: &[&CStr] = &[#(#names),*];
                codes::text(NAMES, row)
            }
        }
    }
}
