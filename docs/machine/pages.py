"""Blocks of code in a page: what runs, what it prints, and which pictures it leaves.

A page is text with fenced blocks. Its `python` and `console` blocks run one after the other, in
one namespace and one empty folder. A `text` block right behind Python is what that prints. A
`console` block holds lines `$ symfric ...`, each followed by what it prints. In what is printed
`...` stands for anything. Blocks of other languages (`bash`, `c`, `yaml`, ...) are only shown.

`<!-- test: heavy -->` in a page says that it runs for more than some seconds.

`python -m docs.machine.pages PAGE FOLDER` runs the blocks of a page in a folder.
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
MARK = re.compile(r"^<!-- test: (\w+) -->$", re.M)
PICTURE = re.compile(r"(!\[[^\]]*\]\()([\w-]+\.(?:png|svg|gif))(\))")


@final
@dataclass(frozen=True)
class Block:
    """One block of code of a page.

    Attributes:
        language: what stands behind the fence.
        body: the code.
        line: where it begins in the page.
        prints: the `text` block right behind, None where there is none.
    """

    language: str
    body: str
    line: int
    prints: str | None = None


def blocks(text: str) -> list[Block]:
    """The blocks of a page; output stands with the block that prints it."""
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
    """Every hand-written page, and the README."""
    yield ROOT / "README.md"
    for folder in (DOCS, *(DOCS / name for name in ("start", "tutorials", "howto", "theory"))):
        yield from sorted(p for p in folder.glob("*.md") if p != DOCS / "README.md")


def mark(text: str) -> str:
    """The mark of a page for its tests, "" for none."""
    found = MARK.search(text)
    return found[1] if found else ""


def commands(block: Block) -> list[tuple[str, str]]:
    """The lines behind `$` of a `console` block, each with what it prints."""
    parts = re.split(r"^\$ ", block.body, flags=re.M)
    if parts[0].strip():
        raise ValueError(f"line {block.line}: expected a command behind '$ ' first")
    found: list[tuple[str, str]] = []
    for part in parts[1:]:
        command, _, printed = part.replace("\\\n", " ").partition("\n")
        found.append((command, printed))
    return found


def agrees(printed: str, expected: str) -> bool:
    """True if `printed` is the text of a page, where `...` stands for anything."""
    wanted = [re.escape(part) for part in plain(expected).split("...")]
    return re.fullmatch(".*".join(wanted), plain(printed), re.S) is not None


def plain(text: str) -> str:
    """Without blanks at the ends of lines and of the text."""
    return "\n".join(line.rstrip() for line in text.strip().splitlines())


def made_pictures(text: str, folder: Path) -> list[str]:
    """Names of the pictures that blocks of the page in `folder` leave, not those next to it."""
    return [name for _, name, _ in PICTURE.findall(text) if not (folder / name).exists()]


def run(
    page: Iterable[Block],
    name: str,
    changed: ast.NodeTransformer | None = None,
    known: Mapping[str, object] | None = None,
) -> Iterator[tuple[str, str, str]]:
    """Run the blocks of a page; each piece of code with what it printed and what the page says.

    Code that the page gives no output for has "" there, and prints nothing if it is Python.

    Args:
        page: its blocks.
        name: of the page, in tracebacks.
        changed: what is done to its Python before it runs; as it is by default.
        known: names that its Python finds there.
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
    """Output of a line of a console: `symfric` runs in this process, all else in a shell."""
    if not command.startswith("symfric ") or set(command) & set("|><&;*`"):
        return in_shell(command)
    from symfric.cli.app import main as symfric  # noqa: PLC0415  (of pages that are run only)

    printed = StringIO()
    with redirect_stdout(printed), redirect_stderr(printed), warnings.catch_warnings():
        warnings.simplefilter("default")
        symfric(shlex.split(command)[1:])
    return printed.getvalue()


def in_shell(command: str) -> str:
    """Run in a shell that knows `python` and `symfric` as the ones that run here."""
    python = shlex.quote(sys.executable)
    tools = f'python() {{ {python} "$@"; }}; symfric() {{ {python} -m symfric "$@"; }}; '
    done = subprocess.run(
        ["bash", "-c", tools + command],
        env=os.environ
        | {"PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return done.stdout


def main(page: Path, folder: Path) -> int:
    """Run `page` in `folder` for the pictures that it leaves there; 0 when it went well."""
    page = page.resolve()
    os.chdir(folder)
    try:
        for _ in run(blocks(page.read_text("utf-8")), str(page)):
            pass
    except Exception:  # noqa: BLE001  (whatever a page may raise, said with its line)
        traceback.print_exc()
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
