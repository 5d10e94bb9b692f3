"""What was made before, kept for the next call that needs it, and not more than a number of it."""

from collections.abc import Hashable
from threading import Lock
from typing import TypeVar

T = TypeVar("T")
_LOCK = Lock()


def remember(known: dict[Hashable, T], key: Hashable, made: T, most: int) -> T:
    """Keep `made` in `known`, unless another thread was first; what is kept.

    Of `most` things the oldest goes when there is another one.
    """
    with _LOCK:
        if key not in known and len(known) >= most:
            del known[next(iter(known))]
        return known.setdefault(key, made)
