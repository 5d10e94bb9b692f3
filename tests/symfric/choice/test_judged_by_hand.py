"""Rungs, standings, order and verdict of rows that are written down, not measured.

Choices on random machines with parameters over decades.

The references are runs of exact dry friction and of the ranked law at a hundredth of its
tolerance, computed without `select`.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import nan, pi

import casadi as ca
import numpy as np
import pytest

from symfric import ExactCoulomb, Law, Model, Variable, contact, simulate, with_values
from symfric.choice import Friction, select
from symfric.choice.friction import alike
from symfric.choice.measured import _by_data  # pyright: ignore[reportPrivateUsage]
from symfric.choice.nature import needed, otherwise
from symfric.choice.ranking import (
    INACCURATE,
    RANKED,
    REFUSED,
    RankedLaw,
    Ranking,
    number,
    ordered,
    short,
)  # fmt: skip
from symfric.choice.smoothing import (
    MOST,
    NARROW,
    Smoothed,
    SmoothingStudy,
    limit_order,
    smoothing,
    study,
)
from symfric.foundation.parameters import parameters
from symfric.laws import ALL_LAWS, GMS, BrownMcPhee, Gonthier, LeineSwitch, LuGre, steady_force
from symfric.scenes import Rabinowicz

ROW = RankedLaw(
    "a", RANKED, error=1e-5, method="Rodas5P", attempts=10, instructions=100, time_s=1e-3,
    steepness=5.0, smoothness="C∞", c_operations=100, fixed_step=0.01,
)  # fmt: skip


def verdict(rows: Sequence[RankedLaw]) -> tuple[str, ...]:
    choice = Ranking("m", ("stiction",), 1e-4, "", "", 0.0, 0.05, 1.0, tuple(rows), 0.0)
    return choice.verdict


def test_two_runs_in_a_row_must_keep_the_error() -> None:
    """One that keeps it by chance, as where errors change their sign, is not enough."""
    errors = {1.0: 0.1, 0.25: 1e-4, 0.0625: 0.05, 0.0625 / 4: 1e-3, 0.0625 / 16: 1e-4}
    found = study(lambda s: Smoothed(s, errors[s], 1), 2e-3, 2e-3, 1.0, (ValueError,))
    assert [level.s for level in found.levels] == [*errors]
    assert found.softest(2e-3) is not None
    assert found.levels[-2].s <= (found.softest(2e-3) or 0.0) < 0.0625


def test_between_two_rungs_the_error_is_a_power_of_the_smoothing() -> None:
    levels = SmoothingStudy(tuple(Smoothed(s, 3 * s**0.5, 1) for s in (1.0, 0.25, 0.0625)), "")
    assert levels.softest(1.0) == pytest.approx(1 / 9, rel=1e-12)
    assert levels.softest(0.5) is None
    assert levels.softest(9.0) == 1.0


def test_errors_that_stay_the_same_are_followed_by_leaps() -> None:
    """A law whose widths are far above the speeds of a machine looks settled, and is not."""
    found = study(lambda s: Smoothed(s, min(0.4, 1e3 * s), 1), 1e-3, 1e-3, 1.0, (ValueError,))
    assert found.stopped == ""
    assert found.levels[4].s == found.levels[3].s / 4**4
    later = study(lambda s: Smoothed(s, min(0.4, 1e9 * s), 1), 1e-3, 1e-3, 1.0, (ValueError,))
    assert later.stopped == ""


def near(limit: float, order: float, wide: float = 0.0) -> Callable[[float], Smoothed]:
    """Runs of a law that is |limit + s^order| off, and keeps to `limit` + 1 while s > wide."""

    def run(s: float) -> Smoothed:
        off = limit + 0.1 * s**order + (0.3 if s > wide > 0 else 0.0)
        return Smoothed(s, off, 1, motion=np.array([[1 + off]]))

    return run


def test_another_motion_is_reported_only_of_a_limit_with_its_order() -> None:
    """Of runs that converge, narrower than the speeds of a machine, to what is off."""
    for order in (0.5, 1.0, 2.0):
        found = study(near(0.2, order), 1e-3, 1e-3, 1.0, (ValueError,))
        assert found.stopped == f"it tends to another motion, with order {order:g}"
    bristles = study(near(0.2, 0.5), 1e-3, 1e-3, 0.5, (ValueError,))
    assert found.levels[-1].s < NARROW
    assert bristles.levels[-1].s < NARROW**2
    still = study(lambda s: Smoothed(s, 0.4, 1), 1e-3, 1e-3, 1.0, (ValueError,))
    assert still.stopped.startswith("its error still changes")
    assert (still.decided, found.decided) == (False, True)
    later = study(near(0.0, 1.0, wide=1e-8), 1e-3, 1e-3, 0.5, (ValueError,))
    assert later.stopped == ""  # by then its velocities are 1e-4 of what they were
    first = study(near(0.0, 1.0, wide=1e-4), 1e-3, 1e-3, 1.0, (ValueError,))
    assert (first.stopped, first.softest(1e-3) is not None) == ("", True)


def test_no_limit_is_shown_by_neighbours_nor_by_runs_that_do_not_converge() -> None:
    """Two errors that cancel have an extremum, where runs are alike and tend to nothing."""
    law = near(0.2, 1.0)
    assert limit_order([law(s) for s in (1.0, 4.0**-4, 4.0**-8)]) == pytest.approx(1.0, abs=1e-3)
    assert limit_order([law(s) for s in (1.0, 0.25, 0.0625)]) is None
    apart = [
        Smoothed(4.0 ** (-4 * k), 0.2, 1, motion=np.array([[x]])) for k, x in enumerate((0, 1, 3))
    ]
    assert limit_order(apart) is None
    slow = [
        Smoothed(4.0 ** (-4 * k), 0.2, 1, motion=np.array([[x]])) for k, x in enumerate((0, 1, 1.5))
    ]
    assert limit_order(slow) is None  # order 1/8: half of it is left to go


def test_a_law_of_which_nothing_is_scaled_is_run_once() -> None:
    found = study(near(0.2, 1.0), 1e-3, 1e-3, 0.0, (ValueError,))
    assert (len(found.levels), found.stopped) == (1, "nothing of it is scaled")


def test_widths_and_dampings_of_a_bristle_are_scaled_within_their_bounds() -> None:
    """sigma_1^2 / sigma_0 stays; with a fixed v_eps a stiffer bristle would relax no more."""
    law, friction = LuGre(sigma_0=1e5, sigma_1=200.0, v_eps=1e-15), Friction(0.2, 0.1)
    found = parameters(smoothing(law, friction, 10.0).at(0.01))
    assert found["sigma_0"].value == pytest.approx(1e7)
    assert found["sigma_1"].value == pytest.approx(2000.0)
    assert found["v_eps"].value == pytest.approx(1e-17)
    dwell = parameters(smoothing(Gonthier(), friction, 10.0).at(1e-12))
    assert dwell["s_eps"].value == parameters(Gonthier())["s_eps"].lower
    with pytest.raises(ValueError, match="v_t"):  # which shapes the law: another one is refused
        smoothing(BrownMcPhee(), friction, 10.0).at(1e-322)


def test_errors_that_follow_a_power_are_followed_in_strides() -> None:
    """0.5 s^(1/2) is 1e-3 at s = 4e-6: seven runs, where four times each would take eleven."""
    found = study(lambda s: Smoothed(s, 0.5 * s**0.5, 1), 1e-3, 1e-3, 1.0, (ValueError,))
    assert len(found.levels) == 7
    assert [level.s for level in found.levels[:4]] == pytest.approx([1, 1 / 4, 1 / 16, 1 / 1024])
    assert found.softest(1e-3) == pytest.approx(4e-6)


def test_where_a_drier_run_fails_shorter_steps_are_tried() -> None:
    def run(s: float) -> Smoothed:
        if s < 0.1:
            raise ValueError("too dry")
        return Smoothed(s, s, 1)

    found = study(run, 1e-3, 1e-3, 1.0, (ValueError,))
    assert [level.s for level in found.levels] == [1.0, 0.25, 0.125]
    assert found.stopped == "too dry"


def test_an_error_that_falls_too_slowly_is_not_followed_for_ever() -> None:
    found = study(lambda s: Smoothed(s, 0.4 * s**0.01, 1), 1e-3, 1e-3, 1.0, (ValueError,))
    assert len(found.levels) == MOST + 1
    assert found.stopped.startswith("its error still changes")


def test_the_peaks_of_sums_and_products_are_the_static_level() -> None:
    """Of laws whose peak is no parameter: a hyperbola, two hyperbolic tangents, a sum of falls."""
    for name in ("popp_stelter", "makkar_dixon", "bittencourt"):
        friction = Friction(0.3, 0.2)
        law = smoothing(alike(ALL_LAWS[name](), friction, 5.0), friction, 5.0).at(1e-4)
        v = np.geomspace(1e-9, 10.0, 100_001)
        F = steady_force(law, v, 5.0) / 5.0
        near = np.linspace(*(v[F.argmax() + k] for k in (-1, 1)), 2001)
        assert steady_force(law, near, 5.0).max() / 5.0 == pytest.approx(0.3, rel=2e-9)
        assert F[-1] == pytest.approx(0.2, abs=1e-6)


def test_why_a_law_moves_otherwise() -> None:
    dry = Friction(0.15, 0.1)
    assert Friction(0.15, 0.1, v_s=0.05).sliding(0.05) == pytest.approx(0.1 + 0.05 / np.e)
    assert "its friction is 0.115 of the load instead of 0.1" in otherwise(LeineSwitch(), dry, 2.0)
    assert otherwise(GMS(), dry, 2.0) == "its bristle is undamped"
    assert "with time constants (tau_dw)" in otherwise(Gonthier(), dry, 2.0)
    assert otherwise(LuGre(), dry, 2.0) == otherwise(BrownMcPhee(), dry, 2.0) == ""


def test_words_of_papers_are_known() -> None:
    assert needed("n", ["break-away", "Frictional lag", "P"]) == ("stiction", "presliding", "lag")


def test_ranked_laws_are_sorted_by_work_others_by_error_regardless_of_time() -> None:
    rows = [
        replace(ROW, law="slow", attempts=20, time_s=1e-9), replace(ROW, law="fast"),
        replace(ROW, law="alike", attempts=11, time_s=9.0),
        replace(ROW, law="far", standing=INACCURATE, error=0.3, attempts=1),
        replace(ROW, law="near", standing=INACCURATE, error=0.2, attempts=90),
        replace(ROW, law="close", standing=INACCURATE, error=0.21, attempts=80),
        replace(ROW, law="none", standing=REFUSED, attempts=0, error=nan),
    ]  # fmt: skip
    found = {row.law: row.rank for row in ordered(rows)}
    assert list(found.items()) == [
        ("fast", 1), ("alike", 1), ("slow", 3), ("close", 4), ("near", 5), ("far", 6), ("none", 0),
    ]  # fmt: skip
    chain = [replace(ROW, law=name, attempts=n) for name, n in (("x", 100), ("y", 110), ("z", 120))]
    assert [row.rank for row in ordered(chain)] == [1, 1, 3]  # z is alike with y, not with x
    shuffled = [replace(row, time_s=k) for k, row in enumerate(reversed(rows))]
    assert [row.law for row in ordered(shuffled)] == [*found]


def test_the_verdict_names_the_least_work_the_flattest_and_the_cheapest() -> None:
    rows = ordered([
        ROW,
        replace(ROW, law="alike", attempts=11, steepness=2.0),
        replace(ROW, law="later", attempts=20, time_s=5e-4, fixed_step=0.05, c_operations=200),
    ])  # fmt: skip
    fast, smooth, fixed, others = verdict(rows)
    assert fast.startswith("Simulation: take a, ")
    assert fast.endswith("; alike is as good. By the clock later is faster, 0.5 ms.")
    assert smooth.startswith("Optimal control: take alike ")
    assert fixed.startswith("Controller: take later: ")  # 4000 operations a second, not 10000
    assert others == "None is left out."
    near = ordered([ROW, replace(ROW, law="alike", attempts=11, time_s=1e-4)])
    assert verdict(near)[0].endswith("; alike is as good.")
    counted = [replace(row, core=core) for row, core in zip(rows, (20, 300, 600), strict=True)]
    assert "take a: its C takes 20 instructions on a Cortex-M4F" in verdict(counted)[2]


def test_numbers_of_the_table_are_short() -> None:
    assert [short(x) for x in (None, nan, 1.0, 0.0123, 2e5, 3e-12)] == [
        "-", "-", "1", "1e-2", "2e+05", "3e-12",
    ]  # fmt: skip
    assert [number(x) for x in (nan, 123.4, 12.34, 0.1234, 0.0123)] == [
        "-", "123", "12.3", "0.123", "0.01",
    ]  # fmt: skip


def test_laws_are_ranked_that_fit_as_well_as_the_best() -> None:
    misfits = {"a": 0.0109, "b": 0.0111, "c": 0.01}
    a, b = (_by_data(misfits, replace(ROW, law=name)) for name in "ab")
    assert (a.standing, a.error) == (RANKED, 0.0109)
    assert (b.standing, b.reason) == (INACCURATE, "1.11 % off the data, the best 1 %")


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
