"""Pages made of lists: the reference of Python, examples, commands, limits, literature."""

import ast
import inspect
import re
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import import_module
from inspect import getdoc
from itertools import pairwise
from pathlib import Path
from typing import Any

import typer

from docs.machine import rst
from docs.machine.items import MADE_OF_LAWS
from docs.machine.made import PACKAGES
from docs.machine.names import FRONTS, Public, catalogue, known, linked, source_of
from docs.machine.pages import ROOT
from docs.machine.rst import Symbols, first_line, sentence, to_rst
from symfric import ALL_LAWS, POPULATIONS, __version__
from symfric.cli.app import COMMANDS, app, argument_shown, arguments, is_option, prose_and_examples
from symfric.gallery import scripts
from symfric.scenes import ALL_SCENES


def reference_pages() -> dict[str, str]:
    """Name of each page, relative to `reference`, -> its text."""
    return {front: reference_page(front, names) for front, names in catalogue().items() if names}


def reference_rows() -> list[list[str]]:
    """Module and subject of each page."""
    return [[f":doc:`{f}`", rst.plain(FRONTS[f])] for f, names in catalogue().items() if names]


def reference_page(front: str, names: list[Public]) -> str:
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
    """Return the page of one public name, from its docstring."""
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
    """The place that documents a name between backticks; None if it is no name of ours."""
    bare = text.removesuffix("()")
    if bare in ALL_LAWS or bare in POPULATIONS or bare in MADE_OF_LAWS:
        return "std", "doc", f"/laws/{bare}"
    if bare in ALL_SCENES:
        return "std", "doc", f"/scenes/{bare}"
    command = COMMAND.match(text)
    if command is not None and command[1] in COMMANDS:
        return "std", "ref", f"symfric-{command[1]}"
    if bare in FRONTS:  # a package whose names all stand on the page of its parent has none
        return "std", "doc", f"/reference/{bare if catalogue()[bare] else bare.rpartition('.')[0]}"
    public = known().get(bare.rpartition(".")[2])
    if public is None or bare not in (public.name, public.full) or not callable(public.object):
        return None
    own = own_pages().get(id(public.object))
    return ("std", "doc", own) if own else ("py", "obj", public.full)


EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def example_pages() -> dict[str, str]:
    """Name of each page, relative to `examples`, -> its text."""
    found = {path.stem: example_page(path) for path in EXAMPLES}
    return found | {"index": example_index()}


def example_index() -> str:
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


def example_page(path: Path) -> str:
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


def command_page() -> str:
    """All commands with their arguments and options."""
    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="symfric")
    text = rst.title("Command line")
    text += "Names and units are those of Python. Exit status 0: done; 1: a solve failed, what "
    text += "there is so far is written; 2: bad input; 130: Ctrl-C.\n\n"
    rows = [[f"`symfric {name}`_", rst.plain(said)] for name, said in COMMANDS.items()]
    text += rst.table(["command", "what it does"], rows)
    for name in COMMANDS:
        text += command_section(name, group.get_command(context, name))  # pyright: ignore
    return text


def command_section(name: str, command: Any) -> str:
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


LIMITS = re.compile(r"^(?:Limits|Not valid): (.*?)(?=\n\n|\n[A-Z][a-z]+:|\Z)", re.M | re.S)


def limits(item: Any) -> str:
    """The limits that a docstring states, "" for none."""
    return " ".join(" ".join(found.split()) for found in LIMITS.findall(getdoc(item) or ""))


def limit_page() -> str:
    """Limits of laws, scenes and public names, each with its link."""
    found = rst.title("Limits")
    found += "Limits that docstrings state; each is also on the page of its object.\n\n"
    kinds: dict[str, dict[str, Any]] = {
        "Laws": ALL_LAWS | POPULATIONS | MADE_OF_LAWS,
        "Scenes": dict(ALL_SCENES),
    }
    seen: set[int] = set()
    for title, items in kinds.items():
        room = title.lower()
        rows = [
            [f":doc:`{name} </{room}/{name}>`", sentence(limits(kind), Symbols(linked))]
            for name, kind in items.items()
            if limits(kind)
        ]
        seen |= {id(kind) for kind in items.values()}
        found += rst.title(title, "-") + rst.table([room[:-1], "limits"], rows)
    rows = [
        [f":py:obj:`{p.full}`", sentence(limits(p.object), linked)]
        for names in catalogue().values()
        for p in names
        if id(p.object) not in seen and limits(p.object)
    ]
    return found + rst.title("Python", "-") + rst.table(["name", "limits"], rows)


SOURCES = re.compile(
    r"^\s*Sources?(?: of [\w' ]+)?: (.*?)(?=\n\s*\n|\n\s*[A-Z]\w+:|\Z)", re.M | re.S
)
YEAR = re.compile(r"\b1[6-9]\d\d\b|\b20\d\d\b")
ASIDE = ("laws", "gallery", "bench", "stress", "cli")
"""Packages of symfric whose sources stand elsewhere, or are those of tables."""


def literature_page() -> str:
    """Citation of symfric, then laws, figures and methods with their sources."""
    text = rst.title("Literature, and how to cite")
    text += cite()
    text += rst.title("Laws", "-")
    text += "What each formula was taken from; how sure we are of it stands on its page.\n\n"
    rows = [
        [rst.plain(source), ", ".join(f":doc:`{name} </laws/{name}>`" for name in names)]
        for source, names in laws().items()
    ]
    text += rst.table(["source", "laws"], rows)
    text += rst.title("Figures", "-")
    text += "Papers whose figures are computed again in the :doc:`gallery </gallery/index>`.\n\n"
    text += "".join(f"* {rst.plain(paper)}\n" for paper in papers()) + "\n"
    text += rst.title("Scenes and methods", "-")
    rows = [[rst.plain(said), rst.code(where)] for said, where in methods()]
    return text + rst.table(["source", "used in"], rows)


def cite() -> str:
    """The entry for a paper."""
    words = "Name the version, and the paper of the law that you took.\n\n"
    entry = f"""@software{{symfric,
  title   = {{symfric: friction laws as {{CasADi}} expressions}},
  author  = {{{{The symfric authors}}}},
  version = {{{__version__}}},
  license = {{MIT}}
}}"""
    return rst.title("How to cite", "-") + words + rst.literal(entry, "bibtex")


def laws() -> dict[str, list[str]]:
    """Source -> names of the laws that it is given for, by the alphabet."""
    found: dict[str, list[str]] = {}
    for name, kind in (ALL_LAWS | POPULATIONS).items():
        found.setdefault(kind.facts.source, []).append(name)
    return dict(sorted(found.items(), key=lambda item: item[0].removeprefix("after ").lower()))


def papers() -> list[str]:
    """The first paragraph of each paper's folder in the gallery."""
    folders = dict.fromkeys(module.rpartition(".")[0] for module in scripts().values())
    found: list[str] = []
    for folder in folders:
        source = ROOT.joinpath(*folder.split("."), "__init__.py").read_text("utf-8")
        said = ast.get_docstring(ast.parse(source)) or ""
        found.append(" ".join(said.split("\n\n")[0].split()))
    return found


def methods() -> list[tuple[str, str]]:
    """Publication and the module that stands on it, of all code but the laws, by the alphabet."""
    found: dict[tuple[str, str], None] = {}
    for path in sorted(p for name in PACKAGES for p in (ROOT / name).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        if len(parts) > 1 and parts[1] in ASIDE:
            continue
        module = ".".join(part for part in parts if part != "__init__")
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            holds = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
            for said in sources(ast.get_docstring(node) or "") if holds else ():
                found[said, module] = None
    return sorted(found, key=lambda item: item[0].lower())


def sources(docstring: str) -> Iterator[str]:
    """The publications that a docstring names: parts between semicolons, each with its year.

    A part without a year belongs to the one before it.
    """
    for match in SOURCES.findall(docstring):
        parts = " ".join(match.split()).rstrip(".").split("; ")
        begins = [k for k, part in enumerate(parts) if k == 0 or YEAR.search(part)]
        for begin, end in pairwise([*begins, len(parts)]):
            yield "; ".join(parts[begin:end])
