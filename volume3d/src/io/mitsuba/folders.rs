//! Search path for files referenced by a scene.

use std::path::{Path, PathBuf};

/// Maximum number of folders, so that a file that includes itself does not exhaust the memory.
pub(super) const MOST_FOLDERS: usize = 64;

/// The folders of a scene: those of `<path>`, the last first, and that of the main file.
#[derive(Debug)]
pub(super) struct Folders(Vec<PathBuf>);

impl Folders {
    pub(super) fn new(main: &Path) -> Self {
        Self(vec![folder(main)])
    }

    /// Adds the folder that a `<path>` in `file` names, at all places where it may be; only finding a file
    /// there shows that one exists. False if there are too many.
    pub(super) fn add(&mut self, name: &str, file: &Path) -> bool {
        for base in [self.0.clone(), vec![folder(file)]].concat().iter().rev() {
            let path = base.join(name);
            if !self.0.contains(&path) {
                self.0.insert(0, path);
            }
        }
        self.0.len() <= MOST_FOLDERS
    }

    /// Candidate paths of a file referenced in `file`, in order of precedence. Names from other systems may
    /// have backslashes.
    pub(super) fn candidates(&self, name: &str, file: &Path) -> Vec<PathBuf> {
        let mut paths: Vec<PathBuf> = vec![];
        let slashed = name.replace('\\', "/");
        for name in [name, &slashed] {
            for folder in self.0.iter().chain([&folder(file)]) {
                let path = folder.join(name);
                if !paths.contains(&path) {
                    paths.push(path);
                }
            }
        }
        paths
    }
}

fn folder(file: &Path) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).to_path_buf()
}
