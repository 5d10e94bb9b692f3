"""Laws whose states do not follow the load."""

import numpy as np
import pytest

from symfric.foundation.status import SolveError, Status
from symfric.integrator import simulate
from symfric.laws import (
    GMS,
    ElastoPlastic,
    ExactCoulomb,
    HaessigFriedland,
    Leuven,
    LoadNormalised,
    LuGre,
    LuGreNormalised,
    Stribeck,
)
from symfric.scenes import FourBar, SliderCrank


def test_lugre_becomes_its_own_load_normalised_form() -> None:
    ours = LoadNormalised(LuGre(sigma_2=0.4), N_0=5.0)
    other = LuGreNormalised(sigma_0=1e5 / 5, sigma_1=190.0 / 5, sigma_2=0.4 / 5)
    for v, N, z in ((0.01, 3.0, 1e-6), (-0.3, 700.0, 2e-5), (1e-4, 0.0, -1e-6)):
        assert float(ours.force(v, N, z)) == pytest.approx(float(other.force(v, N, z)), rel=1e-12)
        assert ours.rate(v, N, z)[0] == pytest.approx(other.rate(v, N, z)[0], rel=1e-12)
        assert ours.steady_state(v, N)[0] == pytest.approx(other.steady_state(v, N)[0], rel=1e-12)
        assert ours.sliding(v, N, 1) == pytest.approx(other.sliding(v, N, 1), rel=1e-12)
        assert ours.static_level(N) == pytest.approx(other.static_level(N), rel=1e-12)


def test_at_its_load_it_is_the_law_itself_and_a_proportional_static_law_anywhere() -> None:
    law = GMS(form="event", sigma_2=0.4)
    ours, v = LoadNormalised(law, N_0=8.0), 0.01
    z = 0.5 * law.steady_state(v, 8.0)
    assert ours.force(v, 8.0, z) == law.force(v, 8.0, z)
    assert (ours.rate(v, 8.0, z) == law.rate(v, 8.0, z)).all()
    assert [s.name for s in ours.switches(v, 8.0, z)] == [s.name for s in law.switches(v, 8.0, z)]
    dry = Stribeck()
    speeds = np.linspace(-0.1, 0.1, 7)
    np.testing.assert_allclose(
        LoadNormalised(dry, N_0=3.0).force(speeds, 70.0), dry.force(speeds, 70.0), rtol=1e-12
    )


def test_laws_that_rest_by_the_applied_force_are_refused() -> None:
    with pytest.raises(ValueError, match="LoadNormalised: expected a law of v and N, got ExactC"):
        LoadNormalised(ExactCoulomb())
    with pytest.raises(ValueError, match="expected a law such as LuGre"):
        LoadNormalised("lugre")  # type: ignore[arg-type]


def test_bristles_that_stop_a_crank_go_on() -> None:
    for law in (LuGre(), ElastoPlastic(), Leuven(), HaessigFriedland()):
        with pytest.raises(SolveError):
            simulate(SliderCrank(law).model(), 0.02)
        run = simulate(SliderCrank(LoadNormalised(law, N_0=4700.0)).model(), 0.02)
        assert run.status is Status.SUCCESS, law
        assert np.abs(run["crank_friction"] / run["crank_N"]).max() < 0.3


def test_the_advice_for_bristles_stands_once_and_can_be_copied() -> None:
    run = simulate(FourBar(LuGre()).model(), 0.1, throw=False)
    assert not run.status.ok
    assert run.message.count("keep the deflection") == 1
    assert "joints theta_crank, theta_coupler, theta_rocker" in run.message
    begin = run.message.index("LoadNormalised(")
    line = run.message[begin : run.message.index(" for LuGre", begin)].replace("...", "")
    advised = eval(line, {"LoadNormalised": LoadNormalised, "LuGre": LuGre})
    assert simulate(FourBar(advised).model(), 0.1).status is Status.SUCCESS
