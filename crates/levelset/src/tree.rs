//! Finding the bodies at a point without asking all of them.
//!
//! A binary tree of boxes around the centres (Omohundro, *Five balltree construction algorithms*, ICSI
//! TR-89-063, 1989). No level set of a box is larger than its largest radius less the distance to it, so a
//! search leaves out every box that cannot hold an answer: the cost of a point grows with the logarithm of
//! the number of bodies, wherever they gather. Bodies of unlike sizes part first, so that large ones do not
//! widen the searches among small ones. Along axes in which all bodies have one period distances to boxes are
//! those of the nearest image.

use std::ops::Range;

use gluey_geom::Vector;

use crate::ball::{Ball, Body, LevelSet, nearest_image};

/// Bodies in a leaf, at most.
const LEAF: usize = 4;
/// Bodies in a box whose radii differ by more than this factor part by radius.
const LIKE_RADII: f64 = 4.0;
/// Margin by which bounds must miss before a box is left out, relative to the coordinates: more than
/// rounding.
const SLACK: f64 = 1e-13;

/// Balls that are found by where they are. Answers are those of a loop over all, bit for bit.
///
/// ```
/// use gluey_geom::Vector;
/// use gluey_levelset::{Ball, BallTree, nearest};
/// let balls = [0.2, 0.5, 0.8].map(|x| Ball::new(Vector::<2>::new(x, 0.5), 0.1));
/// let tree = BallTree::new(&balls);
/// let x = Vector::<2>::new(0.66, 0.4);
/// assert_eq!(tree.nearest(&x), nearest(&balls, &x));
/// assert_eq!(tree.nearest_within(&x, 0.05), None);
/// assert!(tree.any_within(&x, 0.1, |body| body == 2));
/// ```
#[derive(Clone, Debug)]
pub struct BallTree<'a, const D: usize> {
    balls: &'a [Ball<D>],
    /// The balls in the order of the leaves.
    order: Vec<u32>,
    /// Depth first: the first part of a node follows it.
    nodes: Vec<Node<D>>,
    /// The period all balls have along an axis, or that there is none; `None` where they differ.
    periods: [Option<Option<f64>>; D],
    /// Distances in space are no less than this share of those in the box without tilt.
    shortest: f64,
    /// Size of the coordinates.
    scale: f64,
}

/// Some of the balls.
#[derive(Clone, Debug)]
struct Node<const D: usize> {
    /// Where they are in the order.
    balls: Range<usize>,
    /// Box around their centres.
    middle: Vector<D>,
    half_width: Vector<D>,
    largest_radius: f64,
    /// First node that is no part of it.
    next: usize,
}

impl<'a, const D: usize> BallTree<'a, D> {
    /// The tree of `balls`, whose centres are finite.
    pub fn new(balls: &'a [Ball<D>]) -> Self {
        let period = |d: usize| balls.first().map(|ball| ball.period()[d]);
        let common = |d: usize| period(d).filter(|&p| balls.iter().all(|ball| ball.period()[d] == p));
        let mut new = Self {
            balls,
            order: (0..balls.len() as u32).collect(),
            nodes: Vec::new(),
            periods: std::array::from_fn(common),
            shortest: balls.iter().map(|ball| shortest(ball.lattice().shear())).fold(1.0, f64::min),
            scale: balls.iter().map(|ball| ball.center().amax() + ball.bounding_radius()).fold(0.0, f64::max),
        };
        if !balls.is_empty() {
            new.add_node(0..balls.len());
        }
        new
    }

    /// The balls.
    pub fn balls(&self) -> &'a [Ball<D>] {
        self.balls
    }

    /// The body with the largest level set at `x`, and its value, as [`crate::nearest`] gives them. Of
    /// equals, the first.
    pub fn nearest(&self, x: &Vector<D>) -> Option<(usize, f64)> {
        self.nearest_within(x, f64::INFINITY)
    }

    /// The same where that value is at least `-reach`: where `x` lies in a body or no farther than `reach`
    /// from one.
    pub fn nearest_within(&self, x: &Vector<D>, reach: f64) -> Option<(usize, f64)> {
        let mut best = (usize::MAX, -reach);
        if let Some(root) = self.nodes.first() {
            let slack = self.slack(x);
            if self.bound(root, x) + slack >= best.1 {
                self.search(0, x, slack, &mut best);
            }
        }
        (best.0 != usize::MAX).then_some(best)
    }

    /// Whether `test` holds for any body whose level set at `x` is at least `-reach`. Each is tested once,
    /// until the first for which it holds, in an order that depends on the bodies alone.
    pub fn any_within(&self, x: &Vector<D>, reach: f64, mut test: impl FnMut(usize) -> bool) -> bool {
        let slack = self.slack(x);
        let mut index = 0;
        while let Some(node) = self.nodes.get(index) {
            if self.bound(node, x) + slack < -reach {
                index = node.next;
                continue;
            }
            index += 1;
            let is_leaf = index == node.next;
            let of_leaf = if is_leaf { node.balls.clone() } else { 0..0 };
            let mut bodies = self.order[of_leaf].iter().map(|&body| body as usize);
            if bodies.any(|body| self.balls[body].value(x) >= -reach && test(body)) {
                return true;
            }
        }
        false
    }

    /// Replaces `best` by a better body of a node, or an equal one that comes earlier.
    fn search(&self, index: usize, x: &Vector<D>, slack: f64, best: &mut (usize, f64)) {
        let node = &self.nodes[index];
        if node.next == index + 1 {
            for &body in &self.order[node.balls.clone()] {
                let (body, value) = (body as usize, self.balls[body as usize].value(x));
                if value > best.1 || (value == best.1 && body < best.0) {
                    *best = (body, value);
                }
            }
            return;
        }
        let parts = [index + 1, self.nodes[index + 1].next];
        let mut parts = parts.map(|part| (part, self.bound(&self.nodes[part], x) + slack));
        if parts[1].1 > parts[0].1 {
            parts.swap(0, 1);
        }
        for (part, bound) in parts {
            if bound >= best.1 {
                self.search(part, x, slack, best);
            }
        }
    }

    /// No level set of the node is larger at `x`, but for rounding.
    fn bound(&self, node: &Node<D>, x: &Vector<D>) -> f64 {
        let outside = |d: usize| match self.periods[d] {
            Some(period) => {
                (nearest_image(x[d] - node.middle[d], period).abs() - node.half_width[d]).max(0.0)
            }
            None => 0.0,
        };
        node.largest_radius - self.shortest * (0..D).map(|d| outside(d).powi(2)).sum::<f64>().sqrt()
    }

    fn slack(&self, x: &Vector<D>) -> f64 {
        SLACK * (self.scale + x.amax())
    }

    fn add_node(&mut self, balls: Range<usize>) {
        let index = self.nodes.len();
        self.nodes.push(self.node(balls.clone()));
        if balls.len() > LEAF {
            let middle = self.part_by_radius(&balls).unwrap_or_else(|| self.part_by_place(index));
            self.add_node(balls.start..middle);
            self.add_node(middle..balls.end);
        }
        self.nodes[index].next = self.nodes.len();
    }

    fn node(&self, balls: Range<usize>) -> Node<D> {
        let (mut lower, mut upper) =
            (Vector::<D>::repeat(f64::INFINITY), Vector::<D>::repeat(f64::NEG_INFINITY));
        for &body in &self.order[balls.clone()] {
            let place = self.place(body);
            (lower, upper) = (lower.inf(&place), upper.sup(&place));
        }
        let radii = self.order[balls.clone()].iter().map(|&body| self.balls[body as usize].bounding_radius());
        let largest_radius = radii.fold(f64::NEG_INFINITY, f64::max);
        Node {
            balls,
            middle: (lower + upper) * 0.5,
            half_width: (upper - lower) * 0.5,
            largest_radius,
            next: 0,
        }
    }

    /// Puts the small balls of a range before the large ones; where these begin, if it has both.
    fn part_by_radius(&mut self, balls: &Range<usize>) -> Option<usize> {
        let radius = |body: u32| self.balls[body as usize].bounding_radius();
        let order = &mut self.order[balls.clone()];
        let radii = order.iter().map(|&body| radius(body));
        let (least, most) = radii.fold((f64::INFINITY, 0.0f64), |(a, b), r| (a.min(r), b.max(r)));
        if !(least > 0.0 && most > LIKE_RADII * least) {
            return None;
        }
        let between = (least * most).sqrt();
        order.sort_by_key(|&body| radius(body) > between);
        Some(balls.start + order.partition_point(|&body| radius(body) <= between))
    }

    /// Halves a node along the longest edge of its box; where the second half begins.
    fn part_by_place(&mut self, node: usize) -> usize {
        let Node { balls, half_width, .. } = self.nodes[node].clone();
        let longest = half_width.imax();
        let mut order = std::mem::take(&mut self.order);
        let along = |body: &u32| self.place(*body)[longest];
        let half = balls.len() / 2;
        order[balls.clone()]
            .select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
        self.order = order;
        balls.start + half
    }

    /// The image of a centre in the first period.
    fn place(&self, body: u32) -> Vector<D> {
        let center = self.balls[body as usize].center();
        Vector::from_fn(|d, _| match self.periods[d] {
            Some(Some(period)) => center[d] - period * (center[d] / period).floor(),
            _ => center[d],
        })
    }
}

/// The smallest singular value of a shear: that of `[1, g; 0, 1]`.
fn shortest(shear: f64) -> f64 {
    (1.0 + 0.25 * shear * shear).sqrt() - 0.5 * shear.abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ball::nearest;
    use gluey_geom::Lattice;
    use gluey_testkit::packing::Packing;
    use rand::{Rng, RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn point<const D: usize>(random: &mut impl Rng, from: f64, to: f64) -> Vector<D> {
        Vector::from_fn(|_, _| random.random_range(from..to))
    }

    /// The tree against a loop at points anywhere, and at centres and between bodies, where they tie.
    fn check<const D: usize>(balls: &[Ball<D>], random: &mut impl Rng, size: f64) {
        let tree = BallTree::new(balls);
        for trial in 0..60 {
            let [first, second] = [(); 2].map(|()| random.random_range(0..balls.len().max(1)));
            let x = match (trial % 4, balls) {
                (0, [_, ..]) => *balls[first].center(),
                (1, [_, ..]) => (balls[first].center() + balls[second].center()) * 0.5,
                _ => point(random, -0.5 * size, 1.5 * size),
            };
            let expected = nearest(balls, &x);
            assert_eq!(tree.nearest(&x), expected, "{x:?}");
            let reach = size * random.random_range(-0.2f64..0.5).powi(3);
            let reach = if trial % 3 == 0 { -expected.map_or(0.0, |best| best.1) } else { reach };
            assert_eq!(tree.nearest_within(&x, reach), expected.filter(|best| best.1 >= -reach));
            let mut found = Vec::new();
            assert!(!tree.any_within(&x, reach, |body| {
                found.push(body);
                false
            }));
            found.sort_unstable();
            let within = |&body: &usize| balls[body].value(&x) >= -reach;
            let within: Vec<usize> = (0..balls.len()).filter(within).collect();
            assert_eq!(found, within);
            let wanted = within.get(within.len() / 2).copied();
            assert_eq!(tree.any_within(&x, reach, |body| Some(body) == wanted), wanted.is_some());
        }
    }

    /// Radii alike or over six decades, bodies all over the box or in its corner, on a lattice with ties
    /// everywhere, periodic in none, some or all directions, some bodies twice, some beyond the border.
    fn trees_are_loops<const D: usize>() {
        for (trial, count) in (0..=20).chain([33, 64, 100, 300]).flat_map(|n| [n; 6]).enumerate() {
            let mut random = ChaCha8Rng::seed_from_u64(trial as u64);
            let size = 10f64.powi(random.random_range(-3..4));
            let period = std::array::from_fn(|d| (trial >> d & 1 == 1).then_some(size));
            let (is_lattice, decades) = (trial % 5 == 0, if trial % 3 == 0 { 6.0 } else { 0.3 });
            let mut balls: Vec<Ball<D>> = Vec::new();
            for _ in 0..count {
                let cloud = if random.random_range(0..4) == 0 { 1.2 * size } else { 0.1 * size };
                let center = match is_lattice {
                    true => Vector::from_fn(|_, _| 0.25 * size * f64::from(random.random_range(0..5))),
                    false => point(&mut random, -0.1 * cloud, cloud),
                };
                let radius = match is_lattice {
                    true => 0.125 * size,
                    false => 0.2 * size * 10f64.powf(-random.random_range(0.0..decades)),
                };
                let tilt = if trial % 3 == 0 { 0.0 } else { size * random.random_range(-0.6..0.6) };
                balls.push(Ball::in_lattice(center, radius, Lattice::new(period).tilted(tilt)));
                if random.random_range(0..8) == 0 {
                    balls.push(balls[random.random_range(0..balls.len())]);
                }
            }
            check(&balls, &mut random, size);
        }
    }

    #[test]
    fn answers_are_those_of_a_loop() {
        trees_are_loops::<2>();
        trees_are_loops::<3>();
    }

    #[test]
    fn balls_of_different_periods_are_found_as_well() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let ball = |random: &mut ChaCha8Rng| {
            let period = [None, Some(1.0), Some(0.7)][random.random_range(0..3)];
            Ball::periodic(point::<2>(random, 0.0, 1.0), 0.02, [period, Some(1.0)])
        };
        let balls: Vec<Ball<2>> = (0..80).map(|_| ball(&mut random)).collect();
        check(&balls, &mut random, 1.0);
    }

    /// Boxes that a search looks at, on average over points anywhere in the box.
    fn boxes_seen(balls: &[Ball<3>], size: f64) -> f64 {
        let tree = BallTree::new(balls);
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let (trials, mut seen) = (1000, 0);
        for _ in 0..trials {
            let x = point::<3>(&mut random, 0.0, size);
            let mut index = 0;
            while let Some(node) = tree.nodes.get(index) {
                seen += 1;
                index = if tree.bound(node, &x) < 0.0 { node.next } else { index + 1 };
            }
        }
        f64::from(seen) / f64::from(trials)
    }

    /// A periodic suspension of spheres, and some of a tenth of their size all over it.
    fn suspension(count: usize, small_ones: usize) -> (Vec<Ball<3>>, f64) {
        let packing = Packing::<3>::fluid(count, 0.3, 1);
        let period = [Some(packing.side); 3];
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let large = packing.positions.iter().map(|&x| Ball::periodic(x, 0.5, period));
        let mut balls: Vec<_> = large.collect();
        let small = |_| Ball::periodic(point::<3>(&mut random, 0.0, packing.side), 0.05, period);
        balls.extend((0..small_ones).map(small));
        (balls, packing.side)
    }

    #[test]
    fn searches_grow_slowly_with_the_number_of_bodies_whatever_their_radii() {
        let seen = |(balls, size): (Vec<Ball<3>>, f64)| boxes_seen(&balls, size);
        let [few, many] = [100, 3200].map(|count| seen(suspension(count, 0)));
        let mixed = seen(suspension(100, 6400));
        assert!(many < few + 20.0 && mixed < 50.0, "{few} {many} {mixed}");
    }
}
