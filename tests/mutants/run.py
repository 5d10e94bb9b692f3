"""`make mutants`: change one line at a time, and see whether the tests named for it fail.

Each mutant of `mutants.py` is applied to a copy of the tree; the tests named beside it must fail
there and pass without it. Ends with status 1 if a mutant survives, if its old text is no longer
found exactly once, or if its tests fail without it.
"""

import argparse
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryDirectory

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
sys.path[0] = str(HERE.parent)  # where its folder is the package

from mutants.mutant import Mutant  # noqa: E402  (a script finds its neighbours)
from mutants.mutants import MUTANTS  # noqa: E402

PACKAGES = ("symfric", "ocp", "identification", "tests", "examples", "docs")
LIMIT = 120.0
"""Seconds after which tests count as hanging, which kills a mutant, too."""


def copied(folder: Path) -> Path:
    """A copy of the tree in `folder`."""
    ignore = shutil.ignore_patterns("__pycache__", ".*", "*.png", "*.gif", "made", "_build")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, folder / name, ignore=ignore)
    for name in ("pyproject.toml", "README.md"):  # a page is a test, too
        shutil.copy(ROOT / name, folder)
    return folder


def pytest(tree: Path, tests: Sequence[str], limit: float = LIMIT) -> tuple[int | None, str]:
    """Exit status of the tests in `tree`, None where they find no end, and their last line."""
    # nothing made by one mutant, be it bytecode or compiled C, may meet another
    with TemporaryDirectory(prefix="symfric-mutant-cache-") as cache:
        environment = os.environ | {
            "PYTHONPATH": str(tree),
            "PYTHONDONTWRITEBYTECODE": "1",
            "SYMFRIC_CACHE": cache,
        }
        options = ("-q", "-x", "--no-header", "-p", "no:cacheprovider")
        try:
            done = subprocess.run(
                [sys.executable, "-m", "pytest", *options, *tests], cwd=tree, env=environment,
                capture_output=True, text=True, timeout=limit, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return None, "no end"
    lines = [line for line in done.stdout.strip().splitlines() if line]
    failed = next((line for line in lines if line.startswith(("FAILED", "ERROR"))), "")
    return done.returncode, failed or (lines[-1] if lines else done.stderr.strip()[-200:])


def outcome(mutant: Mutant, tree: Path) -> tuple[bool, str]:
    """Whether the tests see the mutant, and what they say."""
    path = tree / mutant.file
    text = path.read_text(encoding="utf-8")
    if text.count(mutant.old) != 1:
        return False, f"old text found {text.count(mutant.old)} times"
    path.write_text(text.replace(mutant.old, mutant.new), encoding="utf-8")
    try:
        status, said = pytest(tree, mutant.tests)
    finally:
        path.write_text(text, encoding="utf-8")
    if status not in (None, 0, 1):
        return False, f"the tests did not run: {said}"
    return status != 0, "survives" if status == 0 else said


def outcomes(mutants: Sequence[Mutant], trees: Sequence[Path]) -> Iterator[tuple[bool, str]]:
    """Outcomes in the order of the mutants, as many at once as there are trees."""
    free: SimpleQueue[Path] = SimpleQueue()
    for tree in trees:
        free.put(tree)

    def one(mutant: Mutant) -> tuple[bool, str]:
        tree = free.get()
        try:
            return outcome(mutant, tree)
        finally:
            free.put(tree)

    with ThreadPoolExecutor(len(trees)) as pool:
        yield from pool.map(one, mutants)


def main() -> int:
    """Run all mutants, or those whose name holds a text, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("names", nargs="*", help="texts; only mutants whose name holds one")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    chosen = [m for m in MUTANTS if not given.names or any(n in m.name for n in given.names)]
    tests = sorted({test for m in chosen for test in m.tests})
    alive = 0
    with TemporaryDirectory(prefix="symfric-mutants-") as folder:
        trees = [copied(Path(folder) / str(k)) for k in range(max(1, given.workers))]
        status, said = pytest(trees[0], tests, LIMIT * len(tests))
        if status != 0:
            print(f"the tests fail without any mutant: {said}")
            return 1
        for m, (killed, said) in zip(chosen, outcomes(chosen, trees), strict=True):
            alive += not killed
            print(f"{'killed' if killed else 'ALIVE':<7} {m.name:<52} {said[:100]}", flush=True)
    print(f"{len(chosen) - alive} of {len(chosen)} mutants killed")
    return 1 if alive else 0


if __name__ == "__main__":
    raise SystemExit(main())
