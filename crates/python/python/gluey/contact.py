"""The contact model, without a fluid: velocities in, velocities that do not overlap out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _gluey
from ._arrays import Array, centers, like, radii

__all__ = ["Contacts", "Correction", "PairContact"]

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Contacts:
    """Contacts of a step, or the memory of them, sorted by pair; ``K`` of them. Indices count from 0."""

    #: The first particle, (K,).
    first: Indices
    #: The second particle, (K,); -1 for a wall.
    second: Indices
    #: The wall, (K,); -1 for a particle.
    wall: Indices
    #: Periods by which the second particle is moved, (K, 3).
    image: Indices
    #: Force over ``6 pi eta``, positive apart, (K,); unit: length^2/time.
    force: Array
    #: Memory, at most 0: minus the impulse by which the pair was pressed together, (K,); unit: length^2.
    gamma: Array
    #: Gap at the end of the step, (K,); None in a memory.
    gap: Array | None = None

    def __len__(self) -> int:
        return len(self.first)


@dataclass(frozen=True)
class Correction:
    """What a step gives."""

    #: Admissible velocities, (N, D).
    velocities: Array
    #: Contacts with a force or a memory.
    contacts: Contacts
    #: Impulses of the contacts in the step over ``6 pi eta``, positive apart, (K,); unit: length^2. They are
    #: forces times ``velocity_weight``: what contacts moved the particles by.
    impulses: Array
    #: ``iterations``, ``passes``, ``residual`` (length), ``pairs``, ``active``, ``smallest_gap`` (or None).
    report: dict[str, Any]


class PairContact:
    """Contacts between discs (2D) or spheres (3D), and with walls: the gluey model and its relatives.

    A step moves particles by ``x' = x + c u + drift``. The model replaces predicted velocities by the nearest
    ones that keep particles apart, in the metric of their Stokes drag, and remembers how long pairs were
    pressed together: a pair that is pulled apart stays closed until the pull has made up for the push (Verdon
    et al. 2010). Results do not depend on the numbering of the particles nor on threads.

    >>> contact = PairContact()
    >>> step = contact.correct([[0.0, 0.0], [2.1, 0.0]], 1.0, [[1.0, 0.0], [-1.0, 0.0]], dt=0.1)
    >>> step.velocities[:, 0].round(6).tolist()       # they would overlap by 0.1; they touch
    [0.5, -0.5]
    >>> bool(step.contacts.gamma[0] < 0.0)
    True

    Parameters
    ----------
    law
        ``gluey``; ``inelastic``, without memory; ``velocity-correction``, pair after pair; or ``none``.
    exact_gap
        Whether gaps at the end of the step are exact, not linear in the step.
    memory
        How memory is integrated: ``consistent`` with the step (a contact ends within a step), or as in the
        ``paper``, whole steps at a time.
    gamma_min
        Floor of the memory (below 0; length^2), for rough particles.
    threshold
        Gap kept by ``velocity-correction``, relative to the mean radius of a pair.
    solver
        ``auto``, ``uzawa``, ``accelerated`` or ``active-set``; all give the same velocities.
    tolerance
        Residual at which forces are accepted, relative to the smallest radius: the overlap that is left.
    iteration_limit
        Most iterations of one solve.
    walls
        Planes that particles do not cross: pairs of a point and a direction into the space of particles.
    periods
        Period along each axis, None for none, such as ``(4.0, None)``. Positions are not to be wrapped.
    fixed
        Indices of particles whose velocities contact does not change.

    Raises
    ------
    ValueError
        For a name that is none, or walls and periods that do not fit each other.
    """

    def __init__(
        self,
        *,
        law: str = "gluey",
        exact_gap: bool = True,
        memory: str = "consistent",
        gamma_min: float | None = None,
        threshold: float = 1e-4,
        solver: str = "auto",
        tolerance: float = 1e-13,
        iteration_limit: int = 500_000,
        walls: Iterable[tuple[ArrayLike, ArrayLike]] = (),
        periods: Sequence[float | None] = (),
        fixed: Iterable[int] = (),
    ) -> None:
        planes = [(np.asarray(x, dtype=float), _unit(direction)) for x, direction in walls]
        sizes = {len(periods)} - {0} | {part.size for plane in planes for part in plane}
        if len(sizes) > 1 or sizes - {2, 3}:
            raise ValueError(f"walls and periods have {sorted(sizes)} coordinates; expected 2 or 3, equally many")
        self._dimension = sizes.pop() if sizes else None
        self._parameters: dict[str, Any] = {
            "law": law,
            "exact_gap": exact_gap,
            "memory": memory,
            "gamma_min": gamma_min,
            "threshold": threshold,
            "solver": solver,
            "tolerance": tolerance,
            "iteration_limit": iteration_limit,
            "fixed": [int(index) for index in fixed],
            "periods": [None if period is None else float(period) for period in periods],
            "planes": planes,
        }
        # Names are checked before the first step tells the dimension.
        model = self._make(self._dimension or 2)
        self._model = None if self._dimension is None else model

    def correct(
        self,
        positions: ArrayLike,
        radii: ArrayLike,
        velocities: ArrayLike,
        dt: float,
        *,
        drift: ArrayLike | None = None,
        velocity_weight: float | None = None,
        sliding: tuple[float, float] = (0.0, 0.0),
    ) -> Correction:
        """Corrects the velocities of a step, and remembers its contacts.

        Parameters
        ----------
        positions
            Centres at the beginning of the step, (N, D); not wrapped into periods.
        radii
            Radii, (N,) or one for all.
        velocities
            Predicted velocities, (N, D).
        dt
            Length of the step.
        drift
            Displacements known before the velocity, (N, D): ``-dt/2 u_before`` of Adams-Bashforth 2.
        velocity_weight
            ``c``, the displacement that a unit velocity makes: ``dt`` when absent, ``3 dt/2`` of
            Adams-Bashforth 2.
        sliding
            Tilt of a box that is sheared for ever at the beginning of the step, and its growth in the step:
            how far images across the border in y are moved along x.

        Raises
        ------
        ContactError
            If there are no such velocities, or input makes no sense; the memory is as before.
        ValueError
            For arrays whose shapes do not fit.
        """
        x = centers(positions)
        model = self._of(x.shape[1])
        weight = float(dt if velocity_weight is None else velocity_weight)
        step = {
            "positions": x,
            "radii": _radii(radii, len(x)),
            "velocities": like("velocities", velocities, x.shape),
            "drift": like("drift", drift, x.shape),
            "dt": float(dt),
            "velocity_weight": weight,
            "sliding": (float(sliding[0]), float(sliding[1])),
        }
        corrected, contacts, report = model.correct(step)
        return Correction(corrected, Contacts(**contacts), weight * contacts["force"], report)

    @property
    def memory(self) -> Contacts:
        """What the next step depends on; may be set to what it was, to go on from there."""
        if self._model is None:
            none = np.empty(0)
            index = np.empty(0, dtype=np.int64)
            return Contacts(index, index, index, np.empty((0, 3), dtype=np.int64), none, none)
        return Contacts(**self._model.memory())

    @memory.setter
    def memory(self, memory: Contacts) -> None:
        if self._model is None and not len(memory):
            return
        if self._model is None:
            raise ValueError("the dimension is not known yet: set the memory after a step, or give walls or periods")
        indices = {name: np.ascontiguousarray(getattr(memory, name), dtype=np.int64) for name in _INDICES}
        numbers = {name: np.ascontiguousarray(getattr(memory, name), dtype=np.float64) for name in ("force", "gamma")}
        self._model.set_memory({**indices, **numbers})

    def reverse(self) -> None:
        """Tells that the flow was reversed, so that remembered forces change their sign."""
        if self._model is not None:
            self._model.reverse()

    def _of(self, dimension: int) -> _gluey.PairContact:
        if self._dimension not in (None, dimension):
            raise ValueError(f"positions have {dimension} coordinates, and had {self._dimension} before")
        if self._model is None:
            self._dimension, self._model = dimension, self._make(dimension)
        return self._model

    def _make(self, dimension: int) -> _gluey.PairContact:
        parameters = dict(self._parameters)
        planes = parameters.pop("planes")
        normals = np.array([normal for _, normal in planes], dtype=float).reshape(len(planes), dimension)
        parameters["wall_normals"] = normals
        parameters["wall_offsets"] = np.array([normal @ x for x, normal in planes], dtype=float)
        return _gluey.PairContact(dimension, parameters)


_INDICES = ("first", "second", "wall", "image")
_radii = radii


def _unit(direction: ArrayLike) -> Array:
    vector = np.asarray(direction, dtype=float)
    length = np.linalg.norm(vector)
    if not (np.isfinite(length) and length > 0.0):
        raise ValueError(f"a wall needs a direction, not {vector.tolist()}")
    return np.asarray(vector / length)
