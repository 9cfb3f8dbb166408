"""The mobility matrix of three spheres in a box at rest, and what it is good for."""

import gluey
import numpy as np

POSITIONS = np.array([[0.35, 0.5, 0.5], [0.65, 0.5, 0.5], [0.5, 0.72, 0.5]])

if __name__ == "__main__":
    stokes = gluey.Stokes(POSITIONS, radii=0.1, cells_per_radius=1.6)
    mobility = stokes.mobility_matrix()
    print(f"{mobility.shape[0]} velocities and spins by as many forces and torques")
    print(f"asymmetry {np.abs(mobility - mobility.T).max() / np.abs(mobility).max():.1e}")
    print(f"eigenvalues from {np.linalg.eigvalsh(mobility)[0]:.3f} to {np.linalg.eigvalsh(mobility)[-1]:.3f}")

    # All three fall; those at the sides of the lower one are turned by it.
    weights = np.zeros((3, 6))
    weights[:, 1] = -1.0
    twists = (mobility @ weights.ravel()).reshape(3, 6)
    alone = -1.0 / (6.0 * np.pi * 0.1)
    for number, twist in enumerate(twists, start=1):
        print(f"sphere {number} falls at {twist[1] / alone:.3f} of Stokes' velocity and turns at {twist[5]:+.3f}")
