"""The commands put together, and how errors become exit statuses.

Typer's sentences about a line that cannot be read name neither the value nor the way out ("Input
should be a valid number, unable to parse string as a number"). Which mistake it is they tell by
their classes, which are not exported.
"""

import os
import sys
import warnings
from collections.abc import Sequence
from errno import ENOSPC
from io import TextIOWrapper
from re import search
from types import TracebackType
from typing import Annotated, Any, cast

import typer

from symfric import SolveError, Status, __version__
from symfric.cli.commands import SETTINGS, Commands, argument_shown, is_option
from symfric.foundation.programs import ProgramError

BAD_INPUT, FAILED_SOLVE, INTERRUPTED = 2, 1, 130

COMPLETED: dict[str, Any] = {"add_completion": True}
app = typer.Typer(
    cls=Commands,
    help="Friction laws from formula to simulation, identification, optimal control and C.",
    epilog="Exit status: 0 done; 1 a solve or a proof failed, what there is is written; 2 what is "
    "asked for cannot be done as it stands, nothing is written; 130 interrupted, otherwise as 1.",
    **SETTINGS | COMPLETED,
)


@app.callback(invoke_without_command=True)
def symfric(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
) -> None:
    """Show the version, or what there is when no command is given."""
    if version:
        typer.echo(f"symfric {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status.

    0: done; 1: a solve failed (what there is so far is written); 2: bad input; 130: Ctrl-C. Every
    error is one sentence on standard error. With SYMFRIC_DEBUG set, errors are raised instead.
    """
    if arguments is None:
        _prepare_process()
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning
            command = typer.main.get_command(app)
            status = command.main(arguments, prog_name="symfric", standalone_mode=False)
        if status == INTERRUPTED:  # what Typer makes of Ctrl-C, without a word
            return _refuse(KeyboardInterrupt("interrupted"), INTERRUPTED)
        return status if isinstance(status, int) else 0
    except SolveError as error:
        interrupted = error.status is Status.INTERRUPTED
        return _refuse(error, INTERRUPTED if interrupted else FAILED_SOLVE)
    except (KeyboardInterrupt, typer.Abort):
        return _refuse(KeyboardInterrupt("interrupted"), INTERRUPTED)
    except (ValueError, OSError, MemoryError, ProgramError, UsageError) as error:
        return _refuse(error, BAD_INPUT)


def _refuse(error: BaseException, status: int) -> int:
    """Say `error` in one sentence and return `status`."""
    if os.environ.get("SYMFRIC_DEBUG"):
        raise error
    typer.echo(f"symfric: {sentence(error)}", err=True)
    return status


def sentence(error: BaseException) -> str:
    """The message of `error` on one line."""
    if isinstance(error, OSError) and error.errno == ENOSPC:
        place = f" for '{error.filename}'" if error.filename is not None else ""
        return (
            f"expected room on the disk, got none left{place}; free some, or set TMPDIR elsewhere"
        )
    if isinstance(error, OSError) and error.filename is not None:
        return f"'{error.filename}': {error.strerror}"
    if isinstance(error, MemoryError):
        return "expected a task that fits into memory, got a larger one; ask for fewer --samples"
    text = usage_sentence(error) if isinstance(error, UsageError) else str(error)
    return " ".join(text.split()).removesuffix(".")


def _prepare_process() -> None:
    """Settings of a process that is nothing but this command line."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")
    if not os.environ.get("SYMFRIC_DEBUG"):
        sys.excepthook = _report_defect


def _show_warning(message: Warning | str, category: type[Warning], *_: object) -> None:
    typer.echo(f"symfric: warning: {' '.join(str(message).split())}", err=True)


def _report_defect(
    kind: type[BaseException], error: BaseException, _: TracebackType | None
) -> None:
    text = " ".join(str(error).split())
    typer.echo(
        f"symfric: internal error, {kind.__name__}: {text}; "
        "set SYMFRIC_DEBUG=1 to see where, and please report it",
        err=True,
    )


UsageError = cast("type[typer.BadParameter]", typer.BadParameter.__mro__[2])
"""What all errors of usage derive from."""


def usage_sentence(error: Any) -> str:
    """`<command>: expected <what>, got <value>; <hint>`."""
    kind, option = type(error).__name__, getattr(error, "option_name", "")
    if kind == "BadOptionUsage":  # of which Typer does not tell the command
        least = "requires" in error.message
        return (
            f"{option}: expected {'a' if least else 'no'} value, got {'none' if least else 'one'}"
        )
    if error.ctx is None:
        return error.format_message()
    where, hint = error.ctx.info_name, f"see {error.ctx.command_path} -h"
    if kind == "MissingParameter":
        return f"{where}: expected {_parameter_shown(error.param)}, got none; {hint}"
    if kind == "BadParameter" and error.param is not None:
        what = "a whole number" if "integer" in error.message else "a number"
        return f"{where}: {error.param.opts[0]}: expected {what}, got '{_value_given(error)}'"
    if kind == "NoSuchOption":
        close = ", ".join(error.possibilities or ())
        offer = f"did you mean {close}?" if close else hint
        return f"{where}: expected an option of it, got {option}; {offer}"
    extra = search(r"unexpected extra argument(?:\(s\)|s)? \((.*)\)", error.message)
    if extra:
        again = "; repeat the option for each NAME=VALUE" if "=" in extra[1] else f"; {hint}"
        return f"{where}: expected no other argument, got {extra[1]}{again}"
    return error.format_message()


def _parameter_shown(parameter: Any) -> str:
    if is_option(parameter):
        return f"{parameter.opts[0]} {parameter.metavar}"
    return argument_shown(parameter)


def _value_given(error: Any) -> str:
    """What was given, from the sentence or from the error behind it."""
    told = search(r"^'(.*)' is not", error.message)
    return told[1] if told else str(error.__cause__.errors()[0]["input"])
