"""`symfric bench`: run time against error, as ratios measured in one run."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from symfric.cli import output
from symfric.cli.options import JsonOption, PlotOption, argument, check_outputs, option
from symfric.foundation.parameters import check_names

if TYPE_CHECKING:
    from symfric.bench.table import Table

SUBJECTS = (
    "integrator",
    "calls",
    "ensemble",
    "multibody",
    "ivp",
    "jitter",
    "regularisation",
    "ocp",
    "interop",
    "identification",
    "codegen",
    "embedded",
)
TABLES = ("calls", "ensemble", "embedded", "interop")
"""Subjects without a picture."""


def _completed(incomplete: str) -> list[str]:
    return [subject for subject in SUBJECTS if subject.startswith(incomplete)]


def bench(
    subject: Annotated[
        str,
        argument(
            "SUBJECT", f"What to measure, default integrator: {', '.join(SUBJECTS)}.", _completed
        ),
    ] = "integrator",
    quick: Annotated[bool, option("--quick", "Fewer points, fewer others.")] = False,
    links: Annotated[
        str | None, option("--links N,N,...", "Lengths of chains; multibody only.")
    ] = None,
    plot: PlotOption = None,
    csv: Annotated[
        Path | None, option("--csv FILE.csv", "Runs of multibody, regularisation.")
    ] = None,
    json: JsonOption = None,
) -> None:
    """Measure symfric beside other integrators.

    Time, error and ratios at equal error. integrator: stick-slip of one mass, ensembles and
    derivatives. calls: many short steps, events, gradients, signals, import. ensemble: members side
    by side beside the same one by one, on one core. multibody: mechanisms,
    the cost of their steps, what they do not need, reference numbers. ivp: correct digits on
    problems with published solutions (Test Set for IVP Solvers). jitter: total variation of
    accelerations against law, step and transition velocity. regularisation: error of smooth laws
    against dry friction, over their width or stiffness. ocp: optimal control from many starts,
    whether it lands, large programs, controllers; beside CasADi's Opti and rockit. interop: laws in
    Opti, rockit, do-mpc and CasADi's integrators, as their users write them. identification:
    fits from many starts and noises, their intervals, measured machines, damaged files. codegen:
    generated C beside its goals and CasADi's own. embedded: its instructions and bytes on Cortex-M
    cores, under QEMU.

    Example: symfric bench multibody --plot bench.png --csv runs.csv
    """
    check_names("bench", [subject], SUBJECTS)
    drawn = tuple(name for name in SUBJECTS if name not in TABLES)
    only = (
        ("--links", links, ("multibody",)),
        ("--csv", csv, ("multibody", "regularisation")),
        ("--plot", plot, drawn),
    )
    given = [o for o, value, where in only if value is not None and subject not in where]
    if given:
        raise ValueError(f"bench {subject}: expected no {', '.join(given)}, got one")
    check_outputs(json, csv, picture=plot)
    from symfric import bench as measures  # noqa: PLC0415  (only this command needs it)

    sizes = {"links": lengths(links)} if links else {}
    with output.progress("measuring") as tell:
        result = getattr(measures, f"bench_{subject}")(
            quick=quick, progress=output.unnamed(tell), **sizes
        )
    if plot:
        result.plot(plot)
    if csv:
        result.write_csv(csv)
    output.emit_json(result.to_dict(), json)
    if json != "-":
        show(result.shown())
    output.say_written(plot, csv, json)


def show(shown: "Iterable[Table | str]") -> None:
    """Print tables and sentences."""
    for item in shown:
        if isinstance(item, str):
            output.show(item)
        else:
            output.show_table(item.head, item.rows, item.title)


def lengths(text: str) -> tuple[int, ...]:
    """The numbers of `--links`, increasing.

    Raises:
        ValueError: something else than positive whole numbers with commas between them.
    """
    parts = text.split(",")
    if not all(part.strip().isdigit() and int(part) > 0 for part in parts):
        raise ValueError(f"--links: expected positive whole numbers such as 2,4,8, got '{text}'")
    return tuple(sorted({int(part) for part in parts}))
