//! The forms on a vector of pieces, one direction after another.
//!
//! Velocities go from nodes to a plane of points of the first direction, from there to lines of points along
//! the last, and to the points, where the forms are taken, and back: what is in use fits into the cache next
//! to the processor.

use gluey_linalg::Scalar;

use super::super::simd::Lanes;
use crate::cut::POINTS;
use crate::element::{derivatives_1d, gauss, multi_index, node_count, values_1d};

/// Nodes per direction.
const NODES: usize = 3;
/// Lines of points along the last direction, at most.
const LINES: usize = POINTS * POINTS;
/// Most dimensions.
const MOST: usize = 3;

/// Values and derivatives of the one-dimensional shape functions at the Gauss points.
#[derive(Clone, Debug)]
pub(super) struct Shapes<T> {
    /// Of degree 2: value, derivative.
    velocity: [[[T; NODES]; POINTS]; 2],
    /// Of degree 1.
    pressure: [[T; 2]; POINTS],
    /// The points.
    points: [T; POINTS],
}

impl<T: Scalar> Shapes<T> {
    pub(super) fn new() -> Self {
        let rule = gauss(POINTS);
        let at = |shape: fn(usize, f64) -> [f64; 3], q: usize| shape(2, rule[q].0).map(T::from_f64);
        let both: [fn(usize, f64) -> [f64; 3]; 2] = [values_1d, derivatives_1d];
        Self {
            velocity: both.map(|shape| std::array::from_fn(|q| at(shape, q))),
            pressure: std::array::from_fn(|q| {
                let [a, b, _] = values_1d(1, rule[q].0);
                [a, b].map(T::from_f64)
            }),
            points: std::array::from_fn(|q| T::from_f64(rule[q].0)),
        }
    }
}

/// Unknowns of a piece: velocities, component by component, pressures, twist.
pub(super) const fn slots<const D: usize>() -> usize {
    D * node_count::<D>(2) + node_count::<D>(1) + twist_len::<D>()
}

/// Unknowns of a rigid motion.
pub(super) const fn twist_len<const D: usize>() -> usize {
    D + D * (D - 1) / 2
}

/// Numbers at a point: volume, normal, penalty.
pub(super) const fn numbers<const D: usize>() -> usize {
    D + 2
}

/// Place in the moments of a piece of a point of [`gauss_cube`](crate::element::gauss_cube): the last
/// direction runs first.
pub(super) fn place<const D: usize>(point: usize) -> usize {
    let (q, last) = (point % POINTS, point / POINTS.pow(D as u32 - 1));
    let between = POINTS.pow(D as u32 - 2);
    (q * between + point / POINTS % between) * POINTS + last
}

/// Pieces side by side in vectors: one number per lane.
pub(super) struct Pieces<'a, V: Lanes> {
    /// Moments times `eta h^(D-2)`, `step` apart: [`numbers`] for each point at [`place`], as they are read.
    pub moments: &'a [V::Scalar],
    /// Distance of successive numbers.
    pub step: usize,
    /// `h / eta`.
    pub pressure: V,
    /// Shear of the cells.
    pub shear: V,
    /// Arm of the lower corner in radii of the ball, and the edge of the cell in radii.
    pub origin: [V; MOST],
    /// See `origin`.
    pub edge: V,
}

/// Velocities, or loads on them, at points of the first direction and at the nodes of the others: for each
/// component the values and the derivatives in the first direction.
type Plane<V> = [[[[V; NODES]; NODES]; 2]; MOST];

/// Fields at points of all directions but the last and at its nodes: for each component the value and the
/// derivatives in these directions; and pressures.
struct LineFields<V> {
    velocity: [[[V; NODES]; MOST]; MOST],
    pressure: [V; 2],
}

/// `y = [A, -B^T; -B, 0] x` on a vector of pieces; slots are `step` numbers apart.
#[inline(always)]
pub(super) fn apply<V: Lanes, const D: usize>(
    shapes: &Shapes<V::Scalar>,
    pieces: &Pieces<'_, V>,
    x: &[V::Scalar],
    y: &mut [V::Scalar],
) {
    let get = |slot: usize| V::load(&x[slot * pieces.step..]);
    let twist =
        std::array::from_fn(|k| if k < twist_len::<D>() { get(first_twist::<D>() + k) } else { zero() });
    let mut pressures = pressures::<V, D>(shapes, get);
    let mut loads = [[[[[zero(); NODES]; NODES]; 2]; MOST]; POINTS];
    let mut of_ball = [zero(); 2 * MOST];
    for (q, loads) in loads.iter_mut().enumerate() {
        let plane = plane::<V, D>(shapes, q, get);
        for r in 0..POINTS.pow(D as u32 - 2) {
            let k = q + POINTS * r;
            let mut line =
                LineFields { velocity: velocities::<V, D>(shapes, r, &plane), pressure: pressures[k] };
            line.take_forms::<D>(shapes, pieces, [q, r], &twist, &mut of_ball);
            pressures[k] = line.pressure;
            add_to_plane::<V, D>(shapes, r, &line.velocity, loads);
        }
    }
    let mut put = |slot: usize, value: V| value.store(&mut y[slot * pieces.step..]);
    for (k, load) in of_ball[..twist_len::<D>()].iter().enumerate() {
        put(first_twist::<D>() + k, *load);
    }
    put_velocities::<V, D>(shapes, &loads, &mut put);
    put_pressures::<V, D>(shapes, &pressures, put);
}

const fn first_twist<const D: usize>() -> usize {
    slots::<D>() - twist_len::<D>()
}

#[inline(always)]
fn zero<V: Lanes>() -> V {
    V::splat(V::Scalar::ZERO)
}

/// The velocities in the plane at a point `q` of the first direction.
#[inline(always)]
fn plane<V: Lanes, const D: usize>(
    shapes: &Shapes<V::Scalar>,
    q: usize,
    get: impl Fn(usize) -> V,
) -> Plane<V> {
    let mut plane = [[[[zero(); NODES]; NODES]; 2]; MOST];
    for c in 0..D {
        for last in 0..NODES {
            for j in 0..NODES.pow(D as u32 - 2) {
                let start = c * node_count::<D>(2) + NODES * j + NODES.pow(D as u32 - 1) * last;
                let line = [get(start), get(start + 1), get(start + 2)];
                for kind in 0..2 {
                    plane[c][kind][last][j] = dot(&shapes.velocity[kind][q], &line);
                }
            }
        }
    }
    plane
}

/// The velocities in the line at a point `r` of the second direction of three.
#[inline(always)]
fn velocities<V: Lanes, const D: usize>(
    shapes: &Shapes<V::Scalar>,
    r: usize,
    plane: &Plane<V>,
) -> [[[V; NODES]; MOST]; MOST] {
    let mut line = [[[zero(); NODES]; MOST]; MOST];
    for c in 0..D {
        for last in 0..NODES {
            let [values, slopes] = [0, 1].map(|kind| &plane[c][kind][last]);
            if D == 2 {
                line[c][0][last] = values[0];
                line[c][1][last] = slopes[0];
                continue;
            }
            line[c][0][last] = dot(&shapes.velocity[0][r], values);
            line[c][1][last] = dot(&shapes.velocity[0][r], slopes);
            line[c][2][last] = dot(&shapes.velocity[1][r], values);
        }
    }
    line
}

/// The transpose of [`velocities`].
#[inline(always)]
fn add_to_plane<V: Lanes, const D: usize>(
    shapes: &Shapes<V::Scalar>,
    r: usize,
    line: &[[[V; NODES]; MOST]; MOST],
    loads: &mut Plane<V>,
) {
    for c in 0..D {
        for last in 0..NODES {
            let [value, first, second] = [0, 1, 2].map(|kind| line[c][kind][last]);
            if D == 2 {
                loads[c][0][last][0] = value;
                loads[c][1][last][0] = first;
                continue;
            }
            for j in 0..NODES {
                let [shape, slope] = [0, 1].map(|kind| V::splat(shapes.velocity[kind][r][j]));
                let own = value.mul_add(shape, loads[c][0][last][j]);
                loads[c][0][last][j] = second.mul_add(slope, own);
                loads[c][1][last][j] = first.mul_add(shape, loads[c][1][last][j]);
            }
        }
    }
}

/// The transpose of [`plane`], of all planes.
#[inline(always)]
fn put_velocities<V: Lanes, const D: usize>(
    shapes: &Shapes<V::Scalar>,
    loads: &[Plane<V>; POINTS],
    put: &mut impl FnMut(usize, V),
) {
    for c in 0..D {
        for last in 0..NODES {
            for j in 0..NODES.pow(D as u32 - 2) {
                let start = c * node_count::<D>(2) + NODES * j + NODES.pow(D as u32 - 1) * last;
                for i in 0..NODES {
                    let mut sum = zero::<V>();
                    for kind in 0..2 {
                        for q in 0..POINTS {
                            let shape = V::splat(shapes.velocity[kind][q][i]);
                            sum = loads[q][c][kind][last][j].mul_add(shape, sum);
                        }
                    }
                    put(start + i, sum);
                }
            }
        }
    }
}

/// The pressures of all lines.
#[inline(always)]
fn pressures<V: Lanes, const D: usize>(
    shapes: &Shapes<V::Scalar>,
    get: impl Fn(usize) -> V,
) -> [[V; 2]; LINES] {
    let mut pressures = [[zero(); 2]; LINES];
    for last in 0..2 {
        let corner = |k: usize| get(D * node_count::<D>(2) + 2usize.pow(D as u32 - 1) * last + k);
        for line in 0..POINTS.pow(D as u32 - 1) {
            let [a, b] = [line % POINTS, line / POINTS].map(|q| &shapes.pressure[q]);
            let mut sum = dot(a, &[corner(0), corner(1)]);
            if D == 3 {
                sum = dot(b, &[sum, dot(a, &[corner(2), corner(3)])]);
            }
            pressures[line][last] = sum;
        }
    }
    pressures
}

/// The transpose of [`pressures`].
#[inline(always)]
fn put_pressures<V: Lanes, const D: usize>(
    shapes: &Shapes<V::Scalar>,
    loads: &[[V; 2]; LINES],
    mut put: impl FnMut(usize, V),
) {
    for corner in 0..node_count::<D>(1) {
        let index = multi_index::<D>(corner, 2);
        let mut sum = zero::<V>();
        for line in 0..POINTS.pow(D as u32 - 1) {
            let mut weight = shapes.pressure[line % POINTS][index[0]];
            if D == 3 {
                weight *= shapes.pressure[line / POINTS][index[1]];
            }
            sum = loads[line][index[D - 1]].mul_add(V::splat(weight), sum);
        }
        put(D * node_count::<D>(2) + corner, sum);
    }
}

impl<V: Lanes> LineFields<V> {
    /// The forms at the points of the line at these points of the directions before, which take the place of
    /// what it held.
    #[inline(always)]
    fn take_forms<const D: usize>(
        &mut self,
        shapes: &Shapes<V::Scalar>,
        pieces: &Pieces<'_, V>,
        line: [usize; 2],
        twist: &[V; 2 * MOST],
        load: &mut [V; 2 * MOST],
    ) {
        let mut sums = [[[zero::<V>(); NODES]; MOST]; MOST];
        let mut pressure_sum = [zero::<V>(); 2];
        let first = (line[0] * POINTS.pow(D as u32 - 2) + line[1]) * POINTS;
        for q in 0..POINTS {
            let [shape, slope] = [0, 1].map(|kind| &shapes.velocity[kind][q]);
            let mut point =
                PointValues::<V> { value: [zero(); MOST], gradient: [[zero(); MOST]; MOST], p: zero() };
            for c in 0..D {
                let field = &self.velocity[c];
                point.value[c] = dot(shape, &field[0]);
                for d in 0..D - 1 {
                    point.gradient[c][d] = dot(shape, &field[1 + d]);
                }
                point.gradient[c][D - 1] = dot(slope, &field[0]);
                // In space.
                let along = point.gradient[c][0].mul(pieces.shear);
                point.gradient[c][1] = point.gradient[c][1].sub(along);
            }
            point.p = dot(&shapes.pressure[q], &self.pressure).mul(pieces.pressure);
            let arm = pieces.arm::<D>(shapes, line, q);
            let moments = pieces.at::<D>(first + q);
            let mut tested = point.tested::<D>(&moments, &arm, twist);
            for gradient in &mut tested.gradient[..D] {
                gradient[0] = gradient[0].sub(gradient[1].mul(pieces.shear));
            }
            for c in 0..D {
                for l in 0..NODES {
                    let [shape, slope] = [shape[l], slope[l]].map(V::splat);
                    let own = tested.value[c].mul_add(shape, sums[c][0][l]);
                    sums[c][0][l] = tested.gradient[c][D - 1].mul_add(slope, own);
                    for d in 0..D - 1 {
                        sums[c][1 + d][l] = tested.gradient[c][d].mul_add(shape, sums[c][1 + d][l]);
                    }
                }
            }
            let divergence = tested.p.mul(pieces.pressure);
            for l in 0..2 {
                pressure_sum[l] = divergence.mul_add(V::splat(shapes.pressure[q][l]), pressure_sum[l]);
            }
            add_twist_load::<V, D>(&tested.value, &arm, load);
        }
        self.velocity = sums;
        self.pressure = pressure_sum;
    }
}

impl<V: Lanes> Pieces<'_, V> {
    /// Arm of a point from the centre of the ball, in its radii.
    #[inline(always)]
    fn arm<const D: usize>(&self, shapes: &Shapes<V::Scalar>, line: [usize; 2], last: usize) -> [V; MOST] {
        let index = [line[0], line[1], last];
        let mut arm = [zero(); MOST];
        for d in 0..D {
            let at = if d == D - 1 { last } else { index[d] };
            arm[d] = self.edge.mul_add(V::splat(shapes.points[at]), self.origin[d]);
        }
        let second = if D == 2 { last } else { index[1] };
        let leaning = self.edge.mul(V::splat(shapes.points[second]));
        arm[0] = leaning.mul_add(self.shear, arm[0]);
        arm
    }

    /// Volume, normal and penalty at a point, by its place in the moments.
    #[inline(always)]
    fn at<const D: usize>(&self, point: usize) -> [V; MOST + 2] {
        let count = numbers::<D>();
        std::array::from_fn(|k| match k < count {
            true => V::load(&self.moments[(point * count + k) * self.step..]),
            false => zero(),
        })
    }
}

/// Values at a point, or what tests values and gradients there.
struct PointValues<V> {
    value: [V; MOST],
    /// `gradient[c][d] = d u_c / d x_d`.
    gradient: [[V; MOST]; MOST],
    p: V,
}

impl<V: Lanes> PointValues<V> {
    /// What the values, gradients and pressures of test functions are multiplied by.
    #[inline(always)]
    fn tested<const D: usize>(
        &self,
        moments: &[V; MOST + 2],
        arm: &[V; MOST],
        twist: &[V; 2 * MOST],
    ) -> Self {
        let (volume, penalty) = (moments[0], moments[D + 1]);
        let normal = |d: usize| moments[1 + d];
        let motion = rigid_motion::<V, D>(twist, arm);
        let mut tested = Self { value: [zero(); MOST], gradient: [[zero(); MOST]; MOST], p: zero() };
        let mut jump = [zero::<V>(); MOST];
        for c in 0..D {
            jump[c] = self.value[c].sub(motion[c]);
        }
        let pressure = volume.mul(self.p);
        for c in 0..D {
            let mut value = penalty.mul_add(jump[c], normal(c).mul(self.p));
            for d in 0..D {
                // Twice the strain.
                let strain = self.gradient[c][d].add(self.gradient[d][c]);
                value = value.sub(strain.mul(normal(d)));
                let flux = jump[d].mul_add(normal(c), jump[c].mul(normal(d)));
                tested.gradient[c][d] = strain.mul(volume).sub(flux);
            }
            tested.value[c] = value;
            tested.gradient[c][c] = tested.gradient[c][c].sub(pressure);
            tested.p = jump[c].mul_add(normal(c), tested.p.sub(volume.mul(self.gradient[c][c])));
        }
        tested
    }
}

/// `U + w x r`.
#[inline(always)]
fn rigid_motion<V: Lanes, const D: usize>(twist: &[V; 2 * MOST], arm: &[V; MOST]) -> [V; MOST] {
    if D == 2 {
        let w = twist[2];
        return [twist[0].sub(w.mul(arm[1])), w.mul_add(arm[0], twist[1]), zero()];
    }
    std::array::from_fn(|c| {
        let (i, j) = ((c + 1) % 3, (c + 2) % 3);
        twist[3 + i].mul_add(arm[j], twist[c]).sub(twist[3 + j].mul(arm[i]))
    })
}

/// Takes force and torque of a load on the fluid from the load on the ball.
#[inline(always)]
fn add_twist_load<V: Lanes, const D: usize>(force: &[V; MOST], arm: &[V; MOST], load: &mut [V; 2 * MOST]) {
    for c in 0..D {
        load[c] = load[c].sub(force[c]);
    }
    if D == 2 {
        load[2] = arm[1].mul_add(force[0], load[2]).sub(arm[0].mul(force[1]));
        return;
    }
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        load[3 + k] = arm[j].mul_add(force[i], load[3 + k]).sub(arm[i].mul(force[j]));
    }
}

#[inline(always)]
fn dot<V: Lanes, const N: usize>(weights: &[V::Scalar; N], values: &[V; N]) -> V {
    let mut sum = values[0].mul(V::splat(weights[0]));
    for k in 1..N {
        sum = values[k].mul_add(V::splat(weights[k]), sum);
    }
    sum
}
