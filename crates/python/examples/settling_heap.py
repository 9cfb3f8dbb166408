"""Discs settle onto a floor between two walls, without a fluid: the contact model alone."""

import numpy as np
from gluey.contact import PairContact

WIDTH, COLUMNS, COUNT, STEP = 40.0, 16, 200, 0.25

if __name__ == "__main__":
    number = np.arange(COUNT)
    # A loose lattice out of order, of different discs.
    radii = 0.85 + 0.15 * np.sin(1.7 * number)
    positions = 2.5 * (np.stack([number % COLUMNS, number // COLUMNS], axis=1) + 0.5)
    positions += 0.2 * np.stack([np.sin(4.3 * number), np.sin(2.9 * number)], axis=1)
    walls = [((0.0, 0.0), (0.0, 1.0)), ((0.0, 0.0), (1.0, 0.0)), ((WIDTH, 0.0), (-1.0, 0.0))]
    contact = PairContact(law="inelastic", exact_gap=False, solver="active-set", tolerance=1e-5, walls=walls)

    falling = np.tile([0.0, -1.0], (COUNT, 1))
    for step in range(160):
        found = contact.correct(positions, radii, falling, STEP)
        positions += STEP * found.velocities
        if step % 40 == 39:
            height, speed = positions[:, 1].mean(), np.linalg.norm(found.velocities, axis=1).mean()
            print(f"t = {(step + 1) * STEP:4.0f}: height {height:6.3f}, speed {speed:.3f}, {len(found.contacts)} contacts")
