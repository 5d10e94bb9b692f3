"""The choice of a law on a machine: ranks, reasons of laws without rank, and output."""

import csv
import json
import os
import re
from dataclasses import replace
from functools import partial
from math import log2
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from refusing import not_refused

from symfric import Model, Trajectory, Variable, simulate, with_values
from symfric.choice import Choice, Friction, RankedLaw, select
from symfric.choice.continuation import RUN
from symfric.choice.nature import forms
from symfric.choice.ranking import lines
from symfric.choice.select import laws_of
from symfric.laws import ALL_LAWS, GMS, BrownMcPhee, ExactCoulomb, Law, LuGre, steady_force
from symfric.scenes import Drive, Rabinowicz
from symfric.scenes.base import contact

SHORT = 8.0
"""Seconds in which the block breaks away once and sticks again."""
SOME = ("brown_mcphee", "lugre", "coulomb", "exact_coulomb", "wojewoda", "makkar_dixon")


@pytest.fixture(scope="module")
def choice() -> Choice:
    return select(Rabinowicz, SOME, accuracy=1e-2, t_end=SHORT, fixed_steps=False)


def test_every_candidate_has_a_row_with_its_standing(choice: Choice) -> None:
    assert {row.law for row in choice} == set(SOME)
    assert {row.law for row in choice.ranked} == {
        "brown_mcphee", "lugre", "exact_coulomb", "makkar_dixon",
    }  # fmt: skip
    assert choice["coulomb"].reason == "shows no stiction, no stribeck"
    assert choice["wojewoda"].standing == "cannot run"
    assert "needs dv" in choice["wojewoda"].reason
    assert all(row.reason for row in choice if not row.ranked)


def again(row: RankedLaw, rtol: float) -> Trajectory:
    """Return the run of a row, or one at another tolerance."""
    law = with_values(ALL_LAWS[row.law](), row.values or {})
    t = np.linspace(0, SHORT, 2001)
    return simulate(Rabinowicz(law).model(), SHORT, rtol=rtol, t_eval=t)


def test_errors_are_those_of_the_run_when_run_again(choice: Choice) -> None:
    """Coulomb lacks the peak, which is its error; its integrator keeps the accuracy."""
    exact = simulate(Rabinowicz(ExactCoulomb()).model(), SHORT, rtol=1e-9)["x"]
    row, other = choice["brown_mcphee"], choice["coulomb"]
    own = with_values(BrownMcPhee(), row.values or {})
    top = steady_force(own, np.linspace(0.1, 10, 20001) * (row.values or {})["v_t"], 1.0).max()
    assert top == pytest.approx(0.15, rel=1e-6)
    with pytest.warns(UserWarning, match="rtol"):
        runs = [again(each, each.rtol) for each in (row, other)]
    assert np.abs(runs[0]["x"] - exact).max() / np.ptp(exact) == pytest.approx(row.error, rel=1e-3)
    assert row.error < 1e-2
    assert row.attempts == runs[0].statistics.steps + runs[0].statistics.rejections
    assert other.rank == len(choice.placed)
    assert other.error > 0.1 > 1e-2 > other.own_error
    fine = again(other, 1e-9)["x"]
    assert np.abs(runs[1]["x"] - fine).max() / np.ptp(fine) == pytest.approx(
        other.own_error, rel=0.05
    )


@pytest.mark.slow
def test_it_is_as_soft_as_the_accuracy_allows() -> None:
    wide, narrow = (
        select(Rabinowicz, ["brown_mcphee"], accuracy=a, t_end=SHORT, fixed_steps=False)
        for a in (1e-2, 1e-3)
    )
    widths = [(c["brown_mcphee"].values or {})["v_t"] for c in (wide, narrow)]
    assert 2.0 < log2(widths[0] / widths[1]) < 6.5  # error ~ v_t^(2/3): 31 times
    assert 0.5e-2 < wide["brown_mcphee"].error < 1e-2


def test_an_unchanged_scene_gives_the_levels() -> None:
    found = select(
        Rabinowicz(LuGre(mu_s=0.2, mu_d=0.12)), ["stribeck"], accuracy=0.05, t_end=10.0,
        fixed_steps=False,
    )  # fmt: skip
    assert found.friction == "mu_s = 0.2, mu_d = 0.12, falling at once"
    assert found.best is not None


@pytest.mark.slow
def test_a_fall_that_is_known_is_kept() -> None:
    found = select(
        Rabinowicz, ["stribeck", "tustin", "brown_mcphee"], friction=Friction(v_s=0.05),
        accuracy=1e-2, t_end=SHORT, fixed_steps=False,
    )  # fmt: skip
    assert [row.law for row in found.ranked] == ["stribeck"]
    assert (found["stribeck"].values or {})["v_s"] == 0.05
    reason = found["tustin"].reason
    order = re.search(r"it tends to another motion, with order (\S+); sliding at 0.1 m/s", reason)
    assert order is not None
    assert 0.8 < float(order[1]) < 1.2
    assert "its friction is 0.107 of the load instead of 0.101" in reason  # e^-2 and e^-4


def press(law: Law) -> Model:
    """A mass that a spring pulls back, on a guide; written by a user."""
    x, v = Variable("x", "m", nominal=0.1), Variable("v", "m/s", start=0.5, nominal=0.1)
    pull = -30 * x.symbol
    guide = contact("guide", law, v.symbol, 20.0, rest={"v": 0.0}, F_e=pull)
    return Model(
        "press", x=(x, v), ode=ca.vertcat(v.symbol, (pull - guide.force) / 2), contacts=(guide,)
    )


def test_a_function_of_a_user_is_a_machine() -> None:
    found = select(press, ["stribeck", "karnopp"], needs=["stiction"], accuracy=0.05, t_end=1.0)
    assert found.machine == "press"
    assert {row.law for row in found.ranked} == {"stribeck", "karnopp"}
    assert found["stribeck"].fixed_step is not None


def test_a_function_that_fails_for_a_law_is_a_row() -> None:
    def only_static(law: Law) -> Model:
        if law.states:
            raise TypeError("no states, please")
        return press(law)

    found = select(only_static, ["lugre", "stribeck"], accuracy=0.05, t_end=1.0, fixed_steps=False)
    assert (found["lugre"].standing, found["lugre"].reason) == ("cannot run", "no states, please")
    assert found.best is not None
    assert "the sharpest law" in found.reference  # exact dry friction has a state


def test_a_law_is_judged_by_events_and_as_it_comes_where_they_do_not_fit() -> None:
    def smooth_only(law: Law) -> Model:
        if law.switches(ca.SX.sym("v"), 1.0, ca.SX.sym("z", len(law.states))):
            raise ValueError("no events, please")
        return press(law)

    rows = [
        select(
            machine, ["maxwell_slip"], needs=["presliding"], friction=Friction(0.1, 0.1),
            reference=BrownMcPhee(mu_s=0.1, mu_d=0.1, v_t=1e-5), accuracy=0.02, t_end=1.0,
            fixed_steps=False,
        )["maxwell_slip"]
        for machine in (press, smooth_only)
    ]  # fmt: skip
    assert [(row.form, row.smoothness, row.standing) for row in rows] == [
        ("event", "event", "ranked"), ("", "C0", "ranked"),
    ]  # fmt: skip
    assert rows[0].to_dict()["form"] == "event"


def test_the_exact_form_comes_first_where_a_controller_can_take_it() -> None:
    both = {"gms": ["event", "smooth"], "karnopp": ["smooth", "event"], "threlfall": ["smooth"]}
    assert {n: [vars(law)["form"] for law in forms(ALL_LAWS[n]())] for n in both} == both
    assert len(forms(GMS(form="event"))) == len(forms(LuGre())) == 1


@pytest.mark.slow
def test_gms_keeps_an_accuracy_by_events_where_it_may_cost_more() -> None:
    law = {"event": GMS(form="event")}
    usual, both = (
        select(Rabinowicz, law, effort=effort, accuracy=1e-2, t_end=SHORT, fixed_steps=False)
        for effort in (1.0, 5.0)
    )
    assert "tries, see effort" in usual["event"].reason
    assert usual["event"].error > 1e-2 > both["event"].error
    assert [row.law for row in both.ranked] == ["event"]
    assert "(form = event)" in both.verdict[0]
    assert "switches by events" in both.verdict[1]


def test_every_run_and_number_of_processes_gives_the_same_order_and_counts(choice: Choice) -> None:
    """Ranks, work and errors do not depend on the time that a run takes."""
    alone, two = (
        select(press, ["stribeck", "tustin"], accuracy=0.2, t_end=0.2, workers=n, fixed_steps=False)
        for n in (1, 2)
    )
    assert [(r.law, r.rank, r.work, r.error) for r in alone] == [
        (r.law, r.rank, r.work, r.error) for r in two
    ]
    assert [row.rank for row in choice.placed] == sorted(row.rank for row in choice.placed)


@pytest.mark.slow
def test_what_a_law_may_cost_is_counted() -> None:
    """GMS rings: it stands with what it reaches, and its runs end where their count does."""
    found = select(Rabinowicz, ["gms"], accuracy=1e-6, fixed_steps=False)["gms"]
    assert (found.standing, found.spent, found.rank) == ("inaccurate", True, 1)
    assert found.work <= RUN
    assert "its bristle is undamped" in found.reason


def test_a_process_that_ends_is_a_row() -> None:
    def deadly(law: Law) -> Model:
        return press(law) if law.states or isinstance(law, BrownMcPhee) else os._exit(3)

    laws = ["stribeck", "lugre"]
    found = select(deadly, laws, accuracy=0.2, t_end=0.2, workers=2, fixed_steps=False)
    assert found["stribeck"].reason == "its process ended with exit status 3: no output"
    assert found["lugre"].attempts > 0


def test_laws_left_out_stand_by_the_reason(choice: Choice) -> None:
    reported = list(lines(choice))
    rows = choice.rows
    alike = tuple(
        replace(row, law=n) for row in rows if row.law == "coulomb" for n in ("one", "two")
    )
    assert "lacks, shows no stiction, no stribeck: coulomb" in reported
    tied = {row.rank for row in rows if [r.rank for r in rows].count(row.rank) > 1}
    marked = [line[2] == "=" for line in reported if line[:2].strip().isdigit()]
    assert marked == [row.rank in tied for row in choice.placed]
    both = list(lines(replace(choice, rows=rows + alike)))
    assert "lacks, shows no stiction, no stribeck: coulomb, one, two" in both


def test_data_judge_fitted_laws() -> None:
    t = np.linspace(0, 3.0, 301)
    truth = LuGre(mu_s=0.2, mu_d=0.15)
    run = simulate(
        Drive(truth).model(), 3.0, t_eval=t, u={"force": lambda t: 2 * ca.sin(ca.pi * t)}
    )
    laws = {"right": truth, "wrong": LuGre()}
    found = select(Drive, laws, data={"t": t, "x": run["x"]}, accuracy=1e-3, fixed_steps=False)
    assert [row.law for row in found.ranked] == ["right"]
    assert found["wrong"].error > 0.05
    assert found["right"].values == {"mu_s": 0.2, "mu_d": 0.15}  # nothing was scaled


def test_steps_that_hold_are_shorter_for_an_explicit_method() -> None:
    found = select(Rabinowicz, ["stribeck"], accuracy=0.03, t_end=SHORT)
    row = found["stribeck"]
    assert row.fixed_step is not None
    assert row.explicit_step is not None
    assert row.explicit_step < row.fixed_step
    assert row.fixed_step in (0.005, 0.01)  # at 0.01 s the eighth digit of mu_s decides
    assert row.c_operations == 12


def test_bad_input_is_refused_in_a_sentence() -> None:
    choose = partial(select, scene=Rabinowicz, laws=["stribeck"])
    table = Path(__file__).with_name("refusals.toml")
    assert not_refused(table, choose=choose, press=press) == []


def test_the_picture_has_round_numbers_and_names_the_exact_law(choice: Choice) -> None:
    """Millions of instructions; the exact law stands far below the others."""
    rows, shortest, longest = choice.ranked, 1.5, 3.0
    works = np.geomspace(1e6 * shortest, 1e6 * longest, len(rows)).astype(int).tolist()
    timed = [replace(r, attempts=1, instructions=w) for r, w in zip(rows, works, strict=True)]
    left, right = replace(choice, rows=tuple(timed)).plot(wide=True).axes
    for axis in (left, right):
        ticks = [label.get_text() for label in axis.get_xticklabels()]
        low, high = axis.get_xlim()
        assert len(ticks) >= 3
        assert low < shortest <= longest < high
        assert all(low <= float(text) <= high for text in ticks)
    assert "exact_coulomb" in [text.get_text() for text in left.texts]
    figure = choice.plot(wide=True)  # names are inside and apart after titles moved the panels
    figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in figure.axes[0].texts]
    whole = figure.axes[0].get_window_extent()
    assert boxes
    for k, box in enumerate(boxes):
        assert whole.contains(*box.min)
        assert whole.contains(*box.max)
        assert not any(box.padded(2.0).overlaps(other) for other in boxes[:k])


def test_it_shows_and_saves_itself(choice: Choice, tmp_path: Path) -> None:
    shown = repr(choice).splitlines()
    assert len(shown) <= 30
    every = list(lines(choice))
    assert max(map(len, [*shown, *every])) <= 80
    assert choice.plot().get_size_inches()[0] == pytest.approx(85 / 25.4, abs=0.01)
    assert any(line.startswith("Simulation: take") for line in shown)
    choice.to_csv(tmp_path / "c.csv")
    with (tmp_path / "c.csv").open(encoding="utf-8") as file:
        assert [row["law"] for row in csv.DictReader(file)] == [row.law for row in choice]
    choice.to_json(tmp_path / "c.json")
    kept = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))
    assert kept["best"] == choice.ranked[0].law
    choice.to_html(tmp_path / "c.html")
    page = (tmp_path / "c.html").read_text(encoding="utf-8")
    assert "http" not in page.replace("data:image", "")
    assert all(row.law in page for row in choice)


def test_an_interrupt_keeps_what_is_there() -> None:
    def stop(name: str, _: float) -> None:
        if name == "stribeck":
            raise KeyboardInterrupt

    found = select(
        Rabinowicz, ["stribeck", "lugre"], accuracy=0.05, t_end=3.0, fixed_steps=False,
        progress=stop,
    )  # fmt: skip
    assert found.interrupted
    assert [row.law for row in found] == ["stribeck"]
    assert list(lines(found))[-1] == "Interrupted: 1 of 2 laws were not measured: lugre."


@pytest.mark.slow
def test_no_law_of_the_catalogue_breaks_it() -> None:
    found = select(Rabinowicz, accuracy=1e-2, t_end=SHORT, workers=2)
    assert {row.law for row in found} == set(ALL_LAWS)
    assert len(found.ranked) > 15


def test_candidates_are_names_and_laws_in_their_order() -> None:
    own = BrownMcPhee(v_t=1e-4)
    found = laws_of("select", [own, "stribeck", LuGre()])
    assert [*found] == ["brown_mcphee", "stribeck", "lugre"]
    assert found["brown_mcphee"] == (own,)
    with pytest.raises(ValueError, match="laws: expected every name once"):
        laws_of("select", [own, "brown_mcphee"])
