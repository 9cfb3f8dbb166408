//! Labels with a little markup: `*t*` is italic, `_{12}` a subscript, `^{-1}` a superscript.
//!
//! kuva writes labels as plain `<text>`; [`typeset`] turns the markup inside them into `<tspan>`s, which
//! resvg and browsers draw alike.

/// Size of sub- and superscripts, as a fraction of the text around them.
const SCRIPT_SIZE: f64 = 0.7;
/// How far scripts are moved, in units of the surrounding font size.
const SUBSCRIPT_DROP: f64 = 0.2;
const SUPERSCRIPT_RISE: f64 = -0.36;

/// Mean width of a letter, a digit or a space, as a fraction of the size of the text.
const LETTER: f64 = 0.49;

/// About how wide a label is, its markup left out.
pub fn width(label: &str, size: f64) -> f64 {
    let (mut letters, mut rest) = (0.0, label);
    while !rest.is_empty() {
        let (piece, length) = next_piece(rest);
        letters += match piece {
            LabelPiece::Star => 0.0,
            LabelPiece::Script(_) => SCRIPT_SIZE * (rest[..length].chars().count() - 3) as f64,
            LabelPiece::Plain => rest[..length].chars().count() as f64,
        };
        rest = &rest[length..];
    }
    LETTER * size * letters
}

/// Replaces the markup in every `<text>` element of an SVG document by tspans.
pub fn typeset(svg: &str) -> String {
    let mut out = String::with_capacity(svg.len());
    let mut rest = svg;
    while let Some(start) = rest.find("<text") {
        let Some(open) = rest[start..].find('>').map(|at| start + at + 1) else { break };
        let Some(close) = rest[open..].find("</text>").map(|at| open + at) else { break };
        out.push_str(&rest[..open]);
        out.push_str(&tspans(&rest[open..close]));
        rest = &rest[close..];
    }
    out.push_str(rest);
    out
}

/// The markup of one label (already escaped for XML) as tspans.
pub fn tspans(label: &str) -> String {
    let mut out = String::new();
    let (mut italic, mut shift) = (false, 0.0);
    let mut rest = label;
    while !rest.is_empty() {
        let (script, length) = next_piece(rest);
        let (piece, tail) = rest.split_at(length);
        rest = tail;
        match script {
            LabelPiece::Star => italic = !italic,
            LabelPiece::Script(wanted) => {
                let inner = &piece[2..piece.len() - 1];
                out.push_str(&tspan(inner, italic, wanted - shift, true));
                shift = wanted;
            }
            LabelPiece::Plain => {
                out.push_str(&tspan(piece, italic, -shift, false));
                shift = 0.0;
            }
        }
    }
    out
}

enum LabelPiece {
    Star,
    Script(f64),
    Plain,
}

/// First item of `rest`, and how many bytes it takes.
fn next_piece(rest: &str) -> (LabelPiece, usize) {
    if rest.starts_with('*') {
        return (LabelPiece::Star, 1);
    }
    for (mark, shift) in [("_{", SUBSCRIPT_DROP), ("^{", SUPERSCRIPT_RISE)] {
        if let (true, Some(end)) = (rest.starts_with(mark), rest.find('}')) {
            return (LabelPiece::Script(shift), end + 1);
        }
    }
    let first = rest.chars().next().map_or(0, char::len_utf8);
    let next = ["*", "_{", "^{"].iter().filter_map(|mark| rest[first..].find(mark)).min();
    (LabelPiece::Plain, next.map_or(rest.len(), |at| first + at))
}

fn tspan(text: &str, italic: bool, shift: f64, script: bool) -> String {
    let mut attributes = String::new();
    if italic {
        attributes.push_str(r#" font-style="italic""#);
    }
    let em = if script { SCRIPT_SIZE } else { 1.0 };
    if shift != 0.0 {
        attributes.push_str(&format!(r#" dy="{:.4}em""#, shift / em));
    }
    if script {
        attributes.push_str(&format!(r#" font-size="{}%""#, SCRIPT_SIZE * 100.0));
    }
    if attributes.is_empty() { text.to_owned() } else { format!("<tspan{attributes}>{text}</tspan>") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_text_stays_as_it_is() {
        assert_eq!(tspans("gluey (paper)"), "gluey (paper)");
        assert_eq!(tspans("\u{2212}1/2"), "\u{2212}1/2");
        assert_eq!(tspans("_{open"), "_{open");
    }

    #[test]
    fn markup_has_no_width() {
        assert_eq!(width("*x*", 10.0), LETTER * 10.0);
        assert_eq!(width("10^{-5}", 10.0), LETTER * 10.0 * (2.0 + 2.0 * SCRIPT_SIZE));
    }

    #[test]
    fn italics_and_scripts_become_tspans() {
        assert_eq!(tspans("*t*"), r#"<tspan font-style="italic">t</tspan>"#);
        let label = tspans("10^{-3} a");
        assert!(label.starts_with("10<tspan dy=\"-0.5143em\" font-size=\"70%\">-3</tspan>"), "{label}");
        assert!(label.ends_with("<tspan dy=\"0.3600em\"> a</tspan>"), "the baseline must come back: {label}");
    }

    #[test]
    fn only_text_elements_are_touched() {
        let svg = "<svg><path d=\"*\"/><text x=\"1\">*D*</text></svg>";
        let set = typeset(svg);
        assert!(set.contains("<path d=\"*\"/>"));
        assert!(set.contains("<tspan font-style=\"italic\">D</tspan>"));
    }
}
