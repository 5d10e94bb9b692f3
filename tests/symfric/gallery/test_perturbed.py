"""Each law, table and machine of the gallery changed by 5 %: a figure that uses it refuses."""

import json
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

import pytest
from perturbing import Job, numbers

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
