"""A page of each example: what its docstring says, its pictures that are kept, and its code."""

import ast
from pathlib import Path

from docs.machine import rst
from docs.machine.docstrings import first_line, to_rst
from docs.machine.names import linked
from docs.machine.pages import ROOT

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def pages() -> dict[str, str]:
    """Name of each page, relative to `examples`, -> its text."""
    found = {path.stem: page(path) for path in EXAMPLES}
    return found | {"index": index()}


def index() -> str:
    """All examples in a table."""
    text = rst.title("Examples")
    text += (
        f"{len(EXAMPLES)} programs of at most a hundred lines in the folder ``examples``; each "
        "runs in the tests, and writes pictures into the folder that is named behind it.\n\n"
    )
    rows = [[f":doc:`{p.stem}`", rst.plain(first_line(doc(p)))] for p in EXAMPLES]
    return (
        text
        + rst.table(["example", "what it shows"], rows)
        + rst.pages([p.stem for p in EXAMPLES], hidden="")
    )


def page(path: Path) -> str:
    """One example."""
    text = rst.title(path.stem) + to_rst(doc(path), linked, formulas=False)
    picture = ROOT / "examples" / "pictures" / f"{path.stem}.png"
    if picture.exists():
        text += rst.directive("image", f"../../examples/pictures/{picture.name}", alt=path.stem)
    text += rst.title(f"examples/{path.name}", "-")
    return text + rst.literal(code(path), "python")


def doc(path: Path) -> str:
    """The docstring of a program."""
    return ast.get_docstring(ast.parse(path.read_text("utf-8"))) or ""


def code(path: Path) -> str:
    """The program without its docstring."""
    source = path.read_text("utf-8")
    first = ast.parse(source).body[0]
    return "\n".join(source.splitlines()[first.end_lineno or 0 :]).strip() + "\n"
