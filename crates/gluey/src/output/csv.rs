//! The trajectory as comma-separated values, one row per step.
//!
//! Columns: `t`, the centres `x1,y1[,z1],x2,...`, gaps in mean radii `a`, the spins `omega1,...` (2D) or
//! `omega1x,omega1y,omega1z,...` (3D). Numbers have 17 significant digits, so they read back exactly.
//!
//! Up to nine particles every pair has a column, `gap12_over_a,gap13_over_a,...,gap23_over_a,...`. From ten
//! on there is one column `min_gap_over_a`, the smallest gap of all pairs, and a second file
//! `<stem>-gaps.csv` lists what is near: a row `t,i,j,gap_over_a,contact_force,repulsion_force,partner`
//! for each gap of at most [`GAP_CUTOFF_OVER_A`]; forces are positive apart, those of contacts over
//! `6 pi eta`, and empty where there is no such force in the run. Where contacts act in the flow there are
//! `friction_force,slip_speed,slides,roughness_over_a` before the partner, empty without a contact.
//! Particles count from 1. The partner `j` is a `particle`, the nearest periodic `image` of one, or a
//! `wall` (1 below, 2 above).

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use gluey_geom::{Dim, Vector};

use super::append_log::{Draft, DraftMark, RowsError};
use super::pair_forces::{ContactForces, PairForces};
use super::{FileError, ResultPaths, line_of};
use crate::measures::Instant;
use crate::near_pairs::{self, PairGap};
use crate::trajectory::TrajectoryRow;

/// Gaps up to this many mean radii are listed one by one where pairs have no columns.
pub const GAP_CUTOFF_OVER_A: f64 = 1.0;

/// Most particles of which every pair has a column.
pub const MOST_WITH_PAIR_COLUMNS: usize = 9;

const AXES: [char; 3] = ['x', 'y', 'z'];

/// The first line of the file of near pairs, where contacts act in the flow or not.
fn gaps_header(acts_in_flow: bool) -> &'static str {
    match acts_in_flow {
        false => "t,i,j,gap_over_a,contact_force,repulsion_force,partner",
        true => {
            "t,i,j,gap_over_a,contact_force,repulsion_force,friction_force,slip_speed,slides,roughness_over_a,partner"
        }
    }
}

/// Writes rows as they come to `<path>.partial-K`, with the first `K` that no earlier run left, and gives the
/// file its name when it is complete; the file of near pairs likewise.
#[derive(Debug)]
pub struct CsvWriter {
    rows: Draft,
    gaps: Option<Draft>,
}

impl CsvWriter {
    /// Starts the files of a run of so many particles, whose contacts act in the flow or not.
    pub fn create<const D: usize>(
        path: &Path,
        particle_count: usize,
        acts_in_flow: bool,
    ) -> Result<Self, RowsError> {
        let rows = Draft::with_header(path, &header::<D>(particle_count))?;
        let gaps = gaps_path(path, particle_count);
        let gaps = gaps.map(|path| Draft::with_header(&path, gaps_header(acts_in_flow))).transpose()?;
        Ok(Self { rows, gaps })
    }

    /// Goes on with the files of a run of so many particles at these marks; `visit` sees the rows up to
    /// there. Rows behind them stay, and are compared with those that are written.
    pub(crate) fn resume<const D: usize>(
        path: &Path,
        rows: &DraftMark,
        gaps: Option<&DraftMark>,
        particle_count: usize,
        mut visit: impl FnMut(&Instant<D>),
    ) -> Result<Self, RowsError> {
        let mut rows = Draft::resume(path, rows)?;
        let gaps = gaps_path(path, particle_count).zip(gaps);
        let mut gaps = gaps.map(|(path, mark)| Draft::resume(&path, mark)).transpose()?;
        if let Some(gaps) = &mut gaps {
            gaps.visit(|line, text| line > 1 || [false, true].map(gaps_header).contains(&text))?;
        }
        rows.visit(|line, text| match line {
            1 => text == header::<D>(particle_count),
            _ => parse(text, particle_count).map(|instant| visit(&instant)).is_some(),
        })?;
        Ok(Self { rows, gaps })
    }

    /// Adds one row, which is with the operating system when this returns, and gives the smallest gap of any
    /// pair in mean radii, if there is one.
    pub fn write<const D: usize>(
        &mut self,
        row: &TrajectoryRow<'_, D>,
        forces: &PairForces<'_, D>,
    ) -> Result<Option<f64>, RowsError> {
        let a = row.mean_radius();
        let smallest = match &mut self.gaps {
            None => row.pairs().map(|(first, second)| row.gap(first, second)).reduce(f64::min),
            Some(gaps) => {
                let cutoff = GAP_CUTOFF_OVER_A * a;
                let near = near_pairs::within(row, cutoff);
                gaps.write(&gap_lines(row, &near, cutoff, forces))?;
                near_pairs::smallest(row, &near, cutoff)
            }
        };
        let smallest = smallest.map(|gap| gap / a);
        self.rows.write(&line(row, smallest))?;
        Ok(smallest)
    }

    /// The file of the rows until it is complete.
    pub(crate) fn path(&self) -> &Path {
        self.rows.path()
    }

    /// How far the rows and the near pairs have come.
    pub(crate) fn marks(&self) -> (DraftMark, Option<DraftMark>) {
        (self.rows.mark(), self.gaps.as_ref().map(Draft::mark))
    }

    /// Gives the complete files their names.
    pub fn finish(self) -> Result<(), FileError> {
        self.gaps.map_or(Ok(()), Draft::finish)?;
        self.rows.finish()
    }
}

/// The file of near pairs of so many particles, where pairs have no columns.
pub(crate) fn gaps_path(path: &Path, particle_count: usize) -> Option<PathBuf> {
    (particle_count > MOST_WITH_PAIR_COLUMNS).then(|| ResultPaths::of_csv(path).gaps())
}

/// The first line of the trajectory.
pub fn header<const D: usize>(particle_count: usize) -> String {
    let mut names = vec!["t".to_owned()];
    for particle in 1..=particle_count {
        names.extend(AXES[..D].iter().map(|axis| format!("{axis}{particle}")));
    }
    if particle_count > MOST_WITH_PAIR_COLUMNS {
        names.push("min_gap_over_a".to_owned());
    } else {
        let pairs = (1..=particle_count).flat_map(|i| (i + 1..=particle_count).map(move |j| (i, j)));
        names.extend(pairs.map(|(first, second)| format!("gap{first}{second}_over_a")));
    }
    for particle in 1..=particle_count {
        match Dim::<D>::ROT {
            1 => names.push(format!("omega{particle}")),
            _ => names.extend(AXES.iter().map(|axis| format!("omega{particle}{axis}"))),
        }
    }
    names.join(",")
}

fn line<const D: usize>(row: &TrajectoryRow<'_, D>, smallest_gap_over_a: Option<f64>) -> String {
    let a = row.mean_radius();
    let centers = row.particles.iter().flat_map(|particle| particle.pose.position.iter().copied());
    let gaps: Vec<f64> = match row.particles.len() > MOST_WITH_PAIR_COLUMNS {
        true => smallest_gap_over_a.into_iter().collect(),
        false => row.pairs().map(|(first, second)| row.gap(first, second) / a).collect(),
    };
    let spins = row.twists.iter().flat_map(|twist| Dim::<D>::spin_slice(&twist.spin).iter().copied());
    line_of([row.time].into_iter().chain(centers).chain(gaps).chain(spins), 16)
}

/// Reads a row of so many particles back.
fn parse<const D: usize>(text: &str, particle_count: usize) -> Option<Instant<D>> {
    let numbers: Vec<f64> = text.split(',').map(|cell| cell.parse().ok()).collect::<Option<_>>()?;
    let pair_count = particle_count * particle_count.saturating_sub(1) / 2;
    let gap_count = if particle_count > MOST_WITH_PAIR_COLUMNS { 1 } else { pair_count };
    let (time, rest) = numbers.split_first()?;
    let (centers, rest) = rest.split_at_checked(D * particle_count)?;
    let (gaps, spins) = rest.split_at_checked(gap_count)?;
    (spins.len() == Dim::<D>::ROT * particle_count).then(|| Instant {
        time: *time,
        centers: centers.chunks(D).map(Vector::from_column_slice).collect(),
        smallest_gap_over_a: gaps.iter().copied().reduce(f64::min),
    })
}

/// The rows of near pairs and near walls.
fn gap_lines<const D: usize>(
    row: &TrajectoryRow<'_, D>,
    near: &[PairGap],
    cutoff: f64,
    forces: &PairForces<'_, D>,
) -> String {
    let (a, time) = (row.mean_radius(), format!("{:.16e}", row.time));
    let of_contacts = ContactForces::of(forces);
    let radius = |particle: usize| row.particles[particle].radius;
    let mut text = String::new();
    let mut add = |first: usize, second: usize, gap: f64, partner: &str| {
        let is_wall = partner == "wall";
        let radii = [radius(first), if is_wall { f64::INFINITY } else { radius(second) }];
        let pair = (first, second, is_wall);
        let forces = [of_contacts.on(pair), forces.repulsion(gap, radii)];
        let rubbing = of_contacts.cells_of_rubbing(pair, a);
        let [contact, repulsion] =
            forces.map(|force| force.map_or(String::new(), |force| format!("{force:.16e}")));
        let (i, j, gap) = (first + 1, second + 1, gap / a);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{time},{i},{j},{gap:.16e},{contact},{repulsion},{rubbing}{partner}");
    };
    for &PairGap { first, second, gap } in near {
        add(first, second, gap, if row.is_direct(first, second) { "particle" } else { "image" });
    }
    for (number, wall) in row.domain.walls.iter().enumerate() {
        for (index, particle) in row.particles.iter().enumerate() {
            let gap = wall.distance(&particle.pose.position) - particle.radius;
            if gap <= cutoff {
                add(index, number, gap, "wall");
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use gluey_contact::Repulsion;
    use gluey_contact::{Contact, Domain, PairKey, Wall};
    use gluey_geom::{Particle, Twist};

    use super::*;

    #[test]
    fn headers_name_what_the_rows_hold() {
        assert_eq!(header::<2>(2), "t,x1,y1,x2,y2,gap12_over_a,omega1,omega2");
        assert_eq!(
            header::<3>(2),
            "t,x1,y1,z1,x2,y2,z2,gap12_over_a,omega1x,omega1y,omega1z,omega2x,omega2y,omega2z"
        );
        assert!(header::<2>(3).contains(",gap12_over_a,gap13_over_a,gap23_over_a,"));
        assert!(header::<2>(9).contains(",gap89_over_a,omega1"));
        assert!(header::<2>(10).contains(",y10,min_gap_over_a,omega1,"));
    }

    fn rows_read_back<const D: usize>() {
        for count in [1, 2, 3, 9, 10, 12] {
            let particles: Vec<_> =
                (0..count).map(|n| Particle::new(Vector::<D>::repeat(n as f64 / 3.0), 0.1)).collect();
            let (twists, domain) = (vec![Twist::default(); count], Domain::default());
            let row = TrajectoryRow { time: 0.1, particles: &particles, twists: &twists, domain: &domain };
            let a = row.mean_radius();
            let smallest_gap_over_a = row.pairs().map(|(i, j)| row.gap(i, j) / a).reduce(f64::min);
            let line = line(&row, smallest_gap_over_a);
            assert_eq!(line.split(',').count(), header::<D>(count).split(',').count());
            let centers = particles.iter().map(|particle| particle.pose.position).collect();
            let expected = Instant { time: 0.1, centers, smallest_gap_over_a };
            assert_eq!(parse(line.trim_end(), count), Some(expected));
            assert_eq!(parse::<D>(&line.replacen(',', "", 1), count), None);
            assert_eq!(parse::<D>("0.1,0.2", count), None);
        }
    }

    #[test]
    fn rows_read_back_exactly() {
        rows_read_back::<2>();
        rows_read_back::<3>();
    }

    #[test]
    fn many_particles_have_a_file_of_near_pairs() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("t.csv");
        // Ten discs a radius apart along x, but for the last two, in a channel; the first sees the last
        // across the border.
        let at = |n: usize| Vector::<2>::new(3.0 * n as f64 + f64::from(n == 9), 2.5);
        let particles: Vec<_> = (0..10).map(|n| Particle::new(at(n), 1.0)).collect();
        let floor = Wall::new(&Vector::<2>::new(0.0, 1.0), &Vector::<2>::y());
        let domain = Domain::default().with_period(0, 30.5).with_wall(floor);
        let twists = vec![Twist::default(); 10];
        let mut writer = CsvWriter::create::<2>(&path, 10, false).expect("files");
        let row = TrajectoryRow { time: 0.5, particles: &particles, twists: &twists, domain: &domain };
        let contact = |pair, lambda| Contact { pair, lambda, gamma: 0.0, gap: 0.5 };
        let contacts = [contact(PairKey::across(0, 9, [-1, 0, 0]), 3.0), contact(PairKey::wall(0, 0), 7.0)];
        let repulsion = Repulsion { force: 2.0, range: 0.5, radius: 1.0 };
        let forces = PairForces { contacts: Some(&contacts), in_flow: None, repulsion: Some(repulsion) };
        assert_eq!(writer.write(&row, &forces).expect("a row"), Some(0.5));
        writer.finish().expect("complete");
        let text = std::fs::read_to_string(folder.path().join("t-gaps.csv")).expect("near pairs");
        let lines: Vec<&str> = text.lines().collect();
        let half = "5.0000000000000000e-1";
        assert_eq!(lines[0], gaps_header(false));
        let shown = |x: f64| format!("{x:.16e}");
        let at = |gap: f64| shown(2.0 * (-gap / 0.5).exp());
        let [none, three, seven] = [0.0, 3.0, 7.0].map(shown);
        assert_eq!(lines[1], format!("{half},1,2,{},{none},{},particle", shown(1.0), at(1.0)));
        assert_eq!(lines[2], format!("{half},1,10,{half},{three},{},image", at(0.5)));
        let at_wall = shown(repulsion.at::<2>(0.5, [1.0, f64::INFINITY]));
        assert_eq!(lines[10], format!("{half},1,1,{half},{seven},{at_wall},wall"));
        assert_eq!(lines.len(), 1 + 8 + 1 + 10);
    }
}
