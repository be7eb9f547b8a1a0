//! Messages as bytes: what an emitted file says of them, and the functions for it.

use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::code::link_name;
use super::names::code;
use super::node::{Node, labelled};
use crate::design::Design;

/// A part of a subsystem's message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MessagePart {
    /// First byte, and how many there are.
    pub first: usize,
    pub bytes: usize,
    /// `u8`, ..., `f64`; little-endian.
    pub ty: &'static str,
    /// What it is, in words, with the value where that is always the same.
    pub what: String,
}

/// The messages of subsystem `i`, byte by byte, as `dpc_runtime` writes them.
pub fn message_layout(design: &Design, i: usize) -> Vec<MessagePart> {
    parts(&Node::new(design, i))
}

pub fn parts(node: &Node) -> Vec<MessagePart> {
    let real = node.scalar();
    let (ny, nz) = (node.sizes.ny, node.sizes.nz);
    let mut parts = Vec::new();
    let mut part = |bytes: usize, ty, what: String| {
        let first = parts.last().map_or(0, |part: &MessagePart| part.first + part.bytes);
        parts.push(MessagePart { first, bytes, ty, what });
    };
    part(1, "u8", format!("version of this layout: {}", dpc_runtime::LAYOUT));
    part(1, "u8", format!("bytes per number: {}", real.bytes()));
    part(2, "u16", "bit 0: the sender's step is certified; all others 0".to_owned());
    part(4, "u32", format!("place of the sender in the network: {}", node.i));
    part(8, "u64", "fingerprint of the network's design".to_owned());
    part(8, "i64", "step, -1 for the message of the start".to_owned());
    part(4, "u32", "number of the start-up plan; 0: none".to_owned());
    part(2, "u16", format!("number of outputs: {ny}"));
    part(2, "u16", format!("number of coupling outputs: {nz}"));
    node.model()
        .outputs
        .iter()
        .for_each(|y| part(real.bytes(), real.name(), format!("yref of {}", code(&labelled(y)))));
    node.model().coupling_outputs.iter().for_each(|z| part(real.bytes(), real.name(), format!("zref of {}", code(z))));
    parts
}

/// Bytes of a message.
pub fn length(node: &Node) -> usize {
    parts(node).last().map_or(0, |part| part.first + part.bytes)
}

/// `DESIGN`, `SENDER`, `MESSAGE_BYTES`; `design` is the network's fingerprint.
pub fn constants(node: &Node, design: u64) -> Vec<TokenStream> {
    let word: Literal = format!("0x{design:016x}").parse().unwrap_or_else(|_| unreachable!("digits are a literal"));
    let (place, length) = (Literal::usize_unsuffixed(node.i), Literal::usize_unsuffixed(length(node)));
    let table = parts(node);
    let head = [
        " Length of a message of this subsystem as bytes, see [`to_bytes`]; little-endian:",
        "",
        " | bytes | type | |",
        " |---|---|---|",
    ];
    let doc = head.map(str::to_owned).into_iter().chain(table.iter().map(MessagePart::row));
    vec![
        quote! {
            /// Fingerprint of the whole network's design. Controllers of any other refuse this one's messages, and this one theirs.
            pub const DESIGN: u64 = #word;
        },
        quote! {
            /// Whose messages these are: of the subsystem at this place in the network, counted from 0.
            pub const SENDER: Sender = Sender { design: DESIGN, place: #place };
        },
        quote! { #(#[doc = #doc])* pub const MESSAGE_BYTES: usize = #length; },
    ]
}

/// `to_bytes`, and `accept_bytes` where there is somebody to hear.
pub fn functions(node: &Node, modules: &[String]) -> Vec<TokenStream> {
    let write = quote! {
        /// The message as bytes, for all who hear it.
        pub fn to_bytes(message: &Message) -> [u8; MESSAGE_BYTES] {
            message.to_bytes(&SENDER)
        }
    };
    let arm = |neighbour: &super::node::Neighbour| {
        let (place, link) =
            (Literal::usize_unsuffixed(neighbour.j), format_ident!("{}", link_name(&modules[neighbour.j])));
        quote! { #place => inbox.accept_bytes(&#link, bytes), }
    };
    let arms = node.neighbours.iter().map(arm);
    let read = quote! {
        /// Files a message that came as bytes, whichever neighbour it is from.
        ///
        /// # Errors
        /// The bytes are no message of a neighbour in the same design, or it is out of sequence or not finite; see [`Refused`].
        pub fn accept_bytes(inbox: &mut Inbox, bytes: &[u8]) -> Result<(), Refused> {
            match Sender::place_in(bytes)? {
                #(#arms)*
                _ => Err(SENDER.stranger(bytes)),
            }
        }
    };
    if node.neighbours.is_empty() { vec![write] } else { vec![write, read] }
}

impl MessagePart {
    /// Of a table in Markdown.
    fn row(&self) -> String {
        format!(" | {} | {} | {} |", self.place(), self.ty, self.what.replace('|', "/"))
    }

    /// `0`, `2, 3` or `4 to 7`.
    pub fn place(&self) -> String {
        let last = self.first + self.bytes - 1;
        match self.bytes {
            1 => self.first.to_string(),
            2 => format!("{}, {last}", self.first),
            _ => format!("{} to {last}", self.first),
        }
    }
}
