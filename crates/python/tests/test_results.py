"""Results are read without gluey, and by other readers of tables."""

from __future__ import annotations

import gzip
import shutil
import subprocess
import sys
from pathlib import Path

import gluey
import numpy as np
import pytest
from conftest import SUSPENSION, pair, spheres
from gluey import results


def test_the_module_alone_reads_what_a_run_wrote(tmp_path: Path) -> None:
    run = gluey.run(pair(), tmp_path / "out", progress=False)
    shutil.copy(Path(results.__file__), tmp_path / "results.py")
    program = """
        import sys
        sys.modules["gluey"] = None
        import results
        run = results.read("out")
        print(run.positions[-1].ravel().tolist(), run.velocities[-1].ravel().tolist())
    """
    command = [sys.executable, "-c", "\n".join(line.strip() for line in program.splitlines())]
    told = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    expected = f"{run.positions[-1].ravel().tolist()} {run.velocities[-1].ravel().tolist()}\n"
    assert told == expected


def test_gaps_and_rheology_of_a_suspension(tmp_path: Path) -> None:
    run = gluey.run(SUSPENSION, tmp_path, progress=False)
    assert run.count == 12 and run.pairs.shape == (0, 2) and run.gaps.shape == (3, 0)
    near = run.near_gaps
    assert near is not None and set(near["partner"]) <= {"particle", "image"}
    assert near["i"].min() >= 0 and near["j"].max() <= 11 and (near["gap_over_a"] <= 1.0).all()
    assert np.isnan(near["contact_force"]).all() and np.isnan(near["repulsion_force"]).all()
    for row, time in enumerate(run.times):
        assert near["gap_over_a"][near["t"] == time].min() == run.min_gap[row]
    rheology = run.rheology
    assert list(rheology)[:3] == ["t", "strain", "viscosity"]
    assert (rheology["t"] == run.times).all() and (rheology["viscosity"] > 1.0).all()
    assert rheology["strain"] == pytest.approx(run.times)
    fraction = np.pi * (run.radii**2).sum()
    assert fraction == pytest.approx(0.3)
    steps = [(step, frame) for step, frame in run.frames()]
    assert [step for step, _ in steps] == [0, 1, 2]
    last = steps[-1][1]
    assert (last.positions == run.positions[-1]).all() and (last.spins == run.spins[-1]).all()
    assert last.periodic.tolist() == [True, True, False] and last.strain == pytest.approx(0.1)
    assert last.lattice[0].tolist() == [1.0, 0.0, 0.0] and last.lattice[1, 0] == pytest.approx(0.1)


def test_pairs_in_contact_have_friction(tmp_path: Path) -> None:
    rough = {"strategy": "rough", "roughness": 0.1, "friction": 0.5}
    near = gluey.run({**SUSPENSION, "contact": rough}, tmp_path, progress=False).near_gaps
    assert near is not None
    touching = near[near["contact_force"] > 0.0]
    assert len(touching) > 0 and np.isnan(near["slides"][near["contact_force"] == 0.0]).all()
    assert (touching["friction_force"] <= 0.5 * touching["contact_force"] * (1.0 + 1e-9)).all()
    assert set(touching["slides"]) <= {0.0, 1.0} and touching["roughness_over_a"] == pytest.approx(0.1)


def test_frames_are_read_compressed_or_not(tmp_path: Path) -> None:
    run = gluey.run(spheres(end=0.1), tmp_path, progress=False)
    path = tmp_path / f"{run.name}-xyz" / "particles-000001.xyz"
    plain = results.frame(path)
    assert plain.positions.shape == (2, 3) and plain.spins.shape == (2, 3) and plain.time == pytest.approx(0.05)
    assert plain.contact_forces is not None and (plain.contact_forces == 0.0).all()
    none = {**spheres(end=0.05), "name": "none", "contact": {"strategy": "none"}}
    without = next(iter(gluey.run(none, tmp_path, progress=False).frames()))[1]
    assert without.contact_forces is None and without.spins.shape == (2, 3)
    packed = path.with_suffix(".xyz.gz")
    packed.write_bytes(gzip.compress(path.read_bytes()))
    again = results.frame(packed)
    assert (again.positions == plain.positions).all() and (again.velocities == plain.velocities).all()
    path.write_text("2\nTime=0\n")
    with pytest.raises(results.ResultsError, match="particles-000001.xyz: not particles"):
        results.frame(path)


def test_forces_of_contacts_are_those_of_pairs_that_touch(tmp_path: Path) -> None:
    case = pair(end=0.4)
    case["particles"] = gluey.particles([[0.38, 0.54], [0.61, 0.46]], 0.1215)
    case["flow"] = {"formulation": "unfitted", "lubrication": "none", "mesh": {"cells_per_radius": 1.9}}
    touching = 0
    for _, at_step in gluey.run(case, tmp_path, progress=False).frames():
        forces = at_step.contact_forces
        assert forces is not None and forces.shape == (2, 2)
        assert forces[0] == pytest.approx(-forces[1], rel=1e-12)
        apart = at_step.positions[1] - at_step.positions[0]
        if forces.any():
            touching += 1
            # Pushed apart, along the line of the centres.
            assert forces[1] @ apart > 0.99 * np.linalg.norm(forces[1]) * np.linalg.norm(apart)
    assert 0 < touching


def test_ase_reads_frames(tmp_path: Path) -> None:
    ase = pytest.importorskip("ase.io", reason="ASE is not installed")
    run = gluey.run(spheres(end=0.1), tmp_path, progress=False)
    path = tmp_path / f"{run.name}-xyz" / "particles-000002.xyz"
    atoms, ours = ase.read(path, format="extxyz"), results.frame(path)
    assert (atoms.get_positions() == ours.positions).all() and (atoms.cell.array == ours.lattice).all()
    assert (atoms.arrays["contact_force"] == ours.contact_forces).all()
    assert (atoms.arrays["velo"] == ours.velocities).all() and atoms.info["Time"] == ours.time


def test_rows_of_a_run_that_goes_on_are_read(tmp_path: Path) -> None:
    def stop(_: object) -> None:
        raise LookupError

    with pytest.raises(LookupError):
        gluey.run(pair(end=30.0), tmp_path, progress=stop)
    run = results.read(tmp_path)
    assert run.state == "interrupted" and 1 <= len(run.times) < 300
    draft = next(tmp_path.glob("*.csv.partial-1"))
    draft.write_text(draft.read_text() + "1.0,0.5")
    assert len(results.read(tmp_path).times) == len(run.times)


def test_what_is_no_result_is_refused(tmp_path: Path) -> None:
    with pytest.raises(results.ResultsError, match="not a folder"):
        results.read(tmp_path / "none")
    with pytest.raises(results.ResultsError, match="no run is recorded there"):
        results.read(tmp_path)
    gluey.run(spheres(end=0.1), tmp_path, progress=False)
    gluey.run({**spheres(end=0.1), "name": "other"}, tmp_path, progress=False)
    with pytest.raises(results.ResultsError, match="2 runs are recorded there, choose one"):
        results.read(tmp_path)
    with pytest.raises(results.ResultsError, match="no run 'third'"):
        results.read(tmp_path, "third")
    run = results.read(tmp_path, "other-gluey")
    assert run.count == 2 and run.near_gaps is None and run.rheology == {}
    with pytest.raises(results.ResultsError, match="vtk=N"):
        run.vtk()
    (tmp_path / "other-gluey.csv").write_text("t,x1\n1.0,two\n")
    with pytest.raises(results.ResultsError, match="other-gluey.csv: not a table of numbers"):
        results.read(tmp_path, "other-gluey").times


def test_numpy_and_pandas_read_the_files_themselves(tmp_path: Path) -> None:
    run = gluey.run(pair(), tmp_path, progress=False)
    file = tmp_path / f"{run.name}.csv"
    rows = np.genfromtxt(file, delimiter=",", names=True)
    assert (rows["x1"] == run.positions[:, 0, 0]).all() and (rows["omega2"] == run.spins[:, 1]).all()
    pandas = pytest.importorskip("pandas")
    frame = pandas.read_csv(file)
    assert frame["gap12_over_a"].to_numpy() == pytest.approx(run.gaps[:, 0], rel=1e-14)
