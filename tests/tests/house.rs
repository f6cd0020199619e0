//! Imports within every crate are free of cycles: in no folder do files or folders import one another in a
//! cycle.
//!
//! Imports are read from all paths in the code, tests excepted. A name that a folder's `mod.rs` re-exports
//! counts as a name of the file that defines it. A folder's own `mod.rs` may use its children and be used by
//! them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, ItemUse, UseTree, Visibility};

/// The names of modules from the crate's root.
type Place = Vec<String>;

/// A module: the paths that it uses, and the names that it re-exports.
#[derive(Default)]
struct Module {
    used: BTreeSet<Vec<String>>,
    exported: BTreeMap<String, Vec<String>>,
}

/// All modules of a crate.
#[derive(Default)]
struct House {
    modules: BTreeMap<Place, Module>,
}

/// Reads the paths of one module and of the modules nested in it.
struct Reader<'h> {
    house: &'h mut House,
    place: Place,
}

fn is_test(attributes: &[Attribute]) -> bool {
    let mentions_test = |a: &Attribute| match &a.meta {
        syn::Meta::List(list) => list.path.is_ident("cfg") && list.tokens.to_string().contains("test"),
        meta => meta.path().is_ident("test"),
    };
    attributes.iter().any(mentions_test)
}

/// Every path of a `use`, with its local name.
fn uses(tree: &UseTree, before: &[String], found: &mut Vec<(Vec<String>, String)>) {
    let with = |name: String| [before, &[name]].concat();
    match tree {
        UseTree::Path(path) => uses(&path.tree, &with(path.ident.to_string()), found),
        UseTree::Name(name) if name.ident == "self" => {
            found.push((before.to_vec(), before.last().cloned().unwrap_or_default()));
        }
        UseTree::Name(name) => found.push((with(name.ident.to_string()), name.ident.to_string())),
        UseTree::Rename(name) => found.push((with(name.ident.to_string()), name.rename.to_string())),
        UseTree::Glob(_) => found.push((before.to_vec(), "*".to_owned())),
        UseTree::Group(group) => group.items.iter().for_each(|item| uses(item, before, found)),
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Mod(m) => &m.attrs,
            Item::Fn(f) => &f.attrs,
            Item::Impl(i) => &i.attrs,
            Item::Use(u) => &u.attrs,
            _ => return visit::visit_item(self, item),
        };
        if !is_test(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, module: &'ast ItemMod) {
        let Some((_, items)) = &module.content else { return };
        let place = [&self.place[..], &[module.ident.to_string()]].concat();
        self.house.modules.entry(place.clone()).or_default();
        let mut reader = Reader { house: self.house, place };
        items.iter().for_each(|item| reader.visit_item(item));
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        let mut found = vec![];
        uses(&item.tree, &[], &mut found);
        let module = self.house.modules.entry(self.place.clone()).or_default();
        for (path, name) in found {
            if matches!(item.vis, Visibility::Inherited) {
                module.used.insert(path);
            } else {
                module.exported.insert(name, path);
            }
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if path.leading_colon.is_none() && names.len() > 1 {
            self.house.modules.entry(self.place.clone()).or_default().used.insert(names);
        }
        visit::visit_path(self, path);
    }
}

impl House {
    fn read(source: &Path) -> Self {
        let mut house = Self::default();
        house.read_folder(source, &[]);
        house
    }

    fn read_folder(&mut self, folder: &Path, place: &[String]) {
        let mut entries: Vec<_> =
            std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path()).collect();
        entries.sort();
        for path in entries {
            let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
            let below = [place, std::slice::from_ref(&name)].concat();
            if name == "tests" {
                continue;
            }
            if path.is_dir() {
                self.read_folder(&path, &below);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let place = if matches!(&*name, "mod" | "lib" | "main") { place.to_vec() } else { below };
                let text = std::fs::read_to_string(&path).expect("text");
                let file = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
                self.modules.entry(place.clone()).or_default();
                let mut reader = Reader { house: self, place };
                file.items.iter().for_each(|item| reader.visit_item(item));
            }
        }
    }

    /// The module to which a path leads from a place; `None` outside the crate.
    fn target(&self, from: &[String], path: &[String], depth: usize) -> Option<Place> {
        let (mut at, mut rest) = match path.first()?.as_str() {
            "crate" => (vec![], &path[1..]),
            "self" => (from.to_vec(), &path[1..]),
            "super" => (from[..from.len().checked_sub(1)?].to_vec(), &path[1..]),
            first => {
                let inside = [from, &[first.to_owned()]].concat();
                let handed_on = self.modules[from].exported.contains_key(first);
                if !self.modules.contains_key(&inside) && !handed_on {
                    return None;
                }
                (from.to_vec(), path)
            }
        };
        while rest.first().is_some_and(|name| name == "super") {
            at.pop();
            rest = &rest[1..];
        }
        for (k, name) in rest.iter().enumerate() {
            let inside = [&at[..], std::slice::from_ref(name)].concat();
            if self.modules.contains_key(&inside) {
                at = inside;
            } else if let Some(onward) = self.modules.get(&at)?.exported.get(name) {
                let onward = [&onward[..], &rest[k + 1..]].concat();
                return if depth > 0 { self.target(&at, &onward, depth - 1).or(Some(at)) } else { Some(at) };
            } else {
                break;
            }
        }
        Some(at)
    }

    /// For every folder, the imports between its children.
    fn arrows(&self) -> BTreeMap<Place, BTreeMap<(String, String), BTreeSet<String>>> {
        let mut arrows: BTreeMap<Place, BTreeMap<_, BTreeSet<String>>> = BTreeMap::new();
        for (place, module) in &self.modules {
            for path in &module.used {
                let Some(target) = self.target(place, path, 8) else { continue };
                let common = place.iter().zip(&target).take_while(|(a, b)| a == b).count();
                if let (Some(from), Some(to)) = (place.get(common), target.get(common)) {
                    let ties = arrows.entry(place[..common].to_vec()).or_default();
                    let tie = format!("{} uses {}", place.join("::"), path.join("::"));
                    ties.entry((from.clone(), to.clone())).or_default().insert(tie);
                }
            }
        }
        arrows
    }
}

/// The imports that lie on a cycle, with their paths.
fn circles(house: &House) -> Vec<String> {
    let mut found = vec![];
    for (folder, arrows) in house.arrows() {
        let reach = |start: &str| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![start.to_owned()]);
            while let Some(at) = open.pop() {
                for ((_, to), _) in arrows.iter().filter(|((from, _), _)| *from == at) {
                    if seen.insert(to.clone()) {
                        open.push(to.clone());
                    }
                }
            }
            seen
        };
        for ((from, to), ties) in &arrows {
            if reach(to).contains(from) {
                let ties: Vec<&str> = ties.iter().map(String::as_str).collect();
                found.push(format!("{}: {from} → {to} ({})", folder.join("::"), ties.join("; ")));
            }
        }
    }
    found
}

#[test]
fn there_are_no_circles() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let mut all = vec![];
    for name in ["flatland", "volume3d", "volume3d/cli", "figures", "tests"] {
        let house = House::read(&root.join(name).join("src"));
        assert!(house.modules.len() > 10, "{name} has been read");
        all.extend(circles(&house).into_iter().map(|circle| format!("{name}::{circle}")));
    }
    assert!(all.is_empty(), "{} arrows lie on circles:\n{}", all.len(), all.join("\n"));
}

#[test]
fn a_circle_is_found_through_what_is_handed_on() {
    let mut house = House::default();
    let files = [
        (vec![], "mod a; mod b; pub use b::Deep;"),
        (vec!["a"], "use super::Deep; pub struct Here;"),
        (vec!["b"], "mod c; pub use c::Deep;"),
        (vec!["b", "c"], "pub struct Deep(crate::a::Here);"),
    ];
    for (place, text) in &files {
        let place: Place = place.iter().map(|name| (*name).to_owned()).collect();
        house.modules.entry(place.clone()).or_default();
        let file = syn::parse_file(text).expect("Rust");
        let mut reader = Reader { house: &mut house, place };
        file.items.iter().for_each(|item| reader.visit_item(item));
    }
    let found = circles(&house);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found.iter().any(|c| c.contains("a uses super::Deep")), "{found:?}");
}

/// The paths in the architecture page, `crate/…` between backticks, exist.
#[test]
fn the_map_is_true() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let mut places = 0;
    for page in ["ARCHITECTURE.md", "CONTRIBUTING.md"] {
        let text = std::fs::read_to_string(root.join(page)).expect("a page");
        for named in text.split('`').skip(1).step_by(2) {
            let crates = ["flatland/", "volume3d/", "tests/", "figures/"];
            if crates.iter().any(|c| named.starts_with(c)) && !named.contains(char::is_whitespace) {
                assert!(root.join(named).exists(), "{page} names {named}");
                places += 1;
            }
        }
    }
    assert!(places > 20, "{places} places");
}
