"""HTML of notebooks as a strict reader sees it, and what a screen holds."""

from base64 import b64decode
from html.parser import HTMLParser

from symfric.foundation.shown import HEIGHT, WIDTH

EMPTY = {"meta", "img", "path", "rect", "br"}


class Balanced(HTMLParser):
    """Every element is closed where it should be; cells of tables, and addresses."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.cells: list[str] = []
        self.sources: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.sources += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert tag in EMPTY or self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in ("td", "th"):
            self.cells.append(data)


class Page(Balanced):
    """All tags, pictures and text; nothing in it runs."""

    def __init__(self, text: str) -> None:
        self.tags: set[str] = set()
        self.words = ""
        super().__init__(text)
        parts = [source.partition(",") for source in self.sources]
        assert all(kind == "data:image/png;base64" for kind, _, _ in parts)
        self.pictures = [b64decode(data) for _, _, data in parts]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        super().handle_starttag(tag, attrs)
        self.tags.add(tag)
        assert not any(name.startswith("on") for name, _ in attrs)

    def handle_data(self, data: str) -> None:
        super().handle_data(data)
        self.words += data


def parsed(text: str) -> Page:
    page = Page(text)
    assert page.tags <= {"div", "b", "table", "thead", "tbody", "tr", "th", "td", "img"}
    assert all(picture.startswith(b"\x89PNG") for picture in page.pictures)
    return page


def shown(thing: object) -> Page:
    """What a notebook shows of `thing`."""
    return parsed(getattr(thing, "_repr_html_")())  # noqa: B009


def on_a_screen(text: str) -> bool:
    lines = text.splitlines()
    return len(lines) <= HEIGHT and max(map(len, lines)) <= WIDTH
