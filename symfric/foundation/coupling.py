"""Groups of equations and unknowns that do not touch each other."""

import numpy as np
from numpy.typing import NDArray


def coupled(pattern: NDArray[np.bool_]) -> list[tuple[list[int], list[int]]]:
    """(columns, rows) of each group of rows that share columns.

    Args:
        pattern: which column each row depends on, shape (rows, columns).
    """
    left, found = set(range(pattern.shape[0])), list[tuple[list[int], list[int]]]()
    while left:
        rows, columns = {left.pop()}, set[int]()
        while True:
            columns |= {int(k) for row in rows for k in np.flatnonzero(pattern[row])}
            more = {row for row in left if pattern[row][sorted(columns)].any()}
            if not more:
                break
            rows |= more
            left -= more
        found.append((sorted(columns), sorted(rows)))
    return found
