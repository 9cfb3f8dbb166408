//! The operator of cut cells on reduced vectors: fluid, surfaces and the motions of bodies.

use gluey_fem::Constraint;
use gluey_fem::cells::{CellScalar, CutOperator, CutPiece};
use gluey_fem::cut::{POINTS, ViscousMatrices};
use gluey_fem::element::{gauss_cube, node_count, value};
use gluey_geom::{Dim, Twist, Vector};
use gluey_levelset::{Ball, Body};
use gluey_linalg::{AffineConstraints, Jagged, Scalar, Subset};
use rayon::prelude::*;

use super::aggregates::Aggregates;
use super::cut_cells::{CutCell, CutCells, in_space};
use super::penalty::{PenaltyFactor, penalties};
use crate::error::StokesError;
use crate::space::{Discretisation, VelocitySpace};
use crate::term::Scratch;

/// Nodes that a thread takes at a time.
const NODES: usize = 1024;
/// Pressure nodes of a cell, at most.
const MOST_CORNERS: usize = 8;
/// Unknowns of a twist, at most.
const MOST_RIGID: usize = 6;
/// One and the coordinates, at most.
const MOST_COORDINATES: usize = 4;

/// `[A, -B^T; -B, 0]` of the cut cells.
#[derive(Clone, Debug)]
pub struct SurfaceCoupling<const D: usize> {
    /// The cut cells.
    pub cut: CutCells<D>,
    discretisation: Discretisation<D>,
    pub(super) viscosity: f64,
    roots: Vec<u32>,
    /// A body that cuts each root or a bad cell that it carries.
    bodies_at_roots: Vec<u32>,
    /// `beta h / eta` of each cut cell.
    penalties: Vec<f64>,
    /// Cut cell and body of each piece.
    pub(super) pieces: Vec<(u32, u32)>,
    /// The velocity nodes of own cut cells in the nodes of the mesh: themselves, or what they take their
    /// values from.
    velocity: AffineConstraints,
    /// The rows of `velocity` in which each node of the mesh is, with weights.
    rows: Jagged<(u32, f64)>,
    /// Nodes among these with given values.
    boundary: Vec<u32>,
    /// The velocity nodes and the pressure nodes of own cut cells.
    nodes: Subset,
    pressures: Subset,
    /// The Gauss points of a cell, and the pressure functions there.
    points: Vec<[f64; D]>,
    corner_values: Vec<[f64; MOST_CORNERS]>,
    pub(super) wide: CutOperator<f64, D>,
    pub(super) narrow: CutOperator<f32, D>,
}

impl<const D: usize> SurfaceCoupling<D> {
    /// The operator around `bodies` in a fluid of this viscosity, with this multiple of the largest ratios as
    /// penalty.
    ///
    /// # Errors
    /// [`StokesError::NoPenalty`], see there.
    pub fn new(
        space: &VelocitySpace<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
        cut: CutCells<D>,
        penalty: &PenaltyFactor,
        aggregates: &Aggregates,
    ) -> Result<Self, StokesError> {
        let discretisation = space.discretisation();
        let (velocity, pressure) = (&discretisation.velocity, &discretisation.pressure);
        let touched = |nodes: &gluey_fem::NodeMap<D>| {
            let mut touched = vec![false; nodes.node_count()];
            let own = cut.cells.iter().filter(|cell| discretisation.is_own(cell.cell as usize));
            let all = own.flat_map(|cell| nodes.cell(cell.cell as usize));
            all.for_each(|&node| touched[node as usize] = true);
            Subset::new(touched.len(), |node| touched[node])
        };
        let (nodes, pressures) = (touched(velocity), touched(pressure));
        let of_cut = forms(&nodes, &aggregates.velocity);
        let rows = rows_of_nodes(&of_cut, nodes.whole());
        let is_given =
            |node: &u32| !rows[*node as usize].is_empty() && velocity.is_on_boundary(*node as usize);
        let boundary: Vec<u32> = (0..nodes.whole() as u32).filter(is_given).collect();
        let pieces: Vec<(u32, u32)> = cut.pieces().items().to_vec();
        let penalties = penalties(discretisation, &cut, aggregates, penalty)?;
        let data = PieceData::new(discretisation, bodies, viscosity, &cut, &penalties, &nodes, &pressures);
        let counts = [nodes.len(), pressures.len(), bodies.len()];
        let shear = discretisation.mesh.shear();
        let is_own = |piece: &&(u32, u32)| discretisation.is_own(cut.cells[piece.0 as usize].cell as usize);
        let own: Vec<&(u32, u32)> = pieces.iter().filter(is_own).collect();
        let of_pieces = || own.iter().map(|&&(place, surface)| data.piece(place, surface));
        let (wide, narrow) = rayon::join(
            || CutOperator::new(of_pieces(), counts).sheared(shear),
            || CutOperator::new(of_pieces(), counts).sheared(shear),
        );
        drop((data, own));
        let (roots, bodies_at_roots) = roots_and_bodies(&cut, aggregates);
        let corners = node_count::<D>(1);
        let corner = |q: usize, x: &[f64; D]| if q < corners { value::<D>(1, q, x) } else { 0.0 };
        let rule = gauss_cube::<D>(POINTS);
        let corner_values = rule.iter().map(|(x, _)| std::array::from_fn(|q| corner(q, x))).collect();
        Ok(Self {
            discretisation: discretisation.clone(),
            viscosity,
            points: rule.into_iter().map(|point| point.0).collect(),
            corner_values,
            roots,
            bodies_at_roots,
            penalties,
            wide,
            narrow,
            pieces,
            velocity: of_cut,
            rows,
            boundary,
            nodes,
            pressures,
            cut,
        })
    }

    /// The mesh with its nodes.
    pub fn discretisation(&self) -> &Discretisation<D> {
        &self.discretisation
    }

    /// The cells whose nodes are unknowns and that are cut or carry bad cells, ascending; indices in the
    /// mesh.
    pub fn roots(&self) -> &[u32] {
        &self.roots
    }

    /// A body that cuts a root or a bad cell that it carries, by the place of the root among these.
    pub fn body_at_root(&self, place: usize) -> usize {
        self.bodies_at_roots[place] as usize
    }

    /// `beta h / eta` of a cut cell, by its place among these.
    pub fn penalty(&self, place: usize) -> f64 {
        self.penalties[place]
    }

    /// The matrix of a cut cell for velocities alone, by its place among these.
    pub fn viscous_matrix(&self, place: usize, with: &mut ViscousMatrices<D>, matrix: &mut [f64]) {
        let cell = &self.cut.cells[place];
        with.fill(&cell.moments, self.penalties[place], self.stress(cell), matrix);
    }

    /// Adds the part of the matrix of a piece for the twist of its body, row by row.
    pub fn add_twist_block(&self, piece: usize, block: &mut [f64]) {
        let (place, number) = self.pieces[piece];
        let (rigid, shear) = (Dim::<D>::RIGID, self.discretisation.mesh.shear());
        let cell = &self.cut.cells[place as usize];
        let ball = &cell.balls[number as usize];
        let factor = self.stress(cell) * self.penalties[place as usize];
        // Integrals of products of 1 and the components of the arm, on which motions depend linearly.
        let mut products = [[0.0; MOST_COORDINATES]; MOST_COORDINATES];
        for (at, area) in self.points.iter().zip(&cell.moments.surfaces[number as usize].area) {
            let from_center: [f64; D] = std::array::from_fn(|d| at[d] - ball.center[d]);
            let arm = in_space(shear, &from_center) / ball.radius;
            let line: [f64; MOST_COORDINATES] =
                std::array::from_fn(|i| if i == 0 { 1.0 } else { arm.get(i - 1).copied().unwrap_or(0.0) });
            for (row, first) in products.iter_mut().zip(&line) {
                let weighted = factor * area * first;
                row.iter_mut().zip(&line).for_each(|(sum, second)| *sum += weighted * second);
            }
        }
        let coefficient = |k: usize, i: usize| {
            let at_center = unit_motion(k, &Vector::<D>::zeros());
            let axis = Vector::<D>::from_fn(|d, _| f64::from(u8::from(d + 1 == i)));
            if i == 0 { at_center } else { unit_motion(k, &axis) - at_center }
        };
        let mut motions = [[Vector::<D>::zeros(); MOST_COORDINATES]; MOST_RIGID];
        for (k, motion) in motions[..rigid].iter_mut().enumerate() {
            (0..=D).for_each(|i| motion[i] = coefficient(k, i));
        }
        for (row, first) in block.chunks_exact_mut(rigid).zip(&motions) {
            for (i, first) in first.iter().enumerate() {
                for (sum, second) in row.iter_mut().zip(&motions) {
                    let terms =
                        products[i].iter().zip(second).map(|(weight, second)| weight * first.dot(second));
                    *sum += terms.sum::<f64>();
                }
            }
        }
    }

    /// What the forms on a cut cell are multiplied by, `eta h^(D-2)`.
    fn stress(&self, cell: &CutCell<D>) -> f64 {
        self.viscosity * self.discretisation.cell_size(cell.cell as usize).powi(D as i32 - 2)
    }

    /// Calls `visit(q, r, int p_q p_r)` for the pressures of a cut cell, the integral over its fluid.
    pub fn for_each_mass(&self, place: usize, mut visit: impl FnMut(usize, usize, f64)) {
        let cell = &self.cut.cells[place];
        let volume = self.discretisation.cell_size(cell.cell as usize).powi(D as i32);
        let corners = node_count::<D>(1);
        let mut mass = [[0.0; MOST_CORNERS]; MOST_CORNERS];
        for (shapes, weight) in self.corner_values.iter().zip(&cell.moments.volume) {
            for (row, shape) in mass.iter_mut().zip(shapes) {
                let factor = volume * weight * shape;
                row.iter_mut().zip(shapes).for_each(|(sum, shape)| *sum += factor * shape);
            }
        }
        for q in 0..corners {
            (0..corners).for_each(|r| visit(q, r, mass[q][r]));
        }
    }

    /// `(y, q) += (A x - B^T p, -B x)` by one of the operators, for the pressures at all nodes; without
    /// pressures where `q` is empty. Loads on nodes with given values are cleared.
    pub(super) fn add_by<T: CellScalar, X: Scalar>(
        &self,
        operator: &CutOperator<T, D>,
        [x, p]: [&[X]; 2],
        [y, q]: [&mut [X]; 2],
        scratch: &mut Scratch<T>,
    ) {
        let [velocity, pressure, velocity_load, pressure_load, pieces] = &mut scratch.0;
        let nodal = self.velocity.unknown_count() * D;
        let convert = |value: &X| T::from_f64(value.to_f64());
        let back = |value: T| X::from_f64(value.to_f64());
        velocity.resize(self.nodes.len() * D + y.len() - nodal, T::ZERO);
        let (at_nodes, of_twists) = velocity.split_at_mut(self.nodes.len() * D);
        self.gather(x, at_nodes);
        match x.get(nodal..) {
            Some(twists) => of_twists.iter_mut().zip(twists).for_each(|(to, twist)| *to = convert(twist)),
            None => of_twists.fill(T::ZERO),
        }
        pressure.clear();
        if !p.is_empty() {
            pressure.extend(self.pressures.positions().iter().map(|&node| convert(&p[node as usize])));
        }
        velocity_load.clear();
        velocity_load.resize(velocity.len(), T::ZERO);
        pressure_load.clear();
        pressure_load.resize(if q.is_empty() { 0 } else { self.pressures.len() }, T::ZERO);
        operator.add([&*velocity, &*pressure], [&mut *velocity_load, &mut *pressure_load], pieces);
        let (at_nodes, of_twists) = y.split_at_mut(nodal);
        self.spread(velocity_load, at_nodes);
        let twist_load = &velocity_load[self.nodes.len() * D..];
        of_twists.iter_mut().zip(twist_load).for_each(|(to, &load)| *to += back(load));
        for &node in &self.boundary {
            at_nodes[node as usize * D..][..D].fill(X::ZERO);
        }
        for (&node, &load) in self.pressures.positions().iter().zip(pressure_load.iter()) {
            q[node as usize] += back(load);
        }
    }

    /// Velocities at the nodes of own cut cells from those at all nodes; zero where there are none.
    fn gather<T: Scalar, X: Scalar>(&self, x: &[X], velocity: &mut [T]) {
        velocity.par_chunks_mut(NODES * D).enumerate().for_each(|(k, velocity)| {
            for (row, velocity) in (k * NODES..).zip(velocity.as_chunks_mut::<D>().0) {
                *velocity = [T::ZERO; D];
                for &(node, weight) in self.velocity.terms(row).iter().filter(|_| !x.is_empty()) {
                    let from = &x[node as usize * D..][..D];
                    (0..D).for_each(|c| velocity[c] += T::from_f64(weight) * T::from_f64(from[c].to_f64()));
                }
            }
        });
    }

    /// The transpose of [`SurfaceCoupling::gather`], added to the loads on all nodes.
    fn spread<T: Scalar, X: Scalar>(&self, load: &[T], y: &mut [X]) {
        let load = load.as_chunks::<D>().0;
        y.par_chunks_mut(NODES * D).enumerate().for_each(|(k, y)| {
            for (node, y) in (k * NODES..).zip(y.as_chunks_mut::<D>().0) {
                for &(row, weight) in &self.rows[node] {
                    let load = &load[row as usize];
                    (0..D).for_each(|c| y[c] += X::from_f64((T::from_f64(weight) * load[c]).to_f64()));
                }
            }
        });
    }
}

/// The roots, ascending, and a body that cuts each or a bad cell that it carries.
fn roots_and_bodies<const D: usize>(cut: &CutCells<D>, aggregates: &Aggregates) -> (Vec<u32>, Vec<u32>) {
    let bodies = cut.cells.iter().map(|cell| cell.bodies[0]);
    let mut roots: Vec<(u32, u32)> = aggregates.roots.iter().copied().zip(bodies).collect();
    roots.sort_unstable();
    roots.dedup_by_key(|root| root.0);
    roots.into_iter().unzip()
}

/// The rows of `forms` in which each of so many nodes is, with weights.
fn rows_of_nodes(forms: &AffineConstraints, count: usize) -> Jagged<(u32, f64)> {
    let terms = (0..forms.row_count()).flat_map(|row| forms.terms(row).iter().map(move |term| (row, term)));
    Jagged::grouped(count, terms.map(|(row, &(node, weight))| (node as usize, (row as u32, weight))))
}

/// Some nodes in all nodes, of which ghosts take their values from others.
fn forms(nodes: &Subset, ghosts: &[Constraint]) -> AffineConstraints {
    let mut all = AffineConstraints::identity(nodes.whole());
    ghosts.iter().for_each(|ghost| all.set(ghost.node as usize, ghost.masters.iter().copied()));
    let mut forms = AffineConstraints::zeros(nodes.len(), nodes.whole());
    for (row, &node) in nodes.positions().iter().enumerate() {
        forms.set(row, all.terms(node as usize).iter().copied());
    }
    forms
}

/// The velocity at `arm` of a body of radius one that moves in unknown `k` of its twist.
fn unit_motion<const D: usize>(k: usize, arm: &Vector<D>) -> Vector<D> {
    let mut twist = Twist::<D>::default();
    match k.checked_sub(D) {
        Some(k) => twist.spin[k] = 1.0,
        None => twist.velocity[k] = 1.0,
    }
    twist.velocity_at(arm)
}

/// Data that pieces are made of.
struct PieceData<'a, const D: usize> {
    discretisation: &'a Discretisation<D>,
    bodies: &'a [Ball<D>],
    viscosity: f64,
    cut: &'a CutCells<D>,
    /// Integrals of the penalty over each surface of each cut cell.
    penalties: Vec<Vec<Vec<f64>>>,
    /// Numbered nodes of each cut cell.
    nodes: Vec<Vec<u32>>,
    pressures: Vec<Vec<u32>>,
}

impl<'a, const D: usize> PieceData<'a, D> {
    fn new(
        discretisation: &'a Discretisation<D>,
        bodies: &'a [Ball<D>],
        viscosity: f64,
        cut: &'a CutCells<D>,
        beta: &[f64],
        nodes: &Subset,
        pressures: &Subset,
    ) -> Self {
        let of_cell = |(cell, beta): (&CutCell<D>, &f64)| {
            let surfaces = cell.moments.surfaces.iter();
            surfaces.map(|surface| surface.area.iter().map(|area| beta * area).collect()).collect()
        };
        let number = |numbers: &Subset, nodes: &[u32]| {
            nodes.iter().filter_map(|&n| numbers.number(n as usize)).map(|n| n as u32).collect()
        };
        let cells = || cut.cells.iter().map(|cell| cell.cell as usize);
        Self {
            penalties: cut.cells.iter().zip(beta).map(of_cell).collect(),
            nodes: cells().map(|c| number(nodes, discretisation.velocity.cell(c))).collect(),
            pressures: cells().map(|c| number(pressures, discretisation.pressure.cell(c))).collect(),
            discretisation,
            bodies,
            viscosity,
            cut,
        }
    }

    fn piece(&self, place: u32, surface: u32) -> CutPiece<'_, D> {
        let (place, surface) = (place as usize, surface as usize);
        let cell = &self.cut.cells[place];
        let h = self.discretisation.cell_size(cell.cell as usize);
        let shear = self.discretisation.mesh.shear();
        let (body, ball) = (cell.bodies[surface], &cell.balls[surface]);
        CutPiece {
            nodes: &self.nodes[place],
            pressures: &self.pressures[place],
            body,
            origin: (-in_space(shear, &ball.center) / ball.radius).into(),
            edge: h / self.bodies[body as usize].bounding_radius(),
            viscous: self.viscosity * h.powi(D as i32 - 2),
            pressure: h / self.viscosity,
            volume: if surface == 0 { &cell.moments.volume } else { &[] },
            normal: &cell.moments.surfaces[surface].normal,
            penalty: &self.penalties[place][surface],
        }
    }
}
