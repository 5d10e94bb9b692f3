"""Records that begin loaded: LuGre's bristle under an imposed velocity."""

import casadi as ca
import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.points import Points
from symfric import LuGre
from symfric.foundation.status import Status

LAW = LuGre(mu_s=0.3, mu_d=0.2, v_s=0.01, sigma_0=1e4, sigma_1=30.0, sigma_2=0.5)
STEP, PARTS = 1e-3, 10


def record(z: float) -> Dataset:
    """Slow first, then back and forth; the bristle begins bent by `z` [m] (midpoint rule)."""
    t = STEP * np.arange(1500)
    v = 0.03 * np.sin(2 * np.pi * 0.7 * t) * t / (t + 0.2)
    a, b, bent = (ca.SX.sym(name) for name in ("a", "b", "z"))
    rate = ca.Function("rate", [a, bent], [ca.SX(LAW.rate(a, 1.0, bent))])
    force = ca.Function("force", [a, bent], [ca.SX(LAW.force(a, 1.0, bent))])
    end, h = bent, STEP / PARTS
    for k in range(PARTS):
        speed = a + (b - a) * (k + 0.5) / PARTS
        end = end + h * rate(speed, end + h / 2 * rate(speed, end))
    step = ca.Function("step", [bent, a, b], [end])
    path = step.mapaccum(t.size - 1)(z, v[:-1], v[1:]).full().ravel()
    F = force(v[None, :], np.append(z, path)[None, :]).full().ravel()
    noise = 2e-3 * np.random.default_rng(0).standard_normal(t.size)
    return Dataset.of(t=t, v=v, F=F + noise, units={"v": "m/s", "F": "N"})


@pytest.mark.parametrize(("load", "loaded"), [(-1.0, True), (0.0, False)])
def test_a_record_that_begins_loaded_is_said_to_be(load: float, loaded: bool) -> None:
    fit = Fit(Points(), "lugre", record(load * 0.2 / 1e4), starts=1).solve(throw=False)
    said = [s for s in fit.verdict.sentences if "the record starts under load" in s]
    assert len(said) == loaded
    assert (fit.status is Status.SOLVED) != loaded
    assert not loaded or said[0].startswith("The residuals of F are ")
