//! Rooms of the crate lie in layers, and no files use each other in a circle.

#![allow(clippy::expect_used, clippy::panic)] // helpers of tests: a panic is the failure report

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use pathfinding::prelude::strongly_connected_components;
use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, ItemUse, Macro, UseTree, Visibility};

/// Rooms by layer, the lowest first. Rooms of one layer do not use each other.
const LAYERS: [&[&str]; 10] = [
    &["base"],
    &["parallel", "snapshot", "network"],
    &["agents"],
    &["neighbor"],
    &["predator"],
    &["flock", "line"],
    &["reward"],
    &["observation"],
    &["episode"],
    &["sweep", "graph", "kinds", "bindings"],
];

type Names = Vec<String>;

/// The layer of a room.
fn layer_of(room: &str) -> Option<usize> {
    LAYERS.iter().position(|rooms| rooms.contains(&room))
}

/// The module in one file.
#[derive(Default)]
struct Module {
    /// Its path from the root of the crate.
    path: Names,
    /// Its file modules.
    children: BTreeSet<String>,
    /// Paths that occur in it, as written.
    written: BTreeSet<Names>,
    /// What it re-exports: name and path as written. A re-export alone is no use.
    exports: BTreeMap<String, Names>,
}

impl Module {
    fn parse(path: Names, text: &str) -> Self {
        let mut module = Self {
            path,
            ..Self::default()
        };
        module.visit_file(&syn::parse_file(text).expect("a file that compiles"));
        module
    }

    /// The path from the root of the crate; `None` for names that are local or of other crates.
    fn absolute(&self, written: &[String]) -> Option<Names> {
        let first = written.first()?;
        let supers = written.iter().take_while(|s| *s == "super").count();
        let (mut path, rest) = match first.as_str() {
            "crate" => (Vec::new(), &written[1..]),
            "self" => (self.path.clone(), &written[1..]),
            "super" => (
                self.path[..self.path.len().checked_sub(supers)?].to_vec(),
                &written[supers..],
            ),
            child if self.children.contains(child) => (self.path.clone(), written),
            name => {
                let exported = self.exports.get(name).filter(|path| path[0] != name)?;
                (self.absolute(exported)?, &written[1..])
            }
        };
        path.extend_from_slice(rest);
        Some(path)
    }

    /// Paths from the root of the crate that are used in it.
    fn used(&self) -> impl Iterator<Item = Names> {
        self.written.iter().filter_map(|path| self.absolute(path))
    }

    /// Records every path of a tree of uses.
    fn record_tree(&mut self, tree: &UseTree, before: &[String], is_export: bool) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        let (name, path) = match tree {
            UseTree::Path(path) => {
                return self.record_tree(&path.tree, &with(&path.ident), is_export);
            }
            UseTree::Group(group) => {
                let trees = group.items.iter();
                return trees.for_each(|tree| self.record_tree(tree, before, is_export));
            }
            UseTree::Name(name) if name.ident == "self" => {
                (name.ident.to_string(), before.to_vec())
            }
            UseTree::Name(name) => (name.ident.to_string(), with(&name.ident)),
            UseTree::Rename(rename) => (rename.rename.to_string(), with(&rename.ident)),
            UseTree::Glob(_) => ("*".to_owned(), before.to_vec()),
        };
        if is_export {
            self.exports.insert(name, path);
        } else {
            self.written.insert(path);
        }
    }

    /// Records the paths among a macro's tokens, and single names of types. Other names may be local.
    fn record_tokens(&mut self, tokens: TokenStream) {
        let mut paths = vec![Names::new()];
        let mut num_colons = 0;
        for token in tokens {
            let last = paths.len() - 1;
            match token {
                TokenTree::Punct(punct) if punct.as_char() == ':' => {
                    num_colons += 1;
                    continue;
                }
                TokenTree::Ident(name) if num_colons == 2 => paths[last].push(name.to_string()),
                TokenTree::Ident(name) => paths.push(vec![name.to_string()]),
                // The path of `pub(in ..)` is no use.
                TokenTree::Group(_) if paths[last] == ["pub"] => {}
                TokenTree::Group(group) => self.record_tokens(group.stream()),
                TokenTree::Punct(_) | TokenTree::Literal(_) => paths.push(Names::new()),
            }
            num_colons = 0;
        }
        let is_type = |path: &Names| path.iter().any(|name| name.starts_with(char::is_uppercase));
        let found = paths
            .into_iter()
            .filter(|path| path.len() > 1 || is_type(path));
        self.written.extend(found);
    }
}

impl Visit<'_> for Module {
    fn visit_item(&mut self, item: &Item) {
        if !is_for_tests(attributes_of(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, module: &ItemMod) {
        assert!(
            module.content.is_none(),
            "{}: one module per file",
            module.ident
        );
        self.children.insert(module.ident.to_string());
    }

    fn visit_item_use(&mut self, item: &ItemUse) {
        let is_export = !matches!(item.vis, Visibility::Inherited);
        self.record_tree(&item.tree, &[], is_export);
    }

    fn visit_path(&mut self, path: &syn::Path) {
        let segments = path.segments.iter().map(|s| s.ident.to_string());
        self.written.insert(segments.collect());
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, found: &Macro) {
        self.record_tokens(found.tokens.clone());
        visit::visit_macro(self, found);
    }

    /// The path of `pub(in ..)` is no use.
    fn visit_visibility(&mut self, _: &Visibility) {}
}

fn attributes_of(item: &Item) -> &[Attribute] {
    match item {
        Item::Mod(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        _ => &[],
    }
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let name: Result<syn::Ident, _> = attribute.parse_args();
        attribute.path().is_ident("cfg") && name.is_ok_and(|name| name == "test")
    })
}

/// All modules of the crate that are not for tests alone, by path.
#[derive(Default)]
struct Crate(BTreeMap<Names, Module>);

impl Crate {
    /// The crate in this folder.
    fn read() -> Self {
        let mut found = Self::default();
        found.read_module(
            &Path::new(env!("CARGO_MANIFEST_DIR")).join("src"),
            Vec::new(),
        );
        found
    }

    fn read_module(&mut self, source: &Path, path: Names) {
        let folder = source.join(path.iter().collect::<PathBuf>());
        let candidates = [
            source.join("lib.rs"),
            folder.with_extension("rs"),
            folder.join("mod.rs"),
        ];
        let is_root = path.is_empty();
        let file = candidates
            .into_iter()
            .skip(usize::from(!is_root))
            .find(|file| file.is_file())
            .unwrap_or_else(|| panic!("no file of {path:?}"));
        let text = fs::read_to_string(&file).expect("a file of the crate");
        let module = Module::parse(path, &text);
        for child in &module.children {
            let path = [&module.path[..], std::slice::from_ref(child)].concat();
            self.read_module(source, path);
        }
        self.0.insert(module.path.clone(), module);
    }

    /// The crate with one more use in a module.
    fn with_use(mut self, path: &[&str], text: &str) -> Self {
        let path: Names = path.iter().map(|name| (*name).to_owned()).collect();
        let more = Module::parse(path.clone(), text);
        let module = self.0.get_mut(&path).expect("a module of the crate");
        module.written.extend(more.written);
        self
    }

    /// The module that defines what a path names. Re-exports are followed, so that a `mod.rs` that only declares and
    /// re-exports is in no circle.
    fn definer(&self, path: &[String]) -> &Module {
        let mut length = 0;
        while length < path.len() && self.0.contains_key(&path[..=length]) {
            length += 1;
        }
        let module = &self.0[&path[..length]];
        let exported = path.get(length).and_then(|name| module.exports.get(name));
        let exported = exported.and_then(|written| module.absolute(written));
        match exported {
            Some(exported) => self.definer(&[&exported[..], &path[length + 1..]].concat()),
            None => module,
        }
    }

    /// Uses of a room in the same or a higher layer, as (from, to, description).
    fn upward_uses(&self) -> Vec<(&str, String, String)> {
        let mut up = Vec::new();
        for module in self.0.values().filter(|module| !module.path.is_empty()) {
            let room = module.path[0].as_str();
            for used in module.used() {
                let used_room = used.first().map(String::as_str).unwrap_or_default();
                let description = format!("{} uses {}", module.path.join("::"), used.join("::"));
                let layer = layer_of(used_room).unwrap_or_else(|| panic!("{description}: no room"));
                if used_room != room && Some(layer) >= layer_of(room) {
                    up.push((room, used_room.to_owned(), description));
                }
            }
        }
        up
    }

    /// Modules that use each other, directly or through others.
    fn circles(&self) -> Vec<BTreeSet<String>> {
        let paths: Vec<&Names> = self.0.keys().filter(|path| !path.is_empty()).collect();
        let components = strongly_connected_components(&paths, |path| {
            let module = &self.0[*path];
            let used = module.used().map(|used| &self.definer(&used).path);
            used.filter(|used| !used.is_empty() && used != path)
                .collect::<BTreeSet<_>>()
        });
        let circles = components.into_iter().filter(|paths| paths.len() > 1);
        circles
            .map(|paths| paths.iter().map(|path| path.join("::")).collect())
            .collect()
    }
}

#[test]
fn no_room_uses_one_above_it() {
    let found = Crate::read();
    let root = &found.0[&Names::new()];
    let rooms: BTreeSet<&str> = root.children.iter().map(String::as_str).collect();
    assert_eq!(rooms, LAYERS.concat().into_iter().collect());

    let up = found.upward_uses();
    assert!(up.is_empty(), "uses that run up: {up:#?}");
}

#[test]
fn every_file_is_a_module_of_the_crate() {
    fn count(folder: &Path) -> usize {
        let entries = fs::read_dir(folder).expect("a folder of the crate");
        let paths = entries.map(|entry| entry.expect("an entry").path());
        paths
            .filter(|path| path.file_stem().is_some_and(|name| name != "tests"))
            .map(|path| if path.is_dir() { count(&path) } else { 1 })
            .sum()
    }
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    assert_eq!(Crate::read().0.len(), count(&source));
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    let circles = Crate::read().circles();
    assert!(circles.is_empty(), "{circles:#?}");
}

#[test]
fn a_planted_upward_use_is_found() {
    let before = Crate::read().upward_uses().len();
    let planted = Crate::read().with_use(&["neighbor"], "use crate::flock::World;");
    let found = planted.upward_uses();
    assert_eq!(found.len(), before + 1);
    assert!(
        found
            .iter()
            .any(|(from, to, _)| (*from, to.as_str()) == ("neighbor", "flock"))
    );
}

#[test]
fn a_planted_circle_is_found_inside_a_room_and_through_re_exports() {
    let before = Crate::read().circles().len();
    for (path, text) in [
        (["neighbor", "ranges"], "use super::engine::tree::Tree;"),
        (["flock", "scenario"], "use crate::flock::World;"),
        (["line", "scenario"], "fn step(line: &crate::line::Line) {}"),
    ] {
        let circles = Crate::read().with_use(&path, text).circles();
        assert_eq!(circles.len(), before + 1, "{path:?}");
    }
}
