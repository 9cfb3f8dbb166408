"""Mobilities and resistances beside what is known of them."""

from __future__ import annotations

import gluey
import numpy as np
import pytest

TWO = [[0.31, 0.52], [0.64, 0.43]]
THREE = [[0.31, 0.52, 0.5], [0.64, 0.43, 0.47]]
RADII = [0.15, 0.11]


def stokes(dimension: int) -> gluey.Stokes:
    positions = TWO if dimension == 2 else THREE
    return gluey.Stokes(positions, RADII, cells_per_radius=2.9 if dimension == 2 else 1.7, tolerance=1e-9)


@pytest.mark.parametrize("dimension", [2, 3])
def test_matrices_are_those_of_the_reciprocal_theorem(dimension: int) -> None:
    flows, size = stokes(dimension), 2 * (3 if dimension == 2 else 6)
    mobility, resistance = flows.mobility_matrix(), flows.resistance_matrix()
    assert mobility.shape == resistance.shape == (size, size)
    scale = np.abs(mobility).max()
    assert np.abs(mobility - mobility.T).max() < 1e-6 * scale
    assert np.linalg.eigvalsh(0.5 * (mobility + mobility.T)).min() > 0.0
    assert np.abs(mobility @ resistance - np.eye(size)).max() < 1e-4
    # Single flows give the columns.
    generator = np.random.default_rng(1)
    forces = generator.normal(size=(2, dimension))
    torques = generator.normal(size=(2,) if dimension == 2 else (2, 3))
    velocities, spins = flows.mobility(forces, torques)
    assert velocities.shape == forces.shape and spins.shape == torques.shape
    given = np.hstack([forces, torques.reshape(2, -1)]).ravel()
    expected = (mobility @ given).reshape(2, -1)
    assert np.hstack([velocities, spins.reshape(2, -1)]) == pytest.approx(expected, abs=1e-6 * scale)
    back = flows.resistance(velocities, spins)
    assert back[0] == pytest.approx(forces, abs=1e-3) and back[1] == pytest.approx(torques, abs=1e-3)


def test_a_sphere_far_from_walls_is_einsteins() -> None:
    """Walls at ten radii: the drag is Stokes' with the factor of a cube of that size, the stresslet nearly
    that of an unbounded fluid."""
    radius = 0.05
    flows = gluey.Stokes([[0.5, 0.5, 0.5]], radius)
    flow = flows.flow(shear_rate=1.0)
    assert flow.spins[0] == pytest.approx([0.0, 0.0, -0.5], abs=2e-3)
    assert flow.stresslets is not None and flow.stresslets.shape == (1, 3, 3)
    assert flow.stresslets[0] == pytest.approx(flow.stresslets[0].T)
    assert abs(np.trace(flow.stresslets[0])) < 1e-12
    unbounded = 20.0 / 3.0 * np.pi * radius**3 * 0.5
    assert flow.stresslets[0, 0, 1] == pytest.approx(unbounded, rel=0.02)
    velocities, _ = flows.mobility([[1.0, 0.0, 0.0]])
    factor = velocities[0, 0] * 6.0 * np.pi * radius
    # A sphere in the middle of a cube with edges of 20 radii is slower by 1/(1 + 1.95 a/l + ...).
    assert 0.75 < factor < 0.9
    assert flow.unknowns > flow.cells > 100 and flow.iterations > 0


def test_the_boundary_and_the_box_are_as_asked_for() -> None:
    x = [[1.0, 0.5]]
    closed = gluey.Stokes(x, 0.1, box=([0.0, 0.0], [2.0, 1.0]), cells_per_radius=1.6)
    channel = gluey.Stokes(x, 0.1, box=([0.0, 0.0], [2.0, 1.0]), boundary="periodic", cells_per_radius=1.6)
    slow, fast = (flows.mobility([[1.0, 0.0]])[0][0, 0] for flows in (closed, channel))
    assert 0.0 < slow < fast
    # A disc off the middle of a closed box is carried by the shear.
    carried = gluey.Stokes([[1.0, 0.7]], 0.1, box=([0.0, 0.0], [2.0, 1.0])).flow(shear_rate=2.0)
    assert carried.velocities[0, 0] == pytest.approx(2.0 * 0.2, rel=0.1)
    assert carried.forces == pytest.approx(np.zeros((1, 2)))
    coarse = gluey.Stokes(x, 0.1, box=([0.0, 0.0], [2.0, 1.0]), flow={"mesh": {"root_cells": 3}}).flow()
    assert coarse.velocities == pytest.approx(np.zeros((1, 2)))


def test_threads_change_no_bit() -> None:
    one, two = (gluey.Stokes(THREE, RADII, threads=threads, cells_per_radius=1.7) for threads in (1, 2))
    force = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    assert (one.mobility(force)[0] == two.mobility(force)[0]).all()


def test_bad_input_is_refused() -> None:
    with pytest.raises(gluey.CaseError, match="overlap"):
        gluey.Stokes([[0.5, 0.5], [0.55, 0.5]], 0.1)
    with pytest.raises(gluey.CaseError, match="outside|reaches|box"):
        gluey.Stokes([[0.95, 0.5]], 0.1)
    with pytest.raises(gluey.CaseError, match="formulation"):
        gluey.Stokes([[0.5, 0.5]], 0.1, formulation="magic")
    with pytest.raises(gluey.CaseError, match="unknown key `viscosity`"):
        gluey.Stokes([[0.5, 0.5]], 0.1, flow={"viscosity": 2.0})
    with pytest.raises(ValueError, match="boundary 'sheared'"):
        gluey.Stokes([[0.5, 0.5]], 0.1, boundary="sheared")
    with pytest.raises(ValueError, match=r"positions has the shape \(2,\)"):
        gluey.Stokes([0.5, 0.5], 0.1)
    flows = gluey.Stokes([[0.5, 0.5]], 0.2)
    with pytest.raises(ValueError, match=r"forces has the shape \(1, 3\); expected \(1, 2\)"):
        flows.mobility([[1.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match=r"torques has the shape \(1, 3\); expected \(1,\)"):
        flows.mobility(torques=[[1.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="not both"):
        flows.flow(forces=[[1.0, 0.0]], spins=[1.0])
    soft = gluey.Stokes([[0.5, 0.5]], 0.2, formulation="paper")
    assert soft.flow(shear_rate=1.0).stresslets is None
    with pytest.raises(gluey.StokesError, match="not available in this formulation"):
        soft.resistance([[1.0, 0.0]])
