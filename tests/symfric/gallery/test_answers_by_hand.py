"""What the gallery compares with: exact dry friction on the belt, and machines written by hand.

The paper's tables again: the stored numbers are consistent, and our side of them runs.

Each law, table and machine of the gallery changed by 5 %: a figure that uses it refuses.
"""

import json
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from oracles import rabinowicz_coulomb, rabinowicz_motion
from perturbing import Job, numbers

from symfric import SteadyStateLuGre
from symfric.gallery.generalized_maxwell_slip.laws import SIGMA_0, SIGMA_1, bristle
from symfric.gallery.laminator_nips import sled
from symfric.gallery.selection.belt import peaked
from symfric.gallery.selection.tables import PRINTED, PaperComparison, PaperRow, compare_with_paper
from symfric.gallery.self_tuning import machines
from symfric.gallery.self_tuning.machines import fixed_steps, solve
from symfric.gallery.shared import Belt


def test_the_belt_has_the_period_and_the_extremes_of_the_closed_form() -> None:
    belt = Belt(m=0.8, k=2.1, v_belt=0.1, F_S=1.1772, F_C=0.7848)
    times = np.linspace(0.0, 40.0, 40001)
    motion = belt.motion(times)
    known = rabinowicz_coulomb(0.15, 0.1, 0.8, 2.1, 0.1, 9.81)
    assert np.allclose(np.diff(belt.leaves), known.period, rtol=1e-12)
    assert motion["x"].max() == pytest.approx(known.x_max, rel=1e-6)
    assert motion["x"][20000:].min() == pytest.approx(known.x_min, rel=1e-6)
    assert motion["friction"].min() == pytest.approx(-1.1772, rel=1e-3)
    slips = motion["v_rel"] < -0.05
    assert np.allclose(motion["friction"][slips], -0.7848)
    a = np.gradient(np.gradient(motion["x"], times), times)
    inside = np.convolve(slips, np.ones(9), "same") == 9  # away from stops and starts
    assert np.allclose(a[inside], motion["a"][inside], atol=1e-4)
    for t in (0.5, 7.0, 33.3):
        x, _ = rabinowicz_motion(0.0, t, (0.15, 0.1, 0.8, 2.1, 0.1, 9.81))
        assert motion["x"][round(1000 * t)] == pytest.approx(x, rel=1e-10)


def test_fixed_steps_are_of_order_four() -> None:
    machine = machines.slider_crank(lambda v, _: 0 * v)
    exact = solve(machine, np.array([0.0, 0.02]))["crank"][-1]
    coarse, fine = (abs(fixed_steps(machine, h, 0.02)["crank"][-1] - exact) for h in (4e-3, 2e-3))
    assert coarse / fine == pytest.approx(16, rel=0.1)


def test_the_sled_under_coulomb_friction_is_the_block_on_the_belt(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A curve that falls at once from 4 N to 3 N: amplitude and mean are those of `Belt`."""
    jump = SteadyStateLuGre(F_S=4.0, F_C=3.0, v_s=1e-11, sigma_2=0.0)
    monkeypatch.setitem(sled.PRINTED, "jump", jump)
    Z, speed = 50.0, 600.0
    (amplitude,), (mean,) = sled.swept("jump", (Z, 0.0), np.array([speed]))
    belt = Belt(m=1.0, k=Z**2, v_belt=speed / 60e3, F_S=4.0, F_C=3.0)
    times = np.linspace(0.0, 1.0, 100001)
    force = Z**2 * belt.motion(times)["x"]
    first, last = (belt.leaves[k] for k in (1, -2))
    whole = (times >= first) & (times <= last)
    assert amplitude == pytest.approx(2 * np.hypot(1.0, Z * speed / 60e3), rel=1e-5)
    assert amplitude == pytest.approx(np.ptp(force[whole]), rel=1e-5)
    assert mean == pytest.approx(np.mean(force[whole]), rel=1e-4)


def test_a_slack_wire_does_not_push() -> None:
    """A heavy sled under the main study's curve overtakes the wire."""
    _, force = sled.cycle("main", (300.0, 0.0), 500 / 60e3)
    assert force.min() == 0.0
    assert np.mean(force == 0.0) > 0.1


def test_bristle_is_damped_before_it_slides_and_holds_its_level_after() -> None:
    v, level = 1e-3, 2.0
    z, damped = bristle(np.array(0.0), v, 1e-12, level)
    assert damped == pytest.approx(SIGMA_1 * v, rel=1e-3)
    assert z == pytest.approx(v * 1e-12, rel=1e-3)
    z, slides = bristle(np.array(0.0), -v, 1e6, level)
    assert slides == pytest.approx(SIGMA_0 * z) == pytest.approx(-level)


def of_tables(first: bool) -> PaperComparison:
    """A comparison that holds the printed numbers alone."""
    rows = tuple(
        PaperRow(name, *((p.T4, p.S4) if first else (p.T8, p.S8))) for name, p in PRINTED.items()
    )
    return PaperComparison("", "", "", 1.0, 1e-4, rows)


def test_ranks_of_table_5_follow_from_table_4() -> None:
    """The places that table 5 prints, in its order of laws."""
    orders = of_tables(first=True).orders()
    printed = {
        ("J", "T"): {"Bengisu": 4, "Karnopp": 3, "Velocity-based": 1, "Awrejcewicz": 2, "LuGre": 6,
                     "Elasto-plastic": 8, "Stick-slip": 5, "Gonthier": 7},
        ("J", "S"): {"Bengisu": 4, "Karnopp": 5, "Velocity-based": 3, "Awrejcewicz": 1, "LuGre": 8,
                     "Elasto-plastic": 6, "Stick-slip": 2, "Gonthier": 7},
        ("S", "T"): {"Bengisu": 1, "LuGre": 3, "Elasto-plastic": 5, "Stick-slip": 2, "Gonthier": 4},
        ("S", "S"): {"Bengisu": 2, "LuGre": 5, "Elasto-plastic": 3, "Stick-slip": 1, "Gonthier": 4},
        ("Y", "T"): {"Dahl": 1, "LuGre": 2, "Elasto-plastic": 4, "Gonthier": 3},
        ("J+S", "S"): {"Bengisu": 2, "Stick-slip": 1},
        ("J+S+Y", "T"): {"LuGre": 1, "Elasto-plastic": 3, "Gonthier": 2},
        ("J+S+Y", "S"): {"LuGre": 3, "Elasto-plastic": 1, "Gonthier": 2},
    }  # fmt: skip
    for (column, by), places in printed.items():
        order = orders[column][f"printed {by}"]
        assert {name: order.index(name) + 1 for name in order} == places, (column, by)


def test_ranks_of_table_9_follow_from_table_8() -> None:
    orders = of_tables(first=False).orders()
    assert orders["J"]["printed T"][:4] == ["Bengisu", "Awrejcewicz", "Karnopp", "Velocity-based"]
    assert orders["J"]["printed S"][-3:] == ["Bengisu", "Karnopp", "Awrejcewicz"]
    assert orders["J+S+Y"]["printed S"] == ["Elasto-plastic", "Gonthier", "LuGre"]


def test_one_motion_has_several_s_and_the_order_needs_its_numbers() -> None:
    found = compare_with_paper("rabinowicz", ["Velocity-based", "Threlfall"])
    first, second = found.rows
    assert first.S_uniform == pytest.approx(0.147, abs=2e-3)  # Karnopp's closed form: 0.1476
    assert first.S_steps > 1.2 * first.S_uniform
    assert second.S_uniform == pytest.approx(0.0966, abs=1e-3)
    assert 100 < first.attempts < 1000
    assert first.explicit_step is not None
    assert first.explicit_step > 1e-6  # the step that the paper prints
    text = "\n".join(found.lines())
    assert max(map(len, found.lines())) <= 80
    assert "standard deviation" in text
    assert "2.20" in text


@pytest.mark.slow
def test_the_box_of_the_paper_moves_as_far() -> None:
    found = compare_with_paper("pendulum_box", ["Smooth"])
    (row,) = found.rows
    assert row.S_uniform == pytest.approx(row.S, rel=0.05)
    assert row.explicit_step is None
    assert "no explicit method takes this machine" in " ".join(found.lines())


def test_every_peaked_law_has_to_peak() -> None:
    assert peaked({"Bengisu": 1.4, "Stick-slip": 1.9, "Coulomb": 1.0})
    for wrong in (1.2, 2.0):
        assert not peaked({"Bengisu": 1.4, "Stick-slip": wrong})


ROOT = Path(__file__).parents[3]
DATA = tomllib.loads(Path(__file__).with_name("perturbed.toml").read_text("utf-8"))


def entries(kind: str) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """File, name and figures of one kind of changes."""
    for key, names in DATA[kind].items():
        file, *groups = key.split()
        for name in names.split():
            yield file, name, tuple(f for group in groups for f in DATA["groups"][group])


def jobs() -> list[Job]:
    """Every number of the tables and machines, and every law and its rate."""
    found: list[Job] = []
    for file, name, figures in entries("numbers"):
        values = [n.value for n in numbers((ROOT / file).read_text("utf-8"), name)]
        used = [k for k, v in enumerate(values) if name != "PRINTED" or float(str(v)) < 1]
        found += [Job(file, name, k, "", figures) for k in used]
    found += [Job(file, name, 0, "", figures) for file, name, figures in entries("fields")]
    for file, law, figures in entries("laws"):
        methods = ("force", "rate") if file.startswith("dynamic") else ("force",)
        found += [Job(f"symfric/laws/{file}.py", law, -1, m, figures) for m in methods]
    return found


def verdicts(changes: Sequence[Job], quick: bool = True) -> dict[str, str]:
    """The message of the gallery on each change; empty if there is none."""
    script = ROOT / "tests" / "perturbing.py"
    lines = "".join(json.dumps(asdict(job)) + "\n" for job in changes)
    size = "quick" if quick else "full"
    run = subprocess.run(
        [sys.executable, str(script), size], input=lines, capture_output=True, text=True, check=True
    )
    messages = [json.loads(line)["verdict"] for line in run.stdout.splitlines()]
    return dict(zip(map(str, changes), messages, strict=True))


def unseen(changes: Sequence[Job], quick: bool = True) -> set[str]:
    """Changes without a message."""
    return {job for job, message in verdicts(changes, quick).items() if not message}


@pytest.mark.slow
def test_a_changed_number_and_a_changed_law_change_a_verdict() -> None:
    """One of each kind, in the figure that shows it."""
    table = Job("symfric/gallery/selection/tables.py", "PRINTED", 1, "", ("selection/fig_02",))
    law = Job("symfric/laws/static/machines.py", "QuarterCarSimple", -1, "force",
              ("quarter_car_friction/fig_13",))  # fmt: skip
    found = verdicts([table, law])
    assert "S is that of table 4" in found[str(table)]
    assert "fig_13" in found[str(law)]


@pytest.mark.slow
def test_nearly_every_change_of_five_percent_changes_a_verdict() -> None:
    changes = jobs()
    left = unseen(changes)
    left = unseen([job for job in changes if str(job) in left], quick=False)
    assert len(changes) > 140
    assert left <= {*DATA["exceptions"]}, "a change that no figure sees needs a reason"
    assert len(left) <= 0.05 * len(changes)


def test_exceptions_are_changes_that_are_made() -> None:
    assert {*DATA["exceptions"]} <= {*map(str, jobs())}
