"""Choices on random machines with parameters over decades.

The references are runs of exact dry friction and of the ranked law at a hundredth of its
tolerance, computed without `select`.
"""

import warnings
from collections.abc import Callable, Sequence
from math import pi

import casadi as ca
import numpy as np
import pytest

from symfric import ExactCoulomb, Law, Model, Variable, contact, simulate, with_values
from symfric.choice import Friction, select
from symfric.laws import ALL_LAWS
from symfric.scenes import Rabinowicz

LAWS = ("stribeck", "brown_mcphee", "lugre", "elasto_plastic")
"""Laws that tend to dry friction; `select` must not report another motion for them."""
ACCURACY = 1e-3
STILL = 1e-9
"""A signal that moves by less, in nominal values, is at rest."""
Random = np.random.Generator
Made = tuple[Callable[[Law], Model], float]


def belt(random: Random, mu_s: float, mu_d: float) -> Made:
    """A few cycles of stick and slip, with belts from slow to nearly too fast for them."""
    m, omega = 10 ** random.uniform(-1, 2), 10 ** random.uniform(-0.5, 1.3)
    k, jump = m * omega**2, (mu_s - mu_d) * 9.81
    v_belt = jump / omega * 10 ** random.uniform(-1.5, 0.0)
    cycle = 2 * jump * m / (k * v_belt) + 2 * pi / omega
    t_end = mu_s * m * 9.81 / (k * v_belt) + random.uniform(1.0, 4.0) * cycle
    return lambda law: Rabinowicz(law, m=m, k=k, v_belt=v_belt).model(), t_end


def own(random: Random, mu_s: float, mu_d: float) -> Made:
    """Two masses in a row, the second one on a guide, pulled over a spring."""
    m, N, omega = (10 ** random.uniform(*span) for span in ((-1, 1), (0, 2), (0, 1)))
    k = m * omega**2
    pace = (mu_s - mu_d) * N / (m * omega) * 10 ** random.uniform(-1, -0.3)
    t_end = 2.5 * mu_s * N / (k * pace)

    def model(law: Law) -> Model:
        names = (("a", "m"), ("va", "m/s"), ("b", "m"), ("vb", "m/s"))
        a, va, b, vb = (Variable(n, unit, nominal=0.1) for n, unit in names)
        t = ca.SX.sym("t")
        link = 9 * k * (a.symbol - b.symbol) + 0.3 * m * omega * (va.symbol - vb.symbol)
        guide = contact("guide", law, vb.symbol, N, rest={"vb": 0.0}, F_e=link)
        pull = k * (pace * t - a.symbol)
        rates = va.symbol, (pull - link) / m, vb.symbol, (link - guide.force) / m
        return Model("own", x=(a, va, b, vb), ode=ca.vertcat(*rates), contacts=(guide,), t=t)

    return model, t_end


def judged(seed: int, laws: Sequence[str] = LAWS) -> tuple[int, int]:
    """Return the numbers of laws ranked and run on a random machine, after checks of each rank."""
    random = np.random.default_rng(seed)
    mu_s = 10 ** random.uniform(-1, 0)
    mu_d = mu_s * random.uniform(0.4, 0.9)
    made, t_end = (belt, own)[seed % 2](random, mu_s, mu_d)
    found = select(
        made, laws, t_end=t_end, friction=Friction(mu_s, mu_d), accuracy=ACCURACY,
        fixed_steps=False,
    )  # fmt: skip
    t = np.linspace(0.0, t_end, 2001)
    model = made(ExactCoulomb(mu_s=mu_s, mu_d=mu_d))
    exact = simulate(model, t_end, rtol=1e-9, t_eval=t, backend="vm")
    moved = {v: np.ptp(exact[v.name]) for v in model.x if v.unit in ("m", "rad")}
    sizes = {v.name: x if x > STILL * v.nominal else v.nominal for v, x in moved.items()}
    for row in found:
        assert "another motion" not in row.reason, (seed, row)
        if not row.ranked:
            continue
        law = with_values(ALL_LAWS[row.law](), row.values or {})
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            run = simulate(made(law), t_end, rtol=row.rtol / 100, t_eval=t, backend="vm")
        off = {n: np.abs(run[n] - exact[n]).max() / size for n, size in sizes.items()}
        assert max(off.values()) < 2 * ACCURACY, (seed, off, row)
    return len(found.ranked), len(found.placed)


def test_no_convergent_law_is_reported_to_tend_to_another_motion() -> None:
    assert judged(0, ("stribeck", "lugre")) == (2, 2)


@pytest.mark.slow
def test_thirty_random_machines_are_judged_rightly() -> None:
    counts = np.array([judged(seed) for seed in range(30)])
    assert counts[:, 0].min() >= 2  # smooth laws always get there
    assert counts[:, 0].sum() >= 0.8 * len(LAWS) * 30
