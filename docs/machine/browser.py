"""Opens built pages in headless Chromium: `python -m docs.machine.browser out/docs`.

Each page is opened narrow and wide, and refused for an error on its console, for anything it asks
of the network, for a picture that does not show, for a formula without extent, and for being wider
than the screen. The browser is spoken to in its DevTools protocol through two pipes; `--shots
FOLDER` keeps a picture of each page.
"""

import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, final

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
WIDTHS = {"narrow": 390, "wide": 1400}
LOOK = """(() => {
  const wide = document.documentElement.scrollWidth - window.innerWidth;
  const broken = [...document.images].filter(i => i.complete && !i.naturalWidth).map(i => i.src);
  const flat = [...document.querySelectorAll('math')].filter(
    m => m.checkVisibility() && m.getBoundingClientRect().height < 4).length;
  const words = document.querySelector('article')?.innerText.length ?? 0;
  return {wide, broken, flat, words, height: document.documentElement.scrollHeight};
})()"""
"""What is wrong with a page as it is shown."""
QUIET = ("search.html", "genindex.html", "py-modindex.html")
"""Pages that are nearly empty before somebody asks."""


@final
class Browser:
    """A headless browser with one tab."""

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
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

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
        os.write(self.to, json.dumps(message).encode() + b"\0")
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
            piece = os.read(self.come, 1 << 16)
            if not piece:
                raise RuntimeError("the browser has gone")
            self.kept += piece
        first, _, self.kept = self.kept.partition(b"\0")
        return json.loads(first)

    def open(self, address: str, width: int) -> dict[str, Any]:
        """Show a page; what `LOOK` says of it once it is loaded."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=900, deviceScaleFactor=1, mobile=width < 600,
        )  # fmt: skip
        self.events.clear()
        self.ask("Page.navigate", url=address)
        while not any(e.get("method") == "Page.loadEventFired" for e in self.events):
            self.events.append(self.hear())
        seen = self.ask("Runtime.evaluate", expression=LOOK, returnByValue=True)
        return seen["result"]["value"]

    def shot(self, width: int, height: int, path: Path) -> None:
        """A picture of the whole page."""
        height = min(height, 12000)
        clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
        data = self.ask("Page.captureScreenshot", clip=clip, captureBeyondViewport=True)["data"]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(base64.b64decode(data))


def said(event: dict[str, Any]) -> str:
    """What an event says against a page, "" for nothing."""
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


def problems(browser: Browser, folder: Path, shots: Path | None) -> Iterator[str]:
    """A sentence about everything that is wrong with a page."""
    for path in sorted(folder.rglob("*.html")):
        name = path.relative_to(folder)
        for kind, width in WIDTHS.items():
            seen = browser.open(path.as_uri(), width)
            told = [said(event) for event in browser.events]
            told += [f"picture does not show: {source}" for source in seen["broken"]]
            if seen["wide"] > 1:
                told.append(f"{seen['wide']} px wider than the screen")
            if seen["flat"]:
                told.append(f"{seen['flat']} formulas without extent")
            if seen["words"] < 40 and name.name not in QUIET:
                told.append("hardly a word on it")
            yield from (f"{name} ({kind}): {sentence}" for sentence in told if sentence)
            if shots is not None:
                shot = shots / kind / name.with_suffix(".png")
                browser.shot(width, int(seen["height"]), shot)


def main(folder: Path, shots: Path | None = None) -> int:
    """Print every problem; 0 if there is none, or no browser."""
    program = next((found for name in NAMES if (found := shutil.which(name))), None)
    if program is None:
        print(f"browser: none of {', '.join(NAMES)} is installed, no page opened")
        return 0
    folder = folder.resolve()
    browser = Browser(program)
    try:
        found = [*problems(browser, folder, shots)]
    finally:
        browser.close()
    for sentence in found:
        print(f"browser: {sentence}")
    pages = len([*folder.rglob("*.html")])
    widths = " and ".join(f"{width} px" for width in WIDTHS.values())
    print(f"browser: {pages} pages at {widths}, {len(found)} problems")
    return bool(found)


if __name__ == "__main__":
    keep = Path(sys.argv[3]) if sys.argv[2:3] == ["--shots"] else None
    sys.exit(main(Path(sys.argv[1]), keep))
