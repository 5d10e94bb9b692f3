"""HTML of notebooks as a strict reader sees it, and what a screen holds."""

from base64 import b64decode
from html.parser import HTMLParser

from symfric.foundation.shown import HEIGHT, WIDTH


class Page(HTMLParser):
    """Tags that are open at the end, all tags, pictures and text."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.pictures: list[bytes] = []
        self.words = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        given = dict(attrs)
        if tag == "img":
            kind, _, data = str(given["src"]).partition(",")
            assert kind == "data:image/png;base64"
            self.pictures.append(b64decode(data))
        else:
            self.open.append(tag)
        assert not any(name.startswith("on") for name in given)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words += data


def parsed(text: str) -> Page:
    page = Page(text)
    assert not page.open
    assert page.tags <= {"div", "b", "table", "thead", "tbody", "tr", "th", "td", "img"}
    assert all(picture.startswith(b"\x89PNG") for picture in page.pictures)
    return page


def shown(thing: object) -> Page:
    """What a notebook shows of `thing`."""
    return parsed(getattr(thing, "_repr_html_")())  # noqa: B009


def on_a_screen(text: str) -> bool:
    lines = text.splitlines()
    return len(lines) <= HEIGHT and max(map(len, lines)) <= WIDTH
