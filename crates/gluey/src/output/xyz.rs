//! Particles in extended XYZ, a file per frame, as OVITO and ASE read it.
//!
//! The first line is the number of particles, the second holds `key=value`: `Lattice` (the edges of the box,
//! the second one tilted), `Origin`, `pbc` (`T` along periodic axes), `Properties`, `Time`, `Strain` (of the
//! undisturbed flow) and `Dimension`. A line per particle: `species pos radius velo angular_velocity`, and
//! `contact_force` where there is a contact model, vectors of three coordinates each. In 2D discs lie in the
//! middle of a box as high as the largest of them.
//! Positions are not wrapped. Numbers read back exactly.

mod read;

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use gluey_geom::{Dim, Particle, Twist, Vector};
use gluey_suspension::Container;

use super::{FileError, prepare_folder_of, write_atomically};

pub use read::{XyzError, dimension, read_text};

/// What all frames have.
const PROPERTIES: &str = "species:S:1:pos:R:3:radius:R:1:velo:R:3:angular_velocity:R:3";
/// What those of a run with a contact model have besides.
const WITH_FORCES: &str = "species:S:1:pos:R:3:radius:R:1:velo:R:3:angular_velocity:R:3:contact_force:R:3";

/// Fast: numbers hardly get smaller at higher levels.
const COMPRESSION_LEVEL: u32 = 1;

/// Particles at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct XyzFrame<const D: usize> {
    /// Time.
    pub time: f64,
    /// Shear strain of the undisturbed flow.
    pub strain: f64,
    /// The box.
    pub container: Container<D>,
    /// Centres, not wrapped.
    pub positions: Vec<Vector<D>>,
    /// Radii.
    pub radii: Vec<f64>,
    /// Velocities of the centres.
    pub velocities: Vec<Vector<D>>,
    /// Angular velocities; in 2D about the third axis.
    pub spins: Vec<[f64; 3]>,
    /// Sum of the forces of its contacts on each particle, over `6 pi eta`; none without a contact model.
    /// Unit: length^2/time.
    pub contact_forces: Option<Vec<Vector<D>>>,
}

impl<const D: usize> XyzFrame<D> {
    /// Particles and their twists at a time and a strain.
    pub fn of(
        time: f64,
        strain: f64,
        container: Container<D>,
        particles: &[Particle<D>],
        twists: &[Twist<D>],
    ) -> Self {
        Self {
            time,
            strain,
            container,
            positions: particles.iter().map(|particle| particle.pose.position).collect(),
            radii: particles.iter().map(|particle| particle.radius).collect(),
            velocities: twists.iter().map(|twist| twist.velocity).collect(),
            spins: twists.iter().map(|twist| spin(Dim::<D>::spin_slice(&twist.spin))).collect(),
            contact_forces: None,
        }
    }

    /// The same with the forces of contacts.
    #[must_use]
    pub fn with_contact_forces(self, forces: Vec<Vector<D>>) -> Self {
        Self { contact_forces: Some(forces), ..self }
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        let mut text = format!("{}\n{}\n", self.positions.len(), self.comment());
        for (i, (position, radius)) in self.positions.iter().zip(&self.radii).enumerate() {
            text.push('P');
            write_numbers(&mut text, &padded(position.as_slice()));
            write_numbers(&mut text, &[*radius]);
            write_numbers(&mut text, &padded(self.velocities[i].as_slice()));
            write_numbers(&mut text, &self.spins[i]);
            if let Some(forces) = &self.contact_forces {
                write_numbers(&mut text, &padded(forces[i].as_slice()));
            }
            text.push('\n');
        }
        text
    }

    fn comment(&self) -> String {
        let height = 2.0 * self.radii.iter().copied().fold(0.0, f64::max);
        let (bounds, lattice) = (self.container.bounds(), self.container.lattice());
        let [mut origin, mut edges] = [bounds.lower, bounds.extent()].map(|x| padded(x.as_slice()));
        if D == 2 {
            (origin[2], edges[2]) = (-0.5 * height, height);
        }
        let [x, y, z] = edges;
        let mut text = "Lattice=\"".to_owned();
        write_numbers(&mut text, &[x, 0.0, 0.0, lattice.tilt(), y, 0.0, 0.0, 0.0, z]);
        text.push_str("\" Origin=\"");
        write_numbers(&mut text, &origin);
        let periodic = (0..3).map(|d| if d < D && !self.container.is_walled(d) { "T" } else { "F" });
        let periodic: Vec<&str> = periodic.collect();
        let (time, strain) = (self.time, self.strain);
        let properties = if self.contact_forces.is_some() { WITH_FORCES } else { PROPERTIES };
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "\" pbc=\"{}\" Properties={properties} Time={time:e} Strain={strain:e} Dimension={D}",
            periodic.join(" ")
        );
        text.replace("=\" ", "=\"")
    }
}

/// Three coordinates; the third of a plane is 0.
fn padded(x: &[f64]) -> [f64; 3] {
    std::array::from_fn(|d| x.get(d).copied().unwrap_or(0.0))
}

/// A spin with three components.
fn spin(components: &[f64]) -> [f64; 3] {
    match *components {
        [about_z] => [0.0, 0.0, about_z],
        _ => padded(components),
    }
}

/// Adds numbers that read back exactly, each behind a space.
fn write_numbers(text: &mut String, numbers: &[f64]) {
    for number in numbers {
        let _ = write!(text, " {number:e}");
    }
}

/// Writes frames into a folder.
#[derive(Debug)]
pub struct XyzWriter {
    folder: PathBuf,
    gzip: bool,
}

impl XyzWriter {
    /// Prepares `folder`.
    pub fn create(folder: &Path, gzip: bool) -> Result<Self, FileError> {
        prepare_folder_of(&folder.join("particles.xyz"))?;
        Ok(Self { folder: folder.to_owned(), gzip })
    }

    /// Writes the frame of a step, `particles-<step>.xyz`, which appears when it is complete.
    pub fn write<const D: usize>(&self, step: usize, frame: &XyzFrame<D>) -> Result<(), FileError> {
        let name = format!("particles-{step:06}.xyz{}", if self.gzip { ".gz" } else { "" });
        let (path, text) = (self.folder.join(name), frame.text());
        if !self.gzip {
            return write_atomically(&path, text.as_bytes());
        }
        let mut encoder = GzEncoder::new(Vec::new(), Compression::new(COMPRESSION_LEVEL));
        let bytes = encoder.write_all(text.as_bytes()).and_then(|()| encoder.finish());
        let bytes = bytes.map_err(|error| FileError::new(&path, "compress the file", error))?;
        write_atomically(&path, &bytes)
    }
}

#[cfg(test)]
mod tests {
    use gluey_geom::Aabb;

    use super::*;

    fn frame<const D: usize>(tilt: f64) -> XyzFrame<D> {
        let bounds =
            Aabb { lower: Vector::repeat(-0.25), upper: Vector::from_fn(|d, _| [2.0, 1.0, 0.75][d]) };
        let container = Container::new(bounds, std::array::from_fn(|d| d != 2)).tilted(tilt);
        let particles: Vec<_> = (0..3)
            .map(|n| Particle::new(Vector::<D>::repeat(f64::from(n) / 3.0), 0.125 * f64::from(n + 1)))
            .collect();
        let twist = Twist { velocity: Vector::repeat(-1.0 / 7.0), ..Twist::default() };
        let mut frame = XyzFrame::of(0.1, -0.3, container, &particles, &[twist; 3]);
        frame.spins[1][2] = 1e-20 / 3.0;
        frame
    }

    fn reads_back<const D: usize>() {
        let folder = tempfile::tempdir().expect("a folder");
        for (gzip, tilt) in [(false, 0.0), (true, 0.25)] {
            let mut written = frame::<D>(tilt);
            if gzip {
                written = written.with_contact_forces(vec![Vector::repeat(0.1 / 7.0); 3]);
            }
            XyzWriter::create(folder.path(), gzip).expect("a folder").write(7, &written).expect("a file");
            let name = if gzip { "particles-000007.xyz.gz" } else { "particles-000007.xyz" };
            let path = folder.path().join(name);
            let text = read_text(&path).expect("text");
            assert_eq!(dimension(&path, &text).expect("a number"), D);
            assert_eq!(XyzFrame::<D>::parse(&path, &text).expect("a frame"), written);
        }
    }

    #[test]
    fn frames_read_back_exactly() {
        reads_back::<2>();
        reads_back::<3>();
    }

    #[test]
    fn the_second_line_says_what_other_programs_want_to_know() {
        let text = frame::<2>(0.5).text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!((lines[0], lines.len()), ("3", 5));
        assert_eq!(
            lines[1],
            "Lattice=\"2.25e0 0e0 0e0 5e-1 1.25e0 0e0 0e0 0e0 7.5e-1\" Origin=\"-2.5e-1 -2.5e-1 -3.75e-1\" \
             pbc=\"T T F\" Properties=species:S:1:pos:R:3:radius:R:1:velo:R:3:angular_velocity:R:3 \
             Time=1e-1 Strain=-3e-1 Dimension=2"
        );
        assert!(lines[2].starts_with("P 0e0 0e0 0e0 1.25e-1 "));
        let with = frame::<2>(0.5).with_contact_forces(vec![Vector::<2>::new(0.5, -2.0); 3]).text();
        let with: Vec<&str> = with.lines().collect();
        assert_eq!(with[1], lines[1].replace(PROPERTIES, WITH_FORCES));
        assert_eq!(with[2], format!("{} 5e-1 -2e0 0e0", lines[2]), "what is there stays as it is");
    }

    #[test]
    fn faults_have_their_line() {
        let text = frame::<3>(0.0).text();
        let fault =
            |text: &str| XyzFrame::<3>::parse(Path::new("f.xyz"), text).expect_err("refused").to_string();
        assert!(fault("").starts_with("f.xyz:1: "));
        assert!(fault(&text.replacen('3', "4", 1)).starts_with("f.xyz:6: "));
        assert!(fault(&text.replace("Time", "Tome")).starts_with("f.xyz:2: "));
        assert!(fault(&text.replacen("P 0e0", "P zero", 1)).contains("f.xyz:3: found `zero`"));
        assert!(fault(&text.replace(PROPERTIES, "pos:R:3")).contains("f.xyz:2: found `pos:R:3`"));
        let short = fault(&text.replace(PROPERTIES, WITH_FORCES));
        assert!(short.starts_with("f.xyz:3: ") && short.contains("a name and 13 numbers"), "{short}");
    }
}
