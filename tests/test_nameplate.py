"""One file of a drive from a log of currents to compensated motion."""

from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from identification import Dataset, Fit, InverseDynamics
from ocp import Phase, Problem, integral, solve
from symfric import BrownMcPhee, Drive, Stribeck, drive, driven, simulate
from symfric.codegen import generate, verify
from symfric.compensation import Cascade, close_loop, compensator, sine

H, LOAD = 1e-3, 40.0
TRUE = Stribeck(mu_s=28.0, mu_d=20.0, v_s=0.05, sigma_2=100.0)
NAMEPLATE = """
"torque_constant [mN m/A]" = 120
gear_ratio = 2
"lead [mm]" = 10
efficiency = [0.9, 0.8]
"rotor_inertia [g cm^2]" = 60
"max_current [A]" = 1.5
"resistance [Ohm]" = 1.2
counts_per_turn = 16384
counter = 65536
"""


def motion(t: Any) -> Any:
    """Return a current [A] that moves the axis slowly and fast in both directions."""
    return 0.02 + 0.45 * ca.sin(7 * t) + 0.2 * ca.sin(2.3 * t) + 0.1 * ca.sin(23 * t)


@pytest.mark.slow
def test_one_file_goes_through_all_applications(tmp_path: Path) -> None:
    path = tmp_path / "drive.toml"
    path.write_text(NAMEPLATE)
    axis = Drive.read(path)
    k, rotor = float(axis.force_constant), float(axis.rotor)

    # simulate the axis, and log currents and a counter of 16 bit
    plant = driven(drive(TRUE, m=LOAD, N=1.0, offset=3.0), axis)
    t = np.arange(0.0, 10.0, H)
    run = simulate(plant, t[-1], u={"current": motion}, t_eval=t, rtol=1e-8)
    counts = np.rint(run["x"] / float(axis.count or 0)) % 65536
    noise = 2e-3 * np.random.default_rng(4).standard_normal(t.size)
    log = tmp_path / "log.csv"
    rows = np.column_stack([t, counts, 1e3 * (run["current"] + noise)])
    np.savetxt(log, rows, "%.7g", ",", header="t [s],encoder [counts],iq [mA]", comments="")

    # identify it, also from the forces converted by hand
    data = Dataset.read(log, drive=axis)
    fit = Fit(InverseDynamics(), "stribeck", data).solve()
    truth = {"m": LOAD + rotor, "offset": 3.0, "mu_s": 28.0, "mu_d": 20.0, "v_s": 0.05}
    for name, value in truth.items():
        e = fit.parameters[name]
        assert e.value == pytest.approx(value, abs=4 * (e.standard_error or 0.0), rel=0.01), name
    sides = {s.name: s for s in fit.sides}
    assert sides["m without rotor"].load == pytest.approx(LOAD, rel=0.02)
    assert sides["mu_d"].current == pytest.approx(20.0 / (0.9 * k), rel=0.02)
    F_m = k * (run["current"] + noise)
    by_hand = Dataset.of(t=t, x=run["x"], force=np.where(F_m * run["v"] > 0, 0.9 * F_m, F_m / 0.8))
    other = Fit(InverseDynamics(), "stribeck", by_hand).solve()
    for name in truth:
        error = fit.parameters[name].standard_error or 0.0
        assert other.values[name] == pytest.approx(fit.values[name], abs=2 * error), name

    # move it with the least copper loss, and the same problem in newtons
    smooth = BrownMcPhee(mu_s=fit.values["mu_s"], mu_d=fit.values["mu_d"], mu_v=0.0, v_t=1e-3)
    mass, ends = fit.values["m"], {"start": {"x": 0.0, "v": 0.0}, "end": {"x": 0.05, "v": 0.0}}
    stage = driven(drive(smooth, m=mass - rotor, N=1.0), axis, limit="bounds")
    move = Problem(Phase(stage, 0.4, **ends), integral(lambda s: s.copper_loss))  # type: ignore[arg-type]
    best = solve(move, friction="smooth", intervals=30)
    assert np.abs(best["current"]).max() <= 1.5 * (1 + 1e-6)

    def heat(s: Any) -> Any:
        return 1.2 * (axis.from_load(s.force, s.v) / k) ** 2

    hand = drive(smooth, m=mass, N=1.0)
    same = solve(
        Problem(Phase(hand, 0.4, **ends), integral(heat)),  # type: ignore[arg-type]
        friction="smooth", intervals=30,
    )  # fmt: skip
    assert best.cost == pytest.approx(same.cost, rel=2e-3)  # forces and currents are held apart

    # compensate it in amperes, in C
    block = compensator(fit.law, drive=axis, h=H, offset=fit.values["offset"], error_gain=60.0)  # type: ignore[arg-type]
    assert verify(generate(block, tmp_path / "c")).ok
    numbers = {"kv": 2e3 / k, "inertia": mass / (0.9 * k), "limit": 1.5, "count": 3e-7}
    controller = Cascade(h=H, **numbers)
    loops = close_loop(plant, sine(0.02, 0.5, 2.0, h=H), block, controller=controller)
    assert loops.reduction("compensated") > 4
    assert np.abs(loops["compensated"].added).max() <= 1.5
