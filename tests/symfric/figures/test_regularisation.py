"""Parameters that make a law smooth, and points where laws are compared."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import symfric as sf
from symfric.bench.regularisation import last_cycle, peak
from symfric.figures.recommended import _Search  # pyright: ignore[reportPrivateUsage]
from symfric.figures.regularisation import distance, machine_of, regularisation, sample
from symfric.scenes import Drive, PendulumBox, Rabinowicz, SliderCrank


def test_roles_mark_what_makes_a_law_smooth() -> None:
    smoothing = {
        sf.BrownMcPhee(): "v_t",
        sf.Coulomb(): "v_eps",
        sf.Specker(): "v_t",
        sf.Asymmetric(sf.BrownMcPhee(), sf.BrownMcPhee()): "v_t_pos v_t_neg v_blend",
        sf.LuGre(): "sigma_0 sigma_1",
        sf.LuGre(sigma_1=0.0): "sigma_0",
        sf.ElastoPlastic(): "sigma_0 sigma_1 z_ba",
        sf.BlimanSorine(): "s_f",
        sf.MaxwellSlip(): "k_1 k_2 k_3 k_4",
    }
    assert {law: " ".join(regularisation("here", law).powers) for law in smoothing} == smoothing


def test_stiffness_and_inverse_velocity_grow_where_widths_shrink() -> None:
    soft = regularisation("here", sf.LuGre(sigma_0=1e4, sigma_1=10.0))
    wide = regularisation("here", sf.BrownMcPhee())
    slope = regularisation("here", sf.DuanSingh(sigma=50.0), "sigma")
    assert soft.values(0.01) == pytest.approx({"sigma_0": 1e6, "sigma_1": 100.0})
    assert wide.values(0.1) == pytest.approx({"v_t": 1e-4})
    assert slope.values(0.5) == pytest.approx({"sigma": 100.0})
    for knob in (soft, wide, slope):
        name = next(iter(knob.powers))
        assert sf.parameters(knob.at(0.3))[name].value == knob.values(0.3)[name]


def test_every_law_declares_its_width_or_requires_it() -> None:
    for law in sf.ALL_LAWS.values():
        try:
            assert regularisation("here", law()).powers
        except ValueError as error:
            sentences = ("parameter: expected what makes", "is it dry already", "rests exactly")
            assert any(text in str(error) for text in sentences)


def test_a_machine_is_a_scene_its_class_or_a_function() -> None:
    law = sf.BrownMcPhee()
    for scene, t_end in ((Rabinowicz(law), None), (Rabinowicz, None), (sf.rabinowicz, 20.0)):
        machine = machine_of("here", scene, t_end, None, None, law)
        assert machine.model(law).name == "rabinowicz"
        assert machine.t_end == 20.0
    assert machine_of("here", Rabinowicz(law, m=2.0), 3.0, None, None, law).t_end == 3.0


def test_motions_are_compared_by_positions_relative_to_how_far_they_go() -> None:
    wide, narrow = (sf.BrownMcPhee(v_t=v_t) for v_t in (1e-2, 1e-3))
    machine = machine_of("here", PendulumBox, 1.0, None, None, wide)
    one, other = (sample(machine, law, 1e-6) for law in (wide, narrow))
    assert one.motion.shape[0] == 2
    off = np.abs(one.motion - other.motion).max(axis=1)
    assert distance(one, other) == pytest.approx((off / np.ptp(other.motion, axis=1)).max())
    assert distance(other, other) == 0.0
    named = machine_of("here", PendulumBox, 1.0, ("phi",), None, wide)
    assert sample(named, wide, 1e-6).motion.shape[0] == 1
    last = replace(machine, of=lambda run: run["phi"][-1:])
    assert sample(last, wide, 1e-6).motion.shape == (1, 1)


LAW = sf.BrownMcPhee()


@pytest.fixture(scope="module")
def found() -> sf.Recommendation:
    return sf.recommended(LAW, Rabinowicz, 0.01, of=["x"])


def off_exact(law: sf.Law, rtol: float) -> float:
    """Error of `law` on the belt against friction without regularisation."""
    dry = sf.ExactCoulomb(mu_s=peak(LAW), mu_d=LAW.mu_d)
    exact, run = (sf.simulate(sf.rabinowicz(each), 20.0, rtol=rtol) for each in (dry, law))
    return float(np.abs(run["x"] - exact["x"]).max() / np.ptp(exact["x"]))


def test_error_is_kept_against_friction_without_regularisation(found: sf.Recommendation) -> None:
    """The limit was found without that law; softer by half would not do."""
    assert off_exact(found.law, found.rtol) <= 0.01
    assert off_exact(found.law, found.rtol) == pytest.approx(found.error, abs=found.uncertain)
    softer = sf.BrownMcPhee(v_t=2 * found.values["v_t"])
    assert off_exact(softer, found.rtol) > 0.01
    assert found.uncertain <= 0.2 * found.wanted
    assert found.order == pytest.approx(2 / 3, abs=0.05)


def test_it_reports_what_was_set_and_its_cost(found: sf.Recommendation) -> None:
    assert sf.parameters(found.law)["v_t"].value == found.values["v_t"]
    run = sf.simulate(sf.rabinowicz(found.law), 20.0, rtol=found.rtol)
    assert found.steps == run.statistics.steps
    assert found.attempts == run.statistics.steps + run.statistics.rejections
    assert str(found).startswith("BrownMcPhee: v_t = ")
    assert "(0.01 wanted) at rtol = 1e-06" in str(found)


def test_curve_holds_the_runs_and_is_drawn(found: sf.Recommendation, tmp_path: Path) -> None:
    curve = found.curve["BrownMcPhee"]
    assert (np.diff(curve["v_t"]) < 0).all()
    assert (np.diff(curve["error"]) < 0).all()
    found.plot(tmp_path / "curve.svg")
    assert (tmp_path / "curve.svg").stat().st_size > 0


def test_widths_are_rounded_to_two_digits_and_to_narrower_ones() -> None:
    machine = machine_of("here", Rabinowicz, 1.0, None, None, LAW)
    for law, name, value in ((LAW, "v_t", 1.2e-5), (sf.LuGre(), "sigma_0", 8.2e6)):
        search = _Search(machine, regularisation("here", law), 0.01, 1e-6)
        found = search.knob.values(search.rounded(0.0123456))[name]
        assert found == pytest.approx(value, rel=1e-9)


def test_a_law_that_is_too_dry_is_softened() -> None:
    wide = sf.recommended(sf.BrownMcPhee(v_t=1e-5), Rabinowicz, 0.1)
    assert 3e-5 < wide.values["v_t"] < 1e-3
    assert wide.error <= 0.1


def test_bristles_get_stiffer_and_keep_their_part_of_critical_damping() -> None:
    stiff = sf.recommended(sf.LuGre(), sf.rabinowicz, 0.1, t_end=20.0)
    s = 1e5 / stiff.values["sigma_0"]
    assert s < 1.0
    assert stiff.values["sigma_1"] == pytest.approx(
        sf.parameters(sf.LuGre())["sigma_1"].value / s**0.5
    )


def test_numbers_of_a_cycle_need_less_than_the_whole_way(found: sf.Recommendation) -> None:
    """An error of phase grows with every cycle, that of a period does not."""
    cycle = sf.recommended(LAW, Rabinowicz, 0.01, of=last_cycle)
    assert cycle.values["v_t"] > 5 * found.values["v_t"]


def test_a_scene_is_driven_by_default_or_by_given_inputs() -> None:
    law = sf.Coulomb(v_eps=1e-2)
    as_it_is = sf.recommended(law, Drive(law), 0.01, t_end=0.5)
    gently = sf.recommended(law, Drive(law), 0.01, t_end=0.5, u={"force": 1.0})
    assert as_it_is.values != gently.values


def test_another_law_as_the_truth_is_not_met_by_other_levels() -> None:
    """The peak of Brown-McPhee is 0.05 % short of mu_s, which no v_t mends."""
    with pytest.raises(sf.SolveError, match="do their levels differ") as error:
        sf.recommended(LAW, Rabinowicz, 1e-3, exact=sf.ExactCoulomb(mu_s=0.15, mu_d=0.1))
    assert error.value.status is sf.Status.SOLVER_FAILED
    assert isinstance(error.value.partial, sf.FigureData)
    assert error.value.partial.curves[0]["error"].min() > 1e-3
    same = sf.ExactCoulomb(mu_s=peak(LAW), mu_d=LAW.mu_d)
    advice = sf.recommended(LAW, Rabinowicz, 0.01, of=["x"], exact=same)
    assert advice.reference == "ExactCoulomb"
    assert advice.error <= 0.01


@pytest.mark.slow
def test_the_error_of_the_integrator_is_reported_separately() -> None:
    with pytest.raises(sf.SolveError, match=r"with rtol = 1e-05 the run at v_t = .*tighten rtol"):
        sf.recommended(LAW, SliderCrank(LAW, omega=1.0), 1e-7, t_end=0.5, rtol=1e-5)


def test_numbers_that_never_come_are_no_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    """A block that only sticks has no cycle."""
    monkeypatch.setattr(import_module("symfric.figures.recommended"), "DRIEST", 3)
    with pytest.raises(sf.SolveError, match="has not settled"):
        sf.recommended(LAW, Rabinowicz(LAW), 0.1, t_end=0.5, of=last_cycle)
