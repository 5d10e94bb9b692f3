"""Runs as one HTML page that needs nothing from elsewhere: what was asked, and what came out.

The page is an archive: it holds the numbers, the laws with their
equations, parameters and limits, and how to run it again.
"""

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
from symfric.foundation.style import COLOURS
from symfric.model import Contact
from symfric.page import html
from symfric.page.svg import Path as Line
from symfric.page.svg import around, chart
from symfric.results.kinds import is_mechanism, norms
from symfric.results.trajectory import Trajectory

CONTENTS = (
    ("motion", "Motion"),
    ("signals", "Signals"),
    ("friction", "Friction"),
    ("books", "Accuracy"),
    ("laws", "Laws"),
    ("settings", "Parameters"),
    ("made", "How it was made"),
)
LINES = 4
"""Runs in one chart; a page with more has its friction in several."""


def report(
    runs: Trajectory | Mapping[str, Trajectory],
    path: str | Path | None = None,
    *,
    settings: Mapping[str, Mapping[str, Parameter]] | None = None,
    command: str = "",
) -> str:
    """One page of one or several simulations of a machine.

    Args:
        runs: a trajectory, or name, such as that of the law -> trajectory.
        path: HTML file to write.
        settings: name -> all parameters of the machine, which a model holds as constants.
        command: how to do it again.

    Returns:
        The page as text.

    Raises:
        ValueError: no run, or something else than runs.
    """
    if not isinstance(runs, Trajectory | Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise checks.refused("report: runs", "a run of simulate, or {name: run}", runs)
    named = checks.named(
        "report: runs", {runs.scene: runs} if isinstance(runs, Trajectory) else runs
    )
    if not named:
        raise ValueError("report: expected at least one run, got none")
    for name, run in named.items():
        checks.kind(f"report: runs {name}", run, Trajectory, "a run of simulate")
    parts = {
        "motion": [_picture(named)],
        "signals": [*_signals(named)],
        "friction": [*_friction(named)],
        "books": [*_books(named)],
        "laws": [*_laws(named)],
        "settings": [*_settings(settings or {})],
        "made": [*_made(named, command)],
    }
    sections = {a: html.section(a, title, *parts[a]) for a, title in CONTENTS}
    first = next(iter(named.values()))
    heading = f"{first.scene} with {' and '.join(named)}"
    links = [(a, title) for a, title in CONTENTS if sections[a]]
    body = [html.title(heading), _verdict(named), html.contents(links), *sections.values()]
    text = html.page(heading, "en", "\n".join(part for part in body if part))
    if path is not None:
        write_text(path, text)
    return text


def _verdict(runs: Mapping[str, Trajectory]) -> str:
    """Return the ends of the runs."""
    ended = all(run.status.ok for run in runs.values())
    good = ended and not any(run.doubts for run in runs.values())
    said = [f"{name}: {run.message}" for name, run in runs.items()]
    return html.verdict(
        "good" if good else "bad", "Done" if good else "In doubt" if ended else "Not finished", said
    )


def _picture(runs: Mapping[str, Trajectory]) -> str:
    """Return the picture that `plot` gives, inside the page."""
    from symfric.foundation.shown import data_uri  # noqa: PLC0415  (matplotlib is slow)
    from symfric.results.pictures import plot_trajectories  # noqa: PLC0415  (likewise)

    source = data_uri(plot_trajectories(runs), dpi=110)
    drawing = f'<img src="{source}" alt="signals over time" style="max-width:100%">'
    return html.figure(drawing, "Signals over time, with every accepted step.")


def _signals(runs: Mapping[str, Trajectory]) -> Iterator[str]:
    """Return a table of ranges for each run."""
    for name, run in runs.items():
        rows = [
            (signal, *map(_number, (run.final[signal], *run.extremes[signal])), run.units[signal])
            for signal in run.units
        ]
        span = f"{run.span[0]:g} ... {run.span[1]:g} s"
        caption = f"{name}, {span}: over all accepted steps"
        yield html.table(caption, ("signal", "final", "least", "greatest", "unit"), rows, (1, 2, 3))
        if run.happened:
            counts = {what: sum(w == what for _, w in run.happened) for _, what in run.happened}
            yield html.paragraph(
                "Events: " + ", ".join(f"{what} {n} times" for what, n in counts.items()) + "."
            )


def _friction(runs: Mapping[str, Trajectory]) -> Iterator[str]:
    """Friction over the sliding velocity, a chart per contact."""
    first = next(iter(runs.values()))
    for contact in first.model.contacts:
        name = _force_name(contact)
        if all(name in run.units for run in runs.values()):
            kinds = {label: f"run{k % len(COLOURS)}" for k, label in enumerate(runs)}
            for start in range(0, len(runs), LINES):
                shown = dict([*runs.items()][start : start + LINES])
                yield html.figure(_loop(shown, kinds, contact, name))


def _force_name(contact: Contact) -> str:
    return "friction" if contact.bare else f"{contact.name}_friction"


def _loop(
    runs: Mapping[str, Trajectory], kinds: Mapping[str, str], contact: Contact, name: str
) -> str:
    """Friction of one contact over its sliding velocity, in the colours of the picture above."""
    lines: list[tuple[str, Any, Any]] = []
    for label, run in runs.items():
        own = next(c for c in run.model.contacts if c.name == contact.name)
        lines.append((label, run.of(own.slip, run.looks), run.at_looks(name)))
    slips, forces = (np.concatenate([line[k] for line in lines]) for k in (1, 2))
    first = next(iter(runs.values()))
    speed = "rad/s" if contact.turning else "m/s"
    x = around("sliding velocity", speed, slips)
    y = around(name, first.units[name], forces)
    marks = [Line(kinds[label], across, up, label) for label, across, up in lines]
    return chart(f"Friction over sliding velocity: {contact.name}", x, y, marks, height=300.0)


def _books(runs: Mapping[str, Trajectory]) -> Iterator[str]:
    """Error, constraints, energy, cost."""
    rows = [(name, *_accuracy(run)) for name, run in runs.items()]
    header = ("run", "measured error", "energy unexplained", "constraints", "steps", "rejected")
    yield html.table("Error and cost", (*header, "method", "run [ms]"), rows, (1, 2, 3, 4, 5, 7))
    yield html.paragraph(
        "Measured error: largest difference of a state from a run by another formula at a "
        "hundredth of the tolerance, over the magnitude of that state. Energy unexplained: what "
        "energy and work of a mechanism leave open, over what moved. Constraints: largest "
        "violation, in m.",
        "soft",
    )


def _accuracy(run: Trajectory) -> tuple[str, ...]:
    s = run.statistics
    mechanism = is_mechanism(run.model) and run.status.ok
    energy = f"{run.energy_balance().relative:.1e}" if mechanism else "–"
    held = [run[name].max() for name in norms(run.model)[:1]]
    return (
        f"{s.error:.1e}" if np.isfinite(s.error) else "–",
        energy,
        f"{max(held):.1e}" if held else "–",
        f"{s.steps}",
        f"{s.rejections}",
        f"{s.method} ({s.backend})",
        f"{1e3 * s.run_time:.3g}",
    )


def _laws(runs: Mapping[str, Trajectory]) -> Iterator[str]:
    """Equation, limits and numbers of every law with other numbers, once."""
    told = set[str]()
    for run in runs.values():
        for contact in run.model.contacts:
            law: Any = contact.law
            numbers = parameters(law)
            mark = f"{type(law)}{[(n, str(p.value)) for n, p in numbers.items()]}"
            if mark not in told:
                told.add(mark)
                yield from _law(law, numbers)


def _law(law: Any, numbers: Mapping[str, Parameter]) -> Iterator[str]:
    title, _, rest = (getdoc(type(law)) or type(law).__name__).partition("\n")
    yield html.heading(title)
    for block in rest.strip("\n").replace("\nSource:", "\n\nSource:").split("\n\n"):
        text = html.code if block.startswith(" ") else html.paragraph
        yield text(block if block.startswith(" ") else " ".join(block.split()))
    rows = [(n, _number(p.value), p.unit, p.doc) for n, p in numbers.items()]
    yield html.table("Parameters of the law", ("name", "value", "unit", "meaning"), rows, (1,))
    yield html.bullets(law.warnings() if hasattr(law, "warnings") else ())


def _settings(settings: Mapping[str, Mapping[str, Parameter]]) -> Iterator[str]:
    """All parameters of the machine, side by side where there are several."""
    names = dict.fromkeys(name for known in settings.values() for name in known)
    rows: list[Sequence[str]] = []
    for name in names:
        each = [known.get(name) for known in settings.values()]
        one = next(p for p in each if p is not None)
        values = [_number(p.value) if p is not None else "–" for p in each]
        rows.append((name, *values, one.unit, one.doc))
    columns = range(1, 1 + len(settings))
    yield html.table("As they were", ("name", *settings, "unit", "meaning"), rows, [*columns])


def _made(runs: Mapping[str, Trajectory], command: str) -> Iterator[str]:
    """Call and versions."""
    yield html.code(command)
    programs = ("symfric", "casadi", "numpy")
    rows = [(name, version(name)) for name in programs]
    rows += [("Python", python_version()), ("platform", platform())]
    yield html.table("Versions", ("what", ""), rows)


def _number(value: Any) -> str:
    """Six digits; an expression unchanged."""
    return f"{value:.6g}" if isinstance(value, int | float | np.floating) else str(value)
