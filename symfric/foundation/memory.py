"""Bounded, thread-safe cache."""

from collections.abc import Hashable
from threading import Lock
from typing import TypeVar

T = TypeVar("T")
_LOCK = Lock()


def remember(known: dict[Hashable, T], key: Hashable, made: T, most: int) -> T:
    """Store `made` in `known` unless `key` is present, and return the stored object.

    If `known` has `most` entries, the oldest entry is removed.
    """
    with _LOCK:
        if key not in known and len(known) >= most:
            del known[next(iter(known))]
        return known.setdefault(key, made)
