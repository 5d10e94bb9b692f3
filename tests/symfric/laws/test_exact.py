"""The set-valued form of laws: against closed forms, SciPy and `ExactCoulomb`."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import symfric as sf
from symfric.foundation.numeric import Scalar
from symfric.laws import Exact, smooth


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
