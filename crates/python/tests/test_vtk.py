"""Files for ParaView, read back by meshio and by VTK: arrays, names and times, beside the table of the run."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import gluey
import numpy as np
import pytest
from conftest import SUSPENSION, pair

meshio = pytest.importorskip("meshio", reason="meshio is not installed")
vtk_xml = pytest.importorskip("vtkmodules.vtkIOXML", reason="VTK is not installed")
numpy_support = pytest.importorskip("vtkmodules.util.numpy_support", reason="VTK is not installed")

FIELDS = {"velocity": 3, "pressure": 1, "viscosity": 1, "level_set": 1, "lambda": 3}
PARTICLES = {"radius": 1, "velocity": 3, "spin": 3, "particle": 1, "image": 1, "unwrapped": 3}
CONTACTS = {"gamma": 1, "lambda": 1, "gap": 1}


@pytest.fixture(scope="module", params=[2, 3])
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> gluey.Result:
    """Two particles pressed together: fields, particles and a contact every second step."""
    case = pair(request.param, end=0.4, contact={"strategy": "gluey"})
    near = [[0.38, 0.54, 0.5], [0.61, 0.46, 0.5]]
    case["particles"] = gluey.particles([x[: request.param] for x in near], 0.1215)
    case["flow"] = {"formulation": "unfitted", "lubrication": "none", "mesh": {"cells_per_radius": 1.9}}
    if request.param == 3:
        case["time"] = {"step": 0.1, "end": 0.2}
    return gluey.run(case, tmp_path_factory.mktemp("out"), progress=False, vtk=2)


def read_by_vtk(path: Path) -> Any:
    reader = vtk_xml.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    assert reader.GetErrorCode() == 0
    return reader.GetOutput()


def arrays_of_vtk(data: Any) -> dict[str, np.ndarray]:
    names = [data.GetArrayName(k) for k in range(data.GetNumberOfArrays())]
    return {name: numpy_support.vtk_to_numpy(data.GetArray(name)) for name in names}


def width(array: np.ndarray) -> int:
    return 1 if array.ndim == 1 else array.shape[1]


def flat(array: np.ndarray) -> np.ndarray:
    return array.reshape(len(array), -1)


def times_of(collection: Path) -> list[tuple[float, str]]:
    sets = ElementTree.parse(collection).getroot().iter("DataSet")
    return [(float(entry.attrib["timestep"]), entry.attrib["file"]) for entry in sets]


def both(path: Path) -> tuple[Any, Any]:
    """A file by meshio and by VTK, with the same points and cells."""
    mesh, grid = meshio.read(path), read_by_vtk(path)
    points = numpy_support.vtk_to_numpy(grid.GetPoints().GetData())
    assert (mesh.points == points).all() and points.dtype == np.float64
    assert sum(len(block.data) for block in mesh.cells) == grid.GetNumberOfCells()
    return mesh, grid


def test_collections_list_the_times_of_the_table(run: gluey.Result) -> None:
    for series in ("particles", "contacts", "fields"):
        listed = run.vtk(series)
        folder = run.folder / f"{run.name}-vtk"
        assert [(time, path.name) for time, path in listed] == times_of(folder / f"{series}.pvd")
        assert [time for time, _ in listed] == run.times[::2].tolist()
        assert all(path.is_file() for _, path in listed)


def test_particles_are_those_of_the_table(run: gluey.Result) -> None:
    d = run.dimension
    for row, (_, path) in zip(range(0, len(run.times), 2), run.vtk("particles")):
        mesh, grid = both(path)
        by_vtk = arrays_of_vtk(grid.GetPointData())
        assert {name: width(array) for name, array in by_vtk.items()} == PARTICLES
        assert set(mesh.point_data) == set(PARTICLES)
        for name, array in by_vtk.items():
            assert (flat(mesh.point_data[name]) == flat(array)).all(), name
        assert (mesh.points[:, :d] == run.positions[row]).all() and (mesh.points[:, d:] == 0.0).all()
        assert (by_vtk["radius"] == run.radii).all()
        # Walls all around: nothing is brought back, and there are no images.
        assert by_vtk["particle"].tolist() == [1.0, 2.0] and by_vtk["image"].tolist() == [0.0, 0.0]
        assert (by_vtk["unwrapped"] == mesh.points).all()
        assert (by_vtk["velocity"][:, :d] == run.velocities[row]).all()
        spins = by_vtk["spin"][:, 2] if d == 2 else by_vtk["spin"]
        assert (spins == run.spins[row]).all()
        assert {block.type for block in mesh.cells} == {"vertex"}


def test_images_complete_a_sheared_box(tmp_path: Path) -> None:
    run = gluey.run(SUSPENSION, tmp_path, progress=False, vtk=1)
    found = 0
    for row, (_, path) in enumerate(run.vtk("particles")):
        mesh, grid = both(path)
        by_vtk = arrays_of_vtk(grid.GetPointData())
        assert {name: width(array) for name, array in by_vtk.items()} == PARTICLES
        image, number = by_vtk["image"], by_vtk["particle"].astype(int) - 1
        # The particles in their order, then what reaches into the box of them.
        assert number[: run.count].tolist() == list(range(run.count)) and not image[: run.count].any()
        assert (image[run.count :] == 1.0).all()
        found += len(image) - run.count
        assert (by_vtk["unwrapped"][:, :2] == run.positions[row][number]).all()
        assert (by_vtk["radius"] == run.radii[number]).all()
        # All are whole periods away from where nothing brings them back: rows of the lattice.
        tilt = run.rheology["strain"][row]
        away = mesh.points[:, :2] - by_vtk["unwrapped"][:, :2]
        up = np.round(away[:, 1])
        right = away[:, 0] - up * tilt
        assert away[:, 1] == pytest.approx(up, abs=1e-12) and right == pytest.approx(np.round(right), abs=1e-12)
        # Images slide with their rows.
        faster = by_vtk["velocity"][:, 0] - run.velocities[row][number, 0]
        assert faster == pytest.approx(up, abs=1e-12)
    assert found > 0


def test_contacts_join_the_particles(run: gluey.Result) -> None:
    found = 0
    for row, (_, path) in zip(range(0, len(run.times), 2), run.vtk("contacts")):
        mesh, grid = both(path)
        by_vtk = arrays_of_vtk(grid.GetCellData())
        assert {name: width(array) for name, array in by_vtk.items()} == CONTACTS
        for name, array in by_vtk.items():
            by_meshio = np.concatenate([flat(block) for block in mesh.cell_data[name]])
            assert (by_meshio == flat(array)).all(), name
        lines = [block.data for block in mesh.cells if block.type == "line"]
        for line in lines:
            found += len(line)
            assert line.tolist() == [[0, 1]]
            assert (mesh.points[line[0], : run.dimension] == run.positions[row]).all()
            # Contacts come behind the vertices of the particles.
            assert by_vtk["gamma"][-1] < 0.0 and by_vtk["gap"][-1] == pytest.approx(0.0, abs=1e-9)
            assert (by_vtk["gamma"][:2] == 0.0).all()
    assert found > 0


def test_fields_are_the_same_for_both_readers(run: gluey.Result) -> None:
    d = run.dimension
    cell_type, name_of_type = (28, "quad9") if d == 2 else (29, "hexahedron27")
    for row, (_, path) in zip(range(0, len(run.times), 2), run.vtk("fields")):
        mesh, grid = both(path)
        by_vtk = arrays_of_vtk(grid.GetPointData())
        assert {name: width(array) for name, array in by_vtk.items()} == FIELDS
        for name, array in by_vtk.items():
            if len(array):
                assert (flat(mesh.point_data[name]) == flat(array)).all(), name
        assert {block.type for block in mesh.cells} == {name_of_type}
        assert {grid.GetCellType(k) for k in range(grid.GetNumberOfCells())} == {cell_type}
        nodes = np.array([[cell.GetPointId(k) for k in range(3**d)] for cell in map(grid.GetCell, range(50))])
        assert (mesh.cells[0].data[:50] == nodes).all()
        # The box, with its undisturbed flow on the boundary and the motion of the particles inside them.
        x, u = mesh.points[:, :d], by_vtk["velocity"][:, :d]
        assert x.min() == 0.0 and x.max() == 1.0
        wall = (x[:, 1] == 0.0) | (x[:, 1] == 1.0)
        assert u[wall, 0] == pytest.approx(x[wall, 1] - 0.5, abs=1e-12)
        for center, velocity in zip(run.positions[row], run.velocities[row]):
            nearest = np.linalg.norm(x - center, axis=1).argmin()
            assert u[nearest] == pytest.approx(velocity, abs=0.02)
        inside = np.linalg.norm(x - run.positions[row, 0], axis=1) < 0.8 * run.radii[0]
        assert inside.any() and (by_vtk["level_set"][inside] > 0.0).all()
