"""Runs of cases: what the command line does, from Python."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any, Callable, Mapping, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _gluey
from ._progress import Line
from .errors import GlueyWarning
from .results import Result

#: A case: a dictionary with the keys of a case file, the text of one, or its path.
CaseLike = Union[Mapping[str, Any], str, "os.PathLike[str]"]
#: Whether, or to whom, a run tells where it is.
Progress = Union[bool, Callable[[dict[str, Any]], object]]


def run(
    case: CaseLike,
    out: str | os.PathLike[str] | None = None,
    *,
    overrides: Mapping[str, Any] | None = None,
    progress: Progress = True,
    threads: int | None = None,
    force: bool = False,
    xyz: int | None = 1,
    vtk: int | None = None,
    checkpoint_every: int | None = None,
    checkpoint_minutes: float | None = None,
) -> Result:
    """Runs a case and gives its results.

    Ctrl-C stops the run after its step and leaves a checkpoint, from which :func:`resume` goes on; a second
    one does not wait for the step. Other threads of Python go on while a run computes.

    Parameters
    ----------
    case
        A dictionary with the keys of a case file (arrays of numpy may stand for lists, None for what is
        absent), TOML text, or the path of a case file. A text without a line break or ``=`` is a path. A
        ``particles_file`` is sought in the folder of the case file, or in the current one.
    out
        Folder for the results, which is made when missing. Without one they are only in memory; those of a
        run that does not come to its end stay in a temporary folder, which the error names.
    overrides
        Keys to set otherwise, such as ``{"time.step": 0.01, "particles.0.radius": 0.06}``.
    progress
        True for a line that says where the run is, False for nothing, or a function to be called about twenty
        times a second at most with a dictionary: ``name``, ``step``, ``steps``, ``time``, ``phase`` (``flow``,
        ``contact``, ``motion`` or ``output``), ``wall_s`` and ``left_s`` (seconds; None before the first step).
        An exception it raises stops the run as Ctrl-C does, and is raised again.
    threads
        Threads of this run, instead of one per processor; results do not depend on them.
    force
        Whether the results of another run in ``out`` may be replaced.
    xyz
        Steps between frames in extended XYZ, which hold the velocities; None for no frames.
    vtk
        Steps between files for ParaView, in ``out``; None for no files.
    checkpoint_every, checkpoint_minutes
        Steps, and minutes, between checkpoints.

    Raises
    ------
    CaseError
        If the case makes no sense: with the key, and the line where there is one.
    RunError
        If the run cannot begin or does not come to its end.
    Interrupted
        After Ctrl-C; it is a ``KeyboardInterrupt``.
    """
    periods = {"xyz": xyz, "vtk": vtk, "checkpoint_every": checkpoint_every, "threads": threads}
    for name, number in periods.items():
        if number is not None and number < 1:
            raise ValueError(f"{name} = {number}: must be at least 1")
    if checkpoint_minutes is not None and not checkpoint_minutes > 0.0:
        raise ValueError(f"checkpoint_minutes = {checkpoint_minutes}: must be greater than 0")
    if vtk is not None and out is None:
        raise ValueError("vtk: files for ParaView need a folder that stays, out=")
    checked = load(case, overrides)
    folder = tempfile.mkdtemp(prefix="gluey-") if out is None else os.fspath(out)
    output = {
        "out": folder,
        "force": force,
        "vtk": vtk,
        "xyz": xyz,
        "checkpoint_every": checkpoint_every,
        "checkpoint_minutes": checkpoint_minutes,
    }
    with _Told(progress) as told:
        try:
            where, name = _gluey.run(checked, output, threads, told.progress, told.notice)
        except BaseException:
            if out is None and not any(Path(folder).glob("*.checkpoint")):
                shutil.rmtree(folder, ignore_errors=True)
            raise
    result = Result(where, name)
    if out is None:
        result.load()
        shutil.rmtree(folder, ignore_errors=True)
    return result


def resume(
    folder: str | os.PathLike[str],
    *,
    name: str | None = None,
    previous: bool = False,
    progress: Progress = True,
    threads: int | None = None,
) -> Result:
    """Goes on with a run that was interrupted, killed or stopped by an error, and gives its results.

    They are equal, bit for bit, to those of a run that nothing stopped.

    Parameters
    ----------
    folder
        What the run wrote to.
    name
        What the names of its files begin with; needed where there are several runs in the folder.
    previous
        Whether to go on from the checkpoint before the last.
    progress, threads
        See :func:`run`.

    Raises
    ------
    RunError, Interrupted
        As :func:`run`, and RunError where there is nothing to go on with.
    """
    which = {"folder": os.fspath(folder), "name": name, "previous": previous}
    with _Told(progress) as told:
        where, stem = _gluey.resume(which, threads, told.progress, told.notice)
    return Result(where, stem)


def check(case: CaseLike, *, overrides: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Says what a run would be, without running it.

    Returns
    -------
    dict
        ``name``, ``dimension``, ``particles`` (number), ``volume_fraction``, ``strategy``, ``formulation``,
        ``time_step``, ``steps``; of the first mesh ``cells`` and ``unknowns``, which are exact, and
        ``memory_bytes``, an estimate (None for a flow without a mesh); ``memory_available_bytes`` (None where
        the system does not tell); and ``toml``, the case with all defaults.

    Raises
    ------
    CaseError
        If the case makes no sense.
    RunError
        If its mesh does not fit into the memory there is.
    """
    checked = load(case, overrides)
    return {**checked.check(), "toml": checked.toml()}


def particles(
    positions: ArrayLike, radii: ArrayLike, *, forces: ArrayLike | None = None, torques: ArrayLike | None = None
) -> list[dict[str, Any]]:
    """The list of particles of a case, from arrays.

    Parameters
    ----------
    positions
        Centres, (N, D).
    radii
        Radii, (N,) or one for all.
    forces
        Forces on the particles beside their weight, (N, D).
    torques
        Torques, (N,) in 2D, (N, 3) in 3D.
    """
    centers = np.atleast_2d(np.asarray(positions, dtype=float))
    count = len(centers)
    found: list[dict[str, Any]] = [{"position": center} for center in centers.tolist()]
    columns = {"radius": np.broadcast_to(np.asarray(radii, dtype=float), count)}
    if forces is not None:
        columns["force"] = np.asarray(forces, dtype=float)
    if torques is not None:
        columns["torque"] = np.asarray(torques, dtype=float).reshape(count, -1)
    for key, column in columns.items():
        if len(column) != count:
            raise ValueError(f"{key}: {len(column)} entries for {count} particles")
        for particle, entry in zip(found, column.tolist()):
            particle[key] = entry
    return found


def load(case: CaseLike, overrides: Mapping[str, Any] | None = None) -> _gluey.Case:
    """A checked case."""
    changes = dict(overrides or {})
    if isinstance(case, Mapping):
        return _gluey.Case.of_dict(dict(case), changes)
    if isinstance(case, str) and ("\n" in case or "=" in case):
        return _gluey.Case.parse(case, changes)
    if isinstance(case, (str, os.PathLike)):
        return _gluey.Case.load(os.fspath(case), changes)
    raise TypeError(f"a case is a dictionary, TOML text or a path, not {type(case).__name__}")


class _Told:
    """Who is told where a run is."""

    def __init__(self, progress: Progress) -> None:
        self.line = Line() if progress is True else None
        self.progress = progress if callable(progress) else self.line

    def __enter__(self) -> _Told:
        return self

    def __exit__(self, *_: object) -> None:
        if self.line is not None:
            self.line.close()

    def notice(self, text: str, is_warning: bool) -> None:
        """Says what is no part of the progress, on a line of its own."""
        if self.line is not None:
            self.line.close()
        if is_warning:
            # The caller of run or resume; the native part in between has no frame.
            warnings.warn(text, GlueyWarning, stacklevel=3)
        else:
            print(text, file=sys.stderr, flush=True)
