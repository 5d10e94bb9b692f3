"""Opens built pages in headless Chromium: `python -m docs.machine.browser out/docs`.

Each page is shown narrow, on a tablet, wide, dark and in print, and refused for what `look.js`
finds (wider than the screen, cut, unreadable, without a text for those who do not see it), for an
error on its console and for anything it asks of the network. The search must find something.
`--shots FOLDER` keeps a picture of each page in each of these; names behind it choose pages.
"""

import base64
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from time import monotonic
from typing import Any, final

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
PATIENCE = 60.0
"""Time [s] without a word after which the browser is taken for gone."""


@final
class Browser:
    """A headless browser with one tab.

    Raises:
        RuntimeError: it does not start, has gone or says nothing for a minute.
    """

    def __init__(self, program: str) -> None:
        self.profile = tempfile.mkdtemp(prefix="symfric-docs-")
        to_read, self.to = os.pipe()
        self.come, from_write = os.pipe()
        os.set_inheritable(to_read, True)
        os.set_inheritable(from_write, True)
        self.process = subprocess.Popen(
            ["bash", "-c", f'exec "$0" "$@" 3<&{to_read} 4>&{from_write}', program,
             "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe",
             f"--user-data-dir={self.profile}", "--no-first-run", "--hide-scrollbars"],
            pass_fds=(to_read, from_write), stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(to_read)
        os.close(from_write)
        self.kept = b""
        self.number = 0
        self.events: list[dict[str, Any]] = []
        self.session = ""
        try:
            target = self.ask("Target.createTarget", url="about:blank")["targetId"]
            found = self.ask("Target.attachToTarget", targetId=target, flatten=True)
            self.session = found["sessionId"]
            for domain in ("Page", "Runtime", "Log", "Network"):
                self.ask(f"{domain}.enable")
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the browser and forget its profile."""
        os.close(self.to)
        self.process.terminate()
        self.process.wait(20)
        os.close(self.come)
        shutil.rmtree(self.profile, ignore_errors=True)

    def ask(self, method: str, **arguments: Any) -> dict[str, Any]:
        """Send a command and wait for its answer; what happens meanwhile is kept in `events`."""
        self.number += 1
        message: dict[str, Any] = {"id": self.number, "method": method, "params": arguments}
        if self.session:
            message["sessionId"] = self.session
        try:
            os.write(self.to, json.dumps(message).encode() + b"\0")
        except BrokenPipeError:
            raise RuntimeError("the browser has gone") from None
        while True:
            answer = self.hear()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self.events.append(answer)

    def hear(self) -> dict[str, Any]:
        """The next message of the browser."""
        while b"\0" not in self.kept:
            if not select.select([self.come], [], [], PATIENCE)[0]:
                raise RuntimeError(f"the browser says nothing for {PATIENCE:.0f} s")
            piece = os.read(self.come, 1 << 16)
            if not piece:
                raise RuntimeError("the browser has gone")
            self.kept += piece
        first, _, self.kept = self.kept.partition(b"\0")
        return json.loads(first)

    def show(self, width: int, dark: bool = False, as_print: bool = False) -> None:
        """Set how pages are shown from now on."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=900, deviceScaleFactor=1, mobile=width < 600,
        )  # fmt: skip
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        still = {"name": "prefers-reduced-motion", "value": "reduce"}
        media = "print" if as_print else "screen"
        self.ask("Emulation.setEmulatedMedia", media=media, features=[scheme, still])

    def open(self, address: str) -> None:
        """Load a page; what happens meanwhile is in `events`."""
        self.events.clear()
        self.ask("Page.navigate", url=address)
        while not any(e.get("method") == "Page.loadEventFired" for e in self.events):
            self.events.append(self.hear())

    def value(self, expression: str) -> Any:
        """The value of a piece of JavaScript, once it is there."""
        seen = self.ask(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in seen:
            told = seen["exceptionDetails"].get("exception", {}).get("description", "")
            raise RuntimeError(f"JavaScript: {told}")
        return seen["result"].get("value")

    def shot(self, width: int, path: Path, most: int = 12000) -> None:
        """A picture of the whole page, down to `most` pixels."""
        height = min(int(self.value("document.documentElement.scrollHeight")), most)
        clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
        data = self.ask("Page.captureScreenshot", clip=clip, captureBeyondViewport=True)["data"]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(base64.b64decode(data))


LOOK = Path(__file__).with_name("look.js").read_text("utf-8")
QUIET = ("search.html", "genindex.html", "py-modindex.html")
"""Pages that are nearly empty until the user interacts."""
SOUGHT = "stribeck"
"""Word that the search must find."""


@final
@dataclass(frozen=True)
class Kind:
    """A way to show a page.

    Attributes:
        width: of the screen [px].
        dark: for those whose system is dark.
        print: as on paper, where nothing scrolls.
        structure: whether what does not depend on any of these is looked at, too.
    """

    width: int
    dark: bool = False
    print: bool = False
    structure: bool = False


KINDS = {
    "wide": Kind(1400, structure=True),
    "wide dark": Kind(1400, dark=True),
    "tablet": Kind(768),
    "narrow": Kind(390),
    "narrow dark": Kind(390, dark=True),
    "print": Kind(720, print=True),
}


def said(event: dict[str, Any]) -> str:
    """The problem of a page that an event reports, "" for none."""
    method, what = event.get("method", ""), event.get("params", {})
    if method == "Runtime.exceptionThrown":
        return f"exception: {what['exceptionDetails'].get('exception', {}).get('description', '')}"
    if method == "Runtime.consoleAPICalled" and what["type"] in ("error", "assert", "warning"):
        words = " ".join(str(a.get("value", a.get("description", ""))) for a in what["args"])
        return f"console {what['type']}: {words}"
    if method == "Log.entryAdded" and what["entry"]["level"] in ("error", "warning"):
        return f"console {what['entry']['level']}: {what['entry']['text']}"
    if method == "Network.requestWillBeSent":
        address = what["request"]["url"]
        return "" if address.startswith(("file:", "data:")) else f"asks the network for {address}"
    if method == "Network.loadingFailed" and not what.get("canceled"):
        return f"cannot load: {what.get('errorText', '')}"
    return ""


def problems(
    browser: Browser, folder: Path, pages: Sequence[Path], shots: Path | None
) -> Iterator[str]:
    """A sentence about everything that is wrong with a page."""
    first = next(iter(KINDS.values()))
    for path in pages:
        name = path.relative_to(folder)
        browser.show(first.width, first.dark, first.print)
        browser.open(path.as_uri())
        for label, kind in KINDS.items():
            browser.show(kind.width, kind.dark, kind.print)
            how = json.dumps(asdict(kind) | {"quiet": name.name in QUIET})
            for sentence in browser.value(f"({LOOK})({how})"):
                yield f"{name} ({label}): {sentence}"
            if shots is not None:
                browser.shot(kind.width, shots / label.replace(" ", "_") / name.with_suffix(".png"))
        yield from (f"{name}: {told}" for e in browser.events if (told := said(e)))


def searched(browser: Browser, folder: Path, patience: float = 20.0) -> Iterator[str]:
    """Problems of the search, which runs in the browser alone."""
    page = folder / "search.html"
    if not page.exists():
        return
    browser.show(1400)
    browser.open(f"{page.as_uri()}?q={SOUGHT}")
    until = monotonic() + patience
    count = "document.querySelectorAll('#search-results li').length"
    while not browser.value(count) and monotonic() < until:
        browser.value("new Promise(done => setTimeout(done, 100))")
    if not browser.value(count):
        yield f"search.html: nothing found for '{SOUGHT}'"
    browser.value("new Promise(done => setTimeout(done, 500))")
    yield from (f"search.html ({SOUGHT}): {told}" for e in browser.events if (told := said(e)))


def main(folder: Path, shots: Path | None = None, only: Sequence[str] = ()) -> int:
    """Print every problem; 0 if there is none, or no browser.

    Args:
        folder: of the built pages.
        shots: where a picture of each page is kept.
        only: parts of names of pages; all where there is none.
    """
    program = next((found for name in NAMES if (found := shutil.which(name))), None)
    if program is None:
        print(f"browser: none of {', '.join(NAMES)} is installed, NO page was opened")
        return 0
    folder = folder.resolve()
    every = sorted(folder.rglob("*.html"))
    pages = [
        p for p in every if not only or any(o in p.relative_to(folder).as_posix() for o in only)
    ]
    if not pages:
        print(f"browser: no pages in {folder}; run make docs first")
        return 1
    try:
        browser = Browser(program)
    except (OSError, RuntimeError) as error:
        print(f"browser: {program} does not start here, NO page was opened: {error}")
        return 1
    found = 0
    try:
        for sentence in chain(problems(browser, folder, pages, shots), searched(browser, folder)):
            found += 1
            print(f"browser: {sentence}", flush=True)
    finally:
        browser.close()
    print(f"browser: {len(pages)} pages, each {', '.join(KINDS)}: {found} problems")
    return bool(found)


if __name__ == "__main__":
    keep = Path(sys.argv[3]) if sys.argv[2:3] == ["--shots"] else None
    sys.exit(main(Path(sys.argv[1]), keep, sys.argv[4:]))
