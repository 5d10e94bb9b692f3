"""Open built pages in headless Chromium: `python -m docs.machine.browser out/docs`.

Each page is shown narrow, on a tablet, wide, dark and in print. It is rejected for the findings of
`look.js` (wider than the screen, cut, unreadable, pictures without text), for errors on its console
and for requests to the network. The search must find something. `--shots FOLDER` saves a picture of
each page in each of these; further arguments select pages by parts of their names.
"""

import argparse
import shutil
import sys
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
LOOK = Path(__file__).with_name("look.js").read_text("utf-8")
QUIET = ("search.html", "genindex.html", "py-modindex.html")
"""Pages that are nearly empty until the user interacts."""
SOUGHT = "stribeck"
"""Word that the search must find."""
KINDS: dict[str, dict[str, Any]] = {
    "wide": {"width": 1400, "dark": False, "print": False, "structure": True},
    "wide dark": {"width": 1400, "dark": True, "print": False, "structure": False},
    "tablet": {"width": 768, "dark": False, "print": False, "structure": False},
    "narrow": {"width": 390, "dark": False, "print": False, "structure": False},
    "narrow dark": {"width": 390, "dark": True, "print": False, "structure": False},
    "print": {"width": 720, "dark": False, "print": True, "structure": False},
}
"""Kind of display -> width [px], dark mode, print, and True to check what does not depend on it."""


def listened(page: Any) -> list[str]:
    """Return a list to which errors and requests of `page` are appended."""
    found: list[str] = []
    page.on("pageerror", lambda error: found.append(f"exception: {error}"))

    def console(message: Any) -> None:
        if message.type in ("error", "assert", "warning"):
            found.append(f"console {message.type}: {message.text}")

    def request(one: Any) -> None:
        if not one.url.startswith(("file:", "data:")):
            found.append(f"requests {one.url} from the network")

    page.on("console", console)
    page.on("request", request)
    page.on("requestfailed", lambda one: found.append(f"cannot load {one.url}: {one.failure}"))
    return found


def show(page: Any, kind: dict[str, Any]) -> None:
    """Set how pages are displayed."""
    page.set_viewport_size({"width": kind["width"], "height": 900})
    page.emulate_media(
        media="print" if kind["print"] else "screen", reduced_motion="reduce",
        color_scheme="dark" if kind["dark"] else "light",
    )  # fmt: skip


def problems(
    page: Any, folder: Path, paths: Sequence[Path], shots: Path | None = None
) -> Iterator[str]:
    """Yield a text for each problem of the pages at `paths` in `folder`."""
    errors = listened(page)
    for path in paths:
        name = path.relative_to(folder)
        errors.clear()
        show(page, KINDS["wide"])
        page.goto(path.as_uri())
        for label, kind in KINDS.items():
            show(page, kind)
            for sentence in page.evaluate(LOOK, kind | {"quiet": name.name in QUIET}):
                yield f"{name} ({label}): {sentence}"
            if shots is not None:
                to = shots / label.replace(" ", "_") / name.with_suffix(".png")
                page.screenshot(path=to, full_page=True)
        yield from (f"{name}: {error}" for error in errors)


def searched(page: Any, folder: Path, patience: float = 20.0) -> Iterator[str]:
    """Yield problems of the search, which runs in the browser."""
    from playwright.sync_api import TimeoutError as Late  # noqa: PLC0415  (with a browser only)

    if not (folder / "search.html").exists():
        return
    errors = listened(page)
    page.goto(f"{(folder / 'search.html').as_uri()}?q={SOUGHT}")
    try:
        page.wait_for_selector("#search-results li", timeout=1e3 * patience)
        page.wait_for_timeout(500)
    except Late:
        yield f"search.html: nothing found for '{SOUGHT}'"
    yield from (f"search.html ({SOUGHT}): {error}" for error in errors)


def main(folder: Path, shots: Path | None = None, only: Sequence[str] = ()) -> int:
    """Print every problem; return 0 if there is none, or no browser."""
    program = next((found for name in NAMES if (found := shutil.which(name))), None)
    if program is None:
        print(f"browser: none of {', '.join(NAMES)} is installed, NO page was opened")
        return 0
    from playwright.sync_api import Error, sync_playwright  # noqa: PLC0415  (with a browser only)

    folder = folder.resolve()
    names = [path for path in sorted(folder.rglob("*.html"))]
    paths = [p for p in names if not only or any(o in str(p.relative_to(folder)) for o in only)]
    if not paths:
        print(f"browser: no pages in {folder}; run make docs first")
        return 1
    found = 0
    with sync_playwright() as playwright:
        try:
            page = playwright.chromium.launch(executable_path=program).new_page()
        except Error as error:
            print(f"browser: {program} does not start here, NO page was opened: {error}")
            return 1
        for sentence in chain(problems(page, folder, paths, shots), searched(page, folder)):
            found += 1
            print(f"browser: {sentence}", flush=True)
    print(f"browser: {len(paths)} pages, each {', '.join(KINDS)}: {found} problems")
    return bool(found)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--shots", type=Path)
    parser.add_argument("only", nargs="*")
    given = parser.parse_args()
    sys.exit(main(given.folder, given.shots, given.only))
