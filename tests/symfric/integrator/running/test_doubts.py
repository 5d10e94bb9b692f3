"""Runs warn of friction above its level, and of nothing else.

Every failure is one sentence: when, which equation, what to do; and keeps what was reached.
"""

import warnings
from dataclasses import dataclass
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import each_backend

import symfric as sf
from symfric import Model, Status, Variable, simulate
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import parameters
from symfric.integrator.running import doubts, record
from symfric.integrator.running.diagnosis import chattering
from symfric.integrator.running.doubts import places
from symfric.laws import ALL_LAWS, Asymmetric, LoadNormalised, Sum
from symfric.scenes import ALL_SCENES, Drive, Rabinowicz
from symfric.scenes.base import Scene

SLOW = {"m": 2.0, "k": 37.0, "v_belt": 0.03}
"""A belt with a load that grows by 1.1 N/s, of 6.5 N at break-away."""


@cache
def block(**of_law: float) -> sf.Model:
    law = sf.LuGre(mu_s=0.33, mu_d=0.21, **{"v_s": 1e-8, "sigma_1": 2e7, **of_law})
    return Rabinowicz(law, **SLOW).model()


def quiet(*arguments: Any, **keywords: Any) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("error", sf.OverloadWarning)
        return sf.simulate(*arguments, **keywords)


def test_a_bristle_that_creeps_below_its_width_is_reported() -> None:
    """k v_belt / sigma_0 = 1.1e-16 m/s is below v_eps = 1e-15: it stretches, and never slides."""
    with pytest.warns(
        sf.OverloadWarning, match="contact 'belt' LuGre carries 2.29 times"
    ) as reported:
        run = sf.simulate(block(sigma_0=1e16), 20.0, rtol=1e-7)
    assert len(reported) == 1
    assert run.status.ok
    assert "2.29 times" in run.doubts and run.doubts in run.message
    top = np.abs(run.at(run.step_times)["friction"]).max() / (0.33 * 2.0 * 9.81)
    assert f"{top:.3g}" == "2.29"
    assert "In doubt" in sf.report(run)
    assert quiet(block(sigma_0=1e16, v_eps=1e-18), 20.0, rtol=1e-7).doubts == ""


@cache
def swinging(v_eps: float, amplitude: float = 0.5) -> sf.Model:
    """A mass pulled ever harder over a contact whose load swings."""
    x, v, t = (
        sf.Variable("x", "m", nominal=0.1),
        sf.Variable("v", "m/s", nominal=0.1),
        ca.SX.sym("t"),
    )
    place = sf.contact(
        "pad", sf.LuGre(mu_s=0.33, mu_d=0.21, sigma_1=300.0, v_eps=v_eps), v.symbol,
        10 * (1 + amplitude * ca.sin(9 * t)), rest={"v": 0.0},
    )  # fmt: skip
    ode = ca.vertcat(v.symbol, 5 * t - 40 * x.symbol - place.force)
    return sf.Model("swinging", x=(x, v), ode=ode, contacts=(place,), t=t)


def test_it_is_seen_where_the_load_varies_and_no_drop_of_it_is_taken_for_it() -> None:
    (held,) = places(swinging(1e-15))
    assert held.screen is None
    assert quiet(swinging(1e-15), 4.0).doubts == ""
    with pytest.warns(sf.OverloadWarning, match="contact 'pad'"):
        sf.simulate(swinging(1e-3), 4.0)


def test_a_long_run_whose_steps_are_not_kept_is_looked_at(monkeypatch: Any) -> None:
    monkeypatch.setattr(record, "MOST_BYTES", 1000)
    monkeypatch.setattr("symfric.integrator.running.run.MOST_BYTES", 1000)
    with pytest.warns(sf.OverloadWarning, match="2.29 times"):
        sf.simulate(block(sigma_0=1e16), 20.0, rtol=1e-7, t_eval=[0.0, 1.0])


def test_an_ensemble_warns_once_and_names_the_members() -> None:
    law = sf.LuGre(mu_s=0.33, mu_d=0.21, v_s=1e-8, sigma_1=2e7)
    model = Rabinowicz(law, **SLOW).model(free=["sigma_0"])
    with pytest.warns(
        sf.OverloadWarning, match="2 of 3 members, the first is 1: .* 2.29"
    ) as reported:
        study = sf.simulate_many(model, 20.0, p={"sigma_0": [1e15, 1e16, 1e17]}, rtol=1e-7)
    assert len(reported) == 1
    assert [*study.doubtful] == [1, 2]
    assert "doubtful: 2" in repr(study)


def test_what_states_may_carry_or_a_user_starts_with_is_no_overload() -> None:
    """Behind a reversal both parts of Bliman and Sorine point the same way."""
    force = {"force": lambda t: 6 * ca.sin(3 * t)}
    law = sf.BlimanSorine(mu_1=0.41, mu_2=0.33, eta=0.27, s_f=6e-6)
    for other in (law, Sum((law, law)), Asymmetric(law, law), LoadNormalised(law, N_0=10.0)):
        assert quiet(Drive(other).model(), 3.0, u=force).doubts == ""
    assert quiet(Drive(sf.LuGre()).model(), 0.1, x0={"z": 1e-4}).doubts == ""


@pytest.mark.parametrize(
    "law", [sf.Dahl(v_eps=1e-2), sf.ElastoPlastic(v_eps=1e-2), sf.GMS(v_eps=1e-2)]
)
def test_every_bristle_is_looked_at(law: sf.Law) -> None:
    with pytest.warns(sf.OverloadWarning, match=type(law).__name__):
        sf.simulate(Rabinowicz(law, v_belt=1e-3, k=100.0).model(), 40.0)


def alarms(seed: int, runs: int) -> list[str]:
    """Random laws of random parameters in scenes, at random tolerances: what they are warned of."""
    random = np.random.default_rng(seed)
    kinds = [kind for kind in ALL_LAWS.values() if kind().states]
    names = ("rabinowicz", "drive", "coupled_blocks", "pendulum_box", "four_mass", "clutch")
    found = list[str]()
    for _ in range(runs):
        law, scene = kinds[random.integers(len(kinds))](), names[random.integers(len(names))]
        wide, rtol = random.uniform(0.0, 1.5), 10 ** random.uniform(-8, -3)
        known = [p for p in parameters(law).values() if p.value and p.role != "width"]
        try:
            law = sf.with_values(
                law, {p.name: float(p.value) * 10 ** random.uniform(-wide, wide) for p in known}
            )
            with warnings.catch_warnings(record=True) as reported:
                warnings.simplefilter("always")
                kind = ALL_SCENES[scene]
                u = {n: i.function for n, i in kind.inputs.items()}
                model = kind(law).model()
                sf.simulate(
                    model, min(kind.t_end, 5.0), rtol=rtol, max_steps=10_000, u=u, backend="vm"
                )
        except (ValueError, sf.SolveError):
            continue
        found += [
            f"{law} in {scene}: {w.message}" for w in reported if w.category is sf.OverloadWarning
        ]
    return found


def test_random_laws_are_not_doubted() -> None:
    assert alarms(1, 4) == []


@pytest.mark.slow
def test_hundreds_of_random_laws_are_not_doubted() -> None:
    assert alarms(2, 600) == []


@dataclass(frozen=True, eq=False)
class Pushing(sf.BrownMcPhee):
    """A law whose author forgot that friction is positive where it opposes the slip."""

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        return -super().force(v, N, z)


@pytest.mark.parametrize(
    ("machine", "u"),
    [
        (Rabinowicz(Pushing()), {}),
        (Drive(Pushing()), {"force": 30.0}),
        (Rabinowicz(Pushing(mu_d=0.1)), {}),
    ],
)
def test_friction_that_adds_energy_is_reported(machine: Scene, u: dict[str, float]) -> None:
    with pytest.warns(sf.EnergyWarning, match=r"by Pushing adds \d\S* J .* check its sign"):
        run = sf.simulate(machine.model(), 2.0, u=u)
    assert run.status is sf.Status.SUCCESS
    assert run.doubts in run.message and "along the slip" in run.doubts


PLAIN = [n for n, law in ALL_LAWS.items() if {i.name for i in law().inputs} <= {"F_e"}]


@pytest.mark.parametrize("name", PLAIN)
def test_steady_friction_of_no_law_adds_energy(name: str) -> None:
    model = Drive(ALL_LAWS[name]()).model()
    for sliding in doubts.sliding_places(model):
        assert not sliding.suspect(model.values("p"))


def test_a_bound_of_zero_is_exceeded_by_a_share_of_the_nominal_value() -> None:
    x = sf.Variable("x", "m", start=1.0, lower=0.0)
    model = sf.Model("falling", x=(x,), ode=ca.SX(-1.0))
    assert not sf.simulate(model, 1.0005).doubts
    with pytest.warns(sf.LimitWarning, match=r"x from t = 1 s, up to -0\.1 m"):
        sf.simulate(model, 1.1)


@pytest.mark.parametrize(("samples", "first"), [(sf.Hold, "2"), (sf.Linear, "1.5")])
def test_samples_of_an_input_exceed_its_bounds_from_the_right_time(
    samples: type, first: str
) -> None:
    x, u = sf.Variable("x", "m"), sf.Variable("u", "m/s", lower=-1.0, upper=1.0)
    model = sf.Model("moved", x=(x,), u=(u,), ode=u.symbol)
    with pytest.warns(sf.LimitWarning, match=f"u from t = {first} s, up to 2 m/s"):
        sf.simulate(model, 4.0, u={"u": samples((0.0, 1.0, 2.0, 3.0), (0.0, 0.0, 2.0, 0.0))})


def test_laws_are_not_inserted_for_friction_that_only_brakes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = list[str]()
    monkeypatch.setattr(doubts, "by_laws", lambda model, _: asked.append(model.name))
    sf.simulate(ALL_SCENES["arm"](sf.LuGre()).model(), 1e-3, backend="vm", samples=2)
    assert asked == []


def test_a_second_run_derives_no_friction_again(monkeypatch: pytest.MonkeyPatch) -> None:
    model = Rabinowicz(Pushing()).model()
    for _ in range(2):
        with pytest.warns(sf.EnergyWarning):
            sf.simulate(model, 2.0, samples=2)
        monkeypatch.setattr(doubts, "_determined", None)


def test_bristles_that_return_stored_energy_are_not_reported() -> None:
    """A block at rest on stretched bristles: at first friction does nothing but push it."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", sf.EnergyWarning)
        run = sf.simulate(Drive(sf.LuGre(sigma_1=0.0)).model(), 0.01, x0={"z": 5e-6})
    assert run["friction"][0] * run["v"][1] < 0


t = ca.SX.sym("t")
x, y, z = Variable("x", "m"), Variable("y", "m", start=1.0), Variable("z", "1", start=1.0)
X, Y, Z = x.symbol, y.symbol, z.symbol


def ode(*rates: ca.SX | float) -> Model:
    return Model("edge", x=(x, y), ode=ca.vertcat(*rates), t=t)


def dae(rate: ca.SX, alg: ca.SX) -> Model:
    return Model("edge", x=(x,), z=(z,), ode=rate, alg=alg, t=t)


SLIDE = Model("slide", x=(y,), ode=-ca.sign(Y))
SWITCH = Model("edge", x=(x,), ode=ca.if_else(X < 0.5, 1, -1e12))
"""Sliding on a switch a trillion times faster than the approach to it."""

Failure = tuple[Model, dict[str, Any], Status, float, str]
NAN, SMALL, SINGULAR = Status.NOT_FINITE, Status.STEP_TOO_SMALL, Status.SINGULAR
FAILURES: dict[str, Failure] = {
    # x = t, and an equation for y that fails somewhere
    "root": (ode(1, ca.sqrt(1 - X)), {}, NAN, 1.0, "the .*equation of y "),
    "logarithm": (ode(1, ca.log(1 - X)), {}, NAN, 1.0, "the .*equation of y "),
    "power": (ode(1, (1 - X) ** 1.5), {}, NAN, 1.0, "the .*equation of y "),
    "root of time": (ode(1, ca.sqrt(1.5 - t)), {}, NAN, 1.5, "the .*equation of y "),
    "first, at once": (
        ode(1 / X, -Y), {}, NAN, 0.0, "the equation of x returned NaN or infinity"
    ),
    "second, at once": (ode(-X, ca.log(X)), {}, NAN, 0.0, "the equation of y returned"),
    "both, at once": (ode(1 / X, Y / X), {}, NAN, 0.0, "the equation of x, y returned"),
    # the root itself is finite, and its slope infinite where the tank runs empty
    "slope": (ode(1, -ca.sqrt(Y)), {"t_end": 3.0}, NAN, 2.0, ".*equation of y"),
    # no state depends on the unknown
    "unknown": (dae(-X, Z - ca.log(1 - t)), {}, NAN, 1.0, ".*equation of z"),
    # y' = y^n from 1 is infinite at t = 1 / (n - 1)
    "square": (
        ode(-X, Y**2), {}, SMALL, 1.0, r".*y = .*grows without bound; check signs and param"
    ),
    # y is infinite as a double at t = 0.70978, and products of it before
    "exponential": (ode(-X, 1e3 * Y), {}, SMALL, 0.7, ".*y = .*e.30. grows without bound"),
    "cube": (ode(-X, Y**3), {}, SMALL, 0.5, ".*y = .*grows without bound; check signs and param"),
    "no solution": (
        dae(-Z, Z**2 - (1 - t)), {}, SINGULAR, 1.0,
        ".*algebraic equations for z have no solution near their last one",
    ),
    "switch": (
        SWITCH, {}, SMALL, 0.5,
        ".*fastest equation x; a discontinuity is near.*smooth form or the model an event",
    ),
    "switch, late": (
        SWITCH, {"t_start": 1e6, "t_end": 1e6 + 2}, SMALL, 1e6 + 0.5,
        ".*steps below 2.2e-09 s are lost to rounding",
    ),
}  # fmt: skip
"""Model, arguments, status, when it stops, and the rest of its message."""


@each_backend
@pytest.mark.parametrize("case", FAILURES)
def test_failures_are_named_with_their_time(case: str, backend: str) -> None:
    model, arguments, status, end, message = FAILURES[case]
    how = {"t_end": 2.0, "backend": backend} | arguments
    text = rf"^simulate 'edge': stopped at t = \S+ s: {message}"
    with pytest.raises(sf.SolveError, match=text) as caught:
        simulate(model, **how)
    error, run = caught.value, simulate(model, **how, throw=False)
    assert error.status is error.partial.status is run.status is status
    assert not run.status.ok
    assert str(error) == error.partial.message
    assert str(error).count("\n") == 0
    assert "x = " not in str(error)
    assert ("lost to rounding" in str(error)) == (case == "switch, late")
    assert run.step_times[-1] == pytest.approx(end, abs=1e-3)
    assert run.t[-1] <= run.step_times[-1]
    assert all(np.isfinite(signal).all() for signal in run.signals.values())


def test_redundant_constraints_are_refused_at_the_start_by_name() -> None:
    a, b = Variable("a", "N"), Variable("b", "N")
    same = a.symbol + b.symbol - X
    model = Model("redundant", x=(x,), z=(a, b), ode=-a.symbol, alg=ca.vertcat(same, 2 * same))
    with pytest.raises(ValueError, match="equations for a, b"):
        simulate(model, 1.0, x0={"x": 1.0})


@each_backend
def test_number_of_attempts_is_limited_and_the_start_of_the_run_returned(backend: str) -> None:
    model = sf.rabinowicz(sf.BrownMcPhee())
    with pytest.raises(sf.SolveError, match="maximum number of steps was used up") as caught:
        simulate(model, 1000.0, max_steps=300, backend=backend, samples=50_001)
    partial = caught.value.partial
    assert caught.value.status is Status.MAX_STEPS
    assert f"Stopped at t = {partial.step_times[-1]:g} s" in str(caught.value)
    assert 300 <= partial.statistics.steps + partial.statistics.rejections < 300 + 32
    early = partial.t[partial.t < 20]
    assert early.size > 10
    whole = simulate(model, 20.0).at(early)["x"]
    assert partial["x"][: early.size] == pytest.approx(whole, abs=1e-5)


def test_a_sign_in_the_equations_is_distinguished_from_a_law() -> None:
    with pytest.raises(sf.SolveError, match=r"contain sign\(\.\.\.\): use contact") as e:
        simulate(SLIDE, 5.0, max_steps=300, backend="vm")
    assert e.value.status is Status.MAX_STEPS
    assert chattering(SLIDE)
    assert not chattering(Model("smooth", x=(y,), ode=-Y))
    for law in (sf.ExactCoulomb(), sf.Karnopp()):  # of which one holds a sign of its own
        assert not chattering(sf.rabinowicz(law))
