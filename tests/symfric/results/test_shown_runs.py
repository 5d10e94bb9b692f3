"""What runs and ensembles say of themselves."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.typing import NDArray
from pages import on_a_screen, shown

from symfric.integrator import simulate, simulate_many
from symfric.laws import BrownMcPhee, ExactCoulomb, LuGre
from symfric.multibody import Mechanism
from symfric.results.trajectory import Trajectory
from symfric.scenes import MECHANISMS, Arm, rabinowicz

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def run() -> Trajectory:
    return simulate(rabinowicz(ExactCoulomb()), 6.0, samples=301)


def test_a_run_says_how_it_ended_and_where_signals_went(run: Trajectory) -> None:
    text = repr(run)
    assert on_a_screen(text)
    assert text.startswith(
        "run of 'rabinowicz' from 0 to 6 s\nfriction: belt by ExactCoulomb\nSUCC"
    )
    assert f"{run.statistics.steps} steps of Rodas5P, {len(run.happened)} event" in text
    row = next(line.split() for line in text.splitlines() if line.startswith("  friction"))
    low, high = run.extremes["friction"]
    numbers = (run["friction"][0], run["friction"][-1], low, high)
    assert row == ["friction", "N", *(f"{x:.6g}" for x in numbers)]


def test_a_run_as_html_has_a_picture_and_leaves_no_figure_open(run: Trajectory) -> None:
    before = plt.get_fignums()
    page = shown(run)
    assert len(page.pictures) == 1
    assert "ExactCoulomb" in page.words
    assert plt.get_fignums() == before


def test_showing_a_long_run_looks_at_its_times_only() -> None:
    looked = list[int]()
    short = simulate(rabinowicz(LuGre()), 1.0, samples=51)
    counts = replace(short.statistics, steps=10**6)

    def evaluate(at: Array) -> dict[str, Array]:
        looked.append(at.size)
        return short.evaluate(at)

    long = replace(short, count=lambda: counts, evaluate=evaluate)
    assert "see extremes" in repr(long)
    row = next(line.split() for line in repr(long).splitlines() if line.startswith("  x "))
    assert row[-2:] == [f"{short['x'].min():.6g}", f"{short['x'].max():.6g}"]
    assert looked == [51]


def test_an_ensemble_says_who_failed() -> None:
    model = rabinowicz(BrownMcPhee(), free=["m"])
    runs = simulate_many(model, 1.0, p={"m": [0.5, 1.0]}, t_eval=[0.5, 1.0], max_steps=5)
    assert "ensemble of 'rabinowicz': 2 members at 2 times from 0.5 to 1 s" in repr(runs)
    assert "member 0 failed: " in repr(runs)
    fine = simulate_many(model, 1.0, p={"m": [0.5, 1.0]}, t_eval=np.linspace(0.1, 1, 9))
    x = fine["x"][:, -1]
    row = next(line.split() for line in repr(fine).splitlines() if line.startswith("  x"))
    assert row == ["x", "m", f"{x.min():.6g}", f"{np.median(x):.6g}", f"{x.max():.6g}"]
    assert len(shown(fine).pictures) == 1
    nowhere = simulate(model, 6.0, max_steps=3, throw=False)
    assert "MAX_STEPS" in repr(nowhere) and on_a_screen(repr(nowhere))


def test_mechanisms_show_bodies_joints_and_what_rubs() -> None:
    for scene in MECHANISMS.values():
        machine = scene(BrownMcPhee()).mechanism()
        assert on_a_screen(repr(machine))
        assert "BrownMcPhee" in repr(machine)
    arm = Arm(BrownMcPhee()).mechanism()
    assert "6 bodies, 6 joints, no closed loops" in repr(arm)
    assert len(shown(arm).pictures) == 1
    assert not shown(Mechanism("empty")).pictures


def test_completion_offers_what_users_ask_for() -> None:
    run = simulate(rabinowicz(BrownMcPhee()), 0.1, samples=11)
    offered = {name for name in dir(run) if not name.startswith("_")}
    assert {"at", "plot", "save", "extremes", "t", "final", "sensitivities"} <= offered
    assert offered.isdisjoint({"evaluate", "express", "keep", "packed_as", "shown", "hidden"})
