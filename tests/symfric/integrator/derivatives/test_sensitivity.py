"""Derivatives of a simulation: against closed forms, differences over a scan, and CasADi's own."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from differentiable import oscillator, pendulum, root, switched
from numpy.typing import NDArray
from scipy.linalg import expm

import symfric as sf
from symfric.integrator.by_peer import peer
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.integrator.running.run import Tolerances

Array = NDArray[np.float64]
LAWS: dict[str, sf.Law] = {"brown_mcphee": sf.BrownMcPhee(), "lugre": sf.LuGre()}
FREE = ("mu_s", "mu_d", "k")
T_END = 20.0

each_law = pytest.mark.parametrize("law", LAWS)
each_engine = pytest.mark.parametrize("backend", ["vm", "compiled"])


def derivative(run: sf.Trajectory, name: str, signal: str) -> Array:
    return run.sensitivities[name][signal]


def exact(t: float, start: tuple[float, float] = (1.0, 0.5)) -> tuple[Array, Array, Array]:
    """Solution of the oscillator, derivative by k, derivative by the start (by exponentials)."""
    A, by_k = np.array([[0.0, 1.0], [-4.0, -0.3]]), np.array([[0.0, 0.0], [-1.0, 0.0]])
    both = expm(t * np.block([[A, by_k], [np.zeros((2, 2)), A]]))
    y0 = np.array(start)
    return both[:2, :2] @ y0, both[:2, 2:] @ y0, both[:2, :2]


@each_engine
def test_linear_system_meets_the_matrix_exponential_between_the_steps(backend: str) -> None:
    times = np.sort(np.random.default_rng(3).uniform(0.0, 5.0, 40))
    names = ["k", "x0.x", "x0.v"]
    run = sf.simulate(
        oscillator(), 5.0, t_eval=times, rtol=1e-9, backend=backend, sensitivities=names
    )
    assert run.statistics.steps > 40  # so that most times lie inside a step
    solution, by_k, by_start = (np.array(part) for part in zip(*map(exact, times), strict=True))
    near = {"rel": 0.0, "abs": 2e-7}
    assert derivative(run, "k", "x") == pytest.approx(by_k[:, 0], **near)
    assert derivative(run, "k", "v") == pytest.approx(by_k[:, 1], **near)
    assert derivative(run, "x0.v", "x") == pytest.approx(by_start[:, 0, 1], **near)
    assert derivative(run, "x0.x", "v") == pytest.approx(by_start[:, 1, 0], **near)
    # an output depends on the parameter itself, too: d(k x^2/2 + v^2/2)/dk
    x, v = solution.T
    by_hand = x**2 / 2 + 4.0 * x * by_k[:, 0] + v * by_k[:, 1]
    assert derivative(run, "k", "energy") == pytest.approx(by_hand, rel=0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("law", "name"), [("brown_mcphee", "mu_s"), ("brown_mcphee", "x0.v"), ("lugre", "k")]
)
def test_difference_quotients_agree_over_a_scan_of_widths(law: str, name: str) -> None:
    model = sf.rabinowicz(LAWS[law], free=FREE)
    at = 0.02 if name == "x0.v" else {v.name: float(v.start) for v in model.p}[name]

    def x_end(value: float) -> float:
        p = {} if name == "x0.v" else {name: value}
        x0 = {"v": value} if name == "x0.v" else {"v": 0.02}
        return sf.simulate(model, T_END, x0=x0, p=p, rtol=1e-13, t_eval=[T_END])["x"][0]

    run = sf.simulate(
        model, T_END, x0={"v": 0.02}, rtol=1e-12, t_eval=[T_END], sensitivities=[name]
    )
    ours = derivative(run, name, "x")[0]
    widths = at * 10.0 ** -np.array([1, 5, 6, 7])
    quotients = np.array([(x_end(at + h) - x_end(at - h)) / (2 * h) for h in widths])
    wrong = np.abs(quotients / ours - 1)
    assert wrong.min() <= (1e-6 if law == "brown_mcphee" else 1e-4)
    assert wrong.max() > 1e-4, "differences are no reference at every width, so scan them"


def peer_slopes(model: sf.Model, x0: Array, times: Array, plugin: str) -> tuple[Array, Array]:
    """States and their derivatives by p at times, by an integrator of CasADi and its own AD."""
    inputs = input_data(model, None, 0.0, float(times[-1]))
    whole = system(model, inputs)
    tolerances = Tolerances(1e-12, 1e-13 * whole.nominal, 0.0, 1_000_000)
    problem = peer(whole, inputs, model.values("p"), tolerances, plugin)
    solver = ca.integrator("s", problem.plugin, problem.dae, 0.0, times.tolist(), problem.options)
    p = ca.MX.sym("p", len(model.p))
    xf = solver(x0=x0 / whole.nominal, p=p)["xf"] * ca.repmat(ca.DM(whole.nominal), 1, times.size)
    both = ca.Function("both", [p], [xf, ca.jacobian(ca.vec(xf), p)])
    states, slopes = both(model.values("p"))
    return states.full(), slopes.full().reshape(times.size, len(x0), -1)


@each_law
def test_casadis_rosenbrock_has_the_same_derivatives(law: str) -> None:
    model, times = sf.rabinowicz(LAWS[law], free=FREE), np.array([3.0, 9.0])
    x0 = model.initial_state({"v": 0.02})
    start = dict(zip([v.name for v in model.x], x0, strict=True))  # all, so that none follows p
    run = sf.simulate(model, 9.0, x0=start, rtol=1e-12, t_eval=times, sensitivities=FREE)
    states, slopes = peer_slopes(model, x0, times, "rosenbrock")
    for i, state in enumerate(("x", "v")):
        assert run[state] == pytest.approx(states[i], rel=1e-6)
        for j, name in enumerate(FREE):
            assert derivative(run, name, state) == pytest.approx(slopes[:, i, j], rel=1e-5)


def test_bristle_in_steady_sliding_follows_parameters_and_start_velocity() -> None:
    """At t = 0 the bristle is z = g(v) sgn(v)/sigma_0 with g by mu_s: its derivatives by hand."""
    model = sf.rabinowicz(sf.LuGre(), free=["mu_s"])
    names = ["mu_s", "x0.v", "x0.z"]
    run = sf.simulate(model, 1.0, t_eval=[0.0, 1.0], x0={"v": 0.099}, sensitivities=names)
    v, v_s, mu_s, mu_d, load, sigma_0 = -1e-3, 1e-3, 0.15, 0.1, 0.8 * 9.81, 1e5
    stribeck = np.exp(-((v / v_s) ** 2))
    by_mu = -load * stribeck / sigma_0
    by_v = load * (mu_s - mu_d) * stribeck * 2 * v / v_s**2 / sigma_0
    assert derivative(run, "mu_s", "z")[0] == pytest.approx(by_mu, rel=1e-9)
    assert derivative(run, "x0.v", "z")[0] == pytest.approx(by_v, rel=1e-6)
    assert derivative(run, "x0.z", "z")[0] == 1.0
    assert derivative(run, "x0.z", "v")[0] == 0.0


def test_bristle_start_that_is_given_does_not_follow() -> None:
    model = sf.rabinowicz(sf.LuGre(), free=["mu_s"])
    run = sf.simulate(model, 1.0, t_eval=[0.0, 1.0], x0={"z": 1e-5}, sensitivities=["mu_s", "x0.v"])
    assert derivative(run, "mu_s", "z")[0] == derivative(run, "x0.v", "z")[0] == 0.0


@each_engine
def test_algebraic_variables_follow_from_the_start_on(backend: str) -> None:
    run = sf.simulate(
        root(), 1.0, samples=33, rtol=1e-9, backend=backend, sensitivities=["p", "x0.x"]
    )
    q, t = 0.7 ** (1 / 3), run.t
    root_x = np.sqrt(1 - 2 / 3 * q * t)
    by_q, q_by_p = -t * root_x, q / (3 * 0.7)
    near = {"rel": 0.0, "abs": 2e-7}
    assert derivative(run, "p", "x") == pytest.approx(by_q * q_by_p, **near)
    by_p = q_by_p * (root_x + q * by_q / (3 * root_x**2))
    assert derivative(run, "p", "z") == pytest.approx(by_p, **near)
    assert derivative(run, "x0.x", "x") == pytest.approx(root_x, **near)


def test_algebraic_variables_follow_jumps_of_the_inputs() -> None:
    times = np.array([0.0, 0.3, 0.5, 0.50001, 0.9, 1.2, 1.5])
    u = sf.Hold([0.0, 0.5, 1.2], [1.0, -2.0, 3.0])
    run = sf.simulate(
        switched(), 1.5, u={"u": u}, t_eval=times, rtol=1e-9, sensitivities=["p", "x0.x"]
    )
    level = np.array([1.0, 1.0, -2.0, -2.0, -2.0, 3.0, 3.0])
    grown = np.array([0.0, 0.3, 0.5, 0.49998, -0.3, -0.9, 0.0])  # int u
    x = np.exp(-0.8 * grown)
    assert derivative(run, "p", "x") == pytest.approx(-grown * x, rel=1e-6, abs=1e-7)
    assert derivative(run, "p", "z") == pytest.approx(
        level * x * (1 - 0.8 * grown), rel=1e-6, abs=1e-7
    )
    assert derivative(run, "x0.x", "z") == pytest.approx(0.8 * level * x, rel=1e-6)


@each_engine
def test_sampled_inputs_are_part_of_the_steps(backend: str) -> None:
    """v' = u/m - c v/m with u = 3 - t from samples; by m from the closed form of a ramp."""
    u = sf.Linear([0.0, 0.4, 1.1, 2.0], [3.0, 2.6, 1.9, 1.0])
    model = sf.drive(sf.Viscous(sigma_2=2.0), free=["m"])
    run = sf.simulate(
        model, 2.0, u={"force": u}, p={"m": 0.8}, x0={"v": 0.2}, rtol=1e-10, samples=9,
        backend=backend, sensitivities=["m", "x0.v"],
    )  # fmt: skip
    t, c = run.t, 2.0

    def velocity(m: complex) -> NDArray[np.complex128]:
        steady = (3.0 - (t - m / c)) / c
        return steady + (0.2 - (3.0 + m / c) / c) * np.exp(-t * c / m)

    assert run["v"] == pytest.approx(velocity(0.8).real, abs=1e-8)
    by_m = velocity(0.8 + 1e-20j).imag / 1e-20
    assert derivative(run, "m", "v") == pytest.approx(by_m, rel=0.0, abs=1e-7)
    assert derivative(run, "x0.v", "v") == pytest.approx(np.exp(-t * c / 0.8), rel=0, abs=1e-7)


def test_explicit_time_is_no_parameter() -> None:
    """x' = p cos(t) from t = 1: dx/dp = sin(t) - sin(1)."""
    x, p, t = sf.Variable("x", "m", start=0.0), sf.Variable("p", "m/s", start=2.0), ca.SX.sym("t")
    model = sf.Model("swing", x=(x,), p=(p,), ode=p.symbol * ca.cos(t), t=t)
    run = sf.simulate(model, 3.0, t_start=1.0, rtol=1e-9, samples=7, sensitivities=["p"])
    assert derivative(run, "p", "x") == pytest.approx(np.sin(run.t) - np.sin(1.0), abs=1e-7)


def test_model_without_parameters_and_inputs_has_start_values() -> None:
    x = sf.Variable("x", "m", start=2.0)
    model = sf.Model("decay", x=(x,), ode=-x.symbol)
    run = sf.simulate(model, 1.0, samples=5, rtol=1e-9, sensitivities=["x0.x"])
    assert derivative(run, "x0.x", "x") == pytest.approx(np.exp(-run.t), rel=1e-7)
    assert run.gradient({"x": [0, 0, 0, 0, 1.0]}) == pytest.approx({"x0.x": np.exp(-1.0)})


def test_implicit_model_with_a_matrix_that_is_not_constant() -> None:
    """(1 + r^2) r = -p x (1 + r^2) has the solution r = x' = -p x."""
    x, p, r = sf.Variable("x", "m", start=1.0), sf.Variable("p", "1/s", start=0.5), ca.SX.sym("r")
    residual = (1 + r**2) * (r + p.symbol * x.symbol)
    model = sf.Model("implicit", x=(x,), p=(p,), xdot=r, residual=residual)
    run = sf.simulate(model, 2.0, samples=5, rtol=1e-9, sensitivities=["p"])
    by_p = -run.t * np.exp(-0.5 * run.t)
    assert derivative(run, "p", "x") == pytest.approx(by_p, rel=1e-6, abs=1e-7)


def test_mechanism_starts_and_stays_on_its_constraints_with_its_derivatives() -> None:
    """The start (0.6, -0.8) l moves along the radius with l, and along the circle with x0."""
    names = ["l", "x0.x"]
    run = sf.simulate(pendulum(), 1.0, samples=3, rtol=1e-10, sensitivities=names)
    start = [[derivative(run, name, signal)[0] for signal in ("x", "y")] for name in names]
    assert start == [pytest.approx([0.6, -0.8]), pytest.approx([0.64, 0.48])]
    for name, by_radius in (("l", 1.0), ("x0.x", 0.0)):
        along = run["x"] * derivative(run, name, "x") + run["y"] * derivative(run, name, "y")
        assert along == pytest.approx(np.full(3, by_radius), abs=1e-9)

        def at(h: float, name: str = name) -> sf.Trajectory:
            p = {"l": 1.0 + h} if name == "l" else {}
            x0 = {} if name == "l" else {"x": 0.6 + h}
            return sf.simulate(pendulum(), 1.0, samples=3, rtol=1e-12, p=p, x0=x0)

        ahead, behind = at(1e-5), at(-1e-5)
        for signal in ("x", "vy", "lam"):
            quotient = (ahead[signal] - behind[signal]) / 2e-5
            assert derivative(run, name, signal) == pytest.approx(quotient, rel=1e-5, abs=1e-6)


def test_derivatives_reach_as_far_as_an_interrupted_run() -> None:
    model = sf.rabinowicz(sf.LuGre(), free=["mu_s"])

    def interrupt(fraction: float) -> None:
        if fraction > 0:
            raise KeyboardInterrupt

    run = sf.simulate(
        model, 200.0, backend="vm", progress=interrupt, sensitivities=["mu_s"], rtol=1e-8
    )
    assert run.status is sf.Status.INTERRUPTED
    slopes = derivative(run, "mu_s", "x")
    assert slopes.shape == run.t.shape
    assert 0 < run.t.size < 2001
    assert np.isfinite(slopes).all()


def test_run_that_failed_at_once_has_no_derivatives() -> None:
    x, p = sf.Variable("x", "m", start=1.0), sf.Variable("p", "1", start=-1.0)
    model = sf.Model("broken", x=(x,), p=(p,), ode=ca.sqrt(p.symbol) * x.symbol)
    run = sf.simulate(model, 1.0, sensitivities=["p"], throw=False)
    assert not run.status.ok
    with pytest.raises(ValueError, match="expected sensitivities, got none"):
        _ = run.sensitivities
    with pytest.raises(sf.SolveError):
        sf.simulate(model, 1.0, sensitivities=["p"])


@pytest.mark.parametrize(
    ("make", "arguments", "message"),
    [
        (oscillator, {"sensitivities": ["kk"]}, r"expected one of k, c, x0\.x, x0\.v, got kk"),
        (oscillator, {"sensitivities": ["x0.w"]}, r"got x0\.w; did you mean x0\."),
        (
            lambda: sf.rabinowicz(sf.LuGre(), free=["k"]),
            {"sensitivities": ["mu_s"]},
            r"'rabinowicz' \(parameters must be free\): expected one of k, .* got mu_s",
        ),
    ],
)
def test_bad_requests_are_refused_saying_what_is_possible(
    make: Callable[[], sf.Model], arguments: dict[str, object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        sf.simulate(make(), 1.0, **arguments)  # pyright: ignore[reportArgumentType]


def test_derivatives_that_were_not_asked_for_are_missed_by_name() -> None:
    with pytest.raises(ValueError, match=r"got none; request them by\s+simulate\(\.\.\., sens"):
        _ = sf.simulate(oscillator(), 1.0).sensitivities
