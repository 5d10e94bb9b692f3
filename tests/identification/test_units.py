"""Fits in other units of force, length and time: the same answer."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from identification import (
    ClosedLoop,
    Dataset,
    Fit,
    Fitted,
    InverseDynamics,
    Points,
    Shooting,
    synthetic_drive_data,
)
from identification.data.record import Record
from identification.solving.task import Point
from symfric import ALL_LAWS
from symfric.foundation.parameters import parameters
from symfric.scenes import Drive

UNITS = [(f, 1.0, 1.0) for f in (1e-9, 1e9)]
UNITS += [(1.0, x, 1.0) for x in (1e-9, 1e9)] + [(1.0, 1.0, t) for t in (1e-9, 1e9)]
"""Sizes of the units of force, length and time."""
Sizes = tuple[float, float, float]
FREE_OF_INPUTS = [name for name, law in ALL_LAWS.items() if not law().inputs]
AMBIGUOUS = ("makkar_dixon", "bittencourt", "leuven", "gonthier", "rate_and_state")
"""Laws with several sets of parameters that fit equally well, of which rounding selects one: equal
terms, terms that only a temperature separates, elements and speeds without influence on steady
sliding; and a law with a lower bound of a coefficient as a number (a >= 1e-6)."""


def size(unit: str, sizes: Sizes, values: Mapping[str, float]) -> float:
    """Return the size of a unit of sliding, by its letters."""
    force, length, time = sizes
    known = {"N": force, "kg": force * time**2 / length, "m": length, "s": time, "degC": 1.0}
    known |= {"rad": length, "K": 1.0, "Pa": force / length**2}
    text = unit.replace("N m", "N").replace("kg m^2", "kg").replace(" ", "*").replace("^", "**")
    return float(eval(text, {"__builtins__": {}}, known | dict(values)))


def of_law(name: str, turns: bool) -> Dataset:
    """Return points of the steady curve of a law with its default numbers."""
    law, rng = ALL_LAWS[name](), np.random.default_rng(0)
    scales = [(p.unit, float(p.value)) for p in parameters(law).values()
              if p.role == "velocity scale" and p.value > 0]  # fmt: skip
    fast = 10 * max([x if u.endswith(("m/s", "rad/s")) else 1 / x for u, x in scales] or [1e-3])
    v = fast * np.concatenate([side * np.geomspace(0.01, 1, 60) for side in (-1, 1)])
    F = np.array([float(ca.DM(law.force(x, 1.0, law.steady_state(x, 1.0)))) for x in v])
    F += 0.005 * np.abs(F).max() * rng.standard_normal(F.size)
    return Dataset.of(v=v, F=F, points=True, units="rad, N m" if turns else "m, N")


def in_units(data: Dataset, sizes: Sizes) -> Dataset:
    def changed(r: Record) -> Record:
        force, length, time = sizes
        signals = {n: y * size(r.units[n] or "1", sizes, {}) for n, y in r.signals.items()}
        loop = r.loop
        if loop is not None:
            gains = {"kp": loop.kp / time, "kv": loop.kv * time / length, "gain": loop.gain * force}
            loop = replace(loop, reference=loop.reference * length, **gains)
        return replace(r, t=None if r.t is None else r.t * time, signals=signals, loop=loop)

    return data.each(changed)


def restated(fit: Fit, held: Mapping[str, float], sizes: Sizes) -> tuple[Fit, dict[str, float]]:
    """Return a fit of a law in other units with values that it holds, and the units of values."""
    known = parameters(Drive(ALL_LAWS[fit.what]()))
    numbers = {n: float(p.value) for n, p in known.items() if len(n) == 1 and p.unit == "1"}
    unit = {n: size(p.unit, sizes, numbers) for n, p in known.items() if p.unit != "rad"}
    kept = [n for n in held if n != "N" and known[n].role != "width"]
    fixed = {n: unit.get(n, 1.0) * held[n] for n in kept}
    data = in_units(fit.data, sizes)
    return replace(fit, data=data, fixed=fixed, normal_force=sizes[0]), unit


def assert_same(kind: Any, law: str, data: Dataset, some: list[Sizes], **given: Any) -> None:
    """Fit in every system of units, and compare values and intervals with those in SI units."""
    asked = Fit(kind, law, data, **given)
    first: Fitted = asked.solve(throw=False)
    held = {n: p.value for n, p in first.parameters.items() if p.fixed}
    for sizes in some:
        again, unit = restated(asked, held, sizes)
        other = again.solve(throw=False)
        assert other.status is first.status, (law, sizes, other.message)
        for name, p in first.parameters.items():
            q, one = other.parameters[name], unit.get(name)
            if p.fixed or one is None or p.low is None or not p.high > p.low:
                continue
            close = 1e-6 * abs(p.value) + 1e-3 * (p.high - p.low)
            assert q.value / one == pytest.approx(p.value, rel=0, abs=close), (law, sizes, name)
            for a, b in ((q.low, p.low), (q.high, p.high)):
                assert a / one == pytest.approx(b, rel=1e-3, abs=close), (law, sizes, name)


def test_units_of_points_do_not_matter() -> None:
    for law, some in (
        ("stribeck", UNITS[::2]),
        ("hollars", UNITS[::2]),
        ("mixed_lubrication", UNITS),
    ):
        assert_same(Points(), law, of_law(law, False), some, starts=1)


def test_units_of_a_force_balance_do_not_matter() -> None:
    slow: Any = {"rate": 500.0, "speeds": (0.004, 0.02, 0.08), "position_noise": 1e-10}
    some = [(1e-9, 1e7, 1.0), (1.0, 1.0, 1e9)]
    assert_same(InverseDynamics(), "stribeck", synthetic_drive_data(seed=1, **slow), some, starts=1)


def test_positive_numbers_below_a_smallest_bound_are_parameters() -> None:
    assert ALL_LAWS["stribeck"](v_s=1e-20, v_eps=0.0).force(1e-19, 1.0) == pytest.approx(
        0.1, rel=1e-9
    )
    for v_s in (0.0, -1e-20):
        with pytest.raises(ValueError, match="v_s: expected 1e-12 <= v_s"):
            ALL_LAWS["stribeck"](v_s=v_s)


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in FREE_OF_INPUTS if n not in AMBIGUOUS])
def test_units_do_not_matter_for_any_law(name: str) -> None:
    turns = any("rad/s" in p.unit for p in parameters(ALL_LAWS[name]()).values())
    assert_same(Points(), name, of_law(name, turns), UNITS)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "law"),
    [
        (InverseDynamics(), "stribeck"),
        (InverseDynamics(), "brown_mcphee"),
        (InverseDynamics(), "lugre"),
        (ClosedLoop(), "stribeck"),
        (ClosedLoop(), "brown_mcphee"),
    ],
)
def test_units_do_not_matter_for_any_residuals(kind: Any, law: str) -> None:
    data = synthetic_drive_data(seed=1).between(0.0, 4.0)
    assert_same(kind, law, data, UNITS, starts=1)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["stribeck", "dahl"])
def test_units_do_not_matter_for_simulated_residuals(law: str) -> None:
    """At the start: a search in one window of 4 s amplifies rounding and ends at its limit."""
    data = synthetic_drive_data(seed=1).between(0.0, 4.0)
    asked = Fit(Shooting(), law, data, starts=1)
    made = asked.prepared()
    first = made.task.at(made.centre)
    assert isinstance(first, Point)
    for sizes in UNITS:
        again = restated(asked, made.subject.held, sizes)[0].prepared()
        other = again.task.at(again.centre)
        assert isinstance(other, Point)
        assert other.cost == pytest.approx(first.cost, rel=1e-6)
        for a, b in ((other.r, first.r), (other.J, first.J)):
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-6 * np.abs(b).max())
