//! Functions and comments of a size that is read at one glance.

use proc_macro2::Span;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

use super::modules::is_test;
use super::sources::SourceFile;

/// Most parameters of a function, the receiver and the parts of tuples included.
const MOST_PARAMETERS: usize = 7;
/// Most parameters of all functions that are tuples without a name: they may only become fewer.
const MOST_TUPLES: usize = 66;
/// Most lines of a function, from `fn` to the last brace.
const LONGEST_FUNCTION: usize = 60;
/// Most columns of a comment, as for code.
const WIDEST_COMMENT: usize = 110;

/// Offences against the limits, and how many parameters take a tuple apart: `(a, b): (A, B)`.
pub fn offences(sources: &[SourceFile]) -> anyhow::Result<(Vec<String>, usize)> {
    let (mut offences, mut tuple_count) = (Vec::new(), 0);
    for source in sources {
        let (own, tuples) = of_source(source)?;
        offences.extend(own);
        tuple_count += tuples;
    }
    if tuple_count > MOST_TUPLES {
        offences.push(format!("{tuple_count} parameters are tuples, more than {MOST_TUPLES}"));
    }
    Ok((offences, tuple_count))
}

/// Offences in a source, and the number of its tuples.
fn of_source(source: &SourceFile) -> anyhow::Result<(Vec<String>, usize)> {
    let path = &source.path;
    let comments = source.lines.iter().enumerate().filter(|(_, line)| line.trim_start().starts_with("//"));
    let wide = comments.filter(|(_, line)| line.chars().count() > WIDEST_COMMENT);
    let mut offences: Vec<String> = wide
        .map(|(index, _)| format!("{path}:{}: a comment of more than {WIDEST_COMMENT} columns", index + 1))
        .collect();
    let mut functions = Functions { path, offences: Vec::new(), tuple_count: 0 };
    if !source.is_test() {
        functions.visit_file(&source.syntax()?);
    }
    offences.extend(functions.offences);
    Ok((offences, functions.tuple_count))
}

struct Functions<'a> {
    path: &'a str,
    offences: Vec<String>,
    tuple_count: usize,
}

impl Functions<'_> {
    fn check(&mut self, signature: &syn::Signature, end: usize) {
        self.tuple_count += signature.inputs.iter().filter(|argument| is_tuple(argument)).count();
        let start = signature.span().start().line;
        let (path, name) = (self.path, &signature.ident);
        let count: usize = signature.inputs.iter().map(parameters).sum();
        if count > MOST_PARAMETERS {
            let limit = format!("{count} parameters, more than {MOST_PARAMETERS}");
            self.offences.push(format!("{path}:{start}: `{name}` has {limit}"));
        }
        let length = end + 1 - start;
        if length > LONGEST_FUNCTION {
            let limit = format!("{length} lines, more than {LONGEST_FUNCTION}");
            self.offences.push(format!("{path}:{start}: `{name}` has {limit}"));
        }
    }
}

fn last_line(span: Span) -> usize {
    span.end().line
}

fn is_tuple(argument: &syn::FnArg) -> bool {
    matches!(argument, syn::FnArg::Typed(argument) if matches!(*argument.pat, syn::Pat::Tuple(_)))
}

/// Weight of an argument: a tuple for as many as it has parts.
fn parameters(argument: &syn::FnArg) -> usize {
    match argument {
        syn::FnArg::Typed(argument) => parts(&argument.pat),
        syn::FnArg::Receiver(_) => 1,
    }
}

fn parts(pattern: &syn::Pat) -> usize {
    match pattern {
        syn::Pat::Tuple(tuple) => tuple.elems.iter().map(parts).sum(),
        _ => 1,
    }
}

impl<'a> Visit<'a> for Functions<'_> {
    fn visit_item(&mut self, item: &'a syn::Item) {
        if !is_test(item) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_fn(&mut self, function: &'a syn::ItemFn) {
        self.check(&function.sig, last_line(function.block.span()));
        visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, function: &'a syn::ImplItemFn) {
        self.check(&function.sig, last_line(function.block.span()));
        visit::visit_impl_item_fn(self, function);
    }

    fn visit_trait_item_fn(&mut self, function: &'a syn::TraitItemFn) {
        self.check(&function.sig, last_line(function.span()));
        visit::visit_trait_item_fn(self, function);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> Vec<String> {
        of_source(&SourceFile::new("crates/a/src/a.rs".into(), text)).unwrap().0
    }

    #[test]
    fn tuples_count_by_their_parts() {
        assert!(found("fn f(a: u8, b: u8, c: u8, (d, e): (u8, u8), f: u8, g: u8) {}").is_empty());
        let found =
            found("struct S;\nimpl S {\n fn f(&self, (a, (b, c)): T, d: u8, e: u8, f: u8, g: u8) {}\n}");
        assert_eq!(found, ["crates/a/src/a.rs:3: `f` has 8 parameters, more than 7"]);
    }

    #[test]
    fn tuples_without_a_name_are_counted() {
        let text = "fn f((a, b): (u8, u8), c: (u8, u8)) {}\nimpl S {\n fn g((d, (e, h)): T) {}\n}\n";
        let source = SourceFile::new("crates/a/src/a.rs".into(), text);
        assert_eq!(offences(&[source]).unwrap(), (Vec::new(), 2));
        let many = "fn f((a, b): (u8, u8)) {}\n".repeat(MOST_TUPLES + 1);
        let found = offences(&[SourceFile::new("crates/a/src/a.rs".into(), &many)]).unwrap();
        assert_eq!(found.0.len(), 1, "{found:?}");
    }

    #[test]
    fn long_functions_are_found_and_tests_may_be_long() {
        let body = "let x = 1;\n".repeat(LONGEST_FUNCTION - 2);
        assert!(found(&format!("fn f() {{\n{body}}}\n")).is_empty());
        let long = format!("fn f() {{\n{body}let y = 2;\n}}\n");
        assert_eq!(found(&long).len(), 1);
        assert!(found(&format!("#[cfg(test)]\nmod tests {{\n{long}}}\n")).is_empty());
    }

    #[test]
    fn wide_comments_are_found() {
        assert_eq!(found(&format!("//! {}\n", "x".repeat(WIDEST_COMMENT))).len(), 1);
        assert!(found(&format!("//! {}\n", "x".repeat(WIDEST_COMMENT - 4))).is_empty());
    }
}
