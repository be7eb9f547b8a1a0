//! What some functions of a library reach, and how deep the stack gets.

use std::collections::{BTreeMap, BTreeSet};

use super::library::{Kind, Library, Reference, Section};

/// All sections that a linker keeps for some functions.
pub struct Reached<'a> {
    library: &'a Library,
    roots: Vec<usize>,
    places: BTreeSet<usize>,
}

impl<'a> Reached<'a> {
    /// From the functions whose names begin with one of `prefixes`.
    pub fn from(library: &'a Library, prefixes: &[&str]) -> Self {
        let asked = |name: &str| prefixes.iter().any(|prefix| name.starts_with(prefix));
        let named = library.defined.iter().filter(|(name, _)| asked(name)).map(|(_, place)| *place);
        let roots: Vec<usize> = named.filter(|place| library.sections[*place].kind == Kind::Code).collect();
        let (mut places, mut open) = (BTreeSet::new(), roots.clone());
        while let Some(place) = open.pop() {
            if places.insert(place) {
                open.extend(targets(&library.sections[place]));
            }
        }
        Self { library, roots, places }
    }

    pub fn code(&self) -> u64 {
        self.bytes(Kind::Code)
    }

    pub fn constants(&self) -> u64 {
        self.bytes(Kind::Constant)
    }

    /// Names that the library has not got.
    pub fn foreign(&self) -> Vec<String> {
        let references = self.sections().flat_map(|section| &section.refers);
        let names = references.filter_map(|reference| match reference {
            Reference::Foreign(name) => Some(name.clone()),
            Reference::Section(_) => None,
        });
        names.collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// Functions with `part` in their names.
    pub fn named(&self, part: &str) -> Vec<String> {
        self.functions().map(|section| section.name.clone()).filter(|name| name.contains(part)).collect()
    }

    /// Functions whose stack nobody told.
    pub fn unmeasured(&self) -> Vec<String> {
        self.functions().filter(|section| section.stack.is_none()).map(|section| section.name.clone()).collect()
    }

    /// The deepest chain of calls: the sum of its frames and return addresses, and the functions in it with their frames.
    ///
    /// # Errors
    /// A function may call itself, so that there is no such sum.
    pub fn stack(&self) -> Result<(u64, Vec<(String, u64)>), String> {
        let mut known = BTreeMap::new();
        for root in &self.roots {
            self.depth(*root, &mut known)?;
        }
        let deepest = self.roots.iter().filter_map(|root| Some((known.get(root)?.as_ref()?.bytes, *root))).max();
        let Some((bytes, root)) = deepest else { return Ok((0, Vec::new())) };
        let next = |place: &usize| known.get(place)?.as_ref()?.next;
        let chain = std::iter::successors(Some(root), next).map(|place| &self.library.sections[place]);
        Ok((bytes, chain.map(|section| (section.name.clone(), section.stack.unwrap_or(0))).collect()))
    }

    /// Of a call of the function at `place`; `known` has `None` for those under way.
    fn depth(&self, place: usize, known: &mut BTreeMap<usize, Option<Depth>>) -> Result<u64, String> {
        match known.get(&place) {
            Some(Some(depth)) => return Ok(depth.bytes),
            Some(None) => return Err(format!("{} may call itself", self.library.sections[place].name)),
            None => known.insert(place, None),
        };
        let section = &self.library.sections[place];
        let leaves = section.refers.iter().any(|reference| matches!(reference, Reference::Foreign(_)));
        let mut below = Depth { bytes: if leaves { self.library.return_address } else { 0 }, next: None };
        for callee in self.callees(place) {
            let bytes = self.depth(callee, known)?;
            if bytes > below.bytes {
                below = Depth { bytes, next: Some(callee) };
            }
        }
        let bytes = self.library.return_address + section.stack.unwrap_or(0) + below.bytes;
        known.insert(place, Some(Depth { bytes, next: below.next }));
        Ok(bytes)
    }

    /// Functions that the one at `place` refers to, itself or through constants. A table that leads back into it is one of jumps.
    fn callees(&self, place: usize) -> BTreeSet<usize> {
        let is_code = |place: &usize| self.library.sections[*place].kind == Kind::Code;
        let (direct, mut open): (Vec<usize>, Vec<usize>) = targets(&self.library.sections[place]).partition(is_code);
        let mut callees: BTreeSet<usize> = direct.into_iter().collect();
        let mut seen = BTreeSet::new();
        while let Some(data) = open.pop() {
            if !seen.insert(data) {
                continue;
            }
            let (code, data): (Vec<usize>, Vec<usize>) = targets(&self.library.sections[data]).partition(is_code);
            callees.extend(code.into_iter().filter(|code| *code != place));
            open.extend(data);
        }
        callees
    }

    fn bytes(&self, kind: Kind) -> u64 {
        self.sections().filter(|section| section.kind == kind).map(|section| section.bytes).sum()
    }

    fn sections(&self) -> impl Iterator<Item = &'a Section> {
        self.places.iter().map(|place| &self.library.sections[*place])
    }

    fn functions(&self) -> impl Iterator<Item = &'a Section> {
        self.sections().filter(|section| section.kind == Kind::Code)
    }
}

/// Of a call, and the call below it that it is due to.
struct Depth {
    bytes: u64,
    next: Option<usize>,
}

fn targets(section: &Section) -> impl Iterator<Item = usize> {
    section.refers.iter().filter_map(|reference| match reference {
        Reference::Section(place) => Some(*place),
        Reference::Foreign(_) => None,
    })
}
