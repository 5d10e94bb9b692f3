"""Structure of the source: import directions, sizes, and kinks of formulas."""

import ast
import tomllib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
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

FRONTS = tuple(".".join(p.parent.relative_to(ROOT).parts) for p in SOURCES if p.stem == "__init__")
"""Packages; their modules do not import from their `__init__`."""


def dotted(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def within(module: str, unit: str) -> bool:
    return module == unit or module.startswith(f"{unit}.")


@dataclass(frozen=True)
class Source:
    """What the rules ask of a file: no syntax tree is kept, which would slow down the next one."""

    imported: frozenset[str]
    """Modules of this project, `from symfric import x` resolved to the module."""
    classes: tuple[str, ...]
    long: tuple[str, ...]
    """Functions of more than 60 lines."""
    calls: frozenset[str]
    """Names that are called, bare or as an attribute of something other than `smooth`."""


@cache
def source(path: Path) -> Source:
    """Read a file."""
    nodes = [*ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path)))]
    return Source(
        frozenset(n for node in nodes for n in imports(node) if n.split(".")[0] in PACKAGES),
        tuple(node.name for node in nodes if isinstance(node, ast.ClassDef)),
        tuple(node.name for node in nodes if isinstance(node, FUNCTIONS) and lines(node) > 60),
        frozenset(called(node.func) for node in nodes if isinstance(node, ast.Call)),
    )


def imports(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom) or not node.module:
        return []
    names = [f"{node.module}.{alias.name}" for alias in node.names]
    return [name if is_module(name) else node.module for name in names]


def lines(node: FUNCTIONS) -> int:
    body = node.body[1:] if ast.get_docstring(node) else node.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


def called(function: ast.expr) -> str:
    if isinstance(function, ast.Name):
        return function.id
    owner = function.value if isinstance(function, ast.Attribute) else None
    smooth = isinstance(owner, ast.Name) and owner.id == "smooth"
    return function.attr if isinstance(function, ast.Attribute) and not smooth else ""


@cache
def is_module(name: str) -> bool:
    path = ROOT.joinpath(*name.split("."))
    return path.with_suffix(".py").exists() or (path / "__init__.py").exists()


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
    return folder not in FLOORS or [n for n in source(path).imported if not allowed(n, folder)]


@each_source
def test_modules_do_not_import_from_the_init_of_their_own_package(path: Path) -> object:
    module = dotted(path)
    fronts = {n for n in source(path).imported if n in FRONTS and within(module, n)}
    return fronts if path.stem != "__init__" and not on_top(module) else ()


def test_no_circle_between_folders_or_files() -> None:
    """Imports inside functions and for type checkers count; `__init__.py` files do not."""
    files = {dotted(path): path for path in SOURCES if path.stem != "__init__"}
    between_files = {
        name: {other for other in source(path).imported if other in files and other != name}
        for name, path in files.items()
    }
    between_folders: dict[str, set[str]] = {}
    for name, path in files.items():
        if not on_top(name):
            there = {folder_of(other) for other in source(path).imported} - {folder_of(name)}
            between_folders.setdefault(folder_of(name), set()).update(there)
    for arrows in (between_files, between_folders):
        TopologicalSorter(arrows).prepare()  # CycleError names a circle


@each(SOURCES + TESTS)
def test_file_is_short(path: Path) -> object:
    return len(path.read_text(encoding="utf-8").splitlines()) > 400


NONSMOOTH = {"fabs", "sign", "if_else", "fmin", "fmax", "norm", "norm_1", "norm_2", "norm_inf"}


@each_source
def test_no_function_is_long(path: Path) -> object:
    return source(path).long


@each_source
def test_formulas_have_their_kinks_from_one_place(path: Path) -> object:
    module = dotted(path)
    formulas = within(module, "symfric.laws") or within(module, "symfric.scenes")
    return formulas and module != "symfric.laws.base.smooth" and NONSMOOTH & source(path).calls


def test_at_most_two_classes_share_a_name() -> None:
    names = Counter(name for path in SOURCES for name in source(path).classes)
    assert not [name for name, count in names.items() if count > 2]


def test_every_package_is_typed_and_none_hides_a_file() -> None:
    for package in PACKAGES:
        assert (ROOT / package / "py.typed").exists()
        assert (ROOT / package / "__init__.py").exists()
