"""Random machines that stick and slip: no break-away is lost, whatever their scales.

A block on a belt with mass, stiffness, levels and velocities drawn over decades. A slip is a
stretch faster than a tenth of the fastest sliding; every one of the reference, by another formula
at 1e-10, has to be there. `make stress` runs it.
"""

from math import log10, pi, sqrt

import numpy as np
import pytest

from symfric import BrownMcPhee, Law, LuGre, Model, simulate
from symfric.foundation.numeric import Array
from symfric.scenes import Rabinowicz

SCENES, SEED = 500, 10
CYCLES = 6


def drawn(rng: np.random.Generator) -> tuple[Model, float]:
    """A machine that sticks for part of each of `CYCLES` cycles, and their duration [s]."""

    def decades(low: float, high: float) -> float:
        return float(10 ** rng.uniform(log10(low), log10(high)))

    m, omega, g = decades(1e-2, 1e2), 2 * pi / decades(0.03, 10.0), 9.81
    mu_s = float(rng.uniform(0.1, 1.0))
    mu_d = mu_s * float(rng.uniform(0.4, 0.9))
    fastest = (mu_s - mu_d) * g / omega  # of a slip from break-away, less the belt
    belt = fastest * decades(0.02, 0.3)
    width = belt * decades(1e-4, 3e-2)
    law: Law
    if rng.uniform() < 0.5:
        law = BrownMcPhee(mu_s=mu_s, mu_d=mu_d, v_t=width)
    else:
        stiffness = decades(1e2, 1e4) * m * omega * omega
        law = LuGre(
            mu_s=mu_s, mu_d=mu_d, v_s=width, sigma_0=stiffness, sigma_1=2 * sqrt(m * stiffness)
        )
    stuck = 2 * (mu_s - mu_d) * g / (omega * omega * belt)
    scene = Rabinowicz(law, m=m, k=m * omega * omega, v_belt=belt, g=g)
    return scene.model(), CYCLES * (stuck + 2 * pi / omega)


def slips(
    model: Model, t_end: float, rtol: float, method: str = "auto", samples: int = 20001
) -> tuple[Array, float]:
    """Times [s] at which slips begin, and half of the shortest time between two of them."""
    run = simulate(model, t_end, rtol=rtol, method=method, samples=samples)
    speed = np.abs(run["v_rel"])
    fast = speed > 0.1 * speed.max()
    begins = run.t[1:][fast[1:] & ~fast[:-1]]
    return begins, float(np.diff(begins).min(initial=t_end)) / 2


def lost(model: Model, t_end: float, rtol: float) -> bool:
    """Return True if a slip of the reference is missing, or an extra one is there."""
    expected, near = slips(model, t_end, 1e-10, "rodas4p")
    found, _ = slips(model, t_end, rtol)
    before = t_end - near  # the last one may begin beyond the end
    return (expected < before).sum() != (found < before).sum() or any(
        float(np.abs(found - t).min(initial=np.inf)) > near for t in expected[expected < before]
    )


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*rtol")
@pytest.mark.parametrize(("rtol", "allowed"), [(1e-4, 1), (1e-5, 0), (1e-6, 0)])
def test_no_break_away_of_500_random_machines_is_lost(rtol: float, allowed: int) -> None:
    rng = np.random.default_rng(SEED)
    failed = [k for k in range(SCENES) if lost(*drawn(rng), rtol)]
    assert len(failed) <= allowed, f"machines {failed}"


def test_machines_that_are_drawn_stick_and_slip() -> None:
    """Else the test above would prove nothing."""
    rng = np.random.default_rng(SEED)
    counts = [slips(*drawn(rng), 1e-6, samples=4001)[0].size for _ in range(3)]
    assert min(counts) >= CYCLES // 2
