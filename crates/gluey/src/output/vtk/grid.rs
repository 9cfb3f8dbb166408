//! The fields of a flow as a grid of quadratic cells, and arrays of numbers at points.

use gluey_geom::Vector;
use gluey_motion::Fields;
use vtkio::model::CellType;

use super::xml::{Array, GridPiece};

/// The series of the fields.
pub(super) const FIELDS: &str = "fields";

/// Lattice positions (x fastest) of the nodes of a biquadratic quadrilateral (VTK cell type 28), in VTK's
/// order: corners, edges, centre.
pub(super) const QUAD_ORDER: [usize; 9] = [0, 2, 8, 6, 1, 5, 7, 3, 4];
/// The same for a triquadratic hexahedron (type 29): corners, edges, faces -x +x -y +y -z +z, centre.
pub(super) const HEXAHEDRON_ORDER: [usize; 27] =
    [0, 2, 8, 6, 18, 20, 26, 24, 1, 5, 7, 3, 19, 23, 25, 21, 9, 11, 17, 15, 12, 14, 10, 16, 4, 22, 13];

pub(super) fn fields_piece<const D: usize>(fields: &Fields<D>) -> GridPiece {
    let (order, cell_type): (&[usize], _) = match D {
        2 => (&QUAD_ORDER, CellType::BiquadraticQuad),
        _ => (&HEXAHEDRON_ORDER, CellType::TriquadraticHexahedron),
    };
    let cells = fields.cells.chunks_exact(order.len());
    let count = cells.len();
    GridPiece {
        points: in_space(&fields.points),
        connectivity: cells.flat_map(|cell| order.iter().map(|&node| u64::from(cell[node]))).collect(),
        offsets: (1..=count).map(|cell| (cell * order.len()) as u64).collect(),
        types: vec![cell_type; count],
        of_points: vec![
            vectors("velocity", &fields.velocity),
            scalars("pressure", fields.pressure.clone()),
            scalars("viscosity", fields.viscosity.clone()),
            scalars("level_set", fields.level_set.clone()),
            vectors("lambda", &fields.multiplier),
        ],
        of_cells: Vec::new(),
    }
}

pub(super) fn scalars(name: &'static str, values: Vec<f64>) -> Array {
    Array { name, components: 1, values }
}

pub(super) fn vectors<const D: usize>(name: &'static str, values: &[Vector<D>]) -> Array {
    Array { name, components: 3, values: in_space(values) }
}

/// VTK's vectors have three components.
pub(super) fn in_space<const D: usize>(vectors: &[Vector<D>]) -> Vec<f64> {
    vectors.iter().flat_map(|v| [v[0], v[1], v.get(2).copied().unwrap_or(0.0)]).collect()
}
