"""The largest fixed step against steps that are written down."""

from math import pi

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from symfric.choice.measured import Motion, largest
from symfric.figures.regularisation import Machine
from symfric.integrator import Input, Linear
from symfric.laws import Viscous
from symfric.scenes import Drive

Array = NDArray[np.float64]
C, W, END = 20.0, 4 * pi, 2.0


def exact(t: Array) -> Array:
    """x of v' = sin(W t) - C v from rest."""
    swing = (1 - np.cos(W * t)) * C / W - np.sin(W * t)
    return (swing + (1 - np.exp(-C * t)) * W / C) / (C * C + W * W)


def off(h: float) -> float:
    """Largest error of backward Euler, the force that of the middle of each step."""
    x, v, worst = 0.0, 0.0, 0.0
    for k in range(round(END / h)):
        v = (v + h * np.sin(W * h * (k + 0.5))) / (1 + h * C)
        x += h * v
        worst = max(worst, abs(x - float(exact(np.array(h * (k + 1))))))
    return worst


FINE = np.linspace(0.0, END, 20001)


@pytest.mark.parametrize(("step", "sampled"), [(2e-3, False), (5e-3, True), (2e-2, False)])
def test_it_is_the_largest_round_step_that_stays_near(step: float, sampled: bool) -> None:
    """An error that this step has by a hair, and none that is larger."""
    size = float(np.ptp(exact(FINE)))
    share = 1.02 * off(step) / size
    assert all(off(h) / size > share for h in (2e-3, 5e-3, 1e-2, 2e-2, 5e-2) if h > step)
    push: Input = Linear(FINE, np.sin(W * FINE)) if sampled else lambda t: ca.sin(W * t)  # pyright: ignore
    machine = Machine("drive", Drive, END, u={"force": push})
    motion = Motion(("x",), FINE, exact(FINE)[None, :], np.array([size]))
    model = Drive(Viscous(sigma_2=C), m=1.0, N=1.0).model()
    found, why = largest(machine, model, "backward_euler", motion, share)
    assert why == ""
    assert found == pytest.approx(step)
