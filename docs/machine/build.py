"""Everything that pages show: outputs and pictures of their blocks, drawings, figures of papers.

Results are kept in `docs/made` until the code or the blocks change; docstrings and comments do not
count. SYMFRIC_DOCS=quick computes figures of the papers at reduced size, SYMFRIC_DOCS=keep keeps
all results.
"""

import ast
import hashlib
import inspect
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from docs.machine import items, lists, measure, sliders
from docs.machine.items import cards
from docs.machine.markdown import block, contents, directive, opening, plain, table
from docs.machine.pages import DOCS, ROOT, blocks, made_pictures, written_pages
from symfric.gallery import scripts
from symfric.gallery.rendering import read, render

MADE = DOCS / "made"
"""Results of the build, not in the repository."""
GALLERY = MADE / "gallery"
KEYS = GALLERY / "keys.json"
ELSEWHERE = ("cli", "stress", "bench", "gallery", "embedded", "fmu")
"""Packages of symfric that do not affect pictures of laws, scenes and pages."""
Say = Callable[[str], None]


def make_all(say: Say) -> list[str]:
    """Write every page and compute its contents; return a text for each failure."""
    write("laws", items.law_pages())
    write("scenes", items.scene_pages())
    write("examples", lists.example_pages())
    write("reference", lists.reference_pages())
    write("benchmarks", {"index": measure.page()})
    write("made/tables", measure.tables())
    failed = run_pages(say)
    failed += draw("laws", items.every(), items.draw_law, say)
    failed += draw("scenes", items.ALL_SCENES, items.draw_scene, say)
    failed += draw("sliders", items.ALL_LAWS, sliders.draw_sliders, say, ".html", sliders.TEXT)
    failed += make_gallery(say)
    write("gallery", gallery_pages())
    return failed


def write(folder: str, pages: Mapping[str, str]) -> None:
    """Write pages that changed into a folder, and remove those of an earlier build."""
    wanted = {DOCS / folder / f"{name}.md": text for name, text in pages.items()}
    for path, text in wanted.items():
        if not path.exists() or path.read_text("utf-8") != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, "utf-8")
    for path in (DOCS / folder).rglob("*.md"):
        if path not in wanted:
            path.unlink()


# ---- results are stale if their key changed ----


def mode(name: str) -> bool:
    """Return True if SYMFRIC_DOCS is `name`."""
    return os.environ.get("SYMFRIC_DOCS", "") == name


@cache
def code_of(path: Path) -> str:
    """Return a Python file as its syntax tree, without docstrings, comments and positions."""
    tree = ast.parse(path.read_text("utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [  # pyright: ignore[reportAttributeAccessIssue]
                statement for statement in body
                if not (isinstance(statement, ast.Expr)
                        and isinstance(statement.value, ast.Constant)
                        and isinstance(statement.value.value, str))
            ] or [ast.Pass()]  # fmt: skip
    return ast.dump(tree)


@cache
def code_key() -> str:
    """Return the key of all code that pictures depend on."""
    files = [p for name in lists.PACKAGES for p in sorted((ROOT / name).rglob("*.py"))]
    kept = [p for p in files if p.relative_to(ROOT).parts[1] not in ELSEWHERE]
    return digest(f"{p.relative_to(ROOT)} {code_of(p)}" for p in kept)


def digest(texts: Iterable[str]) -> str:
    """Return one short hash of several texts."""
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:20]


def is_fresh(folder: Path, key: str, pictures: Iterable[str] = ()) -> bool:
    """Return True if `folder` was made with `key`, or at all if results are kept."""
    stamp = folder / ".key"
    there = stamp.is_file() and all((folder / name).exists() for name in pictures)
    return there and (mode("keep") or stamp.read_text() == key)


def emptied(folder: Path) -> Path:
    """Return an empty folder."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


# ---- blocks of pages ----


def place(page: Path) -> Path:
    """Return the folder in which the blocks of `page` run."""
    return MADE / "pages" / page.relative_to(DOCS).with_suffix("")


def run_pages(say: Say) -> list[str]:
    """Run the blocks of every page but the README; return those that fail or print other text."""
    stale: list[tuple[Path, str]] = []
    for page in written_pages():
        text = page.read_text("utf-8")
        code = [b for b in blocks(text) if b.language in ("python", "console")]
        if code and page.is_relative_to(DOCS):
            key = digest([code_key(), *(f"{b.body}{b.prints}" for b in code)])
            if not is_fresh(place(page), key, made_pictures(text, page.parent)):
                stale.append((page, key))
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        return [failure for failure in pool.map(partial(_run_page, say), stale) if failure]


def _run_page(say: Say, task: tuple[Path, str]) -> str:
    (page, key), name = task, str(task[0].relative_to(ROOT))
    say(f"running {name}")
    folder = emptied(place(page))
    done = subprocess.run(
        [sys.executable, "-m", "docs.machine.pages", str(page), str(folder)],
        cwd=ROOT,
        env=os.environ | {"MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        return f"{name}: its blocks fail or print other text:\n{done.stderr}"
    (folder / ".key").write_text(key)
    return ""


# ---- drawings of laws and scenes ----


def draw(
    kind: str, names: Iterable[str], function: Callable[[str, Path], None], say: Say,
    ending: str = ".png", text: str = "",
) -> list[str]:  # fmt: skip
    """Let `function(name, folder)` draw each of `names`; return a text for each failure.

    Args:
        ending: ending of the name of each result.
        text: what the results contain, besides what code makes.
    """
    folder, names = MADE / kind, list(names)
    key = digest([code_key(), code_of(Path(inspect.getfile(function))), kind, text, *names])
    if is_fresh(folder, key, (f"{name}{ending}" for name in names)):
        return []
    say(f"drawing {len(names)} pictures of {kind}")
    workers = min(os.cpu_count() or 1, len(names))
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        failed = [*filter(None, pool.map(partial(_drawn, function, emptied(folder)), names))]
    if not failed:
        (folder / ".key").write_text(key)
    return failed


def _drawn(function: Callable[[str, Path], None], folder: Path, name: str) -> str:
    try:
        function(name, folder)
    except Exception as error:  # noqa: BLE001  (one picture that fails leaves the others)
        return f"{folder.name} '{name}': {type(error).__name__}: {error}"
    return ""


# ---- figures of the papers ----


def keys() -> dict[str, str]:
    """Return the key of each figure: library, shared code, code and text of its paper, size."""
    gallery = ROOT / "symfric" / "gallery"
    shared = [code_of(p) for p in sorted(gallery.glob("*.py"))]
    papers = {
        folder: digest([code_key(), *shared, str(mode("quick")),
                        *(p.read_text("utf-8") for p in sorted((gallery / folder).glob("*.py")))])
        for folder in {name.partition("/")[0] for name in scripts()}
    }  # fmt: skip
    return {name: papers[name.partition("/")[0]] for name in scripts()}


def make_gallery(say: Say) -> list[str]:
    """Compute the figures that changed; return a text for each failure."""
    GALLERY.mkdir(parents=True, exist_ok=True)
    before: dict[str, str] = json.loads(KEYS.read_text()) if KEYS.exists() else {}
    now, there = keys(), read(GALLERY)
    stale = {name for name, key in now.items() if before.get(name) != key and not mode("keep")}
    changed = [name for name in now if name in stale or name not in there]
    if not changed:
        return []
    say(f"computing {len(changed)} figures of the papers{' at reduced size' * mode('quick')}")
    tenths = set(range(1, 10))

    def tell(fraction: float) -> None:
        if (tenth := int(10 * fraction)) in tenths:
            tenths.remove(tenth)
            say(f"{10 * tenth} % of the figures")

    done = render(GALLERY, changed, quick=mode("quick"), progress=tell)
    good = {n: k for n, k in now.items() if n not in changed or n in done.records}
    KEYS.write_text(json.dumps(good, indent=1))
    if done.left:
        raise KeyboardInterrupt  # `render` returns the finished figures after Ctrl-C
    return [f"gallery '{name}': {why}" for name, why in done.failures.items()]


def gallery_pages() -> dict[str, str]:
    """Return the text of each page, by its name relative to `gallery`."""
    records = read(GALLERY)
    papers: dict[str, list[Mapping[str, Any]]] = {}
    for record in records.values():
        papers.setdefault(record["paper"], []).append(record)
    text = opening("gallery")
    if mode("quick"):
        text += directive("note", "", "These figures are computed at reduced size.")
    for paper, own in papers.items():
        head = re.split(r", (?:doi|J\.|[A-Z]\w+ [\d(])", paper)[0]
        text += f"## {plain(head)}\n\n" + (f"*{plain(paper)}*\n\n" if paper != head else "")
        text += f"{plain(own[0]['note'])}\n\n" * bool(own[0]["note"])
        text += cards(
            ((f"/made/gallery/{r['picture']}", r["name"], r["figure"], r["title"]) for r in own),
            "cards wide",
        )
        rows = [
            [f"[{r['figure']}]({r['name']}.md)", plain(r["title"]),
             plain(f"{r['how_far']}: {r['measure']}")]
            for r in own
        ]  # fmt: skip
        text += table(["figure", "content", "distance"], rows, "options")
        text += contents(r["name"] for r in own)
    return {name: figure_page(record) for name, record in records.items()} | {"index": text}


def figure_page(record: Mapping[str, Any]) -> str:
    """Return the page of one figure."""
    text = (
        f"# {plain(record['figure'])}. {plain(record['title'])}\n\n*{plain(record['paper'])}*\n\n"
    )
    text += "".join(f"{plain(p)}\n\n" for p in record["text"].split("\n\n") if p)
    if record["quick"]:
        text += directive("note", "", "Computed at reduced size; verdicts hold for the full size.")
    file = f"/made/gallery/{record['picture']}"
    text += directive("figure", file, alt=plain(record["title"]))
    parts = {
        "Compared": record["compared"],
        "Distance": f"{record['how_far']}: {record['measure']}",
        **{kind.capitalize(): words for kind, words in record["verdicts"].items()},
    }
    text += "".join(f"**{name}.** {plain(words)}\n\n" for name, words in parts.items())
    if record.get("checked"):
        text += "The computation of this figure checks these claims on the numbers below:\n\n"
        text += "".join(f"* {plain(claim)}\n" for claim in record["checked"]) + "\n"
    rows = [[plain(name), f"{value:.6g}"] for name, value in record["numbers"].items()]
    if rows:
        text += "## Numbers\n\n" + table((), rows)
    source = ROOT.joinpath(*scripts()[record["name"]].split(".")).with_suffix(".py")
    function = without_docstring(source.read_text("utf-8"), record["name"].rpartition("/")[2])
    return text + f"## Script\n\n`{source.relative_to(ROOT)}`\n\n" + block(function, "python")


def without_docstring(source: str, function: str) -> str:
    """Return the source of a function without its docstring, which is the text of the page."""
    found = next(
        n for n in ast.parse(source).body if isinstance(n, ast.FunctionDef) and n.name == function
    )
    first, lines = found.body[0], source.splitlines(keepends=True)
    documented = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    begin = first.end_lineno if documented else first.lineno - 1
    return "".join(lines[found.lineno - 1 : first.lineno - 1] + lines[begin : found.end_lineno])
