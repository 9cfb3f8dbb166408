//! Self-contained pages: their frame and style, and how numbers read.

use gluey_pictures::font_faces;

use super::BookFailure;

const STYLE: &str = "body{font-family:'Libertinus Serif',Georgia,serif;max-width:66rem;margin:2rem auto;padding:0 1rem;\
line-height:1.45;color:#111;background:#fff}h1,h2{font-weight:normal}section{margin-top:3rem}svg{max-width:100%;height:auto}\
table{border-collapse:collapse;margin:1rem 0;font-size:.9rem;display:block;overflow-x:auto}\
th,td{padding:.2rem .5rem;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap;font-variant-numeric:lining-nums}\
th{font-weight:normal;border-bottom:1px solid #111;vertical-align:bottom}td:first-child,th:first-child,td.t,th.t{text-align:left}\
.rows td.t{white-space:normal}.reason{color:#444;padding-left:2rem}.bad{color:#b00020}.note{background:#fff4d6;padding:.6rem 1rem}";

/// A whole page.
pub fn document(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n\
         <style>{}{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        font_faces()
    )
}

/// What stands under the title: a note on `--quick`, and what failed.
pub fn notes(quick: Option<&str>, failures: &[BookFailure]) -> String {
    let quick =
        quick.map(|text| format!("<p class=\"note\">Computed with <code>--quick</code>: {text}</p>\n"));
    let failures = failures.iter().map(|BookFailure { what, error }| {
        format!("<p class=\"note bad\">{}: {}</p>\n", escape(what), escape(error))
    });
    quick.into_iter().chain(failures).collect()
}

/// Tags of cells with text.
pub const TEXT: &str = "td class=\"t\"";
/// The same where something is wrong.
pub const BAD: &str = "td class=\"t bad\"";
/// The same over a column.
pub const TITLE: &str = "th class=\"t\"";

/// A row of a table, of cells with their tags.
pub fn row<S: AsRef<str>>(cells: impl IntoIterator<Item = (&'static str, S)>) -> String {
    let cell = |(tag, text): (&str, S)| format!("<{tag}>{}</{}>", text.as_ref(), &tag[..2]);
    format!("<tr>{}</tr>\n", cells.into_iter().map(cell).collect::<String>())
}

/// Four significant digits; a dash for what was not measured.
pub fn number(value: Option<f64>) -> String {
    match value {
        None => "–".to_owned(),
        Some(0.0) => "0".to_owned(),
        Some(value) if (1e-3..1e4).contains(&value.abs()) => {
            let digits = (3 - value.abs().log10().floor() as i32).max(0) as usize;
            format!("{value:.digits$}").replace('-', "−")
        }
        Some(value) => {
            let text = format!("{value:.2e}");
            let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
            format!("{mantissa}·10<sup>{exponent}</sup>").replace('-', "−")
        }
    }
}

/// The text with what HTML reserves replaced.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits_or_a_power_of_ten() {
        assert_eq!(number(Some(7.76913)), "7.769");
        assert_eq!(number(Some(-0.0153)), "−0.01530");
        assert_eq!(number(Some(4.03e-4)), "4.03·10<sup>−4</sup>");
        assert_eq!(number(Some(0.0)), "0");
        assert_eq!(number(None), "–");
    }
}
