"""The softest law that keeps a wanted error, verified against dry friction."""

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from symfric import (
    BrownMcPhee,
    Coulomb,
    ExactCoulomb,
    LuGre,
    Recommendation,
    SolveError,
    Status,
    parameters,
    rabinowicz,
    recommended,
    simulate,
)
from symfric.bench.regularisation import last_cycle, peak
from symfric.figures.data import FigureData
from symfric.laws import Law
from symfric.scenes import Drive, Rabinowicz, SliderCrank

LAW = BrownMcPhee()


@pytest.fixture(scope="module")
def found() -> Recommendation:
    return recommended(LAW, Rabinowicz, 0.01, of=["x"])


def off_exact(law: Law, rtol: float) -> float:
    """Error of `law` on the belt against friction without regularisation."""
    dry = ExactCoulomb(mu_s=peak(LAW), mu_d=LAW.mu_d)
    exact, run = (simulate(rabinowicz(each), 20.0, rtol=rtol) for each in (dry, law))
    return float(np.abs(run["x"] - exact["x"]).max() / np.ptp(exact["x"]))


def test_error_is_kept_against_friction_without_regularisation(found: Recommendation) -> None:
    """The limit was found without that law; softer by half would not do."""
    assert off_exact(found.law, found.rtol) <= 0.01
    assert off_exact(found.law, found.rtol) == pytest.approx(found.error, abs=found.uncertain)
    softer = BrownMcPhee(v_t=2 * found.values["v_t"])
    assert off_exact(softer, found.rtol) > 0.01
    assert found.uncertain <= 0.2 * found.wanted
    assert found.order == pytest.approx(2 / 3, abs=0.05)


def test_it_says_what_was_set_and_what_it_costs(found: Recommendation) -> None:
    assert parameters(found.law)["v_t"].value == found.values["v_t"]
    run = simulate(rabinowicz(found.law), 20.0, rtol=found.rtol)
    assert found.steps == run.statistics.steps
    assert found.attempts == run.statistics.steps + run.statistics.rejections
    assert str(found).startswith("BrownMcPhee: v_t = ")
    assert "(0.01 wanted) at rtol = 1e-06" in str(found)


def test_curve_holds_the_runs_and_is_drawn(found: Recommendation, tmp_path: Path) -> None:
    curve = found.curve["BrownMcPhee"]
    assert (np.diff(curve["v_t"]) < 0).all()
    assert (np.diff(curve["error"]) < 0).all()
    found.plot(tmp_path / "curve.svg")
    assert (tmp_path / "curve.svg").stat().st_size > 0


def test_a_law_that_is_too_dry_is_softened() -> None:
    wide = recommended(BrownMcPhee(v_t=1e-5), Rabinowicz, 0.1)
    assert 3e-5 < wide.values["v_t"] < 1e-3
    assert wide.error <= 0.1


def test_bristles_get_stiffer_and_keep_their_part_of_critical_damping() -> None:
    stiff = recommended(LuGre(), rabinowicz, 0.1, t_end=20.0)
    s = 1e5 / stiff.values["sigma_0"]
    assert s < 1.0
    assert stiff.values["sigma_1"] == pytest.approx(parameters(LuGre())["sigma_1"].value / s**0.5)


def test_numbers_of_a_cycle_need_less_than_the_whole_way(found: Recommendation) -> None:
    """An error of phase grows with every cycle, that of a period does not."""
    cycle = recommended(LAW, Rabinowicz, 0.01, of=last_cycle)
    assert cycle.values["v_t"] > 5 * found.values["v_t"]


def test_a_scene_is_driven_as_it_is_or_as_told() -> None:
    law = Coulomb(v_eps=1e-2)
    as_it_is = recommended(law, Drive(law), 0.01, t_end=0.5)
    gently = recommended(law, Drive(law), 0.01, t_end=0.5, u={"force": 1.0})
    assert as_it_is.values != gently.values


def test_another_law_as_the_truth_is_not_met_by_other_levels() -> None:
    """The peak of Brown-McPhee is 0.05 % short of mu_s, which no v_t mends."""
    with pytest.raises(SolveError, match="do their levels differ") as error:
        recommended(LAW, Rabinowicz, 1e-3, exact=ExactCoulomb(mu_s=0.15, mu_d=0.1))
    assert error.value.status is Status.SOLVER_FAILED
    assert isinstance(error.value.partial, FigureData)
    assert error.value.partial.curves[0]["error"].min() > 1e-3
    same = ExactCoulomb(mu_s=peak(LAW), mu_d=LAW.mu_d)
    told = recommended(LAW, Rabinowicz, 0.01, of=["x"], exact=same)
    assert told.reference == "ExactCoulomb"
    assert told.error <= 0.01


@pytest.mark.slow
def test_what_the_integrator_adds_is_told_apart() -> None:
    with pytest.raises(SolveError, match=r"with rtol = 1e-05 the run at v_t = .*tighten rtol"):
        recommended(LAW, SliderCrank(LAW, omega=1.0), 1e-7, t_end=0.5, rtol=1e-5)


def test_numbers_that_never_come_are_no_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    """A block that only sticks has no cycle."""
    monkeypatch.setattr(import_module("symfric.figures.recommended"), "DRIEST", 3)
    with pytest.raises(SolveError, match="has not settled"):
        recommended(LAW, Rabinowicz(LAW), 0.1, t_end=0.5, of=last_cycle)
