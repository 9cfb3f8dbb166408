//! One `.vtu` file as text: an unstructured grid in VTK's XML format with inline binary data (VTK file
//! formats, 2023, section "XML file formats").
//!
//! Every array is base64: a header of 64-bit numbers, then the little-endian values, in zlib blocks where
//! they are compressed.

use std::io::{self, Write};
use std::path::Path;

use base64::engine::{Engine, general_purpose::STANDARD};
use flate2::{Compression, write::ZlibEncoder};
use serde::{Deserialize, Serialize};
use vtkio::IOBuffer;
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataSet, UnstructuredGridPiece, Version,
    VertexNumbers, Vtk,
};
use vtkio::xml::Compressor;

use crate::case::Precision;
use crate::output::{FileError, write_atomically};

/// Bytes of a block before compression.
const BLOCK: usize = 1 << 18;
/// Bytes of the number that stands before uncompressed data.
const SIZE_LENGTH: usize = 8;

/// The form of numbers in the files for ParaView.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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

/// Numbers at points or cells.
pub(super) struct Array {
    pub name: &'static str,
    /// Numbers per point or cell.
    pub components: u32,
    pub values: Vec<f64>,
}

/// A grid and what is known at its points and cells.
pub(super) struct GridPiece {
    /// Three coordinates per point.
    pub points: Vec<f64>,
    /// Points of all cells.
    pub connectivity: Vec<u64>,
    /// Where each cell ends in `connectivity`.
    pub offsets: Vec<u64>,
    pub types: Vec<CellType>,
    pub of_points: Vec<Array>,
    pub of_cells: Vec<Array>,
}

/// Writes the file that holds `piece`, whole or not at all.
pub(super) fn write(path: &Path, piece: GridPiece, encoding: VtkEncoding) -> Result<(), FileError> {
    let text = document(piece, encoding);
    let text = text.map_err(|error| FileError::new(path, "encode the file", error))?;
    write_atomically(path, text.as_bytes())
}

/// The text of that file. vtkio writes it, without compression; the arrays are compressed afterwards in
/// blocks, since vtkio (0.7.0-rc2) hands its compressor one number at a time, for each of which flate2 clears
/// 32 kB. What is empty stays as it is: vtkio does not read arrays of no block.
fn document(piece: GridPiece, encoding: VtkEncoding) -> io::Result<String> {
    let compression = if piece.points.is_empty() { 0 } else { encoding.compression };
    let vtk = Vtk {
        version: Version::new_xml(1, 0),
        title: String::new(),
        byte_order: ByteOrder::LittleEndian,
        data: DataSet::inline(grid(piece, encoding.precision)),
        file_path: None,
    };
    let mut bytes = Vec::new();
    vtk.try_into_xml_format(Compressor::None, 0)
        .and_then(|mut file| {
            if compression > 0 {
                file.compressor = Compressor::ZLib;
            }
            file.write(&mut bytes)
        })
        .map_err(|error| io::Error::other(error.to_string()))?;
    let text = String::from_utf8(bytes).map_err(io::Error::other)?;
    let text = counted(&signed_indices(&text));
    match compression {
        0 => Ok(text),
        level => compressed_arrays(&text, level.min(9)),
    }
}

fn grid(piece: GridPiece, precision: Precision) -> UnstructuredGridPiece {
    let attributes = |arrays: Vec<Array>| -> Vec<Attribute> {
        let attribute = |array: Array| {
            let components = array.components;
            Attribute::generic(array.name, components).with_data(reals(array.values, precision))
        };
        arrays.into_iter().map(attribute).collect()
    };
    UnstructuredGridPiece {
        points: reals(piece.points, precision),
        cells: Cells {
            cell_verts: VertexNumbers::XML { connectivity: piece.connectivity, offsets: piece.offsets },
            types: piece.types,
        },
        data: Attributes { point: attributes(piece.of_points), cell: attributes(piece.of_cells) },
    }
}

fn reals(values: Vec<f64>, precision: Precision) -> IOBuffer {
    match precision {
        Precision::Double => values.into(),
        Precision::Single => values.into_iter().map(|x| x as f32).collect::<Vec<f32>>().into(),
    }
}

/// vtkio writes node numbers as unsigned; with those, numpy (in meshio) ends up with floating-point indices.
/// Numbers below 2^63 have the same bytes in both types, and the data themselves are base64, which holds no
/// `<`.
fn signed_indices(text: &str) -> String {
    text.replace("<DataArray type=\"UInt64\"", "<DataArray type=\"Int64\"")
}

/// vtkio leaves out numbers of points and cells that are zero, and VTK breaks off without them.
fn counted(text: &str) -> String {
    text.replace("<Piece>", "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\">")
}

/// The same file with its arrays compressed: base64 of the size in 8 bytes and the data, as vtkio wrote it,
/// becomes base64 of compressed blocks.
fn compressed_arrays(text: &str, level: u32) -> io::Result<String> {
    let mut file = String::with_capacity(text.len() / 2);
    let mut rest = text;
    while let Some(start) = rest.find("<DataArray") {
        let (before, array) = rest.split_at(start);
        file.push_str(before);
        let Some(open) = array.find('>') else { return Err(io::ErrorKind::InvalidData.into()) };
        let (tag, content) = array.split_at(open + 1);
        file.push_str(tag);
        rest = content;
        if !tag.ends_with("/>") {
            let end = content.find('<').unwrap_or(content.len());
            let data = STANDARD.decode(content[..end].trim()).map_err(io::Error::other)?;
            compress(data.get(SIZE_LENGTH..).unwrap_or_default(), level, &mut file)?;
            rest = &content[end..];
        }
    }
    file.push_str(rest);
    Ok(file)
}

/// The header: number of blocks, their size, that of a last partial one, then the size of each when
/// compressed. Header and blocks are encoded one after the other.
fn compress(data: &[u8], level: u32, file: &mut String) -> io::Result<()> {
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
    let header: Vec<u8> = header.into_iter().flat_map(u64::to_le_bytes).collect();
    STANDARD.encode_string(header, file);
    STANDARD.encode_string(blocks, file);
    Ok(())
}
