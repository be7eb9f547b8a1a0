//! What `compiler/src/spec.rs` and `spec/scenario.rs` say: their structs, their fields, and the words above them.

use syn::{Attribute, Expr, ExprLit, Fields, GenericArgument, Item, Lit, Meta, PathArguments, Type};

/// A struct that a table of the file is read into.
pub struct Struct {
    pub name: String,
    pub doc: Doc,
    pub fields: Vec<Field>,
    /// It derives `Default`: the file may leave the table out.
    pub has_default: bool,
}

pub struct Field {
    pub name: String,
    pub doc: Doc,
    /// As written, without spaces.
    pub of_type: String,
}

/// A doc comment: its first paragraph, and the lines `Word: rest` after it.
pub struct Doc {
    pub about: String,
    notes: Vec<String>,
}

/// The structs of the Rust file `text`, in its order.
///
/// # Panics
/// The text is not Rust.
pub fn structs(text: &str) -> Vec<Struct> {
    let file = syn::parse_file(text).expect("the source of the compiler is Rust");
    let structs = file.items.into_iter().filter_map(|item| match item {
        Item::Struct(item) => Some(item),
        _ => None,
    });
    structs
        .map(|item| Struct {
            name: item.ident.to_string(),
            doc: Doc::new(&item.attrs),
            has_default: derives_default(&item.attrs),
            fields: fields(&item.fields),
        })
        .collect()
}

fn fields(fields: &Fields) -> Vec<Field> {
    let field = |field: &syn::Field| {
        let name = field.ident.as_ref()?.to_string();
        Some(Field { name, doc: Doc::new(&field.attrs), of_type: written(&field.ty) })
    };
    fields.iter().filter_map(field).collect()
}

impl Doc {
    fn new(attributes: &[Attribute]) -> Self {
        let text = attributes.iter().filter_map(line).map(|line| line.trim().to_owned()).collect::<Vec<_>>();
        let is_note = |line: &String| NOTES.iter().any(|note| line.starts_with(note));
        let (notes, about): (Vec<_>, Vec<_>) = text.into_iter().partition(is_note);
        let paragraph = about.iter().map(String::as_str).take_while(|line| !line.is_empty()).collect::<Vec<_>>();
        Self { about: paragraph.join(" ").replace("\\[", "[").replace("\\]", "]"), notes }
    }

    /// What follows `word` at the start of a line.
    pub fn note(&self, word: &str) -> Option<&str> {
        self.notes.iter().find_map(|note| note.strip_prefix(word)).map(str::trim)
    }

    pub fn has(&self, word: &str) -> bool {
        self.note(word).is_some()
    }
}

const NOTES: [&str; 8] = ["Key:", "One of:", "Default:", "Example:", "Required.", "Not a key:", "Only in:", "Or only:"];

fn line(attribute: &Attribute) -> Option<String> {
    let Meta::NameValue(pair) = &attribute.meta else { return None };
    let Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) = &pair.value else { return None };
    pair.path.is_ident("doc").then(|| text.value())
}

fn derives_default(attributes: &[Attribute]) -> bool {
    let mut found = false;
    for attribute in attributes.iter().filter(|attribute| attribute.path().is_ident("derive")) {
        let _ = attribute.parse_nested_meta(|meta| {
            found |= meta.path.is_ident("Default");
            Ok(())
        });
    }
    found
}

/// `Option<At<f64>>`
fn written(ty: &Type) -> String {
    match ty {
        Type::Path(path) => {
            let last = path.path.segments.last().expect("a path has a segment");
            match &last.arguments {
                PathArguments::AngleBracketed(inner) => {
                    let inner = inner.args.iter().map(argument).collect::<Vec<_>>();
                    format!("{}<{}>", last.ident, inner.join(","))
                }
                _ => last.ident.to_string(),
            }
        }
        Type::Tuple(tuple) => format!("({})", tuple.elems.iter().map(written).collect::<Vec<_>>().join(",")),
        _ => String::new(),
    }
}

fn argument(argument: &GenericArgument) -> String {
    match argument {
        GenericArgument::Type(ty) => written(ty),
        _ => String::new(),
    }
}
