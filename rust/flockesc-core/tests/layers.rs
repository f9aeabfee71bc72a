//! Architecture tests: top-level modules use only modules of lower layers, and no files depend on each other
//! in a cycle.

#![allow(clippy::expect_used, clippy::panic)] // in helpers of tests, a panic reports the failure

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use pathfinding::prelude::strongly_connected_components;
use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, ItemUse, Macro, UseTree, Visibility};

/// Top-level modules by layer, the lowest layer first. Modules of one layer do not use each other.
const LAYERS: [&[&str]; 10] = [
    &["base"],
    &["parallel", "snapshot"],
    &["agents", "network"],
    &["neighbor"],
    &["predator"],
    &["flock", "line"],
    &["reward"],
    &["observation"],
    &["episode"],
    &["sweep", "graph", "kinds", "bindings"],
];

type Names = Vec<String>;

/// Returns the layer of a top-level module.
fn layer_of(module: &str) -> Option<usize> {
    LAYERS.iter().position(|modules| modules.contains(&module))
}

/// The module in one file.
#[derive(Default)]
struct Module {
    /// The path from the root of the crate.
    path: Names,
    /// Names of the submodules in their own files.
    children: BTreeSet<String>,
    /// Paths in the module, as written.
    written: BTreeSet<Names>,
    /// Re-exports: names and paths as written. A re-export alone does not count as a use.
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

    /// Returns the path from the root of the crate, or `None` for names that are local or from other crates.
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

    /// Returns the used paths, from the root of the crate.
    fn used(&self) -> impl Iterator<Item = Names> {
        self.written.iter().filter_map(|path| self.absolute(path))
    }

    /// Records all paths of a `use` tree.
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

    /// Records the paths in a macro's tokens, and single names of types. Other single names may be local.
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
                // The path of `pub(in ..)` does not count as a use.
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

    /// Ignores the path of `pub(in ..)`, which does not count as a use.
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

/// All modules of the crate except test modules, by path.
#[derive(Default)]
struct Crate(BTreeMap<Names, Module>);

impl Crate {
    /// Reads the crate in this folder.
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
            .unwrap_or_else(|| panic!("no file for {path:?}"));
        let text = fs::read_to_string(&file).expect("a file of the crate");
        let module = Module::parse(path, &text);
        for child in &module.children {
            let path = [&module.path[..], std::slice::from_ref(child)].concat();
            self.read_module(source, path);
        }
        self.0.insert(module.path.clone(), module);
    }

    /// Returns the crate with an additional use in a module.
    fn with_use(mut self, path: &[&str], text: &str) -> Self {
        let path: Names = path.iter().map(|name| (*name).to_owned()).collect();
        let more = Module::parse(path.clone(), text);
        let module = self.0.get_mut(&path).expect("a module of the crate");
        module.written.extend(more.written);
        self
    }

    /// Returns the module that defines the item at a path. Re-exports are followed, so that a `mod.rs` with
    /// only declarations and re-exports is in no cycle.
    fn defining_module(&self, path: &[String]) -> &Module {
        let mut length = 0;
        while length < path.len() && self.0.contains_key(&path[..=length]) {
            length += 1;
        }
        let module = &self.0[&path[..length]];
        let exported = path.get(length).and_then(|name| module.exports.get(name));
        let exported = exported.and_then(|written| module.absolute(written));
        match exported {
            Some(exported) => self.defining_module(&[&exported[..], &path[length + 1..]].concat()),
            None => module,
        }
    }

    /// Returns the uses of modules in the same or a higher layer, as (from, to, description).
    fn upward_uses(&self) -> Vec<(&str, String, String)> {
        let mut up = Vec::new();
        for module in self.0.values().filter(|module| !module.path.is_empty()) {
            let user = module.path[0].as_str();
            for path in module.used() {
                let used = path.first().map(String::as_str).unwrap_or_default();
                let description = format!("{} uses {}", module.path.join("::"), path.join("::"));
                let layer = layer_of(used).unwrap_or_else(|| panic!("{description}: no layer"));
                if used != user && Some(layer) >= layer_of(user) {
                    up.push((user, used.to_owned(), description));
                }
            }
        }
        up
    }

    /// Returns the sets of modules that use each other, directly or indirectly.
    fn cycles(&self) -> Vec<BTreeSet<String>> {
        let paths: Vec<&Names> = self.0.keys().filter(|path| !path.is_empty()).collect();
        let components = strongly_connected_components(&paths, |path| {
            let module = &self.0[*path];
            let used = module.used().map(|used| &self.defining_module(&used).path);
            used.filter(|used| !used.is_empty() && used != path)
                .collect::<BTreeSet<_>>()
        });
        let cycles = components.into_iter().filter(|paths| paths.len() > 1);
        cycles
            .map(|paths| paths.iter().map(|path| path.join("::")).collect())
            .collect()
    }
}

#[test]
fn modules_use_only_lower_layers() {
    let found = Crate::read();
    let root = &found.0[&Names::new()];
    let modules: BTreeSet<&str> = root.children.iter().map(String::as_str).collect();
    assert_eq!(modules, LAYERS.concat().into_iter().collect());

    let up = found.upward_uses();
    assert!(up.is_empty(), "uses of higher layers: {up:#?}");
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
fn files_have_no_cyclic_dependencies() {
    let cycles = Crate::read().cycles();
    assert!(cycles.is_empty(), "{cycles:#?}");
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
fn planted_cycles_are_found_inside_a_module_and_through_re_exports() {
    let before = Crate::read().cycles().len();
    for (path, text) in [
        (["neighbor", "ranges"], "use super::engine::tree::Tree;"),
        (["flock", "scenario"], "use crate::flock::World;"),
        (["line", "scenario"], "fn step(line: &crate::line::Line) {}"),
    ] {
        let cycles = Crate::read().with_use(&path, text).cycles();
        assert_eq!(cycles.len(), before + 1, "{path:?}");
    }
}
