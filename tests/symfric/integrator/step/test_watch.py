"""What error control watches: no friction near rest is leapt over, whatever the estimate says."""

import json
from math import copysign
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from printed_laws import PRINTED
from scipy.integrate import odeint

import symfric as sf
from symfric.foundation.numeric import Array
from symfric.integrator.step.attempt import REACH, Watch

CAPTURED = json.loads((Path(__file__).parents[3] / "golden" / "captured.json").read_text())
STARTS = np.array(CAPTURED["v"])
NAMES = ("stribeck", "tustin", "benson", "andersson", "simscape_breakaway", "bengisu_akay")
LAWS: dict[str, sf.Law] = {name: sf.ALL_LAWS[name](mu_s=0.3, mu_d=0.0) for name in NAMES}
LAWS["brown_mcphee"] = sf.BrownMcPhee(mu_s=0.3, mu_d=0.0, v_t=1e-4)


def law(case: str) -> sf.Law:
    name, *more = case.split()
    return sf.Sum((LAWS[name], sf.Viscous(sigma_2=0.02))) if more else LAWS[name]


def test_an_error_of_slip_is_measured_by_the_slower_end_of_a_step() -> None:
    """e / (rtol (w + min|s|)): here 1e-6 / (1e-3 (0.5 + 2))."""
    y, e = ca.SX.sym("y"), ca.SX.sym("e")
    same = ca.Function("change", [y, e, ca.SX.sym("d", 0)], [e])
    for before, after in ((-2.0, 10.0), (10.0, 2.0)):
        slip = Watch(*(ca.DM([x]) for x in (before, 0.0, after, 0.5)), same, 1)
        assert float(slip.error(0.0, 1e-6, [], 1e-3)) == pytest.approx((1e-6 / 2.5e-3) ** 2)


def test_travel_is_counted_in_what_is_allowed_at_its_nearest_point() -> None:
    for before, half, after, travel, nearest in (
        (10.0, 6.0, 2.0, 8.0, 2.0),  # straight, towards rest
        (-2.0, -6.0, -10.0, 8.0, 2.0),
        (3.0, 0.0, -3.0, 6.0, 0.0),  # through rest
        (5.0, 1.0, 5.0, 4.0, 1.0),  # a dip and back: ends alone would show nothing
        (5.0, -1.0, 5.0, 6.0, 0.0),  # a dip through rest
    ):
        change = ca.Function("change", [ca.SX.sym("y")], [ca.SX(0)])
        watch = Watch(*(ca.DM([x]) for x in (before, half, after, 1.0)), change, 1)
        assert float(watch.leap()) == travel / (REACH * (1 + nearest))


def test_friction_peaks_without_a_coulomb_level_catch_the_block() -> None:
    """18 of 20 starts were off by more than 1 %, x = -1.04 for -0.78 m, with SUCCESS.

    Swinging without dissipation the block comes back to just where Simscape's smooth peak lets go:
    an error of 1e-7 m decides there, so that this case alone needs a tighter tolerance.
    """
    for case, x in CAPTURED["x"].items():
        rtol = 1e-7 if case == "simscape_breakaway" else 1e-6
        many = sf.simulate_many(
            sf.rabinowicz(law(case)), 20.0, x0={"v": STARTS[::4]}, rtol=rtol, backend="vm",
            executor="serial",
        )  # fmt: skip
        assert np.abs(many["x"][:, -1] - x[::4]).max() < 1e-4, case


def test_both_engines_catch_it() -> None:
    """x = -1.0404 m was found, at rtol 1e-9 -0.797; SciPy's LSODA with max_step 2e-4: -0.7783."""
    model = sf.rabinowicz(LAWS["stribeck"])
    runs = [sf.simulate(model, 20.0, x0={"v": -0.5}, backend=b) for b in ("vm", "compiled")]
    assert runs[0].final == runs[1].final
    assert runs[0].statistics.steps == runs[1].statistics.steps
    assert [r.final["x"] for r in runs] == pytest.approx([-0.77828] * 2, abs=1e-4)


def test_a_block_that_just_touches_the_velocity_of_the_belt_is_caught() -> None:
    """Its velocity turns 3 micrometres a second short of it, on a scale of one, within a step.

    Both ends of that step look harmless; x(6) was off by 0.39 m.
    """
    model = sf.rabinowicz(sf.Stribeck(mu_s=0.3, mu_d=0.0, v_s=1e-6, v_eps=1e-7))
    run = sf.simulate(model, 6.0, x0={"v": 3e-6 - 0.1}, backend="vm")
    fine = sf.simulate(model, 6.0, x0={"v": 3e-6 - 0.1}, rtol=1e-8, method="radau5", backend="vm")
    assert run.final["x"] == pytest.approx(fine.final["x"], abs=1e-7)


def test_a_scale_set_as_a_parameter_is_resolved_as_one_set_in_the_law() -> None:
    """The scale stayed where the model was built: an error of 8.9e-3 instead of 1.7e-7."""
    free = sf.rabinowicz(sf.Stribeck(v_s=1e-1, v_eps=1e-2), free=["v_s", "v_eps"])
    run = sf.simulate(free, 20.0, p={"v_s": 1e-3, "v_eps": 1e-4}, backend="vm")
    held = sf.simulate(sf.rabinowicz(sf.Stribeck(v_s=1e-3, v_eps=1e-4)), 20.0, backend="vm")
    assert run.statistics.steps == pytest.approx(held.statistics.steps, rel=0.02)
    assert run.final["x"] == pytest.approx(held.final["x"], abs=1e-6)


def test_a_scale_too_fine_for_the_clock_ends_no_run() -> None:
    """Rest is crossed in steps that the clock still tells apart."""
    law = sf.Coulomb(mu_d=0.0, v_eps=1e-300)
    for v in (0.5, 0.51, 0.3):
        assert sf.simulate(sf.rabinowicz(law), 20.0, x0={"v": v}, backend="vm").status.ok


@pytest.mark.slow
def test_references_are_those_of_scipy() -> None:
    """LSODA finds the peak because it is not allowed to take longer steps."""
    for case, expected in CAPTURED["x"].items():
        name, *viscous = case.split()
        sigma = 0.02 if viscous else 0.0

        def rates(y: Array, t: float, name=name, sigma=sigma) -> tuple[float, float]:
            slip = y[1] - 0.1
            friction = copysign(PRINTED[name](LAWS[name], abs(slip), 0.8 * 9.81), slip)
            return y[1], (-2.1 * y[0] - friction - sigma * slip) / 0.8

        for v, x in list(zip(STARTS, expected, strict=True))[::4]:
            found = odeint(
                rates, [0.0, v], [0.0, 20.0], rtol=1e-9, atol=1e-11, hmax=2e-4, mxstep=10**7
            )
            assert found[-1, 0] == pytest.approx(x, abs=1e-5), (case, v)
