//! Charts of the tables of `gluey analyse`; lengths in mean radii.

use gluey_pictures::{Axis, Canvas, Chart, Curve, PALETTE, Stroke};

use super::error::PlotError;
use super::figure::Figure;
use super::figures::{FAINT, chart, curve, points, stacked, under_frame};
use super::read::{StructureTables, TableSource};

/// A column, its name in the legend, its stroke.
type Column = (&'static str, &'static str, Stroke);

/// Levels to compare with.
const LEVEL: Stroke = Stroke { dashes: Some("4 3"), ..FAINT };
/// What has a chart for itself, above others that share a legend.
const ALONE: Stroke = Stroke { color: "#1c1c1c", width: 1.4, dashes: None };
/// How lines that fit are drawn over what they fit.
const FIT: Stroke = Stroke { color: "#1c1c1c", width: 1.0, dashes: Some("6 3") };

/// A picture; none where there is no table of it and it was not asked for by name.
pub fn draw(
    figure: Figure,
    tables: &StructureTables<'_>,
    width_mm: f64,
    is_needed: bool,
) -> Result<Option<Canvas>, PlotError> {
    let charts = match figure {
        Figure::Contacts => contacts(tables, is_needed)?,
        Figure::Correlations => correlations(tables, is_needed)?,
        Figure::Profiles => profiles(tables, is_needed)?,
        Figure::Diffusion => diffusion(tables, is_needed)?,
        Figure::Gaps | Figure::Trajectories | Figure::Rheology | Figure::Solver => Vec::new(),
    };
    // What no frame has makes no chart, unless it was asked for.
    let has_points = |chart: &Chart| is_needed || points(&chart.curves).next().is_some();
    let charts: Vec<Chart> = charts.into_iter().filter(has_points).collect();
    Ok((!charts.is_empty()).then(|| stacked(&charts, width_mm)))
}

/// Contacts of a particle, the largest cluster and fabric, against strain or, without shear, time.
fn contacts(tables: &StructureTables<'_>, is_needed: bool) -> Result<Vec<Chart>, PlotError> {
    let Some(source) = tables.table("series.csv", Figure::Contacts, is_needed)? else {
        return Ok(Vec::new());
    };
    let (name, label) = clock(&source, ["strain", "t"], ["strain *γ*", "time *t*"])?;
    let fabric = [
        ("fabric_xx", "fabric *xx*", PALETTE[0]),
        ("fabric_yy", "fabric *yy*", PALETTE[1]),
        ("fabric_xy", "fabric *xy*", PALETTE[2]),
        ("fabric_zz", "fabric *zz*", PALETTE[3]),
    ];
    Ok(vec![
        of_columns(&source, name, label, "contacts of a particle", &[("contacts", "", ALONE)], &[0.0])?,
        of_columns(
            &source,
            name,
            label,
            "part in the largest cluster",
            &[("largest_cluster", "", ALONE)],
            &[0.0],
        )?,
        of_columns(&source, name, label, "fabric", &fabric, &[0.0])?,
    ])
}

/// g(r), g(theta) in degrees and, in periodic boxes, S(k), each beside 1, what there is without order.
fn correlations(tables: &StructureTables<'_>, is_needed: bool) -> Result<Vec<Chart>, PlotError> {
    let named = [
        ("g_of_r.csv", "r_over_a", "distance *r* / *a*", "g", "*g*(*r*)"),
        ("g_of_theta.csv", "theta_rad", "angle to the flow *θ* (degrees)", "g", "*g*(*θ*) near contact"),
        ("structure_factor.csv", "k_a", "wave number *k a*", "s", "*S*(*k*)"),
    ];
    let mut charts = Vec::new();
    for (file, across, label, column, name) in named {
        // Boxes between walls all around have no waves.
        let is_needed = is_needed && file != "structure_factor.csv";
        let Some(source) = tables.table(file, Figure::Correlations, is_needed)? else { continue };
        let x: Vec<f64> = match across {
            "theta_rad" => source.column(across)?.iter().map(|angle| angle.to_degrees()).collect(),
            _ => source.column(across)?.to_vec(),
        };
        let ends = if across == "theta_rad" { [0.0, 180.0] } else { [0.0, last(&x)] };
        let level = curve(None, LEVEL, &ends, &[1.0, 1.0]);
        let partial = partial(&source, &x);
        let of_all = (!partial.is_empty()).then(|| "all pairs".to_owned());
        let whole = curve(of_all, PALETTE[0], &x, source.column(column)?);
        let curves = partial.into_iter().chain([level, whole]).collect();
        let mut x = Axis::around(label, ends);
        if across == "theta_rad" {
            x = Axis { min: 0.0, max: 180.0, tick: 30.0, ..x };
        }
        charts.push(over(x, name, curves, &[0.0]));
    }
    Ok(charts)
}

/// Correlations between particles of two radii, where the table has them.
fn partial(source: &TableSource, x: &[f64]) -> Vec<Curve> {
    let pairs = (1..=3).flat_map(|one| (one..=3).map(move |other| (one, other)));
    let found = pairs.filter_map(|(one, other)| {
        Some((format!("radii {one} and {other}"), source.table.find(&format!("g_{one}{other}"))?))
    });
    let strokes = PALETTE[1..].iter().copied().chain([FAINT]);
    found.zip(strokes).map(|((name, g), stroke)| curve(Some(name), stroke, x, g)).collect()
}

/// Fraction and velocities against the height.
fn profiles(tables: &StructureTables<'_>, is_needed: bool) -> Result<Vec<Chart>, PlotError> {
    let Some(source) = tables.table("profile_y.csv", Figure::Profiles, is_needed)? else {
        return Ok(Vec::new());
    };
    let height = "height *y* (lengths of the case)";
    let velocities = [
        ("velocity_x", "along *x*", PALETTE[0]),
        ("velocity_y", "along *y*", PALETTE[1]),
        ("velocity_z", "along *z*", PALETTE[3]),
    ];
    Ok(vec![
        of_columns(&source, "y", height, "volume fraction", &[("fraction", "", ALONE)], &[0.0])?,
        of_columns(&source, "y", height, "velocity (length / time)", &velocities, &[])?,
    ])
}

/// Mean squares of displacements against the lag, and the lines that fit the second half of them, whose
/// slopes are twice the diffusivities of the summary.
fn diffusion(tables: &StructureTables<'_>, is_needed: bool) -> Result<Vec<Chart>, PlotError> {
    let Some(source) = tables.table("diffusion.csv", Figure::Diffusion, is_needed)? else {
        return Ok(Vec::new());
    };
    let (name, label) = clock(&source, ["lag_strain", "lag_t"], ["lag in strain *γ*", "lag in time *t*"])?;
    let lags = source.column(name)?;
    let columns = [
        ("mean_square_over_a2_x", "*x* beside the shear", PALETTE[0]),
        ("mean_square_over_a2_y", "*y*", PALETTE[1]),
        ("mean_square_over_a2_z", "*z*", PALETTE[3]),
    ];
    let mut curves = Vec::new();
    for (name, label, stroke) in columns {
        let Some(squares) = found(&source, name)? else { continue };
        curves.push(curve(Some(label.to_owned()), stroke, lags, squares));
        let line = fitted(lags, squares)
            .map(|[slope, start]| lags.iter().map(|lag| start + slope * lag).collect::<Vec<_>>());
        curves.extend(line.map(|line| {
            let half = second_half(lags.len());
            curve(None, FIT, &lags[half..], &line[half..])
        }));
    }
    let x = Axis::around(label, lags.iter().copied().chain([0.0]));
    let mut chart = over(x, "mean square displacement / *a*^{2}", curves, &[0.0]);
    chart.notes.push("Black: fits of the second half, of slope 2 *D*".to_owned());
    chart.notes.push("*D* with its intervals is in summary.txt".to_owned());
    Ok(vec![chart])
}

/// From which row on lines are fitted: the lags from half of the longest on.
fn second_half(rows: usize) -> usize {
    rows.div_ceil(2).saturating_sub(1)
}

/// Slope and value at zero of the line that fits the second half of the rows best.
fn fitted(x: &[f64], y: &[f64]) -> Option<[f64; 2]> {
    let half = second_half(x.len());
    let (x, y) = (&x[half..], &y[half..]);
    let count = x.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let (mean_x, mean_y) = (mean(x), mean(y));
    let width: f64 = x.iter().map(|x| (x - mean_x).powi(2)).sum();
    let slope = x.iter().zip(y).map(|(x, y)| (x - mean_x) * y).sum::<f64>() / width;
    slope.is_finite().then_some([slope, mean_y - slope * mean_x])
}

/// The column of strains and its label or, where they do not grow, that of times.
fn clock(
    source: &TableSource,
    names: [&'static str; 2],
    labels: [&'static str; 2],
) -> Result<(&'static str, &'static str), PlotError> {
    let strain = source.column(names[0])?;
    let is_sheared = strain.iter().all(|x| x.is_finite()) && strain.iter().any(|x| *x != strain[0]);
    Ok(if is_sheared { (names[0], labels[0]) } else { (names[1], labels[1]) })
}

/// Columns against another one; those of the third axis are there in 3D only.
fn of_columns(
    source: &TableSource,
    across: &str,
    label: &str,
    name: &str,
    columns: &[Column],
    shown: &[f64],
) -> Result<Chart, PlotError> {
    let x = source.column(across)?;
    let mut curves = Vec::new();
    for (column, label, stroke) in columns {
        let label = (!label.is_empty()).then(|| (*label).to_owned());
        curves.extend(found(source, column)?.map(|values| curve(label, *stroke, x, values)));
    }
    Ok(over(Axis::around(label, x.iter().copied()), name, curves, shown))
}

/// A column, which may only be missing if it is one of the third axis.
fn found<'a>(source: &'a TableSource, name: &str) -> Result<Option<&'a [f64]>, PlotError> {
    match source.table.find(name) {
        None if name.ends_with('z') => Ok(None),
        _ => source.column(name).map(Some),
    }
}

/// A chart whose upright axis shows all curves and `shown`.
fn over(x: Axis, name: &str, curves: Vec<Curve>, shown: &[f64]) -> Chart {
    let mut values: Vec<f64> = points(&curves).map(|point| point.1).chain(shown.iter().copied()).collect();
    if values.iter().all(|value| *value == 0.0) {
        values.push(1.0);
    }
    chart(x, Axis::around(name, under_frame(values)), curves)
}

fn last(x: &[f64]) -> f64 {
    x.last().copied().unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table begins with lag 1, and of lags 1 to 8 those from 4 on are fitted, as in the summary.
    #[test]
    fn lines_fit_the_second_half() {
        let lags: Vec<f64> = (1..=8).map(f64::from).collect();
        let squares: Vec<f64> =
            lags.iter().map(|lag| if *lag < 4.0 { 9.0 } else { 0.5 + 3.0 * lag }).collect();
        let [slope, start] = fitted(&lags, &squares).expect("a line");
        assert!((slope - 3.0).abs() < 1e-12 && (start - 0.5).abs() < 1e-12, "{slope} {start}");
        assert_eq!(fitted(&[1.0], &[1.0]), None);
    }
}
