//! The tables, as comma-separated values; lengths in mean radii.

use std::fmt::Write as _;

use gluey_geom::{Dim, Space};

use super::observe::{Distributions, Instant};

const AXES: [char; 3] = ['x', 'y', 'z'];

/// Names and contents of all tables.
pub(super) fn all<const D: usize>(
    series: &[Instant<D>],
    distributions: &Distributions<D>,
) -> Vec<(&'static str, String)>
where
    Dim<D>: Space<D>,
{
    let mut tables = vec![
        ("series.csv", of_series(series)),
        ("g_of_r.csv", radial(distributions)),
        ("g_of_theta.csv", angular(distributions)),
        ("profile_y.csv", profile(distributions)),
        ("diffusion.csv", diffusion(distributions)),
    ];
    tables.extend(waves(distributions).map(|text| ("structure_factor.csv", text)));
    tables
}

/// Lines of numbers under a header.
struct Table(String);

impl Table {
    fn new(header: &str) -> Self {
        Self(format!("{header}\n"))
    }

    fn row(&mut self, numbers: impl IntoIterator<Item = f64>) {
        let mut separator = "";
        for number in numbers {
            // Writing to a string cannot fail.
            let _ = write!(self.0, "{separator}{number:.9e}");
            separator = ",";
        }
        self.0.push('\n');
    }
}

/// The columns of a vector.
fn vector<const D: usize>(name: &str) -> String {
    AXES[..D].iter().map(|axis| format!(",{name}_{axis}")).collect()
}

fn of_series<const D: usize>(series: &[Instant<D>]) -> String {
    let tensor: String =
        (0..D).flat_map(|i| (i..D).map(move |j| format!(",fabric_{}{}", AXES[i], AXES[j]))).collect();
    let mut table = Table::new(&format!(
        "t,strain,smallest_gap_over_a,gap_1_percent_over_a,median_gap_over_a,contacts,largest_cluster{}{tensor}",
        vector::<D>("percolates")
    ));
    for instant in series {
        let gaps = instant.gaps.map_or([f64::NAN; 3], |gaps| [gaps.smallest, gaps.percentile, gaps.median]);
        let fabric = (0..D).flat_map(|i| (i..D).map(move |j| instant.fabric[(i, j)]));
        table.row(
            [instant.time, instant.strain]
                .into_iter()
                .chain(gaps)
                .chain([instant.contacts, instant.largest_cluster])
                .chain(instant.percolates.map(|is| f64::from(u8::from(is))))
                .chain(fabric),
        );
    }
    table.0
}

fn radial<const D: usize>(distributions: &Distributions<D>) -> String {
    let mut table = Table::new("r_over_a,g,pairs");
    for bin in distributions.radial.bins() {
        table.row([bin.distance / distributions.a, bin.g, bin.pair_count as f64]);
    }
    table.0
}

fn angular<const D: usize>(distributions: &Distributions<D>) -> String {
    let mut table = Table::new("theta,g");
    distributions.angular.bins().into_iter().for_each(|(theta, g)| table.row([theta, g]));
    table.0
}

fn waves<const D: usize>(distributions: &Distributions<D>) -> Option<String> {
    let mut table = Table::new("k_a,s,vectors");
    for bin in distributions.waves.as_ref()?.bins() {
        table.row([bin.wave_number * distributions.a, bin.s, bin.vector_count as f64]);
    }
    Some(table.0)
}

fn profile<const D: usize>(distributions: &Distributions<D>) -> String {
    let mut table = Table::new(&format!("y,fraction{}", vector::<D>("velocity")));
    for slab in distributions.profile.slabs() {
        table.row([slab.middle, slab.fraction].into_iter().chain(slab.velocity.iter().copied()));
    }
    table.0
}

fn diffusion<const D: usize>(distributions: &Distributions<D>) -> String {
    let mut table = Table::new(&format!("lag_t,lag_strain{}", vector::<D>("mean_square_over_a2")));
    let interval = distributions.interval.unwrap_or(f64::NAN);
    for lag in 1..=distributions.longest_lag() {
        let Some(squares) = distributions.displacements.mean_square(lag) else { continue };
        let time = lag as f64 * interval;
        let squares = squares / distributions.a.powi(2);
        table.row([time, time * distributions.rate.abs()].into_iter().chain(squares.iter().copied()));
    }
    table.0
}
