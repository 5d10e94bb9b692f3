"""Structure of the source: import directions, sizes, and forbidden calls."""

import ast
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[1]
ALLOWED = tomllib.loads((ROOT / "tests" / "floors.toml").read_text(encoding="utf-8"))
FLOORS = {folder: set(known) for folder, known in ALLOWED["floors"].items()}
ON_TOP = tuple(ALLOWED["on_top"])
PACKAGES = ("symfric", "ocp", "identification")
SOURCES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
TESTS = sorted((ROOT / "tests").rglob("*.py"))
FUNCTIONS = ast.FunctionDef | ast.AsyncFunctionDef
KEPT = FUNCTIONS | ast.ClassDef | ast.Import | ast.ImportFrom | ast.Call | ast.Assert

FRONTS = tuple(".".join(p.parent.relative_to(ROOT).parts) for p in SOURCES if p.stem == "__init__")
"""Packages; their modules do not import from their `__init__`."""


def dotted(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def within(module: str, unit: str) -> bool:
    return module == unit or module.startswith(f"{unit}.")


@cache
def imported(path: Path) -> frozenset[str]:
    """Modules of this project that a file names, `from symfric import x` resolved to the module."""
    found = set[str]()
    for node in nodes(path):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [
                f"{node.module}.{a.name}" if is_module(f"{node.module}.{a.name}") else node.module
                for a in node.names
            ]
        else:
            continue
        found.update(name for name in names if name.split(".")[0] in PACKAGES)
    return frozenset(found)


@cache
def is_module(name: str) -> bool:
    path = ROOT.joinpath(*name.split("."))
    return path.with_suffix(".py").exists() or (path / "__init__.py").exists()


@cache
def nodes(path: Path) -> list[ast.AST]:
    """Imports, functions, classes, calls and assertions of a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"), str(path))
    return [node for node in ast.walk(tree) if isinstance(node, KEPT)]


@cache
def folder_of(module: str) -> str:
    return max((f for f in FRONTS if within(module, f)), key=len)


def each(paths: list[Path]) -> Callable[[Callable[[Path], object]], Callable[[], None]]:
    """Run a test over all `paths` as one; it yields the mistakes of a file."""

    def looped(test: Callable[[Path], object]) -> Callable[[], None]:
        def over_all() -> None:
            assert not {str(path): wrong for path in paths if (wrong := test(path))}

        return over_all

    return looped


each_source = each(SOURCES)


def on_top(module: str) -> bool:
    return any(within(module, top) for top in ON_TOP)


def allowed(name: str, folder: str) -> bool:
    """Return True if files of `folder` may import the module `name`."""
    if folder in ("ocp", "identification"):
        return not on_top(name) and (within(name, folder) or within(name, "symfric"))
    outer = [other for other in FLOORS if within(folder, other) and other != folder]
    above = any(within(name, package) for package in outer)
    known = {folder} | FLOORS[folder]
    return any(name == k if above else within(name, k) for k in known) or (
        above and folder_of(name) in known
    )


@each_source
def test_imports_point_down(path: Path) -> object:
    """`tests/floors.toml` lists what each folder may import."""
    module = dotted(path)
    if module == "symfric" or on_top(module):
        return ()
    folder = folder_of(module)
    return folder not in FLOORS or [n for n in imported(path) if not allowed(n, folder)]


@each_source
def test_modules_do_not_import_from_the_init_of_their_own_package(path: Path) -> object:
    module = dotted(path)
    fronts = {n for n in imported(path) if n in FRONTS and within(module, n)}
    return fronts if path.stem != "__init__" and not on_top(module) else ()


def test_no_circle_between_folders_or_files() -> None:
    """Imports inside functions and for type checkers count; `__init__.py` files do not."""
    files = {dotted(path): path for path in SOURCES if path.stem != "__init__"}
    between_files = {
        name: {other for other in imported(path) if other in files and other != name}
        for name, path in files.items()
    }
    between_folders: dict[str, set[str]] = {}
    for name, path in files.items():
        if not on_top(name):
            there = {folder_of(other) for other in imported(path)} - {folder_of(name)}
            between_folders.setdefault(folder_of(name), set()).update(there)
    for arrows in (between_files, between_folders):
        TopologicalSorter(arrows).prepare()  # CycleError names a circle


@each(SOURCES + TESTS)
def test_file_is_short(path: Path) -> object:
    return len(path.read_text(encoding="utf-8").splitlines()) > 400


def calls(path: Path, apart_from: str = "") -> Iterator[str]:
    """Names that are called, bare or as an attribute of something other than `apart_from`."""
    for node in nodes(path):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            yield node.func.id
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            owner = node.func.value
            if not (isinstance(owner, ast.Name) and owner.id == apart_from):
                yield node.func.attr


NONSMOOTH = {"fabs", "sign", "if_else", "fmin", "fmax", "norm", "norm_1", "norm_2", "norm_inf"}


@each_source
def test_rules_of_the_source(path: Path) -> object:
    """Functions below 60 lines, absolute imports, no assert, no print, one place for kinks."""
    module, wrong = dotted(path), list[str]()
    for node in nodes(path):
        if isinstance(node, FUNCTIONS):
            body = node.body[1:] if ast.get_docstring(node) else node.body
            if body and (body[-1].end_lineno or 0) - body[0].lineno + 1 > 60:
                wrong.append(f"{node.name} is long")
        elif isinstance(node, ast.ImportFrom) and node.level:
            wrong.append(f"relative import in line {node.lineno}")
        elif isinstance(node, ast.Assert):
            wrong.append(f"assert in line {node.lineno}")
    if not on_top(module) and "print" in calls(path):
        wrong.append("print")
    formulas = within(module, "symfric.laws") or within(module, "symfric.scenes")
    if formulas and module != "symfric.laws.base.smooth":
        wrong += NONSMOOTH & set(calls(path, apart_from="smooth"))
    return wrong


def test_at_most_two_classes_share_a_name() -> None:
    names = Counter(n.name for p in SOURCES for n in nodes(p) if isinstance(n, ast.ClassDef))
    assert not [name for name, count in names.items() if count > 2]


def test_every_package_is_typed_and_none_hides_a_file() -> None:
    for package in PACKAGES:
        assert (ROOT / package / "py.typed").exists()
        assert (ROOT / package / "__init__.py").exists()
