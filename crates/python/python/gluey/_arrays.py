"""What is given as arrays of numpy, checked."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def centers(positions: ArrayLike) -> Array:
    """Centres, (N, 2) or (N, 3)."""
    array = np.ascontiguousarray(positions, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] not in (2, 3):
        raise ValueError(f"positions has the shape {array.shape}; expected (N, 2) in 2D or (N, 3) in 3D")
    return array


def like(name: str, given: ArrayLike | None, shape: tuple[int, ...]) -> Array:
    """An array of this shape; zeros for None."""
    if given is None:
        return np.zeros(shape)
    array = np.asarray(given, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"{name} has the shape {array.shape}; expected {shape}")
    return np.ascontiguousarray(array)


def radii(given: ArrayLike, count: int) -> Array:
    """Radii, (N,); one may stand for all."""
    array = np.asarray(given, dtype=np.float64)
    if array.ndim == 0:
        return np.full(count, float(array))
    return like("radii", array, (count,))
