//! Mutations of the two crates, and the patched source files in which all are built in at once.
//!
//! A mutation is a small mistake: a term that is 5 % too small, a wrong density, an omitted kind of curve.
//! They are listed in `tests/mutations`, each with the tests that must fail with it. None is in the code: the
//! example `mutations` puts them into a copy of the workspace, where each is an alternative that the
//! environment variable `MUTATION` switches on.
//!
//! ```toml
//! [[mutation]]
//! name = "half-a-jump"
//! what = "Edge sampling in the plane sees half of every jump"
//! file = "flatland/src/estimator/edge_points.rs"
//! code = "⟨(self.values[0] - self.values[1])⟩ * self.weight"
//! becomes = "0.5 * $"
//! tests = ["tests --test unbiased edge_sampling"]
//! ```
//!
//! `code` must be in the file exactly once, ignoring white space. The part between ⟨ and ⟩ is an expression,
//! or statements that end in a semicolon; `becomes` replaces it, with `$` for the original.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;

/// The environment variable that switches a mutation on, by its number; 0 is none.
pub const VARIABLE: &str = "MUTATION";

/// One mistake.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mutation {
    /// Its name: short, of words joined by hyphens.
    pub name: String,
    /// The mistake, as one sentence without a full stop.
    pub what: String,
    /// The source file, from the root of the workspace.
    pub file: String,
    /// The code around it, with the replaced part between ⟨ and ⟩.
    pub code: String,
    /// The replacement text.
    pub becomes: String,
    /// Tests that must fail: package, `--lib` or `--test NAME`, then name filters.
    pub tests: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    mutation: Vec<Mutation>,
}

/// The root of the workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// All mutations, ordered by file and by name.
///
/// # Errors
/// An error names the file that cannot be read, or the duplicate name.
pub fn all() -> Result<Vec<Mutation>, String> {
    let folder = root().join("tests/mutations");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "toml"));
    files.sort();
    let mut all: Vec<Mutation> = vec![];
    for path in files {
        let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let List { mutation } = toml::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
        all.extend(mutation);
    }
    for (i, mutation) in all.iter().enumerate() {
        if all[..i].iter().any(|other| other.name == mutation.name) {
            return Err(format!("two mutations are called {}", mutation.name));
        }
    }
    Ok(all)
}

/// Position of a mutation in its file, with its replacement.
#[derive(Clone, Debug)]
struct Patch {
    number: usize,
    range: Range<usize>,
    becomes: String,
}

/// Source files with all mutations built in, as far as they do not overlap.
#[derive(Debug, Default)]
pub struct Batch {
    /// The numbers of the batch's mutations.
    pub numbers: Vec<usize>,
    patches: BTreeMap<String, Vec<Patch>>,
}

/// The characters of a text that are not white space, and the position of each of their bytes.
fn dense(text: &str) -> (String, Vec<usize>) {
    let (mut dense, mut places) = (String::new(), vec![]);
    for (place, c) in text.char_indices().filter(|(_, c)| !c.is_whitespace()) {
        dense.push(c);
        places.extend(place..place + c.len_utf8());
    }
    (dense, places)
}

impl Mutation {
    /// Byte range of the replaced code in a source text.
    ///
    /// # Errors
    /// The reason why it does not apply.
    fn find(&self, source: &str) -> Result<Range<usize>, String> {
        let Self { name, file, code, .. } = self;
        let marks = code.split_once('⟨').and_then(|(a, rest)| rest.split_once('⟩').map(|(b, c)| [a, b, c]));
        let [before, inside, after] = marks.ok_or_else(|| format!("{name}: no ⟨ and ⟩ in `{code}`"))?;
        let [before, inside, after] = [before, inside, after].map(|part| dense(part).0);
        let (text, places) = dense(source);
        let whole = format!("{before}{inside}{after}");
        let mut found = text.match_indices(&whole);
        let (start, _) = found.next().ok_or_else(|| format!("{name}: `{code}` is not in {file}"))?;
        if found.next().is_some() {
            return Err(format!("{name}: `{code}` is in {file} more than once"));
        }
        let first = start + before.len();
        let last = first + inside.len();
        if inside.is_empty() {
            return Err(format!("{name}: nothing is between ⟨ and ⟩"));
        }
        Ok(places[first]..places[last - 1] + 1)
    }
}

/// Packs mutations, numbered from 1, into as few batches as possible without overlaps.
///
/// # Errors
/// The mutations that do not apply, one a line.
pub fn batches(mutations: &[Mutation]) -> Result<Vec<Batch>, String> {
    let (mut batches, mut faults): (Vec<Batch>, Vec<String>) = (vec![], vec![]);
    for (number, mutation) in (1..).zip(mutations) {
        let path = root().join(&mutation.file);
        let source =
            std::fs::read_to_string(&path).map_err(|e| format!("{}: {}: {e}", mutation.name, mutation.file));
        match source.and_then(|source| mutation.find(&source)) {
            Ok(range) => {
                let patch = Patch { number, range, becomes: mutation.becomes.clone() };
                let place = batches.iter().position(|batch| batch.has_room(&mutation.file, &patch.range));
                let place = place.unwrap_or_else(|| {
                    batches.push(Batch::default());
                    batches.len() - 1
                });
                batches[place].numbers.push(number);
                batches[place].patches.entry(mutation.file.clone()).or_default().push(patch);
            }
            Err(fault) => faults.push(fault),
        }
    }
    if faults.is_empty() { Ok(batches) } else { Err(faults.join("\n")) }
}

impl Batch {
    /// Whether a range is free: alternatives for one expression share it, others must not overlap.
    fn has_room(&self, file: &str, range: &Range<usize>) -> bool {
        let overlaps = |other: &Range<usize>| range.start < other.end && other.start < range.end;
        let patches = self.patches.get(file).into_iter().flatten();
        patches.into_iter().all(|patch| patch.range == *range || !overlaps(&patch.range))
    }

    /// A file of the workspace as it is in the copy: with its mutations, and with the switch in the file that
    /// holds it.
    pub fn patched(&self, file: &str, source: &str) -> String {
        let mut patches = self.patches.get(file).cloned().unwrap_or_default();
        patches.sort_by_key(|patch| (patch.range.start, patch.number));
        let own = if file.starts_with("flatland/src/") { "crate" } else { "flatland" };
        let mut text = source.to_owned();
        for alike in patches.chunk_by(|a, b| a.range == b.range).rev() {
            let range = alike[0].range.clone();
            let original = &source[range.clone()];
            let mut switch = String::new();
            for Patch { number, becomes, .. } in alike {
                let becomes = becomes.replace('$', original);
                switch += &format!("if {own}::mutation::is({number}) {{ {becomes} }} else ");
            }
            switch += &format!("{{ {original} }}");
            let is_statement = original.ends_with(';');
            text.replace_range(range, &if is_statement { switch } else { format!("({switch})") });
        }
        if file.ends_with("/src/lib.rs") {
            // Alternatives may have superfluous parentheses.
            text.insert_str(0, "#![allow(unused_parens)]\n");
        }
        if file == "flatland/src/lib.rs" {
            text += SWITCH;
        }
        text
    }
}

/// Module added to the copy of flatland.
const SWITCH: &str = r#"
/// Mutations.
pub mod mutation {
    /// Whether one is switched on.
    #[inline]
    pub fn is(number: u32) -> bool {
        static ON: std::sync::OnceLock<u32> = std::sync::OnceLock::new();
        let on = || std::env::var("MUTATION").ok().and_then(|n| n.parse().ok()).unwrap_or(0);
        *ON.get_or_init(on) == number
    }
}
"#;

#[cfg(test)]
mod tests {
    use super::*;

    /// The code of every mutation in the list occurs exactly once.
    #[test]
    fn all_mutations_apply() {
        let all = all().unwrap_or_else(|e| panic!("{e}"));
        assert!(all.len() >= 40, "{}", all.len());
        let batches = batches(&all).unwrap_or_else(|e| panic!("mutations that do not apply:\n{e}"));
        assert_eq!(batches.iter().map(|batch| batch.numbers.len()).sum::<usize>(), all.len());
    }

    fn mutation(code: &str, becomes: &str) -> Mutation {
        let [name, what, file, code, becomes] =
            ["m", "", "volume3d/src/a.rs", code, becomes].map(str::to_owned);
        Mutation { name, what, file, code, becomes, tests: vec![] }
    }

    #[test]
    fn code_is_found_whatever_its_white_space() {
        let source = "fn f() {\n    let a =\n        b  + c;\n    g( );\n}";
        let of = |code: &str| mutation(code, "").find(source).map(|range| &source[range]);
        assert_eq!(of("let a = ⟨b + c⟩;"), Ok("b  + c"));
        assert_eq!(of("⟨g();⟩ }"), Ok("g( );"));
        assert!(of("⟨h()⟩").unwrap_err().contains("is not in"));
        assert!(of("⟨(⟩").unwrap_err().contains("more than once"));
        assert!(of("b + c").unwrap_err().contains("no ⟨"));
    }

    #[test]
    fn alternatives_are_switched() {
        let source = "let a = b + c; g();";
        let patch = |number: usize, code: &str, becomes: &str| {
            let mutation = mutation(code, becomes);
            Patch { number, range: mutation.find(source).unwrap(), becomes: mutation.becomes }
        };
        let patches =
            vec![patch(1, "a = ⟨b + c⟩", "2 * ($)"), patch(2, "; ⟨g();⟩", ""), patch(3, "a = ⟨b + c⟩", "b")];
        let file = "volume3d/src/a.rs".to_owned();
        let batch = Batch { numbers: vec![1, 2, 3], patches: BTreeMap::from([(file.clone(), patches)]) };
        let expected = "let a = (if flatland::mutation::is(1) { 2 * (b + c) } else if flatland::mutation::is(3) { b } \
                        else { b + c }); if flatland::mutation::is(2) {  } else { g(); }";
        assert_eq!(batch.patched(&file, source), expected);
        assert!(
            batch.has_room(&file, &(8..13))
                && !batch.has_room(&file, &(8..9))
                && batch.has_room(&file, &(0..8))
        );
    }
}
