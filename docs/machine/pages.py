"""Blocks of code in a page: run them and compare their output with the page.

The `python` and `console` blocks of a page run one after the other, in one namespace and one empty
folder. A `text` block directly after Python is its output. A `console` block has lines
`$ symfric ...`, each followed by its output. In outputs, `...` stands for any text. Blocks of other
languages (`bash`, `c`, `yaml`, ...) are only displayed.

`python -m docs.machine.pages PAGE FOLDER` runs a page in a folder and prints all differences.
"""

import ast
import os
import re
import shlex
import subprocess
import sys
import traceback
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import final

DOCS = Path(__file__).resolve().parents[1]
ROOT = DOCS.parent
FENCE = re.compile(
    r"^(?P<fence>```+)(?P<language>[\w-]+)[ \t]*\n(?P<body>.*?)^(?P=fence)[ \t]*$", re.M | re.S
)
PICTURE = re.compile(r"(!\[[^\]]*\]\()([\w-]+\.(?:png|svg|gif))(\))")


@final
@dataclass(frozen=True)
class Block:
    """Block of code of a page.

    Attributes:
        language: language behind the fence.
        body: code.
        line: first line in the page.
        prints: `text` block directly behind, None if there is none.
    """

    language: str
    body: str
    line: int
    prints: str | None = None


def blocks(text: str) -> list[Block]:
    """Return the blocks of a page, each Python block with its output."""
    found: list[Block] = []
    end = 0
    for match in FENCE.finditer(text):
        between = text[end : match.start()]
        language, body = match["language"], match["body"]
        line = text.count("\n", 0, match.start()) + 1
        if language == "text" and found and found[-1].language == "python" and not between.strip():
            last = found.pop()
            found.append(Block(last.language, last.body, last.line, body))
        else:
            found.append(Block(language, body, line))
        end = match.end()
    return found


def written_pages() -> Iterator[Path]:
    """Yield every hand-written page, and the README."""
    yield ROOT / "README.md"
    for folder in (DOCS, *(DOCS / name for name in ("start", "tutorials", "howto", "theory"))):
        yield from sorted(p for p in folder.glob("*.md") if p != DOCS / "README.md")


def commands(block: Block) -> list[tuple[str, str]]:
    """Return the commands of a `console` block, each with its output."""
    parts = re.split(r"^\$ ", block.body, flags=re.M)
    if parts[0].strip():
        raise ValueError(f"line {block.line}: expected a command behind '$ ' first")
    found: list[tuple[str, str]] = []
    for part in parts[1:]:
        command, _, printed = part.replace("\\\n", " ").partition("\n")
        found.append((command, printed))
    return found


def agrees(printed: str, expected: str) -> bool:
    """Return True if `printed` is the text of a page, where `...` stands for any text."""
    wanted = [re.escape(part) for part in plain(expected).split("...")]
    return re.fullmatch(".*".join(wanted), plain(printed), re.S) is not None


def plain(text: str) -> str:
    """Remove blanks at the ends of lines and of the text."""
    return "\n".join(line.rstrip() for line in text.strip().splitlines())


def made_pictures(text: str, folder: Path) -> list[str]:
    """Return the names of pictures that blocks of the page in `folder` write."""
    return [name for _, name, _ in PICTURE.findall(text) if not (folder / name).exists()]


def run(
    page: Iterable[Block],
    name: str,
    changed: ast.NodeTransformer | None = None,
    known: Mapping[str, object] | None = None,
) -> Iterator[tuple[str, str, str]]:
    """Run the blocks of a page; yield each piece of code with its output and that of the page.

    The output on the page is "" if it is missing; then Python must print nothing.

    Args:
        page: blocks of the page.
        name: name of the page, in tracebacks.
        changed: transformation of its Python before it runs.
        known: names that its Python finds.
    """
    names: dict[str, object] = {"__name__": "__main__", **(known or {})}
    for block in page:
        if block.language == "python":
            printed = StringIO()
            tree = ast.parse("\n" * block.line + block.body, name)
            if changed is not None:
                tree = ast.fix_missing_locations(changed.visit(tree))
            code = compile(tree, name, "exec")
            with redirect_stdout(printed):
                exec(code, names)
            yield block.body, printed.getvalue(), block.prints or ""
        elif block.language == "console":
            for command, expected in commands(block):
                yield command, output(command), expected or "..."


def output(command: str) -> str:
    """Return the output of a command: `symfric` runs in this process, others in a shell."""
    if not command.startswith("symfric ") or set(command) & set("|><&;*`"):
        return in_shell(command)
    from symfric.cli.app import main as symfric  # noqa: PLC0415  (for pages that are run only)

    printed = StringIO()
    with redirect_stdout(printed), redirect_stderr(printed), warnings.catch_warnings():
        warnings.simplefilter("default")
        symfric(shlex.split(command)[1:])
    return printed.getvalue()


def in_shell(command: str) -> str:
    """Run in a shell in which `python` and `symfric` are those of this process."""
    python = shlex.quote(sys.executable)
    tools = f'python() {{ {python} "$@"; }}; symfric() {{ {python} -m symfric "$@"; }}; '
    path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        ["bash", "-c", tools + command],
        env=os.environ | {"PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return done.stdout


def differences(page: Path) -> Iterator[str]:
    """Run a page in the current folder; yield a text for each output that differs."""
    for code, printed, expected in run(blocks(page.read_text("utf-8")), str(page)):
        if not agrees(printed, expected):
            yield f"{code}\nprints\n{printed}\ninstead of\n{expected}"


def main(page: Path, folder: Path) -> int:
    """Run `page` in `folder`, which keeps its pictures; return 0 if all outputs agree."""
    page, wrong = page.resolve(), 0
    os.chdir(folder)
    warnings.simplefilter("error")
    try:
        for wrong, difference in enumerate(differences(page), start=1):  # noqa: B007
            print(difference, file=sys.stderr)
    except Exception:  # noqa: BLE001  (any error of a page, with its line)
        traceback.print_exc()
        return 1
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
