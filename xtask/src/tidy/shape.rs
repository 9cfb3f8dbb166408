//! Functions and comments of a size that is read at one glance.

use proc_macro2::Span;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

use super::TidyError;
use super::modules::is_test;
use super::sources::Source;

/// Most parameters of a function, the receiver and the parts of tuples included.
const MOST_PARAMETERS: usize = 6;
/// Most lines of a function, from `fn` to the last brace.
const LONGEST_FUNCTION: usize = 60;
/// Most columns of a comment, as for code.
const WIDEST_COMMENT: usize = 110;

/// Offences against the limits.
pub fn offences(sources: &[Source]) -> Result<Vec<String>, TidyError> {
    let mut offences = Vec::new();
    for source in sources {
        offences.extend(of_source(source)?);
    }
    Ok(offences)
}

fn of_source(source: &Source) -> Result<Vec<String>, TidyError> {
    let path = &source.path;
    let comments = source.lines.iter().enumerate().filter(|(_, line)| line.trim_start().starts_with("//"));
    let wide = comments.filter(|(_, line)| line.chars().count() > WIDEST_COMMENT);
    let mut offences: Vec<String> = wide
        .map(|(index, _)| format!("{path}:{}: a comment of more than {WIDEST_COMMENT} columns", index + 1))
        .collect();
    if !source.is_test() {
        let file = syn::parse_file(&source.text())
            .map_err(|error| TidyError::Syntax { path: path.clone(), error })?;
        let mut functions = Functions { path, offences: Vec::new() };
        functions.visit_file(&file);
        offences.extend(functions.offences);
    }
    Ok(offences)
}

struct Functions<'a> {
    path: &'a str,
    offences: Vec<String>,
}

impl Functions<'_> {
    fn check(&mut self, signature: &syn::Signature, end: usize) {
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
        of_source(&Source::new("crates/a/src/a.rs".into(), text)).unwrap()
    }

    #[test]
    fn tuples_count_by_their_parts() {
        assert!(found("fn f(a: u8, b: u8, c: u8, (d, e): (u8, u8), f: u8) {}").is_empty());
        let found = found("struct S;\nimpl S {\n fn f(&self, (a, (b, c)): T, d: u8, e: u8, f: u8) {}\n}");
        assert_eq!(found, ["crates/a/src/a.rs:3: `f` has 7 parameters, more than 6"]);
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
