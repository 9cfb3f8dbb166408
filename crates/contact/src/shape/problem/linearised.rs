//! The projection of shapes as the core of the crate sees it: scaled rows of the points of contact, and where
//! they are after each pass.

use gluey_geom::Twist;

use super::{FIRST_PASSES, ShapeProjection};
use crate::delassus::{ScaledDelassus, scale_rows};
use crate::projection::{LinearProblem, Linearised};
use crate::shape::Shape;
use crate::shape::points::{OwnDrag, PointRow};
use crate::solver::{SolveFailure, SolveReport};

impl<const D: usize, S: Shape<D>> ShapeProjection<'_, D, S> {
    /// The rows of all points of contact, and their scales.
    fn scaled_rows(&self) -> (Vec<PointRow<D>>, Vec<f64>) {
        let mut rows: Vec<PointRow<D>> = self.points.iter().map(|point| self.row(point)).collect();
        let mut scales = vec![0.0; rows.len()];
        scale_rows(&self.bodies.weights, &mut rows, &mut scales, |_| {});
        (rows, scales)
    }

    fn set_forces(&mut self, forces: &[f64], scales: &[f64]) {
        for (point, (force, scale)) in self.points.iter_mut().zip(forces.iter().zip(scales)) {
            point.force = force * scale;
        }
    }
}

impl<const D: usize, S: Shape<D>> Linearised for ShapeProjection<'_, D, S> {
    fn begin(&mut self) {
        self.moved.fill(Twist::default());
        self.turn_frames();
        self.linearise(1);
    }

    fn project(&mut self) -> Result<SolveReport, SolveFailure> {
        let (weights, count) = (&self.bodies.weights, self.points.len());
        let (rows, scales) = self.scaled_rows();
        let of_scaled = |value: &dyn Fn(usize) -> f64| (0..count).map(value).collect::<Vec<f64>>();
        let free_gaps = of_scaled(&|k| scales[k] * self.free_gap(k));
        let floors = of_scaled(&|k| self.floor(k) / scales[k]);
        let mut forces = of_scaled(&|k| self.points[k].force / scales[k]);
        let mut scratch = vec![0.0; self.tuning.solver.scratch_count() * count];
        let mut problem = LinearProblem {
            operator: ScaledDelassus { rows: &rows, response: OwnDrag(weights), motions: &mut self.changes },
            weights,
            free_gaps: &free_gaps,
            floors: &floors,
            forces: &mut forces,
            scratch: &mut scratch,
        };
        let report = problem.solve(&self.tuning)?;
        self.set_forces(&forces, &scales);
        self.drop_idle();
        self.move_to_end();
        Ok(report)
    }

    fn linearise(&mut self, pass: usize) -> Option<(usize, f64)> {
        let (mut farthest, mut largest) = (None, 2.0 * self.tuning.tolerance);
        self.carry_points();
        for k in (0..self.pairs.len()).filter(|&k| self.pairs[k].takes_part).collect::<Vec<_>>() {
            let pair = &self.pairs[k];
            let known = self.points.get(pair.main).map_or(pair.arms, |point| point.arms);
            let (gap, arms) = self.gap_now(pair, &known);
            let defect = self.defect(pair, gap);
            if defect > largest {
                (farthest, largest) = (Some((k, gap)), defect);
            }
            self.pairs[k].gap = gap;
            self.pairs[k].main = self.point_at(k, arms, pass);
        }
        if pass > FIRST_PASSES {
            self.turn_normals();
        }
        farthest
    }
}
