"""Checks every link of the built pages: `python -m docs.machine.links out/docs`.

A link within the pages must lead to a file, and to a place in it; one that leaves them must be well
formed. Nothing that a page loads (scripts, styles, fonts, pictures) may come from the network.
"""

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from typing import final
from urllib.parse import unquote, urlsplit

LOADED = {("script", "src"), ("link", "href"), ("img", "src"), ("iframe", "src"), ("source", "src")}
"""What a browser fetches by itself."""
NETWORK = re.compile(r"(?:url\(\s*['\"]?|@import\s+['\"])((?:https?:)?//[^'\")\s]+)")


@final
@dataclass
class Found(HTMLParser):
    """Content of a page: places that links lead to, and its links with the tags that load them."""

    places: set[str] = field(default_factory=set[str])
    links: list[tuple[str, str, str]] = field(default_factory=list[tuple[str, str, str]])

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note places and links."""
        for name, value in attrs:
            if name == "id" or (name == "name" and tag == "a"):
                self.places.add(value or "")
            elif name in ("href", "src") and value is not None:
                self.links.append((tag, name, value))


def problems(folder: Path) -> Iterator[str]:
    """A sentence about each link that leads nowhere."""
    pages: dict[Path, Found] = {}
    for path in sorted(folder.rglob("*.html")):
        pages[path] = Found()
        pages[path].feed(path.read_text("utf-8"))
    for path, page in pages.items():
        where = str(path.relative_to(folder))
        for tag, name, link in page.links:
            trouble = _trouble(path, (tag, name), link, pages)
            if trouble:
                yield f"{where}: {link}: {trouble}"
    for path in sorted(folder.rglob("*.css")):
        for link in NETWORK.findall(path.read_text("utf-8")):
            yield f"{path.relative_to(folder)}: {link}: loaded from the network"


def _trouble(page: Path, kind: tuple[str, str], link: str, pages: dict[Path, Found]) -> str:
    parts = urlsplit(link)
    if parts.scheme == "data":
        return ""
    if parts.scheme or parts.netloc:
        if kind in LOADED:
            return "loaded from the network"
        good = parts.scheme == "mailto" or (
            parts.scheme in ("http", "https") and re.fullmatch(r"[\w-]+(\.[\w-]+)+", parts.netloc)
        )
        return "" if good else "no well-formed address"
    target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
    if not target.is_file():
        return "no such file"
    place = unquote(parts.fragment)
    if place and target in pages and place not in pages[target].places:
        return "no such place in that page"
    return ""


def main(folder: Path) -> int:
    """Print every problem; 0 if there is none."""
    folder = folder.resolve()
    pages = len([*folder.rglob("*.html")])
    if not pages:
        print(f"links: no pages in {folder}; run make docs first")
        return 1
    found = [*problems(folder)]
    for sentence in found:
        print(f"links: {sentence}")
    print(f"links: {pages} pages, {len(found)} links lead nowhere")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
