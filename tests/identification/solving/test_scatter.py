"""Starts around a centre, and distant starts that first solve easier problems."""

import casadi as ca
import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.shooting import Shooting
from identification.solving.descent import descend_easier_first
from identification.unknowns.spec import Unknown
from identification.unknowns.unknowns import REACH, Unknowns, scattered, unknowns_of
from symfric import Model, simulate
from symfric.foundation.parameters import Variable
from symfric.foundation.status import Status

UNKNOWNS = [
    Unknown("k", "N/m", 1e5, 1e-12, logarithmic=True, scale=1e5),
    Unknown("c", "N s/m", 30.0, 10.0, 100.0, logarithmic=True),
    Unknown("level", "N", 2.0, 0.0, scale=2.0),
    Unknown("offset", "N", -0.5),
    Unknown("peak", "N", 3.0, 0.0, scale=3.0, above="level"),
    Unknown("x0.x[0]", "m", 0.3, nuisance=True),
    Unknown("dead_time", "s", 0.01, 0.0, 0.02, scale=0.02, nuisance=True),
]


def box() -> Unknowns:
    return unknowns_of(UNKNOWNS, {}, [u.name for u in UNKNOWNS])


def test_starts_stay_in_the_box_and_cover_what_is_bounded() -> None:
    at = box()
    starts = scattered(at, at.start, 21, seed=3)
    values = [at.named(w) for w in starts]
    assert len(starts) == 21
    assert (starts[0] == at.start).all()
    for w, v in zip(starts, values, strict=True):
        assert np.all(w >= at.lower) and np.all(w <= at.upper)
        assert 1e5 / REACH * 0.99 <= v["k"] <= 1e5 * REACH * 1.01
        assert v["peak"] >= v["level"]
        assert abs(v["x0.x[0]"] - 0.3) < 1e-12
    for name, low, high in (("c", 10.0, 100.0), ("dead_time", 0.0, 0.02)):
        found = np.array([v[name] for v in values[1:]])
        share = np.log(found / low) / np.log(high / low) if name == "c" else found / high
        strata = np.floor(np.clip(share, 0, 1 - 1e-9) * 20).astype(int)
        assert len(set(strata.tolist())) >= 19  # one a stratum, but for the margin of the box
    same, other = (scattered(at, at.start, 21, seed=seed) for seed in (3, 4))
    assert np.array_equal(same, starts) and not np.array_equal(other, starts)


Y, V = Variable("y", "m", start=1.0), Variable("v", "m/s")
W, D = (Variable(name, "1/s", start=x, lower=0.0) for name, x in (("w", 9.0), ("d", 0.2)))
SWING = Model(
    "swing",
    x=(Y, V),
    p=(W, D),
    ode=ca.vertcat(V.symbol, -(W.symbol**2) * Y.symbol - D.symbol * V.symbol),
)
T = np.linspace(0.0, 10.0, 501)
TRUTH = {"w": 9.0, "d": 0.02}


def requested() -> Fit:
    """Fourteen periods, from a frequency that is off by a quarter: many minima lie between."""
    y = simulate(SWING, 10.0, p=TRUTH, t_eval=T, rtol=1e-9)["y"]
    y = y + 1e-3 * np.random.default_rng(0).standard_normal(T.size)
    data = Dataset.of(t=T, y=y, units={"y": "m"})
    return Fit(Shooting(), SWING, data, start={"w": 7.0, "d": 0.01}, starts=2)


def test_a_start_far_off_needs_the_windows() -> None:
    prepared = requested().prepared()
    task, first = prepared.task, prepared.centre
    (easier,) = task.easier
    assert len(easier.unknowns.fitted) > len(task.unknowns.fitted)
    straight = descend_easier_first(task, first, 0, 200)
    around = descend_easier_first(task, first, 1, 200)
    assert around.status is Status.SOLVED
    assert task.unknowns.named(around.w)["w"] == pytest.approx(9.0, rel=1e-3)
    assert straight.objective > around.objective + 1000
