"""Pleiades: seven stars in a plane, with near collisions; not stiff."""

import casadi as ca

from symfric.bench.problems.problem import Problem, numbered, unknowns
from symfric.model import Model

STARS = 7
START = (
    *(3, 3, -1, -3, 2, -2, 2), *(3, -3, 2, 0, 0, -4, 4),
    *(0, 0, 0, 0, 0, 1.75, -1.5), *(0, 0, 0, -1.25, 1, 0, 0),
)  # fmt: skip


def model() -> Model:
    """Positions x, y and velocities of stars with masses 1 ... 7."""
    states = unknowns(START, [1] * 28)
    every = [v.symbol for v in states]
    x, y, velocities = every[:7], every[7:14], every[14:]

    def pull(along: list[ca.SX], i: int) -> ca.SX:
        """Acceleration of star i."""
        others = (j for j in range(STARS) if j != i)
        return sum(
            (
                (j + 1) * (along[j] - along[i]) / ((x[j] - x[i]) ** 2 + (y[j] - y[i]) ** 2) ** 1.5
                for j in others
            ),
            start=ca.SX(0),
        )

    accelerations = [pull(along, i) for along in (x, y) for i in range(STARS)]
    return Model("pleiades", x=states, ode=ca.vertcat(*velocities, *accelerations))


PROBLEM = Problem(
    "Pleiades",
    model,
    3.0,
    numbered(
        [
            0.3706139143970502,
            0.3237284092057233e1,
            -0.3222559032418324e1,
            0.6597091455775310,
            0.3425581707156584,
            0.1562172101400631e1,
            -0.7003092922212495,
            -0.3943437585517392e1,
            -0.3271380973972550e1,
            0.5225081843456543e1,
            -0.2590612434977470e1,
            0.1198213693392275e1,
            -0.2429682344935824,
            0.1091449240428980e1,
            0.3417003806314313e1,
            0.1354584501625501e1,
            -0.2590065597810775e1,
            0.2025053734714242e1,
            -0.1155815100160448e1,
            -0.8072988170223021,
            0.5952396354208710,
            -0.3741244961234010e1,
            0.3773459685750630,
            0.9386858869551073,
            0.3667922227200571,
            -0.3474046353808490,
            0.2344915448180937e1,
            -0.1947020434263292e1,
        ]
    ),
    digits={1e-6: 3, 1e-10: 7},
)
