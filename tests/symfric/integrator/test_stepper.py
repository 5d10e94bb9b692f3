"""Plants from sample to sample: equal to `simulate` to the bit, in batches, and failures.

The flow of a model as a Function: values, and derivatives of both orders.
"""

import copy
import sys
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import BACKENDS, each_backend, needs_compiler
from differentiable import followed, oscillator, pendulum, root
from scipy.linalg import expm

from symfric import (
    BrownMcPhee,
    Hold,
    LuGre,
    Model,
    Plant,
    SolveError,
    Status,
    Variable,
    drive,
    flow,
    rabinowicz,
    simulate,
    stepper,
)
from symfric.foundation.numeric import Array
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running import plants
from symfric.integrator.running.plants import SAMPLES
from symfric.scenes import SliderCrank

LAW = BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)
x, z, u = Variable("x", "m"), Variable("z", "1"), Variable("u", "N")


def burst() -> Model:
    """x' = x^2 + u: infinite after a while."""
    return Model("burst", x=(x,), u=(u,), ode=x.symbol**2 + u.symbol)


def walk(plant: Plant, held: Array) -> Array:
    """States at the samples, shape (samples, nx)."""
    return np.array([plant.step(row) for row in held])


@pytest.mark.parametrize("make", [lambda: drive(LuGre()), followed], ids=["bristles", "algebraic"])
def test_samples_have_the_bits_of_one_simulation(make: Any) -> None:
    model, dt, rng = make(), 1e-3, np.random.default_rng(0)
    held = np.cumsum(rng.normal(size=(SAMPLES, 1)), axis=0) * 0.1
    t = np.arange(SAMPLES + 1) * dt
    force = {model.u[0].name: Hold(t[:-1], held[:, 0])}
    run = simulate(model, t[-1], u=force, t_eval=t[1:], rtol=1e-5)
    for backend in BACKENDS:
        plant = stepper(model, dt, rtol=1e-5, backend=backend)
        found = walk(plant, held)
        for i, v in enumerate(model.x):
            np.testing.assert_array_equal(found[:, i], run[v.name])
        assert plant.t == t[-1]
        assert plant.signals == {name: plant[name] for name in model.signals} == run.final


@each_backend
def test_a_batch_is_each_one_alone(backend: str) -> None:
    """Each has its own parameters and start; one of them is reset in between."""
    model = drive(LuGre(), free=["m"])
    held = np.random.default_rng(1).normal(size=(30, 3)) * 3
    mass, start = np.array([0.5, 0.8, 1.1]), np.array([0.0, 0.1, -0.1])
    many = stepper(model, 5e-3, batch=3, x0={"v": start}, p={"m": mass}, backend=backend)
    together = np.array([many.step(row[:, None]) for row in held])
    for b in range(3):
        own = {"x0": {"v": float(start[b])}, "p": {"m": float(mass[b])}}
        one = stepper(model, 5e-3, backend=backend, **own)
        np.testing.assert_array_equal(walk(one, held[:, [b]]), together[:, b])
    again = many.reset(x0={"v": [0.1]}, members=[1])
    np.testing.assert_array_equal(again[[0, 2]], together[-1][[0, 2]])
    assert many.t.tolist() == pytest.approx([0.15, 0.0, 0.15])
    np.testing.assert_array_equal(many.step(held[0][:, None])[1], together[0, 1])
    assert many["v"].shape == (3,)
    assert many.signals["force"].tolist() == held[0].tolist()


@needs_compiler
def test_both_engines_have_the_same_bits_of_a_mechanism() -> None:
    held = np.zeros((20, 0))
    vm, compiled = (stepper(SliderCrank(LAW).model(), 2e-3, backend=b) for b in BACKENDS)
    np.testing.assert_array_equal(walk(vm, held), walk(compiled, held))
    assert vm.attempts == compiled.attempts
    np.testing.assert_array_equal([*vm.signals.values()], [*compiled.signals.values()])


def test_a_thousand_samples_are_compiled_once_and_searched_for_never(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls: list[str] = []
    load = plants.load
    monkeypatch.setattr(plants, "load", lambda *a: calls.append(a[1]) or load(*a))
    model = followed()
    plant = stepper(model, 1e-2, backend=BACKENDS[-1])
    stepper(model, 1e-3, backend=BACKENDS[-1]).copy()
    monkeypatch.setattr(sys.modules[Plant.__module__], "consistent", None)
    walk(plant, np.sin(0.01 * np.arange(1000))[:, None])
    assert calls == ["symfric_plants"] * (len(BACKENDS) - 1)


def test_copies_are_independent_and_reset_repeats_to_the_bit() -> None:
    model, start = drive(LuGre(), free=["m"]), {"v": 0.1}
    one = stepper(model, 5e-3, x0=start, backend="vm")
    held = np.random.default_rng(3).normal(size=(20, 1)) * 3
    returned = [one.step(row) for row in held]
    first, at = np.array(returned), one.x
    other = copy.deepcopy(one)
    apart = other.step(-5.0)
    assert (one.x == at).all()
    assert (apart != at).any()
    assert (one.t, other.t) == pytest.approx((0.1, 0.105))
    np.testing.assert_array_equal(one.copy().step(2.0), one.step(2.0))
    assert one.reset(x0=start).tolist() == one.x.tolist()
    assert (one.t, one.u.tolist()) == (0.0, [0.0])
    np.testing.assert_array_equal(walk(one, held), first)
    np.testing.assert_array_equal(returned, first)  # each is an array of its own
    one.reset(x0=start, p={"m": 2.0})
    one.reset(x0=start)  # parameters stay
    fresh = stepper(model, 5e-3, p={"m": 2.0}, x0=start, backend="vm")
    heavy = walk(one, held)
    np.testing.assert_array_equal(heavy, walk(fresh, held))
    assert (heavy != first).any()


def test_inputs_come_by_name_as_numbers_and_as_arrays() -> None:
    a, b = Variable("a", "N"), Variable("b", "N", start=0.5)
    model = Model("two", x=(x,), u=(a, b), ode=a.symbol + 10 * b.symbol)
    plant, total = stepper(model, 1.0, backend="vm"), 0.0
    for held, rate in (
        (None, 5.0), ({"a": 1.0}, 6.0), ([2.0, 0.0], 2.0), ({"b": np.float32(1.0)}, 12.0),
    ):  # fmt: skip
        total += rate
        assert plant.step(held) == pytest.approx([total])
    with pytest.raises(ValueError, match="u: b: expected numbers"):
        plant.step({"a": 7.0, "b": "c"})
    assert plant.step() == pytest.approx([total + 12.0])
    many = stepper(model, 1.0, batch=2, backend="vm")
    assert many.step({"a": [1.0, 2.0]})[:, 0] == pytest.approx([6.0, 7.0])
    assert many.step({"a": 1.0})[:, 0] == pytest.approx([12.0, 13.0])
    nothing = stepper(Model("decay", x=(x,), ode=-x.symbol), 1.0, x0={"x": 1.0}, backend="vm")
    assert nothing.step() == pytest.approx([np.exp(-1)], rel=1e-5)


def test_time_in_the_equations_starts_at_t_start() -> None:
    t = ca.SX.sym("t")
    model = Model("timed", x=(x,), ode=2 * t, t=t)
    plant = stepper(model, 0.5, t_start=3.0, backend="vm")
    assert plant.step() == pytest.approx([3.5**2 - 9])
    assert plant.step() == pytest.approx([16.0 - 9])
    assert plant.t == 4.0


@each_backend
def test_a_failure_reports_its_time_and_keeps_the_others(backend: str) -> None:
    plant = stepper(burst(), 0.5, batch=3, backend=backend)
    plant.step([[0.0], [1.0], [0.0]])
    with pytest.raises(
        SolveError, match=r"plant 1: stepper 'burst': stopped at t = 0\.65.*x = .* grows"
    ) as e:
        plant.step([[0.0], [100.0], [2.0]])
    assert [*plant.failed] == [1]
    assert "plants failed" not in str(e.value)
    assert e.value.partial.shape == (3, 1)
    assert plant.t[[0, 2]].tolist() == [1.0, 1.0]
    assert 0.5 < plant.t[1] < 1.0
    plant.reset(members=[1])
    assert not plant.failed
    plant.step([[0.0], [0.0], [0.0]])
    assert plant.t.tolist() == [1.5, 0.5, 1.5]
    with pytest.raises(SolveError, match=r"\(3 plants failed\.\)"):
        plant.step([[1e4], [1e4], [0.0]])


W = Variable("z", "1", start=1.0)
HELD = Variable("u", "N", start=1.0)
FAILING = {
    # x' = u / (1 - x): (1 - x)^2 = 1 - 2 t for u = 1, until t = 1/2; 2 t - 1 for u = -1
    "wall": (Model("wall", x=(x,), u=(u,), ode=u.symbol / (1 - x.symbol)), [], r"t = 0\.50", -1.0),
    "root": (
        Model("root", x=(x,), z=(W,), u=(HELD,), ode=W.symbol, alg=W.symbol**2 - HELD.symbol),
        [4.0], "no solution of the algebraic", 9.0,
    ),
}  # fmt: skip


@each_backend
@pytest.mark.parametrize("case", FAILING)
def test_a_failed_plant_goes_on_with_other_inputs(case: str, backend: str) -> None:
    model, before, message, after = FAILING[case]
    plant = stepper(model, 1.0, backend=backend)
    for held in before:
        plant.step(held)
    with pytest.raises(SolveError, match=message) as caught:
        plant.step(1.0 if case == "wall" else -1.0)
    assert len(before) <= plant.t < len(before) + 1
    if case == "root":
        assert caught.value.status is Status.SINGULAR
        assert plant.step(after) == pytest.approx([5.0])
    else:
        assert (1 - plant.step(after)) ** 2 == pytest.approx([1.0], abs=1e-3)
    assert not plant.failed
    assert plant.t == len(before) + 1


@each_backend
def test_bad_inputs_are_refused_and_nothing_has_happened(backend: str) -> None:
    plant = stepper(drive(LuGre()), 1e-2, backend=backend)
    at = plant.step(1.0)
    bad: list[tuple[Any, str]] = [
        ([1.0, 2.0], r"u: expected shape \(1,\) or \(\), got \(2,\)"), ({"forse": 1.0}, "force"),
        ({"force": [1.0, 2.0]}, "u: force: expected shape"), ("a", "u: expected numbers"),
        (float("nan"), "u: expected finite numbers"), (1j, "u: expected numbers"),
        ([[1.0]], "u: expected shape"),
    ]  # fmt: skip
    for given, message in bad:
        with pytest.raises(ValueError, match=message):
            plant.step(given)
        assert (plant.x == at).all()
        assert plant.t == 1e-2
        assert (plant.copy().step(1.0) == plant.copy().step()).all()


def test_an_interrupted_step_has_not_happened(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two of three plants had reached their sample; all of them are set back."""
    plant = stepper(followed(), 0.1, batch=3, backend="vm")
    alone, before = plant.copy(), plant.copy()
    before.step([1.0, 2.0, 3.0])
    large, left = plants._large, iter(range(before.attempts - 1))

    def interrupting(S: Array, h_min: float) -> bool:
        if next(left, None) is None:
            raise KeyboardInterrupt
        return large(S, h_min)

    monkeypatch.setattr(plants, "_large", interrupting)
    with pytest.raises(KeyboardInterrupt):
        plant.step([1.0, 2.0, 3.0])
    monkeypatch.undo()
    assert plant.t.tolist() == [0.0] * 3
    assert not plant.u.any()
    assert (plant.step([3.0, 2.0, 1.0]) == alone.step([3.0, 2.0, 1.0])).all()


def test_the_number_of_attempts_is_limited() -> None:
    plant = stepper(drive(LuGre()), 1.0, max_steps=10, backend="vm")
    with pytest.raises(SolveError, match=r"at t = .* s: The maximum number of steps") as caught:
        plant.step(3.0)
    assert (caught.value.status, plant.attempts) == (Status.MAX_STEPS, 10)


K, C, START = 4.0, 0.3, np.array([1.0, 0.5])


def exact(t: float, k: float = K) -> np.ndarray:
    return expm(t * np.array([[0.0, 1.0], [-k, -C]])) @ START


def test_arguments_and_result_have_names() -> None:
    step = flow(rabinowicz(LuGre(), free=["mu_s"]))
    assert step.name_in() == ["x0", "u", "p", "T"]
    assert step.name_out() == ["xf"]
    assert step.size_in("u") == (0, 1)
    assert step.size_out("xf") == (3, 1)


@pytest.mark.parametrize("method", METHODS)
def test_flow_of_a_linear_system_is_the_matrix_exponential(method: str) -> None:
    """Pushed by u, it swings about u/k."""
    step = flow(oscillator(), steps=200, method=method)
    center = np.array([1.0 / K, 0.0])
    found = step(x0=START + center, u=1.0, p=[K, C], T=2.0)["xf"].full().ravel() - center
    assert found == pytest.approx(exact(2.0), abs=1e-4 if METHODS[method].order > 1 else 0.06)


def test_time_counts_from_zero() -> None:
    """x' = cos(t)."""
    x, t = Variable("x", "m", start=0.0), ca.SX.sym("t")
    step = flow(Model("swing", x=(x,), ode=ca.cos(t), t=t))
    assert float(step(x0=1.0, T=2.0)["xf"]) == pytest.approx(1.0 + np.sin(2.0), rel=1e-7)


def test_algebraic_variables_are_solved_for() -> None:
    """x = (1 - 2/3 p^(1/3) T)^(3/2), and its derivative by p."""
    p = ca.MX.sym("p")
    xf = flow(root(), steps=40)(x0=1.0, p=p, T=1.0)["xf"]
    value, slope = ca.Function("both", [p], [xf, ca.jacobian(xf, p)])(0.7)
    q = 0.7 ** (1 / 3)
    assert float(value) == pytest.approx((1 - 2 / 3 * q) ** 1.5, rel=1e-7)
    assert float(slope) == pytest.approx(-np.sqrt(1 - 2 / 3 * q) * q / (3 * 0.7), rel=1e-6)


def test_mechanism_flows_on_its_constraints() -> None:
    """From a start off the circle, as it is simulated."""
    x0 = [0.61, -0.8, 0.0, 0.0]
    end = flow(pendulum(), steps=50)(x0=x0, p=1.0, T=1.0)["xf"].full().ravel()
    assert np.hypot(end[0], end[1]) == pytest.approx(1.0, abs=1e-12)
    run = simulate(pendulum(), 1.0, x0={"x": 0.61}, rtol=1e-10, t_eval=[1.0])
    assert end == pytest.approx([run[v][0] for v in ("x", "y", "vx", "vy")], rel=1e-6)


def test_implicit_model_flows() -> None:
    """(1 + r^2) (r + x) = 0 for the rate r."""
    x, r = Variable("x", "m", start=1.0), ca.SX.sym("r")
    model = Model("implicit", x=(x,), xdot=r, residual=(1 + r**2) * (r + x.symbol))
    assert float(flow(model)(x0=2.0, T=1.0)["xf"]) == pytest.approx(2 * np.exp(-1.0), rel=1e-6)


@pytest.mark.parametrize("law", [BrownMcPhee(), LuGre()], ids=["brown_mcphee", "lugre"])
def test_friction_flows_as_it_is_simulated(law: BrownMcPhee | LuGre) -> None:
    """Sticking on the belt, where equal steps are no burden; first derivatives too."""
    model = rabinowicz(law, free=["k"])
    x0 = model.initial_state({"v": 0.1})
    start = dict(zip([v.name for v in model.x], x0, strict=True))
    run = simulate(model, 1.0, x0=start, rtol=1e-10, t_eval=[1.0], sensitivities=["k", "x0.x"])
    step = flow(model, steps=100)
    slopes = step.factory("slopes", step.name_in(), ["xf", "jac:xf:p", "jac:xf:x0"])
    xf, by_p, by_x0 = slopes(x0, [], 2.1, 1.0)
    assert float(xf[0]) == pytest.approx(run["x"][0], rel=1e-8)
    assert float(by_p[0]) == pytest.approx(run.sensitivities["k"]["x"][0], rel=1e-4)
    assert float(by_x0[0, 0]) == pytest.approx(run.sensitivities["x0.x"]["x"][0], rel=1e-6)


def test_derivatives_of_both_orders_meet_the_matrix_exponential() -> None:
    """By k twice, from the exponential of a block triangular matrix, and by T, where x' = A x."""
    k, T = ca.MX.sym("k"), ca.MX.sym("T")
    x = flow(oscillator(), steps=100)(x0=START, u=0.0, p=ca.vertcat(k, C), T=T)["xf"][0]
    first = ca.gradient(x, k)
    functions = ca.Function("f", [k, T], [first, ca.jacobian(x, T), ca.jacobian(first, k)])
    by_k, by_T, by_kk = (float(value) for value in functions(K, 2.0))
    A, by = np.array([[0.0, 1.0], [-K, -C]]), np.array([[0.0, 0.0], [-1.0, 0.0]])
    none = np.zeros((2, 2))
    tower = expm(2.0 * np.block([[A, by, none], [none, A, by], [none, none, A]]))
    assert by_k == pytest.approx((tower[:2, 2:4] @ START)[0], rel=1e-6)
    assert by_kk == pytest.approx(2 * (tower[:2, 4:] @ START)[0], rel=1e-5)
    assert by_T == pytest.approx(exact(2.0)[1], rel=1e-6)
