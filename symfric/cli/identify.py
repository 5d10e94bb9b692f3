"""`symfric identify`: mass, offset and friction of a drive from a measured record."""

from pathlib import Path
from typing import Annotated

import typer

from identification import Errors, Identification, read_data
from identification import identify as identify_drive
from symfric import SolveError, law_from_text
from symfric.cli import output
from symfric.cli.options import (
    JsonOption,
    LawOption,
    PlotOption,
    assignments,
    check_outputs,
    numbers,
)
from symfric.foundation.files import write_text


def identify(
    data: Annotated[
        Path,
        typer.Argument(metavar="DATA", help="CSV with columns t [s], x [m], force [N]; or .mat."),
    ],
    law: LawOption,
    validate: Annotated[
        Path | None, typer.Option("--validate", metavar="DATA2", help="Record for errors only.")
    ] = None,
    normal_force: Annotated[
        float,
        typer.Option(
            "--normal-force",
            help="Normal force [N]; with 1 the coefficients are forces in newtons.",
        ),
    ] = 1.0,
    columns: Annotated[
        list[str] | None,
        typer.Option("--column", metavar="SIGNAL=NAME", help="Column of t, x, force or v."),
    ] = None,
    fixed: Annotated[
        list[str] | None, typer.Option("--fix", metavar="NAME=VALUE", help="Hold a parameter.")
    ] = None,
    free: Annotated[
        list[str] | None, typer.Option("--free", metavar="NAME", help="Fit this one, too.")
    ] = None,
    folds: Annotated[
        int, typer.Option("--folds", help="Pieces for cross-validation; 0 leaves it out.")
    ] = 0,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="FILE.md", help="Write the full report.")
    ] = None,
    plot: PlotOption = None,
    json: JsonOption = None,
) -> None:
    """Identify mass, offset and friction of a drive.

    From measured force and position, with uncertainty and errors on a second record.

    Example: symfric identify record.csv --law asymmetric(coulomb+viscous) --plot friction.png
    """
    check_outputs(report, json, picture=plot)
    names, chosen = assignments("--column", columns), law_from_text(law)
    records = [read_data(path, names) for path in (data, validate) if path is not None]
    with output.progress(f"identify {law}") as tell:
        found = identify_drive(
            records[0],
            chosen,
            validate=records[1] if validate else None,
            normal_force=normal_force,
            free=free or (),
            fixed=numbers("--fix", fixed),
            folds=folds,
            throw=False,
            progress=lambda _, fraction: tell(fraction),
        )
    if report:
        write_text(report, found.report())
    if plot:
        found.plot(plot)
    output.emit_json(found.to_dict(), json)
    if json != "-":
        show_identification(found)
    output.say_written(report, plot, json)
    if not found.status.ok:
        raise SolveError(f"identify {law}: {found.message}", found.status, found)


def show_identification(found: Identification) -> None:
    """Print what was fitted with its 95 % interval, what was held, and the errors."""
    unit_load = float(found.drive.N) == 1.0
    shown = found.parameters | (found.levels if unit_load else {})
    output.show_table(
        ["parameter", "value", "std. error", "95 % +-", "unit", "note"],
        [
            (
                name,
                e.value,
                "" if e.standard_error is None else f"{e.standard_error:.3g}",
                "" if e.half_width is None else f"{e.half_width:.3g}",
                e.unit,
                f"held: {e.note}" if e.fixed else e.note,
            )
            for name, e in shown.items()
        ],
        title=f"{found.law} from {found.errors.data}",
    )
    output.show()
    records = [("estimation", found.errors), ("validation", found.validation)]
    output.show_table(
        ["errors", "force [%]", "force [N]", "position, no feedback [mm]"],
        [(name, *_errors(e)) for name, e in records if e is not None],
    )
    output.show(f"\n{found.message} {found.iterations} iterations.")


def _errors(e: Errors) -> tuple[str, str, str]:
    return f"{e.force_relative:.3g}", f"{e.force_rms:.3g}", f"{1e3 * e.position_rms:.3g}"
