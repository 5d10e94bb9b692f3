"""Choose a law: candidates run on the user's machine, and are ranked by work at equal error."""

import csv
import json
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from math import isfinite
from multiprocessing import get_all_start_methods, get_context
from multiprocessing.connection import wait
from multiprocessing.context import ForkProcess
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, cast, final

from symfric.choice.continuation import RUN
from symfric.choice.friction import Friction
from symfric.choice.machine import FAILURES, OWN, frictions_of, load_of, reference_of
from symfric.choice.measured import Task, best_form
from symfric.choice.nature import forms, needed
from symfric.choice.ranking import FAILED, Ranking, Row, lines, ordered
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
"""Largest number of rows of the text in a terminal."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class Choice(Ranking):
    """Ranking of laws with its text, picture, page and files; see `Ranking` for its attributes."""

    @property
    def table(self) -> list[dict[str, Any]]:
        """Row of plain numbers and texts for each law, for CSV and data frames."""
        return [flat(row) for row in self.rows]

    def __repr__(self) -> str:
        return "\n".join(lines(self, SCREEN))

    def _repr_html_(self) -> str:  # pyright: ignore[reportUnusedFunction]  (notebooks call it)
        from symfric.choice.page import body  # noqa: PLC0415  (matplotlib is slow to import)

        return body(self)

    def plot(self, path: str | Path | None = None, *, wide: bool = False) -> "Figure":
        """Draw error against work, marked by the phenomena of a law; save it to `path` if given.

        It is as wide as a column of print, 85 mm; `wide` puts the panels next to each other.
        """
        from symfric.choice.page import plot_choice  # noqa: PLC0415  (matplotlib is slow to import)

        return plot_choice(self, path, wide)

    def to_html(self, path: str | Path) -> None:
        """Write one self-contained page: verdict, picture, table."""
        from symfric.choice.page import page  # noqa: PLC0415  (matplotlib is slow to import)

        write_text(path, page(self))

    def to_csv(self, path: str | Path) -> None:
        """Write the table, one law in a line."""
        rows = self.table
        with written(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
            sheet = csv.DictWriter(file, fieldnames=list(rows[0]) if rows else ["law"])
            sheet.writeheader()
            sheet.writerows(rows)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; NaN and infinity are None."""
        data: dict[str, Any] = {item.name: getattr(self, item.name) for item in fields(self)}
        rows = data.pop("rows")
        return data | {
            "needs": list(self.needs),
            "uncertain": self.uncertain if isfinite(self.uncertain) else None,
            "best": None if self.best is None else self.best.law,
            "verdict": list(self.verdict),
            "unmeasured": list(self.unmeasured),
            "rows": [row.to_dict() for row in rows],
        }

    def to_json(self, path: str | Path) -> None:
        """Write `to_dict` as a file."""
        write_text(path, json.dumps(self.to_dict(), indent=2, ensure_ascii=False) + "\n")


def flat(row: Row) -> dict[str, Any]:
    """Return a row without nested values."""
    data = row.to_dict()
    del data["curve"]
    values = data.pop("values") or {}
    form = [f"form={row.form}"] if row.form else []
    data["values"] = " ".join([*form, *(f"{n}={value:g}" for n, value in values.items())])
    return data | {name: " ".join(data[name]) for name in ("phenomena", "hard")}


Progress = Callable[[str, float], None]
Candidates = Mapping[str, Law | Sequence[Law]] | Sequence[str]
"""Name -> law or forms of it; or names of laws."""
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

    Every law describes the same friction (mu_s, mu_d; the peak of a smooth law is mu_s N), and is
    as smooth as the accuracy allows: its widths and bristles are scaled together. The loosest
    tolerance is taken with which law and integrator together keep the accuracy. That run is
    counted, attempts times instructions, and timed. The count determines the rank, which is the
    same in every run of `select`; laws within 10 % share a rank.

    A law that does not keep the accuracy, or lacks a needed phenomenon, comes after all that do, by
    its error, and is counted where its own error, that of the integrator, is the accuracy. The
    reason is another motion if its runs tend to one with an order; otherwise it says what remains
    undecided: runs fail, cost too much, or creep by less than the rounding of velocities. A law
    that the machine does not accept has a row with the reason, too. The budget of a law is counted
    as well (`symfric.choice.continuation`), independently of the load of the computer.

    Args:
        scene: a scene, a class of scenes (`Rabinowicz`), or a function law -> scene or `Model`,
            such as `partial(PendulumBox.preset, "jing_mi_table_7")`.
        laws: name -> law, or names; the whole catalogue by default. A law given by its name is
            tried in its form with events, if it has one, and, unless that is ranked, in its default
            form (the other way round if the exact form has no C); its row names the form. A
            sequence of laws under a name is tried in its order.
        needs: words of `symfric.choice.NEEDS`, such as "stiction", "presliding", "drift-free".
        accuracy: largest error relative to the size of the motion; between 0 and 1.
        friction: the friction that all laws describe; by default the levels of the scene.
        reference: "exact" dry friction by events, if the machine accepts it, else as "sharpest",
            the limit of a smooth law; or a law, or a run.
        data: t [s] and signals by name, as the reference; errors are then root mean squares, and
            the laws the fitted ones.
        misfits: law -> error from data that were measured elsewhere, as on a test rig, and that the
            laws were fitted to; then `accuracy` is that of the integrator alone, and laws within
            10 % of the smallest misfit are ranked.
        t_end: end of the motion [s]; that of the scene.
        u: inputs; those of the scene.
        of: compared signals by name, or a function of a trajectory, such as the period of a cycle,
            if an error of phase would grow with time; by default the positions.
        fitted: True if laws are neither given the levels of `friction` nor scaled; by default with
            `data`.
        control: largest error of fixed steps, of a law that is as smooth as that allows.
        fixed_steps: measure the needs of a controller, too: the largest fixed steps, and
            instructions on a Cortex-M4F if a cross compiler and QEMU are installed.
        effort: budget of the runs of a law, relative to the usual one; a larger one brings laws
            with undamped bristles, such as GMS, nearer to dry friction.
        workers: processes; more than one needs a system that can fork (not Windows).
        progress: called with the name of each finished law and the share of all.

    Raises:
        ValueError: bad input.
        SolveError: not even a reference runs.

    An interrupt (Ctrl-C) returns the rows so far; `unmeasured` names the other laws.
    Limits: a motion without a limit as widths vanish, such as a chaotic one over a long time, has
    no accuracy; shorten it or compare other numbers. Times are those of CasADi's virtual machine.
    """
    where, began = "select", perf_counter()
    words = needed(f"{where}: needs", needs)
    accuracy = checks.number(f"{where}: accuracy", accuracy, above=0.0, upper=1.0)
    control = checks.number(f"{where}: control", control, above=0.0, upper=1.0)
    count = checks.count(f"{where}: workers", workers)
    effort = checks.number(f"{where}: effort", effort, above=0.0, upper=1e6)
    if friction is not None:
        such = "a friction, such as Friction(mu_s=0.2, mu_d=0.15)"
        checks.kind(f"{where}: friction", friction, Friction, such)
    candidates = laws_of(where, laws)
    machine = machine_of(where, scene, t_end, of, u, BrownMcPhee(), "vm")
    frictions = frictions_of(machine, friction, scene)
    load = None
    with suppress(*FAILURES):
        load = load_of(machine.model(BrownMcPhee()))
    if misfits is None:
        given = reference if data is None else data
        compared, machine = reference_of(
            f"{where}: reference", machine, given, frictions, load, accuracy
        )
        about = compared.about
    else:
        checks.check_names(f"{where}: misfits: laws", candidates, misfits)
        misfits = {
            n: checks.number(f"{where}: misfits: {n}", misfits[n], lower=0.0) for n in candidates
        }
        compared, about = OWN, "the data that they were fitted to"
    of_data = data is not None or misfits is not None
    fitted = of_data if fitted is None else checks.flag(f"{where}: fitted", fitted)
    task = Task(
        machine, compared, words, frictions, load, accuracy, control, fitted,
        checks.flag(f"{where}: fixed_steps", fixed_steps), max(1, round(effort * RUN)), misfits,
    )  # fmt: skip
    rows: list[Row] = []
    with suppress(KeyboardInterrupt):
        for row in _rows(task, candidates, count):
            rows.append(row)
            if progress is not None:
                progress(row.law, len(rows) / len(candidates))
    return Choice(
        machine.name, words, accuracy, "as fitted" if fitted else str(frictions[""]), about,
        compared.uncertain, control, machine.t_end, tuple(ordered(rows)), perf_counter() - began,
        tuple(sorted(set(candidates) - {row.law for row in rows})),
    )  # fmt: skip


def laws_of(where: str, laws: Candidates | None) -> Forms:
    """Return the candidates by name, each in the forms that are tried.

    Raises:
        ValueError: unknown names, anything but laws, an empty sequence.
    """
    if isinstance(laws, Mapping):
        given = checks.named(f"{where}: laws", laws)
        found = {n: tuple(x) if isinstance(x, list | tuple) else (x,) for n, x in given.items()}
        for name, several in found.items():
            for law in several or (several,):
                check_law(f"{where}: laws: {name}", law)
    else:
        names = ALL_LAWS if laws is None else checks.names(f"{where}: laws", laws, ALL_LAWS)
        found = {name: forms(ALL_LAWS[name]()) for name in names}
    if not found:
        raise ValueError(f"{where}: laws: expected at least one, got none")
    return found


def _rows(task: Task, laws: Forms, workers: int) -> Iterator[Row]:
    """Yield the rows, with several workers as they come from processes with one law each.

    The processes are forked, since functions of a user's file cannot be sent.
    """
    if workers == 1 or "fork" not in get_all_start_methods():
        yield from (best_form(task, name, law) for name, law in laws.items())
        return
    fork, left = get_context("fork"), list(laws)
    crew: dict[Any, tuple[ForkProcess, str]] = {}
    try:
        while left or crew:
            while left and len(crew) < workers:
                name = left.pop(0)
                ours, theirs = fork.Pipe(duplex=False)
                arguments = theirs, task, name, laws[name]
                process = fork.Process(target=_work, args=arguments, daemon=True)
                process.start()
                theirs.close()
                crew[ours] = process, name
            for pipe in cast("list[Any]", wait(list(crew))):
                process, name = crew.pop(pipe)
                row: Row | None = None
                with suppress(EOFError):  # a process that died sends nothing
                    row = pipe.recv()
                process.join()
                died = f"its process ended with exit status {process.exitcode}"
                yield row or Row(name, FAILED, died)
    finally:
        for process, _ in crew.values():
            process.kill()


def _work(pipe: Any, task: Task, name: str, law: tuple[Law, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that collects the rows
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    pipe.send(best_form(task, name, law))
