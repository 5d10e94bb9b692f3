"""Estimators of changing friction: batch least squares, a textbook filter, scales, memory."""

import casadi as ca
import numpy as np
import pytest
from one_program import Stepper, along
from scipy.signal import lfilter
from slides import BRISTLES, MAKE, NOISE, STATIC, H, columns, inputs, slid

import symfric as sf
from symfric.codegen import generate, verify
from symfric.codegen.contract import fuzz
from symfric.compensation import compensator, kalman_estimator, recursive_estimator
from symfric.compensation.adapted import Adapted
from symfric.compensation.estimators import prediction
from symfric.scenes import Drive


def test_recursive_estimates_are_those_of_batch_least_squares_with_exponential_weights() -> None:
    """Windows of one sample; the spreads are so wide that their information vanishes."""
    free = ["scale_coulomb", "scale_viscous", "offset", "inertia"]
    memory, noise_F, n = 0.1, 0.1, 2000
    spread = dict.fromkeys(free, 1e5)
    block = recursive_estimator(
        STATIC, mass=1.0, noise=1e-9, accuracy=noise_F, window=H, memory=memory, free=free,
        slowest=1e-3, spread=spread, bounds=dict.fromkeys(free, (-1e7, 1e7)),
    )  # fmt: skip
    v, force = np.random.default_rng(0).standard_normal((2, n)) * [[0.1], [5.0]]
    found = columns(block, inputs(block, v=v, force=force))
    before = np.append(0.0, v[:-1])
    # the law is linear in its scales: regressors from differences of its force
    law = np.array([float(STATIC.force(x, 1.0)) for x in v]) - 20.0 * v
    phi = np.column_stack([law, 20.0 * v, np.ones(n), (v - before) / H])
    kept = (np.abs(v) >= 1e-3) & (v * before > 0)
    weights = np.exp(-H / memory) ** np.arange(n)[::-1]
    root = np.sqrt(weights[kept])[:, None]
    wanted, *_ = np.linalg.lstsq(root * phi[kept], root[:, 0] * force[kept], rcond=None)
    last = np.array([found[name][-1] for name in free])
    assert last == pytest.approx(wanted, rel=1e-10, abs=1e-10)
    assert np.flatnonzero(~kept).size > 2  # reversals


def test_covariance_is_that_of_information_forgotten_towards_the_spreads() -> None:
    """1/P+ = k/P + (1 - k)/S^2 + phi phi'/R, for the windows of 20 samples that are used."""
    block = recursive_estimator(
        STATIC, mass=2.0, noise=1e-4, accuracy=0.2, window=20 * H, memory=0.5, change=5.0
    )
    motion = slid(STATIC, 2000, mass=2.0)
    found = columns(block, inputs(block, **motion))
    v, spread = motion["v"], np.array([1.0, 1.0, 6.0])
    law = np.array([float(STATIC.force(x, 1.0)) for x in v]) - 20.0 * v
    phi = np.column_stack([law, 20.0 * v, np.ones(v.size)]).reshape(-1, 20, 3).mean(axis=1)
    information, keep, used = np.diag(spread**-2.0), np.exp(-20 * H / 0.5), found["used"][19::20]
    R = 0.2**2 + 2 * (2.0 * 1e-4 / (20 * H)) ** 2
    for row, use in zip(phi, used, strict=True):
        information = keep * information + (1 - keep) * np.diag(spread**-2.0)
        information += use * np.outer(row, row) / R
    wanted = np.sqrt(np.diag(np.linalg.inv(information)) * max(1.0, found["excess"][-1])
                     + (spread * 0.5 / 5.0) ** 2)  # fmt: skip
    names = ["scale_coulomb_sd", "scale_viscous_sd", "offset_sd"]
    assert [found[n][-1] for n in names] == pytest.approx(wanted, rel=1e-10)
    assert 0 < used.sum() < used.size


def test_on_a_linear_law_the_filter_is_the_kalman_filter_of_a_textbook() -> None:
    """Viscous friction and an unknown offset: v+ = v + h (u - c v - d) / (m + h c)."""
    m, c, n, change, spread = 2.0, 5.0, 3000, 7.0, 3.0
    law = sf.Viscous(sigma_2=c)
    block = kalman_estimator(
        law, mass=m, noise=0.01, accuracy=0.5, window=0.05, change=change, free=["offset"],
        spread={"offset": spread}, slowest=1e-12,
    )  # fmt: skip
    random = np.random.default_rng(1)
    u = 3.0 * np.sin(0.004 * np.arange(n))
    v = np.empty(n)
    now = 0.0
    for k in range(n):
        now += H * (u[k] - c * now - 1.5) / m
        v[k] = now + 0.01 * random.standard_normal()
    found = columns(block, inputs(block, v=v, force=u))
    M, keep = m + H * c, np.exp(-H / change)
    A = np.array([[1 - H * c / M, -H / M], [0.0, keep]])
    Q = np.diag([0.5**2 * 0.05 * H / M**2, (1 - keep**2) * spread**2])
    x, P, C = np.zeros(2), np.diag([0.01**2, spread**2]), np.array([[1.0, 0.0]])
    for k in range(n):
        x = np.array([x[0] + H * (u[k] - c * x[0] - x[1]) / M, x[1]])
        P = A @ P @ A.T + Q
        gain = P @ C.T / (P[0, 0] + 0.01**2)
        x, P = x + gain[:, 0] * (v[k] - x[0]), (np.eye(2) - gain @ C) @ P
    assert found["excess"].max() < 9.0  # no residual beyond five deviations
    assert found["offset"][-1] == pytest.approx(x[1], rel=1e-10)
    assert found["v_seen"][-1] == pytest.approx(x[0], rel=1e-10)
    shown = np.sqrt(P[1, 1] * max(1.0, found["excess"][-1]))
    assert found["offset_sd"][-1] == pytest.approx(shown, rel=1e-9)


@pytest.mark.parametrize("law", [BRISTLES, sf.LuGreNormalised(), sf.Dahl(), sf.BrownMcPhee()])
def test_derivatives_of_the_prediction_are_those_of_differences(law: sf.Law) -> None:
    f = Adapted("test", law, None, {"mass": 1.0, "noise": NOISE}, None, turning=False, end=True)
    seen, now = ca.SX.sym("v"), ca.SX.sym("now", len(f.theta))
    ahead, slopes, M = prediction(f, seen, now)
    x = ca.vertcat(f.z, seen, now)
    others = [s for s in ca.symvar(ca.vertcat(ahead, M)) if not ca.depends_on(x, s)]
    look = ca.Function("look", [x, ca.vertcat(*others)], [ahead, slopes, M])
    usual = {v.name: float(v.start) for v in f.parts.parameters} | {"force": 3.0, "h": H}
    p = [usual[s.name()] for s in others]
    sizes = np.array([*f.reach, 1e-2, *(float(v.nominal) for v in f.theta)])
    random = np.random.default_rng(2)
    for _ in range(20):
        at = sizes * random.uniform(0.2, 0.9, sizes.size) * random.choice([-1, 1], sizes.size)
        exact, mass = look(at, p)[1].full(), float(look(at, p)[2])
        for j, step in enumerate(1e-6 * sizes):
            ends = [at + sign * step * np.eye(sizes.size)[j] for sign in (1, -1)]
            (up, _, high), (down, _, low) = (look(end, p) for end in ends)
            rate = (up - down).full()[:, 0] / (2 * step)
            k = len(f.reach)  # row of the velocity
            mean = float(look(at, p)[0][k]) - at[k]
            rate[k] += mean * (float(high) - float(low)) / (2 * step) / mass  # M held
            near = 1e-5 * sizes[k] / sizes[j]
            assert exact[k, j] == pytest.approx(rate[k], rel=1e-4, abs=near)


@pytest.mark.parametrize("make", MAKE)
@pytest.mark.parametrize(
    ("length", "force"), [(1e-6, 1e6), pytest.param(1e6, 1e-6, marks=pytest.mark.slow)]
)
def test_estimates_do_not_depend_on_units(make, length: float, force: float) -> None:
    """Lengths and forces in other units, with all scales by default."""

    def run(x: float, F: float) -> dict[str, np.ndarray]:
        law = sf.LuGre(
            mu_s=6.0 * F, mu_d=4.0 * F, v_s=5e-3 * x, sigma_0=1e5 * F / x, sigma_1=300.0 * F / x,
            sigma_2=20.0 * F / x, v_eps=1e-15 * x,
        )  # fmt: skip
        block = make(law, mass=F / x, noise=NOISE * x)
        motion = slid(STATIC, 1500, share=1.5)
        return columns(block, inputs(block, v=motion["v"] * x, force=motion["force"] * F))

    one, other = run(1.0, 1.0), run(length, force)
    for name in ("scale_coulomb", "scale_viscous", "scale_coulomb_sd", "excess"):
        assert other[name] == pytest.approx(one[name], rel=1e-6, abs=1e-8)
    assert other["offset_sd"] == pytest.approx(force * one["offset_sd"], rel=1e-6)


@pytest.mark.parametrize("make", MAKE)
@pytest.mark.parametrize(
    ("h", "level", "colour"),
    [
        pytest.param(1e-3, 1e-3, 0.0, marks=pytest.mark.slow),
        (1e-3, 1e3, 0.0),
        (1e-3, 1.0, 0.98),
        (1e-2, 1.0, 0.0),
        pytest.param(1e-4, 1.0, 0.0, marks=pytest.mark.slow),
    ],
)
def test_levels_and_sample_times_off_by_decades(
    make, h: float, level: float, colour: float
) -> None:
    """Friction of 1.6 times the law is found within three deviations, also in coloured noise."""
    law = sf.LuGre(
        mu_s=6 * level, mu_d=4 * level, v_s=5e-3, sigma_0=1e5 * level, sigma_1=300 * level,
        sigma_2=20 * level,
    )  # fmt: skip
    mass, noise = 1.0 * level, 1e-6 / h / np.sqrt(6)
    random, n = np.random.default_rng(3), round(6.0 / h)
    t = h * np.arange(n + 1)
    v = 0.1 * np.sin(2 * np.pi * 0.5 * t)
    inner = Stepper(sf.codegen.law_block(law), h=h)
    friction = np.array([1.6 * inner(v=x, N=1.0)["F"] for x in v[1:]])
    force = mass * np.diff(v) / h + friction
    block = make(law, mass=mass, noise=noise, h=h)
    white = np.sqrt(1 - colour**2) * random.standard_normal(n)
    seen = v[1:] + noise * lfilter([1.0], [1.0, -colour], white)
    found = columns(block, inputs(block, v=seen, force=force))
    assert abs(found["scale_coulomb"][-1] - 1.6) < 3 * found["scale_coulomb_sd"][-1] < 0.6
    assert found["unseen"][-1] == 0


@pytest.mark.parametrize("make", MAKE)
def test_an_hour_without_motion_keeps_the_estimates_and_widens_their_band(make) -> None:
    """The deviations return to the spreads and not beyond; unseen names all parameters."""
    h = 1.0
    block = make(BRISTLES, mass=1.0, noise=NOISE, h=h)
    motion = slid(STATIC, 3000, share=1.5)
    moving = columns(block, inputs(block, **motion), h=H)
    run = Stepper(block, h=h)
    run.x[:] = [moving[v.name][-1] for v in block.states]
    p = np.array([float(v.start) for v in block.parameters])
    rest = inputs(block, v=np.zeros(3600), force=np.full(3600, 2.0))
    states, outputs = along(block, rest, p, run.x)
    after = dict(zip(block.outputs, outputs[-1], strict=True))
    for name, spread in (("scale_coulomb", 1.0), ("scale_viscous", 1.0), ("offset", 6.0)):
        assert after[name] == pytest.approx(moving[name][-1], rel=1e-12)
        assert after[f"{name}_sd"] <= spread * 1.01 * np.sqrt(max(1.0, after["excess"]))
        assert after[f"{name}_sd"] >= 0.99 * spread
    assert after["unseen"] == 7
    assert np.isfinite(states).all()


@pytest.mark.parametrize("make", MAKE)
def test_outputs_are_within_bounds_for_a_damaged_memory_and_recover(make) -> None:
    bounds = {"scale_coulomb": (0.5, 3.0), "offset": (-2.0, 2.0)}
    block = make(BRISTLES, mass=1.0, noise=NOISE, bounds=bounds, change=2.0)
    motion = slid(STATIC, 6000, share=1.5)
    rows = inputs(block, **motion)
    random = np.random.default_rng(4)
    sizes = np.array([max(v.nominal, abs(float(v.start))) for v in block.states])
    p = np.array([float(v.start) for v in block.parameters])
    good = columns(block, rows)["scale_coulomb"][-1]
    for k in range(12):
        state = sizes * random.standard_normal(sizes.size) * 10.0 ** random.uniform(-9, 9)
        _, outputs = along(block, rows if k < 3 else rows[:50], p, state)
        found = dict(zip(block.outputs, outputs.T, strict=True))
        assert np.isfinite(outputs).all()
        for name, (low, high) in bounds.items():
            assert ((found[name] >= low) & (found[name] <= high)).all()
        if k < 3:
            assert found["scale_coulomb"][-1] == pytest.approx(good, abs=0.05)


@pytest.mark.parametrize("make", MAKE)
def test_estimates_are_frozen_when_samples_are_not_valid(make) -> None:
    """At rest, at the limit of the force, and while `learn` is 0."""
    block = make(BRISTLES, mass=1.0, noise=NOISE, valid=50.0)
    motion = slid(STATIC, 2000, share=1.5)
    one = np.ones(2000)
    for signals in (
        motion | {"v": 1e-3 * one}, motion | {"force": 50.0 * one}, motion | {"learn": 0.0 * one}
    ):  # fmt: skip
        found = columns(block, inputs(block, **signals))
        assert (found["scale_coulomb"] == 1.0).all()
        assert (found["offset"] == 0.0).all()
        assert (found["used"] == 0.0).all()
    assert columns(block, inputs(block, **motion))["scale_coulomb"][-1] > 1.2


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("make", "law"), [(kalman_estimator, BRISTLES), (recursive_estimator, STATIC)]
)
def test_the_c_has_the_bits_of_casadi(make, law: sf.Law, tmp_path, compiler, monkeypatch) -> None:
    del compiler
    for name, steps in {"STEPS": 4000, "FEWER": 1000}.items():
        monkeypatch.setattr(f"symfric.codegen.verification.{name}", steps)
    found = verify(generate(make(law, mass=1.0, noise=NOISE), tmp_path, kit=False))
    assert found.ok, found.status


@pytest.mark.slow
@pytest.mark.parametrize("make", MAKE)
@pytest.mark.parametrize("real", ["float", "double"])
def test_random_bits_are_repaired_and_flagged(make, real: str, compiler) -> None:
    found = fuzz(make(BRISTLES, mass=1.0, noise=NOISE), real, compiler, steps=100_000)
    assert found.ok, found
    assert found.last_resort == 0


def test_names_and_units_are_those_of_the_compensator() -> None:
    drive = Drive(BRISTLES, m=2.0, N=3.0, offset=0.5, turning=True)
    block = recursive_estimator(drive, noise=NOISE, free=["scale_coulomb", "offset", "inertia"])
    parts = compensator(drive, inertia=2.0, scales=["coulomb"])
    units = {v.name: v.unit for v in parts.parameters}
    names = units.keys() & block.outputs.keys()
    assert names == {"scale_coulomb", "offset", "inertia"}
    assert all(block.outputs[name].unit == units[name] for name in names)
    states = {v.name: float(v.start) for v in block.states}
    assert (states["offset_now"], states["inertia_now"]) == (0.5, 2.0)


def test_the_filter_estimates_parameters_of_the_law_itself() -> None:
    """Levels and viscous coefficient by their own names; least squares for a law without states."""
    motion = slid(STATIC, 6000, share=1.5)
    for make, law in ((kalman_estimator, BRISTLES), (recursive_estimator, STATIC)):
        block = make(law, mass=1.0, noise=NOISE, free=["mu_d", "sigma_2"])
        found = columns(block, inputs(block, **motion))
        assert found["mu_d"][-1] == pytest.approx(6.0, abs=3 * found["mu_d_sd"][-1])
        assert found["sigma_2"][-1] == pytest.approx(30.0, abs=3 * found["sigma_2_sd"][-1])
        assert (found["mu_d_sd"][-1], found["sigma_2_sd"][-1]) < (0.7, 7.0)
        assert block.outputs["sigma_2"].unit == "N s/m"
