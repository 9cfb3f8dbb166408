//! The contacts of frames, from the table of near pairs of their run.

use std::path::Path;

use gluey::ResultPaths;
use gluey::output::xyz::XyzFrame;
use gluey::output::{rows_of, whole_lines};
use gluey::table::{NumberTable, TableError};
use gluey_geom::Vector;

use crate::frames::{FramesError, table_beside};

/// A contact in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameContact<const D: usize> {
    /// The particle, from 0.
    pub first: usize,
    /// Its partner; none for a wall.
    pub second: Option<usize>,
    /// From the centre of the first to that of its partner, to the nearest image of it, or to the wall.
    pub arm: Vector<D>,
    /// Normal force over `6 pi eta`, positive apart.
    pub force: f64,
    /// Whether the surfaces slip, where contacts act in the flow; else they stick.
    pub slides: Option<bool>,
}

/// The contacts of each of these frames, the first of which was read from `file`; nothing where the run has
/// no table of near pairs, or no contact model.
pub fn contacts_of<const D: usize>(
    file: &Path,
    frames: &[XyzFrame<D>],
) -> Result<Option<Vec<Vec<FrameContact<D>>>>, FramesError> {
    let Some(path) = table_beside(file, ResultPaths::gaps).and_then(|table| rows_of(&table)) else {
        return Ok(None);
    };
    let text = whole_lines(&path)?;
    let rows = NumberTable::parse(&with_numbers(&text)).and_then(|table| ContactRows::of(&table));
    match rows.map_err(|source| FramesError::Table { path: path.clone(), source })? {
        None => Ok(None),
        Some(rows) => {
            let contacts: Option<Vec<_>> = frames.iter().map(|frame| rows.of_frame(frame)).collect();
            let strangers = || FramesError::Strangers { path, first: file.to_owned() };
            contacts.ok_or_else(strangers).map(Some)
        }
    }
}

/// The rows of a table that have a force.
struct ContactRows(Vec<ContactRow>);

struct ContactRow {
    time: f64,
    /// The particle and its partner, from 1.
    pair: [usize; 2],
    is_wall: bool,
    /// In mean radii.
    gap: f64,
    force: f64,
    slides: Option<bool>,
}

impl ContactRows {
    /// Those of a table; nothing where no row tells of forces.
    fn of(table: &NumberTable) -> Result<Option<Self>, TableError> {
        let [time, i, j, gap, partner] =
            ["t", "i", "j", "gap_over_a", "partner"].map(|name| table.column(name));
        let (time, i, j, gap, partner, force) =
            (time?, i?, j?, gap?, partner?, table.column("contact_force")?);
        if force.iter().all(|force| force.is_nan()) {
            return Ok(None);
        }
        let slides = table.find("slides");
        let contacts = (0..table.row_count()).filter(|row| force[*row] != 0.0);
        let row = |row: usize| ContactRow {
            time: time[row],
            pair: [i[row] as usize, j[row] as usize],
            is_wall: partner[row] != 0.0,
            gap: gap[row],
            force: force[row],
            slides: slides.map(|slides| slides[row] > 0.0),
        };
        Ok(Some(Self(contacts.map(row).collect())))
    }

    /// The contacts at the time of a frame; nothing if they are of particles that it has not.
    fn of_frame<const D: usize>(&self, frame: &XyzFrame<D>) -> Option<Vec<FrameContact<D>>> {
        let begin = self.0.partition_point(|row| row.time < frame.time);
        let rows = self.0[begin..].iter().take_while(|row| row.time == frame.time);
        rows.map(|row| row.contact(frame)).collect()
    }
}

impl ContactRow {
    fn contact<const D: usize>(&self, frame: &XyzFrame<D>) -> Option<FrameContact<D>> {
        let Self { pair: [i, j], is_wall, gap, force, slides, .. } = *self;
        let index = |number: usize| number.checked_sub(1).filter(|index| *index < frame.radii.len());
        let first = index(i)?;
        let (second, arm) = match is_wall {
            true => (None, to_wall(frame, first, gap, j == 1)),
            false => {
                let second = index(j)?;
                let way = frame.positions[second] - frame.positions[first];
                (Some(second), frame.container.lattice().nearest(&way).0)
            }
        };
        Some(FrameContact { first, second, arm, force, slides })
    }
}

/// From the centre of a particle to the wall below or above, at a gap in mean radii.
fn to_wall<const D: usize>(frame: &XyzFrame<D>, particle: usize, gap: f64, is_below: bool) -> Vector<D> {
    let mean = frame.radii.iter().sum::<f64>() / frame.radii.len() as f64;
    let length = frame.radii[particle] + gap * mean;
    Vector::from_fn(|axis, _| {
        if axis != 1 {
            0.0
        } else if is_below {
            -length
        } else {
            length
        }
    })
}

/// The text with numbers for words in its last column: 1 for walls, 0 for other partners of a gap.
pub fn with_numbers(text: &str) -> String {
    let lines = text.lines().map(|line| match line.rsplit_once(',') {
        Some((numbers, "particle" | "image")) => format!("{numbers},0"),
        Some((numbers, "wall")) => format!("{numbers},1"),
        _ => line.to_owned(),
    });
    lines.collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partners_have_numbers() {
        let table = NumberTable::parse(&with_numbers("t,i,partner\n0,1,wall\n0,2,image\n")).expect("numbers");
        assert_eq!(table.column("partner"), Ok(&[1.0, 0.0][..]));
        assert!(NumberTable::parse(&with_numbers("t,i,partner\n0,1,ghost\n")).is_err(), "an unknown partner");
    }
}
