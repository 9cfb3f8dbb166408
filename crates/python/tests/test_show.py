"""Pictures, pages and tables of results."""

from __future__ import annotations

from pathlib import Path

import gluey
import pytest
from conftest import pair


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a short run."""
    folder = tmp_path_factory.mktemp("out")
    gluey.run(pair(end=1.0), folder, progress=False)
    return folder


def test_pictures_are_drawn(out: Path) -> None:
    pictures = gluey.plot(out, formats=["svg"])
    assert [path.suffix for path in pictures] == [".svg"] * len(pictures) and len(pictures) >= 2
    assert all(path.read_text().startswith("<") for path in pictures)
    (snapshot,) = gluey.plot(out, frame=5, formats=["png"], width_mm=85)
    assert snapshot.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(ValueError, match="only: found \"gap\", expected one of gaps"):
        gluey.plot(out, only=["gap"])
    with pytest.raises(ValueError, match="formats: found \"gif\", expected svg or png"):
        gluey.plot(out, formats=["gif"])
    with pytest.raises(ValueError, match="width_mm = 10"):
        gluey.plot(out, width_mm=10)


def test_particles_and_flows_are_drawn_as_asked(out: Path, tmp_path: Path) -> None:
    (seen,) = gluey.plot(out, frame="last", view=(0, 90), colour="gap", contacts=1.0, formats=["svg"])
    assert "gap" in seen.read_text()
    with pytest.raises(gluey.GlueyError, match="with forces of contacts"):
        gluey.plot(out, frame="last", contacts="force")
    with pytest.raises(ValueError, match='contacts: found "-1.0", must be a number from 0 to 10'):
        gluey.plot(out, frame="last", contacts=-1.0)
    with pytest.raises(gluey.GlueyError, match="no fields of the flow"):
        gluey.plot(tmp_path, flow="speed")
    with pytest.raises(ValueError, match="flow: found \"force\", expected one of speed"):
        gluey.plot(out, flow="force")
    with pytest.raises(ValueError, match="view = "):
        gluey.plot(out, frame="last", view=(0, 91))
    with pytest.raises(ValueError, match="slice = 'z=0.5': needs flow"):
        gluey.plot(out, slice="z=0.5")


def test_a_page_is_written(out: Path, tmp_path: Path) -> None:
    page = gluey.view(out, tmp_path / "page.html", every=2)
    assert page == tmp_path / "page.html" and "<html" in page.read_text(encoding="utf-8")[:300]
    with pytest.raises(gluey.GlueyError, match=str(tmp_path)):
        gluey.view(tmp_path)


def test_tables_are_made(out: Path, tmp_path: Path) -> None:
    summary = gluey.analyse(out, tmp_path)
    assert "frames" in summary
    tables = sorted(path.name for path in tmp_path.glob("*.csv"))
    assert tables
    for name in tables:
        assert gluey.results.table(tmp_path / name), name
    with pytest.raises(gluey.GlueyError, match="leaves none"):
        gluey.analyse(out, tmp_path, skip=100)
