"""Sticking valves: flow charts of the papers in plain Python, phase plots, limit cycles, C."""

from itertools import pairwise
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray
from one_program import along

from symfric.codegen import Block, generate, verify
from symfric.compensation import valve_describing_function, valve_stiction
from symfric.compensation.valves import FORMS

Array = NDArray[np.float64]
PAIRS = [(5.0, 2.0), (0.3, 0.3), (1e-3, 1e-5), (40.0, 0.0), (0.0, 0.0)]


def answered(block: Block, u: Array, start: ca.DM | None = None) -> Array:
    """Return the positions for a sequence of inputs."""
    return along(block, u[:, None], state=start)[1][:, 0]


def sign(x: float) -> int:
    return (x > 0) - (x < 0)


def kano(u: Array, S: float, J: float) -> list[float]:
    """Figure 3 of the paper: stp, u_s and d, from rest without residual force."""
    x, stp, d, u_s, old, du_old = 0.0, 1, 1, (S - J) / 2, 0.0, 0.0
    found: list[float] = []
    for now in u.tolist():
        du = now - old
        if du * du_old <= 0 and stp == 0:
            u_s, stp = old, 1
        if stp == 0:
            x = now - d / 2 * (S - J)
        elif -d * (now - u_s) > S:
            d = -d
            x, stp = now - d / 2 * (S - J), 0
        elif d * (now - u_s) > J:
            x, stp = now - d / 2 * (S - J), 0
        found.append(x)
        old, du_old = now, du
    return found


def choudhury(u: Array, S: float, J: float) -> list[float]:
    """Figure 9 of the paper: the flag I, and the last signal x_ss before the valve stopped."""
    x, stuck, u_s, old, way_old = 0.0, True, 0.0, 0.0, 0
    found: list[float] = []
    for now in u.tolist():
        way = sign(now - old)
        if way != way_old:
            if not stuck:
                u_s = old
            slips = way != 0 and abs(now - x) > (S + J) / 2
        elif not stuck:
            slips = True
        elif sign(now - u_s) * sign(u_s - x) == 1:
            slips = abs(now - u_s) > J
        else:
            slips = abs(now - x) > (S + J) / 2
        if slips:
            x = now - way * (S - J) / 2
        stuck = not slips
        found.append(x)
        old, way_old = now, way
    return found


def he(u: Array, S: float, J: float) -> list[float]:
    """Figure 5 of the paper: the residual u_r, with f_s = (S + J)/2 and f_d = (S - J)/2."""
    f_s, f_d, x, u_r, old = (S + J) / 2, (S - J) / 2, 0.0, 0.0, 0.0
    found: list[float] = []
    for now in u.tolist():
        total = u_r + (now - old)
        if abs(total) > f_s:
            u_r = sign(total) * f_d
            x = now - u_r
        else:
            u_r = total
        found.append(x)
        old = now
    return found


CHARTS = {"kano": kano, "choudhury": choudhury, "he": he}


@pytest.mark.parametrize("form", FORMS)
def test_every_step_is_that_of_the_flow_chart(form: str) -> None:
    """Random walks with pauses and reversals, over decades of S and J, and beyond S for Kano."""
    for seed, (S, J) in enumerate([*PAIRS, *[(3.0, 4.0)] * (form != "he")]):
        rng = np.random.default_rng(seed)
        moves = rng.normal(size=2000) * rng.choice([0.0, 0.03, 0.3, 2.0], 2000)
        slow = np.repeat(rng.choice([-1.0, 1.0], 100), 20) * rng.uniform(0, 0.4, 2000)
        for steps in (moves, slow):
            u = np.cumsum(steps) * (S or 1.0)
            assert answered(valve_stiction(S, J, form=form), u).tolist() == CHARTS[form](u, S, J)


def triangle(top: float, count: int) -> Array:
    """Return two and a quarter periods of a triangle, from zero up."""
    quarter = np.arange(1, count + 1) / count * top
    return np.concatenate([quarter, *[top - 2 * quarter, 2 * quarter - top] * 2])


def test_phase_plot_has_deadband_jump_and_offset() -> None:
    """After a reversal at u = A: x stays while u returns by S, then jumps by J and follows u."""
    for S, J in PAIRS[:4]:
        A, n = 3 * (S + J), 4000
        u, fine = triangle(A, n), A / n * (2 + 1e-6)
        for form in ("kano", "choudhury"):
            x = answered(valve_stiction(S, J, form=form), u)
            back, level = slice(n, 2 * n), A - (S - J) / 2
            stays = A - u[back] < S - 1e-9 * A
            assert x[back][stays] == pytest.approx(level, rel=1e-12)
            follows = A - u[back] > S + fine
            assert x[back][follows] == pytest.approx(u[back][follows] + (S - J) / 2)
            jump = np.abs(np.diff(x[back])).max() if J else 0.0
            assert J <= jump + 1e-9 * A <= J + fine
        slow = answered(valve_stiction(S, J, form="he"), u[:n])
        risen = np.diff(np.concatenate([[0.0], slow]))
        expected = J if fine < J else 0.0
        assert risen[risen > 0][1:] == pytest.approx(expected, abs=fine)


def test_valves_without_stiction_follow_the_controller() -> None:
    u = np.random.default_rng(5).normal(size=300)
    for form in FORMS:
        assert answered(valve_stiction(0.0, 0.0, form=form), u) == pytest.approx(u, rel=1e-15)


def looped(block: Block, gain: float, r: float, count: int) -> Array:
    """Return positions under integral control of a static process: u+ = u + gain (r - x)."""
    z, u = ca.SX.sym("z", len(block.states)), ca.SX.sym("u")
    p = ca.DM([float(v.start) for v in block.parameters])
    new = u + gain * (r - z[1])
    after, x = block.step(z, p, new)
    run = ca.Function("loop", [ca.vertcat(z, u)], [ca.vertcat(after, new), x]).mapaccum(count)
    return run(ca.DM([*(float(v.start) for v in block.states), 0.0]))[1].full().ravel()


def test_integral_control_of_a_static_process_oscillates_as_the_closed_form() -> None:
    """At rest at a distance a from r, u moves by S in the time S / (k a), then x jumps by J."""
    for S, J, form in (
        (5.0, 2.0, "kano"), (5.0, 2.0, "choudhury"), (1e-3, 2e-4, "kano"), (0.3, 0.3, "choudhury"),
        (0.3, 0.3, "he"), (40.0, 40.0, "he"),
    ):  # fmt: skip
        r, gain = 0.3 * J, 5e-3
        x = looped(valve_stiction(S, J, form=form), gain, r, 40_000)[10_000:]
        jumps = np.flatnonzero(np.abs(np.diff(x)) > 0.5 * J)
        sizes = np.abs(np.diff(x))[jumps] / J
        assert ((sizes > 1 - 1e-9) & (sizes < 1 + 2 * gain)).all()
        for start, end in pairwise(jumps):
            distance = abs(x[start + 2] - r)
            assert end - start == pytest.approx(S / (gain * distance), rel=1e-2, abs=3)
        assert jumps.size > 4


def test_first_harmonic_is_the_published_describing_function() -> None:
    n = 4000
    angle = np.arange(2 * n) * 2 * np.pi / n
    wave = np.exp(-1j * angle[n:])
    for S, J, form in (
        (5.0, 2.0, "kano"), (5.0, 5.0, "choudhury"), (5.0, 0.0, "he"), (0.02, 0.01, "choudhury"),
        (3.0, 4.0, "kano"),
    ):  # fmt: skip
        for share in (1.05, 1.5, 20.0):
            A = share * (S + J) / 2
            x = answered(valve_stiction(S, J, form=form), A * np.sin(angle))
            found = 2j / (n * A) * np.sum(x[n:] * wave)
            (expected,) = valve_describing_function(S, J, [A])
            assert abs(found - expected) < 2e-3, (S, J, form, share)
    assert valve_describing_function(5.0, 2.0, [1.0, 2.5]).tolist() == [0.0, 0.0]
    assert valve_describing_function(0.0, 0.0, [1.0, 7.0]) == pytest.approx([1.0, 1.0])


def test_a_reset_begins_at_rest_at_the_operating_point() -> None:
    for form in FORMS:
        block = valve_stiction(2.0, 1.0, form=form)
        start = block.reset("rest")(ca.DM.zeros(len(block.states)), [2.0, 1.0], 60.0)
        u = np.array([60.0, 61.4, 58.6, 61.6, 58.0])
        x = answered(block, u, start)
        assert x.tolist() == pytest.approx([60.0, 60.0, 60.0, 61.1, 58.5]), form


@pytest.mark.heavy
def test_c_is_the_same_to_the_last_bit(tmp_path: Path) -> None:
    for form in FORMS:
        report = verify(generate(valve_stiction(0.05, 0.02, form=form), tmp_path / form, kit=False))
        assert report.status == "verified", form
