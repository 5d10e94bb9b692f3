"""Output of the commands: tables and notes for users, JSON for programs."""

import json
import math
import os
import shlex
import sys
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from symfric.foundation.files import json_data, write_text

EXACT = 12
"""Significant digits of numbers that a user may enter again."""
UNLIMITED = 100_000
"""Width of tables in files and pipes [columns], where cells are never wrapped."""
GAP = 3
"""Blanks between the columns of a table."""


def number(value: float, digits: int = 6) -> str:
    """Return a number rounded to significant digits, or a dash if it is not finite."""
    return f"{value:.{digits}g}" if math.isfinite(value) else "-"


def show_table(
    columns: Sequence[str], rows: Iterable[Sequence[str | float]], title: str = "", digits: int = 6
) -> None:
    """Print a table on standard output, with numbers right-aligned and rounded to `digits`.

    Cells and column titles wrap at the width of the terminal, or at COLUMNS if that is set. In
    files and pipes, every row is one line.
    """
    rows, console = [list(row) for row in rows], Console(highlight=False)
    if not (console.is_terminal or "COLUMNS" in os.environ):
        console.width = UNLIMITED
    table = Table(
        title=Text(title) if title else None,
        title_justify="left",
        box=SIMPLE_HEAD,
        pad_edge=False,
        show_edge=False,
    )
    texts = [[c if isinstance(c, str) else number(c, digits) for c in row] for row in rows]
    widths = column_widths([columns, *texts], console.width)
    for index, (name, width) in enumerate(zip(columns, widths, strict=True)):
        numeric = bool(rows) and all(isinstance(row[index], int | float) for row in rows)
        side = "right" if numeric else "left"
        table.add_column(Text(name), justify=side, width=width, overflow="fold")
    for row in texts:
        table.add_row(*map(Text, row))
    with console.capture() as drawn:
        console.print(table)
    typer.echo("\n".join(line.rstrip() for line in drawn.get().splitlines()))


def show_part(
    columns: Sequence[str], rows: Sequence[Sequence[str | float]], digits: int = 6
) -> None:
    """Print a table and an empty line, unless there are no rows."""
    if rows:
        show_table(columns, rows, digits=digits)
        show()


def column_widths(rows: Sequence[Sequence[str]], total: int) -> list[int]:
    """Return the widths of the columns of `rows` in a table of `total` width, if possible.

    Every column is at least as wide as its longest word; the columns share the remaining width.
    """
    cells = list(zip(*rows, strict=True))
    widths = [max((len(w) for text in column for w in text.split()), default=0) for column in cells]
    lacking = [max(map(len, column)) - w for column, w in zip(cells, widths, strict=True)]
    rest = total - sum(widths) - GAP * (len(widths) - 1)
    for k, index in enumerate(sorted(range(len(widths)), key=lambda i: lacking[i])):
        share = min(lacking[index], max(rest, 0) // (len(widths) - k))
        widths[index] += share
        rest -= share
    return widths


def show(text: str = "") -> None:
    """Print `text` on standard output, wrapped at the width of the terminal."""
    Console(highlight=False, markup=False).print(text)


def show_doc(text: str) -> None:
    """Print a docstring with equations unchanged and paragraphs wrapped at the terminal width."""
    paragraph: list[str] = []
    for line in [*text.splitlines(), ""]:
        kept = not line or line.startswith(" ")
        if paragraph and (kept or line.startswith(("Defaults:", "Limits:", "Source:", "Checked:"))):
            show(" ".join(paragraph))
            paragraph = []
        if kept:
            typer.echo(line)
        else:
            paragraph.append(line)


@contextmanager
def progress(text: str) -> Generator[Callable[..., None]]:
    """Show a progress bar on a terminal; yield a function whose last argument is the fraction."""
    if not sys.stderr.isatty():
        yield lambda *of: None
        return
    from rich.progress import Progress  # noqa: PLC0415  (for terminals only)

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(text, total=1.0)
        yield lambda *of: bar.update(task, completed=of[-1])


def note(text: str) -> None:
    """Print `text` on standard error."""
    typer.echo(text, err=True)


def emit_json(content: Mapping[str, Any], destination: str | Path | None) -> None:
    """Write `content` as one JSON object to a file, or to standard output for "-"."""
    if destination is None:
        return
    text = json.dumps(json_data(content), indent=2, allow_nan=False, ensure_ascii=False)
    if destination == "-":
        typer.echo(text)
    else:
        write_text(destination, text + "\n")


def finish(
    content: Mapping[str, Any],
    json: str | None,
    show: Callable[[], None],
    *files: tuple[Path | None, Callable[..., object] | None],
) -> None:
    """Write files and JSON, call `show` unless JSON goes to standard output, and print file names.

    Args:
        content: content of the JSON.
        json: file of the JSON, or "-" for standard output.
        show: function that prints the result.
        files: requested files, each with the function `write(path=...)`; None if it is written.
    """
    for path, write in files:
        if path is not None and write is not None:
            write(path=path)
    emit_json(content, json)
    if json != "-":
        show()
    say_written(*(path for path, _ in files), json)


def say_written(*paths: str | Path | None) -> None:
    """Print the names of written files on standard error."""
    names = [str(path) for path in paths if path is not None and str(path) != "-"]
    if names:
        note(f"wrote {', '.join(names)}")


def command_line() -> str:
    """Return the command line of this process as one text, for pages."""
    # in the C locale, Python represents bytes that it cannot decode as lone surrogates
    return os.fsencode(shlex.join(["symfric", *sys.argv[1:]])).decode(errors="replace")
