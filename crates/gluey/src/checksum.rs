//! Files that tell whether they are whole: 8 bytes that say what they are, a layout (u32, little-endian), the
//! blake3 digest of the rest, and the rest, compressed by zlib.

use std::fs;
use std::io::{self, Read};
use std::path::Path;

use flate2::Compression;
use flate2::read::{ZlibDecoder, ZlibEncoder};

const DIGEST_LENGTH: usize = 32;
/// Fast: fields of 64-bit numbers hardly get smaller at higher levels.
const COMPRESSION_LEVEL: u32 = 1;

/// A kind of file, by its beginning.
pub(crate) struct FileKind {
    pub magic: &'static [u8; 8],
    /// Counts changes of the layout of what is inside.
    pub layout: u32,
}

/// Reasons why a file says nothing.
#[derive(Debug)]
pub(crate) enum Unopened {
    Read(io::Error),
    /// It is of another kind.
    Foreign,
    /// It has this layout.
    Layout(u32),
    Damaged,
}

impl FileKind {
    fn header_length(&self) -> usize {
        self.magic.len() + 4 + DIGEST_LENGTH
    }

    /// The bytes of the file for what it is to hold.
    pub fn sealed(&self, bytes: &[u8]) -> io::Result<Vec<u8>> {
        let mut body = Vec::new();
        ZlibEncoder::new(bytes, Compression::new(COMPRESSION_LEVEL)).read_to_end(&mut body)?;
        let mut file = self.magic.to_vec();
        file.extend(self.layout.to_le_bytes());
        file.extend(blake3::hash(&body).as_bytes());
        file.extend(body);
        Ok(file)
    }

    /// What a file holds.
    pub fn opened(&self, path: &Path) -> Result<Vec<u8>, Unopened> {
        let bytes = fs::read(path).map_err(Unopened::Read)?;
        let Some((header, body)) = bytes.split_at_checked(self.header_length()) else {
            return Err(if self.begins(&bytes[..bytes.len().min(self.magic.len())]) {
                Unopened::Damaged
            } else {
                Unopened::Foreign
            });
        };
        let (magic, rest) = header.split_at(self.magic.len());
        let (layout, digest) = rest.split_at(4);
        if magic != self.magic {
            return Err(Unopened::Foreign);
        }
        let found = layout.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte));
        if found != self.layout {
            return Err(Unopened::Layout(found));
        }
        let inflated = if blake3::hash(body).as_bytes() == digest { inflated(body) } else { None };
        inflated.ok_or(Unopened::Damaged)
    }

    /// Whether a file of this kind may begin so.
    pub fn begins(&self, bytes: &[u8]) -> bool {
        self.magic.starts_with(bytes) && !bytes.is_empty()
    }
}

/// Bytes before compression; `None` if `body` is not compressed.
fn inflated(body: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    ZlibDecoder::new(body).read_to_end(&mut bytes).ok()?;
    Some(bytes)
}
