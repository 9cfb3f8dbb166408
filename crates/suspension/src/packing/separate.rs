//! Balls that overlap are pushed apart along their lines of centres, pair by pair, until no overlap is left
//! but a tolerance. Pairs are looked for with a skin, and a ball is looked at again only after it or a
//! neighbour has moved, so that the cost is that of what is crowded.

use gluey_geom::Vector;

use crate::{Container, for_each_pair};

/// Width of the skin, in mean radii.
const SKIN: f64 = 0.3;
/// Looks at a ball before it is given up, on average.
const LOOK_LIMIT: usize = 20_000;

/// Balls that could not be parted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crowded {
    /// The largest overlap that is left, relative to the smallest radius.
    pub overlap: f64,
}

/// Pushes balls apart until they overlap by no more than `tolerance` smallest radii, and keeps them within
/// the walls.
pub(super) fn separate<const D: usize>(
    container: &Container<D>,
    positions: &mut [Vector<D>],
    radii: &[f64],
    tolerance: f64,
) -> Result<(), Crowded> {
    let smallest = radii.iter().copied().fold(f64::INFINITY, f64::min);
    let mut looks_left = LOOK_LIMIT.saturating_mul(radii.len());
    let mut crowd = Crowd { container, radii, tolerance: tolerance * smallest, positions };
    while let Settled::Not { worst } = crowd.settle(&mut looks_left) {
        if looks_left == 0 {
            return Err(Crowded { overlap: worst / smallest });
        }
    }
    Ok(())
}

struct Crowd<'a, const D: usize> {
    container: &'a Container<D>,
    radii: &'a [f64],
    /// Overlap that is left, a length.
    tolerance: f64,
    positions: &'a mut [Vector<D>],
}

/// The end of a round of pushes.
enum Settled {
    /// No pair overlaps.
    Yes,
    /// A ball has moved so far that it may have new neighbours, or there were too many looks; the largest
    /// overlap of the last sweep.
    Not { worst: f64 },
}

impl<const D: usize> Crowd<'_, D> {
    /// Pushes with the neighbours that balls have now.
    fn settle(&mut self, looks_left: &mut usize) -> Settled {
        let skin = SKIN * self.radii.iter().sum::<f64>() / self.radii.len() as f64;
        let neighbours = NearBalls::of(self.container, self.positions, self.radii, skin);
        let before = self.positions.to_vec();
        let mut to_look_at: Vec<u32> = (0..self.radii.len() as u32).collect();
        let (mut next, mut is_next) = (Vec::new(), vec![false; self.radii.len()]);
        while !to_look_at.is_empty() {
            let mut worst = 0.0;
            for &ball in &to_look_at {
                let overlap = self.push(ball as usize, &neighbours, |moved| {
                    if !std::mem::replace(&mut is_next[moved], true) {
                        next.push(moved as u32);
                    }
                });
                worst = overlap.max(worst);
            }
            let looks = to_look_at.len();
            *looks_left = looks_left.saturating_sub(looks);
            let has_gone = |&ball: &u32| {
                let ball = ball as usize;
                (self.positions[ball] - before[ball]).norm() > 0.5 * skin
            };
            if *looks_left == 0 || next.iter().any(has_gone) {
                return Settled::Not { worst };
            }
            to_look_at.clear();
            std::mem::swap(&mut to_look_at, &mut next);
            to_look_at.sort_unstable();
            to_look_at.iter().for_each(|&ball| is_next[ball as usize] = false);
        }
        Settled::Yes
    }

    /// Parts a ball from its walls and from its neighbours, tells of all that move for it and of what they
    /// have to look at again; its largest overlap.
    fn push(&mut self, ball: usize, neighbours: &NearBalls<D>, mut tell: impl FnMut(usize)) -> f64 {
        let mut worst = 0.0;
        self.keep_inside(ball);
        for &(other, shift) in neighbours.around(ball) {
            let other = other as usize;
            let arm = self.positions[other] + shift - self.positions[ball];
            let distance = arm.norm();
            let overlap = self.radii[ball] + self.radii[other] - distance;
            if overlap > self.tolerance {
                worst = overlap.max(worst);
                // Balls that walls have brought to the same place part along the diagonal.
                let normal = arm.try_normalize(0.0).unwrap_or(Vector::repeat((D as f64).powf(-0.5)));
                let half = normal * (0.5 * overlap);
                self.positions[ball] -= half;
                self.positions[other] += half;
                self.keep_inside(ball);
                self.keep_inside(other);
                tell(ball);
                tell(other);
            }
        }
        worst
    }

    fn keep_inside(&mut self, ball: usize) {
        let (bounds, radius) = (self.container.bounds(), self.radii[ball]);
        for d in (0..D).filter(|&d| self.container.is_walled(d)) {
            let x = &mut self.positions[ball][d];
            *x = x.clamp(bounds.lower[d] + radius, bounds.upper[d] - radius);
        }
    }
}

/// Balls that are near each other, and the shift of the image that is.
struct NearBalls<const D: usize> {
    starts: Vec<usize>,
    list: Vec<(u32, Vector<D>)>,
}

impl<const D: usize> NearBalls<D> {
    fn of(container: &Container<D>, positions: &[Vector<D>], radii: &[f64], skin: f64) -> Self {
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let mut pairs = Vec::new();
        for_each_pair(container, positions, 2.0 * largest + skin, |pair| {
            let (first, second) = (pair.first, pair.second);
            if first != second && pair.arm.norm() < radii[first] + radii[second] + skin {
                let shift = pair.arm - (positions[second] - positions[first]);
                pairs.push((first, second, shift));
            }
        });
        let mut starts = vec![0; radii.len() + 1];
        pairs.iter().for_each(|(first, second, _)| {
            starts[first + 1] += 1;
            starts[second + 1] += 1;
        });
        (0..radii.len()).for_each(|ball| starts[ball + 1] += starts[ball]);
        let (mut ends, mut list) = (starts.clone(), vec![(0, Vector::zeros()); 2 * pairs.len()]);
        for (first, second, shift) in pairs {
            for (ball, other, shift) in [(first, second, shift), (second, first, -shift)] {
                list[ends[ball]] = (other as u32, shift);
                ends[ball] += 1;
            }
        }
        Self { starts, list }
    }

    fn around(&self, ball: usize) -> &[(u32, Vector<D>)] {
        &self.list[self.starts[ball]..self.starts[ball + 1]]
    }
}

#[cfg(test)]
mod tests {
    use gluey_geom::Aabb;

    use super::*;

    #[test]
    fn a_row_between_walls_is_spread() {
        let container =
            Container::<2>::walled(Aabb { lower: Vector::zeros(), upper: Vector::<2>::new(4.0, 1.0) });
        let mut positions = [0.1, 0.2, 0.25, 3.9].map(|x| Vector::<2>::new(x, 0.5));
        let radii = [0.45; 4];
        assert_eq!(separate(&container, &mut positions, &radii, 1e-3), Ok(()));
        for (k, x) in positions.iter().enumerate() {
            assert!(x[0] >= 0.45 && x[0] <= 3.55 && x[1] >= 0.45 && x[1] <= 0.55, "{positions:?}");
            let nearest = positions[..k].iter().map(|other| (other - x).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest > 0.9 - 0.45e-3, "{positions:?}");
        }
    }

    #[test]
    fn what_has_no_room_is_refused_with_its_overlap() {
        let container = Container::<2>::periodic(&Vector::repeat(1.0));
        let mut positions = [[0.1, 0.5], [0.6, 0.4], [0.4, 0.9]].map(Vector::<2>::from);
        let refused = separate(&container, &mut positions, &[0.3; 3], 1e-3);
        assert!(
            matches!(refused, Err(Crowded { overlap }) if overlap > 0.01 && overlap < 1.0),
            "{refused:?}"
        );
    }
}
