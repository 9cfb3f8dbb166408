"""Results of a run as arrays of numpy, without the solver.

This file needs nothing but numpy: copy it to where gluey is not installed. ::

    import results                    # or: from gluey import results

    run = results.read("out")
    run.times                         # (T,)
    run.positions[:, 0]               # path of the first particle, (T, D)

Particles count from 0 in arrays; in files they count from 1. Lengths and times are in the units of the case,
gaps in mean radii.

Nothing here is needed to read single files: ``numpy.genfromtxt("out/pair.csv", delimiter=",", names=True)``
and ``pandas.read_csv("out/pair.csv")`` read any table of a run.
"""

from __future__ import annotations

import gzip
import json
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, Union

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
PathLike = Union[str, Path]

__all__ = ["Frame", "Result", "ResultsError", "frame", "read", "table"]

_RECORD = "-run.json"
_SAID = re.compile(r'(\w+)=(?:"([^"]*)"|(\S+))')
_FORCES = ["contact_force", "repulsion_force"]
# Where contacts act in the flow.
_FRICTION = ["friction_force", "slip_speed", "slides", "roughness_over_a"]
_NEAR = [["t", "i", "j", "gap_over_a", *forces, "partner"] for forces in (_FORCES, _FORCES + _FRICTION)]


class ResultsError(ValueError):
    """Files are not there, or are not those of a run."""


def read(folder: PathLike, name: str | None = None) -> Result:
    """Reads the results of a run.

    Parameters
    ----------
    folder
        What the run wrote to (``out=`` in Python, ``--out`` on the command line).
    name
        What the names of its files begin with; needed where there are several runs in the folder.

    Raises
    ------
    ResultsError
        If there is no such run, or more than one and no name.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise ResultsError(f"{folder}: not a folder; give the one that a run wrote to")
    names = sorted(path.name[: -len(_RECORD)] for path in folder.glob(f"*{_RECORD}"))
    if not names:
        raise ResultsError(f"{folder}: no run is recorded there (no file *{_RECORD})")
    if name is None and len(names) > 1:
        raise ResultsError(f"{folder}: {len(names)} runs are recorded there, choose one by name=: {', '.join(names)}")
    if name is not None and name not in names:
        raise ResultsError(f"{folder}: no run {name!r} is recorded there, but {', '.join(names)}")
    return Result(folder, names[0] if name is None else name)


def _near_of(names: list[str], lines: list[str]) -> NDArray[Any]:
    kinds = {"i": "i8", "j": "i8", "partner": "U8"}
    dtype = np.dtype([(name, kinds.get(name, "f8")) for name in names])
    if not lines:
        return np.empty(0, dtype)
    # Cells of forces that do not act are empty.
    forces: Dict[Union[int, str], Callable[[str], float]] = {
        column: lambda text: float(text or "nan") for column in range(4, len(names) - 1)
    }
    return np.loadtxt(lines, dtype=dtype, delimiter=",", ndmin=1, converters=forces)


def table(path: PathLike) -> dict[str, Array]:
    """A table of comma-separated numbers under a line of names: an array for each column.

    Cells without a number are nan. The last line of a file that is still written may be incomplete; it is
    left out.
    """
    path = Path(path)
    names, lines = _lines(path)
    return dict(zip(names, _numbers(path, names, lines).T))


@dataclass(frozen=True)
class Frame:
    """The particles at one instant, from a file in extended XYZ."""

    time: float
    #: Shear strain of the undisturbed flow.
    strain: float
    #: Edges of the box as rows, (3, 3); the second is tilted in a box that is sheared for ever.
    lattice: Array
    #: Lower corner of the box, (3,).
    origin: Array
    #: Which axes are periodic, (3,).
    periodic: NDArray[np.bool_]
    #: Centres, (N, D); not wrapped into the box.
    positions: Array
    #: Radii, (N,).
    radii: Array
    #: Velocities of the centres, (N, D).
    velocities: Array
    #: Angular velocities: (N,) about the third axis in 2D, (N, 3) in 3D.
    spins: Array
    #: Sum of the forces of its contacts on each particle over ``6 pi eta``, (N, D); None without a contact model.
    contact_forces: Array | None = None


def frame(path: PathLike) -> Frame:
    """Reads a file that a run wrote in extended XYZ (``xyz=``, ``--xyz``), compressed or not."""
    path = Path(path)
    try:
        data = path.read_bytes()
        text = (gzip.decompress(data) if path.suffix == ".gz" else data).decode()
        lines = text.splitlines()
        count = int(lines[0])
        said = {key: quoted or plain for key, quoted, plain in _SAID.findall(lines[1])}
        has_forces = ":contact_force:R:3" in said["Properties"]
        width = 13 if has_forces else 10
        numbers = np.array([line.split()[1:] for line in lines[2 : 2 + count]], dtype=float).reshape(count, width)
        dimension = int(said["Dimension"])
        return Frame(
            time=float(said["Time"]),
            strain=float(said["Strain"]),
            lattice=np.array(said["Lattice"].split(), dtype=float).reshape(3, 3),
            origin=np.array(said["Origin"].split(), dtype=float),
            periodic=np.array([axis == "T" for axis in said["pbc"].split()]),
            positions=numbers[:, :dimension],
            radii=numbers[:, 3],
            velocities=numbers[:, 4 : 4 + dimension],
            spins=numbers[:, 9] if dimension == 2 else numbers[:, 7:10],
            contact_forces=numbers[:, 10 : 10 + dimension] if has_forces else None,
        )
    except (OSError, EOFError, UnicodeDecodeError, ValueError, KeyError, IndexError) as error:
        raise ResultsError(f"{path}: not particles in extended XYZ as gluey writes them ({error})") from error


class Result:
    """The results of a run, read when they are asked for.

    ``T`` rows are on disk: one for every step and one for the end. Of a run that goes on, or did not come to
    its end, they are those that were done.
    """

    def __init__(self, folder: PathLike, name: str) -> None:
        #: The folder of the results.
        self.folder = Path(folder)
        #: What the names of all files begin with.
        self.name = name

    def __repr__(self) -> str:
        place = self.folder if self.folder.is_dir() else "memory"
        return f"<Result {self.name} in {place}: {self.record.get('state')}>"

    def load(self) -> Result:
        """Reads everything but fields for ParaView, so that the files may go away."""
        for part in ("record", "case_text", "_rows", "near_gaps", "rheology", "_frames"):
            getattr(self, part)
        return self

    @cached_property
    def record(self) -> dict[str, Any]:
        """Who ran what, how, and how far: the record of the run."""
        path = self._path(_RECORD)
        try:
            record = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise ResultsError(f"{path}: not the record of a run ({error})") from error
        if not isinstance(record, dict):
            raise ResultsError(f"{path}: not the record of a run")
        return record

    @property
    def state(self) -> str:
        """``complete``, ``running`` (or killed), ``interrupted`` or ``failed``."""
        return str(self.record.get("state"))

    @property
    def report(self) -> dict[str, Any] | None:
        """What came out in numbers; None until the run is complete."""
        return self.record.get("report")

    @cached_property
    def case_text(self) -> str:
        """The case as it was run, with all defaults, as TOML (``tomllib.loads`` makes a dictionary of it)."""
        path = self._path("-case.toml")
        try:
            return path.read_text(encoding="utf-8")
        except OSError as error:
            raise ResultsError(f"{path}: the case as run cannot be read ({error})") from error

    @cached_property
    def dimension(self) -> int:
        """Dimension of space."""
        return 3 if "z1" in self._rows else 2

    @cached_property
    def count(self) -> int:
        """Number of particles."""
        return sum(1 for name in self._rows if re.fullmatch(r"x\d+", name))

    @property
    def times(self) -> Array:
        """Times of the rows, (T,)."""
        return self._rows["t"]

    @cached_property
    def positions(self) -> Array:
        """Centres of the particles, (T, N, D); not wrapped into a periodic box."""
        axes = "xyz"[: self.dimension]
        return self._stack([f"{axis}{i}" for i in self._numbers for axis in axes], self.dimension)

    @cached_property
    def spins(self) -> Array:
        """Angular velocities: (T, N) in 2D, anticlockwise; (T, N, 3) in 3D."""
        if self.dimension == 2:
            return self._stack([f"omega{i}" for i in self._numbers], 1)[:, :, 0]
        return self._stack([f"omega{i}{axis}" for i in self._numbers for axis in "xyz"], 3)

    @cached_property
    def velocities(self) -> Array:
        """Velocities of the centres, (T, N, D); nan at rows of which no frame was written.

        Raises
        ------
        ResultsError
            If the run wrote no frames at all (``xyz=1``, ``--xyz 1``).
        """
        frames = self._frames
        if not frames:
            raise ResultsError(f"{self._path('-xyz')}: no frames were written; run with xyz=1 for velocities")
        velocities = np.full((len(self.times), self.count, self.dimension), np.nan)
        for step, at_step in frames.items():
            if step < len(velocities):
                velocities[step] = at_step.velocities
        return velocities

    @cached_property
    def radii(self) -> Array:
        """Radii, (N,); from frames, or from the case with Python 3.11 or newer."""
        for _, first in self.frames():
            return first.radii
        try:
            import tomllib
        except ImportError as error:
            raise ResultsError("radii are in frames (run with xyz=1), or need Python 3.11 to read the case") from error
        particles = tomllib.loads(self.case_text)["particles"]
        return np.array([particle["radius"] for particle in particles], dtype=float)

    @cached_property
    def pairs(self) -> NDArray[np.int64]:
        """The pairs that have a column of :attr:`gaps`, (P, 2); all of them up to nine particles, else none."""
        if self.count > 9:
            return np.empty((0, 2), dtype=np.int64)
        pairs = [(i, j) for i in range(self.count) for j in range(i + 1, self.count)]
        return np.array(pairs, dtype=np.int64).reshape(len(pairs), 2)

    @cached_property
    def gaps(self) -> Array:
        """Gaps between surfaces in mean radii, (T, P): a column for each of :attr:`pairs`."""
        return self._stack([f"gap{i + 1}{j + 1}_over_a" for i, j in self.pairs], 1)[:, :, 0]

    @cached_property
    def min_gap(self) -> Array:
        """Smallest gap of any pair in mean radii, (T,); nan for a single particle."""
        if "min_gap_over_a" in self._rows:
            return self._rows["min_gap_over_a"]
        return self.gaps.min(axis=1) if self.gaps.size else np.full(len(self.times), np.nan)

    @cached_property
    def near_gaps(self) -> NDArray[Any] | None:
        """Gaps of at most one mean radius, from ten particles on; None up to nine.

        A structured array with the fields ``t``, ``i``, ``j``, ``gap_over_a``, ``contact_force`` and
        ``repulsion_force`` (nan without such a force), and ``partner``: ``particle``, the nearest periodic
        ``image`` of one, or a ``wall``, of which ``j`` is 0 below and 1 above. Where contacts act in the flow also
        ``friction_force``, ``slip_speed``, ``slides`` (1 or 0) and ``roughness_over_a``, nan without a contact.
        """
        path = self._newest("-gaps.csv")
        if path is None:
            return None
        names, lines = _lines(path)
        if names not in _NEAR:
            raise ResultsError(f"{path}: not a table of gaps")
        try:
            near = _near_of(names, lines)
        except ValueError as error:
            raise ResultsError(f"{path}: not a table of gaps ({error})") from error
        near["i"] -= 1
        near["j"] -= 1
        return near

    @cached_property
    def rheology(self) -> dict[str, Array]:
        """Columns of the rheology, each (R,), of a box that is sheared for ever; empty for any other."""
        path = self._newest("-rheology.csv")
        return {} if path is None else table(path)

    def frames(self) -> Iterator[tuple[int, Frame]]:
        """Steps and frames that were written (``xyz=``, ``--xyz``)."""
        if "_frames" in self.__dict__:
            yield from self._frames.items()
            return
        for path in sorted(self._path("-xyz").glob("particles-*.xyz*")):
            found = re.fullmatch(r"particles-(\d+)\.xyz(\.gz)?", path.name)
            if found:
                yield int(found[1]), frame(path)

    def vtk(self, series: str = "particles") -> list[tuple[float, Path]]:
        """Times and files for ParaView of a series: ``particles``, ``contacts`` or ``fields``."""
        path = self._path("-vtk") / f"{series}.pvd"
        try:
            text = path.read_text(encoding="utf-8")
        except OSError as error:
            raise ResultsError(f"{path}: no such series was written (run with vtk=N)") from error
        found = re.findall(r'<DataSet timestep="([^"]+)"[^>]* file="([^"]+)"', text)
        return [(float(time), path.parent / file) for time, file in found]

    @cached_property
    def _frames(self) -> dict[int, Frame]:
        return dict(self.frames())

    @cached_property
    def _rows(self) -> dict[str, Array]:
        path = self._newest(".csv")
        if path is None:
            raise ResultsError(f"{self._path('.csv')}: there is no such file")
        rows = table(path)
        if "t" not in rows or "x1" not in rows:
            raise ResultsError(f"{path}: not the trajectory of a run")
        return rows

    @property
    def _numbers(self) -> range:
        return range(1, self.count + 1)

    def _stack(self, names: list[str], width: int) -> Array:
        columns = [self._rows[name] for name in names]
        if not columns:
            return np.empty((len(self.times), 0, width))
        return np.stack(columns, axis=1).reshape(len(self.times), -1, width)

    def _path(self, suffix: str) -> Path:
        return self.folder / f"{self.name}{suffix}"

    def _newest(self, suffix: str) -> Path | None:
        """A file, or the rows of it that a run has written so far."""
        path = self._path(suffix)
        if path.exists():
            return path
        drafts = [(int(draft.name.rpartition("-")[2]), draft) for draft in self.folder.glob(f"{path.name}.partial-*")]
        return max(drafts)[1] if drafts else None


def _lines(path: Path) -> tuple[list[str], list[str]]:
    """The names of the columns of a table, and its complete lines."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ResultsError(f"{path}: cannot be read ({error})") from error
    header, *lines = text.split("\n")[:-1] or [""]
    if not header:
        raise ResultsError(f"{path}: not a table, its first line has no names")
    return header.split(","), lines


def _numbers(path: Path, names: list[str], lines: list[str]) -> Array:
    """The numbers of lines, (T, columns)."""
    if not lines:
        return np.empty((0, len(names)))
    try:
        if any(line.endswith(",") or ",," in line for line in lines):
            rows = [[float(cell) if cell else np.nan for cell in line.split(",")] for line in lines]
            numbers = np.array(rows, dtype=float)
        else:
            numbers = np.loadtxt(lines, delimiter=",", ndmin=2)
    except ValueError as error:
        raise ResultsError(f"{path}: not a table of numbers ({error})") from error
    if numbers.shape[1] != len(names):
        raise ResultsError(f"{path}: {numbers.shape[1]} numbers a line under {len(names)} names")
    return numbers
