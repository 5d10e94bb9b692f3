"""Where the recursions over a long chain are cut, so that its derivatives stay sparse.

Written out, the balance of every link depends on the coordinates of all others, and its derivatives
fill a matrix. With a symbol for what a body passes on (its orientation, its velocities and
accelerations outwards, its wrench inwards), every equation knows its neighbours only, and
eliminating link by link, from the tips to the ground, takes a number of operations that grows with
the links alone: what the articulated-body algorithm does for accelerations, here for all unknowns
of an implicit step.
"""

from typing import final

import casadi as ca
import numpy as np


@final
class Cuts:
    """Collects symbols l and their values in the order of the recursions; mutable.

    Attributes:
        symbols: l, shape (k, 1).
        values: of l, each in terms of coordinates and of l before it.
        links: the link that each of l belongs to.
    """

    def __init__(self) -> None:
        self.symbols, self.values = ca.SX(0, 1), ca.SX(0, 1)
        self.links: list[int] = []

    def __call__(self, link: int, expression: ca.SX) -> ca.SX:
        """`expression` with a symbol for every entry that is more than a number or a symbol."""
        cut = ca.SX(expression)
        for k in range(cut.nnz()):
            value = ca.SX(cut.nz[k])
            if not (value.is_constant() or value.is_symbolic()):
                symbol = ca.SX.sym(f"l_{len(self.links)}")
                self.symbols = ca.vertcat(self.symbols, symbol)
                self.values = ca.vertcat(self.values, value)
                self.links.append(link)
                cut.nz[k] = symbol
        return cut

    def needed(self, expression: ca.SX) -> list[int]:
        """Numbers of those l that `expression` depends on, directly or through others."""
        found = np.zeros(len(self.links), dtype=bool)
        found[ca.jacobian_sparsity(expression, self.symbols).get_triplet()[1]] = True
        own = ca.jacobian_sparsity(self.values, self.symbols)
        rows, columns = (np.array(part, dtype=int) for part in own.get_triplet())
        for k in range(found.size - 1, -1, -1):
            if found[k]:
                found[columns[rows == k]] = True
        return [int(k) for k in np.flatnonzero(found)]
