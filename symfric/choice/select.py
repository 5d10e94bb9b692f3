"""Choose a law: every candidate runs on the user's machine, ranked by work at equal error."""

import csv
import json
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import isfinite
from multiprocessing import get_all_start_methods, get_context
from multiprocessing.connection import wait
from multiprocessing.context import ForkProcess
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, final

from symfric.choice.continuation import RUN
from symfric.choice.friction import Friction
from symfric.choice.machine import FAILURES, OWN, frictions_of, load_of, reference_of
from symfric.choice.measured import Task, best_form
from symfric.choice.nature import forms, needed
from symfric.choice.ranking import FAILED, Ranking, Row, ordered
from symfric.choice.text import lines, verdict
from symfric.figures.regularisation import Measure, machine_of
from symfric.foundation import checks
from symfric.foundation.files import write_text, written
from symfric.integrator.equations.inputs import Input
from symfric.laws import ALL_LAWS, BrownMcPhee, Law
from symfric.laws.base.law import check_law
from symfric.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure


SCREEN = 16
"""Rows of the text that a terminal shows."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class Choice(Ranking):
    """Ranking of laws that shows, draws and writes itself; see `Ranking` for its attributes."""

    @property
    def verdict(self) -> tuple[str, ...]:
        """Recommended laws and reasons, for simulation, optimal control and a controller."""
        return verdict(self.rows, self.needs, self.accuracy, self.control)

    @property
    def table(self) -> list[dict[str, Any]]:
        """Row of plain numbers and texts for each law; what CSV and data frames hold."""
        return [flat(row) for row in self.rows]

    def __repr__(self) -> str:
        return "\n".join(lines(self, SCREEN))

    def _repr_html_(self) -> str:  # pyright: ignore[reportUnusedFunction]  (notebooks call it)
        from symfric.choice.page import body  # noqa: PLC0415  (matplotlib is slow to import)

        return body(self)

    def plot(self, path: str | Path | None = None, *, wide: bool = False) -> "Figure":
        """Draw error against work, marked by what a law shows; save it to `path` if given.

        It is as wide as a column of print, 85 mm; `wide` puts the panels side by side.
        """
        from symfric.choice.page import plot_choice  # noqa: PLC0415  (matplotlib is slow to import)

        return plot_choice(self, path, wide)

    def to_html(self, path: str | Path) -> None:
        """Write one page that needs nothing from elsewhere: verdict, picture, table."""
        from symfric.choice.page import page  # noqa: PLC0415  (matplotlib is slow to import)

        write_text(path, page(self))

    def to_csv(self, path: str | Path) -> None:
        """Write the table, a law a line."""
        rows = self.table
        with written(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
            sheet = csv.DictWriter(file, fieldnames=list(rows[0]) if rows else ["law"])
            sheet.writeheader()
            sheet.writerows(rows)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data; numbers that are none are null."""
        best = self.best
        return {
            "machine": self.machine,
            "needs": list(self.needs),
            "accuracy": self.accuracy,
            "friction": self.friction,
            "reference": self.reference,
            "uncertain": self.uncertain if isfinite(self.uncertain) else None,
            "control": self.control,
            "t_end": self.t_end,
            "best": None if best is None else best.law,
            "verdict": list(self.verdict),
            "unmeasured": list(self.unmeasured),
            "wall_s": self.wall_s,
            "rows": [row.to_dict() for row in self.rows],
        }

    def to_json(self, path: str | Path) -> None:
        """Write `to_dict` as a file."""
        write_text(path, json.dumps(self.to_dict(), indent=2, ensure_ascii=False) + "\n")


def flat(row: Row) -> dict[str, Any]:
    """Return a row without nested values."""
    found = row.to_dict()
    del found["curve"]
    values = found.pop("values") or {}
    form = [f"form={row.form}"] if row.form else []
    found["values"] = " ".join([*form, *(f"{n}={value:g}" for n, value in values.items())])
    found["phenomena"] = " ".join(row.phenomena)
    found["hard"] = " ".join(row.hard)
    return found


Progress = Callable[[str, float], None]
Candidates = Mapping[str, Law | Sequence[Law]] | Sequence[str]
"""Name -> law or forms of it; or names."""
Forms = Mapping[str, tuple[Law, ...]]


def select(
    scene: object,
    laws: Candidates | None = None,
    *,
    needs: Sequence[str] = ("stiction", "stribeck"),
    accuracy: float = 1e-4,
    friction: Friction | None = None,
    reference: "str | Law | Trajectory" = "exact",
    data: Mapping[str, Sequence[float]] | None = None,
    misfits: Mapping[str, float] | None = None,
    t_end: float | None = None,
    u: Mapping[str, Input] | None = None,
    of: Measure | None = None,
    fitted: bool | None = None,
    control: float = 0.05,
    fixed_steps: bool = True,
    effort: float = 1.0,
    workers: int = 1,
    progress: Progress | None = None,
) -> Choice:
    """Rank friction laws on a machine by the work of a run at equal error.

        error = max |x - x_dry| / (largest - smallest x_dry)      over positions and times

    Every law describes the same friction (mu_s, mu_d; the peak of a smooth law is mu_s N) and is
    made as soft as the accuracy allows: its widths and bristles are scaled together. Then the
    loosest tolerance is taken with which law and integrator together keep the accuracy. That run is
    counted, attempts times instructions, and timed; the count ranks, so that every run of `select`
    gives the same order, and laws within 10 % share a rank.

    A law that does not keep the accuracy, or does not show what is needed, stands behind those by
    its error, and is counted where its own error, that of the integrator, is the accuracy. That it
    moves otherwise is said where its runs tend to another motion with an order; else the reason
    says what was not decided: runs fail, cost too much, or creep by less than velocities are
    rounded.
    A law that the machine does not take has its row, too, and the reason in it. What a law may cost
    is counted as well (`symfric.choice.continuation`): whatever the load of the computer.

    Args:
        scene: a scene, a class of scenes (`Rabinowicz`), or a function law -> scene or `Model`,
            such as `partial(PendulumBox.preset, "jing_mi_table_7")`.
        laws: name -> law, or names; the whole catalogue by default. A law by its name that
            has an exact form with events is tried in that and, where that is not ranked, as it
            comes (in the other order where the exact form has no C); the row says which it was.
            Several laws under a name are such forms.
        needs: words of `symfric.choice.NEEDS`, such as "stiction", "presliding", "drift-free".
        accuracy: largest error relative to the size of the motion; between 0 and 1.
        friction: what all laws describe; by default the levels that the scene has.
        reference: "exact" dry friction by events, where the machine takes it, else as "sharpest",
            the limit of a smooth law; or a law, or a run.
        data: t [s] and signals by name, to compare with instead; errors are then root mean squares,
            and the laws those that were fitted.
        misfits: law -> error from data that were measured elsewhere, as on a test rig, and that the
            laws were fitted to; then `accuracy` is that of the integrator alone, and laws are
            ranked that are within 10 % of the smallest misfit.
        t_end: end of the motion [s]; that of the scene.
        u: inputs; those of the scene.
        of: what is compared: signals by name, or a function of a trajectory, such as the period of
            a cycle, where an error of phase would grow with time; by default the positions.
        fitted: laws come with their numbers, nothing is set or scaled; by default with `data`.
        control: largest error of fixed steps, of a law that is as soft as that allows.
        fixed_steps: measure what a controller needs, too: the largest fixed steps, and instructions
            on a Cortex-M4F where a cross compiler and QEMU are.
        effort: what the runs of a law may cost, in times of what is usual; more brings laws whose
            bristles ring, such as GMS, nearer to dry friction.
        workers: processes; more than one needs a system that can fork (not Windows).
        progress: called with the name of a law that is done, and the share of all.

    Raises:
        ValueError: bad input.
        SolveError: not even a reference runs.

    An interrupt (Ctrl-C) returns what is there; `unmeasured` names the others.
    Limits: a motion that has no limit as widths vanish, such as a chaotic one over a long time, has
    no accuracy; shorten it or compare other numbers. Times are those of CasADi's virtual machine.
    """
    where, began = "select", perf_counter()
    asked = needed(f"{where}: needs", needs)
    accuracy = checks.number(f"{where}: accuracy", accuracy, above=0.0, upper=1.0)
    control = checks.number(f"{where}: control", control, above=0.0, upper=1.0)
    count = checks.count(f"{where}: workers", workers)
    effort = checks.number(f"{where}: effort", effort, above=0.0, upper=1e6)
    if friction is not None:
        such = "a friction, such as Friction(mu_s=0.2, mu_d=0.15)"
        checks.kind(f"{where}: friction", friction, Friction, such)
    known = laws_of(where, laws)
    machine = machine_of(where, scene, t_end, of, u, BrownMcPhee(), "vm")
    frictions = frictions_of(machine, friction, scene)
    load = None
    with suppress(*FAILURES):
        load = load_of(machine.model(BrownMcPhee()))
    given = reference if data is None else data
    compared = OWN
    if misfits is None:
        compared, machine = reference_of(
            f"{where}: reference", machine, given, frictions, load, accuracy
        )
    if misfits is not None:
        checks.check_names(f"{where}: misfits: laws", known, misfits)
        misfits = {n: checks.number(f"{where}: misfits: {n}", misfits[n], lower=0.0) for n in known}
    of_data = data is not None or misfits is not None
    own = of_data if fitted is None else checks.flag(f"{where}: fitted", fitted)
    task = Task(
        machine, compared, asked, frictions, load, accuracy, control, own,
        checks.flag(f"{where}: fixed_steps", fixed_steps), max(1, round(effort * RUN)), misfits,
    )  # fmt: skip
    rows = _rows(task, known, count, progress)
    return Choice(
        machine.name, asked, accuracy, "as fitted" if own else str(frictions[""]),
        compared.about if misfits is None else "the data that they were fitted to",
        compared.uncertain,
        control, machine.t_end, tuple(ordered(rows)), perf_counter() - began,
        tuple(sorted(set(known) - {row.law for row in rows})),
    )  # fmt: skip


def laws_of(where: str, laws: Candidates | None) -> dict[str, tuple[Law, ...]]:
    """Return the candidates by name, each in the forms that are tried.

    Raises:
        ValueError: unknown names, something else than laws, none at all.
    """
    if laws is None:
        return {name: forms(kind()) for name, kind in ALL_LAWS.items()}
    if isinstance(laws, Mapping):
        given = checks.named(f"{where}: laws", laws)
        found = {n: tuple(x) if isinstance(x, list | tuple) else (x,) for n, x in given.items()}
        for name, several in found.items():
            for law in several or (several,):
                check_law(f"{where}: laws: {name}", law)
    else:
        found = {n: forms(ALL_LAWS[n]()) for n in checks.names(f"{where}: laws", laws, ALL_LAWS)}
    if not found:
        raise ValueError(f"{where}: laws: expected at least one, got none")
    return found


def _rows(task: Task, laws: Forms, workers: int, progress: Progress | None) -> list[Row]:
    """Return the rows; those that are there at an interrupt."""
    rows: list[Row] = []
    results = _many(task, laws, workers) if workers > 1 else _one_by_one(task, laws)
    with suppress(KeyboardInterrupt):
        for row in results:
            rows.append(row)
            if progress is not None:
                progress(row.law, len(rows) / len(laws))
    return rows


def _one_by_one(task: Task, laws: Forms) -> Iterator[Row]:
    for name, law in laws.items():
        yield best_form(task, name, law)


def _many(task: Task, laws: Forms, workers: int) -> Iterator[Row]:
    """Return the rows as they come from several processes, each of which asks for one law at a
    time.

    They are forked: functions of a user's file cannot be sent.
    """
    if "fork" not in get_all_start_methods():
        yield from _one_by_one(task, laws)
        return
    fork = get_context("fork")
    left = list(laws)
    crew: dict[Any, tuple[ForkProcess, str]] = {}
    try:
        while left or crew:
            while left and len(crew) < workers:
                name = left.pop(0)
                ours, theirs = fork.Pipe(duplex=False)
                process = fork.Process(
                    target=_work, args=(theirs, task, name, laws[name]), daemon=True
                )
                process.start()
                theirs.close()
                crew[ours] = process, name
            for pipe in wait(list(crew)):
                process, name = crew.pop(pipe)
                yield _answer(pipe, process, name)
    finally:
        for process, _ in crew.values():
            process.kill()


def _answer(pipe: Any, process: ForkProcess, name: str) -> Row:
    """Return the row that a process sends; that it ended, where it sends none."""
    try:
        row: Row = pipe.recv()
    except EOFError:
        process.join()
        return Row(name, FAILED, f"its process ended with exit status {process.exitcode}")
    process.join()
    return row


def _work(pipe: Any, task: Task, name: str, law: tuple[Law, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever waits for the rows
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    pipe.send(best_form(task, name, law))
