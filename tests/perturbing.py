"""A process that changes one number or law of the source by 5 % and asks the gallery what it says.

Run as a script: it reads jobs as lines of JSON, forks for each, and answers with a line each. What
is changed is imported by the child alone, so that no cache holds what was computed before.
"""

import ast
import json
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from importlib import import_module
from importlib.machinery import SourceFileLoader
from multiprocessing import get_context
from pathlib import Path
from types import CodeType

ROOT = Path(__file__).parents[1]
FACTOR = 1.05


@dataclass(frozen=True)
class Job:
    """One change: the `place`-th number of an assignment in a file, or the `method` of a law.

    Attributes:
        file: below the root of the repository.
        name: what is assigned, or the class of the law.
        place: which number in it; -1 for a law.
        method: of the law.
        figures: beginnings of the names of the figures that depend on it.
    """

    file: str
    name: str
    place: int
    method: str
    figures: tuple[str, ...]

    def __str__(self) -> str:
        what = f"{self.name}.{self.method}" if self.method else f"{self.name}[{self.place}]"
        return f"{self.file}: {what}"


def numbers(source: str, name: str) -> Iterator[ast.Constant]:
    """The numbers in the assignments to `name`, also in a class, in the order of the text.

    "Class.name" is that of one class.
    """
    owner, _, name = name.rpartition(".")
    tree: ast.AST = ast.parse(source)
    if owner:
        classes = (n for n in ast.walk(tree) if isinstance(n, ast.ClassDef))
        tree = next(n for n in classes if n.name == owner)
    for node in ast.walk(tree):
        if not isinstance(node, ast.Assign | ast.AnnAssign) or not node.value:
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        if name not in {n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)}:
            continue
        found = [n for n in ast.walk(node.value) if isinstance(n, ast.Constant)]
        found = [n for n in found if type(n.value) in (int, float) and n.value]
        yield from sorted(found, key=lambda n: (n.lineno, n.col_offset))


def changed(job: Job) -> str:
    """The source of the file with the change."""
    source = (ROOT / job.file).read_text("utf-8")
    if job.method:
        return f"{source}\n{LAW.format(law=job.name, method=job.method, factor=FACTOR)}"
    number = [*numbers(source, job.name)][job.place]
    lines = source.splitlines(keepends=True)
    line = lines[number.lineno - 1].encode()
    assert isinstance(number.value, int | float)
    assert number.end_col_offset is not None
    text = repr(number.value * FACTOR).encode()
    line = line[: number.col_offset] + text + line[number.end_col_offset :]
    lines[number.lineno - 1] = line.decode()
    return "".join(lines)


LAW = """
_before = {law}.{method}
{law}.{method} = lambda self, *a, **k: {factor} * _before(self, *a, **k)
"""


def verdict(job: Job, quick: bool) -> str:
    """Return which figure fails, and its message; empty if all are drawn as before."""
    get_code, file = SourceFileLoader.get_code, str(ROOT / job.file)

    def code(loader: SourceFileLoader, name: str) -> CodeType | None:
        if loader.path == file:
            return compile(changed(job), file, "exec", dont_inherit=True)
        return get_code(loader, name)

    SourceFileLoader.get_code = code
    name = "importing"
    try:
        gallery = import_module("symfric.gallery")
        for name in gallery.chosen(job.figures):
            gallery.script(name)(quick=quick)
    except Exception as error:  # noqa: BLE001  (a figure that cannot be drawn is a verdict)
        return f"{name}: {type(error).__name__}: {' '.join(str(error).split())[:400]}"
    return ""


def forked(job: Job, quick: bool) -> str:
    """Return the verdict of a child process."""
    with ProcessPoolExecutor(1, get_context("fork")) as pool:
        try:
            return pool.submit(verdict, job, quick).result()
        except BrokenProcessPool as error:
            return str(error)


def main() -> None:
    """Answer the jobs of the standard input."""
    sys.path.insert(0, str(ROOT))
    for name in ("numpy", "casadi", "scipy.integrate", "scipy.optimize", "matplotlib.figure"):
        import_module(name)
    for line in sys.stdin:
        given = json.loads(line)
        job = Job(**given | {"figures": tuple(given["figures"])})
        reported = forked(job, quick=sys.argv[1] == "quick")
        print(json.dumps(given | {"verdict": reported}), flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
