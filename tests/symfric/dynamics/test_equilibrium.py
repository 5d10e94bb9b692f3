"""Equilibria and linear models against closed forms and other formulations."""

import casadi as ca
import numpy as np
import pytest

from symfric import (
    BrownMcPhee,
    ExactCoulomb,
    LuGre,
    Model,
    Variable,
    contact,
    drive,
    rabinowicz,
    simulate,
)
from symfric.dynamics import equilibrium, linearize
from symfric.laws import Asymmetric, Coulomb, Exact, Stribeck, Viscous
from symfric.scenes import Arm, CoupledBlocks, FourBar, Pendulum, SliderCrank

SEEDS = range(20)


def test_steady_sliding_on_a_belt_has_the_slope_of_the_law_as_damping() -> None:
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        m, k, v_b, s2, v_s, g = rng.uniform(0.2, 5.0, 6) * [1, 10, 0.1, 0.2, 0.1, 1]
        mu_d, rise = rng.uniform(0.05, 0.5, 2)
        law = ExactCoulomb(mu_s=mu_d + rise, mu_d=mu_d, v_s=v_s, sigma_2=s2, form="stribeck")
        N, weight = m * g, np.exp(-((v_b / v_s) ** 2))
        belt = rabinowicz(law, m=m, k=k, v_belt=v_b, g=g)
        at = equilibrium(belt)
        assert at["friction"] == pytest.approx(-N * (mu_d + rise * weight) - s2 * v_b, rel=1e-12)
        assert at.x["x"] == pytest.approx(-at["friction"] / k, rel=1e-12)
        slope = s2 - N * rise * 2 * v_b / v_s**2 * weight
        found = linearize(belt, at)
        assert found.states == ("x", "v")
        size = max(1.0, k / m, abs(slope) / m)
        assert np.abs(found.A - [[0, 1], [-k / m, -slope / m]]).max() < 1e-12 * size
        assert found.stable is bool(slope > 0)


def quarter_car(b: float) -> tuple[Model, np.ndarray]:
    """Quarter car whose strut force is an algebraic variable, and its matrix A by hand."""
    body, wheel, k_s, k_t = 240.0, 40.0, 28900.0, 920000.0
    x = [Variable(n, "m") for n in ("X_b", "X_w")]
    v = [Variable(n, "m/s") for n in ("v_b", "v_w")]
    f, road = Variable("f", "N"), Variable("road", "m")
    pulls = ca.vertcat(f / body, (-f + k_t * (road - x[1])) / wheel)
    strut = f - k_s * (x[1] - x[0]) - b * (v[1] - v[0])
    ode = ca.vertcat(v[0].symbol, v[1].symbol, pulls)
    model = Model("quarter", x=(*x, *v), z=(f,), u=(road,), ode=ode, alg=strut)
    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    A[2] = np.array([-k_s, k_s, -b, b]) / body
    A[3] = np.array([k_s, -k_s - k_t, b, -b]) / wheel
    return model, A


def test_a_quarter_car_has_its_eigenvalues_and_response() -> None:
    for b in (0.0, 260.0, 2600.0):
        model, A = quarter_car(b)
        found = linearize(model, equilibrium(model), outputs=["X_b", "f"])
        expected = np.linalg.eigvals(A)
        assert all(np.abs(expected - s).min() < 1e-12 * abs(s) for s in found.eigenvalues)
        w = np.geomspace(1, 300, 7)
        if not b:
            continue
        by_hand = [np.linalg.solve(1j * x * np.eye(4) - A, [0, 0, 0, 23000.0]) for x in w]
        assert np.abs(found.response(w)[:, 0, 0] / np.array(by_hand)[:, 0] - 1).max() < 1e-10
        scipy = found.to_scipy()
        assert all(np.array_equal(getattr(scipy, n), getattr(found, n)) for n in "ABCD")
    undamped = linearize(model, equilibrium(model))
    assert undamped.modes[0].damping > 0 and undamped.units["X_b"] == "m"


def test_a_linear_model_predicts_small_motions_of_a_mechanism() -> None:
    scene = Pendulum(Viscous())
    model = scene.model()
    found = linearize(model, equilibrium(model, guess={"phi": 0.1}))
    size = 1e-5
    run = simulate(model, 2.0, x0={"phi": size, "phi_rate": 0.0}, rtol=1e-10, atol=1e-14)
    values, vectors = np.linalg.eig(found.A)
    start = np.linalg.solve(vectors, [size, 0.0])
    phi = (vectors[0, :, None] * np.exp(values[:, None] * run.t) * start[:, None]).sum(axis=0)
    assert np.abs(phi.real - run["phi"]).max() < 1e-8 * size
    assert found.eigenvalues[0].imag == pytest.approx(
        np.sqrt(9.81 * 0.5 / (1 / 3) - found.eigenvalues[0].real ** 2), rel=1e-9
    )


def test_formulations_of_a_mechanism_agree() -> None:
    for scene in (FourBar(Stribeck()), SliderCrank(Stribeck(), omega=0.0), Pendulum(LuGre())):
        mechanism, found = scene.mechanism(), list[np.ndarray]()
        for formulation, index in (("joint", 1), ("absolute", 0), ("absolute", 1)):
            model = mechanism.build(formulation=formulation, index=index)
            values = linearize(model, equilibrium(model)).eigenvalues
            found.append(values[np.abs(values) > 1e-4 * np.abs(values).max()])
        for other in found[1:]:
            assert other.size == found[0].size
            assert all(np.abs(other - s).min() < 1e-6 * abs(s) for s in found[0]), scene


def two_blocks(second: bool) -> Model:
    """Block on a floor, and one that hangs on it by a spring and feels the force."""
    x = [Variable(f"x_{i}", "m") for i in (1, 2)]
    v = [Variable(f"v_{i}", "m/s") for i in (1, 2)]
    force, k, N = Variable("force", "N"), 50.0, 10.0
    law = ExactCoulomb(mu_s=0.3, mu_d=0.2)
    floor = contact("floor", law, v[0].symbol, N, {"v_1": 0.0})
    slips = (
        (floor, contact("ice", LuGre(mu_s=0.05, mu_d=0.04), v[1].symbol, N)) if second else (floor,)
    )
    spring = k * (x[1] - x[0])
    loads = [spring - slips[0].force, force - spring - (slips[1].force if second else 0)]
    ode = ca.vertcat(v[0].symbol, v[1].symbol, *loads)
    return Model("two", x=(*x, *v), u=(force,), ode=ode, contacts=slips)


def test_contacts_at_rest_survive_loads_up_to_their_levels() -> None:
    for load in (-0.5, 0.0, 1.1):
        for law in (ExactCoulomb(), LuGre()):
            at = equilibrium(drive(law), u={"force": load})
            (guide,) = at.contacts
            assert guide.state == "stick" and guide.margin == pytest.approx(1.1772 - abs(load))
            assert at.survives("force") == pytest.approx((-1.1772, 1.1772), rel=1e-9)
    uneven = Exact(Asymmetric(Coulomb(mu_d=0.1), Coulomb(mu_d=0.3)))
    at = equilibrium(drive(uneven), u={"force": -1.0})
    assert at.survives("force") == pytest.approx((-2.3544, 0.7848), rel=1e-9)
    at = equilibrium(two_blocks(second=False), u={"force": 1.0})
    # the free block follows the force, and the spring passes it on to the floor
    assert at.x["x_2"] - at.x["x_1"] == pytest.approx(1.0 / 50.0)
    assert at.survives("force") == pytest.approx((-3.0, 3.0), rel=1e-9)
    assert at.free == 1
    at = equilibrium(two_blocks(second=True), u={"force": 0.2})
    assert at.survives("force")[1] == pytest.approx(0.5 - (0.2 - at.contacts[1].force), rel=1e-3)


def test_sticking_contacts_keep_their_place_and_bristles_are_springs() -> None:
    stuck = drive(ExactCoulomb())
    found = linearize(stuck, equilibrium(stuck, u={"force": 0.5}))
    assert found.states == ("x",) and not found.A.any() and not found.B.any()
    assert found.stable
    bristles = drive(LuGre(sigma_1=0.0, sigma_2=0.0))
    found = linearize(bristles, equilibrium(bristles))
    assert max(m.frequency for m in found.modes) == pytest.approx(np.sqrt(1e5 / 0.8), rel=1e-9)


def test_an_overloaded_guess_leads_to_the_unloaded_equilibrium() -> None:
    for law in (ExactCoulomb(), LuGre()):
        at = equilibrium(Pendulum(law, phi_0=1.0).model())
        assert abs(at.contacts[0].force) <= at.contacts[0].level * (1 + 1e-9)
        near = equilibrium(Pendulum(law).model(), guess={"phi": 1e-3, "phi_rate": 0.0})
        assert near.x["phi"] == pytest.approx(1e-3, rel=0.1) and near.free == 1
    arm = equilibrium(Arm(ExactCoulomb()).model())
    assert arm.free >= 5 and all(c.margin >= 0 for c in arm.contacts)


def test_a_run_or_an_equilibrium_is_a_guess_and_both_blocks_slide() -> None:
    blocks = CoupledBlocks(ExactCoulomb(sigma_2=0.2), v_belt=2.0).model()
    run = simulate(blocks, 5.0)
    at = equilibrium(blocks, guess=run)
    assert [c.state for c in at.contacts] == ["slip", "slip"] and at.free == 0
    again = equilibrium(blocks, guess=at)
    assert again.x == pytest.approx(at.x, rel=1e-12)
    found = linearize(blocks, at)
    assert found.stable and "stable" in repr(found) and "slips" in repr(at)


def test_cyclic_positions_may_drift() -> None:
    axis = drive(BrownMcPhee(mu_v=0.5) if hasattr(BrownMcPhee(), "mu_v") else BrownMcPhee())
    at = equilibrium(axis, u={"force": 5.0}, guess={"v": 3.0})
    assert at["friction"] == pytest.approx(5.0, rel=1e-12) and at.drift["x"] == at.x["v"] > 0.1
    assert linearize(axis, at).stable


def test_an_implicit_model_has_the_equilibrium_of_the_explicit_one() -> None:
    x, v, u = Variable("x", "m"), Variable("v", "m/s"), Variable("u", "N")
    xdot = ca.SX.sym("xdot", 2)
    rows = ca.vertcat(xdot[0] - v, 2 * xdot[1] + xdot[0] - (u - 50 * x - 3 * v))
    model = Model("implicit", x=(x, v), u=(u,), xdot=xdot, residual=rows)
    at = equilibrium(model, u={"u": 5.0})
    assert at.x["x"] == pytest.approx(0.1, rel=1e-12)
    found = linearize(model, at, inputs=["u"])
    assert np.abs(found.A - [[0, 1], [-25, -2]]).max() < 1e-13
    assert np.abs(found.B - [[0], [0.5]]).max() < 1e-13


def test_a_figure_shows_magnitude_and_phase() -> None:
    model, _ = quarter_car(260.0)
    figure = linearize(model, equilibrium(model)).plot()
    size, angle = figure.axes
    assert len(size.lines) == len(angle.lines) == 4
    assert angle.get_xlabel() == "frequency [rad/s]"


def clock() -> Model:
    t, x = ca.SX.sym("t"), Variable("x", "m")
    return Model("clock", x=(x,), ode=ca.sin(t) - x, t=t)


def test_what_has_no_equilibrium_is_refused() -> None:
    belt, other = rabinowicz(ExactCoulomb()), drive(ExactCoulomb())
    at, sliding = equilibrium(other), equilibrium(belt)
    slide = equilibrium(rabinowicz(LuGre(), free=["v_belt"]))
    smooth = equilibrium(drive(BrownMcPhee()))
    force = Variable("force", "N", start=1.0)
    x, v = Variable("x", "m"), Variable("v", "m/s")
    fall = Model("fall", x=(x, v), u=(force,), ode=ca.vertcat(v.symbol, force.symbol))
    cases = {
        "near the guess, got none": lambda: equilibrium(fall),
        "equations without explicit time": lambda: equilibrium(clock()),
        "expected a model": lambda: equilibrium(LuGre()),
        "one of force, got forc": lambda: equilibrium(other, u={"forc": 1.0}),
        "got y": lambda: equilibrium(other, guess={"y": 1.0}),
        "an equilibrium of 'rabinowicz'": lambda: linearize(belt, at),
        "expected a contact at rest": lambda: slide.survives("v_belt"),
        "got v_bel": lambda: slide.survives("v_bel"),
        "such as ExactCoulomb": lambda: smooth.survives("force"),
        "the package control": lambda: linearize(other, at).to_control(),
        "without resonance": lambda: linearize(belt, sliding).response([1.0, np.sqrt(2.1 / 0.8)]),
        "a model with inputs": lambda: linearize(belt, sliding).plot(),
        "frequencies > 0": lambda: linearize(other, at).plot([-1.0]),
        "got nothing": lambda: linearize(belt, sliding, outputs=["nothing"]),
    }
    for text, call in cases.items():
        with pytest.raises((ValueError, ImportError), match=text):
            call()
