//! The tables, as comma-separated values; lengths in mean radii. A cell without a number is empty.

use gluey::output::line_of;
use gluey_suspension::structure::GapStatistics;

use super::observe::{Distributions, FrameNumbers};

const AXES: [char; 3] = ['x', 'y', 'z'];

/// Names and contents of all tables.
pub(super) fn all<const D: usize>(
    series: &[FrameNumbers<D>],
    distributions: &Distributions<D>,
) -> Vec<(&'static str, String)> {
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
struct TableText(String);

impl TableText {
    fn new(header: &str) -> Self {
        Self(format!("{header}\n"))
    }

    fn row(&mut self, numbers: impl IntoIterator<Item = Option<f64>>) {
        self.0.push_str(&line_of(numbers, 9));
    }
}

/// The columns of a vector.
fn vector<const D: usize>(name: &str) -> String {
    AXES[..D].iter().map(|axis| format!(",{name}_{axis}")).collect()
}

fn of_series<const D: usize>(series: &[FrameNumbers<D>]) -> String {
    let tensor: String =
        (0..D).flat_map(|i| (i..D).map(move |j| format!(",fabric_{}{}", AXES[i], AXES[j]))).collect();
    let mut table = TableText::new(&format!(
        "t,strain,smallest_gap_over_a,gap_1_percent_over_a,median_gap_over_a,contacts,largest_cluster{}{tensor}",
        vector::<D>("percolates")
    ));
    for instant in series {
        let gaps = |of: fn(&GapStatistics) -> f64| instant.gaps.as_ref().map(of);
        let gaps = [gaps(|gaps| gaps.smallest), gaps(|gaps| gaps.percentile), gaps(|gaps| gaps.median)];
        let of_fabric = |i, j| instant.fabric.map(|fabric| fabric[(i, j)]);
        let fabric = (0..D).flat_map(|i| (i..D).map(move |j| of_fabric(i, j)));
        table.row(
            [Some(instant.time), Some(instant.strain)]
                .into_iter()
                .chain(gaps)
                .chain([Some(instant.contacts), Some(instant.largest_cluster)])
                .chain(instant.percolates.map(|is| Some(f64::from(u8::from(is)))))
                .chain(fabric),
        );
    }
    table.0
}

fn radial<const D: usize>(distributions: &Distributions<D>) -> String {
    let name = |[one, other]: [usize; 2]| format!(",g_{}{}", one + 1, other + 1);
    let names: String = distributions.partial.iter().map(|(pair, _)| name(*pair)).collect();
    let mut table = TableText::new(&format!("r_over_a,g,pairs{names}"));
    let partial: Vec<_> = distributions.partial.iter().map(|(_, radial)| radial.bins()).collect();
    for (row, bin) in distributions.radial.bins().into_iter().enumerate() {
        let whole = [Some(bin.distance / distributions.a), bin.g, Some(bin.pair_count as f64)];
        table.row(whole.into_iter().chain(partial.iter().map(|bins| bins[row].g)));
    }
    table.0
}

fn angular<const D: usize>(distributions: &Distributions<D>) -> String {
    let mut table = TableText::new("theta_rad,g");
    distributions.angular.bins().into_iter().for_each(|(theta, g)| table.row([Some(theta), g]));
    table.0
}

fn waves<const D: usize>(distributions: &Distributions<D>) -> Option<String> {
    let mut table = TableText::new("k_a,s,vectors");
    for bin in distributions.waves.as_ref()?.bins() {
        table.row([bin.wave_number * distributions.a, bin.s, bin.vector_count as f64].map(Some));
    }
    Some(table.0)
}

fn profile<const D: usize>(distributions: &Distributions<D>) -> String {
    let mut table = TableText::new(&format!("y,fraction{}", vector::<D>("velocity")));
    for slab in distributions.profile.slabs() {
        let velocity = (0..D).map(|d| slab.velocity.map(|velocity| velocity[d]));
        table.row([Some(slab.middle), Some(slab.fraction)].into_iter().chain(velocity));
    }
    table.0
}

fn diffusion<const D: usize>(distributions: &Distributions<D>) -> String {
    let mut table = TableText::new(&format!("lag_t,lag_strain{}", vector::<D>("mean_square_over_a2")));
    for lag in 1..=distributions.longest_lag() {
        let Some(squares) = distributions.displacements.mean_square(lag) else { continue };
        let time = distributions.interval.map(|interval| lag as f64 * interval);
        let strain = time.map(|time| time * distributions.rate.abs());
        let squares = squares / distributions.a.powi(2);
        table.row([time, strain].into_iter().chain(squares.iter().copied().map(Some)));
    }
    table.0
}
