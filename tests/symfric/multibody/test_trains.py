"""Trains with brakes, clutches and belts: energy, inverse dynamics, optimal control, all laws."""

from collections.abc import Callable
from math import log
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from chains import attach
from scipy.integrate import solve_ivp
from shafts import SHOE, K, at_start, brake, driven, drum, dry, shafts
from units import OK, Archive, Rates

import symfric as sf
from ocp import Phase, Problem, integral, solve
from symfric import Variable, simulate
from symfric import multibody as mb
from symfric.codegen import generate, inverse_dynamics_block, verify
from symfric.fmu import export_fmu
from symfric.laws import ALL_LAWS, Law, law_from_text

pytestmark = pytest.mark.heavy


def accepts(law: Law) -> bool:
    try:
        driven(drum(law, 100.0, "trailing"), 3.0).prepare()
    except ValueError as error:
        assert "element 'w' > law: expected one that" in str(error)
        return False
    return True


@pytest.mark.slow
def test_every_law_brakes_or_is_refused_in_one_sentence() -> None:
    refused = set[str]()
    for name in ALL_LAWS:
        law = law_from_text(name)
        if not accepts(law):
            refused.add(name)
            continue
        run = simulate(driven(drum(law, 100.0, "trailing"), 3.0).build(), 0.2, rtol=1e-8)
        balance = run.energy_balance()
        assert run.final["a_rate"] < 3.0, name
        assert np.abs(balance.defect).max() < 1e-6 * balance.scale, name
    assert refused == {
        "viscous", "power_law_viscous", "steady_state_lugre", "rui_wang", "makkar_dixon",
        "wojewoda", "quarter_car_general", "quarter_car_simple", "bam", "brush_tyre", "lugre_tyre",
    }  # fmt: skip


def by_scipy(slope: Callable[[Any], Any], begin: Any, end: float) -> Any:
    """State at the end of w' = slope(w)."""

    def rates(t: float, w: Any) -> Any:
        return slope(w)

    return solve_ivp(rates, (0, end), begin, "LSODA", rtol=1e-11, atol=1e-11).y[:, -1]


def random_train(seed: int) -> tuple[Any, Callable[[np.ndarray], np.ndarray]]:
    """Three shafts and a load under a motor, with four elements, and its accelerations by hand."""
    rng = np.random.default_rng(seed)
    law = sf.Coulomb(mu_d=rng.uniform(0.05, 0.4), v_eps=0.05)
    J, mass, torque = rng.uniform(0.1, 2, 3), rng.uniform(1, 20), rng.uniform(5, 20)
    P, r, angle = rng.uniform(20, 200, 4), rng.uniform(0.05, 0.3, 4), rng.uniform(1, 6, 2)
    kind = rng.choice(["leading", "trailing"])
    m = mb.Mechanism("train", gravity=(0.0, 0.0, 0.0))
    for name, inertia, rate in zip("abc", J, rng.uniform(-20, 20, 3), strict=True):
        attach(m, mb.Revolute, name, f"shaft_{name}", J=float(inertia), rate=float(rate))
    attach(m, mb.Prismatic, "rope", "load", mass=float(mass))
    m.force(mb.JointSpringDamper("motor", "a", actuator=float(torque)))
    m.force(mb.Belt("belt", "a", "b", law, P[0], r[0], r[1], angle[0]))
    m.force(mb.DiscClutch("clutch", "b", law, P[1], 0.2, 0.1, "c"))
    m.force(mb.CapstanDrum("winch", "rope", law, P[2], r[2], angle[1], "c"))
    m.force(mb.DrumBrake("brake", "c", law, P[3], r[3], 0.3, 0.16, 0.1, shoes=str(kind)))
    ring, k = 2 / 3 * (0.2**3 - 0.1**3) / (0.2**2 - 0.1**2), 0.1 / 0.16

    def accelerations(w: np.ndarray) -> np.ndarray:
        def mu(v: float) -> float:
            return law.mu_d * np.tanh(v / 0.05)

        F = 2 * P[0] * np.tanh(mu(r[0] * w[0] - r[1] * w[1]) * angle[0] / 2)
        T = mu(ring * (w[1] - w[2])) * P[1] * ring
        R = P[2] * np.expm1(mu(r[2] * w[2] - w[3]) * angle[1])
        m_c = mu(r[3] * w[2])
        B = r[3] * m_c * P[3] * 0.3 / 0.16 / (1 - m_c * k * (1 if kind == "leading" else -1))
        moments = torque - r[0] * F, r[1] * F - T, T - r[2] * R - B
        return np.array([*(M / j for M, j in zip(moments, J, strict=True)), (P[2] + R) / mass])

    return m, accelerations


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 10))]
)
def test_energy_of_random_trains_closes(seed: int) -> None:
    m, accelerations = random_train(seed)
    run = simulate(m.build(), 0.2, rtol=1e-11, samples=51)
    balance = run.energy_balance()
    assert np.abs(balance.defect).max() < 1e-9 * balance.scale
    losses = sum(run.integral(f"{name}_power") for name in ("belt", "clutch", "winch", "brake"))
    put_in = balance.work["motor"] + balance.work["winch"]
    assert put_in - losses == pytest.approx(
        run["kinetic"] - run["kinetic"][0], abs=1e-9 * balance.scale
    )
    names = ("a_rate", "b_rate", "c_rate", "rope_rate")
    begin = [run[name][0] for name in names]
    same = by_scipy(accelerations, begin, 0.2)
    assert [run.final[name] for name in names] == pytest.approx(same, abs=1e-7)


def test_inverse_dynamics_needs_what_the_motion_gives() -> None:
    """The torque of the motor in C and in `functions`, for the accelerations of the model."""
    P = Variable("P", "N", start=80.0)
    for seed in range(1):
        m, _ = random_train(seed)
        m.forces = [f for f in m.forces if f.name != "motor"]
        m.forces[-1] = mb.DrumBrake("brake", "c", m.forces[-1].law, P, *SHOE)
        w = np.random.default_rng(seed).normal(size=4) * 9
        a = np.random.default_rng(seed + 9).normal(size=4)
        block = inverse_dynamics_block(m, p=(P,))
        values = [float(v.start) for v in block.parameters]
        _, found = block.step(ca.DM(), values, np.concatenate([np.zeros(4), w, a]))
        same = mb.functions(m, p=(P,))["inverse_dynamics"](np.zeros(4), w, a, [], [], [], [80.0])
        assert found.full().ravel() == pytest.approx(same.full().ravel(), rel=1e-13)
        lost = at_start(moving(m, w), "joint")
        friction = sum(
            lost[f"{n}_friction"][0] * lost[f"{n}_slip"][0]
            for n in ("belt", "clutch", "winch", "brake")
        )
        inertia = mb.functions(m, p=(P,))["mass"](np.zeros(4), [80.0]).full() @ a
        hand = m.forces[-2].tension * w[3]
        assert w @ (found.full().ravel() - inertia) == pytest.approx(friction - hand, rel=1e-9)


@needs_compiler
@pytest.mark.slow
def test_inverse_dynamics_in_c_has_the_same_bits(tmp_path: Path) -> None:
    block = inverse_dynamics_block(random_train(4)[0])
    checks = verify(generate(block, tmp_path)).checks
    assert [(c.real, c.warnings) for c in checks] == [("double", ()), ("float", ())]
    assert checks[0].ulp == 0
    assert checks[1].error < 1e-5


@needs_compiler
@pytest.mark.slow
def test_a_functional_mock_up_unit_has_the_rates_of_the_brake(tmp_path: Path) -> None:
    model = brake()
    unit = export_fmu(model, tmp_path / "brake.fmu", fmi=3, t_end=1.0, kind="model-exchange")
    opened = Rates(Archive(unit.path, tmp_path / "open"))
    assert opened.begin() == OK
    p, u = model.values("p"), model.values("u")
    for x in np.random.default_rng(0).uniform(-9.0, 9.0, (20, len(model.x))):
        found = opened.rates(0.3, x)
        z = opened.get(*(v.name for v in model.z))
        assert z[0] > 100.0
        assert np.abs(model.function("alg")(0.3, x, z, u, p).full()).max() < 1e-9 * z[0]
        expected = model.function("ode")(0.3, x, z, u, p).full().ravel()
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)
    opened.free()


def moving(m: Any, rates: np.ndarray) -> mb.Mechanism:
    """The mechanism at other rates, with the brake at 80 N."""
    pairs = zip(m.joints, rates.tolist(), strict=True)
    joints = [type(j)(j.name, j.parent, j.child, rate=w) for j, w in pairs]
    other = mb.Mechanism("moving", gravity=(0.0, 0.0, 0.0))
    other.bodies, other.joints, other.frames, other.forces = m.bodies, joints, m.frames, m.forces
    other.forces = [*m.forces[:-1], mb.DrumBrake("brake", "c", m.forces[0].law, 80.0, *SHOE)]
    return other


@pytest.mark.slow
@pytest.mark.parametrize("law", [sf.BrownMcPhee(mu_s=0.3, mu_d=0.3, mu_v=0.0), dry(0.3)])
def test_the_optimal_stop_presses_constantly(law: Law) -> None:
    """Least integral of P^2: the torque J w / T is constant, P by the closed form."""
    m = shafts(20.0)
    m.force(drum(law, m.input("P", "N", start=10.0, nominal=100.0), "leading and trailing"))
    phase = Phase(m.build(), T=1.0, start={"a": 0.0, "a_rate": 20.0}, end={"a_rate": 0.0})
    problem = Problem(phase, integral(lambda s: (s.P / 100) ** 2), bounds={"P": (0.0, 500.0)})
    solution = solve(problem, intervals=10)
    P = 0.5 * 20 * (1 - (0.3 * K) ** 2) / (2 * 0.2 * 0.3 * 0.3 / 0.16)
    assert solution.verified
    assert solution.cost == pytest.approx((P / 100) ** 2, rel=1e-8)


def test_a_plain_bearing_follows_its_hersey_number() -> None:
    """J w' = -r F(r w, N) with N the weight of the rotor."""
    law = sf.MixedLubrication(eta=0.03, A=2e-3)
    m = mb.Mechanism("rotor", gravity=(-10.0, 0.0, 0.0))
    bearing = mb.JointFriction(law, radius=0.02, eps=1e-9)
    attach(m, mb.Revolute, "a", "rotor", mass=20.0, J=0.05, rate=100.0, friction=bearing)
    run = simulate(m.build(), 3.0, rtol=1e-9)
    H = 0.03 * 0.02 * run["a_rate"] * 2e-3 / 200.0
    mu = 0.1 / (1 + (H / 1e-8) ** 2) + H / 2e-5
    assert run["a_friction"][:-1] == pytest.approx(200.0 * mu[:-1], rel=1e-6)
    assert log(H[0] / 1e-8) > 4  # a full film at the start
    same = by_scipy(lambda w: -0.02 / 0.05 * law.force(0.02 * w, 200.0), [100.0], 3.0)
    assert run.final["a_rate"] == pytest.approx(same[0], abs=1e-6)
