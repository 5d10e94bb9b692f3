"""Ensembles that a graphics processor has to run as the virtual machine does."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from differentiable import oscillator, pendulum, root, switched
from ensembles import explosive

from symfric import BrownMcPhee, Hold, Linear, LuGre, Model, Viscous, rabinowicz
from symfric.scenes import PendulumBox

VELOCITIES = np.linspace(-0.1, 0.1, 7)
TIMES = [0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0]  # the jumps of inputs among them
X = {"x": [0.5, 1.0, 2.0]}
JUMPS = [0.0, 0.3, 0.7], [1.0, -2.0, 3.0]
WEDGES = [np.roots([(1 - r) * 1.001, -0.12, (1 - r) * 1e-3]).max() for r in (0.1, 5e-4)]
"""Slopes at which `wedge` has so much of its normal force left: the second one jams."""


def wedge() -> Model:
    """A light box on its pendulum."""
    law = BrownMcPhee(mu_s=0.12, mu_d=0.12, v_t=1e-3)
    box = PendulumBox(law, hinge=Viscous(sigma_2=0.0), m_box=0.02)
    return box.mechanism().build(formulation="joint", index=1)


CASES: dict[str, tuple[Callable[[], Model], Any, dict[str, Any]]] = {
    "stick and slip": (
        lambda: rabinowicz(BrownMcPhee(), free=["mu_s", "k"]), 9.0,
        {"x0": {"v": VELOCITIES}, "p": {"mu_s": np.linspace(0.12, 0.18, 7), "k": 2.0},
         "t_eval": [0.0, 0.3, 2.71, 9.0]},
    ),
    "ends alone": (lambda: rabinowicz(LuGre()), 9.0, {"x0": {"v": VELOCITIES}}),
    "ends of their own": (
        lambda: rabinowicz(LuGre()), np.linspace(1.0, 4.0, 7), {"x0": {"v": VELOCITIES}},
    ),
    "ends of their own, common times": (
        lambda: rabinowicz(LuGre()), np.linspace(1.0, 4.0, 7),
        {"x0": {"v": VELOCITIES}, "t_eval": [0.5, 2.0, 4.0]},
    ),
    "longest step, times, start behind zero": (
        lambda: rabinowicz(LuGre()), 2.0,
        {"x0": {"v": VELOCITIES}, "t_start": 1.0, "max_step": 0.01, "times": [1.1234, 1.5]},
    ),
    "motions that are tiny": (
        oscillator, 1.0, {"x0": {"x": [1.0, 1e-8, 1e-5], "v": [0.5, 0.0, 0.0]}, "t_eval": TIMES},
    ),
    "linear": (oscillator, 1.0, {"x0": X, "u": {"u": Linear(*JUMPS)}, "t_eval": TIMES}),
    "function of time": (
        oscillator, 1.0, {"x0": X, "u": {"u": lambda t: ca.sin(5 * t)}, "t_eval": TIMES},
    ),
    "a number each": (oscillator, 1.0, {"u": {"u": [1.0, 2.0, -3.0]}, "t_eval": TIMES}),
    "samples each": (
        oscillator, [1.0, 0.4, 0.8],
        {"u": {"u": Hold([0.0, 0.3], np.arange(6.0).reshape(3, 2))}, "t_eval": TIMES},
    ),
    "algebraic unknowns follow": (
        switched, 1.0, {"x0": X, "u": {"u": Hold(*JUMPS)}, "t_eval": TIMES},
    ),
    "algebraic unknowns start": (root, 0.5, {"p": {"p": [0.1, 0.7, 300.0]}, "t_eval": [0.0, 0.2]}),
    "mechanism, one not to be assembled": (
        pendulum, 1.0,
        {"x0": {"x": [0.6, 0.7, 0.6]}, "p": {"l": [1.0, 1.1, 1e200]}, "t_eval": [0.0, 0.5, 1.0]},
    ),
    "friction jams in one": (
        wedge, 1e-3, {"x0": {"x": 0.0, "phi": np.arctan(WEDGES), "x_rate": 1.0, "phi_rate": 0.0}},
    ),
    "too many steps in one": (oscillator, 1.0, {"p": {"k": [1.0, 1e8, 4.0]}, "max_steps": 1000}),
    "some fail": (
        explosive, 1.0, {"p": {"p": [0.1, 2.0, 0.5, 4.0, 0.0]}, "t_eval": [0.1, 1.0]},
    ),
}  # fmt: skip

ALIKE = {"ends of their own, common times", "a number each", "linear", "some fail"}
"""Cases of which others tell most."""
