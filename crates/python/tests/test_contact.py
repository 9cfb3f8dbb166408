"""The contact model in Python is that of the crate."""

from __future__ import annotations

import threading

import gluey
import numpy as np
import pytest
from gluey.contact import PairContact


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_pair_that_would_overlap_touches(dimension: int) -> None:
    along = np.eye(dimension)[0]
    contact = PairContact()
    step = contact.correct([0.0 * along, 2.1 * along], [1.0, 1.0], [along, -along], dt=0.1)
    assert step.velocities == pytest.approx(np.array([0.5 * along, -0.5 * along]), abs=1e-12)
    contacts = step.contacts
    assert len(contacts) == 1 and contacts.first[0] == 0 and contacts.second[0] == 1 and contacts.wall[0] == -1
    assert contacts.gap is not None and contacts.gap[0] == pytest.approx(0.0, abs=1e-12)
    # M (u - u*) = B^T lambda with M = diag(a): the force that takes 0.5 of the velocity of a unit sphere.
    assert contacts.force == pytest.approx([0.5]) and step.impulses == pytest.approx([0.05])
    assert contacts.gamma == pytest.approx([-0.05])
    assert step.report["active"] == 1 and step.report["smallest_gap"] == pytest.approx(0.0, abs=1e-12)


def test_the_pull_makes_up_for_the_push() -> None:
    """Pressed together at speed 1 for 0.4, pulled at the same speed: the pair parts 0.4 after the reversal."""
    contact, x, dt, opened = PairContact(), np.array([[0.0, 0.0], [2.0, 0.0]]), 0.02, None
    push = np.array([[1.0, 0.0], [-1.0, 0.0]])
    for n in range(60):
        step = contact.correct(x, 1.0, push if n < 20 else -push, dt)
        x = x + dt * step.velocities
        if opened is None and n >= 20 and x[1, 0] - x[0, 0] > 2.0 + 1e-9:
            opened = n
    assert opened == 40
    assert len(contact.memory) == 0


def test_memory_is_kept_restored_and_reversed() -> None:
    x, towards = [[0.0, 0.0], [2.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]]
    first = PairContact()
    first.correct(x, 1.0, towards, 0.1)
    memory = first.memory
    assert memory.gamma == pytest.approx([-0.1]) and memory.force == pytest.approx([1.0]) and memory.gap is None
    apart = [[-1.0, 0.0], [1.0, 0.0]]
    second = PairContact(periods=(None, None))
    second.memory = memory
    assert (second.correct(x, 1.0, apart, 0.05).velocities == first.correct(x, 1.0, apart, 0.05).velocities).all()
    assert np.abs(second.correct(x, 1.0, apart, 0.01).velocities).max() < 1e-12
    with pytest.raises(ValueError, match="dimension is not known"):
        PairContact().memory = memory
    second.memory = memory
    second.reverse()
    assert second.memory.force == pytest.approx([-1.0])


def test_walls_periods_and_fixed_particles() -> None:
    down = [[0.0, -1.0]]
    floor = PairContact(walls=[((0.0, 0.0), (0.0, 2.0))])
    step = floor.correct([[0.0, 1.05]], 1.0, down, 0.1)
    assert step.velocities == pytest.approx(np.array([[0.0, -0.5]]))
    assert step.contacts.wall.tolist() == [0] and step.contacts.second.tolist() == [-1]
    around = PairContact(periods=(5.0, None))
    step = around.correct([[0.5, 0.0], [4.0, 0.0]], 0.75, [[-1.0, 0.0], [1.0, 0.0]], 0.1)
    assert step.contacts.image.tolist() == [[-1, 0, 0]]
    assert step.velocities == pytest.approx(np.zeros((2, 2)), abs=1e-12)
    held = PairContact(fixed=[0])
    step = held.correct([[0.0, 0.0], [2.0, 0.0]], 1.0, [[0.0, 0.0], [-1.0, 0.0]], 0.1)
    assert step.velocities == pytest.approx(np.zeros((2, 2)), abs=1e-12)


def test_laws_differ() -> None:
    x, towards, apart = [[0.0, 0.0], [2.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]], [[-1.0, 0.0], [1.0, 0.0]]
    kept = {}
    for law in ("none", "inelastic", "gluey"):
        contact = PairContact(law=law)
        pressed = contact.correct(x, 1.0, towards, 0.1).velocities[0, 0]
        kept[law] = (pressed, contact.correct(x, 1.0, apart, 0.1).velocities[0, 0])
    assert kept["none"] == (1.0, -1.0)
    assert kept["inelastic"] == pytest.approx((0.0, -1.0), abs=1e-12)
    assert kept["gluey"] == pytest.approx((0.0, 0.0), abs=1e-12)


def test_bad_input_is_refused() -> None:
    good = {"positions": [[0.0, 0.0], [3.0, 0.0]], "radii": 1.0, "velocities": np.zeros((2, 2)), "dt": 0.1}
    model = PairContact()
    for changes, text in [
        ({"positions": [0.0, 1.0]}, r"positions has the shape \(2,\); expected \(N, 2\)"),
        ({"radii": [1.0]}, r"radii has the shape \(1,\); expected \(2,\)"),
        ({"velocities": np.zeros((2, 3))}, r"velocities has the shape \(2, 3\); expected \(2, 2\)"),
        ({"drift": np.zeros((3, 2))}, "drift has the shape"),
    ]:
        with pytest.raises(ValueError, match=text):
            model.correct(**{**good, **changes})  # type: ignore[arg-type]
    for changes, text in [
        ({"radii": [1.0, -1.0]}, "particle 2 has the radius -1: it must be positive"),
        ({"dt": 0.0}, "must be positive and finite"),
        ({"velocities": [[0.0, np.nan], [0.0, 0.0]]}, "particle 1: its velocity is not finite"),
        ({"positions": [[0.0, 0.0], [0.0, 0.0]]}, "the centres of particles 1 and 2 coincide"),
    ]:
        with pytest.raises(gluey.ContactError, match=text):
            model.correct(**{**good, **changes})  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="unknown contact law `sticky`: expected `none`"):
        PairContact(law="sticky")
    with pytest.raises(ValueError, match="unknown contact solver"):
        PairContact(solver="magic")
    with pytest.raises(ValueError, match="unknown memory"):
        PairContact(memory="long")
    with pytest.raises(ValueError, match="a wall needs a direction"):
        PairContact(walls=[((0.0, 0.0), (0.0, 0.0))])
    with pytest.raises(ValueError, match=r"\[2, 3\] coordinates"):
        PairContact(walls=[((0.0, 0.0), (0.0, 1.0))], periods=(1.0, None, None))
    model.correct(**good)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="positions have 3 coordinates, and had 2 before"):
        model.correct([[0.0, 0.0, 0.0]], 1.0, [[0.0, 0.0, 0.0]], 0.1)


def test_many_particles_on_several_threads_of_python() -> None:
    side = np.arange(40) * 1.9
    x = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    x += 0.2 * np.sin(np.arange(x.size)).reshape(x.shape)
    found: dict[int, np.ndarray] = {}

    def settle(k: int) -> None:
        model, y = PairContact(law="inelastic", exact_gap=False, tolerance=1e-8), x.copy()
        for _ in range(3):
            y += 0.1 * model.correct(y, 1.0, np.zeros_like(y), 0.1).velocities
        found[k] = y

    threads = [threading.Thread(target=settle, args=(k,)) for k in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (found[0] == found[1]).all() and (found[0] == found[2]).all()
    gaps = np.linalg.norm(np.diff(found[0].reshape(40, 40, 2), axis=1), axis=-1) - 2.0
    assert gaps.min() > -1e-2 and np.linalg.norm(np.diff(x.reshape(40, 40, 2), axis=1), axis=-1).min() < 1.9
