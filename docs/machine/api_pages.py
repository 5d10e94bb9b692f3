"""The reference of Python, a page for each module that exports names; where names are described."""

import ast
import inspect
import re
from collections.abc import Iterable
from functools import cache
from importlib import import_module
from typing import Any

from docs.machine import rst
from docs.machine.items import MADE_OF_LAWS
from docs.machine.names import FRONTS, Public, catalogue, known, linked, source_of
from docs.machine.rst import first_line, sentence
from symfric import ALL_LAWS, POPULATIONS
from symfric.cli.commands import COMMANDS
from symfric.scenes import ALL_SCENES


def pages() -> dict[str, str]:
    """Name of each page, relative to `reference`, -> its text."""
    return {front: page(front, names) for front, names in catalogue().items() if names}


def index_rows() -> list[list[str]]:
    """Module and subject of each page."""
    return [[f":doc:`{f}`", rst.plain(FRONTS[f])] for f, names in catalogue().items() if names]


def page(front: str, names: list[Public]) -> str:
    """The names of one module: a table, then each in full."""
    text = rst.title(front)
    text += rst.plain(FRONTS[front]) + "\n\n"
    elsewhere = own_pages()
    laws = [p for p in names if elsewhere.get(id(p.object), "").startswith("/laws/")]
    others = sorted((p for p in names if p not in laws), key=lambda p: p.name.lower())
    rows = [[_link(p, elsewhere), sentence(summary(p), linked)] for p in others]
    text += rst.table(["name", "what it is"], rows)
    if laws:
        text += rst.title("Laws", "-") + "Each has a page of its own, with its equation.\n\n"
        shown = [f":doc:`{p.name} <{elsewhere[id(p.object)]}>`" for p in laws]
        text += ", ".join(shown) + "\n\n"
    full = [p for p in others if id(p.object) not in elsewhere]
    return text + "".join(entry(p) for p in full)


@cache
def own_pages() -> dict[int, str]:
    """Objects that have a page of their own, and which."""
    found: dict[int, str] = {}
    for name, kind in (ALL_LAWS | POPULATIONS | MADE_OF_LAWS).items():
        found[id(kind)] = f"/laws/{name}"
    for name, kind in ALL_SCENES.items():
        found[id(kind)] = f"/scenes/{name}"
    return found


def _link(public: Public, elsewhere: dict[int, str]) -> str:
    if id(public.object) in elsewhere:
        return f":doc:`{public.name} <{elsewhere[id(public.object)]}>`"
    return f":py:obj:`{public.name} <{public.full}>`"


def entry(public: Public) -> str:
    """One name in full, from its docstring."""
    item: Any = public.object
    if inspect.isclass(item):
        kind = "autoexception" if issubclass(item, BaseException) else "autoclass"
        return rst.directive(kind, public.full, members="")
    if is_function(item):
        return rst.directive("autofunction", public.full)
    return rst.directive("py:data", public.full, sentence(summary(public), linked) + "\n")


def summary(public: Public) -> str:
    """The first line of its docstring; of data, the text below them in their source."""
    item: Any = public.object
    if inspect.isclass(item) or is_function(item):
        return first_line(item.__doc__).rstrip(".")
    said = data_docs(source_of(public.front, public.name))
    return first_line(said.get(public.name, "")).rstrip(".")


def is_function(item: Any) -> bool:
    """A function, also a wrapped one; types such as `float | None` can be called, too."""
    return inspect.isroutine(item) or hasattr(item, "__wrapped__")


@cache
def data_docs(module: str) -> dict[str, str]:
    """The texts below the data of a module."""
    tree = ast.parse(inspect.getsource(import_module(module)))
    found: dict[str, str] = {}
    for before, behind in zip(tree.body, tree.body[1:], strict=False):
        said = isinstance(behind, ast.Expr) and isinstance(behind.value, ast.Constant)
        if said and isinstance(before, ast.Assign | ast.AnnAssign):
            targets = before.targets if isinstance(before, ast.Assign) else [before.target]
            names: Iterable[str] = (t.id for t in targets if isinstance(t, ast.Name))
            found |= dict.fromkeys(names, str(behind.value.value))  # pyright: ignore
    return found


Place = tuple[str, str, str]
"""Domain, type and target of a link of Sphinx."""
COMMAND = re.compile(r"symfric ([\w-]+)\b")


def place(text: str) -> Place | None:
    """Where what stands between backticks is documented; None where it is no name of ours."""
    bare = text.removesuffix("()")
    if bare in ALL_LAWS or bare in POPULATIONS or bare in MADE_OF_LAWS:
        return "std", "doc", f"/laws/{bare}"
    if bare in ALL_SCENES:
        return "std", "doc", f"/scenes/{bare}"
    command = COMMAND.match(text)
    if command is not None and command[1] in COMMANDS:
        return "std", "ref", f"symfric-{command[1]}"
    if bare in FRONTS:
        return "std", "doc", f"/reference/{bare}"
    public = known().get(bare.rpartition(".")[2])
    if public is None or bare not in (public.name, public.full) or not callable(public.object):
        return None
    own = own_pages().get(id(public.object))
    return ("std", "doc", own) if own else ("py", "obj", public.full)
