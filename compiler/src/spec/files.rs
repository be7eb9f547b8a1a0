//! The files beside the TOML that it names.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use super::nearest::did_you_mean;
use crate::diagnostic::Source;
use crate::import::{self, Contents, LARGEST_FILE, Unusable};

/// Reads each file once, however many values name it.
#[derive(Debug)]
pub(super) struct Files {
    /// Of the TOML: what paths are relative to.
    folder: PathBuf,
    read: RefCell<BTreeMap<String, Rc<Result<Contents, Unusable>>>>,
}

impl Files {
    pub fn beside(source: &Source) -> Self {
        let folder = Path::new(&source.path).parent().map(Path::to_path_buf).unwrap_or_default();
        Self { folder, read: RefCell::default() }
    }

    /// What the file holds that the TOML calls `name`, or why it cannot be used.
    pub fn get(&self, name: &str) -> Rc<Result<Contents, Unusable>> {
        let known = self.read.borrow().get(name).cloned();
        known.unwrap_or_else(|| {
            let contents = Rc::new(self.bytes(name).and_then(|bytes| import::read(name, &bytes)));
            self.read.borrow_mut().insert(name.to_owned(), Rc::clone(&contents));
            contents
        })
    }

    /// Names of the files that were asked for, in order, whether they are there or not.
    pub fn names(&self) -> Vec<String> {
        self.read.borrow().keys().cloned().collect()
    }

    /// Paths of these.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.names().iter().map(|name| self.folder.join(name)).collect()
    }

    fn bytes(&self, name: &str) -> Result<Vec<u8>, Unusable> {
        if Path::new(name).components().any(|part| matches!(part, Component::Prefix(_) | Component::RootDir)) {
            return Err(unusable("is named by an absolute path").with_help(
                "name it relative to the folder of this file, so that the design is the same on another machine",
            ));
        }
        let path = self.folder.join(name);
        // A pipe or a device might never end.
        let about = std::fs::metadata(&path).map_err(|error| self.unreadable(name, &error))?;
        if !about.is_file() {
            return Err(unusable("is not a file"));
        }
        if about.len() > LARGEST_FILE {
            return Err(unusable(&format!("has {} bytes, more than {LARGEST_FILE}", about.len())));
        }
        std::fs::read(&path).map_err(|error| self.unreadable(name, &error))
    }

    fn unreadable(&self, name: &str, error: &std::io::Error) -> Unusable {
        if error.kind() != ErrorKind::NotFound {
            return unusable(&format!("cannot be read: {error}"));
        }
        let missing = unusable("is not there");
        match self.near(name) {
            Some(near) => missing.with_help(format!("did you mean \"{near}\"?")),
            None => missing.with_help("paths are relative to the folder of this file"),
        }
    }

    /// A file in the same folder whose name is nearly the same.
    fn near(&self, name: &str) -> Option<String> {
        let (folder, file) = name.rsplit_once('/').map_or(("", name), |(folder, file)| (folder, file));
        let entries = std::fs::read_dir(match self.folder.join(folder) {
            here if here.as_os_str().is_empty() => PathBuf::from("."),
            folder => folder,
        });
        let mut there: Vec<String> =
            entries.ok()?.flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect();
        there.sort();
        let near = did_you_mean(file, there.iter().map(String::as_str))?;
        Some(if folder.is_empty() { near.to_owned() } else { format!("{folder}/{near}") })
    }
}

fn unusable(what: &str) -> Unusable {
    Unusable { what: what.to_owned(), help: None }
}
