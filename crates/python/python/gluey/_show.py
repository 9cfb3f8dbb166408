"""What the command line makes of results: pictures, a page for the browser, tables of particles."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Iterable

from . import _gluey


def plot(
    folder: str | os.PathLike[str],
    *,
    only: Iterable[str] = (),
    frame: int | str | None = None,
    flow: str | None = None,
    slice: str | None = None,
    view: tuple[float, float] = (31.5, 20.0),
    colour: str = "speed",
    contacts: float | str | None = None,
    animation: bool = False,
    pixels: int = 720,
    rate: float = 12.0,
    formats: Iterable[str] = ("svg", "png"),
    width_mm: float = 120.0,
) -> list[Path]:
    """Draws the results of every run in a folder, into ``<name>-plots`` beside them.

    Parameters
    ----------
    folder
        What runs wrote to.
    only
        What to draw: ``gaps``, ``trajectories``, ``rheology``, ``solver``, and of the tables of :func:`analyse` ``contacts``,
        ``correlations``, ``profiles``, ``diffusion``; whatever there are results for when absent.
    frame
        The particles of a frame instead (its flow with ``flow``): ``"last"`` or the number of a step.
    flow
        The flow of a frame written with ``vtk``, the last unless ``frame`` names one: ``speed``, ``pressure``,
        ``strain-rate``, ``vorticity``.
    slice
        In 3D, the plane in which the flow is drawn, such as ``"x=0.5"``; across z through the middle when absent.
    view
        From where spheres are seen, in degrees: around the vertical from the front to the right, and above.
    colour
        Colours of particles in frames and animations: ``speed``, ``spin``, the smallest ``gap``, or ``contact-force``.
    contacts
        Join the centres of particles with gaps up to this, in mean radii, from 0 to 10; by ``"force"`` of those in
        contact, in lines as thick as their normal force, dashed where they slip.
    animation
        The particles of all frames instead, as ``particles.gif``.
    pixels
        Pixels across of the animation, from 100 to 4000.
    rate
        Frames a second of the animation, from 0.1 to 50.
    formats
        ``svg``, ``png``.
    width_mm
        Width on paper, from 60 to 400 millimetres.

    Returns
    -------
    list of Path
        The pictures.

    Raises
    ------
    GlueyError
        If there is nothing to draw, or results cannot be read.
    ValueError
        For a name that is none, or a width out of its range.
    """
    if not 60.0 <= width_mm <= 400.0:
        raise ValueError(f"width_mm = {width_mm}: must be a number from 60 to 400")
    if not 100 <= pixels <= 4000:
        raise ValueError(f"pixels = {pixels}: must be a whole number from 100 to 4000")
    if not 0.1 <= rate <= 50.0:
        raise ValueError(f"rate = {rate}: must be a number from 0.1 to 50")
    azimuth, elevation = (float(angle) for angle in view)
    if not (math.isfinite(azimuth) and abs(elevation) <= 90.0):
        raise ValueError(f"view = {view}: must be two angles in degrees, the second from -90 to 90")
    if slice is not None and flow is None:
        raise ValueError(f"slice = {slice!r}: needs flow")
    options = {
        "folder": os.fspath(folder),
        "only": list(only),
        "frame": None if frame is None else str(frame),
        "flow": flow,
        "slice": slice,
        "view": (azimuth, elevation),
        "colour": colour,
        "contacts": None if contacts is None else str(contacts),
        "animation": bool(animation),
        "pixels": int(pixels),
        "rate": float(rate),
        "formats": list(formats),
        "width_mm": float(width_mm),
    }
    return [Path(path) for path in _gluey.plot(options)]


def view(folder: str | os.PathLike[str], out: str | os.PathLike[str] | None = None, *, every: int = 1) -> Path:
    """Writes a page that any browser opens without a network: turn, zoom and play the frames of a run.

    Parameters
    ----------
    folder
        What a run wrote to, or its files in extended XYZ.
    out
        The page; ``view.html`` in that folder when absent.
    every
        Show every so many frames only.

    Raises
    ------
    GlueyError
        If there are no frames.
    """
    if every < 1:
        raise ValueError(f"every = {every}: must be at least 1")
    return Path(_gluey.view(os.fspath(folder), None if out is None else os.fspath(out), every))


def analyse(
    folder: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    reach: float = 0.05,
    skip: int | None = None,
) -> str:
    """Makes tables of the frames of a run (gaps, contacts, clusters and fabric over time, g(r), S(k), profiles,
    displacements) and gives a summary of means with confidence intervals. :func:`results.table` reads them.

    Parameters
    ----------
    folder
        What a run wrote to, or its files in extended XYZ.
    out
        Folder for the tables; ``folder`` when absent.
    reach
        Gap up to which particles count as in contact, in mean radii: from 0 to 10.
    skip
        Frames to leave out at the beginning, instead of the transient that is found.

    Raises
    ------
    GlueyError
        If there are no frames, or fewer than are to be left out.
    """
    where = None if out is None else os.fspath(out)
    return _gluey.analyse(os.fspath(folder), where, float(reach), skip)
