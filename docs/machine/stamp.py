"""What a picture depends on, as one hash: code without docstrings and comments, and more."""

import ast
import hashlib
import os
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from docs.machine.pages import ROOT

PACKAGES = ("symfric", "ocp", "identification")
ASIDE = ("cli", "stress", "bench", "gallery", "embedded", "fmu")
"""Rooms that pictures of laws, scenes and pages do not come from."""


@cache
def code_of(path: Path) -> str:
    """A Python file as its syntax tree, without docstrings, comments and places."""
    tree = ast.parse(path.read_text("utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            kept = [e for e in body if not _is_text(e)]
            node.body = kept or [ast.Pass()]  # pyright: ignore[reportAttributeAccessIssue]
    return ast.dump(tree)


def _is_text(statement: object) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


@cache
def code_hash() -> str:
    """Of all code that pictures come from, less the rooms that stand aside."""
    files = [p for name in PACKAGES for p in sorted((ROOT / name).rglob("*.py"))]
    kept = [p for p in files if p.relative_to(ROOT).parts[1] not in ASIDE]
    return digest(f"{p.relative_to(ROOT)} {code_of(p)}" for p in kept)


def digest(texts: Iterable[str]) -> str:
    """One short hash of several texts."""
    found = hashlib.sha256()
    for text in texts:
        found.update(text.encode())
        found.update(b"\0")
    return found.hexdigest()[:20]


def is_fresh(folder: Path, key: str) -> bool:
    """Whether `folder` was made with `key`, or was made at all where what is there is kept."""
    stamp = folder / ".key"
    return stamp.is_file() and (kept() or stamp.read_text() == key)


def kept() -> bool:
    """Whether SYMFRIC_DOCS=keep: pictures stay as they are, for those who write text."""
    return os.environ.get("SYMFRIC_DOCS", "") == "keep"


def stamped(folder: Path, key: str) -> None:
    """Remember that `folder` was made with `key`, once everything in it is there."""
    (folder / ".key").write_text(key)
