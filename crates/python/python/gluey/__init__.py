"""Rigid particles in a Stokes flow, kept apart by the gluey contact model.

>>> import gluey
>>> case = {
...     "name": "pair", "dimension": 2,
...     "particles": gluey.particles([[0.4, 0.52], [0.6, 0.48]], 0.05),
...     "time": {"step": 0.1, "end": 1.0},
... }
>>> result = gluey.run(case, progress=False)
>>> result.positions.shape        # times, particles, axes
(11, 2, 2)

``run``, ``resume``, ``check``, ``plot``, ``view`` and ``analyse`` are those of the command line; ``Stokes`` has mobilities and resistances of
particles where they are, ``contact.PairContact`` the contact model without a fluid, and ``results`` reads what
any run wrote, without gluey if need be.

Units are those of the case: lengths of the box, times of the shear rate, and the viscosity of the fluid is 1.
In 2D forces and torques are those on a unit of depth.
"""

from . import contact, results
from ._gluey import __version__
from ._run import check, particles, resume, run
from ._show import analyse, plot, view
from ._stokes import Flow, Stokes
from .errors import CaseError, ContactError, GlueyError, GlueyWarning, Interrupted, RunError, StokesError
from .results import Result

__all__ = [
    "CaseError",
    "ContactError",
    "Flow",
    "GlueyError",
    "GlueyWarning",
    "Interrupted",
    "Result",
    "RunError",
    "Stokes",
    "StokesError",
    "__version__",
    "analyse",
    "check",
    "contact",
    "particles",
    "plot",
    "results",
    "resume",
    "run",
    "view",
]
