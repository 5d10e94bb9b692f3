"""Run the blocks of a page in a folder: `python -m docs.machine.run PAGE FOLDER`."""

import ast
import os
import shlex
import subprocess
import sys
import traceback
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

from docs.machine.pages import ROOT, Block, blocks, commands
from symfric.cli.app import main as symfric


def run(
    page: Iterable[Block],
    name: str,
    changed: ast.NodeTransformer | None = None,
    known: Mapping[str, object] | None = None,
) -> Iterator[tuple[str, str, str]]:
    """Run the blocks of a page; each piece of code with what it printed and what the page says.

    Code that the page gives no output for has "" there, and prints nothing if it is Python.

    Args:
        page: its blocks.
        name: of the page, in tracebacks.
        changed: what is done to its Python before it runs; as it is by default.
        known: names that its Python finds there.
    """
    names: dict[str, object] = {"__name__": "__main__", **(known or {})}
    for block in page:
        if block.language == "python":
            printed = StringIO()
            tree = ast.parse("\n" * block.line + block.body, name)
            if changed is not None:
                tree = ast.fix_missing_locations(changed.visit(tree))
            code = compile(tree, name, "exec")
            with redirect_stdout(printed):
                exec(code, names)
            yield block.body, printed.getvalue(), block.prints or ""
        elif block.language == "console":
            for command, expected in commands(block):
                yield command, output(command), expected or "..."


def output(command: str) -> str:
    """What a line of a console prints: `symfric` here and now, all else in a shell."""
    if not command.startswith("symfric ") or set(command) & set("|><&;*`"):
        return in_shell(command)
    printed = StringIO()
    with redirect_stdout(printed), redirect_stderr(printed), warnings.catch_warnings():
        warnings.simplefilter("default")
        symfric(shlex.split(command)[1:])
    return printed.getvalue()


def in_shell(command: str) -> str:
    """Run in a shell that knows `python` and `symfric` as the ones that run here."""
    python = shlex.quote(sys.executable)
    tools = f'python() {{ {python} "$@"; }}; symfric() {{ {python} -m symfric_command "$@"; }}; '
    done = subprocess.run(
        ["bash", "-c", tools + command],
        env=os.environ
        | {"PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return done.stdout


def main(page: Path, folder: Path) -> int:
    """Run `page` in `folder` for the pictures that it leaves there; 0 when it went well."""
    page = page.resolve()
    os.chdir(folder)
    try:
        for _ in run(blocks(page.read_text("utf-8")), str(page)):
            pass
    except Exception:  # noqa: BLE001  (whatever a page may raise, said with its line)
        traceback.print_exc()
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
