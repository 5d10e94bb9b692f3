"""Laws made of pieces are as smooth at their knots as they say, seen from both sides."""

from math import exp

import casadi as ca
import numpy as np
import pytest
from law_cases import state_symbols

from symfric import Law
from symfric.laws import GMS, Bristle2D, ElastoPlastic, Gonthier, HaessigFriedland, StickSlip

N, V = 8.0, 2e-3
G = N * (0.1 + 0.05 * exp(-4.0))
LEVEL, BENT = N * 0.1, 190.0 * V

KNOTS: dict[str, tuple[Law, int, float, list[float], int]] = {
    "elasto_plastic, break-away": (ElastoPlastic(z_ba=3e-6), 1, 3e-6, [0.0], 2),
    "elasto_plastic, full slip": (ElastoPlastic(z_ba=3e-6), 1, G / 1e5, [0.0], 2),
    "gms, latch begins": (GMS(), 1, 0.97 * G / 4, [0.0] * 4 + [0.5] * 4, 2),
    "gms, latched": (GMS(), 1, G / 4, [0.0] * 4 + [0.5] * 4, 2),
    "gms, unloaded": (GMS(), 1, 0.0, [0.0] * 4 + [0.5] * 4, 2),
    "gms, reversed": (GMS(), 1, -0.2 * G / 4, [0.0] * 4 + [0.5] * 4, 2),
    "gonthier, full direction": (Gonthier(), 0, 1e-4, [0.0, 0.5], 1),
    "haessig_friedland, excess begins to go": (HaessigFriedland(), 1, 0.95 * LEVEL / 1e5, [0.0], 2),
    "haessig_friedland, excess gone": (HaessigFriedland(), 1, LEVEL / 1e5, [0.0], 2),
    "stick_slip, full slip": (StickSlip(), 0, 1e-3, [5e-7], 2),
    "stick_slip, dynamic level": (StickSlip(), 0, 1.5e-3, [5e-7], 2),
    "bristle_2d, saturation begins": (Bristle2D(), 1, (0.98 * G - BENT) / 1e5, [0.0], 2),
    "bristle_2d, saturated": (Bristle2D(), 1, (1.02 * G - BENT) / 1e5, [0.0], 2),
}
"""Law, what varies (0 is v, 1 the first state), the knot, the states, continuous derivatives."""


@pytest.mark.parametrize("name", KNOTS)
def test_derivatives_agree_on_both_sides_up_to_the_stated_order(name: str) -> None:
    law, which, knot, states, order = KNOTS[name]
    v, z = ca.SX.sym("v"), state_symbols(law)
    outputs = ca.vertcat(law.force(v, N, z), law.rate(v, N, z))
    x = v if which == 0 else z[0]
    rows = [outputs]
    for _ in range(order + 1):
        rows.append(ca.jacobian(rows[-1], x))
    f = ca.Function("f", [v, z], [ca.horzcat(*rows)])
    scale = abs(knot) or G / 4

    def at(place: float) -> np.ndarray:
        point = [place, states] if which == 0 else [V, [place, *states[1:]]]
        return f(*point).full() * scale ** np.arange(order + 2)

    left, right = at(knot - 1e-10 * scale), at(knot + 1e-10 * scale)
    size = np.abs(np.stack([left, right])).max(axis=(0, 2), keepdims=True)[0]
    gap = np.abs(right - left) / np.maximum(size, 1e-300)
    assert gap[:, : order + 1].max() < 1e-6
    assert gap[:, order + 1].max() > 1e-3, "a knot that is no knot shows nothing"
