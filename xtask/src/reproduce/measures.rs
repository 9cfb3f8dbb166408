//! Numbers that say what a trajectory does: smallest gap, half a turn, closest approach, distance from
//! another one.

use super::trajectory::Trajectory;

/// Gaps this close to the smallest one (in radii) count as closest approach: a pair in contact has many of
/// them.
const CONTACT_BAND: f64 = 1e-6;

/// The smallest gap D/a of all pairs over all times.
pub fn smallest_gap(run: &Trajectory) -> Option<f64> {
    run.gaps.iter().flat_map(|gap| gap.over_radius.iter().copied()).reduce(f64::min)
}

/// The largest gap D/a that a pair reaches.
pub fn largest_gap(run: &Trajectory, pair: (usize, usize)) -> Option<f64> {
    run.gap(pair)?.iter().copied().reduce(f64::max)
}

/// The median gap D/a of a pair over the second half of the run: what it settles to.
pub fn median_gap(run: &Trajectory, pair: (usize, usize)) -> Option<f64> {
    let gap = run.gap(pair)?;
    let mut late = gap[gap.len() / 2..].to_vec();
    late.sort_by(f64::total_cmp);
    late.get(late.len() / 2).copied()
}

/// The last gap D/a of a pair.
pub fn last_gap(run: &Trajectory, pair: (usize, usize)) -> Option<f64> {
    run.gap(pair)?.last().copied()
}

/// Least and greatest distance of any particle from the point `(1/2, 1/2)` in the x-y plane, at times `from`
/// and later.
pub fn distance_from_center(run: &Trajectory, from: f64) -> Option<(f64, f64)> {
    let rows = run.times.iter().zip(0..).filter(|(t, _)| **t >= from).map(|(_, row)| row);
    let distances = rows.flat_map(|row: usize| {
        run.centers.iter().map(move |path| (path[row][0] - 0.5).hypot(path[row][1] - 0.5))
    });
    distances.map(|r| (r, r)).reduce(|(low, high), (r, _)| (low.min(r), high.max(r)))
}

/// Angle of the line from centre 1 to centre 2 in the x-y plane at every time, in radians, without jumps.
pub fn line_angles(run: &Trajectory) -> Vec<f64> {
    let mut angles: Vec<f64> = Vec::with_capacity(run.times.len());
    for (a, b) in run.centers[0].iter().zip(&run.centers[1]) {
        let angle = (b[1] - a[1]).atan2(b[0] - a[0]);
        let turns = angles.last().map_or(0.0, |last| ((last - angle) / std::f64::consts::TAU).round());
        angles.push(angle + turns * std::f64::consts::TAU);
    }
    angles
}

/// First time when the line of centres has turned by `angle` radians (clockwise is negative), by linear
/// interpolation.
pub fn time_to_turn(run: &Trajectory, angle: f64) -> Option<f64> {
    let angles = line_angles(run);
    let wanted = angles.first()? + angle;
    first_crossing(&run.times, &angles, wanted)
}

fn first_crossing(times: &[f64], values: &[f64], wanted: f64) -> Option<f64> {
    let row = values.windows(2).position(|w| (w[0] - wanted) * (w[1] - wanted) <= 0.0 && w[0] != w[1])?;
    let weight = (wanted - values[row]) / (values[row + 1] - values[row]);
    Some(times[row] + weight * (times[row + 1] - times[row]))
}

/// Time of closest approach of particles 1 and 2: the middle of the times when the gap is smallest.
pub fn closest_approach(run: &Trajectory) -> Option<f64> {
    let gap = run.gap((1, 2))?;
    let smallest = gap.iter().copied().reduce(f64::min)?;
    let near = |value: &f64| *value <= smallest.max(0.0) + CONTACT_BAND;
    let (first, last) = (gap.iter().position(near)?, gap.iter().rposition(near)?);
    match first == last && smallest > 0.0 {
        true => bottom(run, gap, first),
        false => Some(0.5 * (run.times[first] + run.times[last])),
    }
}

/// Where the parabola through the logarithm of the gap at a time and the two around it is lowest.
fn bottom(run: &Trajectory, gap: &[f64], lowest: usize) -> Option<f64> {
    let around = gap.get(lowest.checked_sub(1)?..lowest + 2)?;
    let [before, at, after] = [0, 1, 2].map(|k| around[k].ln());
    let step = run.times[lowest + 1] - run.times[lowest];
    Some(run.times[lowest] + 0.5 * step * (before - after) / (before - 2.0 * at + after))
}

/// Largest relative difference of the gap of particles 1 and 2 from `exact` while the exact gap is at least
/// `floor` radii. `None` if the run ends before the exact solution does.
pub fn gap_deviation(run: &Trajectory, exact: &Trajectory, floor: f64) -> Option<f64> {
    let relative = |own: f64, wanted: f64| (own - wanted).abs() / wanted;
    largest_over_exact(run, exact, exact.end(), |wanted| wanted >= floor, relative)
}

/// Largest difference of the gap of particles 1 and 2 from `exact`, in radii, up to time `until` while the
/// exact gap is at most `ceiling` radii. `None` if the run ends earlier.
pub fn gap_error(run: &Trajectory, exact: &Trajectory, until: f64, ceiling: f64) -> Option<f64> {
    largest_over_exact(run, exact, until, |wanted| wanted <= ceiling, |own, wanted| (own - wanted).abs())
}

fn largest_over_exact(
    run: &Trajectory,
    exact: &Trajectory,
    until: f64,
    counts: impl Fn(f64) -> bool,
    difference: impl Fn(f64, f64) -> f64,
) -> Option<f64> {
    let (own, wanted) = (run.gap((1, 2))?, exact.gap((1, 2))?);
    let times = exact.times.iter().zip(wanted).filter(|(t, gap)| **t <= until && counts(**gap));
    let differences = times.map(|(&t, &gap)| Some(difference(run.at(own, t)?, gap)));
    differences.collect::<Option<Vec<f64>>>()?.into_iter().reduce(f64::max)
}

/// Largest distance between the centres of the same particle in `run` and `other` up to time `until`, box
/// units; `None` if one of them ends earlier and `until` is finite.
pub fn center_deviation(run: &Trajectory, other: &Trajectory, until: f64) -> Option<f64> {
    let end = run.end().min(other.end());
    if until.is_finite() && end < until * (1.0 - 1e-9) {
        return None;
    }
    let rows = other.times.iter().enumerate().filter(|(_, t)| **t <= until.min(end) * (1.0 + 1e-9));
    let distances = rows.flat_map(|(row, &t)| {
        (1..=other.centers.len().min(run.centers.len())).map(move |particle| {
            let (own, wanted) = (run.center_at(particle, t)?, other.centers[particle - 1][row]);
            Some((own[0] - wanted[0]).hypot(own[1] - wanted[1]))
        })
    });
    distances.collect::<Option<Vec<f64>>>()?.into_iter().reduce(f64::max)
}

/// The largest gap D/a of particles 1 and 2 after the time when it is smallest.
pub fn largest_gap_after_smallest(run: &Trajectory) -> Option<f64> {
    let gap = run.gap((1, 2))?;
    let smallest = (0..gap.len()).min_by(|&i, &j| gap[i].total_cmp(&gap[j]))?;
    gap[smallest..].iter().copied().reduce(f64::max)
}

/// Largest difference of the gaps D/a of particles 1 and 2 in two runs with the same time step, over all
/// times when that of the first is positive.
pub fn gap_difference_while_apart(run: &Trajectory, other: &Trajectory) -> Option<f64> {
    let (own, others) = (run.gap((1, 2))?, other.gap((1, 2))?);
    let apart = own.iter().zip(others).filter(|(own, _)| **own > 0.0);
    apart.map(|(own, other)| (own - other).abs()).reduce(f64::max)
}

/// The largest gap D/a of particles 1 and 2 in `run` at the times when they touch in `other`.
pub fn largest_gap_while_touching(run: &Trajectory, other: &Trajectory) -> Option<f64> {
    let touching = other.times.iter().zip(other.gap((1, 2))?).filter(|(_, gap)| **gap <= CONTACT_BAND);
    let gap = run.gap((1, 2))?;
    touching.filter_map(|(&t, _)| run.at(gap, t)).reduce(f64::max)
}

/// Greatest over least distance of any particle from the point `(1/2, 1/2)` at times `from` and later.
pub fn orbit_ratio(run: &Trajectory, from: f64) -> Option<f64> {
    distance_from_center(run, from).map(|(least, greatest)| greatest / least)
}

/// Largest distance of the middle of particles 1 and 2 from the plane `y = 1/2`, box units.
pub fn offset_of_the_pair(run: &Trajectory) -> Option<f64> {
    let [first, second, ..] = &run.centers[..] else { return None };
    let offsets = first.iter().zip(second).map(|(a, b)| (0.5 * (a[1] + b[1]) - 0.5).abs());
    offsets.reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::trajectory::GapSeries;
    use super::*;
    use std::f64::consts::PI;

    /// Two particles on a circle of radius 0.05, turning at -1/2 from angle `start`; the gap is `gap(t)`.
    fn turning_pair(start: f64, end: f64, gap: impl Fn(f64) -> f64) -> Trajectory {
        let times: Vec<f64> = (0..=1000).map(|i| end * f64::from(i) / 1000.0).collect();
        let path = |side: f64| {
            let at = |t: &f64| {
                let angle = start - 0.5 * t;
                [0.5 + side * 0.05 * angle.cos(), 0.5 + side * 0.05 * angle.sin(), 0.0]
            };
            times.iter().map(at).collect()
        };
        let over_radius = times.iter().map(|&t| gap(t)).collect();
        Trajectory {
            centers: vec![path(-1.0), path(1.0)],
            gaps: vec![GapSeries { pair: (1, 2), over_radius }],
            times,
        }
    }

    #[test]
    fn half_a_turn_at_half_a_radian_takes_two_pi() {
        let pair = turning_pair(-0.2, 20.0, |_| 1.0);
        assert!((time_to_turn(&pair, -PI).unwrap() - 2.0 * PI).abs() < 1e-6);
        let (low, high) = distance_from_center(&pair, 0.0).unwrap();
        assert!((low - 0.05).abs() < 1e-12 && (high - 0.05).abs() < 1e-12);
    }

    #[test]
    fn closest_approach_is_the_middle_of_a_contact() {
        let pair = turning_pair(-0.2, 5.0, |t| ((t - 3.0).abs() - 0.5).max(1e-17));
        assert!((closest_approach(&pair).unwrap() - 3.0).abs() < 0.01);
        assert_eq!(smallest_gap(&pair), Some(1e-17));
    }

    #[test]
    fn deviations_see_a_shifted_copy() {
        let exact = turning_pair(-0.2, 5.0, |t| 1.0 + t);
        let mut run = exact.clone();
        run.gaps[0].over_radius.iter_mut().for_each(|gap| *gap *= 1.02);
        run.centers[1].iter_mut().for_each(|c| c[1] += 0.001);
        assert!((gap_deviation(&run, &exact, 2.0).unwrap() - 0.02).abs() < 1e-12);
        assert!((center_deviation(&run, &exact, 3.0).unwrap() - 0.001).abs() < 1e-12);
        assert_eq!(center_deviation(&exact, &exact, 3.0), Some(0.0));
    }
}
