//! One `.vtu` file as text: an unstructured grid in VTK's XML format with inline binary data (VTK file
//! formats, 2023, section "XML file formats").
//!
//! Every array is base64: a header of 64-bit numbers, then the little-endian values, in zlib blocks where
//! they are compressed.

use std::fmt::{self, Write as _};
use std::io::{self, Write};
use std::str::FromStr;

use base64::engine::{Engine, general_purpose::STANDARD};
use flate2::{Compression, write::ZlibEncoder};

/// Bytes of a block before compression.
const BLOCK: usize = 1 << 18;

/// How numbers are stored in the files for ParaView.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VtkEncoding {
    /// From 0 (none) over 1 (fast) to 9 (small).
    pub compression: u32,
    /// Of points and fields.
    pub precision: Precision,
}

impl Default for VtkEncoding {
    /// Exact numbers, compressed fast: higher levels gain a few percent.
    fn default() -> Self {
        Self { compression: 1, precision: Precision::Double }
    }
}

/// Bits of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits: seven digits, half the size.
    Single,
    /// 64 bits: the numbers as they were computed.
    Double,
}

/// A name that is no precision.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is not a known precision: expected `f32` or `f64`")]
pub struct UnknownPrecision {
    /// What was asked for.
    pub name: String,
}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Single => "f32",
            Self::Double => "f64",
        })
    }
}

impl FromStr for Precision {
    type Err = UnknownPrecision;

    fn from_str(name: &str) -> Result<Self, UnknownPrecision> {
        let known = [Self::Single, Self::Double].into_iter().find(|precision| precision.to_string() == name);
        known.ok_or_else(|| UnknownPrecision { name: name.to_owned() })
    }
}

/// VTK's numbers of cell types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CellType {
    Vertex = 1,
    Line = 3,
    BiquadraticQuad = 28,
    TriquadraticHexahedron = 29,
}

/// Numbers at points or cells.
pub(super) struct Array {
    pub name: &'static str,
    /// Numbers a point or cell.
    pub components: usize,
    pub values: Vec<f64>,
}

/// A grid and what is known at its points and cells.
pub(super) struct Piece {
    /// Three coordinates a point.
    pub points: Vec<f64>,
    /// Points of all cells.
    pub connectivity: Vec<i64>,
    /// Where each cell ends in `connectivity`.
    pub offsets: Vec<i64>,
    pub types: Vec<CellType>,
    pub of_points: Vec<Array>,
    pub of_cells: Vec<Array>,
}

/// The file that holds `piece`.
pub(super) fn document(piece: &Piece, encoding: VtkEncoding) -> io::Result<String> {
    let compressor = match encoding.compression {
        0 => "",
        _ => " compressor=\"vtkZLibDataCompressor\"",
    };
    let mut file = File { text: String::new(), encoding };
    file.add(format_args!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\"{compressor}>\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
        piece.points.len() / 3,
        piece.types.len()
    ));
    file.section("PointData", |file| file.arrays(&piece.of_points))?;
    file.section("CellData", |file| file.arrays(&piece.of_cells))?;
    file.section("Points", |file| file.reals("points", 3, &piece.points))?;
    file.section("Cells", |file| {
        file.array("Int64", "connectivity", 1, &bytes(&piece.connectivity, i64::to_le_bytes))?;
        file.array("Int64", "offsets", 1, &bytes(&piece.offsets, i64::to_le_bytes))?;
        let types: Vec<u8> = piece.types.iter().map(|&cell| cell as u8).collect();
        file.array("UInt8", "types", 1, &types)
    })?;
    file.add(format_args!("</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"));
    Ok(file.text)
}

fn bytes<T: Copy, const N: usize>(values: &[T], to_bytes: fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|&value| to_bytes(value)).collect()
}

/// A file on its way.
struct File {
    text: String,
    encoding: VtkEncoding,
}

impl File {
    fn add(&mut self, text: fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.text.write_fmt(text);
    }

    fn section(&mut self, name: &str, fill: impl FnOnce(&mut Self) -> io::Result<()>) -> io::Result<()> {
        self.add(format_args!("<{name}>\n"));
        fill(self)?;
        self.add(format_args!("</{name}>\n"));
        Ok(())
    }

    fn arrays(&mut self, arrays: &[Array]) -> io::Result<()> {
        arrays.iter().try_for_each(|array| self.reals(array.name, array.components, &array.values))
    }

    fn reals(&mut self, name: &str, components: usize, values: &[f64]) -> io::Result<()> {
        match self.encoding.precision {
            Precision::Double => self.array("Float64", name, components, &bytes(values, f64::to_le_bytes)),
            Precision::Single => {
                self.array("Float32", name, components, &bytes(values, |x| (x as f32).to_le_bytes()))
            }
        }
    }

    fn array(&mut self, kind: &str, name: &str, components: usize, data: &[u8]) -> io::Result<()> {
        self.add(format_args!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">"
        ));
        match self.encoding.compression {
            0 => {
                let size = (data.len() as u64).to_le_bytes();
                STANDARD.encode_string([&size, data].concat(), &mut self.text);
            }
            level => self.compressed(data, level.min(9))?,
        }
        self.add(format_args!("</DataArray>\n"));
        Ok(())
    }

    /// The header: number of blocks, their size, that of a last partial one, then the size of each when
    /// compressed. Header and blocks are encoded one after the other.
    fn compressed(&mut self, data: &[u8], level: u32) -> io::Result<()> {
        let count = data.len().div_ceil(BLOCK);
        let mut header = vec![count as u64, BLOCK as u64, (data.len() % BLOCK) as u64];
        let mut blocks = Vec::new();
        for block in data.chunks(BLOCK) {
            let start = blocks.len();
            let mut encoder = ZlibEncoder::new(blocks, Compression::new(level));
            encoder.write_all(block)?;
            blocks = encoder.finish()?;
            header.push((blocks.len() - start) as u64);
        }
        STANDARD.encode_string(bytes(&header, u64::to_le_bytes), &mut self.text);
        STANDARD.encode_string(blocks, &mut self.text);
        Ok(())
    }
}
