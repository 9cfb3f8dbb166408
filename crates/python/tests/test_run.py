"""Runs, their results, and what stops them."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
import warnings
from pathlib import Path
from typing import Any

import gluey
import numpy as np
import pytest
from conftest import pair, spheres


def test_a_run_gives_arrays() -> None:
    result = gluey.run(pair(), progress=False)
    assert result.state == "complete" and result.dimension == 2 and result.count == 2
    assert result.times == pytest.approx(np.arange(6) * 0.1)
    assert result.positions.shape == result.velocities.shape == (6, 2, 2)
    assert result.spins.shape == (6, 2) and (result.spins < 0.0).all()
    assert result.pairs.tolist() == [[0, 1]] and result.gaps.shape == (6, 1)
    distance = np.linalg.norm(result.positions[:, 1] - result.positions[:, 0], axis=1)
    assert result.gaps[:, 0] == pytest.approx((distance - 0.24) / 0.12)
    assert (result.min_gap == result.gaps[:, 0]).all()
    assert result.radii.tolist() == [0.12, 0.12]
    # Each goes with the shear, against the other.
    assert (result.velocities[:, 0, 0] > 0.0).all() and (result.velocities[:, 1, 0] < 0.0).all()
    report = result.report
    assert report is not None and report["steps"] == 5
    assert report["min_gap_over_a"] == pytest.approx(result.min_gap.min())
    assert 'formulation = "unfitted"' in result.case_text


def test_three_dimensions_and_steps_without_frames() -> None:
    result = gluey.run(spheres(), progress=False, xyz=5)
    assert result.positions.shape == (41, 2, 3) and result.spins.shape == (41, 2, 3)
    velocities = result.velocities
    assert np.isfinite(velocities[::5]).all() and np.isnan(velocities[1]).all()
    # Adams-Bashforth 2 moves the particles by these velocities, to second order.
    moved = np.gradient(result.positions, result.times, axis=0)
    assert velocities[10] == pytest.approx(moved[10], abs=2e-4)


def test_a_dictionary_a_text_and_a_file_are_the_same(tmp_path: Path, cases: Path) -> None:
    file = cases / "pair-3d-mobility.toml"
    changes = {"time.end": 2.0}
    from_file = gluey.run(file, tmp_path / "a", overrides=changes, progress=False, xyz=None)
    from_text = gluey.run(file.read_text(), tmp_path / "b", overrides=changes, progress=False, xyz=None)
    from_dict = gluey.run(
        {
            **spheres(),
            "name": "pair-3d-mobility",
            "contact": {"strategy": "gluey", "exact_gap": True},
            "flow": {"hydrodynamics": "pair-mobility", "pair-mobility": {"gap_offset": np.float64(0.05)}},
            "reference": "pair3d_trajectory_unbounded",
            "suspension": None,
        },
        tmp_path / "c",
        progress=False,
        xyz=None,
    )
    assert from_file.case_text == from_text.case_text == from_dict.case_text
    assert (from_file.positions == from_text.positions).all() and (from_file.positions == from_dict.positions).all()
    with pytest.raises(gluey.results.ResultsError, match="xyz=1"):
        from_dict.velocities


def test_threads_change_no_bit() -> None:
    one, three = (gluey.run(pair(end=0.2), progress=False, threads=threads) for threads in (1, 3))
    assert (one.positions == three.positions).all() and (one.velocities == three.velocities).all()
    assert one.record["threads"] == 1 and three.record["threads"] == 3


def test_progress_is_told() -> None:
    told: list[dict[str, Any]] = []
    gluey.run(pair(end=0.3), progress=told.append)
    assert told and set(told[0]) == {"name", "step", "steps", "time", "phase", "wall_s", "left_s"}
    assert told[-1]["steps"] == 3 and told[-1]["name"] == "pair"
    assert [state["step"] for state in told] == sorted(state["step"] for state in told)


def test_the_line_of_progress_ends(capsys: pytest.CaptureFixture[str]) -> None:
    from gluey._progress import Line, describe, duration

    state = {"name": "pair", "step": 2, "steps": 10, "time": 0.2, "phase": "flow", "wall_s": 1.0, "left_s": 4.0}
    assert describe(state) == "pair: step 2/10, t = 0.200, 2 steps/s, 4 s left"
    assert describe({**state, "left_s": None}) == "pair: step 2/10, t = 0.200, flow"
    assert [duration(seconds) for seconds in (3.4, 125.0, 3720.0)] == ["3 s", "2 min 05 s", "1 h 02 min"]
    line = Line()
    line.rewrites = True
    line(state)
    line(state)
    line.close()
    assert capsys.readouterr().err == f"\r{describe(state)}\r{describe(state)}\n"


def test_a_notebook_rewrites_its_line(monkeypatch: pytest.MonkeyPatch) -> None:
    from gluey._progress import Line

    class ZMQInteractiveShell:
        pass

    class Shell:
        get_ipython = ZMQInteractiveShell

    stream = io.StringIO()
    assert not Line(stream).rewrites
    monkeypatch.setitem(sys.modules, "IPython", Shell)
    assert Line(stream).rewrites


def test_an_exception_of_progress_stops_the_run(tmp_path: Path) -> None:
    def stop(_: dict[str, Any]) -> None:
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        gluey.run(pair(end=20.0), tmp_path, progress=stop)
    record = gluey.results.read(tmp_path).record
    assert record["state"] == "interrupted" and record["steps_done"] < 200
    assert list(tmp_path.glob("*.checkpoint"))


def test_python_goes_on_meanwhile() -> None:
    ticks = 0
    done = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not done.is_set():
            ticks += 1
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    gluey.run(pair(end=0.5), progress=False)
    done.set()
    thread.join()
    assert ticks > 5


def test_interrupt_leaves_a_checkpoint_and_resume_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    whole = gluey.run(pair(end=4.0), tmp_path / "whole", progress=False)
    program = f"""
        import gluey, signal, sys
        sys.path.insert(0, {str(Path(__file__).parent)!r})
        from conftest import pair
        # What shells start in the background begins with Ctrl-C ignored.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        begun = lambda state: print("begun", flush=True) if state["step"] > 1 else None
        try:
            gluey.run(pair(end=4.0), {str(tmp_path / "cut")!r}, progress=begun)
        except KeyboardInterrupt as error:
            assert isinstance(error, gluey.Interrupted), error
            assert 1 < error.step < error.steps == 40 and error.time > 0.1, vars(error)
            assert error.hint == f"to go on: gluey.resume({{chr(34)}}{{error.folder}}{{chr(34)}})", error.hint
            print("stopped after", error.step)
            sys.exit(130)
    """
    command = [sys.executable, "-c", textwrap.dedent(program)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 130, (out, err)
    assert "stopped after" in out and "stopping after this step" in err
    cut = gluey.results.read(tmp_path / "cut")
    assert cut.state == "interrupted" and 2 < len(cut.times) < 41 and cut.report is None
    result = gluey.resume(tmp_path / "cut", progress=False)
    assert result.state == "complete" and result.record["resumed"] == 1
    assert (result.positions == whole.positions).all() and (result.velocities == whole.velocities).all()
    with pytest.raises(gluey.RunError, match="the run is complete"):
        gluey.resume(tmp_path / "cut")


def test_without_a_folder_nothing_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    result = gluey.run(spheres(), progress=False)
    assert not list(tmp_path.iterdir())
    assert result.velocities.shape == (41, 2, 3) and result.radii.tolist() == [0.05, 0.05]
    with pytest.raises(gluey.CaseError):
        gluey.run({**spheres(), "dimension": 4}, progress=False)
    assert not list(tmp_path.iterdir())


def test_results_are_not_replaced_unless_forced(tmp_path: Path) -> None:
    gluey.run(spheres(), tmp_path, progress=False)
    with pytest.raises(gluey.RunError, match="a complete run of this case is there.*\n.*force=True") as caught:
        gluey.run(spheres(), tmp_path, progress=False)
    assert caught.value.hint is not None and "out=" in caught.value.hint
    again = gluey.run(spheres(end=1.0), tmp_path, progress=False, force=True)
    assert again.times[-1] == pytest.approx(1.0)


def test_a_run_that_fails_says_why_and_how_to_go_on(tmp_path: Path) -> None:
    case = pair(end=40.0, flow={"formulation": "paper", "mesh": {"cells_per_radius": 1.9}})
    case["time"]["step"] = 0.5
    case["particles"] = gluey.particles([[0.7, 0.75], [0.3, 0.3]], 0.12)
    with pytest.raises(gluey.RunError, match="good steps\n  because particle 1 reached the boundary") as caught:
        gluey.run(case, tmp_path, progress=False)
    hint = caught.value.hint
    assert hint is not None and "take a larger box" in hint and f'gluey.resume("{tmp_path}")' in hint


def test_what_a_run_came_upon_is_a_warning(tmp_path: Path) -> None:
    out = tmp_path / "out"

    def stop(_: dict[str, Any]) -> None:
        raise LookupError

    with pytest.raises(LookupError):
        gluey.run(pair(end=8.0), out, progress=stop)
    with pytest.warns(gluey.GlueyWarning) as warned:
        gluey.run(pair(end=0.2), out, progress=False)
    texts = [str(warning.message) for warning in warned]
    assert any("rows of earlier runs that did not come to their end" in text for text in texts), texts
    assert any("the checkpoint of an earlier run is now" in text for text in texts), texts
    assert {warning.filename for warning in warned} == {__file__}


def test_bad_cases_are_refused(tmp_path: Path) -> None:
    cases: list[tuple[Any, str, str, str]] = [
        ({**pair(), "tme": 1}, "unknown key `tme`", "tme", "did you mean `time`"),
        ({**pair(), "dimension": 4}, "dimension = 4", "dimension", "2 or 3"),
        (pair(particles=[]), "particles", "particles", "list them"),
        (pair(time={"step": -0.1, "end": 1.0}), r"time\.step = -0\.1", "time.step", "greater than 0"),
        (pair(time={"step": "x", "end": 1.0}), r"time\.step", "time.step", "a number"),
        ("name = 'x'\ndimension = 2\n", "text:1:1: .*missing key", "time", "add a line like"),
        (tmp_path / "none.toml", "none.toml: cannot be read", "", "give the path"),
    ]
    for case, text, key, hint in cases:
        with pytest.raises(gluey.CaseError, match=text) as caught:
            gluey.check(case)
        error = caught.value
        assert isinstance(error, ValueError) and error.key == key, error
        assert error.hint is not None and hint in error.hint, error
        assert f"\n  hint: {error.hint}" in str(error) and error.issues[0][0] == key
    wrong = pair(time={"step": -0.1, "end": -1.0}, shear_rate=float("nan"))
    with pytest.raises(gluey.CaseError) as caught:
        gluey.check(wrong)
    assert {key for key, _, _ in caught.value.issues} == {"shear_rate", "time.step", "time.end"}
    assert str(caught.value).count("\n  hint: ") == 3
    overlapping = pair(particles=gluey.particles([[0.4, 0.5], [0.5, 0.5]], 0.12))
    with pytest.raises(gluey.CaseError, match="overlap"):
        gluey.run(overlapping, progress=False)


def test_bad_arguments_are_refused(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match=r"flow\.mesh: found a value of type object; expected a number"):
        gluey.check(pair(flow={"mesh": object()}))
    with pytest.raises(TypeError, match="a case is a dictionary"):
        gluey.check(3)  # type: ignore[arg-type]
    with pytest.raises(gluey.CaseError, match=r"overrides, time\.step=0: "):
        gluey.check(pair(), overrides={"time.step": 0})
    with pytest.raises(ValueError, match="is not a key"):
        gluey.check(pair(), overrides={"time..step": 0})
    with pytest.raises(ValueError, match="threads = 0"):
        gluey.run(pair(), threads=0)
    with pytest.raises(ValueError, match="vtk: files for ParaView need a folder"):
        gluey.run(pair(), vtk=1)
    with pytest.raises(ValueError, match="checkpoint_minutes"):
        gluey.run(pair(), checkpoint_minutes=0.0)
    with pytest.raises(gluey.RunError, match="no run is recorded there"):
        gluey.resume(tmp_path)
    with pytest.raises(ValueError, match="radius|broadcast"):
        gluey.particles([[0.0, 0.0]], [1.0, 2.0])


def test_check_says_what_a_run_would_be() -> None:
    case = pair(end=0.1)
    found = gluey.check(case)
    report = gluey.run(case, progress=False).report
    assert report is not None
    assert found["unknowns"] > report["cells"] > 0 and found["cells"] > 50
    assert found["steps"] == 1 and found["particles"] == 2 and found["time_step"] == 0.1
    assert found["volume_fraction"] == pytest.approx(2 * np.pi * 0.12**2)
    assert gluey.check(found["toml"])["toml"] == found["toml"]
    assert gluey.check(spheres())["cells"] is None
    too_large = pair(3, flow={"mesh": {"cells_per_radius": 400.0}})
    with pytest.raises(gluey.RunError, match="GB of memory"):
        gluey.check(too_large)


def test_forked_processes_compute_too() -> None:
    if not hasattr(os, "fork"):
        pytest.skip("there is no fork here")
    gluey.Stokes([[0.5, 0.5]], 0.2).mobility([[1.0, 0.0]])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        child = os.fork()
    if child == 0:
        try:
            gluey.run(pair(end=0.1), progress=False)
            os._exit(0)
        finally:
            os._exit(1)
    deadline = time.monotonic() + 60.0
    while os.waitpid(child, os.WNOHANG) == (0, 0):
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            pytest.fail("the child waits for threads that it does not have")
        time.sleep(0.01)
