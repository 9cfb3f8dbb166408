//! Frames in extended XYZ, read back.

use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;
use gluey_geom::{Aabb, Vector};
use gluey_suspension::Container;
use thiserror::Error;

use super::super::FileError;
use super::{PROPERTIES, WITH_FORCES, XyzFrame};
use crate::text::{decoded, visible};

/// Numbers in the line of a particle, without and with the force of its contacts.
const NUMBER_COUNT: usize = 10;
const COUNT_WITH_FORCES: usize = 13;

/// A file could not be read as a frame.
#[derive(Debug, Error)]
pub enum XyzError {
    /// It could not be read.
    #[error(transparent)]
    Read(#[from] FileError),
    /// It has no particles.
    #[error("{}:{line}: no particles", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// Line, from 1, that says how many there are.
        line: usize,
    },
    /// It is not what `gluey run --xyz` writes.
    #[error("{}:{line}: found `{}`, expected {wanted}", path.display(), visible(found))]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The text as written.
        found: String,
        /// What would be right.
        wanted: String,
    },
}

/// The text of a file, uncompressed where its name ends in `.gz`.
pub fn read_text(path: &Path) -> Result<String, XyzError> {
    let read = || {
        let bytes = std::fs::read(path)?;
        let mut unpacked = Vec::new();
        match path.extension().is_some_and(|extension| extension == "gz") {
            true => GzDecoder::new(&*bytes).read_to_end(&mut unpacked).map(drop)?,
            false => unpacked = bytes,
        }
        decoded(unpacked)
    };
    Ok(read().map_err(|error| FileError::unread(path, error))?)
}

/// The dimension of space of a frame.
pub fn dimension(path: &Path, text: &str) -> Result<usize, XyzError> {
    let lines = FrameLines { path, lines: text.lines().collect() };
    match lines.value("Dimension")?.parse() {
        Ok(dimension @ 2..=3) => Ok(dimension),
        _ => Err(lines.fault(1, lines.value("Dimension")?, "2 or 3")),
    }
}

impl<const D: usize> XyzFrame<D> {
    /// Reads a frame; `path` is what errors call it.
    pub fn parse(path: &Path, text: &str) -> Result<Self, XyzError> {
        let lines = FrameLines { path, lines: text.lines().collect() };
        let count: usize = lines
            .line(0)
            .trim()
            .parse()
            .map_err(|_| lines.fault(0, lines.line(0), "the number of particles"))?;
        if count == 0 {
            return Err(XyzError::Empty { path: path.to_owned(), line: 1 });
        }
        let container = lines.container::<D>()?;
        let number_count = match lines.value("Properties")? {
            PROPERTIES => NUMBER_COUNT,
            WITH_FORCES => COUNT_WITH_FORCES,
            other => return Err(lines.fault(1, other, &format!("Properties={WITH_FORCES}"))),
        };
        let [time, strain] = [lines.numbers::<1>("Time")?[0], lines.numbers::<1>("Strain")?[0]];
        let mut frame = Self {
            time,
            strain,
            container,
            positions: Vec::new(),
            radii: Vec::new(),
            velocities: Vec::new(),
            spins: Vec::new(),
            contact_forces: (number_count == COUNT_WITH_FORCES).then(Vec::new),
        };
        (2..count + 2).try_for_each(|line| frame.push(&lines.particle(line, number_count)?, &lines, line))?;
        Ok(frame)
    }

    fn push(&mut self, numbers: &[f64], lines: &FrameLines<'_>, line: usize) -> Result<(), XyzError> {
        if numbers[3] <= 0.0 {
            return Err(lines.fault(line, &numbers[3].to_string(), "a positive radius"));
        }
        self.positions.push(Vector::from_fn(|d, _| numbers[d]));
        self.radii.push(numbers[3]);
        self.velocities.push(Vector::from_fn(|d, _| numbers[4 + d]));
        self.spins.push(std::array::from_fn(|d| numbers[7 + d]));
        if let Some(forces) = &mut self.contact_forces {
            forces.push(Vector::from_fn(|d, _| numbers[NUMBER_COUNT + d]));
        }
        Ok(())
    }
}

/// The lines of a file.
struct FrameLines<'a> {
    path: &'a Path,
    lines: Vec<&'a str>,
}

impl<'a> FrameLines<'a> {
    fn line(&self, index: usize) -> &'a str {
        self.lines.get(index).copied().unwrap_or("")
    }

    fn fault(&self, index: usize, found: &str, wanted: &str) -> XyzError {
        let (found, wanted) = (found.to_owned(), wanted.to_owned());
        XyzError::Malformed { path: self.path.to_owned(), line: index + 1, found, wanted }
    }

    /// The value of a key of the second line, without quotes.
    fn value(&self, key: &str) -> Result<&'a str, XyzError> {
        let comment = self.line(1);
        let start = comment.match_indices(key).find(|(at, _)| {
            let is_word = *at == 0 || comment.as_bytes()[at - 1] == b' ';
            is_word && comment[at + key.len()..].starts_with('=')
        });
        let missing = || self.fault(1, comment, &format!("`{key}=...` in the second line"));
        let rest = start.map(|(at, _)| &comment[at + key.len() + 1..]).ok_or_else(missing)?;
        let value = match rest.strip_prefix('"') {
            Some(quoted) => quoted.split('"').next(),
            None => rest.split_whitespace().next(),
        };
        value.ok_or_else(missing)
    }

    /// As many numbers as there must be under a key.
    fn numbers<const N: usize>(&self, key: &str) -> Result<[f64; N], XyzError> {
        let value = self.value(key)?;
        let numbers: Option<Vec<f64>> = value.split_whitespace().map(number).collect();
        let fault = || self.fault(1, value, &format!("{N} numbers for `{key}`"));
        numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(fault)
    }

    fn container<const D: usize>(&self) -> Result<Container<D>, XyzError> {
        let (edges, origin) = (self.numbers::<9>("Lattice")?, self.numbers::<3>("Origin")?);
        let periodic: Vec<&str> = self.value("pbc")?.split_whitespace().collect();
        let lower = Vector::<D>::from_fn(|d, _| origin[d]);
        let upper = Vector::<D>::from_fn(|d, _| origin[d] + edges[4 * d]);
        let is_box = (0..D).all(|d| upper[d] > lower[d]) && periodic.len() == 3;
        if !is_box {
            return Err(self.fault(1, self.line(1), "a box"));
        }
        let bounds = Aabb { lower, upper };
        let container = Container::new(bounds, std::array::from_fn(|d| periodic[d] == "T"));
        Ok(container.tilted(edges[3]))
    }

    /// The numbers in the line of a particle, which must be so many.
    fn particle(&self, index: usize, count: usize) -> Result<Vec<f64>, XyzError> {
        let line = self.line(index);
        let cells = line.split_whitespace().skip(1);
        let read = |cell: &str| number(cell).ok_or_else(|| self.fault(index, cell, "a finite number"));
        let numbers = cells.map(read).collect::<Result<Vec<f64>, _>>()?;
        match numbers.len() == count {
            true => Ok(numbers),
            false => Err(self.fault(index, line, &format!("a particle: a name and {count} numbers"))),
        }
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}
