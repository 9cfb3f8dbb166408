//! Texts that others wrote: UTF-8, with or without a byte order mark, and what is not seen in them.

use std::fs;
use std::io;
use std::path::Path;

use thiserror::Error;

/// What some programs begin a text with.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// A reason why a file is no text. It is the inside of an [`io::Error`] of the kind `InvalidData`.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum NotText {
    /// Two bytes for a letter.
    #[error("the file looks like UTF-16, not UTF-8")]
    Utf16,
    /// Another encoding, or no text at all.
    #[error("the file is not UTF-8 text, at line {line}, column {column}, byte {byte:02X}")]
    Other {
        /// Line, from 1.
        line: usize,
        /// Column, from 1, in characters.
        column: usize,
        /// The byte that fits to none before it.
        byte: u8,
    },
}

impl NotText {
    /// What to do about it.
    pub const HINT: &str = "save it as UTF-8";

    /// Whether an error, or what it came from, is that a file is no text.
    pub fn is_in(error: &(dyn std::error::Error + 'static)) -> bool {
        let is = |error: &(dyn std::error::Error + 'static)| {
            let inner = error.downcast_ref::<io::Error>().and_then(io::Error::get_ref);
            inner.is_some_and(|inner| inner.is::<Self>())
        };
        std::iter::successors(Some(error), |error| error.source()).any(is)
    }
}

/// The text of a file, without a byte order mark.
pub(crate) fn read(path: &Path) -> io::Result<String> {
    decoded(fs::read(path)?)
}

/// Bytes as text, without a byte order mark.
pub(crate) fn decoded(bytes: Vec<u8>) -> io::Result<String> {
    let not_text = |why| io::Error::new(io::ErrorKind::InvalidData, why);
    // In UTF-16 every letter of a case or list has a zero beside it.
    let is_utf16 = bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]);
    if is_utf16 || bytes.iter().take(2).any(|&byte| byte == 0) {
        return Err(not_text(NotText::Utf16));
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let (good, rest) = error.as_bytes().split_at(error.utf8_error().valid_up_to());
        let good = String::from_utf8_lossy(good);
        let line = good.matches('\n').count() + 1;
        let column = good.rsplit('\n').next().map_or(0, |line| line.chars().count()) + 1;
        not_text(NotText::Other { line, column, byte: rest[0] })
    })?;
    Ok(text.strip_prefix(BYTE_ORDER_MARK).map_or_else(|| text.clone(), str::to_owned))
}

/// A text as a message shows it: what one does not see is written out.
pub(crate) fn visible(text: &str) -> String {
    text.chars().fold(String::new(), |shown, c| match is_unseen(c) {
        true => shown + &named(c),
        false => {
            let mut shown = shown;
            shown.push(c);
            shown
        }
    })
}

/// How a character that is not seen is called.
pub(crate) fn named(c: char) -> String {
    match c {
        '\t' => "\\t".to_owned(),
        '\r' => "\\r".to_owned(),
        '\n' => "\\n".to_owned(),
        c => format!("U+{:04X}", u32::from(c)),
    }
}

/// Whether a character leaves no trace, or that of a blank that it is not.
pub(crate) fn is_unseen(c: char) -> bool {
    let is_format = matches!(c, '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}')
        || matches!(c, '\u{2060}'..='\u{206f}' | '\u{fe00}'..='\u{fe0f}' | BYTE_ORDER_MARK | '\u{fff9}'..='\u{fffb}');
    c.is_control() || is_format || (c.is_whitespace() && c != ' ')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn why(bytes: &[u8]) -> String {
        let error = decoded(bytes.to_vec()).expect_err("no text");
        assert!(NotText::is_in(&error), "{error}");
        error.to_string()
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_a_text() {
        assert_eq!(decoded(b"\xef\xbb\xbfx,y".to_vec()).expect("text"), "x,y");
        assert_eq!(decoded(b"".to_vec()).expect("text"), "");
    }

    #[test]
    fn what_is_no_text_is_named_by_its_place() {
        assert_eq!(
            why("# dé\n# dé".as_bytes().iter().copied().chain([0xe9]).collect::<Vec<_>>().as_slice()),
            "the file is not UTF-8 text, at line 2, column 5, byte E9"
        );
        for utf16 in [&b"\xff\xfex\0"[..], b"\xfe\xff\0x", b"x\0y\0", b"\0x\0y"] {
            assert!(why(utf16).contains("UTF-16"), "{utf16:?}");
        }
    }

    #[test]
    fn what_is_not_seen_is_written_out() {
        assert_eq!(visible("\u{feff}x\ty\u{a0}z\u{200b} é\0"), "U+FEFFx\\tyU+00A0zU+200B éU+0000");
        assert_eq!(visible("x,y,radius"), "x,y,radius");
    }
}
