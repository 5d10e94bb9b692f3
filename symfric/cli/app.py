"""The commands put together, and how errors become exit statuses."""

import os
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper
from types import TracebackType
from typing import Annotated, Any, cast

import typer
from typer.core import TyperGroup

from symfric import SolveError, Status, __version__
from symfric.foundation.programs import ProgramError

BAD_INPUT, FAILED_SOLVE, INTERRUPTED = 2, 1, 130

# Of all usage errors Typer exports only BadParameter; this is what they derive from.
USAGE_ERROR = cast("type[typer.BadParameter]", typer.BadParameter.__mro__[2])

COMMANDS = {
    "laws": "List the friction laws, or show one in full.",
    "scenes": "List the scenes, or show one in full.",
    "run": "Simulate SCENE with a friction law.",
    "report": "Simulate SCENE and write one page: signals, friction, error, laws.",
    "identify": "Fit friction laws to measured data, and say what they are worth.",
    "codegen": "Write a friction law, a plant or inverse dynamics as C99, and verify it.",
    "export-fmu": "Write a scene or a model as a Functional Mock-up Unit.",
    "ocp": "Solve an optimal control problem and check it.",
    "select": "Rank friction laws on a machine, and say which to take.",
    "demo": "Simulate, identify, optimise and generate C.",
    "gallery": "Compute the figures of the papers again.",
    "bench": "Measure symfric beside other integrators.",
    "stress": "Judge runs of random laws in random scenes.",
}
"""What there is, and the first line of each; a command is loaded when it is called."""


class Commands(TyperGroup):
    """Loads the command that is called, and none for a list of them."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        known: dict[str, Any] = dict.fromkeys(COMMANDS)
        self.commands = known  # for what was meant

    def list_commands(self, ctx: Any) -> list[str]:
        """Their names, in the order of the help."""
        return [*COMMANDS]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of that name, None where there is no such one."""
        if cmd_name not in COMMANDS:
            return None
        one = typer.Typer(**SETTINGS)
        name = cmd_name.replace("-", "_")
        one.command()(getattr(import_module(f"symfric.cli.{name}"), name))
        return typer.main.get_command(one)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the table of commands into a help text."""
        with formatter.section("Commands"):
            formatter.write_dl([*COMMANDS.items()])


SETTINGS: dict[str, Any] = {
    "add_completion": False,
    "pretty_exceptions_enable": False,
    "rich_markup_mode": None,  # units in brackets are not markup
    "context_settings": {"help_option_names": ["-h", "--help"]},
}
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
    except (ValueError, OSError, MemoryError, ProgramError, USAGE_ERROR) as error:
        return _refuse(error, BAD_INPUT)


def _refuse(error: BaseException, status: int) -> int:
    """Say `error` in one sentence and return `status`."""
    if os.environ.get("SYMFRIC_DEBUG"):
        raise error
    typer.echo(f"symfric: {sentence(error)}", err=True)
    return status


def sentence(error: BaseException) -> str:
    """The message of `error` on one line."""
    if isinstance(error, OSError) and error.filename is not None:
        return f"'{error.filename}': {error.strerror}"
    if isinstance(error, MemoryError):
        return "expected a task that fits into memory, got a larger one; ask for fewer --samples"
    text = error.format_message() if isinstance(error, USAGE_ERROR) else str(error)
    text = " ".join(text.split()).removesuffix(".")
    return text.replace(". Did you mean", "; did you mean")


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
