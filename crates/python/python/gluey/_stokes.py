"""Stokes flow around particles at given places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Mapping

import numpy as np
from numpy.typing import ArrayLike

from . import _gluey
from ._arrays import Array, centers, like, radii
from ._run import load, particles


@dataclass(frozen=True)
class Flow:
    """A flow around ``N`` particles in ``D`` dimensions; the viscosity is 1."""

    #: Velocities of the centres, (N, D).
    velocities: Array
    #: Angular velocities: (N,) anticlockwise in 2D, (N, 3) in 3D.
    spins: Array
    #: Forces on the particles by something other than the fluid, (N, D).
    forces: Array
    #: Torques on them about their centres: (N,) in 2D, (N, 3) in 3D.
    torques: Array
    #: Stresslets, (N, D, D): symmetric traceless first moments of the force that the fluid exerts on each
    #: particle, with the share of films that are too thin for the mesh. A sphere in the strain ``E`` has
    #: ``(20/3) pi a^3 E``. None in the formulation ``paper``.
    stresslets: Array | None
    #: The share of films in that, (N, D, D).
    film_stresslets: Array | None
    #: Cells of the mesh.
    cells: int
    #: Unknowns: velocities and pressures.
    unknowns: int
    #: Iterations of the linear solver.
    iterations: int


class Stokes:
    """Stokes flow around rigid discs (2D) or spheres (3D) in a box: mobilities and resistances.

    The viscosity is 1: a sphere of radius ``a`` far from everything needs the force ``6 pi a U``. The mesh is
    made once, the linear solver prepared once for free and once for held particles. Computing lets other
    threads of Python go on.

    >>> stokes = Stokes([[0.5, 0.5]], 0.1)
    >>> velocities, spins = stokes.mobility([[0.0, -1.0]])
    >>> bool(velocities[0, 1] < 0.0)
    True

    Parameters
    ----------
    positions
        Centres, (N, 2) or (N, 3).
    radii
        Radii, (N,) or one for all.
    box
        Lower and upper corner; the unit square or cube when absent.
    boundary
        ``couette``: the velocity is given on all sides (none in a box at rest). ``periodic``: walls below and
        above (y), periodic in the other directions.
    cells_per_radius
        Cells in a radius of the smallest particle, at least; 6.4 in 2D and 3.2 in 3D when absent.
    formulation
        How rigidity enters: ``unfitted`` or ``paper`` (whose particles cannot be held).
    tolerance
        Relative tolerance of the residual of a solve.
    flow
        Further keys of ``[flow]`` in a case file, such as ``{"lubrication": "none", "mesh": {"root_cells": 3}}``.
    threads
        Threads, instead of one per processor; results do not depend on them.

    Raises
    ------
    CaseError
        For particles that overlap or leave the box, a box that is not made of cubes, unknown names.
    RunError
        If the mesh does not fit into the memory there is.
    """

    def __init__(
        self,
        positions: ArrayLike,
        radii: ArrayLike,
        *,
        box: tuple[ArrayLike, ArrayLike] | None = None,
        boundary: str = "couette",
        cells_per_radius: float | None = None,
        formulation: str = "unfitted",
        tolerance: float = 1e-6,
        flow: Mapping[str, Any] | None = None,
        threads: int | None = None,
    ) -> None:
        #: Centres, (N, D).
        self.positions = centers(positions)
        count, self.dimension = self.positions.shape
        #: Radii, (N,).
        self.radii = _radii(radii, count)
        if boundary not in ("couette", "periodic"):
            raise ValueError(f"boundary {boundary!r}: expected 'couette' or 'periodic'")
        if threads is not None and threads < 1:
            raise ValueError(f"threads = {threads}: must be at least 1")
        lower, upper = box if box is not None else (np.zeros(self.dimension), np.ones(self.dimension))
        extra = dict(flow or {})
        mesh = {"cells_per_radius": cells_per_radius, **extra.pop("mesh", {})}
        case = {
            "name": "stokes",
            "dimension": self.dimension,
            "domain": {"lower": np.asarray(lower), "upper": np.asarray(upper), "boundary": boundary},
            "particles": particles(self.positions, self.radii),
            "time": {"step": 1.0, "end": 1.0},
            "flow": {"formulation": formulation, "tolerance": tolerance, "mesh": mesh, **extra},
        }
        self._flows = _gluey.Stokes(load(case), threads)

    def mobility(self, forces: ArrayLike | None = None, torques: ArrayLike | None = None) -> tuple[Array, Array]:
        """Velocities (N, D) and spins ((N,) or (N, 3)) of free particles under these forces and torques, in a
        box at rest. What is absent is 0; see :meth:`flow` for shapes."""
        flow = self.flow(forces=forces, torques=torques)
        return flow.velocities, flow.spins

    def resistance(self, velocities: ArrayLike | None = None, spins: ArrayLike | None = None) -> tuple[Array, Array]:
        """Forces (N, D) and torques ((N,) or (N, 3)) that hold particles at these velocities and spins, in a
        box at rest. What is absent is 0; see :meth:`flow` for shapes."""
        flow = self._solve(True, velocities, spins, 0.0)
        return flow.forces, flow.torques

    def flow(
        self,
        *,
        forces: ArrayLike | None = None,
        torques: ArrayLike | None = None,
        velocities: ArrayLike | None = None,
        spins: ArrayLike | None = None,
        shear_rate: float = 0.0,
    ) -> Flow:
        """A flow around free particles under forces and torques, or around held ones of given velocities and
        spins. What is absent is 0; without anything particles are free.

        Parameters
        ----------
        forces
            Forces on the particles by something other than the fluid, (N, D).
        torques
            Torques about their centres: (N,) in 2D, (N, 3) in 3D.
        velocities
            Velocities of the centres, (N, D).
        spins
            Angular velocities: (N,) in 2D, (N, 3) in 3D.
        shear_rate
            The undisturbed velocity is ``shear_rate (y - y_mid)`` along x, with the middle of the box.

        Raises
        ------
        StokesError
            If the linear solver does not converge, or the formulation cannot hold particles.
        ValueError
            For arrays whose shapes do not fit, or both kinds of conditions.
        """
        is_held = velocities is not None or spins is not None
        if is_held and (forces is not None or torques is not None):
            raise ValueError("give forces and torques, or velocities and spins, not both")
        if is_held:
            return self._solve(True, velocities, spins, shear_rate)
        return self._solve(False, forces, torques, shear_rate)

    def mobility_matrix(self) -> Array:
        """The mobility matrix: velocities and spins by forces and torques, (N R, N R).

        ``R`` is 3 in 2D and 6 in 3D: the ``D`` components of the velocity (force), then those of the spin
        (torque), particle by particle. Symmetric and positive definite up to the tolerance. As many solves as
        it has columns.
        """
        return self._flows.matrix(False)

    def resistance_matrix(self) -> Array:
        """The resistance matrix, the inverse of :meth:`mobility_matrix`, by solves of its own, (N R, N R)."""
        return self._flows.matrix(True)

    def _solve(self, hold: bool, vectors: ArrayLike | None, spins: ArrayLike | None, shear_rate: float) -> Flow:
        names = ("velocities", "spins") if hold else ("forces", "torques")
        count, plane = len(self.radii), self.dimension == 2
        turns = like(names[1], spins, (count,) if plane else (count, 3)).reshape(count, -1)
        drive = {
            "hold": hold,
            "vectors": like(names[0], vectors, self.positions.shape),
            "spins": turns,
            "shear_rate": float(shear_rate),
        }
        found = self._flows.solve(drive)
        for name in ("spins", "torques"):
            found[name] = found[name][:, 0] if plane else found[name]
        return Flow(**found)


_radii = radii
