"""Writes the pages that are made of the code; a page that is as it was is left alone."""

from collections.abc import Callable
from pathlib import Path

from docs.machine import (
    api_pages,
    bench_pages,
    command_pages,
    drawing,
    example_pages,
    gallery_pages,
    interop_page,
    law_pages,
    limit_pages,
    literature_pages,
    rst,
    scene_pages,
)
from docs.machine.pages import DOCS


def make_all(say: Callable[[str], None]) -> list[str]:
    """Write every page and draw what it shows; sentences about what failed."""
    write("laws", law_pages.pages())
    failed = drawing.draw_all("laws", law_pages.every(), drawing.law, say)
    write("scenes", scene_pages.pages())
    failed += drawing.draw_all("scenes", scene_pages.ALL_SCENES, scene_pages.draw, say)
    write("examples", example_pages.pages())
    write("reference", reference())
    write("benchmarks", {"index": bench_pages.page()})
    interop_page.write()
    failed += gallery_pages.make(say)
    write("gallery", gallery_pages.pages())
    return failed


def reference() -> dict[str, str]:
    """Python module by module, and the command line."""
    found = api_pages.pages()
    text = rst.title("Python")
    text += "Every public name, from its docstring.\n\n"
    text += rst.table(["module", "what it is for"], api_pages.index_rows())
    text += rst.pages(found, hidden="")
    return found | {
        "python": text,
        "commands": command_pages.page(),
        "limits": limit_pages.page(),
        "literature": literature_pages.page(),
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
