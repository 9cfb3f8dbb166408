//! The pictures.

use std::collections::BTreeMap;

use gluey::output::solver_log::PHASES;
use gluey::table::TableError;
use gluey_pictures::{Axis, Canvas, Chart, Curve, Mark, PALETTE, PIXELS_PER_MM, Stroke, stack_to_width};

use super::error::PlotError;
use super::figure::Figure;
use super::read::{Borders, Results, TableSource};

/// Many curves that are not told apart.
pub(super) const FAINT: Stroke = Stroke { color: "#9aa5b1", width: 0.8, dashes: None };
/// Paths of more particles than there are strokes.
const THIN: Stroke = Stroke { color: "#0b4f9e", width: 1.0, dashes: None };
/// Height of a frame over the width of the picture.
const HEIGHT: f64 = 0.5;
/// Least height of a frame: what the longest of the labels beside it takes.
const LEAST_HEIGHT_MM: f64 = 42.5;
/// Least and largest height of a frame of paths over its width.
const FLATTEST: f64 = 0.3;
const HIGHEST: f64 = 1.2;
/// Ratio of the largest to the smallest gap from which on their axis is logarithmic.
pub(super) const LOGARITHMIC: f64 = 20.0;
/// Largest gap below which it is too, since its ticks would have many digits.
const SMALL: f64 = 0.01;

/// Gaps against time.
pub fn gaps(results: &Results, width_mm: f64, is_needed: bool) -> Result<Option<Canvas>, PlotError> {
    let source = results.trajectory(Figure::Gaps)?;
    let t = source.column("t")?;
    let mut curves = match source.table.find("min_gap_over_a") {
        Some(gaps) => {
            let smallest = curve(Some("the smallest".into()), PALETTE[0], t, gaps);
            near_pairs(results)?.into_iter().chain([smallest]).collect()
        }
        None => all_pairs(&source, t),
    };
    if curves.is_empty() {
        let (path, column) = (results.csv(), "gap12_over_a".to_owned());
        let missing = PlotError::Table { path, source: TableError::Column { column } };
        return if is_needed { Err(missing) } else { Ok(None) };
    }
    curves.retain(|curve| !curve.pieces.is_empty());
    let values: Vec<f64> = points(&curves).map(|(_, gap)| gap).collect();
    let (low, high) = ends(&values);
    let y = match low > 0.0 && (high > LOGARITHMIC * low || high < SMALL) {
        true => Axis::decades("gap / *a*", low, high),
        // Contacts lie beside the frame, not on it.
        false => Axis::around("gap / *a*", values.into_iter().chain([low.min(-0.01 * high), 1.02 * high])),
    };
    let chart = chart(Axis::around("time *t*", t.iter().copied()), y, curves);
    Ok(Some(stacked(&[chart], width_mm)))
}

/// The gap of every pair, up to as many as there are strokes: those that come nearest.
fn all_pairs(source: &TableSource, t: &[f64]) -> Vec<Curve> {
    let names = (1..10).flat_map(|i| (i + 1..10).map(move |j| (i, j)));
    let mut pairs: Vec<_> =
        names.filter_map(|(i, j)| Some((i, j, source.table.find(&format!("gap{i}{j}_over_a"))?))).collect();
    let smallest = |gaps: &[f64]| gaps.iter().copied().fold(f64::INFINITY, f64::min);
    pairs.sort_by(|one, other| smallest(one.2).total_cmp(&smallest(other.2)));
    let named = pairs.iter().zip(PALETTE);
    let curves = named.map(|(&(i, j, gaps), stroke)| curve(Some(format!("{i} and {j}")), stroke, t, gaps));
    let rest = pairs.iter().skip(PALETTE.len());
    let rest = rest.enumerate();
    rest.map(|(n, (.., gaps))| curve((n == 0).then(|| "other pairs".into()), FAINT, t, gaps))
        .chain(curves)
        .collect()
}

/// The gap of each pair that is listed as near, interrupted where it is not.
fn near_pairs(results: &Results) -> Result<Vec<Curve>, PlotError> {
    let Some(source) = results.near_pairs()? else { return Ok(Vec::new()) };
    let [t, i, j, gaps] = ["t", "i", "j", "gap_over_a"].map(|name| source.column(name));
    let (t, i, j, gaps, partner) = (t?, i?, j?, gaps?, source.column("partner")?);
    let mut instants: Vec<f64> = t.to_vec();
    instants.dedup();
    let step_of = |time: f64| instants.partition_point(|known| *known < time);
    let mut pairs: BTreeMap<[u64; 3], Vec<(usize, f64)>> = BTreeMap::new();
    for row in 0..t.len() {
        pairs
            .entry([i, j, partner].map(|column| column[row] as u64))
            .or_default()
            .push((step_of(t[row]), gaps[row]));
    }
    let label = |n| (n == 0).then(|| "all that are near".to_owned());
    let curves = pairs.values().enumerate().map(|(n, pair)| {
        let runs = pair.chunk_by(|one, other| other.0 == one.0 + 1);
        let pieces = runs.map(|run| run.iter().map(|&(step, gap)| (instants[step], gap)).collect());
        Curve { label: label(n), stroke: FAINT, pieces: pieces.collect() }
    });
    Ok(curves.collect())
}

/// Paths of the centres, with dots where they begin.
pub fn trajectories(results: &Results, width_mm: f64) -> Result<Canvas, PlotError> {
    let source = results.trajectory(Figure::Trajectories)?;
    let count = (1..).take_while(|n| source.table.find(&format!("x{n}")).is_some()).count();
    let rows = if source.table.find("z1").is_some() { &["y", "z"][..] } else { &["y"][..] };
    let borders = results.borders();
    let charts: Result<Vec<Chart>, PlotError> =
        rows.iter().map(|across| paths(&source, across, count, borders.as_ref())).collect();
    Ok(stack_to_width(&charts?, width_mm * PIXELS_PER_MM, Chart::equal_aspect))
}

/// Paths over the box, whose walls are solid and whose periodic borders are dashed. Both axes have one scale;
/// a long way or a high one has room beside it, so that the frame is neither flat nor narrow.
fn paths(
    source: &TableSource,
    across: &str,
    count: usize,
    borders: Option<&Borders>,
) -> Result<Chart, PlotError> {
    let axis = if across == "y" { 1 } else { 2 };
    let mut curves = borders.map_or(Vec::new(), |borders| borders.curves(axis));
    for n in 1..=count {
        let (x, y) = (source.column(&format!("x{n}"))?, source.column(&format!("{across}{n}"))?);
        curves.push(match count <= PALETTE.len() {
            true => curve(Some(format!("particle {n}")), PALETTE[n - 1], x, y),
            false => curve(None, THIN, x, y),
        });
    }
    let starts =
        curves[curves.len() - count..].iter().filter_map(|curve| curve.pieces.first()?.first().copied());
    let marks = starts.map(|at| Mark { at, label: String::new() }).collect();
    let [x, y] = [0, 1].map(|k| {
        let values: Vec<f64> = points(&curves).map(|point| [point.0, point.1][k]).collect();
        ends(&values)
    });
    let (width, height) = (x.1 - x.0, y.1 - y.0);
    let room = 0.02 * width.max(height);
    let axis = |label: &str, (low, high): (f64, f64), least: f64| {
        // Dots and borders lie beside the frame, not on it.
        let room = room.max(0.5 * (least - (high - low)));
        Axis::around(label, [low - room, high + room].into_iter().filter(|end| end.is_finite()))
    };
    let x = axis("*x*", x, height / HIGHEST);
    let y = axis(&format!("*{across}*"), y, width * FLATTEST);
    let notes = if across == "y" { vec!["Dots: where particles begin".to_owned()] } else { Vec::new() };
    Ok(Chart { marks, notes, ..chart(x, y, curves) })
}

/// Viscosities, and below them normal stresses, against strain; where contacts act in the flow also what
/// share of the viscosity is whose, and how many contacts a particle has.
pub fn rheology(results: &Results, width_mm: f64, is_needed: bool) -> Result<Option<Canvas>, PlotError> {
    let Some(source) = results.rheology(is_needed)? else { return Ok(None) };
    let viscosity = [
        ("viscosity", "by stresslets"),
        ("viscosity_by_dissipation", "by dissipation"),
        ("viscosity_of_films", "share of films"),
    ];
    let normal = [("N1", "*N*_{1}"), ("N2", "*N*_{2}"), ("particle_pressure", "particle pressure")];
    let mut charts = vec![
        against_strain(&source, "relative viscosity", &viscosity, 0)?,
        against_strain(&source, "stress / viscous stress", &normal, viscosity.len())?,
    ];
    if source.table.find("viscosity_of_friction").is_some() {
        let contacts = [("sticking_contacts", "that stick"), ("sliding_contacts", "that slip")];
        charts.insert(1, shares_of_viscosity(&source)?);
        charts.push(against_strain(&source, "contacts of a particle", &contacts, 0)?);
    }
    Ok(Some(stacked(&charts, width_mm)))
}

/// What flow, normal and tangential forces of contacts, and repulsion add to the relative viscosity.
fn shares_of_viscosity(source: &TableSource) -> Result<Chart, PlotError> {
    let names = ["viscosity", "viscosity_of_contacts", "viscosity_of_friction", "viscosity_of_repulsion"];
    let [all, contacts, friction, repulsion] = names.map(|name| source.column(name));
    let (all, contacts, friction, repulsion) = (all?, contacts?, friction?, repulsion?);
    let less =
        |one: &[f64], other: &[f64]| -> Vec<f64> { one.iter().zip(other).map(|(a, b)| a - b).collect() };
    let shares = [
        ("flow", less(&less(all, contacts), repulsion)),
        ("contacts, normal", less(contacts, friction)),
        ("friction", friction.to_vec()),
        ("repulsion", repulsion.to_vec()),
    ];
    let strain = source.column("strain")?;
    let there = shares.iter().filter(|(name, share)| *name != "repulsion" || share.iter().any(|x| *x != 0.0));
    let curves = there
        .zip(PALETTE)
        .map(|((name, share), stroke)| curve(Some((*name).to_owned()), stroke, strain, share));
    Ok(over_strain(strain, "shares of the viscosity", curves.collect()))
}

/// Columns against strain, with strokes from `first` on; `N2` is there in 3D only.
fn against_strain(
    source: &TableSource,
    label: &str,
    columns: &[(&str, &str)],
    first: usize,
) -> Result<Chart, PlotError> {
    let strain = source.column("strain")?;
    let mut curves = Vec::new();
    for ((name, label), stroke) in columns.iter().zip(&PALETTE[first..]) {
        let is_absent = *name == "N2" && source.table.find(name).is_none();
        if !is_absent {
            curves.push(curve(Some((*label).to_owned()), *stroke, strain, source.column(name)?));
        }
    }
    Ok(over_strain(strain, label, curves))
}

fn over_strain(strain: &[f64], label: &str, curves: Vec<Curve>) -> Chart {
    let y = Axis::around(label, points(&curves).map(|point| point.1).collect::<Vec<_>>());
    chart(Axis::around("strain *γ*", strain.iter().copied()), y, curves)
}

/// Iterations, where there are linear systems to solve, and below them seconds of each phase against time.
/// Runs without such systems are drawn only if asked for.
pub fn solver(results: &Results, width_mm: f64, is_needed: bool) -> Result<Option<Canvas>, PlotError> {
    let Some(source) = results.solver(is_needed)? else { return Ok(None) };
    let solves = source.column("solves")?.iter().any(|&count| count > 0.0);
    if !solves && !is_needed {
        return Ok(None);
    }
    let stroke = |phase: usize| PALETTE.get(phase).copied().unwrap_or(FAINT);
    let phases = PHASES.iter().enumerate().map(|(k, (phase, column))| (*column, Some(*phase), stroke(k)));
    let mut charts = vec![of_steps(&source, "seconds per step", phases)?];
    if solves {
        // In the strokes of the phases that they belong to.
        let of_phase = |name: &str| stroke(PHASES.iter().position(|(phase, _)| *phase == name).unwrap_or(0));
        let iterations = [("iterations", "solve"), ("contact_iterations", "contact")]
            .map(|(column, phase)| (column, Some(phase), of_phase(phase)));
        charts.insert(0, of_steps(&source, "iterations per step", iterations.into_iter())?);
    }
    Ok(Some(stacked(&charts, width_mm)))
}

/// Columns against time, with their names and strokes, but those that are zero throughout.
fn of_steps<'a>(
    source: &TableSource,
    label: &str,
    columns: impl Iterator<Item = (&'a str, Option<&'a str>, Stroke)>,
) -> Result<Chart, PlotError> {
    let t = source.column("t")?;
    let mut curves = Vec::new();
    for (name, label, stroke) in columns {
        let values = source.column(name)?;
        if values.iter().any(|&value| value != 0.0) {
            curves.push(curve(label.map(str::to_owned), stroke, t, values));
        }
    }
    let values: Vec<f64> = points(&curves).map(|point| point.1).chain([0.0]).collect();
    Ok(chart(Axis::around("time *t*", t.iter().copied()), Axis::around(label, under_frame(values)), curves))
}

/// Values, and one above them: a plateau does not lie on the frame.
pub(super) fn under_frame(mut values: Vec<f64>) -> Vec<f64> {
    let most = values.iter().copied().filter(|value| value.is_finite()).fold(0.0, f64::max);
    values.push(1.04 * most);
    values
}

/// A curve through points, interrupted where there is no number.
pub(super) fn curve(label: Option<String>, stroke: Stroke, x: &[f64], y: &[f64]) -> Curve {
    let all: Vec<(f64, f64)> = x.iter().copied().zip(y.iter().copied()).collect();
    let runs = all.split(|(x, y)| !x.is_finite() || !y.is_finite());
    let pieces = runs.filter(|run| !run.is_empty()).map(<[_]>::to_vec).collect();
    Curve { label, stroke, pieces }
}

pub(super) fn points(curves: &[Curve]) -> impl Iterator<Item = (f64, f64)> {
    curves.iter().flat_map(|curve| curve.pieces.iter().flatten().copied())
}

pub(super) fn ends(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)))
}

pub(super) fn chart(x: Axis, y: Axis, curves: Vec<Curve>) -> Chart {
    Chart { x, y, curves, notes: Vec::new(), marks: Vec::new() }
}

pub(super) fn stacked(charts: &[Chart], width_mm: f64) -> Canvas {
    let width = width_mm * PIXELS_PER_MM;
    stack_to_width(charts, width, |_, _| (HEIGHT * width).max(LEAST_HEIGHT_MM * PIXELS_PER_MM))
}
