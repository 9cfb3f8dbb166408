#!/usr/bin/env python3
"""Reads the files that `gluey run CASE.toml --vtk N` writes with meshio, as a second opinion on their format.

    pip install meshio
    python3 tests/read_back.py out/pair-2d-gluey-vtk

Prints what each file holds; exits non-zero at the first thing that is not as it should be.
"""

import sys
import xml.etree.ElementTree as xml
from pathlib import Path

import meshio
import numpy

FIELDS = {"velocity": 3, "pressure": 1, "viscosity": 1, "level_set": 1, "lambda": 3}
PARTICLES = {"radius": 1, "velocity": 3, "spin": 3, "particle": 1, "image": 1, "unwrapped": 3}
CONTACTS = {"gamma": 1, "lambda": 1, "gap": 1}


def check_arrays(arrays, expected, count):
    assert set(arrays) == set(expected), f"{sorted(arrays)} instead of {sorted(expected)}"
    for name, components in expected.items():
        values = numpy.asarray(arrays[name]).reshape(count, -1)
        assert values.shape[1] == components, f"{name} has {values.shape[1]} components"
        assert numpy.isfinite(values).all(), f"{name} is not finite"


def corners_then_edges(mesh, block):
    """Node 4 (quad) or 8 (hexahedron) of each cell is the middle of its first edge, the last node its centre."""
    points = mesh.points[block.data]
    corner_count = {"quad9": 4, "hexahedron27": 8}[block.type]
    middle = 0.5 * (points[:, 0] + points[:, 1])
    centre = points[:, :corner_count].mean(axis=1)
    assert numpy.abs(points[:, corner_count] - middle).max() < 1e-12, "order of nodes"
    assert numpy.abs(points[:, -1] - centre).max() < 1e-12, "order of nodes"


def check_fields(mesh):
    check_arrays(mesh.point_data, FIELDS, len(mesh.points))
    for block in mesh.cells:
        corners_then_edges(mesh, block)


def check_particles(mesh):
    assert [block.type for block in mesh.cells] == ["vertex"]
    check_arrays(mesh.point_data, PARTICLES, len(mesh.points))
    assert (mesh.point_data["radius"] > 0).all()


def check_contacts(mesh):
    assert {block.type for block in mesh.cells} <= {"vertex", "line"}
    cell_data = {name: numpy.concatenate(blocks) for name, blocks in mesh.cell_data.items()}
    check_arrays(cell_data, CONTACTS, sum(len(block.data) for block in mesh.cells))
    assert (cell_data["gamma"] <= 0).all()


CHECKS = {"fields": check_fields, "particles": check_particles, "contacts": check_contacts}


def main(folder):
    collections = sorted(folder.glob("*.pvd"))
    assert collections, f"no .pvd file in {folder}"
    for collection in collections:
        for entry in xml.parse(collection).iter("DataSet"):
            mesh = meshio.read(folder / entry.get("file"))
            CHECKS[collection.stem](mesh)
            cells = ", ".join(f"{len(block.data)} {block.type}" for block in mesh.cells)
            print(f"t = {float(entry.get('timestep')):<8g} {entry.get('file')}: {len(mesh.points)} points, {cells}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
