//! Sixty boxes from high to long that are sheared to a strain of 2.5, with one to six particles and one to
//! six cells in a radius: whether each runs, and whether its gaps are those of a search over all images.
//!
//! `cargo run --release -p gluey --example sheared_boxes [first] [last]`

use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;

use gluey::{Case, RunOptions, Silent, run};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Boxes of the sweep; the first half is in two dimensions.
pub const COUNT: usize = 60;
/// Length over height.
const ASPECTS: [f64; 10] = [0.25, 8.0, 0.5, 4.0, 1.0, 6.0, 1.5, 3.0, 2.0, 2.5];
/// Cells in a radius.
const CELLS: [f64; 6] = [1.0, 6.0, 2.0, 1.5, 3.0, 4.0];
/// In three dimensions, and for how many particles at most.
const CELLS_3D: [(f64, usize); 6] = [(1.0, 6), (2.0, 2), (1.5, 4), (3.0, 1), (1.0, 3), (6.0, 1)];
/// Strain at the end.
pub const END: f64 = 2.5;

/// What came out of a box.
#[derive(Clone, Copy, Debug)]
pub struct Swept {
    /// Rows of the trajectory.
    pub rows: usize,
    /// The largest difference of a gap from that of a search over all images, in mean radii.
    pub gap_miss: f64,
    /// The least and the largest viscosity.
    pub viscosities: [f64; 2],
}

/// The text of a case. Its particles have room.
fn text(number: usize) -> String {
    let dimension = 2 + number / (COUNT / 2);
    let mut random = ChaCha8Rng::seed_from_u64(number as u64);
    let aspect = ASPECTS[number % ASPECTS.len()];
    let mut edges = vec![aspect.max(1.0), (1.0 / aspect).max(1.0)];
    let (cells, most) = match dimension {
        2 => (CELLS[number % CELLS.len()], 6),
        _ => {
            edges.push([1.0, 2.0][number % 2]);
            CELLS_3D[number % CELLS_3D.len()]
        }
    };
    let count = 1 + random.random_range(0..most);
    // The shortest edge holds two diameters at least.
    let radius: f64 = 1.0 / random.random_range(4.1..if dimension == 2 { 9.0 } else { 6.0 });
    // Little enough for a random arrangement.
    let room = edges.iter().product::<f64>() / (2.4 * radius).powi(dimension as i32);
    let count = count.min((0.5 * room) as usize).max(1);
    let step = if dimension == 2 { 0.1 } else { 0.125 };
    format!(
        "name = \"box-{number}\"\ndimension = {dimension}\n[domain]\nupper = {edges:?}\nboundary = \"sheared\"\n\
         [suspension]\ncount = {count}\nradius = {radius:?}\nseed = {number}\nmin_gap = 0.05\n\
         arrangement = \"random\"\n[time]\nstep = {step}\nend = {END:?}\n[rheology]\nevery = 1\n\
         [contact]\nstrategy = \"none\"\n[flow.mesh]\ncells_per_radius = {cells:?}\n"
    )
}

/// A case of the sweep.
pub fn sheared_box(number: usize) -> Result<Case, Box<dyn Error>> {
    Ok(Case::parse(&text(number), "box.toml")?)
}

/// Runs a case to its end.
pub fn swept(case: &Case, folder: &Path) -> Result<Swept, Box<dyn Error>> {
    let csv = folder.join(format!("{}.csv", case.name));
    run(case, &RunOptions::csv(&csv), &Silent)?;
    let (rows, rheology) = (table(&csv)?, table(&csv.with_file_name(format!("{}-rheology.csv", case.name)))?);
    let viscosity = rheology.column("viscosity")?;
    let least = rheology.column("min_gap_over_a")?;
    let mut gap_miss = 0.0f64;
    for (row, least) in rows.numbers.iter().zip(&least) {
        let gaps = gaps_of_all_images(case, row);
        let first = 1 + case.dimension * case.particles.len();
        for (gap, told) in gaps.iter().zip(&row[first..]) {
            gap_miss = gap_miss.max((gap - told).abs());
        }
        if let Some(smallest) = gaps.into_iter().reduce(f64::min) {
            gap_miss = gap_miss.max((smallest - least).abs());
        }
    }
    let viscosities = [viscosity.iter().copied().fold(f64::INFINITY, f64::min), largest(&viscosity)];
    Ok(Swept { rows: rows.numbers.len(), gap_miss, viscosities })
}

/// Edges of the box.
pub fn edges(case: &Case) -> Vec<f64> {
    case.upper().iter().zip(case.lower()).map(|(upper, lower)| upper - lower).collect()
}

fn largest(numbers: &[f64]) -> f64 {
    numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Gaps of all pairs in mean radii, by rows of images up and down as far as any can matter.
pub fn gaps_of_all_images(case: &Case, row: &[f64]) -> Vec<f64> {
    let (edges, dimension) = (edges(case), case.dimension);
    let tilt = case.shear_rate * row[0] * edges[1];
    let center = |k: usize| &row[1 + dimension * k..1 + dimension * (k + 1)];
    let count = case.particles.len();
    let mut gaps = Vec::new();
    for first in 0..count {
        for second in first + 1..count {
            let apart: Vec<f64> = center(second).iter().zip(center(first)).map(|(a, b)| a - b).collect();
            let across =
                if dimension == 3 { apart[2] - edges[2] * (apart[2] / edges[2]).round() } else { 0.0 };
            let nearest_row = -(apart[1] / edges[1]).round();
            let distance = (-20..=20).map(|j| nearest_row + f64::from(j)).map(|j| {
                let along = apart[0] + j * tilt;
                let along = along - edges[0] * (along / edges[0]).round();
                along.hypot(apart[1] + j * edges[1]).hypot(across)
            });
            let radii = case.particles[first].radius + case.particles[second].radius;
            gaps.push((distance.fold(f64::INFINITY, f64::min) - radii) / case.mean_radius());
        }
    }
    gaps
}

/// A file of numbers with a header.
struct Table {
    names: Vec<String>,
    numbers: Vec<Vec<f64>>,
}

impl Table {
    fn column(&self, name: &str) -> Result<Vec<f64>, String> {
        let place = self.names.iter().position(|other| other == name).ok_or(format!("no column {name}"))?;
        Ok(self.numbers.iter().map(|row| row[place]).collect())
    }
}

/// The rows of a file of numbers.
pub fn numbers(path: &Path) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    Ok(table(path)?.numbers)
}

/// Empty cells are infinite.
fn table(path: &Path) -> Result<Table, Box<dyn Error>> {
    let text = fs::read_to_string(path)?;
    let mut lines = text.lines().map(|line| line.split(','));
    let names = lines.next().ok_or("an empty table")?.map(str::to_owned).collect();
    let number = |cell: &str| if cell.is_empty() { Ok(f64::INFINITY) } else { cell.parse::<f64>() };
    let numbers = lines.map(|cells| cells.map(number).collect()).collect::<Result<_, _>>()?;
    Ok(Table { names, numbers })
}

/// Runs the boxes from the first to the last argument, all by default.
pub fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse::<usize>());
    let first = arguments.next().transpose()?.unwrap_or(0);
    let last = arguments.next().transpose()?.unwrap_or(COUNT - 1);
    let folder = tempfile::TempDir::new()?;
    let mut failed = 0;
    for number in first..=last {
        let case = sheared_box(number)?;
        let (edges, cells) = (edges(&case), case.cells_per_radius());
        let count = case.particles.len();
        let start = Instant::now();
        print!("{number}: {edges:?}, {count} particles, {cells} cells a radius: ");
        match swept(&case, folder.path()) {
            Ok(Swept { rows, gap_miss, viscosities }) => {
                let seconds = start.elapsed().as_secs_f64();
                println!("{rows} rows, gaps to {gap_miss:.0e}, viscosity {viscosities:.4?}, {seconds:.1} s");
            }
            Err(error) => {
                failed += 1;
                let mut chain = error.to_string();
                let mut source = error.source();
                while let Some(cause) = source {
                    chain += &format!(": {cause}");
                    source = cause.source();
                }
                println!("FAILED: {chain}");
            }
        }
    }
    if failed > 0 { Err(format!("{failed} boxes failed").into()) } else { Ok(()) }
}
