"""Friction that drives: how far its power F v falls below zero, and of which laws it does not."""

import numpy as np
import pytest
from law_cases import STATIC, SYMMETRIC

from symfric import Law, simulate
from symfric.laws import Awrejcewicz, HaessigFriedland, Karnopp, LeineSwitch, QuarterCarGeneral
from symfric.scenes import Pendulum

N = 5.0
LEVEL = 0.15 * N
BAND: dict[str, tuple[Law, float, float]] = {
    "karnopp": (Karnopp(), 1e-3, -0.274 * LEVEL * 1e-3),
    "karnopp, original": (Karnopp(form="original"), 1e-3, -LEVEL * 1e-3),
    "awrejcewicz": (Awrejcewicz(), 1e-3, -0.204 * LEVEL * 1e-3),
    "awrejcewicz, original": (Awrejcewicz(form="original"), 1e-3, -0.204 * LEVEL * 1e-3),
    "leine_switch, original": (LeineSwitch(form="original"), 1e-6, -LEVEL * 1e-6),
}
"""Laws that hold what is applied in a band: the law, the band's half width, least power [W]."""


@pytest.mark.parametrize("name", BAND)
def test_friction_in_a_band_of_rest_drives_as_far_as_it_says(name: str) -> None:
    law, width, least = BAND[name]
    v = width * np.concatenate([np.linspace(-3.0, 3.0, 2001), [0.999999]])
    F_e = np.linspace(-3.0, 3.0, 61)[:, None]
    power = np.asarray(law.force(v, N, F_e=F_e)) * v
    assert power.min() >= least
    assert power.min() < 0.75 * least, "the bound, that for mu_d = 0, is not an idle one"
    assert power[:, np.abs(v) > width].min() > 0


def test_the_rig_with_a_band_drives_as_far_as_it_says() -> None:
    law, v = QuarterCarGeneral(), np.linspace(-3e-3, 3e-3, 2001)
    power = np.asarray(law.force(v, N, x_rel=np.linspace(-0.02, 0.02, 41)[:, None])) * v
    assert -0.274 * 193.8 * 1e-3 <= power.min() < 0


@pytest.mark.parametrize(("name", "least"), [("karnopp", -0.274), ("awrejcewicz", -0.204)])
def test_power_of_a_joint_stays_above_the_same_bound(name: str, least: float) -> None:
    law, width, _ = BAND[name]
    run = simulate(Pendulum(law).model(), 4.0)
    (load,) = (np.abs(run[n]).max() for n in run.units if n.endswith("_N"))
    power = next(n for n in run.units if n.endswith("_power"))
    lowest, highest = run.extremes[power]
    assert least * 0.15 * load * width <= lowest < 0 < highest


@pytest.mark.parametrize("name", [n for n in STATIC if not SYMMETRIC[n].inputs])
def test_laws_of_the_velocity_alone_do_not_drive(name: str) -> None:
    v = np.concatenate([-np.geomspace(1e-12, 10.0, 400), [0.0], np.geomspace(1e-12, 10.0, 400)])
    assert (np.asarray(SYMMETRIC[name].force(v, N)) * v >= 0).all()


@pytest.mark.parametrize("form", ["smooth", "event"])
def test_reset_integrator_gives_back_no_more_than_it_stored(form: str) -> None:
    """By Euler steps of a fiftieth of the stretch; in the event form with its switches by hand."""
    law = HaessigFriedland(form=form, sigma_1=0.0)
    bound = 0.15 * 0.1 * N**2 / (2 * 1e5)
    rng = np.random.default_rng(4)
    h, z, slip, work = 1e-8, 0.0, 0.0, [0.0]
    limit = 0.1 * N / 1e5
    v = np.repeat(rng.choice([-1.0, 1.0], 20), rng.integers(20, 2000, 20))
    for before, now in zip(np.r_[0.0, v[:-1]], v, strict=True):
        if form == "event":
            slip = 0.0 if now != before else slip
            state = np.array([z, slip])
            force = float(law.force(now, N, state))
            z += h * now * (1 - slip)
            if now * z >= limit:
                z, slip = now * limit, 1.0
        else:
            state = np.array([z])
            force = float(law.force(now, N, state))
            z += h * float(law.rate(now, N, state)[0])
        work.append(work[-1] + force * now * h)
    path = np.array(work)
    given_back = (np.maximum.accumulate(path) - path).max()
    assert 0.5 * bound < given_back <= 1.01 * bound
