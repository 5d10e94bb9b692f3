"""Structure of the source: import directions, sizes, and what may stand where."""

import ast
import tomllib
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

FRONTS = tuple(".".join(p.parent.relative_to(ROOT).parts) for p in SOURCES if p.stem == "__init__")
"""Folders whose `__init__` hands out names of its rooms; nobody inside enters through it."""


def dotted(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def within(module: str, unit: str) -> bool:
    return module == unit or module.startswith(f"{unit}.")


@cache
def imported(path: Path) -> frozenset[str]:
    """Modules of this project that a file names, `from symfric import x` resolved to the module."""
    found = set[str]()
    for node in ast.walk(parsed(path)):
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
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


@cache
def folder_of(module: str) -> str:
    return max((f for f in FRONTS if within(module, f)), key=len)


def each(paths: list[Path]) -> Callable[[Callable[[Path], None]], Callable[[], None]]:
    """Runs a test over all `paths` as one; a failure names the file."""

    def looped(test: Callable[[Path], None]) -> Callable[[], None]:
        def over_all() -> None:
            for path in paths:
                try:
                    test(path)
                except AssertionError as error:
                    error.add_note(f"in {path}")
                    raise

        return over_all

    return looped


each_source = each(SOURCES)


def on_top(module: str) -> bool:
    return any(within(module, top) for top in ON_TOP)


def allowed(name: str, folder: str) -> bool:
    """Whether files of `folder` may import the module `name`."""
    if folder in ("ocp", "identification"):
        return not on_top(name) and (within(name, folder) or within(name, "symfric"))
    rooms = [other for other in FLOORS if within(folder, other) and other != folder]
    above = any(within(name, house) for house in rooms)
    known = {folder} | FLOORS[folder]
    return any(name == k if above else within(name, k) for k in known) or (
        above and folder_of(name) in known
    )


@each_source
def test_imports_point_down(path: Path) -> None:
    module = dotted(path)
    if module == "symfric" or on_top(module):
        return
    folder = folder_of(module)
    assert folder in FLOORS, f"{module}: list in tests/floors.toml what it may import"
    wrong = sorted({name for name in imported(path) if not allowed(name, folder)})
    assert not wrong, f"{module} must not import {', '.join(wrong)}"


@each_source
def test_nobody_enters_through_the_front_of_his_own_house(path: Path) -> None:
    module = dotted(path)
    if path.stem != "__init__" and not on_top(module):
        assert not {n for n in imported(path) if n in FRONTS and within(module, n)}


def test_no_circle_between_folders() -> None:
    """Fronts apart, which stand above the rooms they show."""
    arrows: dict[str, set[str]] = {}
    for path in SOURCES:
        if path.stem != "__init__" and not on_top(dotted(path)):
            here = folder_of(dotted(path))
            there = {folder_of(name) for name in imported(path)}
            arrows.setdefault(here, set()).update(there - {here})
    while leaves := {f for f, to in arrows.items() if not to & arrows.keys()}:
        arrows = {f: to for f, to in arrows.items() if f not in leaves}
    assert not arrows


def test_no_circle_between_files() -> None:
    """Imports inside functions and for type checkers count; `__init__.py` files do not."""
    files = {dotted(path): path for path in SOURCES if path.stem != "__init__"}
    arrows = {
        name: {other for other in imported(path) if other in files and other != name}
        for name, path in files.items()
    }
    TopologicalSorter(arrows).prepare()  # CycleError names a circle


@each_source
def test_imports_are_absolute(path: Path) -> None:
    relative = [n for n in ast.walk(parsed(path)) if isinstance(n, ast.ImportFrom) and n.level]
    assert not relative


@each(SOURCES + TESTS)
def test_file_is_short(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400


@each_source
def test_functions_are_short(path: Path) -> None:
    long: list[str] = []
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            body = node.body[1:] if ast.get_docstring(node) else node.body
            if body and (body[-1].end_lineno or 0) - body[0].lineno + 1 > 60:
                long.append(node.name)
    assert not long


def calls(tree: ast.AST, beside: str = "") -> Iterator[str]:
    """Names that are called, bare or as an attribute of something other than `beside`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            yield node.func.id
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            owner = node.func.value
            if not (isinstance(owner, ast.Name) and owner.id == beside):
                yield node.func.attr


@each_source
def test_library_does_not_print(path: Path) -> None:
    if not on_top(dotted(path)):
        assert "print" not in calls(parsed(path))


@each_source
def test_user_errors_are_not_asserted(path: Path) -> None:
    assert not [n.lineno for n in ast.walk(parsed(path)) if isinstance(n, ast.Assert)]


NONSMOOTH = {"fabs", "sign", "if_else", "fmin", "fmax", "norm", "norm_1", "norm_2", "norm_inf"}
FORMULAS = [
    path
    for path in SOURCES
    if within(dotted(path), "symfric.laws") or within(dotted(path), "symfric.scenes")
]


@each(FORMULAS)
def test_only_the_smooth_blocks_use_nonsmooth_functions(path: Path) -> None:
    if dotted(path) != "symfric.laws.base.smooth":
        assert not NONSMOOTH & set(calls(parsed(path), beside="smooth"))


def test_every_package_is_typed_and_none_hides_a_file() -> None:
    for package in PACKAGES:
        assert (ROOT / package / "py.typed").exists()
        assert (ROOT / package / "__init__.py").exists()
