"""Comments and long lines of C."""

from collections.abc import Sequence
from importlib.metadata import version
from textwrap import wrap

from symfric.codegen.blocks.block import Block

WIDTH = 100


def banner(block: Block, file: str) -> list[str]:
    """First lines of a file: who made it, and whose it is."""
    return [
        f"{file}: C99 made by symfric {version('symfric')} with CasADi {version('casadi')}, "
        f"model {block.fingerprint}.",
        "This generated code is yours. SPDX-License-Identifier: MIT-0",
    ]


def block_comment(lines: Sequence[str]) -> str:
    """Lines of text as one comment."""
    return "/* " + "\n".join(f" * {comment(line)}".rstrip() for line in lines)[3:] + "\n */"


def comment(text: str) -> str:
    """Text that cannot end the comment it stands in."""
    return text.replace("*/", "* /").replace("/*", "/ *")


def folded(line: str, margin: str) -> str:
    """A long line broken at blanks, further in than it begins."""
    margin += " " * (len(line) - len(line.lstrip(" ")))
    return "\n".join(
        wrap(
            line.lstrip(" "),
            WIDTH,
            initial_indent=margin,
            subsequent_indent=margin + "    ",
            break_long_words=False,
            break_on_hyphens=False,
        )
    )
