//! Files for ParaView, read back: what `VtkWriter` wrote.

use std::path::{Path, PathBuf};

use gluey_geom::{Particle, Vector};
use gluey_motion::Fields;
use thiserror::Error;
use vtkio::Vtk;
use vtkio::model::{Attribute, DataSet, Piece, UnstructuredGridPiece};

use super::grid::{HEXAHEDRON_ORDER, QUAD_ORDER};

/// A file could not be read back.
#[derive(Debug, Error)]
pub enum VtkReadError {
    /// It could not be read, or is no VTK file.
    #[error("{}: cannot be read as a VTK file: {problem}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        problem: String,
    },
    /// It holds something else than gluey writes.
    #[error("{}: {what}, which is not what `gluey run --vtk N` writes", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What is there or missing.
        what: String,
    },
}

/// The fields of a file `fields-<step>.vtu` as they were written, but for their precision; of a `.pvtu` file
/// those of all pieces that it names, one after the other.
///
/// # Errors
/// If the file cannot be read, or is not of this dimension.
pub fn read_fields<const D: usize>(path: &Path) -> Result<Fields<D>, VtkReadError> {
    let mut all = Fields::default();
    for grid in FileGrid::all(path)? {
        append(&mut all, fields_of(&grid)?);
    }
    Ok(all)
}

fn append<const D: usize>(all: &mut Fields<D>, more: Fields<D>) {
    let first = all.points.len() as u32;
    all.cells.extend(more.cells.iter().map(|node| first + node));
    all.points.extend(more.points);
    all.velocity.extend(more.velocity);
    all.pressure.extend(more.pressure);
    all.viscosity.extend(more.viscosity);
    all.level_set.extend(more.level_set);
    all.multiplier.extend(more.multiplier);
}

fn fields_of<const D: usize>(grid: &FileGrid) -> Result<Fields<D>, VtkReadError> {
    let order: &[usize] = if D == 2 { &QUAD_ORDER } else { &HEXAHEDRON_ORDER };
    let (nodes, ends) = grid.piece.cells.cell_verts.clone().into_xml();
    if ends.iter().enumerate().any(|(cell, &end)| end != ((cell + 1) * order.len()) as u64) {
        return Err(grid.foreign(format!("cells that do not have {} nodes each", order.len())));
    }
    let points = grid.vectors::<D>(grid.piece.points.cast_into(), "points")?;
    let mut cells = vec![0; nodes.len()];
    for (cell, nodes) in cells.chunks_exact_mut(order.len()).zip(nodes.chunks_exact(order.len())) {
        for (&place, &node) in order.iter().zip(nodes) {
            let known = u32::try_from(node).ok().filter(|&node| (node as usize) < points.len());
            cell[place] = known.ok_or_else(|| grid.foreign(format!("a cell with the node {node}")))?;
        }
    }
    let fields = Fields {
        cells,
        velocity: grid.vectors(grid.numbers("velocity"), "velocity")?,
        pressure: grid.scalars("pressure")?,
        viscosity: grid.scalars("viscosity")?,
        level_set: grid.scalars("level_set")?,
        multiplier: grid.vectors(grid.numbers("lambda"), "lambda")?,
        points,
    };
    let count = fields.points.len();
    let lengths = [fields.velocity.len(), fields.pressure.len(), fields.level_set.len()];
    match lengths.iter().all(|&length| length == count) {
        true => Ok(fields),
        false => Err(grid.foreign(format!("fields of other lengths than the {count} points"))),
    }
}

/// The particles of a file `particles-<step>.vtu`, without their images.
///
/// # Errors
/// If the file cannot be read.
pub fn read_particles<const D: usize>(path: &Path) -> Result<Vec<Particle<D>>, VtkReadError> {
    let grid = FileGrid::read(path)?;
    let centers = grid.vectors::<D>(grid.piece.points.cast_into(), "points")?;
    let (radii, image) = (grid.scalars("radius")?, grid.scalars("image")?);
    if radii.len() != centers.len() || image.len() != centers.len() {
        return Err(grid.foreign(format!("{} radii of {} particles", radii.len(), centers.len())));
    }
    let balls = centers.into_iter().zip(radii).zip(image);
    let own = balls.filter(|(_, image)| *image == 0.0);
    Ok(own.map(|((center, radius), _)| Particle::new(center, radius)).collect())
}

/// A file and the grid in it.
struct FileGrid {
    path: PathBuf,
    piece: UnstructuredGridPiece,
}

impl FileGrid {
    /// The grid of a file, or those of the files that it names.
    fn all(path: &Path) -> Result<Vec<Self>, VtkReadError> {
        let names = |piece: &Piece<UnstructuredGridPiece>| match piece {
            Piece::Source(name, _) => Some(path.with_file_name(name)),
            _ => None,
        };
        let pieces = pieces_of(path)?;
        let named: Vec<PathBuf> = pieces.iter().filter_map(names).collect();
        match named.is_empty() {
            true => Ok(vec![Self::of_one(path, &pieces)?]),
            false => named.iter().map(|path| Self::read(path)).collect(),
        }
    }

    fn read(path: &Path) -> Result<Self, VtkReadError> {
        Self::of_one(path, &pieces_of(path)?)
    }

    fn of_one(path: &Path, pieces: &[Piece<UnstructuredGridPiece>]) -> Result<Self, VtkReadError> {
        let [piece] = pieces else {
            return Err(unreadable(path, format!("{} pieces instead of one", pieces.len())));
        };
        let piece = piece.load_piece_data(None).map_err(|error| unreadable(path, error.to_string()))?;
        Ok(Self { path: path.to_owned(), piece })
    }

    fn foreign(&self, what: String) -> VtkReadError {
        VtkReadError::Foreign { path: self.path.clone(), what }
    }

    fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        self.piece.data.point.iter().find_map(|attribute| match attribute {
            Attribute::DataArray(array) if array.name == name => array.data.cast_into(),
            _ => None,
        })
    }

    fn scalars(&self, name: &str) -> Result<Vec<f64>, VtkReadError> {
        self.numbers(name).ok_or_else(|| self.foreign(format!("no array `{name}`")))
    }

    /// Vectors of three components without those that there are not.
    fn vectors<const D: usize>(
        &self,
        numbers: Option<Vec<f64>>,
        name: &str,
    ) -> Result<Vec<Vector<D>>, VtkReadError> {
        let numbers = numbers.ok_or_else(|| self.foreign(format!("no array `{name}`")))?;
        Ok(numbers.chunks_exact(3).map(|three| Vector::from_fn(|d, _| three[d])).collect())
    }
}

fn pieces_of(path: &Path) -> Result<Vec<Piece<UnstructuredGridPiece>>, VtkReadError> {
    let vtk = Vtk::import(path).map_err(|error| unreadable(path, error.to_string()))?;
    match vtk.data {
        DataSet::UnstructuredGrid { pieces, .. } => Ok(pieces),
        _ => Err(unreadable(path, "no unstructured grid".to_owned())),
    }
}

fn unreadable(path: &Path, problem: String) -> VtkReadError {
    VtkReadError::Unreadable { path: path.to_owned(), problem }
}
