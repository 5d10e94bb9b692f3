"""A headless Chromium, spoken to in its DevTools protocol through two pipes."""

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
from pathlib import Path
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
        """How pages are shown from now on."""
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
        """What a piece of JavaScript gives, once it is there."""
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
