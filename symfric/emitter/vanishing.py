"""Constants that a floating point type does not hold."""

from dataclasses import replace

import numpy as np

from symfric.emitter.c99 import Real
from symfric.foundation.graph import Graph, Node

LEAST = float(np.finfo(np.float32).tiny)
"""What keeps a divisor from zero in single precision where in double a smaller number does."""


def representable(whole: Graph, real: Real) -> Graph:
    """Constants that vanish in single precision as the smallest ones that do not.

    What a robot's file holds as 1e-67 instead of 0 is no reason to refuse it, and what divides must
    not become 0.
    """

    def one(node: Node) -> Node:
        if not 0.0 < abs(node.value) < LEAST:
            return node
        return replace(node, value=float(np.copysign(LEAST, node.value)))

    return whole if real.size == 8 else Graph(tuple(map(one, whole.nodes)), whole.results)
