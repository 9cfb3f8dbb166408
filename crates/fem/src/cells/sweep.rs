//! The sweep of a [`CellOperator`] over its chunks.

use gluey_linalg::Scalar;

use super::buffers::Buffers;
use super::kernel::Registers;
use super::output::{Input, Output, add_ghost_contributions};
use super::scalar::CellScalar;
use super::simd::{Lanes, Nodes, Portable};
use super::{CellOperator, GROUP, Span};

/// Workspace of a [`CellOperator`]: buffers for every thread while it runs, in the precision `T` that is
/// computed in, and contributions to ghosts, in that of the vectors.
#[derive(Clone, Debug)]
pub struct Workspace<T, X = T> {
    buffers: Vec<Buffers<T>>,
    velocity: Vec<X>,
    pressure: Vec<X>,
    twists: Vec<X>,
}

impl<T, X> Default for Workspace<T, X> {
    fn default() -> Self {
        Self { buffers: Vec::new(), velocity: Vec::new(), pressure: Vec::new(), twists: Vec::new() }
    }
}

impl<T: CellScalar, const D: usize> CellOperator<T, D> {
    /// `y = A x`.
    pub fn viscous(&self, x: &[T], y: &mut [T], work: &mut Workspace<T>) {
        self.apply::<true, false, _>(Input { x, p: &[], expand: true }, y, &mut [], work);
    }

    /// `y = A u` for a nodal velocity field that is already right on rigid and hanging nodes.
    pub fn viscous_of_field(&self, u: &[T], y: &mut [T], work: &mut Workspace<T>) {
        self.apply::<true, false, _>(Input { x: u, p: &[], expand: false }, y, &mut [], work);
    }

    /// `(y, q) = (A x - B^T p, -B x)`. The pressures and their loads are nodal. Vectors may have another
    /// precision than the one that is computed in.
    pub fn stokes<X: Scalar>(&self, x: &[X], p: &[X], y: &mut [X], q: &mut [X], work: &mut Workspace<T, X>) {
        self.apply::<true, true, _>(Input { x, p, expand: true }, y, q, work);
    }

    /// The same for a nodal velocity field that is already right on rigid and hanging nodes.
    pub fn stokes_of_field(&self, u: &[T], p: &[T], y: &mut [T], q: &mut [T], work: &mut Workspace<T>) {
        self.apply::<true, true, _>(Input { x: u, p, expand: false }, y, q, work);
    }

    /// `y = -B^T p`.
    pub fn gradient(&self, p: &[T], y: &mut [T], work: &mut Workspace<T>) {
        self.apply::<false, true, _>(Input { x: &[], p, expand: false }, y, &mut [], work);
    }

    fn apply<const VISCOUS: bool, const PRESSURE: bool, X: Scalar>(
        &self,
        input: Input<'_, X>,
        y: &mut [X],
        q: &mut [X],
        work: &mut Workspace<T, X>,
    ) {
        work.fit(self, !q.is_empty());
        let kernel = |output: Output<'_, X>, buffers: &mut Buffers<T>| {
            self.dispatch::<VISCOUS, PRESSURE, X>(input, output, buffers);
        };
        self.apply_kernel(y, q, work, &kernel);
    }

    /// Runs a kernel on all chunks and adds up what they share.
    fn apply_kernel<X: Scalar>(
        &self,
        y: &mut [X],
        q: &mut [X],
        work: &mut Workspace<T, X>,
        kernel: &(impl Fn(Output<'_, X>, &mut Buffers<T>) + Sync),
    ) {
        let partition = &self.chunks.velocity;
        let (y, twists) = y.split_at_mut(partition.node_count() * D);
        let Workspace { buffers, velocity, pressure, twists: of_chunks } = work;
        let count = self.chunks.count();
        let output = Output {
            chunks: 0..count,
            y: &mut *y,
            q: &mut *q,
            ghost_y: velocity,
            ghost_q: pressure,
            twists: of_chunks,
        };
        self.in_parallel(output, buffers, kernel);
        add_ghost_contributions::<X, D>(partition, 0..count, y, velocity, buffers.len());
        if !q.is_empty() {
            add_ghost_contributions::<X, 1>(&self.chunks.pressure, 0..count, q, pressure, buffers.len());
        }
        T::pool().take_back(buffers);
        twists.fill(X::ZERO);
        for (&body, load) in self.bodies.items().iter().zip(of_chunks.chunks_exact(Self::TWIST)) {
            let sum = &mut twists[body as usize * Self::TWIST..][..Self::TWIST];
            sum.iter_mut().zip(load).for_each(|(sum, &load)| *sum += load);
        }
    }

    /// Halves the chunks until each part has buffers of its own.
    fn in_parallel<X: Scalar>(
        &self,
        output: Output<'_, X>,
        buffers: &mut [Buffers<T>],
        run: &(impl Fn(Output<'_, X>, &mut Buffers<T>) + Sync),
    ) {
        if let [one] = buffers {
            return run(output, one);
        }
        let (first, second) = buffers.split_at_mut(buffers.len() / 2);
        let middle = output.chunks.start + output.chunks.len() * first.len() / (first.len() + second.len());
        let (left, right) = output.split_at(self, middle);
        rayon::join(|| self.in_parallel(left, first, run), || self.in_parallel(right, second, run));
    }

    /// Runs the kernel compiled for the widest vectors this processor has.
    pub(super) fn dispatch<const VISCOUS: bool, const PRESSURE: bool, X: Scalar>(
        &self,
        input: Input<'_, X>,
        output: Output<'_, X>,
        buffers: &mut Buffers<T>,
    ) {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
                // SAFETY: the instructions the function is compiled for were detected just above; its code is
                // the safe generic `run`. The test `vector_and_portable_kernels_agree` compares all three.
                return unsafe { run_avx512::<T, D, VISCOUS, PRESSURE, X>(self, input, output, buffers) };
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                // SAFETY: as above.
                return unsafe { run_avx2::<T, D, VISCOUS, PRESSURE, X>(self, input, output, buffers) };
            }
        }
        self.run::<Portable<T>, VISCOUS, PRESSURE, X>(input, output, buffers);
    }

    /// Works off some chunks.
    #[inline(always)]
    pub(super) fn run<V: Lanes<Scalar = T>, const VISCOUS: bool, const PRESSURE: bool, X: Scalar>(
        &self,
        input: Input<'_, X>,
        output: Output<'_, X>,
        buffers: &mut Buffers<T>,
    ) {
        let mut output = output;
        let (x_buffer, y_buffer, points) = buffers.split();
        let registers = &mut Registers::new(points);
        for chunk in output.chunks.clone() {
            let output = output.take_first(self);
            let span = &self.spans[chunk];
            if span.is_empty() {
                output.clear();
                continue;
            }
            self.read::<VISCOUS, PRESSURE, X>(chunk, input, x_buffer);
            y_buffer[..=self.chunks.local_count(chunk)].fill([T::ZERO; 4]);
            self.uniform_cells::<V, VISCOUS, PRESSURE>(span.uniform, x_buffer, y_buffer, registers);
            if VISCOUS {
                self.varying_cells::<V, PRESSURE>(span, x_buffer, y_buffer, registers);
            } else {
                self.uniform_cells::<V, VISCOUS, PRESSURE>(span.varying, x_buffer, y_buffer, registers);
            }
            self.write(chunk, y_buffer, output);
        }
    }

    /// Cells whose viscosity is one number, or does not matter.
    #[inline(always)]
    fn uniform_cells<V: Lanes<Scalar = T>, const VISCOUS: bool, const PRESSURE: bool>(
        &self,
        range: (u32, u32),
        x: &Nodes<T>,
        y: &mut Nodes<T>,
        registers: &mut Registers<'_, V>,
    ) {
        for first in (range.0..range.1).step_by(V::COUNT) {
            self.cells::<V, VISCOUS, PRESSURE, false>(first as usize, &[], x, y, registers);
        }
    }

    /// Cells whose viscosity varies.
    #[inline(always)]
    fn varying_cells<V: Lanes<Scalar = T>, const PRESSURE: bool>(
        &self,
        span: &Span,
        x: &Nodes<T>,
        y: &mut Nodes<T>,
        registers: &mut Registers<'_, V>,
    ) {
        let (start, end) = span.varying;
        for first in (start..end).step_by(V::COUNT) {
            let eta = self.points_of(span.first_points, (first - start) as usize);
            self.cells::<V, true, PRESSURE, true>(first as usize, eta, x, y, registers);
        }
    }

    /// Viscosities at points from the given cell with a varying one on.
    #[inline(always)]
    fn points_of(&self, first_group: u32, cell: usize) -> &[T] {
        let points = GROUP * self.rule.weights.len();
        &self.points[(first_group as usize + cell / GROUP) * points + cell % GROUP..]
    }

    /// Reads the unknowns of a chunk.
    #[inline(always)]
    fn read<const VISCOUS: bool, const PRESSURE: bool, X: Scalar>(
        &self,
        chunk: usize,
        input: Input<'_, X>,
        buffer: &mut Nodes<T>,
    ) {
        let chunks = &*self.chunks;
        if VISCOUS {
            let (own, ghosts) = (chunks.velocity.owned(chunk), &chunks.velocity.ghosts[chunk]);
            let (x, _) = input.x[..chunks.velocity.node_count() * D].as_chunks::<D>();
            let (owned_buffer, rest) = buffer.split_at_mut(own.len());
            for (node, x) in owned_buffer.iter_mut().zip(&x[own]) {
                set_velocity(node, x);
            }
            for (node, &from) in rest.iter_mut().zip(ghosts) {
                set_velocity(node, &x[from as usize]);
            }
            if input.expand {
                self.expand(chunk, &input.x[chunks.velocity.node_count() * D..], buffer);
            }
        }
        if PRESSURE {
            let own = chunks.pressure.owned(chunk);
            for (&local, &p) in chunks.pressure_locals[own.clone()].iter().zip(&input.p[own]) {
                buffer[local as usize][D] = T::from_f64(p.to_f64());
            }
            let ghosts = chunks.pressure.ghosts.range(chunk);
            let locals = &chunks.ghost_pressure_locals[ghosts];
            for (&local, &q) in locals.iter().zip(&chunks.pressure.ghosts[chunk]) {
                buffer[local as usize][D] = T::from_f64(input.p[q as usize].to_f64());
            }
        }
        buffer[chunks.local_count(chunk)] = [T::ZERO; 4];
    }

    /// Sets rigid nodes, then hanging ones.
    #[inline(always)]
    fn expand<X: Scalar>(&self, chunk: usize, twists: &[X], buffer: &mut Nodes<T>) {
        let bodies = &self.bodies[chunk];
        for rigid in &self.rigid_nodes[chunk] {
            let twist = &twists[bodies[rigid.body as usize] as usize * Self::TWIST..][..Self::TWIST];
            rigid.set_velocity(twist, &mut buffer[rigid.node as u16 as usize]);
        }
        self.chunks.for_each_hanging(chunk, |local, masters, weights| {
            let mut sum = [T::ZERO; D];
            for (&master, &weight) in masters.iter().zip(weights) {
                let (weight, master) = (T::from_f64(weight), &buffer[master as usize]);
                (0..D).for_each(|c| sum[c] += weight * master[c]);
            }
            buffer[local as usize][..D].copy_from_slice(&sum);
        });
    }

    /// Moves the loads of a chunk to its unknowns and writes them.
    #[inline(always)]
    fn write<X: Scalar>(&self, chunk: usize, buffer: &mut Nodes<T>, output: Output<'_, X>) {
        let chunks = &*self.chunks;
        self.chunks.for_each_hanging(chunk, |local, masters, weights| {
            let load = take_velocity::<T, D>(&mut buffer[local as usize]);
            for (&master, &weight) in masters.iter().zip(weights) {
                let (weight, master) = (T::from_f64(weight), &mut buffer[master as usize]);
                (0..D).for_each(|c| master[c] += weight * load[c]);
            }
        });
        output.twists.fill(X::ZERO);
        for rigid in &self.rigid_nodes[chunk] {
            let force = take_velocity::<T, D>(&mut buffer[rigid.node as u16 as usize]);
            rigid.add_moment(&force, &mut output.twists[rigid.body as usize * Self::TWIST..][..Self::TWIST]);
        }
        for &local in &chunks.boundary[chunk] {
            take_velocity::<T, D>(&mut buffer[local as usize]);
        }
        let (own, ghosts) = (output.y.as_chunks_mut::<D>().0, output.ghost_y.as_chunks_mut::<D>().0);
        let (owned_buffer, rest) = buffer.split_at(own.len());
        own.iter_mut().zip(owned_buffer).for_each(|(y, node)| *y = velocity_of(node));
        ghosts.iter_mut().zip(rest).for_each(|(y, node)| *y = velocity_of(node));
        if !output.q.is_empty() || !output.ghost_q.is_empty() {
            for (q, &local) in output.q.iter_mut().zip(&chunks.pressure_locals[chunks.pressure.owned(chunk)])
            {
                *q = X::from_f64(buffer[local as usize][D].to_f64());
            }
            let locals = &chunks.ghost_pressure_locals[chunks.pressure.ghosts.range(chunk)];
            for (q, &local) in output.ghost_q.iter_mut().zip(locals) {
                *q = X::from_f64(buffer[local as usize][D].to_f64());
            }
        }
    }
}

#[inline(always)]
fn take_velocity<T: Scalar, const D: usize>(node: &mut [T; 4]) -> [T; D] {
    std::array::from_fn(|c| std::mem::replace(&mut node[c], T::ZERO))
}

#[inline(always)]
fn velocity_of<T: Scalar, X: Scalar, const D: usize>(node: &[T; 4]) -> [X; D] {
    std::array::from_fn(|c| X::from_f64(node[c].to_f64()))
}

#[inline(always)]
fn set_velocity<T: Scalar, X: Scalar, const D: usize>(node: &mut [T; 4], u: &[X; D]) {
    *node = std::array::from_fn(|c| if c < D { T::from_f64(u[c].to_f64()) } else { T::ZERO });
}

impl<T: CellScalar, X: Scalar> Workspace<T, X> {
    /// Makes room for an operator on the current pool of threads and borrows buffers; a second time nothing
    /// is allocated.
    fn fit<const D: usize>(&mut self, operator: &CellOperator<T, D>, divergence: bool) {
        let chunks = &operator.chunks;
        // A rank may have no cells.
        let threads = rayon::current_num_threads().min(chunks.count()).max(1);
        T::pool().lend(threads, operator.rule.workspace_len(GROUP), &mut self.buffers);
        self.velocity.resize(chunks.velocity.ghosts.items().len() * D, X::ZERO);
        if divergence {
            self.pressure.resize(chunks.pressure.ghosts.items().len(), X::ZERO);
        }
        self.twists.resize(operator.bodies.items().len() * CellOperator::<T, D>::TWIST, X::ZERO);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
pub(super) fn run_avx2<
    T: CellScalar,
    const D: usize,
    const VISCOUS: bool,
    const PRESSURE: bool,
    X: Scalar,
>(
    operator: &CellOperator<T, D>,
    input: Input<'_, X>,
    output: Output<'_, X>,
    buffers: &mut Buffers<T>,
) {
    operator.run::<T::Avx2, VISCOUS, PRESSURE, X>(input, output, buffers);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
fn run_avx512<T: CellScalar, const D: usize, const VISCOUS: bool, const PRESSURE: bool, X: Scalar>(
    operator: &CellOperator<T, D>,
    input: Input<'_, X>,
    output: Output<'_, X>,
    buffers: &mut Buffers<T>,
) {
    operator.run::<T::Avx512, VISCOUS, PRESSURE, X>(input, output, buffers);
}

/// `(y, q)` of the Stokes operator by a given kernel.
#[cfg(test)]
pub(super) fn with<T: CellScalar, const D: usize>(
    operator: &CellOperator<T, D>,
    x: &[T],
    p: &[T],
    kernel: &(impl Fn(Input<'_, T>, Output<'_, T>, &mut Buffers<T>) + Sync),
) -> Vec<T> {
    let (mut y, mut q, mut work) = (vec![T::ZERO; x.len()], vec![T::ZERO; p.len()], Workspace::default());
    work.fit(operator, true);
    let input = Input { x, p, expand: true };
    operator.apply_kernel(&mut y, &mut q, &mut work, &|output, buffers| kernel(input, output, buffers));
    y.extend(q);
    y
}
