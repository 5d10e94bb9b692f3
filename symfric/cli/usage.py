"""What is wrong with a line that cannot be read, in the shape of all other errors.

Typer's sentences name neither the value nor the way out ("Input should be a valid number, unable to
parse string as a number"). Which mistake it is they tell by their classes, which are not exported.
"""

from re import search
from typing import Any, cast

import typer

from symfric.cli.commands import argument_shown, is_option

UsageError = cast("type[typer.BadParameter]", typer.BadParameter.__mro__[2])
"""What all errors of usage derive from."""


def sentence(error: Any) -> str:
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
        return f"{where}: expected {_shown(error.param)}, got none; {hint}"
    if kind == "BadParameter" and error.param is not None:
        what = "a whole number" if "integer" in error.message else "a number"
        return f"{where}: {error.param.opts[0]}: expected {what}, got '{_value(error)}'"
    if kind == "NoSuchOption":
        close = ", ".join(error.possibilities or ())
        offer = f"did you mean {close}?" if close else hint
        return f"{where}: expected an option of it, got {option}; {offer}"
    extra = search(r"unexpected extra argument(?:\(s\)|s)? \((.*)\)", error.message)
    if extra:
        again = "; repeat the option for each NAME=VALUE" if "=" in extra[1] else f"; {hint}"
        return f"{where}: expected no other argument, got {extra[1]}{again}"
    return error.format_message()


def _shown(parameter: Any) -> str:
    if is_option(parameter):
        return f"{parameter.opts[0]} {parameter.metavar}"
    return argument_shown(parameter)


def _value(error: Any) -> str:
    """What was given, from the sentence or from the error behind it."""
    told = search(r"^'(.*)' is not", error.message)
    return told[1] if told else str(error.__cause__.errors()[0]["input"])
