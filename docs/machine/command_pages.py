"""The reference of the command line, from the commands themselves."""

import re
from typing import Any

import typer

from docs.machine import rst
from docs.machine.docstrings import text as sentence
from docs.machine.docstrings import to_rst
from docs.machine.names import linked
from symfric.cli.app import app
from symfric.cli.commands import COMMANDS, argument_shown, arguments, is_option, prose_and_examples


def page() -> str:
    """All commands with their arguments and options."""
    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="symfric")
    text = rst.title("Command line")
    text += "Names and units are those of Python. Exit status 0: done; 1: a solve failed, what "
    text += "there is so far is written; 2: bad input; 130: Ctrl-C.\n\n"
    rows = [[f"`symfric {name}`_", rst.plain(said)] for name, said in COMMANDS.items()]
    text += rst.table(["command", "what it does"], rows)
    for name in COMMANDS:
        text += section(name, group.get_command(context, name))  # pyright: ignore
    return text


def section(name: str, command: Any) -> str:
    """One command."""
    text = f".. _symfric-{name}:\n\n" + rst.title(f"symfric {name}", "-")
    positional, named = arguments(command), [p for p in command.params if is_option(p)]
    words = [argument_shown(p) for p in positional]
    text += rst.literal(" ".join([f"symfric {name}", *words, "[OPTIONS]"]), "text")
    prose, examples = prose_and_examples(command.help or "")
    text += to_rst(flagged(prose), linked, formulas=False)
    if examples:
        text += rst.literal("\n".join(f"$ {line}" for line in examples), "console")
    if positional:
        rows = [[rst.code(argument_shown(p)), sentence(flagged(p.help or ""))] for p in positional]
        text += rst.table(["argument", "meaning"], rows)
    rows = [
        [rst.code(_option(p)), sentence(flagged(p.help or "")), _default(p)]
        for p in named
        if not getattr(p, "hidden", False)
    ]
    return text + rst.table(["option", "meaning", "default"], rows, "options")


FLAG = re.compile(r"(?<![\w-])(--?[a-z][\w-]*(?:[= ][A-Z]{2,}\b|=[\w.=]+)?)")


def flagged(text: str) -> str:
    """Words in which options stand as code, so that no line ends behind their hyphens."""
    parts = text.split("`")  # what stands between backticks is code already
    return "`".join(FLAG.sub(r"`\1`", p) if k % 2 == 0 else p for k, p in enumerate(parts))


def _option(parameter: Any) -> str:
    flag = ", ".join([*parameter.opts, *parameter.secondary_opts])
    value = "" if parameter.is_flag else f" {parameter.metavar or 'VALUE'}"
    return flag + value


def _default(parameter: Any) -> str:
    if parameter.required:
        return "required"
    value = parameter.default
    if value is None or value is False or value in ((), [], ""):
        return ""
    return rst.code(str(getattr(value, "value", value)))
