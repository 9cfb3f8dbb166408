//! Fields in pieces: a `.vtu` file for each rank, and a `.pvtu` file that names them (VTK file formats, 2023,
//! section "Parallel XML file formats"), which vtkio reads and does not write.

use std::fmt::Write;
use std::path::Path;

use gluey_motion::Fields;

use super::grid::{FIELDS, fields_piece};
use super::xml::{self, GridPiece, VtkEncoding};
use crate::case::Precision;
use crate::output::{FileError, write_atomically};

/// Writes the fields in the cells of `rank` at a step into a folder that is there.
pub fn write_piece<const D: usize>(
    folder: &Path,
    step: usize,
    rank: usize,
    fields: &Fields<D>,
    encoding: VtkEncoding,
) -> Result<(), FileError> {
    xml::write(&folder.join(piece_name(FIELDS, step, rank)), fields_piece(fields), encoding)
}

/// Writes the piece of rank zero and, when those of all others are there, the file that names all `count`.
pub(super) fn write_first(
    folder: &Path,
    series: &str,
    step: usize,
    count: usize,
    piece: GridPiece,
    encoding: VtkEncoding,
) -> Result<(), FileError> {
    let names: Vec<String> = (0..count).map(|rank| piece_name(series, step, rank)).collect();
    let index = index(&piece, encoding.precision, &names);
    xml::write(&folder.join(piece_name(series, step, 0)), piece, encoding)?;
    write_atomically(&folder.join(index_name(series, step)), index.as_bytes())
}

fn piece_name(series: &str, step: usize, rank: usize) -> String {
    format!("{series}-{step:06}-{rank:04}.vtu")
}

/// The file that names the pieces of a step.
pub(super) fn index_name(series: &str, step: usize) -> String {
    format!("{series}-{step:06}.pvtu")
}

/// The text that names files with such arrays as `piece` has.
fn index(piece: &GridPiece, precision: Precision, names: &[String]) -> String {
    let kind = match precision {
        Precision::Double => "Float64",
        Precision::Single => "Float32",
    };
    let array = |name: &str, components: u32| {
        format!("<PDataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"/>\n")
    };
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" \
         byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PUnstructuredGrid GhostLevel=\"0\">\n",
    );
    text.push_str("<PPointData>\n");
    piece.of_points.iter().for_each(|of| text.push_str(&array(of.name, of.components)));
    text.push_str("</PPointData>\n<PPoints>\n");
    text.push_str(&array("Points", 3));
    text.push_str("</PPoints>\n");
    for name in names {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "<Piece Source=\"{name}\"/>");
    }
    text.push_str("</PUnstructuredGrid>\n</VTKFile>\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_pieces_are_named_with_the_arrays_they_have() {
        let piece = fields_piece(&Fields::<3>::default());
        let names: Vec<String> = (0..3).map(|rank| piece_name(FIELDS, 40, rank)).collect();
        let text = index(&piece, Precision::Single, &names);
        assert!(text.contains("<Piece Source=\"fields-000040-0002.vtu\"/>"), "{text}");
        assert_eq!(text.matches("<Piece ").count(), 3);
        assert_eq!(text.matches("<PDataArray type=\"Float32\"").count(), 6);
        assert!(text.contains("Name=\"velocity\" NumberOfComponents=\"3\""), "{text}");
        assert!(text.contains("Name=\"pressure\" NumberOfComponents=\"1\""), "{text}");
    }
}
