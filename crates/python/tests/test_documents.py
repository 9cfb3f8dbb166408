"""What is written about the package runs as it stands: README files, docstrings, examples; stubs are true."""

from __future__ import annotations

import doctest
import importlib
import re
import runpy
import subprocess
import sys
from pathlib import Path

import gluey
import pytest
from conftest import ROOT

HERE = Path(__file__).resolve().parents[1]
EXAMPLES = sorted((HERE / "examples").glob("*.py"))


def blocks(path: Path) -> list[str]:
    """The blocks of Python in a file of Markdown."""
    return re.findall(r"^```python\n(.*?)^```", path.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("name", ["README.md", "crates/python/README.md", "docs/python.md"])
def test_blocks_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = ROOT / name
    found = blocks(path)
    assert found, f"{path} has no block of Python"
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in found:
        exec(compile(block, str(path), "exec"), names)


def test_the_first_result_takes_less_than_ten_lines() -> None:
    first = blocks(ROOT / "README.md")[0]
    assert "import gluey" in first and "gluey.run(" in first
    assert len([line for line in first.splitlines() if line.strip()]) < 10


@pytest.mark.parametrize("module", ["gluey", "gluey.contact", "gluey._stokes", "gluey.results", "gluey._run"])
def test_docstrings_run(module: str) -> None:
    outcome = doctest.testmod(importlib.import_module(module))
    assert outcome.failed == 0
    assert outcome.attempted > 0 or module in ("gluey.results", "gluey._run")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_run(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out


def test_there_are_examples() -> None:
    assert [path.stem for path in EXAMPLES] == ["mobility_matrix", "pair", "settling_heap"]


def test_everything_public_is_documented() -> None:
    for module in (gluey, gluey.contact, gluey.results):
        for name in module.__all__:
            thing = getattr(module, name)
            assert name == "__version__" or thing.__doc__, f"{module.__name__}.{name} says nothing of itself"


def test_types_are_true(tmp_path: Path) -> None:
    pytest.importorskip("mypy", reason="mypy is not installed")
    config = tmp_path / "mypy.ini"
    config.write_text("[mypy]\nstrict = True\n")
    for command in (
        ["mypy", "--config-file", str(config), "--cache-dir", str(tmp_path / "cache"), "-p", "gluey"],
        ["mypy.stubtest", "--mypy-config-file", str(config), "gluey._gluey"],
    ):
        told = subprocess.run([sys.executable, "-m", *command], cwd=tmp_path, capture_output=True, text=True)
        assert told.returncode == 0, told.stdout + told.stderr
