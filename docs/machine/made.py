"""Pictures that pages show, made by their own blocks or drawn, kept while the code stays."""

import ast
import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from docs.machine.pages import DOCS, ROOT, blocks, made_pictures, written_pages

PACKAGES = ("symfric", "ocp", "identification")
ASIDE = ("cli", "stress", "bench", "gallery", "embedded", "fmu")
"""Packages that pictures of laws, scenes and pages do not come from."""


@cache
def code_of(path: Path) -> str:
    """A Python file as its syntax tree, without docstrings, comments and places."""
    tree = ast.parse(path.read_text("utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            kept = [e for e in body if not _is_text(e)]
            node.body = kept or [ast.Pass()]  # pyright: ignore[reportAttributeAccessIssue]
    return ast.dump(tree)


def _is_text(statement: object) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


@cache
def code_hash() -> str:
    """Return the hash of all code that pictures depend on, without the excluded packages."""
    files = [p for name in PACKAGES for p in sorted((ROOT / name).rglob("*.py"))]
    kept = [p for p in files if p.relative_to(ROOT).parts[1] not in ASIDE]
    return digest(f"{p.relative_to(ROOT)} {code_of(p)}" for p in kept)


def digest(texts: Iterable[str]) -> str:
    """One short hash of several texts."""
    found = hashlib.sha256()
    for text in texts:
        found.update(text.encode())
        found.update(b"\0")
    return found.hexdigest()[:20]


def is_fresh(folder: Path, key: str) -> bool:
    """True if `folder` was made with `key`, or was made at all where pictures are kept."""
    stamp = folder / ".key"
    return stamp.is_file() and (kept() or stamp.read_text() == key)


def kept() -> bool:
    """True for SYMFRIC_DOCS=keep: pictures stay as they are, for those who write text."""
    return os.environ.get("SYMFRIC_DOCS", "") == "keep"


def stamped(folder: Path, key: str) -> None:
    """Remember that `folder` was made with `key`, once everything in it is there."""
    (folder / ".key").write_text(key)


MADE = DOCS / "made"
"""Pictures that the build makes, a folder per page; nothing of it is in the repository."""


def place(page: Path) -> Path:
    """The folder of the pictures that the blocks of `page` leave."""
    return MADE / "pages" / page.relative_to(DOCS).with_suffix("")


def make_page_pictures(say: Callable[[str], None]) -> list[str]:
    """Run the blocks of every page that shows a picture of its own; sentences about what failed."""
    stale: list[tuple[Path, str]] = []
    for page in written_pages():
        if not page.is_relative_to(DOCS):
            continue
        text = page.read_text("utf-8")
        wanted = made_pictures(text, page.parent)
        if not wanted:
            continue
        key = digest([code_hash(), *(b.body for b in blocks(text) if b.language == "python")])
        there = all((place(page) / name).exists() for name in wanted)
        if not (there and is_fresh(place(page), key)):
            stale.append((page, key))
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        found = pool.map(lambda item: _make(*item, say), stale)
        return [sentence for sentence in found if sentence]


def _make(page: Path, key: str, say: Callable[[str], None]) -> str:
    folder = place(page)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    say(f"running {page.relative_to(ROOT)}")
    done = subprocess.run(
        [sys.executable, "-m", "docs.machine.pages", str(page), str(folder)],
        cwd=ROOT,
        env=os.environ | {"MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        return f"{page.relative_to(ROOT)}: its blocks fail:\n{done.stderr}"
    stamped(folder, key)
    return ""


def draw_all(
    room: str, names: Iterable[str], draw: Callable[[str, Path], None], say: Callable[[str], None]
) -> list[str]:
    """Let `draw(name, folder)` draw each of `names` into a folder; sentences about what failed."""
    folder, names = MADE / room, list(names)
    key = digest([code_hash(), room, *names])
    if is_fresh(folder, key) and all((folder / f"{name}.png").exists() for name in names):
        return []
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    say(f"drawing {len(names)} pictures of {room}")
    workers = min(os.cpu_count() or 1, len(names))
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        failed = [f for f in pool.map(partial(_drawn, draw, folder), names) if f]
    if not failed:
        stamped(folder, key)
    return failed


def _drawn(draw: Callable[[str, Path], None], folder: Path, name: str) -> str:
    try:
        draw(name, folder)
    except Exception as error:  # noqa: BLE001  (one picture that fails leaves the others)
        return f"{folder.name} '{name}': {type(error).__name__}: {error}"
    return ""


def law(name: str, folder: Path) -> None:
    """The picture of a law that `symfric laws NAME --plot` draws, and a small one."""
    from symfric import any_from_text  # noqa: PLC0415  (in the process that draws)
    from symfric.figures.pictures import plot_laws  # noqa: PLC0415

    chosen = any_from_text(name)
    plot_laws({name: chosen}, path=folder / f"{name}.png")
    small(chosen, folder / f"{name}_small.png")


def small(law: Any, path: Path) -> None:
    """Force in steady sliding around rest, without numbers."""
    import numpy as np  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    from symfric.figures.pictures import window  # noqa: PLC0415
    from symfric.laws import steady_force  # noqa: PLC0415

    edge = window(law, 1.0)
    v = np.linspace(-edge, edge, 1001)
    figure = Figure(figsize=(2.2, 1.4), layout="constrained")
    axis = figure.add_subplot()
    axis.plot(v, steady_force(law, v, 1.0), linewidth=2)
    axis.axhline(0.0, color="0.7", linewidth=0.8, zorder=0)
    axis.axvline(0.0, color="0.7", linewidth=0.8, zorder=0)
    axis.set_xticks([])
    axis.set_yticks([])
    figure.savefig(path, dpi=110)
