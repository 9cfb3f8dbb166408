//! Functions and comments of a size that is read at one glance.

use proc_macro2::Span;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

use super::modules::is_test;
use super::sources::SourceFile;

/// Most parameters of a function, the receiver included.
const MOST_PARAMETERS: usize = 7;
/// Most lines of a function, from `fn` to the last brace.
const LONGEST_FUNCTION: usize = 60;
/// Most columns of a comment, as for code.
const WIDEST_COMMENT: usize = 110;

/// Offences against the limits, and parameters that take a tuple apart: `(a, b): (A, B)`.
pub fn offences(sources: &[SourceFile]) -> anyhow::Result<Vec<String>> {
    let of_sources = sources.iter().map(of_source).collect::<anyhow::Result<Vec<_>>>()?;
    Ok(of_sources.concat())
}

fn of_source(source: &SourceFile) -> anyhow::Result<Vec<String>> {
    let path = &source.path;
    let comments = source.lines.iter().enumerate().filter(|(_, line)| line.trim_start().starts_with("//"));
    let wide = comments.filter(|(_, line)| line.chars().count() > WIDEST_COMMENT);
    let mut offences: Vec<String> = wide
        .map(|(index, _)| format!("{path}:{}: a comment of more than {WIDEST_COMMENT} columns", index + 1))
        .collect();
    let mut functions = Functions { path, offences: Vec::new() };
    if !source.is_test() {
        functions.visit_file(&source.syntax()?);
    }
    offences.extend(functions.offences);
    Ok(offences)
}

struct Functions<'a> {
    path: &'a str,
    offences: Vec<String>,
}

impl Functions<'_> {
    fn check(&mut self, signature: &syn::Signature, end: usize) {
        let start = signature.span().start().line;
        let (path, name, count) = (self.path, &signature.ident, signature.inputs.len());
        if signature.inputs.iter().any(is_tuple) {
            self.offences.push(format!("{path}:{start}: a parameter of `{name}` is a tuple without a name"));
        }
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
        of_source(&SourceFile::new("crates/a/src/a.rs".into(), text)).unwrap()
    }

    #[test]
    fn parameters_are_counted() {
        assert!(found("fn f(a: u8, b: u8, c: u8, d: u8, e: u8, f: u8, g: u8) {}").is_empty());
        let found =
            found("struct S;\nimpl S {\n fn f(&self, a: T, b: T, c: T, d: u8, e: u8, f: u8, g: u8) {}\n}");
        assert_eq!(found, ["crates/a/src/a.rs:3: `f` has 8 parameters, more than 7"]);
    }

    #[test]
    fn tuples_without_a_name_are_found() {
        let found = found("fn f(a: u8, b: (u8, u8)) {}\nimpl S {\n fn g((d, (e, h)): T) {}\n}\n");
        assert_eq!(found, ["crates/a/src/a.rs:3: a parameter of `g` is a tuple without a name"]);
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
