"""Choice of a law: candidates run in the user's machine and are ranked by work at equal error."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from math import isfinite
from multiprocessing import get_all_start_methods
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, final

from symfric.choice.continuation import RUN
from symfric.choice.friction import Friction
from symfric.choice.machine import FAILURES, OWN, frictions_of, load_of, reference_of
from symfric.choice.measured import Requirements, best_form
from symfric.choice.nature import forms, needed
from symfric.choice.ranking import FAILED, RankedLaw, Ranking, lines, ordered
from symfric.figures.regularisation import Measure, machine_of
from symfric.foundation import checks
from symfric.foundation.files import write_table, write_text
from symfric.foundation.workers import Crashed, outcomes
from symfric.integrator import Input, Trajectory
from symfric.laws import ALL_LAWS, BrownMcPhee, Law, law_name
from symfric.laws.base.law import require_law

if TYPE_CHECKING:
    from matplotlib.figure import Figure


SCREEN = 16
"""Largest number of rows in the text representation of a `Choice`."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class Choice(Ranking):
    """Ranking of laws with text, figure, page and files; see `Ranking` for the attributes."""

    @property
    def table(self) -> list[dict[str, Any]]:
        """Rows of plain numbers and texts, one for each law, for CSV and data frames."""
        return [flat(row) for row in self.rows]

    def __repr__(self) -> str:
        return "\n".join(lines(self, SCREEN))

    def _repr_html_(self) -> str:  # pyright: ignore[reportUnusedFunction]  (notebooks call it)
        from symfric.choice.page import body  # noqa: PLC0415  (slow to import)

        return body(self)

    def plot(self, path: str | Path | None = None, *, wide: bool = False) -> "Figure":
        """Draw error against work, with markers for phenomena; save the figure to `path` if given.

        The figure has the width of a printed column, 85 mm; `wide` places its panels side by side.
        """
        from symfric.choice.page import plot_choice  # noqa: PLC0415  (slow to import)

        return plot_choice(self, path, wide)

    def to_html(self, path: str | Path) -> None:
        """Write a self-contained HTML page with verdict, figure and table."""
        from symfric.choice.page import page  # noqa: PLC0415  (slow to import)

        write_text(path, page(self))

    def to_csv(self, path: str | Path) -> None:
        """Write the table as CSV, with one line per law."""
        rows = self.table
        write_table(path, rows[0] if rows else ["law"], (row.values() for row in rows))

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
        """Write the result of `to_dict` to a JSON file."""
        write_text(path, json.dumps(self.to_dict(), indent=2, ensure_ascii=False) + "\n")


def flat(row: RankedLaw) -> dict[str, Any]:
    """Return a row without nested values."""
    data = row.to_dict()
    del data["curve"]
    values = data.pop("values") or {}
    form = [f"form={row.form}"] if row.form else []
    data["values"] = " ".join([*form, *(f"{n}={value:g}" for n, value in values.items())])
    return data | {name: " ".join(data[name]) for name in ("phenomena", "hard")}


Progress = Callable[[str, float], None]
Candidates = Mapping[str, Law | Sequence[Law]] | Sequence[str | Law]
"""Laws, or sequences of forms of a law, by name; or a sequence of names of laws."""
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
    """Rank friction laws in a machine by the work of a run at equal error.

        error = max |x - x_dry| / (largest - smallest x_dry)      over positions and times

    All laws describe the same friction (mu_s, mu_d; the peak of a smooth law is mu_s N). Each law
    is as smooth as the accuracy allows, with its widths and bristles scaled together. It runs at
    the loosest tolerance at which law and integrator together satisfy the accuracy. The work of
    this run is attempted steps times instructions per attempt. It determines the rank, which is
    therefore reproducible; laws within 10 % share a rank. The run is also timed.

    Laws that do not satisfy the accuracy or lack a required phenomenon follow, sorted by error.
    Their work is that of a run whose own error, that of the integrator, satisfies the accuracy. The
    reason in the row states that the law tends to another motion, if its runs converge to one, or
    else why this is undecided: runs fail, take too much work, or creep more slowly than rounding
    errors of velocities. Laws that the machine rejects have a row with the reason as well. Each law
    has a budget of work (`symfric.choice.continuation`), independent of the load of the computer.

    Args:
        scene: a scene, a class of scenes (`Rabinowicz`), or a function law -> scene or `Model`,
            such as `partial(PendulumBox.preset, "jing_mi_table_7")`.
        laws: laws by name, or a list of names and laws; by default the whole catalogue. A law given
            by its name is tried in its form with events, if it has one, and then, unless that form
            is ranked, in its default form (in reverse order if no C can be generated from the form
            with events). Its row states the form. A sequence of laws is tried in its order.
        needs: words of `symfric.choice.NEEDS`, such as "stiction", "presliding", "drift-free".
        accuracy: largest error relative to the size of the motion, between 0 and 1.
        friction: the friction that all laws describe; by default the levels of the scene.
        reference: "exact", dry friction with events if the machine accepts it, otherwise as
            "sharpest"; "sharpest", the limit of a smooth law; or a law, or a trajectory.
        data: t [s] and signals by name, used as the reference. Errors are then root mean squares,
            and the laws are assumed to be fitted.
        misfits: error of each law from data of another machine, such as a test rig, to which the
            laws were fitted. Then `accuracy` applies to the integrator alone, and laws within 10 %
            of the smallest misfit are ranked.
        t_end: end of the motion [s]; by default that of the scene.
        u: inputs; by default those of the scene.
        of: names of the compared signals, by default the positions; or a function of a trajectory,
            such as the period of a cycle, if phase errors would grow with time.
        fitted: True if laws keep their parameters and are not scaled; by default True with `data`
            or `misfits`.
        control: largest error of fixed steps, with the law as smooth as this error allows.
        fixed_steps: True to measure the largest fixed steps, and the instructions on a Cortex-M4F
            if a cross compiler and QEMU are installed.
        effort: budget of the runs of a law, relative to the default budget. With a larger budget,
            laws with undamped bristles, such as GMS, come closer to dry friction.
        workers: number of processes; more than one requires a system that can fork (not Windows).
        progress: function called with the name of each finished law and the finished share.

    Raises:
        ValueError: bad input.
        SolveError: no reference can be computed.

    An interrupt (Ctrl-C) returns the rows so far; `unmeasured` contains the other laws.
    Limits: errors are meaningless for a motion that does not converge as widths vanish, such as a
    long chaotic motion; shorten it or compare other numbers. Times are those of CasADi's virtual
    machine.
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
    required = Requirements(
        machine, compared, words, frictions, load, accuracy, control, fitted,
        checks.flag(f"{where}: fixed_steps", fixed_steps), max(1, round(effort * RUN)), misfits,
    )  # fmt: skip
    rows: list[RankedLaw] = []
    with suppress(KeyboardInterrupt):
        for row in _rows(required, candidates, count):
            rows.append(row)
            if progress is not None:
                progress(row.law, len(rows) / len(candidates))
    return Choice(
        machine.name, words, accuracy, "as fitted" if fitted else str(frictions[""]), about,
        compared.uncertain, control, machine.t_end, tuple(ordered(rows)), perf_counter() - began,
        tuple(sorted(set(candidates) - {row.law for row in rows})),
    )  # fmt: skip


def laws_of(where: str, laws: Candidates | None) -> Forms:
    """Return the forms to try for each candidate, by name.

    Raises:
        ValueError: unknown names, elements that are not laws, or an empty sequence.
    """
    if isinstance(laws, Mapping):
        given = checks.named(f"{where}: laws", laws)
        found = {n: tuple(x) if isinstance(x, list | tuple) else (x,) for n, x in given.items()}
        for name, several in found.items():
            for law in several or (several,):
                require_law(f"{where}: laws: {name}", law)
    else:
        listed = laws if isinstance(laws, list | tuple) else ()
        own = {law_name(law): (law,) for law in listed if isinstance(law, Law)}
        asked = [law_name(x) if isinstance(x, Law) else x for x in listed] if own else laws
        known = ALL_LAWS | own
        names = ALL_LAWS if asked is None else checks.names(f"{where}: laws", asked, known)
        found = {name: own.get(name) or forms(ALL_LAWS[name]()) for name in names}
    if not found:
        raise ValueError(f"{where}: laws: expected at least one, got none")
    return found


def _rows(required: Requirements, laws: Forms, workers: int) -> Iterator[RankedLaw]:
    """Yield the rows; with several workers each law has a process, and rows come as they finish.

    The processes are forked, since functions defined in a user's file cannot be sent.
    """
    if workers == 1 or "fork" not in get_all_start_methods():
        yield from (best_form(required, name, law) for name, law in laws.items())
        return
    names, tasks = [*laws], enumerate(laws.items())
    for number, row in outcomes(lambda at: best_form(required, *at), tasks, workers, start="fork"):
        if isinstance(row, Crashed):
            yield RankedLaw(
                names[number], FAILED, f"its process ended with {row.how}: {row.last_line}"
            )
        else:
            yield row
