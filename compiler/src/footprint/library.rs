//! A static library as a graph: sections, and what they refer to.

use std::collections::{BTreeMap, HashMap};

use object::read::archive::ArchiveFile;
use object::{
    Architecture, File, Object, ObjectSection, ObjectSymbol, RelocationTarget, SectionIndex, SectionKind, SymbolIndex,
};

/// All objects of the library together. Every function has a section of its own, as rustc makes them.
pub struct Library {
    pub sections: Vec<Section>,
    /// The section of each name that other objects may use.
    pub defined: BTreeMap<String, usize>,
    sizes: BTreeMap<String, u64>,
    /// What a call puts on the stack before the function has begun.
    pub return_address: u64,
}

pub struct Section {
    /// Of a function in it, as the linker knows it, or the section's own.
    pub name: String,
    pub kind: Kind,
    pub bytes: u64,
    /// Of the function in it; of the largest, where there are several.
    pub stack: Option<u64>,
    pub refers: Vec<Reference>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Code,
    Constant,
    Variable,
}

pub enum Reference {
    Section(usize),
    /// A name that no object of the library has.
    Foreign(String),
}

/// Where the sections of one object are among all.
type Places = HashMap<SectionIndex, usize>;

impl Library {
    /// # Errors
    /// The file is no archive of objects.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        let mut library =
            Self { sections: Vec::new(), defined: BTreeMap::new(), sizes: BTreeMap::new(), return_address: 0 };
        let objects = objects(bytes).map_err(|error| error.to_string())?;
        let places: Vec<Places> = objects.iter().map(|object| library.define(object)).collect();
        for (object, places) in objects.iter().zip(&places) {
            library.refer(object, places);
            library.stacks(object, places)?;
        }
        let architecture = objects.first().map(Object::architecture);
        library.return_address = match architecture {
            Some(Architecture::X86_64 | Architecture::X86_64_X32) => 8,
            Some(Architecture::I386) => 4,
            // In a register, which who needs it saves in its own frame.
            _ => 0,
        };
        Ok(library)
    }

    /// Bytes of a variable.
    pub fn size(&self, name: &str) -> Option<u64> {
        self.sizes.get(name).copied()
    }

    /// Adds the sections of an object, and the names in them.
    fn define(&mut self, object: &File) -> Places {
        let mut places = Places::new();
        for section in object.sections() {
            let Some(kind) = kind(section.kind()) else { continue };
            places.insert(section.index(), self.sections.len());
            let name = section.name().unwrap_or_default().to_owned();
            self.sections.push(Section { name, kind, bytes: section.size(), stack: None, refers: Vec::new() });
        }
        for symbol in object.symbols().filter(ObjectSymbol::is_definition) {
            let place = symbol.section_index().and_then(|index| places.get(&index));
            let (Some(&place), Ok(name)) = (place, symbol.name()) else { continue };
            if symbol.is_global() {
                self.sizes.insert(name.to_owned(), symbol.size());
                if !symbol.is_weak() || !self.defined.contains_key(name) {
                    self.defined.insert(name.to_owned(), place);
                }
            }
            if symbol.kind() == object::SymbolKind::Text {
                self.sections[place].name = name.to_owned();
            }
        }
        places
    }

    fn refer(&mut self, object: &File, places: &Places) {
        for section in object.sections() {
            let Some(&place) = places.get(&section.index()) else { continue };
            let targets = section.relocations().map(|(_, relocation)| relocation.target());
            let refers: Vec<Reference> = targets.filter_map(|target| self.reference(object, places, target)).collect();
            self.sections[place].refers = refers;
        }
    }

    fn reference(&self, object: &File, places: &Places, target: RelocationTarget) -> Option<Reference> {
        let at = |index: SectionIndex| places.get(&index).copied().map(Reference::Section);
        let of_symbol = |index: SymbolIndex| {
            let symbol = object.symbol_by_index(index).ok()?;
            let name = symbol.name().unwrap_or_default();
            // The linker takes one of several weak definitions for all.
            let shared = symbol.is_global().then(|| self.defined.get(name)).flatten();
            match (shared, symbol.section_index()) {
                (Some(&place), _) => Some(Reference::Section(place)),
                (None, Some(index)) => at(index),
                (None, None) if name.is_empty() => None,
                (None, None) => Some(Reference::Foreign(name.to_owned())),
            }
        };
        match target {
            RelocationTarget::Symbol(index) => of_symbol(index),
            RelocationTarget::Section(index) => at(index),
            _ => None,
        }
    }

    /// From `.stack_sizes`: per function its address, which is a relocation, and the bytes of its frame.
    fn stacks(&mut self, object: &File, places: &Places) -> Result<(), String> {
        let width = if object.is_64() { 8 } else { 4 };
        for section in object.sections().filter(|section| section.name() == Ok(".stack_sizes")) {
            let data = section.data().map_err(|error| error.to_string())?;
            for (offset, relocation) in section.relocations() {
                let after = usize::try_from(offset).ok().and_then(|offset| data.get(offset + width..));
                let bytes = after.and_then(leb128).ok_or("a frame without a size")?;
                let index = match relocation.target() {
                    RelocationTarget::Symbol(index) => {
                        object.symbol_by_index(index).ok().and_then(|s| s.section_index())
                    }
                    RelocationTarget::Section(index) => Some(index),
                    _ => None,
                };
                if let Some(&place) = index.and_then(|index| places.get(&index)) {
                    let section = &mut self.sections[place];
                    section.stack = section.stack.max(Some(bytes));
                }
            }
        }
        Ok(())
    }
}

fn objects(bytes: &[u8]) -> object::Result<Vec<File<'_>>> {
    let archive = ArchiveFile::parse(bytes)?;
    let members = archive.members().map(|member| member.and_then(|member| member.data(bytes)));
    // Beside objects there may be a file of rustc's own.
    let is_object = |data: &object::Result<&[u8]>| data.as_ref().map_or(true, |data| data.starts_with(b"\x7fELF"));
    members.filter(is_object).map(|data| data.and_then(File::parse)).collect()
}

fn kind(kind: SectionKind) -> Option<Kind> {
    match kind {
        SectionKind::Text => Some(Kind::Code),
        SectionKind::ReadOnlyData | SectionKind::ReadOnlyDataWithRel | SectionKind::ReadOnlyString => {
            Some(Kind::Constant)
        }
        SectionKind::Data | SectionKind::UninitializedData => Some(Kind::Variable),
        _ => None,
    }
}

/// The first number of `data`, seven bits per byte.
fn leb128(data: &[u8]) -> Option<u64> {
    let end = data.iter().take(9).position(|byte| byte & 0x80 == 0)?;
    Some(data.iter().take(end + 1).rev().fold(0, |value, byte| value << 7 | u64::from(byte & 0x7f)))
}

#[cfg(test)]
mod tests {
    use super::leb128;

    #[test]
    fn numbers_take_as_many_bytes_as_they_need() {
        assert_eq!(leb128(&[0x08, 0xff]), Some(8));
        assert_eq!(leb128(&[0xe5, 0x8e, 0x26]), Some(624_485));
        assert_eq!(leb128(&[0x80]), None);
    }
}
