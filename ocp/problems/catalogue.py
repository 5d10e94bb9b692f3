"""All ready problems."""

from ocp.problems.friction import FRICTION
from ocp.problems.others import OTHERS
from ocp.problems.ready import Ready

READY: dict[str, Ready] = {one.name: one for one in (*FRICTION, *OTHERS)}
"""Name -> problem."""
