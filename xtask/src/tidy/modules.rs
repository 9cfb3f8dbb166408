//! Which module of a crate uses which other one, from the syntax of its files.
//!
//! A path is followed from the module it stands in, through the re-exports on its way, to the file that
//! defines what it names. Passing a name on (`pub use`) is not using it. Code of tests does not count.

use std::collections::{BTreeMap, BTreeSet};

use syn::visit::{self, Visit};

use super::sources::SourceFile;

/// A use of an item of another module.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Use {
    /// File of the module that uses.
    pub from: String,
    /// Line of the use, from 1.
    pub line: usize,
    /// File of the module that is used.
    pub to: String,
}

/// All uses between the modules of a crate whose files lie under `folder`, such as `crates/geom/src`.
pub fn uses(folder: &str, sources: &[SourceFile]) -> anyhow::Result<Vec<Use>> {
    let mut modules = BTreeMap::new();
    for source in sources.iter().filter(|source| !source.is_test()) {
        let own = source.path.strip_prefix(folder).and_then(|path| path.strip_prefix('/'));
        if let Some(path) = own.and_then(module_path) {
            modules.insert(path.clone(), Module::parse(source, path)?);
        }
    }
    let crate_modules = Modules(modules);
    let found = crate_modules.0.values().flat_map(|module| crate_modules.used_by(module));
    Ok(found.collect::<BTreeSet<_>>().into_iter().collect())
}

/// Names from the root of the crate to a module, by its file; none for programs.
fn module_path(file: &str) -> Option<Vec<String>> {
    let stem = file.strip_suffix(".rs").filter(|stem| *stem != "main" && !stem.starts_with("bin/"))?;
    let mut path: Vec<String> = stem.split('/').map(str::to_owned).collect();
    if path.last().is_some_and(|last| last == "mod") || path == ["lib"] {
        path.pop();
    }
    Some(path)
}

/// A path in the code: its names and its line.
#[derive(Debug)]
struct NamePath {
    names: Vec<String>,
    line: usize,
}

/// Names in a file.
#[derive(Debug, Default)]
struct Module {
    file: String,
    path: Vec<String>,
    /// Names brought in by `use`, and whether they are passed on.
    imports: BTreeMap<String, (NamePath, bool)>,
    /// Modules of which all names are brought in.
    globs: Vec<NamePath>,
    /// Paths outside of `use`.
    paths: Vec<NamePath>,
}

impl Module {
    fn parse(source: &SourceFile, path: Vec<String>) -> anyhow::Result<Self> {
        let mut module = Self { file: source.path.clone(), path, ..Self::default() };
        module.visit_file(&source.syntax()?);
        Ok(module)
    }

    /// Adds the leaves of a `use`, which begins with the names in `before`.
    fn add_imports(&mut self, tree: &syn::UseTree, before: &[String], passed_on: bool) {
        let with = |ident: &syn::Ident| [before, &[ident.to_string()]].concat();
        let mut add = |name: String, names: Vec<String>, ident: &syn::Ident| {
            let names = if names.last().is_some_and(|last| last == "self") { before.to_vec() } else { names };
            let name = if name == "self" { before.last().cloned().unwrap_or_default() } else { name };
            let line = ident.span().start().line;
            self.imports.insert(name, (NamePath { names, line }, passed_on));
        };
        match tree {
            syn::UseTree::Path(path) => self.add_imports(&path.tree, &with(&path.ident), passed_on),
            syn::UseTree::Name(name) => add(name.ident.to_string(), with(&name.ident), &name.ident),
            syn::UseTree::Rename(name) => add(name.rename.to_string(), with(&name.ident), &name.ident),
            syn::UseTree::Glob(glob) => {
                let line = glob.star_token.spans[0].start().line;
                self.globs.push(NamePath { names: before.to_vec(), line });
            }
            syn::UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.add_imports(tree, before, passed_on));
            }
        }
    }

    /// Whether a name is used outside of `use`.
    fn says(&self, name: &str) -> bool {
        self.paths.iter().any(|path| path.names.first().is_some_and(|first| first == name))
    }
}

impl<'a> Visit<'a> for Module {
    fn visit_item(&mut self, item: &'a syn::Item) {
        if !is_test(item) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        self.add_imports(&item.tree, &[], !matches!(item.vis, syn::Visibility::Inherited));
    }

    /// `pub(crate)` uses nothing.
    fn visit_visibility(&mut self, _: &'a syn::Visibility) {}

    fn visit_path(&mut self, path: &'a syn::Path) {
        if let Some(first) = path.segments.first() {
            let names = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
            self.paths.push(NamePath { names, line: first.ident.span().start().line });
        }
        visit::visit_path(self, path);
    }
}

/// Whether an item is compiled for tests only.
pub fn is_test(item: &syn::Item) -> bool {
    let attributes = match item {
        syn::Item::Const(item) => &item.attrs,
        syn::Item::Enum(item) => &item.attrs,
        syn::Item::Fn(item) => &item.attrs,
        syn::Item::Impl(item) => &item.attrs,
        syn::Item::Mod(item) => &item.attrs,
        syn::Item::Struct(item) => &item.attrs,
        syn::Item::Trait(item) => &item.attrs,
        syn::Item::Type(item) => &item.attrs,
        syn::Item::Use(item) => &item.attrs,
        _ => return false,
    };
    attributes.iter().any(|attribute| match &attribute.meta {
        syn::Meta::Path(path) => path.is_ident("test"),
        syn::Meta::List(list) => list.path.is_ident("cfg") && list.tokens.to_string() == "test",
        syn::Meta::NameValue(_) => false,
    })
}

/// The modules of a crate by their paths.
struct Modules(BTreeMap<Vec<String>, Module>);

impl Modules {
    fn used_by(&self, module: &Module) -> Vec<Use> {
        let imports = module.imports.iter().filter(|(name, (_, passed_on))| !passed_on || module.says(name));
        let imports = imports.map(|(_, (reference, _))| reference);
        let paths = module.paths.iter().filter(|path| path.names.len() > 1);
        let references = imports.chain(&module.globs).chain(paths);
        let used = references.filter_map(|reference| {
            let to = self.file_of(&module.path, &reference.names, &mut BTreeSet::new())?;
            Some(Use { from: module.file.clone(), line: reference.line, to })
        });
        used.filter(|used| used.to != used.from).collect()
    }

    /// The file that defines what `names` says in the module `at`; none for other crates. `seen` guards
    /// against re-exports in a circle.
    fn file_of(&self, at: &[String], names: &[String], seen: &mut BTreeSet<Vec<String>>) -> Option<String> {
        let (mut here, rest) = self.start(at, names)?;
        let mut rest = rest.iter();
        while let Some(name) = rest.next() {
            let child = [&here[..], std::slice::from_ref(name)].concat();
            if self.0.contains_key(&child) {
                here = child;
                continue;
            }
            if let Some((reference, _)) = self.0.get(&here)?.imports.get(name)
                && seen.insert(child)
            {
                let names: Vec<String> = reference.names.iter().chain(rest).cloned().collect();
                return self.file_of(&here, &names, seen).or_else(|| self.file(&here));
            }
            break;
        }
        self.file(&here)
    }

    fn file(&self, path: &[String]) -> Option<String> {
        self.0.get(path).map(|module| module.file.clone())
    }

    /// The module that a path begins in, and the names after that.
    fn start<'a>(&self, at: &[String], names: &'a [String]) -> Option<(Vec<String>, &'a [String])> {
        let mut here = at.to_vec();
        let mut rest = names;
        match names.first()?.as_str() {
            "crate" => (here, rest) = (Vec::new(), &names[1..]),
            "self" => rest = &names[1..],
            "super" => {}
            first => {
                here.push(first.to_owned());
                return self.0.contains_key(&here).then(|| (here, &names[1..]));
            }
        }
        while let Some(("super", after)) = rest.split_first().map(|(first, after)| (first.as_str(), after)) {
            here.pop();
            rest = after;
        }
        Some((here, rest))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Sources of a crate `a`, given by paths under its `src` and texts.
    pub fn sources(files: &[(&str, &str)]) -> Vec<SourceFile> {
        files.iter().map(|(path, text)| SourceFile::new(format!("crates/a/src/{path}"), text)).collect()
    }

    fn found(files: &[(&str, &str)]) -> Vec<(String, String)> {
        let short = |path: &str| path.trim_start_matches("crates/a/src/").to_owned();
        let uses = uses("crates/a/src", &sources(files)).unwrap();
        uses.iter().map(|found| (short(&found.from), short(&found.to))).collect()
    }

    #[test]
    fn uses_are_found_through_re_exports() {
        let files = [
            ("lib.rs", "mod low;\nmod high;\npub use low::Thing;\n"),
            ("low/mod.rs", "mod inner;\npub use inner::Thing;\n"),
            ("low/inner.rs", "pub struct Thing;\n"),
            ("high.rs", "use crate::Thing;\nuse std::fmt::Debug;\n"),
        ];
        assert_eq!(found(&files), [("high.rs".into(), "low/inner.rs".into())]);
    }

    #[test]
    fn uses_are_found_in_groups_paths_and_upwards() {
        let files = [
            ("lib.rs", "mod a;\nmod b;\nmod c;\n"),
            ("a/mod.rs", "mod x;\npub struct A;\nfn f() { x::g(); crate::b::h(); }\n"),
            ("a/x.rs", "use super::{super::c::{self, C}, A};\npub fn g() {}\n"),
            ("b.rs", "pub fn h() {}\n"),
            ("c.rs", "pub struct C;\n"),
        ];
        let want = [("a/mod.rs", "a/x.rs"), ("a/mod.rs", "b.rs"), ("a/x.rs", "a/mod.rs"), ("a/x.rs", "c.rs")];
        let mut found = found(&files);
        found.dedup();
        assert_eq!(found, want.map(|(from, to)| (from.to_owned(), to.to_owned())));
    }

    #[test]
    fn what_is_passed_on_and_used_is_used() {
        let files = [("lib.rs", "mod a;\npub use a::A;\npub fn f(_: A) {}\n"), ("a.rs", "pub struct A;\n")];
        assert_eq!(found(&files), [("lib.rs".into(), "a.rs".into())]);
    }

    #[test]
    fn tests_use_what_they_like() {
        let files = [
            ("lib.rs", "mod a;\nmod b;\n"),
            (
                "a.rs",
                "#[cfg(test)]\nmod tests { use crate::b::B; }\n#[cfg(test)]\nfn f() { crate::b::g(); }\n",
            ),
            ("a/tests.rs", "use crate::b::B;\n"),
            ("b.rs", "pub struct B;\n"),
        ];
        assert!(found(&files).is_empty());
    }
}
