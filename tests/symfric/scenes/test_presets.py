"""Presets: the printed numbers reach the laws of every place, wherever the law has them."""

import json
from math import atan, pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from law_cases import CASES

import symfric as sf
from symfric.cli import main
from symfric.scenes import ALL_SCENES, PendulumBox, Prescribed, QuarterCar, Rabinowicz
from symfric.scenes.presets import Numbers

ELEVEN = (
    "coulomb", "threlfall", "bengisu_akay", "karnopp", "velocity_based", "awrejcewicz",
    "dahl", "lugre", "elasto_plastic", "stick_slip", "gonthier",
)  # fmt: skip
"""The laws of Jing and Mi, tables 4 and 8."""


def test_defaults_of_the_belt_are_its_preset() -> None:
    """As the docstrings of scene and laws say; LuGre and ten others by tables 2 and 3."""
    for name in ELEVEN:
        own = sf.parameters(Rabinowicz(sf.ALL_LAWS[name]()))
        of_paper = sf.parameters(Rabinowicz.preset("jing_mi_table_3", sf.ALL_LAWS[name]()))
        off = {n for n, p in own.items() if p.value != of_paper[n].value}
        assert off <= {"v_s"} & ({"v_s"} if name == "awrejcewicz" else set()), name


@pytest.mark.parametrize("name", ELEVEN)
def test_box_and_hinge_break_away_at_the_levels_of_table_7(name: str) -> None:
    scene = PendulumBox.preset("jing_mi_table_7", sf.law_from_text(name))
    assert scene.hinge is not None
    shows_stiction = "S" in type(scene.law).facts.phenomena
    for law, static, dynamic in ((scene.law, 0.03, 0.02), (scene.hinge, 0.003, 0.002)):
        level = static if shows_stiction else dynamic
        assert law.static_level(100.0) == pytest.approx(100.0 * level), law
        assert law.sliding(0.2, 100.0, 1) == pytest.approx(100.0 * dynamic, rel=1e-9), law
    own = {n: p.value for n, p in sf.parameters(scene).items() if n in ("m", "m_box", "L", "phi_0")}
    assert own == {"m_box": 6.0, "m": 20.0, "L": 0.3, "phi_0": pi / 6}


def test_rows_of_table_7_differ_between_box_and_pendulum() -> None:
    scene = PendulumBox.preset("jing_mi_table_7", sf.ALL_LAWS["velocity_based"]())
    found = {n: p.value for n, p in sf.parameters(scene).items()}
    assert (found["v_s_1"], found["v_d_1"]) == (5e-4, 0.06)
    assert (found["v_s_2"], found["v_d_2"]) == (1e-3, 1e-2)
    gonthier = PendulumBox.preset("jing_mi_table_7", sf.ALL_LAWS["gonthier"]())
    assert sf.parameters(gonthier.law)["v_s"].value == 1e-5
    assert sf.parameters(gonthier.law)["tau_dw"].value == 0.01


def test_numbers_reach_into_sums_and_wrappers_and_leave_the_rest() -> None:
    law = sf.LoadDependent(sf.Sum((sf.LuGre(delta=1.0), sf.Viscous(sigma_2=3.0))))
    found = sf.parameters(PendulumBox.preset("jing_mi_table_7", law).law)
    assert (found["sigma_0"].value, found["sigma_1"].value) == (1e4, 2.0)
    assert found["delta"].value == 1.0
    assert found["sigma_2_2"].value == 0.0


def test_a_law_that_the_paper_does_not_use_gets_its_levels() -> None:
    scene = Rabinowicz.preset("canudas_de_wit", sf.BrownMcPhee(v_t=7e-3))
    found = sf.parameters(scene)
    assert {n: found[n].value for n in ("mu_s", "mu_d", "v_t", "m", "k")} == {
        "mu_s": 0.15, "mu_d": 0.1, "v_t": 7e-3, "m": 1.0, "k": 2.0,
    }  # fmt: skip


@pytest.mark.parametrize("kind", [sf.Leuven, sf.MaxwellSlip])
def test_elements_that_a_law_comes_with_carry_the_level_and_others_stay(kind: type) -> None:
    """Those of Leuven carry mu_s with a margin of theirs, those of Maxwell-slip mu_d."""
    numbers = Numbers({"mu_s": 0.6, "mu_d": 0.4})
    started, given = ([e.mu for e in law.elements] for law in (kind(), numbers.given(kind())))
    ratio = 0.6 / 0.15 if kind is sf.Leuven else 0.4 / sum(started)
    assert given == pytest.approx([ratio * mu for mu in started])
    mine = (sf.Slider(3e4, 0.5), sf.Slider(1e4, 0.2))
    for law in (
        kind(elements=mine),
        kind(elements=mine, **({"mu_s": 0.2} if kind is sf.Leuven else {})),
    ):
        assert [e.mu for e in numbers.given(law).elements] == [0.5, 0.2]
    if kind is sf.Leuven:
        with pytest.raises(ValueError, match=r"elements that carry mu_s = 0\.6 together"):
            numbers.given(kind(elements=(sf.Slider(3e4, 0.5),)))


def test_what_is_given_beside_a_preset_comes_after_it() -> None:
    scene = PendulumBox.preset("jing_mi_table_7", sf.LuGre(), hinge=sf.Coulomb(), m=30.0)
    assert isinstance(scene.hinge, sf.Coulomb)
    assert (scene.hinge.mu_d, scene.m, scene.m_box) == (0.002, 30.0, 6.0)


def test_roads_of_the_rig() -> None:
    for amplitude in (30, 50, 70):
        law = sf.ALL_LAWS["quarter_car_general"]()
        scene = QuarterCar.preset(f"al_zughaibi_{amplitude}_mm", law)
        heights = [0.0, 0.085, 0.085 + amplitude / 1000, 0.085 - amplitude / 1000]
        assert [float(scene.road(t)) for t in (0.0, 3.0, 6.0, 9.0)] == pytest.approx(heights)
        assert scene.law.static_level(0.0) == 193.8


def test_the_first_ramp_of_the_rig_agrees_with_the_text() -> None:
    """Nothing moves for 0.3 s, X_w - X_b = 6.9 mm at 0.5 s, and it is the gentlest of the three."""
    rig = QuarterCar.preset("al_zughaibi_50_mm", sf.ALL_LAWS["quarter_car_general"]())
    run = sf.simulate(rig.model(), 0.6, rtol=1e-8)
    assert abs(run.at(0.3)["X_w"][0]) < 1e-12
    assert run.at(0.5)["x_rel"][0] == pytest.approx(0.0069, abs=1e-4)
    slopes = [float(rig.road(t + 0.01) - rig.road(t)) for t in (1.0, 5.0, 8.0)]
    assert slopes[0] < slopes[1] < -slopes[2]


def test_numbers_of_table_1_reach_every_law_that_has_them() -> None:
    found = {
        name: sf.parameters(Prescribed.preset("lampaert_table_1", sf.ALL_LAWS[name]()).law)
        for name in ("lugre", "elasto_plastic", "leuven", "gms", "dahl")
    }
    printed = {"v_s": 98e-6, "delta": 0.78, "sigma_0": 0.16e6, "sigma_1": 0.08, "z_ba": 0.61e-6,
               "C": 24.0, "delta_l": 7.0, "mu_s": 1.05, "mu_d": 0.2, "sigma_2": 0.0}  # fmt: skip
    for name, own in found.items():
        wrong = {n: own[n].value for n in printed if n in own and own[n].value != printed[n]}
        assert not wrong, name


def test_every_law_takes_every_preset() -> None:
    """Levels and velocities that contradict each other are refused when a law is made."""
    for kind in ALL_SCENES.values():
        for name, preset in kind.presets.items():
            assert preset.doc
            assert preset.source
            assert set(preset.friction) <= {"law", *kind.places()}, name
            for law in [*CASES.values()][::3]:
                try:
                    scene = kind.preset(name, law)
                except ValueError as error:  # levels that a law is not made for; it says so
                    assert isinstance(law, sf.Wojewoda | sf.RateAndState), error
                    continue
                assert all(getattr(scene, n) == x for n, x in preset.values.items()), name


def test_the_period_of_stick_slip_is_that_of_dry_friction() -> None:
    """Sticking 2 A/v, sliding (2/w)(pi - atan(A w/v)), A = (mu_s - mu_d) m g/k, w^2 = k/m."""
    A, w, v = 0.05 * 9.81 / 10.0, sqrt(10.0), 0.1
    run = sf.simulate(Rabinowicz.preset("nikravesh", sf.ExactCoulomb()).model(), 20.0, rtol=1e-9)
    period = 2 * A / v + 2 / w * (pi - atan(A * w / v))
    slides = run.t[1:][(run["v_rel"][1:] < -1e-6) & (run["v_rel"][:-1] >= -1e-6)]
    assert slides[-1] - slides[-2] == pytest.approx(period, abs=0.011)  # between two samples


def test_command_line_takes_presets_and_laws_of_places(capsys: pytest.CaptureFixture[str]) -> None:
    line = "run pendulum_box --law lugre --preset jing_mi_table_7 --t-end 0.01 --json -"
    assert main([*line.split(), "--law-of", "hinge=coulomb", "--set", "mu_s=0.1"]) == 0
    found = json.loads(capsys.readouterr().out)["parameters"]
    assert (found["mu_s"], found["mu_d_1"], found["mu_d_2"]) == (0.1, 0.02, 0.002)
    for options, message in (
        ("--preset jing", "--preset of pendulum_box: expected one of jing_mi_table_7, got jing"),
        ("--law-of hing=dahl", "did you mean hinge"),
        ("--law-of hinge=coulom", "did you mean coulomb"),
        ("--law-of hinge", "expected NAME=VALUE"),
    ):
        assert main([*["run", "pendulum_box", "--law", "lugre"], *options.split()]) == 2
        assert message in capsys.readouterr().err
    assert main(["run", "rabinowicz", "--law", "lugre", "--law-of", "hinge=dahl"]) == 2
    assert "--law is the law of the main contact" in capsys.readouterr().err


@pytest.mark.heavy
def test_c_of_a_scene_takes_presets_and_places(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = "codegen --law coulomb --scene pendulum_box --preset jing_mi_table_7 --step-size 1e-3"
    more = ("--law-of", "hinge=dahl", "--real", "double", "--out", str(tmp_path))
    assert main([*line.split(), *more]) == 0
    source = "".join(path.read_text() for path in tmp_path.rglob("*.h"))
    assert "mu_d_1" in source
    assert "sigma_0" in source
    capsys.readouterr()
    assert main(["codegen", "--law", "dahl", "--preset", "x", "--out", str(tmp_path)]) == 2
    assert "--preset: expected with --scene only" in capsys.readouterr().err


TIMES = np.linspace(0.0, 1.0, 101)


NEEDS_FORCE = {"karnopp", "awrejcewicz", "exact_coulomb"}


@pytest.mark.slow
def test_every_law_runs_under_given_motion_or_reports_what_is_missing() -> None:
    refused = set[str]()
    for name, kind in sf.ALL_LAWS.items():
        try:
            model = Prescribed(kind(), load="input", N_least=0.1).model()
        except ValueError as error:
            assert "force that rest must carry; a given motion does not say it" in str(error)
            refused.add(name)
            continue
        inputs = {"v": lambda t: 0.02 * t - 0.003, "load": lambda t: 2 - t}
        assert sf.simulate(model, 1.0, u=inputs, samples=3).status.ok, name
    assert refused == NEEDS_FORCE


def test_a_law_without_states_gives_its_curve() -> None:
    law = sf.BrownMcPhee()
    v = sf.Linear(TIMES, 0.01 * np.sin(7 * TIMES))
    run = sf.simulate(Prescribed(law, N=3.0).model(), 1.0, u={"v": v}, t_eval=TIMES)
    expected = [law.force(0.01 * np.sin(7 * t), 3.0) for t in TIMES]
    assert run["friction"] == pytest.approx(expected, abs=1e-12)


def test_dahl_along_a_measured_position_has_its_virgin_curve_and_its_reversal() -> None:
    """F = F_C (1 - exp(-s x/F_C)), then back from F_1: -F_C + (F_C + F_1) exp(-s d/F_C)."""
    law = sf.Dahl(sigma_0=1e5, mu_d=0.1, v_eps=0.0)
    F_C, s = 0.1 * 2.0, 1e5
    x = sf.Linear([0.0, 1.0, 3.0], [5e-6, 9e-6, 3e-6])
    scene = Prescribed(law, N=2.0)
    times = np.array([0.25, 1.0, 2.0, 3.0])
    start = {"x": 5e-6}
    run = sf.simulate(scene.model(), 3.0, x0=start, u={"v": sf.rate_of(x)}, t_eval=times, rtol=1e-9)
    assert run["x"] == pytest.approx([6e-6, 9e-6, 6e-6, 3e-6], abs=1e-15)
    first = F_C * (1 - np.exp(-s * (run["x"][:2] - 5e-6) / F_C))
    back = -F_C + (F_C + first[1]) * np.exp(-s * (9e-6 - run["x"][2:]) / F_C)
    assert run["friction"] == pytest.approx(np.r_[first, back], abs=1e-8)


def test_measured_load_presses_and_an_open_contact_does_not() -> None:
    load = sf.Linear([0.0, 0.5, 1.0], [4.0, 0.02, -0.02])
    scene = Prescribed(sf.BrownMcPhee(), load="input", N_least=1e-3)
    run = sf.simulate(scene.model(), 1.0, u={"v": 0.5, "load": load}, t_eval=TIMES)
    expected = np.maximum(np.interp(TIMES, [0.0, 0.5, 1.0], [4.0, 0.02, -0.02]), 1e-3)
    assert run["N"] == pytest.approx(expected, abs=1e-12)
    assert run["friction"] == pytest.approx(0.1 * expected, rel=1e-6)
    held = sf.simulate(Prescribed(sf.BrownMcPhee(), N=7.0, load="input").model(), 0.1, u={"v": 0.5})
    assert held["N"][0] == 7.0  # nothing given: the parameter


def test_what_a_law_needs_else_is_an_input_of_its_name() -> None:
    law = sf.ALL_LAWS["wojewoda"]()
    model = Prescribed(law).model()
    assert [u.name for u in model.u] == ["v", "dv"]
    run = sf.simulate(model, 1.0, u={"v": lambda t: 0.01 * t, "dv": 0.01}, t_eval=[0.5])
    assert run["friction"][0] == pytest.approx(law.force(5e-3, 1.0, dv=0.01))  # type: ignore[call-arg]


def test_laws_of_the_laminator_give_the_printed_forces() -> None:
    """Equation 4.1 at 210 mm/min: 3.3552 N of the pilot study, 3.8051 N of the main one."""
    for study, force in (("pilot", 3.3552), ("main", 3.8051)):
        for law in (sf.SteadyStateLuGre(), sf.ALL_LAWS["stribeck"](), sf.LuGre()):
            scene = Prescribed.preset(f"laminator_{study}", law)
            run = sf.simulate(scene.model(), 1.0, u={"v": 210 / 60e3}, samples=3)
            assert run["friction"][-1] == pytest.approx(force, abs=2e-3), (study, law)


def test_positions_of_a_file_become_the_motion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "m.csv").write_text("t [ms],x [mm],N [N]\n0,1,9\n500,3,1\n1000,2,-0.5\n")
    line = f"run prescribed --law dahl --set load=input --input x={tmp_path}/m.csv:x"
    assert main([*line.split(), "--input", f"load={tmp_path}/m.csv:N", "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["t_end"] == 1.0
    assert found["extremes"]["x"] == pytest.approx([1e-3, 3e-3])
    assert found["extremes"]["v"] == pytest.approx([-2e-3, 4e-3])
    assert found["extremes"]["N"] == pytest.approx([1e-3, 9.0])
    assert main([*line.split(), "--input", "v=1"]) == 2
    assert "expected x or its rate v, got both" in capsys.readouterr().err
    assert main(["run", "prescribed", "--law", "exact_coulomb"]) == 2
    assert "a `Drive` does" in capsys.readouterr().err
