"""Make what pages show: pictures of their own blocks, kept while nothing they come from changed."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from docs.machine.pages import DOCS, ROOT, blocks, made_pictures, written_pages
from docs.machine.stamp import code_hash, digest, is_fresh, stamped

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
        [sys.executable, "-m", "docs.machine.run", str(page), str(folder)],
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
