"""Writes the pages that are made of the code; a page that is as it was is left alone."""

import ast
import json
import os
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from docs.machine import items, lists, made, measure, rst
from docs.machine.made import MADE, code_hash, code_of, digest, kept
from docs.machine.names import linked
from docs.machine.pages import DOCS, ROOT
from docs.machine.rst import sentence
from symfric.gallery import scripts
from symfric.gallery.rendering import read, render

FOLDER = MADE / "gallery"
KEYS = FOLDER / "keys.json"
ASIDE = ROOT / "symfric" / "gallery" / "pages.py"
"""The page that `symfric gallery` writes, of which ours are not made."""


def quick() -> bool:
    """True if figures are computed at reduced size."""
    return os.environ.get("SYMFRIC_DOCS", "") == "quick"


def keys() -> dict[str, str]:
    """Plate -> what it depends on: the library, what the gallery shares, its paper, its size."""
    found: dict[str, str] = {}
    shared = [code_of(p) for p in sorted((ROOT / "symfric" / "gallery").glob("*.py")) if p != ASIDE]
    figures = {
        ROOT.joinpath(*module.split(".")).with_suffix(".py") for module in scripts().values()
    }
    for name, module in scripts().items():
        file = ROOT.joinpath(*module.split(".")).with_suffix(".py")
        own = [code_of(p) for p in sorted(file.parent.glob("*.py")) if p not in figures]
        said = [path.read_text("utf-8") for path in (file, file.parent / "__init__.py")]
        found[name] = digest([code_hash(), *shared, *own, *said, str(quick())])
    return found


def make_gallery(say: Callable[[str], None]) -> list[str]:
    """Compute the figures that changed; sentences about what failed."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    before: dict[str, str] = json.loads(KEYS.read_text()) if KEYS.exists() else {}
    now, there = keys(), read(FOLDER)
    stale = {name for name, key in now.items() if before.get(name) != key and not kept()}
    changed = [name for name in now if name in stale or name not in there]
    if not changed:
        return []
    say(f"computing {len(changed)} figures of the papers{' at reduced size' * quick()}")
    told = {0}

    def tell(fraction: float) -> None:
        tenths = int(10 * fraction)
        if tenths not in told:
            told.add(tenths)
            say(f"{10 * tenths} % of the figures")

    done = render(FOLDER, changed, quick=quick(), progress=tell)
    good = {n: k for n, k in now.items() if n not in changed or n in done.records}
    KEYS.write_text(json.dumps(good, indent=1))
    if done.left:
        raise KeyboardInterrupt  # which `render` takes, keeping what is done
    return [f"gallery '{name}': {why}" for name, why in done.failures.items()]


def gallery_pages() -> dict[str, str]:
    """Name of each page, relative to `gallery`, -> its text."""
    records = read(FOLDER)
    papers: dict[str, list[Mapping[str, Any]]] = {}
    for record in records.values():
        papers.setdefault(record["paper"], []).append(record)
    found = {name: figure_page(record) for name, record in records.items()}
    return found | {"index": gallery_index(papers)}


def gallery_index(papers: Mapping[str, list[Mapping[str, Any]]]) -> str:
    """All figures by paper, with how far we are."""
    text = rst.title("Figures of the papers")
    text += (
        "Figures of the papers that the laws come from, computed again. Beside each: what is "
        "compared, how far we are, and three kinds of verdicts: an observation of the paper is "
        "reproduced, an explanation is refuted, or the text does not decide. ``symfric gallery`` "
        "computes them on your machine.\n\n"
    )
    if quick():
        text += rst.directive("note", "", "These figures are computed at reduced size.\n")
    for paper, records in papers.items():
        head = re.split(r", (?:doi|J\.|[A-Z]\w+ [\d(])", paper)[0]
        text += rst.title(head, "-") + (f"*{rst.plain(paper)}*\n\n" if paper != head else "")
        text += f"{sentence(records[0]['note'], linked)}\n\n" * bool(records[0]["note"])
        text += gallery_cards(records)
        rows = [
            [
                f":doc:`{r['figure']} <{r['name']}>`",
                sentence(r["title"], linked),
                f"{rst.plain(r['how_far'])}: {sentence(r['measure'], linked)}",
            ]
            for r in records
        ]
        text += rst.table(["figure", "what it shows", "how far we are"], rows, "options")
        text += rst.pages((r["name"] for r in records), hidden="")
    return text


def gallery_cards(records: Iterable[Mapping[str, Any]]) -> str:
    """The pictures of a paper, each leading to its page."""
    body = "".join(
        rst.directive(
            "figure", f"/made/gallery/{r['picture']}", rst.plain(r["figure"]) + "\n",
            target=f"{r['name']}.html", alt=rst.plain(r["title"]),
        )
        for r in records
    )  # fmt: skip
    return rst.directive("container", "cards wide", body)


def figure_page(record: Mapping[str, Any]) -> str:
    """One figure."""
    text = rst.title(f"{record['figure']}. {record['title']}")
    text += f"*{rst.plain(record['paper'])}*\n\n"
    text += "".join(f"{sentence(p, linked)}\n\n" for p in record["text"].split("\n\n") if p)
    if record["quick"]:
        text += rst.directive(
            "note", "", "Computed at reduced size; the verdicts rest on the full one.\n"
        )
    text += rst.directive(
        "figure", f"/made/gallery/{record['picture']}", alt=rst.plain(record["title"])
    )
    said = {
        "Compared": record["compared"],
        "How far we are": f"{record['how_far']}: {record['measure']}",
        **{kind.capitalize(): words for kind, words in record["verdicts"].items()},
    }
    for name, words in said.items():
        text += f"**{name}.** {sentence(words, linked)}\n\n"
    if record.get("checked"):
        text += "Checked on the numbers below whenever this figure is computed:\n\n"
        text += "".join(f"* {sentence(claim, linked)}\n" for claim in record["checked"]) + "\n"
    rows = [[rst.plain(name), f"{value:.6g}"] for name, value in record["numbers"].items()]
    if rows:
        text += rst.title("Numbers", "-") + rst.table((), rows)
    module = scripts()[record["name"]]
    source = ROOT.joinpath(*module.split(".")).with_suffix(".py")
    text += rst.title("Script", "-") + f"``{source.relative_to(ROOT)}``\n\n"
    function = record["name"].rpartition("/")[2]
    return text + rst.literal(without_docstring(source.read_text("utf-8"), function), "python")


def without_docstring(source: str, function: str) -> str:
    """The source of a function without its docstring, which stands above it already."""
    found = next(
        n for n in ast.parse(source).body if isinstance(n, ast.FunctionDef) and n.name == function
    )
    first, lines = found.body[0], source.splitlines(keepends=True)
    said = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    begin = first.end_lineno if said else first.lineno - 1
    return "".join(lines[found.lineno - 1 : first.lineno - 1] + lines[begin : found.end_lineno])


def make_all(say: Callable[[str], None]) -> list[str]:
    """Write every page and draw what it shows; sentences about what failed."""
    write("laws", items.law_pages())
    failed = made.draw_all("laws", items.every(), made.law, say)
    write("scenes", items.scene_pages())
    failed += made.draw_all("scenes", items.ALL_SCENES, items.draw_scene, say)
    write("examples", lists.example_pages())
    write("reference", reference())
    write("benchmarks", {"index": measure.page()})
    measure.write_interop()
    failed += make_gallery(say)
    write("gallery", gallery_pages())
    return failed


def reference() -> dict[str, str]:
    """Python module by module, and the command line."""
    found = lists.reference_pages()
    text = rst.title("Python")
    text += "Every public name, from its docstring.\n\n"
    text += rst.table(["module", "what it is for"], lists.reference_rows())
    text += rst.pages(found, hidden="")
    return found | {
        "python": text,
        "commands": lists.command_page(),
        "limits": lists.limit_page(),
        "literature": lists.literature_page(),
    }


def write(room: str, pages: dict[str, str]) -> None:
    """Write pages into a folder, and take away those of before."""
    folder = DOCS / room
    folder.mkdir(exist_ok=True)
    for name, text in pages.items():
        path = folder / f"{name}.rst"
        if not path.exists() or path.read_text("utf-8") != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, "utf-8")
    for path in stale(folder, pages):
        path.unlink()


def stale(folder: Path, pages: dict[str, str]) -> list[Path]:
    """Pages of an earlier build that are none any more."""
    wanted = {folder / f"{name}.rst" for name in pages}
    return [path for path in folder.rglob("*.rst") if path not in wanted]
