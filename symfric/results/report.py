"""Self-contained HTML page about simulations.

It contains signals, laws with equations and limits, parameters, and the command that repeats the
simulations.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from inspect import getdoc
from pathlib import Path
from platform import platform, python_version
from typing import Any

import numpy as np

from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.parameters import Parameter, parameters
from symfric.foundation.shown import data_uri
from symfric.foundation.style import COLOURS
from symfric.page import html
from symfric.page.svg import Polyline, around, chart
from symfric.results.kinds import is_mechanism, norms
from symfric.results.trajectory import Trajectory

LINES = 4
"""Largest number of runs in one chart of friction over sliding velocity."""


def report(
    runs: Trajectory | Mapping[str, Trajectory],
    path: str | Path | None = None,
    *,
    settings: Mapping[str, Mapping[str, Parameter]] | None = None,
    command: str = "",
) -> str:
    """Return an HTML page about one or several simulations of a machine.

    Args:
        runs: a trajectory, or trajectories by name, such as the name of the law.
        path: HTML file to write.
        settings: all parameters of the machine by name of the run; models contain only their
            values.
        command: command line that repeats the runs.

    Returns:
        The content of the page.

    Raises:
        ValueError: there is no run, or a value is not a run.
    """
    from symfric.results.pictures import plot_trajectories  # noqa: PLC0415  (slow to import)

    if isinstance(runs, Trajectory):
        runs = {runs.scene: runs}
    if not isinstance(runs, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise checks.refused("report: runs", "a run of simulate, or {name: run}", runs)
    named = checks.named("report: runs", runs)
    if not named:
        raise ValueError("report: expected at least one run, got none")
    for name, run in named.items():
        checks.kind(f"report: runs {name}", run, Trajectory, "a run of simulate")
    source = data_uri(plot_trajectories(named), dpi=110)
    drawing = f'<img src="{source}" alt="signals over time" style="max-width:100%">'
    caption = "Signals over time, with every accepted step."
    parts = {
        "motion": ("Motion", [html.figure(drawing, caption)]),
        "signals": ("Signals", [*_signals(named)]),
        "friction": ("Friction", [*_friction(named)]),
        "books": ("Accuracy", [*_books(named)]),
        "laws": ("Laws", [*_laws(named)]),
        "settings": ("Parameters", [*_settings(settings or {})]),
        "made": ("How it was made", [*_made(command)]),
    }
    sections = {a: html.section(a, title, *blocks) for a, (title, blocks) in parts.items()}
    heading = f"{next(iter(named.values())).scene} with {' and '.join(named)}"
    links = [(a, title) for a, (title, _) in parts.items() if sections[a]]
    body = [html.title(heading), _verdict(named), html.contents(links), *sections.values()]
    text = html.page(heading, "en", "\n".join(part for part in body if part))
    if path is not None:
        write_text(path, text)
    return text


def _verdict(runs: Mapping[str, Trajectory]) -> str:
    """Return the block with the status of the runs."""
    ended = all(run.status.ok for run in runs.values())
    good = ended and not any(run.doubts for run in runs.values())
    messages = [f"{name}: {run.message}" for name, run in runs.items()]
    title = "Done" if good else "In doubt" if ended else "Not finished"
    return html.verdict("good" if good else "bad", title, messages)


def _signals(runs: Mapping[str, Trajectory]) -> Iterator[str]:
    """Yield a table of ranges and a paragraph about events for each run."""
    for name, run in runs.items():
        rows = [
            (signal, *map(_number, (run.final[signal], *run.extremes[signal])), run.units[signal])
            for signal in run.units
        ]
        span = f"{run.span[0]:g} ... {run.span[1]:g} s"
        caption = f"{name}, {span}: over all accepted steps"
        yield html.table(caption, ("signal", "final", "least", "greatest", "unit"), rows, (1, 2, 3))
        if run.happened:
            counts = Counter(name for _, name in run.happened).items()
            events = ", ".join(f"{event} {n} times" for event, n in counts)
            yield html.paragraph(f"Events: {events}.")


def _friction(runs: Mapping[str, Trajectory]) -> Iterator[str]:
    """Yield charts of friction over sliding velocity for each contact, in the colours of `plot`."""
    first = next(iter(runs.values()))
    for contact in first.model.contacts:
        name = "friction" if contact.bare else f"{contact.name}_friction"
        if not all(name in run.units for run in runs.values()):
            continue
        curves: list[Polyline] = []
        for k, (label, run) in enumerate(runs.items()):
            own = next(c for c in run.model.contacts if c.name == contact.name)
            slip = run.of(own.slip, run.looks)
            curves.append(Polyline(f"run{k % len(COLOURS)}", slip, run.at_looks(name), label))
        for start in range(0, len(curves), LINES):
            shown = curves[start : start + LINES]
            slips, forces = [c.x for c in shown], [c.y for c in shown]
            speed = "rad/s" if contact.turning else "m/s"
            x = around("sliding velocity", speed, np.concatenate(slips))
            y = around(name, first.units[name], np.concatenate(forces))
            title = f"Friction over sliding velocity: {contact.name}"
            yield html.figure(chart(title, x, y, shown, height=300.0))


def _books(runs: Mapping[str, Trajectory]) -> Iterator[str]:
    """Yield the table of errors, constraints, energy and cost, with an explanation."""
    rows: list[tuple[str, ...]] = []
    for name, run in runs.items():
        s, energy = run.statistics, np.nan
        if is_mechanism(run.model) and run.status.ok:
            energy = run.energy_balance().relative
        held = [run[norm].max() for norm in norms(run.model)[:1]] or [np.nan]
        errors = (f"{x:.1e}" if np.isfinite(x) else "–" for x in (s.error, energy, *held))
        cost = f"{s.steps}", f"{s.rejections}", f"{s.method} ({s.backend})"
        rows.append((name, *errors, *cost, f"{1e3 * s.run_time:.3g}"))
    header = ("run", "measured error", "energy unexplained", "constraints", "steps", "rejected")
    yield html.table("Error and cost", (*header, "method", "run [ms]"), rows, (1, 2, 3, 4, 5, 7))
    yield html.paragraph(
        "Measured error: largest difference of a state from a run by another formula at a "
        "hundredth of the tolerance, over the magnitude of that state. Energy unexplained: what "
        "energy and work of a mechanism do not explain, relative to the largest of them. "
        "Constraints: largest violation, in m.",
        "soft",
    )


def _laws(runs: Mapping[str, Trajectory]) -> Iterator[str]:
    """Yield equation, limits and parameters of each law with different parameters."""
    laws: dict[str, Any] = {}
    for run in runs.values():
        for contact in run.model.contacts:
            law: Any = contact.law
            numbers = [(n, str(p.value)) for n, p in parameters(law).items()]
            laws.setdefault(f"{type(law)}{numbers}", law)
    for law in laws.values():
        title, _, rest = (getdoc(type(law)) or type(law).__name__).partition("\n")
        yield html.heading(title)
        for block in rest.strip("\n").replace("\nSource:", "\n\nSource:").split("\n\n"):
            text = html.code if block.startswith(" ") else html.paragraph
            yield text(block if block.startswith(" ") else " ".join(block.split()))
        rows = [(n, _number(p.value), p.unit, p.doc) for n, p in parameters(law).items()]
        yield html.table("Parameters of the law", ("name", "value", "unit", "meaning"), rows, (1,))
        yield html.bullets(law.warnings() if hasattr(law, "warnings") else ())


def _settings(settings: Mapping[str, Mapping[str, Parameter]]) -> Iterator[str]:
    """Yield the table of all parameters, with a column for each run."""
    names = dict.fromkeys(name for known in settings.values() for name in known)
    rows: list[Sequence[str]] = []
    for name in names:
        each = [known.get(name) for known in settings.values()]
        one = next(p for p in each if p is not None)
        values = [_number(p.value) if p is not None else "–" for p in each]
        rows.append((name, *values, one.unit, one.doc))
    columns = range(1, 1 + len(settings))
    yield html.table("Values in the runs", ("name", *settings, "unit", "meaning"), rows, [*columns])


def _made(command: str) -> Iterator[str]:
    """Yield the command and a table of versions."""
    yield html.code(command)
    rows = [(name, version(name)) for name in ("symfric", "casadi", "numpy")]
    rows += [("Python", python_version()), ("platform", platform())]
    yield html.table("Versions", ("what", ""), rows)


def _number(value: Any) -> str:
    """Return a number with six significant digits; other values as `str`."""
    return f"{value:.6g}" if isinstance(value, int | float | np.floating) else str(value)
