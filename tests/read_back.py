#!/usr/bin/env python3
"""Reads the files that `gluey run CASE.toml --vtk N` writes with meshio and VTK, as second opinions on their format.

    pip install meshio vtk
    python3 tests/read_back.py out/pair-2d-gluey-vtk

Fields in pieces, which runs on several ranks write, are read by VTK through the file that names them, and one by one
by meshio. Prints what each file holds; exits non-zero at the first thing that is not as it should be.
"""

import sys
import xml.etree.ElementTree as xml
from pathlib import Path

import meshio
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLPUnstructuredGridReader, vtkXMLUnstructuredGridReader

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


def read_by_vtk(file):
    """Points, nodes cell by cell and arrays of points as VTK finds them."""
    reader = vtkXMLPUnstructuredGridReader() if file.suffix == ".pvtu" else vtkXMLUnstructuredGridReader()
    complaints = []
    reader.AddObserver("ErrorEvent", lambda *_: complaints.append(file))
    reader.AddObserver("WarningEvent", lambda *_: complaints.append(file))
    reader.SetFileName(str(file))
    reader.Update()
    assert not complaints, f"VTK does not like {file}"
    grid = reader.GetOutput()
    nodes = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    points = vtk_to_numpy(grid.GetPoints().GetData()) if grid.GetNumberOfPoints() else numpy.zeros((0, 3))
    data = grid.GetPointData()
    arrays = {data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)) for k in range(data.GetNumberOfArrays())}
    return points, nodes, grid.GetNumberOfCells(), arrays


def check_pieces(index):
    """Pieces hold what VTK finds through their index, and their cells fill the box once. Returns what to print."""
    names = [piece.get("Source") for piece in xml.parse(index).iter("Piece")]
    written = sorted(file.name for file in index.parent.glob(f"{index.stem}-*.vtu"))
    assert names == written, f"{index} names {names} of {written}"
    points, nodes, cell_count, arrays = read_by_vtk(index)
    check_arrays(arrays, FIELDS, len(points))
    read, pieces = [read_by_vtk(index.with_name(name)) for name in names], []
    for name, (_, _, count, _) in zip(names, read):
        if count > 0:
            pieces.append(meshio.read(index.with_name(name)))
            check_fields(pieces[-1])
    assert sum(piece[2] for piece in read) == cell_count, "cells of the pieces"
    assert numpy.array_equal(numpy.concatenate([piece.points for piece in pieces]), points), "places by meshio"
    for array, values in arrays.items():
        by_meshio = numpy.concatenate([piece.point_data[array] for piece in pieces])
        assert numpy.array_equal(by_meshio.reshape(len(points), -1), values.reshape(len(points), -1)), array
    corners = points[nodes.reshape(cell_count, -1)]
    sizes = corners.max(axis=1) - corners.min(axis=1)
    box = points.max(axis=0) - points.min(axis=0)
    used = box > 0
    filled = sizes[:, used].prod(axis=1).sum() / box[used].prod()
    assert abs(filled - 1.0) < 1e-6, f"cells fill the box {filled} times"
    middles = 0.5 * (corners.max(axis=1) + corners.min(axis=1))
    assert len(numpy.unique(numpy.round(middles, 9), axis=0)) == cell_count, "a cell is there twice"
    return f"{len(names)} pieces, {len(points)} points, {cell_count} cells"


def main(folder):
    collections = sorted(folder.glob("*.pvd"))
    assert collections, f"no .pvd file in {folder}"
    for collection in collections:
        for entry in xml.parse(collection).iter("DataSet"):
            file = folder / entry.get("file")
            if file.suffix == ".pvtu":
                text = check_pieces(file)
            else:
                mesh = meshio.read(file)
                CHECKS[collection.stem](mesh)
                points, *_ = read_by_vtk(file)
                assert numpy.array_equal(points, mesh.points), f"{file} by VTK"
                text = f"{len(mesh.points)} points, " + ", ".join(f"{len(b.data)} {b.type}" for b in mesh.cells)
            print(f"t = {float(entry.get('timestep')):<8g} {file.name}: {text}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
