"""Pages that are lists: the Python reference, examples, commands, limits, literature."""

import ast
import inspect
import re
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from itertools import pairwise
from typing import Any, NamedTuple

import typer
from typer.cli import get_docs_for_click

from docs.machine.docstrings import first_line
from docs.machine.items import LAW_PAGES
from docs.machine.markdown import TEXTS, block, code, contents, directive, opening, plain, table
from docs.machine.pages import ROOT
from symfric import ALL_LAWS, POPULATIONS, __version__
from symfric.cli.app import COMMANDS, app
from symfric.gallery import scripts
from symfric.gallery.plate import about_paper
from symfric.scenes import ALL_SCENES

PACKAGES = ("symfric", "ocp", "identification")
MODULES = TEXTS["modules"]
"""Public modules with their subjects; a name is documented in the first that exports it."""


class Public(NamedTuple):
    """Public name: `module.name` is `object`."""

    module: str
    name: str
    object: Any

    @property
    def full(self) -> str:
        """The name by which it is imported."""
        return f"{self.module}.{self.name}"

    @property
    def page(self) -> str:
        """Page of a law or a scene, "" for other objects."""
        return own_pages().get(id(self.object), "")

    def summary(self) -> str:
        """Return the first line of its docstring; of data, the text below it in the source."""
        if inspect.isclass(self.object) or is_function(self.object):
            return first_line(self.object.__doc__).rstrip(".")
        from sphinx.pycode import ModuleAnalyzer  # noqa: PLC0415  (not for tests without Sphinx)

        module = self.module
        while (other := getattr(import_module(module), "_places", {}).get(self.name)) is not None:
            module = other
        docs = ModuleAnalyzer.for_module(module).find_attr_docs()
        return first_line("\n".join(docs.get(("", self.name), []))).rstrip(".")


def is_function(item: Any) -> bool:
    """Return True for functions, also wrapped ones, but not for types such as `float | None`."""
    return inspect.isroutine(item) or hasattr(item, "__wrapped__")


@cache
def own_pages() -> Mapping[int, str]:
    """Return the page of each law and scene, by the identity of its class."""
    laws = {id(kind): f"/laws/{name}" for name, kind in LAW_PAGES.items()}
    return laws | {id(kind): f"/scenes/{name}" for name, kind in ALL_SCENES.items()}


@cache
def catalogue() -> Mapping[str, list[Public]]:
    """Return the names of each module, each object in the first module that exports it."""
    seen: set[int] = set()
    found: dict[str, list[Public]] = {}
    for module in MODULES:
        package = import_module(module)
        names = getattr(package, "__all__", None) or [
            n for n, item in vars(package).items()
            if getattr(item, "__module__", "") == module and n[0].islower()
        ]  # fmt: skip
        every = [Public(module, name, getattr(package, name)) for name in names]
        found[module] = [p for p in every if id(p.object) not in seen]
        seen |= {id(p.object) for p in every}
    return found


@cache
def known() -> Mapping[str, Public]:
    """Return public names by their short names, without ambiguous ones."""
    found: dict[str, Public | None] = {}
    for public in (p for names in catalogue().values() for p in names):
        found[public.name] = None if public.name in found else public
    return {name: public for name, public in found.items() if public is not None}


Place = tuple[str, str, str]
"""Domain, type and target of a link of Sphinx."""
COMMAND = re.compile(r"symfric ([\w-]+)\b")


def place(text: str) -> Place | None:
    """Return the place that documents a name between backticks; None for other texts."""
    bare = text.removesuffix("()")
    if bare in LAW_PAGES:
        return "std", "doc", f"/laws/{bare}"
    if bare in ALL_SCENES:
        return "std", "doc", f"/scenes/{bare}"
    command = COMMAND.match(text)
    if command is not None and command[1] in COMMANDS:
        return "std", "ref", f"symfric-{command[1]}"
    if bare in MODULES:  # without names of its own, it is documented with its parent
        return "std", "doc", f"/reference/{bare if catalogue()[bare] else bare.rpartition('.')[0]}"
    public = known().get(bare.rpartition(".")[2])
    if public is None or bare not in (public.name, public.full) or not callable(public.object):
        return None
    return ("std", "doc", public.page) if public.page else ("py", "obj", public.full)


def reference_pages() -> dict[str, str]:
    """Return the text of each page, by its name relative to `reference`."""
    modules = {module: names for module, names in catalogue().items() if names}
    found = {module: module_page(module, names) for module, names in modules.items()}
    text = "# Python\n\nThe reference contains every public name with its docstring.\n\n"
    text += table(["module", "subject"], [[f"[{m}]({m}.md)", MODULES[m]] for m in modules])
    return found | {
        "python": text + contents(modules),
        "commands": command_page(),
        "limits": limit_page(),
        "literature": literature_page(),
    }


def module_page(module: str, names: list[Public]) -> str:
    """Return the page of one module: a table of its names, then their documentation."""
    laws = [p for p in names if p.page.startswith("/laws/")]
    others = sorted((p for p in names if p not in laws), key=lambda p: p.name.lower())
    text = f"# {module}\n\n{MODULES[module]}\n\n"
    text += table(["name", "description"], [[link(p), plain(p.summary())] for p in others])
    if laws:
        text += "## Laws\n\nEach law has its own page.\n\n" + ", ".join(map(link, laws)) + "\n\n"
    entries = [entry(p) for p in others if not p.page]
    return text + directive("eval-rst", "", "\n".join(entries))


def link(public: Public) -> str:
    """Return a link to the documentation of a name."""
    if public.page:
        return f"[{public.name}]({public.page}.md)"
    return f"{{py:obj}}`{public.name} <{public.full}>`"


def entry(public: Public) -> str:
    """Return the directive that documents a name."""
    item = public.object
    if inspect.isclass(item):
        kind = "autoexception" if issubclass(item, BaseException) else "autoclass"
        return f".. {kind}:: {public.full}\n   :members:\n"
    if is_function(item):
        return f".. autofunction:: {public.full}\n"
    return f".. py:data:: {public.full}\n\n   {public.summary()}\n"


def command_page() -> str:
    """Return all commands with their arguments and options, as Typer writes them."""
    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="symfric")
    text = f"# Command line\n\nNames and units are the same as in Python. {group.epilog}\n\n"
    rows = [[f"[symfric {n}](#symfric-{n})", plain(about)] for n, about in COMMANDS.items()]
    text += table(["command", "description"], rows)
    for name in COMMANDS:
        command = group.get_command(context, name)  # pyright: ignore
        full = f"symfric {name}"
        own = get_docs_for_click(obj=command, ctx=typer.Context(command, info_name=full), name=full)
        own = re.sub(r"^# .*", f"(symfric-{name})=\n## {full}", own.replace("`symfric", "`symfric"))
        own = re.sub(r"^Example: (.*)\n+", r"```console\n$ \1\n```\n\n", own, flags=re.M)
        text += re.sub(r"(?<![\w`-])(--[a-z][\w-]*(?:=[\w.=]+)?)(?![^\n]*`:)", r"`\1`", own) + "\n"
    return text


EXAMPLES = sorted((ROOT / "examples").rglob("*.py"))


def example_pages() -> dict[str, str]:
    """Return the text of each page, by its name relative to `examples`."""
    found: dict[str, str] = {}
    rows: list[list[str]] = []
    for path in EXAMPLES:
        source = path.read_text("utf-8")
        tree = ast.parse(source)
        about = ast.get_docstring(tree) or ""
        program = "\n".join(source.splitlines()[tree.body[0].end_lineno or 0 :]).strip()
        text = f"# {path.stem}\n\n{plain(about)}\n\n"
        picture = path.parent / "pictures" / f"{path.stem}.png"
        if picture.exists():
            text += f"![{path.stem}](../../examples/pictures/{picture.name})\n\n"
        text += f"## {path.relative_to(ROOT)}\n\n" + block(program, "python")
        found[path.stem] = text
        rows.append([f"[{path.stem}]({path.stem}.md)", plain(first_line(about))])
    index = opening("examples", count=len(EXAMPLES))
    return found | {"index": index + table(["example", "subject"], rows) + contents(found)}


LIMITS = re.compile(r"^(?:Limits|Not valid): (.*?)(?=\n\n|\n[A-Z][a-z]+:|\Z)", re.M | re.S)


def limits(item: Any) -> str:
    """Return the limits that a docstring states, "" for none."""
    return " ".join(" ".join(x.split()) for x in LIMITS.findall(inspect.getdoc(item) or ""))


def limit_page() -> str:
    """Return limits of laws, scenes and public names, each with its link."""
    text = "# Limits\n\nThis page collects the limits that docstrings state. "
    text += "Each limit is also on the page of its object.\n\n"
    for title, items in {"Laws": LAW_PAGES, "Scenes": ALL_SCENES}.items():
        folder = title.lower()
        rows = [[f"[{name}](../{folder}/{name}.md)", plain(limits(kind))]
                for name, kind in items.items() if limits(kind)]  # fmt: skip
        text += f"## {title}\n\n" + table([folder[:-1], "limits"], rows)
    rows = [
        [f"{{py:obj}}`{p.full}`", plain(limits(p.object))]
        for names in catalogue().values() for p in names if not p.page and limits(p.object)
    ]  # fmt: skip
    return text + "## Python\n\n" + table(["name", "limits"], rows)


SOURCES = re.compile(
    r"^\s*Sources?(?: of [\w' ]+)?: (.*?)(?=\n\s*\n|\n\s*[A-Z]\w+:|\Z)", re.M | re.S
)
YEAR = re.compile(r"\b1[6-9]\d\d\b|\b20\d\d\b")
ELSEWHERE = ("laws", "gallery", "bench", "stress", "cli")
"""Packages of symfric whose sources are listed elsewhere, or belong to tables."""


def literature_page() -> str:
    """Return the citation of symfric, and the sources of laws, figures and methods."""
    text = opening("literature", version=__version__)
    rows = [
        [plain(source), ", ".join(f"[{name}](../laws/{name}.md)" for name in names)]
        for source, names in laws().items()
    ]
    text += table(["source", "laws"], rows)
    text += "## Figures\n\nThe [gallery](../gallery/index.md) contains figures of these papers:\n\n"
    folders = dict.fromkeys(module.rpartition(".")[0] for module in scripts().values())
    text += "".join(f"* {plain(about_paper(folder)['paper'])}\n" for folder in folders) + "\n"
    rows = [[plain(source), code(module)] for source, module in methods()]
    return text + "## Scenes and methods\n\n" + table(["source", "used in"], rows)


def laws() -> dict[str, list[str]]:
    """Return source -> names of its laws, in alphabetical order."""
    found: dict[str, list[str]] = {}
    for name, kind in (ALL_LAWS | POPULATIONS).items():
        found.setdefault(kind.facts.source, []).append(name)
    return dict(sorted(found.items(), key=lambda item: item[0].removeprefix("after ").lower()))


def methods() -> list[tuple[str, str]]:
    """Return publication and module of all code but the laws, in alphabetical order."""
    found: dict[tuple[str, str], None] = {}
    for path in sorted(p for name in PACKAGES for p in (ROOT / name).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        if len(parts) > 1 and parts[1] in ELSEWHERE:
            continue
        module = ".".join(part for part in parts if part != "__init__")
        text = path.read_text("utf-8")
        for node in ast.walk(ast.parse(text)) if "Source" in text else ():
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                for source in sources(ast.get_docstring(node) or ""):
                    found[source, module] = None
    return sorted(found, key=lambda item: item[0].lower())


def sources(docstring: str) -> Iterator[str]:
    """Yield the publications of a docstring: parts between semicolons, each with its year.

    A part without a year belongs to the one before it.
    """
    for match in SOURCES.findall(docstring):
        parts = " ".join(match.split()).rstrip(".").split("; ")
        begins = [k for k, part in enumerate(parts) if k == 0 or YEAR.search(part)]
        for begin, end in pairwise([*begins, len(parts)]):
            yield "; ".join(parts[begin:end])
