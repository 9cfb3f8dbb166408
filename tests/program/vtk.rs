//! The files for ParaView hold what was written, in the order of nodes that VTK defines.

use std::fs;
use std::path::Path;

use gluey::output::vtk::{
    Precision, ShownBox, VtkEncoding, VtkFrame, VtkWriter, read_fields, read_particles, write_piece,
};
use gluey::{Case, RunOptions, Silent, VtkOptions, run};
use gluey_contact::{Contact, ContactForce, Domain, PairKey, Wall};
use gluey_geom::{Particle, Twist, Vector};
use gluey_motion::Fields;
use gluey_suspension::Container;
use tempfile::TempDir;
use vtkio::Vtk;
use vtkio::model::{Attribute, CellType, DataSet, UnstructuredGridPiece};

/// Edges of a quadrilateral in VTK's order: node 4 + i lies between the corners `EDGES[i]`.
const QUAD_EDGES: [[usize; 2]; 4] = [[0, 1], [1, 2], [2, 3], [3, 0]];
/// The same for a hexahedron: node 8 + i.
const HEXAHEDRON_EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
/// Corners of the faces of a triquadratic hexahedron: node 20 + i is the centre of `FACES[i]`
/// (vtkTriQuadraticHexahedron.h: left, right, front, back, bottom, top).
const HEXAHEDRON_FACES: [[usize; 4]; 6] =
    [[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]];
/// Corners of the unit cube in VTK's order.
const CORNERS: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
];

fn read(path: &Path) -> UnstructuredGridPiece {
    let vtk = Vtk::import(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let DataSet::UnstructuredGrid { pieces, .. } = vtk.data else { panic!("not an unstructured grid") };
    assert_eq!(pieces.len(), 1);
    pieces[0].load_piece_data(None).expect("data")
}

fn numbers(attributes: &[Attribute], name: &str) -> Vec<f64> {
    let found = attributes.iter().find_map(|attribute| match attribute {
        Attribute::DataArray(array) if array.name == name => array.data.cast_into::<f64>(),
        _ => None,
    });
    found.unwrap_or_else(|| panic!("no array {name}"))
}

/// One cell, the unit square or cube, with a field that tells its nodes apart.
fn one_cell<const D: usize>() -> Fields<D> {
    let node_count = 3usize.pow(D as u32);
    let point =
        |node: usize| Vector::<D>::from_fn(|axis, _| 0.5 * (node / 3usize.pow(axis as u32) % 3) as f64);
    let points: Vec<Vector<D>> = (0..node_count).map(point).collect();
    Fields {
        cells: (0..node_count as u32).collect(),
        velocity: points.iter().map(|x| x * 2.0).collect(),
        pressure: (0..node_count).map(|node| 1.0 / (node as f64 + 3.0)).collect(),
        viscosity: vec![1e3; node_count],
        level_set: points.iter().map(|x| x.norm() - 0.3).collect(),
        multiplier: points.iter().map(|x| -x).collect(),
        points,
    }
}

/// A frame of fields without particles.
fn frame_of<const D: usize>(fields: &Fields<D>) -> VtkFrame<D> {
    VtkFrame {
        step: 40,
        time: 1.0,
        particles: vec![],
        twists: vec![],
        contacts: vec![],
        in_flow: None,
        domain: Domain::default(),
        in_box: None,
        fields: Some(fields.clone()),
    }
}

fn cells_have_vtks_order_of_nodes<const D: usize>(
    cell_type: CellType,
    edges: &[[usize; 2]],
    faces: &[[usize; 4]],
) {
    let folder = TempDir::new().expect("a folder");
    let fields = one_cell::<D>();
    let mut writer = VtkWriter::create(folder.path(), &[]).expect("a folder");
    let frame = frame_of(&fields);
    writer.write(&frame).expect("files");
    let path = folder.path().join("fields-000040.vtu");
    assert_eq!(read_fields::<D>(&path).expect("what was written"), fields);
    let piece = read(&path);

    assert_eq!(piece.cells.types, [cell_type]);
    let points: Vec<f64> = piece.points.cast_into().expect("numbers");
    let nodes = piece.cells.cell_verts.into_xml().0;
    let at = |n: usize| -> [f64; 3] { std::array::from_fn(|axis| points[3 * nodes[n] as usize + axis]) };
    let mean = |corners: &[usize]| -> [f64; 3] {
        std::array::from_fn(|axis| corners.iter().map(|&n| at(n)[axis]).sum::<f64>() / corners.len() as f64)
    };
    let corner_count = 1 << D;
    assert_eq!(nodes.len(), fields.points.len());
    (0..corner_count).for_each(|n| assert_eq!(at(n), CORNERS[n], "corner {n}"));
    for (i, edge) in edges.iter().enumerate() {
        assert_eq!(at(corner_count + i), mean(edge), "edge {i}");
    }
    for (i, face) in faces.iter().enumerate() {
        assert_eq!(at(corner_count + edges.len() + i), mean(face), "face {i}");
    }
    let all: Vec<usize> = (0..corner_count).collect();
    assert_eq!(at(nodes.len() - 1), mean(&all), "centre");

    let data = &piece.data.point;
    assert_eq!(numbers(data, "pressure"), fields.pressure);
    assert_eq!(numbers(data, "viscosity"), fields.viscosity);
    assert_eq!(numbers(data, "level_set"), fields.level_set);
    let three = |v: &Vector<D>| [v[0], v[1], v.get(2).copied().unwrap_or(0.0)];
    assert_eq!(numbers(data, "velocity"), fields.velocity.iter().flat_map(three).collect::<Vec<_>>());
    assert_eq!(numbers(data, "lambda"), fields.multiplier.iter().flat_map(three).collect::<Vec<_>>());
}

/// Pieces are read back one after the other, empty ones too. A step that was written in the other way before
/// is replaced.
#[test]
fn fields_in_pieces() {
    let folder = TempDir::new().expect("a folder");
    let (one, mut other) = (one_cell::<2>(), one_cell::<2>());
    other.points.iter_mut().for_each(|x| x[0] += 1.0);
    let frame = frame_of(&one);
    let files = || {
        let files =
            fs::read_dir(folder.path()).expect("a folder").map(|file| file.expect("a file").file_name());
        let names =
            files.filter_map(|name| name.into_string().ok()).filter(|name| name.starts_with("fields"));
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    };
    let listed = || fs::read_to_string(folder.path().join("fields.pvd")).expect("a collection");
    let create = |done| VtkWriter::create(folder.path(), done).expect("a folder");
    create(&[]).write(&frame).expect("files");
    assert_eq!(files(), ["fields-000040.vtu", "fields.pvd"]);
    write_piece(folder.path(), 40, 1, &other, VtkEncoding::default()).expect("a piece");
    write_piece(folder.path(), 40, 2, &Fields::<2>::default(), VtkEncoding::default()).expect("no cells");
    create(&[]).in_pieces(3).write(&frame).expect("files");
    let pieces = ["fields-000040-0000.vtu", "fields-000040-0001.vtu", "fields-000040-0002.vtu"];
    assert_eq!(files(), [&pieces[..], &["fields-000040.pvtu", "fields.pvd"]].concat());
    assert!(listed().contains("timestep=\"1\" part=\"0\" file=\"fields-000040.pvtu\""), "{}", listed());

    let empty = fs::read_to_string(folder.path().join(pieces[2])).expect("a file");
    assert!(empty.contains("<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\">"), "VTK wants both: {empty}");
    let joined = read_fields::<2>(&folder.path().join("fields-000040.pvtu")).expect("what was written");
    assert_eq!(joined.cells, (0..18).collect::<Vec<_>>());
    assert_eq!(joined.points, [&one.points[..], &other.points].concat());
    assert_eq!(joined.velocity, [&one.velocity[..], &other.velocity].concat());
    assert_eq!(joined.pressure, [&one.pressure[..], &other.pressure].concat());
    fs::remove_file(folder.path().join(pieces[1])).expect("a file");
    let error = read_fields::<2>(&folder.path().join("fields-000040.pvtu")).expect_err("a piece is missing");
    assert!(error.to_string().contains(pieces[1]), "{error}");

    // A run that goes on finds the steps before, whoever wrote them.
    create(&[(40, 1.0)]).write(&VtkFrame { step: 41, time: 1.5, ..frame.clone() }).expect("files");
    assert!(
        listed().contains("fields-000040.pvtu") && listed().contains("fields-000041.vtu"),
        "{}",
        listed()
    );
    create(&[]).write(&frame).expect("files");
    assert!(files().contains(&"fields-000040.vtu".to_owned()));
    assert!(!files().contains(&"fields-000040.pvtu".to_owned()));
}

/// What is read back does not depend on the compression, and on the precision as far as it must.
#[test]
fn every_encoding_reads_back() {
    let folder = TempDir::new().expect("a folder");
    // More than a block of numbers.
    let count = 20_000;
    let particles: Vec<_> =
        (0..count).map(|n| Particle::new(Vector::<3>::repeat(n as f64 / 3.0), 0.1 + n as f64)).collect();
    let twists = vec![Twist::default(); count];
    let radii: Vec<f64> = particles.iter().map(|particle| particle.radius).collect();
    let mut sizes = Vec::new();
    for (compression, precision) in
        [(0, Precision::Double), (1, Precision::Double), (9, Precision::Double), (1, Precision::Single)]
    {
        let encoding = VtkEncoding { compression, precision };
        let mut writer = VtkWriter::create(folder.path(), &[]).expect("a folder").encoded(encoding);
        let frame = VtkFrame {
            step: 0,
            time: 0.0,
            particles: particles.clone(),
            twists: twists.clone(),
            contacts: vec![],
            in_flow: None,
            domain: Domain::default(),
            in_box: None,
            fields: None,
        };
        writer.write(&frame).expect("files");
        let path = folder.path().join("particles-000000.vtu");
        let read_back = numbers(&read(&path).data.point, "radius");
        match precision {
            Precision::Double => assert_eq!(read_back, radii),
            Precision::Single => {
                assert!(read_back.iter().zip(&radii).all(|(x, y)| (x - y).abs() <= 1e-7 * y))
            }
        }
        sizes.push(fs::metadata(path).expect("a file").len());
    }
    assert!(sizes[1] < sizes[0] && sizes[2] <= sizes[1] && sizes[3] < sizes[1], "{sizes:?}");
}

#[test]
fn quadratic_cells() {
    cells_have_vtks_order_of_nodes::<2>(CellType::BiquadraticQuad, &QUAD_EDGES, &[]);
    cells_have_vtks_order_of_nodes::<3>(
        CellType::TriquadraticHexahedron,
        &HEXAHEDRON_EDGES,
        &HEXAHEDRON_FACES,
    );
}

#[test]
fn particles_and_contacts() {
    let folder = TempDir::new().expect("a folder");
    let particles: Vec<Particle<2>> = (0..3)
        .map(|n| Particle::new(Vector::<2>::new(0.1 * n as f64, 0.5), 0.05 + 0.01 * n as f64))
        .collect();
    let mut twists = [Twist::<2>::default(); 3];
    twists[1].velocity = Vector::<2>::new(0.1, -0.2);
    twists[2].spin[0] = -0.5;
    let contacts = [Contact { pair: PairKey::new(0, 2), lambda: 0.3, gamma: -0.01, gap: 1e-9 }];
    let mut writer = VtkWriter::create(folder.path(), &[]).expect("a folder");
    let frame = VtkFrame {
        step: 0,
        time: 0.0,
        particles: particles.clone(),
        twists: twists.to_vec(),
        contacts: contacts.to_vec(),
        in_flow: None,
        domain: Domain::default(),
        in_box: None,
        fields: None,
    };
    writer.write(&frame).expect("files");

    let path = folder.path().join("particles-000000.vtu");
    assert_eq!(read_particles::<2>(&path).expect("what was written"), particles);
    let piece = read(&path);
    assert_eq!(piece.cells.types, [CellType::Vertex; 3]);
    assert_eq!(numbers(&piece.data.point, "radius"), [0.05, 0.060000000000000005, 0.07]);
    assert_eq!(numbers(&piece.data.point, "velocity")[3..6], [0.1, -0.2, 0.0]);
    assert_eq!(numbers(&piece.data.point, "spin")[6..9], [0.0, 0.0, -0.5]);

    let piece = read(&folder.path().join("contacts-000000.vtu"));
    assert_eq!(piece.cells.types, [CellType::Vertex, CellType::Vertex, CellType::Vertex, CellType::Line]);
    assert_eq!(numbers(&piece.data.cell, "gamma"), [0.0, 0.0, 0.0, -0.01]);
    assert_eq!(numbers(&piece.data.cell, "lambda"), [0.0, 0.0, 0.0, 0.3]);
    assert!(
        piece.data.cell.iter().all(|array| !format!("{array:?}").contains("friction")),
        "contacts after the flow"
    );
    let (nodes, offsets) = piece.cells.cell_verts.into_xml();
    assert_eq!((nodes.as_slice(), offsets.as_slice()), ([0, 1, 2, 0, 2].as_slice(), [1, 2, 3, 5].as_slice()));
    assert!(!folder.path().join("fields.pvd").exists(), "a collection without files");
}

#[test]
fn contacts_with_walls_and_images() {
    let folder = TempDir::new().expect("a folder");
    let particles = [[0.5, 1.0], [3.5, 1.5]].map(|x| Particle::new(Vector::<2>::from(x), 0.5));
    let ceiling = Wall::new(&Vector::<2>::new(0.0, 2.0), &-Vector::<2>::y());
    let domain = Domain::default().with_period(0, 4.0).with_wall(ceiling);
    let pairs = [PairKey::new(0, 1), PairKey::across(0, 1, [-1, 0, 0]), PairKey::wall(1, 0)];
    let contacts = [1.0, 2.0, 3.0].map(|lambda| Contact {
        pair: pairs[lambda as usize - 1],
        lambda,
        gamma: -lambda,
        gap: 0.1 * lambda,
    });
    let force = |one: &Contact| ContactForce {
        pair: one.pair,
        normal: Vector::y(),
        force: Vector::<2>::new(-0.5, one.lambda),
        branch: Vector::y(),
        slip: Vector::<2>::new(0.25 * one.lambda, 0.0),
        gap: one.gap,
        floor: 0.01,
        slides: one.lambda > 1.0,
    };
    let mut writer = VtkWriter::create(folder.path(), &[]).expect("a folder");
    let frame = VtkFrame {
        step: 0,
        time: 0.0,
        particles: particles.to_vec(),
        twists: vec![Twist::default(); 2],
        contacts: contacts.to_vec(),
        in_flow: Some(contacts.iter().map(force).collect()),
        domain,
        in_box: None,
        fields: None,
    };
    writer.write(&frame).expect("files");

    let piece = read(&folder.path().join("contacts-000000.vtu"));
    assert_eq!(piece.cells.types, [[CellType::Vertex; 2].as_slice(), &[CellType::Line; 3]].concat());
    assert_eq!(numbers(&piece.data.cell, "lambda"), [0.0, 0.0, 1.0, 2.0, 3.0]);
    assert_eq!(numbers(&piece.data.cell, "gamma"), [0.0, 0.0, -1.0, -2.0, -3.0]);
    assert_eq!(
        numbers(&piece.data.cell, "friction")[3..],
        [0.0, 0.0, 0.0, -0.5, 0.0, 0.0, -0.5, 0.0, 0.0, -0.5, 0.0, 0.0]
    );
    assert_eq!(numbers(&piece.data.cell, "slip")[6..9], [0.25, 0.0, 0.0]);
    assert_eq!(numbers(&piece.data.cell, "slides"), [0.0, 0.0, 0.0, 1.0, 1.0]);
    assert_eq!(numbers(&piece.data.cell, "roughness"), [0.0, 0.0, 0.01, 0.01, 0.01]);
    let points: Vec<f64> = piece.points.cast_into().expect("numbers");
    // After the centres: the image of particle 1, and its foot point on the ceiling.
    assert_eq!(points[6..], [-0.5, 1.5, 0.0, 3.5, 2.0, 0.0]);
    assert_eq!(piece.cells.cell_verts.into_xml().0, [0, 1, 0, 1, 0, 2, 1, 3]);
}

/// Two discs that touch across the upper border of a sheared box, both far from it by now: shown in the box,
/// a line from one to the image of the other, and that image beside them.
#[test]
fn a_sheared_box_is_shown_whole() {
    let folder = TempDir::new().expect("a folder");
    let particles = [[3.3, 0.92], [-1.8, -0.92]].map(|x| Particle::new(Vector::<2>::from(x), 0.1));
    let mut domain = Domain::periodic(&Vector::<2>::repeat(1.0));
    domain.set_sliding(5.1, 0.0);
    let in_box =
        Some(ShownBox { container: Container::periodic(&Vector::<2>::repeat(1.0)).tilted(5.1), slide: 0.4 });
    let twists = [Twist { velocity: Vector::<2>::new(1.0, 2.0), ..Twist::default() }; 2];
    let contacts = [Contact { pair: PairKey::across(0, 1, [-5, 2, 0]), lambda: 1.0, gamma: 0.0, gap: 0.0 }];
    let mut writer = VtkWriter::create(folder.path(), &[]).expect("a folder");
    let (particles, twists, contacts) = (particles.to_vec(), twists.to_vec(), contacts.to_vec());
    let (in_flow, fields) = (None, None);
    let frame = VtkFrame { step: 0, time: 0.0, particles, twists, contacts, in_flow, domain, in_box, fields };
    writer.write(&frame).expect("files");

    let near = |found: &[f64], exact: &[f64]| {
        assert_eq!(found.len(), exact.len(), "{found:?}");
        assert!(found.iter().zip(exact).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {exact:?}");
    };
    let piece = read(&folder.path().join("particles-000000.vtu"));
    let points: Vec<f64> = piece.points.cast_into().expect("numbers");
    let data = &piece.data.point;
    // The first is three periods away, the second one row of images up, where x is 5.1 further.
    near(&points[..6], &[0.3, 0.92, 0.0, 0.3, 0.08, 0.0]);
    let (numbers_of, is_image) = (numbers(data, "particle"), numbers(data, "image"));
    assert_eq!((&numbers_of[..2], &is_image[..2]), ([1.0, 2.0].as_slice(), [0.0, 0.0].as_slice()));
    assert!(is_image[2..].iter().all(|image| *image == 1.0));
    let place = |x: [f64; 2]| points.chunks(3).position(|p| (p[0] - x[0]).hypot(p[1] - x[1]) < 1e-12);
    let above = place([0.4, 1.08]).expect("the image above of the second");
    assert_eq!(numbers_of[above], 2.0);
    let below = place([0.2, -0.08]).expect("the image below of the first");
    assert_eq!(numbers_of[below], 1.0);
    let velocities = numbers(data, "velocity");
    let velocity = |ball: usize| velocities[3 * ball..3 * ball + 2].to_vec();
    near(&[velocity(0), velocity(1)].concat(), &[1.0, 2.0, 1.4, 2.0]);
    near(&[velocity(above), velocity(below)].concat(), &[1.8, 2.0, 0.6, 2.0]);
    near(&numbers(data, "unwrapped")[..6], &[3.3, 0.92, 0.0, -1.8, -0.92, 0.0]);

    let piece = read(&folder.path().join("contacts-000000.vtu"));
    let points: Vec<f64> = piece.points.cast_into().expect("numbers");
    assert_eq!(piece.cells.cell_verts.into_xml().0, [0, 1, 0, 2]);
    near(&points, &[0.3, 0.92, 0.0, 0.3, 0.08, 0.0, 0.4, 1.08, 0.0]);
}

/// Two spheres without a mesh to a time of 1, and options that write every so many steps into a folder.
fn mobility_run(folder: &Path, every: usize) -> (Case, RunOptions) {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-3d-mobility.toml");
    let mut case = Case::load(file).expect("a case");
    case.time.end = 1.0;
    let vtk = VtkOptions::new(folder.join("vtk"), every);
    (case, RunOptions { vtk: Some(vtk), ..RunOptions::csv(folder.join("t.csv")) })
}

/// Frames are on their way while the run goes on: the last ones, too, are waited for.
#[test]
fn a_last_frame_that_cannot_be_written_fails_the_run() {
    let folder = TempDir::new().expect("a folder");
    let (case, options) = mobility_run(folder.path(), 10);
    // Where a file should be there is a folder.
    let last = folder.path().join("vtk/particles-000020.vtu");
    fs::create_dir_all(&last).expect("a folder");
    let error = run(&case, &options, &Silent).expect_err("a frame is missing");
    assert!(error.to_string().contains(&last.display().to_string()), "{error}");
    assert!(folder.path().join("vtk/particles-000010.vtu").is_file());
}

#[test]
fn runs_leave_a_collection_of_all_times() {
    let folder = TempDir::new().expect("a folder");
    let (case, options) = mobility_run(folder.path(), 8);
    run(&case, &options, &Silent).unwrap_or_else(|error| panic!("{error}"));
    let collection = fs::read_to_string(folder.path().join("vtk/particles.pvd")).expect("a collection");
    for (time, file) in
        [("0", "particles-000000.vtu"), ("0.4", "particles-000008.vtu"), ("0.8", "particles-000016.vtu")]
    {
        assert!(
            collection.contains(&format!("timestep=\"{time}\" part=\"0\" file=\"{file}\"")),
            "{collection}"
        );
        assert_eq!(read(&folder.path().join("vtk").join(file)).cells.types.len(), 2);
    }
    assert_eq!(collection.matches("<DataSet").count(), 3);
}
