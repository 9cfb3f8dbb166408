//! Points of pictures: the nodes of cells, also where a periodic box joins them.

use gluey_fem::{NodeMap, TreeMesh, points_of_cells};
use gluey_geom::{Aabb, Vector};

#[test]
fn far_faces_of_periodic_boxes_have_points_of_their_own() {
    let mesh = TreeMesh::<2>::uniform(Aabb::unit(), [1; 2], [true, false], 1).expect("a mesh");
    let nodes = NodeMap::new(&mesh, 2);
    let (points, of_cells) = points_of_cells(&mesh, &nodes, 0..4);
    assert_eq!((nodes.node_count(), points.len(), of_cells.len()), (20, 25, 36));
    assert_eq!(points.iter().filter(|point| point.x[0] == 1.0).count(), 5);
    for (place, &point) in of_cells.iter().enumerate() {
        let (point, cell) = (&points[point as usize], &mesh.cells()[place / 9]);
        let corner = mesh.lower_corner(cell);
        assert_eq!(point.x, corner + Vector::<2>::new((place % 3) as f64, (place % 9 / 3) as f64) * 0.25);
    }
}

#[test]
fn some_cells_have_the_points_that_they_touch() {
    let mesh = TreeMesh::<2>::uniform(Aabb::unit(), [1; 2], [false; 2], 1).expect("a mesh");
    let (points, of_cells) = points_of_cells(&mesh, &NodeMap::new(&mesh, 2), 1..2);
    assert_eq!((points.len(), of_cells), (9, (0..9).collect::<Vec<_>>()));
    assert!(points.iter().all(|point| point.cell == 1));
}
