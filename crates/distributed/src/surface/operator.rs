//! The Stokes operator around surfaces on shared vectors.

use gluey_geom::{Dim, Space};
use gluey_linalg::LinOp;
use gluey_parallel::Communicator;
use gluey_stokes::{StokesSystem, SystemOperator};

use super::films::SharedFilms;
use super::space::SurfaceSpace;

/// `[A, -B^T; -B, 0]` with the rows of films, on what ranks own.
pub struct SurfaceOperator<'s, 'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    pub space: SurfaceSpace<'a, D>,
    operator: SystemOperator<'s, D>,
    /// At all nodes of the part.
    x: Vec<f64>,
    y: Vec<f64>,
    films: Option<SharedFilms<'s>>,
}

impl<'s, 'a, const D: usize> SurfaceOperator<'s, 'a, D>
where
    Dim<D>: Space<D>,
{
    pub fn new(
        system: &'s StokesSystem<D>,
        space: SurfaceSpace<'a, D>,
        films: Option<SharedFilms<'s>>,
    ) -> Self {
        let [x, y] = [0, 1].map(|_| vec![0.0; system.dim()]);
        Self { space, operator: SystemOperator::new(system), x, y, films }
    }

    /// The unknowns.
    pub fn into_space(self) -> SurfaceSpace<'a, D> {
        self.space
    }
}

impl<const D: usize> LinOp<f64> for SurfaceOperator<'_, '_, D>
where
    Dim<D>: Space<D>,
{
    fn dim(&self) -> usize {
        self.space.dim()
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.space.spread(x, &mut self.x);
        self.operator.apply(&self.x, &mut self.y);
        self.space.gather(&mut self.y, y);
    }

    fn complete(&self, sums: &mut [f64]) {
        self.space.ranks.sum(sums);
    }

    fn settle(&mut self, b: &[f64], x: &mut [f64]) {
        if let Some(films) = &mut self.films {
            let [_, _, b] = self.space.parts(b);
            films.apply(&self.space, b, x);
        }
    }
}
