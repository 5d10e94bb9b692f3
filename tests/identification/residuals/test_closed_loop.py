import pickle
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from fits import check_slopes, evaluated

from identification.data.dataset import Dataset
from identification.data.record import PositionLoop, Record
from identification.residuals import stepper
from identification.residuals.closed_loop import ClosedLoop, Controller, LoopRows
from identification.solving.descent import descend
from identification.solving.task import task
from identification.unknowns.subject import Subject, subject
from identification.unknowns.unknowns import unknowns_of
from symfric import Coulomb, Sum, Viscous
from symfric.scenes import Drive

N, STEP = 1500, 1e-3
T = np.arange(N) * STEP
REFERENCE = 0.02 * np.sin(2 * np.pi * T)
PULSE = np.where(np.arange(N) == 700, 3.0, 0.0)
LOOP = PositionLoop(60.0, 200.0, 30.0, 10.0, REFERENCE, PULSE)
TRUE = {"m": 95.0, "mu_d": 20.0, "sigma_2": 200.0, "offset": -3.0}


@pytest.fixture(autouse=True)
def _no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """Short runs are not worth a compiler, and have the same bits without it."""
    monkeypatch.setattr(stepper, "find_compiler", lambda: None)


def by_hand(substeps: int = 50) -> tuple[np.ndarray, np.ndarray]:
    """The loop step by step, with the impulse clamp of dry friction."""
    x = v = x_last = mean_last = 0.0
    h = STEP / substeps
    positions, forces = [], []
    for k in range(N):
        mean = (x + x_last) / 2
        u = LOOP.kp * LOOP.kv * (REFERENCE[k] - x) - LOOP.kv * (mean - mean_last) / STEP
        x_last, mean_last = x, mean
        force = LOOP.gain * (float(np.clip(u, -10, 10)) + PULSE[k])
        positions.append(x)
        forces.append(force)
        for _ in range(substeps):
            free = v + h * (force + 3.0 - 200.0 * v) / 95.0
            new = np.sign(free) * max(abs(free) - h * 20.0 / 95.0, 0.0)
            x += h * (v + new) / 2
            v = new
    return np.array(positions), np.array(forces)


def of(values: dict[str, float], names: tuple[str, ...]) -> np.ndarray:
    return np.array([values[name] for name in names])


@pytest.fixture(scope="module")
def data() -> Dataset:
    x, force = by_hand()
    units = {"x": "m", "force": "N"}
    return Dataset((Record("hand", T, {"x": x, "force": force}, units, loop=LOOP),), "hand")


@pytest.fixture(scope="module")
def drive() -> Subject:
    law = Sum((Coulomb(20.0, 1e-8), Viscous(200.0)))
    return subject(Drive(law, m=95.0, N=1.0, offset=-3.0), free=["offset"], fixed={"v_eps": 1e-8})


@pytest.fixture(scope="module")
def rows(data: Dataset, drive: Subject) -> LoopRows:
    return ClosedLoop().prepare(drive, data)


def test_residuals_vanish_at_the_impulse_clamp(rows: LoopRows) -> None:
    found = evaluated(rows, of(TRUE, rows.names))
    x, force = (found.r[c.rows] for c in rows.channels)
    assert [c.signal for c in rows.channels] == ["x", "force"]
    assert np.abs(x).max() < 5e-4 * 0.02
    assert np.linalg.norm(force) < 0.01 * np.linalg.norm(rows.channels[1].measured)


def test_a_record_may_begin_in_motion(data: Dataset, drive: Subject) -> None:
    """The controller remembers the velocity that the drive has: no kick at the cut."""
    part = Dataset((data[0].at(slice(1000, None)),), "part")
    rows = ClosedLoop().prepare(drive, part)
    found = evaluated(rows, of(TRUE, rows.names))
    force = rows.channels[1]
    assert np.abs(found.r[force.rows]).max() < 0.05 * np.abs(force.measured).max()


def test_disturbance_enters_after_the_limit(rows: LoopRows) -> None:
    found = rows.runs[0].signals(of(TRUE, rows.names), np.zeros(2))
    u = found["force"][0]
    assert np.abs(np.delete(u, 700)).max() <= 300.0 + 1e-9
    assert u[700] - u[699] == pytest.approx(90.0, abs=15.0)


def test_slopes_are_those_of_finite_differences(data: Dataset, drive: Subject) -> None:
    rows = ClosedLoop(x0="estimate", signals=("x", "v", "force")).prepare(drive, with_v(data))
    assert rows.names[-2:] == ("x0.x[0]", "x0.v[0]")
    at = of(TRUE | {"x0.x[0]": 1e-3, "x0.v[0]": 0.05}, rows.names)
    check_slopes(rows, at, least=0.1)


def with_v(data: Dataset) -> Dataset:
    x = data[0]["x"]
    signals = {**data[0].signals, "v": np.gradient(x, STEP)}
    return Dataset((replace(data[0], signals=signals, units={**data[0].units, "v": "m/s"}),), "v")


def test_a_fit_finds_the_drive_of_the_other_simulation(rows: LoopRows, drive: Subject) -> None:
    unknowns = unknowns_of([*drive.unknowns, *rows.own], drive.ties, rows.names, drive.held)
    start = {"m": 80.0, "mu_d": 12.0, "sigma_2": 260.0, "offset": 0.0}
    end = descend(task(rows, unknowns), unknowns.of(start))
    found = dict(zip(rows.names, unknowns.values(end.w), strict=True))
    assert end.evaluations <= 12
    for name, value in TRUE.items():
        assert found[name] == pytest.approx(value, rel=5e-3), name


def test_a_user_controller_is_the_same_loop(data: Dataset, drive: Subject) -> None:
    s, x, r, xv = (ca.SX.sym(name, n) for name, n in (("s", 2), ("x", 1), ("r", 1), ("xv", 2)))
    mean = (x + s[0]) / 2
    command = LOOP.kp * LOOP.kv * (r - x) - LOOP.kv * (mean - s[1]) / STEP
    command = ca.fmin(ca.fmax(command, -LOOP.limit), LOOP.limit)
    step = ca.Function("mine", [s, x, r], [ca.vertcat(x, mean), command])
    before = ca.vertcat(xv[0] - STEP * xv[1], xv[0] - 1.5 * STEP * xv[1])
    start = ca.Function("start", [xv], [before])
    controller = Controller(step, ("goal",), "pulse", gain=LOOP.gain, start=start)
    signals = {**data[0].signals, "goal": REFERENCE, "pulse": PULSE}
    mine = Dataset((Record("mine", T, signals, {**data[0].units, "goal": "m", "pulse": "1"}),))
    rows, known = ClosedLoop(controller).prepare(drive, mine), ClosedLoop().prepare(drive, data)
    found, other = (evaluated(r, of(TRUE, r.names)) for r in (rows, known))
    np.testing.assert_allclose(found.r, other.r, atol=1e-12)
    np.testing.assert_allclose(found.J, other.J, atol=1e-9)


def test_residuals_go_to_other_processes(rows: LoopRows) -> None:
    at = of(TRUE, rows.names)
    one, two = (evaluated(r, at) for r in (rows, pickle.loads(pickle.dumps(rows))))
    np.testing.assert_array_equal(one.J, two.J)


def test_a_motion_that_is_not_finite_is_reported(rows: LoopRows) -> None:
    assert rows.at(np.full(len(rows.names), np.nan)).startswith("data 'hand': ")


def test_every_record_has_its_own_start(data: Dataset, drive: Subject) -> None:
    both = Dataset((data[0].at(slice(0, 40)), data[0].at(slice(200, 240))), "both")
    rows = ClosedLoop(x0="estimate").prepare(drive, both)
    assert rows.names[-4:] == ("x0.x[0]", "x0.v[0]", "x0.x[1]", "x0.v[1]")
    found = evaluated(rows, np.array([*of(TRUE, rows.names[:-4]), *(u.start for u in rows.own)]))
    own = [found.J[c.rows, -4:] for c in rows.channels if c.signal == "x"]
    np.testing.assert_allclose([part[0] for part in own], np.eye(4)[[0, 2]])
    assert not own[0][:, 2:].any()
    assert not own[1][:, :2].any()
