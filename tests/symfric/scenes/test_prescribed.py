"""The tribometer: laws are what they are under given motion, and closed forms of Dahl."""

import json
from pathlib import Path

import numpy as np
import pytest

from symfric import (
    ALL_LAWS,
    BrownMcPhee,
    Dahl,
    Linear,
    LuGre,
    SteadyStateLuGre,
    rate_of,
    simulate,
)
from symfric.cli import main
from symfric.scenes import Prescribed

TIMES = np.linspace(0.0, 1.0, 101)
NEEDS_FORCE = {"karnopp", "awrejcewicz", "exact_coulomb"}


@pytest.mark.slow
def test_every_law_runs_under_given_motion_or_says_what_is_missing() -> None:
    refused = set[str]()
    for name, kind in ALL_LAWS.items():
        try:
            model = Prescribed(kind(), load="input", N_least=0.1).model()
        except ValueError as error:
            assert "force that rest must carry; a given motion does not say it" in str(error)
            refused.add(name)
            continue
        inputs = {"v": lambda t: 0.02 * t - 0.003, "load": lambda t: 2 - t}
        assert simulate(model, 1.0, u=inputs, samples=3).status.ok, name
    assert refused == NEEDS_FORCE


def test_a_law_without_states_gives_its_curve() -> None:
    law = BrownMcPhee()
    v = Linear(TIMES, 0.01 * np.sin(7 * TIMES))
    run = simulate(Prescribed(law, N=3.0).model(), 1.0, u={"v": v}, t_eval=TIMES)
    expected = [law.force(0.01 * np.sin(7 * t), 3.0) for t in TIMES]
    assert run["friction"] == pytest.approx(expected, abs=1e-12)


def test_dahl_along_a_measured_position_has_its_virgin_curve_and_its_reversal() -> None:
    """F = F_C (1 - exp(-s x/F_C)), then back from F_1: -F_C + (F_C + F_1) exp(-s d/F_C)."""
    law = Dahl(sigma_0=1e5, mu_d=0.1, v_eps=0.0)
    F_C, s = 0.1 * 2.0, 1e5
    x = Linear([0.0, 1.0, 3.0], [5e-6, 9e-6, 3e-6])
    scene = Prescribed(law, N=2.0)
    times = np.array([0.25, 1.0, 2.0, 3.0])
    start = {"x": 5e-6}
    run = simulate(scene.model(), 3.0, x0=start, u={"v": rate_of(x)}, t_eval=times, rtol=1e-9)
    assert run["x"] == pytest.approx([6e-6, 9e-6, 6e-6, 3e-6], abs=1e-15)
    first = F_C * (1 - np.exp(-s * (run["x"][:2] - 5e-6) / F_C))
    back = -F_C + (F_C + first[1]) * np.exp(-s * (9e-6 - run["x"][2:]) / F_C)
    assert run["friction"] == pytest.approx(np.r_[first, back], abs=1e-8)


def test_measured_load_presses_and_an_open_contact_does_not() -> None:
    load = Linear([0.0, 0.5, 1.0], [4.0, 0.02, -0.02])
    scene = Prescribed(BrownMcPhee(), load="input", N_least=1e-3)
    run = simulate(scene.model(), 1.0, u={"v": 0.5, "load": load}, t_eval=TIMES)
    expected = np.maximum(np.interp(TIMES, [0.0, 0.5, 1.0], [4.0, 0.02, -0.02]), 1e-3)
    assert run["N"] == pytest.approx(expected, abs=1e-12)
    assert run["friction"] == pytest.approx(0.1 * expected, rel=1e-6)
    held = simulate(Prescribed(BrownMcPhee(), N=7.0, load="input").model(), 0.1, u={"v": 0.5})
    assert held["N"][0] == 7.0  # nothing given: the parameter


def test_what_a_law_needs_else_is_an_input_of_its_name() -> None:
    law = ALL_LAWS["wojewoda"]()
    model = Prescribed(law).model()
    assert [u.name for u in model.u] == ["v", "dv"]
    run = simulate(model, 1.0, u={"v": lambda t: 0.01 * t, "dv": 0.01}, t_eval=[0.5])
    assert run["friction"][0] == pytest.approx(law.force(5e-3, 1.0, dv=0.01))  # type: ignore[call-arg]


def test_laws_of_the_laminator_give_the_printed_forces() -> None:
    """Equation 4.1 at 210 mm/min: 3.3552 N of the pilot study, 3.8051 N of the main one."""
    for study, force in (("pilot", 3.3552), ("main", 3.8051)):
        for law in (SteadyStateLuGre(), ALL_LAWS["stribeck"](), LuGre()):
            scene = Prescribed.preset(f"laminator_{study}", law)
            run = simulate(scene.model(), 1.0, u={"v": 210 / 60e3}, samples=3)
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
