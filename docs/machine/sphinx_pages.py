"""Pages of the documentation: pictures that blocks make, and pages made of the code itself."""

from pathlib import Path
from typing import Any

from sphinx.util import logging

from docs.machine.making import MADE, make_page_pictures, place
from docs.machine.pages import DOCS, PICTURE

log = logging.getLogger(__name__)


def make(app: Any) -> None:
    """Before any page is read: make what they show."""
    del app
    for sentence in make_page_pictures(log.info):
        log.warning(sentence)


def show_made(app: Any, name: str, content: list[str]) -> None:
    """Point a picture that is not beside its page to the one that its blocks made."""
    page = Path(app.env.doc2path(name))
    if page.suffix != ".md":
        return
    made = "/" + place(page).relative_to(DOCS).as_posix() + "/"

    def shown(match: Any) -> str:
        beside = (page.parent / match[2]).exists()
        return match[0] if beside else f"{match[1]}{made}{match[2]}{match[3]}"

    content[0] = PICTURE.sub(shown, content[0])


def setup(app: Any) -> dict[str, bool]:
    """Connect the above."""
    MADE.mkdir(exist_ok=True)
    app.connect("builder-inited", make)
    app.connect("source-read", show_made)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
