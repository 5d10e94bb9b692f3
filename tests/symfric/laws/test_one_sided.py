"""One side of v = 0: what laws tend to as their widths vanish, and what rest then holds.

The set-valued form of laws: against closed forms, SciPy and `ExactCoulomb`.
"""

from itertools import product

import casadi as ca
import numpy as np
import pytest
from law_cases import CASES, given_inputs
from scipy.integrate import solve_ivp

import symfric as sf
from symfric.foundation.numeric import Scalar
from symfric.laws import Exact, smooth
from symfric.laws.base.law import FORCE

N = 7.848
REFUSED = ("wojewoda", "rate_and_state", "rate_and_state, slip")
LIMITED = {name: law for name, law in CASES.items() if name not in REFUSED}


def path_peak() -> float:
    """Return the top of the force of `BlimanSorine` along a slow slide from rest."""
    path = np.linspace(0.0, 1e-4, 200001) / 1e-5
    return float(N * np.max(0.3 * (1 - np.exp(-path / 0.4)) - 0.2 * (1 - np.exp(-path))))


HELD = {
    "lugre+dahl": 0.25 * N, "load_dependent(lugre)": 0.15 * (2.0 + 0.5 * N),
    "asymmetric(lugre)": 0.15 * N, "armstrong": 0.15 * N, "bliman_sorine, order 1": 0.3 * N,
    "temperature_dependent(lugre)": 0.15 * N * np.exp(-0.1), "lagged(stribeck)": 0.15 * N,
    "bliman_sorine": path_peak(), "maxwell_slip": 0.1 * N, "maxwell_slip, event": 0.1 * N,
    "maxwell_slip, n 2": 0.1 * N,
}  # fmt: skip
"""Static levels of dynamic laws that are not mu_s N, or mu_d N where there is no mu_s."""


def narrowed(law: sf.Law, share: float) -> sf.Law:
    """Return the law with layers that are `share` of what they were."""
    known = sf.parameters(law)
    return sf.with_values(law, {n: known[n].value * share**e for n, e in law.widths.items()})


def further(law: sf.Law) -> dict[str, float]:
    """Return further inputs but the applied force."""
    return {n: x for n, x in given_inputs(law).items() if n != FORCE}


def test_sliding_is_the_force_outside_of_a_thin_layer() -> None:
    for (name, law), side in product(LIMITED.items(), (1, -1)):
        thin = narrowed(law, 1e-7)
        for v in side * np.array([1e-3, 2e-2, 0.7] if law.widths else [1e-2, 0.7]):
            z = thin.steady_state(v, N)
            found = float(thin.sliding(v, N, side, **further(law)))
            force = float(thin.force(v, N, z, **given_inputs(law)))
            assert found == pytest.approx(force, rel=1e-4), name
            assert found == pytest.approx(law.sliding(v, N, side, **further(law)), rel=1e-12), name


def test_derivatives_at_rest_are_those_of_the_side() -> None:
    """Derivatives up to order two are finite at v = 0; the slope is the one-sided quotient."""
    for (name, law), side in product(LIMITED.items(), (1, -1)):
        v = ca.SX.sym("v")
        F = ca.SX(law.sliding(v, N, side, **further(law)))
        slope = ca.gradient(F, v)
        at = ca.Function("at", [v], [ca.vertcat(F, slope, ca.gradient(slope, v))])
        h = side * 1e-8
        found = at(ca.DM([[0.0, h, 2 * h, -side * 10.0]])).full()
        assert np.isfinite(found[:, [0, 3]]).all(), name
        if "delta 0.78" in name:  # infinite: its power is rounded over 1e-6 v_s
            continue
        quotient = (4 * found[0, 1] - found[0, 2] - 3 * found[0, 0]) / (2 * h)
        size = abs(found[0, 0])
        assert found[1, 0] == pytest.approx(quotient, rel=2e-3, abs=2e-3 * size), name


def test_static_level_is_the_top_of_a_thin_layer() -> None:
    for (name, law), side in product(LIMITED.items(), (1, -1)):
        if law.states or not law.widths:
            continue
        rounded = {n: 0.0 for n in ("u_eps",) if n in sf.parameters(law)}
        thin = narrowed(sf.with_values(law, rounded), 1e-7)
        v = side * np.concatenate([np.geomspace(1e-16, 1e-6, 20001), [0.0]])
        pull = {FORCE: side * 1e3} if FORCE in given_inputs(law) else {}
        F = thin.force(v, N, thin.steady_state(v, N), **{**given_inputs(law), **pull})
        wanted, top = law.static_level(N, side, **further(law)), np.max(side * np.asarray(F))
        if name == "quarter_car_general":  # the force at rest, unless that is beyond F_brk
            wanted = 0.001 * 28900.0 + 0.05 * 260.0
            top = thin.force(0.0, N, **further(law))
        assert float(wanted) == pytest.approx(top, rel=2e-3), name


def test_static_level_of_a_law_with_states() -> None:
    for name, law in LIMITED.items():
        if law.states:
            known = sf.parameters(law)
            mu = next((known[n].value for n in ("mu_s", "mu_s_pos", "mu_d") if n in known), 0.0)
            assert float(law.static_level(N)) == pytest.approx(HELD.get(name, mu * N)), name
    assert CASES["bouc_wen"].static_level(N) == CASES["bouc_wen"].sliding(1.0, N, 1)


def test_laws_without_the_limit_give_the_reason() -> None:
    class Own(sf.Viscous):  # pyright: ignore[reportGeneralTypeIssues]
        outside = sf.Law.outside

    for law in (*(CASES[name] for name in REFUSED), sf.QuarterCarGeneral(form="as_printed"), Own()):
        for ask in (lambda law=law: law.sliding(0.1, N, -1), lambda law=law: law.static_level(N)):
            with pytest.raises(
                ValueError, match=f"{type(law).__name__}: expected .* got"
            ) as caught:
                ask()
            reason = {"Own": "write its method `outside", "QuarterCarGeneral": "as printed"}
            assert reason.get(type(law).__name__, "got one without") in str(caught.value)


def test_widths_have_flat_names_and_no_zeros() -> None:
    widths = {
        sf.BrownMcPhee(): {"v_t": 1},
        sf.SelfTuning(): {"B": -1},
        sf.Stribeck(v_eps=0.0): {},
        sf.Karnopp(): {"D_v": 1},
        sf.Sum((sf.Coulomb(), sf.Stribeck(), sf.Viscous())): {"v_eps_1": 1, "v_eps_2": 1},
        sf.Asymmetric(sf.Stribeck(), sf.Stribeck(mu_s=0.3)): {
            "v_blend": 1,
            "v_eps_pos": 1,
            "v_eps_neg": 1,
        },
    }
    assert {law: law.widths for law in widths} == widths


def test_levels_and_curves_of_both_sides() -> None:
    pair = sf.Asymmetric(sf.Stribeck(), sf.Stribeck(mu_s=0.3))
    assert (pair.static_level(10.0), pair.static_level(10.0, -1)) == (1.5, 3.0)
    assert pair.sliding(0.0, 10.0, -1) == -3.0
    belt = sf.Capstan(mu_d=0.1, beta=1.0)
    assert belt.static_level(1.0) == pytest.approx(np.exp(0.1) - 1)
    assert belt.static_level(1.0, -1) == pytest.approx(1 - np.exp(-0.1))
    assert belt.sliding(-1.0, 1.0, -1) == pytest.approx(np.exp(-0.1) - 1)
    # velocities that are no widths stay
    assert sf.Stribeck(v_s=0.1).sliding(0.1, 1.0, 1) == pytest.approx(0.1 + 0.05 * np.exp(-1))
    steep = sf.MakkarDixon(gamma_3=10.0).sliding(-0.1, 1.0, -1)
    assert steep == pytest.approx(-(0.5 * (1 - np.tanh(1.0)) + 1.0))
    for kind in (sf.Hollars, sf.Exudyn):  # rounding a peak takes what the docstring says
        v = np.geomspace(1e-4, 1e-1, 20001)
        assert 0.02 < 1 - np.max(kind().force(v, 1.0)) / kind().static_level(1.0) < 0.06


class Falling(sf.StaticLaw):
    """A user's law, F = N sign(v) / (1 + |v|)."""

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        return self.outside(smooth.magnitude(v, 1e-3), N) * smooth.sign(v, 1e-3)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        return N / (1.0 + speed)


def by_events(t_end: float, start: tuple[float, float]) -> tuple[list[float], int]:
    """Oscillator x'' = -x - F on a belt at 1 m/s by SciPy, with the number of mode changes."""

    def pulled(_: float, y: np.ndarray) -> float:
        return 1.0 - abs(y[0])

    t, y, mode, changes = 0.0, np.array(start), -1, 0
    while t < t_end:

        def rates(_: float, y: np.ndarray, mode: int = mode) -> list[float]:
            slip = y[1] - 1.0
            return [y[1], -y[0] - mode / (1.0 + mode * slip) if mode else 0.0]

        def stopped(_: float, y: np.ndarray, mode: int = mode) -> float:
            return mode * (y[1] - 1.0)

        event = stopped if mode else pulled
        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        run = solve_ivp(rates, (t, t_end), y, method="DOP853", rtol=1e-13, atol=1e-14, events=event)
        t, y = float(run.t[-1]), run.y[:, -1].copy()
        if run.status == 1:
            changes, y[1] = changes + 1, 1.0
            mode = 0 if mode and abs(y[0]) <= 1.0 else -int(np.sign(y[0]))
    return y.tolist(), changes


def test_oscillator_of_a_user_on_a_belt() -> None:
    # Acary and Brogliato 2008: friction that decreases with the sliding velocity
    x, v = sf.Variable("x", "m"), sf.Variable("v", "m/s", start=-0.2)
    belt = sf.contact("belt", Exact(Falling()), v.symbol - 1.0, 1.0)
    rates = ca.vertcat(v.symbol, -x.symbol - belt.force)
    model = sf.Model("oscillator", x=(x, v), ode=rates, contacts=(belt,))
    wanted, changes = by_events(30.0, (0.0, -0.2))
    assert changes > 5
    for rtol, error in ((1e-7, 1e-6), (1e-11, 1e-9)):
        run = sf.simulate(model, 30.0, rtol=rtol)
        assert run.statistics.events == changes
        assert [run.final["x"], run.final["v"]] == pytest.approx(wanted, abs=error)


def test_exact_coulomb_is_a_case() -> None:
    levels = {"mu_s": 0.15, "mu_d": 0.1, "v_s": 1e-2}
    for law in (sf.Stribeck(**levels), sf.LuGre(**levels)):
        one = sf.simulate(sf.rabinowicz(Exact(law)), 20.0)
        other = sf.simulate(sf.rabinowicz(sf.ExactCoulomb(**levels, form="stribeck")), 20.0)
        assert one.final["x"] == pytest.approx(other.final["x"], abs=1e-9)
        assert one.statistics.events == other.statistics.events > 3


def test_smooth_laws_tend_to_it() -> None:
    wanted = sf.simulate(sf.rabinowicz(Exact(sf.BrownMcPhee(v_t=1e-2))), 5.0)["x"]
    errors = []
    for v_t in (1e-3, 1e-4, 1e-5):
        run = sf.simulate(sf.rabinowicz(sf.BrownMcPhee(v_t=v_t)), 5.0, rtol=1e-9)
        errors.append(np.max(np.abs(run["x"] - wanted)))
    assert errors[0] > 5 * errors[1] > 25 * errors[2]


def test_each_side_has_its_level() -> None:
    law = sf.Asymmetric(sf.Coulomb(mu_d=0.1), sf.Coulomb(mu_d=0.3))
    t, v = ca.SX.sym("t"), sf.Variable("v", "m/s")
    for side, level in ((1.0, 1.0), (-1.0, 3.0)):  # a pull of t N on a mass under 10 N
        guide = sf.contact("guide", Exact(law), v.symbol, 10.0)
        rate = (side * t - guide.force) / 2.0
        run = sf.simulate(sf.Model("pull", t=t, x=(v,), ode=rate, contacts=(guide,)), 5.0)
        assert [time for time, _ in run.happened] == pytest.approx([level], abs=1e-9)
        assert run.final["v"] == pytest.approx(side * (5.0 - level) ** 2 / 4.0, rel=1e-9)


def test_all_laws_with_a_sliding_force_have_an_exact_form() -> None:
    refused = set[str]()
    for name, law in sf.ALL_LAWS.items():
        try:
            exact = Exact(law())
        except ValueError as error:
            refused.add(name)
            assert "expected a law with a sliding force" in str(error)
            continue
        assert [s.name for s in exact.states] == ["mode"]
        for side in (1, -1):
            z = np.array([float(side)])
            inputs = {i.name: i.steady for i in exact.inputs if i.name != "F_e"}
            found = exact.force(0.02 * side, 3.0, z, F_e=0.0, **inputs)
            assert found == law().sliding(0.02 * side, 3.0, side, **inputs), name
            assert exact.force(0.0, 3.0, 0.0 * z, F_e=0.1 * side) == 0.1 * side, name
    assert refused == {"wojewoda", "rate_and_state"}


class Stiff(sf.Law):
    """A user's law whose methods return unsuitable values."""

    @property
    def states(self) -> tuple[sf.State, ...]:
        return (sf.State("z", "m", 1e-6),)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        return N * ca.tanh(v)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        return [v if v > 0 else -v]

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        return np.zeros(1)


def test_unsuitable_methods_of_a_user_are_refused() -> None:
    v, law = np.linspace(-1.0, 1.0, 5), Stiff()
    for call, text in (
        (lambda: law.rate(0.1, 1.0, 0.0), "Stiff.rate: expected .*column.*write ca.vertcat"),
        (lambda: law.rate(ca.SX.sym("v"), 1.0, 0.0), "a condition that Python evaluates"),
        (lambda: law.force(v, v[:4], np.zeros((1, 5))), "an array .* write it with symfric"),
    ):
        with pytest.raises(ValueError, match=text):
            call()
    assert float(law.force(0.1, 2.0, 0.0)) == pytest.approx(2.0 * np.tanh(0.1))
    assert sf.Law.facts.phenomena == ()
