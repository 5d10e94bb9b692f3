"""Command line application: its commands, and the conversion of errors to exit statuses.

The options of a command are the parameters of its function; `options.toml` contains their forms and
meanings. Typer parses the line, but its conversions and messages are not used. The conversions load
pydantic, which takes longer than a simulation. The messages name neither the value nor a remedy;
the classes of Typer's errors distinguish them, but are not exported.
"""

import os
import sys
import tomllib
import warnings
from collections.abc import Callable, Sequence
from errno import ENOSPC
from functools import partial, wraps
from importlib import import_module
from inspect import Parameter, Signature, cleandoc, signature
from io import TextIOWrapper
from pathlib import Path
from re import search, sub
from types import TracebackType
from typing import Annotated, Any, cast, get_args, get_origin, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup

from symfric import SolveError, Status, __version__
from symfric.foundation.programs import ProgramError

MODULES = dict.fromkeys(("bench", "gallery", "stress"), "campaigns") | {"report": "run"}
"""Command -> name of its module, if the names differ."""

SETTINGS: dict[str, Any] = {
    "pretty_exceptions_enable": False,
    "rich_markup_mode": None,  # units in brackets are not markup
    "context_settings": {"help_option_names": ["-h", "--help"]},
}

EXAMPLE = "Example: "
WIDTH = 78
"""Largest width of an example [columns]."""


TEXTS = tomllib.loads(Path(__file__).with_name("options.toml").read_text(encoding="utf-8"))
"""Commands, and form, meaning and completion of each parameter of each command."""

COMMANDS: dict[str, str] = TEXTS["commands"]
"""Command -> first line of its help."""


def declared(function: Callable[..., None]) -> Callable[..., None]:
    """Return the function of a command with parameters for Typer, which accept texts."""
    own, command = TEXTS.get(function.__name__, {}), function.__name__.replace("_", "-")
    module, hints = vars(sys.modules[function.__module__]), get_type_hints(function)
    completions = vars(import_module("symfric.cli.completions"))
    parameters, where = list[Parameter](), dict[str, str]()
    for p in signature(function).parameters.values():
        form, meaning, *completion = own.get(p.name) or TEXTS["all"][p.name]
        flags = [word for word in form.split() if word.startswith("--")]
        several = list in (get_origin(hints[p.name]), *map(get_origin, get_args(hints[p.name])))
        where[p.name] = f"{command}: {flags[0] if flags else form}"
        default: Any = (typer.Option if flags else typer.Argument)(
            ... if p.default is p.empty else p.default,
            *flags,
            metavar=form.removeprefix(" ".join(flags)).strip() or None,
            help=sub(
                r"\{(\w+)\}", lambda name: ", ".join(module[name[1]]), " ".join(meaning.split())
            ),
            autocompletion=completions[completion[0]] if completion else None,
        )
        kind = list[str] if several else bool if hints[p.name] is bool else str
        parameters.append(p.replace(default=default, annotation=kind))

    @wraps(function)
    def call(**texts: Any) -> None:
        function(**{name: converted(where[name], hints[name], t) for name, t in texts.items()})

    call.__annotations__ = {p.name: p.annotation for p in parameters}
    vars(call)["__signature__"] = Signature(parameters)
    return call


def converted(where: str, hint: Any, value: Any) -> Any:
    """Return a text of the command line, converted to the type `hint`."""
    kind = next((k for k in (int, float, Path) if k in (hint, *get_args(hint))), str)
    try:
        return kind(value) if isinstance(value, str) else value
    except ValueError:
        what = "a whole number" if kind is int else "a number"
        raise ValueError(f"{where}: expected {what}, got '{value}'") from None


def unconverted(command: Any) -> Any:
    """Return a command of Typer whose parameters do not convert their values."""
    for parameter in command.params:
        parameter.process_value = partial(_processed, parameter, parameter.process_value)
    return command


def _processed(parameter: Any, process: Callable[..., Any], context: Any, value: Any) -> Any:
    """Return a value unchanged; let Typer refuse missing values and call callbacks of options."""
    needed = bool(value) if parameter.callback else parameter.required and not value
    return process(context, value) if needed else value


class Commands(TyperGroup):
    """Command group that imports only the module of the called command."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        known: dict[str, Any] = dict.fromkeys(COMMANDS)
        self.commands = known

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command of this name, or None if there is none."""
        if cmd_name not in COMMANDS:
            return None
        one = typer.Typer(add_completion=False, **SETTINGS)
        name = cmd_name.replace("-", "_")
        module = import_module(f"symfric.cli.{MODULES.get(name, name)}")
        one.command(cls=Command)(declared(getattr(module, name)))
        return unconverted(typer.main.get_command(one))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that the first word names; suggest a name for an unknown word."""
        if not (args[0] in COMMANDS or ctx.resilient_parsing or args[0].startswith("-")):
            from symfric.foundation.checks import check_names  # noqa: PLC0415  (slow to import)

            check_names("command", args[:1], COMMANDS)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the table of commands."""
        with formatter.section("Commands"):
            formatter.write_dl([*COMMANDS.items()])


class Command(TyperCommand):
    """Command whose help ends with examples to copy."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the words of the usage line that follow the name of the command."""
        return ["[OPTIONS]", *(argument_shown(p) for p in arguments(self))]

    def format_help_text(self, ctx: Any, formatter: Any) -> None:
        """Write the description of the command."""
        formatter.write_paragraph()
        with formatter.indentation():
            formatter.write_text(prose_and_examples(self.help or "")[0])

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the lists of arguments and options."""
        positional = [(argument_shown(p), p.help or "") for p in arguments(self)]
        if positional:
            with formatter.section("Arguments"):
                formatter.write_dl(positional)
        named = [p.get_help_record(ctx) for p in self.get_params(ctx) if is_option(p)]
        with formatter.section("Options"):
            formatter.write_dl([record for record in named if record is not None])

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the examples."""
        with formatter.section("Examples"):
            for line in prose_and_examples(self.help or "")[1]:
                formatter.write(f"{continued(line, formatter.current_indent)}\n")


def is_option(parameter: Any) -> bool:
    """Return True if a parameter of a command is an option, False if it is an argument."""
    return parameter.opts[0].startswith("-")


def arguments(command: Any) -> list[Any]:
    """Return the positional arguments of a command."""
    return [p for p in command.params if not is_option(p)]


def argument_shown(parameter: Any) -> str:
    """Return an argument as the usage line shows it: SCENE, or [NAME] if it is optional."""
    name = parameter.metavar + "..." * (parameter.nargs == -1)
    return name if parameter.required else f"[{name}]"


def prose_and_examples(text: str) -> tuple[str, list[str]]:
    """Return the prose and the example lines of the docstring of a command."""
    paragraphs = cleandoc(text).split("\n\n")
    examples = [" ".join(p.split())[len(EXAMPLE) :] for p in paragraphs if p.startswith(EXAMPLE)]
    return "\n\n".join(p for p in paragraphs if not p.startswith(EXAMPLE)), examples


def continued(line: str, indent: int) -> str:
    """Return a shell command wrapped before options, with backslashes at the line ends."""
    start, *rest = line.split(" --")
    rows = [" " * indent + start]
    for option in rest:
        if len(rows[-1]) + len(option) + len(" -- \\") > WIDTH:
            rows[-1] += " \\"
            rows.append(" " * (indent + 3))
        rows[-1] += f" --{option}"
    return "\n".join(rows)


BAD_INPUT, FAILED_SOLVE, INTERRUPTED = 2, 1, 130

app = typer.Typer(
    cls=Commands,
    help="Friction laws from formula to simulation, identification, optimal control and C.",
    epilog="Exit status: 0: success; 1: a solve or a verification failed, partial results are "
    "written; 2: invalid request, nothing is written; 130: interrupted, otherwise as 1.",
    **SETTINGS,
)


@app.callback(invoke_without_command=True)
def symfric(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
) -> None:
    """Print the version on request, or the help if no command is given."""
    if version:
        typer.echo(f"symfric {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


UsageError = cast("type[typer.BadParameter]", typer.BadParameter.__mro__[2])
"""Base class of all usage errors."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status.

    0: success; 1: a solve failed (partial results are written); 2: bad input; 130: Ctrl-C. Every
    error is printed as one sentence on standard error, or raised if SYMFRIC_DEBUG is set.
    """
    debug = bool(os.environ.get("SYMFRIC_DEBUG"))
    if arguments is None:
        prepare_process(debug)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning
            command = unconverted(typer.main.get_command(app))
            status = command.main(arguments, prog_name="symfric", standalone_mode=False)
        if status == INTERRUPTED:  # Typer's silent status after Ctrl-C
            raise KeyboardInterrupt
        return status if isinstance(status, int) else 0
    except (
        KeyboardInterrupt, typer.Abort, SolveError, ValueError, OSError, MemoryError, ProgramError,
        UsageError,
    ) as error:  # fmt: skip
        if debug:
            raise
        typer.echo(f"symfric: {sentence(error)}", err=True)
        if isinstance(error, SolveError):
            return INTERRUPTED if error.status is Status.INTERRUPTED else FAILED_SOLVE
        return INTERRUPTED if isinstance(error, KeyboardInterrupt | typer.Abort) else BAD_INPUT


def prepare_process(debug: bool) -> None:
    """Configure a process that runs only this command line."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")
    if not debug:
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


def sentence(error: BaseException) -> str:
    """Return the message of `error` on one line."""
    if isinstance(error, KeyboardInterrupt | typer.Abort):
        return "interrupted"
    if isinstance(error, OSError) and error.errno == ENOSPC:
        place = f" for '{error.filename}'" if error.filename is not None else ""
        return f"expected free disk space, got none{place}; free some, or set TMPDIR elsewhere"
    if isinstance(error, OSError) and error.filename is not None:
        return f"'{error.filename}': {error.strerror}"
    if isinstance(error, MemoryError):
        return "expected a task that fits into memory, got a larger one; request fewer --samples"
    text = usage_sentence(error) if isinstance(error, UsageError) else str(error)
    return " ".join(text.split()).removesuffix(".")


def usage_sentence(error: Any) -> str:
    """Return `<command>: expected <what>, got <value>; <hint>` for a usage error."""
    kind, option = type(error).__name__, getattr(error, "option_name", "")
    if kind == "BadOptionUsage":  # Typer does not report the command here
        least = "requires" in error.message
        return (
            f"{option}: expected {'a' if least else 'no'} value, got {'none' if least else 'one'}"
        )
    if error.ctx is None:
        return error.format_message()
    where, hint = error.ctx.info_name, f"see {error.ctx.command_path} -h"
    if kind == "MissingParameter":
        p = error.param
        missing = f"{p.opts[0]} {p.metavar}" if is_option(p) else argument_shown(p)
        return f"{where}: expected {missing}, got none; {hint}"
    if kind == "NoSuchOption":
        close = ", ".join(error.possibilities or ())
        offer = f"did you mean {close}?" if close else hint
        return f"{where}: expected an option of it, got {option}; {offer}"
    extra = search(r"unexpected extra argument(?:\(s\)|s)? \((.*)\)", error.message)
    if extra:
        again = "; repeat the option for each NAME=VALUE" if "=" in extra[1] else f"; {hint}"
        return f"{where}: expected no other argument, got {extra[1]}{again}"
    return error.format_message()
