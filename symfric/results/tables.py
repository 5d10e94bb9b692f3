"""Packages for tables that may be missing."""

from importlib import import_module
from typing import Any


def module(where: str, name: str) -> Any:
    """A package that may be missing.

    Raises:
        ImportError: it is, and what to do.
    """
    try:
        return import_module(name)
    except ImportError:
        raise ImportError(
            f"{where}: expected the package {name}, got none; install it by 'pip install {name}', "
            "or take to_csv, which needs nothing"
        ) from None
