"""Structure of the source: import directions, sizes, and what may stand where."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("symfric", "ocp", "identification")
SOURCES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
TESTS = sorted((ROOT / "tests").rglob("*.py"))

MAY_IMPORT: dict[str, set[str]] = {
    "symfric.status": set(),
    "symfric.files": set(),
    "symfric.vector": set(),
    "symfric.numeric": {"symfric.vector"},
    "symfric.parameters": {"symfric.numeric"},
    "symfric.laws": {"symfric.numeric", "symfric.parameters", "symfric.vector"},
    "symfric.sketch": set(),
    "symfric.holonomic": set(),
    "symfric.model": {
        "symfric.holonomic",
        "symfric.numeric",
        "symfric.parameters",
        "symfric.sketch",
    },
    "symfric.scenes": {
        "symfric.laws",
        "symfric.model",
        "symfric.multibody",
        "symfric.numeric",
        "symfric.parameters",
    },
    "symfric.multibody": {
        "symfric.holonomic",
        "symfric.laws",
        "symfric.model",
        "symfric.numeric",
        "symfric.parameters",
        "symfric.sketch",
    },
    "symfric.integrator": {
        "symfric.holonomic",
        "symfric.model",
        "symfric.numeric",
        "symfric.parameters",
        "symfric.status",
        "symfric.files",
        "symfric.sketch",
        "symfric.animation",  # on request, when a trajectory draws itself
        "symfric.plotting",  # likewise
    },
    "symfric.kinds": {"symfric.model"},
    "symfric.strokes": {"symfric.sketch"},
    "symfric.animation": {
        "symfric.files",
        "symfric.sketch",
        "symfric.strokes",
        "symfric.integrator",  # types only
    },
    "symfric.plotting": {
        "symfric.files",
        "symfric.numeric",
        "symfric.parameters",
        "symfric.figures",  # types only
        "symfric.integrator",  # types only
        "symfric.kinds",
        "symfric.laws",
    },
    "symfric.figures": {
        "symfric.integrator",
        "symfric.laws",
        "symfric.model",
        "symfric.numeric",
        "symfric.parameters",
        "symfric.plotting",  # on request, when a figure draws itself
        "symfric.scenes",
    },
    "symfric.codegen": {
        "symfric",
        "symfric.files",
        "symfric.integrator",
        "symfric.laws",
        "symfric.model",
        "symfric.numeric",
        "symfric.parameters",
        "symfric.status",
    },
    "ocp": {"symfric"},
    "identification": {"symfric"},
}
"""Unit -> units it may import (CONVENTIONS, section 8); each may import itself."""

ON_REQUEST = {"symfric.laws": {"symfric.figures"}}
"""Module -> what it imports inside a function, when an attribute of that name is asked for."""

ON_TOP = ("symfric.cli", "symfric.bench")
"""They see all, and they may print."""


def dotted(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def within(module: str, unit: str) -> bool:
    return module == unit or module.startswith(f"{unit}.")


def imported(tree: ast.AST) -> Iterator[str]:
    """Modules of this project that a file names, `from symfric import x` resolved to the module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [
                f"{node.module}.{a.name}" if is_module(f"{node.module}.{a.name}") else node.module
                for a in node.names
            ]
        else:
            continue
        yield from (name for name in names if name.split(".")[0] in PACKAGES)


def is_module(name: str) -> bool:
    path = ROOT.joinpath(*name.split("."))
    return path.with_suffix(".py").exists() or (path / "__init__.py").exists()


def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def unit_of(module: str) -> str | None:
    units = [unit for unit in MAY_IMPORT if within(module, unit)]
    return max(units, key=len, default=None)


each_source = pytest.mark.parametrize("path", SOURCES, ids=[dotted(p) for p in SOURCES])


def on_top(module: str) -> bool:
    return any(within(module, top) for top in ON_TOP)


def allowed(name: str, unit: str) -> bool:
    """Whether `unit` may import the module `name`; to parts of symfric, `symfric` is its front."""
    known = MAY_IMPORT[unit] | {unit}
    if unit.startswith("symfric."):
        return name in known or any(within(name, other) for other in known - {"symfric"})
    return not on_top(name) and any(within(name, other) for other in known)


@each_source
def test_imports_point_down(path: Path) -> None:
    module = dotted(path)
    if module == "symfric" or on_top(module):
        return
    unit = unit_of(module)
    assert unit, f"{module}: say in MAY_IMPORT what it may know"
    wrong = sorted({name for name in imported(parsed(path)) if not allowed(name, unit)})
    later = ON_REQUEST.get(module, set())
    wrong = [name for name in wrong if not any(within(name, unit) for unit in later)]
    assert not wrong, f"{module} must not import {', '.join(wrong)}"


@pytest.mark.parametrize("module", ON_REQUEST)
def test_what_is_fetched_on_request_is_not_imported_before(module: str) -> None:
    path = ROOT.joinpath(*module.split("."), "__init__.py")
    eager = [n for n in parsed(path).body if isinstance(n, ast.Import | ast.ImportFrom)]
    early = [name for node in eager for name in imported(node)]
    assert not [n for n in early if any(within(n, unit) for unit in ON_REQUEST[module])]


@each_source
def test_imports_are_absolute(path: Path) -> None:
    relative = [n for n in ast.walk(parsed(path)) if isinstance(n, ast.ImportFrom) and n.level]
    assert not relative


@pytest.mark.parametrize("path", SOURCES + TESTS, ids=[dotted(p) for p in SOURCES + TESTS])
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


@pytest.mark.parametrize("path", FORMULAS, ids=[dotted(p) for p in FORMULAS])
def test_only_the_smooth_blocks_use_nonsmooth_functions(path: Path) -> None:
    if dotted(path) != "symfric.laws.smooth":
        assert not NONSMOOTH & set(calls(parsed(path), beside="smooth"))


def test_every_package_is_typed_and_none_hides_a_file() -> None:
    for package in PACKAGES:
        assert (ROOT / package / "py.typed").exists()
        assert (ROOT / package / "__init__.py").exists()
