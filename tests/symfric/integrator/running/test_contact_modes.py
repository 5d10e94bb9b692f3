"""Modes of several contacts that change at one time, against the referee of optimal control."""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose

from symfric import Contact, Event, Hold, Model, Trajectory, Variable, simulate, simulate_many
from symfric.bench.ocp_cases import Case
from symfric.bench.ocp_referee import judged
from symfric.foundation.numeric import Array
from symfric.laws import ExactCoulomb

SEEDS = [*range(3), *(pytest.param(k, marks=pytest.mark.slow) for k in range(3, 20))]


def machine(seed: int, share: float) -> tuple[Case, Model, Array, Array]:
    """Chain of 1 to 4 blocks, each on the ground or on the block before it, and a random control.

    States are the positions and the sliding velocities s = G v. `share` is the ratio of both
    levels.
    """
    rng = np.random.default_rng(seed)
    n = 1 + seed % 4
    mass, stiffness, damping = rng.uniform(0.5, 2.0, n), rng.uniform(0, 60, n), rng.uniform(0, 1, n)
    G = np.eye(n) - np.diag(rng.random(n - 1) < 0.5, -1)
    back, pushed = np.linalg.inv(G), int(rng.integers(n))
    sliding = rng.uniform(1.0, 4.0, n)

    def rate(m: Any, x: Any, u: Any, F: Any) -> list[Any]:
        v = [sum(back[i, j] * x[n + j] for j in range(n)) for i in range(n)]
        force = [-sum(G[j, i] * F[j] for j in range(n)) for i in range(n)]
        force[pushed] = force[pushed] + u
        for i in range(n - 1):
            pull = stiffness[i] * (x[i + 1] - x[i]) + damping[i] * (v[i + 1] - v[i])
            force[i], force[i + 1] = force[i] + pull, force[i + 1] - pull
        change = [sum(G[j, i] * force[i] / mass[i] for i in range(n)) for j in range(n)]
        return [*v, *change]

    case = Case(
        "machine", "", tuple(f"y{i}" for i in range(2 * n)), rate, tuple(range(n, 2 * n)),
        tuple((share * level, level) for level in sliding), (0.0,) * (2 * n), {}, 20.0, 1.5,
        normal=lambda m, x, u: [1.0] * n,
    )  # fmt: skip
    x, u = [Variable(name, "1") for name in case.states], Variable("u", "N")
    contacts = tuple(
        Contact(f"c{i}", x[n + i].symbol, 1.0, ExactCoulomb(mu_s=static, mu_d=level))
        for i, (static, level) in enumerate(case.levels)
    )
    symbols, F = [v.symbol for v in x], [c.force for c in contacts]
    ode = ca.vertcat(*rate(None, symbols, u.symbol, F))
    model = Model("machine", x=tuple(x), u=(u,), ode=ode, contacts=contacts)
    return case, model, np.linspace(0.0, 1.5, 7), rng.uniform(-20.0, 20.0, 6)


@pytest.mark.parametrize("seed", SEEDS)
def test_machines_of_one_to_four_contacts_move_as_by_the_referee(seed: int) -> None:
    """With equal levels the modes are unique; the miss of the referee is that of the last state."""
    case, model, edges, controls = machine(seed, 1.0)
    run = simulate(model, case.T, u={"u": Hold(edges[:-1], controls)}, rtol=1e-10)
    for i, name in enumerate(case.states):
        last = float(run[name][-1])
        alone = replace(case, ends={1.0: {i: last + 1e3}})
        miss = judged(alone, edges, controls).miss * max(1.0, last + 1e3)
        assert last + 1e3 - miss == pytest.approx(last, abs=1e-6)


@pytest.mark.parametrize("backend", ["vm", "compiled"])
def test_modes_after_each_change_are_consistent(backend: str) -> None:
    """Forces at rest are within the static levels; sliding forces oppose the sliding."""
    for seed in (3, 19):
        case, model, edges, controls = machine(seed, 1.5)
        run = simulate(model, case.T, u={"u": Hold(edges[:-1], controls)}, backend=backend)
        times = np.linspace(0.0, case.T, 1501)
        for c, (static, sliding) in zip(model.contacts, case.levels, strict=True):
            slip, force, mode = run.of(ca.vertcat(c.slip, c.friction, c.states[0].symbol), times)
            rests = np.abs(mode) < 0.5
            assert np.abs(force[rests]).max(initial=0.0) <= static * (1 + 1e-6)
            assert np.abs(slip[rests]).max(initial=0.0) < 1e-9
            assert_allclose(force[~rests], sliding * np.round(mode[~rests]), rtol=1e-9)
            assert (slip[~rests] * mode[~rests] > -1e-9).all()


def stack(level: float = 1.0, *, kick: bool = False) -> Model:
    """Two equal blocks, the upper one on the lower one, whose contact has the level `level`.

    With a `kick`, the lower block gets the velocity J at time T.
    """
    x = [Variable(f"x{i}", "m") for i in range(2)]
    v = [Variable(f"v{i}", "m/s") for i in range(2)]
    u, t = Variable("force", "N"), ca.SX.sym("t")
    p = Variable("T", "s", start=0.4), Variable("J", "m/s", start=2.0)
    low = Contact("low", v[0].symbol, 2.0, ExactCoulomb(mu_s=1.0, mu_d=1.0))
    top = Contact("top", v[1].symbol - v[0].symbol, 1.0, ExactCoulomb(mu_s=level, mu_d=level))
    ode = ca.vertcat(v[0].symbol, v[1].symbol, u.symbol - low.force + top.force, -top.force)
    hit = Event("kick", t - p[0].symbol, 1, reset={"v0": v[0].symbol + p[1].symbol})
    return Model(
        "stack", x=(*x, *v), u=(u,), p=p, t=t, ode=ode, contacts=(low, top), events=(hit,) * kick
    )


@pytest.mark.parametrize(("force", "speeds"), [(1.9, (0, 0)), (3.0, (0.5, 0.5)), (5.0, (2.0, 1.0))])
def test_a_carried_block_sticks_if_it_can(force: float, speeds: tuple[float, float]) -> None:
    """A push of u moves both blocks together up to u = 2 + 2, then the upper one slides back."""
    for backend in ("vm", "compiled"):
        run = simulate(stack(), 1.0, u={"force": force}, backend=backend)
        assert_allclose([run.final["v0"], run.final["v1"]], speeds, atol=1e-9)
    many = simulate_many(stack(), 1.0, u={"force": np.array([force, force])})
    assert_allclose(many["v1"][:, -1], speeds[1], atol=1e-9)


@pytest.mark.parametrize("force", [0.0, 3.0])
def test_derivatives_after_a_decision_agree_with_differences(force: float) -> None:
    """The kick starts both contacts from rest, or the upper one while the lower one slides."""
    model, at, h = stack(1.3, kick=True), {"T": 0.4, "J": 2.0}, 1e-5

    def run(**given: Any) -> Trajectory:
        return simulate(model, 1.0, u={"force": force}, t_eval=[1.0], rtol=1e-11, **given)

    slopes = run(sensitivities=[*at]).sensitivities
    for name, value in at.items():
        up, down = (run(p={name: value + step}) for step in (h, -h))
        for signal in ("x0", "x1", "v0", "v1"):
            difference = (up[signal][0] - down[signal][0]) / (2 * h)
            assert slopes[name][signal][0] == pytest.approx(difference, abs=1e-6)
