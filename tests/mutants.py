"""`make mutants`: change one line of the product at random, and see whether the tests fail.

A mutant replaces one operator, comparison, condition or function of an expression. The seed alone
determines lines and changes, so a fresh seed is a fresh sample. The tests of the folder that
mirrors the file run first, then the whole suite. Messages, annotations and the constants of modules
(tolerances, limits) are never changed.
"""

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("symfric", "ocp", "identification")
COPIED = (*PACKAGES, "tests", "examples", "docs")
LIMIT = 1800.0
"""Seconds after which tests count as hanging, which kills a mutant, too."""

SWAPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
CALLS = {"min": "max", "max": "min", "any": "all", "all": "any", "argmin": "argmax",
         "sin": "cos", "cos": "sin", "fmin": "fmax", "fmax": "fmin"}  # fmt: skip


@final
@dataclass(frozen=True)
class Mutant:
    """Lines `first` to `last` of `file` (counted from 1) become `new`; `what` describes it."""

    file: str
    first: int
    last: int
    new: str
    what: str


def changed(node: ast.expr) -> Iterator[ast.expr]:
    """Yield `node` with one change at its top."""
    if isinstance(node, ast.BinOp) and type(node.op) in SWAPS and not _text(node):
        yield ast.BinOp(node.left, SWAPS[type(node.op)](), node.right)  # type: ignore[arg-type]
    elif isinstance(node, ast.Compare) and len(node.ops) == 1:
        swapped = SWAPS[type(node.ops[0])]()
        yield ast.Compare(node.left, [swapped], node.comparators)  # type: ignore[list-item]
    elif isinstance(node, ast.BoolOp):
        yield ast.BoolOp(SWAPS[type(node.op)](), node.values)  # type: ignore[arg-type]
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        yield node.operand
    elif isinstance(node, ast.IfExp):
        yield ast.IfExp(node.test, node.orelse, node.body)
    elif isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        name = node.func.id if isinstance(node.func, ast.Name) else name
        if name in CALLS:
            func = ast.parse(ast.unparse(node.func)[: -len(name)] + CALLS[name], mode="eval").body
            yield ast.Call(func, node.args, node.keywords)


def _text(node: ast.BinOp) -> bool:
    """Return True for joined texts and paths."""
    sides = (node.left, node.right)
    return any(
        isinstance(s, ast.JoinedStr) or isinstance(getattr(s, "value", 0), str) for s in sides
    )


def mutants_of(path: Path) -> list[Mutant]:
    """Return every mutant of the functions of a file."""
    source = path.read_text(encoding="utf-8")
    lines, found = source.splitlines(), dict[tuple[int, int, int, int], list[Mutant]]()
    name = path.relative_to(ROOT).as_posix()
    for function in ast.walk(ast.parse(source)):
        body = function.body if isinstance(function, ast.FunctionDef) else []
        for node in _expressions(body):
            first, last = node.lineno, node.end_lineno or 0
            begin, end = node.col_offset, node.end_col_offset or 0
            head = lines[first - 1].encode()[:begin].decode()
            tail = lines[last - 1].encode()[end:].decode()
            old, texts = ast.unparse(node), [ast.unparse(other) for other in changed(node)]
            found[first, begin, last, end] = [
                Mutant(name, first, last, f"{head}({new}){tail}", f"{old[:60]} -> {new[:60]}")
                for new in texts
            ]
    return [mutant for mutants in found.values() for mutant in mutants]


def _expressions(body: Sequence[ast.stmt]) -> Iterator[ast.expr]:
    """Yield expressions below statements, without annotations, errors and texts."""
    open_nodes: list[ast.AST] = [*body]
    while open_nodes:
        node = open_nodes.pop()
        if isinstance(
            node, ast.Raise | ast.Assert | ast.JoinedStr | ast.FunctionDef | ast.ClassDef
        ):
            continue
        if isinstance(node, ast.expr):
            yield node
        open_nodes += [
            child
            for field, value in ast.iter_fields(node)
            if field not in ("annotation", "returns")
            for child in (value if isinstance(value, list) else [value])
            if isinstance(child, ast.AST)
        ]


def drawn(count: int, seed: int, under: Sequence[str], only: set[tuple[str, int]]) -> list[Mutant]:
    """Draw `count` mutants of different lines, in files below `under` and in the lines `only`."""
    files = [p for u in under for p in (sorted((ROOT / u).rglob("*.py")) or [ROOT / u])]
    pool = [m for path in files for m in mutants_of(path)]
    pool = [m for m in pool if not only or (m.file, m.first) in only]
    random.Random(seed).shuffle(pool)
    by_line = {(m.file, m.first): m for m in reversed(pool)}
    return [m for m in pool if by_line[m.file, m.first] is m][:count]


def changed_lines(reference: str) -> set[tuple[str, int]]:
    """Return (file, line) of the lines that differ from a commit."""
    command = ["git", "diff", "-U0", reference, "--", *PACKAGES]
    text = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    found, file = set[tuple[str, int]](), ""
    for line in text.splitlines():
        if line.startswith("+++ "):
            file = line[6:]
        elif line.startswith("@@"):
            begin, _, count = line.split("+")[1].split(" ")[0].partition(",")
            found |= {(file, int(begin) + k) for k in range(int(count or 1))}
    return found


def nearest(file: str) -> str:
    """Return the folder of tests that mirrors the folder of a file."""
    folder = Path("tests", *Path(file).parts[:-1])
    while not any((ROOT / folder).glob("test_*.py")):
        folder = folder.parent
    return folder.as_posix()


def pytest(tree: Path, tests: str, workers: int) -> str:
    """Return the first failure of the tests below `tests`, "" if they pass."""
    # compiled code of the user's cache is shared by hard links; a mutant adds only to its own
    with TemporaryDirectory(prefix="symfric-mutant-") as folder:
        cache = Path(os.environ.get("SYMFRIC_CACHE", Path.home() / ".cache" / "symfric"))
        own = Path(folder, "cache")
        if cache.is_dir() and cache.stat().st_dev == Path(folder).stat().st_dev:
            own.mkdir()
            for code in cache.iterdir():
                with suppress(OSError):  # removed meanwhile, by a compiler that works there
                    os.link(code, own / code.name)
        environment = os.environ | {
            "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1", "SYMFRIC_CACHE": str(own)
        }  # fmt: skip
        options = ["-q", "-x", "--no-header", "-p", "no:cacheprovider", "--dist", "loadfile"]
        command = [sys.executable, "-m", "pytest", *options, "-n", str(workers), tests]
        try:
            done = subprocess.run(
                command, cwd=tree, env=environment, capture_output=True, text=True, timeout=LIMIT,
                check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return "no end"
    if done.returncode in (0, 5):  # 5: no tests there
        return ""
    lines = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return (lines or [done.stdout.strip()[-100:] or done.stderr.strip()[-100:]])[0]


def outcome(mutant: Mutant, tree: Path, workers: int, near: bool) -> str:
    """Return the first test that sees the mutant, "" if none does."""
    path = tree / mutant.file
    source = path.read_text(encoding="utf-8")
    lines = source.splitlines(keepends=True)
    lines[mutant.first - 1 : mutant.last] = [mutant.new + "\n"]
    path.write_text("".join(lines), encoding="utf-8")
    try:
        folder = nearest(mutant.file)
        seen = pytest(tree, folder, workers)
        return seen or ("" if near else pytest(tree, "tests", workers))
    finally:
        path.write_text(source, encoding="utf-8")


def copied(folder: Path) -> Path:
    """Return a copy of the tree in `folder`."""
    ignore = shutil.ignore_patterns("__pycache__", ".*", "*.png", "*.gif", "made", "_build")
    for name in COPIED:
        shutil.copytree(ROOT / name, folder / name, ignore=ignore)
    for path in ROOT.iterdir():  # pages are tests, too
        if path.is_file():
            shutil.copy(path, folder)
    return folder


def main() -> int:
    """Run the mutants and print a table; 1 if one survives."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=random.randrange(10**6))
    parser.add_argument("--under", nargs="*", default=PACKAGES, help="folders or files")
    parser.add_argument("--changed", metavar="COMMIT", help="only lines that differ from COMMIT")
    parser.add_argument("--near", action="store_true", help="only the tests of the folder")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="for each mutant")
    given = parser.parse_args()
    only = changed_lines(given.changed) if given.changed else set[tuple[str, int]]()
    mutants, alive = drawn(given.count, given.seed, given.under, only), 0
    print(f"{len(mutants)} mutants of seed {given.seed}", flush=True)
    with TemporaryDirectory(prefix="symfric-mutants-") as folder:
        tree = copied(Path(folder))
        for m in mutants:
            seen = outcome(m, tree, given.workers, given.near)
            alive += not seen
            verdict = f"killed [{seen[:80]}]" if seen else "ALIVE "
            print(f"{verdict} {m.file}:{m.first} {m.what}", flush=True)
    print(f"{len(mutants) - alive} of {len(mutants)} mutants killed")
    return 1 if alive else 0


if __name__ == "__main__":
    raise SystemExit(main())
