"""Rows become tables, files, pictures and goals; timing; the command."""

import csv
import json
from collections.abc import Iterator
from math import nan
from pathlib import Path

import pytest
from backends import needs_compiler

from symfric.bench import SUBJECTS, measure
from symfric.bench.report import (
    GOALS,
    Found,
    Progress,
    Report,
    best_time,
    compile_time,
    curves,
    goal,
    interleaved,
    timed,
)
from symfric.cli import main
from symfric.foundation.status import SolveError, Status

ROWS = [
    {"case": "a", "who": "symfric", "error": 1e-4, "time [ms]": 2.0, "steps": 12345},
    {"case": "a", "who": "other", "error": 0.0012345, "time [ms]": nan, "steps": 7},
    {"case": "b", "who": "symfric", "error": 1e-6, "time [ms]": 3.0, "steps": 9, "note": "x"},
    {"case": "a", "who": "symfric", "error": 1e-6, "time [ms]": 0.0, "steps": 1},
]


def found() -> Iterator[Found]:
    yield from (("T", row) for row in ROWS)
    yield "A note."


def report() -> Report:
    draw = curves("case", ("who", "steps"), "error", "time [ms]", "error")
    return Report(("T", draw)).collect({"one": found})


def test_tables_have_all_columns_and_three_digits() -> None:
    table, note = report().shown()
    assert note == "A note."
    title, head, rows = table
    assert (title, head) == ("T", ["case", "who", "error", "time [ms]", "steps", "note"])
    assert rows[1][:3] == ["a", "other", 0.00123]
    assert rows[1][3] != rows[1][3]
    assert rows[0][4:] == [12345, ""]
    assert report().to_dict() == {"tables": {"T": ROWS}, "notes": ["A note."]}


def test_csv_holds_all_digits(tmp_path: Path) -> None:
    report().write_csv(tmp_path / "t.csv")
    rows = list(csv.DictReader((tmp_path / "t.csv").read_text("utf-8").splitlines()))
    assert [float(r["error"]) for r in rows] == [r["error"] for r in ROWS]
    assert [r["note"] for r in rows] == ["", "", "x", ""]


def test_a_task_that_fails_keeps_its_rows_and_the_other_tasks() -> None:
    def fails() -> Iterator[Found]:
        yield "T", ROWS[0]
        raise RuntimeError("no such solver\nat line 3")

    made = Report().collect({"a": fails, "b": found})
    assert [*made.tables["T"]] == [ROWS[0], *ROWS]
    assert made.failed == ("a",)
    assert "a failed: RuntimeError: no such solver" in made.notes
    assert not made.interrupted

    def stopped() -> Iterator[Found]:
        yield "T", ROWS[0]
        raise SolveError("simulate: interrupted", Status.INTERRUPTED)

    assert Report().collect({"a": stopped, "b": found}).interrupted


def test_an_interrupt_keeps_the_rows_so_far() -> None:
    def interrupted() -> Iterator[Found]:
        yield "T", ROWS[0]
        raise KeyboardInterrupt

    reported: list[tuple[str, float, str]] = []
    tasks = {"a": found, "b": interrupted, "c": found}
    made = Report().collect(tasks, lambda *at: reported.append(at))
    assert [*made.tables["T"]] == [*ROWS, ROWS[0]]
    assert "Interrupted" in made.notes[-1]
    assert made.interrupted
    assert [at for at in reported if not at[2]] == [("a", 0.0, ""), ("b", 1 / 3, "")]
    assert len(reported) == 2 + 5 + 1
    assert reported[2] == ("a", 1 / 3, "a  other  0.00123  -  7")
    assert reported[5] == ("a", 1 / 3, "A note.")

    def at_once() -> Iterator[Found]:
        raise KeyboardInterrupt
        yield

    with pytest.raises(KeyboardInterrupt):
        Report().collect({"a": at_once})


def test_pictures_have_a_panel_for_each_case_and_a_curve_for_each_line(tmp_path: Path) -> None:
    figure = report().plot(tmp_path / "t.svg")
    assert (tmp_path / "t.svg").stat().st_size > 0
    panels = [axis for axis in figure.axes if axis.axison]
    assert [(a.get_title(), a.get_ylabel()) for a in panels] == [
        ("a", "time [ms]"), ("b", "time [ms]"), ("a", "error"), ("b", "error")
    ]  # fmt: skip
    lines = {line.get_label(): line for line in panels[0].lines}
    assert [*lines] == [f"{r['who']}, steps = {r['steps']:g}" for r in ROWS]
    first, other, _, last = lines.values()
    assert (first.get_linewidth(), other.get_linewidth()) == (2.0, 1.0)
    assert first.get_xydata().tolist() == [[1e-4, 2.0]]
    assert other.get_xydata().size == 0
    assert last.get_xydata().tolist() == [[1e-6, 1e-14]]
    falling = [{"case": "a", "who": "x", "error": e, "time [ms]": 1.0} for e in (1e-2, 1e-4)]
    draw = curves("case", ("who",), "error", "time [ms]")
    assert draw(falling).axes[0].xaxis_inverted()
    with pytest.raises(ValueError, match="expected a benchmark with a picture"):
        Report().plot()


def test_goals_are_met_on_their_side_and_never_by_nan() -> None:
    rows = [
        goal("a", 1.0, 10.0, seconds=0.5, note="n"), goal("b", 3.0, 2.0), goal("c", 3.0, 2.0, ">="),
        goal("d", 1.0, 2.0, ">="), goal("e", nan, 2.0), goal("f", nan, 2.0, ">="),
        goal("g", 0.0, 0.0),
    ]  # fmt: skip
    assert {title for title, _ in rows} == {GOALS}
    only = [row for _, row in rows]
    assert [row["met"] for row in only] == ["yes", "no", "yes", "no", "no", "no", "yes"]
    assert (only[0]["goal"], only[2]["goal"]) == ("<= 10", ">= 2")
    assert (only[0]["processor time [s]"], only[0]["note"]) == (0.5, "n")


def test_the_shortest_call_within_the_budget_counts() -> None:
    """Calls of 4, 2, 3 and 1 seconds with a budget of 8."""
    clock = iter([0.0, 4.0, 10.0, 12.0, 20.0, 23.0, 30.0, 31.0])
    calls: list[int] = []

    def call() -> int:
        calls.append(1)
        return len(calls)

    assert best_time(call, budget=8.0, clock=lambda: next(clock)) == (2.0, 3)
    best_time(call, budget=100.0, most=5)
    assert len(calls) == 8
    seconds, result = timed(call)
    assert (result, seconds < 0.1) == (9, True)


def test_methods_take_turns() -> None:
    order: list[str] = []
    calls = {name: lambda n=name: order.append(n) for name in "ab"}
    assert set(interleaved(calls, rounds=2)) == {"a", "b"}
    assert "".join(order) == "ababab"


@needs_compiler
def test_compile_time_is_that_of_the_compiler() -> None:
    assert 0 < compile_time("double f(double x) { return 2 * x; }\n") < 10


def test_the_command_prints_and_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    requested: list[object] = []

    def bench(*arguments: object, **options: object) -> Report:
        requested.append(
            (arguments, {name: options[name] for name in options if name != "progress"})
        )
        return report()

    monkeypatch.setattr("symfric.bench.multibody.bench", bench)
    files = {"--json": "b.json", "--csv": "b.csv", "--plot": "b.svg"}
    options = [part for o, name in files.items() for part in (o, str(tmp_path / name))]
    assert main(["bench", "multibody", "--quick", "--links", "4,2", *options]) == 0
    assert requested == [((True,), {"links": (2, 4)})]
    data = json.loads((tmp_path / "b.json").read_text("utf-8"))
    assert data["tables"]["T"][1] == ROWS[1] | {"time [ms]": None}
    assert all((tmp_path / name).stat().st_size > 0 for name in files.values())
    printed = capsys.readouterr().out
    assert "0.00123" in printed and "A note." in printed


def test_rows_are_printed_as_they_come_and_kept_after_an_interrupt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def two() -> Iterator[Found]:
        yield "T", ROWS[0]
        assert capsys.readouterr().err == "a  symfric  0.0001  2  1.23e+04\n"
        raise KeyboardInterrupt

    def bench(*of: object, progress: Progress) -> Report:
        return Report().collect({"a": two}, progress)

    monkeypatch.setattr("symfric.bench.multibody.bench", bench)
    assert main(["bench", "multibody", "--csv", str(tmp_path / "t.csv")]) == 130
    assert "Interrupted" in capsys.readouterr().out
    assert len((tmp_path / "t.csv").read_text("utf-8").splitlines()) == 2


@pytest.mark.slow
@pytest.mark.parametrize("subject", SUBJECTS)
def test_every_subject_is_measured(subject: str) -> None:
    more = {"links": (2, 4)} if subject == "multibody" else {}
    made = measure(subject, quick=True, **more)
    assert made.tables or made.notes
    assert made.draw is None or made.tables[made.draw[0]]
    for rows in made.tables.values():
        times = [v for row in rows for c, v in row.items() if "time" in c and v == v]
        assert all(0 <= float(t) < 1e7 for t in times)
