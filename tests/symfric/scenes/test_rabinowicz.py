"""The block on the belt: signs, energy, the closed form and an independent integrator."""

from functools import cache

import numpy as np
import pytest
from oracles import StickSlip, rabinowicz_coulomb, rabinowicz_lugre
from scipy.integrate import solve_ivp
from stored import stored

from symfric import (
    ALL_LAWS,
    BrownMcPhee,
    Dahl,
    Law,
    LuGre,
    OverloadWarning,
    SelfTuning,
    Trajectory,
    parameters,
    rabinowicz,
    simulate,
)

M, K, V_BELT, G = 0.8, 2.1, 0.1, 9.81


def ideal(mu_s: float = 0.15, mu_d: float = 0.1) -> StickSlip:
    return rabinowicz_coulomb(mu_s, mu_d, M, K, V_BELT, G)


def test_closed_form_has_the_published_numbers() -> None:
    found = ideal()
    assert found.stick_time == pytest.approx(3.737143, abs=5e-7)
    assert found.slip_time == pytest.approx(2.332852, abs=5e-7)
    assert found.period == pytest.approx(6.069995, abs=5e-7)
    assert (found.x_max, found.x_min) == pytest.approx((0.570501, 0.176927), abs=5e-7)


FITTING = [n for n, kind in ALL_LAWS.items() if {i.name for i in kind().inputs} <= {"F_e"}]


@pytest.mark.parametrize("kind", [ALL_LAWS[name] for name in FITTING], ids=FITTING)
def test_belt_carries_the_block_along_while_friction_opposes_the_slip(kind: type[Law]) -> None:
    run = simulate(rabinowicz(kind()), 0.5, rtol=1e-6)
    assert run["v_rel"][0] == pytest.approx(-V_BELT)
    assert run["friction"][0] < 0
    assert run.final["x"] > 0
    np.testing.assert_allclose(run["v_rel"], run["v"] - V_BELT, atol=1e-15)


def test_mirrored_belt_mirrors_the_motion() -> None:
    one, other = (simulate(rabinowicz(LuGre(), v_belt=v), 8.0, rtol=1e-8) for v in (0.1, -0.1))
    assert other["x"] == pytest.approx(-one["x"], abs=1e-6)


def energy(run: Trajectory) -> np.ndarray:
    return 0.5 * M * run["v"] ** 2 + 0.5 * K * run["x"] ** 2


@pytest.mark.parametrize("law", [BrownMcPhee(v_t=1e-2), LuGre(), Dahl()])
def test_energy_gained_is_work_of_the_belt_less_what_the_contact_takes(law: Law) -> None:
    run = simulate(rabinowicz(law), 9.0, rtol=1e-8, samples=200_001)
    belt = np.trapezoid(-run["friction"] * V_BELT, run.t)
    contact = np.trapezoid(run["power"], run.t)
    gained = energy(run)[-1] - energy(run)[0]
    assert contact > 0
    assert belt > contact
    assert gained == pytest.approx(belt - contact, abs=2e-5 * belt)


def cycle(law: Law, rtol: float = 1e-9) -> tuple[float, float, float]:
    """Period, largest and smallest elongation of the settled stick-slip."""
    run = simulate(rabinowicz(law), 26.0, rtol=rtol, samples=26_001)
    settled, x = run.t > 7.0, run["x"] - ideal().x_centre
    falling = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0))
    share = x[falling] / (x[falling] - x[falling + 1])
    crossings = run.t[falling] + share * np.diff(run.t)[falling]
    inside = run["x"][settled]
    return float(np.diff(crossings)[-1]), float(inside.max()), float(inside.min())


def brown_mcphee_peak() -> float:
    """Its peak misses the static level, which is what its stick-slip tends to."""
    x = np.linspace(0.9, 1.1, 200_001)
    return float(np.max(BrownMcPhee(v_t=1.0).force(x, 1.0)))


WIDTHS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


@cache
def errors(kind: str) -> np.ndarray:
    """Distance of period, x_max and x_min to the closed form, a row per width."""
    if kind == "brown_mcphee":
        target, laws = ideal(mu_s=brown_mcphee_peak()), [BrownMcPhee(v_t=w) for w in WIDTHS]
    else:
        target, laws = ideal(), [SelfTuning.from_peak_velocity(w) for w in WIDTHS]
    expected = target.period, target.x_max, target.x_min
    return np.abs(np.array([cycle(law) for law in laws]) - expected)


@pytest.mark.parametrize("kind", ["brown_mcphee", "self_tuning"])
def test_stick_slip_approaches_the_closed_form_with_the_two_thirds_power_of_the_width(
    kind: str,
) -> None:
    period = errors(kind)[:, 0]
    assert (np.diff(period) < 0).all()
    rates = np.log10(period[:-1] / period[1:])
    assert rates[-2:] == pytest.approx(2 / 3, abs=0.03)
    assert period[-1] < 1.1e-3


@pytest.mark.parametrize("kind", ["brown_mcphee", "self_tuning"])
def test_turning_points_approach_the_closed_form(kind: str) -> None:
    turning = errors(kind)[2:, 1:]
    assert (np.diff(turning, axis=0) < 0).all()
    assert turning[-1] == pytest.approx(0.0, abs=6e-5)


def test_seed_widths_of_brown_mcphee_come_as_close_as_stated() -> None:
    """Against the plain closed form: 1e-5 hits it by chance, between its two errors."""
    periods = [cycle(BrownMcPhee(v_t=w))[0] for w in WIDTHS]
    assert [round(p - ideal().period, 3) for p in periods] == [0.48, 0.097, 0.017, 0.0, -0.003]


@cache
def reference() -> tuple[np.ndarray, np.ndarray]:
    """Times and (x, v, z) of LuGre stick-slip by SciPy's Radau at 1e-12."""
    t = np.linspace(0.0, 8.0, 161)

    def compute() -> np.ndarray:
        run = solve_ivp(
            rabinowicz_lugre(),
            (0.0, 8.0),
            [0.0, 0.0, -0.1 * M * G / 1e5],
            method="Radau",
            rtol=1e-12,
            atol=[1e-15, 1e-15, 1e-19],
            t_eval=t,
        )
        assert run.success
        return run.y

    return t, stored("rabinowicz_lugre", compute)


@pytest.mark.parametrize(("rtol", "error"), [(1e-6, 2e-4), (1e-8, 2e-6), (1e-10, 2e-8)])
def test_lugre_agrees_with_an_independent_integrator(rtol: float, error: float) -> None:
    t, expected = reference()
    run = simulate(rabinowicz(LuGre(v_eps=0.0)), 8.0, t_eval=t, rtol=rtol)
    assert np.abs(run["x"] - expected[0]).max() < error
    assert np.abs(run["v"] - expected[1]).max() < error
    assert np.abs(run["z"] - expected[2]).max() < error * 1e-4


@pytest.mark.parametrize(("v_eps", "error"), [(1e-9, 1e-8), (1e-7, 1e-7), (1e-6, 1e-6)])
def test_smoothing_below_the_creep_changes_nothing_that_counts(v_eps: float, error: float) -> None:
    """The creep while sticking is k v_belt / sigma_0 = 2.1e-6 m/s."""
    t, expected = reference()
    run = simulate(rabinowicz(LuGre(v_eps=v_eps)), 8.0, t_eval=t, rtol=1e-10)
    assert np.abs(run["x"] - expected[0]).max() < error


def test_smoothing_above_the_creep_loses_the_stick_slip() -> None:
    """The limit that the docstring of LuGre states; the default stays a thousand times below."""
    t, expected = reference()
    with pytest.warns(OverloadWarning, match="times its static level"):
        run = simulate(rabinowicz(LuGre(v_eps=1e-5)), 8.0, t_eval=t, rtol=1e-8)
    assert np.abs(run["x"] - expected[0]).max() > 0.1


@pytest.mark.parametrize("v_belt", [0.01, 1e-3])
def test_slow_belts_stick_and_slip_with_the_default_smoothing(v_belt: float) -> None:
    t_end = 8.0 / v_belt * 0.1
    runs = [
        simulate(rabinowicz(LuGre(v_eps=e), v_belt=v_belt), t_end, rtol=1e-8)["x"]
        for e in (parameters(LuGre())["v_eps"].default, 0.0)
    ]
    assert np.abs(runs[0] - runs[1]).max() < 1e-6


def test_block_starts_at_rest_with_sliding_bristles() -> None:
    start = rabinowicz(LuGre()).initial_state()
    assert start == pytest.approx([0.0, 0.0, -0.1 * M * G / 1e5])


def test_free_parameters_become_symbols_with_unit_and_start() -> None:
    model = rabinowicz(BrownMcPhee(), free=["mu_s", "k"], k=3.0)
    assert [(p.name, p.unit, p.start) for p in model.p] == [("mu_s", "1", 0.15), ("k", "N/m", 3.0)]
    one = simulate(model, 3.0, p={"mu_s": 0.2, "k": 2.1}, rtol=1e-8)
    other = simulate(rabinowicz(BrownMcPhee(mu_s=0.2)), 3.0, rtol=1e-8)
    assert one["x"] == pytest.approx(other["x"], abs=1e-6)
