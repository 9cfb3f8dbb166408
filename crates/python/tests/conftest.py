"""Cases that run in a blink, and where the cases of the repository are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gluey
import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def cases() -> Path:
    """The folder of the example cases."""
    return ROOT / "data" / "cases"


def pair(dimension: int = 2, end: float = 0.5, **keys: Any) -> dict[str, Any]:
    """Two particles in shear, on a coarse mesh."""
    places = [[0.35, 0.56, 0.5], [0.65, 0.44, 0.5]]
    case: dict[str, Any] = {
        "name": "pair",
        "dimension": dimension,
        "particles": gluey.particles([x[:dimension] for x in places], 0.12),
        "time": {"step": 0.1, "end": end},
        "flow": {"formulation": "unfitted", "mesh": {"cells_per_radius": 1.9}},
    }
    return {**case, **keys}


def spheres(end: float = 2.0) -> dict[str, Any]:
    """Two spheres without finite elements: a thousand steps a second."""
    return {
        "name": "spheres",
        "dimension": 3,
        "particles": gluey.particles([[0.3, 0.525, 0.5], [0.7, 0.475, 0.5]], 0.05),
        "time": {"step": 0.05, "end": end},
        "flow": {"hydrodynamics": "pair-mobility"},
    }


#: Discs in a box that is sheared for ever.
SUSPENSION = {
    "name": "dense",
    "dimension": 2,
    "domain": {"boundary": "sheared"},
    "suspension": {"volume_fraction": 0.3, "count": 12, "seed": 3, "sweeps": 50, "arrangement": "equilibrium"},
    "time": {"step": 0.05, "end": 0.1},
    "contact": {"strategy": "none"},
    "flow": {"formulation": "unfitted", "mesh": {"cells_per_radius": 1.6}},
}
