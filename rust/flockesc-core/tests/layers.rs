//! Rooms of the crate lie in layers: each uses only rooms of lower layers.

#![allow(clippy::expect_used, clippy::panic)] // helpers of tests: a panic is the failure report

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, ItemUse, Macro, UseTree};

/// Rooms by layer, the lowest first. Rooms of one layer do not use each other.
const LAYERS: [&[&str]; 10] = [
    &["base"],
    &["parallel", "snapshot"],
    &["agents"],
    &["neighbor"],
    &["predator"],
    &["flock", "line"],
    &["reward"],
    &["observation"],
    &["episode"],
    &["sweep", "graph"],
];

/// Uses that still run up: (from, to).
const STANDING: [(&str, &str); 1] = [("observation", "episode")];

/// The layer of a room.
fn layer_of(room: &str) -> Option<usize> {
    LAYERS.iter().position(|rooms| rooms.contains(&room))
}

/// One module with its inline modules, and what it uses.
struct Module {
    /// Its path from the root of the crate.
    path: Vec<String>,
    /// Its file modules.
    children: Vec<String>,
    /// Paths from the root of the crate that occur in it.
    used: BTreeSet<Vec<String>>,
}

impl Module {
    /// Records a path that begins with `crate`, `self` or `super`; others are local or of other crates.
    fn record(&mut self, segments: &[String]) {
        let supers = segments.iter().take_while(|s| *s == "super").count();
        let mut used = match segments.first().map(String::as_str) {
            Some("crate") => Vec::new(),
            Some("self") => self.path.clone(),
            Some("super") => self.path[..self.path.len() - supers].to_vec(),
            _ => return,
        };
        used.extend_from_slice(&segments[supers.max(1)..]);
        self.used.insert(used);
    }

    /// Records every path of a tree of uses.
    fn record_tree(&mut self, tree: &UseTree, before: &[String]) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.record_tree(&path.tree, &with(&path.ident)),
            UseTree::Name(name) => self.record(&with(&name.ident)),
            UseTree::Rename(rename) => self.record(&with(&rename.ident)),
            UseTree::Glob(_) => self.record(before),
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.record_tree(tree, before);
                }
            }
        }
    }
}

impl Visit<'_> for Module {
    fn visit_item(&mut self, item: &Item) {
        if !is_for_tests(attributes_of(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, module: &ItemMod) {
        let name = module.ident.to_string();
        if module.content.is_none() {
            self.children.push(name);
        } else {
            self.path.push(name);
            visit::visit_item_mod(self, module);
            self.path.pop();
        }
    }

    fn visit_item_use(&mut self, item: &ItemUse) {
        self.record_tree(&item.tree, &[]);
    }

    fn visit_path(&mut self, path: &syn::Path) {
        let segments: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        self.record(&segments);
        visit::visit_path(self, path);
    }

    /// What a macro is given or makes is text here: only its `crate::` paths are found.
    fn visit_macro(&mut self, found: &Macro) {
        let text: String = found.tokens.to_string().split_whitespace().collect();
        for (at, prefix) in text.match_indices("crate::") {
            let rest = &text[at + prefix.len()..];
            let room = rest.split(|c: char| !c.is_alphanumeric() && c != '_');
            let room = room.map(str::to_owned).next().unwrap_or_default();
            self.used.insert(vec![room]);
        }
        visit::visit_macro(self, found);
    }

    /// The path of `pub(in ..)` is no use.
    fn visit_visibility(&mut self, _: &syn::Visibility) {}
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

/// The module at `path` and all below it that are not for tests alone.
fn modules(source: &Path, path: Vec<String>, found: &mut Vec<(PathBuf, Module)>) {
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
    let mut module = Module {
        path,
        children: Vec::new(),
        used: BTreeSet::new(),
    };
    module.visit_file(&syn::parse_file(&text).expect("a file that compiles"));
    for child in &module.children {
        let path = [&module.path[..], std::slice::from_ref(child)].concat();
        modules(source, path, found);
    }
    found.push((file, module));
}

#[test]
fn no_room_uses_one_above_it() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    modules(&source, Vec::new(), &mut found);

    let root = found.pop().expect("the root").1;
    let rooms: BTreeSet<&str> = root.children.iter().map(String::as_str).collect();
    assert_eq!(rooms, LAYERS.concat().into_iter().collect());

    let mut standing = BTreeSet::new();
    let mut up = Vec::new();
    for (file, module) in &found {
        let room = module.path[0].as_str();
        for used in &module.used {
            let file = file.strip_prefix(&source).expect("in the crate").display();
            let used_room = used.first().map(String::as_str).unwrap_or_default();
            let layer = layer_of(used_room)
                .unwrap_or_else(|| panic!("{file}: crate::{} names no room", used.join("::")));
            if used_room == room || Some(layer) < layer_of(room) {
                continue;
            }
            if STANDING.contains(&(room, used_room)) {
                standing.insert((room, used_room));
            } else {
                up.push(format!("{file}: crate::{}", used.join("::")));
            }
        }
    }
    assert!(up.is_empty(), "uses that run up:\n{}", up.join("\n"));
    assert_eq!(standing, STANDING.into(), "uses that no longer run up");
}
