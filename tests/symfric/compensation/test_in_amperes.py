"""Compensators of drives, whose output is a current."""

from typing import Any

import numpy as np
import pytest
from one_program import Stepper

from symfric import Drive, LuGre, Model, Stribeck, drive, driven
from symfric.compensation import Cascade, close_loop, compensator, sine
from symfric.scenes import Drive as Stage

LAW = Stribeck(mu_s=28.0, mu_d=20.0, v_s=0.01, sigma_2=200.0)
SCREW: dict[str, Any] = {"torque_constant": 0.12, "gear_ratio": -2, "lead": 5e-3}
H = 1e-3


def stepped(block: Any, rows: list[dict[str, float]], **p: float) -> list[float]:
    """Return the first output for the inputs of each row."""
    go = Stepper(block, **p)
    return [next(iter(go(**{"enable": 1.0, **row}).values())) for row in rows]


def test_the_current_is_the_force_over_the_force_constant() -> None:
    d, how = Drive(**SCREW), {"h": H, "ramp": None, "velocity": "measured"}
    rows = [{"v": v} for v in (-0.1, -0.003, 0.0, 0.02, 0.4)]
    in_newtons = stepped(compensator(LAW, **how), rows)
    in_amperes = stepped(compensator(LAW, drive=d, **how), rows)
    assert in_amperes == pytest.approx([F / float(d.force_constant) for F in in_newtons], rel=1e-12)
    lossy = Drive(**SCREW, efficiency=(0.8, 0.5))
    driving = stepped(compensator(LAW, drive=lossy, **how), rows[::4])
    assert driving == pytest.approx([i / 0.8 for i in in_amperes[::4]], rel=1e-12)


def test_gear_and_motor_scale_the_current_only() -> None:
    rows = [{"v_ref": v, "v": v} for v in np.linspace(-0.05, 0.05, 7)]

    def forces(ratio: float, K: float) -> list[float]:
        d = Drive(torque_constant=K, gear_ratio=ratio, efficiency=(0.9, 0.7))
        block = compensator(Stage(LAW, N=1.0, turning=True), drive=d, h=H, ramp=None)
        return [ratio * K * i for i in stepped(block, rows)]

    for ratio in (-1.0, 30.0, 1000.0):
        for K in (1e-3, 1e3):
            assert forces(ratio, K) == pytest.approx(forces(1.0, 1.0), rel=1e-12)


@pytest.mark.parametrize("chosen", [{}, {"limit": 30.0}, {"slew": 1e3}, {"slew": 50.0}])
def test_the_limit_of_the_current_is_the_last_operation(chosen: dict[str, float]) -> None:
    d = Drive(**SCREW, max_current=0.15, efficiency=0.7)
    block = compensator(LAW, drive=d, h=H, ramp=None, velocity="measured", **chosen)
    k = abs(float(d.force_constant))
    most = min(0.15, chosen.get("limit", np.inf) / k)
    assert {p.name: p.start for p in block.parameters}["i_max"] == pytest.approx(most)
    random = np.random.default_rng(2)
    rows = [{"v": v} for v in 10 ** random.uniform(-4, 2, 50) * random.choice([-1, 1], 50)]
    currents = np.array(stepped(block, rows))
    assert np.abs(currents).max() <= most
    if "slew" in chosen:
        assert np.abs(np.diff(currents)).max() <= chosen["slew"] * H / k * (1 + 1e-12)
        state = [5000.0 if v.name == "i_last" else 0.0 for v in block.states]
        values = [float(v.start) for v in block.parameters]
        assert abs(float(block.step(state, values, [0.1] * len(block.inputs))[1])) <= most


def test_units_are_those_of_the_drive() -> None:
    block = compensator(LuGre(), drive=Drive(torque_constant=1.0, max_torque=2.0), h=H, slew=1.0)
    units = {v.name: v.unit for v in (*block.parameters, *block.inputs, *block.states)}
    assert block.outputs["current"].unit == "A"
    assert (units["i_max"], units["i_rate"], units["v"]) == ("A", "A/s", "rad/s")
    assert any("current is within +-i_max" in text for text in block.use)
    reversed_ = compensator(LAW, drive=Drive(**SCREW), h=H)
    assert any("negative x" in text for text in reversed_.use)


@pytest.mark.parametrize("counter", [None, 256.0])
def test_velocity_from_counts(counter: float | None) -> None:
    d = Drive(**SCREW, counts_per_turn=1000, counter=counter)
    how: dict[str, Any] = {"drive": d, "h": H, "ramp": None, "velocity": "measured"}
    v = 0.1 * np.sin(np.arange(60) / 10)
    counts = np.rint(np.cumsum(v) * H / float(d.count or 0)) + 300
    wrapped = counts if counter is None else counts % counter
    by_counts = stepped(compensator(LAW, counts=0.0, **how), [{"counts": c} for c in wrapped])
    exact = np.diff(counts) * float(d.count or 0) / H
    by_velocity = stepped(compensator(LAW, **how), [{"v": rate} for rate in (0.0, *exact)])
    assert by_counts == pytest.approx(by_velocity, rel=1e-9, abs=1e-12)
    slow = stepped(compensator(LAW, counts=0.01, **how), [{"counts": 5.0 * k} for k in range(200)])
    steady = stepped(compensator(LAW, **how), [{"v": 5 * float(d.count or 0) / H}])
    assert slow[-1] == pytest.approx(steady[0], rel=1e-6)
    assert abs(slow[2]) != pytest.approx(abs(steady[0]), rel=1e-3)


def test_a_loop_in_amperes_equals_that_in_newtons() -> None:
    d = Drive(torque_constant=0.12, gear_ratio=2, lead=5e-3, rotor_inertia=1e-6)
    k = float(d.force_constant)

    def path(plant: Model, scale: float, axis: Drive | None) -> Any:
        numbers = {"kv": 2e4 / scale, "inertia": 95 / scale, "limit": 500 / scale}
        controller = Cascade(h=H, **numbers)
        block = compensator(LAW, h=H, drive=axis)
        return close_loop(plant, sine(0.01, 1.0, 0.5, h=H), block, controller=controller)

    in_newtons = path(drive(LAW, m=95.0 + float(d.rotor), N=1.0), 1.0, None)
    in_amperes = path(driven(drive(LAW, m=95.0, N=1.0), d), k, d)
    for name in ("without", "compensated"):
        a, b = in_newtons[name].x, in_amperes[name].x
        assert np.allclose(a, b, atol=2 * Cascade().count)
        assert in_amperes[name].rms == pytest.approx(in_newtons[name].rms, rel=1e-3)
