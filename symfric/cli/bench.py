"""`symfric bench`: run time against error, as ratios measured in one run."""

from pathlib import Path
from typing import Annotated

import typer

from symfric.cli import bench_tables, output
from symfric.cli.options import JsonOption, PlotOption, check_outputs
from symfric.foundation.parameters import check_names

SUBJECTS = ("integrator", "calls", "ensemble", "multibody", "ivp", "jitter", "regularisation")


def bench(
    subject: Annotated[
        str, typer.Argument(help=f"What to measure: {', '.join(SUBJECTS)}.")
    ] = "integrator",
    quick: Annotated[bool, typer.Option("--quick", help="Fewer points, fewer others.")] = False,
    links: Annotated[
        str | None,
        typer.Option("--links", metavar="N,N,...", help="Lengths of chains; multibody only."),
    ] = None,
    plot: PlotOption = None,
    csv: Annotated[
        Path | None,
        typer.Option("--csv", metavar="FILE.csv", help="Runs of multibody, regularisation."),
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
    against dry friction, over their width or stiffness.

    Example: symfric bench multibody --plot bench.png --csv runs.csv
    """
    check_names("bench", [subject], SUBJECTS)
    only = (("--links", links, ("multibody",)), ("--csv", csv, ("multibody", "regularisation")))
    given = [o for o, value, where in only if value is not None and subject not in where]
    if given:
        raise ValueError(f"bench {subject}: expected no {', '.join(given)}, got one")
    check_outputs(json, csv, picture=plot)
    if subject == "integrator":
        _integrator(quick, plot, json)
    elif subject == "calls":
        _calls(quick, plot, json)
    elif subject == "ensemble":
        _ensemble(quick, plot, json)
    elif subject == "multibody":
        _multibody(quick, links, plot, csv, json)
    elif subject == "ivp":
        _ivp(quick, plot, json)
    elif subject == "regularisation":
        _regularisation(quick, plot, csv, json)
    else:
        _jitter(quick, plot, json)
    output.say_written(plot, csv, json)


def _integrator(quick: bool, plot: Path | None, json: str | None) -> None:
    from symfric.bench import bench_integrator  # noqa: PLC0415  (only this command needs it)

    with output.progress("measuring") as tell:
        result = bench_integrator(quick=quick, progress=lambda _, fraction: tell(fraction))
    if plot:
        result.plot(plot)
    output.emit_json(result.to_dict(), json)
    if json != "-":
        bench_tables.integrator(result)


def _calls(quick: bool, plot: Path | None, json: str | None) -> None:
    from symfric.bench import bench_calls  # noqa: PLC0415  (only this command needs it)

    if plot:
        raise ValueError("bench calls: expected no --plot, got one; it is a table")
    with output.progress("measuring") as tell:
        result = bench_calls(quick=quick, progress=lambda _, fraction: tell(fraction))
    output.emit_json(result.to_dict(), json)
    if json != "-":
        bench_tables.calls(result)


def _ensemble(quick: bool, plot: Path | None, json: str | None) -> None:
    from symfric.bench import bench_lanes  # noqa: PLC0415  (only this command needs it)

    if plot:
        raise ValueError("bench ensemble: expected no --plot, got one; it is a table")
    with output.progress("measuring") as tell:
        result = bench_lanes(quick=quick, progress=lambda _, fraction: tell(fraction))
    output.emit_json(result.to_dict(), json)
    if json != "-":
        bench_tables.ensemble(result)


def _multibody(
    quick: bool, links: str | None, plot: Path | None, csv: Path | None, json: str | None
) -> None:
    from symfric.bench import bench_multibody  # noqa: PLC0415  (only this command needs it)
    from symfric.bench.chains import SIZES  # noqa: PLC0415

    sizes = lengths(links) if links else SIZES
    with output.progress("measuring") as tell:
        result = bench_multibody(
            quick=quick, links=sizes, progress=lambda _, fraction: tell(fraction)
        )
    if plot:
        result.plot(plot)
    if csv:
        result.write_csv(csv)
    output.emit_json(result.to_dict(), json)
    if json != "-":
        bench_tables.multibody(result)


def _ivp(quick: bool, plot: Path | None, json: str | None) -> None:
    from symfric.bench import bench_ivp  # noqa: PLC0415  (only this command needs it)

    with output.progress("measuring") as tell:
        result = bench_ivp(quick=quick, progress=lambda _, fraction: tell(fraction))
    if plot:
        result.plot(plot)
    output.emit_json(result.to_dict(), json)
    if json != "-":
        bench_tables.ivp(result)


def _jitter(quick: bool, plot: Path | None, json: str | None) -> None:
    from symfric.bench.jitter import SCALES, jitter, plot_jitter  # noqa: PLC0415

    scales = SCALES[1::2] if quick else SCALES
    with output.progress("measuring") as tell:
        data = jitter(scales, progress=lambda _, fraction: tell(fraction))
    if plot:
        plot_jitter(data, plot)
    output.emit_json(data.to_dict(), json)
    if json != "-":
        bench_tables.jitter(data)


def _regularisation(quick: bool, plot: Path | None, csv: Path | None, json: str | None) -> None:
    from symfric.bench import bench_regularisation  # noqa: PLC0415  (only this command needs it)

    with output.progress("measuring") as tell:
        result = bench_regularisation(quick=quick, progress=lambda _, fraction: tell(fraction))
    if plot:
        result.plot(plot)
    if csv:
        result.write_csv(csv)
    output.emit_json(result.to_dict(), json)
    if json != "-":
        bench_tables.regularisation(result)


def lengths(text: str) -> tuple[int, ...]:
    """The numbers of `--links`, increasing.

    Raises:
        ValueError: something else than positive whole numbers with commas between them.
    """
    parts = text.split(",")
    if not all(part.strip().isdigit() and int(part) > 0 for part in parts):
        raise ValueError(f"--links: expected positive whole numbers such as 2,4,8, got '{text}'")
    return tuple(sorted({int(part) for part in parts}))
