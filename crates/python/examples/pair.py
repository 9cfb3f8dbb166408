"""The two discs of Verdon et al. (2010), figure 5: what each contact strategy makes of them.

On a mesh that does not resolve the film between them, two discs in shear flow would overlap. Inelastic contact throws
them onto another orbit, gluey contact lets them part as they came.
"""

import gluey

CASE = {
    "name": "pair",
    "dimension": 2,
    "particles": gluey.particles([[0.451, 0.51], [0.549, 0.49]], radii=0.05),
    "time": {"step": 0.1, "end": 15.0},
    "flow": {"formulation": "paper", "mesh": {"cells_per_radius": 3.2}},
}

if __name__ == "__main__":
    print("strategy      smallest gap / a   gap at the end / a")
    for strategy in ("none", "inelastic", "gluey"):
        result = gluey.run(CASE, overrides={"contact.strategy": strategy}, progress=False)
        print(f"{strategy:12} {result.min_gap.min():17.2e} {result.gaps[-1, 0]:20.2e}")
