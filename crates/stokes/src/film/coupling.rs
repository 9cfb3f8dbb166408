//! Forces of films on the bodies, implicit in their velocities.
//!
//! The relative motion of the two sides of a film is `B V` for the twists `V`: the velocity `v.n` along the
//! normal, the slip `v_t`, with `v = (U_1 + w_1 x r_1) - (U_2 + w_2 x r_2)` in the middle of the film, the
//! spin `w = ((w_1 - w_2) x n)_t` and rolling, `m = w + (1/b - 1/a) v_t / 2`, which is how fast the surfaces
//! carry fluid into the film. All are zero where the two move as one body. With a resistance `R` for each the
//! forces are `-B^T R B V`: symmetric, opposite to each other, and dissipating. For two spheres of any radii
//! they have the singular terms of Jeffrey and Onishi (1984, 10.1017/S0022112084000355).
//!
//! What flows through a film between bodies, `Q` per width relative to the mean of their surfaces, is a mode
//! too ([`FilmFlow`]): the mesh lets fluid through the widened film as if it were as thick as that. This
//! resistance acts on the fluid in the film, and on the bodies with the opposite force, half of it each.
//!
//! The forces `f = R B V` are unknowns beside velocities and pressures, so that nothing grows where a film
//! closes: `s B V - g = 0` with `f = s g`, `s^2 = R`. The square of `g` is the power that the film
//! dissipates, and residuals of these rows weigh velocities by what they do there: in a film that nearly
//! closes they are small. With about the resistance `R_0` that the mesh has, the Schur complement is
//! `1 + R / R_0`.

use gluey_fem::Evaluator;
use gluey_geom::{Dim, Matrix, Vector, Wrench};
use gluey_linalg::{Jagged, Scalar, vector};
use nalgebra::Matrix2;
use rayon::prelude::*;

use super::deficit::Deficits;
use super::flux::FilmFlow;
use super::near::{Film, Heights, Partner};
use super::network::FilmRow;
use crate::space::VelocitySpace;
use crate::term::{Load, Product, Scratch, Term};

/// Least cosine between the normals of one film in two steps.
const SAME_FILM: f64 = 0.7;
/// Rows that a thread takes at a time, at least.
const ROWS: usize = 64;

/// Rows of the films' forces `g` in the Stokes system, `s B V - g`.
#[derive(Clone, Debug)]
pub struct FilmCoupling<const D: usize> {
    /// Films with a resistance, each with the number of its first row.
    films: Vec<Film<D>>,
    /// What flows through each in the directions across it, where the mesh has it.
    flows: Vec<Vec<FilmFlow<D>>>,
    /// Their modes.
    modes: Vec<Vec<Mode<D>>>,
    /// `s B`: entries of reduced velocities.
    rows: Jagged<(u32, f64)>,
    /// `R_0 / (R + R_0)`, the inverse of the Schur complement.
    inverses: Vec<f64>,
    /// `s`.
    scales: Vec<f64>,
}

/// Forces of a film on its two sides beyond what the mesh resolves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmForce<const D: usize> {
    /// The film.
    pub film: Film<D>,
    /// Forces and torques on the body and on its partner; none on a wall.
    pub wrenches: [Wrench<D>; 2],
}

impl<const D: usize> FilmForce<D> {
    /// The same with other numbers of bodies.
    #[must_use]
    pub(crate) fn renumbered(self, number: impl Fn(u32) -> u32) -> Self {
        Self { film: self.film.renumbered(number), ..self }
    }

    /// The first moment of the forces on a side, `F r` with `r` from its centre to the middle of the film:
    /// its symmetric part without trace is a share of the stresslet.
    pub fn moment(&self, side: usize) -> Matrix<D> {
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let arm = self.film.normal * (sign * self.film.arm(side));
        self.wrenches[side].force * arm.transpose()
    }
}

impl<const D: usize> FilmCoupling<D> {
    /// Modes of a film: the normal one; sliding, rolling and the flow through it in each direction across it.
    pub const MODES: usize = 1 + 3 * (D - 1);
    /// Numbers that are kept of a film.
    pub const KEPT: usize = 2 + 4 * D;

    /// The forces of `films` that are widened to these heights, each with what flows through it in
    /// the directions across it where that counts, on the velocities of `space` in a fluid of this viscosity.
    pub fn new(
        space: &VelocitySpace<D>,
        films: Vec<Film<D>>,
        flows: Vec<Vec<FilmFlow<D>>>,
        heights: &Heights,
        viscosity: f64,
    ) -> Self {
        let (mut rows, mut inverses, mut scales) = (Jagged::default(), Vec::new(), Vec::new());
        let mut kinds = Vec::with_capacity(films.len());
        for (film, flow) in films.iter().zip(&flows) {
            let shape = film.shape(film.height(heights));
            let lacks = if flow.is_empty() { shape.deficits::<D>() } else { shape.deficits_with_flow::<D>() };
            let modes = modes::<D>(film, flow, &shape.resolved::<D>(), &lacks);
            let mut flow = flow.iter();
            for mode in &modes {
                let scale = (viscosity * mode.lacks).sqrt();
                let through = if mode.is_flow { flow.next() } else { None };
                let mut row = mode.row(space.full_dim(), film, through);
                for (node, weight) in through.iter().flat_map(|flow| &flow.nodes) {
                    space.push_load(*node as usize, weight, &mut row);
                }
                rows.push(row.into_iter().map(|(k, weight)| (k, scale * weight)));
                inverses.push(mode.has / (mode.has + mode.lacks));
                scales.push(scale);
            }
            kinds.push(modes);
        }
        Self { films, flows, modes: kinds, rows, inverses, scales }
    }

    /// What the films exert on the bodies, for the scaled forces `g`.
    pub fn forces(&self, space: &VelocitySpace<D>, g: &[f64]) -> Vec<FilmForce<D>> {
        let of_film = |(index, film): (usize, &Film<D>)| {
            let first = index * Self::MODES;
            let wrench = |side: usize| {
                let body = film.side(side)?;
                let mut load = vec![0.0; Dim::<D>::RIGID];
                for row in first..first + Self::MODES {
                    // Of a body and its own image, one side comes first in the row.
                    let entries = self.rows[row].chunks_exact(Dim::<D>::RIGID).nth(side)?;
                    load.iter_mut().zip(entries).for_each(|(load, entry)| *load -= entry.1 * g[row]);
                }
                Some(space.wrench_of(&load, body))
            };
            FilmForce {
                film: *film,
                wrenches: [wrench(0).unwrap_or_default(), wrench(1).unwrap_or_default()],
            }
        };
        self.films.iter().enumerate().map(of_film).collect()
    }

    /// What is kept of the scaled forces `g` for the films of another step, [`FilmCoupling::KEPT`] numbers
    /// for each: body, partner, normal, the sums of `f slip t` and of `f turning t` over the modes of motion,
    /// and that of `f t` over those of the flow through it. Unlike velocities, forces change little where a
    /// film closes.
    pub fn kept(&self, g: &[f64]) -> Vec<f64> {
        let mut kept = Vec::with_capacity(self.films.len() * Self::KEPT);
        for (index, film) in self.films.iter().enumerate() {
            let first = index * Self::MODES;
            let [mut force, mut couple, mut through] = [Vector::<D>::zeros(); 3];
            for (k, mode) in self.modes[index].iter().enumerate() {
                let f = self.scales[first + k] * g[first + k];
                if mode.is_flow {
                    through += mode.direction * f;
                } else {
                    force += mode.direction * (f * mode.slip);
                    couple += mode.direction * (f * mode.turning);
                }
            }
            kept.extend(key(film));
            kept.extend([&film.normal, &force, &couple, &through].into_iter().flatten());
        }
        kept
    }

    /// Writes the scaled forces of the films that were there before, with nearly the same normal, for what
    /// [`FilmCoupling::kept`] gave for them then.
    pub fn restore(&self, kept: &[f64], g: &mut [f64]) {
        let mut before: Vec<&[f64]> = kept.chunks_exact(Self::KEPT).collect();
        let order = |a: &[f64], b: &[f64]| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]));
        before.sort_by(|a, b| order(a, b));
        let vector = |old: &[f64], k: usize| Vector::<D>::from_column_slice(&old[2 + k * D..][..D]);
        for (film, (modes, at)) in self.films.iter().zip(self.modes.iter().zip((0..).step_by(Self::MODES))) {
            let key = key(film);
            let first = before.partition_point(|old| order(old, &key).is_lt());
            let mut alike = before[first..].iter().take_while(|old| order(old, &key).is_eq());
            let Some(old) = alike.find(|old| vector(old, 0).dot(&film.normal) > SAME_FILM) else { continue };
            let [force, couple, through] = [1, 2, 3].map(|k| vector(old, k));
            let mut set = |k: usize, f: f64| {
                let scale = self.scales[at + k];
                g[at + k] = if scale > 0.0 { f / scale } else { 0.0 };
            };
            set(0, force.dot(&film.normal));
            for k in (1..Self::MODES).step_by(3) {
                let [a, b] = [&modes[k], &modes[k + 1]];
                let (slip, turning) = (force.dot(&a.direction), couple.dot(&a.direction));
                let determinant = a.slip * b.turning - b.slip * a.turning;
                set(k, (slip * b.turning - b.slip * turning) / determinant);
                set(k + 1, (a.slip * turning - slip * a.turning) / determinant);
                set(k + 2, through.dot(&a.direction));
            }
        }
    }

    /// The forces `g` that belong to the motions of the bodies in reduced velocities, for the films' part of
    /// a right-hand side.
    pub fn of_motions(&self, x: &[f64], b: &[f64]) -> Vec<f64> {
        let motion = |row: &[(u32, f64)]| row.iter().map(|&(k, weight)| weight * x[k as usize]).sum::<f64>();
        self.rows.iter().zip(b).map(|(row, b)| motion(row) - b).collect()
    }

    /// Number of rows.
    pub fn dim(&self) -> usize {
        self.scales.len()
    }

    /// The rows of relative motions of surfaces, on the twists, the first of which is entry `first` of
    /// reduced velocities.
    pub fn rows_of_motion(&self, first: usize) -> Vec<FilmRow> {
        let rigid = Dim::<D>::RIGID;
        let is_of_motion = |&row: &usize| {
            !self.modes[row / Self::MODES][row % Self::MODES].is_flow && self.scales[row] > 0.0
        };
        let of_twists = |row: usize| {
            let entries: Vec<_> = self.rows[row].iter().map(|&(k, w)| (k - first as u32, w)).collect();
            FilmRow::new(row, rigid, &entries)
        };
        (0..self.dim()).filter(is_of_motion).map(of_twists).collect()
    }

    /// `y += s B^T g`.
    fn add_loads<S: Scalar, T: Scalar>(&self, g: &[S], y: &mut [T]) {
        for (row, g) in self.rows.iter().zip(g) {
            for &(k, weight) in row {
                y[k as usize] += T::from_f64(weight * g.to_f64());
            }
        }
    }

    fn for_each_flow(&self, mut visit: impl FnMut(usize, &Film<D>, &FilmFlow<D>)) {
        for (index, (film, flows)) in self.films.iter().zip(&self.flows).enumerate() {
            let modes = self.modes[index].iter().enumerate().filter(|(_, mode)| mode.is_flow);
            modes.zip(flows).for_each(|((k, _), flow)| visit(index * Self::MODES + k, film, flow));
        }
    }

    /// `z -= s B V` for what the velocities of the partners are beside those of bodies: those of walls, or of
    /// the image of a body in a flow that is not periodic. `at` gives them by the film.
    fn subtract_partners(&self, at: impl Fn(&Film<D>) -> Option<Vector<D>>, z: &mut [f64]) {
        let known = self.films.iter().enumerate().filter_map(|(index, film)| Some((index, film, at(film)?)));
        for (index, film, velocity) in known {
            for (k, mode) in self.modes[index].iter().enumerate() {
                let row = index * Self::MODES + k;
                let motion = velocity.dot(&(mode.direction * mode.slip + film.normal * mode.approach));
                z[row] -= self.scales[row] * motion;
            }
        }
    }
}

impl<X: Scalar, T, const D: usize> Product<X, T> for FilmCoupling<D> {
    /// `(y, z) += (s B^T g, s B x - g)`.
    fn add(&self, [x, _, g]: [&[X]; 3], [y, _, z]: [&mut [X]; 3], _: &mut Scratch<T>) {
        let measure = |(row, (z, g)): (usize, (&mut X, &X))| {
            let terms = self.rows[row].iter();
            let motion: f64 = terms.map(|&(k, weight)| weight * x[k as usize].to_f64()).sum();
            *z += X::from_f64(motion - g.to_f64());
        };
        let rows = z.par_iter_mut().zip(g).enumerate().with_min_len(ROWS);
        rayon::join(|| self.add_loads(g, y), || rows.for_each(measure));
    }
}

impl<const D: usize> Term<D> for FilmCoupling<D> {
    fn row_count(&self) -> usize {
        self.dim()
    }

    fn row(&self, row: usize) -> &[(u32, f64)] {
        &self.rows[row]
    }

    fn row_inverses(&self) -> &[f64] {
        &self.inverses
    }

    /// `z += s B V` for the velocities of walls, and of boundary nodes in a film.
    fn add_data(&self, space: &VelocitySpace<D>, u: &[f64], z: &mut [f64]) {
        let evaluator = Evaluator::new(&space.discretisation().mesh);
        let of_wall = |film: &Film<D>| evaluator.motion_at(space.nodes(), u, &film.far_point()).velocity;
        self.subtract_partners(|film| film.partner.is_wall().then(|| of_wall(film)), z);
        self.for_each_flow(|row, _, flow| {
            let at = |node: u32| Vector::<D>::from_column_slice(&u[node as usize * D..][..D]);
            let sum: f64 = flow.boundary.iter().map(|(node, weight)| weight.dot(&at(*node))).sum();
            z[row] += self.scales[row] * sum;
        });
    }

    /// `z -= s B V` for the strain at bodies and in the films between them.
    fn add_strain(&self, strain: &Matrix<D>, _: &mut Load<D>, z: &mut [f64]) {
        let mut motions = vec![0.0; z.len()];
        let of_image = |film: &Film<D>| (!film.partner.is_wall()).then(|| strain * film.branch());
        self.subtract_partners(of_image, &mut motions);
        self.for_each_flow(|row, film, flow| {
            // From the mean place of the two centres to the middle of the film.
            let arm = film.normal * (0.5 * (film.arm(0) - film.arm(1)));
            let places = flow.first + flow.total * arm.transpose();
            motions[row] += self.scales[row] * strain.component_mul(&places).sum();
        });
        vector::axpy(-1.0, &motions, z);
    }
}

/// The two sides of a film as numbers: bodies, negative for walls.
fn key<const D: usize>(film: &Film<D>) -> [f64; 2] {
    let partner = match film.partner {
        Partner::Body(body) => f64::from(body),
        Partner::Wall { axis, is_upper } => -1.0 - f64::from(2 * axis + u32::from(is_upper)),
    };
    [f64::from(film.body), partner]
}

/// The rows of the motions that a film between two bodies resists, as of one that nothing else resolves up to
/// the thickness `height`, in the motions of all bodies: numbered from `first` on.
pub fn rows_of_film<const D: usize>(
    film: &Film<D>,
    height: f64,
    viscosity: f64,
    first: usize,
) -> Vec<FilmRow> {
    let lacks = film.shape(height).deficits::<D>();
    let modes = modes::<D>(film, &[], &lacks, &lacks);
    let resisting = modes.iter().filter(|mode| mode.lacks > 0.0);
    let scaled = |(k, mode): (usize, &Mode<D>)| {
        let scale = (viscosity * mode.lacks).sqrt();
        let entries: Vec<_> = mode.row(0, film, None).into_iter().map(|(k, w)| (k, scale * w)).collect();
        FilmRow::new(first + k, Dim::<D>::RIGID, &entries)
    };
    resisting.enumerate().map(scaled).collect()
}

/// The row of the velocity of the body beyond that of its partner in the middle of a film, in this direction.
pub fn row_of_velocity<const D: usize>(film: &Film<D>, direction: Vector<D>) -> FilmRow {
    let mode =
        Mode { direction, slip: 1.0, approach: 0.0, turning: 0.0, is_flow: false, has: 0.0, lacks: 0.0 };
    FilmRow::new(0, Dim::<D>::RIGID, &mode.row(0, film, None))
}

/// A mode of the relative motion of the two sides of a film: `slip v.t + approach v.n + turning
/// ((w_1 - w_2) x n).t` in a direction `t`, and the flow through the film if it is one of that.
#[derive(Clone, Copy, Debug)]
struct Mode<const D: usize> {
    direction: Vector<D>,
    slip: f64,
    approach: f64,
    turning: f64,
    is_flow: bool,
    /// About the resistance that the mesh has, and that which it lacks.
    has: f64,
    lacks: f64,
}

/// The modes of a film: in each direction across it the two of slip and rolling in which the resistance is
/// diagonal, and the flow through it.
fn modes<const D: usize>(
    film: &Film<D>,
    flows: &[FilmFlow<D>],
    has: &Deficits,
    lacks: &Deficits,
) -> Vec<Mode<D>> {
    let plain = Mode {
        direction: film.normal,
        slip: 1.0,
        approach: 0.0,
        turning: 0.0,
        is_flow: false,
        has: has.normal,
        lacks: lacks.normal,
    };
    let roll = film.roll_of_slip();
    // In slip and in rolling times a length, which have a common unit: w = m - roll v.
    let length = film.curvature_radius();
    let [spin, cross, rolling] = lacks.rolling;
    let form = Matrix2::new(
        lacks.sliding + roll * roll * spin,
        -roll * (cross + spin) / length,
        -roll * (cross + spin) / length,
        (spin + 2.0 * cross + rolling) / (length * length),
    );
    let eigen = form.symmetric_eigen();
    let of_motion = [has.sliding, has.rolling[2] / (length * length)];
    let across = |direction: Vector<D>, k: usize| {
        let [slip, turning] = [0, 1].map(|i| eigen.eigenvectors[(i, k)]);
        Mode {
            direction,
            slip: slip + turning * length * roll,
            turning: turning * length,
            has: of_motion[0] * slip * slip + of_motion[1] * turning * turning,
            lacks: eigen.eigenvalues[k].max(0.0),
            ..plain
        }
    };
    let through = |direction: Vector<D>, flow: Option<&FilmFlow<D>>| Mode {
        direction,
        slip: lacks.carried * roll,
        approach: flow.map_or(0.0, |flow| flow.approach),
        turning: lacks.carried + flow.map_or(0.0, |flow| flow.turning),
        is_flow: true,
        has: has.through,
        lacks: lacks.through,
    };
    let tangents = film.tangents();
    let tangential = tangents.iter().enumerate();
    let tangential = tangential.flat_map(|(k, &t)| [across(t, 0), across(t, 1), through(t, flows.get(k))]);
    std::iter::once(plain).chain(tangential).collect()
}

impl<const D: usize> Mode<D> {
    /// Its row in the motions of the two sides, where those of all bodies begin at `first`.
    fn row(&self, first: usize, film: &Film<D>, flow: Option<&FilmFlow<D>>) -> Vec<(u32, f64)> {
        let (t, n) = (&self.direction, &film.normal);
        let mut row = Vec::with_capacity(2 * Dim::<D>::RIGID);
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            let Some(body) = film.side(side) else { continue };
            let first = first + body * Dim::<D>::RIGID;
            // From the centre to the middle of the film.
            let arm = n * (sign * film.arm(side));
            let turn = Dim::<D>::moment(&arm, t) * self.slip + Dim::<D>::moment(n, t) * self.turning;
            let (mut force, mut turn) = ((t * self.slip + n * self.approach) * sign, turn * sign);
            if let Some(flow) = flow {
                force -= flow.total * 0.5;
                turn += flow.of_spin(&arm) * -0.5;
            }
            let spins = Dim::<D>::spin_slice(&turn).iter().map(|w| w / film.radii[side]);
            let entries = force.iter().copied().chain(spins).enumerate();
            row.extend(entries.map(|(k, weight)| ((first + k) as u32, weight)));
        }
        row
    }
}

#[cfg(test)]
mod tests;
