//! Fields, particles and contacts for ParaView, VTK and meshio: compressed `.vtu` files and `.pvd`
//! collections.
//!
//! Three series a run: `fields` (velocity, pressure, viscosity, level set and rigidity multiplier at the
//! nodes of quadratic cells), `particles` (a vertex each: radius, velocity, spin, number, where it is when
//! nothing brings it back into a periodic box, whether it is an image) and `contacts` (a line for each
//! contact, from centre to centre, to the centre of an image across a periodic border, or to the foot
//! point on a wall: gamma, lambda, gap, and where contacts act in the flow friction, slip, slides and
//! roughness; and a vertex for every particle, so that the file is readable when
//! nothing touches).
//!
//! Where ranks share the flow, each has its cells in a file of its own, and `.pvtu` files name those of a
//! step.
//!
//! In periodic boxes particles are where the fields are, in the box, and images that reach into it follow
//! them, so that pictures are whole.

mod background;
mod grid;
mod pieces;
mod read;
mod shown;
mod xml;

use std::path::{Path, PathBuf};

use gluey_contact::{Contact, ContactForce, Domain, Partner};
use gluey_geom::{Dim, Particle, Spin, Twist, Vector};
use gluey_motion::Fields;

use super::{FileError, prepare_folder_of, pvd, remove_stale};

pub use crate::case::Precision;
pub(crate) use background::{FrameWriter, OnTheirWay};
use grid::{FIELDS, fields_piece, in_space, scalars, vectors};
pub use pieces::write_piece;
pub use read::{VtkReadError, read_fields, read_particles};
pub use shown::ShownBox;
use shown::{Shown, shown};
use vtkio::model::CellType;
pub use xml::VtkEncoding;
use xml::{Array, GridPiece};

/// What rounding may do to a place, relative to the distance of centres.
const ROUNDING: f64 = 1e-6;

/// Particles, contacts and fields at one instant.
#[derive(Clone, Debug)]
pub struct VtkFrame<const D: usize> {
    /// Step that starts here.
    pub step: usize,
    /// Time.
    pub time: f64,
    /// Particles.
    pub particles: Vec<Particle<D>>,
    /// Their velocities.
    pub twists: Vec<Twist<D>>,
    /// Contacts.
    pub contacts: Vec<Contact>,
    /// Their forces over `6 pi eta`, one for each, where they act in the flow.
    pub in_flow: Option<Vec<ContactForce<D>>>,
    /// Their walls and periods.
    pub domain: Domain<D>,
    /// The box that particles are shown in; where they are, if there is none.
    pub in_box: Option<ShownBox<D>>,
    /// Flow fields, where the model has any.
    pub fields: Option<Fields<D>>,
}

/// Writes frames into a folder and keeps the collections up to date.
#[derive(Debug)]
pub struct VtkWriter {
    folder: PathBuf,
    encoding: VtkEncoding,
    series: [FrameSeries; 3],
}

/// Files of one kind and their times.
#[derive(Debug)]
struct FrameSeries {
    name: &'static str,
    /// How many files a step has, of which this writer writes the first; none for one file.
    pieces: Option<usize>,
    entries: Vec<(f64, String)>,
}

impl VtkWriter {
    /// Prepares `folder`. Of the steps already done when a run goes on from a checkpoint, given as `(step,
    /// time)`, those with a file in the folder stay in the collections.
    pub fn create(folder: &Path, done: &[(usize, f64)]) -> Result<Self, FileError> {
        prepare_folder_of(&folder.join("fields.pvd"))?;
        let series = [FIELDS, "particles", "contacts"].map(|name| {
            let files = |step| [file_name(name, step), pieces::index_name(name, step)];
            let there = |step| files(step).into_iter().find(|file| folder.join(file).is_file());
            let entries = done.iter().filter_map(|&(step, time)| Some((time, there(step)?)));
            FrameSeries { name, pieces: None, entries: entries.collect() }
        });
        Ok(Self { folder: folder.to_owned(), encoding: VtkEncoding::default(), series })
    }

    /// The same with other numbers in the files.
    pub fn encoded(mut self, encoding: VtkEncoding) -> Self {
        self.encoding = encoding;
        self
    }

    /// The same where fields come in so many pieces, of which frames have the first. The others have to be
    /// there ([`write_piece`]) when a frame is written.
    pub fn in_pieces(mut self, count: usize) -> Self {
        let fields = self.series.iter_mut().filter(|series| series.name == FIELDS);
        fields.for_each(|series| series.pieces = Some(count));
        self
    }

    /// Writes one instant.
    pub fn write<const D: usize>(&mut self, frame: &VtkFrame<D>) -> Result<(), FileError> {
        let balls = shown(&frame.particles, frame.in_box.as_ref());
        let pieces = [
            frame.fields.as_ref().map(fields_piece),
            Some(particles_piece(frame, &balls)),
            Some(contacts_piece(frame, &balls)),
        ];
        for (series, piece) in self.series.iter_mut().zip(pieces) {
            if let Some(piece) = piece {
                series.add(&self.folder, frame.step, frame.time, piece, self.encoding)?;
            }
        }
        Ok(())
    }
}

impl FrameSeries {
    fn add(
        &mut self,
        folder: &Path,
        step: usize,
        time: f64,
        piece: GridPiece,
        encoding: VtkEncoding,
    ) -> Result<(), FileError> {
        let (whole, index) = (file_name(self.name, step), pieces::index_name(self.name, step));
        // A run that was resumed may have written the step in the other way before.
        let (file, other) = match self.pieces {
            None => {
                xml::write(&folder.join(&whole), piece, encoding)?;
                (whole, index)
            }
            Some(count) => {
                pieces::write_first(folder, self.name, step, count, piece, encoding)?;
                (index, whole)
            }
        };
        remove_stale(&folder.join(other))?;
        self.entries.push((time, file));
        pvd::write(&folder.join(format!("{}.pvd", self.name)), &self.entries)
    }
}

fn file_name(series: &str, step: usize) -> String {
    format!("{series}-{step:06}.vtu")
}

fn particles_piece<const D: usize>(frame: &VtkFrame<D>, balls: &[Shown<D>]) -> GridPiece {
    let (particles, twists) = (&frame.particles, &frame.twists);
    let count = balls.len();
    let velocity = |ball: &Shown<D>| {
        let mut velocity = twists[ball.particle].velocity;
        velocity[0] += ball.slide;
        velocity
    };
    let of_balls = |number: &dyn Fn(&Shown<D>) -> f64| balls.iter().map(number).collect();
    let velocities: Vec<Vector<D>> = balls.iter().map(velocity).collect();
    let unwrapped: Vec<_> = balls.iter().map(|ball| particles[ball.particle].pose.position).collect();
    let spins: Vec<f64> =
        balls.iter().flat_map(|ball| spin_in_space::<D>(&twists[ball.particle].spin)).collect();
    GridPiece {
        points: in_space(&centers(balls)),
        connectivity: (0..count as u64).collect(),
        offsets: (1..=count as u64).collect(),
        types: vec![CellType::Vertex; count],
        of_points: vec![
            scalars("radius", of_balls(&|ball| particles[ball.particle].radius)),
            vectors("velocity", &velocities),
            Array { name: "spin", components: 3, values: spins },
            scalars("particle", of_balls(&|ball| ball.particle as f64 + 1.0)),
            scalars("image", of_balls(&|ball| f64::from(u8::from(ball.is_image)))),
            vectors("unwrapped", &unwrapped),
        ],
        of_cells: Vec::new(),
    }
}

/// Vertices at the centres and lines between what is in contact. Foot points on walls and centres of images
/// follow the centres, without a vertex.
fn contacts_piece<const D: usize>(frame: &VtkFrame<D>, balls: &[Shown<D>]) -> GridPiece {
    let (contacts, count) = (&frame.contacts, frame.particles.len());
    let positions: Vec<Vector<D>> = frame.particles.iter().map(|particle| particle.pose.position).collect();
    let mut points = centers(&balls[..count]);
    let mut connectivity: Vec<u64> = (0..count as u64).collect();
    for Contact { pair, .. } in contacts {
        let branch = pair.branch(&positions, &frame.domain).unwrap_or_else(Vector::zeros);
        let end = points[pair.first as usize] + branch;
        let second = match pair.second {
            // Where both are shown side by side the line ends at the vertex.
            Partner::Particle { index, .. } if is_at(&end, &points[index as usize], branch.norm()) => {
                u64::from(index)
            }
            _ => {
                points.push(end);
                points.len() as u64 - 1
            }
        };
        connectivity.extend([u64::from(pair.first), second]);
    }
    let mut offsets: Vec<u64> = (1..=count as u64).collect();
    offsets.extend((1..=contacts.len()).map(|line| (count + 2 * line) as u64));
    let mut types = vec![CellType::Vertex; count];
    types.resize(count + contacts.len(), CellType::Line);
    // Vertices carry zeros.
    let of_lines = |value: fn(&Contact) -> f64| -> Vec<f64> {
        std::iter::repeat_n(0.0, count).chain(contacts.iter().map(value)).collect()
    };
    let mut of_cells = vec![
        scalars("gamma", of_lines(|contact| contact.gamma)),
        scalars("lambda", of_lines(|contact| contact.lambda)),
        scalars("gap", of_lines(|contact| contact.gap)),
    ];
    of_cells.extend(frame.in_flow.iter().flat_map(|forces| rubbing(forces, count)));
    GridPiece { points: in_space(&points), connectivity, offsets, types, of_points: Vec::new(), of_cells }
}

/// Friction, slip and roughness of contacts, behind the zeros of so many vertices.
fn rubbing<const D: usize>(forces: &[ContactForce<D>], count: usize) -> [Array; 4] {
    let scalar = |value: fn(&ContactForce<D>) -> f64| -> Vec<f64> {
        std::iter::repeat_n(0.0, count).chain(forces.iter().map(value)).collect()
    };
    let vector = |value: fn(&ContactForce<D>) -> Vector<D>| -> Vec<Vector<D>> {
        std::iter::repeat_n(Vector::zeros(), count).chain(forces.iter().map(value)).collect()
    };
    [
        vectors("friction", &vector(|one| one.tangential())),
        vectors("slip", &vector(|one| one.slip)),
        scalars("slides", scalar(|one| f64::from(u8::from(one.slides)))),
        scalars("roughness", scalar(|one| one.floor)),
    ]
}

/// A plane spin turns about z.
fn spin_in_space<const D: usize>(spin: &Spin<D>) -> [f64; 3] {
    match Dim::<D>::spin_slice(spin) {
        [x, y, z] => [*x, *y, *z],
        other => [0.0, 0.0, other.first().copied().unwrap_or(0.0)],
    }
}

fn centers<const D: usize>(balls: &[Shown<D>]) -> Vec<Vector<D>> {
    balls.iter().map(|ball| ball.center).collect()
}

/// Whether two places are the same but for rounding, relative to a length.
fn is_at<const D: usize>(x: &Vector<D>, y: &Vector<D>, length: f64) -> bool {
    (x - y).norm() <= ROUNDING * length
}
