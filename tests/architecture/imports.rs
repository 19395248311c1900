//! Which file of a crate uses which, and the circles among them.
//!
//! A name that reaches a file through `pub use` counts as that of the file it is from; a `mod.rs` or `lib.rs` that
//! only declares and passes on its children uses none of them.

use super::tokens::{tokens, without_tests};
use std::collections::{BTreeMap, BTreeSet};

/// A place in the tree of modules: names from the root of the crate.
type Place = Vec<String>;

/// A module with a file of its own.
#[derive(Debug, Default)]
struct Module {
    children: BTreeSet<String>,
    /// Names that `use` brings in, with the paths they are from.
    imported: BTreeMap<String, Place>,
    /// Paths of `use x::*`.
    globs: Vec<Place>,
    /// Items of this file.
    defined: BTreeSet<String>,
    /// Paths that the file uses, relative to the root of the crate or to itself.
    used: Vec<Place>,
}

/// One file or folder that uses another beside it, and the path by which it does.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Use {
    pub from: String,
    pub to: String,
    pub path: String,
}

pub struct Crate {
    modules: BTreeMap<Place, Module>,
    /// Macros that `#[macro_export]` puts into the root, with their modules.
    exported: BTreeMap<String, Place>,
}

impl Crate {
    /// From files as (path below the root, text): `lib.rs`, `a.rs`, `b/mod.rs`, `b/c.rs`.
    pub fn new<'a>(files: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let mut this = Self { modules: BTreeMap::new(), exported: BTreeMap::new() };
        let mut texts = BTreeMap::new();
        for (path, text) in files {
            let mut place: Place = path.trim_end_matches(".rs").split('/').map(String::from).collect();
            if ["mod", "lib", "main"].contains(&place[place.len() - 1].as_str()) {
                place.pop();
            }
            texts.insert(place, text);
        }
        // From the root down, so that files that only tests declare are not reached.
        let mut open = vec![Place::new()];
        while let Some(place) = open.pop() {
            let Some(text) = texts.get(&place) else { continue };
            if text.contains("#[macro_export]") {
                let names = text.split("macro_rules! ").skip(1);
                let name =
                    |t: &str| t.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or("").to_string();
                this.exported.extend(names.map(|t| (name(t), place.clone())));
            }
            let module = parse(&without_tests(tokens(text)));
            open.extend(module.children.iter().map(|child| [&place[..], std::slice::from_ref(child)].concat()));
            this.modules.insert(place, module);
        }
        this
    }

    /// The file that a path leads to, seen from a module; none for other crates and local names.
    fn resolve(&self, from: &Place, path: &[String], depth: usize) -> Option<Place> {
        let (first, rest) = path.split_first()?;
        let module = &self.modules[from];
        match first.as_str() {
            // Imports that lead in circles lead nowhere.
            _ if depth > 20 => None,
            "crate" => self.walk(&Place::new(), rest, depth),
            "self" => self.walk(from, rest, depth),
            "super" => self.walk(&from[..from.len().checked_sub(1)?].to_vec(), rest, depth),
            name if module.children.contains(name) || module.imported.contains_key(name) => {
                self.walk(from, path, depth)
            }
            _ => None,
        }
    }

    fn walk(&self, at: &Place, path: &[String], depth: usize) -> Option<Place> {
        let module = &self.modules[at];
        let Some((first, rest)) = path.split_first() else { return Some(at.clone()) };
        if first == "super" || first == "self" {
            return self.resolve(at, path, depth + 1);
        }
        let child = [&at[..], std::slice::from_ref(first)].concat();
        if self.modules.contains_key(&child) && module.children.contains(first) {
            return self.walk(&child, rest, depth);
        }
        if let Some(import) = module.imported.get(first) {
            // `use super::f as f` of a name of its own would come back here.
            return self.resolve(at, &[&import[..], rest].concat(), depth + 1);
        }
        if at.is_empty()
            && !module.defined.contains(first)
            && let Some(home) = self.exported.get(first)
        {
            return Some(home.clone());
        }
        if !module.defined.contains(first) && depth < 20 {
            for glob in &module.globs {
                let home = self.resolve(at, glob, depth + 1).filter(|home| home != at);
                if let Some(home) = home.filter(|home| self.holds(home, first)) {
                    return self.walk(&home, path, depth + 1);
                }
            }
        }
        Some(at.clone())
    }

    fn holds(&self, place: &Place, name: &str) -> bool {
        let module = &self.modules[place];
        module.defined.contains(name) || module.imported.contains_key(name) || module.children.contains(name)
    }

    /// Names of the folders down to the file, and of the file.
    fn location(&self, place: &Place) -> Place {
        let own = if self.modules[place].children.is_empty() { None } else { Some("mod.rs".to_string()) };
        place.iter().cloned().chain(own).collect()
    }

    /// What uses what within each folder. Files of a folder below count as that folder.
    pub fn uses(&self) -> BTreeMap<String, Vec<Use>> {
        let mut out: BTreeMap<String, BTreeMap<(String, String), Use>> = BTreeMap::new();
        for (place, module) in &self.modules {
            for path in &module.used {
                let Some(target) = self.resolve(place, path, 0) else { continue };
                let (from, to) = (self.location(place), self.location(&target));
                let Some(k) = from.iter().zip(&to).position(|(a, b)| a != b) else { continue };
                let (a, b) = (from[k].clone(), to[k].clone());
                let known = out.entry(from[..k].join("/")).or_default();
                let path = format!("{} uses {}", from.join("/"), path.join("::"));
                known.entry((a.clone(), b.clone())).or_insert(Use { from: a, to: b, path });
            }
        }
        out.into_iter().map(|(folder, uses)| (folder, uses.into_values().collect())).collect()
    }

    /// The circles of each folder, with a line for every use that is part of one.
    pub fn circles(&self) -> Vec<String> {
        let mut out = Vec::new();
        for (folder, uses) in self.uses() {
            let reached = reached(&uses);
            let circular = |u: &Use| reached[&u.to].contains(&u.from);
            let mut lines: Vec<String> = uses
                .iter()
                .filter(|u| circular(u))
                .map(|u| format!("{folder}/: {} -> {} ({})", u.from, u.to, u.path))
                .collect();
            out.append(&mut lines);
        }
        out
    }
}

/// For every node what can be reached from it.
fn reached(uses: &[Use]) -> BTreeMap<String, BTreeSet<String>> {
    let nodes: BTreeSet<&String> = uses.iter().flat_map(|u| [&u.from, &u.to]).collect();
    let from = |node: &String| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![node]);
        while let Some(next) = open.pop() {
            for u in uses.iter().filter(|u| u.from == *next) {
                if seen.insert(u.to.clone()) {
                    open.push(&u.to);
                }
            }
        }
        seen
    };
    nodes.into_iter().map(|node| (node.clone(), from(node))).collect()
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Children, imports, items and used paths of a file.
fn parse(tokens: &[String]) -> Module {
    let mut module = Module::default();
    let declared = tokens.windows(3).filter(|t| t[0] == "mod" && t[2] == ";");
    module.children.extend(declared.map(|t| t[1].clone()));
    let mut mentioned = BTreeSet::new();
    // Braces that are open, and how many of them are those of modules within the file.
    let (mut open, mut i) = (Vec::new(), 0);
    while i < tokens.len() {
        let token = tokens[i].as_str();
        let inner = open.iter().filter(|is_module| **is_module).count();
        let top = open.len() == inner;
        match token {
            "use" if i == 0 || [";", "}", "{", "]", "pub", ")"].contains(&tokens[i - 1].as_str()) => {
                let end = i + tokens[i..].iter().position(|t| t == ";").unwrap_or(tokens.len() - i);
                let public = i > 0 && ["pub", ")"].contains(&tokens[i - 1].as_str());
                let mut leaves = Vec::new();
                tree(&tokens[i + 1..end], &mut Vec::new(), &mut leaves);
                for (path, name) in leaves {
                    record(&mut module, path, name, (public, top), inner);
                }
                i = end + 1;
                continue;
            }
            "{" => open.push(i >= 2 && tokens[i - 2] == "mod"),
            "}" => {
                open.pop();
            }
            "fn" | "struct" | "enum" | "trait" | "type" | "const" | "static" | "union" if top => {
                module.defined.extend(tokens.get(i + 1).cloned());
            }
            "macro_rules" => module.defined.extend(tokens.get(i + 2).cloned()),
            _ if is_name(token) && tokens.get(i + 1).is_some_and(|t| t == "::") => {
                let begins = i == 0 || tokens[i - 1] != "::";
                if begins {
                    let mut path = vec![token.to_string()];
                    while tokens.get(i + 1).is_some_and(|t| t == "::") && tokens.get(i + 2).is_some_and(|t| is_name(t))
                    {
                        path.push(tokens[i + 2].clone());
                        i += 2;
                    }
                    module.used.extend(outward(path, inner));
                }
            }
            _ if i == 0 || ![".", "fn", "mod"].contains(&tokens[i - 1].as_str()) => {
                mentioned.insert(token);
            }
            _ => {}
        }
        i += 1;
    }
    // A folder's own code with a name that the folder passes on.
    let of_child = |path: &Place| path.iter().find(|s| *s != "self").is_some_and(|s| module.children.contains(s));
    let named = module.imported.iter().filter(|(name, path)| mentioned.contains(name.as_str()) && of_child(path));
    let named: Vec<Place> = named.map(|(_, path)| path.clone()).collect();
    module.used.extend(named);
    module
}

/// A path of a module within the file as one of the file itself; none if it stays within.
fn outward(path: Place, inner: usize) -> Option<Place> {
    let supers = path.iter().take_while(|s| *s == "super").count();
    match inner {
        0 => Some(path),
        _ if path[0] == "crate" => Some(path),
        _ if supers > inner => Some(path[inner..].to_vec()),
        _ => None,
    }
}

fn record(module: &mut Module, path: Place, name: String, (public, top): (bool, bool), inner: usize) {
    let Some(path) = outward(path, inner) else { return };
    let own_child = path.iter().find(|s| *s != "self").is_some_and(|s| module.children.contains(s));
    if name == "*" {
        if top && inner == 0 {
            module.globs.push(path.clone());
        }
    } else if top && inner == 0 && path != [name.as_str()] {
        module.imported.insert(name, path.clone());
    }
    // A folder that passes on what its files have uses none of them.
    if !(public && own_child) {
        module.used.push(path);
    }
}

/// The leaves of a `use`: whole path, and the name that it brings in.
fn tree(tokens: &[String], prefix: &mut Place, out: &mut Vec<(Place, String)>) {
    let mut start = 0;
    let mut depth = 0;
    for i in 0..=tokens.len() {
        let token = tokens.get(i).map_or(",", String::as_str);
        match token {
            "{" => depth += 1,
            "}" => depth -= 1,
            "," if depth == 0 => {
                branch(&tokens[start..i], prefix, out);
                start = i + 1;
            }
            _ => {}
        }
    }
}

fn branch(tokens: &[String], prefix: &mut Place, out: &mut Vec<(Place, String)>) {
    if tokens.is_empty() {
        return;
    }
    if let Some(brace) = tokens.iter().position(|t| t == "{") {
        let before = prefix.len();
        prefix.extend(tokens[..brace].iter().filter(|t| is_name(t)).cloned());
        tree(&tokens[brace + 1..tokens.len() - 1], prefix, out);
        prefix.truncate(before);
        return;
    }
    let renamed = tokens.iter().position(|t| t == "as");
    let own = &tokens[..renamed.unwrap_or(tokens.len())];
    let mut path: Place = prefix.iter().chain(own.iter().filter(|t| is_name(t))).cloned().collect();
    if path.len() > 1 && path.last().is_some_and(|s| s == "self") {
        path.pop();
    }
    let name = match renamed {
        Some(i) => tokens[i + 1].clone(),
        None if own.last().is_some_and(|t| t == "*") => "*".into(),
        None => path.last().cloned().unwrap_or_default(),
    };
    out.push((path, name));
}

#[cfg(test)]
fn circles(files: &[(&str, &str)]) -> Vec<String> {
    Crate::new(files.iter().copied()).circles()
}

#[test]
fn circles_between_files_and_between_folders_are_found() {
    let found = circles(&[
        ("lib.rs", "pub mod a; pub mod b;"),
        ("a/mod.rs", "mod one; mod two; pub use one::One; pub use two::{self, Two};"),
        ("a/one.rs", "use super::Two; pub struct One(Two);"),
        ("a/two.rs", "pub struct Two; fn f() { super::one::g() }"),
        ("b/mod.rs", "mod inner; pub struct B;"),
        ("b/inner.rs", "use super::B;"),
    ]);
    assert_eq!(
        found,
        ["a/: one -> two (a/one uses super::Two)", "a/: two -> one (a/two uses super::one::g)"],
        "what b/inner.rs takes from b/mod.rs is no circle"
    );
    let found = circles(&[
        ("lib.rs", "pub mod a; pub mod b; pub mod c; pub use a::deep::Name as Short;"),
        ("a/mod.rs", "pub mod deep;"),
        ("a/deep.rs", "use crate::b::{B, C as D}; pub struct Name;"),
        ("b.rs", "use crate::c; pub struct B;"),
        ("c.rs", "pub fn f(_: crate::Short) {}"),
    ]);
    let starts: Vec<&str> = found.iter().map(|line| line.split(" (").next().unwrap()).collect();
    assert_eq!(starts, ["/: a -> b", "/: b -> c", "/: c -> a"], "{found:?}");
}

#[test]
fn a_module_file_that_uses_its_children_is_in_a_circle_with_those_that_use_it() {
    let files = |text| [("lib.rs", "mod a;"), ("a/mod.rs", text), ("a/b.rs", "use super::Own;")];
    assert_eq!(circles(&files("mod b; pub use b::X; pub struct Own;")), Vec::<String>::new());
    for text in [
        "mod b; use b::X; pub struct Own;",
        "mod b; pub struct Own; fn f() { b::g() }",
        "mod b; pub struct Own; fn f() { let x = self::b::X; }",
        "pub use b::X; mod b; pub struct Own(X);",
    ] {
        assert_eq!(circles(&files(text)).len(), 2, "{text}");
    }
}

#[test]
fn other_crates_tests_and_inner_modules_make_no_circle() {
    let files = [
        ("lib.rs", "mod a; mod b; #[cfg(test)] mod b_tests;"),
        ("a.rs", "use std::b::X; use super::b; #[cfg(test)] mod tests { use crate::b_tests; }"),
        (
            "b.rs",
            "pub mod inside { use super::Y; } pub struct Y; #[cfg(test)] mod tests { use super::*; use crate::a; }",
        ),
        ("b_tests.rs", "use crate::{a, b};"),
    ];
    assert_eq!(circles(&files), Vec::<String>::new());
}

#[test]
fn names_come_from_where_globs_renames_and_exported_macros_lead() {
    let files = [
        ("lib.rs", "mod a; mod b; mod c; pub use a::*; pub use b::Old as New;"),
        ("a.rs", "use crate::New; pub struct A;"),
        ("b.rs", "use crate::shout; pub struct Old;"),
        ("c.rs", "#[macro_export] macro_rules! shout { () => { $crate::A } }"),
    ];
    let found = circles(&files);
    let starts: Vec<&str> = found.iter().map(|line| line.split(" (").next().unwrap()).collect();
    assert_eq!(starts, ["/: a -> b", "/: b -> c", "/: c -> a"], "{found:?}");
}
