"""Which printed numbers of the pages hang on rounding: `python tests/steady.py [PAGE ...]`.

Other interpreters, libraries and processors round otherwise, and error control makes other steps
of it. A page is run again under nudges: tolerances of all simulations a few per cent off, or in
their last bits, and a C library that takes its oldest code for sin and exp. A number that then is
another, or so near to the next one that it soon will be, has more digits than it deserves:

    moved > SAFETY * distance to where its last digit turns over

Counts, as of steps, are for one tolerance: only last bits must leave them alone. The values behind
the texts are known of what the page's own Python formats; of tables and of what commands print,
the texts alone.
"""

import ast
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, final
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from docs.machine.pages import ROOT, agrees, blocks, run, written_pages
from symfric.integrator.methods.attempt import RRow

SAFETY = 0.5
"""A value that moved by more than this share of what would change its last digit is reported."""
OLD_LIBM = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F"}
"""Settings under which glibc's sin, exp, pow round otherwise; others ignore them."""
NUDGES: Mapping[str, tuple[float, Mapping[str, str]]] = {
    "as it is": (1.0, {}),
    "rtol - 3 %": (0.97, {}),
    "rtol + 4 %": (1.04, {}),
    "rtol - 11 %": (0.89, {}),
    "last bits": (1 + 1e-12, {}),
    "old libm": (1 - 3e-13, OLD_LIBM),
}
"""What a page is run under: a factor of all tolerances of simulations, and the environment."""
ROUNDING = 1e-9
"""Factors nearer to one than this leave counts as they are."""
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


@final
@dataclass(frozen=True)
class Piece:
    """What one block of a page printed.

    Attributes:
        code, printed, expected: as `docs.machine.pages.run` tells.
        values: numbers that its Python formatted, each as text and as it is.
    """

    code: str
    printed: str
    expected: str
    values: tuple[tuple[str, float], ...]


@final
@dataclass(frozen=True)
class Finding:
    """A number, or a text, that is not steady.

    Attributes:
        page, code: where.
        what: the text of the number, or of the whole block.
        moved: largest change [1 in its last digit]; NaN where only texts are known.
        room: distance to where the last digit turns over, in the same unit.
        under: the nudge.
    """

    page: str
    code: str
    what: str
    moved: float
    room: float
    under: str

    def __str__(self) -> str:
        if self.moved != self.moved:
            return f"{self.what} ({self.under})"
        size = f"moves by {self.moved:.2g} in its last digit, and turns over at {self.room:.2g}"
        return f"{self.what} {size} ({self.under})"


class _Listening(ast.NodeTransformer):
    """Reports every formatted value to `_heard` with its format."""

    def visit_FormattedValue(self, node: ast.FormattedValue) -> ast.AST:
        self.generic_visit(node)
        if node.conversion != -1:
            return node
        spec = node.format_spec or ast.JoinedStr([])
        heard = ast.Call(ast.Name("_heard", ast.Load()), [node.value, spec], [])
        return ast.FormattedValue(heard, -1, None)


@contextmanager
def nudged(factor: float) -> Generator[None]:
    """Every simulation at tolerances that are `factor` times the requested ones."""
    of, fill = RRow.of, RRow.fill

    def other(t_end: float, rtol: float, h_max: float, atol: Any, d: Any) -> NDArray[np.float64]:
        return of(t_end, rtol * factor, h_max, np.asarray(atol) * factor, d)

    def filled(R: Any, t_end: float, rtol: float, h_max: float, atol: Any, d: Any) -> None:
        fill(R, t_end, rtol * factor, h_max, atol * factor, d)

    with patch.object(RRow, "of", other), patch.object(RRow, "fill", filled):
        yield


def printed(page: Path, factor: float) -> list[Piece]:
    """What the blocks of a page print, run here."""
    heard: list[tuple[str, float]] = []

    def listen(value: Any, spec: str) -> str:
        text = format(value, spec)
        if isinstance(value, float | np.floating) and NUMBER.fullmatch(text.strip()):
            heard.append((text.strip(), float(value)))
        return text

    found = list[Piece]()
    with nudged(factor):
        every = run(blocks(page.read_text("utf-8")), str(page), _Listening(), {"_heard": listen})
        for code, text, expected in every:
            found.append(Piece(code, text, expected, tuple(heard)))
            heard.clear()
    return found


def unit(text: str) -> float:
    """What a one in the last digit of a printed number is worth."""
    digits, _, exponent = text.lower().partition("e")
    behind = len(digits.partition(".")[2])
    return 10.0 ** (int(exponent or 0) - behind)


def findings(page: str, runs: Mapping[str, Sequence[Piece]]) -> list[Finding]:
    """What is not steady between runs of a page, of which the first is the one to compare with.

    Of each number the worst nudge.
    """
    first, *others = runs
    found = list[Finding]()
    for place, piece in enumerate(runs[first]):
        for name in others:
            other = runs[name][place]
            if not agrees(other.printed, piece.expected):
                found += _texts(page, piece, other, name)
            found += _values(page, piece, other, name)
    worst = dict[tuple[str, str], Finding]()
    for one in sorted(found, key=lambda one: one.moved / one.room if one.moved else 0.0):
        worst[one.code, one.what.partition(" is ")[0]] = one
    return [*worst.values()]


def _texts(page: str, piece: Piece, other: Piece, name: str) -> list[Finding]:
    """Numbers that the page does not print any more, or the whole text."""
    nan, here, there = float("nan"), NUMBER.findall(piece.printed), NUMBER.findall(other.printed)
    if len(here) != len(there) or here == there:
        return [Finding(page, piece.code, "the text of a block is another", nan, nan, name)]
    by_rounding = abs(NUDGES[name][0] - 1) < ROUNDING
    pairs = [(a, b) for a, b in zip(here, there, strict=True) if a != b]
    pairs = [(a, b) for a, b in pairs if by_rounding or not a.lstrip("+-").isdigit()]
    return [Finding(page, piece.code, f"{a} is {b}", nan, nan, name) for a, b in pairs]


def _values(page: str, piece: Piece, other: Piece, name: str) -> list[Finding]:
    """Numbers that the page prints and that could soon be others."""
    found = list[Finding]()
    if len(piece.values) != len(other.values):
        return found
    for (text, value), (_, now) in zip(piece.values, other.values, strict=True):
        size = unit(text)
        moved, room = abs(now - value) / size, 0.5 - abs(value - float(text)) / size
        if text in NUMBER.findall(piece.expected) and moved > SAFETY * room:
            found.append(Finding(page, piece.code, text, moved, room, name))
    return found


def runs_of(page: Path) -> dict[str, list[Piece]]:
    """A page under every nudge, each in a process of its own.

    Raises:
        RuntimeError: a block of it fails, as it is on standard error.
    """
    found = dict[str, list[Piece]]()
    for name, (factor, environment) in NUDGES.items():
        with tempfile.TemporaryDirectory() as folder:
            reported = Path(folder) / "values.json"
            command = [sys.executable, __file__, str(page)]
            path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
            done = subprocess.run(
                [*command, "--factor", str(factor), "--to", str(reported)],
                cwd=folder,
                env=os.environ | dict(environment) | {"PYTHONPATH": path},
                check=False,
            )
            if done.returncode:
                raise RuntimeError(f"{page}: expected a page that runs, got the above ({name})")
            read = json.loads(reported.read_text("utf-8"))
            found[name] = [
                Piece(r["code"], r["printed"], r["expected"], tuple(map(tuple, r["values"])))
                for r in read
            ]
    return found


def main(arguments: Sequence[str]) -> int:
    """Tell of pages what is not steady; 0 when all is."""
    options = {a: b for a, b in pairwise(arguments) if a.startswith("--")}
    if "--to" in options:
        pieces = printed(Path(arguments[0]), float(options["--factor"]))
        Path(options["--to"]).write_text(json.dumps([asdict(p) for p in pieces]), "utf-8")
        return 0
    pages = [Path(p).resolve() for p in arguments] or list(written_pages())
    count = 0
    for page in pages:
        name = str(page.relative_to(ROOT))
        found = findings(name, runs_of(page))
        count += len(found)
        print(f"{name}: {'steady' if not found else ''}", *found, sep="\n  ", flush=True)
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
